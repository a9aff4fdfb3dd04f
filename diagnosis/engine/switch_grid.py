"""Numbers of a switch (set-point, band), looked for by scans of a grid with switches that follow the readings.

The objective has many minima along them: a control that hardly misses a peak never switches, and a fit ends in the
nearest minimum. In a scan every shape switches where the readings say, whatever else is unknown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.engine.fit import Fit, Linearised
from diagnosis.engine.scan import scan
from models.base.types import Array
from models.network.laws import Parameter
from models.terms.term import Term

POINTS, LEVELS = 9, 3  # of a grid in one direction; how often it is made finer, to a step of the one before
STEPS = (POINTS - 1) // 2


def switch_numbers(term: Term) -> list[int]:
    """Places of the uncertain parameters that decide when a term switches."""
    laws = [state.update for state in term.states if state.update is not None]
    read = {symbol.name for law in laws for symbol in law.free_symbols}
    return [i for i, p in enumerate(term.parameters[1:], start=1) if p.name in read and p.sd > 0.0]


def refined(fit: Fit, candidate: Hypothesis, shapes: Sequence[int]) -> tuple[Hypothesis, float]:
    """A candidate that switches, in one shape: where finer scans about some of its shapes put its numbers.

    Parameters
    ----------
    fit : Fit
        Without the candidate
    shapes : sequence of int
        Variants to begin from

    Returns
    -------
    candidate : Hypothesis
        With one variant
    strength : float
        That the scan promises
    """
    rows = [candidate.variants[shape] for shape in dict.fromkeys(shapes)]
    return _scanned(fit, candidate, rows, level=0)


def with_refined_switches(fit: Fit, effect: Hypothesis, first: int) -> Fit:
    """A fit continued from the numbers that a finer scan about its own gives a switch, if they fit better.

    Parameters
    ----------
    effect : Hypothesis
        In the fit
    first : int
        Place of its strength among the unknowns
    """
    assert effect.term is not None  # noqa: S101 - it is in the fit
    if not switch_numbers(effect.term):
        return fit
    experiment, own = fit.experiment, slice(first, first + len(effect.term.parameters))
    row = np.array([u.value(z) for u, z in zip(experiment.unknowns[own], fit.z[own].tolist(), strict=True)])
    without = _without(fit, own)
    found, strength = _scanned(without, effect, [np.array([1.0, *row[1:]])], level=1)
    z = fit.z.copy()
    z[own] = [
        u.z_of(value) for u, value in zip(experiment.unknowns[own], (strength, *found.variants[0, 1:]), strict=True)
    ]
    try:
        further = experiment.fit(z, fit.trajectories)
    except ArithmeticError:
        return fit
    return further if further.objective < fit.objective else fit


def _scanned(fit: Fit, candidate: Hypothesis, rows: Sequence[Array], level: int) -> tuple[Hypothesis, float]:
    assert candidate.term is not None  # noqa: S101 - it switches
    at, parameters = switch_numbers(candidate.term), candidate.term.parameters
    best, strength = rows, 0.0
    for finer in range(level, LEVELS):
        grids = [[_about(parameters[i], row[i], finer) for i in at] for row in best]
        variants = [_with(row, at, values) for row, grid in zip(best, grids, strict=True) for values in product(*grid)]
        tried = replace(candidate, variants=np.array(variants))
        found = scan(fit, [tried])
        strength = float(found.singles(found.gram.given([*found.unknowns, *found.further])).value[0])
        best = [tried.variants[found.best[0]]]
    return replace(candidate, variants=np.array(best)), strength


def _about(p: Parameter, value: float, level: int) -> list[float]:
    """Values about one, up to its neighbours in the parameter's grid, or up to one step of the level before."""
    axis = [np.log(v) if p.log else v for v in p.grid]
    reach = max(np.diff(np.sort(axis)), default=p.sd) / STEPS**level
    steps = reach * np.linspace(-1.0, 1.0, POINTS)
    values = value * np.exp(steps) if p.log else value + steps
    return sorted({float(v) for v in np.clip(values, p.lower, p.upper)})


def _with(row: Array, at: Sequence[int], values: Sequence[float]) -> Array:
    changed = row.copy()
    changed[list(at)] = values
    return changed


def _without(fit: Fit, own: slice) -> Fit:
    """A fit without the unknowns of one effect, and by a straight line without what it does."""
    experiment, kept = fit.experiment, np.ones(len(fit.z), dtype=bool)
    kept[own] = False
    parts = [replace(part, residual=part.residual + fit.z[own.start] * part.columns[:, own.start],
                     columns=part.columns[:, kept]) for part in fit.parts]  # fmt: skip
    unknowns = tuple(unknown for unknown, keep in zip(experiment.unknowns, kept, strict=True) if keep)
    return Fit(experiment=replace(experiment, unknowns=unknowns), z=fit.z[kept],
               linearised=Linearised.of(parts, experiment.metric))  # fmt: skip
