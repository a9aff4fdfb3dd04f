"""Figures as data: what is drawn is said once, and drawn into a page, a PNG and a CSV."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import cycle
from typing import Literal

import numpy as np

from builder.plots import PALETTE
from models.types import Array

Kind = Literal["line", "points", "rings", "area", "band", "bars"]
BLACK = "#000000"
MARKED = range(3, 13)  # lines of so few points get a mark at each


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """One curve of a panel.

    Attributes
    ----------
    label : str
        Its name in the legend; curves of one name have one colour and one entry over all panels of a figure
    x, y : Array, shape (N,)
        Of bars, `x` is their length and `y` their place
    kind : {"line", "points", "rings", "area", "band", "bars"}
        Areas are stacked in their order; a band goes from `low` to `y`
    low : Array, shape (N,), or None
    names : tuple of str
        A name for every point, which a reader sees when hovering; of bars, the names on the axis
    dashed : bool
    colour : str or None
        By default, the next one of the palette
    """

    label: str
    x: Array
    y: Array
    kind: Kind = "line"
    low: Array | None = None
    names: tuple[str, ...] = ()
    dashed: bool = False
    colour: str | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Plot:
    """Axes with curves; labels carry the unit. The y axis starts at zero unless told otherwise."""

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    x_log: bool = False
    y_log: bool = False
    square: bool = False
    from_zero: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class Map:
    """A quantity over two others as colours with contour lines.

    Attributes
    ----------
    x, y : Array, shape (M,) and (N,)
    z : Array, shape (N, M)
    z_label : str
    levels : tuple of float
        Contour lines, increasing; the colours go from the first to the last
    """

    title: str
    x_label: str
    y_label: str
    z_label: str
    x: Array
    y: Array
    z: Array
    levels: tuple[float, ...]


@dataclass(frozen=True)
class Knot:
    """A node of a drawn network: name, place, its group (for the colour), and what hovering tells."""

    name: str
    x: float
    y: float
    group: str
    tells: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Graph:
    """A network: knots by name, and edges (knot, knot, width from 0 to 1, what hovering tells)."""

    title: str
    knots: tuple[Knot, ...]
    edges: tuple[tuple[str, str, float, str], ...]


Panel = Plot | Map | Graph


@dataclass(frozen=True, kw_only=True, eq=False)
class Figure:
    """One or more panels under one caption and one legend."""

    name: str
    title: str
    caption: str
    panels: tuple[Panel, ...]

    def colours(self) -> dict[str, str]:
        """Return the colour of every legend entry, in order of appearance."""
        colours: dict[str, str] = {}
        following = cycle(PALETTE)
        for panel in self.panels:
            if isinstance(panel, Map):
                continue
            if isinstance(panel, Graph):
                labels: list[tuple[str, str | None]] = [(knot.group, None) for knot in panel.knots]
            else:
                labels = [(curve.label, curve.colour) for curve in panel.curves]
            for label, colour in labels:
                if label not in colours:
                    colours[label] = colour or next(following)
        return colours

    def rows(self) -> dict[str, list[object]]:
        """Return everything drawn as one long table: panel, curve, both quantities with their names and units."""
        table: dict[str, list[object]] = {
            key: [] for key in ("panel", "curve", "point", "x_quantity", "x", "y_quantity", "y", "y_low")
        }

        def add(*values: object) -> None:
            for column, value in zip(table.values(), values, strict=True):
                column.append(value)

        for panel in self.panels:
            if isinstance(panel, Graph):
                for a, b, _, tells in panel.edges:
                    add(panel.title, f"{a} - {b}", tells, "", None, "", None, None)
            elif isinstance(panel, Map):
                for (i, j), z in np.ndenumerate(panel.z):
                    add(
                        panel.title,
                        panel.z_label,
                        float(z),
                        panel.x_label,
                        float(panel.x[j]),
                        panel.y_label,
                        float(panel.y[i]),
                        None,
                    )
            else:
                for curve in panel.curves:
                    names = curve.names or ("",) * len(curve.x)
                    low = [None] * len(curve.x) if curve.low is None else curve.low.tolist()
                    for name, x, y, y_low in zip(names, curve.x.tolist(), curve.y.tolist(), low, strict=True):
                        add(panel.title, curve.label, name, panel.x_label, x, panel.y_label, y, y_low)
        return table
