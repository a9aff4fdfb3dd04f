"""Load shares and the quadrature on the path of contact: reference numbers of FZG type C, and high contact ratio."""

from __future__ import annotations

import math
from typing import Any, get_args

import numpy as np
import pytest

from models.base.errors import InputError
from models.formulas import load_sharing
from models.formulas.geometry import GearPair, gear_pair
from models.formulas.involute import centre_distance
from models.formulas.load_sharing import (
    LoadSharing,
    contact_breakpoints,
    contact_points,
    load_share,
    load_sharing_loss_factor,
    unit_stiffness_sanchez_pedrero,
)

ALPHA = math.radians(20.0)
BORES = (15e-3, 15e-3)


@pytest.fixture(scope="module")
def pair() -> GearPair:
    """FZG type C."""
    return gear_pair(z=(16, 24), m_n=4.5e-3, alpha_n=ALPHA, b=14e-3, a=91.5e-3, x=(0.182, 0.172))


@pytest.fixture(scope="module")
def high() -> GearPair:
    """High contact ratio, 2.14, by a tooth of 1.2 modules addendum."""
    return gear_pair(z=(60, 90), m_n=2e-3, alpha_n=ALPHA, b=20e-3, a=150e-3, x=(0.0, 0.0), r_a=(62.4e-3, 92.4e-3))


@pytest.mark.parametrize(
    ("model", "shares", "H_VL"),
    [
        ("potential_energy", [0.422, 0.584, 1.0, 0.578, 0.416], 0.1915),
        ("sanchez_pedrero", [0.355, 0.645, 1.0, 0.645, 0.355], 0.1889),
        ("equal", [0.5, 0.5, 1.0, 0.5, 0.5], 0.1949),
    ],
)
def test_type_c_reference_numbers(pair: GearPair, model: LoadSharing, shares: list[float], H_VL: float) -> None:
    """Shares at A, B-, C, D+, E and the loss factor, as an independent calculation printed them."""
    at = np.array([pair.T1A, pair.T1B, pair.T1C, pair.T1D, pair.T1E])
    assert load_share(pair, at, model=model, r_bore=BORES) == pytest.approx(shares, abs=6e-4)
    points = contact_points(pair, model=model, r_bore=BORES)
    assert load_sharing_loss_factor(pair, points) == pytest.approx(H_VL, abs=5e-5)


def test_share_jumps_to_one_between_b_and_d(pair: GearPair) -> None:
    inside = np.linspace(pair.T1B + 1e-9, pair.T1D - 1e-9, 7)
    assert np.all(load_share(pair, inside) == 1.0)


def test_share_is_zero_away_from_the_path_of_contact(pair: GearPair) -> None:
    outside = np.array([pair.T1A - 1e-6, pair.T1E + 1e-6, -1.0, 1.0])
    assert np.all(load_share(pair, outside) == 0.0)


def test_share_keeps_the_shape_of_its_argument(pair: GearPair) -> None:
    t = np.linspace(pair.T1A, pair.T1E, 6)
    assert load_share(pair, t.reshape(2, 3)).shape == (2, 3)
    assert float(load_share(pair, t[1])) == pytest.approx(load_share(pair, t)[1])


def test_sanchez_pedrero_constant(pair: GearPair) -> None:
    """b_0 = [(1.71858^2)/2 - 1]^(-1/2) = 1.44828 at contact ratio 1.43716, by hand; v(0) = cos(b_0 epsilon / 2)."""
    v = float(unit_stiffness_sanchez_pedrero(0.0, pair.epsilon_alpha))
    assert math.acos(v) / (0.5 * pair.epsilon_alpha) == pytest.approx(1.44828, abs=5e-6)
    assert float(unit_stiffness_sanchez_pedrero(0.5 * pair.epsilon_alpha, pair.epsilon_alpha)) == 1.0


@pytest.mark.parametrize(
    ("keyword", "value"),
    [("r_bore", (12e-3, 27.5e-3)), ("E", (206e9, 110e9)), ("nu", (0.1, 0.3))],
)
def test_material_and_bore_reach_the_shares(pair: GearPair, keyword: str, value: Any) -> None:
    arguments: dict[str, Any] = {keyword: value}
    base, changed = contact_points(pair, r_bore=BORES), contact_points(pair, **{"r_bore": BORES, **arguments})
    assert np.max(np.abs(base.share - changed.share)) > 1e-5


def test_breakpoints_of_type_c_and_of_type_a(pair: GearPair) -> None:
    assert contact_breakpoints(pair) == pytest.approx([pair.T1A, pair.T1B, pair.T1C, pair.T1D, pair.T1E])
    type_a = gear_pair(z=(16, 24), m_n=4.5e-3, alpha_n=ALPHA, b=10e-3, a=91.5e-3, x=(0.8532, -0.5))
    expected = [type_a.T1A, type_a.T1C, type_a.T1B, type_a.T1D, type_a.T1E]
    assert contact_breakpoints(type_a) == pytest.approx(expected)


def test_quadrature_has_converged(pair: GearPair) -> None:
    coarse, fine = (load_sharing_loss_factor(pair, contact_points(pair, n, r_bore=BORES)) for n in (6, 30))
    assert coarse == pytest.approx(fine, rel=1e-8)


