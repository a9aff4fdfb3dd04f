"""Laws as text: written so that every number survives, and read without running anything of the file.

The text is what Python and sympy print: ``+ - * / **``, comparisons, ``&``, ``|``, ``~``, and the functions of
:data:`FUNCTIONS`. It is parsed into a tree and the tree is walked; nothing is ever evaluated as code.
"""

from __future__ import annotations

import ast
import operator
import sys
from collections.abc import Callable, Collection, Mapping
from typing import Any

import sympy as sp
from sympy.logic.boolalg import Boolean
from sympy.printing.str import StrPrinter

from models.errors import InputError, did_you_mean
from models.laws import symbol

LONGEST, DEEPEST = 20_000, 100  # characters, levels: far beyond any law that a person would review
LARGEST_WHOLE = 10**6  # beyond it whole numbers are taken as floating ones, so that powers stay small
LARGEST_EXACT_POWER = 4
LARGEST_NUMBER = sys.float_info.max
FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "Abs": sp.Abs, "abs": sp.Abs, "sign": sp.sign, "sqrt": sp.sqrt, "exp": sp.exp, "log": sp.log,
    "sin": sp.sin, "cos": sp.cos, "tan": sp.tan, "atan": sp.atan, "sinh": sp.sinh, "cosh": sp.cosh, "tanh": sp.tanh,
    "Min": sp.Min, "min": sp.Min, "Max": sp.Max, "max": sp.Max, "Mod": sp.Mod,
}  # fmt: skip
COMPARISONS: Mapping[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: sp.StrictLessThan, ast.LtE: sp.LessThan, ast.Gt: sp.StrictGreaterThan, ast.GtE: sp.GreaterThan,
}  # fmt: skip
ARITHMETIC: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
}  # fmt: skip


class _Printer(StrPrinter):  # type: ignore[misc]
    """Text of expressions whose floating numbers are read back bit by bit."""

    def _print_Float(self, expr: sp.Float) -> str:
        return repr(float(expr))


def expression_text(expression: sp.Expr) -> str:
    """An expression as text that :func:`parse_expression` reads back.

    Examples
    --------
    >>> expression_text(0.1 * symbol("speed") ** 2 / 3)
    '0.03333333333333333*speed**2'
    """
    return str(_Printer().doprint(expression))


def parse_expression(text: str, names: Collection[str], *, where: str) -> sp.Expr:
    """The expression that a text stands for.

    Parameters
    ----------
    text : str
    names : collection of str
        Signals and parameters that it may use
    where : str
        What messages call it, e.g. file and key

    Raises
    ------
    InputError
        If it is no expression, uses an unknown name or function, or is too long or too deep.

    Examples
    --------
    >>> parse_expression("8.0*(speed/3000.0)**3 + Max(T_oil, 0)", ["speed", "T_oil"], where="law")
    2.96296296296296e-10*speed**3 + Max(0, T_oil)
    >>> parse_expression("speed.real", ["speed"], where="law")
    Traceback (most recent call last):
    models.errors.InputError: law: 'speed.real' has no place in a law
    """
    if len(text) > LONGEST:
        raise InputError(f"{where}: a law of {len(text)} characters is too long; {LONGEST} are possible")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise InputError(f"{where}: {_shown(text)} is not an expression ({getattr(error, 'msg', error)})") from error
    reader = _Reader({name: symbol(name) for name in names}, where)
    try:
        value = reader.read(tree.body, 0)
    except InputError:
        raise
    except Exception as error:  # whatever sympy makes of it, the file is at fault
        raise InputError(f"{where}: {_shown(text)} cannot be used ({error})") from error
    if not isinstance(value, sp.Expr):
        raise InputError(f"{where}: {_shown(text)} is a condition, not a number")
    too_large = any(abs(number) > LARGEST_NUMBER for number in value.atoms(sp.Number) if number.is_finite)
    if too_large or value.has(sp.nan, sp.zoo, sp.oo, -sp.oo, sp.I):
        raise InputError(f"{where}: {_shown(text)} is not a finite real expression")
    return value


