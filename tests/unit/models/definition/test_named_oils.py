"""Named oils: constants against the tables they come from, and what a gearbox file may override."""

from __future__ import annotations

import re

import pytest

from models.assembly.gearbox import load_gearbox, read_gearbox
from models.base.errors import InputError
from models.definition.named_oils import known_oils, lubricant, named_oil, read_oil
from models.files.toml_file import packaged, read_text

FZG = read_text(packaged("gearboxes", "fzg"))
NAMES = known_oils()

# Kinematic viscosity [mm2/s] at 40, 60, 80, 90, 100 degC: FEUP's table, printed with two decimals.
FEUP_VISCOSITY = {
    "MINR": (316.0, 103.25, 43.68, 30.56, 22.23),
    "MINE": (325.88, 134.76, 66.17, 48.77, 36.98),
    "PAOR": (311.56, 124.98, 60.18, 44.06, 33.23),
    "ESTF": (321.84, 129.9, 62.77, 46.01, 34.72),
    "ESTR": (299.64, 117.6, 55.86, 40.71, 30.59),
    "PAGD": (287.34, 141.46, 78.55, 60.72, 47.92),
    "P150": (148.94, 64.52, 33.15, 24.97, 19.33),
    "FVA3": (99.39, 39.35, 19.28, 14.33, 10.99),
}
# Arana et al. 2019, Tables 2 and 3: nu_40, nu_100, density at 15.6 degC, Lambda, a1, a2, b1, b2.
ARANA = {
    "N100": (97.9, 8.61, 900.0, 0.053, -7.23e7, 3.48e5, 5.00e-3, -1.83e-5),
    "M100": (96.0, 10.6, 882.0, 0.047, -2.28e7, 2.26e5, -6.82e-2, 2.768e-4),
    "PAO100": (94.1, 14.0, 840.0, 0.035, -5.73e7, 3.90e5, -3.95e-2, 2.354e-4),
}


GRADES = (100, 150, 220, 320, 460)  # ISO 3448: the middle of the viscosity at 40 degC, [mm2/s]
# ASTM D2270: L = a Y^2 + b Y + c and H = d Y^2 + e Y + f, for a viscosity Y at 100 degC from the first number on.
D2270 = (
    (7.7, 0.41858, 16.1558, -56.040, 0.05794, 10.5156, -28.240),
    (9.0, 0.88779, 7.5527, -16.600, 0.26665, 6.7015, -10.810),
    (12.0, 0.76720, 10.7972, -38.180, 0.20073, 8.4658, -22.490),
    (15.0, 0.97305, 5.3135, -2.200, 0.28889, 5.9741, -4.930),
    (18.0, 0.97256, 5.2500, -0.980, 0.24504, 7.4160, -16.730),
    (22.0, 0.91413, 7.4759, -21.820, 0.20323, 9.1267, -34.230),
    (28.0, 0.87031, 9.7157, -50.770, 0.18411, 10.1015, -46.750),
)


def viscosity_index(nu_40: float, nu_100: float) -> float:
    """Index up to 100 after ASTM D2270."""
    a, b, c, d, e, f = next(row[1:] for row in reversed(D2270) if nu_100 >= row[0])
    low, high = a * nu_100**2 + b * nu_100 + c, d * nu_100**2 + e * nu_100 + f
    return 100.0 * (low - nu_40) / (low - high)


def test_the_viscosity_index_is_that_of_the_standard() -> None:
    assert viscosity_index(73.30, 8.86) == pytest.approx(92.0, abs=0.5)  # the example of ASTM D2270


@pytest.mark.parametrize("grade", GRADES)
def test_a_grade_has_its_middle_viscosity_and_a_typical_index(grade: int) -> None:
    oil = lubricant(named_oil(f"ISO_VG_{grade}"))
    nu_40, nu_100 = (float(oil.kinematic_viscosity(T)) for T in (40.0, 100.0))
    assert nu_40 == pytest.approx(grade)
    assert viscosity_index(nu_40, nu_100) == pytest.approx(95.0, abs=0.2)
    assert all(source.startswith("typical") for source in read_oil(f"ISO_VG_{grade}")[1].sources.values())


def test_every_source_table_has_its_oils() -> None:
    assert set(NAMES) == {*FEUP_VISCOSITY, *ARANA, *(f"ISO_VG_{grade}" for grade in GRADES), "FZG_mineral_32"}


@pytest.mark.parametrize("name", NAMES)
def test_every_oil_is_valid_and_every_constant_has_a_source(name: str) -> None:
    fluid = named_oil(name)
    values, notes = read_oil(name)
    assert fluid.gold is not None, "both pressure-viscosity laws can be chosen where the constants exist"
    assert all(notes.source_of(key).strip() for key in values)
    assert not notes.faults
    assert "limiting_shear_coefficient" in notes.priors


@pytest.mark.parametrize("name", FEUP_VISCOSITY)
def test_viscosity_of_the_feup_oils(name: str) -> None:
    oil = lubricant(named_oil(name))
    for T, nu in zip((40.0, 60.0, 80.0, 90.0, 100.0), FEUP_VISCOSITY[name], strict=True):
        assert float(oil.kinematic_viscosity(T)) == pytest.approx(nu, abs=0.0051)  # half of the last printed digit


