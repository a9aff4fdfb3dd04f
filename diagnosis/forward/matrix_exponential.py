"""Matrix exponential of the heat balance over many intervals at once."""

from __future__ import annotations

import numpy as np

from models.base.types import Array


def exponential(matrix: Array, steps: Array) -> tuple[Array, Array]:
    r"""Exact solution of ``x' = A x + b`` over an interval.

    Parameters
    ----------
    matrix : Array, shape (K, n, n)
        A, [1/s]
    steps : Array, shape (K,)
        h, [s]

    Returns
    -------
    decay, gain : Array, shape (K, n, n)
        :math:`e^{hA}` and :math:`\int_0^h e^{sA} ds` [s]: ``x(h) = decay x + gain b``

    References
    ----------
    Taylor series of phi_1 with doubling, phi_1(2z) = (e^z + 1) phi_1(z) / 2; Hochbruck, Ostermann, Exponential
    integrators, Acta Numerica 19 (2010).
    """
    z = matrix * steps[:, None, None]
    largest = float(np.max(np.abs(z).sum(axis=-1), initial=0.0))
    if not np.isfinite(largest):
        raise ArithmeticError("the heat balance is no number with these parameters")
    doublings = max(0, int(np.ceil(np.log2(max(largest, 1e-12) / 0.5))))
    z = z / 2.0**doublings
    identity = np.eye(matrix.shape[-1])
    phi = np.broadcast_to(identity, z.shape).copy()
    for order in range(9, 1, -1):  # Horner: phi_1 = 1 + z/2 (1 + z/3 (1 + ...))
        phi = identity + (z / order) @ phi
    decay = identity + z @ phi
    for _ in range(doublings):
        phi = 0.5 * (decay @ phi + phi)
        decay = decay @ decay
    return decay, phi * steps[:, None, None]