class _Reader:
    """Walks a syntax tree and builds the expression."""

    def __init__(self, symbols: Mapping[str, sp.Symbol], where: str) -> None:
        self.symbols, self.where = symbols, where

    def read(self, node: ast.expr, depth: int) -> Any:
        if depth > DEEPEST:
            raise InputError(f"{self.where}: the law is nested deeper than {DEEPEST} levels")
        step = getattr(self, f"_{type(node).__name__}", None)
        if step is None:
            raise InputError(f"{self.where}: {_shown(ast.unparse(node))} has no place in a law")
        return step(node, depth + 1)

    def _number(self, node: ast.expr, depth: int) -> sp.Expr:
        value = self.read(node, depth)
        if not isinstance(value, sp.Expr):
            raise InputError(f"{self.where}: {_shown(ast.unparse(node))} is a condition where a number is needed")
        return value

    def _condition(self, node: ast.expr, depth: int) -> Any:
        value = self.read(node, depth)
        if isinstance(value, sp.Expr) or not isinstance(value, Boolean):  # a symbol is both
            raise InputError(f"{self.where}: {_shown(ast.unparse(node))} is a number where a condition is needed")
        return value

    def _Constant(self, node: ast.Constant, _: int) -> Any:
        value = node.value
        if isinstance(value, bool):
            return sp.true if value else sp.false
        if isinstance(value, int):
            return sp.Integer(value) if abs(value) <= LARGEST_WHOLE else sp.Float(float(value))
        if isinstance(value, float):
            return sp.Float(value)
        raise InputError(f"{self.where}: {_shown(repr(value))} is not a number")

    def _Name(self, node: ast.Name, _: int) -> sp.Symbol:
        if node.id == "pi" and node.id not in self.symbols:
            return sp.pi
        if node.id not in self.symbols:
            raise InputError(f"{self.where}: {node.id!r} is not a signal{did_you_mean(node.id, self.symbols)}")
        return self.symbols[node.id]

    def _UnaryOp(self, node: ast.UnaryOp, depth: int) -> Any:
        if isinstance(node.op, (ast.Not, ast.Invert)):
            return sp.Not(self._condition(node.operand, depth))
        value = self._number(node.operand, depth)
        return -value if isinstance(node.op, ast.USub) else value

    def _BinOp(self, node: ast.BinOp, depth: int) -> Any:
        if isinstance(node.op, (ast.BitAnd, ast.BitOr)):
            joined = sp.And if isinstance(node.op, ast.BitAnd) else sp.Or
            return joined(self._condition(node.left, depth), self._condition(node.right, depth))
        left, right = self._number(node.left, depth), self._number(node.right, depth)
        if isinstance(node.op, ast.Pow):
            small = right.is_Integer and abs(right) <= LARGEST_EXACT_POWER
            if left.is_number and right.is_number and not small:
                return sp.Float(float(left)) ** sp.Float(float(right))
            return left**right
        if type(node.op) not in ARITHMETIC:
            raise InputError(f"{self.where}: {_shown(ast.unparse(node))} has no place in a law")
        value = ARITHMETIC[type(node.op)](left, right)
        large = value.is_Rational and max(abs(value.p), value.q) > LARGEST_WHOLE**2
        return sp.Float(float(value)) if large else value

    def _BoolOp(self, node: ast.BoolOp, depth: int) -> Any:
        joined = sp.And if isinstance(node.op, ast.And) else sp.Or
        return joined(*(self._condition(value, depth) for value in node.values))

    def _Compare(self, node: ast.Compare, depth: int) -> Any:
        values = [self._number(value, depth) for value in (node.left, *node.comparators)]
        if any(type(op) not in COMPARISONS for op in node.ops):
            raise InputError(f"{self.where}: {_shown(ast.unparse(node))}: compare with <, <=, > or >=")
        pairs = zip(node.ops, values[:-1], values[1:], strict=True)
        return sp.And(*(COMPARISONS[type(op)](left, right) for op, left, right in pairs))

    def _Call(self, node: ast.Call, depth: int) -> Any:
        name = node.func.id if isinstance(node.func, ast.Name) else ast.unparse(node.func)
        if node.keywords:
            raise InputError(f"{self.where}: {_shown(ast.unparse(node))}: functions take no named arguments")
        if name == "Piecewise":
            return sp.Piecewise(*(self._case(case, depth) for case in node.args))
        if name not in FUNCTIONS:
            known = ", ".join(sorted([*FUNCTIONS, "Piecewise"]))
            raise InputError(f"{self.where}: {_shown(name)} is not a function; known are: {known}")
        value = FUNCTIONS[name](*(self._number(argument, depth) for argument in node.args))
        # Towers of numbers are worked out at once, so that what overflows is refused here and not in a simulation.
        return sp.Float(float(value)) if value.is_number and not value.is_Rational else value

    def _case(self, node: ast.expr, depth: int) -> tuple[Any, Any]:
        if not (isinstance(node, ast.Tuple) and len(node.elts) == 2):
            raise InputError(f"{self.where}: {_shown(ast.unparse(node))}: Piecewise takes pairs (value, condition)")
        return self._number(node.elts[0], depth + 1), self._condition(node.elts[1], depth + 1)


def _shown(text: str) -> str:
    return repr(text) if len(text) <= 80 else f"{text[:77]!r}..."
