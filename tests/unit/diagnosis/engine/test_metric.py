"""Marginalising model error and deviations between sessions equals the normal density of the readings."""

from types import SimpleNamespace

import numpy as np
import pytest

from diagnosis.engine.gram import Gram
from diagnosis.engine.learnt import deviation_priors
from diagnosis.engine.metric import Metric, leading_directions
from diagnosis.engine.sessions import over_sessions

SESSIONS = ((0, 2), (1,))
ROWS = (30, 24, 18)


@pytest.fixture
def columns():
    rng = np.random.default_rng(3)
    return [rng.standard_normal((rows, 9)) for rows in ROWS]


def covariance(shared, own):
    """Of all rows, pieces one after the other."""
    starts = np.cumsum([0, *ROWS])
    whole = np.eye(starts[-1])
    B = np.concatenate(shared)
    whole += B @ B.T
    for pieces in SESSIONS:
        rows = np.concatenate([np.arange(starts[p], starts[p + 1]) for p in pieces])
        L = np.concatenate([own[p] for p in pieces])
        whole[np.ix_(rows, rows)] += L @ L.T
    return whole


@pytest.mark.parametrize("own_columns", [0, 4])
def test_inner_products_equal_those_of_the_covariance(columns, own_columns):
    first = 4 - own_columns
    shared, own, X = ([W[:, some] for W in columns] for some in (slice(0, 3), slice(first, 4), slice(4, 9)))
    metric = Metric(sessions=SESSIONS, columns=tuple(W[:, :4] for W in columns), shared=3, own=first, deviation=0.3)
    S = covariance(shared, [0.3 * L for L in own])
    everything = np.concatenate(X)
    expected = everything.T @ np.linalg.solve(S, everything)
    np.testing.assert_allclose(metric.products(X), expected, rtol=1e-10)
    assert metric.log_determinant == pytest.approx(np.linalg.slogdet(S)[1], rel=1e-10)
    a, b = metric.against([W[:, 0] for W in X], X)
    np.testing.assert_allclose(a, expected[0], rtol=1e-9)
    np.testing.assert_allclose(b, np.diag(expected), rtol=1e-9)


@pytest.mark.parametrize("s", [0.0, 0.3])
def test_explained_are_the_most_probable_values_and_deviations(columns, s):
    shared, J = [W[:, 1:4] for W in columns], [W[:, 4:6] for W in columns]
    both = [np.column_stack([B, j]) for B, j in zip(shared, J, strict=True)] if s else shared
    own = [s * W[:, :5] if s else np.zeros((len(W), 0)) for W in both]
    metric = Metric(sessions=SESSIONS, columns=tuple(both), shared=3, own=0 if s else 3, deviation=s)
    found = metric.explained([W[:, 0] for W in columns])
    # The same by ridge regression on all columns: shared, then those of both sessions.
    r, count = np.concatenate([W[:, 0] for W in columns]), own[0].shape[1]
    X = np.zeros((len(r), 3 + 2 * count))
    starts = np.cumsum([0, *ROWS])
    for p, session in enumerate((0, 1, 0)):
        rows = slice(starts[p], starts[p + 1])
        X[rows, :3] = shared[p]
        X[rows, 3 + session * count : 3 + (session + 1) * count] = own[p]
    best = np.linalg.solve(np.eye(X.shape[1]) + X.T @ X, X.T @ r)
    for p, session in enumerate((0, 1, 0)):
        expected = np.pad(best[:3], (0, max(count - 3, 0)))  # of J there is no value that sessions share
        if s:
            expected += s * best[3 + session * count : 3 + (session + 1) * count]
        np.testing.assert_allclose(found[p], expected, rtol=1e-9)


def test_leading_directions_keep_what_columns_do():
    rng = np.random.default_rng(1)
    N = rng.standard_normal((60, 4)) @ rng.standard_normal((4, 25))
    kept = N @ leading_directions(N.T @ N)
    assert kept.shape[1] == 4
    np.testing.assert_allclose(kept @ kept.T, N @ N.T, atol=1e-9)


def test_deviations_between_sessions_equal_the_normal_density(columns):
    experiment = SimpleNamespace(
        pieces=[SimpleNamespace(recording=name) for name in "abc"], sessions=SESSIONS, most_deviation=np.inf,
    )  # fmt: skip
    gram = Gram(of_recording={name: W.T @ W for name, W in zip("abc", columns, strict=True)},
                log_determinants=dict.fromkeys("abc", 1.0))  # fmt: skip
    found = over_sessions(gram, experiment, range(3), [3])
    r = np.concatenate([W[:, 0] for W in columns])
    for s, given in zip(found.deviations, found.given, strict=True):
        S = covariance([W[:, 1:5] for W in columns], [s * W[:, 1:4] for W in columns])
        expected = -0.5 * (r @ np.linalg.solve(S, r) + np.linalg.slogdet(S)[1] + 3.0)
        assert given.log_evidence == pytest.approx(expected, rel=1e-10)
    weights = np.log(list(deviation_priors().values())) + [given.log_evidence for given in found.given]
    assert found.log_evidence == pytest.approx(np.logaddexp.reduce(weights))
    assert 0.0 <= found.mean <= 0.4
    experiment.most_deviation = 0.1
    limited = over_sessions(gram, experiment, range(3), [3])
    possible = found.deviations <= 0.1
    prior = np.array(list(deviation_priors().values()))[possible]
    assert np.isneginf(limited.weights[~possible]).all()
    assert limited.weights[possible] == pytest.approx(weights[possible] - np.log(prior.sum()))
    assert limited.mean <= 0.1
