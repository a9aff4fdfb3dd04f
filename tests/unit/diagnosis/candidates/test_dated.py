"""Changes of laws over the shared time axis: on after their date, in every definition, and throughout once exported."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.candidates.dated import (
    Axis,
    carried_on,
    changing,
    comes_daily,
    each_day,
    for_a_while,
    has_clock,
    may_change,
    over_hours,
    step,
)
from diagnosis.candidates.factors import factors_of
from models.assembly.gearbox import Gearbox, load_gearbox
from models.mechanisms import CATALOGUE, Placed, Scale
from models.network.laws import symbol

AXIS = Axis(dates=np.array([2000.0, 6000.0]), end=10_000.0, until=12_000.0)


@pytest.fixture(scope="module")
def air(fzg: Gearbox) -> Placed:
    return next(f for f in factors_of(fzg.network(), Scale.of(fzg), ()) if f.label == "air_cooling_housing_air")


def value(placed: Placed, time: float, start: float, **own: float) -> float:
    given = {symbol(f"{placed.label}_{name}"): one for name, one in own.items()}
    given |= {symbol("time"): time, symbol(f"{placed.label}_start"): start}
    return float(placed.expression.xreplace(given))


def test_a_step_is_on_after_its_date_and_in_later_recordings(air: Placed) -> None:
    term = changing(air, step(AXIS), AXIS).term
    assert isinstance(term, Placed)
    own = {"strength": -0.2, "since": 2000.0, "within": 240.0}
    assert value(term, 1900.0, 0.0, **own) == 0.0
    assert value(term, 2120.0, 0.0, **own) == pytest.approx(-0.1)
    assert value(term, 2300.0, 0.0, **own) == pytest.approx(-0.2)
    assert value(term, 0.0, 3000.0, **own) == pytest.approx(-0.2)
    assert value(term, 1500.0, 1000.0, **own) == pytest.approx(-0.2)


def test_no_date_is_in_the_last_moments() -> None:
    """A single odd row at the end is no change of the machine."""
    assert AXIS.moment("since").upper == pytest.approx(8000.0)
    assert Axis(dates=np.zeros(0), end=600.0, until=600.0).moment("since").upper == pytest.approx(300.0)


def test_for_a_while_ends(air: Placed) -> None:
    term = changing(air, for_a_while(AXIS), AXIS).term
    assert isinstance(term, Placed)
    own = {"strength": 0.4, "since": 2000.0, "lasting": 3000.0}
    assert [round(value(term, t, 0.0, **own), 3) for t in (1000.0, 3500.0, 7000.0)] == [0.0, 0.4, 0.0]


def test_courses_over_hours_go_on_in_the_next_recording(air: Placed) -> None:
    hypothesis = changing(air, over_hours(AXIS), AXIS)
    assert isinstance(hypothesis.term, Placed)
    assert hypothesis.how == "over_hours"
    names = [p.name.removeprefix(f"{hypothesis.term.label}_") for p in hypothesis.term.parameters]
    for variant, expected in zip(hypothesis.variants, (0.1, 1 - np.exp(-2 / 3), np.exp(-2 / 3)), strict=True):
        own = {name: v for name, v in zip(names, variant.tolist(), strict=True) if name != "start"}
        assert value(hypothesis.term, 3600.0, 3600.0, **own) == pytest.approx(expected)


def test_what_grows_stays_after_the_last_recording_as_it_was(air: Placed) -> None:
    """An FMU may run for days; the recordings say nothing of growth after them."""
    term = changing(air, over_hours(AXIS), AXIS).term
    assert isinstance(term, Placed)
    own = {"strength": 1.0, "linear": 1.0, "settling": 0.0, "fading": 0.0}
    assert (
        value(term, 1e6, 10_000.0, **own) == value(term, 2000.0, 10_000.0, **own) == pytest.approx(12_000.0 / 72_000.0)
    )


def test_an_exported_step_acts_throughout(fzg: Gearbox, air: Placed) -> None:
    """The clock's start, which a correction takes over, is the end of the recordings."""
    hypothesis = changing(air, step(AXIS), AXIS)
    assert isinstance(hypothesis.term, Placed)
    label, network = hypothesis.term.label, fzg.network()
    corrected = hypothesis.term.apply(
        network, {f"{label}_strength": -0.2, f"{label}_since": 6000.0, f"{label}_within": 240.0}
    )
    here = {symbol(p.name): p.start for p in corrected.parameters} | {symbol("time"): 0.0, symbol("air_speed"): 2.0}
    here |= {symbol(f"T_{node.name}"): 60.0 + i for i, node in enumerate(network.nodes)}
    for before, after in zip(network.links, corrected.links, strict=True):
        if before.name in hypothesis.term.target:
            ratio = after.conductance.xreplace(here) / before.conductance.xreplace(here)
            assert float(ratio) == pytest.approx(0.8)


