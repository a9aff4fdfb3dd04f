"""Laws: tracing callables, code for arrays and for plain numbers, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp

from models.base.errors import InputError
from models.network.laws import Signals, compile_function, function_source, symbol, trace

NAMES = ["speed", "T_oil", "k"]
x, y = symbol("x"), symbol("y")


def test_expression_callable_and_number_are_the_same_law() -> None:
    for law in (lambda s: 2.0 * s.k, 2.0 * symbol("k"), 2.0 * sp.Symbol("k")):
        expression, numeric = trace(law, NAMES, "law")
        assert expression == 2.0 * symbol("k")
        assert numeric is None
    assert trace(3, NAMES, "law")[0] == 3


@pytest.mark.parametrize(
    "law",
    [
        lambda s: np.exp(s.speed),
        lambda s: 5.0 if s.speed > 10.0 else 1.0,
        lambda s: max(s.speed, 1.0),
        lambda s: math.sqrt(s.T_oil),
        lambda s: float(s.k),
        lambda s: 1.0 if s.k else 0.0,  # does not fail on symbols: they count as true
    ],
    ids=["numpy", "branch", "max", "math", "float", "truth value"],
)
def test_what_cannot_be_traced_is_kept_as_a_number(law: Callable[[Signals], Any]) -> None:
    expression, numeric = trace(law, NAMES, "law")
    assert expression == symbol("law")
    assert numeric is not None
    assert numeric.function is law


@pytest.mark.parametrize(
    ("law", "says"),
    [
        (lambda s: s.sped, "'sped' is not a signal of this network; did you mean 'speed'"),
        (lambda s: s["T_oli"], "did you mean 'T_oil'"),
        (lambda s: 1.0 if s.speed > s.T_oill else 0.0, "did you mean 'T_oil'"),
        (sp.Symbol("q") + 1, "uses 'q', not a signal of this network"),
        (sp.sqrt(-1) * symbol("k"), "not a real finite expression"),
        (sp.oo, "not a real finite expression"),
        (lambda s: sp.Piecewise((1.0, s.speed > 1.0)), "Piecewise without a last case"),
        (lambda s: np.array([1.0, 2.0]) * float(s.k), r"gives an array of shape \(2,\)"),
        (lambda s: open(s), "fails both on symbols and on numbers"),  # noqa: PTH123, SIM115
    ],
)
def test_refused_laws(law: Any, says: str) -> None:
    with pytest.raises(InputError, match=says):
        trace(law, NAMES, "law")


def test_signals_list_themselves() -> None:
    signals = Signals({"b": 1.0, "a": 2.0})
    assert dir(signals) == ["a", "b"]
    assert not hasattr(signals, "__array__")


EXPRESSIONS = [
    sp.Max(x, y, 0.5),
    sp.Min(x, y),
    sp.Abs(x) ** 0.3 + sp.exp(-y),
    sp.sqrt(x**2 + 1.0),
    sp.Piecewise((x, x > y), (2.0 * y, x > 0.2), (sp.Float(7.0), True)),
    sp.Piecewise((sp.Float(1.0), sp.And(x > 0.0, y > 0.0)), (sp.Float(2.0), sp.Or(x > 1.0, y < -1.0)), (y, True)),
]


@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_array_code_number_code_and_sympy_agree(expression: sp.Expr) -> None:
    vector = compile_function(function_source("f", ["x", "y"], [expression], vector=True), "f")
    plain = compile_function(function_source("f", ["x", "y"], [expression], vector=False), "f")
    xs, ys = np.array([-2.0, 0.1, 0.3, 1.5]), np.array([[-1.5], [0.0], [0.4]])
    values = np.broadcast_to(vector(xs, ys)[0], (3, 4))
    for i, b in enumerate(ys[:, 0]):
        for j, a in enumerate(xs):
            exact = float(expression.subs({x: float(a), y: float(b)}))
            assert values[i, j] == pytest.approx(exact, rel=1e-14)
            assert plain(float(a), float(b))[0] == pytest.approx(exact, rel=1e-14)


def test_functions_of_nothing_give_an_empty_tuple() -> None:
    assert compile_function(function_source("f", ["x"], [], vector=False), "f")(1.0) == ()


def test_a_remainder_keeps_its_parentheses() -> None:
    """sympy prints 2*Mod(x, y) without them, as plain Python code."""
    law = 2.0 * sp.Mod(symbol("x") + 3.0, symbol("y")) / symbol("y")
    for vector in (False, True):
        source = function_source("law", ["x", "y"], [law], vector=vector)
        assert float(compile_function(source, "law")(8.5, 4.0)[0]) == pytest.approx(2.0 * (11.5 % 4.0) / 4.0)
        assert float(compile_function(source, "law")(-8.5, 4.0)[0]) == pytest.approx(2.0 * (-5.5 % 4.0) / 4.0)
