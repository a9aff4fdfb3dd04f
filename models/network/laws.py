"""A law is one symbolic expression of named signals and parameters.

From that one expression come the numpy function, the plain-Python function inside the FMU, its derivatives, the C of a
native FMU and the equation a report prints. Where a user's Python callable cannot be traced into an expression (it
branches on a value, or calls numpy on it) it is kept as a numeric law: it simulates, but cannot be exported.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import Any, TypeAlias

import numpy as np
import sympy as sp
from sympy.printing.c import C99CodePrinter
from sympy.printing.codeprinter import CodePrinter, PrintMethodNotImplementedError
from sympy.printing.numpy import NumPyPrinter
from sympy.printing.pycode import PythonCodePrinter

from models.base.errors import InputError, did_you_mean
from models.base.types import Array
from models.formulas.extremes import with_these


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A number of the network that may be tuned, with its prior.

    Attributes
    ----------
    unit : str
        "1" for a factor
    start, lower, upper : float
        Value as delivered, and bounds
    sd : float
        Standard deviation of the prior: of the natural logarithm where `log`, else of the value
    log : bool
        Whether the prior is log-normal
    grid : tuple of float
        Values from which a search for it starts, where one start may miss the best; empty: `start` alone
    sweep : (float, float) or None
        Positive range that is gone through finely once the rest is found, where no grid is fine enough: of a period
    """

    name: str
    unit: str = "1"
    start: float = 1.0
    lower: float = 0.05
    upper: float = 20.0
    sd: float = 0.2
    log: bool = True
    description: str = ""
    grid: tuple[float, ...] = ()
    sweep: tuple[float, float] | None = None


def symbol(name: str) -> sp.Symbol:
    """The symbol of a signal or parameter: real, so that powers and magnitudes simplify."""
    return sp.Symbol(name, real=True)


class Signals:
    """The signals of a network by name, as symbols or as numbers: ``s.speed``, ``s.T_oil``, ``s["T_oil"]``.

    Raises
    ------
    InputError
        For a name that the network does not have, with the nearest one that it has.
    """

    def __init__(self, values: Mapping[str, Any]) -> None:
        self._values = values

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        try:
            return self._values[name]
        except KeyError:
            raise InputError(f"{name!r} is not a signal of this network{did_you_mean(name, self._values)}") from None

    __getitem__ = __getattr__

    def __dir__(self) -> Iterable[str]:
        return sorted(self._values)


@dataclass(frozen=True)
class NumericLaw:
    """A law that could not be traced: a callable of numeric :class:`Signals`, and the symbol in its place."""

    function: Callable[[Signals], Any]
    stand_in: sp.Symbol


LawLike: TypeAlias = Callable[[Signals], Any] | sp.Expr | float


def trace(law: LawLike, names: Iterable[str], stand_in: str) -> tuple[sp.Expr, NumericLaw | None]:
    """Turn what a user gives as a law into an expression.

    Parameters
    ----------
    law : callable of :class:`Signals`, sympy expression, or number
    names : iterable of str
        Signals and parameters that the network has
    stand_in : str
        Name of the symbol that replaces the law if it cannot be traced

    Returns
    -------
    expression, numeric : sympy.Expr, NumericLaw or None

    Raises
    ------
    InputError
        If the law uses a name that the network does not have, or gives no number.

    Examples
    --------
    >>> trace(lambda s: 8.0 * (s.speed / 3000.0) ** 3, ["speed"], "extra")[0].subs(symbol("speed"), 3000.0)
    8.00000000000000
    >>> trace(lambda s: np.exp(s.speed), ["speed"], "extra")[0]
    extra
    """
    known = {name: symbol(name) for name in names}
    if not callable(law):
        return _check_expression(sp.sympify(law), known, stand_in), None
    try:
        value = law(Signals(known))
    except InputError:
        raise
    except Exception:  # noqa: BLE001 - whatever fails on symbols may well do on numbers
        value = None
    expression = None
    if value is not None:
        try:
            expression = sp.sympify(value)
        except (sp.SympifyError, TypeError, ValueError):
            expression = None
    if isinstance(expression, sp.Expr) and _agrees(expression, law, known):
        return _check_expression(expression, known, stand_in), None
    numeric = NumericLaw(law, symbol(stand_in))
    try:
        sample: Array = np.asarray(law(Signals(dict.fromkeys(known, 1.0))), dtype=np.float64)
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"the law of {stand_in!r} fails both on symbols and on numbers: {error}") from error
    if sample.shape != ():
        raise InputError(f"the law of {stand_in!r} gives an array of shape {sample.shape}; one number is needed")
    return numeric.stand_in, numeric


