"""What each fault of a gearbox file is called, that all come at once, and that nothing else ever comes out."""

from __future__ import annotations

import json
import tomllib

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from models.errors import InputError
from models.gearbox import load_gearbox, read_gearbox
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


ONE_FAULT = [
    # keys
    (
        ("face_width_mm = 14.0", "facewidth_mm = 14.0"),
        "stage.facewidth_mm is not a known key; did you mean 'face_width_mm'?",
    ),
    (
        ("[ambient]", "[ambient]\nhumidty = 1"),
        "ambient.humidty is not a known key; known are: air_speed_m_s, temperature",
    ),
    (("mu_solid =", "mu_solids ="), "stage.friction.mu_solids is not a known key; did you mean 'mu_solid'?"),
    (("[[seal]]", "[[seals]]"), "seals is not a known key; did you mean 'seal'?"),
    (
        ("area_fraction = { value = 0.45,", "area_fraction = { value = 0.45, std = 1,"),
        "housing.part 'housing_lower'.area_fraction.std is not a known key; did you mean 'sd'?",
    ),
    (("air_speed_m_s = { value = 2.0, sd = 0.3, source", "# source"), "ambient.air_speed_m_s is missing"),
    (("[training]", "[[training]]"), "training: must be a table, not"),
    (('source = "the paper, Tables 1, 2, 4 and 5"\n', ""), "source is missing; say where the values come from"),
    (('source = "the paper, Tables 1, 2, 4 and 5"\n', "source = 3\n"), "source: must be a text"),
    # types
    (("face_width_mm = 14.0", 'face_width_mm = "14 mm"'), "stage.face_width_mm: must be a number, not '14 mm'"),
    (("face_width_mm = 14.0", "face_width_mm = true"), "stage.face_width_mm: must be a number, not True"),
    (("z = [16, 24]", "z = [16.0, 24]"), "stage.z #1: must be a whole number, not 16.0"),
    (("z = [16, 24]", "z = [16]"), "stage.z #2 is missing"),
    (("z = [16, 24]", "z = [16, 24, 40]"), "stage.z: has too many entries"),
    (("z = [16, 24]", "z = 16"), "stage.z: must be a list, not 16"),
    (
        ("surface_to_air = false", "length_in_air_mm = 50.0"),
        "shaft 'shaft_1': length_in_air_mm is 50, but surface_to_air is false; set it to true",
    ),
    (
        ("surface_to_air = false", "surface_to_air = true\nlength_in_air_mm = 300.0"),
        "shaft 'shaft_1': length_in_air_mm is 300, more than length_mm, which is 223",
    ),
    (("surface_to_air = false", "surface_to_air = 0"), "shaft 'shaft_1'.surface_to_air: must be true or false, not 0"),
    (('designation = "NU 406"', "designation = 406"), "bearing 'bearing_1'.designation: must be a text, not 406"),
    (
        ('name = "seal_1"', 'name = "seal 1"'),
        "seal 'seal 1'.name: 'seal 1' must be a name of letters, digits and underscores",
    ),
    (
        ('model = "arana"', 'model = "arena"'),
        "stage.friction.model: 'arena' is not one of its values; did you mean 'arana'?",
    ),
    (
        ("face_width_mm = 14.0", "face_width_mm = 1979-05-27"),
        "stage.face_width_mm: must be a number, not datetime.date",
    ),
    # units by magnitude
    (
        ("face_width_mm = 14.0", "face_width_mm = 0.014"),
        "stage.face_width_mm: 0.014 mm is below 1 mm (plausible: 1 to 1000 mm): were metres meant?",
    ),
    (
        ("face_width_mm = 14.0", "face_width_mm = 14000"),
        "stage.face_width_mm: 14000 mm is above 1000 mm (plausible: 1 to 1000 mm): were micrometres meant?",
    ),
    (
        ("pressure_angle_deg = 20.0", "pressure_angle_deg = 0.349"),
        "0.349 deg is below 10 deg (plausible: 10 to 35 deg): were radians meant?",
    ),
    (
        ("youngs_modulus_GPa = 206.0", "youngs_modulus_GPa = 206000.0"),
        "206000 GPa is above 500 GPa (plausible: 1 to 500 GPa): were MPa meant?",
    ),
    (
        ("value = 27.0, sd = 1.0", "value = 300.15, sd = 1.0"),
        "ambient.temperature_degC: 300.15 degC is above 80 degC (plausible: -60 to 80 degC): was kelvin meant?",
    ),
    (
        ("value = 24.0, sd =", "value = 0.024, sd ="),
        "shaft 'shaft_1'.diameter_mm: 0.024 mm is below 2 mm (plausible: 2 to 1000 mm): were metres meant?",
    ),
    (
        ("value = 7200.0", "value = 7.2"),
        "housing.density_kg_m3: 7.2 kg/m3 is below 900 kg/m3 (plausible: 900 to 12000 kg/m3): were g/cm3 meant?",
    ),
    (
        ("value = 0.45,", "value = 45,"),
        "housing.part 'housing_lower'.area_fraction: 45 is above 1 (plausible: 0.01 to 1): was percent meant?",
    ),
    (
        ("value = 0.024, sd", "value = 24.0, sd"),
        "housing.wall_thickness_m: 24 m is above 0.3 m (plausible: 0.0005 to 0.3 m): were millimetres meant?",
    ),
    (("face_width_mm = 14.0", "face_width_mm = nan"), "stage.face_width_mm: must be finite, not nan"),
    (("face_width_mm = 14.0", "face_width_mm = inf"), "stage.face_width_mm: must be finite, not inf"),
    (
        ("profile_shift = { value = [0.182, 0.172]", "profile_shift = { value = [nan, 0.172]"),
        "stage.profile_shift #1: must be finite, not nan",
    ),
    # standard deviations
    (("sd = 0.01,", "sd = -0.01,"), "stage.friction.mu_solid: sd must be a number above 0 or a text such as '20 %'"),
    (("sd = 0.01,", "sd = nan,"), "stage.friction.mu_solid: sd must be a number above 0"),
    (("sd = 0.01,", 'sd = "10",'), "stage.friction.mu_solid: sd must be a number above 0"),
    (("z = [16, 24]", "z = { value = [16, 24], sd = 1 }"), "stage.z #1 is a whole number and cannot have an sd"),
    (
        ('designation = "NU 406"', 'designation = { value = "NU 406", sd = 1 }'),
        "bearing 'bearing_1'.designation: only a number can have an sd",
    ),
    (('157], sd = "15 %"', "157], sd = [0.1]"), "stage.roughness_Ra_um: has 2 values but 1 sd"),
    (("[stage.churning]", "[stage.churning]\nsd = 1"), "stage.churning.sd: stands without a value beside it"),
    # oil
    (
        ('named = "FZG_mineral_32"', 'named = "FZG_mineral_46"'),
        "oil.named: there is no oil named 'FZG_mineral_46'; did you mean 'FZG_mineral_32'?",
    ),
    (('named = "FZG_mineral_32"', "named = 32"), "oil.named: must be a text, not 32"),
    (
        ("[oil]", "[oil]\nviscosity_points = [[40.0, 5.45], [100.0, 32.63]]"),
        "oil: viscosity_points: 32.63 mm2/s at 100 degC is not below 5.45 mm2/s at 40 degC; "
        "the hotter oil must be the thinner one",
    ),
    (
        ("[oil]", "[oil]\nviscosity_points = [[40.0, 32.63], [40.0, 5.45]]"),
        "oil: viscosity_points are both at 40 degC; two different",
    ),
    (
        ("[oil]", "[oil]\nviscosity_points = [[40.0, 3.263e-5], [100.0, 5.45]]"),
        "oil.viscosity_points #1 #2: 3.263e-05 mm2/s is below 0.5 mm2/s (plausible: 0.5 to 100000 mm2/s): "
        "were m2/s meant?",
    ),
    (
        ("[oil]", "[oil]\nviscosity_points = [[313.15, 32.63], [100.0, 5.45]]"),
        "oil.viscosity_points #1 #1: 313.15 degC is above 250 degC (plausible: -60 to 250 degC): was kelvin meant?",
    ),
    (
        ("[oil]", "[oil]\nd341 = { m = 9.5, n = 3.75 }\nviscosity_points = [[40.0, 32.63], [100.0, 5.45]]"),
        "oil: needs either viscosity_points or d341, and not both",
    ),
    (("[oil]", "[oil]\ngold = { s = 0.139, t = 0.9904 }"), "oil.gold: s = 0.139, t = 0.9904 is outside"),
    (
        (
            "[oil]",
            "[oil]\nmodulus = { a1_Pa = 2.28e8, a2_Pa_per_K = 2.26e5, b1 = 0.0, b2_per_K = 0.0, nu_40_mm2_s = 96.0 }",
        ),
        "oil.modulus: a1 + a2 T is 3.03e+08 Pa at 60 degC",
    ),
    (
        ("[oil]", "[oil]\nthermal_expansion_1_K = -5.8e-4"),
        "oil.thermal_expansion_1_K: -0.00058 1/K is below 0.0001 1/K (plausible: 0.0001 to 0.002 1/K): "
        "was the opposite sign meant?",
    ),
    # gears
    (
        ("helix_angle_deg = 0.0", "helix_angle_deg = 15.0"),
        "stage: helix_angle_deg = 15: helical gears are not supported yet",
    ),
    (
        ("profile_shift = { value = [0.182, 0.172]", "profile_shift = { value = [-0.4, 0.754]"),
        "stage: gear pair: gear 1: profile shift -0.4 undercuts",
    ),
    (("center_distance_mm = 91.5", "center_distance_mm = 80.0"), "stage: gear pair: "),
    (("tip_shortening =", "tip_diameter_mm = [78.0, 112.0]\ntip_shortening ="), "contact ratio"),
    (
        ("value = [30.0, 30.0]", "value = [63.0, 30.0]"),
        "stage: bore_mm of 'pinion' is 63, not below its root diameter 62.39 mm",
    ),
    (
        ("value = 24.0, sd =", "value = 64.0, sd ="),
        "shaft 'shaft_1'.diameter_mm: 64 mm is not below the root diameter 62.39 mm of the gear 'pinion' on it",
    ),
    (('driven = "shaft_2"', 'driven = "shaft_1"'), "stage: driver and driven are both 'shaft_1'"),
    # names and references
    (
        ('driven = "shaft_2"', 'driven = "shaft2"'),
        "stage.driven: there is no shaft 'shaft2'; did you mean 'shaft_2'?",
    ),
    (
        ('name = "bearing_1"\nshaft = "shaft_1"', 'name = "bearing_1"\nshaft = "shaft_7"'),
        "bearing 'bearing_1'.shaft: there is no shaft 'shaft_7'; did you mean",
    ),
    (
        ('name = "seal_1"\nshaft = "shaft_1"', 'name = "seal_1"\nshaft = "axle"'),
        "seal 'seal_1'.shaft: there is no shaft 'axle'; known are: shaft_1, shaft_2",
    ),
    (('name = "bearing_2"', 'name = "bearing_1"'), "name 'bearing_1' is given 2 times"),
    (('names = ["pinion", "wheel"]', 'names = ["gear", "gear"]'), "name 'gear' is given 2 times"),
    (('name = "housing_lower"', 'name = "air"'), "name 'air' is taken by the model itself; choose another"),
    (('name = "mesh"\n', 'name = "mesch"\n'), "node 'mesch': there is no node 'mesch'; did you mean 'mesh'?"),
    (('name = "mesh"\n', 'name = "air"\n'), "node 'air': 'air' is a boundary, and has no heat capacity"),
    (("[[node]]", '[[node]]\nname = "mesh"\nheat_capacity_J_K = 1.0\n[[node]]'), "node: 'mesh' is overridden 2 times"),
    (("h_air =", "h_iar ="), "factors.h_iar is not a known factor; did you mean 'h_air'?"),
    (
        ("C_housing_lower =", "C_housing_middle ="),
        "factors.C_housing_middle is not a known factor; did you mean 'C_housing_",
    ),
    (("mesh = { value = 1.0", "mesh = { value = -1.0"), "factors.mesh: -1 is below 0.001"),
    (('name = "seal_2"', 'name = "total"'), "name 'total' is taken by the model itself; choose another"),
    (('name = "bearing_4"', 'name = "ambient"'), "name 'ambient' is taken by the model itself; choose another"),
    (('name = "bearing_4"', 'name = "initial"'), "name 'initial' is taken by the model itself; choose another"),
    (('name = "housing_upper"', 'name = "gears"'), "name 'gears' is taken by the model itself; choose another"),
    # what cannot be beside the rest of the file
    (
        ("value = 0.9, sd", "value = 900.0, sd"),
        "oil.volume_l: 900 l does not go into the housing, whose inside_area_m2 = 0.149 encloses 5.41 l at most: were "
        "millilitres meant?",
    ),
    (
        ("value = 19.0, sd", "value = 190.0, sd"),
        "oil.level_below_axis_mm: 190 mm is outside the housing, below its floor: no gear would reach the oil; with "
        "height_m = 0.215 and the tip radius 59.18 mm of 'wheel', -155.8 to 155.8 mm is possible",
    ),
    (
        ("value = 19.0, sd", "value = -190.0, sd"),
        "oil.level_below_axis_mm: -190 mm is outside the housing, above its roof; with height_m = 0.215",
    ),
    (
        ("value = 0.75, sd", "value = 750.0, sd"),
        "bearing 'bearing_1': mass_kg = 750 does not fit its size: a solid steel ring of its bore_mm, "
        "outside_diameter_mm and width_mm has 1.02 kg, so 0.1 to 2 kg is possible: were grams meant?",
    ),
    (
        ("value = 0.75, sd", "value = 0.002, sd"),
        "bearing 'bearing_1': mass_kg = 0.002 does not fit its size",
    ),
    (
        ("outside_diameter_mm = 90.0", "outside_diameter_mm = 900.0"),
        "bearing 'bearing_1': outside_diameter_mm = 900 is 30 times bore_mm = 30; rolling bearings have up to 4 times, "
        "above 5 is refused",
    ),
    (
        ("width_mm = 23.0", "width_mm = 2.3"),
        "bearing 'bearing_1': width_mm = 2.3 is 0.0767 times the height of its section, 30 mm between bore_mm and "
        "outside_diameter_mm; 0.1 to 10 times is possible",
    ),
    (
        ("diameter_mm = 24.0\nmodel", "diameter_mm = 240.0\nmodel"),
        "seal 'seal_1'.diameter_mm: 240 mm does not fit the shaft 'shaft_1', whose bearings have a bore of 30 mm and "
        "whose diameter_mm is 24; 8 to 90 mm",
    ),
    (
        ("diameter_mm = 24.0\nmodel", "diameter_mm = 2.4\nmodel"),
        "seal 'seal_1'.diameter_mm: 2.4 mm does not fit the shaft 'shaft_1'",
    ),
    # sums, orders and what is not supported
    (("value = 0.45,", "value = 0.4,"), "housing: the area_fraction of its parts sum to 0.95, not to 1"),
    (
        ("load_share = { value = 0.5,", "load_share = { value = 0.4,"),
        "bearing: load_share of the bearings on 'shaft_1' sum to 0.8, not to 1",
    ),
    (
        ("[[bearing]]", '[[shaft]]\nname = "shaft_3"\nlength_mm = 90.0\ndiameter_mm = 20.0\n[[bearing]]'),
        "shaft: has 3 entries, and more than two shafts is not supported yet",
    ),
    (
        ("[[bearing]]", '[[shaft]]\nname = "shaft_3"\nlength_mm = 90.0\ndiameter_mm = 20.0\n[[bearing]]'),
        "shaft 'shaft_3': no stage drives the shaft 'shaft_3'",
    ),
    (
        ("[[bearing]]", '[[stage]]\ndriver = "shaft_1"\n[[bearing]]'),
        "stage: has 2 entries, and more than one stage is not supported yet",
    ),
    (
        ("speed_rpm = { value = [1.0, 6500.0]", "speed_rpm = { value = [6500.0, 1.0]"),
        "training: speed_rpm: the lower bound 6500 is not below the upper bound 1",
    ),
    (
        ("outside_diameter_mm = 90.0", "outside_diameter_mm = 30.0"),
        "bearing 'bearing_1': outside_diameter_mm = 30 is not above bore_mm = 30",
    ),
    (("foundation_conductance_W_K = { value = 0.0", "foundation_conductance_W_K = { value = 3.0"), None),
    # schema and syntax
    (("schema = 1", "schema = 2"), "schema = 2 is not known; this version reads schema = 1"),
    (("schema = 1", "schema = true"), "schema = True is not known"),
    (("schema = 1", 'schema = "1"'), "schema = '1' is not known"),
    (("schema = 1", ""), "schema is missing"),
    (("face_width_mm = 14.0", "face_width_mm = 14,0"), "is not valid TOML: "),
    (("face_width_mm = 14.0", "face_width_mm = 14.0\nface_width_mm = 14.0"), "is not valid TOML: "),
]


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
        "fzg.toml: stage.facewidth_mm is not a known key; did you mean 'face_width_mm'?"
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


