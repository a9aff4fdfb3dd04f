"""Temperatures along a recording and their derivatives: the network simulated for all intervals at once.

The network is linearised about a whole trajectory instead of integrated step by step: on every interval the heat
balance is affine in the temperatures and solved exactly (matrix exponential), the solution is the next trajectory to
linearise about, and three or four rounds settle it: a Newton iteration on waveforms. Every round is a handful of array
operations over all intervals, and what it linearised serves the derivatives as well: an extra heat anywhere, at
any time, of any parameter, answers through the same matrices.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
import sympy as sp

from diagnosis.grid import Piece
from diagnosis.memories import Memories, update_of
from models.compiled import compile_laws, structure
from models.laws import compile_function, function_source, symbol
from models.network import BASE_SIGNALS, Losses, ThermalNetwork
from models.types import Array

ROUNDS = 6
SETTLED_K = 0.02
STEADY = 0.01  # relative change of speed or torque within an interval
LOSS_STEP_K = 2.0  # for the derivatives of the losses
LOSS_NEAR_K = 0.7  # within it the straight lines are good to some 1e-4 of the loss
LOSS_REACH_K = 15.0  # beyond it the derivatives are taken anew
TEMPERATURE_STEP_K = 0.05
STATE_STEP = 0.05  # of a state that is solved with the temperatures, mostly a temperature itself
TORQUE_STEP = 0.02  # relative
# Where switches run free: a switching that comes a step later moves a temperature by more, so rounds end early.
FREE_ROUNDS, FREE_SETTLED_K = 3, 0.2
HIGHEST_T, LOWEST_T = 400.0, -60.0  # a trajectory is held here while it settles
RUNAWAY_T = 1500.0  # degC; beyond it there is no trajectory
# A switching that no row shows, be they means over minutes or noisy near a set-point, sends a guided trajectory astray.
# Further off than this, switches follow the simulated temperature until it is back.
ASTRAY_K = 4.0
SMALL = 1e-9
MOST_AT_ONCE = 40_000  # intervals times parameters whose derivatives are taken together


@dataclass(frozen=True, kw_only=True, eq=False)
class LossTangent:
    """Losses of a piece as straight lines of the temperatures around a trajectory.

    Attributes
    ----------
    T : Array, shape (K, nodes)
        Temperatures they were computed at, [degC]
    power : Array, shape (K, components)
        [W]
    slope : Array, shape (K, components, nodes)
        [W/K]
    torque_slope : Array, shape (K, components)
        Per relative change of the torque, [W]
    samples : Array
        Inputs that they were computed with, see :class:`diagnosis.grid.Piece`
    """

    T: Array
    power: Array
    slope: Array
    torque_slope: Array
    samples: Array

    def at(self, T: Array) -> Array:
        """Losses [W], shape (K, components), at temperatures of shape (K, nodes)."""
        return np.asarray(self.power + np.einsum("kcn,...kn->...kc", self.slope, T - self.T))


class NetworkOnGrid:
    """A network whose laws are evaluated on all intervals of a piece at once.

    Parameters
    ----------
    network : ThermalNetwork
    losses : Losses
        The loss model behind the signals ``P_<component>``
    """

    def __init__(self, network: ThermalNetwork, losses: Losses) -> None:
        self.network, self.losses = network, losses
        self.laws = compile_laws(network, vector=True)
        self.parts = self.laws.parts
        self.n = len(self.parts)
        _, to_boundary, self.injection = structure(network)
        n_all = self.n + to_boundary.shape[-1]
        self._incidence = np.zeros((len(network.links), n_all))
        names = [*self.parts, *self.laws.boundaries]
        for index, link in enumerate(network.links):
            self._incidence[index, names.index(link.nodes[0])] = 1.0
            self._incidence[index, names.index(link.nodes[1])] = -1.0
        self.to_parts = -self._incidence[:, : self.n]
        varying = np.array(self.laws.varying, dtype=int)
        self._varying = varying
        self._constant = np.array([i for i in range(len(network.links)) if i not in set(self.laws.varying)], dtype=int)
        self.loss_nodes = np.array([self.parts.index(name) for name in losses.temperature_nodes], dtype=int)
        self.is_loss = np.array(self.laws.losses_of_sources, dtype=bool)
        self.start = np.array([p.start for p in network.parameters])

    # ------------------------------------------------------------------ heat balance on all intervals
    # Temperatures, losses, memories and parameters may each be many at once: a further first axis, V.

    def signals(self, piece: Piece, T: Array, values: Array, memory: Array) -> list[Array | float]:
        """The common signals of the laws at the middles of the intervals; see :class:`models.runtime.Laws`."""
        return [
            piece.middle, *np.moveaxis(piece.inputs, -1, 0), *np.moveaxis(T, -1, 0), *_one_each(values),
            *np.moveaxis(memory, -1, 0),
        ]  # fmt: skip

    def capacities(self, values: Array) -> Array:
        """Heat capacities of the parts [J/K], shape (parts,) or (V, parts)."""
        found = self.laws.fixed(*np.moveaxis(values, -1, 0))[len(self._constant) :]
        return np.stack([np.broadcast_to(np.asarray(c, float), np.shape(values)[:-1]) for c in found], axis=-1)

    def conductances(self, signals: Sequence[Array | float], values: Array, shape: tuple[int, ...]) -> Array:
        """Conductances of all links [W/K], shape (K, links) or (V, K, links)."""
        result = np.empty((*shape, len(self._incidence)))
        for index, value in zip(self._constant, self.laws.fixed(*_one_each(values)), strict=False):
            result[..., index] = value
        for index, value in zip(self._varying, self.laws.exchange(*signals), strict=True):
            result[..., index] = value
        return result

    def differences(self, signals: Sequence[Array | float], T: Array, shape: tuple[int, ...]) -> Array:
        """Temperature differences over the links [K], shape (K, links) or (V, K, links)."""
        everywhere = np.empty((*shape, self._incidence.shape[1]))
        everywhere[..., : self.n] = T
        for index, value in enumerate(self.laws.boundary(*signals), start=self.n):
            everywhere[..., index] = value
        return np.asarray(everywhere @ self._incidence.T)

    def source_heats(self, signals: Sequence[Array | float], power: Array, shape: tuple[int, ...]) -> Array:
        """Heats of all sources [W], shape (K, sources) or (V, K, sources)."""
        result = np.empty((*shape, len(self.laws.sources)))
        for index, value in enumerate(self.laws.heat(*signals, *np.moveaxis(power, -1, 0))[: result.shape[-1]]):
            result[..., index] = value
        return result

    def balance(self, piece: Piece, T: Array, values: Array, power: Array, memory: Array) -> Balance:
        """Heat balance at the middles of the intervals.

        Parameters
        ----------
        piece : Piece
        T : Array, shape (K, parts) or (V, K, parts)
            [degC]
        values : Array, shape (parameters,) or (V, parameters)
            Parameters of the network
        power : Array, shape (K, components) or (V, K, components)
            Nominal losses, [W]
        memory : Array, shape (K, states) or (V, K, states)
        """
        shape = np.broadcast_shapes(T.shape[:-1], power.shape[:-1], memory.shape[:-1], (*values.shape[:-1], 1))
        signals = self.signals(piece, T, values, memory)
        conductances = self.conductances(signals, values, shape)
        differences = self.differences(signals, T, shape)
        sources = self.source_heats(signals, power, shape)
        heat = sources @ self.injection + (conductances * differences) @ self.to_parts
        return Balance(heat=heat, sources=sources, conductances=conductances, differences=differences)

    def rates(self, piece: Piece, T: Array, values: Array, power: Array, memory: Array) -> Array:
        """Rates of the states that are solved with the temperatures [1/s times their unit], shape (..., K, coupled)."""
        shape = np.broadcast_shapes(T.shape[:-1], power.shape[:-1], memory.shape[:-1], (*values.shape[:-1], 1))
        found = self._coupled_law(*self.signals(piece, T, values, memory), *np.moveaxis(power, -1, 0))
        return np.stack([np.broadcast_to(rate, shape) for rate in found], axis=-1)

    # ------------------------------------------------------------------ losses and memories

    def loss_at(self, piece: Piece, T: Array) -> Array:
        """Nominal losses, mean over the samples of every interval, [W], shape (K, components)."""
        mine, operation = T[:, self.loss_nodes], piece.samples[..., :2]
        speed, torque = operation[..., 0], operation[..., 1]
        power = self.losses.power(speed.mean(axis=1), torque.mean(axis=1), mine)
        # Where the operating point moves within an interval, the mean of the losses is not the loss at the mean.
        moving = np.flatnonzero((np.ptp(operation, axis=1) > STEADY * np.abs(operation).max(axis=1)).any(axis=-1))
        if len(moving):
            count = operation.shape[1]
            at = np.repeat(mine[moving], count, axis=0)
            each = self.losses.power(speed[moving].ravel(), torque[moving].ravel(), at)
            power[moving] = each.reshape(len(moving), count, -1).mean(axis=1)
        return np.asarray(power)

    def loss_tangent(self, piece: Piece, T: Array, previous: LossTangent | None = None) -> LossTangent:
        """Losses around a trajectory; derivatives of `previous` are kept where it is near enough."""
        T = np.clip(T, LOWEST_T, HIGHEST_T)
        mine = T[:, self.loss_nodes]
        if previous is not None and previous.samples is piece.samples and np.max(
            np.abs(mine - previous.T), initial=0.0) < LOSS_NEAR_K:  # fmt: skip
            return previous
        power = self.loss_at(piece, T)
        if previous is not None and np.max(np.abs(mine - previous.T), initial=0.0) < LOSS_REACH_K:
            return replace(previous, T=mine, power=power, samples=piece.samples)
        slope = np.empty((len(T), power.shape[-1], len(self.loss_nodes)))
        for index, node in enumerate(self.loss_nodes):
            moved = T.copy()
            moved[:, node] += LOSS_STEP_K
            slope[..., index] = (self.loss_at(piece, moved) - power) / LOSS_STEP_K
        stronger = np.array(piece.samples)
        stronger[..., 1] *= 1.0 + TORQUE_STEP
        torque_slope = (self.loss_at(replace(piece, samples=stronger), T) - power) / TORQUE_STEP
        return LossTangent(T=mine, power=power, slope=slope, torque_slope=torque_slope, samples=piece.samples)

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
                *self._boundary.values(), *(network.states[index].rate for index in self.coupled)]  # fmt: skip
        felt = {s.name for law in laws for s in law.free_symbols}
        return [index for index in (*self.switches, *self.actuated) if network.states[index].name in felt]

    @cached_property
    def switched_by(self) -> list[int]:
        """Which parts' temperatures decide on switches."""
        laws = [update_of(self.network.states[index], blurred=False) for index in self.switches]
        read = {s.name for law in laws for s in law.xreplace(self._boundary).free_symbols}
        return [index for index, part in enumerate(self.parts) if f"T_{part}" in read]

    @cached_property
    def _boundary(self) -> Mapping[sp.Symbol, sp.Expr]:
        return {symbol(f"T_{n.name}"): n.temperature for n in self.network.nodes if n.temperature is not None}

    @cached_property
    def _signal_names(self) -> list[str]:
        """All signals but states and losses."""
        return [*BASE_SIGNALS, *self.network.inputs, *(f"T_{part}" for part in self.parts),
                *(p.name for p in self.network.parameters)]  # fmt: skip

    @cached_property
    def _coupled_law(self) -> Callable[..., tuple[Any, ...]]:
        network = self.network
        arguments = [*self._signal_names, *(s.name for s in network.states), *(f"P_{c}" for c in network.components)]
        laws = [network.states[index].rate.xreplace(self._boundary) for index in self.coupled]
        return compile_function(function_source("rates", arguments, laws, vector=True), "rates")

    @cached_property
    def _memories(self) -> Memories:
        arguments = [*self._signal_names, *(f"P_{c}" for c in self.network.components)]
        return Memories(self.network.states, arguments, self.parts, self._boundary)

    @cached_property
    def remembered(self) -> frozenset[str]:
        """Parameters that decide on states."""
        laws = [law for state in self.network.states for law in (state.rate, state.update) if law is not None]
        return frozenset(s.name for law in laws for s in law.free_symbols) & {p.name for p in self.network.parameters}

    def memory(
        self, piece: Piece, T: Array, seen: Array, values: Array, power: Array, before: Array | None = None
    ) -> Array:  # fmt: skip
        """The states beside the temperatures, at the middles of the intervals.

        Parameters
        ----------
        piece : Piece
        T : Array, shape (K + 1, parts)
            Temperatures at the grid points, [degC]
        seen : Array, shape (K + 1, parts)
            Those that switches follow, [degC]
        values : Array, shape (parameters,) or (V, parameters)
        power : Array, shape (K, components)
            Nominal losses, [W]
        before : Array, shape (K, states), optional
            Where the states that are solved with the temperatures are taken from, if they are there

        Returns
        -------
        Array, shape (K, states) or (V, K, states)
        """
        count = len(self.network.states)
        known = {} if before is None or before.shape[1] != count else {i: before[:, i] for i in self.coupled}
        middle = 0.5 * (T[1:] + T[:-1])
        rows = [piece.middle, *piece.inputs.T, *middle.T, *_one_each(np.atleast_2d(values)), *power.T]
        result = np.empty((*values.shape[:-1], len(piece.steps), count))
        for index, state in enumerate(self._memories.follow(piece, rows, seen, known)):
            result[..., index] = state
        return result

    def switching(self, *, blurred: bool) -> Callable[[Sequence[Any]], tuple[float, ...]]:
        """What switches become, on plain numbers: of all signals in the order of the laws."""
        return self._picked([update_of(self.network.states[index], blurred=blurred) for index in self.switches])

    @cached_property
    def actuation(self) -> Callable[[Sequence[Any]], tuple[float, ...]]:
        """Rates of the states that follow switches, then the derivative of each with respect to itself."""
        states = [self.network.states[index] for index in self.actuated]
        return self._picked([*(s.rate for s in states), *(sp.diff(s.rate, symbol(s.name)) for s in states)])

    def _picked(self, laws: Sequence[sp.Expr]) -> Callable[[Sequence[Any]], tuple[float, ...]]:
        network = self.network
        laws = [law.xreplace(self._boundary) for law in laws]
        names = [*self._signal_names, *(s.name for s in network.states), *(f"P_{c}" for c in network.components)]
        used = {s.name for law in laws for s in law.free_symbols}
        places = [index for index, name in enumerate(names) if name in used]  # few of dozens
        function = compile_function(function_source("laws", [names[i] for i in places], laws, vector=False), "laws")
        return lambda signals: function(*(signals[i] for i in places))


