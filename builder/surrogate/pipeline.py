"""From physical inputs to scaled targets as a scikit-learn pipeline, and from a fitted one to a plain network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag
from sklearn.base import clone
from sklearn.compose import TransformedTargetRegressor
from sklearn.pipeline import Pipeline
from sklearn.preprocessing import FunctionTransformer, MinMaxScaler, StandardScaler

from builder.surrogate.levenberg_marquardt import LevenbergMarquardtRegressor
from builder.surrogate.networks import NetworkSpec
from models.base.types import Array
from models.portable.surrogate import Feature, Network, feature_matrix

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


def surrogate_pipeline(
    *,
    features: Sequence[tuple[Feature, int]],
    viscosity: tuple[float, float],
    standardised: bool,
    network: LevenbergMarquardtRegressor,
) -> TransformedTargetRegressor:
    """Return an unfitted estimator: features, their scaling, the network, and the scaling of its targets.

    Everything is scaled to zero mean and unit variance if `standardised`, else to [-1, 1].
    """
    scaler = StandardScaler() if standardised else MinMaxScaler(feature_range=(-1.0, 1.0))
    chosen = FunctionTransformer(feature_matrix, kw_args={"features": features, "viscosity": viscosity})
    steps = [("features", chosen), ("scaler", scaler), ("network", network)]
    return TransformedTargetRegressor(Pipeline(steps), transformer=clone(scaler), check_inverse=False)


def plain_network(
    fitted: TransformedTargetRegressor, spec: NetworkSpec, outputs: Sequence[str], powers: Array | None
) -> Network:
    """Return a fitted :func:`surrogate_pipeline` as plain weights, its scalings folded into them.

    Parameters
    ----------
    fitted : estimator
    spec : NetworkSpec
        Name, inputs and bounds
    outputs : sequence of str
    powers : Array, shape (outputs, inputs), or None
        If given, the targets were those of :func:`reduced_target`, which is reversed: a linear part from the features
        to the outputs, and an exponential. Else the targets were the losses

    Returns
    -------
    Network
    """
    features, scaler, net = (step for _, step in fitted.regressor_.steps)
    kinds, viscosity = features.kw_args["features"], features.kw_args["viscosity"]
    slope, offset = _affine(scaler)
    back_slope, back_offset = _affine(fitted.transformer_)
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
        features=tuple(kinds),
        viscosity=tuple(viscosity),
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
