r"""The metric in which residuals are judged: noise, and what is marginalised with it.

Model error :math:`N n` with :math:`n \sim N(0, 1)` in units of its amplitudes is marginalised exactly in the linearised
readings; so are deviations :math:`s [J, N]` of every test session from the values that all sessions share. With
:math:`B` the columns of both, whitened, the inner product of whitened readings is
:math:`x^T (1 + B B^T)^{-1} y = x^T y - x^T B (1 + B^T B)^{-1} B^T y`.

References
----------
Petersen, Pedersen, The Matrix Cookbook (2012), section 3.2 (Woodbury identity) and 9.1 (determinants by blocks).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import eigh, solve_triangular

from diagnosis.forward.grid import ErrorCourse
from models.base.types import Array

LEAST_DIRECTION, MOST_DIRECTIONS = 0.1, 300  # squared norm of a direction against the noise; how many are carried


@dataclass(frozen=True, kw_only=True, eq=False)
class Metric:
    """Inner products of whitened readings of all pieces; by default noise is all that there is.

    Attributes
    ----------
    sessions : tuple of tuple of int
        Pieces of every test session
    columns : tuple of Array, shape (M, n) each
        Whitened columns of every piece, those of model error times their amplitudes
    shared : int
        How many of them, from the first, have values that all sessions share
    own : int
        First of those from which every session deviates, model error before others; n if sessions do not differ
    deviation : float
        Of a session, in prior standard deviations
    courses : tuple of ErrorCourse
        What the n shared columns do along every piece, for simulations with model error; empty: none
    """

    sessions: tuple[tuple[int, ...], ...] = ()
    columns: tuple[Array, ...] = ()
    shared: int = 0
    own: int = 0
    deviation: float = 0.0
    courses: tuple[ErrorCourse, ...] = ()

    @property
    def shared_columns(self) -> list[Array]:
        """Whitened columns of every piece whose values all sessions share, shape (M, shared) each."""
        return [columns[:, : self.shared] for columns in self.columns]

    @cached_property
    def _factors(self) -> tuple[list[Array], list[Array], Array]:
        """Lower Cholesky factor of every session, the shared columns along it, and the factor of these given all."""
        roots, across, whole = [], [], np.eye(self.shared)
        for pieces in self.sessions:
            columns = [self.columns[p] for p in pieces]
            inner, s = _sum(columns, columns), self.deviation
            own = s * s * inner[self.own :, self.own :]
            roots.append(np.asarray(np.linalg.cholesky(np.eye(len(own)) + own)))
            across.append(solve_triangular(roots[-1], s * inner[self.own :, : self.shared], lower=True))
            whole += inner[: self.shared, : self.shared] - across[-1].T @ across[-1]
        return roots, across, np.asarray(np.linalg.cholesky(whole))

    @cached_property
    def log_determinant(self) -> float:
        """Of what is marginalised."""
        roots, _, whole = self._factors
        return 2.0 * float(sum(np.log(np.diag(root)).sum() for root in (*roots, whole)))

    def products(self, columns: Sequence[Array]) -> Array:
        """Inner products of whitened columns.

        Parameters
        ----------
        columns : sequence of Array, shape (M, n) each
            Of every piece

        Returns
        -------
        Array, shape (n, n)
        """
        mine, along = self._along(columns)
        return _sum(columns, columns) - sum((each.T @ each for each in mine), 0.0) - along.T @ along

    def against(self, residuals: Sequence[Array], columns: Sequence[Array]) -> tuple[Array, Array]:
        """Inner products of many columns with the residual, and of each with itself.

        Parameters
        ----------
        residuals : sequence of Array, shape (M,) each
        columns : sequence of Array, shape (M, n) each

        Returns
        -------
        a, b : Array, shape (n,)
        """
        own, over = self._along([r[:, None] for r in residuals])
        mine, along = self._along(columns)
        a = np.sum([X.T @ r for X, r in zip(columns, residuals, strict=True)], axis=0) - along.T @ over[:, 0]
        b = np.sum([np.einsum("mn,mn->n", X, X) for X in columns], axis=0) - np.einsum("un,un->n", along, along)
        for each, r in zip(mine, own, strict=True):
            a, b = a - each.T @ r[:, 0], b - np.einsum("un,un->n", each, each)
        return np.asarray(a), np.asarray(b)

    def explained(self, residuals: Sequence[Array]) -> list[Array]:
        """Most probable values of all columns in every piece, deviations of its session included.

        Parameters
        ----------
        residuals : sequence of Array, shape (M,) each

        Returns
        -------
        list of Array, shape (n,) each
            Of columns that are not shared the deviation
        """
        (roots, across, whole), (mine, along) = self._factors, self._along([r[:, None] for r in residuals])
        shared = solve_triangular(whole.T, along[:, 0])
        found = [np.pad(shared, (0, self.columns[0].shape[1] - self.shared))] * len(residuals)
        for root, over, own, pieces in zip(roots, across, mine, self.sessions, strict=True):
            for p in pieces if len(root) else ():
                found[p] = found[p] + self.deviation * solve_triangular(root.T, own[:, 0] - over @ shared)
        return found

    def spread(self, combination: Array) -> float:
        """Standard deviation that the readings leave to a combination of the shared columns, shape (n,)."""
        return float(np.linalg.norm(solve_triangular(self._factors[2], combination, lower=True)))

    def _along(self, columns: Sequence[Array]) -> tuple[list[Array], Array]:
        """Components of columns along what is marginalised: of every session, then of what all share."""
        roots, across, whole = self._factors
        mine, along = [], np.zeros((len(whole), columns[0].shape[1]))
        for root, over, pieces in zip(roots, across, self.sessions, strict=True):
            inner = _sum([self.columns[p] for p in pieces], [columns[p] for p in pieces])
            mine.append(solve_triangular(root, self.deviation * inner[self.own :], lower=True))
            along += inner[: self.shared] - over.T @ mine[-1]
        return mine, solve_triangular(whole, along, lower=True)


def leading_directions(products: Array) -> Array:
    """Combinations of columns that carry nearly all of what the columns can do.

    Parameters
    ----------
    products : Array, shape (n, n)
        Inner products of whitened columns with prior N(0, 1) each

    Returns
    -------
    Array, shape (n, k)
        Columns times this have the prior N(0, 1) again; directions that are left out are far below the noise
    """
    values, vectors = eigh(products)
    chosen = np.flatnonzero(values > LEAST_DIRECTION)[-MOST_DIRECTIONS:]
    return np.asarray(vectors[:, chosen])


def _sum(left: Sequence[Array], right: Sequence[Array]) -> Array:
    return np.asarray(np.sum([a.T @ b for a, b in zip(left, right, strict=True)], axis=0))
