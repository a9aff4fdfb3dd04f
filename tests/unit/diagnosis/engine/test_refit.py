"""Candidates on recordings of the model itself: their shapes are fitted, and what they are is found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import Hypothesis, hypothesis_of
from diagnosis.engine import switch_grid
from diagnosis.engine.fit import Experiment, Fit, calibrate
from diagnosis.engine.refit import ROUGH, SWITCH_SHARES, refit
from diagnosis.engine.scan import SHAPES_TRIED, Scan, course_of_heat, scan
from diagnosis.results.findings import switch_errors
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.mechanisms import CATALOGUE, Placed, Scale
from tests.unit.diagnosis.inference_example import CHANNELS, acting, at, with_measured, with_term


@pytest.fixture(scope="module")
def scale(fzg: Gearbox, experiment: Experiment) -> Scale:
    return Scale.of(fzg, speed=2600.0, torque=150.0, duration=float(experiment.pieces[0].time[-1]))


def found_with(base: Fit, placed: Placed) -> tuple[Scan, Fit]:
    """The scan of one candidate, and the fit with it."""
    scanned = scan(base, [hypothesis_of(placed)])
    strength = float(scanned.singles(scanned.gram.given(scanned.unknowns)).value[0])
    return scanned, refit(base, scanned.candidates[0], scanned.best[0], strength)


def value_of(fit: Fit, name: str) -> float:
    return next(u.value(z) for u, z in zip(fit.experiment.unknowns, fit.z.tolist(), strict=True)
                if u.parameter.name == name)  # fmt: skip


def test_a_moment_is_found_between_the_grid(experiment: Experiment, scale: Scale) -> None:
    """A bearing damage that sets in between two moments of the grid."""
    placed = CATALOGUE["bearing_damage"].placed(experiment.machine.model.network, scale)[0]
    names = [p.name.removeprefix(f"{placed.label}_") for p in placed.parameters]
    true = 0.29 * scale.duration
    concealed = acting(experiment, placed, dict(zip(names, (60.0, true, 0.3), strict=True)))
    # From the nearest moment of the grid: the scan of so short a ride may prefer another one.
    base, one = calibrate(concealed), hypothesis_of(placed)
    nearest = int(np.argmin(np.abs(one.variants[:, 1] - true)))
    found = refit(base, one, nearest, 60.0)
    of_grid = one.variants[nearest, 1]
    assert abs(value_of(found, placed.parameters[1].name) - true) < 0.5 * abs(of_grid - true)
    assert found.log_evidence > base.log_evidence + 20.0


@pytest.mark.parametrize("late_s", [90.0, -90.0])
def test_a_clock_may_be_early_or_late(fzg: Gearbox, experiment: Experiment, late_s: float) -> None:
    placed, *_ = CATALOGUE["clock_offset"].placed(experiment.machine.model.network, Scale.of(fzg), CHANNELS)
    piece = experiment.pieces[0]
    measured = np.array(piece.measured)
    for index, name in enumerate(CHANNELS):
        if name != "P_loss":
            measured[:, index] = np.interp(piece.time - late_s, piece.time, piece.measured[:, index])
    scanned, found = found_with(calibrate(with_measured(experiment, measured)), placed)
    # Late readings come from the row before, early ones from the next: a variant supports its own sign only.
    assert scanned.sign[0] == np.sign(scanned.candidates[0].variants[scanned.best[0], 0]) == np.sign(late_s)
    # Late readings and slow sensors look alike: part of it goes into their lags.
    assert value_of(found, placed.strength.name) == pytest.approx(late_s, abs=20.0)


@pytest.mark.parametrize("late_s", [5.0, -5.0])
def test_the_end_of_a_row_of_losses_that_is_stamped_is_learnt(
    fzg: Gearbox, experiment: Experiment, late_s: float
) -> None:
    """Means of the ten seconds before their stamp, or after it, with temperatures of that moment: no fault."""
    piece = experiment.pieces[0]
    measured, index = np.array(piece.measured), CHANNELS.index("P_loss")
    measured[:, index] = np.interp(piece.time - late_s, piece.time, piece.measured[:, index])
    base = calibrate(with_measured(experiment, measured))
    assert value_of(base, "delay_P_loss") == pytest.approx(late_s, abs=1.0)
    clocks = CATALOGUE["clock_offset"].placed(experiment.machine.model.network, Scale.of(fzg), CHANNELS)
    scanned = scan(base, [hypothesis_of(placed) for placed in clocks])
    assert len(scanned.log_bayes) == 2 and scanned.log_bayes.max() < 0.0


def with_fan(experiment: Experiment, scale: Scale) -> tuple[Placed, float, Fit]:
    """A fan, the middle of its band, and the machine calibrated to readings with it."""
    (placed,) = CATALOGUE["fan_thermostat"].placed(experiment.machine.model.network, scale)
    nominal = experiment.point(0, np.zeros(len(experiment.unknowns))).trajectory.T
    parts = experiment.machine.model.parts
    housing = nominal[:, [parts.index(f"housing_{half}") for half in ("lower", "upper")]].mean(axis=1)
    true = float(np.percentile(housing, 85))
    values = {"strength": scale.conductance, "set_point": true, "band": 2.0}
    return placed, true, calibrate(acting(experiment, placed, values, guided=False))


def test_a_set_point_is_found(experiment: Experiment, scale: Scale) -> None:
    """A switch moves by jumps, so the derivative with respect to its set point is no guide; the grid has to lead."""
    placed, true, base = with_fan(experiment, scale)
    _, found = found_with(base, placed)
    # Once on, it stays on: only the upper edge is seen.
    edge = value_of(found, f"{placed.label}_set_point") + 0.5 * value_of(found, f"{placed.label}_band")
    assert edge == pytest.approx(true + 1.0, abs=1.5)
    assert found.log_evidence > base.log_evidence + 20.0
    # It switches between two grid points: it is known to half of what the housing changes from one to the next.
    (trajectory,) = found.trajectories
    halves = [found.experiment.machine.model.parts.index(f"housing_{half}") for half in ("lower", "upper")]
    switched = np.flatnonzero(np.diff(trajectory.memory[:, -1]))
    change = np.sqrt(np.mean(np.diff(trajectory.seen[:, halves].mean(axis=1))[switched] ** 2))
    assert 0.1 < change < 1.0
    errors = switch_errors(found, placed)
    assert errors[f"{placed.label}_set_point"] == pytest.approx(0.5 * change / np.sqrt(2.0))
    assert errors[f"{placed.label}_band"] == pytest.approx(0.5 * change * np.sqrt(2.0))


def test_what_may_have_several_optima_is_fitted_from_several_starts(experiment: Experiment, scale: Scale) -> None:
    network = experiment.machine.model.network
    names = ("clock_offset", "fan_thermostat", "windage")
    placed = [CATALOGUE[name].placed(network, scale, CHANNELS)[0] for name in names]
    clock, fan, windage = scan(calibrate(experiment), [hypothesis_of(one) for one in placed]).starts
    sizes = [size for _, size in clock]
    assert len(sizes) == 3 and len(set(sizes)) == 3 and len({np.sign(size) for size in sizes}) == 1
    assert len(fan) == SHAPES_TRIED - 1 and len({variant for variant, _ in fan}) == len(fan)
    assert windage == ()


def test_the_best_start_goes_on(experiment: Experiment, scale: Scale) -> None:
    """A clock that is 80 s late, from a few seconds: a straight line does not lead there."""
    placed, *_ = CATALOGUE["clock_offset"].placed(experiment.machine.model.network, scale, CHANNELS)
    piece, late_s, one = experiment.pieces[0], 80.0, hypothesis_of(placed)
    measured = np.array(piece.measured)
    for index, name in enumerate(CHANNELS):
        if name != "P_loss":
            measured[:, index] = np.interp(piece.time - late_s, piece.time, piece.measured[:, index])
    base = calibrate(with_measured(experiment, measured))
    small = int(np.flatnonzero(one.variants[:, 0] > 0.0)[0])
    alone = refit(base, one, small, 5.0, iterations=4)
    several = refit(base, one, small, 5.0, further=((small, 40.0), (small, 80.0)), iterations=4)
    assert value_of(alone, placed.strength.name) < 0.25 * late_s
    assert value_of(several, placed.strength.name) == pytest.approx(late_s, abs=10.0)
    assert several.objective < 0.25 * alone.objective


def test_the_heat_of_a_term_over_the_time(experiment: Experiment, scale: Scale) -> None:
    placed = next(p for p in CATALOGUE["solar_soak"].placed(experiment.machine.model.network, scale)
                  if p.place == "housing")  # fmt: skip
    piece = experiment.pieces[0]
    noon, length = 0.4 * piece.time[-1], 0.2 * piece.time[-1]
    given = dict(zip((p.name for p in placed.parameters), (80.0, noon, length), strict=True))
    sunny = with_term(experiment, placed)
    heat = course_of_heat(sunny.fit(at(sunny, given), iterations=0), placed)
    bell = 80.0 * np.exp(-(((piece.middle - noon) / length) ** 2))
    assert heat == pytest.approx(bell * np.sqrt(piece.steps), rel=1e-6, abs=1e-6)


def starts_of_fits(monkeypatch: pytest.MonkeyPatch, index: int) -> list[float]:
    """Strengths, which are one unknown, from which rough fits start from now on."""
    starts, fit = list[float](), Experiment.fit

    def noted(own: Experiment, z: Array, *given: Any, iterations: int, **options: Any) -> Fit:
        if iterations == ROUGH:
            starts.append(own.unknowns[index].value(float(z[index])))
        return fit(own, z, *given, iterations=iterations, **options)

    monkeypatch.setattr(Experiment, "fit", noted)
    return starts


def test_what_switches_starts_from_several_strengths(
    experiment: Experiment, scale: Scale, monkeypatch: pytest.MonkeyPatch
) -> None:
    placed, _, base = with_fan(experiment, scale)
    without = calibrate(experiment)
    starts = starts_of_fits(monkeypatch, len(base.z))
    found_with(base, placed)
    assert np.array(starts[:3]) / starts[0] == pytest.approx(SWITCH_SHARES) and len(starts) >= 3
    starts.clear()
    found_with(without, placed)  # a machine without it: other sizes bring nothing either
    assert len(starts) == 1
    grids, scanned = list[int](), switch_grid.scan

    def counted(fit: Fit, candidates: Sequence[Hypothesis]) -> Scan:
        grids.append(len(candidates))
        return scanned(fit, candidates)

    monkeypatch.setattr(switch_grid, "scan", counted)
    found_with(without, placed)
    assert len(grids) == 1  # and a finer grid neither
    found_with(base, placed)
    assert len(grids) == 1 + switch_grid.LEVELS


def test_in_means_over_minutes_too_and_from_the_fit_as_it_is(
    experiment: Experiment, scale: Scale, monkeypatch: pytest.MonkeyPatch
) -> None:
    """There its numbers are not held, but the objective has many minima all the same."""
    slow = replace(experiment, pieces=tuple(replace(piece, slow=True) for piece in experiment.pieces))
    placed, _, base = with_fan(slow, scale)
    aside = replace(base, z=base.z + 0.3)
    far = replace(aside, linearised=aside.experiment.linearise(aside.z))
    starts = starts_of_fits(monkeypatch, len(base.z))
    found_with(base, placed)
    once = len(starts)
    assert np.array(starts[:3]) / starts[0] == pytest.approx(SWITCH_SHARES) and once >= 3
    starts.clear()
    found_with(far, placed)
    assert len(starts) == 2 * once
