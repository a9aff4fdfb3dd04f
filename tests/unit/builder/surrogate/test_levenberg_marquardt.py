"""The network's Jacobian, its training, and that nothing depends on chance or threads."""

from __future__ import annotations

import itertools
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.base import clone
from threadpoolctl import threadpool_limits

from builder.surrogate.levenberg_marquardt import (
    BLOCK_ROWS,
    LayerShapes,
    LevenbergMarquardtRegressor,
    _normal_equations,
    jacobian_transposed,
    minimise,
    predict_rows,
)


@settings(max_examples=20, deadline=None)
@given(
    inputs=st.integers(1, 4),
    hidden=st.lists(st.integers(1, 5), min_size=1, max_size=3),
    outputs=st.integers(1, 3),
    seed=st.integers(0, 1000),
)
def test_jacobian_is_the_derivative_of_the_outputs(inputs, hidden, outputs, seed):
    random = np.random.default_rng(seed)
    shapes = LayerShapes((inputs, *hidden, outputs))
    parameters = random.normal(size=shapes.count)
    rows = random.uniform(-1.0, 1.0, (7, inputs))
    step = 1e-6

    def outputs_at(point):
        return predict_rows(shapes.unpack(point), rows)

    central = [
        (outputs_at(parameters + step * e) - outputs_at(parameters - step * e)).T / (2.0 * step)
        for e in np.eye(shapes.count)
    ]
    values, jacobian = jacobian_transposed(shapes, parameters, rows)
    np.testing.assert_allclose(values, outputs_at(parameters).T, rtol=1e-13, atol=1e-13)
    # central differences: truncation 1e-12, cancellation 1e-16 / 1e-6
    np.testing.assert_allclose(jacobian, central, rtol=0.0, atol=1e-8)


def test_normal_equations_over_several_blocks():
    random = np.random.default_rng(0)
    shapes = LayerShapes((3, 4, 4, 2))
    parameters = shapes.initial(random)
    rows = random.uniform(-1.0, 1.0, (2 * BLOCK_ROWS + 17, 3))
    targets = random.normal(size=(len(rows), 2))
    with ThreadPoolExecutor(2) as pool:
        hessian, gradient = _normal_equations(shapes, parameters, rows, targets, pool)
    values, jacobian = jacobian_transposed(shapes, parameters, rows)
    flat = jacobian.reshape(shapes.count, -1)
    np.testing.assert_allclose(hessian, flat @ flat.T, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(gradient, flat @ (values - targets.T).ravel(), rtol=1e-10, atol=1e-10)


def test_every_step_lowers_the_loss_and_a_known_network_is_recovered():
    random = np.random.default_rng(3)
    shapes = LayerShapes((2, 3, 2, 1))
    rows = random.uniform(-1.0, 1.0, (300, 2))
    teacher = random.normal(size=shapes.count) * 2.0
    targets = predict_rows(shapes.unpack(teacher), rows)
    near = teacher + 0.05 * random.normal(size=shapes.count)
    with ThreadPoolExecutor(1) as pool:
        steps = minimise(shapes, near, rows, targets, pool)
        losses = [loss for _, (_, loss) in zip(range(200), steps, strict=False)]
    assert all(after < before for before, after in itertools.pairwise(losses))
    assert losses[-1] < 1e-20


def test_rosenbrock_valley_is_learnt_on_unseen_points():
    random = np.random.default_rng(0)
    x, unseen = random.uniform(-1.5, 1.5, (600, 2)), random.uniform(-1.5, 1.5, (200, 2))

    def valley(p):
        return np.log1p((1.0 - p[:, 0]) ** 2 + 100.0 * (p[:, 1] - p[:, 0] ** 2) ** 2)

    network = LevenbergMarquardtRegressor((10, 10), max_iter=200, starts=2).fit(x, valley(x))
    assert network.score(unseen, valley(unseen)) > 0.999


def test_same_bits_whatever_the_number_of_threads():
    random = np.random.default_rng(0)
    x = random.uniform(-1.0, 1.0, (3000, 3))  # large enough for BLAS to share the work out
    y = np.stack([np.sin(x @ [1.0, 2.0, 3.0]), np.exp(x[:, 0])], axis=1)
    weights = []
    for threads in (1, 2):
        with threadpool_limits(threads):
            network = LevenbergMarquardtRegressor((20, 10), max_iter=5, starts=2, start_iterations=2).fit(x, y)
        weights.append(np.concatenate([w.ravel() for w in (*network.coefs_, *network.intercepts_)]))
    assert np.array_equal(*weights)


def test_the_weights_with_the_least_validation_error_are_kept():
    random = np.random.default_rng(0)
    x = random.uniform(-1.0, 1.0, (60, 2))
    noisy = x[:, 0] + 0.5 * random.normal(size=60)
    network = LevenbergMarquardtRegressor(
        (8, 8), max_iter=100, starts=1, validation_fraction=0.3, patience=10, tolerance=0.0
    ).fit(x, noisy)
    best = int(np.argmin(network.validation_curve_))
    assert network.n_iter_ == best + 11 < 100  # patience after the best
    short = clone(network).set_params(max_iter=best + 1).fit(x, noisy)
    assert np.array_equal(short.predict(x), network.predict(x))


def test_shape_of_predictions_follows_the_targets():
    x = np.linspace(-1.0, 1.0, 40)[:, None]
    single = LevenbergMarquardtRegressor((3, 3), max_iter=5, starts=1).fit(x, x[:, 0])
    double = LevenbergMarquardtRegressor((3, 3), max_iter=5, starts=1).fit(x, np.hstack([x, x**2]))
    assert single.predict(x).shape == (40,)
    assert double.predict(x).shape == (40, 2)
    with pytest.raises(ValueError, match="2 columns"):
        single.predict(np.zeros((3, 2)))
