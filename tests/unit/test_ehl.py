"""Line contact: worked numbers, scaling laws and limits of every correlation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from models import ehl
from models.gearbox import load_gearbox

GEARBOX = load_gearbox("fzg")
PAIR, OIL = GEARBOX.stage[0].pair(), GEARBOX.lubricant()
E_RED = ehl.reduced_modulus(206e9, 0.3, 206e9, 0.3)
# Pitch point at 1500 rpm, 200 N m, 60 degC.
CONTACT: dict[str, Any] = {
    "R": PAIR.rho_red_C,
    "E_red": E_RED,
    "eta": float(OIL.dynamic_viscosity(60.0)),
    "alpha": float(OIL.film_pressure_viscosity_coefficient(60.0)),
    "V_e": 1500.0 * np.pi / 30.0 * PAIR.T1C,
}
F = 200.0 / PAIR.r_b[0]
FILMS: list[tuple[Callable[..., Any], dict[str, float], float, tuple[float, float, float]]] = [
    (ehl.film_hamrock_dowson, {"F": F}, 0.163, (0.67, 0.53, -0.067)),
    (ehl.film_dowson_toyoda, {"w": F / PAIR.b}, 0.197, (0.69, 0.56, -0.10)),
    (ehl.film_grubin, {"w": F / PAIR.b}, 0.180, (8.0 / 11.0, 8.0 / 11.0, -1.0 / 11.0)),
]


@pytest.mark.parametrize(("film", "load", "expected", "exponents"), FILMS)
def test_film_thickness_at_the_pitch_point(
    film: Callable[..., Any], load: dict[str, float], expected: float, exponents: tuple[float, float, float]
) -> None:
    """Independent evaluation, three digits; then the exponents of speed, pressure coefficient and load."""
    h = float(film(**CONTACT, **load))
    assert h * 1e6 == pytest.approx(expected, abs=5e-4)
    (name, value), *_ = load.items()
    for changed, exponent in (
        ({"V_e": 2.0 * CONTACT["V_e"]}, exponents[0]),
        ({"eta": 2.0 * CONTACT["eta"]}, exponents[0]),
        ({"alpha": 2.0 * CONTACT["alpha"]}, exponents[1]),
        ({name: 2.0 * value}, exponents[2]),
    ):
        assert film(**{**CONTACT, **load, **changed}) / h == pytest.approx(2.0**exponent, rel=1e-12)


def test_hertz_pressure_carries_the_load() -> None:
    """The elliptic pressure over the half-widths integrates to the load per length: ``pi/2 p_H b_H = w``."""
    b_H, p_H = ehl.hertz_line(4e5, 8e-3, E_RED)
    assert 0.5 * np.pi * b_H * p_H == pytest.approx(4e5, rel=1e-12)
    assert p_H == pytest.approx(np.sqrt(4e5 * E_RED / (2.0 * np.pi * 8e-3)), rel=1e-12)


def test_thermal_reduction_is_one_without_heat_and_falls_with_sliding() -> None:
    L = np.array([0.0, 1e-3, 0.1, 1.0, 10.0])
    gupta = ehl.thermal_reduction_gupta(p_H=1e9, E_red=E_RED, L=L, slide_roll_ratio=0.3)
    simple = ehl.thermal_reduction_gupta_simple(L=L, slide_roll_ratio=0.3)
    rolling = ehl.thermal_reduction_murch_wilson(L=L)
    for phi in (gupta, simple, rolling):
        assert phi[0] == 1.0
        assert np.all(np.diff(phi) < 0.0)
        assert np.all(phi > 0.0)
    assert np.all(ehl.thermal_reduction_gupta_simple(L=L[1:], slide_roll_ratio=0.6) < simple[1:])
    assert np.all(ehl.thermal_reduction_gupta(p_H=1e9, E_red=E_RED, L=L[1:], slide_roll_ratio=0.6) < gupta[1:])


def test_gupta_by_hand() -> None:
    """``(1 - 13.2 * 0.005 * 0.5^0.42) / (1 + 0.213 (1 + 2.23 * 0.4^0.83) 0.5^0.64)``."""
    phi = ehl.thermal_reduction_gupta(p_H=0.005 * E_RED, E_red=E_RED, L=0.5, slide_roll_ratio=0.4)
    assert phi == pytest.approx((1 - 0.066 * 0.5**0.42) / (1 + 0.213 * (1 + 2.23 * 0.4**0.83) * 0.5**0.64), rel=1e-12)


def test_other_reductions_and_band_source_by_hand() -> None:
    simple = ehl.thermal_reduction_gupta_simple(L=0.5, slide_roll_ratio=0.4)
    assert simple == pytest.approx(1 / (1 + 0.1 * (1 + 14.8 * 0.4**0.83) * 0.5**0.64), rel=1e-12)
    assert ehl.thermal_reduction_murch_wilson(L=0.5) == pytest.approx(3.94 / (3.94 + 0.5**0.62), rel=1e-12)
    exact = 4.0 / 3.0 * np.sqrt(2.0 / np.pi) / 46.0 * np.sqrt(1.263e-5 * 2e-4 / 3.0)  # Blok; 1.06 rounds 1.0638
    assert ehl.band_source_resistance(b_H=2e-4, u=3.0, k=46.0, chi=1.263e-5) == pytest.approx(exact, rel=4e-3)


def test_gupta_numerator_is_held() -> None:
    phi = ehl.thermal_reduction_gupta(p_H=2e9, E_red=E_RED, L=1e4, slide_roll_ratio=0.0)
    assert phi == pytest.approx(0.1 / (1.0 + 0.213 * 1e4**0.64), rel=1e-12)


@pytest.mark.parametrize(
    ("law", "dry"),
    [
        (ehl.asperity_share_doleschel, 1.0),
        (ehl.asperity_share_erf, 1.0),
        (ehl.asperity_share_diab, 0.25),
        (ehl.asperity_share_matsumoto, 1.0),
    ],
)
def test_asperity_share_falls_from_dry_to_nothing(law: Callable[[Any, float], Any], dry: float) -> None:
    h = np.concatenate(([0.0], np.geomspace(1e-10, 1e-5, 50)))
    share = law(h, 2e-7)
    assert share[0] == pytest.approx(dry)
    assert share[-1] == pytest.approx(0.0, abs=1e-12)
    assert np.all(np.diff(share) <= 0.0)


def test_asperity_shares_at_one_roughness() -> None:
    assert ehl.asperity_share_doleschel(1e-7, 1e-7) == pytest.approx(0.25)
    assert ehl.asperity_share_erf(1e-7, 1e-7) == pytest.approx(1.0 - 0.8427008, abs=1e-7)
    assert ehl.asperity_share_diab(1e-7, 1e-7) == pytest.approx(0.25 * (1.0 - 0.6826895), abs=1e-7)
    assert ehl.asperity_share_matsumoto(1e-7 / 0.75, 1e-6) == pytest.approx(0.5, abs=1e-12)


def test_fluid_friction_is_newtonian_for_slow_shear_and_limited_for_fast() -> None:
    state: dict[str, Any] = {"p_mean": 8e8, "eta": 50.0, "alpha": 1.2e-8, "h": 2e-7, "shear_limit": 0.047}
    slow = ehl.fluid_friction(V_s=1e-6, **state)
    assert slow == pytest.approx(50.0 * 1e-6 / 2e-7 / 8e8, rel=1e-6)  # eta V / (h p)
    assert ehl.fluid_friction(V_s=0.0, **state) == 0.0
    eyring = 2.0 * 0.047 / 1.2e-8
    middle = ehl.fluid_friction(V_s=1e-1, **state)
    assert middle == pytest.approx(eyring / 8e8 * np.arcsinh(50.0 * 1e-1 / (eyring * 2e-7)), rel=1e-12)
    assert ehl.fluid_friction(V_s=1e9, **state) == 0.047


def test_heat_partition() -> None:
    assert ehl.heat_partition(2.0, 2.0) == 0.5
    assert ehl.heat_partition(4.0, 1.0) == pytest.approx(2.0 / 3.0)
    assert ehl.heat_partition(3.0, 5.0) + ehl.heat_partition(5.0, 3.0) == pytest.approx(1.0)


def test_both_bodies_reach_one_contact_temperature() -> None:
    """The partition is the one that makes the mean rises of both surfaces equal: the law behind the mesh node."""
    u_1, u_2 = 3.0, 5.0
    share = ehl.heat_partition(u_1, u_2)
    rise = [float(ehl.band_source_resistance(b_H=2e-4, u=u, k=46.0, chi=1.263e-5)) for u in (u_1, u_2)]
    assert share * rise[0] == pytest.approx((1.0 - share) * rise[1], rel=1e-12)


def test_thermal_loading_is_dimensionless_product() -> None:
    assert ehl.thermal_loading(eta=0.013, beta=0.0335, V_e=5.0, k_oil=0.129) == pytest.approx(
        0.013 * 0.0335 * 25 / 0.129
    )
