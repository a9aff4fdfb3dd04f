"""Stiffness of a tooth pair: reference numbers, an independent quadrature, and limits in closed form."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from models.formulas.geometry import GearPair, gear_pair
from models.formulas.involute import half_tooth_angle
from models.formulas.mesh_stiffness import (
    foundation_compliance,
    hertz_compliance,
    tooth_compliance,
    tooth_pair_stiffness,
)

BORES = (15e-3, 15e-3)  # FZG: 30 mm shafts


@pytest.fixture(scope="module")
def pair() -> GearPair:
    """FZG type C."""
    return gear_pair(z=(16, 24), m_n=4.5e-3, alpha_n=math.radians(20.0), b=14e-3, a=91.5e-3, x=(0.182, 0.172))


def brute_force_compliance(pair: GearPair, gear: int, rho: float, E: float, nu: float) -> float:
    """The integral over the height y, its section found from the tooth thickness at the radius that lies at y."""
    r_b, r_f = pair.r_b[gear], pair.r_f[gear]

    def psi(r: float) -> float:
        return half_tooth_angle(z=pair.z[gear], x=pair.x[gear], alpha_n=pair.alpha_n, r_b=r_b, r=r)

    r_C = math.hypot(r_b, rho)
    y_C, x_C = r_C * math.cos(psi(r_C)), r_C * math.sin(psi(r_C))
    alpha_F = math.acos(r_b / r_C) - psi(r_C)
    G = E / (2.0 * (1.0 + nu))

    def integrand(y: float) -> float:
        r = brentq(lambda radius: radius * math.cos(psi(radius)) - y, 0.9 * r_f, 1.01 * r_C, xtol=1e-16)
        thickness = 2.0 * r * math.sin(psi(r))
        moment = math.cos(alpha_F) * (y_C - y) - math.sin(alpha_F) * x_C
        bending = moment**2 / (E * pair.b * thickness**3 / 12.0)
        return (
            bending
            + 1.2 * math.cos(alpha_F) ** 2 / (G * pair.b * thickness)
            + math.sin(alpha_F) ** 2 / (E * pair.b * thickness)
        )

    y_f, y_b = r_f * math.cos(psi(r_f)), r_b * math.cos(psi(r_b))
    knots = sorted({y_f, y_b, y_C} if r_f < r_b else {y_f, y_C})
    parts = pairwise(knots)
    return sum(float(quad(integrand, low, high, epsabs=0.0, epsrel=1e-9)[0]) for low, high in parts)


@pytest.mark.parametrize("fraction", [0.0, 0.3, 0.6, 1.0])
@pytest.mark.parametrize("gear", [0, 1])
def test_tooth_compliance_against_brute_force(pair: GearPair, gear: int, fraction: float) -> None:
    t = pair.T1A + fraction * (pair.T1E - pair.T1A)
    rho = (t, pair.T1T2 - t)[gear]
    ours = tooth_compliance(
        rho / pair.r_b[gear],
        psi_b=pair.virtual_tooth(gear)[0],
        r_b=pair.r_b[gear],
        r_f=pair.r_f[gear],
        b=pair.b,
        E=200e9,
        nu=0.28,
    )
    assert float(ours) == pytest.approx(brute_force_compliance(pair, gear, rho, 200e9, 0.28), rel=1e-7)


def test_many_teeth_have_their_root_above_the_base_circle() -> None:
    """Then there is no radial flank; the brute force agrees there too."""
    pair = gear_pair(z=(60, 80), m_n=2e-3, alpha_n=math.radians(20.0), b=20e-3, a=140e-3, x=(0.0, 0.0))
    assert pair.r_f[0] > pair.r_b[0]
    ours = tooth_compliance(
        pair.T1E / pair.r_b[0],
        psi_b=pair.virtual_tooth(0)[0],
        r_b=pair.r_b[0],
        r_f=pair.r_f[0],
        b=pair.b,
        E=206e9,
        nu=0.3,
    )
    assert float(ours) == pytest.approx(brute_force_compliance(pair, 0, pair.T1E, 206e9, 0.3), rel=1e-7)


def test_slender_tooth_is_a_cantilever() -> None:
    """Loaded at the base circle of a huge gear, a tooth is a straight beam: 4 L^3/(E b h^3) + 1.2 L/(G b h)."""
    E, nu, b, r_f, length, height = 206e9, 0.3, 10e-3, 1e3, 10e-3, 1e-3
    ours = tooth_compliance(0.0, psi_b=0.5 * height / r_f, r_b=r_f + length, r_f=r_f, b=b, E=E, nu=nu)
    beam = 4.0 * length**3 / (E * b * height**3) + 1.2 * length * 2.0 * (1.0 + nu) / (E * b * height)
    assert float(ours) == pytest.approx(beam, rel=1e-4)


def test_hertz_compliance_for_equal_steels_and_for_a_rigid_partner() -> None:
    equal = hertz_compliance(b=14e-3, E=(206e9, 206e9), nu=(0.3, 0.3))
    assert equal == pytest.approx(4.0 * 0.91 / (math.pi * 206e9 * 14e-3), rel=1e-12)
    assert hertz_compliance(b=14e-3, E=(206e9, 1e30), nu=(0.3, 0.3)) == pytest.approx(0.5 * equal, rel=1e-9)


def test_type_c_reference_numbers(pair: GearPair) -> None:
    """An independent calculation gives 7.8 / 11.4 / 7.6 N/(mm um) at A, C, E and 14.5 for the mesh, so printed."""
    k = tooth_pair_stiffness(pair, np.array([pair.T1A, pair.T1C, pair.T1E]), r_bore=BORES) / pair.b * 1e-9
    assert k == pytest.approx([7.8, 11.4, 7.6], abs=0.05)
    t = np.linspace(pair.T1A, pair.T1E, 2001)
    mean = np.trapezoid(tooth_pair_stiffness(pair, t, r_bore=BORES), t) / pair.p_b / pair.b * 1e-9
    assert mean == pytest.approx(14.5, abs=0.05)


def test_within_15_percent_of_iso_6336(pair: GearPair) -> None:
    """ISO 6336-1 method B gives c' = 0.8 / 0.06335 = 12.62 N/(mm um), stated there for stiff solid gears."""
    k_max = float(tooth_pair_stiffness(pair, pair.T1C, r_bore=BORES)) / pair.b * 1e-9
    assert 0.85 * 12.62 < k_max < 12.62


