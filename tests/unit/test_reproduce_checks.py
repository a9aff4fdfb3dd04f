"""The checks behind the verdicts: each can come to both results, and an item's verdict follows its checks."""

from __future__ import annotations

import numpy as np
import pytest

from builder.reproduce import drive, losses, networks, tables
from builder.reproduce.figure import Curve, Figure, Graph, Knot, Map, Plot
from builder.reproduce.item import Item, Verdict, judged, silent, target
from builder.reproduce.published import Comparison
from builder.reproduce.render_html import drawings, legend
from builder.reproduce.sensitivity import uncertain_groups
from builder.reproduce.speed import measured
from models.gearbox import load_gearbox

NO = {"numbers": {}, "otherwise": "because"}


def test_one_statement_that_differs_makes_the_item_differ() -> None:
    holds, differs = judged("a", "", "", True, **NO), judged("b", "", "", False, **NO)
    mute, missed = silent("c", "", "no numbers"), target("d", "", "", False, **NO)
    assert Item(key="1", title="", reading="", checks=(holds, mute, differs)).verdict == Verdict.DIFFERS
    assert Item(key="1", title="", reading="", checks=(holds, mute, differs)).why == "because"
    assert Item(key="2", title="", reading="", checks=(holds, mute, missed)).verdict == Verdict.REPRODUCED
    assert Item(key="3", title="", reading="", checks=(mute, missed)).verdict == Verdict.SILENT
    assert Item(key="3", title="", reading="", checks=(mute,)).why == "no numbers"
    assert Item(key="4", title="", reading="", without_checks=Verdict.SCHEME).verdict == Verdict.SCHEME


def test_values_are_held_against_the_print() -> None:
    fzg = load_gearbox("fzg")
    assert tables.values_equal_the_print(fzg, tables.TABLE_1).verdict == Verdict.REPRODUCED
    other = fzg.with_values({"stage.0.face_width_mm": 14.01, "housing.outside_area_m2": 0.22})
    check = tables.values_equal_the_print(other, tables.TABLE_1)
    assert check.verdict == Verdict.DIFFERS
    assert check.numbers == {"printed": 17.0, "equal": 16.0}
    assert "Face width" in check.found
    assert tables.values_equal_the_print(other, tables.TABLE_5).numbers["equal"] == 12.0  # stands there twice


def totals(gap: np.ndarray) -> dict[str, np.ndarray]:
    base = np.outer([1.0, 2.0, 8.0], np.arange(1.0, 7.0)) * 50.0
    return {"niemann": base, "mauz": base + gap, "changenet_velex": base + gap}


def test_spread_of_the_churning_formulas() -> None:
    constant = totals(np.tile(np.arange(6.0), (3, 1)) * 20.0)
    assert losses.underestimates_at_high_speed_and_low_torque(constant).verdict == Verdict.REPRODUCED
    assert losses.underestimation_stays_constant_over_torque(constant).verdict == Verdict.REPRODUCED
    growing = totals(np.outer([1.0, 2.0, 8.0], np.arange(6.0)) * 20.0)
    assert losses.underestimates_at_high_speed_and_low_torque(growing).verdict == Verdict.DIFFERS
    assert losses.underestimation_stays_constant_over_torque(growing).verdict == Verdict.DIFFERS
    assert losses.trend_changes_with_torque(constant["niemann"]).verdict == Verdict.DIFFERS


@pytest.mark.parametrize(("name", "change"), [("churning", 1.05), ("seals", 1.05), ("sliding", 0.001)])
def test_breakdown(name: str, change: float) -> None:
    parts = {
        "churning": np.array([5.0, 5.0]),
        "seals": np.array([60.0, 60.0]),
        "bearings, no load": np.array([20.0, 20.0]),
        "bearings, load-dependent": np.array([0.0, 80.0]),
        "rolling": np.array([3.0, 1.0]),
        "sliding": np.array([0.0, 800.0]),
    }
    both = (losses.no_load_losses_constant_over_torque, losses.sliding_and_bearings_dominate_at_high_torque)
    assert [check(parts).verdict for check in both] == [Verdict.REPRODUCED] * 2
    parts[name] = parts[name] * np.array([1.0, change])
    assert Verdict.DIFFERS in [check(parts).verdict for check in both]


