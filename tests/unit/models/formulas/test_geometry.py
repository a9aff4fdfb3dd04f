"""Geometry of a spur gear pair: numbers of FZG type C, and every refusal."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from models.base.errors import InputError
from models.formulas import involute
from models.formulas.geometry import GearPair, gear_pair

ALPHA = math.radians(20.0)
TYPE_C: dict[str, Any] = {"z": (16, 24), "m_n": 4.5e-3, "alpha_n": ALPHA, "b": 14e-3, "a": 91.5e-3, "x": (0.182, 0.172)}


@pytest.fixture(scope="module")
def pair() -> GearPair:
    return gear_pair(**TYPE_C)


@pytest.mark.parametrize(
    ("attribute", "expected"),
    [
        ("r_b", (33.8289, 50.7434)),
        ("r_w", (36.600, 54.900)),
        ("r_a", (41.226, 59.181)),
        ("r_f", (31.194, 49.149)),
        ("p_b", 13.2846),
        ("T1T2", 34.9252),
        ("rho_red_C", 8.3821),
    ],
)
def test_lengths_of_type_c(pair: GearPair, attribute: str, expected: float | tuple[float, float]) -> None:
    """To the last digit given, in mm (an independent calculation of the same pair)."""
    assert 1e3 * np.asarray(getattr(pair, attribute)) == pytest.approx(np.asarray(expected), abs=6e-5)


def test_ratios_of_type_c(pair: GearPair) -> None:
    assert math.degrees(pair.alpha_wt) == pytest.approx(22.4388, abs=5e-5)
    assert pair.epsilon_alpha == pytest.approx(1.43716, abs=5e-6)
    assert (pair.epsilon_1, pair.epsilon_2) == pytest.approx((0.7221, 0.7151), abs=5e-5)
    assert pair.k == pytest.approx((-0.02067, -0.02067), abs=5e-6)
    assert pytest.approx(0.1949, abs=5e-5) == pair.H_V
    assert pair.u == 1.5


def test_points_on_the_path_of_contact(pair: GearPair) -> None:
    """Curvature radii [mm] and sliding speed over pitch line speed at A, B, C, D, E."""
    t = np.array([pair.T1A, pair.T1B, pair.T1C, pair.T1D, pair.T1E])
    rho_1, rho_2, R = pair.curvature_radii(t)
    assert 1e3 * rho_1 == pytest.approx([4.470, 10.278, 13.970, 17.755, 23.562], abs=6e-4)
    assert 1e3 * rho_2 == pytest.approx([30.455, 24.647, 20.955, 17.170, 11.363], abs=6e-4)
    assert pytest.approx([3.898, 7.253, 8.382, 8.729, 7.666], abs=6e-4) == 1e3 * R
    sliding = pair.sliding_speed(t, 100.0) / (100.0 * pair.r_w[0])
    assert sliding == pytest.approx([0.4326, 0.1681, 0.0, 0.1724, 0.4368], abs=6e-5)


def test_both_flanks_move_alike_at_the_pitch_point(pair: GearPair) -> None:
    u_1, u_2 = pair.speeds(pair.T1C, 227.0)
    assert u_1 == pytest.approx(227.0 * pair.r_w[0] * math.sin(pair.alpha_wt), rel=1e-12)
    assert u_2 == pytest.approx(u_1, rel=1e-12)


def test_speeds_broadcast_over_points_and_speeds(pair: GearPair) -> None:
    u_1, u_2 = pair.speeds(np.linspace(pair.T1A, pair.T1E, 5), np.array([[10.0], [-20.0]]))
    assert u_1.shape == u_2.shape == (2, 5)
    assert u_1[1] == pytest.approx(-2.0 * u_1[0])
    assert np.all(pair.sliding_speed(pair.T1A, np.array([10.0, -10.0])) > 0.0)


def test_without_tip_shortening_the_tips_stand_at_the_rack_addendum(pair: GearPair) -> None:
    full = gear_pair(**TYPE_C, tip_shortening=False)
    assert (2e3 * full.r_a[0], 2e3 * full.r_a[1]) == pytest.approx((82.638, 118.548), abs=5e-4)
    assert full.k == pytest.approx((0.0, 0.0), abs=1e-12)
    assert full.epsilon_alpha == pytest.approx(1.463, abs=5e-4)


def test_tip_shortening_keeps_the_tip_clearance_of_the_rack(pair: GearPair) -> None:
    assert pair.a - pair.r_a[0] - pair.r_f[1] == pytest.approx(0.25 * pair.m_n, rel=1e-9)


def test_tip_radii_override_tip_shortening() -> None:
    given = gear_pair(**TYPE_C, r_a=(41.0e-3, 59.0e-3))
    assert given.r_a == (41.0e-3, 59.0e-3)
    assert pytest.approx(math.sqrt(41.0e-3**2 - given.r_b[0] ** 2)) == given.T1E


def test_unshifted_pair_is_never_lengthened() -> None:
    """A centre distance a little above the nominal one must not give a positive tip 'shortening'."""
    wide = gear_pair(**{**TYPE_C, "z": (20, 30), "a": 112.55e-3, "x": (0.0, 0.0)})
    assert wide.k == pytest.approx((0.0, 0.0), abs=1e-12)


def test_fzg_type_a_with_its_slight_undercut_is_accepted() -> None:
    pair = gear_pair(**{**TYPE_C, "b": 10e-3, "x": (0.8532, -0.5)})
    assert pair.x[1] < involute.smallest_profile_shift(24, ALPHA)
    assert pair.T1C < pair.T1B  # so the pitch point lies where two pairs carry


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"a": 84.0e-3}, ["84 mm", "84.572 mm", "sum of the base radii", "91.503 mm"]),
        ({"a": 93.0e-3}, ["93 mm", "0.3540", "91.503 mm", "0.05"]),
        ({"x": (0.5, -0.9)}, ["91.5 mm", "-0.4000"]),
        ({"z": (10, 30), "x": (0.0, 0.3532)}, ["gear 1", "undercuts", "0.2386"]),
        ({"x": (1.4, -0.5), "a": 93.575e-3, "r_a": (46.9e-3, 54.2e-3)}, ["gear 1", "pointed teeth", "93.800 mm"]),
        ({"r_a": (38.0e-3, 56.0e-3)}, ["contact ratio 0.", "at least 1", "raise the tip"]),
        ({"r_a": (41.226e-3, 62.0e-3)}, ["before T1", "gear 2", "into the root of gear 1"]),
        ({"z": (24, 16), "x": (0.172, 0.182), "r_a": (62.0e-3, 41.226e-3)}, ["beyond T2", "into the root of gear 2"]),
        ({"r_a": (33.0e-3, 59.181e-3)}, ["gear 1", "tip diameter 66.000 mm", "base diameter"]),
    ],
)
def test_impossible_pairs_are_refused_with_the_limit(change: dict[str, Any], words: list[str]) -> None:
    with pytest.raises(InputError) as refusal:
        gear_pair(**{**TYPE_C, **change})
    for word in words:
        assert word in str(refusal.value)


def test_centre_distance_that_no_shift_allows_is_nan() -> None:
    assert math.isnan(involute.centre_distance((16, 24), 4.5e-3, ALPHA, -5.0))


def test_half_tooth_angle_below_the_base_circle_is_that_of_the_base_circle() -> None:
    at: dict[str, Any] = {"z": 16, "x": 0.182, "alpha_n": ALPHA, "r_b": 33.8289e-3}
    assert involute.half_tooth_angle(**at, r=31e-3) == involute.half_tooth_angle(**at, r=33.8289e-3)
