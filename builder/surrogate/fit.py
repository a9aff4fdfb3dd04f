"""Fitting of one network: from physical inputs to scaled targets, and back to a network of plain weights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag
from sklearn.base import clone
from sklearn.preprocessing import MinMaxScaler, StandardScaler

from builder.surrogate.levenberg_marquardt import LevenbergMarquardtRegressor
from builder.surrogate.networks import NetworkSpec
from models.base.types import Array
from models.portable.surrogate import Network, feature_matrix

# If a reduced loss vanishes (a dry gear does not churn) its logarithm is held this far below the largest one.
LOWEST_FRACTION = 1e-6
LOWEST = 1e-30


def reduced_target(x: Array, losses: Array, powers: Array) -> Array:
    """Logarithm of reduced losses, ``ln(P / prod(x_i ** power_i))``.

    Reduced so (sliding by speed and torque, the others by a power of speed), losses stay bounded as speed and torque go
    to zero, and a square error is a relative one.

    Parameters
    ----------
    x : Array, shape (N, inputs)
    losses : Array, shape (N, outputs)
        [W]
    powers : Array, shape (outputs, inputs)
        Exponents of the inputs; not zero only for positive inputs

    Returns
    -------
    Array, shape (N, outputs)
    """
    used = np.flatnonzero(powers.any(axis=0))
    reduced = losses / np.exp(np.log(x[:, used]) @ powers[:, used].T)
    floor = np.maximum(LOWEST_FRACTION * reduced.max(axis=0), LOWEST)
    return np.asarray(np.log(np.maximum(reduced, floor)))


def fit_network(
    regressor: LevenbergMarquardtRegressor,
    x: Array,
    losses: Array,
    *,
    spec: NetworkSpec,
    outputs: Sequence[str],
    powers: Array | None,
    viscosity: tuple[float, float],
) -> Network:
    """Fit a network to losses, and return it as plain weights with all scalings folded into them.

    Parameters
    ----------
    regressor : LevenbergMarquardtRegressor
        Not fitted yet
    x : Array, shape (N, inputs)
    losses : Array, shape (N, outputs)
        [W]
    spec : NetworkSpec
        Name, inputs, features and bounds
    outputs : sequence of str
    powers : Array, shape (outputs, inputs), or None
        If given, the targets are those of :func:`reduced_target`, which is reversed: a linear part from the features to
        the outputs, and an exponential; all is scaled to zero mean and unit variance. Else the targets are the losses,
        and all is scaled to [-1, 1]
    viscosity : (float, float)
        Constants of the oil

    Returns
    -------
    Network
    """
    kinds = spec.features(transforms=powers is not None)
    scaler = MinMaxScaler(feature_range=(-1.0, 1.0)) if powers is None else StandardScaler()
    back = clone(scaler)
    rows = scaler.fit_transform(feature_matrix(x, features=kinds, viscosity=viscosity))
    net = regressor.fit(rows, back.fit_transform(losses if powers is None else reduced_target(x, losses, powers)))
    slope, offset = _affine(scaler)
    back_slope, back_offset = _affine(back)
    w_1, w_2, w_3 = net.coefs_
    b_1, b_2, b_3 = net.intercepts_
    passed = np.zeros((len(kinds), len(outputs)))
    if powers is not None:
        for row, (kind, column) in enumerate(kinds):
            if kind == "log":
                passed[row] = powers[:, column]
    return Network(
        name=spec.name,
        inputs=spec.inputs,
        outputs=tuple(outputs),
        lower=tuple(map(float, spec.lower)),
        upper=tuple(map(float, spec.upper)),
        features=kinds,
        viscosity=viscosity,
        weights=(slope[:, None] * w_1, w_2, w_3 / back_slope),
        biases=(b_1 + offset @ w_1, b_2, (b_3 - back_offset) / back_slope),
        passed=passed,
        log_output=powers is not None,
    )


def joined_network(networks: Sequence[Network]) -> Network:
    """Return networks of equal inputs and features as one that has all their hidden units and outputs."""
    first = networks[0]
    if len(networks) == 1:
        return first
    depths = [list(layers) for layers in zip(*(network.weights for network in networks), strict=True)]
    b_1, b_2, b_3 = (np.concatenate(parts) for parts in zip(*(network.biases for network in networks), strict=True))
    return replace(
        first,
        outputs=tuple(name for network in networks for name in network.outputs),
        weights=(np.hstack(depths[0]), block_diag(*depths[1]), block_diag(*depths[2])),
        biases=(b_1, b_2, b_3),
        passed=np.hstack([network.passed for network in networks]),
    )


def _affine(scaler: StandardScaler | MinMaxScaler) -> tuple[Array, Array]:
    """Slope and offset of a scaler, each shape (columns,)."""
    if isinstance(scaler, StandardScaler):
        return 1.0 / scaler.scale_, -scaler.mean_ / scaler.scale_
    return scaler.scale_, scaler.min_
