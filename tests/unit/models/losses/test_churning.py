"""Load-independent losses of dipping gears: the independent evaluation's table for the FZG rig at 60 degC."""

from __future__ import annotations

import numpy as np
import pytest

from models.assembly.gearbox import load_gearbox

GEARBOX = load_gearbox("fzg").with_values({"oil.volume_l": 1.0})
PAIR = GEARBOX.stage[0].pair()
V_T = np.array([1.0, 2.0, 5.0, 8.3, 15.0, 20.0])
SPEED = V_T / PAIR.r_w[0] * 30.0 / np.pi


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
