"""Minimum and maximum of expressions."""

from __future__ import annotations

import pickle

import pytest
import sympy as sp

from models.formulas.extremes import Max, Min
from models.network.laws import compile_function, function_source, trace

x, y = sp.symbols("x y", real=True)
LAW = Min(Max((x - y) / 3, 0), 1) * sp.exp(-Max(x, y, 0.5))


def test_numbers_give_a_number() -> None:
    assert LAW.xreplace({x: sp.Float(2.0), y: sp.Float(1.0)}) == pytest.approx(float(sp.exp(-2.0) / 3))


def test_a_rebuilt_law_stays_of_these_classes() -> None:
    for law in (LAW.xreplace({x: 2 * y}), pickle.loads(pickle.dumps(LAW))):
        assert {type(one) for one in law.atoms(sp.Max, sp.Min)} == {Max, Min}


def test_a_law_with_those_of_sympy_gets_these() -> None:
    given = sp.Min(sp.Max((x - y) / 3, 0), 1) * sp.exp(-sp.Max(x, y, 0.5))
    assert given != LAW
    assert trace(given, ["x", "y"], "law")[0] == LAW


@pytest.mark.parametrize("vector", [True, False])
def test_printed_as_those_of_sympy(vector: bool) -> None:
    source = function_source("law", ["x", "y"], [LAW], vector=vector)
    for at in ((0.2, 3.0), (2.0, 1.0), (9.0, 0.1)):
        assert compile_function(source, "law")(*at)[0] == pytest.approx(
            float(LAW.xreplace(dict(zip((x, y), map(sp.Float, at), strict=True))))
        )