def test_a_law_and_its_change_fit_in_one_network(fzg: Gearbox) -> None:
    """Names of parameters, memories and boundaries differ."""
    network, scale = fzg.network(), Scale.of(fzg)
    for name in ("hot_neighbour", "motor_flange", "cooler_thermostat"):
        placed = CATALOGUE[name].placed(network, scale)[0]
        term = changing(placed, step(AXIS), AXIS).term
        assert term is not None
        both = term.apply(placed.apply(network))
        assert len(both.parameters) == len(network.parameters) + len(placed.parameters) + len(term.parameters)
        assert len(both.states) == len(network.states) + 2 * len(placed.states)


def test_a_law_of_time_is_carried_on(fzg: Gearbox) -> None:
    placed = CATALOGUE["oil_loss"].placed(fzg.network(), Scale.of(fzg))[0]
    assert has_clock(placed)
    assert not may_change(placed)
    hypothesis = carried_on(placed, AXIS)
    assert (hypothesis.name, hypothesis.how) == ("oil_loss", "carried_on")
    assert hypothesis.label != f"{placed.name}@{placed.place}"
    assert isinstance(hypothesis.term, Placed)
    own = {"strength": -0.3, "life": 1000.0}
    assert value(hypothesis.term, 500.0, 4500.0, **own) == pytest.approx(-0.3 * (1 - np.exp(-5.0)))


def test_a_moment_of_a_law_that_is_carried_on_lies_on_the_axis_of_all_recordings(fzg: Gearbox) -> None:
    """Damage on the fifth day is far outside the hours of any recording."""
    placed = CATALOGUE["bearing_damage"].placed(fzg.network(), Scale.of(fzg))[0]
    days = Axis(dates=np.array([30_000.0, 380_000.0]), end=400_000.0, until=500_000.0)
    hypothesis = carried_on(placed, days)
    assert isinstance(hypothesis.term, Placed)
    moment = next(p for p in hypothesis.term.parameters if p.name == f"{hypothesis.term.label}_moment")
    assert set(hypothesis.variants[:, hypothesis.term.parameters.index(moment)]) == {30_000.0, 380_000.0}
    assert hypothesis.date == moment.name and not hypothesis.has_course
    assert moment.sd == pytest.approx(0.4 * 400_000.0) and moment.upper == pytest.approx(390_000.0)
    without_dates = carried_on(placed, replace(days, dates=np.zeros(0)))
    assert len(without_dates.variants) == len(CATALOGUE["bearing_damage"].parameters(Scale.of(fzg))[1].grid)


def test_a_clock_that_drifts_goes_on_in_the_next_recording(fzg: Gearbox) -> None:
    placed = CATALOGUE["clock_drift"].placed(fzg.network(), Scale.of(fzg))[0]
    hypothesis = carried_on(placed, AXIS)
    assert isinstance(hypothesis.term, Placed)
    assert value(hypothesis.term, 1800.0, 10 * 86400.0 - 1800.0, strength=12.0) == pytest.approx(120.0)
    assert set(np.sign(hypothesis.variants[:, 0])) == {-1.0, 1.0}


def test_sun_comes_every_day_at_one_hour(fzg: Gearbox) -> None:
    """Recordings begin at different hours; the height is at 11 h, the first begins at 7:30."""
    sun = CATALOGUE["solar_soak"].placed(fzg.network(), Scale.of(fzg))
    assert comes_daily(sun[0]) and not comes_daily(CATALOGUE["windage"].placed(fzg.network(), Scale.of(fzg))[0])
    hypothesis = each_day(sun[0], replace(AXIS, hour=7.5))
    assert isinstance(hypothesis.term, Placed)
    own = {"strength": 40.0, "noon": 11.0, "length": 3600.0}
    for day in (0, 1, 5):
        at = [
            value(hypothesis.term, 600.0, (24 * day + hour - 7.5) * 3600.0 - 600.0, **own) for hour in (10, 11, 12, 23)
        ]
        assert at == pytest.approx([40.0 * np.exp(-1.0), 40.0, 40.0 * np.exp(-1.0), 0.0], abs=1e-9)
    before_midnight = {**own, "noon": 0.5}
    assert value(hypothesis.term, 0.0, 16.0 * 3600.0, **before_midnight) == pytest.approx(40.0 * np.exp(-1.0))
    assert hypothesis.term.says.startswith("Every day at one hour: sun")


@pytest.mark.parametrize("name", ["fzg", "conveyor", "heated_rod", "la_haute_borne"])
def test_every_definition_has_changes_of_its_own_laws(name: str) -> None:
    """All losses and links that conduct are targets, and every term fits into the network."""
    gearbox = load_gearbox(name)
    network, scale = gearbox.network(), Scale.of(gearbox)
    factors = factors_of(network, scale, [part.name for part in network.parts])
    changes = [changing(one, step(AXIS), AXIS) for one in factors]
    assert len({one.label for one in changes}) == len(changes)
    assert {one.law for one in changes} == {one.name for one in factors}
    targets = {target for one in factors for target in one.target}
    assert {link.name for link in network.links if not link.conductance.is_zero} <= targets
    assert {source.name for source in network.sources if source.is_loss} <= targets
    assert {f"{source.name}_heat" for source in network.sources if not source.is_loss} <= {one.name for one in factors}
    for one in changes:
        assert one.term is not None
        assert one.term.apply(network, as_recorded=True) is not network