def test_a_wrong_value_does_not_hide_what_is_wrong_with_the_others() -> None:
    """Between the values of a table and between tables whatever can be told is told, beside faults of single values."""
    assert set(faults(
        ('model = "arana"', 'model = "arena"'),
        ("center_distance_mm = 91.5", "center_distance_mm = 80.0"),
        ('[[bearing]]\nname = "bearing_1"', '[[bearing]]\ndrug = 1\nname = "bearing_1"'),
        ("outside_diameter_mm = 90.0", "outside_diameter_mm = 900.0"),
        ("height_m = { value = 0.215", "heigth_m = { value = 0.215"),
        ("foundation = true", "foundation = false"),
        ("foundation_conductance_W_K = { value = 0.0", "foundation_conductance_W_K = { value = 3.0"),
        ("value = 0.9, sd", "value = 900.0, sd"),
        ("temperature_degC = { value = [-20.0, 200.0]", 'temperature_degC = { value = ["cold", 200.0]'),
        ("speed_rpm = { value = [1.0, 6500.0]", "speed_rpm = { value = [6500.0, 1.0]"),
    )) == {
        "fzg.toml: stage.friction.model: 'arena' is not one of its values; did you mean 'arana'?",
        "fzg.toml: stage: gear pair: centre distance 80 mm must be above 84.572 mm, the sum of the base radii; profile "
        "shifts 0.182 and 0.172 ask for 91.503 mm",
        *(f"fzg.toml: bearing 'bearing_{i}'.drug is not a known key; did you mean 'drag'?" for i in range(1, 5)),
        *(f"fzg.toml: bearing 'bearing_{i}': outside_diameter_mm = 900 is 30 times bore_mm = 30; rolling bearings have "
          "up to 4 times, above 5 is refused: correct one of them" for i in range(1, 5)),
        "fzg.toml: housing.heigth_m is not a known key; did you mean 'height_m'?",
        "fzg.toml: housing: foundation_conductance_W_K is above 0, but no part stands on the foundation; set "
        "foundation = true for one of them",
        "fzg.toml: oil.volume_l: 900 l does not go into the housing, whose inside_area_m2 = 0.149 encloses 5.41 l at "
        "most: were millilitres meant?",
        "fzg.toml: training.temperature_degC #1: must be a number, not 'cold'",
        "fzg.toml: training: speed_rpm: the lower bound 6500 is not below the upper bound 1",
    }  # fmt: skip


