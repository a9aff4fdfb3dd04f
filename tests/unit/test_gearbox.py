"""Gearbox definitions: what is read, where it comes from, and what each fault of a file is called."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from models.errors import InputError
from models.gearbox import Gearbox, known_gearboxes, load_gearbox, read_gearbox
from models.quantity import UNITS, unit_of
from models.toml_file import packaged, read_text

FZG = read_text(packaged("gearboxes", "fzg"))


def edited(*changes: tuple[str, str]) -> str:
    """Return the FZG file with texts exchanged (their first occurrence)."""
    text = FZG
    for old, new in changes:
        assert old in text, f"the FZG file has no {old!r}"
        text = text.replace(old, new, 1)
    return text


def faults(*changes: tuple[str, str]) -> list[str]:
    """Return the lines that refuse the edited FZG file."""
    with pytest.raises(InputError) as caught:
        read_gearbox(edited(*changes), file="fzg.toml")
    return str(caught.value).splitlines()


@pytest.fixture(scope="module")
def fzg() -> Gearbox:
    return load_gearbox("fzg")


# --- what is read ------------------------------------------------------------------------------------------------------


def test_the_fzg_rig_has_the_values_of_the_paper(fzg: Gearbox) -> None:
    stage, housing = fzg.stage[0], fzg.housing
    assert (stage.z, stage.module_mm, stage.center_distance_mm, stage.face_width_mm) == ((16, 24), 4.5, 91.5, 14.0)
    assert (stage.profile_shift, stage.roughness_Ra_um) == ((0.182, 0.172), (0.174, 0.157))
    assert fzg.oil.viscosity_points == ((40.0, 32.63), (100.0, 5.45))
    assert fzg.oil.density_kg_m3 == 876.8
    assert [(shaft.length_mm, shaft.diameter_mm) for shaft in fzg.shaft] == [(223.0, 24.0), (90.0, 55.0)]
    assert [seal.diameter_mm for seal in fzg.seal] == [24.0, 54.0]
    assert (housing.inside_area_m2, housing.outside_area_m2, housing.wall_thickness_m) == (0.149, 0.214, 0.024)
    assert {bearing.designation for bearing in fzg.bearing} == {"NU 406"}
    assert fzg.speed_ratio == {"shaft_1": 1.0, "shaft_2": pytest.approx(16 / 24)}


def test_si_attributes_are_the_keys_in_si(fzg: Gearbox) -> None:
    stage = fzg.stage[0]
    assert stage.module == pytest.approx(4.5e-3, rel=1e-15)
    assert stage.pressure_angle == pytest.approx(math.radians(20.0), rel=1e-15)
    assert stage.roughness_Ra == pytest.approx((0.174e-6, 0.157e-6), rel=1e-15)
    assert stage.tip_diameter is None
    assert stage.material.youngs_modulus == pytest.approx(206e9, rel=1e-15)
    assert fzg.shaft[0].length == pytest.approx(0.223, rel=1e-15)
    assert fzg.oil.volume == pytest.approx(0.9e-3, rel=1e-15)


@pytest.mark.parametrize(
    ("key", "symbol"),
    [("level_below_axis_mm", "mm"), ("nu_40_mm2_s", "mm2/s"), ("height_m", "m"), ("wall_thickness_m", "m"),
     ("specific_heat_J_kgK", "J/(kg K)"), ("heat_capacity_J_K", "J/K"), ("a2_Pa_per_K", "Pa/K"), ("b2_per_K", "1/K"),
     ("oil_heat_transfer_W_m2K", "W/(m2 K)"), ("conductivity_W_mK", "W/(m K)"), ("emissivity", "")],
)  # fmt: skip
def test_the_longest_ending_names_the_unit(key: str, symbol: str) -> None:
    assert unit_of(key).symbol == symbol


def test_every_slip_of_a_unit_is_invertible() -> None:
    for ending, unit in UNITS.items():
        for meant, convert in unit.slips.items():
            assert convert(1.0) != 1.0, f"{ending}: {meant} is the same unit"


def test_bearing_oil_level_follows_the_sump_unless_given(fzg: Gearbox) -> None:
    assert fzg.bearing[0].oil_level(19.0) == pytest.approx(17.0, rel=1e-15)  # 0.6 * 60 mm - 19 mm
    assert fzg.bearing[0].oil_level(50.0) == 0.0
    own = fzg.with_values({"bearing.0.oil_level_mm": 12.0})
    assert own.bearing[0].oil_level(19.0) == 12.0


def test_conveyor_differs_and_loads() -> None:
    conveyor = load_gearbox("conveyor")
    assert conveyor.stage[0].z == (21, 67)
    assert [part.name for part in conveyor.housing.part] == ["base", "body", "cover"]
    assert set(conveyor.factors) >= {"C_base", "C_body", "C_cover"}
    assert all(bearing.oil_level(conveyor.oil.level_below_axis_mm) == 0.0 for bearing in conveyor.bearing)
    assert conveyor.oil.pressure_viscosity == "roelands"  # the file overrides its named oil
    assert conveyor.hash != load_gearbox("fzg").hash


def test_bundled_names_and_files(tmp_path: Path, fzg: Gearbox) -> None:
    assert known_gearboxes() == ("conveyor", "fzg")
    path = tmp_path / "mine.toml"
    path.write_text(FZG, encoding="utf-8")
    assert load_gearbox(path).hash == load_gearbox(str(path)).hash == fzg.hash


@pytest.mark.parametrize(
    ("name", "message"),
    [("fgz", "there is no gearbox named 'fgz'; did you mean 'fzg'?"), ("nowhere.toml", "nowhere.toml: cannot be read"),
     ("fzg\0.toml", "cannot be read"), ("", "there is no gearbox named ''"), ("no/such/file.toml", "cannot be read")],
)  # fmt: skip
def test_unknown_names_and_files(name: str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        load_gearbox(name)


def test_a_file_that_is_not_text(tmp_path: Path) -> None:
    path = tmp_path / "binary.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="is not UTF-8 text"):
        load_gearbox(path)
    with pytest.raises(InputError, match="cannot be read"):
        load_gearbox(tmp_path)


# --- provenance --------------------------------------------------------------------------------------------------------

UNCERTAIN = (
    "ambient.temperature_degC", "ambient.air_speed_m_s", "oil.level_below_axis_mm", "oil.volume_l",
    "oil.viscosity_points.0.1", "oil.viscosity_points.1.1", "oil.density_kg_m3", "oil.thermal_expansion_1_K",
    "oil.modulus.a2_Pa_per_K", "oil.modulus.b2_per_K", "oil.limiting_shear_coefficient", "oil.schlenk_X_L",
    "shaft.0.length_mm", "shaft.0.diameter_mm", "shaft.0.conductivity_W_mK", "shaft.1.diameter_mm",
    "stage.0.roughness_Ra_um.0", "stage.0.roughness_Ra_um.1", "stage.0.friction.mu_solid",
    "stage.0.material.conductivity_W_mK", "bearing.0.mass_kg", "bearing.0.R1", "bearing.3.S2", "bearing.1.K_rs",
    "bearing.2.mu_bl", "bearing.3.mu_EHL", "seal.0.temperature_coefficient", "seal.1.temperature_coefficient",
    "housing.inside_area_m2", "housing.outside_area_m2", "housing.wall_thickness_m", "housing.conductivity_W_mK",
    "housing.oil_heat_transfer_W_m2K", "housing.emissivity", "housing.foundation_conductance_W_K",
    "housing.joint_conductance_W_K",
)  # fmt: skip


def test_every_value_of_the_fzg_file_has_a_source(fzg: Gearbox) -> None:
    for path in fzg.leaves:
        assert fzg.source_of(path).strip(), path
        assert not fzg.source_of(path).startswith("default"), f"{path} should stand in the file"


def test_every_uncertain_value_and_every_factor_of_the_fzg_file_has_a_prior(fzg: Gearbox) -> None:
    expected = {*UNCERTAIN, *(f"factors.{name}" for name in fzg.factors)}
    assert expected <= set(fzg.priors)
    assert set(fzg.priors) <= set(fzg.leaves)
    assert all(sd > 0.0 for sd in fzg.priors.values())


def test_a_prior_stands_only_on_a_value_that_can_move_alone(fzg: Gearbox) -> None:
    for path, sd in fzg.priors.items():
        value = fzg.leaves[path]
        for step in (0.5 * sd, -0.5 * sd):
            if value + step > 0.0:
                assert fzg.with_values({path: value + step}).leaves[path] == value + step


def test_percent_and_plain_standard_deviations(fzg: Gearbox) -> None:
    assert fzg.priors["stage.0.friction.mu_solid"] == 0.01
    assert fzg.priors["housing.oil_heat_transfer_W_m2K"] == pytest.approx(190.0, rel=1e-15)
    assert fzg.priors["stage.0.roughness_Ra_um.1"] == pytest.approx(0.15 * 0.157, rel=1e-15)
    assert "oil.viscosity_points.0.0" not in fzg.priors  # sd 0 in a list: exactly known


def test_the_nearest_source_wins(fzg: Gearbox) -> None:
    assert fzg.source_of("stage.0.center_distance_mm") == "Table 1 of the paper"
    assert fzg.source_of("stage.0.profile_shift.1").startswith("Table 1 of the paper; rounded")
    assert fzg.source_of("schema") == "the paper, Tables 1, 2, 4 and 5"
    assert "Arana et al. 2019, Table 3, M100" in fzg.source_of("oil.modulus.a1_Pa")  # from the named oil
    assert fzg.source_of("oil.density_kg_m3") == "Table 1 of the paper"
    assert load_gearbox("conveyor").source_of("bearing.0.K_Z") == "default of schema 1"
    with pytest.raises(InputError, match=re.escape("did you mean 'stage.0.face_width_mm'?")):
        fzg.source_of("stage.0.facewidth_mm")


def test_sources_name_conflicts_and_no_private_files(fzg: Gearbox) -> None:
    assert "145 - theta" in fzg.source_of("seal.0.temperature_coefficient")
    for name in known_gearboxes():
        for path, source in load_gearbox(name).sources.items():
            assert not re.search(r"\.(md|txt|csv)\b|/work|/tmp", source), f"{path}: {source}"


# --- changing values ---------------------------------------------------------------------------------------------------


def test_with_values_round_trip(fzg: Gearbox) -> None:
    changed = fzg.with_values({"stage.0.friction.mu_solid": 0.07, "stage.0.roughness_Ra_um.1": np.float64(0.2)})
    assert changed.stage[0].friction.mu_solid == 0.07
    assert changed.stage[0].roughness_Ra_um == (0.174, 0.2)
    assert changed.hash != fzg.hash
    assert changed.source_of("stage.0.friction.mu_solid") == "changed after reading (with_values)"
    assert changed.source_of("stage.0.roughness_Ra_um.0") == fzg.source_of("stage.0.roughness_Ra_um.0")
    assert changed.priors == fzg.priors
    back = changed.with_values({"stage.0.friction.mu_solid": 0.0863, "stage.0.roughness_Ra_um": [0.174, 0.157]})
    assert back.hash == fzg.hash
    assert fzg.stage[0].friction.mu_solid == 0.0863  # the first one is untouched


def test_with_values_can_set_what_was_left_open(fzg: Gearbox) -> None:
    changed = load_gearbox("conveyor").with_values({"shaft.0.heat_capacity_J_K": 500.0, "factors.striction": 1.2})
    assert changed.shaft[0].heat_capacity_J_K == 500.0
    assert changed.factors["striction"] == 1.2
    assert changed.source_of("shaft.0.heat_capacity_J_K") == "changed after reading (with_values)"


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [("stage.0.friction.mu_sold", 0.1, "stage.0.friction.mu_sold is not a known key; did you mean 'mu_solid'?"),
     ("stage.1.friction.mu_solid", 0.1, "stage.1.friction.mu_solid is not a value of this gearbox; did you mean"),
     ("stage.-1.module_mm", 4.0, "is not a value of this gearbox"),
     ("stage.0.friction.mu_solid", math.nan, "stage.0.friction.mu_solid: must be finite, not nan"),
     ("stage.0.friction.mu_solid", "0.1", "stage.0.friction.mu_solid: must be a number, not '0.1'"),
     ("factors.h_iar", 1.0, "factors.h_iar is not a known factor; did you mean 'h_air'?"),
     ("bearing.0.load_share", 0.6, "load_share of the bearings on 'shaft_1' sum to 1.1, not to 1")],
)  # fmt: skip
def test_with_values_validates(fzg: Gearbox, path: str, value: object, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        fzg.with_values({path: value})


def test_hash_knows_values_only(fzg: Gearbox) -> None:
    assert read_gearbox(f"# a remark\n{FZG}# another\n", file="x.toml").hash == fzg.hash
    assert (
        read_gearbox(edited(("sd = 0.01,", "sd = 0.02,"), ('"Table 1 of the paper"', '"T1"')), file="x").hash
        == fzg.hash
    )
    assert read_gearbox(edited(("face_width_mm = 14.0", "face_width_mm = 14")), file="x").hash == fzg.hash
    assert read_gearbox(edited(("face_width_mm = 14.0", "face_width_mm = 14.1")), file="x").hash != fzg.hash


def test_hash_is_the_same_in_another_process(fzg: Gearbox) -> None:
    code = "from models.gearbox import load_gearbox; print(load_gearbox('fzg').hash)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == fzg.hash


def test_a_definition_is_frozen(fzg: Gearbox) -> None:
    with pytest.raises(ValueError, match="frozen"):
        fzg.stage[0].friction.mu_solid = 0.1


# --- faults ------------------------------------------------------------------------------------------------------------

ONE_FAULT = [
    # keys
    (("face_width_mm = 14.0", "facewidth_mm = 14.0"),
     "stage.0.facewidth_mm is not a known key; did you mean 'face_width_mm'?"),
    (("[ambient]", "[ambient]\nhumidty = 1"), "ambient.humidty is not a known key; known are: air_speed_m_s, temperature"),
    (("mu_solid =", "mu_solids ="), "stage.0.friction.mu_solids is not a known key; did you mean 'mu_solid'?"),
    (("[[seal]]", "[[seals]]"), "seals is not a known key; did you mean 'seal'?"),
    (('area_fraction = { value = 0.45,', 'area_fraction = { value = 0.45, std = 1,'),
     "housing.part.0.area_fraction.std is not a known key; did you mean 'sd'?"),
    (("air_speed_m_s = { value = 2.0, sd = 0.3, source", "# source"), "ambient.air_speed_m_s is missing"),
    (("[training]", "[[training]]"), "training: must be a table, not"),
    (('source = "the paper, Tables 1, 2, 4 and 5"\n', ""), "source is missing; say where the values come from"),
    (('source = "the paper, Tables 1, 2, 4 and 5"\n', "source = 3\n"), "source: must be a text"),
    # types
    (("face_width_mm = 14.0", 'face_width_mm = "14 mm"'), "stage.0.face_width_mm: must be a number, not '14 mm'"),
    (("face_width_mm = 14.0", "face_width_mm = true"), "stage.0.face_width_mm: must be a number, not True"),
    (("z = [16, 24]", "z = [16.0, 24]"), "stage.0.z.0: must be a whole number, not 16.0"),
    (("z = [16, 24]", "z = [16]"), "stage.0.z.1 is missing"),
    (("z = [16, 24]", "z = [16, 24, 40]"), "stage.0.z: has too many entries"),
    (("z = [16, 24]", "z = 16"), "stage.0.z: must be a list, not 16"),
    (("surface_to_air = false", "surface_to_air = 0"), "shaft.0.surface_to_air: must be true or false, not 0"),
    (('designation = "NU 406"', "designation = 406"), "bearing.0.designation: must be a text, not 406"),
    (('name = "seal_1"', 'name = "seal 1"'), "seal.0.name: 'seal 1' must be a name of letters, digits and underscores"),
    (('model = "arana"', 'model = "arena"'), "stage.0.friction.model: 'arena' is not one of its values; did you mean 'arana'?"),
    (("face_width_mm = 14.0", "face_width_mm = 1979-05-27"), "stage.0.face_width_mm: must be a number, not datetime.date"),
    # units by magnitude
    (("face_width_mm = 14.0", "face_width_mm = 0.014"),
     "stage.0.face_width_mm: 0.014 mm is below 1 mm (plausible: 1 to 1000 mm): were metres meant?"),
    (("face_width_mm = 14.0", "face_width_mm = 14000"),
     "stage.0.face_width_mm: 14000 mm is above 1000 mm (plausible: 1 to 1000 mm): were micrometres meant?"),
    (("pressure_angle_deg = 20.0", "pressure_angle_deg = 0.349"), "0.349 deg is below 10 deg (plausible: 10 to 35 deg): were radians meant?"),
    (("youngs_modulus_GPa = 206.0", "youngs_modulus_GPa = 206000.0"), "206000 GPa is above 500 GPa (plausible: 1 to 500 GPa): were MPa meant?"),
    (("value = 27.0, sd = 1.0", "value = 300.15, sd = 1.0"), "ambient.temperature_degC: 300.15 degC is above 80 degC (plausible: -60 to 80 degC): was kelvin meant?"),
    (("value = 24.0, sd =", "value = 0.024, sd ="), "shaft.0.diameter_mm: 0.024 mm is below 2 mm (plausible: 2 to 1000 mm): were metres meant?"),
    (("value = 7200.0", "value = 7.2"), "housing.density_kg_m3: 7.2 kg/m3 is below 900 kg/m3 (plausible: 900 to 12000 kg/m3): were g/cm3 meant?"),
    (("value = 0.45,", "value = 45,"), "housing.part.0.area_fraction: 45 is above 1 (plausible: 0.01 to 1): was percent meant?"),
    (("value = 0.024, sd", "value = 24.0, sd"), "housing.wall_thickness_m: 24 m is above 0.3 m (plausible: 0.0005 to 0.3 m): were millimetres meant?"),
    (("face_width_mm = 14.0", "face_width_mm = nan"), "stage.0.face_width_mm: must be finite, not nan"),
    (("face_width_mm = 14.0", "face_width_mm = inf"), "stage.0.face_width_mm: must be finite, not inf"),
    (("profile_shift = { value = [0.182, 0.172]", "profile_shift = { value = [nan, 0.172]"), "stage.0.profile_shift.0: must be finite, not nan"),
    # standard deviations
    (("sd = 0.01,", "sd = -0.01,"), "stage.0.friction.mu_solid: sd must be a number above 0 or a text such as '20 %'"),
    (("sd = 0.01,", "sd = nan,"), "stage.0.friction.mu_solid: sd must be a number above 0"),
    (("sd = 0.01,", 'sd = "10",'), "stage.0.friction.mu_solid: sd must be a number above 0"),
    (("z = [16, 24]", "z = { value = [16, 24], sd = 1 }"), "stage.0.z.0 is a whole number and cannot have an sd"),
    (('designation = "NU 406"', 'designation = { value = "NU 406", sd = 1 }'), "bearing.0.designation: only a number can have an sd"),
    (('157], sd = "15 %"', "157], sd = [0.1]"), "stage.0.roughness_Ra_um: has 2 values but 1 sd"),
    (("[stage.churning]", "[stage.churning]\nsd = 1"), "stage.0.churning.sd: stands without a value beside it"),
    # oil
    (('named = "FZG_mineral_32"', 'named = "FZG_mineral_46"'), "oil.named: there is no oil named 'FZG_mineral_46'; did you mean 'FZG_mineral_32'?"),
    (('named = "FZG_mineral_32"', "named = 32"), "oil.named: must be a text, not 32"),
    (("[oil]", "[oil]\nviscosity_points = [[40.0, 5.45], [100.0, 32.63]]"),
     "oil: viscosity_points: 32.63 mm2/s at 100 degC is not below 5.45 mm2/s at 40 degC; the hotter oil must be the thinner one"),
    (("[oil]", "[oil]\nviscosity_points = [[40.0, 32.63], [40.0, 5.45]]"), "oil: viscosity_points are both at 40 degC; two different"),
    (("[oil]", "[oil]\nviscosity_points = [[40.0, 3.263e-5], [100.0, 5.45]]"),
     "oil.viscosity_points.0.1: 3.263e-05 mm2/s is below 0.5 mm2/s (plausible: 0.5 to 100000 mm2/s): were m2/s meant?"),
    (("[oil]", "[oil]\nviscosity_points = [[313.15, 32.63], [100.0, 5.45]]"),
     "oil.viscosity_points.0.0: 313.15 degC is above 250 degC (plausible: -60 to 250 degC): was kelvin meant?"),
    (("[oil]", "[oil]\nd341 = { m = 9.5, n = 3.75 }\nviscosity_points = [[40.0, 32.63], [100.0, 5.45]]"),
     "oil: needs either viscosity_points or d341, and not both"),
    (("[oil]", "[oil]\ngold = { s = 0.139, t = 0.9904 }"), "oil.gold: s = 0.139, t = 0.9904 is outside"),
    (("[oil]", "[oil]\nmodulus = { a1_Pa = 2.28e8, a2_Pa_per_K = 2.26e5, b1 = 0.0, b2_per_K = 0.0, nu_40_mm2_s = 96.0 }"),
     "oil.modulus: a1 + a2 T is 3.03e+08 Pa at 60 degC"),
    (("[oil]", "[oil]\nthermal_expansion_1_K = -5.8e-4"), "oil.thermal_expansion_1_K: -0.00058 1/K is below 0.0001 1/K (plausible: 0.0001 to 0.002 1/K): was the opposite sign meant?"),
    # gears
    (("helix_angle_deg = 0.0", "helix_angle_deg = 15.0"), "stage.0: helix_angle_deg = 15: helical gears are not supported yet"),
    (("profile_shift = { value = [0.182, 0.172]", "profile_shift = { value = [-0.4, 0.754]"), "stage.0: gear pair: gear 1: profile shift -0.4 undercuts"),
    (("center_distance_mm = 91.5", "center_distance_mm = 80.0"), "stage.0: gear pair: "),
    (("tip_shortening =", "tip_diameter_mm = [78.0, 112.0]\ntip_shortening ="), "contact ratio"),
    (("value = [30.0, 30.0]", "value = [63.0, 30.0]"), "stage.0: bore_mm of 'pinion' is 63, not below its root diameter 62.39 mm"),
    (("value = 24.0, sd =", "value = 64.0, sd ="), "shaft.0.diameter_mm: 64 mm is not below the root diameter 62.39 mm of the gear 'pinion' on it"),
    (('driven = "shaft_2"', 'driven = "shaft_1"'), "stage.0: driver and driven are both 'shaft_1'"),
    # names and references
    (('driven = "shaft_2"', 'driven = "shaft2"'), "stage.0.driven: there is no shaft 'shaft2'; did you mean 'shaft_2'?"),
    (('name = "bearing_1"\nshaft = "shaft_1"', 'name = "bearing_1"\nshaft = "shaft_7"'), "bearing.0.shaft: there is no shaft 'shaft_7'; did you mean"),
    (('name = "seal_1"\nshaft = "shaft_1"', 'name = "seal_1"\nshaft = "axle"'), "seal.0.shaft: there is no shaft 'axle'; known are: shaft_1, shaft_2"),
    (('name = "bearing_2"', 'name = "bearing_1"'), "name 'bearing_1' is given 2 times"),
    (('names = ["pinion", "wheel"]', 'names = ["gear", "gear"]'), "name 'gear' is given 2 times"),
    (('name = "housing_lower"', 'name = "air"'), "name 'air' is taken by the model itself; choose another"),
    (('name = "mesh"\n', 'name = "mesch"\n'), "node.0: there is no node 'mesch'; did you mean 'mesh'?"),
    (('name = "mesh"\n', 'name = "air"\n'), "node.0: 'air' is a boundary, and has no heat capacity"),
    (("[[node]]", '[[node]]\nname = "mesh"\nheat_capacity_J_K = 1.0\n[[node]]'), "node: 'mesh' is overridden 2 times"),
    (("h_air =", "h_iar ="), "factors.h_iar is not a known factor; did you mean 'h_air'?"),
    (("C_housing_lower =", "C_housing_middle ="), "factors.C_housing_middle is not a known factor; did you mean 'C_housing_"),
    (("mesh = { value = 1.0", "mesh = { value = -1.0"), "factors.mesh: -1 is below 0.001"),
    # sums, orders and what is not supported
    (("value = 0.45,", "value = 0.4,"), "housing: the area_fraction of its parts sum to 0.95, not to 1"),
    (("load_share = { value = 0.5,", "load_share = { value = 0.4,"), "bearing: load_share of the bearings on 'shaft_1' sum to 0.9, not to 1"),
    (("[[bearing]]", '[[shaft]]\nname = "shaft_3"\nlength_mm = 90.0\ndiameter_mm = 20.0\n[[bearing]]'), "shaft: has 3 entries, and more than two shafts is not supported yet"),
    (("[[bearing]]", '[[shaft]]\nname = "shaft_3"\nlength_mm = 90.0\ndiameter_mm = 20.0\n[[bearing]]'), "shaft.2: no stage drives the shaft 'shaft_3'"),
    (("[[bearing]]", '[[stage]]\ndriver = "shaft_1"\n[[bearing]]'), "stage: has 2 entries, and more than one stage is not supported yet"),
    (("speed_rpm = { value = [1.0, 6500.0]", "speed_rpm = { value = [6500.0, 1.0]"), "training: speed_rpm: the lower bound 6500 is not below the upper bound 1"),
    (("outside_diameter_mm = 90.0", "outside_diameter_mm = 30.0"), "bearing.0: outside_diameter_mm = 30 is not above bore_mm = 30"),
    (("foundation_conductance_W_K = { value = 0.0", "foundation_conductance_W_K = { value = 3.0"), None),
    # schema and syntax
    (("schema = 1", "schema = 2"), "schema = 2 is not known; this version reads schema = 1"),
    (("schema = 1", "schema = true"), "schema = True is not known"),
    (("schema = 1", 'schema = "1"'), "schema = '1' is not known"),
    (("schema = 1", ""), "schema is missing"),
    (("face_width_mm = 14.0", "face_width_mm = 14,0"), "is not valid TOML: "),
    (("face_width_mm = 14.0", "face_width_mm = 14.0\nface_width_mm = 14.0"), "is not valid TOML: "),
]  # fmt: skip


@pytest.mark.parametrize(("change", "message"), ONE_FAULT, ids=[str(change[1])[:60] for change, _ in ONE_FAULT])
def test_every_fault_has_its_line(change: tuple[str, str], message: str | None) -> None:
    if message is None:
        read_gearbox(edited(change), file="fzg.toml")
        return
    lines = faults(change)
    assert any(line.startswith("fzg.toml: ") and message in line for line in lines), lines


def test_a_syntax_error_names_its_line() -> None:
    line = next(number for number, text in enumerate(FZG.splitlines(), start=1) if "face_width_mm = 14.0" in text)
    assert f"at line {line}, column" in faults(("face_width_mm = 14.0", "face_width_mm = 14,0"))[0]


def test_foundation_needs_a_part_on_it() -> None:
    changes = (
        ("foundation_conductance_W_K = { value = 0.0", "foundation_conductance_W_K = { value = 3.0"),
        ("foundation = true", "foundation = false"),
    )
    assert faults(*changes) == [
        "fzg.toml: housing: foundation_conductance_W_K is above 0, but no part stands on the foundation; "
        "set foundation = true for one of them"
    ]  # fmt: skip


def test_a_misspelt_key_is_one_fault_and_not_also_a_missing_one() -> None:
    assert faults(("face_width_mm = 14.0", "facewidth_mm = 14.0")) == [
        "fzg.toml: stage.0.facewidth_mm is not a known key; did you mean 'face_width_mm'?"
    ]


def test_all_faults_of_a_file_come_at_once() -> None:
    lines = faults(
        ("face_width_mm = 14.0", "facewidth_mm = 14.0"),
        ("air_speed_m_s = { value = 2.0", "air_speed_m_s = { value = -2.0"),
        ('name = "bearing_1"\nshaft = "shaft_1"', 'name = "bearing_1"\nshaft = "shaft_7"'),
        ("value = 0.45,", "value = 0.4,"),
        ("h_air =", "h_iar ="),
        ("sd = 0.01,", "sd = -0.01,"),
        ('named = "FZG_mineral_32"', 'named = "unknown_oil"'),
        ('name = "mesh"\n', 'name = "mesch"\n'),
    )
    for message in ("facewidth_mm is not", "air_speed_m_s: -2", "no shaft 'shaft_7'", "sum to 0.95", "h_iar is not",
                    "sd must be", "no oil named 'unknown_oil'", "no node 'mesch'"):  # fmt: skip
        assert sum(message in line for line in lines) == 1, (message, lines)
    assert all(line.startswith("fzg.toml: ") for line in lines)


@pytest.mark.parametrize("table", ["ambient", "oil", "housing", "training", "stage", "shaft", "bearing"])
def test_every_required_table_is_missed(table: str) -> None:
    document = tomllib.loads(FZG)
    del document[table]
    with pytest.raises(InputError, match=f"(?m)^x.toml: {table} is missing$"):
        read_gearbox(as_toml(document), file="x.toml")


# --- anything else -----------------------------------------------------------------------------------------------------


def as_toml(document: dict[str, object]) -> str:
    """Write a document as TOML: inline tables on one line each, which JSON is but for its colons."""

    def inline(value: object) -> str:
        if isinstance(value, dict):
            return "{" + ", ".join(f"{json.dumps(key)} = {inline(item)}" for key, item in value.items()) + "}"
        if isinstance(value, list):
            return "[" + ", ".join(inline(item) for item in value) + "]"
        if isinstance(value, float):
            return repr(value)
        return json.dumps(value)

    return "\n".join(f"{json.dumps(key)} = {inline(item)}" for key, item in document.items())


def refused_or_read(text: str) -> None:
    try:
        read_gearbox(text, file="x.toml")
    except InputError as error:
        assert str(error).startswith("x.toml: ")


def test_rewritten_file_is_the_same_gearbox(fzg: Gearbox) -> None:
    assert read_gearbox(as_toml(tomllib.loads(FZG)), file="x.toml").hash == fzg.hash


@given(st.text(max_size=200))
def test_garbage_text_is_refused(text: str) -> None:
    refused_or_read(text)


TEXT = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=10)
VALUE = st.recursive(
    st.one_of(st.integers(-(2**70), 2**70), st.floats(), st.booleans(), TEXT, st.just(2**2000)),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["value", "sd", "source", "name", "x"]), inner, max_size=3),
    max_leaves=6,
)  # fmt: skip


def places(document: object) -> list[tuple[object, object]]:
    """Return every (container, key) of a document."""
    if isinstance(document, dict):
        items: list[tuple[object, object]] = list(document.items())
    elif isinstance(document, list):
        items = list(enumerate(document))
    else:
        return []
    return [(document, key) for key, _ in items] + [place for _, item in items for place in places(item)]


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_any_value_anywhere_is_refused_or_read(data: st.DataObject) -> None:
    document = tomllib.loads(FZG)
    for _ in range(data.draw(st.integers(1, 3))):
        container, key = data.draw(st.sampled_from(places(document)))
        if data.draw(st.booleans()):
            container[key] = data.draw(VALUE)  # type: ignore[index]
        elif isinstance(container, dict):
            container[data.draw(TEXT)] = data.draw(VALUE)
        else:
            del container[key]  # type: ignore[attr-defined]
    refused_or_read(as_toml(document))


@pytest.mark.parametrize(
    "text",
    ["schema = 1\n" + ".".join(["a"] * 900) + " = 1", "a = " + "[" * 5000, f"schema = 0x{'f' * 5000}",
     FZG.replace("face_width_mm = 14.0", f"face_width_mm = 0x{'f' * 5000}"),
     FZG.replace("sd = 0.01,", f"sd = 0x{'f' * 5000},"), FZG.replace("value = 0.0863", f"value = 0x{'f' * 5000}"),
     FZG + "\n[oil.x" + ".y" * 200 + "]\n", "value = 1\n" + FZG, 'schema = 1\nvalue = 3\nsource = "x"'],
    ids=["deep keys", "deep lists", "huge schema", "huge integer", "huge sd", "huge value", "deep tables", "value on top", "value only"],
)  # fmt: skip
def test_absurd_documents_are_refused(text: str) -> None:
    with pytest.raises(InputError, match="x.toml: "):
        read_gearbox(text, file="x.toml")
