"""The date of a change, finer than the scan has it, and how well the readings show it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.engine.candidates import scan
from diagnosis.engine.fit import Fit
from diagnosis.engine.point import Column
from models.base.types import Array

FINER, SPANS = 17, 5  # dates and lengths between the neighbours of the best one
ROUNDS, CLOSER = 3, 0.25  # how much closer every round looks
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


def date_of(
    fit: Fit, hypothesis: Hypothesis, variant: int, *, distance: float, further: Sequence[Sequence[Column]] = (),
    amplitudes: Array | float = 1.0,
) -> Dated:  # fmt: skip
    """Look for the date of a change between the dates of the scan.

    Parameters
    ----------
    fit : Fit
        Without the change
    hypothesis : Hypothesis
        At a date
    variant : int
        Its best one in the scan
    distance : float
        Between dates of the scan, [s]
    further : sequence, one per piece, of sequences of Column
        Further unknowns, see :func:`diagnosis.engine.candidates.scan`
    amplitudes : Array, shape (further unknowns,), or float
        Their prior standard deviations
    """
    assert hypothesis.term is not None  # noqa: S101 - a change has one
    parameters = hypothesis.term.parameters
    since = next(i for i, p in enumerate(parameters) if p.name.endswith("_since"))
    span, best = since + 1, np.array(hypothesis.variants[variant])
    shortest = float(np.min(hypothesis.variants[:, span]))
    reach, stretch = distance, 4.0
    while True:
        dates = best[since] + reach * np.linspace(-1.0, 1.0, FINER)
        spans = np.unique(np.maximum(best[span] * stretch ** np.linspace(-1.0, 1.0, SPANS), shortest))
        tried = [replace(hypothesis, variants=_moved(best, since, [date, length])) for length in spans for date in dates]
        found = scan(fit, tried, further)
        known = [*found.unknowns, *found.further]
        scale = np.concatenate([np.ones(len(found.unknowns)), np.broadcast_to(amplitudes, len(found.further))])
        single = found.singles(found.gram.given(known, scale))
        at = int(np.argmax(single.log_bayes))
        weights = np.exp(single.log_bayes - single.log_bayes[at]).reshape(len(spans), FINER).sum(axis=0)
        best = tried[at].variants[0]
        low, high = _band(dates, weights)
        if reach <= (high - low) or reach < 0.02 * distance:
            break
        reach, stretch = max(CLOSER * reach, 0.75 * (high - low)), np.sqrt(stretch)
    return Dated(
        hypothesis=tried[at], log_bayes=float(single.log_bayes[at]), strength=float(single.value[at]),
        since=float(best[since]), low=low, high=high,
    )  # fmt: skip


def _moved(values: Array, first: int, given: Sequence[float]) -> Array:
    variant = np.array(values)
    variant[first : first + len(given)] = given
    return variant[None, :]


def _band(dates: Array, weights: Array) -> tuple[float, float]:
    """Band of a distribution that is constant around every date."""
    edges = np.concatenate([[dates[0]], 0.5 * (dates[1:] + dates[:-1]), [dates[-1]]])
    share = np.concatenate([[0.0], np.cumsum(weights) / weights.sum()])
    return float(np.interp(LOW, share, edges)), float(np.interp(HIGH, share, edges))
