"""Readings of the sensors along a trajectory and their derivatives: nodes, lag, bias, total loss."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.recurrence import lagged
from diagnosis.forward.trajectory import Trajectory
from models.base.types import Array
from models.correction.instruments import Mix
from models.quantities.quantities import is_total_loss


@dataclass(kw_only=True, eq=False)
class Sensors:
    """Properties of every channel; unknowns write into them.

    Attributes
    ----------
    channels : tuple of str
        Nodes, or ``P_loss``
    lag, bias : Array, shape (channels,)
        First-order lag [s] and bias [K]; of the total loss the bias in W
    loss_gain : float
        Factor on the total loss, [-]
    loss_delay : float
        Of the total loss behind the inputs, [s]; negative where it is ahead
    mixes : mapping of str to sequence of Mix
        Other nodes that thermometers feel, by channel
    """

    channels: tuple[str, ...]
    lag: Array
    bias: Array
    loss_gain: float = 1.0
    loss_delay: float = 0.0
    mixes: Mapping[str, Sequence[Mix]] = field(default_factory=dict)


def boundary_temperatures(model: NetworkOnGrid, trajectory: Trajectory) -> dict[str, Array]:
    """Temperatures of the boundaries at the middles of the intervals, shape (K,) each, [degC]."""
    T = trajectory.middle
    found = model.laws.boundary(*model.signals(trajectory.piece, T, trajectory.values, trajectory.memory))
    return {name: np.broadcast_to(np.asarray(each, dtype=float), T.shape[:1])
            for name, each in zip(model.laws.boundaries, found, strict=True)}  # fmt: skip


def readings(model: NetworkOnGrid, trajectory: Trajectory, sensors: Sensors) -> Array:
    """Readings of the sensors along a trajectory, shape (K + 1, channels), [degC] or [W]."""
    read = np.empty((len(trajectory.T), len(sensors.channels)))
    nodes = dict(zip(model.parts, trajectory.T.T, strict=False))
    if sensors.mixes:
        nodes |= {name: to_points(T) for name, T in boundary_temperatures(model, trajectory).items()}
    for index, name in enumerate(sensors.channels):
        if is_total_loss(name):
            read[:, index] = delayed_loss(trajectory, sensors.loss_delay) * sensors.loss_gain
        else:
            felt = _felt(model, nodes, sensors, name, trajectory)
            read[:, index] = lagged(felt, trajectory.piece.steps, sensors.lag[index])
    error = trajectory.piece.error
    return np.asarray(read + sensors.bias + (0.0 if error is None else error.reading))


def reading_columns(
    model: NetworkOnGrid, trajectory: Trajectory, sensors: Sensors, T: Array, direct_loss: Array
) -> Array:
    """Change of the readings for changes of temperatures and loss.

    The delay of the loss, half a row or so, is left out here: it moves a small change by next to nothing.

    Parameters
    ----------
    T : Array, shape (K + 1, parts, columns)
        Changes of the temperatures, [K]
    direct_loss : Array, shape (K, columns)
        Changes of the total loss at fixed temperatures, [W]

    Returns
    -------
    Array, shape (K + 1, channels, columns)
    """
    read = np.empty((len(T), len(sensors.channels), T.shape[-1]))
    nodes = dict(zip(model.parts, np.moveaxis(T, 1, 0), strict=False))
    for index, name in enumerate(sensors.channels):
        if is_total_loss(name):
            slope = 0.5 * trajectory.loss_slope[:, None, :]
            loss = (slope @ T[1:] + slope @ T[:-1])[:, 0] + direct_loss
            read[:, index] = to_points(loss) * sensors.loss_gain
        else:
            felt = _felt(model, nodes, sensors, name, trajectory)
            read[:, index] = lagged(felt, trajectory.piece.steps, sensors.lag[index])
    return read


def _felt(
    model: NetworkOnGrid, nodes: Mapping[str, Array], sensors: Sensors, channel: str, trajectory: Trajectory
) -> Array:  # fmt: skip
    """Temperatures, or their changes, as a thermometer feels them; boundaries that are not given do not change."""
    own = nodes[model.parts[model.part_index(channel)]]
    felt = own
    for one in sensors.mixes.get(channel, ()):
        other = nodes.get(one.node, np.zeros_like(own))
        felt = felt + one.share * (lagged(other, trajectory.piece.steps, one.lag) - own)
    return felt


def to_points(values: Array) -> Array:
    """From the middles of the intervals to the grid points, shape (K, ...) to (K + 1, ...)."""
    return np.concatenate([values[:1], 0.5 * (values[1:] + values[:-1]), values[-1:]])


def delayed_loss(trajectory: Trajectory, delay: float) -> Array:
    """Total loss at the grid points as it was `delay` seconds before, shape (K + 1,), [W]."""
    loss, time = to_points(trajectory.loss), trajectory.piece.time
    return loss if delay == 0.0 else np.interp(time - delay, time, loss)


def delay_column(trajectory: Trajectory, delay: float) -> Array:
    """Change of the total loss per second of delay, shape (K + 1,), [W/s]."""
    later, earlier = (delayed_loss(trajectory, delay + way) for way in (1.0, -1.0))
    return np.asarray(0.5 * (later - earlier))