def _one_each(values: Array) -> list[Array | float]:
    """Parameters one by one: numbers, or columns of shape (V, 1)."""
    return list(values) if values.ndim == 1 else [values[:, index, None] for index in range(values.shape[1])]


@dataclass(frozen=True, kw_only=True, eq=False)
class Balance:
    """Heat balance on all intervals.

    Attributes
    ----------
    heat : Array, shape (K, parts)
        Net heat into every part, [W]
    sources : Array, shape (K, sources)
        [W]
    conductances, differences : Array, shape (K, links)
        [W/K] and [K]
    """

    heat: Array
    sources: Array
    conductances: Array
    differences: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Trajectory:
    """A settled trajectory of one piece and what its linearisation knows.

    Attributes
    ----------
    piece : Piece
    T : Array, shape (K + 1, parts)
        Temperatures at the grid points, [degC]
    values : Array, shape (parameters,)
        Values of the network's parameters
    tangent : LossTangent
    seen : Array, shape (K + 1, parts)
        Temperatures that the memories followed, [degC]
    memory : Array, shape (K, states)
    balance : Balance
    jacobian : Array, shape (K, parts, parts)
        Derivative of the net heats with respect to the temperatures, losses included, [W/K]
    loss : Array, shape (K,)
        Total mechanical loss, [W]
    loss_slope : Array, shape (K, parts)
        Its derivative with respect to the temperatures, [W/K]
    decay, gain : Array, shape (K, parts + coupled, parts + coupled)
        Exact solution over an interval: ``T_next = decay T + gain (net heat / capacity)``; [-] and [s]. After the
        temperatures come the states that are solved with them
    capacities : Array, shape (parts,)
    """

    piece: Piece
    T: Array
    values: Array
    tangent: LossTangent
    seen: Array
    memory: Array
    balance: Balance
    jacobian: Array
    loss: Array
    loss_slope: Array
    decay: Array
    gain: Array
    capacities: Array

    @property
    def middle(self) -> Array:
        """Temperatures at the middles of the intervals, shape (K, parts), [degC]."""
        return np.asarray(0.5 * (self.T[1:] + self.T[:-1]))

    def response(self, heat: Array, initial: Array | None = None) -> Array:
        """Change of the temperatures for extra heats.

        Parameters
        ----------
        heat : Array, shape (K, parts, columns) or (K, parts + coupled, columns)
            Extra heats, [W]; and extra rates of the states that are solved with the temperatures
        initial : Array, shape (parts, columns), optional
            Change of the start temperatures, [K]

        Returns
        -------
        Array, shape (K + 1, parts, columns)
            [K]
        """
        n, size = len(self.capacities), self.decay.shape[-1]
        driven = self.gain[:, :, :n] @ (heat[:, :n] / self.capacities[:, None])
        if heat.shape[1] > n:
            driven += self.gain[:, :, n:] @ heat[:, n:]
        result = np.zeros((len(heat) + 1, size, heat.shape[2]))
        if initial is not None:
            result[0, :n] = initial
        now = result[0]
        for k, decay in enumerate(self.decay):
            now = decay @ now
            now += driven[k]
            result[k + 1] = now
        return result[:, :n]


