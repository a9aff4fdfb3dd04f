"""Tables of a definition: what a key means that is left open, and values in SI where the two of a pair differ."""

from __future__ import annotations

import pytest

from models.assembly.gearbox import Gearbox, load_gearbox
from models.definition.bearing_section import Bearing
from models.definition.sections import (
    Churning,
    Fluid,
    Housing,
    HousingPart,
    Material,
    Rolling,
    Seal,
    Section,
    Shaft,
    Stage,
)

# A file of schema 1 that leaves a number or a switch open means this one, today and later.
DEFAULTS: dict[type[Section], dict[str, float | bool]] = {
    Bearing: {"K_rs": 3e-8, "mu_bl": 0.12},  # SKF, Rolling bearings, 2016: low oil bath
    Seal: {"temperature_coefficient": 1.6},  # ISO/TR 14179-2, Linke
    Rolling: {"constant_N_m2": 9.0e7},  # Anderson and Loewenthal
    Churning: {"C_Sp": 1.0},  # Mauz: no splash guard
    Fluid: {"density_temperature_degC": 15.0},  # as data sheets state density
    # case-hardening steel
    Material: {"youngs_modulus_GPa": 206.0, "poisson": 0.3, "density_kg_m3": 7830.0, "specific_heat_J_kgK": 465.0,
               "conductivity_W_mK": 46.0},
    Shaft: {"conductivity_W_mK": 46.0, "surface_to_air": False},
    # grey cast iron
    Housing: {"density_kg_m3": 7200.0, "specific_heat_J_kgK": 500.0, "foundation_conductance_W_K": 0.0},
    HousingPart: {"foundation": False},
    Stage: {"helix_angle_deg": 0.0, "tip_shortening": True},
}  # fmt: skip


@pytest.mark.parametrize("section", DEFAULTS, ids=lambda section: section.__name__)
def test_a_value_left_open(section: type[Section]) -> None:
    found = {key: field.default for key, field in section.model_fields.items() if type(field.default) in (float, bool)}
    assert found == DEFAULTS[section]


def test_constants_of_a_bearing_left_open(fzg: Gearbox) -> None:
    """SKF, Rolling bearings, 2016: cylindrical roller bearings with cage, deep groove ball bearings; mineral oil."""
    left_open = fzg.bearing[0].model_dump(exclude={"K_Z", "K_L", "mu_EHL", "S1", "S2"}, exclude_none=True)
    roller = Bearing.model_validate(left_open | {"S2": 0.0015})
    assert (roller.K_Z, roller.K_L, roller.mu_EHL) == (5.1, 0.65, 0.02)
    ball = Bearing.model_validate(left_open | {"type": "deep_groove_ball", "S1": 0.003})
    assert (ball.K_Z, ball.K_L, ball.mu_EHL) == (3.1, None, 0.05)


def test_choices_left_open_are_those_of_the_paper(fzg: Gearbox) -> None:
    """The FZG file states every choice that a file may leave open, after the paper."""
    for given in (fzg.stage[0], fzg.stage[0].friction, *fzg.bearing, *fzg.shaft):
        fields = type(given).model_fields
        choices = {key: field.default for key, field in fields.items() if isinstance(field.default, str)}
        if choices.pop("roughness", None):  # "mean", that of Doleschel's law, is written out
            assert fzg.stage[0].friction.asperity_load_share == "doleschel"
        assert {key: getattr(given, key) for key in choices} == choices


def test_pairs_keep_their_order() -> None:
    """Each of the pair has its own bore and tip diameter, driver first."""
    conveyor = load_gearbox("conveyor")
    tips = tuple(2e3 * radius for radius in conveyor.stage[0].pair().r_a)
    given = conveyor.with_values({"stage.0.tip_diameter_mm": [tips[0] - 0.2, tips[1] - 0.4]}).stage[0]
    assert given.bore_radius == pytest.approx((0.016, 0.025), rel=1e-15)
    assert given.pair().r_a == pytest.approx((0.5e-3 * tips[0] - 1e-4, 0.5e-3 * tips[1] - 2e-4), rel=1e-12)


@pytest.mark.parametrize(
    ("changes", "length"),
    [({}, 0.0), ({"surface_to_air": True}, 0.223), ({"surface_to_air": True, "length_in_air_mm": 60.0}, 0.06),
     ({"surface_to_air": True, "length_in_air_mm": 223.0}, 0.223)],
)  # fmt: skip
def test_length_in_air(fzg: Gearbox, changes: dict[str, float], length: float) -> None:
    """Nothing inside the box, else the whole shaft unless a part of it is given."""
    shaft = fzg.with_values({f"shaft.0.{key}": value for key, value in changes.items()}).shaft[0]
    assert shaft.length_in_air == pytest.approx(length, rel=1e-15)
