"""Evidence for one more column, with everything else that is unknown marginalised.

Ordinary calibration swallows most of an effect: its residual says little, the shifted parameters say the rest. So a
candidate is judged against the residual *at the priors' middle*, whose covariance is that of the noise plus that of all
unknowns, ``1 + J J^T`` in whitened units. For a column ``x`` with strength ``s ~ N(0, sd^2)`` everything follows from
two numbers, ``a = x^T M^-1 r`` and ``b = x^T M^-1 x``.

References
----------
MacKay, Information Theory, Inference, and Learning Algorithms (2003), chapter 28, for the Occam factor; Brynjarsdottir,
O'Hagan, Inverse Problems 30 (2014), for why the priors of the unknowns have to be realistic.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.special import log_ndtr

from diagnosis.inference.posterior import Fit
from models.base.types import Array


class Marginal:
    """A residual at the priors' middle, and the covariance of everything unknown.

    Parameters
    ----------
    columns : Array, shape (M, unknowns)
        Whitened derivatives with respect to the unknowns
    residual : Array, shape (M,)
        Whitened, where all unknowns are in the middle of their priors
    """

    def __init__(self, columns: Array, residual: Array) -> None:
        J = self.columns = columns
        self.residual = residual
        self._factor = cho_factor(np.eye(J.shape[1]) + J.T @ J)
        self.rest = residual - J @ self.most_probable(residual)  # M^-1 r
        self.chi_square = float(self.residual @ self.rest)

    @classmethod
    def of(cls, fit: Fit) -> Marginal:
        """Of a fit: back to the middle of the priors along the linearisation, where the covariance is 1 + J J^T."""
        J = fit.white_columns
        return cls(J, fit.white_residual + J @ fit.z)

    def most_probable(self, residual: Array) -> Array:
        """The unknowns that a residual at the priors' middle speaks for, shape (unknowns,)."""
        return np.asarray(cho_solve(self._factor, self.columns.T @ residual))

    def weighed(self, columns: Array) -> Array:
        """``M^-1 x`` for columns, shape (M, n)."""
        return np.asarray(columns - self.columns @ cho_solve(self._factor, self.columns.T @ columns))

    def products(self, columns: Array) -> tuple[Array, Array]:
        """``a`` and ``b`` of columns of shape (M, n), each of shape (n,)."""
        along = self.columns.T @ columns
        b = np.einsum("mn,mn->n", columns, columns) - np.einsum("un,un->n", along, cho_solve(self._factor, along))
        return np.asarray(columns.T @ self.rest), np.asarray(np.maximum(b, 0.0))

    def gram(self, columns: Array) -> Array:
        """``X^T M^-1 X`` of columns, shape (n, n)."""
        along = self.columns.T @ columns
        return np.asarray(columns.T @ columns - along.T @ cho_solve(self._factor, along))


@dataclass(frozen=True, kw_only=True)
class Strength:
    """What a column is worth.

    Attributes
    ----------
    log_bayes : Array, shape (n,)
        Log Bayes factor of the column against nothing
    value, sd : Array, shape (n,)
        Most probable strength and its standard deviation
    """

    log_bayes: Array
    value: Array
    sd: Array


def strength(a: Array, b: Array, prior_sd: Array | float, sign: int) -> Strength:
    """Log Bayes factor of columns whose strength has a normal prior, or half of one.

    Parameters
    ----------
    a, b : Array, shape (n,)
        See :meth:`Marginal.products`
    prior_sd : Array or float
        Of the strength
    sign : {-1, 0, 1}
        Which strengths are possible; 0 both

    Examples
    --------
    >>> found = strength(np.array([30.0]), np.array([10.0]), 1.0, 1)
    >>> found.value.round(2).tolist(), found.log_bayes.round(1).tolist()
    ([2.73], [40.4])
    >>> bool(strength(np.array([-30.0]), np.array([10.0]), 1.0, 1).log_bayes[0] < 0.0)
    True
    """
    precision = b + 1.0 / np.square(prior_sd)
    value, sd = a / precision, 1.0 / np.sqrt(precision)
    log_bayes = 0.5 * a * value - 0.5 * np.log1p(b * np.square(prior_sd))
    if sign:
        log_bayes = log_bayes + np.log(2.0) + log_ndtr(sign * value / sd)
    return Strength(log_bayes=np.asarray(log_bayes), value=np.asarray(value), sd=np.asarray(sd))
