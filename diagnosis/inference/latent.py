"""Heat that the model lacks, node by node and over time, without any idea of what it is.

Into one part at a time goes an unknown heat that is a straight line between knots. Its prior is a random process: a
level plus something that wanders over hours. The evidence for it, with all other unknowns marginalised, says *where*;
its posterior says *how much and when*, with a band.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.forward.grid import Piece
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.observation import reading_columns
from diagnosis.inference.evidence import Marginal
from diagnosis.inference.posterior import Fit, Linearised
from models.base.types import Array

KNOT_S = 1200.0
MOST_KNOTS = 160
WANDER_S = 7200.0
AMPLITUDES = (0.02, 0.08, 0.3)  # of the typical loss
LEVEL_SHARE = 0.5  # of the prior variance that is a constant level


def white_columns(model: NetworkOnGrid, part: Linearised, heat: Array, loss: Array) -> Array:
    """Whitened readings per column of extra heat.

    Parameters
    ----------
    model : NetworkOnGrid
    part : Linearised
    heat : Array, shape (K, parts, columns)
        [W]
    loss : Array, shape (K, columns)
        What of it is mechanical loss and shows as such, [W]

    Returns
    -------
    Array, shape (M, columns)
    """
    T = part.trajectory.response(heat)
    return part.whitening(part.shown(reading_columns(model, part.trajectory, part.sensors, T, loss)))


@dataclass(frozen=True, kw_only=True, eq=False)
class Knots:
    """Straight lines between knots in all pieces.

    Attributes
    ----------
    shapes : tuple of Array, shape (K, knots)
        Value of every knot's hat function at the middles of the intervals of every piece
    time : Array, shape (knots,)
        Since the start of its recording, [s]
    piece : Array of int, shape (knots,)
        Piece each knot belongs to
    """

    shapes: tuple[Array, ...]
    time: Array
    piece: Array


def knots_of(pieces: Sequence[Piece]) -> Knots:
    """Knots of all pieces, no more than :data:`MOST_KNOTS` of them."""
    total = sum(float(p.time[-1] - p.time[0]) for p in pieces)
    spacing = max(KNOT_S, total / MOST_KNOTS)
    times, owner, count = [], [], []
    for index, piece in enumerate(pieces):
        n = max(2, int(np.ceil((piece.time[-1] - piece.time[0]) / spacing)) + 1)
        times.append(np.linspace(piece.time[0], piece.time[-1], n))
        owner += [index] * n
        count.append(n)
    shapes, before = [], 0
    for piece, time, n in zip(pieces, times, count, strict=True):
        shape = np.zeros((len(piece.steps), sum(count)))
        for j in range(n):
            shape[:, before + j] = np.interp(piece.middle, time, np.eye(n)[j])
        shapes.append(shape)
        before += n
    return Knots(shapes=tuple(shapes), time=np.concatenate(times), piece=np.array(owner))


@dataclass(frozen=True, kw_only=True, eq=False)
class LatentHeat:
    """An unknown heat in one part.

    Attributes
    ----------
    node : str
    is_loss : bool
        Whether it was taken as mechanical loss, which the measured total loss then shows
    log_bayes : float
        Against no such heat
    mean, sd : tuple of Array, shape (K,)
        Heat at the middles of the intervals of every piece and its standard deviation, [W]
    """

    node: str
    is_loss: bool
    log_bayes: float
    mean: tuple[Array, ...]
    sd: tuple[Array, ...]


def latent_heat(
    model: NetworkOnGrid, fit: Fit, marginal: Marginal, node: str, *, loss_W: float, is_loss: bool, knots: Knots
) -> LatentHeat:
    """Evidence and course of an unknown heat in `node`.

    Parameters
    ----------
    model : NetworkOnGrid
    fit : Fit
    marginal : Marginal
        Of the same fit
    node : str
        A part of the network
    loss_W : float
        Typical total loss, [W]
    is_loss : bool
        Whether the measured total loss would show it
    knots : Knots
    """
    at = model.parts.index(node)
    blocks = []
    for part, shape in zip(fit.parts, knots.shapes, strict=True):
        heat = np.zeros((len(shape), model.n, shape.shape[1]))
        heat[:, at] = shape
        blocks.append(white_columns(model, part, heat, shape if is_loss else np.zeros_like(shape)))
    X = np.concatenate(blocks)
    a, gram = X.T @ marginal.rest, marginal.gram(X)
    best = None
    together = knots.piece[:, None] == knots.piece
    wander = np.where(together, np.exp(-np.abs(knots.time[:, None] - knots.time) / WANDER_S), 0.0)
    prior = LEVEL_SHARE + (1.0 - LEVEL_SHARE) * wander
    count = len(a)
    evidences = []
    for amplitude in AMPLITUDES:
        root = np.linalg.cholesky((amplitude * loss_W) ** 2 * prior + 1e-9 * np.eye(count))
        inner = np.eye(count) + root.T @ gram @ root
        factor = np.linalg.cholesky(inner)
        half = np.linalg.solve(factor, root.T @ a)
        evidence = 0.5 * float(half @ half) - float(np.log(np.diag(factor)).sum())
        evidences.append(evidence)
        if best is None or evidence > best[0]:
            spread = np.linalg.solve(factor, root.T)
            best = (evidence, spread.T @ half, spread.T @ spread)
    assert best is not None  # noqa: S101 - AMPLITUDES is not empty
    _, mean, covariance = best
    return LatentHeat(
        node=node,
        is_loss=is_loss,
        log_bayes=float(np.logaddexp.reduce(evidences) - np.log(len(AMPLITUDES))),
        mean=tuple(shape @ mean for shape in knots.shapes),
        sd=tuple(np.sqrt(np.einsum("ki,ij,kj->k", s, covariance, s).clip(0.0)) for s in knots.shapes),
    )
