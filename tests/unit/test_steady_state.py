"""Steady states are found where they exist, also where losses fall steeply with temperature."""

from __future__ import annotations

import numpy as np
import pytest

from models.gearbox import load_gearbox

SPEEDS = np.array([261.0, 522.0, 1305.0, 2166.0, 3914.0, 5214.0])


@pytest.mark.parametrize("torque", [0.0, 94.0, 302.0])
@pytest.mark.parametrize("convection", ["iso_14179", "flat_plate", "iso_14179_free", "churchill_chu"])
def test_every_convection_law_settles_and_balances(convection: str, torque: float) -> None:
    gearbox = load_gearbox("fzg").with_values({"housing.convection": convection})
    network, losses = gearbox.network(), gearbox.losses()
    steady = network.steady_state(losses=losses, speed=SPEEDS, torque=torque)
    initial = {node: float(T[-1, 0]) for node, T in steady.temperatures.items()}
    hold = {"time_s": [0.0, 600.0], "speed_rpm": [SPEEDS[-1]] * 2, "torque_Nm": [torque] * 2}
    result = network.simulate(hold, losses=losses, initial=initial)
    for node, T in result.temperatures.items():
        assert T[-1] == pytest.approx(initial[node], abs=1e-5), node