def simulate(
    model: NetworkOnGrid,
    piece: Piece,
    values: Array,
    start: Array,
    *,
    guess: Trajectory | Array | None = None,
    rounds: int = ROUNDS,
    settled_K: float = SETTLED_K,
) -> Trajectory:
    """The free-running trajectory of a piece.

    Parameters
    ----------
    model : NetworkOnGrid
    piece : Piece
    values : Array, shape (parameters,)
        Values of the network's parameters
    start : Array, shape (parts,)
        Start temperatures, [degC]
    guess : Trajectory, or Array of shape (K + 1, parts), optional
        Where to linearise first; by default the start temperatures
    rounds : int
        At most
    settled_K : float
        Largest change of a round at which it ends, [K]

    Raises
    ------
    ArithmeticError
        If the temperatures leave all bounds.
    """
    tangent = guess.tangent if isinstance(guess, Trajectory) else None
    if isinstance(guess, Trajectory):
        T = guess.T
    elif guess is not None:
        T = guess
    else:
        T = np.broadcast_to(start, (len(piece.time), model.n))
    found, states = None, guess.memory if isinstance(guess, Trajectory) else None
    for _ in range(rounds):
        with np.errstate(over="ignore", invalid="ignore"):
            found = _round(model, piece, values, start, np.clip(T, LOWEST_T, HIGHEST_T), tangent, states)
        if not np.isfinite(found.T).all():
            raise ArithmeticError(f"the temperatures of {piece.recording} run away with these parameters")
        change = float(np.max(np.abs(found.T - T)))
        T, tangent, states = found.T, found.tangent, found.memory
        if change < settled_K:
            break
    assert found is not None  # noqa: S101 - rounds >= 1
    # A conductance tilted below zero lets a standing gearbox heat itself for ever: no temperatures at all.
    if float(np.max(np.abs(found.T))) > RUNAWAY_T:
        raise ArithmeticError(f"the temperatures of {piece.recording} run away with these parameters")
    return found


