"""Evidence of an unknown heat: several columns per part that are marginalised together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.candidates.unknown_heat import unknown_heats
from diagnosis.engine.candidates import heat_columns
from diagnosis.engine.families import axis_of
from diagnosis.engine.fit import Experiment
from diagnosis.engine.gram import Given, Index
from diagnosis.engine.point import Column, Point
from diagnosis.setup.inference_setup import InferenceSetup
from models.base.types import Array
from models.quantities.quantities import TOTAL_LOSS

SIZES = (0.3, 1.0, 3.0)  # of the prior of an unknown heat


def outside_of(setup: InferenceSetup, experiment: Experiment) -> list[Hypothesis]:
    """An unknown heat, and an unknown loss, in every part."""
    return unknown_heats(experiment.machine.model.network, setup.scale, axis_of(experiment),
                         losses=TOTAL_LOSS in setup.channels)  # fmt: skip


def outside_columns(experiment: Experiment, point: Point, hypotheses: Sequence[Hypothesis]) -> list[Column]:
    """Columns of all functions of unknown heats in one piece, one after the other, per watt."""
    return [column for one in hypotheses for column in heat_columns(experiment, point, one)]


@dataclass(frozen=True, kw_only=True, eq=False)
class Together:
    """Evidence of columns that are marginalised together.

    Attributes
    ----------
    log_bayes : float
        Against nothing, mean over :data:`SIZES`
    weights : Array, shape (columns,)
        Most probable ones, at the most probable size
    """

    log_bayes: float
    weights: Array


def judged_together(given: Given, columns: Index, sd: float) -> Together:
    """Evidence of one unknown heat.

    Parameters
    ----------
    given : Given
        With everything else that is unknown marginalised
    columns : sequence of int
        Places of its functions among the labels
    sd : float
        Prior of the weights: of the strength of its term
    """
    found = [given.given(columns, sd * size).log_evidence - given.log_evidence for size in SIZES]
    best = SIZES[int(np.argmax(found))]
    return Together(log_bayes=float(np.logaddexp.reduce(found) - np.log(len(SIZES))),
                    weights=given.most_probable(columns, sd * best))  # fmt: skip