def test_shafts_are_held_against_gears_whatever_is_wrong_with_the_stage() -> None:
    lines = faults(('model = "arana"', 'model = "arena"'), ("value = 24.0, sd =", "value = 64.0, sd ="))
    assert lines == [
        "fzg.toml: shaft 'shaft_1'.diameter_mm: 64 mm is not below the root diameter 62.39 mm of the gear 'pinion' on "
        "it",
        "fzg.toml: stage.friction.model: 'arena' is not one of its values; did you mean 'arana'?",
    ]


def test_a_fault_of_one_value_is_one_fault() -> None:
    """Nothing follows from a value that is not valid."""
    assert faults(("value = 0.45,", "value = 45,")) == [
        "fzg.toml: housing.part 'housing_lower'.area_fraction: 45 is above 1 (plausible: 0.01 to 1): was percent meant?"
    ]
    assert faults(('driven = "shaft_2"', 'driven = "shaft_1"')) == [
        "fzg.toml: stage: driver and driven are both 'shaft_1'; a stage joins two shafts"
    ]
    assert len(faults(("load_share = { value = 0.5,", "load_share = { value = 5.0,"))) == 4  # each bearing's own


def test_shares_are_added_up_whatever_else_is_wrong_with_a_bearing() -> None:
    lines = faults(
        ("load_share = { value = 0.5,", "load_share = { value = 0.4,"),
        ('name = "bearing_1"\nshaft', 'name = "bearing_1"\ndrug = 1\nshaft'),
    )
    assert "fzg.toml: bearing: load_share of the bearings on 'shaft_1' sum to 0.8, not to 1" in lines
    assert len(lines) == 6


