"""Charts over time: readings next to the simulations of every sensor, and the errors that are left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from diagnosis.engine.predict import rmse
from diagnosis.forward.grid import stands_for
from diagnosis.report.chart import (
    DASHES,
    FONT_PX,
    MOST_OF_ALL,
    MOST_POINTS,
    Chart,
    averaged,
    axis,
    curve_points,
    dressed,
    limits,
    row_titles,
)
from diagnosis.report.wording import name, time_scale
from diagnosis.results.number_format import fixed
from diagnosis.results.predicted_run import PredictedRun
from diagnosis.results.result import Diagnosis
from diagnosis.results.result_parts import MODELS, error_unit
from models.base.types import Array
from models.quantities.part_colours import AMBIENT, CALIBRATED, DELIVERED, MEASURED, part_colours
from models.quantities.quantities import TOTAL_LOSS, Input, node_of_channel

STAGES = tuple((label, model) for model, label in MODELS.items())
LINES: Mapping[str, dict[str, Any]] = {
    "before": {"dash": "dot", "width": 1.6, "color": DELIVERED},
    "calibrated": {"dash": "dash", "width": 1.6, "color": CALIBRATED},
    "after": {"width": 2.0, "color": MEASURED},
}
ROW_PX, INPUT_PX, ERROR_PX, EDGE_PX, BETWEEN_PX = 150, 84, 220, 130, 34
SHADE: Mapping[str, Any] = {"type": "rect", "fillcolor": "#9aa1a9", "line": {"width": 0}, "layer": "below"}
ERROR_POINTS = 240
BAND_SD = 2.0
FAR = 4.0  # times the calibrated model's error: the model as delivered may then leave its chart
MOST_INPUTS = 4
AIR = "surroundings"


@dataclass(frozen=True, kw_only=True, eq=False)
class Shown:
    """One recording, all its gap-free parts one after another.

    Attributes
    ----------
    time : Array, shape (rows,)
        [s]
    inputs, measured : mapping of str to Array, shape (rows,)
    models : mapping of str to mapping of channel to Array, shape (rows,)
        Simulations of ``before``, ``calibrated`` and ``after``
    unscored : sequence of (from, to)
        Stretches that served to find start temperatures, [s]
    weights : Array, shape (rows,)
        Of every row in a mean over its part, [s]
    """

    title: str
    time: Array
    inputs: Mapping[str, Array]
    measured: Mapping[str, Array]
    models: Mapping[str, Mapping[str, Array]]
    unscored: Sequence[tuple[float, float]]
    weights: Array

    @property
    def scale(self) -> tuple[float, str]:
        """Seconds of the unit of its time axis, and that unit."""
        return time_scale(float(self.time[-1]))

    def error(self, model: str, channel: str) -> Array:
        """Simulated less measured, shape (rows,)."""
        return self.models[model][channel] - self.measured[channel]


@dataclass(frozen=True, kw_only=True, eq=False)
class Choice:
    """A recording to choose in a chart: curves with their rows of axes, and properties of the layout."""

    title: str
    traces: Sequence[tuple[int, go.Scatter]]
    look: Mapping[str, Any]


def stages_of(diagnosis: Diagnosis) -> tuple[tuple[str, str], ...]:
    """Return the models to compare; the last one only if it has more than the calibrated one."""
    return STAGES if diagnosis.has_correction else STAGES[:2]


def recordings_of(diagnosis: Diagnosis) -> list[Shown]:
    """All recordings, held-out ones first: they are what counts."""
    pieces: dict[str, list[PredictedRun]] = {}
    for run in sorted(diagnosis.courses, key=lambda run: not run.held_out):
        pieces.setdefault(f"{run.recording} ({'held out' if run.held_out else 'learned from'})", []).append(run)
    return [_joined(title, runs) for title, runs in pieces.items()]


def measured_and_simulated(diagnosis: Diagnosis) -> Chart:
    """Inputs, surroundings, and per sensor what was measured and simulated, of one recording at a time."""
    shown = recordings_of(diagnosis)
    channels = list(shown[0].measured)
    driven = _inputs(diagnosis, shown)
    inputs = [key for key, given in driven.items() if not given.quantity.is_temperature][:MOST_INPUTS]
    airs = [key for key, given in driven.items() if given.quantity.is_temperature]
    rows = [*inputs, *([AIR] if airs else []), *channels]
    stages = stages_of(diagnosis)
    colours = _colours(diagnosis, channels)
    most = min(MOST_POINTS, MOST_OF_ALL // max(len(shown) * len(channels) * (len(stages) + 1), 1))
    marks = {"measured": {"mode": "markers", "marker": {"color": MEASURED, "size": 5}}} | {
        stage: {"mode": "lines", "line": LINES[look]} for stage, look in stages
    }
    choices = []
    for one in shown:
        traces = []
        for row, key in enumerate(rows, 1):
            curves = (
                _surroundings(one, airs) if key == AIR
                else _channel(one, key, stages, colours[key], most) if key in channels
                else [_line(one, one.inputs[key], name(key), {"color": MEASURED, "width": 1.4}, MOST_POINTS)]
            )  # fmt: skip
            traces += [(row, curve.update(showlegend=False)) for curve in curves]
        look = _look(diagnosis, one, rows, channels, airs, stages)
        choices.append(Choice(title=one.title, traces=traces, look=look))
    figure = _one_at_a_time(
        [INPUT_PX] * (len(rows) - len(channels)) + [ROW_PX] * len(channels), choices,
        legend=[go.Scatter(x=[None], y=[None], name=label, legendgroup=label, **of) for label, of in marks.items()],
    )  # fmt: skip
    order = " → ".join(stage for stage, _ in stages)
    return Chart(
        name="courses", title="Measured and simulated", figure=figure,
        note=f"Behind each name: the RMSE {order}. The solid line has the colour of its part. Grey ground: the first "
             "minutes, from which the start temperatures come; they do not count. The model as delivered may leave the "
             "panel.",
        alt=f"Measured readings and free-running simulations of {', '.join(map(name, channels))} over time, with "
            f"{', '.join(map(name, [*inputs, *airs]))}; first shown: {shown[0].title}. {_sizes_told(shown[0], stages)}",
    )  # fmt: skip


def errors_over_time(diagnosis: Diagnosis) -> Chart:
    """Errors of all sensors on one scale: calibrated, and corrected."""
    shown = recordings_of(diagnosis)
    channels = [channel for channel in shown[0].measured if channel != TOTAL_LOSS]
    stages = stages_of(diagnosis)[-2:]
    has_loss = TOTAL_LOSS in shown[0].measured
    titles = [f"<b>{stage.capitalize()}</b>, simulated less measured in K" for stage, _ in stages]
    titles += ["<b>Total loss</b>, simulated less measured in W"] * has_loss
    colours, choices = _colours(diagnosis, channels), []
    for one in shown:
        traces, means = list[tuple[int, go.Scatter]](), list[Array]()
        for row, (_, look) in enumerate(stages, 1):
            for channel in channels:
                error = one.error(look, channel)
                means.append(averaged(one.time, error, ERROR_POINTS)[1])
                faulty = " (faulty sensor)" if channel in diagnosis.faulty else ""
                line = {"color": colours[channel], "width": 1.5, "dash": "dot" if faulty else "solid"}
                trace = _line(one, error, name(channel) + faulty, line, ERROR_POINTS, mean=True)
                traces.append((row, trace.update(legendgroup=channel, showlegend=row == 1)))
        for stage, look in stages if has_loss else ():
            trace = _line(one, one.error(look, TOTAL_LOSS), stage, LINES[look], ERROR_POINTS, mean=True)
            traces.append((len(titles), trace.update(showlegend=False)))
        scale = limits([*means, BAND_SD * diagnosis.noise_K * np.array([-1.0, 1.0])])
        ranges: dict[str, Any] = {f"{axis('yaxis', row)}.range": scale for row in range(1, len(stages) + 1)}
        if has_loss:
            ranges[f"{axis('yaxis', len(titles))}.autorange"] = True
        choices.append(Choice(title=one.title, traces=traces, look={
            "annotations": row_titles(titles), **_x_axis(one, len(titles)), **ranges,
            "shapes": [*_noise(diagnosis, len(stages)), *_unscored(one, len(titles))],
        }))  # fmt: skip
    figure = _one_at_a_time([ERROR_PX] * len(stages) + [ROW_PX] * has_loss, choices)
    figure.update_yaxes(matches="y", row=2, col=1)
    band = f" Band: ± {BAND_SD:g} standard deviations of the noise." if diagnosis.noise_K > 0.0 else ""
    return Chart(
        name="errors", title="Errors over time", figure=figure,
        note=f"Means over short stretches; both panels have one scale.{band}",
        alt=f"Errors of {', '.join(map(name, channels))} over time, {' and '.join(s for s, _ in stages)}; first shown: "
            f"{shown[0].title}. {_sizes_told(shown[0], stages)}",
    )  # fmt: skip


# ---------------------------------------------------------------------- parts


def _joined(title: str, pieces: Sequence[PredictedRun]) -> Shown:
    """Pieces of one recording one after another; a line is interrupted between them, where rows are missing."""

    def joined(get: str) -> dict[str, Array]:
        return {key: np.concatenate([getattr(piece, get)[key] for piece in pieces]) for key in getattr(pieces[0], get)}

    starts = [(float(piece.time[0]), piece.counts_from_s) for piece in pieces]
    return Shown(
        title=title, time=np.concatenate([piece.time for piece in pieces]), inputs=joined("inputs"),
        measured=joined("measured"), models={model: joined(model) for model in MODELS},
        unscored=[(a, b) for a, b in starts if b > a],
        weights=np.concatenate([stands_for(piece.time) for piece in pieces]),
    )  # fmt: skip


def _colours(diagnosis: Diagnosis, channels: Sequence[str]) -> dict[str, str]:
    """Colour of the part that each channel measures; the loss has that of readings."""
    parts = diagnosis.network.node_names
    colours = part_colours(parts)
    return {channel: colours.get(node_of_channel(channel, parts), MEASURED) for channel in channels}


def _inputs(diagnosis: Diagnosis, shown: Sequence[Shown]) -> dict[str, Input]:
    """Inputs that are not 0 all the time: a machine without a shaft has zeros."""
    known = diagnosis.network.inputs
    return {key: known[key] for key in shown[0].inputs
            if key in known and any(np.any(one.inputs[key]) for one in shown)}  # fmt: skip


def _one_at_a_time(
    heights: Sequence[int], choices: Sequence[Choice], *, legend: Sequence[go.Scatter] = ()
) -> go.Figure:
    """Rows of axes that show the first recording, and a menu to choose another one.

    Parameters
    ----------
    heights : sequence of int
        Of the rows, [px]
    legend : sequence of go.Scatter
        Shown with every recording
    """
    height = sum(heights) + BETWEEN_PX * len(heights)
    figure = make_subplots(
        rows=len(heights), cols=1, shared_xaxes=True, row_heights=[float(one) for one in heights],
        vertical_spacing=BETWEEN_PX / height,
    )  # fmt: skip
    for trace in legend:
        figure.add_trace(trace, row=1, col=1)
    for choice in choices:
        for row, trace in choice.traces:
            figure.add_trace(trace.update(visible=choice is choices[0]), row=row, col=1)
    owners = [choice for choice in choices for _ in choice.traces]
    buttons = [
        {"label": choice.title, "method": "update",
         "args": [{"visible": [True] * len(legend) + [owner is choice for owner in owners]}, choice.look]}
        for choice in choices
    ]  # fmt: skip
    menu = {"buttons": buttons, "x": 0.0, "xanchor": "left", "y": 1.0, "yanchor": "top", "pad": {"t": -120, "b": 0},
            "bgcolor": "white", "font": {"size": FONT_PX}}  # fmt: skip
    above = {"orientation": "h", "x": 0.0, "xanchor": "left", "y": 1.0 + 22.0 / height, "yanchor": "bottom"}
    dressed(figure, height + EDGE_PX, updatemenus=[menu] if len(buttons) > 1 else [], legend=above,
            margin={"l": 10, "r": 14, "t": EDGE_PX, "b": 10}, hovermode="x unified")  # fmt: skip
    return figure.update_layout(choices[0].look, overwrite=False)


def _channel(
    one: Shown, channel: str, stages: Sequence[tuple[str, str]], colour: str, most: int
) -> list[go.Scatter]:  # fmt: skip
    x, y = curve_points(one.time / one.scale[0], one.measured[channel], most)
    dots = go.Scatter(x=x, y=y, mode="markers", marker={"color": MEASURED, "size": 3, "opacity": 0.55},
                      name="measured", legendgroup="measured")  # fmt: skip
    lines = []
    for stage, look in stages:
        line = {**LINES[look], "color": colour} if look == "after" else LINES[look]
        lines.append(_line(one, one.models[look][channel], stage, line, most).update(legendgroup=stage))
    return [dots, *lines]


def _surroundings(one: Shown, airs: Sequence[str]) -> list[go.Scatter]:
    return [
        _line(one, one.inputs[key], name(key), {"color": AMBIENT, "width": 1.6, "dash": dash}, MOST_POINTS)
        for key, dash in zip(airs, DASHES, strict=False)
    ]


def _line(
    one: Shown, values: Array, label: str, line: Mapping[str, Any], most: int, *, mean: bool = False
) -> go.Scatter:  # fmt: skip
    x = one.time / one.scale[0]
    if mean:
        x, values = averaged(x, values, most)
    x, y = curve_points(x, values, most)
    return go.Scatter(x=x, y=y, mode="lines", line=dict(line), name=label, hovertemplate="%{y:.4g}")


def _errors(one: Shown, channel: str, stages: Sequence[tuple[str, str]]) -> list[float]:
    """RMSE of the rows that count, by stage."""
    rows = ~np.any([(one.time >= a) & (one.time < b) for a, b in one.unscored] or [one.time < -np.inf], axis=0)
    return [float(rmse(one.error(look, channel)[rows, None], one.weights[rows])[0]) for _, look in stages]


def _look(
    diagnosis: Diagnosis, one: Shown, rows: Sequence[str], channels: Sequence[str], airs: Sequence[str],
    stages: Sequence[tuple[str, str]],
) -> dict[str, Any]:  # fmt: skip
    """Titles, ranges and shades of the axes for one recording."""
    titles: list[str] = []
    look: dict[str, Any] = {}
    for row, key in enumerate(rows, 1):
        if key not in channels:
            labels = [diagnosis.network.inputs[one].quantity.label for one in (airs if key == AIR else [key])]
            what = ", ".join(label.rpartition(" in ")[0] or label for label in labels)
            titles.append(f"<b>{what}</b>, {labels[0].rpartition(' in ')[2]}")
            look[f"{axis('yaxis', row)}.autorange"] = True
            continue
        sizes = _errors(one, key, stages)
        faulty = ", its sensor is at fault" if key in diagnosis.faulty else ""
        titles.append(f"<b>{name(key).capitalize()}</b>, {'W' if key == TOTAL_LOSS else '°C'}: RMSE "
                      f"{' → '.join(fixed(size) for size in sizes)} {error_unit(key)}{faulty}")  # fmt: skip
        far = len(sizes) > 1 and sizes[0] > FAR * sizes[1]
        near = [one.models[state][key] for _, state in stages[int(far) :]]
        look[f"{axis('yaxis', row)}.range"] = limits([one.measured[key], *near])
    shapes = _unscored(one, len(rows))
    return {"annotations": row_titles(titles), "shapes": shapes, **_x_axis(one, len(rows)), **look}


def _x_axis(one: Shown, rows: int) -> dict[str, Any]:
    scale, symbol = one.scale
    lowest = axis("xaxis", rows)
    return {f"{lowest}.title.text": f"Time in {symbol}", f"{lowest}.range": (one.time[[0, -1]] / scale).tolist()}


def _unscored(one: Shown, rows: int) -> list[dict[str, Any]]:
    scale, _ = one.scale
    return [
        {**SHADE, "xref": axis("x", row), "yref": f"{axis('y', row)} domain", "x0": a / scale, "x1": b / scale,
         "y0": 0, "y1": 1, "opacity": 0.18}
        for row in range(1, rows + 1) for a, b in one.unscored
    ]  # fmt: skip


def _noise(diagnosis: Diagnosis, rows: int) -> list[dict[str, Any]]:
    edge = BAND_SD * diagnosis.noise_K
    return [
        {**SHADE, "xref": f"{axis('x', row)} domain", "yref": axis("y", row), "x0": 0, "x1": 1, "y0": -edge,
         "y1": edge, "opacity": 0.25}
        for row in range(1, rows + 1) if edge > 0.0
    ]  # fmt: skip


def _sizes_told(one: Shown, stages: Sequence[tuple[str, str]]) -> str:
    """Errors of the channels in words."""
    order = ", ".join(stage for stage, _ in stages)
    told = "; ".join(
        f"{name(channel)} {', '.join(fixed(size) for size in _errors(one, channel, stages))} {error_unit(channel)}"
        for channel in one.measured
    )
    return f"RMSE {order}: {told}."
