"""The report of a diagnosis: what it says, its charts, its equations, and its drawing of the network."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from importlib import resources
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import pytest
from markupsafe import escape

from diagnosis.report import equation as equations
from diagnosis.report import network_chart as drawing
from diagnosis.report import network_layout
from diagnosis.report.chart import Chart, averaged, curve_points, stretches, thinned
from diagnosis.report.course_charts import _errors, _joined, errors_over_time, measured_and_simulated, recordings_of
from diagnosis.report.finding_charts import dates_with_bands, driver_of, heat_of_findings, names_by_grade
from diagnosis.report.network_layout import WIDEST_ROW, places_of
from diagnosis.report.page import PLOTLY, charts_of, page
from diagnosis.report.wording import WORDS
from diagnosis.report.write import write_report
from diagnosis.results.first_screen import VERDICT_TEXT
from diagnosis.results.number_format import NONE, fixed
from diagnosis.results.result import Diagnosis
from diagnosis.results.result_parts import Change
from models.base.errors import InputError
from models.quantities.part_colours import part_colours
from tests.unit.diagnosis.diagnosis_example import (
    CHANNELS,
    EXAMPLES,
    NETWORK,
    RECORDINGS,
    consistent,
    insufficient_data,
    missing_physics,
    placed,
    sensor_fault,
    two_effects,
    unexplained,
)

LIBRARY = (resources.files("diagnosis.report") / PLOTLY).read_text(encoding="utf-8")
MATHML = 'xmlns="http://www.w3.org/1998/Math/MathML"'
MOST_BYTES = 6_000_000


class Text(HTMLParser):
    """What a reader sees of a page, and its tags in order."""

    VOID = frozenset({"meta", "link", "br"})

    def __init__(self, source: str) -> None:
        super().__init__()
        self.words: list[str] = []
        self.open: list[str] = []
        self.faults: list[str] = []
        self.feed(source)
        self.plain = " ".join(" ".join(self.words).split())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        pass

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.faults.append(tag)

    def handle_data(self, data: str) -> None:
        if not {"style", "script", "title"} & set(self.open):
            self.words.append(data)


@pytest.fixture(scope="module")
def pages() -> dict[str, str]:
    return {name: page(example()) for name, example in EXAMPLES.items()}


# ------------------------------------------------------------------ the page


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_page_is_whole_and_needs_nothing_else(pages: dict[str, str], name: str) -> None:
    text = Text(pages[name])
    assert text.faults == [] and text.open == []
    own = pages[name].replace(LIBRARY, "").replace(MATHML, "")
    assert not re.findall(r"""(?:src|href)=(?!"#|"data:,)|url\(|@import|://""", own)
    ids = re.findall(r'\bid="([^"]+)"', own)
    assert len(ids) == len(set(ids))
    assert set(re.findall(r'href="#([^"]+)"', own)) <= set(ids)
    assert pages[name].count(LIBRARY) == 1
    assert len(pages[name].encode()) < MOST_BYTES


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_verdict_stands_first_and_no_number_is_broken(pages: dict[str, str], name: str) -> None:
    text, diagnosis = Text(pages[name]).plain, EXAMPLES[name]()
    assert text.index(diagnosis.verdict_text) < 200
    assert not re.search(r"\b(nan|None|inf|Undefined)\b", text)
    assert "degC" not in text
    for finding in diagnosis.findings:
        assert finding.says.removesuffix(".") in text


def test_errors_are_told_for_every_sensor_of_both_sets() -> None:
    diagnosis = missing_physics()
    text = Text(page(diagnosis)).plain
    for fits in (diagnosis.train, diagnosis.holdout):
        for errors in fits.sensors.values():
            assert " ".join(fixed(value) for value in errors) in text
    assert "total loss W 40.00 22.00 6.00" in text
    nothing_held_out = Text(page(insufficient_data())).plain
    assert "No recording was held out" in nothing_held_out


def test_without_a_finding_nothing_is_said_to_be_found(pages: dict[str, str]) -> None:
    for name in ("consistent", "insufficient_data"):
        text = Text(pages[name][: pages[name].index('<section id="words">')]).plain
        for never in ("What was found", "with the findings", "corrected", "pointed out"):
            assert never not in text, never
    assert "Nothing that these data show: evidence" in Text(pages["consistent"]).plain
    assert "none: it is in the recording, not in the gearbox" in Text(pages["sensor_fault"]).plain


def test_every_explained_word_is_among_the_words(pages: dict[str, str]) -> None:
    for text in pages.values():
        titles = {unescape(t) for t in re.findall(r'<abbr tabindex="0" title="([^"]+)"', text)}
        assert titles
        assert titles <= set(WORDS.values())


def test_names_from_files_cannot_break_out_of_the_page() -> None:
    hostile = '<script>alert("1")</script>'
    base = missing_physics()
    diagnosis = replace(
        base, gearbox=hostile, notes=(hostile,), next_test=hostile, inputs={hostile: hostile},
        courses=tuple(replace(course, recording=hostile) for course in base.courses[:2]),
        findings=(replace(base.findings[0], says=hostile, equation="$" + hostile),),
    )  # fmt: skip
    text = page(diagnosis)
    assert hostile not in text
    assert Text(text).faults == []


def test_what_a_diagnosis_was_made_from_is_told_one_by_one(pages: dict[str, str]) -> None:
    text = Text(pages["consistent"]).plain
    assert (f"recordings: train_1 {'9b1c' * 16} held out: hold_1 {'04de' * 16} switched off windage gearbox "
            f"{'3f7a' * 16} version 0.1.0") in text  # fmt: skip


def test_pieces_of_one_recording_are_told_apart_and_counted_once() -> None:
    base = consistent()
    diagnosis = replace(base, courses=(base.courses[0], base.courses[0], base.courses[2]))
    titles = ["hold_1 (held out)", "train_1 (learned from)"]
    assert [one.title for one in recordings_of(diagnosis)] == titles
    assert len(recordings_of(diagnosis)[1].time) == 2 * len(base.courses[0].time)
    assert "from 2 recordings" in Text(page(diagnosis)).plain


def test_numbers_of_a_finding_have_their_meaning(pages: dict[str, str]) -> None:
    assert 'strength<br><span class="soft">heat at the reference speed</span>' in pages["missing_physics"]


def test_a_parameter_out_of_its_prior_is_told_as_one() -> None:
    base = missing_physics()
    finding = replace(
        base.findings[0], mechanism="parameter", place="h_air", node="housing_lower", kind="parameter", term=None,
        equation="", says="The parameter h_air is 3.1, far from what the definition allows.",
    )  # fmt: skip
    text = Text(page(replace(base, verdict="parameter_error", findings=(finding,)))).plain
    assert "parameter h air" in text
    assert "parameter at" not in text


def test_a_recording_without_values_does_not_break_the_page() -> None:
    base = consistent()
    course = base.courses[0]
    nothing = {channel: np.full(len(course.time), np.nan) for channel in CHANNELS}
    text = Text(page(replace(base, courses=(replace(course, measured=nothing),)))).plain
    assert f"{NONE} K" in page(replace(base, courses=(replace(course, measured=nothing),)))
    assert "Measured and simulated" in text


def test_the_file_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    write_report(insufficient_data(), tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == page(insufficient_data())
    with pytest.raises(InputError, match="cannot be written"):
        write_report(insufficient_data(), tmp_path / "report.html" / "report.html")
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


# ------------------------------------------------------------------ charts


def test_a_long_curve_is_thinned_and_keeps_its_ends_and_peaks() -> None:
    x = np.arange(100_000.0)
    y = np.random.default_rng(1).normal(size=x.size)
    y[54_321], y[777] = 40.0, -30.0
    few_x, few_y = thinned(x, y, 800)
    assert len(few_x) <= 800
    assert (np.diff(few_x) > 0.0).all()
    assert {0.0, 54_321.0, 777.0, 99_999.0} <= set(few_x)
    assert set(zip(few_x, few_y, strict=True)) <= set(zip(x, y, strict=True))


def test_means_leave_the_mean_alone_and_skip_what_is_missing() -> None:
    y = np.where(np.arange(1000) % 10 == 0, np.nan, 3.0)
    x, means = averaged(np.arange(1000.0), y, 50)
    assert len(x) == 50
    assert means == pytest.approx(3.0)


def test_a_gap_interrupts_a_line_and_uneven_rows_do_not() -> None:
    with_gap = np.concatenate([np.arange(0.0, 100.0), np.arange(400.0, 500.0)])
    assert [(s.start, s.stop) for s in stretches(with_gap)] == [(0, 100), (100, 200)]
    assert len(stretches(np.cumsum(np.tile([1.0, 3.0, 9.0], 50)))) == 1
    x, y = curve_points(with_gap, np.ones(200))
    assert np.isnan(y).tolist() == [False] * 100 + [True] + [False] * 100
    assert x.dtype == y.dtype == np.float32


@pytest.mark.parametrize("y", [np.full(5, np.nan), np.empty(0)])
def test_a_curve_of_nothing_has_no_points(y: np.ndarray) -> None:
    assert [len(values) for values in curve_points(np.arange(len(y), dtype=float), y)] == [0, 0]


def test_errors_in_charts_agree_with_the_curves() -> None:
    course = next(c for c in missing_physics().courses if c.recording == "hold_1")
    counted = course.time >= course.counts_from_s
    difference = (course.calibrated["oil"] - course.measured["oil"])[counted]
    edges = 0.5 * (course.time[1:] + course.time[:-1])
    lengths = np.diff(np.concatenate([[course.time[0]], edges, [course.time[-1]]]))[counted]
    known = np.isfinite(difference)
    expected = fixed(float(np.sqrt(np.average(difference[known] ** 2, weights=lengths[known]))))
    titles = [note.text for note in figure_of(measured_and_simulated(missing_physics())).layout.annotations]
    oil = next(title for title in titles if title.startswith("<b>Oil"))
    assert re.search(rf"RMSE [\d.]+ → {re.escape(expected)} → [\d.]+ K", oil)


def test_a_night_off_weighs_nothing_in_the_error_of_a_chart() -> None:
    course = next(c for c in missing_physics().courses if c.recording == "hold_1")
    night = replace(course, time=course.time + 36.0 * 3600.0, counts_from_s=course.counts_from_s + 36.0 * 3600.0)
    joined, alone = (_joined("hold_1", pieces) for pieces in ([course, night], [course]))
    assert joined.weights.sum() == pytest.approx(2.0 * alone.weights.sum())
    stages = (("calibrated", "calibrated"),)
    assert _errors(joined, "oil", stages) == pytest.approx(_errors(alone, "oil", stages))


def test_held_out_recordings_come_first_and_one_is_shown_at_a_time() -> None:
    figure = figure_of(measured_and_simulated(missing_physics()))
    buttons = figure.layout.updatemenus[0].buttons
    assert [b.label.partition(" ")[0] for b in buttons] == ["hold_1", "hold_2", "train_1", "train_2"]
    assert {name for name, (_, held_out) in RECORDINGS.items() if held_out} == {"hold_1", "hold_2"}
    seen = np.array([button.args[0]["visible"] for button in buttons])
    assert seen.shape == (4, len(figure.data))
    always = seen.all(axis=0)
    assert always.sum() == 4  # the legend
    assert (seen[:, ~always].sum(axis=0) == 1).all()


def test_ambient_is_drawn_and_a_part_has_one_colour_everywhere() -> None:
    charts = {chart.name: chart.figure for chart in charts_of(missing_physics())}
    titles = [note.text for note in charts["courses"].layout.annotations]
    assert "<b>Ambient temperature</b>, °C" in titles
    oil = part_colours(NETWORK.node_names)["oil"]
    lines = {trace.name: trace.line.color for trace in charts["errors"].data}
    assert lines["oil"] == oil
    assert oil in {trace.line.color for trace in charts["courses"].data if trace.name == "corrected"}
    nodes = next(trace for trace in charts["network"].data if isinstance(trace.marker.line.color, tuple))
    assert nodes.marker.line.color[[text.startswith("<b>oil<") for text in nodes.text].index(True)] == oil
    assert charts["heat"].data[0].line.color == oil


@pytest.mark.parametrize("name", EXAMPLES)
def test_charts_are_six_at_most_and_have_texts(name: str) -> None:
    charts = charts_of(EXAMPLES[name]())
    assert 2 <= len(charts) <= 6
    text = page(EXAMPLES[name]())
    for chart in charts:
        assert len(chart.alt) > 40
        assert text.count(f'id="plot-{chart.name}"') == 1
        assert f'aria-label="{escape(chart.alt)}"' in text


def test_errors_share_one_scale() -> None:
    figure = figure_of(errors_over_time(missing_physics()))
    low, high = figure.layout.yaxis.range
    shown = [trace for trace in figure.data if trace.visible and trace.yaxis in ("y", "y2")]
    assert all(low < min(trace.y) and max(trace.y) < high for trace in shown) and len(shown) > 2
    assert figure.layout.yaxis2.matches == "y" and figure.layout.yaxis2.range == (low, high)


def test_names_stand_by_grade() -> None:
    tied = replace(missing_physics().findings[0], grade="likely", tie_set=("windage", "pocketing"))
    bars = {bar.name: dict(zip(bar.y, bar.x, strict=True)) for bar in
            figure_of(names_by_grade(replace(missing_physics(), findings=(tied,)))).data}  # fmt: skip
    assert bars == {"likely": {"windage": 0.914, "pocketing": 0.061}, "not reported": {"churning swirl": 0.019}}


def test_the_bar_of_a_nearest_name_is_what_is_stated_of_it() -> None:
    nearest = replace(missing_physics().findings[0], grade="likely", acts_like=True, probability=0.2)
    bars = {bar.name: dict(zip(bar.y, bar.x, strict=True)) for bar in
            figure_of(names_by_grade(replace(missing_physics(), findings=(nearest,)))).data}  # fmt: skip
    assert bars["likely"] == {"windage": 0.2}
    # The same factor for all, or a name that is less probable would have the longer bar.
    assert bars["not reported"]["pocketing"] == pytest.approx(0.061 * 0.2 / 0.914)


def test_a_name_that_only_comes_with_another_is_shown_if_the_data_ask_for_more() -> None:
    finding = missing_physics().findings[0]
    rivals = (finding.confusable_with[0], replace(finding.confusable_with[1], instead=False))
    base = replace(missing_physics(), findings=(replace(finding, confusable_with=rivals),))
    assert "May act as well" not in page(base) and "churning swirl" not in names_by_grade(base).alt  # type: ignore[union-attr]
    asked = replace(base, remaining_nat=14.0)
    assert "May act as well" in page(asked) and "churning swirl" in names_by_grade(asked).alt  # type: ignore[union-attr]


def test_the_date_is_drawn_with_its_band() -> None:
    change = Change(recording="train_2", from_s=1800.0, band_s=(1700.0, 1900.0))
    dated = replace(missing_physics().findings[0], date=change)
    figure = figure_of(dates_with_bands(replace(missing_physics(), findings=(dated,), starts_at={"train_2": 64800.0})))
    (band,) = figure.layout.shapes
    assert (band.x0, band.x1) == pytest.approx((66500.0 / 3600.0, 66700.0 / 3600.0))
    assert figure.data[-1].x[0] == pytest.approx(66600.0 / 3600.0)
    assert {name for bars in figure.data[:2] for name in bars.y} == {"train_2"}  # baselines have no place on this axis
    assert dates_with_bands(missing_physics()) is None


def test_heat_is_drawn_over_what_drives_it() -> None:
    label, x, heat = driver_of(missing_physics(), missing_physics().findings[0])  # type: ignore[misc]
    assert label == "Input speed in 1/min"
    assert len(x) == len(heat) == 400
    assert heat_of_findings(consistent()) is None


def figure_of(chart: Chart | None) -> go.Figure:
    assert chart is not None
    return chart.figure


# ------------------------------------------------------------------ equations


@pytest.mark.parametrize(
    ("mechanism", "place"),
    [("windage", "oil"), ("cooler_thermostat", "oil"), ("sensor_stuck", "oil"), ("motor_flange", "shaft_1"),
     ("radiation_error", "housing_air"), ("cooler_proportional", "oil"), ("rain_on_housing", "housing")],
)  # fmt: skip
def test_laws_of_the_catalogue_are_drawn(mechanism: str, place: str) -> None:
    latex = placed(mechanism, place).equation()
    mathml = str(equations.drawn(latex))
    assert mathml.count("<math") == latex.count(r",\quad ") + 1
    assert "\\" not in mathml  # no command is left over
    assert mathml.count("<mtable") == latex.count(r"\begin{cases}")


def test_an_equation_cannot_break_out() -> None:
    assert "<script" not in equations.drawn("$<script>alert(1)</script>")


def test_no_equation_draws_nothing() -> None:
    assert equations.drawn("") == ""


# ------------------------------------------------------------------ the network


@pytest.mark.parametrize(
    ("example", "nodes", "links"),
    [
        (missing_physics, {"oil"}, set()),
        (two_effects, {"oil"}, {"cooler_thermostat_oil", "bearing_1-housing_lower", "bearing_1-housing_upper"}),
        (sensor_fault, {"bearing_1"}, set()),
        (unexplained, {"housing_lower"}, set()),
        (consistent, set(), set()),
    ],
)
def test_the_drawing_points_out_what_was_found(example: object, nodes: set[str], links: set[str]) -> None:
    marked = drawing.marks(example())  # type: ignore[operator]
    assert set(marked.nodes) == nodes
    assert set(marked.links) == links


def test_a_large_network_keeps_rows_that_a_phone_has_room_for() -> None:
    network = NETWORK
    for index in range(40):
        network = network.with_node(f"rib_{index}", 100.0).with_link(f"rib_{index}", "air", 1.0)
    places = places_of(network, network)
    assert sorted(places) == sorted(network.node_names) and len(set(places.values())) == len(places)
    assert max(Counter(row for _, row in places.values()).values()) <= WIDEST_ROW
    names = drawing.drawn(drawing.Marks(network=network), network, ()).layout.annotations
    assert len(names) == len(network.nodes)


def test_a_drawing_does_not_depend_on_the_order_in_a_set(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else a node changes its side from one run to the next where neighbours to both sides balance."""
    middle, rng = network_layout._middle, np.random.default_rng(0)
    monkeypatch.setattr(network_layout, "_middle", lambda at, own: middle(rng.permutation(at).tolist(), own))
    first, *others = (places_of(NETWORK, NETWORK) for _ in range(30))
    assert all(one == first for one in others)


# ------------------------------------------------------------------ looks


def test_examples_cover_every_verdict_but_a_parameter() -> None:
    verdicts = {example().verdict for example in EXAMPLES.values()}
    assert verdicts == set(VERDICT_TEXT) - {"parameter_error"}
    assert all(isinstance(example(), Diagnosis) for example in EXAMPLES.values())