def test_high_contact_ratio(high: GearPair) -> None:
    assert high.epsilon_alpha == pytest.approx(2.143, abs=1e-3)
    assert contact_breakpoints(high).size == 7  # A, E, C, and two changes of the number of pairs from either end
    t = high.T1A + np.array([0.1, 0.5]) * high.p_b
    assert load_share(high, t, model="equal") == pytest.approx([1 / 3, 1 / 2])
    for model in ("potential_energy", "equal"):
        points = contact_points(high, model=model)
        assert float(np.sum(points.share * points.dx)) == pytest.approx(high.p_b, rel=1e-7)


def test_sanchez_pedrero_refuses_high_contact_ratio(high: GearPair) -> None:
    with pytest.raises(InputError, match=r"2\.143; use 'potential_energy'"):
        load_share(high, high.T1C, model="sanchez_pedrero")


def test_coinciding_breakpoints_are_one(high: GearPair) -> None:
    """The tip of gear 1 placed so that the contact ends one base pitch after the pitch point: B is C up to rounding."""
    tip = math.hypot(high.r_b[0], high.T1C + high.p_b)
    pair = gear_pair(z=high.z, m_n=high.m_n, alpha_n=ALPHA, b=high.b, a=high.a, x=high.x, r_a=(tip, 92.0e-3))
    assert pytest.approx(pair.T1C, rel=1e-12) == pair.T1B
    assert contact_breakpoints(pair) == pytest.approx([pair.T1A, pair.T1C, pair.T1D, pair.T1E])
    assert np.all(contact_points(pair).dx > 1e-9)


def helical(beta_deg: float = 15.0, b: float = 23e-3) -> GearPair:
    """H501 of GEARpie, with another helix angle its sum of profile shifts at this centre distance is not kept."""
    beta = math.radians(beta_deg)
    z, m_n, x = (20, 30), 3.5e-3, (0.1809, 0.0891)
    return gear_pair(z=z, m_n=m_n, alpha_n=ALPHA, beta=beta, b=b, a=centre_distance(z, m_n, ALPHA, sum(x), beta), x=x)


@pytest.mark.parametrize("model", get_args(LoadSharing))
@pytest.mark.parametrize("beta_deg", [5.0, 15.0, 30.0])
def test_lines_of_contact_carry_the_whole_force(model: LoadSharing, beta_deg: float) -> None:
    points = contact_points(helical(beta_deg), model=model)
    carried = np.sum(points.share * points.dx) / helical(beta_deg).p_b
    assert carried == pytest.approx(1.0, abs=1e-3)
    assert np.sum(points.dx) == pytest.approx(helical(beta_deg).T1E - helical(beta_deg).T1A, rel=1e-12)


def test_uniform_load_where_the_lines_have_a_constant_length() -> None:
    """Overlap ratio 1: ``pi (u + 1) / (z_1 u cos(beta_b)) (eps_1^2 + eps_2^2) / eps_alpha`` (Velex, Ville 2009)."""
    pair = helical(b=math.pi * 3.5e-3 / math.sin(math.radians(15.0)))
    assert pair.epsilon_beta == pytest.approx(1.0, abs=1e-12)
    closed = math.pi * (pair.u + 1.0) / (pair.z[0] * pair.u * math.cos(pair.beta_b))
    closed *= (pair.epsilon_1**2 + pair.epsilon_2**2) / pair.epsilon_alpha
    points = contact_points(pair, model="equal")
    assert points.share == pytest.approx(1.0 / pair.epsilon_alpha, rel=1e-9)
    assert load_sharing_loss_factor(pair, points) == pytest.approx(closed, rel=1e-9)


@pytest.mark.parametrize("model", get_args(LoadSharing))
def test_a_small_helix_angle_is_a_spur_gear(model: LoadSharing) -> None:
    spur, nearly = helical(0.0), helical(0.01)
    factors = [load_sharing_loss_factor(pair, contact_points(pair, model=model)) for pair in (spur, nearly)]
    assert factors[1] == pytest.approx(factors[0], rel=1e-3)


@pytest.mark.parametrize(("beta_deg", "b"), [(0.01, 23e-3), (5.0, 10e-3), (12.0, 40e-3), (15.0, 23e-3), (30.0, 60e-3)])
def test_points_on_the_lines_are_enough(monkeypatch: pytest.MonkeyPatch, beta_deg: float, b: float) -> None:
    """Within 0.1 % of 12 x 12 points between kinks and no merging, also with an exponent above 1 on the load."""

    def weighed(exponent: float) -> float:
        pair = helical(beta_deg, b)
        points = contact_points(pair)
        return float(np.sum(points.share**exponent * pair.sliding_speed(points.t, 1.0) * points.dx))

    coarse = [weighed(exponent) for exponent in (1.0, 1.2)]
    monkeypatch.setattr(load_sharing, "_GAUSS", 12)
    monkeypatch.setattr(load_sharing, "_two_points", lambda values, weights: (values, weights))
    assert coarse == pytest.approx([weighed(exponent) for exponent in (1.0, 1.2)], rel=1e-3)
