"""Exact derivatives of the heat balance by anything that its laws name: parameters, inputs, states, losses.

The laws are symbolic expressions, so are their derivatives.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import sympy as sp

from diagnosis.forward.network_on_grid import Balance, NetworkOnGrid
from diagnosis.forward.trajectory import Heat, Trajectory, losses_along
from models.formulas.extremes import Max, Min
from models.network.laws import compile_function, function_source, symbol


class LawSlopes:
    """The derivatives of all laws of a network.

    Parameters
    ----------
    model : NetworkOnGrid
        Of a network whose laws all are expressions
    names : sequence of str
        Parameters, inputs, states and losses (``P_<component>``) to differentiate by
    """

    def __init__(self, model: NetworkOnGrid, names: Sequence[str]) -> None:
        self.model, network = model, model.network
        known = model.boundary
        laws = [
            *(("link", i, link.conductance.xreplace(known)) for i, link in enumerate(network.links)),
            *(("source", i, source.heat.xreplace(known)) for i, source in enumerate(network.sources)),
            *(("boundary", i, known[symbol(f"T_{name}")]) for i, name in enumerate(model.laws.boundaries)),
            *(("capacity", i, part.capacity) for i, part in enumerate(network.parts)),
            *(("rate", i, network.states[s].rate.xreplace(known)) for i, s in enumerate(model.coupled)),
        ]
        self._laws: list[tuple[str, int, list[str], Callable[..., tuple[Any, ...]], list[int]]] = []
        for kind, index, law in laws:
            free = {s.name for s in law.free_symbols}
            if by := [name for name in names if name in free]:
                used = [i for i, name in enumerate(model.arguments) if name in free]
                function = _slopes(law, tuple(model.arguments[i] for i in used), tuple(by))
                self._laws.append((kind, index, by, function, used))
        self._names = tuple(names)

    def along(self, trajectory: Trajectory, here: Balance) -> dict[str, Heat]:
        """Net heat per unit of every name along a trajectory.

        Parameters
        ----------
        here : Balance
            Its heat balance, see :func:`diagnosis.forward.trajectory.settled_balance`
        """
        model, T = self.model, trajectory.middle
        power = losses_along(model, trajectory)
        signals = model.signals(trajectory.piece, T, trajectory.values, trajectory.memory)
        signals, stored = [*signals, *power.T], np.diff(trajectory.T, axis=0) / trajectory.piece.steps[:, None]
        n, nodes = model.n, [model.parts.index(source.node) for source in model.network.sources]
        into = {name: np.zeros((len(T), n + len(model.coupled))) for name in self._names}
        loss = {name: np.zeros(len(T)) for name in self._names}
        for kind, index, names, function, used in self._laws:
            with np.errstate(all="ignore"):
                slopes = function(*(signals[i] for i in used))
            for name, found in zip(names, slopes, strict=True):
                slope, heat = np.asarray(found, dtype=float), into[name]
                if not np.isfinite(slope.sum()):
                    slope = np.nan_to_num(slope)  # x^p ln(x) at x = 0 has no value but the limit 0
                if kind == "link":
                    heat[:, :n] += (slope * here.differences[:, index])[:, None] * model.to_parts[index]
                elif kind == "source":
                    heat[:, nodes[index]] += slope
                    loss[name] += slope if model.is_loss[index] else 0.0
                elif kind == "boundary":
                    for link in np.flatnonzero(model.incidence[:, n + index]):
                        flow = slope * model.incidence[link, n + index] * here.conductances[:, link]
                        heat[:, :n] += flow[:, None] * model.to_parts[link]
                elif kind == "capacity":
                    # What a part stores over an interval is its mean net heat, jumps of operation included.
                    heat[:, index] -= slope * stored[:, index]
                else:
                    heat[:, n + index] += slope
        return {name: Heat(into=into[name], loss=loss[name]) for name in self._names}


@lru_cache(maxsize=4096)
def _slopes(law: sp.Expr, arguments: tuple[str, ...], names: tuple[str, ...]) -> Callable[..., tuple[Any, ...]]:
    """Derivatives of one law as a function; kept, since most laws stay as they are when a term is added."""
    # What repeats is a straight line between its jumps.
    whole = {one: sp.Dummy() for one in law.atoms(sp.Mod)}
    law = law.xreplace({one: one.args[0] - one.args[1] * count for one, count in whole.items()})
    counts = {count: sp.floor(one.args[0] / one.args[1]) for one, count in whole.items()}
    # Minima and maxima are computed first: derivatives through them are long, and take sympy long.
    extremes: dict[sp.Expr, sp.Symbol] = {}
    law = _apart(law, extremes)
    slopes_of: dict[sp.Symbol, list[sp.Expr]] = {}
    for extreme, own in extremes.items():
        slopes_of[own] = _extreme_slopes(extreme, names, slopes_of)
    slopes = [slope.xreplace(counts) for slope in _chained(law, names, slopes_of)]
    known, steps = list(arguments), []
    for extreme, own in extremes.items():
        steps.append(_function(known, [extreme.xreplace(counts)]))
        known.append(own.name)
    last = _function(known, slopes)

    def evaluated(*signals: Any) -> tuple[Any, ...]:
        for step in steps:
            signals = (*signals, *step(*signals))
        return last(*signals)

    return evaluated


def _function(arguments: Sequence[str], laws: Sequence[sp.Expr]) -> Callable[..., tuple[Any, ...]]:
    return compile_function(function_source("slopes", arguments, laws, vector=True), "slopes")


def _apart(law: sp.Expr, extremes: dict[sp.Expr, sp.Symbol]) -> sp.Expr:
    """The law with a symbol for every minimum and maximum; these are added to `extremes`, inner ones first."""
    if not law.has(Min, Max):
        return law
    args = [_apart(arg, extremes) for arg in law.args]
    if not isinstance(law, Min | Max):
        return law.func(*args)
    return extremes.setdefault(law.func(*args), symbol(f"_extreme_{len(extremes)}"))


def _extreme_slopes(
    extreme: sp.Expr, names: Sequence[str], slopes_of: Mapping[sp.Symbol, Sequence[sp.Expr]]
) -> list[sp.Expr]:  # fmt: skip
    """Derivatives of a minimum or maximum: those of the argument that it is; half of each where two are equal."""
    sign, result = (1 if isinstance(extreme, Max) else -1), [sp.Integer(0)] * len(names)
    for index, arg in enumerate(extreme.args):
        others = extreme.args[:index] + extreme.args[index + 1 :]
        other = others[0] if len(others) == 1 else extreme.func(*others)
        here = sp.Heaviside(sign * (arg - other), evaluate=False)
        result = [one + here * slope for one, slope in zip(result, _chained(arg, names, slopes_of), strict=True)]
    return result


def _chained(
    law: sp.Expr, names: Sequence[str], slopes_of: Mapping[sp.Symbol, Sequence[sp.Expr]]
) -> list[sp.Expr]:  # fmt: skip
    """Derivatives of a law of signals and of extremes whose derivatives are known."""
    result = [sp.diff(law, symbol(name)) for name in names]
    for own in sorted(law.free_symbols & set(slopes_of), key=lambda one: str(one.name)):
        outer = sp.diff(law, own)
        result = [one + outer * slope for one, slope in zip(result, slopes_of[own], strict=True)]
    return result
