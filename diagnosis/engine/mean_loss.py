"""Mean total loss of a fit, and what it depends on."""

from __future__ import annotations

import numpy as np

from diagnosis.engine.fit import Fit
from diagnosis.engine.unknown import in_scope
from models.base.types import Array


def mean_loss(fit: Fit) -> tuple[float, Array]:
    """Mean total loss over the tested recordings, and its slopes with temperatures as they are.

    Returns
    -------
    loss : float
        [W]
    slopes : Array, shape (unknowns,)
        By ``z``, [W]
    """
    experiment, slopes, loss, duration = fit.experiment, np.zeros(len(fit.z)), 0.0, 0.0
    for part in map(fit.parts.__getitem__, experiment.tested):
        point, piece = part.point, part.point.trajectory.piece
        duration += float(piece.steps.sum())
        loss += float(piece.steps @ point.balance.sources[:, experiment.machine.model.is_loss].sum(axis=-1))
        for index, (unknown, z) in enumerate(zip(experiment.unknowns, fit.z.tolist(), strict=True)):
            heat = unknown.column(point, z).heat if in_scope(unknown, piece.recording) else None
            slopes[index] += 0.0 if heat is None else float(piece.steps @ heat.loss)
    return loss / duration, slopes / duration
