"""The date of a change, finer than the scan has it, and how well the readings show it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.engine.candidates import scan
from diagnosis.engine.fit import Fit
from models.base.types import Array

DATES, SPANS, LONGEST = 49, 6, 0.3  # tried per round, and the longest time that a change takes, of the time axis
ROUNDS = 4
PLAUSIBLE = 0.01  # of the best one: dates and spans around which the next round looks
RESOLVED, FINEST_S = 12.0, 30.0  # dates per band, and their least distance
LOW, HIGH = 0.05, 0.95


@dataclass(frozen=True, kw_only=True, eq=False)
class Dated:
    """The date of a change.

    Attributes
    ----------
    hypothesis : Hypothesis
        With one variant, the most probable one
    log_bayes, strength : float
        Of it
    since, low, high : float
        Most probable date and the band from 5 to 95 %, on the time axis of all recordings, [s]
    """

    hypothesis: Hypothesis
    log_bayes: float
    strength: float
    since: float
    low: float
    high: float


def date_of(fit: Fit, hypothesis: Hypothesis) -> Dated:
    """Look for the date of a change between the dates of the scan.

    Dates and the times that a change takes (or lasts) are tried on a grid, which becomes finer where the readings put
    the date.

    Parameters
    ----------
    fit : Fit
        Without the change; its unknowns and what its metric holds are marginalised
    hypothesis : Hypothesis
        At a date
    """
    assert hypothesis.term is not None  # noqa: S101 - a change has one
    names = [p.name.removeprefix(f"{hypothesis.term.label}_") for p in hypothesis.term.parameters]
    since, end = names.index("since"), float(hypothesis.variants[0, -1])
    values, shortest = hypothesis.variants[0], float(hypothesis.variants[:, since + 1].min())
    dates, spans = np.linspace(0.0, end, DATES), np.geomspace(shortest, LONGEST * end, SPANS)
    for _ in range(ROUNDS):
        tried = [replace(hypothesis, variants=_moved(values, since, [at, span])) for span in spans for at in dates]
        found = scan(fit, tried)
        best = int(np.argmax(found.log_bayes))
        weights = np.exp(found.log_bayes - found.log_bayes[best]).reshape(len(spans), len(dates))
        low, high = _band(dates, weights.sum(axis=0))
        value = found.singles(found.gram.given([*found.unknowns, *found.further])).value
        dated = Dated(
            hypothesis=tried[best], log_bayes=float(found.log_bayes[best]), strength=float(value[best]),
            since=float(tried[best].variants[0, since]), low=low, high=high,
        )  # fmt: skip
        distance = dates[1] - dates[0]
        if distance < max((high - low) / RESOLVED, FINEST_S):
            break
        dates = np.linspace(*_plausible(dates, weights.max(axis=0)), DATES)
        spans = np.exp(np.linspace(*_plausible(np.log(spans), weights.max(axis=1)), SPANS))
        spans = np.maximum(spans, shortest)
    return dated


def _plausible(values: Array, weights: Array) -> tuple[float, float]:
    """From before the first plausible value to after the last one."""
    at = np.flatnonzero(weights >= PLAUSIBLE)
    return float(values[max(at[0] - 1, 0)]), float(values[min(at[-1] + 1, len(values) - 1)])


def _moved(values: Array, first: int, given: Sequence[float]) -> Array:
    variant = np.array(values)
    variant[first : first + len(given)] = given
    return variant[None, :]


def _band(dates: Array, weights: Array) -> tuple[float, float]:
    """Band of a distribution that is constant around every date."""
    edges = np.concatenate([[dates[0]], 0.5 * (dates[1:] + dates[:-1]), [dates[-1]]])
    share = np.concatenate([[0.0], np.cumsum(weights) / weights.sum()])
    return float(np.interp(LOW, share, edges)), float(np.interp(HIGH, share, edges))
