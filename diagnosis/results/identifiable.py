"""Sizes that the recordings of an explanation identify or not, see :mod:`diagnosis.results.ratios_only`."""

from __future__ import annotations

import numpy as np

from diagnosis.candidates.explain import Explanation
from diagnosis.results.ratios_only import along, notes_along, sizes
from models.base.types import Array


def scale_direction(explanation: Explanation) -> Array:
    """Change of the unknowns that multiplies every heat, conductance and capacity by e, within their bounds.

    Returns
    -------
    Array, shape (unknowns,)
        In units of their priors' standard deviations
    """
    fit, network = explanation.fit, explanation.problem.model.network
    known = set(sizes(network))
    direction = np.zeros(len(fit.unknowns))
    for index, item in enumerate(fit.unknowns.items):
        if item.role == "network" and item.target in known and item.parameter.sd > 0.0:
            direction[index] = along(item.parameter, item.value(float(fit.z[index])))
    return direction


def scale_notes(explanation: Explanation) -> tuple[str, ...]:
    """One sentence if the recordings identify ratios only; nothing if they identify sizes.

    Parameters
    ----------
    explanation : Explanation
    """
    return notes_along(scale_direction(explanation), explanation.fit.white_columns)
