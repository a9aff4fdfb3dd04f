"""The report of a diagnosis: what it says, its charts, its equations, and its drawing of the network."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from diagnosis.report import equation as equations
from diagnosis.report import network_drawing as drawing
from diagnosis.report import page, write_report
from diagnosis.report.chart import Chart, Curve, averaged, drawn, stretches, thinned
from diagnosis.report.figures import courses
from diagnosis.report.wording import WORDS
from diagnosis.results.number_format import NONE, fixed
from diagnosis.results.result import VERDICT_TEXT, Diagnosis
from models.base.errors import InputError
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
    assert not re.findall(r"""(?:src|href)=(?!"#|"data:,)|url\(|@import|://""", pages[name])
    ids = re.findall(r'\bid="([^"]+)"', pages[name])
    assert len(ids) == len(set(ids))
    assert set(re.findall(r'href="#([^"]+)"', pages[name])) <= set(ids)


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
        for never in ("What was found", "with the findings", "pointed out"):
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


def test_pieces_of_one_recording_are_told_apart_and_counted_once() -> None:
    base = consistent()
    diagnosis = replace(base, courses=(base.courses[0], base.courses[0], base.courses[2]))
    assert [panel.title for panel in courses(diagnosis)] == ["hold_1", "train_1, part 1", "train_1, part 2"]
    assert "from 2 recordings" in Text(page(diagnosis)).plain


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
    assert f"RMSE {NONE} → {NONE} K" in text
    assert "Simulated less measured" in text


def test_the_file_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    write_report(insufficient_data(), tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == page(insufficient_data())
    with pytest.raises(InputError, match="cannot be written"):
        write_report(insufficient_data(), tmp_path / "report.html" / "report.html")
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


# ------------------------------------------------------------------ charts


def chart_of(*curves: Curve, **kind: object) -> str:
    return str(drawn(Chart(title="Oil", x_label="Time in h", y_label="Temperature in °C", curves=curves, **kind)))  # type: ignore[arg-type]


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
    svg = chart_of(Curve(label="oil", look="after", x=with_gap, y=np.ones(200)))
    assert re.search(r'data-label="oil" d="([^"]+)"', svg)[1].count("M") == 2  # type: ignore[index]


@pytest.mark.parametrize("y", [np.full(5, np.nan), np.empty(0)])
def test_a_chart_of_nothing_says_so(y: np.ndarray) -> None:
    assert "nothing was recorded" in chart_of(Curve(label="oil", look="after", x=np.arange(len(y), dtype=float), y=y))


def test_errors_in_charts_agree_with_the_curves() -> None:
    course = next(c for c in missing_physics().courses if c.recording == "hold_1")
    counted = course.time >= course.counts_from_s
    difference = (course.calibrated["oil"] - course.measured["oil"])[counted]
    edges = 0.5 * (course.time[1:] + course.time[:-1])
    lengths = np.diff(np.concatenate([[course.time[0]], edges, [course.time[-1]]]))[counted]
    known = np.isfinite(difference)
    expected = fixed(float(np.sqrt(np.average(difference[known] ** 2, weights=lengths[known]))))
    panel = next(p for p in courses(missing_physics()) if p.title == "hold_1")
    below = str(panel.sensors[CHANNELS.index("oil")][1])
    assert re.search(rf"RMSE [\d.]+ → {re.escape(expected)} → [\d.]+ K", below)


def test_held_out_recordings_come_first() -> None:
    assert [panel.title for panel in courses(missing_physics())] == ["hold_1", "hold_2", "train_1", "train_2"]
    assert len(courses(missing_physics())[0].sensors) == len(CHANNELS)
    assert {name for name, (_, held_out) in RECORDINGS.items() if held_out} == {"hold_1", "hold_2"}


# ------------------------------------------------------------------ equations


@pytest.mark.parametrize(
    ("mechanism", "place"),
    [("windage", "oil"), ("cooler_thermostat", "oil"), ("sensor_stuck", "oil"), ("motor_flange", "shaft_1"),
     ("radiation_error", "housing_air"), ("cooler_proportional", "oil"), ("rain_on_housing", "housing")],
)  # fmt: skip
def test_laws_of_the_catalogue_are_drawn(mechanism: str, place: str) -> None:
    latex = placed(mechanism, place).equation()
    svg = str(equations.drawn(latex))
    assert svg.startswith("<svg")
    assert unescape(re.search(r"<title>(.*?)</title>", svg, re.DOTALL)[1]) == latex  # type: ignore[index]


@pytest.mark.parametrize(
    "latex", [r"\frac{1", r"2 \begin{cases} 1 & a \end{cases} + <b>", r"\begin{matrix} 1 \end{matrix}"]
)
def test_latex_beyond_reach_is_shown_as_it_is(latex: str) -> None:
    shown = str(equations.drawn(latex))
    assert shown.startswith("<code")
    assert "<b>" not in shown
    assert latex in unescape(shown)


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
    html = str(drawing.drawn(network, network, (), drawing.Marks()))
    tops = re.findall(r"top: ([\d.]+)%", html)
    assert len(tops) == len(network.nodes)
    assert max(tops.count(top) for top in tops) <= drawing.WIDEST_ROW


# ------------------------------------------------------------------ looks


def test_examples_cover_every_verdict_but_a_parameter() -> None:
    verdicts = {example().verdict for example in EXAMPLES.values()}
    assert verdicts == set(VERDICT_TEXT) - {"parameter_error"}
    assert all(isinstance(example(), Diagnosis) for example in EXAMPLES.values())
