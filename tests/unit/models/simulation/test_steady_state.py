"""Steady states are found where they exist, also where losses fall steeply with temperature."""

from __future__ import annotations

import numpy as np
import pytest

from models.assembly.gearbox import load_gearbox

TEMPERATURES = (-20.0, 20.0, 45.0)
SPEEDS = np.array([261.0, 522.0, 1305.0, 2166.0, 3914.0, 5214.0])


@pytest.mark.parametrize("torque", [0.0, 94.0, 302.0])
@pytest.mark.parametrize("convection", ["iso_14179", "flat_plate", "iso_14179_free", "churchill_chu"])
def test_every_convection_law_settles_and_balances(convection: str, torque: float) -> None:
    gearbox = load_gearbox("fzg").with_values({"housing.convection": convection})
    network, losses = gearbox.network(), gearbox.losses()
    steady = network.steady_state(losses=losses, speed=SPEEDS, torque=torque)
    initial = {node: T[-1] for node, T in steady.temperatures.items()}
    hold = {"time_s": [0.0, 600.0], "speed_rpm": [SPEEDS[-1]] * 2, "torque_Nm": [torque] * 2}
    result = network.simulate(hold, losses=losses, initial=initial)
    for node, T in result.temperatures.items():
        assert T[-1] == pytest.approx(initial[node], abs=1e-5), node


def test_losses_that_rise_about_as_fast_as_heat_leaves() -> None:
    """The conveyor's churning changes its regime from 71 to 84 degC, where it rises by 6 to 8 W/K."""
    gearbox = load_gearbox("conveyor")
    network, losses = gearbox.network(), gearbox.losses()
    for T_ambient in TEMPERATURES:
        torque = np.linspace(100.0, 150.0, 6)
        steady = network.steady_state(losses=losses, speed=3000.0, torque=torque, inputs={"T_ambient": T_ambient})
        oil = np.ravel(steady.temperatures["oil"])
        assert (np.diff(oil) > 0.0).all()
        hold = {"time_s": [0.0, 3600.0], "speed_rpm": [3000.0] * 2, "torque_Nm": [150.0] * 2,
                "T_ambient_degC": [T_ambient] * 2}  # fmt: skip
        at_last = {node: float(np.ravel(T)[-1]) for node, T in steady.temperatures.items()}
        held = network.simulate(hold, losses=losses, initial=at_last)
        assert held.temperatures["oil"][-1] == pytest.approx(oil[-1], abs=1e-4)
