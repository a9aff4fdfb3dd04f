"""Equations as MathML, which browsers set by themselves."""

from __future__ import annotations

import re

from latex2mathml.converter import convert
from markupsafe import Markup

SEPARATOR = r",\quad "
# What sympy and the laws write for machines, and what a reader wants: factors apart, no "1.0", no "3.6e+04".
FOR_READERS = (
    (re.compile(r"(?<=[}\w*)]) (?=[A-Za-z(\\])(?!\\(?:leftarrow|leq?|geq?|cdot|right|quad|neq|bmod|;)\b)"), r"\\, "),
    (re.compile(r"(\d)e\+?(-?)0*(\d+)"), r"\1 \\cdot 10^{\2\3}"),
    (re.compile(r"(?<![\d.])(\d+)\.0(?!\d)"), r"\1"),
    (re.compile(r"\\text\{for\}\\:"), r"\\text{if }"),
)


def drawn(latex: str) -> Markup:
    r"""An equation as MathML, one formula per ``,\quad``; empty for an empty equation.

    Parameters
    ----------
    latex : str
        As :meth:`models.terms.term.Term.equation` gives it
    """
    lines = [_for_readers(line) for line in latex.split(SEPARATOR) if line.strip()]
    return Markup("\n").join(Markup(convert(line, display="block")) for line in lines)  # noqa: S704 - escapes every sign


def _for_readers(latex: str) -> str:
    for machine, reader in FOR_READERS:
        latex = machine.sub(reader, latex)
    return latex
