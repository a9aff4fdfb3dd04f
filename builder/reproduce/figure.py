"""Figures as data: drawn by matplotlib into a PNG and an SVG, and tabulated as CSV."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from models.base.types import Array
from models.columns.curves import PALETTE, STYLE
from models.quantities.part_colours import part_colours

WIDTH, HEIGHT, BAR_HEIGHT = 4.6, 3.6, 0.26  # inches per panel, and per bar
MARKED = range(3, 13)  # number of points of a line that gets a mark at each
BLUE, RED, BLACK = PALETTE[0], PALETTE[1], "#000000"
Kind = Literal["line", "dashed", "points", "rings", "area", "band"]
COLUMNS = ["panel", "curve", "point", "x_quantity", "x", "y_quantity", "y", "y_low"]


@dataclass(frozen=True, eq=False)
class Curve:
    """Points (x, y); curves of one label have one colour and one legend entry in all panels of a figure.

    Attributes
    ----------
    label : str
    x, y : Array, shape (N,)
    kind : str
        Areas are stacked in their order; a band fills from `low` to `y`
    colour : str or None
        By default the next one of the palette
    low : Array, shape (N,), or None
    """

    label: str
    x: Array
    y: Array
    kind: Kind = "line"
    colour: str | None = None
    low: Array | None = None

    def draw(self, ax: Axes, colour: str, top: Array | float) -> None:
        """Draw into axes; an area stands on `top`."""
        style: dict[str, Any] = {"color": colour, "label": self.label}
        if self.kind == "area":
            ax.fill_between(self.x, top, top + self.y, linewidth=0.0, **style)
        elif self.kind == "band":
            ax.fill_between(self.x, 0.0 if self.low is None else self.low, self.y, linewidth=0.0, **style)
        elif self.kind == "rings":
            ax.plot(self.x, self.y, "o", markersize=6.0, fillstyle="none", markeredgewidth=0.8, **style)
        elif self.kind == "points":
            ax.plot(self.x, self.y, "o", markersize=2.6, markeredgecolor="white", markeredgewidth=0.25, **style)
        else:
            style["linestyle"] = "--" if self.kind == "dashed" else "-"
            style["marker"] = "o" if len(self.x) in MARKED else ""
            ax.plot(self.x, self.y, linewidth=1.4, markersize=3.5, **style)


@dataclass(frozen=True, eq=False)
class Plot:
    """Curves over one quantity; labels carry the unit."""

    title: str
    x_label: str
    y_label: str
    curves: Sequence[Curve]
    x_log: bool = False
    y_log: bool = False
    square: bool = False
    from_zero: bool = True

    def labels(self) -> Iterator[tuple[str, str | None]]:
        """Legend entries and their fixed colours."""
        return ((curve.label, curve.colour) for curve in self.curves)

    def draw(self, ax: Axes, colours: Mapping[str, str]) -> None:
        """Draw into axes."""
        ax.set(xlabel=self.x_label, ylabel=self.y_label)
        ax.set_xscale("log" if self.x_log else "linear")
        ax.set_yscale("log" if self.y_log else "linear")
        top: Array | float = 0.0
        for curve in self.curves:
            curve.draw(ax, colours[curve.label], top)
            top = top + curve.y if curve.kind == "area" else top
        if np.max(top) > 0.0:
            ax.margins(0.0)
        elif self.square:
            ax.set_aspect("equal", adjustable="box")
        elif self.from_zero and not self.y_log:
            ax.set_ylim(bottom=0.0)

    def rows(self) -> pd.DataFrame:
        """Every point of every curve."""
        quantities = {"x_quantity": self.x_label, "y_quantity": self.y_label}
        frames = [
            pd.DataFrame({"x": c.x, "y": c.y, "y_low": c.low}).assign(curve=c.label, **quantities) for c in self.curves
        ]
        return pd.concat(frames)


@dataclass(frozen=True, eq=False)
class Bars:
    """Horizontal bars: a group of one bar per label for every name."""

    title: str
    x_label: str
    names: Sequence[str]
    lengths: Mapping[str, Array]

    def labels(self) -> Iterator[tuple[str, str | None]]:
        """Legend entries."""
        return ((label, None) for label in self.lengths)

    def draw(self, ax: Axes, colours: Mapping[str, str]) -> None:
        """Draw into axes."""
        thickness = 0.8 / len(self.lengths)
        place = np.arange(len(self.names))
        for i, (label, length) in enumerate(self.lengths.items()):
            offset = (i - 0.5 * (len(self.lengths) - 1)) * thickness
            ax.barh(place + offset, length, thickness, color=colours[label], label=label)
        ax.set(xlabel=self.x_label, yticks=place, yticklabels=self.names)
        ax.grid(visible=False, axis="y")
        ax.margins(y=0.02)
        ax.invert_yaxis()

    def rows(self) -> pd.DataFrame:
        """Every bar."""
        place = np.arange(len(self.names))
        return pd.concat(
            pd.DataFrame({"x": length, "y": place, "point": self.names}).assign(curve=label, x_quantity=self.x_label)
            for label, length in self.lengths.items()
        )


@dataclass(frozen=True, eq=False)
class Map:
    """A quantity z, shape (N, M), over y, shape (N,), and x, shape (M,): filled contours at increasing levels."""

    title: str
    x_label: str
    y_label: str
    z_label: str
    x: Array
    y: Array
    z: Array
    levels: Sequence[float]

    def labels(self) -> Iterator[tuple[str, str | None]]:
        """No legend entries: the colour bar has the levels."""
        return iter(())

    def draw(self, ax: Axes, _colours: Mapping[str, str]) -> None:
        """Draw into axes; every step between two levels gets the same share of the colours."""
        norm = mpl.colors.BoundaryNorm(self.levels, mpl.colormaps["cividis"].N, extend="max")
        drawn = ax.contourf(self.x, self.y, self.z, self.levels, cmap="cividis", norm=norm, extend="max")
        lines = ax.contour(self.x, self.y, self.z, self.levels[1:], colors="white", linewidths=0.5)
        ax.clabel(lines, fontsize=7, fmt="%g")
        ax.set(xlabel=self.x_label, ylabel=self.y_label)
        ax.grid(visible=False)
        ax.figure.colorbar(drawn, ax=ax, label=self.z_label)

    def rows(self) -> pd.DataFrame:
        """Every grid point."""
        x, y = np.meshgrid(self.x, self.y)
        columns = {"point": self.z.ravel(), "x": x.ravel(), "y": y.ravel()}
        return pd.DataFrame(columns).assign(curve=self.z_label, x_quantity=self.x_label, y_quantity=self.y_label)


@dataclass(frozen=True, eq=False)
class Graph:
    """Nodes as (x, y) by name, and links as (node, node, width from 0 to 1, value in words)."""

    title: str
    nodes: Mapping[str, tuple[float, float]]
    links: Sequence[tuple[str, str, float, str]]

    def labels(self) -> Iterator[tuple[str, str | None]]:
        """No legend entries: every node has its name in it."""
        return iter(())

    def draw(self, ax: Axes, _colours: Mapping[str, str]) -> None:
        """Draw into axes."""
        for a, b, width, _ in self.links:
            (x_a, y_a), (x_b, y_b) = self.nodes[a], self.nodes[b]
            ax.plot(
                [x_a, x_b], [y_a, y_b], color="#8A8A8A", linewidth=0.5 + 4.0 * width, zorder=1, solid_capstyle="round"
            )
        for name, colour in part_colours(self.nodes).items():
            box: dict[str, Any] = {"boxstyle": "round,pad=0.45", "facecolor": "white", "edgecolor": colour,
                                   "linewidth": 2.5}  # fmt: skip
            x, y = self.nodes[name]
            ax.text(x, y, name.replace("_", " "), bbox=box, zorder=2, ha="center", va="center", fontsize=8)
        ax.set_axis_off()
        ax.set_xlim(*_around([x for x, _ in self.nodes.values()]))
        ax.set_ylim(*_around([y for _, y in self.nodes.values()]))

    def rows(self) -> pd.DataFrame:
        """Every link."""
        return pd.DataFrame([{"curve": f"{a} - {b}", "point": value} for a, b, _, value in self.links])


def _around(values: Sequence[float]) -> tuple[float, float]:
    """A range with room for the names at its ends."""
    apart = 0.1 * (max(values) - min(values))
    return min(values) - apart, max(values) + apart


@dataclass(frozen=True, eq=False)
class Figure:
    """One or more panels under one caption and one legend; `name` is that of its files."""

    name: str
    title: str
    caption: str
    panels: Sequence[Plot | Bars | Map | Graph]

    def draw(self) -> Canvas:
        """Draw all panels in rows of at most three."""
        count = len(self.panels)
        columns = min(count, 2 if count % 3 else 3)
        rows = -(-count // columns)
        height = max(BAR_HEIGHT * len(p.names) + 1.0 if isinstance(p, Bars) else HEIGHT for p in self.panels)
        colours = self._colours()
        in_row = 3 if columns == 1 else 4
        with mpl.rc_context(STYLE):
            size = WIDTH * max(columns, 1.4), height * rows + 0.25 * -(-len(colours) // in_row) + 0.5
            canvas = Canvas(figsize=size, layout="constrained")
            canvas.suptitle(self.title, fontsize=11)
            axes = canvas.subplots(rows, columns, squeeze=False).ravel()
            handles: dict[str, Any] = {}
            for ax, panel in zip(axes, self.panels, strict=False):
                ax.set_title(panel.title, fontsize=9.5)
                panel.draw(ax, colours)
                found, labels = ax.get_legend_handles_labels()
                handles = dict(zip(labels, found, strict=True)) | handles
            for spare in axes[count:]:
                spare.set_visible(False)
            if len(colours) > 1:
                shown = [handles[label] for label in colours]
                canvas.legend(shown, [*colours], loc="outside lower center", ncols=min(len(colours), in_row))
        return canvas

    def rows(self) -> pd.DataFrame:
        """Everything drawn as one long table: panel, curve, both quantities with their names and units."""
        table = pd.concat(panel.rows().assign(panel=panel.title) for panel in self.panels)
        return table.reindex(columns=COLUMNS)

    def _colours(self) -> dict[str, str]:
        colours: dict[str, str] = {}
        following = cycle(PALETTE)
        for label, colour in (entry for panel in self.panels for entry in panel.labels()):
            if label not in colours:
                colours[label] = colour or next(following)
        return colours
