"""Derivatives of laws."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from diagnosis.engine.slopes import _slopes
from models.network.laws import symbol

NAMES = ("x", "y", "z")
x, y, z = (symbol(name) for name in NAMES)
NESTED = sp.Max(x * y, sp.Min(z, x + 1, y**2))


@pytest.mark.parametrize(
    "law",
    [
        sp.Max(x * y, z) ** 2 * sp.exp(-x), NESTED * sp.Min(x, z), sp.sin(NESTED) + x * NESTED,
        sp.Mod(x * y, 2) * z, sp.Max(sp.Mod(x, 2), y), x * y / z,
    ],
)  # fmt: skip
def test_derivatives_are_those_of_differences(law: sp.Expr) -> None:
    rng, step = np.random.default_rng(1), 1e-6
    at = rng.uniform(0.3, 2.9, (3, 200))
    value = sp.lambdify((x, y, z), law, "numpy")
    found = _slopes(law, NAMES, NAMES)(*at)
    for index, slope in enumerate(found):
        move = np.zeros((3, 1))
        move[index] = step
        there, here = (np.array([float(value(*column)) for column in (at + way * move).T]) for way in (1.0, -1.0))
        assert np.allclose(np.broadcast_to(slope, 200), (there - here) / (2.0 * step), rtol=1e-6, atol=1e-6)


def test_an_extreme_is_half_of_each_argument_where_they_are_equal() -> None:
    assert _slopes(sp.Max(x, y), NAMES, ("x", "y", "z"))(1.0, 1.0, 0.0) == (0.5, 0.5, 0)
