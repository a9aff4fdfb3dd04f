"""Published gear geometries: GEARpie of cfernandesFEUP, and the tip diameters of FZG type C.

GEARpie's symbols are ours, with pbt = p_b, epslon_alpha = epsilon_alpha, HV = H_V, al = a. It gives the spur gears C14
and C40 no addendum reduction, so ``tip_shortening=False`` here. Its report rounds; the tolerance is half a unit of the
last printed digit.
"""

from __future__ import annotations

import math

import pytest

from models.formulas.geometry import GearPair, gear_pair


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


def test_tip_diameters_of_fzg_type_c() -> None:
    """Published as 82.46 and 118.36 mm (FZG type C, A/8.3/90 test gears); they need the tip shortening.

    The shifts that are published with them are rounded to four digits, which moves a tip diameter by up to 0.001 mm,
    and the printed digits by another 0.005 mm.
    """
    pair = type_c(14.0, tip_shortening=True)
    assert 2e3 * pair.r_a[0] == pytest.approx(82.46, abs=6e-3)
    assert 2e3 * pair.r_a[1] == pytest.approx(118.36, abs=6e-3)