@pytest.mark.parametrize("name", ARANA)
def test_constants_of_the_arana_oils(name: str) -> None:
    nu_40, nu_100, density, shear, a1, a2, b1, b2 = ARANA[name]
    fluid, oil = named_oil(name), lubricant(named_oil(name))
    assert float(oil.kinematic_viscosity(40.0)) == pytest.approx(nu_40, rel=1e-12)
    assert float(oil.kinematic_viscosity(100.0)) == pytest.approx(nu_100, rel=1e-12)
    assert float(oil.density(15.6)) == pytest.approx(density, rel=1e-15)
    assert fluid.limiting_shear_coefficient == shear
    assert (oil.a1, oil.a2, oil.b1, oil.b2) == pytest.approx((a1, a2, b1, b2), rel=1e-12)  # not scaled: own viscosity


def test_modulus_constants_are_carried_to_another_viscosity() -> None:
    """The worked scaling of M100 to the rig's oil: A grows by (96 / 32.63)^0.139 = 1.162; B stays."""
    oil, measured = load_gearbox("fzg").lubricant(), ARANA["M100"]
    assert oil.a2 / measured[5] == pytest.approx(1.162, abs=5e-4)
    assert oil.a1 / measured[4] == pytest.approx(oil.a2 / measured[5], rel=1e-12)
    assert (oil.b1, oil.b2) == (measured[6], measured[7])


@pytest.mark.parametrize("name", NAMES)
def test_gold_exponents_are_not_swapped(name: str) -> None:
    """Gold's coefficient at 60 degC is 10 to 20 1/GPa for every lubricating oil; the swapped pair gives 2 to 14."""
    oil = lubricant(named_oil(name))
    alpha = oil.gold_s * float(oil.kinematic_viscosity(60.0)) ** oil.gold_t
    assert 10.0 < alpha < 20.0
    assert 0.1 < oil.gold_t < 0.2


def test_oils_of_no_measured_pressure_constants_use_roelands() -> None:
    assert {name for name in NAMES if named_oil(name).pressure_viscosity == "roelands"} == {"ESTF", "ESTR", "PAGD"}


def test_assumptions_are_flagged() -> None:
    for name in ("ESTF", "ESTR"):
        assert "assumed" in read_oil(name)[1].source_of("limiting_shear_coefficient")
    for name in ("MINR", "PAOR", "P150", "FVA3", "MINE"):
        assert "assumption" in read_oil(name)[1].source_of("modulus.a1_Pa")


def with_oil(table: str) -> str:
    return FZG.replace('named = "FZG_mineral_32"', table)


@pytest.mark.parametrize("name", NAMES)
def test_every_named_oil_fills_the_rig(name: str) -> None:
    gearbox = read_gearbox(with_oil(f'named = "{name}"'), file="x.toml")
    assert gearbox.oil.named == name
    assert gearbox.lubricant() == lubricant(named_oil(name))
    assert gearbox.oil.volume_l == 0.9


def test_a_file_overrides_its_named_oil_value_by_value() -> None:
    oil = 'named = "MINR"\ndensity_kg_m3 = { value = 890.0, source = "measured" }\nschlenk_X_L = 0.9'
    gearbox = read_gearbox(with_oil(oil), file="x.toml")
    assert gearbox.oil.density_kg_m3 == 890.0
    assert gearbox.source_of("oil.density_kg_m3") == "measured"
    assert gearbox.source_of("oil.schlenk_X_L") == "the paper, Tables 1, 2, 4 and 5"  # the file's own, not the oil's
    assert "FEUP" in gearbox.source_of("oil.d341.m")
    assert "oil.schlenk_X_L" not in gearbox.priors  # the oil's sd belongs to the oil's value
    assert gearbox.priors["oil.thermal_expansion_1_K"] == pytest.approx(5.8e-5, rel=1e-12)


def test_measured_viscosities_replace_the_line_of_a_named_oil() -> None:
    points = "viscosity_points = [[40.0, 300.0], [100.0, 21.0]]"
    gearbox = read_gearbox(with_oil(f'named = "MINR"\n{points}'), file="x.toml")
    assert gearbox.oil.d341 is None
    assert gearbox.lubricant().nu_40 == pytest.approx(300.0, rel=1e-12)


def test_a_law_without_its_constants_is_refused() -> None:
    with pytest.raises(
        InputError,
        match=re.escape("oil: pressure_viscosity = 'modulus' needs [oil.modulus] with a1_Pa, a2_Pa_per_K, b1"),
    ):
        read_gearbox(with_oil('named = "ESTR"\npressure_viscosity = "modulus"'), file="x.toml")


def test_an_oil_without_a_name_of_ours_needs_every_value() -> None:
    with pytest.raises(InputError) as caught:
        read_gearbox(with_oil('name = "mine"\nbase = "pao"'), file="x.toml")
    missing = {
        "density_kg_m3",
        "thermal_expansion_1_K",
        "pressure_viscosity",
        "limiting_shear_coefficient",
        "schlenk_X_L",
    }
    assert set(str(caught.value).splitlines()) == {f"x.toml: oil.{key} is missing" for key in missing}


def test_unknown_oil() -> None:
    with pytest.raises(InputError, match=re.escape("there is no oil named 'M10'; did you mean 'M100'?")):
        named_oil("M10")
