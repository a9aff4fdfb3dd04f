"""Numbers of a switch (set-point, band), looked for by scans of a grid with switches that follow the readings.

The objective has many minima along them: a control that hardly misses a peak never switches, and a fit ends in the
nearest minimum. In a scan every shape switches where the readings say, whatever else is unknown. So the numbers are
held while all others are fitted, and scanned again, in turns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.engine.fit import Experiment, Fit, Linearised
from diagnosis.engine.scan import scan
from models.base.types import Array
from models.network.laws import Parameter
from models.terms.term import Term

POINTS, LEVELS = 9, 3  # of a grid in one direction; how often it is made finer
LEAST_GAIN = 0.1  # nats by a straight line, from which other numbers are worth a fit


def switch_numbers(term: Term) -> list[int]:
    """Places of the uncertain parameters that decide when a term switches."""
    laws = [state.update for state in term.states if state.update is not None]
    read = {symbol.name for law in laws for symbol in law.free_symbols}
    return [i for i, p in enumerate(term.parameters[1:], start=1) if p.name in read and p.sd > 0.0]


def held_numbers(experiment: Experiment, effects: Sequence[Hypothesis], first: int) -> list[int]:
    """Places of the unknowns that are held while others are fitted: the numbers of the switches of some effects.

    In means over minutes a switch goes over smoothly, and its numbers are fitted as others are.

    Parameters
    ----------
    first : int
        Place of the first unknown of the effects
    """
    found: list[int] = []
    for effect in effects if not experiment.slow else ():
        if effect.term is not None:
            found += [first + i for i in switch_numbers(effect.term)]
            first += len(effect.term.parameters)
    return found


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
    at = switch_numbers(candidate.added)
    reaches = [_to_a_neighbour(candidate.added.parameters[i]) for i in at]
    some = replace(candidate, variants=candidate.variants[list(dict.fromkeys(shapes))])
    found, strength, _ = finer_scans(fit, some, at, reaches)
    return found, strength


def with_refined_switches(fit: Fit, effects: Sequence[Hypothesis], first: int) -> Fit:
    """A fit continued from the numbers that finer scans about its own give every switch, where that fits better.

    Parameters
    ----------
    effects : sequence of Hypothesis
        In the fit
    first : int
        Place of their first unknown
    """
    held = held_numbers(fit.experiment, effects, first)
    for effect in effects:
        if effect.term is not None:
            own = slice(first, first + len(effect.term.parameters))
            fit, first = _with_refined_switch(fit, effect, effect.term, own, held), own.stop
    return fit


def _with_refined_switch(fit: Fit, effect: Hypothesis, term: Term, own: slice, held: Sequence[int]) -> Fit:
    at, experiment, z = switch_numbers(term), fit.experiment, fit.z.copy()
    if not at:
        return fit
    values = np.array([u.value(one) for u, one in zip(experiment.unknowns[own], z[own].tolist(), strict=True)])
    shape = replace(effect, variants=np.array([[1.0, *values[1:]]]))
    reaches = [_to_a_neighbour(term.parameters[i]) * 2.0 / (POINTS - 1) for i in at]
    found, strength, gained = finer_scans(_without(fit, own), shape, at, reaches, levels=LEVELS - 1)
    if gained < LEAST_GAIN:
        return fit
    values = np.array([strength, *found.variants[0, 1:]])
    z[own] = [u.z_of(value) for u, value in zip(experiment.unknowns[own], values.tolist(), strict=True)]
    try:
        further = experiment.fit(z, fit.trajectories, held=held)
    except ArithmeticError:
        return fit
    return further if further.objective < fit.objective else fit


def finer_scans(
    fit: Fit, candidate: Hypothesis, at: Sequence[int], reaches: Sequence[float], *, points: int = POINTS,
    levels: int = LEVELS,
) -> tuple[Hypothesis, float, float]:  # fmt: skip
    """A candidate in the shape that scans of ever finer grids about its shapes prefer.

    Parameters
    ----------
    at : sequence of int
        Places of the parameters that change
    reaches : sequence of float
        How far each goes to either side in the first grid, in its logarithm if it has such a prior; in the next ones,
        one step of the grid before
    points : int
        Of a grid in one direction

    Returns
    -------
    candidate : Hypothesis
        With one variant
    strength, gain : float
        That the scan promises, and nats that it is ahead of the mean over the shapes before
    """
    parameters, before, strength, gain = [candidate.added.parameters[i] for i in at], candidate, 0.0, 0.0
    for level in range(levels):
        steps = np.linspace(-1.0, 1.0, points) * (2.0 / (points - 1)) ** level
        variants = [
            _changed(shape, at, values)
            for shape in candidate.variants
            for values in product(*(
                _about(p, float(shape[i]), reach * steps) for i, p, reach in zip(at, parameters, reaches, strict=True)
            ))
        ]  # fmt: skip
        found = scan(fit, [replace(candidate, variants=np.array(variants)), before])
        candidate = replace(candidate, variants=np.array([variants[found.best[0]]]))
        strength = float(found.singles(found.gram.given([*found.unknowns, *found.further])).value[0])
        promised = float(found.log_bayes[0] + found.spread[0])
        gain = promised - float(found.log_bayes[1])
        if promised <= 0.0:
            break  # a finer grid brings nothing either
    return candidate, strength, gain


def _to_a_neighbour(p: Parameter) -> float:
    """Farthest distance of two neighbours in the grid of a parameter, in its logarithm if it has such a prior."""
    return float(max(np.diff(np.sort(np.log(p.grid) if p.log else p.grid)), default=p.sd))


def _about(p: Parameter, value: float, steps: Array) -> list[float]:
    """Values about one, none twice."""
    values = value * np.exp(steps) if p.log else value + steps
    return [float(one) for one in np.unique(np.clip(values, p.lower, p.upper))]


def _changed(shape: Array, at: Sequence[int], values: Sequence[float]) -> Array:
    shape = shape.copy()
    shape[list(at)] = values
    return shape


def _without(fit: Fit, own: slice) -> Fit:
    """A fit without the unknowns of one effect, and by a straight line without what it does."""
    experiment, kept = fit.experiment, np.ones(len(fit.z), dtype=bool)
    kept[own] = False
    parts = [replace(part, residual=part.residual + fit.z[own.start] * part.columns[:, own.start],
                     columns=part.columns[:, kept]) for part in fit.parts]  # fmt: skip
    unknowns = tuple(unknown for unknown, keep in zip(experiment.unknowns, kept, strict=True) if keep)
    return Fit(experiment=replace(experiment, unknowns=unknowns), z=fit.z[kept],
               linearised=Linearised.of(parts, experiment.metric))  # fmt: skip
