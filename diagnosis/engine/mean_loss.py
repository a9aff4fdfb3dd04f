"""Mean total loss of a fit, and what it depends on."""

from __future__ import annotations

import numpy as np

from diagnosis.engine.fit import Experiment, Fit
from diagnosis.engine.scale import all_sizes_are_unknown, is_of_temperatures
from diagnosis.engine.unknown import in_scope
from models.base.types import Array


def is_estimated(experiment: Experiment) -> bool:
    """True if the mean loss is an estimate: none is measured, and the definition fixes sizes."""
    network = experiment.network
    return is_of_temperatures(experiment) and not all_sizes_are_unknown(network, experiment.unknowns)


def mean_loss(fit: Fit) -> float:
    """Mean total loss over the tested recordings, [W]."""
    is_loss, tested = fit.experiment.machine.model.is_loss, [fit.parts[i].point for i in fit.experiment.tested]
    heat = sum(float(p.piece.steps @ p.balance.sources[:, is_loss].sum(axis=-1)) for p in tested)
    return heat / sum(p.piece.duration for p in tested)


def mean_loss_slopes(fit: Fit) -> Array:
    """Slopes of the mean total loss by ``z``, with temperatures as they are, shape (unknowns,), [W]."""
    slopes, duration = np.zeros(len(fit.z)), 0.0
    for point in (fit.parts[i].point for i in fit.experiment.tested):
        piece = point.piece
        duration += piece.duration
        for index, (unknown, z) in enumerate(zip(fit.experiment.unknowns, fit.z.tolist(), strict=True)):
            heat = unknown.column(point, z).heat if in_scope(unknown, piece.recording) else None
            slopes[index] += 0.0 if heat is None else float(piece.steps @ heat.loss)
    return slopes / duration
