"""Load-independent losses of dipping gears: the independent evaluation's table for the FZG rig at 60 degC."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from models import churning
from models.gearbox import load_gearbox

GEARBOX = load_gearbox("fzg").with_values({"oil.volume_l": 1.0})
PAIR = GEARBOX.stage[0].pair()
V_T = np.array([1.0, 2.0, 5.0, 8.3, 15.0, 20.0])
SPEED = V_T / PAIR.r_w[0] * 30.0 / np.pi
EXAMPLE: dict[str, Any] = {
    "h": 0.02, "r_p": 0.05, "b": 0.014, "z": 24, "tooth_height": 0.01, "alpha": np.radians(20.0), "V_oil": 1e-3,
    "nu": 15.41, "rho": 848.0,
}  # fmt: skip


@pytest.mark.parametrize(
    ("model", "watts", "half_digit"),
    [
        ("niemann", [0.3, 0.9, 3.6, 7.7, 18.7, 28.7], 0.05),
        ("mauz", [8.0, 17.0, 45.0, 82.0, 178.0, 272.0], 0.55),
    ],
)
def test_table_of_the_rig(model: str, watts: list[float], half_digit: float) -> None:
    losses = GEARBOX.with_values({"stage.0.churning.model": model}).losses()
    loss = losses.breakdown(speed=SPEED, torque=94.0, temperatures=60.0)["churning"]
    assert loss == pytest.approx(watts, abs=half_digit)


def test_changenet_velex_on_the_rig() -> None:
    """A second evaluation of the formula, by other hands: 0.9 l at 60 degC."""
    losses = GEARBOX.with_values({"stage.0.churning.model": "changenet_velex", "oil.volume_l": 0.9}).losses()
    loss = losses.breakdown(speed=SPEED[[0, 2, 3, 4, 5]], torque=94.0, temperatures=60.0)["churning"]
    assert loss == pytest.approx([0.49, 6.3, 21.1, 57.8, 82.6], rel=0.01)


def test_mauz_by_hand() -> None:
    """e = 22.2 + 40.2 mm, b = 14 mm: C1 = 0.4283, C2 = 0.278; torque of the wheel 0.5394 N m at 8.3 m/s."""
    loss = churning.churning_mauz(e=(22.226e-3, 40.181e-3), b=14e-3, v_t=8.3, omega_2=1.0)
    assert loss == pytest.approx(0.5394, abs=2e-4)
    assert churning.churning_mauz(e=(22.226e-3, 40.181e-3), b=14e-3, v_t=8.3, omega_2=1.0, C_Sp=1.6) == pytest.approx(
        1.6 * loss
    )


def test_dry_gears_lose_nothing() -> None:
    v, nu = np.array([1.0, 10.0]), np.full(2, 15.0)
    assert churning.churning_niemann(e=-1e-3, b=14e-3, v_t=v).tolist() == [0.0, 0.0]
    assert churning.churning_niemann_printed(e=-1e-3, b=14e-3, v_t=v, omega=v).tolist() == [0.0, 0.0]
    assert churning.churning_mauz(e=(-1e-3, -1e-3), b=14e-3, v_t=v, omega_2=v).tolist() == [0.0, 0.0]
    assert churning.churning_changenet_velex(**{**EXAMPLE, "h": -1e-3, "nu": nu}, omega=v).tolist() == [0.0, 0.0]


def test_changenet_velex_exponents() -> None:
    """Laminar: omega^(3 - 1.2 - 0.21), nu^0.21; turbulent: omega^(3 - 1.76), no viscosity; density linear."""
    slow, fast = 20.0, 1000.0  # Re = 908 and 45 400

    def loss(omega: float, **changed: float) -> float:
        return float(churning.churning_changenet_velex(**{**EXAMPLE, **changed}, omega=omega))

    assert loss(2 * slow) / loss(slow) == pytest.approx(2.0**1.59, rel=1e-12)
    assert loss(slow, nu=2 * 15.41) / loss(slow) == pytest.approx(2.0**0.21, rel=1e-12)
    assert loss(2 * fast) / loss(fast) == pytest.approx(2.0**1.24, rel=1e-12)
    assert loss(fast, nu=0.5 * 15.41) == pytest.approx(loss(fast), rel=1e-12)
    assert loss(slow, rho=424.0) == pytest.approx(0.5 * loss(slow), rel=1e-12)
    assert loss(slow, V_oil=2e-3) / loss(slow) == pytest.approx(2.0**0.1, rel=1e-12)
    assert loss(fast, V_oil=2e-3) / loss(fast) == pytest.approx(2.0**-0.35, rel=1e-12)


def test_changenet_velex_by_hand() -> None:
    """A point below and one above the transition, written out: theta = 0.9273, S_m = 0.010015 m^2 with teeth."""
    theta = np.arccos(0.6)
    S_m = 0.05**2 * (2 * theta - np.sin(2 * theta)) + 0.1 * 0.014 * theta
    S_m += 2 * 24 * 0.01 * theta * 0.014 / (np.pi * np.cos(np.radians(20)))
    Re, Fr = 20 * 0.05 * 0.014 / 15.41e-6, 400 * 0.05 / 9.80665
    C_m = 1.366 * 0.2**0.45 * 1.0**0.1 * Fr**-0.6 * Re**-0.21 * 0.14**0.21
    loss = churning.churning_changenet_velex(**EXAMPLE, omega=20.0)
    assert loss == pytest.approx(0.5 * 848 * 20**3 * S_m * 0.05**3 * C_m, rel=1e-12)
    C_m = 3.644 * 0.2**0.1 * 1.0**-0.35 * (1000.0**2 * 0.05 / 9.80665) ** -0.88 * 0.14**0.85
    loss = churning.churning_changenet_velex(**EXAMPLE, omega=1000.0)
    assert loss == pytest.approx(0.5 * 848 * 1000.0**3 * S_m * 0.05**3 * C_m, rel=1e-12)


def test_changenet_velex_is_continuous_at_both_ends_of_the_transition() -> None:
    for Re in (churning.RE_LAMINAR, churning.RE_TURBULENT):
        omega = Re * 15.41e-6 / (0.05 * 0.014)
        below, above = (
            float(churning.churning_changenet_velex(**EXAMPLE, omega=omega * f)) for f in (1 - 1e-9, 1 + 1e-9)
        )
        assert above == pytest.approx(below, rel=1e-6)


def test_fully_immersed_gear_is_finite() -> None:
    assert np.isfinite(churning.churning_changenet_velex(**{**EXAMPLE, "h": 0.2}, omega=100.0))