def test_a_default_does_not_stand_for_a_wrong_value() -> None:
    """The pair is held against neither the given nor the default angle, because the given one is none."""
    changes = (
        ("helix_angle_deg = 0.0", 'helix_angle_deg = "0"'),
        ("center_distance_mm = 91.5", "center_distance_mm = 80.0"),
    )
    assert faults(*changes) == ["fzg.toml: stage.helix_angle_deg: must be a number, not '0'"]


def test_entries_of_lists_are_named_as_the_file_names_them() -> None:
    lines = faults(('name = "bearing_3"\nlike = "bearing_1"', 'name = "bearing_1"\nlike = "bearing_1"\nmodle = 1'))
    assert "fzg.toml: bearing #3.modle is not a known key; did you mean 'model'?" in lines
    lines = faults(("[[bearing]]", '[[stage]]\ndriver = "shaft_1"\n[[bearing]]'))
    assert "fzg.toml: stage #2.driven is missing" in lines


def test_changes_by_path_are_answered_by_path() -> None:
    with pytest.raises(InputError, match=r"^fzg.toml: bearing\.0: mass_kg = 750 does not fit"):
        load_gearbox("fzg").with_values({"bearing.0.mass_kg": 750.0})


@pytest.mark.parametrize("name", ["fzg", "conveyor", "la_haute_borne"])
def test_what_comes_with_the_package_is_plausible(name: str) -> None:
    assert load_gearbox(name).name


