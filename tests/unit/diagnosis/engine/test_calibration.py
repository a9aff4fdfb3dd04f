"""Calibration with model error: it stays near the readings, settles, and has every class at hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike

from diagnosis.engine import calibration as calibration_module
from diagnosis.engine.calibration import (
    Calibration,
    NearReadings,
    calibrate_in_draughts,
    calibrate_with_error,
    recalibrate,
)
from diagnosis.engine.fit import Experiment, calibrate
from diagnosis.engine.learnt import error_classes, widest_class
from diagnosis.engine.model_error import ModelError
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.sessions import fit_over_sessions
from diagnosis.forward.whitening import AS_ASSUMED, RandomHeat
from models.assembly.gearbox import Gearbox
from tests.unit.diagnosis.inference_example import recorded, with_measured

WIDEST = widest_class()


@pytest.fixture(scope="module")
def found(fzg: Gearbox) -> Calibration:
    """A machine whose losses have another law than the model's."""
    train = recorded(fzg, "train", windage_W=150.0, hours=3.0, factors={"h_air": 2.2, "mesh": 0.8})
    _, experiment = prepare_experiment(fzg, [train], [train])
    return calibrate_with_error(experiment, calibrate(experiment))


def test_model_error_brings_the_simulation_to_the_readings(found: Calibration) -> None:
    """Alone, a linear model error leaves the simulation kelvins beside them."""
    first = found.near.fitted(WIDEST, found.fit)  # of another class than the calibrated one: it settles in two turns
    there = NearReadings.of(first.fit.experiment, found.near.error, first.fit).fitted(WIDEST, first.fit)
    for part in there.fit.parts:
        assert part.point.trajectory.piece.error is not None
        with_error, without = (np.nanstd(r[5:]) for r in (part.point.residual, part.point.residual_without_error))
        assert without > 1.0 and with_error < 0.1 * without


def test_it_is_judged_by_the_random_heat_that_its_readings_show(found: Calibration) -> None:
    """There is none in them."""
    chosen = found.fit.experiment
    assert chosen.random_heat.heat <= 0.25 and chosen.random_heat == found.near.experiment.random_heat
    assert recalibrate(found, found.fit).fit.experiment.random_heat == chosen.random_heat


def test_where_another_start_is_no_better_or_has_no_solution_all_stays(
    found: Calibration, monkeypatch: pytest.MonkeyPatch
) -> None:
    ahead = replace(found, chosen=replace(found.chosen, log_evidence=found.chosen.log_evidence + 100.0))
    assert recalibrate(ahead, found.fit) is ahead

    def fails(*_: object) -> NearReadings:
        raise ArithmeticError("no solution")

    monkeypatch.setattr(NearReadings, "of", fails)
    assert recalibrate(found, found.fit) is found


@pytest.mark.parametrize("far_sd", [0.0, np.inf])
def test_a_machine_far_from_what_is_stated_is_calibrated_from_there_too(
    found: Calibration, monkeypatch: pytest.MonkeyPatch, far_sd: float
) -> None:
    """Where it had ended, readings are explained worse."""
    worse = replace(found, chosen=replace(found.chosen, log_evidence=found.chosen.log_evidence - 100.0))
    monkeypatch.setattr(calibration_module, "FAR_SD", far_sd)
    reached = calibration_module._from_middles(worse)
    if far_sd:
        assert reached is worse
    else:
        assert reached.chosen.log_evidence > found.chosen.log_evidence - 5.0


def test_it_has_settled(found: Calibration) -> None:
    chosen = found.chosen
    near = NearReadings.of(chosen.fit.experiment, found.near.error, chosen.fit)
    again = near.fitted(chosen.error_class, chosen.fit, chosen.deviation)
    assert np.abs(again.fit.z - chosen.fit.z).max() < 0.1
    assert again.log_evidence == pytest.approx(chosen.log_evidence, abs=0.5)


def test_the_most_probable_class_is_chosen(found: Calibration) -> None:
    assert found.evidence[found.chosen.error_class.name] == 0.0 == max(found.evidence.values())
    assert set(found.evidence) == {one.name for one in error_classes()}
    at = {one.name: found.near.log_evidence(one, found.fit.z) for one in error_classes()}
    assert max(at, key=lambda name: at[name]) == found.chosen.error_class.name


def test_another_class_starts_at_the_same_point(found: Calibration) -> None:
    there = found.in_class(WIDEST)
    assert there is found.in_class(WIDEST) and there.error_class == WIDEST
    np.testing.assert_array_equal(there.fit.z, found.fit.z)
    expected = found.near.log_evidence(WIDEST, found.fit.z)
    assert there.log_evidence == pytest.approx(expected, abs=0.5)
    assert fit_over_sessions(there.fit, len(there.fit.z)).log_evidence == pytest.approx(
        there.log_evidence - np.log(WIDEST.prior)
    )


