"""What must hold for any gear pair that is accepted."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import get_args

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from models.base.errors import InputError
from models.formulas.geometry import GearPair, gear_pair
from models.formulas.involute import centre_distance, half_tooth_angle, profile_shift_sum
from models.formulas.load_sharing import (
    LoadSharing,
    contact_breakpoints,
    contact_points,
    load_share,
    load_sharing_loss_factor,
)
from models.formulas.mesh_stiffness import tooth_pair_stiffness

MODELS = get_args(LoadSharing)


@st.composite
def gear_pairs(draw: st.DrawFn) -> GearPair:
    """Pairs free of backlash over the usual range, thrown away where the check refuses them."""
    z = (draw(st.integers(14, 60)), draw(st.integers(14, 90)))
    alpha_n = math.radians(draw(st.sampled_from([17.5, 20.0, 22.5, 25.0])))
    x = (draw(st.floats(-0.3, 0.8)), draw(st.floats(-0.3, 0.8)))
    m_n = draw(st.floats(0.5e-3, 20e-3))
    a = centre_distance(z, m_n, alpha_n, sum(x))
    shortened = draw(st.booleans())
    try:
        return gear_pair(z=z, m_n=m_n, alpha_n=alpha_n, b=10.0 * m_n, a=a, x=x, tip_shortening=shortened)
    except InputError:
        assume(False)
        raise


def mirrored(pair: GearPair) -> GearPair:
    """The same gears, with the other one driving."""
    return gear_pair(
        z=pair.z[::-1],
        m_n=pair.m_n,
        alpha_n=pair.alpha_n,
        b=pair.b,
        a=pair.a,
        x=pair.x[::-1],
        r_a=pair.r_a[::-1],
    )


@given(gear_pairs())
def test_teeth_fill_the_working_pitch_circle(pair: GearPair) -> None:
    """Without backlash the two tooth thicknesses there add up to the pitch: thickness and centre distance agree."""
    thickness = [
        2.0 * r_w * half_tooth_angle(z=z, x=x, alpha_n=pair.alpha_n, r_b=r_b, r=r_w)
        for z, x, r_b, r_w in zip(pair.z, pair.x, pair.r_b, pair.r_w, strict=True)
    ]
    assert sum(thickness) == pytest.approx(2.0 * math.pi * pair.r_w[0] / pair.z[0], rel=1e-9)


@given(gear_pairs())
def test_lengths_on_the_line_of_action_are_consistent(pair: GearPair) -> None:
    assert sum(pair.r_w) == pytest.approx(pair.a)
    assert pair.epsilon_1 + pair.epsilon_2 == pytest.approx(pair.epsilon_alpha)
    assert pair.epsilon_alpha >= 1.0
    assert 0.0 <= pair.T1A < pair.T1E <= pair.T1T2
    assert math.hypot(pair.T1C, pair.r_b[0]) == pytest.approx(pair.r_w[0])
    assert math.hypot(pair.T1T2 - pair.T1A, pair.r_b[1]) == pytest.approx(pair.r_a[1])
    assert profile_shift_sum(pair.z, pair.alpha_n, pair.alpha_wt) == pytest.approx(sum(pair.x), abs=1e-9)
    assert pair.sliding_speed(pair.T1C, 100.0) == pytest.approx(0.0, abs=1e-9 * 100.0 * pair.a)


@given(gear_pairs(), st.floats(0.0, 1.0), st.sampled_from(MODELS))
def test_companions_carry_the_whole_force(pair: GearPair, fraction: float, model: LoadSharing) -> None:
    assume(model != "sanchez_pedrero" or pair.epsilon_alpha < 2.0)
    companions = np.asarray(pair.T1A + (fraction + np.arange(-1, 4)) * pair.p_b, dtype=np.float64)
    shares = load_share(pair, companions, model=model)
    assert np.all((shares >= 0.0) & (shares <= 1.0))
    if 1e-6 < fraction < 1.0 - 1e-6:  # at the ends A and D are one position counted twice
        assert shares.sum() == pytest.approx(1.0, rel=1e-12)


@given(gear_pairs(), st.sampled_from(MODELS))
def test_quadrature_covers_the_path_of_contact(pair: GearPair, model: LoadSharing) -> None:
    assume(model != "sanchez_pedrero" or pair.epsilon_alpha < 2.0)
    points = contact_points(pair, model=model)
    assert np.all(points.dx > 0.0) and np.all(np.diff(points.t) > 0.0)
    assert points.dx.sum() == pytest.approx(pair.T1E - pair.T1A, rel=1e-12)
    # One pair after the other takes the whole force through one base pitch.
    assert np.sum(points.share * points.dx) == pytest.approx(pair.p_b, rel=1e-5)


@given(gear_pairs())
def test_breakpoints_hold_every_jump(pair: GearPair) -> None:
    breakpoints = contact_breakpoints(pair)
    assert breakpoints[0] == pair.T1A and breakpoints[-1] == pair.T1E
    assert np.all(np.diff(breakpoints) > 0.0)
    for low, high in pairwise(breakpoints):
        inside = low + np.array([0.01, 0.5, 0.99]) * (high - low)
        assert np.ptp(load_share(pair, inside, model="equal")) == 0.0


@given(gear_pairs())
def test_equal_sharing_is_ohlendorf(pair: GearPair) -> None:
    assume(pair.epsilon_alpha < 2.0 and pair.T1B <= pair.T1C <= pair.T1D)
    points = contact_points(pair, model="equal")
    assert load_sharing_loss_factor(pair, points) == pytest.approx(pair.H_V, rel=1e-9)


@given(gear_pairs(), st.floats(0.0, 1.0))
def test_exchanging_the_gears_mirrors_the_line_of_action(pair: GearPair, fraction: float) -> None:
    other = mirrored(pair)
    t = pair.T1A + fraction * (pair.T1E - pair.T1A)
    assert pytest.approx(pair.T1T2 - pair.T1E, abs=1e-12 * pair.a + 1e-15) == other.T1A
    bores = (0.2 * pair.r_f[0], 0.5 * pair.r_f[1])
    stiffness = tooth_pair_stiffness(pair, t, r_bore=bores, E=(206e9, 110e9), nu=(0.1, 0.4))
    exchanged = tooth_pair_stiffness(other, pair.T1T2 - t, r_bore=bores[::-1], E=(110e9, 206e9), nu=(0.4, 0.1))
    assert exchanged == pytest.approx(stiffness, rel=1e-9)
    there, here = contact_points(other), contact_points(pair)
    assert there.share[::-1] == pytest.approx(here.share, rel=1e-7)


@settings(max_examples=30)
@given(gear_pairs(), st.floats(0.1, 10.0))
def test_loss_factor_does_not_depend_on_the_size(pair: GearPair, scale: float) -> None:
    larger = gear_pair(
        z=pair.z,
        m_n=scale * pair.m_n,
        alpha_n=pair.alpha_n,
        b=scale * pair.b,
        a=scale * pair.a,
        x=pair.x,
        r_a=(scale * pair.r_a[0], scale * pair.r_a[1]),
    )
    H_VL = load_sharing_loss_factor(pair, contact_points(pair))
    assert load_sharing_loss_factor(larger, contact_points(larger)) == pytest.approx(H_VL, rel=1e-7)
