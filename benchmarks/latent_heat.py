"""Heat that a calibrated model lacks at a node over time, without any form: straight lines between knots.

Its prior is a random process: a level, and something that wanders over hours. All other unknowns are marginalised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.engine.fit import Fit
from diagnosis.engine.gram import base_of, gram_of
from diagnosis.forward.grid import Piece
from models.base.types import Array

KNOT_S, MOST_KNOTS, WANDER_S = 1200.0, 160, 7200.0
AMPLITUDES = (0.02, 0.08, 0.3)  # of the typical loss
LEVEL_SHARE = 0.5  # of the prior variance that is a constant level


@dataclass(frozen=True, kw_only=True, eq=False)
class LatentHeat:
    """An unknown heat in one part: evidence against no such heat, and its mean at all intervals of all pieces, [W]."""

    node: str
    log_bayes: float
    mean: Array


def latent_heat(fit: Fit, node: str, *, loss_W: float, is_loss: bool) -> LatentHeat:
    """Evidence and course of an unknown heat in `node`; `is_loss`: one that the measured total loss would show."""
    shapes, time, owner = _knots([part.point.piece for part in fit.parts])
    model, blocks = fit.experiment.machine.model, []
    wander = np.where(owner[:, None] == owner, np.exp(-np.abs(time[:, None] - time) / WANDER_S), 0.0)
    root = np.linalg.cholesky(LEVEL_SHARE + (1.0 - LEVEL_SHARE) * wander + 1e-9 * np.eye(len(time)))
    for part, shape in zip(fit.parts, shapes, strict=True):
        into = np.zeros((len(shape), part.point.trajectory.decay.shape[-1], len(time)))
        into[:, model.parts.index(node)] = shape @ root
        loss = into[:, model.parts.index(node)] if is_loss else np.zeros_like(shape)
        blocks.append(part.filter(part.point.heated(into, loss)))
    base = base_of(fit)
    given = gram_of(fit.parts, base, blocks).given(range(base[0].shape[1] - 1))
    columns = range(base[0].shape[1] - 1, base[0].shape[1] - 1 + len(time))
    found = [given.given(columns, share * loss_W).log_evidence - given.log_evidence for share in AMPLITUDES]
    weights = root @ given.most_probable(columns, AMPLITUDES[int(np.argmax(found))] * loss_W)
    return LatentHeat(
        node=node,
        log_bayes=float(np.logaddexp.reduce(found) - np.log(len(AMPLITUDES))),
        mean=np.concatenate([shape @ weights for shape in shapes]),
    )


def _knots(pieces: Sequence[Piece]) -> tuple[list[Array], Array, Array]:
    """Hat functions of all knots at the intervals of every piece, times of the knots [s], and their pieces."""
    total = sum(float(p.time[-1] - p.time[0]) for p in pieces)
    spacing = max(KNOT_S, total / MOST_KNOTS)
    times = [np.linspace(p.time[0], p.time[-1], max(2, int(np.ceil((p.time[-1] - p.time[0]) / spacing)) + 1))
             for p in pieces]  # fmt: skip
    owner = np.repeat(np.arange(len(pieces)), [len(time) for time in times])
    shapes = []
    for index, (piece, time) in enumerate(zip(pieces, times, strict=True)):
        shape = np.zeros((len(piece.steps), len(owner)))
        shape[:, owner == index] = np.stack([np.interp(piece.middle, time, one) for one in np.eye(len(time))], axis=1)
        shapes.append(shape)
    return shapes, np.concatenate(times), owner
