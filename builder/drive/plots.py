"""The picture of a driven cycle as a file: inputs, losses and temperatures above each other."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from models.base.types import Array
from models.columns.curves import (
    LABELS,
    STYLE,
    Curves,
    draw_ambient,
    draw_curves,
    draw_inputs,
    loss_curves,
    members,
    temperature_curves,
    time_scale,
)
from models.quantities.quantities import GEARBOX_INPUTS, Input

DOTS: dict[str, Any] = {
    "linestyle": "none", "marker": "o", "markersize": 3.5, "markerfacecolor": "white", "markeredgecolor": "black",
    "markeredgewidth": 0.8,
}  # fmt: skip
MOST_DOTS = 30  # of a curve


def plot_cycle(
    path: Path,
    columns: Mapping[str, Array],
    *,
    title: str,
    groups: Mapping[str, tuple[str, ...]],
    inputs: Mapping[str, Input] = GEARBOX_INPUTS,
    reference: Mapping[str, Array] | None = None,
) -> None:
    """Draw a cycle with its losses and temperatures into a PNG, PDF or SVG.

    Parameters
    ----------
    path : Path
        File to write; its ending is the kind
    columns : mapping of column name to Array, shape (N,)
        A result in the columns of the file contract
    title : str
    groups : mapping of str to tuple of str
        Nodes that are alike, e.g. ``bearings``; of each group the first, the last and the hottest are drawn
    inputs : mapping of str to Input
        Of the machine; the first two that drive it are drawn
    reference : mapping of column name to Array, or None
        The result of the full model, drawn as small circles
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 8.5), layout="constrained")
        has_loss = "P_loss_W" in columns
        heights = (1.0, 1.6, 2.0) if has_loss else (1.0, 2.6)
        driving, *between, temperatures = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
        figure.suptitle(title, fontsize=11)
        scale, unit = time_scale(columns["time_s"])
        time = columns["time_s"] * scale
        moving = [i.quantity for i in inputs.values() if not i.quantity.is_temperature]
        labels = {q.column: q.label for q in moving or [i.quantity for i in inputs.values()]}
        draw_inputs(driving, time, columns, labels)
        hidden = {node for group in groups.values() for node in group[1:-1]} | {"air", "frame"}
        hidden -= {max(group, key=lambda node: columns[f"T_{node}_degC"].max()) for group in groups.values() if group}
        shown = {node: curve for node, curve in temperature_curves(columns).items() if node not in hidden}
        drawn = [(losses, "losses", loss_curves(columns)) for losses in between]
        for axes, what, curves in (*drawn, (temperatures, "temperatures", shown)):
            draw_curves(axes, time, curves, members(columns, what))
            axes.set_ylabel(LABELS[what])
            if reference is not None:
                _dots(axes, reference, curves, scale)
        draw_ambient(temperatures, time, columns)
        for losses in between:
            losses.set_ylim(bottom=0.0)
        temperatures.set_xlabel(f"Time in {unit}")
        temperatures.set_xlim(time[0], time[-1])
        if reference is not None:
            named = between[0] if between else temperatures
            named.plot([], [], **DOTS, label="full model")
            named.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        kind = path.suffix.removeprefix(".").lower() or "png"
        figure.savefig(path, format=kind, dpi=150, metadata={"Software": None} if kind == "png" else None)


def _dots(axes: Axes, reference: Mapping[str, Array], curves: Curves, scale: float) -> None:
    time = reference["time_s"] * scale
    every = max(1, len(time) // MOST_DOTS)
    for _, names in curves.values():
        dots = sum(reference[name] for name in names)
        axes.plot(time[::every], dots[::every], **DOTS)  # type: ignore[index]
