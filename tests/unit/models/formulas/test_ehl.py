"""Line contact: what two formulas must agree on; the numbers are in `tests/validation`."""

from __future__ import annotations

import numpy as np
import pytest

from models.formulas import ehl

E_RED = ehl.reduced_modulus(206e9, 0.3, 206e9, 0.3)


def test_hertz_pressure_carries_the_load() -> None:
    """The elliptic pressure over the half-widths integrates to the load per length: ``pi/2 p_H b_H = w``."""
    b_H, p_H = ehl.hertz_line(4e5, 8e-3, E_RED)
    assert 0.5 * np.pi * b_H * p_H == pytest.approx(4e5, rel=1e-12)


def test_both_bodies_reach_one_contact_temperature() -> None:
    """The partition is the one that makes the mean rises of both surfaces equal: the law behind the mesh node."""
    u_1, u_2 = 3.0, 5.0
    share = ehl.heat_partition(u_1, u_2)
    rise = [float(ehl.band_source_resistance(b_H=2e-4, u=u, k=46.0, chi=1.263e-5)) for u in (u_1, u_2)]
    assert share * rise[0] == pytest.approx((1.0 - share) * rise[1], rel=1e-12)