@pytest.mark.parametrize("table", ["ambient", "oil", "housing", "training", "stage", "shaft", "bearing"])
def test_every_required_table_is_missed(table: str) -> None:
    document = tomllib.loads(FZG)
    del document[table]
    with pytest.raises(InputError, match=f"(?m)^x.toml: {table} is missing$"):
        read_gearbox(as_toml(document), file="x.toml")


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


def test_a_rewritten_file_is_the_same_gearbox() -> None:
    """The writer of the tests below keeps what a file says."""
    assert read_gearbox(as_toml(tomllib.loads(FZG)), file="x.toml").hash == load_gearbox("fzg").hash


def refused_or_read(text: str) -> None:
    """Read a text; anything but a gearbox or an InputError that names the file fails the test."""
    try:
        read_gearbox(text, file="x.toml")
    except InputError as refusal:
        if not str(refusal).startswith("x.toml: "):
            raise


@given(st.text(max_size=200))
def test_garbage_text_is_refused(text: str) -> None:
    refused_or_read(text)


KEYS = st.sampled_from(["value", "sd", "source", "name", "x"])
TEXT = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=10)
VALUE = st.recursive(
    st.one_of(st.integers(-(2**70), 2**70), st.floats(), st.booleans(), TEXT, st.just(2**2000)),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(KEYS, inner, max_size=3),
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
     FZG.replace("z = [16, 24]", f"z = [{2**2000}, 24]"),
     FZG.replace("sd = 0.01,", f"sd = 0x{'f' * 5000},"), FZG.replace("value = 0.0863", f"value = 0x{'f' * 5000}"),
     FZG + "\n[oil.x" + ".y" * 200 + "]\n", "value = 1\n" + FZG, 'schema = 1\nvalue = 3\nsource = "x"'],
    ids=["keys", "lists", "huge schema", "huge integer", "huge teeth", "huge sd", "huge value", "tables", "on top",
         "value only"],
)  # fmt: skip
def test_absurd_documents_are_refused(text: str) -> None:
    with pytest.raises(InputError, match=r"x\.toml: "):
        read_gearbox(text, file="x.toml")


