"""The page: everything that a diagnosis contains, put into the template."""

from __future__ import annotations

import math
from collections.abc import Sequence
from importlib import resources
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from diagnosis.report import course_charts, equation, finding_charts, network_chart, wording
from diagnosis.report.chart import Chart
from diagnosis.results import number_format as numbers
from diagnosis.results.first_screen import date_told, size_of, values_told
from diagnosis.results.result import Diagnosis
from diagnosis.results.result_parts import NO_CLAIM, Errors, Fits, error_unit, named, title_of

PACKAGE = "diagnosis.report"
PLOTLY = "plotly-basic.min.js"  # npm: plotly.js-basic-dist-min, of the version that the plotly of Python brings
SHOWN_RANKS, MOST_RANKS, MOST_LEARNT = 10, 300, 6
BAR_SD = 4.0  # at the end of a bar


def page(diagnosis: Diagnosis) -> str:
    """The report as one HTML page that needs nothing else."""
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters.update(
        name=wording.name,
        number=numbers.number,
        fixed=numbers.fixed,
        share=numbers.share,
        sentence=wording.sentence,
        clause=wording.clause,
        plain=wording.plain,
        unit=wording.unit,
        with_error=numbers.with_error,
        drawn=equation.drawn,
    )
    farthest_first = sorted(diagnosis.calibration, key=lambda one: -abs(one.shift_in_sd))
    return environment.from_string(_text("report.html.j2")).render(
        d=diagnosis,
        style=Markup(_text("report.css")),  # noqa: S704 - our own file
        script=Markup(_text("report.js")),  # noqa: S704 - our own file
        plotly=Markup(_text(PLOTLY)),  # noqa: S704 - a library
        charts={chart.name: chart for chart in charts_of(diagnosis)},
        words=wording.WORDS,
        claims=diagnosis.verdict not in NO_CLAIM,
        evidence=_evidence(diagnosis),
        stages=course_charts.stages_of(diagnosis),
        told=network_chart.marks(diagnosis).told,
        fits=[(title, _rows(fits, diagnosis.faulty), fits.recordings if len(fits.recordings) > 1 else {})
              for title, fits in (("Held out", diagnosis.holdout), ("Learned from", diagnosis.train))],
        learnt=sorted((term.strength for term in diagnosis.learnt), key=lambda size: -size.start)[:MOST_LEARNT],
        calibration=farthest_first,
        descriptions=diagnosis.descriptions,
        shift_bar=_shift_bar,
        ranking=diagnosis.ranking[:MOST_RANKS],
        shown_ranks=SHOWN_RANKS,
        windows=wording.windows,
        headline=wording.headline,
        size_of=size_of,
        named=named,
        title_of=title_of,
        values_told=values_told,
        date_told=date_told,
        recordings=len({course.recording for course in diagnosis.courses}),
    )  # fmt: skip


def charts_of(diagnosis: Diagnosis) -> tuple[Chart, ...]:
    """Return the charts of a diagnosis that there is something to show in, six at most."""
    made = (
        network_chart.network_with_places(diagnosis),
        finding_charts.names_by_grade(diagnosis),
        finding_charts.dates_with_bands(diagnosis),
        finding_charts.heat_of_findings(diagnosis),
        course_charts.errors_over_time(diagnosis),
        course_charts.measured_and_simulated(diagnosis),
    )
    return tuple(chart for chart in made if chart is not None)


def _text(file: str) -> str:
    return (resources.files(PACKAGE) / file).read_text(encoding="utf-8")


def _evidence(diagnosis: Diagnosis) -> dict[str, Any]:
    """Evidence and threshold, and where both are on a bar."""
    found, needed = diagnosis.log_e_value, diagnosis.threshold
    end = max(2.0 * needed, found, 1.0)
    return {
        "reached": found > needed,
        "length": 100.0 * max(found, 0.0) / end,
        "threshold": 100.0 * max(needed, 0.0) / end,
    }


def _rows(fits: Fits, faulty: Sequence[str]) -> list[tuple[str, str, Errors]]:
    """Sensor, unit and errors; nothing without recordings."""
    if not math.isfinite(fits.before):
        return []
    what = f"all but {', '.join(faulty)}" if faulty else "all temperatures"
    total = Errors(before=fits.before, calibrated=fits.calibrated, after=fits.after)
    return [(what, "K", total), *((c, error_unit(c), errors) for c, errors in fits.sensors.items())]


def _shift_bar(shift_in_sd: float) -> tuple[float, float]:
    """Where the bar of a shift begins, and how long it is, in percent of what it may take."""
    shift = min(max(shift_in_sd, -BAR_SD), BAR_SD) if math.isfinite(shift_in_sd) else 0.0
    return 50.0 + 50.0 * min(shift, 0.0) / BAR_SD, 50.0 * abs(shift) / BAR_SD
