"""Minimum and maximum of expressions.

Those of sympy look for arguments that can never be the extreme one, each time that an expression with them is rebuilt:
milliseconds for the laws here, where nothing is found. They refuse what has no order, such as conditions; these do not,
so texts are read with those of sympy.
"""

from __future__ import annotations

from typing import Any

import sympy as sp


class Max(sp.Max):  # type: ignore[misc]
    """The largest of some expressions; a number where all of them are numbers.

    Examples
    --------
    >>> Max(sp.Symbol("x"), 3.0), Max(2.0, 3.0)
    (Max(3.0, x), 3.00000000000000)
    """

    def __new__(cls, *args: Any, **_: Any) -> sp.Expr:  # noqa: D102
        return sp.Max(*args) if _are_numbers(args) else super().__new__(cls, *args, evaluate=False)


class Min(sp.Min):  # type: ignore[misc]
    """The smallest of some expressions; a number where all of them are numbers.

    Examples
    --------
    >>> Min(sp.Symbol("x"), 3.0), Min(2.0, 3.0)
    (Min(3.0, x), 2.00000000000000)
    """

    def __new__(cls, *args: Any, **_: Any) -> sp.Expr:  # noqa: D102
        return sp.Min(*args) if _are_numbers(args) else super().__new__(cls, *args, evaluate=False)


def with_these(expression: sp.Basic) -> sp.Basic:
    """An expression with these in place of those of sympy."""
    if not expression.has(sp.Max, sp.Min):
        return expression
    own = {sp.Max: Max, sp.Min: Min}.get(expression.func, expression.func)
    return own(*map(with_these, expression.args))


def _are_numbers(args: tuple[Any, ...]) -> bool:
    return all(sp.sympify(arg).is_Number for arg in args)
