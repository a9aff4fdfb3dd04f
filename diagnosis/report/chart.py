"""Charts as SVG that fits any width without a script: curves stretch, lines and letters keep their size.

The colours are classes of the page's style, so that a chart follows its light and dark looks.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from markupsafe import Markup
from matplotlib.ticker import MaxNLocator

from diagnosis.results.number_format import MINUS
from models.base.types import Array

Kind = Literal["line", "points", "band"]
MOST_POINTS = 800  # of a curve
GRID = 2000  # units of the drawing across
GAP = 20.0  # times the usual distance of rows: a curve is interrupted
MARGIN = 0.04  # of the range, above and below the curves


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """One curve of a chart.

    Attributes
    ----------
    label : str
    look : str
        Class of the page's style
    x, y : Array, shape (N,)
        NaN where there is nothing
    low : Array, shape (N,), or None
        Lower edge of a band that ends at `y`
    far : bool
        Whether it may lie outside the chart, which then keeps to the others
    """

    label: str
    look: str
    x: Array
    y: Array
    kind: Kind = "line"
    low: Array | None = None
    far: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Chart:
    """Axes with curves.

    Attributes
    ----------
    title, x_label, y_label : str
        Labels carry the unit
    note : str
        Text next to the title
    curves : tuple of Curve
    shade : tuple of (from, to)
        Stretches of the x axis that are set back
    x_range : (from, to) or None
        By default what the curves cover
    height : int
        Of the plot, [px]
    level : bool
        Whether zero must be in sight
    """

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    note: str = ""
    shade: tuple[tuple[float, float], ...] = ()
    x_range: tuple[float, float] | None = None
    height: int = 180
    level: bool = False


def drawn(chart: Chart) -> Markup:
    """The chart as HTML; a sentence where it has no numbers."""
    x_low, x_high = chart.x_range or _range([curve.x for curve in chart.curves])
    near = [c for c in chart.curves if not c.far] or list(chart.curves)
    y_low, y_high = _range([values for c in near for values in (c.y, c.low) if values is not None])
    if not np.isfinite([x_low, x_high, y_low, y_high]).all():
        return Markup('<p class="soft">{}: nothing was recorded here.</p>').format(chart.title)
    if chart.level:
        y_low, y_high = min(y_low, 0.0), max(y_high, 0.0)
    x_low, x_high = _apart(x_low, x_high)
    y_low, y_high = _apart(y_low, y_high)
    y_low, y_high = y_low - MARGIN * (y_high - y_low), y_high + MARGIN * (y_high - y_low)
    scatter = any(curve.kind == "points" for curve in chart.curves) and chart.x_range is None
    if scatter:
        x_low, x_high = x_low - MARGIN * (x_high - x_low), x_high + MARGIN * (x_high - x_low)
    view = _View(x_low, x_high, y_low, y_high)
    x_ticks, y_ticks = _ticks(x_low, x_high, 7), _ticks(y_low, y_high, max(chart.height // 40, 2))
    shapes = [Markup('<rect class="shade" x="{}" y="0" width="{}" height="{}"/>').format(
        view.x(a), max(view.x(min(b, x_high)) - view.x(a), 0), GRID) for a, b in chart.shade if b > a]  # fmt: skip
    grid = "".join(f"M{view.x(t)} 0v{GRID}" for t in x_ticks) + "".join(f"M0 {view.y(t)}h{GRID}" for t in y_ticks)
    shapes.append(Markup('<path class="grid" d="{}"/>').format(grid))
    if y_low < 0.0 < y_high:
        shapes.append(Markup('<path class="zero" d="M0 {}h{}"/>').format(view.y(0.0), GRID))
    shapes += [_curve(curve, view) for curve in chart.curves]
    return Markup(
        '<figure class="chart"><figcaption><b>{}</b>{}<span class="soft unit">{}</span></figcaption>'
        '<div class="frame" style="height: {}px"><div class="y">{}</div>'
        '<svg viewBox="0 0 {} {}" preserveAspectRatio="none" role="img" aria-label="{}" data-x="{:.9g} {:.9g}"'
        ' data-y="{:.9g} {:.9g}" data-of="{}"{}>{}</svg></div>'
        '<div class="x">{}</div><div class="soft unit right">{}</div></figure>'
    ).format(
        chart.title,
        Markup(' <span class="note">{}</span>').format(chart.note) if chart.note else "",
        chart.y_label,
        chart.height,
        _labels(y_ticks, y_low, y_high, "bottom"),
        GRID,
        GRID,
        f"{chart.title}: {chart.y_label} over {chart.x_label}",
        x_low,
        x_high,
        y_low,
        y_high,
        chart.x_label,
        "" if scatter else Markup(" data-hover"),
        Markup("").join(shapes),
        _labels(x_ticks, x_low, x_high, "left"),
        chart.x_label,
    )


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
    if len(x) < 3:
        return [slice(0, len(x))]
    step = np.diff(x)
    cuts = [0, *(np.flatnonzero(step > GAP * max(float(np.median(step)), 1e-12)) + 1).tolist(), len(x)]
    return [slice(a, b) for a, b in pairwise(cuts)]


class _View:
    """From values to units of the drawing."""

    def __init__(self, x_low: float, x_high: float, y_low: float, y_high: float) -> None:
        self._x, self._y = (x_low, GRID / (x_high - x_low)), (y_high, GRID / (y_high - y_low))

    def x(self, value: float) -> int:
        return round((value - self._x[0]) * self._x[1])

    def y(self, value: float) -> int:
        return round((self._y[0] - value) * self._y[1])

    def points(self, x: Array, y: Array) -> list[list[int]]:
        units = np.column_stack([(x - self._x[0]) * self._x[1], (self._y[0] - y) * self._y[1]])
        rounded: list[list[int]] = np.rint(units).astype(int).tolist()
        return rounded


def _curve(curve: Curve, view: _View) -> Markup:
    known = np.isfinite(curve.x) & np.isfinite(curve.y)
    x, y = curve.x[known], curve.y[known]
    if curve.kind == "points":
        # A line of no length with round ends is a dot that does not stretch.
        path = "".join(f"M{a} {b}h0" for a, b in view.points(*thinned(x, y)))
    elif curve.kind == "band" and curve.low is not None:
        low = curve.low[known]
        path = "".join(
            "M" + "L".join(f"{a} {b}" for a, b in view.points(*thinned(x[s], y[s]))
                           + view.points(*thinned(x[s], low[s]))[::-1]) + "Z"
            for s in stretches(x)
        )  # fmt: skip
    else:
        share = MOST_POINTS / max(len(x), 1)
        path = "".join(
            "M" + "L".join(f"{a} {b}" for a, b in view.points(*thinned(x[s], y[s], max(2, int(share * len(x[s]))))))
            for s in stretches(x) if s.stop > s.start
        )  # fmt: skip
    return Markup('<path class="{} {}" data-label="{}" d="{}"/>').format(curve.kind, curve.look, curve.label, path)


def _range(arrays: Sequence[Array]) -> tuple[float, float]:
    values = np.concatenate([values[np.isfinite(values)] for values in arrays]) if arrays else np.empty(0)
    return (float(values.min()), float(values.max())) if len(values) else (np.nan, np.nan)


def _apart(low: float, high: float) -> tuple[float, float]:
    """A range that is not empty."""
    least = 1e-6 * max(abs(low), abs(high), 1e-3)
    return (low, high) if high - low > least else (low - 0.5, high + 0.5)


def _ticks(low: float, high: float, most: int) -> list[float]:
    ticks = MaxNLocator(nbins=most, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)
    return [float(t) for t in ticks if low <= t <= high]


def _labels(ticks: Sequence[float], low: float, high: float, side: str) -> Markup:
    step = abs(ticks[1] - ticks[0]) if len(ticks) > 1 else 1.0
    decimals = next((d for d in range(7) if abs(round(step, d) - step) < 1e-9 * max(step, 1e-9) + 1e-12), 6)
    return Markup("").join(
        Markup('<span style="{}: {:.2f}%">{}</span>').format(
            side, 100.0 * (t - low) / (high - low), f"{t + 0.0:.{decimals}f}".replace("-", MINUS)
        )
        for t in ticks
    )
