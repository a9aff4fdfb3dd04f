"""Networks with extensions, for tests of all kinds of FMU."""

from __future__ import annotations

from typing import Any

import sympy as sp

from models.simulation.thermal_network import ThermalNetwork


def thermostat(s: Any) -> sp.Expr:
    return sp.Piecewise((0.0, s.T_oil > 29.0), (1.0, s.T_oil < 28.0), (s.heater_on, True))


def extended(network: ThermalNetwork) -> ThermalNetwork:
    """A network with a heater that a thermostat switches, an input of its own, and a boundary."""
    return (
        network.with_input("pump_flow", 1.0)
        .with_state("heater_on", start=1.0, update=thermostat)
        .with_source("oil", lambda s: 4000.0 * s.heater_on, name="heater (electric)")
        .with_source("oil", lambda s: 3.0 * s.pump_flow, name="pump", is_loss=True)
        .with_link("housing", "cellar", lambda s: 3.0, temperature=lambda s: 0.0 * s.T_ambient + 10.0)
    )  # fmt: skip


def with_everything(network: ThermalNetwork) -> ThermalNetwork:
    """An extended network with a node, a memory that decays, heat that depends on time and links that vary."""
    return (
        extended(network)
        .with_state("run_in", start=1.0, rate=lambda s: -s.run_in * sp.Abs(s.speed) / 1e5)
        .with_source("mesh", lambda s: 0.2 * s.run_in * s.P_mesh_sliding, name="run-in", is_loss=True)
        .with_source("housing", lambda s: 20.0 * sp.Max(sp.sin(s.time / 40.0), 0.0), name="sun")
        .with_node("cooler", 800.0)
        .with_link("cooler", "oil", lambda s: 40.0 * s.pump_flow**2 / (1 + s.pump_flow**2))
        .with_link("cooler", "air", lambda s: 5.0 + 0.01 * sp.Abs(s.T_cooler - s.T_air) ** 1.25)
    )
