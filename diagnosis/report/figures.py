"""The charts of a diagnosis: courses of every sensor, their errors, and heats of findings."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from diagnosis.engine.predict import rmse
from diagnosis.forward.grid import stands_for
from diagnosis.report.chart import Chart, Curve, averaged, drawn
from diagnosis.report.wording import LOSS, name, time_scale
from diagnosis.results.number_format import fixed
from diagnosis.results.result import Diagnosis
from diagnosis.results.result_parts import Finding, PredictedRun
from models.base.types import Array

STAGES = (("as delivered", "before"), ("calibrated", "calibrated"), ("with the findings", "after"))
SENSOR_PX, ERROR_PX, INPUT_PX = 190, 120, 90
ERROR_POINTS = 240
BAND_SD = 2.0
FAR = 4.0  # times the calibrated model's error: the model as delivered is then left to leave its chart


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One recording, or one gap-free part of it: its inputs, and of every sensor the course and the error."""

    title: str
    held_out: bool
    length: str
    inputs: tuple[Markup, ...]
    sensors: tuple[tuple[Markup, Markup], ...]


def courses(diagnosis: Diagnosis) -> list[Panel]:
    """All recordings, held-out ones first: they are what counts."""
    ordered = sorted(diagnosis.courses, key=lambda course: not course.held_out)
    pieces = Counter(course.recording for course in ordered)
    begun: Counter[str] = Counter()
    panels = []
    for course in ordered:
        begun[course.recording] += 1
        part = f", part {begun[course.recording]}" if pieces[course.recording] > 1 else ""
        panels.append(_panel(course, course.recording + part, diagnosis.noise_K, shows_after=bool(diagnosis.findings)))
    return panels


def _end(time: Array) -> float:
    return float(time[-1]) if len(time) else 0.0


def _length(course: PredictedRun) -> str:
    if not len(course.time):
        return ""
    span = float(course.time[-1] - course.time[0])
    seconds, symbol = time_scale(span)
    return f"{span / seconds:.1f} {symbol}"


def _panel(course: PredictedRun, title: str, noise: float, *, shows_after: bool) -> Panel:
    seconds, symbol = time_scale(_end(course.time))
    time, label = course.time / seconds, f"Time in {symbol}"
    span = (float(time[0]), float(time[-1])) if len(time) else None
    shade = ((span[0], course.counts_from_s / seconds),) if span and course.counts_from_s > course.time[0] else ()
    inputs = tuple(
        drawn(Chart(title=title, x_label=label, y_label=unit, x_range=span, height=INPUT_PX, level=True,
                    curves=(Curve(label=title, look="input", x=time, y=values),)))
        for title, unit, values in (
            ("Speed", "Input shaft, 1/min", course.speed), ("Torque", "Input shaft, N m", course.torque)
        )
        if np.any(values)  # a machine without a shaft has zeros
    )  # fmt: skip
    stages = STAGES if shows_after else STAGES[:2]
    sensors = []
    for channel, measured in course.measured.items():
        unit = "W" if channel == LOSS else "K"
        runs = [(stage, look, getattr(course, look)[channel]) for stage, look in stages]
        counted = course.time >= course.counts_from_s
        weights = stands_for(course.time)[counted]
        sizes = [float(rmse((run - measured)[counted, None], weights)[0]) for _, _, run in runs]
        # A definition of guesses as delivered is so far off that nothing else could be told apart beside it.
        far = "before" if len(sizes) > 1 and sizes[0] > FAR * sizes[1] else ""
        curves = (Curve(label="measured", look="measured", x=time, y=measured, kind="points"),
                  *(Curve(label=stage, look=look, x=time, y=run, far=look == far)
                    for stage, look, run in runs))  # fmt: skip
        above = Chart(title=name(channel).capitalize(), x_label=label, x_range=span, shade=shade, height=SENSOR_PX,
                      y_label="Power loss in W" if channel == LOSS else "Temperature in °C", curves=curves)  # fmt: skip
        errors = tuple(
            Curve(label=stage, look=look, x=x, y=y, far=look == far)
            for stage, look, run in runs
            for x, y in (averaged(time, run - measured, ERROR_POINTS),)
        )
        if channel != LOSS and noise > 0.0 and span:
            edges = np.array(span)
            errors = (Curve(label=f"noise (± {BAND_SD:g} sd)", look="noise", x=edges, y=np.full(2, BAND_SD * noise),
                            low=np.full(2, -BAND_SD * noise), kind="band"), *errors)  # fmt: skip
        below = Chart(title="Simulated less measured", x_label=label, y_label=f"Error in {unit}", x_range=span,
                      note=f"RMSE {' → '.join(fixed(value) for value in sizes)} {unit}", shade=shade, height=ERROR_PX,
                      curves=errors, level=True)  # fmt: skip
        sensors.append((drawn(above), drawn(below)))
    return Panel(title=title, held_out=course.held_out, length=_length(course), inputs=inputs,
                 sensors=tuple(sensors))  # fmt: skip


def found_heat(finding: Finding) -> list[Markup]:
    """The heat of a finding over time, by recording."""
    charts = []
    for recording, (time, heat) in finding.heat.items():
        seconds, symbol = time_scale(_end(time))
        curve = Curve(label="heat of it", look="law", x=time / seconds, y=heat)
        charts.append(drawn(Chart(title=recording, x_label=f"Time in {symbol}", y_label="Heat in W", curves=(curve,),
                                  height=ERROR_PX, level=True)))  # fmt: skip
    return charts
