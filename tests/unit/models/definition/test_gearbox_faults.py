"""Messages about faults of a gearbox file: file, table, key, value, limit; and no other exception for any document."""

from __future__ import annotations

import json
import tomllib

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from models.assembly.gearbox import load_gearbox, read_gearbox
from models.base.errors import InputError
from tests.unit.models.fzg_file import FZG, edited

THIRD_SHAFT = '[[shaft]]\nname = "shaft_3"\nlength_mm = 90.0\ndiameter_mm = 20.0\n[[bearing]]'


def message_about(text: str) -> str:
    with pytest.raises(InputError) as caught:
        read_gearbox(text, file="fzg.toml")
    message = str(caught.value)
    assert all(line.startswith("fzg.toml: ") for line in message.splitlines())
    return message


# What is written in place of what in the FZG file, and what one line of the message must contain.
FAULTS = [
    # keys
    ("face_width_mm = 14.0", "facewidth_mm = 14.0", "stage: 'facewidth_mm' ; did you mean 'face_width_mm'?"),
    ("[ambient]", "[ambient]\nhumidty = 1", "ambient: 'humidty' ; known are: air_speed_m_s, temperature"),
    ("mu_solid =", "mu_solids =", "stage.friction: 'mu_solids' ; did you mean 'mu_solid'?"),
    ("[housing]", "[housings]\n[housing]", "'housings' is not a known key; did you mean 'housing'?"),
    ("{ value = 0.45,", "{ value = 0.45, std = 1,", "housing.part 'housing_lower'.area_fraction: 'std' ; 'sd'?"),
    ("air_speed_m_s = { value = 2.0, sd = 0.3, source", "# source", "ambient.air_speed_m_s is missing"),
    ('source = "the paper, Tables 1, 2, 4 and 5"\n', "", "source is missing"),
    ('source = "the paper, Tables 1, 2, 4 and 5"\n', "source = 3\n", "source: must be a text"),
    ("schema = 1", "schema = 2", "schema is 2; gearbox definitions of schema 1"),
    ("schema = 1", "schema = true", "schema is True"),
    ("schema = 1", "", "schema is None"),
    ("face_width_mm = 14.0", "face_width_mm = 14,0", "is not valid TOML: line , column"),
    # types
    ("[training]", "[[training]]", "training: must be a table"),
    ("face_width_mm = 14.0", 'face_width_mm = "14 mm"', "stage.face_width_mm: must be a number, not '14 mm'"),
    ("face_width_mm = 14.0", "face_width_mm = nan", "stage.face_width_mm: must be finite, not nan"),
    ("z = [16, 24]", "z = [16.0, 24]", "stage.z #1: must be a whole number, not 16.0"),
    ("z = [16, 24]", "z = [16]", "stage.z #2 is missing"),
    ("z = [16, 24]", "z = [16, 24, 40]", "stage.z: has too many entries"),
    ("z = [16, 24]", "z = 16", "stage.z: must be a list, not 16"),
    ("surface_to_air = false", "surface_to_air = 0", "shaft 'shaft_1'.surface_to_air: must be true or false, not 0"),
    ('designation = "NU 406"', "designation = 406", "bearing 'bearing_1'.designation: must be a text, not 406"),
    ('name = "seal_2"', 'name = "seal 2"', "seal 'seal 2'.name: 'seal 2' must be a name of letters"),
    ('model = "arana"', 'model = "arena"', "stage.friction.model: 'arena' ; did you mean 'arana'?"),
    # units by magnitude
    ("face_width_mm = 14.0", "face_width_mm = 0.014", "stage.face_width_mm: 0.014 mm 1 to 1000 mm were metres meant?"),
    ("= 20.0\nhelix", "= 0.349\nhelix", "stage.pressure_angle_deg: 0.349 deg 10 to 35 deg were radians meant?"),
    ("modulus_GPa = 206.0", "modulus_GPa = 206000.0", "stage.material.youngs_modulus_GPa: 500 GPa were MPa meant?"),
    ("value = 27.0, sd = 1.0", "value = 300.15, sd = 1.0", "ambient.temperature_degC: 300.15 degC was kelvin meant?"),
    ("value = 7200.0", "value = 7.2", "housing.density_kg_m3: 7.2 kg/m3 900 to 12000 kg/m3 were g/cm3 meant?"),
    ("value = 0.45,", "value = 45,", "housing.part 'housing_lower'.area_fraction: 45 was percent meant?"),
    ("value = 0.024, sd", "value = 24.0, sd", "housing.wall_thickness_m: 24 m 0.3 m were millimetres meant?"),
    # fractions and coefficients
    ("poisson = 0.3", "poisson = 0.6", "stage.material.poisson: 0.6 is above 0.49 (plausible: 0 to 0.49)"),
    ("value = 0.9, sd = 0.05", "value = 1.2, sd = 0.05", "housing.emissivity: 1.2 is above 1 (plausible: 0 to 1)"),
    ("value = 0.55, source", "value = 1.55, source", "housing.part 'housing_upper'.area_fraction: 1.55 is above 1"),
    ("load_share = { value = 0.5,", "load_share = { value = -0.5,", "bearing 'bearing_1'.load_share: -0.5 is below 0"),
    ("value = 0.0863,", "value = 0.863,", "stage.friction.mu_solid: 0.863 is above 0.3"),
    ("mu_EHL = { value = 0.02,", "mu_EHL = { value = 0.6,", "bearing 'bearing_1'.mu_EHL: 0.6 is above 0.5"),
    ("value = 3.0e-8,", "value = 3.0e-2,", "bearing 'bearing_1'.K_rs: 0.03 is above 1e-06"),
    ("R1 = { value = 1.0e-6", "R1 = { value = 1.0", "bearing 'bearing_1'.R1: 1 is above 0.0001"),
    (
        'type = "cylindrical_roller"',
        'type = "deep_groove_ball"',
        "bearing 'bearing_1': S1 is missing of a deep_groove_",
    ),
    ("value = 1.6, sd = 0.3", "value = -1.6, sd = 0.3", "seal 'seal_1'.temperature_coefficient: -1.6 is below 0"),
    # annotations
    ("sd = 0.01,", "sd = -0.01,", "stage.friction.mu_solid: sd must be a number above 0 or a text such as '20 %'"),
    ("sd = 0.01,", 'sd = "10",', "stage.friction.mu_solid: sd must be a number above 0"),
    ("z = [16, 24]", "z = { value = [16, 24], sd = 1 }", "stage.z #1: is a whole number and cannot have an sd"),
    ('"NU 406"', '{ value = "NU 406", sd = 1 }', "bearing 'bearing_1'.designation: only a number can have an sd"),
    ('157], sd = "15 %"', "157], sd = [0.1]", "stage.roughness_Ra_um: has 2 values but 1 sd"),
    ("[stage.churning]", "[stage.churning]\nsd = 1", "stage.churning.sd: has no value"),
    # what another table or file fills
    ('named = "FZG_mineral_32"', 'named = "FZG_mineral_46"', "oil.named: 'FZG_mineral_46'; 'FZG_mineral_32'?"),
    ('named = "FZG_mineral_32"', "named = 32", "oil.named: must be a text, not 32"),
    ('like = "bearing_1"', 'like = "bearing_l"', "bearing 'bearing_2'.like: 'bearing_l' ; did you mean 'bearing_1'?"),
    ('name = "bearing_1"\n', "", "bearing 'bearing_2'.like: 'bearing_1' is no earlier bearing"),
    ('like = "bearing_1"', 'like = "bearing_2"', "bearing 'bearing_2'.like: 'bearing_2' is no earlier bearing"),
    # within a table
    ("[oil]", "[oil]\nviscosity_points = [[40.0, 5.45], [100.0, 32.63]]", "oil: 32.63 mm2/s at 100 degC hotter"),
    ("[oil]", "[oil]\nviscosity_points = [[40.0, 9.0], [40.0, 5.45]]", "oil: viscosity_points are both at 40 degC"),
    ("[oil]", "[oil]\nviscosity_points = [[313.15, 9.0], [100.0, 5.0]]", "oil.viscosity_points #1 #1: 313.15 kelvin"),
    ("[oil]", "[oil]\nd341 = { m = 9.5, n = 3.75 }\nviscosity_points = [[40.0, 9.0], [100.0, 5.0]]", "oil: not both"),
    ("[oil]", "[oil]\nd341 = { m = 4.0, n = 7.0 }", "d341: m = 4, n = 7 give 0.3 mm2/s at 40 degC"),
    ("[oil]", "[oil]\nd341 = { m = 16.0, n = 1.0 }", "d341: m = 16, n = 1 give inf mm2/s at 40 degC"),
    ("[oil]", "[oil]\ngold = { s = 0.139, t = 0.9904 }", "oil.gold.s: 0.139 is below 2"),
    ("[oil]", '[oil]\nname = "x"\npressure_viscosity = "roelands"\ngold = 1', "oil.gold: must be a table, not 1"),
    ("surface_to_air = false", "length_in_air_mm = 50.0", "shaft 'shaft_1': length_in_air_mm is 50, set it to true"),
    (
        "surface_to_air = false",
        "surface_to_air = true\nlength_in_air_mm = 300.0",
        "shaft 'shaft_1': length_in_air_mm is 300, more than length_mm, which is 223",
    ),
    ("helix_angle_deg = 0.0", "helix_angle_deg = 50.0", "stage.helix_angle_deg: 50 deg is above 45 deg"),
    ("value = [0.182, 0.172]", "value = [-0.4, 0.754]", "stage: gear pair: profile shift -0.4 undercuts"),
    ("center_distance_mm = 91.5", "center_distance_mm = 80.0", "stage: gear pair: centre distance 80 mm"),
    ("value = [30.0, 30.0]", "value = [62.4, 30.0]", "stage: bore_mm of 'pinion' is 62.4, root diameter 62.39 mm"),
    ('driven = "shaft_2"', 'driven = "shaft_1"', "stage: driver and driven are both 'shaft_1'"),
    ("diameter_mm = 90.0", "diameter_mm = 30.0", "bearing 'bearing_1': outside_diameter_mm = 30 bore_mm = 30"),
    ("diameter_mm = 90.0", "diameter_mm = 900.0", "bearing 'bearing_1': outside_diameter_mm = 900 is 30 times 5"),
    ("value = 0.45,", "value = 0.4,", "housing: area_fraction sum to 0.95, not to 1"),
    ("value = [1.0, 6500.0]", "value = [6500.0, 1.0]", "training: speed_rpm: lower bound 6500 upper bound 1"),
    # between tables
    (
        "value = 24.0, sd =",
        "value = 62.4, sd =",
        "shaft 'shaft_1'.diameter_mm: 62.4 mm root diameter 62.39 mm 'pinion'",
    ),
    ('driven = "shaft_2"', 'driven = "shaft2"', "stage.driven: no shaft 'shaft2'; did you mean 'shaft_2'?"),
    (
        'name = "bearing_1"\nshaft = "shaft_1"',
        'name = "bearing_1"\nshaft = "x"',
        "'bearing_1'.shaft: no shaft 'x'",
    ),
    (
        'name = "seal_1"\nshaft = "shaft_1"',
        'name = "seal_1"\nshaft = "axle"',
        "'seal_1'.shaft: known are: shaft_1",
    ),
    ('name = "bearing_2"', 'name = "bearing_1"', "name 'bearing_1' is given 2 times"),
    ('name = "seal_2"', 'name = "T"', "name 'T' is taken by the model itself"),
    ('name = "FZG', 'name = "\\u0001FZG', "name:"),
    (
        "mass_kg = { value = 0.75",
        "mass_kg = { value = 75.0",
        "bearing 'bearing_1': mass_kg = 75, solid ring of steel of its size has 1.02 kg",
    ),
    (
        "diameter_mm = 24.0\nmodel",
        "diameter_mm = 240.0\nmodel",
        "seal 'seal_1'.diameter_mm: 240 mm on a shaft of 24 mm",
    ),
    (
        "diameter_mm = { value = 24.0",
        "diameter_mm = { value = 8.0",
        "bearing 'bearing_1'.bore_mm: 30 mm on a shaft of 8 mm",
    ),
    (
        "value = 0.215, sd = 0.005",
        "value = 0.1, sd = 0.005",
        "housing.height_m: 0.1 m is less than the tip diameter 0.1184 m",
    ),
    ("value = 0.149, sd", "value = 0.3, sd", "housing: inside_area_m2 = 0.3 is above outside_area_m2 = 0.214"),
    ('names = ["pinion", "wheel"]', 'names = ["gear", "gear"]', "name 'gear' is given 2 times"),
    ('name = "housing_lower"', 'name = "air"', "name 'air' is taken by the model itself; choose another"),
    ('name = "seal_2"', 'name = "total"', "name 'total' is taken by the model itself"),
    ('name = "mesh"\n', 'name = "mesch"\n', "node 'mesch': did you mean 'mesh'?"),
    ('name = "mesh"\n', 'name = "air"\n', "node 'air': is a boundary"),
    ("[[node]]", '[[node]]\nname = "mesh"\nheat_capacity_J_K = 1.0\n[[node]]', "node: 'mesh' is overridden 2 times"),
    ("h_air =", "h_iar =", "factors: 'h_iar' ; did you mean 'h_air'?"),
    ("mesh = { value = 1.0", "mesh = { value = -1.0", "factors.mesh: -1 is below 0.001"),
    ("value = 19.0, sd", "value = 250.0, sd", "oil.level_below_axis_mm: 250 mm height_m is 0.215; -155.8 to 155.8 mm"),
    ("volume_l = { value = 0.9,", "volume_l = { value = 900.0,", "oil.volume_l: 900 l do not fit even a ball 5.41 l"),
    ("load_share = { value = 0.5,", "load_share = { value = 0.4,", "bearing: load_share on 'shaft_1' sum to 0.8"),
    ("[[bearing]]", THIRD_SHAFT, "shaft 'shaft_3': no stage has it as driver or driven; leave it out"),
]


