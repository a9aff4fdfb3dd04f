"""Whitened columns of a linearisation side by side, and their Gram matrix."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from diagnosis.engine.fit import Fit, Linear
from diagnosis.engine.gram import Gram
from models.base.types import Array


def whitened_base(parts: Sequence[Linear], z: Array, error: Sequence[Array] = ()) -> list[Array]:
    """Residual at the priors' middles, unknowns and model error of every piece, shape (M, 1 + unknowns + n).

    Parameters
    ----------
    z : Array, shape (unknowns,)
        Where they are linearised
    error : sequence of Array, shape (M, n) each
        Whitened columns of model error
    """
    return [np.column_stack([part.residual + part.columns @ z, part.columns, *error[index : index + 1]])
            for index, part in enumerate(parts)]  # fmt: skip


def base_of(fit: Fit) -> list[Array]:
    """Whitened columns of a fit, with the model error of its metric."""
    metric = fit.experiment.metric
    return whitened_base(fit.parts, fit.z, () if metric is None else metric.shared_columns)


def gram_of(parts: Sequence[Linear], base: Sequence[Array], chosen: Sequence[Array] = ()) -> Gram:
    """Gram matrices by recording.

    Parameters
    ----------
    base : sequence of Array, shape (M, m) each
        Residual first
    chosen : sequence of Array, shape (M, n) each
        Further columns
    """
    of_recording: dict[str, Array] = {}
    determinants: dict[str, float] = {}
    for index, (part, W) in enumerate(zip(parts, base, strict=True)):
        name = part.point.trajectory.piece.recording
        whole = W.T @ W
        if chosen:
            X = chosen[index]
            across = W.T @ X
            whole = np.block([[whole, across], [across.T, X.T @ X]])
        of_recording[name] = of_recording.get(name, 0.0) + whole
        determinants[name] = determinants.get(name, 0.0) + part.filter.log_determinant
    return Gram(of_recording=of_recording, log_determinants=determinants)
