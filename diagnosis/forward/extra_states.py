"""Internal states of laws along a recording (hysteresis, lags, counters), on all intervals, for many parameters.

A state whose law is a straight line of itself (a hysteresis that holds, a first-order lag, a counter) is a linear
recurrence over the intervals and needs no loop over them. It may feel states that stand before it. Any other one is
followed interval by interval.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray
from scipy.special import exprel
from sympy.core.relational import Relational

from diagnosis.forward.grid import Piece
from diagnosis.forward.recurrence import recurrence
from models.base.types import Array
from models.network.laws import compile_function, function_source, symbol
from models.simulation.thermal_network import ExtraState

SWITCHED_PARTS = 32  # of an interval, in which it is looked whether something switches
SLOW_SUBSTEPS = 11  # of an interval of minutes, where there is no closed form; odd
MOVED = 1e-3  # of a state, for the slope of its rate


def update_of(state: ExtraState, *, averaged: bool) -> sp.Expr:
    """Value of a state after a step; the state itself if it does not switch."""
    found = state.averaged_update if averaged and state.averaged_update is not None else state.update
    return symbol(state.name) if found is None else found


def within(points: Array, parts: int) -> Array:
    """Values in the middles of so many parts of every interval, shape (K, parts, ...), by straight lines."""
    shares = (np.arange(parts) + 0.5) / parts
    return np.asarray(points[:-1, None] + shares[:, None] * (points[1:] - points[:-1])[:, None])


class Memories:
    """States that are followed along a recording.

    Parameters
    ----------
    arguments : sequence of str
        Names of all other signals, in the order in which :meth:`follow` gets them
    parts : sequence of str
        Nodes whose temperatures are among them, adjacent and in this order
    boundary : mapping
        Expressions of the boundary temperatures
    """

    def __init__(
        self, states: Sequence[ExtraState], arguments: Sequence[str], parts: Sequence[str],
        boundary: Mapping[sp.Symbol, sp.Expr],
    ) -> None:  # fmt: skip
        self._states, self._count = tuple(states), len(parts)
        self._first = list(arguments).index(f"T_{parts[0]}")
        self._switches = [state.update is not None for state in states]
        self._starts = [state.start for state in states]
        names = [*arguments, *(state.name for state in states)]
        rates = [state.rate.xreplace(boundary) for state in states]
        self._laws = {}
        for averaged in (False, True) if states else ():
            updates = [update_of(state, averaged=averaged).xreplace(boundary) for state in states]
            source = function_source("memory", names, [*rates, *updates], vector=True)
            self._laws[averaged] = compile_function(source, "memory")
        self._in_turn = all(_in_turn(state, states[index + 1 :]) for index, state in enumerate(states))

    def follow(
        self, piece: Piece, rows: Sequence[Array | float], seen: Array, given: Mapping[int, Array] | None = None
    ) -> list[Array]:  # fmt: skip
        """The states at the middles of the intervals, each of shape (V, K).

        Parameters
        ----------
        rows : sequence of Array or float
            All other signals; of shape (K,) at the middles of the intervals, or (V, 1) for V values of a parameter
        seen : Array, shape (K + 1, parts)
            Temperatures at the grid points that switches follow, [degC]
        given : mapping of int to Array, shape (K,), optional
            States that are known, by their place
        """
        if not self._states:
            return []
        known = {index: state[None, :] for index, state in (given or {}).items()}
        with np.errstate(over="ignore", invalid="ignore"):
            if not self._in_turn:
                return self._one_by_one(piece, rows, seen, known)
            for index, switches in enumerate(self._switches):
                if index not in known:
                    before = [*rows, *(known.get(i, start) for i, start in enumerate(self._starts))]
                    known[index] = (
                        self._switched(index, piece, before, seen) if switches else self._driven(index, piece, before)
                    )
        return [known[index] for index in range(len(self._states))]

    def _law(self, piece: Piece) -> Callable[..., tuple[Any, ...]]:
        return self._laws[piece.guided and piece.slow]

    def _line(
        self, index: int, piece: Piece, rows: Sequence[Array | float], count: int, at: int
    ) -> tuple[Array, Array]:  # fmt: skip
        """Value at 0 and slope of a law of one state, each of shape (count, V)."""
        rows, own, ends = list(rows), len(rows) - len(self._states) + index, []
        for value in (0.0, 1.0):
            rows[own] = value
            ends.append(np.asarray(self._law(piece)(*rows)[at + index], dtype=float))
        shape = np.broadcast_shapes(*(np.shape(row) for row in rows), (1, count))
        there, further = (np.broadcast_to(end, shape).T for end in ends)
        return there, further - there

    def _switched(self, index: int, piece: Piece, rows: Sequence[Array | float], seen: Array) -> Array:
        """A state that switches by the temperatures `seen`."""
        intervals = np.arange(len(piece.steps))
        if piece.slow:  # what switches during a slow interval did so in its midst
            owner, points = np.concatenate([[0], intervals]), seen
        else:
            owner = np.repeat(intervals, SWITCHED_PARTS)
            points = within(seen, SWITCHED_PARTS).reshape(len(owner), -1)
        driven, slope = self._line(index, piece, self._at(rows, owner, points), len(owner), len(self._states))
        state = recurrence(slope, _started(driven, slope, self._starts[index])).T
        if piece.slow:
            return np.asarray(0.5 * (state[:, 1:] + state[:, :-1]))
        return np.asarray(state.reshape(len(state), -1, SWITCHED_PARTS).mean(axis=-1))

    def _at(self, rows: Sequence[Array | float], owner: NDArray[np.intp], points: Array) -> list[Array | float]:
        """All other signals in so many intervals, with these temperatures."""
        found = [_of_interval(row, owner) for row in rows]
        found[self._first : self._first + self._count] = list(points.T)
        return found

    def _driven(self, index: int, piece: Piece, rows: Sequence[Array | float]) -> Array:
        """A state that a rate drives."""
        rate, slope = self._line(index, piece, rows, len(piece.steps), 0)
        h = piece.steps[:, None]
        decay, gain = np.exp(slope * h), h * exprel(slope * h)
        after = recurrence(decay, _started(rate * gain, decay, self._starts[index]))
        before = np.concatenate([np.full((1, after.shape[1]), self._starts[index]), after[:-1]])
        return np.asarray((np.exp(0.5 * slope * h) * before + 0.5 * h * exprel(0.5 * slope * h) * rate).T)

    def _one_by_one(
        self, piece: Piece, rows: Sequence[Array | float], seen: Array, known: Mapping[int, Array]
    ) -> list[Array]:  # fmt: skip
        """States that need each other, or that are no straight lines of themselves."""
        size, law = len(self._states), self._law(piece)
        substeps = SLOW_SUBSTEPS if piece.slow else 1
        parts = 1 if piece.slow else SWITCHED_PARTS
        points = seen[1:, None] if piece.slow else within(seen, parts)
        count = max(np.shape(row)[0] if np.ndim(row) == 2 else 1 for row in rows)
        result = [np.empty((count, len(piece.steps))) for _ in self._states]

        def held(k: int, now: Sequence[Array]) -> list[Array]:
            return [known[i][:, k, None] if i in known else z for i, z in enumerate(now)]

        def law_at(k: int, now: Sequence[Array]) -> Sequence[Array]:
            return law(*(_of_interval(row, np.array([k])) for row in rows), *held(k, now))[:size]

        def rates(k: int, now: list[Array]) -> list[tuple[Array, Array]]:
            """Of every state its rate, and the slope of that with itself: a lag may be far shorter than a step."""
            rate = law_at(k, now)
            moved = [law_at(k, [*now[:i], now[i] + MOVED, *now[i + 1 :]])[i] for i in range(size)]
            return [(r, (m - r) / MOVED) for r, m in zip(rate, moved, strict=True)]

        def switched(k: int, point: Array, now: Sequence[Array]) -> list[Array]:
            got = law(*self._at(rows, np.array([k]), point[None, :]), *held(k, now))[size:]
            return [np.broadcast_to(new, (count, 1)) if it else z
                    for new, z, it in zip(got, now, self._switches, strict=True)]  # fmt: skip

        now: list[Array] = [np.full((count, 1), start) for start in self._starts]
        if piece.slow:
            now = switched(0, seen[0], now)
        for k, h in enumerate(piece.steps / substeps):
            before, positions = now, [now] if piece.slow else []
            for point in points[k]:
                positions.append(switched(k, point, positions[-1] if positions else before))
            means = [np.mean(np.broadcast_arrays(*each), axis=0) for each in zip(*positions, strict=True)]
            after = positions[-1]
            # What a rate drives feels the mean position of a switch.
            now = half = [mean if it else z for mean, z, it in zip(means, before, self._switches, strict=True)]
            for part in range(substeps):
                driven = rates(k, now)
                half = _advanced(now, driven, 0.5 * h) if part == substeps // 2 else half
                now = _advanced(now, driven, h)
            for index, state in enumerate(half):
                result[index][:, k] = np.broadcast_to(state, (count, 1))[:, 0]
            now = [last if it else z for last, z, it in zip(after, now, self._switches, strict=True)]
        return [known.get(index, state) for index, state in enumerate(result)]


def _advanced(states: Sequence[Array], driven: Sequence[tuple[Array, Array]], h: float) -> list[Array]:
    """States after a time, by their rates and the slopes of these."""
    return [z + h * exprel(h * slope) * rate for z, (rate, slope) in zip(states, driven, strict=True)]


def _of_interval(row: Array | float, owner: NDArray[np.intp]) -> Array | float:
    """A signal in some intervals; of many values of a parameter as it is."""
    if isinstance(row, float) or row.ndim == 0 or row.shape[-1] == 1:
        return row
    return np.asarray(row[..., owner])


def _in_turn(state: ExtraState, later: Sequence[ExtraState]) -> bool:
    """True if a state switches or is driven, does not depend on a later state, and is linear in itself."""
    laws = [law for law in (state.rate, state.update, state.averaged_update) if law is not None]
    others = {symbol(other.name) for other in later}
    if any(law.free_symbols & others for law in laws) or (state.update is not None and not state.rate.is_zero):
        return False
    return all(_straight(law, symbol(state.name)) for law in laws)


@lru_cache(maxsize=512)
def _straight(law: sp.Expr, own: sp.Symbol) -> bool:
    decides = any(own in condition.free_symbols for condition in law.atoms(Relational))
    return not decides and own not in sp.diff(law, own).free_symbols


def _started(driven: Array, slope: Array, start: float) -> Array:
    result = np.array(driven)
    result[0] += slope[0] * start
    return result