def _agrees(expression: sp.Expr, law: Callable[[Signals], Any], known: Mapping[str, sp.Symbol]) -> bool:
    """Return True if a traced law and its callable give equal values on numbers.

    ``1.0 if s.valve else 0.0`` does not fail on symbols, which all count as true: the trace would lose a branch.
    """
    for sample in (0.0, 1.0):
        try:
            value = float(law(Signals(dict.fromkeys(known, sample))))
            traced = float(expression.xreplace({known[name]: sp.Float(sample) for name in known}))
        except Exception:  # noqa: BLE001, S112 - no number at this sample (a division by zero): no evidence
            continue
        if np.isfinite(value) and not np.isclose(value, traced, rtol=1e-9, atol=1e-12):
            return False
    return True


def _check_expression(expression: sp.Expr, known: Mapping[str, sp.Symbol], name: str) -> sp.Expr:
    # A sympy expression may come with plain symbols; they mean the signals of the same name.
    expression = expression.subs({s: known[s.name] for s in expression.free_symbols if s.name in known})
    expression = with_these(expression)
    for free in sorted(s.name for s in expression.free_symbols - set(known.values())):
        raise InputError(f"the law of {name!r} uses {free!r}, not a signal of this network{did_you_mean(free, known)}")
    for piecewise in expression.atoms(sp.Piecewise):
        if piecewise.args[-1].cond != True:  # noqa: E712 - a sympy condition, not a bool
            raise InputError(f"the law of {name!r} has a Piecewise without a last case; end it with (value, True)")
    if expression.has(sp.I, sp.nan, sp.zoo, sp.oo):
        raise InputError(f"the law of {name!r} is {expression}, not a real finite expression")
    return expression


def _nested(printer: CodePrinter, function: str, args: Sequence[sp.Expr]) -> str:
    """Code of a function of many arguments as calls of one of two."""
    code: str = reduce(lambda code, arg: f"{function}({code}, {arg})", map(printer._print, args))
    return code


class _VectorPrinter(NumPyPrinter):  # type: ignore[misc]
    """numpy code whose Max, Min, And, Or and Piecewise broadcast (sympy's own need arguments of one shape)."""

    def _print_Max(self, expr: sp.Max) -> str:
        return _nested(self, self._module_format("numpy.maximum"), expr.args)

    def _print_Min(self, expr: sp.Min) -> str:
        return _nested(self, self._module_format("numpy.minimum"), expr.args)

    def _print_And(self, expr: sp.And) -> str:
        return _nested(self, self._module_format("numpy.logical_and"), expr.args)

    def _print_Or(self, expr: sp.Or) -> str:
        return _nested(self, self._module_format("numpy.logical_or"), expr.args)

    def _print_Piecewise(self, expr: sp.Piecewise) -> str:
        code: str = self._print(expr.args[-1].expr)
        for arg in reversed(expr.args[:-1]):
            where = self._module_format("numpy.where")
            code = f"{where}({self._print(arg.cond)}, {self._print(arg.expr)}, {code})"
        return code


class _ScalarPrinter(PythonCodePrinter):  # type: ignore[misc]
    """Python code of plain numbers."""

    def _print_Mod(self, expr: sp.Mod) -> str:
        dividend, divisor = expr.args  # sympy 1.14 leaves the outer parentheses out: 2*(x % y) becomes 2*x % y
        return f"(({self._print(dividend)}) % ({self._print(divisor)}))"


def function_source(name: str, arguments: Sequence[str], expressions: Sequence[sp.Expr], *, vector: bool) -> str:
    """Python source of a function that evaluates expressions, common subexpressions once.

    Parameters
    ----------
    name : str
        Name of the function
    arguments : sequence of str
        Its positional arguments, in order
    expressions : sequence of sympy.Expr
        What it returns, as a tuple
    vector : bool
        numpy code for arrays, or plain ``math`` code for single numbers (40 times faster on those)
    """
    return _function_source(name, tuple(arguments), tuple(expressions), vector)


@lru_cache(maxsize=4096)  # a diagnosis asks for the laws of the same mechanisms again and again
def _function_source(name: str, arguments: tuple[str, ...], expressions: tuple[sp.Expr, ...], vector: bool) -> str:
    settings = {"fully_qualified_modules": True, "allow_unknown_functions": False}
    printer = _VectorPrinter(settings) if vector else _ScalarPrinter(settings)
    common, reduced = sp.cse(list(expressions), symbols=sp.numbered_symbols("_x", real=True))
    lines = [f"def {name}({', '.join(arguments)}):"]
    lines += [f"    {variable} = {printer.doprint(value)}" for variable, value in common]
    lines.append(f"    return ({''.join(printer.doprint(value) + ', ' for value in reduced)})")
    return "\n".join(lines) + "\n"


@lru_cache(maxsize=4096)  # the same laws are asked for again and again
def compile_function(source: str, name: str) -> Callable[..., tuple[Any, ...]]:
    """The function that :func:`function_source` wrote."""
    # Without the name of a module, pickling looks for it in all of them.
    namespace: dict[str, Any] = {"math": math, "numpy": np, "__name__": __name__}
    exec(compile(source, f"<law {name}>", "exec"), namespace)  # noqa: S102 - our own generated code
    function: Callable[..., tuple[Any, ...]] = namespace[name]
    return function


