"""Steady oil temperatures of many operating points, also far from where the iteration to a steady state ends."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from models.cycle import COLUMNS
from models.network import Losses, ThermalNetwork
from models.simulation import Result, steady_state
from models.types import Array

ITERATIONS = 120  # most points take a third
LONG_S = 2e5  # 60 time constants of the housing


def steady_oil(
    network: ThermalNetwork,
    losses: Losses,
    *,
    speed: Array,
    torque: Array,
    inputs: Mapping[str, Array] | None = None,
    parameters: Mapping[str, Array] | None = None,
) -> tuple[Array, Array]:
    """Oil temperature [degC] and total loss [W] at rest, each of shape (N,).

    Parameters
    ----------
    network : ThermalNetwork
    losses : Losses
    speed, torque : Array, shape (N,)
        Of the input shaft, [1/min] and [N m]
    inputs, parameters : mapping of name to Array, shape (N,), or None
    """
    given, factors = dict(inputs or {}), dict(parameters or {})

    def settled(rows: NDArray[np.intp]) -> Array:
        """Oil and loss of some points, shape (rows, 2)."""
        try:
            result = steady_state(
                network,
                losses=losses,
                speed=speed[rows],
                torque=torque[rows],
                inputs={name: values[rows] for name, values in given.items()},
                parameters={name: values[rows] for name, values in factors.items()},
                max_iterations=ITERATIONS,
            )
        except ArithmeticError:
            # Far from the nominal definition the iteration may not end; time always does.
            if len(rows) > 1:
                return np.concatenate([settled(half) for half in np.array_split(rows, 2)])
            result = after_long(rows[0])
        return np.stack((result.temperatures["oil"][..., -1], result.loss[..., -1]), axis=-1).reshape(-1, 2)

    def after_long(row: np.intp) -> Result:
        at = {name: float(values[row]) for name, values in given.items()}
        columns = {"speed_rpm": float(speed[row]), "torque_Nm": float(torque[row])}
        columns |= {COLUMNS[name][0]: at.get(name, default) for name, default in network.inputs.items()}
        cycle = {"time_s": np.array([0.0, LONG_S])} | {name: np.full(2, value) for name, value in columns.items()}
        one = {name: float(values[row]) for name, values in factors.items()}
        result: Result = network.simulate(cycle, losses=losses, parameters=one)
        return result

    oil, loss = settled(np.arange(len(speed))).T
    return oil, loss
