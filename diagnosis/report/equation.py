"""Equations as drawings: LaTeX set by matplotlib, so that a page needs neither a network nor a script for it."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from matplotlib.font_manager import FontProperties
from matplotlib.path import Path as Outline
from matplotlib.textpath import TextPath
from numpy.typing import NDArray

from models.base.types import Array

SIZE_PX = 19.0
LEADING_PX, MARGIN_PX, GAP_PX = 10.0, 3.0, 8.0
SEPARATOR = r",\quad "
CASES = re.compile(r"^(?P<before>.*?)\\begin\{cases\}(?P<rows>.*?)\\end\{cases\}(?P<after>.*)$", re.DOTALL)
# What sympy and the laws write for machines, and what a reader wants: factors apart, no "1.0", no "3.6e+04".
FOR_READERS = (
    (re.compile(r"\\bmod\b"), r"\\;\\mathrm{mod}\\;"),  # which matplotlib does not know
    (re.compile(r"(?<=[}\w*)]) (?=[A-Za-z(\\])(?!\\(?:leftarrow|leq?|geq?|cdot|right|quad|neq|;)\b)"), r"\\, "),
    (re.compile(r"(\d)e\+?(-?)0*(\d+)"), r"\1 \\cdot 10^{\2\3}"),
    (re.compile(r"(?<![\d.])(\d+)\.0(?!\d)"), r"\1"),
)
FONT = FontProperties(math_fontfamily="stix")
COMMANDS = {int(Outline.MOVETO): "M", int(Outline.LINETO): "L", int(Outline.CURVE3): "Q", int(Outline.CURVE4): "C",
            int(Outline.CLOSEPOLY): "Z"}  # fmt: skip


def drawn(latex: str) -> Markup:
    r"""An equation as SVG in the colour of the text around it, one line per ``,\quad``.

    Parameters
    ----------
    latex : str
        As :meth:`models.terms.term.Term.equation` gives it; ``cases`` may be the last thing of a line

    Returns
    -------
    Markup
        The LaTeX itself as code where matplotlib cannot set it; empty for an empty equation
    """
    if not latex.strip():
        return Markup()
    try:
        blocks = [_block(line) for line in latex.split(SEPARATOR)]
    except ValueError:  # what matplotlib raises on LaTeX beyond its reach
        return Markup('<code class="latex">{}</code>').format(latex)
    inks, top = [], 0.0
    for block in blocks:
        low, high = _extent(block)
        inks += [ink.shifted(MARGIN_PX, -MARGIN_PX - top - high) for ink in block]
        top += high - low + LEADING_PX
    width = max(ink.right for ink in inks) + MARGIN_PX
    height = top - LEADING_PX + 2.0 * MARGIN_PX
    return Markup(
        '<svg class="equation" role="img" aria-label="{}" width="{:.0f}" height="{:.0f}" viewBox="0 0 {:.1f} {:.1f}">'
        '<title>{}</title><path fill="currentColor" d="{}"/></svg>'
    ).format(latex, width, height, width, height, latex, "".join(ink.path() for ink in inks))


@dataclass(frozen=True, eq=False)
class _Ink:
    """Outlines of letters; `points`, shape (N, 2), [px], y upwards, with matplotlib's code of each."""

    points: Array
    codes: NDArray[np.uint8]

    @property
    def right(self) -> float:
        return float(self.points[:, 0].max())

    def shifted(self, x: float, y: float) -> _Ink:
        return _Ink(self.points + np.array([x, y]), self.codes)

    def stretched(self, times: float) -> _Ink:
        return _Ink(self.points * np.array([1.0, times]), self.codes)

    def path(self) -> str:
        """Path data of SVG, whose y grows downwards."""
        parts = []
        for points, code in Outline(self.points, self.codes).iter_segments(simplify=False):
            command = COMMANDS[int(code)]
            pairs = np.asarray(points).reshape(-1, 2) * [1.0, -1.0]
            parts.append(command + ("" if command == "Z" else " ".join(f"{value:.1f}" for value in pairs.ravel())))
        return "".join(parts)


def _block(line: str) -> list[_Ink]:
    """One line, its base line at height 0."""
    cases = CASES.match(line)
    if cases is None:
        return [_set(line)]
    if cases["after"].strip() or r"\begin" in cases["rows"]:
        raise ValueError("cases inside an expression")
    head = [_set(cases["before"])] if cases["before"].strip() else []
    rows = [row for row in cases["rows"].split(r"\\") if row.strip()]
    return head + _braced([_columns(row) for row in rows], max((ink.right for ink in head), default=0.0) + GAP_PX)


def _columns(row: str) -> list[_Ink]:
    value, _, condition = row.replace(r"\text{for}", r"\mathrm{if}").partition("&")
    return [_set(value), _set(condition.replace(r"\text{otherwise}", r"\mathrm{otherwise}"))]


def _braced(rows: list[list[_Ink]], x: float) -> list[_Ink]:
    """Rows of two columns behind a brace, centred on the axis of the line."""
    heights = [_extent(row) for row in rows]
    total = sum(high - low for low, high in heights) + 0.6 * LEADING_PX * (len(rows) - 1)
    top = 0.25 * SIZE_PX + 0.5 * total
    brace = _set(r"\{")
    low, high = _extent([brace])
    brace = brace.stretched(total / (high - low))
    found = [brace.shifted(x, top - _extent([brace])[1])]
    x = found[0].right + GAP_PX
    second = x + max(value.right for value, _ in rows) + 2.5 * GAP_PX
    for (low, high), (value, condition) in zip(heights, rows, strict=True):
        found += [value.shifted(x, top - high), condition.shifted(second, top - high)]
        top -= high - low + 0.6 * LEADING_PX
    return found


def _set(latex: str) -> _Ink:
    for machine, reader in FOR_READERS:
        latex = machine.sub(reader, latex)
    outline = TextPath((0.0, 0.0), f"${latex.strip()}$", size=SIZE_PX, prop=FONT)
    return _Ink(np.array(outline.vertices, dtype=np.float64), np.array(outline.codes, dtype=np.uint8))


def _extent(inks: list[_Ink]) -> tuple[float, float]:
    y = np.concatenate([ink.points[:, 1] for ink in inks])
    return float(y.min()), float(y.max())