def free_running(model: NetworkOnGrid, piece: Piece, values: Array, start: Array) -> Trajectory:
    """The trajectory of a long piece of a network with switches, that nothing measured guides.

    Whether a switch acts depends on when it acted before, so the rounds of :func:`simulate` settle from the front, one
    switching after the other. Here every round is linearised for each position of the switches, and what is stepped
    through is which of them holds; in finer intervals, since a switch acts in the midst of a row. At the grid points
    stand means over as long as the rows lie apart, as rows of slow recordings are.

    Parameters
    ----------
    model : NetworkOnGrid
    piece : Piece
    values : Array, shape (parameters,)
    start : Array, shape (parts,)
        [degC]
    """
    fine, at = piece.finer()
    count = len(fine.steps)
    T = np.broadcast_to(start, (count + 1, model.n))
    tangent: LossTangent | None = None
    states: Array | None = None
    for _ in range(FREE_ROUNDS):
        middle = np.clip(0.5 * (T[1:] + T[:-1]), LOWEST_T, HIGHEST_T)
        tangent = model.loss_tangent(fine, middle, tangent)
        power = tangent.at(middle[:, model.loss_nodes])
        held = np.clip(T, LOWEST_T, HIGHEST_T)
        memory = model.memory(fine, held, held, values, power, states)
        nothing = np.full_like(T, np.nan)
        before, (T, _, states) = T, _stepped(model, fine, values, start, middle, tangent, memory, nothing)
        if not np.isfinite(T).all():
            raise ArithmeticError(f"the temperatures of {piece.recording} run away with these parameters")
        if float(np.max(np.abs(T - before))) < FREE_SETTLED_K:
            break
    # What rows minutes apart show are means, over as much around every grid point; at the ends over what there is.
    half = piece.samples.shape[1] // 2 if piece.slow else 0
    total = np.concatenate([np.zeros((1, model.n)), np.cumsum(T, axis=0)])
    low, high = np.maximum(at - half, 0), np.minimum(at + half, count) + 1
    means = (total[high] - total[low]) / (high - low)[:, None]
    assert states is not None  # noqa: S101 - rounds >= 1
    memory = np.add.reduceat(states, at[:-1]) / np.diff(at)[:, None]
    unguided = replace(piece, guided=False)
    return replace(_round(model, unguided, values, start, means, None, memory, follow=False), T=means)