@pytest.mark.parametrize(("old", "new", "words"), FAULTS, ids=[new[:60] for _, new, _ in FAULTS])
def test_a_fault_is_named(old: str, new: str, words: str) -> None:
    """A line of the message contains all the words, in this order."""
    message = message_about(edited((old, new)))

    def contains(line: str) -> bool:
        position = 0
        for word in words.split(" "):
            position = line.find(word, position)
            if position < 0:
                return False
        return True

    assert any(contains(line) for line in message.splitlines()), message


def test_a_foundation_needs_a_part_on_it() -> None:
    conducts = ("foundation_conductance_W_K = { value = 0.0", "foundation_conductance_W_K = { value = 3.0")
    read_gearbox(edited(conducts), file="fzg.toml")
    assert "set foundation = true" in message_about(edited(conducts, ("foundation = true", "foundation = false")))


def test_a_misspelt_key_or_name_is_one_fault() -> None:
    """Nothing is reported that only follows from it."""
    for change in (
        ("face_width_mm = 14.0", "facewidth_mm = 14.0"),
        ("value = 0.45,", "value = 45,"),
        ('driven = "shaft_2"', 'driven = "shaft2"'),
        ('named = "FZG_mineral_32"', 'named = "FZG_mineral_23"'),
        ('name = "bearing_2"\nlike = "bearing_1"', 'name = "bearing_2"\nlike = "nobody"'),
    ):
        assert len(message_about(edited(change)).splitlines()) == 1, change


