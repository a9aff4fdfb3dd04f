"""Radial shaft seals."""

from __future__ import annotations

import numpy as np
import pytest

from models.seal import LOWEST_BRACKET, seal_loss_iso_simple, seal_loss_linke


def test_linke_by_hand() -> None:
    """``145 - 1.6 * 60 + 350 lg lg 32.8 = 112.24``; times ``24^2 * 1000 * 1e-7``."""
    bracket = 145.0 - 96.0 + 350.0 * np.log10(np.log10(32.8))
    loss = seal_loss_linke(d_mm=24.0, n_rpm=1000.0, T_oil=60.0, nu_40=32.0)
    assert loss == pytest.approx(bracket * 0.0576, rel=1e-12)
    assert loss == pytest.approx(6.465, abs=5e-4)


def test_linke_scales_with_speed_and_square_of_diameter() -> None:
    one = seal_loss_linke(d_mm=20.0, n_rpm=1000.0, T_oil=50.0, nu_40=68.0)
    assert seal_loss_linke(d_mm=40.0, n_rpm=3000.0, T_oil=50.0, nu_40=68.0) == pytest.approx(12.0 * one)
    assert seal_loss_linke(d_mm=20.0, n_rpm=0.0, T_oil=50.0, nu_40=68.0) == 0.0


def test_linke_falls_with_temperature_to_its_floor() -> None:
    T = np.linspace(-60.0, 300.0, 200)
    loss = seal_loss_linke(d_mm=24.0, n_rpm=1000.0, T_oil=T, nu_40=32.0)
    assert np.all(np.diff(loss) <= 0.0)
    assert loss[-1] == pytest.approx(LOWEST_BRACKET * 24.0**2 * 1000.0 * 1e-7)


def test_printed_coefficient_gives_twenty_watts_more() -> None:
    """Sum of both seals of the rig at 8.3 m/s: + 20 W at 60 degC, + 30 W at 90 degC (independent evaluation)."""
    for T, more in ((60.0, 20.0), (90.0, 30.0)):
        losses = [
            sum(
                float(seal_loss_linke(d_mm=d, n_rpm=n, T_oil=T, nu_40=32.0, c_T=c))
                for d, n in ((24.0, 2165.7), (54.0, 1443.8))
            )
            for c in (1.6, 1.0)
        ]
        assert losses[1] - losses[0] == pytest.approx(more, abs=0.55)


def test_iso_simple() -> None:
    assert seal_loss_iso_simple(d_mm=10.0, n_rpm=np.array([0.0, 1000.0])) == pytest.approx([0.0, 0.769])