def _stepped(
    model: NetworkOnGrid, piece: Piece, values: Array, start: Array, middle: Array, tangent: LossTangent,
    memory: Array, guide: Array,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Temperatures at the grid points where switches follow them as they come; the other memories are given.

    Linearised about the temperatures `middle` once for every position of the switches, and of what follows them, as a
    slow valve does: between its ends the step is taken in proportion. Where there is a `guide`, see
    :meth:`diagnosis.grid.Piece.guide`, the switches follow it as long as the temperatures are near it.

    Returns
    -------
    T, seen : Array, shape (K + 1, parts)
        Temperatures, and those that the switches followed, [degC]
    memory : Array, shape (K, states)
        As given, but for what was found here
    """
    switches, actuated, acting, kept = model.switches, model.actuated, model.acting, memory.copy()
    corners = list(product((0.0, 1.0), repeat=len(acting)))
    solutions = []
    for corner in corners:
        kept[:, acting] = corner
        solved = _linearised(model, piece, values, middle, tangent, kept)
        solutions.append((solved.decay, solved.driven))
    switching, actuation = model.switching(blurred=piece.guided and piece.slow), model.actuation
    power = tangent.at(middle[:, model.loss_nodes])
    given = np.broadcast_to(values, (len(kept), len(values)))
    table = np.concatenate([piece.middle[:, None], piece.inputs, middle, given, kept, power], axis=1).tolist()
    first = 1 + piece.inputs.shape[1]
    states = first + model.n + len(values)
    n, now = model.n, _start(model, start)
    result, seen = np.empty((len(kept) + 1, len(now))), np.empty((len(kept) + 1, n))
    result[0] = now
    state = {index: model.network.states[index].start for index in (*switches, *actuated)}
    for k, (signals, h) in enumerate(zip(table, piece.steps.tolist(), strict=True)):
        near = np.abs(now[:n] - guide[k]) < ASTRAY_K  # not where nothing was measured
        seen[k] = np.where(near, guide[k], now[:n])
        signals[first : first + n] = seen[k].tolist()
        for index, value in state.items():
            signals[states + index] = value
        for index, value in zip(switches, switching(signals), strict=True):
            state[index] = signals[states + index] = value
        # Seen in means over minutes a switch may be half way; it is where it is more likely to be.
        opening = state | {index: float(state[index] > 0.5) for index in switches}
        if actuated:
            found = actuation(signals)
            for index, rate, slope in zip(actuated, found, found[len(actuated) :], strict=False):
                opening[index] += rate * _gain(slope, 0.5 * h)
                state[index] += rate * _gain(slope, h)
        kept[k, list(opening)] = list(opening.values())
        now = _between(solutions, corners, [opening[index] for index in acting], k, now)
        result[k + 1] = now
    seen[-1] = now[:n]
    kept[:, model.coupled] = 0.5 * (result[1:, n:] + result[:-1, n:])
    return result[:, :n], seen, kept


def _between(
    solutions: Sequence[tuple[Array, Array]], corners: Sequence[tuple[float, ...]], positions: Sequence[float], k: int,
    now: Array,
) -> Array:  # fmt: skip
    """One step between the solutions at the ends of what acts."""
    result = np.zeros_like(now)
    for corner, (decay, driven) in zip(corners, solutions, strict=True):
        weight = math.prod(z if end else 1.0 - z for z, end in zip(positions, corner, strict=True))
        if weight:
            result += weight * (decay[k] @ now + driven[k])
    return result


def _gain(slope: float, h: float) -> float:
    """Change after a time ``h`` per rate at its begin, of a state whose rate has this slope, [s]."""
    return h if abs(slope * h) < SMALL else math.expm1(slope * h) / slope


def _start(model: NetworkOnGrid, start: Array) -> Array:
    """Start temperatures, and the start of the states that are solved with them."""
    return np.concatenate([start, [model.network.states[index].start for index in model.coupled]])


@dataclass(frozen=True, kw_only=True, eq=False)
class _Solved:
    """The heat balance linearised about temperatures at the middles, and its exact solution over every interval."""

    balance: Balance
    jacobian: Array
    loss_slope: Array
    total: Array
    capacities: Array
    decay: Array
    gain: Array
    driven: Array


def _linearised(
    model: NetworkOnGrid, piece: Piece, values: Array, T: Array, tangent: LossTangent, memory: Array
) -> _Solved:
    power = tangent.at(T[:, model.loss_nodes])
    balance = model.balance(piece, T, values, power, memory)
    total = balance.sources[:, model.is_loss].sum(axis=-1)
    moved, changed = _moved(model, T, tangent)
    there = model.balance(piece, moved, values, changed, memory)
    jacobian = np.ascontiguousarray(np.moveaxis((there.heat - balance.heat) / TEMPERATURE_STEP_K, 0, -1))
    loss_slope = ((there.sources[..., model.is_loss].sum(axis=-1) - total) / TEMPERATURE_STEP_K).T
    capacities = model.capacities(values)
    matrix = jacobian / capacities[:, None]
    constant = balance.heat / capacities - np.einsum("kij,kj->ki", matrix, T)
    if model.coupled:
        matrix, constant = _with_states(model, piece, values, T, tangent, memory, balance, matrix, capacities)
    decay, gain = exponential(matrix, piece.steps)
    return _Solved(
        balance=balance, jacobian=jacobian, loss_slope=loss_slope, total=total, capacities=capacities, decay=decay,
        gain=gain, driven=np.einsum("kij,kj->ki", gain, constant),
    )  # fmt: skip


def _moved(model: NetworkOnGrid, T: Array, tangent: LossTangent) -> tuple[Array, Array]:
    """Temperatures of which one part's is a little higher, and the losses there, for every part: (parts, K, ...)."""
    moved = T + TEMPERATURE_STEP_K * np.eye(model.n)[:, None, :]
    return moved, tangent.at(moved[..., model.loss_nodes])


def _with_states(
    model: NetworkOnGrid, piece: Piece, values: Array, T: Array, tangent: LossTangent, memory: Array, balance: Balance,
    matrix: Array, capacities: Array,
) -> tuple[Array, Array]:  # fmt: skip
    """Matrix and constant of temperatures and the states that are solved with them."""
    n, power = model.n, tangent.at(T[:, model.loss_nodes])
    rates = model.rates(piece, T, values, power, memory)
    size = n + len(model.coupled)
    whole = np.zeros((len(T), size, size))
    whole[:, :n, :n] = matrix
    moved, changed = _moved(model, T, tangent)
    there = model.rates(piece, moved, values, changed, memory)
    whole[:, n:, :n] = np.moveaxis((there - rates) / TEMPERATURE_STEP_K, 0, -1)
    for index, state in enumerate(model.coupled):
        changed = memory.copy()
        changed[:, state] += STATE_STEP
        heat = model.balance(piece, T, values, power, changed).heat
        whole[:, :n, n + index] = (heat - balance.heat) / capacities / STATE_STEP
        whole[:, n:, n + index] = (model.rates(piece, T, values, power, changed) - rates) / STATE_STEP
    here = np.concatenate([T, memory[:, model.coupled]], axis=1)
    slope = np.concatenate([balance.heat / capacities, rates], axis=1)
    return whole, slope - np.einsum("kij,kj->ki", whole, here)


def _round(
    model: NetworkOnGrid, piece: Piece, values: Array, start: Array, T_ref: Array, tangent: LossTangent | None,
    states: Array | None, *, follow: bool = True,
) -> Trajectory:  # fmt: skip
    """Linearise about a trajectory and solve; with the states as given, or those that follow its temperatures."""
    T = 0.5 * (T_ref[1:] + T_ref[:-1])
    tangent = model.loss_tangent(piece, T, tangent)
    power = tangent.at(T[:, model.loss_nodes])
    guide, seen = piece.guide(model.parts), piece.seen(T_ref, model.parts)
    if not follow and states is not None:
        memory = states.copy()
    else:
        memory = model.memory(piece, T_ref, seen, values, power, states)
    solved, result = _walked(model, piece, values, start, T, tangent, memory)
    read = model.switched_by
    if read and follow and np.nanmax(np.abs(result[:, : model.n] - guide)[:, read], initial=0.0) > ASTRAY_K:
        seen = _stepped(model, piece, values, start, T, tangent, memory, guide)[1]
        memory = model.memory(piece, T_ref, seen, values, power, states)
        solved, result = _walked(model, piece, values, start, T, tangent, memory)
    n = model.n
    memory[:, model.coupled] = 0.5 * (result[1:, n:] + result[:-1, n:])
    result = result[:, :n]
    loss = solved.total + np.einsum("kn,kn->k", solved.loss_slope, 0.5 * (result[1:] + result[:-1]) - T)
    return Trajectory(
        piece=piece, T=result, values=values, tangent=tangent, seen=seen, memory=memory, balance=solved.balance,
        jacobian=solved.jacobian, loss=loss, loss_slope=solved.loss_slope, decay=solved.decay, gain=solved.gain,
        capacities=solved.capacities,
    )  # fmt: skip


def _walked(
    model: NetworkOnGrid, piece: Piece, values: Array, start: Array, T: Array, tangent: LossTangent, memory: Array
) -> tuple[_Solved, Array]:
    """The solution about temperatures at the middles; temperatures and states at the grid points."""
    solved = _linearised(model, piece, values, T, tangent, memory)
    now = _start(model, start)
    result = np.empty((len(T) + 1, len(now)))
    result[0] = now
    for k in range(len(T)):
        now = solved.decay[k] @ now + solved.driven[k]
        result[k + 1] = now
    return solved, result


def exponential(matrix: Array, steps: Array) -> tuple[Array, Array]:
    r"""Exact solution of ``x' = A x + b`` over an interval.

    Parameters
    ----------
    matrix : Array, shape (K, n, n)
        A, [1/s]
    steps : Array, shape (K,)
        h, [s]

    Returns
    -------
    decay, gain : Array, shape (K, n, n)
        :math:`e^{hA}` and :math:`\int_0^h e^{sA} ds` [s]: ``x(h) = decay x + gain b``

    References
    ----------
    Taylor series of phi_1 with doubling, phi_1(2z) = (e^z + 1) phi_1(z) / 2; Hochbruck, Ostermann, Exponential
    integrators, Acta Numerica 19 (2010).
    """
    z = matrix * steps[:, None, None]
    largest = float(np.max(np.abs(z).sum(axis=-1), initial=0.0))
    if not np.isfinite(largest):
        raise ArithmeticError("the heat balance is no number with these parameters")
    doublings = max(0, int(np.ceil(np.log2(max(largest, 1e-12) / 0.5))))
    z = z / 2.0**doublings
    identity = np.eye(matrix.shape[-1])
    phi = np.broadcast_to(identity, z.shape).copy()
    for order in range(9, 1, -1):  # Horner: phi_1 = 1 + z/2 (1 + z/3 (1 + ...))
        phi = identity + (z / order) @ phi
    decay = identity + z @ phi
    for _ in range(doublings):
        phi = 0.5 * (decay @ phi + phi)
        decay = decay @ decay
    return decay, phi * steps[:, None, None]


def settled_balance(model: NetworkOnGrid, trajectory: Trajectory) -> Balance:
    """The heat balance along a settled trajectory; its own is that of the one before, about which it was solved."""
    T = trajectory.middle
    power = trajectory.tangent.at(T[:, model.loss_nodes])
    return model.balance(trajectory.piece, T, trajectory.values, power, trajectory.memory)


def parameter_heats(
    model: NetworkOnGrid, trajectory: Trajectory, here: Balance, indices: Sequence[int], steps: Array
) -> tuple[Array, Array]:
    """Net heat and total loss per unit of some parameters, along a trajectory.

    Parameters
    ----------
    model : NetworkOnGrid
    trajectory : Trajectory
    here : Balance
        Its :func:`settled_balance`
    indices : sequence of int
        Which parameters
    steps : Array, shape (V,)
        Of every parameter, in its unit

    Returns
    -------
    heat : Array, shape (K, parts + coupled, V)
        Including the change of stored heat that another capacity makes, per unit of the parameter, [W/unit]; then the
        rates of the states that are solved with the temperatures
    loss : Array, shape (K, V)
    """
    count = max(1, MOST_AT_ONCE // len(trajectory.memory))
    found = [_parameter_heats(model, trajectory, here, indices[i : i + count], steps[i : i + count])
             for i in range(0, len(indices), count)]  # fmt: skip
    heats, losses = zip(*found, strict=True)
    return np.concatenate(heats, axis=-1), np.concatenate(losses, axis=-1)


def _parameter_heats(
    model: NetworkOnGrid, trajectory: Trajectory, here: Balance, indices: Sequence[int], steps: Array
) -> tuple[Array, Array]:
    T, piece, memory = trajectory.middle, trajectory.piece, trajectory.memory
    values = np.tile(trajectory.values, (len(indices), 1))
    values[range(len(indices)), indices] += steps
    power = trajectory.tangent.at(T[:, model.loss_nodes])
    remembered = [i for i, index in enumerate(indices) if model.network.parameters[index].name in model.remembered]
    memories = memory
    if remembered:
        memories = np.tile(memory, (len(indices), 1, 1))
        memories[remembered] = model.memory(piece, trajectory.T, trajectory.seen, values[remembered], power, memory)
    there = model.balance(piece, T, values, power, memories)
    stored = (trajectory.capacities / model.capacities(values))[:, None, :]
    heat = (there.heat * stored - here.heat) / steps[:, None, None]
    if model.coupled:
        before = model.rates(piece, T, trajectory.values, power, memory)
        driven = (model.rates(piece, T, values, power, memories) - before) / steps[:, None, None]
        heat = np.concatenate([heat, driven], axis=-1)
    loss = (there.sources - here.sources)[..., model.is_loss].sum(axis=-1) / steps[:, None]
    return np.moveaxis(heat, 0, -1), loss.T


def named_values(network: ThermalNetwork, given: Mapping[str, float] | None = None) -> Array:
    """Values of all parameters of a network: as delivered, or as given by name."""
    given = given or {}
    return np.array([given.get(p.name, p.start) for p in network.parameters])