def shaken(fzg: Gearbox, *, times: ArrayLike, lasting: float = 1.0, draught: float = 0.0) -> Experiment:
    """A machine with random heats in its parts: so many times as much as is assumed, and as lasting; and draughts.

    Parameters
    ----------
    times : array_like, shape (parts,) or ()
    """
    train = recorded(fzg, "train", hours=6.0)
    _, experiment = prepare_experiment(fzg, [train], [train])
    point, noise = experiment.point(0, np.zeros(len(experiment.unknowns))), experiment.noise[0]
    rng = np.random.default_rng(1)
    rho = np.exp(-point.trajectory.piece.steps / noise.heat_time / lasting)
    heat = np.zeros((len(rho), point.trajectory.decay.shape[-1], 1))
    model, balance = experiment.machine.model, point.trajectory.balance
    outside = np.abs(model.to_parts.sum(axis=1)) > 0.5
    from_air = (balance.conductances * balance.differences)[:, outside] @ model.to_parts[outside]
    now = rng.standard_normal(model.n + 1)
    for k, kept in enumerate(rho):
        heat[k, : model.n, 0] = np.asarray(times) * noise.heat_sd * now[:-1] + draught * from_air[k] * now[-1]
        now = kept * now + np.sqrt(1.0 - kept**2) * rng.standard_normal(len(now))
    moved = point.heated(heat, np.zeros((len(rho), 1)))[:, :, 0]
    return with_measured(experiment, experiment.pieces[0].measured + moved)


def likely(experiment: Experiment) -> RandomHeat:
    fit = calibrate(experiment)
    near = NearReadings.of(experiment, ModelError.of(experiment), fit)
    return near.most_probable(near.evidence_of(WIDEST, fit.z), AS_ASSUMED)


def test_random_heats_are_as_much_as_the_readings_show(fzg: Gearbox) -> None:
    assert likely(shaken(fzg, times=0.0)).heat <= 0.25
    assert likely(shaken(fzg, times=1.0)).heat >= 0.5


def test_random_heats_are_never_raised_and_last_longer_without_geometry_alone(fzg: Gearbox) -> None:
    """Else an effect that lasts for hours would pass for random."""
    experiment = shaken(fzg, times=3.0, lasting=10.0)
    found = likely(experiment)
    assert (found.heat, found.time) == (1.0, 1.0) and found.wander <= 1.0
    capacity = float(experiment.point(0, np.zeros(len(experiment.unknowns))).trajectory.capacities.sum())
    free = likely(replace(experiment, noise=tuple(replace(one, capacity=capacity) for one in experiment.noise)))
    assert free.time > 1.0 and max(free.heat, free.wander) <= 1.0


def test_without_geometry_each_part_has_as_much_random_heat_as_it_shows(fzg: Gearbox) -> None:
    experiment = prepare_experiment(fzg, [recorded(fzg, "train", hours=6.0)])[1]
    quiet = [part == "oil" for part in experiment.machine.model.parts]
    capacity = float(experiment.point(0, np.zeros(len(experiment.unknowns))).trajectory.capacities.sum())
    experiment = shaken(fzg, times=np.where(quiet, 0.0, 20.0))
    loud = tuple(replace(one, heat_sd=20.0 * one.heat_sd) for one in experiment.noise)
    assert likely(replace(experiment, noise=loud)).parts == ()
    found = likely(replace(experiment, noise=tuple(replace(one, capacity=capacity) for one in loud)))
    assert [times < 1.0 for times in found.parts] == quiet and found.heat == 1.0


def test_draughts_are_assumed_where_the_readings_show_them(fzg: Gearbox, found: Calibration) -> None:
    """They change the heat of all parts to the surroundings by one share, 5 % at most."""
    assert calibrate_in_draughts(found) is None
    experiment = shaken(fzg, times=0.0, draught=0.04)
    still = calibrate_with_error(experiment, calibrate(experiment))
    there = calibrate_in_draughts(still)
    assert there is not None and 0.01 < there.near.experiment.random_heat.draught <= 0.05
    assert there.chosen.log_evidence > still.chosen.log_evidence + 5.0
    assert there.near.experiment.noise[0].draught == there.near.experiment.random_heat.draught
    assert calibrate_in_draughts(replace(still, of_others=still)) is None  # a broken sensor is no draught


def test_random_heats_are_factors_on_what_is_assumed(found: Calibration) -> None:
    """Whatever the experiment has already."""
    size = len(found.near.experiment.noise[0].heat_sd)
    times = RandomHeat(heat=0.25, wander=0.5, draught=0.02, parts=(0.5,) * size)
    has = RandomHeat(heat=0.5, wander=0.125, time=2.0, parts=(*(1.0,) * (size - 1), 0.25))
    again = found.near.experiment.with_random_heat(has).with_random_heat(times)
    back = found.near.experiment.with_random_heat(times)
    assert again.random_heat == back.random_heat == times
    for one, other, assumed in zip(again.noise, back.noise, found.near.experiment.noise, strict=True):
        np.testing.assert_array_equal(one.heat_sd, other.heat_sd)
        np.testing.assert_array_equal(one.heat_sd, 0.125 * assumed.heat_sd / found.near.experiment.random_heat.heats)
        assert (one.wander, one.heat_time, one.draught) == (other.wander, other.heat_time, 0.02)
