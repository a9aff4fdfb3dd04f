"""Plots that users show to others: labels with units, colour-blind safe, readable in print."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from models.base.types import Array
from models.quantities.part_colours import AMBIENT, part_colours
from models.quantities.quantities import GEARBOX_INPUTS, Input

# Okabe and Ito's palette: distinct for people with any colour vision, and in grey by order of lightness.
PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#6B6B6B")
LINES = ("-", "--", "-.", ":")
TOTAL = "total"
AMBIENT_COLUMN = "T_ambient_degC"
DOTS: dict[str, Any] = {
    "linestyle": "none", "marker": "o", "markersize": 3.5, "markerfacecolor": "white", "markeredgecolor": "black",
    "markeredgewidth": 0.8,
}  # fmt: skip
STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "svg.hashsalt": "gearbox",
}


def plot_cycle(
    path: Path,
    columns: Mapping[str, Array],
    *,
    title: str,
    groups: Mapping[str, tuple[str, ...]],
    inputs: Mapping[str, Input] = GEARBOX_INPUTS,
    reference: Mapping[str, Array] | None = None,
    reference_name: str = "full model",
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
        Nodes that are drawn together, e.g. ``bearings``; of each group the first and the last are drawn
    inputs : mapping of str to Input
        Of the machine; the first two that drive it are drawn
    reference : mapping of column name to Array, or None
        A second result, drawn as small circles
    reference_name : str
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 8.5), layout="constrained")
        has_loss = "P_loss_W" in columns
        heights = (1.0, 1.6, 2.0) if has_loss else (1.0, 2.6)
        driving, *between, temperatures = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
        figure.suptitle(title, fontsize=11)
        scale, unit = _time_scale(columns["time_s"])
        time = columns["time_s"] * scale
        _inputs(driving, time, columns, inputs)
        for losses in between:
            shown = _loss_curves(columns)
            _curves(losses, time, shown, reference, scale, part_colours(shown) | {TOTAL: "black"})
            losses.set_ylabel("Power loss in W")
            losses.set_ylim(bottom=0.0)
        nodes = _nodes(columns)
        _curves(temperatures, time, _temperature_curves(columns, groups), reference, scale, part_colours(nodes))
        if AMBIENT_COLUMN in columns:
            temperatures.plot(
                time, columns[AMBIENT_COLUMN], color=AMBIENT, linestyle=":", linewidth=1.4, label="ambient"
            )
            temperatures.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        temperatures.set_ylabel("Temperature in °C")
        temperatures.set_xlabel(f"Time in {unit}")
        temperatures.set_xlim(time[0], time[-1])
        if reference is not None:
            named = between[0] if between else temperatures
            named.plot([], [], **DOTS, label=reference_name)
            named.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        kind = path.suffix.removeprefix(".").lower() or "png"
        figure.savefig(path, format=kind, dpi=150, metadata={"Software": None} if kind == "png" else None)


def _time_scale(time: Array) -> tuple[float, str]:
    return (1.0 / 3600.0, "h") if time[-1] - time[0] > 7200.0 else (1.0, "s")


def _inputs(axes: Axes, time: Array, columns: Mapping[str, Array], inputs: Mapping[str, Input]) -> None:
    """Draw the first two inputs that are no temperature; without any the first one."""
    driving = [given for given in inputs.values() if not given.quantity.is_temperature] or list(inputs.values())
    shown = [given for given in driving if given.column in columns][:2]
    for place, given, colour, line in zip((axes, None), shown, PALETTE, LINES, strict=False):
        at = place or axes.twinx()
        at.plot(time, columns[given.column], color=colour, linestyle=line)
        label = given.quantity.label.removeprefix("Input ")
        at.set_ylabel(label[:1].upper() + label[1:], color=colour)
        if place is None:
            at.spines["right"].set_visible(True)
            at.grid(visible=False)


def _loss_curves(columns: Mapping[str, Array]) -> dict[str, tuple[Array, tuple[str, ...]]]:
    """Curves by label: values, and the columns that they are the sum of."""
    parts = [name for name in columns if name.startswith("P_loss_") and name != "P_loss_W"]
    gathered: dict[str, tuple[str, ...]] = {TOTAL: ("P_loss_W",)}
    for name in parts:
        # Numbered twins (bearing_1, bearing_2 ...) make one curve.
        component = name.removeprefix("P_loss_").removesuffix("_W")
        stem, _, number = component.rpartition("_")
        label = f"{stem}s" if number.isdigit() else component
        gathered[label] = (*gathered.get(label, ()), name)
    return {label: (sum(columns[n] for n in names), names) for label, names in gathered.items()}  # type: ignore[misc]


def _nodes(columns: Mapping[str, Array]) -> list[str]:
    """All nodes of the machine, in the order of its network."""
    found = (name for name in columns if name.startswith("T_") and name.endswith("_degC"))
    return [name[2:-5] for name in found if name != AMBIENT_COLUMN]


def _temperature_curves(
    columns: Mapping[str, Array], groups: Mapping[str, tuple[str, ...]]
) -> dict[str, tuple[Array, tuple[str, ...]]]:
    nodes = _nodes(columns)
    hidden = {node for group in groups.values() for node in group[1:-1]} | {"air", "frame"}
    shown = [node for node in nodes if node not in hidden]
    return {node: (columns[f"T_{node}_degC"], (f"T_{node}_degC",)) for node in shown}


def _curves(
    axes: Axes,
    time: Array,
    curves: Mapping[str, tuple[Array, tuple[str, ...]]],
    reference: Mapping[str, Array] | None,
    scale: float,
    colours: Mapping[str, str],
) -> None:
    for label, (values, names) in curves.items():
        width = 2.0 if label == TOTAL else 1.4
        axes.plot(time, values, color=colours[label], linewidth=width, label=label.replace("_", " "))
        if reference is not None:
            times, dots = reference["time_s"] * scale, sum(reference[name] for name in names)
            every = max(1, len(times) // 30)
            axes.plot(times[::every], dots[::every], **DOTS)  # type: ignore[index]
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
