"""From physical inputs to losses as one scikit-learn estimator, and from a fitted one to a plain network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Self

import numpy as np
from scipy.linalg import block_diag
from sklearn.base import BaseEstimator, RegressorMixin, TransformerMixin, clone
from sklearn.compose import TransformedTargetRegressor
from sklearn.pipeline import Pipeline
from sklearn.preprocessing import MinMaxScaler, StandardScaler
from sklearn.utils.validation import check_is_fitted

from builder.levenberg_marquardt import LevenbergMarquardtRegressor
from models.surrogate import Feature, Network, feature_values
from models.types import Array

# Where a reduced loss vanishes (a dry gear does not churn) its logarithm is held this far below the largest one.
LOWEST_FRACTION = 1e-6
LOWEST = 1e-30


class PhysicalFeatures(TransformerMixin, BaseEstimator):  # type: ignore[misc]
    """Features of physical inputs: logarithms of speeds and loads, viscosity of the oil at temperatures.

    Parameters
    ----------
    features : sequence of (Feature, int)
        Kind and input column of every feature, see :func:`models.surrogate.feature_values`
    viscosity : (float, float)
        ASTM D341 constants m, n of the oil
    """

    def __init__(self, features: Sequence[tuple[Feature, int]], viscosity: tuple[float, float]) -> None:
        self.features = features
        self.viscosity = viscosity

    def fit(self, X: Any, y: Any = None) -> Self:  # noqa: ARG002  (scikit-learn's signature)
        """Nothing to learn."""
        return self

    def transform(self, X: Any) -> Array:
        """Features, shape (N, features), of inputs, shape (N, inputs)."""
        x = np.asarray(X, dtype=float)
        return np.stack([feature_values(kind, x[:, column], self.viscosity) for kind, column in self.features], axis=-1)

    def __sklearn_is_fitted__(self) -> bool:
        """Tell scikit-learn that this step is always ready."""
        return True


class ReducedTargetRegressor(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """Fits the logarithm of reduced losses, ``ln(P / prod(x_i ** power_i))``, by another regressor.

    Reduced so (sliding by speed and torque, the others by a power of speed), losses stay bounded as speed and torque go
    to zero, and a square error is a relative one.

    Parameters
    ----------
    regressor : estimator
    powers : Array, shape (outputs, inputs)
        Exponents of the inputs; not zero only for positive inputs
    """

    def __init__(self, regressor: Any, powers: Sequence[Sequence[float]]) -> None:
        self.regressor = regressor
        self.powers = powers

    def fit(self, X: Any, y: Any) -> Self:
        """Train on inputs, shape (N, inputs), and losses, shape (N, outputs)."""
        reduced = np.asarray(y, dtype=float) / np.exp(self._log_reference(X))
        floor = np.maximum(LOWEST_FRACTION * reduced.max(axis=0), LOWEST)
        self.regressor_ = clone(self.regressor).fit(X, np.log(np.maximum(reduced, floor)))
        return self

    def predict(self, X: Any) -> Array:
        """Losses, shape (N, outputs)."""
        check_is_fitted(self, "regressor_")
        return np.asarray(np.exp(self.regressor_.predict(X) + self._log_reference(X)))

    def _log_reference(self, X: Any) -> Array:
        powers = np.asarray(self.powers, dtype=float)
        used = np.flatnonzero(powers.any(axis=0))
        return np.asarray(np.log(np.asarray(X, dtype=float)[:, used]) @ powers[:, used].T)


def surrogate_pipeline(
    *,
    features: Sequence[tuple[Feature, int]],
    viscosity: tuple[float, float],
    powers: Sequence[Sequence[float]] | None,
    network: LevenbergMarquardtRegressor,
) -> Any:
    """Return the unfitted estimator of one network: features, scaling, network, scaled (and reduced) losses.

    With `powers` the logarithms of reduced losses are fitted and everything is scaled to zero mean and unit variance;
    without, the losses themselves, everything scaled to [-1, 1].
    """
    scaler = MinMaxScaler(feature_range=(-1.0, 1.0)) if powers is None else StandardScaler()
    steps = [("features", PhysicalFeatures(features, viscosity)), ("scaler", scaler), ("network", network)]
    scaled = TransformedTargetRegressor(Pipeline(steps), transformer=clone(scaler), check_inverse=False)
    return scaled if powers is None else ReducedTargetRegressor(scaled, powers)


def plain_network(
    fitted: Any,
    *,
    name: str,
    inputs: Sequence[str],
    outputs: Sequence[str],
    lower: Sequence[float],
    upper: Sequence[float],
) -> Network:
    """Return a fitted :func:`surrogate_pipeline` as plain weights, its scalings folded into them.

    Parameters
    ----------
    fitted : estimator
    name, inputs, outputs, lower, upper
        As in :class:`models.surrogate.Network`

    Returns
    -------
    Network
        Equal to ``fitted.predict`` within the bounds, to rounding
    """
    reduced = isinstance(fitted, ReducedTargetRegressor)
    scaled = fitted.regressor_ if reduced else fitted
    features, scaler, net = (step for _, step in scaled.regressor_.steps)
    slope, offset = _affine(scaler)
    back_slope, back_offset = _affine(scaled.transformer_)
    w_1, w_2, w_3 = net.coefs_
    b_1, b_2, b_3 = net.intercepts_
    passed = np.zeros((len(features.features), len(outputs)))
    if reduced:
        for row, (kind, column) in enumerate(features.features):
            if kind == "log":
                passed[row] = np.asarray(fitted.powers)[:, column]
    return Network(
        name=name,
        inputs=tuple(inputs),
        outputs=tuple(outputs),
        lower=tuple(map(float, lower)),
        upper=tuple(map(float, upper)),
        features=tuple(features.features),
        viscosity=tuple(features.viscosity),
        weights=(slope[:, None] * w_1, w_2, w_3 / back_slope),
        biases=(b_1 + offset @ w_1, b_2, (b_3 - back_offset) / back_slope),
        passed=passed,
        log_output=reduced,
    )


def fitted_network(fitted: Any) -> LevenbergMarquardtRegressor:
    """Return the network inside a fitted :func:`surrogate_pipeline`."""
    scaled = fitted.regressor_ if isinstance(fitted, ReducedTargetRegressor) else fitted
    network: LevenbergMarquardtRegressor = scaled.regressor_.named_steps["network"]
    return network


def side_by_side(networks: Sequence[Network]) -> Network:
    """Return networks of the same inputs and features as one: their hidden units and outputs side by side."""
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
