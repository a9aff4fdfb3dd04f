"""Steady oil temperatures of many operating points, also far from where the iteration to a steady state ends."""

from __future__ import annotations

from collections.abc import Mapping

from models.network import Losses, ThermalNetwork
from models.simulation import steady_state
from models.types import Array


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
    result = steady_state(network, losses=losses, speed=speed, torque=torque, inputs=inputs, parameters=parameters)
    return result.temperatures["oil"][..., -1].ravel(), result.loss[..., -1].ravel()
