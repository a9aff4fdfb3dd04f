"""What is left out of the model that predicts, because recordings contradict it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from diagnosis.decision.answer import Answer
from diagnosis.decision.posterior import Judged
from diagnosis.engine.calibration import Calibration
from diagnosis.engine.fit import Fit
from diagnosis.engine.learnt import error_classes
from diagnosis.engine.point import Machine
from diagnosis.engine.refit import with_candidate
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.recorder import simulated_as_recorded
from diagnosis.recordings.recording import Recording
from diagnosis.report.write import correction_of
from diagnosis.results import held_out, predictions
from models.assembly.gearbox import Gearbox
from models.correction.correction import MODEL_ERROR
from models.files.cycle import Cycle
from models.formulas.extremes import Max
from models.terms.term import Term
from tests.unit.diagnosis.results.assembled_example import Assemble, Prepared, effect_of, posterior_of


def test_what_was_learnt_of_model_error_is_in_prediction_and_correction(
    assembled: Assemble, prepared: Prepared, calibration: Calibration, recordings: tuple[Recording, Recording],
    fzg: Gearbox,
) -> None:  # fmt: skip
    """The full model with the correction, read through its sensors, gives the prediction that was judged."""
    splits = next(one for one in error_classes() if one.name == "splits and law errors")
    posterior = posterior_of(calibration.near.fitted(splits, prepared[2]).fit, log_e=-1.0)
    missing = replace(posterior, nothing=replace(posterior.nothing, error_class=splits))
    found = assembled(missing, [], plain=prepared[2])
    assert found.verdict in ("consistent", "insufficient_data") and found.learnt and found.has_correction
    assert found.holdout.found == found.holdout.calibrated > found.holdout.after
    correction = correction_of(found, fzg)
    assert {one.mechanism for one in correction.findings if one.label.startswith("learnt_")} == {MODEL_ERROR}
    assert any(sensor.mix for sensor in correction.sensors)
    assert "with what was learnt of model error" in str(found)
    (course,) = (one for one in found.courses if one.held_out)
    network, cycle = correction.network(fzg), Cycle(recordings[1].time, recordings[1].inputs)
    read = simulated_as_recorded(cycle, correction, lambda driven: network.simulate(
        driven, losses=fzg.losses(), initial=course.start).columns())  # fmt: skip
    for name in ("oil", "bearing_1"):
        there = np.interp(course.time, cycle.time, read[f"T_{name}_degC_as_recorded"])
        apart = (there - course.after[name])[course.time > course.counts_from_s]
        assert float(np.sqrt(np.mean(apart**2))) < 0.03  # the grid of a prediction rounds corners


def at_fast_and_light(s: Any) -> Any:
    """A heat at an operation of the held-out ride alone."""
    return 0.3 * Max(s.speed - 3000.0, 0.0) * Max(70.0 - s.torque, 0.0)


@pytest.mark.parametrize("law", [3000.0, 3e7, at_fast_and_light])
def test_what_was_learnt_is_left_out_where_it_makes_the_recordings_worse(
    assembled: Assemble, prepared: Prepared, calibration: Calibration, monkeypatch: pytest.MonkeyPatch, law: Any
) -> None:
    """Far off, with temperatures that leave all bounds, or in the held-out recording alone."""
    splits = next(one for one in error_classes() if one.name == "splits and law errors")
    posterior = posterior_of(calibration.near.fitted(splits, prepared[2]).fit, log_e=-1.0)
    learn = predictions.with_learnt_error

    def wrong(*given: Any) -> tuple[Fit, tuple[Term, ...]]:
        fit, terms = learn(*given)
        there = fit.experiment.machine
        model = NetworkOnGrid(there.model.network.with_source("oil", law, name="much"), there.model.losses)
        return replace(fit, experiment=replace(fit.experiment, machine=Machine(model, there.terms, there.mixes))), terms

    monkeypatch.setattr(predictions, "with_learnt_error", wrong)
    missing = replace(posterior, nothing=replace(posterior.nothing, error_class=splits))
    found = assembled(missing, [], plain=prepared[2])
    assert not found.learnt and not found.has_correction
    assert found.holdout.after == found.holdout.calibrated
    assert (found.left_out_K > found.holdout.after + 1.0) is callable(law)
    assert ("left out: with it held-out temperatures are missed by" in str(found)) is callable(law)


@pytest.mark.parametrize(
    ("left", "named", "alone_W", "stays"),
    [(1.0, 1, 65.0, True), (80.0, 1, 65.0, True), (1.0, 2, 65.0, True), (1.0, 1, 900.0, False)],
)
def test_a_second_effect_is_left_out_where_held_out_readings_contradict_it(
    assembled: Assemble, prepared: Prepared, windage: Judged, monkeypatch: pytest.MonkeyPatch, left: float, named: int,
    alone_W: float, stays: bool,
) -> None:  # fmt: skip
    """The first one stays if it is not contradicted itself, as a claim if little is left without the other one.

    Of two with names too.
    """
    there, z, at = windage.fitted.experiment, windage.fitted.z.copy(), len(prepared[2].z)
    z[at] = there.unknowns[at].z_of(alone_W)
    single = replace(windage, left=left, fit=there.fit(z, iterations=0))
    harmful = effect_of(prepared[0], prepared[2], "hot_neighbour", "housing_lower")
    experiment, z = with_candidate(single.fitted, harmful, 0)
    z[0] = experiment.unknowns[len(single.fitted.z)].z_of(300.0)
    fit = experiment.fit(np.concatenate([single.fitted.z, z]), iterations=0)
    pair = Judged(effects=(*single.effects, harmful), log_bayes=120.0, fit=fit, error_class=single.error_class)
    monkeypatch.setattr(held_out, "_final", lambda best, plain, _: best.fit if best else plain)
    answers = [Answer(best=pair, effect=effect, grade="claim", probability=0.95, joint=0.95) for effect in pair.effects]
    certain = posterior_of(prepared[2], single, pair, log_e=1e6)  # whatever the held-out readings take off
    found = assembled(certain, answers[:named])
    assert found.contradicted is not stays
    assert [term.label for term in found.terms] == [one.term.label for one in pair.effects[:stays] if one.term]
    assert stays or found.holdout.found > found.holdout.calibrated  # what it would have been with them
    assert found.findings[0].grade == ("claim" if stays and left == 1.0 else "likely")
    assert (found.holdout.after < found.holdout.calibrated) is stays
    assert ("a second effect was fitted too and is left out" in str(found)) is stays


def test_without_the_estimated_bias_of_a_thermometer_it_is_missed(assembled: Assemble, prepared: Prepared) -> None:
    experiment, z = prepared[2].experiment, prepared[2].z.copy()
    names = [unknown.parameter.name for unknown in experiment.unknowns]
    offset = names.index("bias_oil")
    z[predictions.instruments_of(experiment)] = 0.0
    z[offset] = experiment.unknowns[offset].z_of(2.0)
    fit = Fit(experiment=experiment, z=z, linearised=prepared[2].linearised)
    stated = predictions._with_stated_instruments(fit, None)
    assert stated.z[offset] == 0.0 and stated.z[names.index("mesh")] == z[names.index("mesh")]
    found = assembled(posterior_of(prepared[2], log_e=-1.0), [])
    assert found.as_stated_K > found.holdout.after  # windage is put down to instruments too
    biased = predictions._predictions(fit, experiment, [None] * len(experiment.pieces))
    plain = predictions._predictions(stated, experiment, [None] * len(experiment.pieces))
    oil = experiment.pieces[0].channels.index("oil")
    assert biased[0].read[-1, oil] - plain[0].read[-1, oil] == pytest.approx(2.0, abs=0.05)  # the start is another one
