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
    MOST_OF_ALL,
    MOST_POINTS,
    Chart,
    averaged,
    axis,
    curve_points,
    dressed,
    limits,
    menu,
    row_titles,
)
from diagnosis.report.wording import LOSS, name, time_scale
from diagnosis.results.number_format import fixed
from diagnosis.results.predicted_run import PredictedRun
from diagnosis.results.result import Diagnosis
from diagnosis.results.result_parts import MODELS, error_unit
from models.base.types import Array
from models.quantities.part_colours import AMBIENT, CALIBRATED, DELIVERED, MEASURED, part_colours
from models.quantities.quantities import Input, node_of_channel

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
    """One recording, all its gap-free parts joined.

    Attributes
    ----------
    unscored : sequence of (from, to)
        Stretches that served to find start temperatures, [s]
    weights : Array, shape (rows,)
        Of every row in a mean over its part, [s]
    """

    title: str
    run: PredictedRun
    unscored: Sequence[tuple[float, float]]
    weights: Array

    @property
    def scale(self) -> tuple[float, str]:
        """Seconds of the unit of its time axis, and that unit."""
        return time_scale(float(self.run.time[-1]))

    def counted(self) -> Array:
        """True for rows that count."""
        time = self.run.time
        return np.asarray(~np.any([(time >= a) & (time < b) for a, b in self.unscored] or [time < -np.inf], axis=0))


def stages_of(diagnosis: Diagnosis) -> tuple[tuple[str, str], ...]:
    """Return the models to compare; the last one only if it has more than the calibrated one."""
    return STAGES if diagnosis.has_correction else STAGES[:2]


def recordings_of(diagnosis: Diagnosis) -> list[Shown]:
    """All recordings, held-out ones first: they are what counts."""
    ordered = sorted(diagnosis.courses, key=lambda course: not course.held_out)
    keys = dict.fromkeys((course.recording, course.held_out) for course in ordered)
    return [
        _joined(f"{key[0]} ({'held out' if key[1] else 'learned from'})",
                [course for course in ordered if (course.recording, course.held_out) == key])
        for key in keys
    ]  # fmt: skip


