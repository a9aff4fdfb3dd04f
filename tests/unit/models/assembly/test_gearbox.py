"""Gearbox definitions: what is read, where it comes from, and what each fault of a file is called."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from models.assembly.gearbox import Gearbox, known_gearboxes, load_gearbox, read_gearbox
from models.base.errors import InputError
from models.definition.named_oils import named_oil
from models.quantities.definition_units import UNITS, unit_of
from tests.unit.models.fzg_file import FZG, edited


@pytest.fixture(scope="module")
def fzg() -> Gearbox:
    return load_gearbox("fzg")


# --- what is read ---


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
    assert known_gearboxes() == ("conveyor", "fzg", "heated_rod", "helical", "la_haute_borne", "reducer", "two_stage")
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
    with pytest.raises(InputError, match=r"is not UTF-8 text \(byte 0\); TOML must be$"):
        load_gearbox(path)
    with pytest.raises(InputError, match="; TOML must be; only simulate takes an FMU, before the cycle$"):
        load_gearbox(path.rename(tmp_path / "rig.fmu"))
    with pytest.raises(InputError, match="cannot be read"):
        load_gearbox(tmp_path)


# --- provenance ---

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


# --- changing values ---


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
    [("stage.0.friction.mu_sold", 0.1, "stage.friction: 'mu_sold' is not a known key; did you mean 'mu_solid'?"),
     ("stage.1.friction.mu_solid", 0.1, "stage.1.friction.mu_solid is not a value of this gearbox; did you mean"),
     ("stage.-1.module_mm", 4.0, "is not a value of this gearbox"),
     ("stage.0.friction.mu_solid", math.nan, "stage.friction.mu_solid: must be finite, not nan"),
     ("stage.0.friction.mu_solid", "0.1", "stage.friction.mu_solid: must be a number, not '0.1'"),
     ("factors.h_iar", 1.0, "factors: 'h_iar' is not a known factor; did you mean 'h_air'?"),
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
    code = "from models.assembly.gearbox import load_gearbox; print(load_gearbox('fzg').hash)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == fzg.hash


def test_a_definition_is_frozen(fzg: Gearbox) -> None:
    with pytest.raises(ValueError, match="frozen"):
        fzg.stage[0].friction.mu_solid = 0.1


def test_another_oil_is_another_oil_in_all_that_follows_from_its_name(fzg: Gearbox) -> None:
    """As a file that names it, with the level and the volume of the machine; what is given with it counts."""
    other = fzg.with_values({"oil.volume_l": 2.0, "oil.named": "ISO_VG_220"})
    oil = named_oil("ISO_VG_220")
    assert other.oil.model_dump(include=set(type(oil).model_fields)) == oil.model_dump()
    assert (other.oil.volume_l, other.oil.level_below_axis_mm) == (2.0, fzg.oil.level_below_axis_mm)
    assert [seal.nu_40_mm2_s for seal in other.seal] == [None, None]  # the grade of the oil
    assert other.source_of("oil.density_kg_m3") != fzg.source_of("oil.density_kg_m3")
    with pytest.raises(InputError, match="there is no oil named 'VG'"):
        fzg.with_values({"oil.named": "VG"})
    with pytest.raises(InputError, match="oil: 'named' is not a known key"):  # without geometry an oil has no name
        load_gearbox("reducer").with_values({"oil.named": "ISO_VG_220"})


def test_another_designation_changes_the_bearing(fzg: Gearbox) -> None:
    other = fzg.with_values({"bearing.0.mass_kg": 0.9, "bearing.0.designation": "NU 211"}).bearing
    assert (other[0].bore_mm, other[0].mass_kg, other[0].shaft) == (55.0, 0.9, fzg.bearing[0].shaft)
    assert other[1] == fzg.bearing[1]
    with pytest.raises(InputError, match="sizes of 'NU 999' are not known"):
        fzg.with_values({"bearing.0.designation": "NU 999"})


def test_kelvin_are_not_taken_for_degrees_in_python_either(fzg: Gearbox) -> None:
    with pytest.raises(InputError, match=r"T_oil_degC is 333.15; -90 ... 250 is possible"):
        fzg.losses_at(speed=1500.0, torque=94.0, temperatures=333.15)
    with pytest.raises(InputError, match=r"T_ambient_degC is 293.15 at row 2; -90 ... 200 is possible .*kelvin"):
        fzg.steady_state(speed=1500.0, torque=94.0, inputs={"T_ambient": [20.0, 293.15]})
