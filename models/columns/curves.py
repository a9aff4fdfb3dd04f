"""Columns as curves: labels with units, one colour per part, readable in print."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np

from models.base.errors import InputError, did_you_mean
from models.base.types import Array
from models.quantities.part_colours import AMBIENT, OTHER_HUES, part_colours
from models.quantities.quantities import GEARBOX_INPUTS, node_columns, node_of_channel, quantity_of_column

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes

STYLE: dict[Any, Any] = {
    "font.size": 9.0,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "svg.hashsalt": "gearbox",
}
PALETTE = OTHER_HUES
LINES = ("-", "--", "-.", ":")
TOTAL, TOTAL_COLOUR = "total", "black"
SIZE = (8.0, 4.0)  # inches of new axes
LABELS = {"temperatures": "Temperature in °C", "losses": "Power loss in W"}
LONG_S = 7200.0  # longer times are in hours
OF_STAGES = ("sliding", "rolling", "churning")  # ends of losses that every stage has; their sum has the name of one
Curves = dict[str, tuple[Array, tuple[str, ...]]]  # by label: values, and the columns that they are the sum of


@contextmanager
def axes_or_new(ax: Axes | None) -> Iterator[Axes]:
    """Yield the axes, or new ones in the style of all plots."""
    with mpl.rc_context(STYLE):
        if ax is None:
            from matplotlib import pyplot as plt  # so that a notebook shows the figure

            ax = plt.subplots(figsize=SIZE, layout="constrained")[1]
        yield ax


def time_scale(time: Array) -> tuple[float, str]:
    """Return factor and unit in which a time axis [s] is drawn."""
    return (1.0 / 3600.0, "h") if len(time) and time[-1] - time[0] > LONG_S else (1.0, "s")


def draw_columns(
    columns: Mapping[str, Array], what: str, *, only: Sequence[str], ax: Axes | None, parts: Sequence[str] = ()
) -> Axes:
    """Draw temperatures or losses; see :meth:`models.columns.columns.Columns.plot`.

    `parts` are all parts of the machine, on which the colours depend; by default those that have a column.
    """
    makers = {"temperatures": temperature_curves, "losses": loss_curves}
    if what not in makers:
        raise InputError(f"{what!r} cannot be drawn{did_you_mean(what, makers)}; {' and '.join(makers)} can")
    curves = makers[what](columns, only)
    x, label = _x_axis(columns)
    with axes_or_new(ax) as axes:
        draw_curves(axes, x, curves, parts or members(columns, what))
        if what == "temperatures" and not only and "air" not in curves:
            draw_ambient(axes, x, columns)
        axes.set(xlabel=label, ylabel=LABELS[what])
        if what == "losses":
            axes.set_ylim(bottom=0.0)
    return axes


def draw_curves(ax: Axes, x: Array, curves: Curves, parts: Sequence[str]) -> None:
    """Draw curves in the colours that they have among all `parts` of the machine, with a legend at the right."""
    colours = part_colours(parts)
    for label, (values, _) in curves.items():
        part = node_of_channel(label, colours)
        colour = TOTAL_COLOUR if label == TOTAL else colours.get(part) or part_colours([part])[part]
        width, marker = 2.0 if label == TOTAL else 1.4, "o" if len(x) == 1 else ""
        lines = ax.plot(x, np.atleast_2d(values).T, color=colour, linewidth=width, marker=marker)
        lines[0].set_label(label.replace("__", ", ").replace("_", " "))
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))


def draw_ambient(ax: Axes, x: Array, columns: Mapping[str, Array]) -> None:
    """Draw the ambient temperature, if there is a column of it."""
    if GEARBOX_INPUTS["T_ambient"].column in columns:
        values = columns[GEARBOX_INPUTS["T_ambient"].column]
        ax.plot(x, np.atleast_1d(values), color=AMBIENT, linestyle=":", linewidth=1.4, label="ambient")
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))


def members(columns: Mapping[str, Array], what: str) -> list[str]:
    """Return all nodes that have a temperature, or all losses, without the total."""
    if what == "temperatures":
        return list(node_columns(columns))
    names = [n for n in columns if n.startswith("P_loss_") and n.endswith("_W") and n != "P_loss_W"]
    return [n.removeprefix("P_loss_").removesuffix("_W") for n in names]


def temperature_curves(columns: Mapping[str, Array], only: Sequence[str] = ()) -> Curves:
    """Return the temperatures of nodes, without those of inputs.

    Raises
    ------
    InputError
        If there are none, or a named one is missing.
    """
    curves: Curves = {node: (columns[name], (name,)) for node, name in node_columns(columns).items()}
    return _chosen(curves, only, "temperature")


def loss_curves(columns: Mapping[str, Array], only: Sequence[str] = ()) -> Curves:
    """Return the losses, the total first; numbered twins (bearing_1, bearing_2 ...) make one curve.

    Raises
    ------
    InputError
        If there are none, or a named one is missing.
    """
    gathered: dict[str, tuple[str, ...]] = {TOTAL: ("P_loss_W",)} if "P_loss_W" in columns else {}
    for component in members(columns, "losses"):
        stem, _, number = component.rpartition("_")
        plural = stem if stem.endswith(OF_STAGES) else f"{stem}s"
        label = plural if number.isdigit() and component not in only else component
        gathered[label] = (*gathered.get(label, ()), f"P_loss_{component}_W")
    curves: Curves = {
        label: (np.sum([columns[n] for n in names], axis=0), names) for label, names in gathered.items()
    }  # fmt: skip
    return _chosen(curves, only, "loss")


def _chosen(curves: Curves, only: Sequence[str], what: str) -> Curves:
    if not curves:
        raise InputError(f"there is no {what} to draw")
    for name in only:
        if name not in curves:
            raise InputError(f"there is no {what} {name!r} to draw{did_you_mean(name, curves)}")
    return {name: curves[name] for name in only} if only else curves


def _x_axis(columns: Mapping[str, Array]) -> tuple[Array, str]:
    """Return values and label: time, else the first column that changes."""
    if "time_s" in columns:
        scale, unit = time_scale(columns["time_s"])
        return columns["time_s"] * scale, f"Time in {unit}"
    name = next((n for n, values in columns.items() if np.ptp(values) > 0.0), next(iter(columns)))
    return np.atleast_1d(columns[name]), axis_label(name)


def axis_label(column: str) -> str:
    """Return the label of an axis for a column; of an input that a definition names, its name.

    Examples
    --------
    >>> axis_label("speed_rpm"), axis_label("heater_power")
    ('Speed in 1/min', 'Heater power')
    """
    quantity = quantity_of_column(column)
    return short_label(column.replace("_", " ") if quantity is None else quantity.label)


def short_label(label: str) -> str:
    """Return the label of an input without that word."""
    short = label.removeprefix("Input ")
    return short[:1].upper() + short[1:]


def draw_inputs(ax: Axes, time: Array, columns: Mapping[str, Array], labels: Mapping[str, str]) -> None:
    """Draw the first two of the labelled columns that there are, the second with an axis at the right."""
    shown = [(column, label) for column, label in labels.items() if column in columns][:2]
    for place, (column, label), colour, line in zip((ax, None), shown, PALETTE, LINES, strict=False):
        at = place or ax.twinx()
        at.plot(time, columns[column], color=colour, linestyle=line)
        at.set_ylabel(short_label(label), color=colour)
        if place is None:
            at.spines["right"].set_visible(True)
            at.grid(visible=False)