def test_networks_are_judged_by_their_worst_output() -> None:
    y = np.random.default_rng(0).uniform(1.0, 2.0, (200, 2))
    good = networks.Judgement(calculated=y, predicted=1.001 * y, corner_calculated=y, corner_predicted=1.001 * y)
    spoilt = y * np.array([1.0, 1.6])
    bad = networks.Judgement(calculated=y, predicted=spoilt, corner_calculated=y, corner_predicted=spoilt)
    assert networks.high_r_squared("x", good).verdict == Verdict.REPRODUCED
    assert networks.high_r_squared("x", bad).verdict == Verdict.DIFFERS
    assert networks.weak_at_the_lower_limits(good).verdict == Verdict.DIFFERS
    assert networks.weak_at_the_lower_limits(bad).verdict == Verdict.REPRODUCED
    assert networks.weak_at_the_lower_limits(bad).numbers["worst_95"] == pytest.approx(0.6)


def test_the_drive_cycle_has_the_phases_that_the_checks_name() -> None:
    time, speed, torque = drive.KNOTS.T
    at = {
        phase: (np.interp(phase, time, speed), np.interp(phase, time, torque))
        for phase in (drive.START, drive.CONSTANT, drive.HEAVY, drive.END)
    }
    for ends in at.values():
        for first, last in ends:
            assert first == last
    assert at[drive.START][1][0] == at[drive.END][1][0] < at[drive.CONSTANT][1][0] < at[drive.HEAVY][1][0]


def test_a_published_number_is_met_within_its_tolerance_only() -> None:
    assert Comparison("x", "s", 1.46, 1.4649, 5e-3, 2).met
    assert not Comparison("x", "s", 1.46, 1.4651, 5e-3, 2).met


def test_uncertain_numbers_that_are_alike_move_together() -> None:
    gearbox = load_gearbox("fzg")
    groups = uncertain_groups(gearbox)
    paths = [path for group in groups for path in group.paths]
    assert len(paths) == len(set(paths)), "each number once"
    assert set(paths) < set(gearbox.priors)
    left = set(gearbox.priors) - set(paths)
    assert all(
        "C_" in p or p.startswith(("housing.density", "housing.specific", "oil.volume", "oil.schlenk")) for p in left
    )


def test_timing_counts_the_runs_that_it_reports() -> None:
    calls: list[int] = []
    timing = measured(lambda: calls.append(1), runs=4, longest_s=60.0)
    assert timing.runs == 4
    assert len(calls) == 5  # the first does not count


def test_a_figure_is_drawn_and_tabulated_from_one_description() -> None:
    x = np.array([1.0, 2.0, 3.0])
    plot = Plot(
        title="p",
        x_label="v in m/s",
        y_label="P in W",
        curves=(
            Curve(label="a", x=x, y=x**2),
            Curve(label="b", x=x, y=x, kind="points"),
            Curve(label="a", x=x, y=-x),
        ),
    )
    levels = Map(title="m", x_label="x", y_label="y", z_label="z", x=x, y=x, z=np.outer(x, x), levels=(0.0, 4.0, 9.0))
    graph = Graph(
        title="g",
        knots=(Knot("oil", 0, 0, "oil", ""), Knot("air", 1, 0, "air", "")),
        edges=(("oil", "air", 1.0, "7 W/K"),),
    )
    figure = Figure(name="f", title="f", caption="", panels=(plot, levels, graph))
    assert len(set(figure.colours().values())) == 4
    assert [entry["label"] for entry in legend(figure)] == ["a", "b", "oil", "air"]
    drawn = drawings(figure)
    assert [len(panel["data"]) for panel in drawn] == [3, 1, 3]
    # Even steps between the levels, whatever their distance.
    assert drawn[1]["data"][0]["z"][2] == [pytest.approx(0.75), pytest.approx(1.4), pytest.approx(2.0)]
    rows = figure.rows()
    assert {len(column) for column in rows.values()} == {9 + 9 + 1}
    assert rows["y"][:3] == [1.0, 4.0, 9.0]