def test_stiffness_goes_with_width_and_modulus(pair: GearPair) -> None:
    t = np.array([pair.T1A, pair.T1D])
    k = tooth_pair_stiffness(pair, t, r_bore=BORES)
    soft = tooth_pair_stiffness(pair, t, r_bore=BORES, E=(103e9, 103e9))
    assert soft == pytest.approx(0.5 * k, rel=1e-12)
    wide = gear_pair(z=(16, 24), m_n=4.5e-3, alpha_n=math.radians(20.0), b=28e-3, a=91.5e-3, x=(0.182, 0.172))
    assert tooth_pair_stiffness(wide, t, r_bore=BORES) == pytest.approx(2.0 * k, rel=1e-12)


@pytest.mark.parametrize("gear", [0, 1])
def test_each_gear_has_its_own_material_and_bore(pair: GearPair, gear: int) -> None:
    """Compliances in series: making one gear rigid leaves the other's part, and the two parts give the whole."""
    rigid = (1e30, 206e9) if gear == 0 else (206e9, 1e30)
    other = (206e9, 1e30) if gear == 0 else (1e30, 206e9)
    whole = 1.0 / tooth_pair_stiffness(pair, pair.T1A, r_bore=BORES)
    parts = [1.0 / tooth_pair_stiffness(pair, pair.T1A, r_bore=BORES, E=E) for E in (rigid, other)]
    assert sum(parts) == pytest.approx(whole, rel=1e-12)
    nu = (0.2, 0.3) if gear == 0 else (0.3, 0.2)
    assert 1.0 / tooth_pair_stiffness(pair, pair.T1A, r_bore=BORES, nu=nu) != pytest.approx(whole, rel=1e-4)
    bores = (12e-3, 15e-3) if gear == 0 else (15e-3, 12e-3)
    assert 1.0 / tooth_pair_stiffness(pair, pair.T1A, r_bore=bores) != pytest.approx(whole, rel=1e-4)


def test_foundation_against_a_value_worked_by_hand() -> None:
    """theta_f = 0.1, h = 2, u_f/s_f = 0.5, tan(alpha_F) = 0: L/4 + M/2 + P with the printed coefficients."""
    L = -5.574e-5 / 0.01 - 1.9986e-3 * 4 - 2.3015e-4 * 20 + 4.7702e-3 * 10 + 0.0271 * 2 + 6.8045
    M = 60.111e-5 / 0.01 + 28.1e-3 * 4 - 83.431e-4 * 20 - 9.9256e-3 * 10 + 0.1624 * 2 + 0.9086
    P = -50.952e-5 / 0.01 + 185.5e-3 * 4 + 0.0538e-4 * 20 + 53.3e-3 * 10 + 0.2895 * 2 + 0.9236
    r_f = 50e-3
    r_b = r_f * 1.1  # so that u_f = 0.1 r_f and s_f = 0.2 r_f; the flank below the base circle is radial
    ours = foundation_compliance(0.1, psi_b=0.1, r_b=r_b, r_f=r_f, r_bore=25e-3, b=10e-3, E=2e11)
    assert float(ours) == pytest.approx((0.25 * L + 0.5 * M + P) / (2e11 * 10e-3), rel=1e-9)


def test_default_bore_is_a_third_of_the_root_radius(pair: GearPair) -> None:
    thirds = (pair.r_f[0] / 3.0, pair.r_f[1] / 3.0)
    assert tooth_pair_stiffness(pair, pair.T1C) == tooth_pair_stiffness(pair, pair.T1C, r_bore=thirds)
