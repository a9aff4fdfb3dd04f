"""The heat of something that was found."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnosis.candidates.explain import Explanation
from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.forward.term_on_grid import TermOnGrid
from models.base.types import Array


def heats_of(explanation: Explanation, h: Hypothesis) -> Sequence[Array]:
    """Heat of something found, over all intervals, summed over the parts it warms, [W]; none of a fault."""
    if h.term is None or h.term.kind in ("sensor", "signal"):
        return []
    values = explanation.values_of(h)
    given = np.array([[values[p.name][0] for p in h.term.parameters]])
    return [heat[:, 0] for heat in _heats_with(explanation, h, given)]


def _heats_with(explanation: Explanation, h: Hypothesis, values: Array) -> list[Array]:
    """Heat with each row of `values`, the first as fitted, for its parameters; shape (K, rows) per piece, [W]."""
    assert h.term is not None  # noqa: S101 - only a term brings heat
    term, result = TermOnGrid(explanation.problem.model, h.term), []
    for part in explanation.fit.parts:
        heat = term.heat(part.trajectory, values, there=values[0])[0]
        positive, negative = heat.clip(0.0).sum(axis=1), heat.clip(None, 0.0).sum(axis=1)
        result.append(np.where(positive > -negative, positive, negative))
    return result


def mean_heat_of(explanation: Explanation, h: Hypothesis) -> tuple[float, float]:
    """Mean magnitude of the heat of something found and its standard error, [W]; nothing of a fault.

    The error is that of the term's own parameters, everything else that was fitted marginalised.
    """
    if h.term is None or h.term.kind in ("sensor", "signal"):
        return 0.0, 0.0
    items, fit = explanation.fit.unknowns.items, explanation.fit
    own = fit.unknowns.of(h.term.parameters)
    covariance = fit.covariance[np.ix_(own, own)]
    sd = np.sqrt(np.diag(covariance))
    moved = fit.z[own] + np.concatenate([np.zeros((1, len(own))), np.diag(sd), -np.diag(sd)])
    values = np.array([[items[i].value(float(x)) for i, x in zip(own, row, strict=True)] for row in moved])
    steps = np.concatenate([part.trajectory.piece.steps for part in fit.parts])
    means = np.average(np.abs(np.concatenate(_heats_with(explanation, h, values))), axis=0, weights=steps)
    up, down = np.split(means[1:], 2)
    slope = (up - down) / (2.0 * sd)
    return float(means[0]), float(np.sqrt(slope @ covariance @ slope))
