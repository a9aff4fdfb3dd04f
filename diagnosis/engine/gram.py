r"""One Gram matrix of everything that may be in the readings, and the evidences that follow from it.

Per recording :math:`G = W^T W` with the whitened :math:`W = [r, J, N, X]`: residual, unknowns, model error, candidates.
With unknowns :math:`z \sim N(0, A^2)` (A the amplitudes, 0 for what is absent) the evidence of the readings is

.. math:: \ln p = -\tfrac12 \left(r^T M^{-1} r + \ln |M| + \ln |S|\right), \quad M = 1 + W_b A^2 W_b^T

(S: the noise), and every further question is a Schur complement of G.

References
----------
MacKay, Information Theory, Inference, and Learning Algorithms (2003), chapter 28, for the evidence; Petersen, Pedersen,
The Matrix Cookbook (2012), sections 3.2 and 9.1, for inverse and determinant by Schur complements.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cholesky, solve_triangular
from scipy.special import log_ndtr

from diagnosis.engine.fit import Fit, Linear
from models.base.types import Array

Index = Sequence[int] | NDArray[np.intp]
Signs = NDArray[np.int_]
LEAST = 1e-9  # of a column's square: less shows nothing


@dataclass(frozen=True, kw_only=True, eq=False)
class Gram:
    """Inner products of whitened columns.

    Attributes
    ----------
    of_recording : mapping of str to Array, shape (1 + columns, 1 + columns)
        The first is the residual at the priors' middles
    log_determinants : mapping of str to float
        Of the noise of every recording
    """

    of_recording: Mapping[str, Array]
    log_determinants: Mapping[str, float]

    @property
    def count(self) -> int:
        """How many columns there are."""
        return len(next(iter(self.of_recording.values()))) - 1

    def combined(self, unknowns: range, directions: Array) -> Gram:
        """Products with combinations, shape (unknowns, n), in place of some neighbouring unknowns."""
        first, last = unknowns.start + 1, unknowns.stop + 1

        def moved(G: Array) -> Array:
            G = np.concatenate([G[:first], directions.T @ G[first:last], G[last:]])
            return np.concatenate([G[:, :first], G[:, first:last] @ directions, G[:, last:]], axis=1)

        return Gram(of_recording={name: moved(G) for name, G in self.of_recording.items()},
                    log_determinants=self.log_determinants)  # fmt: skip

    def given(
        self, unknowns: Index, amplitudes: Array | float = 1.0, recordings: Collection[str] | None = None
    ) -> Given:
        """Everything else, with some unknowns marginalised.

        Parameters
        ----------
        unknowns : sequence of int
            Places of the unknowns among the columns
        amplitudes : Array, shape (unknowns,), or float
            Prior standard deviations
        recordings : collection of str, optional
            Which recordings count; all by default
        """
        names = list(self.of_recording) if recordings is None else [n for n in self.of_recording if n in recordings]
        whole = np.sum([self.of_recording[name] for name in names], axis=0)
        nothing = Given(matrix=whole, log_determinant=sum(self.log_determinants[name] for name in names))
        return nothing.given(unknowns, amplitudes)


@dataclass(frozen=True, kw_only=True, eq=False)
class Strengths:
    """Evidence and size of columns as further unknowns.

    Attributes
    ----------
    log_bayes : Array, shape (n,)
        Log Bayes factor against nothing
    value : Array, shape (n,)
        Most probable strength
    """

    log_bayes: Array
    value: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Given:
    """Inner products with some unknowns marginalised; columns keep their places.

    Attributes
    ----------
    matrix : Array, shape (columns, columns)
        Inner products in the metric of noise and unknowns
    log_determinant : float
        Of noise and unknowns
    """

    matrix: Array
    log_determinant: float

    @property
    def log_evidence(self) -> float:
        """Log evidence of the readings, up to ``-M/2 ln 2 pi``."""
        return -0.5 * (float(self.matrix[0, 0]) + self.log_determinant)

    def given(self, unknowns: Index, amplitudes: Array | float = 1.0) -> Given:
        """Products with further unknowns marginalised; see :meth:`Gram.given`."""
        at = np.asarray(unknowns, dtype=int) + 1
        scale = np.broadcast_to(np.asarray(amplitudes, dtype=float), at.shape)
        at, scale = at[scale > 0.0], scale[scale > 0.0]
        if not len(at):
            return self
        inner = scale[:, None] * self.matrix[np.ix_(at, at)] * scale
        inner[np.diag_indices(len(at))] += 1.0
        root = cholesky(inner, lower=True)
        across = solve_triangular(root, scale[:, None] * self.matrix[at], lower=True)
        return Given(matrix=self.matrix - across.T @ across,
                     log_determinant=self.log_determinant + 2.0 * float(np.log(np.diag(root)).sum()))  # fmt: skip

    def most_probable(self, unknowns: Index, amplitudes: Array | float = 1.0) -> Array:
        """Most probable values of unknowns that are not marginalised yet, shape (unknowns,)."""
        at = np.asarray(unknowns, dtype=int) + 1
        scale = np.broadcast_to(np.asarray(amplitudes, dtype=float), at.shape)
        inner = scale[:, None] * self.matrix[np.ix_(at, at)] * scale + np.eye(len(at))
        return np.asarray(scale * np.linalg.solve(inner, scale * self.matrix[at, 0]))


def strengths(a: Array, b: Array, sd: Array | float, sign: Signs | int = 0) -> Strengths:
    """Evidence and size of columns, each alone.

    Parameters
    ----------
    a, b : Array, shape (n,)
        Inner products with the residual, and with itself
    sd : Array, shape (n,), or float
        Prior of the strengths
    sign : Array of int, shape (n,), or int
        Which strengths are possible: -1, 1, or 0 for both
    """
    b = np.maximum(b, 0.0)
    sd, sign = np.broadcast_to(np.asarray(sd, float), a.shape), np.broadcast_to(np.asarray(sign), a.shape)
    precision = b + 1.0 / np.square(sd)
    value, own = a / precision, 1.0 / np.sqrt(precision)
    log_bayes = 0.5 * a * value - 0.5 * np.log1p(b * np.square(sd))
    log_bayes = log_bayes + np.where(sign != 0, np.log(2.0) + log_ndtr(sign * value / own), 0.0)
    return Strengths(log_bayes=np.where(b > LEAST, log_bayes, 0.0), value=value)


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
    return whitened_base(fit.parts, fit.z, fit.experiment.metric.shared_columns)


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
        name = part.point.piece.recording
        whole = W.T @ W
        if chosen:
            X = chosen[index]
            across = W.T @ X
            whole = np.block([[whole, across], [across.T, X.T @ X]])
        of_recording[name] = of_recording.get(name, 0.0) + whole
        determinants[name] = determinants.get(name, 0.0) + part.filter.log_determinant
    return Gram(of_recording=of_recording, log_determinants=determinants)
