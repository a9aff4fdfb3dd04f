"""Trajectories of networks with switches over long recordings, that nothing measured guides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.forward.grid import Piece
from diagnosis.forward.network_on_grid import HIGHEST_T, LOWEST_T, LossTangent, NetworkOnGrid
from diagnosis.forward.trajectory import Stepped, Trajectory, complete_start, linear_round, stepped
from models.base.types import Array

# Where switches run free: a switching that comes a step later moves a temperature by more, so rounds end early.
FREE_ROUNDS, FREE_SETTLED_K = 3, 0.05
# From a cold start, losses linearised there are no good at operating temperature: it takes further rounds until their
# tangents have arrived.
MOST_FREE_ROUNDS, LOSS_ARRIVED = 20, 0.01
WINDOW = 180  # fine intervals of a slow recording that are settled before the next: some hours


def free_running(
    model: NetworkOnGrid, piece: Piece, values: Array, start: Array, *, guess: Array | None = None
) -> Trajectory:  # fmt: skip
    """The trajectory of a long piece of a network with switches, that nothing measured guides.

    Whether a switch acts depends on when it acted before, so the rounds of :func:`simulate` settle from the front, one
    switching after the other. Here every round is linearised for each position of the switches, and what is stepped
    through is which of them holds; in finer intervals, since a switch acts in the midst of a row. At the grid points
    stand means over as long as the rows lie apart, as rows of slow recordings are.

    Parameters
    ----------
    values : Array, shape (parameters,)
    start : Array, shape (parts,) or (parts + coupled,)
        As for :func:`simulate`
    guess : Array, shape (K + 1, parts), optional
        Where to linearise first; by default the start temperatures

    Raises
    ------
    ArithmeticError
        If the temperatures leave all bounds.
    """
    fine, at = piece.finer()
    count = len(fine.steps)
    # Whatever came before it is settled, so that a window needs few rounds, however often a switch acts.
    alone = {*model.switches, *model.actuated, *model.coupled} >= set(range(len(model.network.states)))
    length = WINDOW if alone and piece.slow else count
    T = np.empty((count + 1, model.n))
    states = np.zeros((count, len(model.network.states)))
    now, held = complete_start(model, start), None
    for first in range(0, count, length):
        last = min(first + length, count)
        near = None
        if guess is not None and length == count:
            near = np.stack([np.interp(fine.time, piece.time, course) for course in guess.T], axis=-1)
        found = _settled_window(model, fine.part(first, last), values, now, near, held)
        T[first : last + 1], states[first:last], now, held = found.T, found.memory, found.end, found.held
    # What rows minutes apart show are means, over as much around every grid point; at the ends over what there is.
    half = piece.samples.shape[1] // 2 if piece.slow else 0
    total = np.concatenate([np.zeros((1, model.n)), np.cumsum(T, axis=0)])
    low, high = np.maximum(at - half, 0), np.minimum(at + half, count) + 1
    means = (total[high] - total[low]) / (high - low)[:, None]
    memory = np.add.reduceat(states, at[:-1]) / np.diff(at)[:, None]
    unguided = replace(piece, guided=False)
    return replace(linear_round(model, unguided, values, start, means, None, None, given=memory), T=means)


def _settled_window(
    model: NetworkOnGrid, fine: Piece, values: Array, start: Array, near: Array | None, held: dict[int, float] | None
) -> Stepped:
    """Rounds of stepping until temperatures and tangents of the losses have settled."""
    T = np.broadcast_to(start[: model.n], (len(fine.steps) + 1, model.n)) if near is None else near
    tangent: LossTangent | None = None
    states: Array | None = None
    shift, found = np.inf, None  # of the mean temperatures in the last round, whatever the switches did meanwhile, K
    for done in range(MOST_FREE_ROUNDS):
        middle = np.clip(0.5 * (T[1:] + T[:-1]), LOWEST_T, HIGHEST_T)
        last, tangent = tangent, model.loss_tangent(fine, middle, tangent)
        still = shift < FREE_SETTLED_K and last is not None and _arrived(model, last, tangent, middle)
        if done >= FREE_ROUNDS and still:
            break
        power = tangent.at(middle[:, model.loss_nodes])
        inside = np.clip(T, LOWEST_T, HIGHEST_T)
        memory = model.memory(fine, inside, inside, values, power, states)
        nothing = np.full_like(T, np.nan)
        found = stepped(model, fine, values, start, middle, tangent, memory, nothing, held)
        before, T, states = T, found.T, found.memory
        if not np.isfinite(T).all():
            raise ArithmeticError(f"the temperatures of {fine.recording} run away with these parameters")
        shift = float(np.max(np.abs((T - before).mean(axis=0))))
        if float(np.max(np.abs(T - before))) < FREE_SETTLED_K:
            break
    assert found is not None  # noqa: S101 - rounds >= 1
    return found


def _arrived(model: NetworkOnGrid, last: LossTangent, tangent: LossTangent, middle: Array) -> bool:
    """True if the losses of the last round's tangents equal those at the temperatures that it gave."""
    mine = middle[:, model.loss_nodes]
    off = np.abs(last.at(mine) - tangent.at(mine))
    return bool((off.mean(axis=0) <= LOSS_ARRIVED * np.abs(tangent.at(mine)).mean(axis=0)).all())
