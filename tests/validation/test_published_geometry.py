"""Published gear geometries: GEARpie of cfernandesFEUP with its loss factors, and the tip diameters of FZG type C.

GEARpie's symbols are ours, with pbt = p_b, epslon_alpha = epsilon_alpha, HV = H_V, al = a. It gives the spur gears C14
and C40 no addendum reduction, so ``tip_shortening=False`` here. Its report rounds; the tolerance is half a unit of the
last printed digit.
"""

from __future__ import annotations

import math

import pytest

from models.formulas.geometry import GearPair, gear_pair
from models.formulas.load_sharing import contact_points, load_sharing_loss_factor


def type_c(b_mm: float, *, tip_shortening: bool) -> GearPair:
    """C14 and C40 of GEARpie's gear library differ in face width only."""
    return gear_pair(
        z=(16, 24),
        m_n=4.5e-3,
        alpha_n=math.radians(20.0),
        b=b_mm * 1e-3,
        a=91.5e-3,
        x=(0.1817, 0.1715),
        tip_shortening=tip_shortening,
    )


@pytest.mark.parametrize("b_mm", [14.0, 40.0])
def test_gearpie_c14_and_c40(b_mm: float) -> None:
    pair = type_c(b_mm, tip_shortening=False)
    assert 1e3 * pair.p_b == pytest.approx(13.285, abs=5e-4)
    assert pytest.approx(34.93, abs=5e-3) == 1e3 * pair.T1T2
    assert pair.epsilon_alpha == pytest.approx(1.46, abs=5e-3)
    assert pytest.approx(0.1986, abs=5e-5) == pair.H_V


HELICAL = {
    "H501": {"z": (20, 30), "m_n": 3.5e-3, "b": 23e-3, "x": (0.1809, 0.0891)},
    "H701": {"z": (28, 42), "m_n": 2.5e-3, "b": 17e-3, "x": (0.2290, 0.1489)},
}


@pytest.mark.parametrize(
    ("name", "r_a", "lengths", "epsilon", "H_V", "H_uniform"),
    [
        ("H501", (40.336, 58.132), (10.652, 10.332, 34.45, 15.55, 7.48), (1.46, 0.54), 0.1639, 0.1869),
        ("H701", (39.276, 57.193), (7.609, 7.380, 34.45, 11.53, 5.49), (1.52, 0.56), 0.1225, 0.1404),
    ],
)
def test_gearpie_helical(
    name: str, r_a: tuple[float, ...], lengths: tuple[float, ...], epsilon: tuple[float, ...], H_V: float,
    H_uniform: float,
) -> None:  # fmt: skip
    """Helix angle 15 degrees; base pitches of H701 are an independent calculation.

    GEARpie sums a uniform load over slices; its own steps leave 0.25 %.
    """
    pair = gear_pair(alpha_n=math.radians(20.0), beta=math.radians(15.0), a=91.5e-3, **HELICAL[name])  # type: ignore[arg-type]
    assert [1e3 * radius for radius in pair.r_a] == pytest.approx(r_a, abs=6e-4)
    found = (pair.p_b, pair.p_b * math.cos(pair.beta_b), pair.T1T2, pair.T1E - pair.T1A, pair.T1C - pair.T1A)
    assert [1e3 * length for length in found[:2]] == pytest.approx(lengths[:2], abs=6e-4)
    assert [1e3 * length for length in found[2:]] == pytest.approx(lengths[2:], abs=5e-3)
    assert (pair.epsilon_alpha, pair.epsilon_beta) == pytest.approx(epsilon, abs=5e-3)
    assert pytest.approx(H_V, abs=5e-5) == pair.H_V
    uniform = load_sharing_loss_factor(pair, contact_points(pair, model="equal"))
    assert uniform == pytest.approx(H_uniform, rel=2.5e-3)


def test_tip_diameters_of_fzg_type_c() -> None:
    """Published as 82.46 and 118.36 mm (FZG type C, A/8.3/90 test gears); they need the tip shortening.

    The shifts that are published with them are rounded to four digits, which moves a tip diameter by up to 0.001 mm,
    and the printed digits by another 0.005 mm.
    """
    pair = type_c(14.0, tip_shortening=True)
    assert 2e3 * pair.r_a[0] == pytest.approx(82.46, abs=6e-3)
    assert 2e3 * pair.r_a[1] == pytest.approx(118.36, abs=6e-3)