def test_a_table_like_an_earlier_one_takes_its_values_and_annotations() -> None:
    gearbox = load_gearbox("fzg")
    assert gearbox.bearing[3].R1 == gearbox.bearing[0].R1
    assert gearbox.bearing[3].shaft == "shaft_2"
    assert gearbox.priors["bearing.3.mu_bl"] == gearbox.priors["bearing.0.mu_bl"]
    assert gearbox.source_of("bearing.3.K_rs") == gearbox.source_of("bearing.0.K_rs")


@pytest.mark.parametrize(
    ("like", "hint"), [("bearing_l", "did you mean 'bearing_1'?"), ("bearing_2", "did you mean 'bearing_1'?")]
)
def test_like_names_an_earlier_table(like: str, hint: str) -> None:
    text = FZG.replace('name = "bearing_2"\nlike = "bearing_1"', f'name = "bearing_2"\nlike = "{like}"')
    with pytest.raises(InputError) as caught:
        read_gearbox(text, file="fzg.toml")
    assert f"bearing 'bearing_2'.like: '{like}' is no earlier bearing; {hint}" in str(caught.value)


def test_a_table_that_could_not_be_filled_is_one_fault() -> None:
    assert len(faults(('named = "FZG_mineral_32"', 'named = "FZG_mineral_23"'))) == 1
    assert len(faults(('name = "bearing_2"\nlike = "bearing_1"', 'name = "bearing_2"\nlike = "nobody"'))) == 1
