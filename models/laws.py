"""A law is one symbolic expression of named signals and parameters.

From that one expression come the numpy function, the plain-Python function inside the FMU, its derivatives, the C of a
native FMU and the equation a report prints. Where a user's Python callable cannot be traced into an expression (it
branches on a value, or calls numpy on it) it is kept as a numeric law: it simulates, but cannot be exported.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import sympy as sp
from sympy.printing.numpy import NumPyPrinter
from sympy.printing.pycode import PythonCodePrinter

from models.errors import InputError, did_you_mean
from models.types import Array


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A number of the network that may be tuned, with its prior.

    Attributes
    ----------
    name : str
    unit : str
        "1" for a factor
    start, lower, upper : float
        Value as delivered, and bounds
    sd : float
        Standard deviation of the prior: of the natural logarithm where `log`, else of the value
    log : bool
        Whether the prior is log-normal
    description : str
    """

    name: str
    unit: str = "1"
    start: float = 1.0
    lower: float = 0.05
    upper: float = 20.0
    sd: float = 0.2
    log: bool = True
    description: str = ""


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
    """A law that could not be traced: a callable of :class:`Signals` holding numbers, and the symbol it stands for."""

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
        Name of the symbol that stands for the law where it cannot be traced

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
        return _checked(sp.sympify(law), known, stand_in), None
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
        return _checked(expression, known, stand_in), None
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
    """Whether a traced law gives on numbers what its callable gives.

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


def _checked(expression: sp.Expr, known: Mapping[str, sp.Symbol], name: str) -> sp.Expr:
    # A sympy expression may come with plain symbols; they mean the signals of the same name.
    expression = expression.subs({s: known[s.name] for s in expression.free_symbols if s.name in known})
    for free in sorted(s.name for s in expression.free_symbols - set(known.values())):
        raise InputError(f"the law of {name!r} uses {free!r}, not a signal of this network{did_you_mean(free, known)}")
    for piecewise in expression.atoms(sp.Piecewise):
        if piecewise.args[-1].cond != True:  # noqa: E712 - a sympy condition, not a bool
            raise InputError(f"the law of {name!r} has a Piecewise without a last case; end it with (value, True)")
    if expression.has(sp.I, sp.nan, sp.zoo, sp.oo):
        raise InputError(f"the law of {name!r} is {expression}, not a real finite expression")
    return expression


class _VectorPrinter(NumPyPrinter):  # type: ignore[misc]
    """numpy code whose Max, Min, And, Or and Piecewise broadcast (sympy's own need arguments of one shape)."""

    def _nested(self, function: str, args: Sequence[sp.Expr]) -> str:
        code: str = self._print(args[0])
        for arg in args[1:]:
            code = f"{self._module_format(function)}({code}, {self._print(arg)})"
        return code

    def _print_Max(self, expr: sp.Max) -> str:
        return self._nested("numpy.maximum", expr.args)

    def _print_Min(self, expr: sp.Min) -> str:
        return self._nested("numpy.minimum", expr.args)

    def _print_And(self, expr: sp.And) -> str:
        return self._nested("numpy.logical_and", expr.args)

    def _print_Or(self, expr: sp.Or) -> str:
        return self._nested("numpy.logical_or", expr.args)

    def _print_Piecewise(self, expr: sp.Piecewise) -> str:
        code: str = self._print(expr.args[-1].expr)
        for arg in reversed(expr.args[:-1]):
            where = self._module_format("numpy.where")
            code = f"{where}({self._print(arg.cond)}, {self._print(arg.expr)}, {code})"
        return code


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

    Returns
    -------
    str
    """
    settings = {"fully_qualified_modules": True, "allow_unknown_functions": False}
    printer = _VectorPrinter(settings) if vector else PythonCodePrinter(settings)
    common, reduced = sp.cse(list(expressions), symbols=sp.numbered_symbols("_x", real=True))
    lines = [f"def {name}({', '.join(arguments)}):"]
    lines += [f"    {variable} = {printer.doprint(value)}" for variable, value in common]
    lines.append(f"    return ({''.join(printer.doprint(value) + ', ' for value in reduced)})")
    return "\n".join(lines) + "\n"


def compile_function(source: str, name: str) -> Callable[..., tuple[Any, ...]]:
    """The function that :func:`function_source` wrote."""
    namespace: dict[str, Any] = {"math": math, "numpy": np}
    exec(compile(source, f"<law {name}>", "exec"), namespace)  # noqa: S102 - our own generated code
    function: Callable[..., tuple[Any, ...]] = namespace[name]
    return function