def measured_and_simulated(diagnosis: Diagnosis) -> Chart:
    """Inputs, surroundings, and per sensor what was measured and simulated, of one recording at a time."""
    shown = recordings_of(diagnosis)
    channels = list(shown[0].run.measured)
    driven = _inputs(diagnosis, shown)
    inputs = [key for key, given in driven.items() if not given.quantity.is_temperature][:MOST_INPUTS]
    airs = [key for key, given in driven.items() if given.quantity.is_temperature]
    rows = [*inputs, *([AIR] if airs else []), *channels]
    stages = stages_of(diagnosis)
    heights = [INPUT_PX] * (len(rows) - len(channels)) + [ROW_PX] * len(channels)
    figure = _grid(heights)
    colours = _colours(diagnosis, channels)
    most = min(MOST_POINTS, MOST_OF_ALL // max(len(shown) * len(channels) * (len(stages) + 1), 1))
    for label, marks in [("measured", {"mode": "markers", "marker": {"color": MEASURED, "size": 5}})] + [
        (stage, {"mode": "lines", "line": LINES[look]}) for stage, look in stages
    ]:
        figure.add_scatter(x=[None], y=[None], name=label, legendgroup=label, **marks, row=1, col=1)
    always, owners = len(figure.data), []
    for index, one in enumerate(shown):
        for row, key in enumerate(rows, 1):
            traces = (
                _surroundings(one, airs) if key == AIR
                else _channel(one, key, stages, colours[key], most) if key in channels
                else [_line(one, one.run.inputs[key], name(key), {"color": MEASURED, "width": 1.4}, MOST_POINTS)]
            )  # fmt: skip
            for trace in traces:
                figure.add_trace(trace.update(visible=index == 0, showlegend=False), row=row, col=1)
                owners.append(index)
    looks = [_look(diagnosis, one, rows, channels, airs, stages) for one in shown]
    _one_at_a_time(figure, heights, [one.title for one in shown], looks, owners, always=always)
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
    channels = [channel for channel in shown[0].run.measured if channel != LOSS]
    stages = stages_of(diagnosis)[-2:]
    has_loss = LOSS in shown[0].run.measured
    rows = [stage.capitalize() for stage, _ in stages] + ["Total loss"] * has_loss
    heights = [ERROR_PX] * len(stages) + [ROW_PX] * has_loss
    titles = [f"<b>{row}</b>, simulated less measured in {'W' if row == 'Total loss' else 'K'}" for row in rows]
    figure, colours, owners, looks = _grid(heights), _colours(diagnosis, channels), [], []
    for index, one in enumerate(shown):
        ranges = dict[str, Any]()
        errors = [{c: getattr(one.run, look)[c] - one.run.measured[c] for c in channels} for _, look in stages]
        courses = [averaged(one.run.time, error, ERROR_POINTS)[1] for of in errors for error in of.values()]
        for row, of in enumerate(errors, 1):
            ranges[f"{axis('yaxis', row)}.range"] = limits(
                [*courses, BAND_SD * diagnosis.noise_K * np.array([-1.0, 1.0])]
            )
            for channel, error in of.items():
                faulty = " (faulty sensor)" if channel in diagnosis.faulty else ""
                line = {"color": colours[channel], "width": 1.5, "dash": "dot" if faulty else "solid"}
                trace = _line(one, error, name(channel) + faulty, line, ERROR_POINTS, mean=True)
                trace.update(legendgroup=channel, showlegend=row == 1, visible=index == 0)
                figure.add_trace(trace, row=row, col=1)
                owners.append(index)
        for stage, look in stages if has_loss else ():
            error = getattr(one.run, look)[LOSS] - one.run.measured[LOSS]
            trace = _line(one, error, stage, LINES[look], ERROR_POINTS, mean=True)
            figure.add_trace(trace.update(visible=index == 0, showlegend=False), row=len(rows), col=1)
            owners.append(index)
        if has_loss:
            ranges[f"{axis('yaxis', len(rows))}.autorange"] = True
        looks.append({"annotations": row_titles(titles), **_x_axis(one, len(rows)), **ranges,
                      "shapes": [*_noise(diagnosis, len(stages)), *_unscored(one, len(rows))]})  # fmt: skip
    figure.update_yaxes(matches="y", row=2, col=1)
    _one_at_a_time(figure, heights, [one.title for one in shown], looks, owners)
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
    first = pieces[0]

    def joined(get: str) -> dict[str, Array]:
        return {key: np.concatenate([getattr(piece, get)[key] for piece in pieces]) for key in getattr(first, get)}

    run = PredictedRun(
        recording=first.recording, held_out=first.held_out, time=np.concatenate([piece.time for piece in pieces]),
        inputs=joined("inputs"), measured=joined("measured"), before=joined("before"),
        calibrated=joined("calibrated"), after=joined("after"), counts_from_s=first.counts_from_s, start=first.start,
    )  # fmt: skip
    starts = [(float(piece.time[0]), piece.counts_from_s) for piece in pieces]
    weights = np.concatenate([stands_for(piece.time) for piece in pieces])
    return Shown(title=title, run=run, unscored=[(a, b) for a, b in starts if b > a], weights=weights)


def _colours(diagnosis: Diagnosis, channels: Sequence[str]) -> dict[str, str]:
    """Colour of the part that each channel measures; the loss has that of readings."""
    parts = diagnosis.network.node_names
    colours = part_colours(parts)
    return {channel: colours.get(node_of_channel(channel, parts), MEASURED) for channel in channels}


def _inputs(diagnosis: Diagnosis, shown: Sequence[Shown]) -> dict[str, Input]:
    """Inputs that are not 0 all the time: a machine without a shaft has zeros."""
    known = diagnosis.network.inputs
    return {key: known[key] for key in shown[0].run.inputs
            if key in known and any(np.any(one.run.inputs[key]) for one in shown)}  # fmt: skip


def _grid(heights: Sequence[int]) -> go.Figure:
    return make_subplots(
        rows=len(heights), cols=1, shared_xaxes=True, row_heights=[float(height) for height in heights],
        vertical_spacing=BETWEEN_PX / _height(heights),
    )  # fmt: skip


def _height(heights: Sequence[int]) -> int:
    return sum(heights) + BETWEEN_PX * len(heights)


def _one_at_a_time(
    figure: go.Figure, heights: Sequence[int], titles: Sequence[str], looks: Sequence[dict[str, Any]],
    owners: Sequence[int], *, always: int = 0,
) -> None:  # fmt: skip
    """Show the first recording, and a menu to choose another one.

    Parameters
    ----------
    looks : sequence of dict
        Layout for each recording
    owners : sequence of int
        Recording of each trace behind the first `always`
    """
    buttons = [
        {"label": title, "method": "update",
         "args": [{"visible": [True] * always + [owner == index for owner in owners]}, look]}
        for index, (title, look) in enumerate(zip(titles, looks, strict=True))
    ]  # fmt: skip
    legend = {"orientation": "h", "x": 0.0, "xanchor": "left", "y": 1.0 + 22.0 / _height(heights), "yanchor": "bottom"}
    dressed(figure, _height(heights) + EDGE_PX, **menu(buttons), margin={"l": 10, "r": 14, "t": EDGE_PX, "b": 10},
            legend=legend, hovermode="x unified")  # fmt: skip
    figure.update_layout(looks[0], overwrite=False)


def _channel(
    one: Shown, channel: str, stages: Sequence[tuple[str, str]], colour: str, most: int
) -> list[go.Scatter]:  # fmt: skip
    x, y = curve_points(one.run.time / one.scale[0], one.run.measured[channel], most)
    dots = go.Scatter(x=x, y=y, mode="markers", marker={"color": MEASURED, "size": 3, "opacity": 0.55},
                      name="measured", legendgroup="measured")  # fmt: skip
    lines = []
    for stage, look in stages:
        line = {**LINES[look], "color": colour} if look == "after" else LINES[look]
        lines.append(_line(one, getattr(one.run, look)[channel], stage, line, most).update(legendgroup=stage))
    return [dots, *lines]


def _surroundings(one: Shown, airs: Sequence[str]) -> list[go.Scatter]:
    dashes = ("solid", "dash", "dot", "dashdot")
    return [
        _line(one, one.run.inputs[key], name(key), {"color": AMBIENT, "width": 1.6, "dash": dash}, MOST_POINTS)
        for key, dash in zip(airs, dashes, strict=False)
    ]


def _line(
    one: Shown, values: Array, label: str, line: Mapping[str, Any], most: int, *, mean: bool = False
) -> go.Scatter:  # fmt: skip
    x = one.run.time / one.scale[0]
    if mean:
        x, values = averaged(x, values, most)
    x, y = curve_points(x, values, most)
    return go.Scatter(x=x, y=y, mode="lines", line=dict(line), name=label, hovertemplate="%{y:.4g}")


def _errors(one: Shown, channel: str, stages: Sequence[tuple[str, str]]) -> list[float]:
    """RMSE of the rows that count, by stage."""
    rows = one.counted()
    weights = one.weights[rows]
    return [
        float(rmse((getattr(one.run, look)[channel] - one.run.measured[channel])[rows, None], weights)[0])
        for _, look in stages
    ]


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
        titles.append(f"<b>{name(key).capitalize()}</b>, {'W' if key == LOSS else '°C'}: RMSE "
                      f"{' → '.join(fixed(size) for size in sizes)} {error_unit(key)}{faulty}")  # fmt: skip
        far = len(sizes) > 1 and sizes[0] > FAR * sizes[1]
        near = [getattr(one.run, state)[key] for _, state in stages[int(far) :]]
        look[f"{axis('yaxis', row)}.range"] = limits([one.run.measured[key], *near])
    shapes = _unscored(one, len(rows))
    return {"annotations": row_titles(titles), "shapes": shapes, **_x_axis(one, len(rows)), **look}


def _x_axis(one: Shown, rows: int) -> dict[str, Any]:
    scale, symbol = one.scale
    lowest = axis("xaxis", rows)
    return {f"{lowest}.title.text": f"Time in {symbol}", f"{lowest}.range": (one.run.time[[0, -1]] / scale).tolist()}


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
        for channel in one.run.measured
    )
    return f"RMSE {order}: {told}."
