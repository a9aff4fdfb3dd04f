"""One step of linear heat balances, many gearboxes at once."""

from __future__ import annotations

import numpy as np

from models.base.types import Array

GAMMA = 1.0 - 1.0 / np.sqrt(2.0)


def sdirk_step(*, T: Array, capacity: Array, K: Array, heat: Array, dt: float) -> tuple[Array, Array]:
    r"""Temperatures after a step of :math:`C\,\dot T = q - K T`.

    Two implicit stages, second order, L-stable: nodes far faster than the step settle instead of ringing. As the
    balance is linear over the step, the heat that crosses a path is its conductance times the mean temperatures.

    Parameters
    ----------
    T : Array, shape (B, n)
        [degC]
    capacity : Array, shape (B, n)
        [J/K]
    K : Array, shape (B, n, n)
        Conductances, [W/K]
    heat : Array, shape (B, n)
        [W]
    dt : float
        [s]

    Returns
    -------
    new, mean : Array, shape (B, n)
        After the step, and the mean over it that belongs to the heat balance, [degC]

    References
    ----------
    Alexander, SIAM J. Numer. Anal. 14 (1977), the two-stage method with gamma = 1 - 1/sqrt(2).
    """
    diagonal = np.arange(T.shape[1])
    matrix = GAMMA * dt * K
    matrix[:, diagonal, diagonal] += capacity
    inverse = np.linalg.inv(matrix)
    first = T
    rate = _product(inverse, heat - _product(K, first))
    second = T + (1.0 - GAMMA) * dt * rate
    stage_1 = first + GAMMA * dt * rate
    rate = _product(inverse, heat - _product(K, second))
    new = second + GAMMA * dt * rate
    return new, (1.0 - GAMMA) * stage_1 + GAMMA * new


def _product(matrix: Array, vector: Array) -> Array:
    return np.asarray(np.einsum("bij,bj->bi", matrix, vector))
