"""Temperatures along a recording and their derivatives: the network simulated for all intervals at once.

The network is linearised about a whole trajectory instead of integrated step by step: on every interval the heat
balance is affine in the temperatures and solved exactly (matrix exponential), the solution is the next trajectory to
linearise about, and three or four rounds settle it: a Newton iteration on waveforms. Every round is a handful of array
operations over all intervals, and what it linearised serves the derivatives as well: an extra heat anywhere, at
any time, of any parameter, answers through the same matrices.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.special import exprel

from diagnosis.forward.grid import Piece
from diagnosis.forward.kept import kept
from diagnosis.forward.matrix_exponential import exponential
from diagnosis.forward.network_on_grid import HIGHEST_T, LOWEST_T, Balance, LossTangent, NetworkOnGrid
from models.base.types import Array

ROUNDS = 6
SETTLED_K = 0.02
TEMPERATURE_STEP_K = 0.05
STATE_STEP = 0.05  # of a state that is solved with the temperatures, mostly a temperature itself
RUNAWAY_T = 1500.0  # degC; beyond it there is no trajectory
# A switching that no row shows, be they means over minutes or noisy near a set-point, sends a guided trajectory astray.
# Further off than this, switches follow the simulated temperature until it is back.
ASTRAY_K = 4.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Trajectory:
    """A settled trajectory of one piece and what its linearisation knows.

    Attributes
    ----------
    T : Array, shape (K + 1, parts)
        Temperatures at the grid points, [degC]
    values : Array, shape (parameters,)
        Values of the network's parameters
    seen : Array, shape (K + 1, parts)
        Temperatures that the memories followed, [degC]
    memory : Array, shape (K, states)
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
        initial : Array, shape (parts, columns) or (parts + coupled, columns), optional
            Change of the start temperatures, [K]

        Returns
        -------
        Array, shape (K + 1, parts, columns)
            [K]
        """
        n, size = len(self.capacities), self.decay.shape[-1]
        gain = self.gain[:, :, : heat.shape[1]].copy()
        gain[:, :, :n] /= self.capacities
        result = np.zeros((len(heat) + 1, size, heat.shape[2]))
        np.matmul(gain, heat, out=result[1:])
        if initial is not None:
            result[0, : len(initial)] = initial
        now = result[0]
        for decay, after in zip(self.decay, result[1:], strict=True):
            after += decay @ now
            now = after
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
    """The trajectory of a piece, by rounds of linear solutions about the one before.

    Parameters
    ----------
    values : Array, shape (parameters,)
        Values of the network's parameters
    start : Array, shape (parts,) or (parts + coupled,)
        Start temperatures, [degC], and where they are known those of the states that are solved with them
    guess : Trajectory, or Array of shape (K + 1, parts), optional
        Where to linearise first; by default the start temperatures
    rounds : int
        At most
    settled_K : float
        Largest change of a round at which it ends, [K]

    Raises
    ------
    ArithmeticError
        If the temperatures leave all bounds; with model error, those where laws are linearised.
    """
    tangent = guess.tangent if isinstance(guess, Trajectory) else None
    if isinstance(guess, Trajectory):
        T = guess.T
    elif guess is not None:
        T = guess
    else:
        T = np.broadcast_to(start[: model.n], (len(piece.time), model.n))
    found, states = None, guess.memory if isinstance(guess, Trajectory) else None
    for _ in range(rounds):
        with np.errstate(over="ignore", invalid="ignore"):
            found = linear_round(model, piece, values, start, np.clip(T, LOWEST_T, HIGHEST_T), tangent, states)
        if not np.isfinite(found.T).all():
            raise ArithmeticError(f"the temperatures of {piece.recording} run away with these parameters")
        change = float(np.max(np.abs(found.T - T)))
        T, tangent, states = found.T, found.tangent, found.memory
        if change < settled_K:
            break
    assert found is not None  # noqa: S101 - rounds >= 1
    # A conductance tilted below zero lets a standing gearbox heat itself for ever: no temperatures at all. And
    # model error explains what is near the readings, not a course that it has to carry to where no law is linearised.
    lowest, highest = (-RUNAWAY_T, RUNAWAY_T) if piece.error is None else (LOWEST_T, HIGHEST_T)
    if not (lowest <= float(found.T.min()) and float(found.T.max()) <= highest):
        raise ArithmeticError(f"the temperatures of {piece.recording} run away with these parameters")
    return found


@dataclass(frozen=True, kw_only=True, eq=False)
class Stepped:
    """Settled temperatures and memories of some intervals, all that is stepped at their end, and switches there."""

    T: Array
    seen: Array
    memory: Array
    end: Array
    held: dict[int, float]


def stepped(
    model: NetworkOnGrid, piece: Piece, values: Array, start: Array, middle: Array, tangent: LossTangent,
    memory: Array, guide: Array, held: dict[int, float] | None = None,
) -> Stepped:  # fmt: skip
    """Temperatures at the grid points where switches follow them as they come; the other memories are given.

    Linearised about the temperatures `middle` once for every position of the switches, and of what follows them, as a
    slow valve does: between its ends the step is taken in proportion. Where there is a `guide`, see
    :meth:`diagnosis.forward.grid.Piece.guide`, the switches follow it as long as the temperatures are near it.

    Returns
    -------
    Stepped
        With the temperatures that the switches followed; memories as given, except for the values computed here
    """
    switches, actuated, memories = model.switches, model.actuated, memory.copy()
    moving = [*switches, *actuated]
    felt = [moving.index(index) for index in model.acting]
    solutions = {}
    for corner in product((0.0, 1.0), repeat=len(felt)):
        memories[:, model.acting] = corner
        solved = _linearised(model, piece, values, middle, tangent, memories)
        solutions[corner] = list(solved.decay), list(solved.driven)
    switching, actuation = model.switching(averaged=piece.guided and piece.slow), model.actuation
    power = tangent.at(middle[:, model.loss_nodes])
    given = np.broadcast_to(values, (len(memories), len(values)))
    table = np.concatenate([piece.middle[:, None], piece.inputs, middle, given, memories, power], axis=1).tolist()
    first = 1 + piece.inputs.shape[1]
    states = first + model.n + len(values)
    n, now, seen, openings = model.n, complete_start(model, start), [], []
    result = np.empty((len(memories) + 1, len(now)))
    result[0] = now
    state = {index: model.network.states[index].start for index in moving} | (held or {})
    rows = zip(table, guide[:-1].tolist(), piece.steps.tolist(), strict=True)
    for k, (signals, guides, h) in enumerate(rows):
        # A guide is NaN where nothing was measured.
        T = [there if abs(own - there) < ASTRAY_K else own for own, there in zip(now.tolist(), guides, strict=False)]
        seen.append(T)
        signals[first : first + n] = T
        for index, value in state.items():
            signals[states + index] = value
        for index, value in zip(switches, switching(signals), strict=True):
            state[index] = signals[states + index] = value
        # Seen in means over minutes a switch may be half way; it is where it is more likely to be.
        opening = [float(state[index] > 0.5) for index in switches]
        if actuated:
            found = actuation(signals)
            for index, rate, slope in zip(actuated, found, found[len(actuated) :], strict=False):
                opening.append(state[index] + rate * 0.5 * h * float(exprel(0.5 * h * slope)))
                state[index] += rate * h * float(exprel(h * slope))
        openings.append(opening)
        now = _between(solutions, tuple([opening[place] for place in felt]), k, now)
        result[k + 1] = now
    memories[:, moving] = openings
    memories[:, model.coupled] = 0.5 * (result[1:, n:] + result[:-1, n:])
    return Stepped(T=result[:, :n], seen=np.array([*seen, now[:n]]), memory=memories, end=now, held=state)


def _between(
    solutions: Mapping[tuple[float, ...], tuple[Sequence[Array], Sequence[Array]]], at: tuple[float, ...], k: int,
    now: Array,
) -> Array:  # fmt: skip
    """One step between the solutions at the ends of what acts, by corner."""
    if at in solutions:
        decay, driven = solutions[at]
        return np.asarray(decay[k].dot(now) + driven[k])
    result = np.zeros_like(now)
    for corner, (decay, driven) in solutions.items():
        weight = math.prod([z if end else 1.0 - z for z, end in zip(at, corner, strict=True)])
        result += weight * (decay[k].dot(now) + driven[k])
    return result


def complete_start(model: NetworkOnGrid, start: Array) -> Array:
    """Start temperatures, and the start of the states that are solved with them: as given, else as declared."""
    if len(start) > model.n:
        return start
    return np.concatenate([start, [model.network.states[index].start for index in model.coupled]])


@dataclass(frozen=True, kw_only=True, eq=False)
class _Solved:
    """The heat balance linearised about temperatures at the middles, and its exact solution over every interval."""

    balance: Balance
    loss_slope: Array
    total: Array
    capacities: Array
    decay: Array
    gain: Array
    driven: Array


def _linearised(
    model: NetworkOnGrid, piece: Piece, values: Array, T: Array, tangent: LossTangent, memory: Array
) -> _Solved:
    n, power = model.n, tangent.at(T[:, model.loss_nodes])
    balance, capacities = model.balance(piece, T, values, power, memory), model.capacities(values)
    total = balance.sources[:, model.is_loss].sum(axis=-1)
    # One part's temperature is a little higher, for every part: (parts, K, ...).
    moved, changed = T + TEMPERATURE_STEP_K * np.eye(n)[:, None, :], np.tile(power, (n, 1, 1))
    changed[model.loss_nodes] += TEMPERATURE_STEP_K * np.moveaxis(tangent.slope, -1, 0)
    there = model.balance(piece, moved, values, changed, memory)
    loss_slope = ((there.sources[..., model.is_loss].sum(axis=-1) - total) / TEMPERATURE_STEP_K).T
    size, here, slope = n + len(model.coupled), T, balance.heat / capacities
    matrix = np.empty((len(T), size, size))
    matrix[:, :n, :n] = np.moveaxis((there.heat - balance.heat) / TEMPERATURE_STEP_K, 0, -1) / capacities[:, None]
    if model.coupled:
        rates = model.rates(piece, T, values, power, memory)
        higher = model.rates(piece, moved, values, changed, memory)
        matrix[:, n:, :n] = np.moveaxis((higher - rates) / TEMPERATURE_STEP_K, 0, -1)
        here, slope = np.concatenate([T, memory[:, model.coupled]], axis=1), np.concatenate([slope, rates], axis=1)
        for index, state in enumerate(model.coupled):
            other = memory.copy()
            other[:, state] += STATE_STEP
            heat = model.balance(piece, T, values, power, other).heat
            matrix[:, :n, n + index] = (heat - balance.heat) / capacities / STATE_STEP
            matrix[:, n:, n + index] = (model.rates(piece, T, values, power, other) - rates) / STATE_STEP
    decay, gain = exponential(matrix, piece.steps)
    return _Solved(
        balance=balance, loss_slope=loss_slope, total=total, capacities=capacities, decay=decay, gain=gain,
        driven=np.einsum("kij,kj->ki", gain, slope - np.einsum("kij,kj->ki", matrix, here)),
    )  # fmt: skip


def linear_round(
    model: NetworkOnGrid, piece: Piece, values: Array, start: Array, T_ref: Array, tangent: LossTangent | None,
    states: Array | None, *, given: Array | None = None,
) -> Trajectory:  # fmt: skip
    """Linearise about a trajectory and solve; with states that follow its temperatures, if none are given."""
    T = 0.5 * (T_ref[1:] + T_ref[:-1])
    tangent = model.loss_tangent(piece, T, tangent)
    power = tangent.at(T[:, model.loss_nodes])
    guide = piece.guide(model.parts)
    seen = np.where(np.isfinite(guide), guide, T_ref)
    memory = model.memory(piece, T_ref, seen, values, power, states) if given is None else given.copy()
    solved, result = _walked(model, piece, values, start, T, tangent, memory)
    read = model.switched_by
    if read and given is None and np.nanmax(np.abs(result[:, : model.n] - guide)[:, read], initial=0.0) > ASTRAY_K:
        seen = stepped(model, piece, values, start, T, tangent, memory, guide).seen
        memory = model.memory(piece, T_ref, seen, values, power, states)
        solved, result = _walked(model, piece, values, start, T, tangent, memory)
    n = model.n
    memory[:, model.coupled] = 0.5 * (result[1:, n:] + result[:-1, n:])
    result = result[:, :n]
    loss = solved.total + np.einsum("kn,kn->k", solved.loss_slope, 0.5 * (result[1:] + result[:-1]) - T)
    if piece.error is not None:
        loss = loss + piece.error.loss
    return Trajectory(
        piece=piece, T=result, values=values, tangent=tangent, seen=seen, memory=memory, balance=solved.balance,
        loss=loss, loss_slope=solved.loss_slope, decay=solved.decay, gain=solved.gain, capacities=solved.capacities,
    )  # fmt: skip


def _walked(
    model: NetworkOnGrid, piece: Piece, values: Array, start: Array, T: Array, tangent: LossTangent, memory: Array
) -> tuple[_Solved, Array]:
    """The solution about temperatures at the middles; temperatures and states at the grid points."""
    solved = _linearised(model, piece, values, T, tangent, memory)
    now = complete_start(model, start)
    result = np.concatenate([now[None, :], solved.driven])
    for decay, after in zip(solved.decay, result[1:], strict=True):
        after += decay @ now
        now = after
    return solved, result


@kept
def settled_balance(model: NetworkOnGrid, trajectory: Trajectory) -> Balance:
    """The heat balance along a settled trajectory; its own is that of the one before, about which it was solved."""
    return model.balance(trajectory.piece, trajectory.middle, trajectory.values, losses_along(model, trajectory),
                         trajectory.memory)  # fmt: skip


def losses_along(model: NetworkOnGrid, trajectory: Trajectory) -> Array:
    """Nominal losses along a trajectory, by its tangent, shape (K, components), [W]."""
    return trajectory.tangent.at(trajectory.middle[:, model.loss_nodes])


@dataclass(frozen=True, kw_only=True, eq=False)
class Heat:
    """Further heat in a network on all intervals, per unit of something.

    Attributes
    ----------
    into : Array, shape (K, parts + coupled)
        Net heat into every part [W], including the change of stored heat that another capacity makes; then the rates of
        the states that are solved with the temperatures
    loss : Array, shape (K,)
        What of it is mechanical loss at fixed temperatures, [W]
    """

    into: Array
    loss: Array

    def __add__(self, other: Heat) -> Heat:
        return Heat(into=self.into + other.into, loss=self.loss + other.loss)

    def __mul__(self, factor: Array | float) -> Heat:
        factor = np.asarray(factor, dtype=float)
        return Heat(into=self.into * (factor[:, None] if factor.ndim else factor), loss=self.loss * factor)

    def __truediv__(self, step: float) -> Heat:
        return Heat(into=self.into / step, loss=self.loss / step)


def parameter_heat(model: NetworkOnGrid, trajectory: Trajectory, index: int, step: float) -> Heat:
    """Heat per unit of a parameter along a trajectory, by a difference.

    Parameters
    ----------
    index : int
        Which parameter
    step : float
        In its unit
    """
    values = trajectory.values.copy()
    values[index] += step
    power = losses_along(model, trajectory)
    memory = model.memory(trajectory.piece, trajectory.T, trajectory.seen, values, power, trajectory.memory)
    return heat_change(model, trajectory, trajectory.piece, values, power, memory) / step


def heat_change(
    model: NetworkOnGrid, trajectory: Trajectory, piece: Piece, values: Array, power: Array, memory: Array
) -> Heat:
    """Change of heat along a trajectory when inputs, parameters, nominal losses or memories are others."""
    T, here = trajectory.middle, settled_balance(model, trajectory)
    there = model.balance(piece, T, values, power, memory)
    heat = there.heat * (trajectory.capacities / model.capacities(values)) - here.heat
    if model.coupled:
        before = model.rates(trajectory.piece, T, trajectory.values, losses_along(model, trajectory), trajectory.memory)
        heat = np.concatenate([heat, model.rates(piece, T, values, power, memory) - before], axis=-1)
    return Heat(into=heat, loss=(there.sources - here.sources)[:, model.is_loss].sum(axis=-1))
