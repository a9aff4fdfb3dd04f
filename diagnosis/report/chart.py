"""Interactive charts: a plotly figure with its title and a text for those who do not see it, in one look."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import Any

import numpy as np
import plotly.graph_objects as go
from markupsafe import Markup

from diagnosis.recordings.cleaning import time_pieces
from models.base.types import Array

INK, LINE = "#1f2328", "#dfe3e8"
FONT_PX = 12
DASHES = ("solid", "dash", "dot", "dashdot")
LETTERS = 42  # of a line on a phone
MOST_POINTS = 700  # of a curve
MOST_OF_ALL = 160_000  # points of all curves of a chart: some 2 MB of the page
MARGIN = 0.05  # of the range of curves
GAP = 20.0  # times the usual distance of rows: a curve is interrupted
CONFIG = {
    "responsive": True,
    "displaylogo": False,
    "modeBarButtonsToRemove": ["select2d", "lasso2d", "autoScale2d"],
}


@dataclass(frozen=True, kw_only=True, eq=False)
class Chart:
    """A figure of the report.

    Attributes
    ----------
    name : str
        Of the element in the page
    alt : str
        All that the figure shows, in words
    note : str
        How to read it
    """

    name: str
    title: str
    alt: str
    figure: go.Figure
    note: str = ""

    @property
    def html(self) -> Markup:
        """The figure for a page that has plotly.js."""
        return Markup(  # noqa: S704 - plotly escapes what could end its script
            self.figure.to_html(full_html=False, include_plotlyjs=False, config=CONFIG, div_id=f"plot-{self.name}")
        )


def dressed(figure: go.Figure, height: int, **layout: Any) -> go.Figure:
    """A figure in the common look.

    Parameters
    ----------
    height : int
        [px]; the width is that of the page
    **layout
        Further properties of the layout
    """
    frame = {"gridcolor": LINE, "zerolinecolor": "#9aa1a9", "linecolor": "#9aa1a9", "showline": True,
            "automargin": True}  # fmt: skip
    figure.update_xaxes(**frame)
    figure.update_yaxes(**frame)
    usual: dict[str, Any] = {
        "template": "none",
        "height": height,
        "font": {"size": FONT_PX, "color": INK},
        "margin": {"l": 10, "r": 14, "t": 30, "b": 10},
        "paper_bgcolor": "white",
        "plot_bgcolor": "white",
        "hoverlabel": {"bgcolor": "white", "font": {"size": FONT_PX}, "namelength": -1},
        "legend": {"orientation": "h", "x": 0.0, "xanchor": "left", "y": 1.0, "yanchor": "bottom"},
    }
    return figure.update_layout(**(usual | layout))


def curve_points(x: Array, y: Array, most: int = MOST_POINTS) -> tuple[Array, Array]:
    """A curve as plotly gets it: thinned, and interrupted where rows are missing; single precision."""
    known = np.isfinite(x) & np.isfinite(y)
    x, y = x[known], y[known]
    parts, share = stretches(x), most / max(len(x), 1)
    thin = [thinned(x[s], y[s], max(2, int(share * (s.stop - s.start)))) for s in parts]
    xs = [piece for one, _ in thin for piece in (one, one[-1:])]
    ys = [piece for _, one in thin for piece in (one, np.full(min(len(one), 1), np.nan))]
    return np.concatenate(xs[:-1]).astype(np.float32), single(np.concatenate(ys[:-1]))


def single(values: Array) -> Array:
    """Six digits of the largest value, in single precision: last bits differ between processes, a page must not.

    Examples
    --------
    >>> single(np.array([85.1234567, np.nan])) == single(np.array([85.1234567 + 1e-12, np.nan]))
    array([ True, False])
    """
    largest = float(np.max(np.abs(values), where=np.isfinite(values), initial=1e-30))
    return np.round(values, 5 - math.floor(math.log10(largest))).astype(np.float32)


def thinned(x: Array, y: Array, most: int = MOST_POINTS) -> tuple[Array, Array]:
    """A curve of at most about `most` points that keeps every peak: the least and the largest of each stretch.

    Examples
    --------
    >>> x, y = thinned(np.arange(1000.0), np.where(np.arange(1000) == 517, 9.0, 0.0), 100)
    >>> len(x) <= 100, float(y.max())
    (True, 9.0)
    """
    if len(x) <= most:
        return x, y
    kept = {0, len(x) - 1}
    for rows in np.array_split(np.arange(len(x)), max(most // 2 - 1, 1)):
        kept |= {int(rows[np.argmin(y[rows])]), int(rows[np.argmax(y[rows])])}
    chosen = sorted(kept)
    return x[chosen], y[chosen]


def averaged(x: Array, y: Array, most: int) -> tuple[Array, Array]:
    """Means over stretches of rows, at most `most`; of rows without a value nothing is taken."""
    known = np.isfinite(y)
    x, y = x[known], y[known]
    if len(x) <= most:
        return x, y
    edges = np.linspace(0, len(x), most + 1).astype(int)
    count = np.diff(edges)
    return np.add.reduceat(x, edges[:-1]) / count, np.add.reduceat(y, edges[:-1]) / count


def stretches(x: Array) -> list[slice]:
    """Rows between gaps that are much longer than the usual distance."""
    usual = float(np.median(np.diff(x))) if len(x) > 1 else 0.0
    return time_pieces(x, GAP * max(usual, 1e-12))


def limits(curves: Sequence[Array]) -> list[float] | None:
    """A range around curves; None if they have no values."""
    values = np.concatenate([c[np.isfinite(c)] for c in curves])
    if not len(values):
        return None
    low, high = float(values.min()), float(values.max())
    apart = max(MARGIN * (high - low), 1e-6 * max(abs(low), abs(high)), 1e-9)
    return [low - apart, high + apart]


def axis(letter: str, row: int) -> str:
    """Name of an axis of a row of axes, counted from 1: ``x``, ``x2``, ``yaxis3``."""
    return f"{letter}{row}" if row > 1 else letter


def row_titles(texts: Sequence[str]) -> list[dict[str, Any]]:
    """A title over the left end of every row of axes."""
    return [
        {"text": text, "x": 0.0, "xref": "paper", "xanchor": "left", "y": 1.0, "yanchor": "bottom",
         "yref": f"{axis('y', row)} domain", "showarrow": False, "font": {"size": FONT_PX}}
        for row, text in enumerate(texts, 1)
    ]  # fmt: skip


def wrapped(text: str) -> str:
    """A text on lines that a phone has room for."""
    return "<br>".join(wrap(text, LETTERS))
