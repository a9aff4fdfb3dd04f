"""Figures as PNG, in the style of the house's plots."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure as Canvas
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from builder.plots import STYLE
from builder.reproduce.figure import MARKED, Curve, Figure, Graph, Map, Plot
from models.types import Array

WIDTH, HEIGHT = 4.6, 3.6  # inches per panel
BAR_INCHES = 0.26
COLOURS = "cividis"  # told apart with any colour vision
BAR_THICKNESS = 0.8


def write_png(figure: Figure, path: Path) -> None:
    """Draw a figure into a PNG file."""
    count = len(figure.panels)
    columns = 1 if count == 1 or _wide(figure) else 2 if count % 3 else 3
    rows = -(-len(figure.panels) // columns)
    height = max(HEIGHT, *(_bar_height(panel) for panel in figure.panels))
    colours = figure.colours()
    style: Any = STYLE
    with mpl.rc_context(style):
        legend_rows = -(-len(colours) // (3 if columns == 1 else 4))
        size = (WIDTH * max(columns, 1.4), height * rows + 0.25 * legend_rows + 0.5)
        canvas = Canvas(figsize=size, layout="constrained")
        canvas.suptitle(figure.title, fontsize=11)
        axes = np.atleast_1d(canvas.subplots(rows, columns, squeeze=False)).ravel()
        for spare in axes[len(figure.panels) :]:
            spare.set_visible(False)
        handles: dict[str, Line2D | Patch] = {}
        for ax, panel in zip(axes, figure.panels, strict=False):
            ax.set_title(panel.title, fontsize=9.5)
            if isinstance(panel, Map):
                _map(canvas, ax, panel)
            elif isinstance(panel, Graph):
                _graph(ax, panel, colours, handles)
            else:
                _plot(ax, panel, colours, handles)
        if len(handles) > 1:
            canvas.legend(
                handles=list(handles.values()),
                loc="outside lower center",
                ncols=min(len(handles), 3 if columns == 1 else 4),
            )
        canvas.savefig(path, format="png", dpi=150, metadata={"Software": None})


def _wide(figure: Figure) -> bool:
    return any(isinstance(panel, Graph) or _bar_height(panel) > 0.0 for panel in figure.panels)


def _bar_height(panel: object) -> float:
    if not isinstance(panel, Plot) or panel.curves[0].kind != "bars":
        return 0.0
    return BAR_INCHES * len(panel.curves[0].y) + 1.0


def _plot(ax: Axes, panel: Plot, colours: dict[str, str], handles: dict[str, Line2D | Patch]) -> None:
    ax.set_xlabel(panel.x_label)
    ax.set_ylabel(panel.y_label)
    if panel.x_log:
        ax.set_xscale("log")
    if panel.y_log:
        ax.set_yscale("log")
    bars = [curve for curve in panel.curves if curve.kind == "bars"]
    top: Array | float = 0.0  # of the areas so far
    for curve in panel.curves:
        colour = colours[curve.label]
        if curve.kind == "area":
            ax.fill_between(curve.x, top, top + curve.y, color=colour, linewidth=0.0)
            top = top + curve.y
        elif curve.kind == "bars":
            _bars(ax, curve, colour, bars.index(curve), len(bars))
        else:
            _curve(ax, curve, colour)
        handles.setdefault(curve.label, _handle(curve, colour))
    if panel.from_zero and not (panel.y_log or bars or panel.square):
        ax.set_ylim(bottom=0.0)
    if np.max(top) > 0.0:
        ax.margins(x=0.0)
        ax.set_ylim(0.0, float(np.max(top)))
    if panel.square:
        ax.set_aspect("equal", adjustable="box")


def _curve(ax: Axes, curve: Curve, colour: str) -> None:
    if curve.kind == "band":
        ax.fill_between(curve.x, 0.0 if curve.low is None else curve.low, curve.y, color=colour, linewidth=0.0)
    elif curve.kind == "rings":
        ax.plot(
            curve.x,
            curve.y,
            linestyle="none",
            marker="o",
            markersize=6.0,
            fillstyle="none",
            color=colour,
            markeredgewidth=0.8,
        )
    elif curve.kind == "points":
        ax.plot(
            curve.x,
            curve.y,
            linestyle="none",
            marker="o",
            markersize=2.6,
            markerfacecolor=colour,
            markeredgecolor="white",
            markeredgewidth=0.25,
        )
    else:
        mark = "o" if len(curve.x) in MARKED else ""
        line = "--" if curve.dashed else "-"
        ax.plot(curve.x, curve.y, color=colour, linestyle=line, linewidth=1.4, marker=mark, markersize=3.5)


def _bars(ax: Axes, curve: Curve, colour: str, index: int, count: int) -> None:
    thickness = BAR_THICKNESS / count
    ax.barh(curve.y + (index - 0.5 * (count - 1)) * thickness, curve.x, thickness, color=colour)
    ax.set_yticks(curve.y, curve.names)
    ax.grid(visible=False, axis="y")
    ax.margins(y=0.02)
    ax.invert_yaxis() if not ax.yaxis_inverted() else None


def _handle(curve: Curve, colour: str) -> Line2D | Patch:
    if curve.kind in ("area", "band", "bars"):
        return Patch(color=colour, label=curve.label)
    if curve.kind == "rings":
        return Line2D(
            [], [], linestyle="none", marker="o", markersize=6.0, fillstyle="none", color=colour, label=curve.label
        )
    if curve.kind == "points":
        return Line2D([], [], linestyle="none", marker="o", markersize=4.0, color=colour, label=curve.label)
    return Line2D([], [], color=colour, linestyle="--" if curve.dashed else "-", label=curve.label)


def _map(canvas: Canvas, ax: Axes, panel: Map) -> None:
    ax.set_xlabel(panel.x_label)
    ax.set_ylabel(panel.y_label)
    norm = BoundaryNorm(panel.levels, mpl.colormaps[COLOURS].N, extend="max")
    drawn = ax.contourf(panel.x, panel.y, panel.z, levels=panel.levels, cmap=COLOURS, norm=norm, extend="max")
    lines = ax.contour(panel.x, panel.y, panel.z, levels=panel.levels[1:], colors="white", linewidths=0.5)
    ax.clabel(lines, fontsize=7, fmt="%g")
    ax.grid(visible=False)
    canvas.colorbar(drawn, ax=ax, label=panel.z_label)


def _graph(ax: Axes, panel: Graph, colours: dict[str, str], handles: dict[str, Line2D | Patch]) -> None:
    place = {knot.name: (knot.x, knot.y) for knot in panel.knots}
    for a, b, width, _ in panel.edges:
        (x_1, y_1), (x_2, y_2) = place[a], place[b]
        ax.plot([x_1, x_2], [y_1, y_2], color="#8A8A8A", linewidth=0.5 + 4.0 * width, zorder=1, solid_capstyle="round")
    for knot in panel.knots:
        ax.text(
            knot.x,
            knot.y,
            knot.name.replace("_", " "),
            ha="center",
            va="center",
            fontsize=8,
            color="white",
            zorder=2,
            bbox={"boxstyle": "round,pad=0.45", "facecolor": colours[knot.group], "edgecolor": "none"},
        )
        handles.setdefault(knot.group, Patch(color=colours[knot.group], label=knot.group))
    ax.set_axis_off()
    ax.margins(0.1)
