"""The report of a diagnosis: what it says, its charts, its equations, and its drawing of the network."""

from __future__ import annotations

import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from diagnosis.numbers import MINUS, NONE, fixed
from diagnosis.report import equation as equations
from diagnosis.report import network_drawing as drawing
from diagnosis.report import page, write_report
from diagnosis.report.chart import GRID, Chart, Curve, averaged, drawn, stretches, thinned
from diagnosis.report.figures import courses
from diagnosis.report.wording import WORDS
from diagnosis.result import VERDICT_TEXT, Diagnosis
from models.errors import InputError
from tests.unit.diagnosis_example import (
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
        self.told = " ".join(" ".join(self.words).split())

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
    text, diagnosis = Text(pages[name]).told, EXAMPLES[name]()
    assert text.index(diagnosis.verdict_text) < 200
    assert not re.search(r"\b(nan|None|inf|Undefined)\b", text)
    assert "degC" not in text
    for finding in diagnosis.findings:
        assert finding.says.removesuffix(".") in text


def test_findings_are_told_with_numbers_units_and_what_separates_them(pages: dict[str, str]) -> None:
    text = Text(pages["missing_physics"]).told
    for told in (
        "windage at oil", "18.4 ± 1.1 W", "2.870 ± 0.090", "44.2 nat", "21.0 W on average, 66.0 W at most",
        "pocketing at oil probability 0.06 To tell them apart: compare a wide with a narrow gear",
        "by chance with p ≤ 10⁻¹²", "5.21 → 3.62 → 0.52 K", "speed above 2900 1/min train_1: 9.0 to 18.0 h",
        "Hold 20 m/s without load at two oil temperatures that lie 30 K apart.", "aeration oil gears hold 20 m/s",
        "14 outliers of bearing_3 removed", "3f7a" * 16,
    ):  # fmt: skip
        assert told in text, told


def test_errors_are_told_for_every_sensor_of_both_sets() -> None:
    diagnosis = missing_physics()
    text = Text(page(diagnosis)).told
    for fits in (diagnosis.train, diagnosis.holdout):
        for errors in fits.sensors.values():
            assert " ".join(fixed(value) for value in errors) in text
    assert "total loss W 40.00 22.00 6.00" in text
    nothing_held_out = Text(page(insufficient_data())).told
    assert "No recording was held out" in nothing_held_out


def test_every_likely_place_stands_at_the_top() -> None:
    base = missing_physics()
    first, other = base.location
    told = page(replace(base, location=(first, replace(other, node="bearing_1", probability=0.52), other)))
    top = told[: told.index("What was found</h2>")]
    assert re.search(r"Also bearing 1, .*probability.* 0.52", top) and "Also mesh" not in top


def test_without_a_finding_nothing_is_said_to_be_found(pages: dict[str, str]) -> None:
    for name in ("consistent", "insufficient_data"):
        text = Text(pages[name][: pages[name].index('<section id="words">')]).told
        for never in ("What was found", "with what was found", "Missing heat", "pointed out"):
            assert never not in text, never
    assert "Below the threshold" in Text(pages["consistent"]).told
    assert "none: it is in the recording, not in the gearbox" in Text(pages["sensor_fault"]).told


def test_every_explained_word_is_among_the_words(pages: dict[str, str]) -> None:
    for text in pages.values():
        titles = {unescape(t) for t in re.findall(r'<abbr tabindex="0" title="([^"]+)"', text)}
        assert titles
        assert titles <= set(WORDS.values())


def test_calibration_is_told_most_distressed_first() -> None:
    text = page(missing_physics())
    rows = re.findall(rf'<td>([{MINUS}\d.]+)</td><td class="wide">', text)
    shifts = [abs(float(value.replace(MINUS, "-"))) for value in rows]
    assert len(shifts) == len(missing_physics().calibration)
    assert shifts == sorted(shifts, reverse=True)
    assert text.count('class="distress"') == sum(abs(c.shift_in_sd) > 2.0 for c in missing_physics().calibration)
    assert "tilt of &#39;mesh&#39; with speed" in text, "shapes are described as well"


def test_names_from_files_cannot_break_out_of_the_page() -> None:
    hostile = '<script>alert("1")</script>'
    base = missing_physics()
    diagnosis = replace(
        base, gearbox=hostile, notes=(hostile,), next_test=hostile, inputs={hostile: hostile},
        courses=tuple(replace(course, recording=hostile) for course in base.courses[:2]),
        missing_heat=tuple(replace(heat, recording=hostile) for heat in base.missing_heat),
        findings=(replace(base.findings[0], says=hostile, equation="$" + hostile),),
    )  # fmt: skip
    text = page(diagnosis)
    assert hostile not in text
    assert Text(text).faults == []


def test_pieces_of_one_recording_are_told_apart_and_counted_once() -> None:
    base = consistent()
    diagnosis = replace(base, courses=(base.courses[0], base.courses[0], base.courses[2]))
    assert [panel.title for panel in courses(diagnosis)] == ["hold_1", "train_1, part 1", "train_1, part 2"]
    assert "from 2 recordings" in Text(page(diagnosis)).told


def test_a_short_piece_years_after_the_start_is_shown_in_days() -> None:
    example = consistent()
    late = replace(example.courses[0], time=0.05 * example.courses[0].time + 1.3e8)
    (panel, *_) = courses(replace(example, courses=(late,)))
    text = str(panel)
    assert panel.length == f"{(late.time[-1] - late.time[0]) / 60.0:.1f} min"
    assert "Time in d" in text and "1504.66" in text
    assert "Time in min" not in text


def test_a_parameter_out_of_its_prior_is_told_as_one() -> None:
    base = missing_physics()
    finding = replace(
        base.findings[0], mechanism="parameter", place="h_air", node="housing_lower", kind="parameter", term=None,
        equation="", says="The parameter h_air is 3.1, far from what the definition allows.",
    )  # fmt: skip
    text = Text(page(replace(base, verdict="parameter_error", findings=(finding,)))).told
    assert "parameter h air" in text
    assert "parameter at" not in text


def test_a_recording_without_values_does_not_break_the_page() -> None:
    base = consistent()
    course = base.courses[0]
    nothing = {channel: np.full(len(course.time), np.nan) for channel in CHANNELS}
    text = Text(page(replace(base, courses=(replace(course, measured=nothing),)))).told
    assert f"RMSE {NONE} → {NONE} K" in text
    assert "Simulated less measured" in text


def test_the_file_appears_whole_or_not_at_all(tmp_path: Path) -> None:
    write_report(insufficient_data(), tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == page(insufficient_data())
    with pytest.raises(InputError, match="missing.*cannot be written"):
        write_report(insufficient_data(), tmp_path / "missing" / "report.html")
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


# ------------------------------------------------------------------ charts


def values_of(svg: str, label: str) -> np.ndarray:
    """Read a curve back from a chart: columns x and y, in the units of its axes."""
    (x0, x1), (y0, y1) = (map(float, re.search(rf'data-{a}="([^"]+)"', svg)[1].split()) for a in "xy")  # type: ignore[index]
    path = re.search(rf'data-label="{label}" d="([^"]+)"', svg)[1]  # type: ignore[index]
    units = np.array([p.split() for p in re.split("[MLZ]", path.replace("h0", "")) if p], dtype=float)
    return np.column_stack([x0 + units[:, 0] / GRID * (x1 - x0), y1 - units[:, 1] / GRID * (y1 - y0)])


def chart_of(*curves: Curve, **kind: object) -> str:
    return str(drawn(Chart(title="Oil", x_label="Time in h", y_label="Temperature in °C", curves=curves, **kind)))  # type: ignore[arg-type]


def test_a_chart_shows_the_values_that_it_was_given() -> None:
    x = np.linspace(0.0, 18.0, 200)
    y = 60.0 + 20.0 * np.sin(x)
    for kind in ("line", "points"):
        shown = values_of(chart_of(Curve(label="oil", look="after", x=x, y=y, kind=kind)), "oil")  # type: ignore[arg-type]
        assert shown[:, 0] == pytest.approx(x, abs=20.0 / GRID)
        assert shown[:, 1] == pytest.approx(y, abs=50.0 / GRID)


def test_ticks_stand_at_their_values() -> None:
    svg = chart_of(Curve(label="oil", look="after", x=np.array([0.0, 10.0]), y=np.array([20.0, 80.0])))
    y0, y1 = map(float, re.search(r'data-y="([^"]+)"', svg)[1].split())  # type: ignore[index]
    ticks = re.findall(r'<span style="bottom: ([\d.]+)%">([^<]+)</span>', svg)
    assert len(ticks) >= 3
    for place, value in ticks:
        assert y0 + float(place) / 100.0 * (y1 - y0) == pytest.approx(float(value), abs=0.01 * (y1 - y0))


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


@pytest.mark.parametrize("level", [0.0, 27.0, -1e-9, 1e7])
def test_a_constant_is_drawn_amid_its_axis(level: float) -> None:
    svg = chart_of(Curve(label="oil", look="after", x=np.arange(5.0), y=np.full(5, level)))
    assert values_of(svg, "oil")[:, 1] == pytest.approx(level, abs=0.01 + 1e-6 * abs(level))


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
    width, height = (float(n) for n in re.search(r'width="(\d+)" height="(\d+)"', svg).groups())  # type: ignore[union-attr]
    outline = re.search(r' d="([^"]+)"', svg)[1]  # type: ignore[index]
    xy = np.array(re.findall(r"-?[\d.]+", re.sub("[A-Z]", " ", outline)), dtype=float).reshape(-1, 2)
    assert xy.min() >= 0.0
    assert (xy <= [width + 1.0, height + 1.0]).all()
    assert unescape(re.search(r"<title>(.*?)</title>", svg, re.DOTALL)[1]) == latex  # type: ignore[index]


def test_cases_are_drawn_one_below_the_other() -> None:
    def height(latex: str) -> float:
        return float(re.search(r'height="(\d+)"', equations.drawn(latex))[1])  # type: ignore[index]

    cases = [rf"{i} & \text{{for}}\: t < {i} \\" for i in range(4)]
    heights = [
        height(rf"x = \begin{{cases}} {''.join(cases[:n])} 0 & \text{{otherwise}} \end{{cases}}") for n in (1, 2, 3)
    ]
    assert np.diff(heights) == pytest.approx(np.diff(heights)[0], abs=2.0)
    assert np.diff(heights)[0] > 10.0


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


def test_every_node_and_link_is_drawn_once_and_apart() -> None:
    diagnosis = two_effects()
    network = drawing.corrected(diagnosis)
    html = str(drawing.drawn(network, NETWORK, {"oil"}, drawing.marks(diagnosis)))
    places = re.findall(r'<div class="node[^"]*" style="left: ([\d.]+)%; top: ([\d.]+)%"', html)
    assert len(places) == len(set(places)) == len(network.nodes) == len(NETWORK.nodes) + 1
    assert html.count("<path") == len(network.links)
    assert ">coolant<" in html
    assert html.count("link guilty") == 3


def test_a_large_network_keeps_rows_that_a_phone_has_room_for() -> None:
    network = NETWORK
    for index in range(40):
        network = network.with_node(f"rib_{index}", 100.0).with_link(f"rib_{index}", "air", 1.0)
    html = str(drawing.drawn(network, network, (), drawing.Marks()))
    tops = re.findall(r"top: ([\d.]+)%", html)
    assert len(tops) == len(network.nodes)
    assert max(tops.count(top) for top in tops) <= drawing.WIDEST_ROW


# ------------------------------------------------------------------ looks


def _luminance(colour: str) -> float:
    digits = colour.removeprefix("#")
    digits = "".join(2 * d for d in digits) if len(digits) == 3 else digits
    linear = [(c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4)
              for c in (int(digits[i : i + 2], 16) / 255.0 for i in (0, 2, 4))]  # fmt: skip
    return float(np.dot([0.2126, 0.7152, 0.0722], linear))


@pytest.mark.parametrize("look", [0, 1, 2], ids=["light", "dark", "print"])
def test_letters_and_curves_stand_out_from_their_ground(look: int) -> None:
    style = (resources.files("diagnosis.report") / "report.css").read_text(encoding="utf-8")
    looks = [dict(re.findall(r"--(\w+): (#\w+)", block)) for block in re.findall(r":root \{(.*?)\}", style, re.DOTALL)]
    colours = looks[0] | looks[look]
    for names, least in (
        (("ink", "soft", "link", "good", "bad", "warn", "grey"), 4.5),
        (("before", "calibrated", "after", "measured", "missing", "law", "input"), 3.0),
    ):
        for name in names:
            for ground in ("paper", "back"):
                light, dark = sorted((_luminance(colours[name]), _luminance(colours[ground])), reverse=True)
                assert (light + 0.05) / (dark + 0.05) >= least, (name, ground)


def test_examples_cover_every_verdict_but_a_parameter() -> None:
    verdicts = {example().verdict for example in EXAMPLES.values()}
    assert verdicts == set(VERDICT_TEXT) - {"parameter_error"}
    assert all(isinstance(example(), Diagnosis) for example in EXAMPLES.values())
