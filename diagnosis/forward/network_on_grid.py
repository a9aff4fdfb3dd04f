"""A network on the working grid: its laws, losses and memories evaluated on all intervals of a piece at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import sympy as sp

from diagnosis.forward.extra_states import Memories, update_of
from diagnosis.forward.grid import Piece
from models.base.types import Array
from models.network.compiled import FUNCTIONS, law_expressions, laws_of
from models.network.laws import compile_each, compile_function, function_source, symbol
from models.quantities.quantities import node_of_channel
from models.simulation.thermal_network import BASE_SIGNALS, Losses, ThermalNetwork

STEADY = 0.03  # relative change of speed or torque within an interval
LOSS_STEP_K = 2.0  # for the derivatives of the losses
# Within this a loss is taken from its straight line: the jump when it is not must not make a fit stumble.
LOSS_NEAR_K, TORQUE_NEAR = 0.1, 0.003
LOSS_REACH_K, TORQUE_REACH = 3.0, 0.05  # beyond it the derivatives are taken anew
SLOW_NEAR_K, SLOW_REACH_K = 0.7, 15.0  # the same of a piece whose rows are means over minutes
TORQUE_STEP = 0.02  # relative
HIGHEST_T, LOWEST_T = 400.0, -60.0  # a trajectory is held here while it settles


@dataclass(frozen=True, kw_only=True, eq=False)
class Balance:
    """Heat balance on all intervals.

    Attributes
    ----------
    heat : Array, shape (..., K, parts)
        Net heat into every part, [W]
    sources : Array, shape (..., K, sources)
        [W]
    conductances, differences : Array, shape (..., K, links)
        [W/K] and [K]
    """

    heat: Array
    sources: Array
    conductances: Array
    differences: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class LossTangent:
    """Losses of a piece as straight lines of the temperatures and of the torque around a trajectory.

    Attributes
    ----------
    T : Array, shape (K, nodes)
        Temperatures they were computed at, [degC]
    power : Array, shape (K, components)
        As computed, [W]
    slope : Array, shape (K, components, nodes)
        [W/K]
    torque_slope : Array, shape (K, components)
        Per relative change of the torque, [W]
    samples : Array
        Inputs that they were computed with, see :class:`diagnosis.forward.grid.Piece`
    stronger : Array, shape (K,)
        Relative change of the torque since, up to :data:`TORQUE_NEAR`
    """

    T: Array
    power: Array
    slope: Array
    torque_slope: Array
    samples: Array
    stronger: Array

    def at(self, T: Array) -> Array:
        """Losses [W], shape (K, components), at temperatures of shape (K, nodes)."""
        along = self.slope @ (T - self.T)[:, :, None]
        return np.asarray(self.power + along[:, :, 0] + self.stronger[:, None] * self.torque_slope)


class NetworkOnGrid:
    """A network whose laws are evaluated on all intervals of a piece at once.

    Parameters
    ----------
    losses : Losses
        The loss model behind the signals ``P_<component>``
    """

    def __init__(self, network: ThermalNetwork, losses: Losses) -> None:
        self.network, self.losses = network, losses
        functions = law_expressions(network)
        self.laws = laws_of(network, {name: compile_each(*functions[name]) for name in FUNCTIONS})
        self.parts = self.laws.parts
        self.n = len(self.parts)
        self.injection = self.laws.injection
        names = [*self.parts, *self.laws.boundaries]
        self.incidence = np.zeros((len(network.links), len(names)))
        for index, link in enumerate(network.links):
            self.incidence[index, names.index(link.nodes[0])] = 1.0
            self.incidence[index, names.index(link.nodes[1])] = -1.0
        self.to_parts = -self.incidence[:, : self.n]
        self._varying = np.array(self.laws.varying, dtype=int)
        self._constant = np.setdiff1d(np.arange(len(network.links)), self._varying)
        self.loss_nodes = np.array([self.parts.index(name) for name in losses.temperature_nodes], dtype=int)
        self._apart = _apart(losses)
        self.is_loss = np.array(self.laws.losses_of_sources, dtype=bool)
        self.start = np.array([p.start for p in network.parameters])

    def part_index(self, channel: str) -> int:
        """Index of the part that a channel measures."""
        return self.parts.index(node_of_channel(channel, self.parts))

    # ------------------------------------------------------------------ heat balance on all intervals
    # Temperatures and losses may each be many at once: a further first axis, V.

    def signals(self, piece: Piece, T: Array, values: Array, memory: Array) -> list[Array | float]:
        """The common signals of the laws at the middles of the intervals; see
        :class:`models.portable.evaluation.Laws`.
        """
        return [
            piece.middle, *np.moveaxis(piece.inputs, -1, 0), *np.moveaxis(T, -1, 0), *values,
            *np.moveaxis(memory, -1, 0),
        ]  # fmt: skip

    def capacities(self, values: Array) -> Array:
        """Heat capacities of the parts [J/K], shape (parts,)."""
        return np.array(self.laws.fixed(*values)[len(self._constant) :], dtype=float)

    def conductances(self, signals: Sequence[Array | float], values: Array, shape: tuple[int, ...]) -> Array:
        """Conductances of all links [W/K], shape (K, links) or (V, K, links)."""
        result = np.empty((*shape, len(self.incidence)))
        for index, value in zip(self._constant, self.laws.fixed(*values), strict=False):
            result[..., index] = value
        for index, value in zip(self._varying, self.laws.exchange(*signals), strict=True):
            result[..., index] = value
        return result

    def balance(self, piece: Piece, T: Array, values: Array, power: Array, memory: Array) -> Balance:
        """Heat balance at the middles of the intervals.

        Parameters
        ----------
        T : Array, shape (K, parts) or (V, K, parts)
            [degC]
        values : Array, shape (parameters,)
            Parameters of the network
        power : Array, shape (K, components) or (V, K, components)
            Nominal losses, [W]
        memory : Array, shape (K, states)
        """
        shape = np.broadcast_shapes(T.shape[:-1], power.shape[:-1])
        signals = self.signals(piece, T, values, memory)
        conductances = self.conductances(signals, values, shape)
        everywhere, sources = np.empty((*shape, self.incidence.shape[1])), np.empty((*shape, len(self.laws.sources)))
        everywhere[..., : self.n] = T
        for index, value in enumerate(self.laws.boundary(*signals), start=self.n):
            everywhere[..., index] = value
        differences = everywhere @ self.incidence.T
        for index, value in enumerate(self.laws.heat(*signals, *np.moveaxis(power, -1, 0))[: sources.shape[-1]]):
            sources[..., index] = value
        heat = sources @ self.injection + (conductances * differences) @ self.to_parts
        if piece.error is not None:
            heat = heat + piece.error.heat
        return Balance(heat=heat, sources=sources, conductances=conductances, differences=differences)

    def rates(self, piece: Piece, T: Array, values: Array, power: Array, memory: Array) -> Array:
        """Rates of the states that are solved with the temperatures [1/s times their unit], shape (..., K, coupled)."""
        shape = np.broadcast_shapes(T.shape[:-1], power.shape[:-1])
        found = self._coupled_law(*self.signals(piece, T, values, memory), *np.moveaxis(power, -1, 0))
        return np.stack([np.broadcast_to(rate, shape) for rate in found], axis=-1)

    # ------------------------------------------------------------------ losses and memories

    def loss_at(self, samples: Array, T: Array) -> Array:
        """Nominal losses, mean over the samples of every interval, [W], shape (K, components).

        Parameters
        ----------
        samples : Array, shape (K, S, inputs)
            See :class:`diagnosis.forward.grid.Piece`
        T : Array, shape (K, parts)
            [degC]
        """
        operation = samples[..., :2]
        # Where the operating point moves within an interval, the mean of the losses is not the loss at the mean; with
        # a loss that goes with the square it is by 8e-5 at STEADY, which the noise of recorded speeds reaches.
        moves = (np.ptp(operation, axis=1) > STEADY * np.abs(operation).max(axis=1)).any(axis=-1)
        counts = np.where(moves, operation.shape[1], 1)
        first = np.cumsum(counts) - counts
        points = np.repeat(operation.mean(axis=1), counts, axis=0)
        points[np.repeat(moves, counts)] = operation[moves].reshape(-1, 2)
        at = np.repeat(T[:, self.loss_nodes], counts, axis=0)
        power = self.losses.power(points[:, 0], points[:, 1], at)
        return np.asarray(np.add.reduceat(power, first, axis=0) / counts[:, None])

    def loss_tangent(self, piece: Piece, T: Array, previous: LossTangent | None = None) -> LossTangent:
        """Losses around a trajectory; of `previous` is kept what is near enough, interval by interval."""
        T = np.clip(T, LOWEST_T, HIGHEST_T)
        mine, samples = T[:, self.loss_nodes], piece.samples
        if previous is None or previous.samples.shape != samples.shape:
            return self._tangent(samples, T)
        if piece.slow:
            return self._slow_tangent(samples, T, previous)
        stronger, unlike = _stronger(samples, previous.samples)
        apart = np.abs(mine - previous.T).max(axis=1, initial=0.0)
        anew = np.flatnonzero((apart > LOSS_NEAR_K) | (unlike > TORQUE_NEAR))
        far = np.flatnonzero((apart > LOSS_REACH_K) | (unlike > TORQUE_REACH))
        if not len(anew):
            return replace(previous, stronger=stronger)
        # Copies: the tangent before may still be somebody's.
        found = {name: np.array(getattr(previous, name)) for name in ("T", "power", "slope", "torque_slope", "samples")}
        found["T"][anew], found["samples"][anew], stronger[anew] = mine[anew], samples[anew], 0.0
        found["power"][anew] = self.loss_at(samples[anew], T[anew])
        if len(far):
            slopes = self._loss_slopes(samples[far], T[far], found["power"][far])
            found["slope"][far], found["torque_slope"][far] = slopes
        return LossTangent(**found, stronger=stronger)

    def _tangent(self, samples: Array, T: Array) -> LossTangent:
        """Losses and their slopes around temperatures, all rows recomputed."""
        power = self.loss_at(samples, T)
        slope, torque_slope = self._loss_slopes(samples, T, power)
        return LossTangent(T=T[:, self.loss_nodes], power=power, slope=slope, torque_slope=torque_slope,
                           samples=samples, stronger=np.zeros(len(T)))  # fmt: skip

    def _slow_tangent(self, samples: Array, T: Array, previous: LossTangent) -> LossTangent:
        """Recompute all loss tangents or none: partial updates make fits of slow recordings converge elsewhere."""
        mine = T[:, self.loss_nodes]
        apart = float(np.abs(mine - previous.T).max(initial=0.0))
        if samples is previous.samples and apart < SLOW_NEAR_K:
            return previous
        if apart >= SLOW_REACH_K:
            return self._tangent(samples, T)
        return replace(previous, T=mine, power=self.loss_at(samples, T), samples=samples)

    def _loss_slopes(self, samples: Array, T: Array, power: Array) -> tuple[Array, Array]:
        """Derivatives of losses with respect to temperatures, (K, components, nodes), and to the torque."""
        slope = np.zeros((*power.shape, len(self.loss_nodes)))
        for readers in self._apart:
            moved = T.copy()
            moved[:, self.loss_nodes[list(readers)]] += LOSS_STEP_K
            change = (self.loss_at(samples, moved) - power) / LOSS_STEP_K
            for node, components in readers.items():
                slope[:, components, node] = change[:, components]
        stronger = np.array(samples)
        stronger[..., 1] *= 1.0 + TORQUE_STEP
        return slope, (self.loss_at(stronger, T) - power) / TORQUE_STEP

    @cached_property
    def switches(self) -> list[int]:
        """Which of the states switch."""
        return [index for index, state in enumerate(self.network.states) if state.update is not None]

    @cached_property
    def coupled(self) -> list[int]:
        """Which of the states go with the temperatures all the time, as a tank does: they are solved with them."""
        mine = {f"T_{part}" for part in self.parts}
        return [index for index, state in enumerate(self.network.states)
                if state.update is None and mine & {s.name for s in state.rate.free_symbols}]  # fmt: skip

    @cached_property
    def actuated(self) -> list[int]:
        """Which of the others follow a switch, as a slow valve does."""
        states = self.network.states
        switches = {states[index].name for index in self.switches}
        return [index for index, state in enumerate(states) if state.update is None and index not in self.coupled
                and switches & {s.name for s in state.rate.free_symbols}]  # fmt: skip

    @cached_property
    def acting(self) -> list[int]:
        """Which of both the heat balance feels; it is taken for a straight line of them."""
        network = self.network
        laws = [*(link.conductance for link in network.links), *(source.heat for source in network.sources),
                *self.boundary.values(), *(network.states[index].rate for index in self.coupled)]  # fmt: skip
        felt = {s.name for law in laws for s in law.free_symbols}
        return [index for index in (*self.switches, *self.actuated) if network.states[index].name in felt]

    @cached_property
    def switched_by(self) -> list[int]:
        """Which parts' temperatures decide on switches."""
        laws = [update_of(self.network.states[index], averaged=False) for index in self.switches]
        read = {s.name for law in laws for s in law.xreplace(self.boundary).free_symbols}
        return [index for index, part in enumerate(self.parts) if f"T_{part}" in read]

    @cached_property
    def boundary(self) -> Mapping[sp.Symbol, sp.Expr]:
        """Expressions of all boundary temperatures, [degC], by their signal."""
        return {symbol(f"T_{node}"): law for node, law in self.network.boundaries.items()}

    @cached_property
    def _signal_names(self) -> list[str]:
        """All signals but states and losses."""
        return [*BASE_SIGNALS, *self.network.inputs, *(f"T_{part}" for part in self.parts),
                *(p.name for p in self.network.parameters)]  # fmt: skip

    @cached_property
    def arguments(self) -> list[str]:
        """All signals, in the order in which laws get them."""
        network = self.network
        return [*self._signal_names, *(s.name for s in network.states), *(f"P_{c}" for c in network.components)]

    @cached_property
    def _coupled_law(self) -> Callable[..., tuple[Any, ...]]:
        laws = [self.network.states[index].rate.xreplace(self.boundary) for index in self.coupled]
        return compile_function(function_source("rates", self.arguments, laws, vector=True), "rates")

    @cached_property
    def _memories(self) -> Memories:
        arguments = [*self._signal_names, *(f"P_{c}" for c in self.network.components)]
        return Memories(self.network.states, arguments, self.parts, self.boundary)

    @cached_property
    def remembered(self) -> frozenset[str]:
        """Parameters that decide on states."""
        laws = [law for state in self.network.states for law in (state.rate, state.update) if law is not None]
        return frozenset(s.name for law in laws for s in law.free_symbols) & {p.name for p in self.network.parameters}

    def memory(
        self, piece: Piece, T: Array, seen: Array, values: Array, power: Array, before: Array | None = None
    ) -> Array:  # fmt: skip
        """The extra states (those that are not temperatures) at the middles of the intervals.

        Parameters
        ----------
        T : Array, shape (K + 1, parts)
            Temperatures at the grid points, [degC]
        seen : Array, shape (K + 1, parts)
            Those that switches follow, [degC]
        values : Array, shape (parameters,)
        power : Array, shape (K, components)
            Nominal losses, [W]
        before : Array, shape (K, states), optional
            Where the states that are solved with the temperatures are taken from, if they are there

        Returns
        -------
        Array, shape (K, states)
        """
        count = len(self.network.states)
        known = {} if before is None or before.shape[1] != count else {i: before[:, i] for i in self.coupled}
        middle = 0.5 * (T[1:] + T[:-1])
        rows = [piece.middle, *piece.inputs.T, *middle.T, *values, *power.T]
        result = np.empty((len(piece.steps), count))
        for index, state in enumerate(self._memories.follow(piece, rows, seen, known)):
            result[:, index] = state
        return result

    def switching(self, *, averaged: bool) -> Callable[[Sequence[Any]], tuple[float, ...]]:
        """Values of switches after a step, from plain numbers: all signals in the order of the laws."""
        return self._picked([update_of(self.network.states[index], averaged=averaged) for index in self.switches])

    @cached_property
    def actuation(self) -> Callable[[Sequence[Any]], tuple[float, ...]]:
        """Rates of the states that follow switches, then the derivative of each with respect to itself."""
        states = [self.network.states[index] for index in self.actuated]
        return self._picked([*(s.rate for s in states), *(sp.diff(s.rate, symbol(s.name)) for s in states)])

    def _picked(self, laws: Sequence[sp.Expr]) -> Callable[[Sequence[Any]], tuple[float, ...]]:
        laws, names = [law.xreplace(self.boundary) for law in laws], self.arguments
        used = {s.name for law in laws for s in law.free_symbols}
        places = [index for index, name in enumerate(names) if name in used]  # few of dozens
        function = compile_function(function_source("laws", [names[i] for i in places], laws, vector=False), "laws")
        return lambda signals: function(*(signals[i] for i in places))


