"""A small feed-forward network trained with Levenberg-Marquardt, as a scikit-learn regressor.

Sigmoid hidden layers, linear output. The Jacobian is analytic; each step solves the damped normal equations
``(J^T J + mu I) step = -J^T r`` with Cholesky. A few hundred parameters and a few thousand rows: ``J^T J`` is built in
blocks of rows that stay in the cache, so that one iteration costs milliseconds.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.model_selection import train_test_split
from sklearn.utils.validation import check_array, check_is_fitted, check_X_y
from threadpoolctl import threadpool_limits

from models.base.types import Array

# Rows per block of the Jacobian: 200 parameters x 512 rows are 0.8 MB and stay in the second-level cache. Fixed,
# because the order of summation decides the last bits.
BLOCK_ROWS = 512
DAMPING_START, DAMPING_LOWEST, DAMPING_HIGHEST = 1e-3, 1e-15, 1e10


def _sigmoid(z: Array) -> Array:
    return 0.5 * (1.0 + np.tanh(0.5 * z))


@dataclass(frozen=True)
class LayerShapes:
    """Sizes of the layers, and how the weights lie in one flat parameter vector.

    Every layer is one matrix of shape (inputs + 1, outputs); its last row holds the biases.
    """

    sizes: tuple[int, ...]

    @property
    def count(self) -> int:
        """Number of parameters, [-]."""
        return sum((n_in + 1) * n_out for n_in, n_out in zip(self.sizes, self.sizes[1:], strict=False))

    def unpack(self, parameters: Array) -> list[Array]:
        """Views of the layers' matrices in `parameters`, shape (count,)."""
        layers, start = [], 0
        for n_in, n_out in zip(self.sizes, self.sizes[1:], strict=False):
            stop = start + (n_in + 1) * n_out
            layers.append(parameters[start:stop].reshape(n_in + 1, n_out))
            start = stop
        return layers

    def initial(self, random: np.random.Generator) -> Array:
        """Random start after Nguyen and Widrow [1]_: the units' active regions cover inputs of about [-1, 1].

        References
        ----------
        .. [1] D. Nguyen, B. Widrow, "Improving the learning speed of 2-layer neural networks by choosing initial values
           of the adaptive weights", IJCNN 1990.
        """
        parameters = np.empty(self.count)
        layers = self.unpack(parameters)
        for depth, layer in enumerate(layers):
            n_in, n_out = layer.shape[0] - 1, layer.shape[1]
            weights = random.uniform(-1.0, 1.0, (n_in, n_out))
            if depth == len(layers) - 1:
                layer[:-1], layer[-1] = weights / np.sqrt(n_in), 0.0
                continue
            # 0.7 H^(1/n) is meant for tanh units on [-1, 1]; a sigmoid is half as steep, and its outputs span [0, 1].
            norm = 0.7 * n_out ** (1.0 / n_in) * 2.0
            weights *= norm / np.linalg.norm(weights, axis=0)
            bias = norm * np.linspace(-1.0, 1.0, n_out) * np.where(weights[0] >= 0.0, 1.0, -1.0)
            if depth > 0:
                weights *= 2.0
                bias = bias - 0.5 * weights.sum(axis=0)
            layer[:-1], layer[-1] = weights, bias
        return parameters


def predict_rows(layers: Sequence[Array], rows: Array) -> Array:
    """Outputs of the network, shape (rows, outputs), for `rows` of shape (rows, inputs); layers as in `LayerShapes`."""
    *hidden, last = layers
    for layer in hidden:
        rows = _sigmoid(rows @ layer[:-1] + layer[-1])
    return np.asarray(rows @ last[:-1] + last[-1])


def jacobian_transposed(shapes: LayerShapes, parameters: Array, rows: Array) -> tuple[Array, Array]:
    """Outputs and the transposed Jacobian of the network by back-propagation.

    Parameters
    ----------
    shapes : LayerShapes
        Sizes of the layers
    parameters : Array, shape (P,)
        Weights and biases
    rows : Array, shape (N, inputs)
        Scaled inputs

    Returns
    -------
    (outputs, jacobian) : Array, shape (outputs, N), and Array, shape (P, outputs, N)
        Network outputs and their derivatives with respect to every parameter
    """
    layers = shapes.unpack(parameters)
    n_outputs, n_rows = shapes.sizes[-1], len(rows)
    ones = np.ones((1, n_rows))
    activations = [np.vstack([rows.T, ones])]
    for layer in layers[:-1]:
        activations.append(np.vstack([_sigmoid(layer.T @ activations[-1]), ones]))
    outputs = layers[-1].T @ activations[-1]

    jacobian = np.zeros((shapes.count, n_outputs, n_rows))
    stop = shapes.count
    # derivative of the outputs with respect to the sums that enter this layer, (units of this layer, outputs, N)
    sensitivity = np.eye(n_outputs)[:, :, None]
    for depth in range(len(layers) - 1, -1, -1):
        n_in, n_out = layers[depth].shape[0] - 1, layers[depth].shape[1]
        start = stop - (n_in + 1) * n_out
        block = jacobian[start:stop].reshape(n_in + 1, n_out, n_outputs, n_rows)
        np.multiply(activations[depth][:, None, None, :], sensitivity[None], out=block)
        if depth > 0:
            unit = activations[depth][:-1]
            back = np.tensordot(layers[depth][:-1], np.broadcast_to(sensitivity, (n_out, n_outputs, n_rows)), axes=1)
            sensitivity = back * (unit * (1.0 - unit))[:, None, :]
        stop = start
    return outputs, jacobian


