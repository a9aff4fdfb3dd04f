"""Formulas of the lubricant: the independent evaluation's numbers, limits, and behaviour far outside the range."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from models.assembly.gearbox import load_gearbox
from models.formulas.oil import (
    T_HIGHEST,
    T_LOWEST,
    Oil,
    conductivity_cragoe,
    d341_constants,
    kinematic_viscosity_d341,
    pressure_viscosity_gold,
    specific_heat_cragoe,
)

OIL = load_gearbox("fzg").lubricant()
ROELANDS = replace(OIL, pressure_viscosity="roelands")


def test_viscosity_goes_through_its_two_points() -> None:
    m, n = d341_constants(40.0, 320.0, 100.0, 24.0)
    assert kinematic_viscosity_d341(np.array([40.0, 100.0]), m, n) == pytest.approx([320.0, 24.0], rel=1e-12)


def test_d341_against_din_51563() -> None:
    """The constant 0.7 against 0.8: 0.4 % apart at 60 to 80, 1.2 % at 20 and 3.2 % at 0 degC."""
    y = [np.log10(np.log10(nu + 0.8)) for nu in (32.63, 5.45)]
    x = [np.log10(T + 273.15) for T in (40.0, 100.0)]
    slope = (y[0] - y[1]) / (x[1] - x[0])
    for T, limit in ((60.0, 0.0045), (80.0, 0.0045), (20.0, 0.0125), (0.0, 0.0325)):
        din = 10.0**10.0 ** (y[0] - slope * (np.log10(T + 273.15) - x[0])) - 0.8
        assert OIL.kinematic_viscosity(T) == pytest.approx(din, rel=limit)


@pytest.mark.parametrize("T", [-20.0, 20.0, 60.0, 150.0])
def test_thermoviscosity_is_the_derivative_of_the_viscosity(T: float) -> None:
    h = 1e-3
    slope = -(np.log(OIL.dynamic_viscosity(T + h)) - np.log(OIL.dynamic_viscosity(T - h))) / (2.0 * h)
    assert OIL.thermoviscosity(T) == pytest.approx(slope, rel=1e-6)


def test_swapped_gold_exponents_would_be_seen() -> None:
    """The pair circulates swapped; it would give an eighth of the Modulus equation's coefficient."""
    swapped = float(np.asarray(pressure_viscosity_gold(15.41, 0.139, 0.9904)))
    assert swapped < 0.2 * float(OIL.pressure_viscosity_coefficient(60.0, 0.0))


@pytest.mark.parametrize("T", [40.0, 60.0, 90.0])
def test_film_coefficient_is_the_reciprocal_of_the_integral(T: float) -> None:
    """The series of the Modulus equation against quadrature to 1 GPa, beyond which nothing is left of the integrand."""

    def thinning(p: float) -> float:
        return float(np.exp(-OIL.pressure_viscosity_coefficient(T, p) * p))

    integral, _ = quad(thinning, 0.0, 1e9, points=[1e7, 1e8, 3e8], limit=200)
    assert OIL.film_pressure_viscosity_coefficient(T) == pytest.approx(1.0 / integral, rel=3e-3)


@pytest.mark.parametrize("T", [40.0, 90.0])
def test_roelands_film_coefficient_is_near_the_integral(T: float) -> None:
    """Arana's closed form is an approximation: within 1 % here."""
    integral, _ = quad(
        lambda p: float(np.exp(-ROELANDS.pressure_viscosity_coefficient(T, p) * p)), 0.0, 1e9, points=[1e7, 1e8, 3e8]
    )
    assert ROELANDS.film_pressure_viscosity_coefficient(T) == pytest.approx(1.0 / integral, rel=1e-2)


@pytest.mark.parametrize("T", [-20.0, 20.0, 60.0, 120.0])
def test_roelands_is_gold_at_the_pressure_that_gold_is_for(T: float) -> None:
    gold = pressure_viscosity_gold(OIL.kinematic_viscosity(T), OIL.gold_s, OIL.gold_t)
    assert ROELANDS.pressure_viscosity_coefficient(T, 0.2e9) == pytest.approx(np.asarray(gold), rel=1e-12)
    at_rest, little = (ROELANDS.pressure_viscosity_coefficient(T, p) for p in (0.0, 1e4))
    assert little == pytest.approx(at_rest, rel=1e-3)
    assert at_rest > 1.05 * gold


@pytest.mark.parametrize("T", [40.0, 60.0, 90.0])
def test_gold_is_the_modulus_equation_at_its_pressure(T: float) -> None:
    """Two sources for one oil, FVA 3 or scaled from it."""
    gold = float(pressure_viscosity_gold(OIL.kinematic_viscosity(T), OIL.gold_s, OIL.gold_t))
    assert OIL.pressure_viscosity_coefficient(T, 0.2e9) == pytest.approx(gold, rel=0.05)


def test_roelands_is_the_printed_exponential() -> None:
    """``eta = eta0 exp{(ln eta0 + 9.67)[(1 + p/1.96e8)^Z - 1]}`` at 1 GPa and 60 degC."""
    eta_0 = float(ROELANDS.dynamic_viscosity(60.0))
    alpha_0 = float(ROELANDS.pressure_viscosity_coefficient(60.0, 0.0))
    Z = alpha_0 * 1.96e8 / (np.log(eta_0) + 9.67)
    exponent = (np.log(eta_0) + 9.67) * ((1.0 + 1e9 / 1.96e8) ** Z - 1.0)
    assert ROELANDS.pressure_viscosity_coefficient(60.0, 1e9) * 1e9 == pytest.approx(exponent, rel=1e-9)


def test_measured_constants_replace_cragoe() -> None:
    T = np.array([20.0, 80.0])
    fixed = replace(OIL, specific_heat_constant=2000.0, conductivity_constant=0.14)
    assert fixed.specific_heat(T).tolist() == [2000.0, 2000.0]
    assert fixed.conductivity(T).tolist() == [0.14, 0.14]
    assert OIL.specific_heat(T) == pytest.approx(specific_heat_cragoe(T, OIL.rho_15))
    assert OIL.conductivity(T) == pytest.approx(conductivity_cragoe(T, OIL.rho_15))


@pytest.mark.parametrize("oil", [OIL, ROELANDS], ids=["modulus", "roelands"])
def test_finite_and_positive_at_any_temperature(oil: Oil) -> None:
    T = np.array([-273.0, -100.0, -60.0, -20.0, 200.0, 300.0, 400.0, 2000.0])
    for p in (0.0, 5e8, 2e9):
        alpha = oil.pressure_viscosity_coefficient(T, p)
        assert np.all(np.isfinite(alpha))
        assert np.all(alpha > 0.0)
        assert np.all(np.isfinite(np.exp(alpha * p)))
    for values in (
        oil.kinematic_viscosity(T), oil.density(T), oil.specific_heat(T), oil.conductivity(T), oil.thermoviscosity(T),
        oil.film_pressure_viscosity_coefficient(T),
    ):  # fmt: skip
        assert np.all(np.isfinite(values))
        assert np.all(values > 0.0)


def test_properties_are_held_outside_the_liquid_range() -> None:
    assert OIL.kinematic_viscosity(-200.0) == OIL.kinematic_viscosity(T_LOWEST)
    assert OIL.density(1000.0) == OIL.density(T_HIGHEST)