def _apart(losses: Losses) -> list[dict[int, list[int]]]:
    """Temperatures that can be moved together, since no component reads two of them; and which components read each.

    References
    ----------
    Curtis, Powell, Reid, On the estimation of sparse Jacobian matrices, J. Inst. Maths Applics 13 (1974).
    """
    groups: list[dict[int, list[int]]] = []
    for node, name in enumerate(losses.temperature_nodes):
        readers = [index for index, nodes in enumerate(losses.reads) if name in nodes]
        free = (group for group in groups if not any(set(readers) & set(others) for others in group.values()))
        group = next(free, None)
        if group is None:
            groups.append(group := {})
        group[node] = readers
    return groups


def _stronger(now: Array, before: Array) -> tuple[Array, Array]:
    """Relative increase of the torque in every interval; and how unlike its samples are, at most; (K,) each.

    Another speed is infinitely unlike.
    """
    torque, then = np.abs(now[..., 1]), np.abs(before[..., 1])
    change = (torque - then).mean(axis=1) / np.maximum(then.mean(axis=1), 1e-9)
    unlike = np.abs(torque - then).max(axis=1) / np.maximum(then.max(axis=1), 1e-9)
    return change, np.where((now[..., 0] == before[..., 0]).all(axis=1), np.maximum(unlike, np.abs(change)), np.inf)
