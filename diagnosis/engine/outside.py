"""Evidence of an unknown heat: several columns per part that are marginalised together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.candidates.unknown_heat import shaped, unknown_heats
from diagnosis.engine.families import axis_of
from diagnosis.engine.fit import Experiment, Fit
from diagnosis.engine.gram import Given, Index
from diagnosis.engine.scan import scan
from diagnosis.engine.sessions import over_sessions
from diagnosis.setup.inference_setup import InferenceSetup
from models.base.types import Array
from models.quantities.quantities import TOTAL_LOSS

SIZES = (0.3, 1.0, 3.0)  # of the prior of an unknown heat


def outside_of(setup: InferenceSetup, experiment: Experiment) -> list[Hypothesis]:
    """An unknown heat, and an unknown loss, in every part."""
    return unknown_heats(experiment.network, setup.scale, axis_of(experiment),
                         losses=TOTAL_LOSS in setup.channels)  # fmt: skip


def judge_outside(fit: Fit, hypotheses: Sequence[Hypothesis]) -> list[tuple[Hypothesis, float]]:
    """Judge unknown heats: all functions of each are marginalised together.

    Parameters
    ----------
    fit : Fit
        Its unknowns and the model error in its metric are marginalised too, over deviations between sessions
    hypotheses : sequence of Hypothesis
        See :func:`outside_of`

    Returns
    -------
    list of (Hypothesis, float)
        Each with one variant, its most probable shape; and its log Bayes factor against nothing, shape and size
        marginalised, [nat]
    """
    functions = [replace(one, variants=row[None, :]) for one in hypotheses for row in one.variants]
    found = scan(fit, functions)
    over = over_sessions(found.gram, fit.experiment, [*found.unknowns, *found.further])
    judged, first = [], 0
    for one in hypotheses:
        columns = found.of_candidates[first : first + len(one.variants)]
        each = [judged_together(given, columns, one.added.strength.sd) for given in over.given]
        log_bayes = over.weighed([np.array([value]) for value, _ in each])
        weights = each[over.most_probable][1]
        judged.append((shaped(one, weights), float(log_bayes[0])))
        first += len(columns)
    return judged


def judged_together(given: Given, columns: Index, sd: float) -> tuple[float, Array]:
    """Evidence of columns that are marginalised together.

    Parameters
    ----------
    given : Given
        With everything else that is unknown marginalised
    columns : sequence of int
        Places among the columns of the Gram matrix
    sd : float
        Prior of the weights

    Returns
    -------
    log_bayes : float
        Against nothing, mean over :data:`SIZES`
    weights : Array, shape (columns,)
        Most probable ones, at the most probable size
    """
    found = [given.given(columns, sd * size).log_evidence - given.log_evidence for size in SIZES]
    best = SIZES[int(np.argmax(found))]
    return float(np.logaddexp.reduce(found) - np.log(len(SIZES))), given.most_probable(columns, sd * best)
