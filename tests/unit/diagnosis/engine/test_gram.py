"""The Gram matrix: every evidence against the normal density of the readings themselves."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from diagnosis.engine.gram import Gram, strengths
from models.base.types import Array

ROWS, UNKNOWNS, FURTHER, CANDIDATES = {"a": 30, "b": 12}, 4, 3, 5


@pytest.fixture
def columns() -> dict[str, Array]:
    """Residual, unknowns, further unknowns and candidates of two recordings."""
    rng = np.random.default_rng(1)
    return {name: rng.standard_normal((rows, 1 + UNKNOWNS + FURTHER + CANDIDATES)) * [2.0, *(0.7,) * 12]
            for name, rows in ROWS.items()}  # fmt: skip


@pytest.fixture
def gram(columns: dict[str, Array]) -> Gram:
    return Gram(of_recording={n: W.T @ W for n, W in columns.items()},
                log_determinants={"a": 3.0, "b": -1.0})  # fmt: skip


def log_density(W: Array, which: list[int], sd: Array | float = 1.0) -> float:
    """Of the residual, up to what all have in common."""
    X = W[:, 1 + np.array(which, dtype=int)] * sd
    covariance = np.eye(len(W)) + X @ X.T
    return float(multivariate_normal(cov=covariance).logpdf(W[:, 0])) + 0.5 * len(W) * np.log(2.0 * np.pi)


def test_combinations_take_the_place_of_columns(gram: Gram, columns: dict[str, Array]) -> None:
    directions = np.random.default_rng(2).standard_normal((FURTHER, 2))
    found = gram.combined(range(UNKNOWNS, UNKNOWNS + FURTHER), directions)
    for name, W in columns.items():
        first, last = 1 + UNKNOWNS, 1 + UNKNOWNS + FURTHER
        combined = np.column_stack([W[:, :first], W[:, first:last] @ directions, W[:, last:]])
        np.testing.assert_allclose(found.of_recording[name], combined.T @ combined, atol=1e-12)
    assert found.count == gram.count - 1 and found.log_determinants == gram.log_determinants


def test_evidence_is_the_normal_density(gram: Gram, columns: dict[str, Array]) -> None:
    both, sd = np.concatenate(list(columns.values())), np.array([0.5, 2.0, 1.0, 0.3])
    given = gram.given(range(4), sd)
    assert given.log_evidence == pytest.approx(log_density(both, [0, 1, 2, 3], sd) - 0.5 * (3.0 - 1.0), abs=1e-9)
    # In steps as at once; what has no amplitude is absent; some recordings alone.
    stepwise = gram.given([0, 2], sd[[0, 2]]).given([3, 1, 5], [0.3, 2.0, 0.0])
    assert stepwise.log_evidence == pytest.approx(given.log_evidence, abs=1e-9)
    alone = gram.given(range(4), sd, recordings=["b"])
    assert alone.log_evidence == pytest.approx(log_density(columns["b"], [0, 1, 2, 3], sd) + 0.5, abs=1e-9)


def test_singles_are_ratios_of_densities(gram: Gram, columns: dict[str, Array]) -> None:
    both, base, sd = np.concatenate(list(columns.values())), [0, 1, 2, 3], np.array([0.4, 3.0, 1.0, 0.2, 0.9])
    given, nothing = gram.given(base), log_density(both, base)
    at = 8 + np.arange(5)  # the residual is first
    for k, found in enumerate(strengths(given.matrix[0, at], given.matrix[at, at], sd).log_bayes):
        own = np.array([1.0] * 4 + [sd[k]])
        assert found == pytest.approx(log_density(both, [*base, 7 + k], own) - nothing, abs=1e-9)


@pytest.mark.parametrize("sign", [-1, 0, 1])
def test_a_single_is_the_integral_over_the_strength(sign: int) -> None:
    rng = np.random.default_rng(2)
    x, residual, sd = rng.normal(size=30), rng.normal(size=30) + 0.4, 0.7
    found = strengths(np.array([x @ residual]), np.array([x @ x]), sd, sign)
    s = np.linspace(-8.0 * sd, 8.0 * sd, 400_001)
    prior = np.exp(-0.5 * (s / sd) ** 2) / (sd * np.sqrt(2.0 * np.pi))
    if sign:
        prior = np.where(sign * s > 0.0, 2.0 * prior, 0.0)
    ratio = np.exp(s * (x @ residual) - 0.5 * s**2 * (x @ x))
    assert found.log_bayes[0] == pytest.approx(np.log(np.trapezoid(prior * ratio, s)), abs=1e-3)


def test_most_probable_values(gram: Gram, columns: dict[str, Array]) -> None:
    both, sd = np.concatenate(list(columns.values())), np.array([0.5, 2.0, 1.0, 0.3])
    X = both[:, 1:5]
    ridge = np.linalg.solve(X.T @ X + np.diag(sd**-2.0), X.T @ both[:, 0])
    np.testing.assert_allclose(gram.given([]).most_probable(range(4), sd), ridge, atol=1e-10)
