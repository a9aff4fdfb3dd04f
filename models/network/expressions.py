"""Laws as text: written so that every number survives, and read without running anything of the file.

The text is what Python and sympy print: ``+ - * / **``, comparisons, ``&``, ``|``, ``~``, and the functions of
:data:`FUNCTIONS`. It is parsed into a tree and the tree is walked; nothing is ever evaluated as code.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Annotated, Any, TypeAlias

import sympy as sp
from pydantic import PlainSerializer, PlainValidator
from sympy.printing.str import StrPrinter

from models.base.errors import InputError
from models.formulas.extremes import with_these
from models.network.laws import symbol

LARGEST_EXACT_POWER = 4  # larger powers of two numbers are taken as floating ones: 9**9**9 would fill the memory
FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "Abs": sp.Abs, "abs": sp.Abs, "sign": sp.sign, "sqrt": sp.sqrt, "exp": sp.exp, "log": sp.log,
    "sin": sp.sin, "cos": sp.cos, "tan": sp.tan, "atan": sp.atan, "sinh": sp.sinh, "cosh": sp.cosh, "tanh": sp.tanh,
    "Min": sp.Min, "min": sp.Min, "Max": sp.Max, "max": sp.Max, "Mod": sp.Mod,
}  # fmt: skip


def _power(base: Any, exponent: Any) -> Any:
    small = exponent.is_Integer and abs(exponent) <= LARGEST_EXACT_POWER
    if base.is_number and exponent.is_number and not small:
        return sp.Float(float(base)) ** sp.Float(float(exponent))
    return base**exponent


OPERATORS: Mapping[type[ast.AST], Callable[..., Any]] = {
    ast.USub: operator.neg, ast.UAdd: operator.pos, ast.Not: sp.Not, ast.Invert: sp.Not,
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: _power,
    ast.BitAnd: sp.And, ast.BitOr: sp.Or, ast.And: sp.And, ast.Or: sp.Or,
    ast.Lt: sp.StrictLessThan, ast.LtE: sp.LessThan, ast.Gt: sp.StrictGreaterThan, ast.GtE: sp.GreaterThan,
}  # fmt: skip


class _Printer(StrPrinter):  # type: ignore[misc]
    """Text of expressions whose floating numbers are read back bit by bit."""

    def _print_Float(self, expr: sp.Float) -> str:
        return repr(float(expr))


def expression_text(expression: sp.Expr) -> str:
    """Return an expression as text that :func:`parse_expression` reads back.

    Examples
    --------
    >>> expression_text(0.1 * symbol("speed") ** 2 / 3)
    '0.03333333333333333*speed**2'
    """
    return str(_Printer().doprint(expression))


def parse_expression(text: str) -> sp.Expr:
    """Return the expression that a text denotes; every name in it becomes a symbol.

    Raises
    ------
    InputError
        If it is no expression of numbers, names and :data:`FUNCTIONS`, or not a finite real number.

    Examples
    --------
    >>> parse_expression("8.0*(speed/3000.0)**3 + Max(T_oil, 0)")
    2.96296296296296e-10*speed**3 + Max(0, T_oil)
    >>> parse_expression("speed.real")
    Traceback (most recent call last):
    models.base.errors.InputError: not allowed here: 'speed.real'
    """
    try:
        value = _read(ast.parse(text.strip(), mode="eval").body)
    except InputError:
        raise
    except SyntaxError as error:
        raise InputError(f"{_shown(text)} is not an expression ({error.msg})") from error
    except Exception as error:  # sympy refuses operands with exceptions of many types
        raise InputError(f"{_shown(text)} cannot be used ({error})") from error
    if not isinstance(value, sp.Expr):
        raise InputError(f"{_shown(text)} is a condition, not a number")
    if value.has(sp.nan, sp.zoo, sp.oo, -sp.oo, sp.I):
        raise InputError(f"{_shown(text)} is not a finite real expression")
    return with_these(value)


def _read(node: ast.expr) -> Any:
    """Return the sympy object of one node of the syntax tree."""
    match node:
        case ast.Constant(value=bool() | int() | float() as number):
            return sp.sympify(number)
        case ast.Name(id=name):
            return sp.pi if name == "pi" else symbol(name)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            return OPERATORS[type(op)](_read(left), _read(right))
        case ast.BinOp(op=ast.BitXor()):
            raise _not_allowed(node, "; a power is written **")
        case ast.UnaryOp(op=op, operand=operand):
            return OPERATORS[type(op)](_read(operand))
        case ast.BoolOp(op=op, values=values):
            return OPERATORS[type(op)](*map(_read, values))
        case ast.Compare():
            return _comparison(node)
        case ast.Call():
            return _call(node)
    raise _not_allowed(node)


def _comparison(node: ast.Compare) -> Any:
    if not all(type(op) in OPERATORS for op in node.ops):
        raise _not_allowed(node, "; compare with <, <=, > or >=")
    pairs = pairwise(map(_read, (node.left, *node.comparators)))
    return sp.And(*(OPERATORS[type(op)](*pair) for op, pair in zip(node.ops, pairs, strict=True)))


def _call(node: ast.Call) -> Any:
    match node:
        case ast.Call(func=ast.Name(id="Piecewise"), args=cases, keywords=[]):
            return sp.Piecewise(*map(_case, cases))
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]) if name in FUNCTIONS:
            return FUNCTIONS[name](*map(_read, arguments))
    raise _not_allowed(node, f"; functions are {', '.join(sorted([*FUNCTIONS, 'Piecewise']))}")


def _case(node: ast.expr) -> tuple[Any, Any]:
    match node:
        case ast.Tuple(elts=[value, condition]) if not isinstance(_read(condition), sp.Expr):
            return _read(value), _read(condition)
    raise _not_allowed(node, "; Piecewise takes pairs (value, condition)")


def _not_allowed(node: ast.expr, hint: str = "") -> InputError:
    return InputError(f"not allowed here: {_shown(ast.unparse(node))}{hint}")


def _shown(text: str) -> str:
    return repr(text) if len(text) <= 80 else f"{text[:77]!r}..."


def _law(value: Any) -> sp.Expr:
    """Return the law of a text; an expression stays as it is."""
    if isinstance(value, sp.Expr):
        return value
    if isinstance(value, str):
        return parse_expression(value)
    raise InputError(f"must be a text such as 'strength * speed', not {value!r}")


Law: TypeAlias = Annotated[sp.Expr, PlainValidator(_law), PlainSerializer(expression_text, return_type=str)]
"""A law in a file: a text that is parsed when the file is read and printed when it is written."""
