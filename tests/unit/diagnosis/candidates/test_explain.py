"""Hypotheses on recordings of the model itself: scan, fit, and what the strength is worth."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from diagnosis.candidates.explain import (
    DISTORTED,
    Explanation,
    calibrated,
    distorted,
    fitted,
    in_the_middle,
    instead,
    refined,
    without,
)
from diagnosis.candidates.heat import _heats_with, heats_of, mean_heat_of
from diagnosis.decision.stage import Stage
from diagnosis.inference.evidence import Marginal
from diagnosis.inference.posterior import Problem
from diagnosis.inference.unknowns import unknowns_of
from diagnosis.results.findings import _with_form, finding_of

from diagnosis.candidates import explain
from diagnosis.candidates.hypotheses import (
    _lines,
    hypothesis_of,
    scan,
    sharpened,
    switched_elsewhere,
    two_point_columns,
)
from diagnosis.decision import acceptance
from diagnosis.forward.grid import Piece
from diagnosis.forward.network_on_grid import NetworkOnGrid, named_values
from diagnosis.forward.observation import readings
from diagnosis.forward.trajectory import simulate
from models.assembly.gearbox import Gearbox
from models.mechanisms import CATALOGUE, Scale
from tests.unit.diagnosis.inference_example import CHANNELS, damaged


def test_shapes_are_sought_between_the_grid(fzg: Gearbox, piece: Piece, problem: Problem) -> None:
    """A moment that lies between two of the grid, where the fit from either would creep."""
    concealed, scale, true = damaged(fzg, piece, problem)
    placed = CATALOGUE["bearing_damage"].placed(problem.model.network, scale)[0]
    base = in_the_middle(
        calibrated(problem.changed(pieces=[concealed]))
    )  # a calibration that went astray: so the search
    assert base is not None
    marginal = Marginal.of(base.fit)
    (coarse,) = scan(base.problem, base.fit, marginal, [hypothesis_of(placed)])
    fine = sharpened(base.problem, base.fit, marginal, coarse)
    moments = [s.hypothesis.variants[s.best, 1] for s in (coarse, fine)]
    assert abs(moments[1] - true) < 0.5 * abs(moments[0] - true)
    assert fine.log_bayes_of[fine.best] > coarse.log_bayes_of[coarse.best] + 1.0
    assert fine.log_bayes >= coarse.log_bayes


def test_what_is_not_needed_can_be_taken_out_again(fzg: Gearbox, piece: Piece, problem: Problem) -> None:
    concealed, scale, _ = damaged(fzg, piece, problem)
    network, start = problem.model.network, calibrated(problem.changed(pieces=[concealed]))

    def added(base: Explanation, name: str) -> Explanation:
        hypothesis = hypothesis_of(CATALOGUE[name].placed(network, scale, CHANNELS)[0])
        (scored,) = scan(base.problem, base.fit, Marginal.of(base.fit), [hypothesis])
        found = fitted(base, scored)
        assert found is not None
        return replace(found, fit=found.problem.at(found.fit))

    one = added(start, "bearing_damage")
    two = added(one, "oil_mist")
    alone = without(start, two, 1)
    assert [h.name for h in alone.found] == ["bearing_damage"]
    assert alone.log_evidence > one.log_evidence - 0.5  # as good as if it had never been added
    assert two.log_evidence < alone.log_evidence + 3.0  # the second one explains nothing
    assert without(start, two, 0).log_evidence < two.log_evidence - 3.0  # the first one does
    other = added(start, "windage")
    exchanged, known = instead(start, two, 1, other), added(one, "windage")
    assert exchanged.labels == known.labels  # the same as if it had been added at once
    assert exchanged.log_evidence == pytest.approx(known.log_evidence, abs=0.2)
    # A further effect may be what the form of the first one lacks, however far it is ahead of its rivals.
    case: Any = SimpleNamespace(nominal=network)
    stages = [Stage(scored=(), log_e_value=30.0, fits=(e,), gains=(20.0,), accepted=e) for e in (one, two)]
    stated = [finding_of(case, two, h, stage, ()).probability for h, stage in zip(two.found, stages, strict=True)]
    assert stated == pytest.approx([1.0, 0.7])
    # From another process come copies; the evidence is theirs all the same.
    copies = [finding_of(case, two, replace(h), stage, ()) for h, stage in zip(two.found, stages, strict=True)]
    assert [copy.log_bayes for copy in copies] == [20.0, 20.0]


def test_the_error_of_a_mean_heat_is_that_of_the_strength_and_of_what_goes_with_it(
    fzg: Gearbox, piece: Piece, problem: Problem
) -> None:
    """Straight in its strength it has the same relative error; at its moment the heat shows what is unsure of that."""
    concealed, scale, _ = damaged(fzg, piece, problem)
    start = calibrated(problem.changed(pieces=[concealed]))
    h = hypothesis_of(CATALOGUE["bearing_damage"].placed(problem.model.network, scale, CHANNELS)[0])
    (scored,) = scan(start.problem, start.fit, Marginal.of(start.fit), [h])
    found = fitted(start, scored)
    assert found is not None
    found = replace(found, fit=found.problem.at(found.fit))
    mean, error = mean_heat_of(found, h)
    heats, steps = np.concatenate(heats_of(found, h)), np.concatenate([p.steps for p in found.problem.pieces])
    assert mean == pytest.approx(np.average(np.abs(heats), weights=steps))
    assert h.term is not None
    value, own_error = found.values_of(h)[h.term.strength.name]
    reported = _with_form(h, found.values_of(h))
    # What is said adds that the form of a law is hardly known to a tenth; its other numbers have none of it, nor has
    # the fault of an instrument, which has no law.
    assert reported[h.term.strength.name] == (value, pytest.approx(np.hypot(own_error, 0.1 * value)))
    assert all(reported[name] == pair for name, pair in found.values_of(h).items() if name != h.term.strength.name)
    fault: Any = SimpleNamespace(of_measurement=True)
    assert _with_form(replace(h, term=fault), found.values_of(h)) == found.values_of(h)
    # The same by many draws from the posterior of the term's parameters.
    items, rng = found.fit.unknowns.items, np.random.default_rng(3)
    own = found.fit.unknowns.of(h.term.parameters)
    draws = rng.multivariate_normal(found.fit.z[own], found.fit.covariance[np.ix_(own, own)], 400)
    values = np.array([[items[i].value(x) for i, x in zip(own, draw, strict=True)] for draw in draws])
    heat = np.concatenate(_heats_with(found, h, np.concatenate([values.mean(axis=0, keepdims=True), values])))
    drawn = np.average(np.abs(heat[:, 1:]), axis=0, weights=steps)
    assert error == pytest.approx(drawn.std(), rel=0.2)


def test_a_set_point_is_found_from_afar(fzg: Gearbox, piece: Piece, problem: Problem) -> None:
    """A switch moves by jumps, so the derivative with respect to its set-point says nothing: other shapes are tried."""
    network, scale = problem.model.network, Scale.of(fzg, speed=2600.0, torque=150.0, duration=float(piece.time[-1]))
    (placed,) = CATALOGUE["fan_thermostat"].placed(network, scale)
    names = [p.name for p in placed.parameters]
    nominal = simulate(problem.model, piece, problem.model.start, problem.starts[0])
    housing = nominal.T[:, [problem.model.parts.index(f"housing_{half}") for half in ("lower", "upper")]].mean(axis=1)
    true = float(np.percentile(housing, 85))
    model = NetworkOnGrid(placed.apply(network), fzg.losses())
    values = named_values(model.network, dict(zip(names, (scale.conductance, true, 2.0), strict=True)))
    sensors = problem.unknowns.sensors(CHANNELS, np.zeros(len(problem.unknowns)))
    free = replace(piece, guided=False)
    seen = readings(model, simulate(model, free, values, problem.starts[0], rounds=12), sensors)
    base = calibrated(problem.changed(pieces=[replace(piece, measured=seen)]))
    hypothesis = hypothesis_of(placed)
    (scored,) = scan(base.problem, base.fit, Marginal.of(base.fit), [hypothesis])
    far = replace(scored, best=0, hypothesis=replace(hypothesis, variants=np.array([[1.0, true + 9.0, 6.0],
                                                                                    *hypothesis.variants])),
                  values=np.array([0.5 * scale.conductance, *scored.values]),
                  log_bayes_of=np.array([scored.log_bayes, *scored.log_bayes_of]))  # fmt: skip
    rough = fitted(base, far)
    assert rough is not None
    found = refined(rough)
    found_at = {name: value for name, (value, _) in found.values_of(far.hypothesis).items()}
    # Once on, it stays on: only the upper edge is seen.
    edge = found_at[f"{placed.label}_set_point"] + 0.5 * found_at[f"{placed.label}_band"]
    assert edge == pytest.approx(true + 1.0, abs=0.6)
    assert found.log_evidence > base.log_evidence + 20.0


def test_each_temperature_of_a_two_point_control_is_sought_for_itself(fzg: Gearbox, problem: Problem) -> None:
    scale = Scale.of(fzg, speed=2600.0, torque=150.0, duration=3600.0)
    network, means = problem.model.network, problem.changed(pieces=[replace(problem.pieces[0], slow=True)])
    cooler = hypothesis_of(CATALOGUE["cooler_thermostat"].placed(network, scale)[0])
    columns = two_point_columns(cooler, problem)
    assert columns is not None
    names = [p.name.removeprefix("cooler_thermostat_oil_") for p in cooler.term.parameters]
    assert [names[column] for column in columns] == ["set_point", "band"]
    values = np.array([1.0, 70.0, 6.0, *cooler.variants[0, 3:]])
    for end, rows in enumerate(switched_elsewhere(cooler, columns, values, np.array([-2.0, 1.0]))):
        upper, lower = rows[:, 1] + 0.5 * rows[:, 2], rows[:, 1] - 0.5 * rows[:, 2]
        moved, still = (upper, lower) if end == 0 else (lower, upper)
        np.testing.assert_allclose(moved, (73.0 if end == 0 else 67.0) + np.array([-2.0, 1.0]))
        np.testing.assert_allclose(still, 67.0 if end == 0 else 73.0)
        np.testing.assert_array_equal(rows[:, 3:], np.tile(values[3:], (2, 1)))
    # A band cannot turn round; a valve that opens in proportion switches nowhere; nor is anything sharp in means.
    assert min(rows[:, 2].min() for rows in switched_elsewhere(cooler, columns, values, np.array([-9.0, 9.0]))) > 0.0
    valve = hypothesis_of(CATALOGUE["cooler_proportional"].placed(network, scale)[0])
    assert two_point_columns(valve, problem) is None and two_point_columns(cooler, means) is None
    assert len(_lines(cooler, problem)) == len(_lines(cooler, means)) + 2


def test_what_comes_again_and_again_is_found_with_its_period(fzg: Gearbox, piece: Piece, problem: Problem) -> None:
    """A scan knows single showers only: that they come again, and when, is swept for where one of them was found."""
    network, scale = problem.model.network, Scale.of(fzg, speed=2600.0, torque=150.0, duration=float(piece.time[-1]))
    placed = next(t for t in CATALOGUE["rain_on_housing"].placed(network, scale) if len(t.target) > 2)
    names = [p.name for p in placed.parameters]
    true = {"strength": 2.0 * scale.conductance, "onset": 250.0, "length": 240.0, "every": 900.0, "drying": 150.0,
            "colder": 2.0}  # fmt: skip
    assert [name.removeprefix(f"{placed.label}_") for name in names] == list(true)
    model = NetworkOnGrid(placed.apply(network), fzg.losses())
    values = named_values(model.network, dict(zip(names, true.values(), strict=True)))
    sensors = problem.unknowns.sensors(CHANNELS, np.zeros(len(problem.unknowns)))
    seen = readings(model, simulate(model, piece, values, problem.starts[0]), sensors)
    base = calibrated(problem.changed(pieces=[replace(piece, measured=seen)]))
    (scored,) = scan(base.problem, base.fit, Marginal.of(base.fit), [hypothesis_of(placed)])
    once = scored.hypothesis.variants[scored.best, 3]
    assert once > 2.0 * scale.duration
    rough = fitted(base, scored)
    assert rough is not None
    found = refined(rough)
    got = {n.removeprefix(f"{placed.label}_"): v for n, (v, _) in found.values_of(scored.hypothesis).items()}
    assert got["every"] == pytest.approx(true["every"], rel=0.03)
    assert (got["onset"] - true["onset"] + 450.0) % true["every"] == pytest.approx(450.0, abs=40.0)
    assert found.log_evidence > base.log_evidence + 50.0


@pytest.mark.parametrize("late_s", [90.0, -90.0])
def test_a_clock_may_be_early_or_late(fzg: Gearbox, piece: Piece, problem: Problem, late_s: float) -> None:
    (placed, *_) = CATALOGUE["clock_offset"].placed(problem.model.network, Scale.of(fzg), CHANNELS)
    measured = np.array(piece.measured)
    for index, name in enumerate(CHANNELS):
        if name != "P_loss":
            measured[:, index] = np.interp(piece.time - late_s, piece.time, piece.measured[:, index])
    base = calibrated(problem.changed(pieces=[replace(piece, measured=measured)]))
    (scored,) = scan(base.problem, base.fit, Marginal.of(base.fit), [hypothesis_of(placed)])
    assert np.sign(scored.values[scored.best]) == np.sign(late_s)
    # Late readings come from the row before, early ones from the next: no variant speaks for the other sign, or small
    # misfits where the operation jumps look like a clock that no fit then finds.
    for h, value, log_bayes in zip(scored.hypothesis.variants, scored.values, scored.log_bayes_of, strict=True):
        assert h[0] * value > 0.0 or log_bayes < 0.0
    rough = fitted(base, scored)
    assert rough is not None
    found = refined(rough)
    # Late readings and slow sensors look alike: part of it goes into their lags.
    assert found.values_of(scored.hypothesis)[placed.strength.name][0] == pytest.approx(late_s, abs=20.0)
    # What a row stands for, the time before its stamp or after it, is not known either.
    found = replace(found, fit=found.problem.at(found.fit))
    for interval, matters in ((10.0, True), (150.0, False)):
        case: Any = SimpleNamespace(scale=SimpleNamespace(interval=interval), channels=CHANNELS, loss_W=250.0)
        assert acceptance._matters(case, found, scored.hypothesis) is matters


@pytest.mark.parametrize("late_s", [5.0, -5.0])
def test_what_a_row_of_losses_stands_for_is_learnt_and_no_finding(
    fzg: Gearbox, piece: Piece, problem: Problem, late_s: float
) -> None:
    """Means of the ten seconds before their stamp, or after it, beside temperatures of that moment."""
    measured, at = np.array(piece.measured), CHANNELS.index("P_loss")
    measured[:, at] = np.interp(piece.time - late_s, piece.time, piece.measured[:, at])
    base = calibrated(problem.changed(pieces=[replace(piece, measured=measured)]))
    assert base.fit.unknowns.sensors(CHANNELS, base.fit.z).loss_delay == pytest.approx(late_s, abs=1.0)
    clocks = CATALOGUE["clock_offset"].placed(problem.model.network, Scale.of(fzg), CHANNELS)
    scored = scan(base.problem, base.fit, Marginal.of(base.fit), [hypothesis_of(placed) for placed in clocks])
    assert len(scored) == 2 and max(s.log_bayes for s in scored) < 0.0
    slow = unknowns_of(fzg.network(), CHANNELS, slow=True)  # rows that are minutes apart are means, all of them
    assert not any(item.role == "loss_delay" for item in slow.items)


def test_a_distorted_calibration_is_also_seen_from_the_middle_of_the_priors(problem: Problem) -> None:
    base = calibrated(problem)
    assert not distorted(base)
    z = np.array(base.fit.z)
    z[0] = 1.5 * DISTORTED
    bent = replace(base, fit=base.problem.fit(z, [part.trajectory for part in base.fit.parts], iterations=0))
    assert distorted(bent)
    middle = in_the_middle(bent)
    assert middle is not None
    np.testing.assert_array_equal(middle.fit.z, 0.0)
    assert middle.log_evidence == bent.log_evidence  # what is found from there is compared with the same base


@pytest.mark.parametrize("form", ["clock", "lag", "swapped", "stuck"])
def test_faulty_sensors_show_every_change_as_they_show_the_truth(fzg: Gearbox, problem: Problem, form: str) -> None:
    """Derivatives go through the fault as well: by a clock an hour late everything comes an hour late."""
    scale = Scale.of(fzg)
    name = {"clock": "clock_offset", "lag": "sensor_lag", "swapped": "swapped_channels", "stuck": "sensor_stuck"}[form]
    term = CATALOGUE[name].placed(problem.model.network, scale, CHANNELS)[0]
    size = {"clock": 700.0, "lag": 300.0, "swapped": 0.6, "stuck": 1.0}[form]
    values = {term.strength.name: size}
    faulty = explain._with(problem, hypothesis_of(term))
    own = {p.name: values.get(p.name, p.grid[0] if p.grid else p.start) for p in term.parameters}
    z = np.array([item.z(own[item.target]) if item.target in own else 0.0 for item in faulty.unknowns.items])
    index = next(i for i, item in enumerate(faulty.unknowns.items) if item.target == "mesh")
    part = faulty.linearise(0, z, None)
    reads = []
    for step in (-0.05, 0.05):
        moved = np.array(z)
        moved[index] += step
        there = faulty.linearise(0, moved, part.trajectory)
        reads.append(faulty.read(there.trajectory, there.sensors, moved))
    difference = (reads[1] - reads[0]) / 0.1
    largest = np.abs(difference).max(axis=0)
    np.testing.assert_allclose(part.columns[:, :, index] / largest, difference / largest, atol=0.03)
    # What the sensors show of a change of the readings is what the scan of hypotheses uses.
    sound = problem.linearise(0, z[: len(problem.unknowns.items)], part.trajectory)
    shown = part.shown(sound.columns[:, :, [index]])[:, :, 0]
    np.testing.assert_allclose(shown / largest, difference / largest, atol=0.03)