def _normal_equations(
    shapes: LayerShapes, parameters: Array, rows: Array, targets: Array, pool: ThreadPoolExecutor
) -> tuple[Array, Array]:
    """J^T J, shape (P, P), and J^T r, shape (P,), for r = outputs - targets.

    Blocks of rows are spread over threads and summed in their own order: the same bits however many threads there are.
    """

    def block(start: int) -> tuple[Array, Array]:
        outputs, jacobian = jacobian_transposed(shapes, parameters, rows[start : start + BLOCK_ROWS])
        residual = (outputs - targets[start : start + BLOCK_ROWS].T).ravel()
        flat = jacobian.reshape(shapes.count, -1)
        return flat @ flat.T, flat @ residual  # numpy recognises the product as symmetric, and releases the lock

    hessian, gradient = np.zeros((shapes.count, shapes.count)), np.zeros(shapes.count)
    for hessian_part, gradient_part in pool.map(block, range(0, len(rows), BLOCK_ROWS)):
        hessian += hessian_part
        gradient += gradient_part
    return hessian, gradient


def minimise(
    shapes: LayerShapes, parameters: Array, rows: Array, targets: Array, pool: ThreadPoolExecutor
) -> Iterator[tuple[Array, float]]:
    """Levenberg-Marquardt with Nielsen's damping [1]_: yields parameters and mean square residual after each step.

    Ends where no step improves them.

    References
    ----------
    .. [1] K. Madsen, H. B. Nielsen, O. Tingleff, "Methods for non-linear least squares problems", 2nd ed., DTU 2004.
    """

    def square(candidate: Array) -> float:
        return float(np.mean((predict_rows(shapes.unpack(candidate), rows) - targets) ** 2))

    damping, growth = DAMPING_START, 2.0
    loss = square(parameters)
    while True:
        hessian, gradient = _normal_equations(shapes, parameters, rows, targets, pool)
        hessian /= targets.size
        gradient /= targets.size
        diagonal = hessian.diagonal().copy()
        while True:
            try:
                np.fill_diagonal(hessian, diagonal + damping)
                step = -cho_solve(cho_factor(hessian, check_finite=False), gradient, check_finite=False)
                candidate_loss = square(parameters + step)
            except LinAlgError:
                candidate_loss = np.inf
            if candidate_loss < loss:
                break
            damping *= growth
            growth *= 2.0
            if damping > DAMPING_HIGHEST:
                return
        predicted = float(step @ (damping * step - gradient))
        gain = (loss - candidate_loss) / max(predicted, np.finfo(float).tiny)
        damping = max(damping * max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3), DAMPING_LOWEST)
        growth = 2.0
        parameters, loss = parameters + step, candidate_loss
        yield parameters, loss


