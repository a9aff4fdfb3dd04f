"""Heat per unit of a relative change somewhere in a network, along one piece."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from diagnosis.engine.model_error.courses import SPEED, TORQUE, View
from diagnosis.forward.recurrence import lagged
from diagnosis.forward.trajectory import Heat
from models.base.types import Array

STEP = 0.01  # of the largest torque
SPAN_K = 100.0  # that relative changes of a temperature mean


@dataclass(frozen=True, kw_only=True)
class SourceHeat:
    """Heat of some sources, into their own parts."""

    names: tuple[str, ...]

    def __call__(self, view: View) -> Heat:
        """Along a piece, per relative change."""
        into, loss = _nothing(view)
        for name in self.names:
            index = view.sources[name]
            heat = view.point.balance.sources[:, index]
            into[:, : view.model.n] += heat[:, None] * view.model.injection[index]
            loss += heat * view.model.is_loss[index]
        return Heat(into=into, loss=loss)


@dataclass(frozen=True, kw_only=True)
class LinkHeat:
    """Heat flow through some links."""

    names: tuple[str, ...]

    def __call__(self, view: View) -> Heat:
        """Along a piece, per relative change."""
        into, loss = _nothing(view)
        for name in self.names:
            index, balance = view.links[name], view.point.balance
            flow = balance.conductances[:, index] * balance.differences[:, index]
            into[:, : view.model.n] += flow[:, None] * view.model.to_parts[index]
        return Heat(into=into, loss=loss)


@dataclass(frozen=True, kw_only=True)
class SplitHeat:
    """Heat of some sources, from their own parts to another one."""

    names: tuple[str, ...]
    target: str

    def __call__(self, view: View) -> Heat:
        """Along a piece, per share."""
        moved = SourceHeat(names=self.names)(view).into
        into = -moved
        into[:, view.model.parts.index(self.target)] += moved.sum(axis=1)
        return Heat(into=into, loss=np.zeros(len(into)))


def pair_heat(view: View, *, pair: tuple[str, str]) -> Heat:
    """Heat between two nodes through the mean conductance of the machine."""
    into, loss = _nothing(view)
    flow = view.standard.conductance * (view.temperature(pair[0]) - view.temperature(pair[1]))
    for node, sign in zip(pair, (-1.0, 1.0), strict=True):
        if node in view.model.parts:
            into[:, view.model.parts.index(node)] += sign * flow
    return Heat(into=into, loss=loss)


def capacity_heat(view: View, *, part: str) -> Heat:
    """Heat that a larger capacity takes."""
    index = view.model.parts.index(part)
    return _into_part(view, index, -_stored(view, index, view.trajectory.T[:, index]))


def core_heat(view: View, *, part: str, time: float) -> Heat:
    """Heat that a part does not take at once, since its core follows with a time constant [s]."""
    index = view.model.parts.index(part)
    T = view.trajectory.T[:, index]
    return _into_part(view, index, _stored(view, index, T - lagged(T, view.piece.steps, time)))


def mass_heat(view: View, *, part: str, time: float) -> Heat:
    """Heat from a mass that follows a part with a time constant [s], through the mean conductance of the machine."""
    index = view.model.parts.index(part)
    T = view.trajectory.T[:, index]
    ahead = T - lagged(T, view.piece.steps, time)
    return _into_part(view, index, -0.5 * view.standard.conductance * (ahead[1:] + ahead[:-1]))


def torque_heat(view: View) -> Heat:
    """Heat per offset of the torque while the machine turns, as a share of the largest torque."""
    samples, inputs = np.array(view.piece.samples), view.point.machine.inputs
    turning = np.abs(samples[..., inputs.index(SPEED)]) > view.standard.coordinates[SPEED].floor
    samples[..., inputs.index(TORQUE)] += STEP * view.standard.largest[TORQUE] * turning
    return view.point.moved_heat(samples, STEP)


def gain_heat(view: View, *, name: str) -> Heat:
    """Heat per relative change of an input."""
    return view.point.heat_per_relative(name)


def offset_heat(view: View, *, name: str) -> Heat:
    """Heat per offset of an input that is a temperature, as a share of :data:`SPAN_K`."""
    return view.point.heat_per(name) * SPAN_K


def _nothing(view: View) -> tuple[Array, Array]:
    count = len(view.piece.steps)
    return np.zeros((count, view.model.n + len(view.model.coupled))), np.zeros(count)


def _into_part(view: View, index: int, heat: Array) -> Heat:
    into, loss = _nothing(view)
    into[:, index] = heat
    return Heat(into=into, loss=loss)


def _stored(view: View, index: int, T: Array) -> Array:
    """Heat [W] that the capacity of a part stores along temperatures at the grid points."""
    return np.asarray(view.trajectory.capacities[index] * np.diff(T) / view.piece.steps)
