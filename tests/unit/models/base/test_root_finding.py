"""The bracketed root finder on whole arrays."""

from __future__ import annotations

import numpy as np
import pytest

from models.base.root_finding import decreasing_root
from models.base.types import Array


def test_many_roots_at_once() -> None:
    target = np.geomspace(1e-3, 1e3, 200)
    x = decreasing_root(lambda x: target - x**3, np.zeros(200), np.full(200, 20.0), f_tol=1e-9)
    assert np.abs(target - x**3).max() <= 1e-9
    assert x == pytest.approx(np.cbrt(target), rel=1e-6)


def test_a_root_does_not_depend_on_its_neighbours() -> None:
    a = np.array([0.3, 2.0, 7.0])

    def solve(values: Array) -> Array:
        return decreasing_root(
            lambda x: np.exp(-x) * values - x, np.zeros_like(values), np.full_like(values, 9.0), f_tol=1e-4
        )

    together = solve(a)
    assert together.tolist() == [float(solve(a[i : i + 1])[0]) for i in range(3)]


def test_roots_at_the_ends_of_the_bracket() -> None:
    x = decreasing_root(lambda x: 1.0 - x, np.array([1.0, 0.0]), np.array([3.0, 1.0]), f_tol=1e-12)
    assert x.tolist() == [1.0, 1.0]


def test_degenerate_bracket() -> None:
    assert decreasing_root(lambda x: 5.0 - x, np.array([5.0]), np.array([5.0]), f_tol=1e-12).tolist() == [5.0]


def test_a_function_that_bends_hard_still_converges() -> None:
    """Plain regula falsi keeps one end here for hundreds of evaluations."""
    calls = 0

    def f(x: Array) -> Array:
        nonlocal calls
        calls += 1
        return 1e-3 - x**15

    decreasing_root(f, np.zeros(1), np.full(1, 2.0), f_tol=1e-8)
    assert calls <= 40


def test_failure_is_reported() -> None:
    with pytest.raises(ArithmeticError, match="1 roots not found"):
        decreasing_root(lambda x: np.where(x < 0.5, 1.0, -1.0), np.zeros(1), np.ones(1), f_tol=0.1, max_iterations=20)