class LevenbergMarquardtRegressor(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """Feed-forward network with sigmoid hidden layers, trained full-batch with Levenberg-Marquardt.

    Parameters
    ----------
    hidden_layer_sizes : sequence of int
        Units of each hidden layer
    max_iter : int
        Accepted steps at most ("epochs": every step sees all rows)
    starts, start_iterations : int
        Random starts, and steps of each before only the best one goes on
    validation_fraction : float
        Share of the rows that is held back and decides which step's weights are kept, [-]; 0 keeps the last
    patience : int
        Steps without a better validation error after which training stops
    tolerance : float
        Training also stops where `patience` steps improve the validation error by less than this fraction, [-]
    random_state : int
        Seed of the starts and of the split

    Attributes
    ----------
    coefs_, intercepts_ : list of Array
        Weights, shape (inputs, units), and biases, shape (units,), of each layer
    n_iter_ : int
        Steps of the start that won
    loss_curve_, validation_curve_ : list of float
        Mean square errors after each of its steps

    Examples
    --------
    >>> import numpy as np
    >>> x = np.linspace(-1.0, 1.0, 200)[:, None]
    >>> net = LevenbergMarquardtRegressor(hidden_layer_sizes=(5, 5), random_state=1).fit(x, np.sin(3.0 * x[:, 0]))
    >>> bool(np.abs(net.predict(x) - np.sin(3.0 * x[:, 0])).max() < 1e-4)
    True
    """

    def __init__(
        self,
        hidden_layer_sizes: Sequence[int] = (10, 10),
        *,
        max_iter: int = 300,
        starts: int = 3,
        start_iterations: int = 30,
        validation_fraction: float = 0.1,
        patience: int = 50,
        tolerance: float = 1e-3,
        random_state: int = 0,
    ) -> None:
        self.hidden_layer_sizes = hidden_layer_sizes
        self.max_iter = max_iter
        self.starts = starts
        self.start_iterations = start_iterations
        self.validation_fraction = validation_fraction
        self.patience = patience
        self.tolerance = tolerance
        self.random_state = random_state

    def fit(self, X: Any, y: Any) -> Self:
        """Train on `X`, shape (N, inputs), and `y`, shape (N,) or (N, outputs), both scaled to the order of 1."""
        X, y = check_X_y(X, y, dtype=np.float64, multi_output=True, y_numeric=True)
        y = np.asarray(y, dtype=np.float64)
        self.n_features_in_ = X.shape[1]
        self.single_output_ = y.ndim == 1
        targets = y.reshape(len(y), -1)
        split = (X, X, targets, targets)
        if self.validation_fraction > 0.0:
            split = train_test_split(X, targets, test_size=self.validation_fraction, random_state=self.random_state)
        shapes = LayerShapes((X.shape[1], *self.hidden_layer_sizes, targets.shape[1]))
        # One thread of BLAS: the same sums in the same order whoever runs this, alone or with other networks.
        with threadpool_limits(1), ThreadPoolExecutor(os.cpu_count()) as pool:
            runs = [_Run(shapes, self.random_state, start, split, pool) for start in range(max(self.starts, 1))]
            if len(runs) > 1:
                for run in runs:
                    run.advance(min(self.start_iterations, self.max_iter), self.patience, self.tolerance)
            best = min(runs, key=lambda run: run.best_error)
            best.advance(self.max_iter, self.patience, self.tolerance)
        layers = shapes.unpack(best.best)
        self.coefs_ = [layer[:-1].copy() for layer in layers]
        self.intercepts_ = [layer[-1].copy() for layer in layers]
        self.loss_curve_, self.validation_curve_ = best.losses, best.errors
        self.n_iter_ = len(best.losses)
        return self

    def predict(self, X: Any) -> Array:
        """Outputs, shape (N,) or (N, outputs) as the targets were, for `X` of shape (N, inputs)."""
        check_is_fitted(self, "coefs_")
        X = check_array(X, dtype=np.float64)
        if X.shape[1] != self.n_features_in_:
            raise ValueError(f"X has {X.shape[1]} columns, but the network was fitted on {self.n_features_in_}")
        outputs = predict_rows([np.vstack(layer) for layer in zip(self.coefs_, self.intercepts_, strict=True)], X)
        return outputs[:, 0] if self.single_output_ else outputs


class _Run:
    """One start: its steps so far, and the weights that were best on the validation rows."""

    def __init__(
        self, shapes: LayerShapes, seed: int, start: int, split: Sequence[Array], pool: ThreadPoolExecutor
    ) -> None:
        rows, self._held_rows, targets, self._held_targets = split
        self._shapes = shapes
        self.best = shapes.initial(np.random.default_rng([seed, start]))
        self._steps = minimise(shapes, self.best, rows, targets, pool)
        self.best_error = np.inf
        self.losses: list[float] = []
        self.errors: list[float] = []
        self._mark, self._marked_at = np.inf, 0

    def advance(self, max_iter: int, patience: int, tolerance: float) -> None:
        """Step on until `max_iter` steps are done in all, or validation stops it."""
        while len(self.losses) < max_iter and len(self.losses) - self._marked_at < patience:
            step = next(self._steps, None)
            if step is None:
                return
            parameters, loss = step
            outputs = predict_rows(self._shapes.unpack(parameters), self._held_rows)
            error = float(np.mean((outputs - self._held_targets) ** 2))
            self.losses.append(loss)
            self.errors.append(error)
            if error < self.best_error:
                self.best, self.best_error = parameters, error
            if error < self._mark * (1.0 - tolerance):
                self._mark, self._marked_at = error, len(self.losses)