def compile_each(arguments: Sequence[str], expressions: Sequence[sp.Expr]) -> Callable[..., tuple[Any, ...]]:
    """A function of arrays that evaluates expressions, each compiled apart and kept.

    A network that differs from another one by a term shares most of its laws: only the new ones are compiled.

    Parameters
    ----------
    arguments : sequence of str
        Positional arguments of the function, in order
    expressions : sequence of sympy.Expr
        What it returns, as a tuple
    """
    place = {name: index for index, name in enumerate(arguments)}
    laws = []
    for expression in expressions:
        used = sorted((s.name for s in expression.free_symbols), key=place.__getitem__)
        law = compile_function(function_source("law", used, [expression], vector=True), "law")
        laws.append((law, [place[name] for name in used]))
    return lambda *signals: tuple(law(*(signals[i] for i in at))[0] for law, at in laws)


class _CPrinter(C99CodePrinter):  # type: ignore[misc]
    """C99 on doubles alone: no integer that could be divided as one, no macro that a compiler may lack."""

    def __init__(self, places: Mapping[str, str]) -> None:
        super().__init__({"allow_unknown_functions": False, "math_macros": {}})
        self._places = places

    def _print_Symbol(self, expr: sp.Symbol) -> str:
        return self._places.get(expr.name, str(expr.name))

    def _print_Integer(self, expr: sp.Integer) -> str:
        return f"{int(expr)}.0"

    def _print_Rational(self, expr: sp.Rational) -> str:
        return f"({int(expr.p)}.0/{int(expr.q)}.0)"

    def _print_Piecewise(self, expr: sp.Piecewise) -> str:
        code: str = self._print(expr.args[-1].expr)
        for arg in reversed(expr.args[:-1]):
            code = f"({self._print(arg.cond)} ? {self._print(arg.expr)} : {code})"
        return code

    def _print_Float(self, expr: sp.Float) -> str:
        return repr(float(expr))

    def _print_NumberSymbol(self, expr: sp.NumberSymbol) -> str:
        return repr(float(expr))

    def _print_Pow(self, expr: sp.Pow) -> str:
        base: str = self._print(expr.base)
        exponent = float(expr.exp) if expr.exp.is_number else math.nan
        size = abs(exponent)
        if size == 1.0:
            power = f"({base})"
        elif size == 0.5:
            power = f"sqrt({base})"
        elif size == 0.25:
            power = f"sqrt(sqrt({base}))"
        elif size.is_integer() and size <= LARGEST_PRODUCT:
            power = f"whole_power({base}, {int(size)})"
        else:
            return f"pow({base}, {self._print(expr.exp)})"
        return power if exponent > 0.0 else f"(1.0/{power})"

    def _print_Max(self, expr: sp.Max) -> str:
        return _nested(self, "larger", expr.args)

    def _print_Min(self, expr: sp.Min) -> str:
        return _nested(self, "smaller", expr.args)

    def _print_sign(self, expr: sp.Expr) -> str:
        return f"sign({self._print(expr.args[0])})"

    def _print_Mod(self, expr: sp.Mod) -> str:
        return f"modulo({self._print(expr.args[0])}, {self._print(expr.args[1])})"


LARGEST_PRODUCT = 16  # exponent up to which a whole power is a product


def c_function_source(name: str, arguments: Mapping[str, str], expressions: Sequence[sp.Expr]) -> str:
    """C99 source of ``void law_<name>(const double *s, double *y)``.

    It needs ``elementary.h`` and the macro ``RESTRICT`` of the native FMU.

    Parameters
    ----------
    arguments : mapping of str to str
        C expression for every signal or parameter
    expressions : sequence of sympy.Expr
        What goes to ``y``, in order

    Examples
    --------
    >>> print(c_function_source("heat", {"speed": "s[1]"}, [symbol("speed") ** 3 / 2]))
    void law_heat(const double *RESTRICT s, double *RESTRICT y) {
        y[0] = ((1.0/2.0))*whole_power(s[1], 3);
    }
    <BLANKLINE>

    Raises
    ------
    InputError
        If an expression uses a function that C lacks.
    """
    printer = _CPrinter(arguments)
    common, reduced = sp.cse(list(expressions), symbols=sp.numbered_symbols("_x", real=True))
    try:
        lines = [f"const double {variable} = {printer.doprint(value)};" for variable, value in common]
        lines += [f"y[{index}] = {printer.doprint(value)};" for index, value in enumerate(reduced)]
    except PrintMethodNotImplementedError as error:
        raise InputError(f"a law of {name!r} cannot be written in C: {error}") from error
    lines += [f"(void){unused};" for unused in ("s", "y") if not any(f"{unused}[" in line for line in lines)]
    body = "".join(f"    {line}\n" for line in lines)
    return f"void law_{name}(const double *RESTRICT s, double *RESTRICT y) {{\n{body}}}\n"