def test_faults_of_several_tables_come_at_once() -> None:
    values = message_about(
        edited(
            ("face_width_mm = 14.0", "facewidth_mm = 14.0"),
            ("air_speed_m_s = { value = 2.0", "air_speed_m_s = { value = -2.0"),
            ("value = 0.45,", "value = 0.4,"),
        )
    )
    assert len(values.splitlines()) == 3
    names = message_about(
        edited(
            ('name = "bearing_1"\nshaft = "shaft_1"', 'name = "bearing_1"\nshaft = "shaft_7"'),
            ("h_air =", "h_iar ="),
            ('name = "mesh"\n', 'name = "mesch"\n'),
        )
    )
    assert all(word in names for word in ("'shaft_7'", "'h_iar'", "'mesch'"))


@pytest.mark.parametrize("table", ["ambient", "oil", "housing", "training", "stage", "shaft", "bearing"])
def test_every_required_table_is_missed(table: str) -> None:
    document = tomllib.loads(FZG)
    del document[table]
    assert f"fzg.toml: {table} is missing" in message_about(as_toml(document)).splitlines()


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
     FZG.replace("sd = 0.01,", f"sd = 0x{'f' * 5000},"), FZG + "\n[oil.x" + ".y" * 200 + "]\n", "value = 1\n" + FZG,
     'schema = 1\nvalue = 3\nsource = "x"'],
    ids=["keys", "lists", "huge schema", "huge integer", "huge teeth", "huge sd", "tables", "on top", "value only"],
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
