"""Model error that is written into a machine does to the readings what its straight lines do."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from diagnosis.engine import learnt_error as module
from diagnosis.engine.calibration import NearReadings
from diagnosis.engine.fit import Experiment
from diagnosis.engine.learnt import error_classes
from diagnosis.engine.learnt_error import (
    WRITABLE,
    LearntError,
    is_writable,
    learnt_error,
    with_learnt_error,
)
from diagnosis.engine.model_error import ModelError
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.recordings.read import read_recordings
from models.assembly.gearbox import load_gearbox
from models.base.types import Array
from models.correction.correction import Correction, Finding, correction_text
from models.network.laws import symbol
from models.terms.term import Term
from tests.unit.diagnosis.inference_example import recording_of

DATA = Path(__file__).parents[4] / "examples" / "data"
SD = 0.3


@cache
def experiment_of(machine: str) -> Experiment:
    gearbox = load_gearbox(machine)
    if machine != "fzg":
        train = read_recordings([f"{DATA / machine}.csv.gz@0..7200"], gearbox.network())
        return prepare_experiment(gearbox, train, [])[1]
    time = np.arange(0.0, 7200.0, 10.0)
    columns = {"time_s": time, "speed_rpm": np.interp(time, [600, 4000], [900, 2500]),
               "torque_Nm": np.interp(time, [600, 5000], [20.0, 90.0]),
               "T_ambient_degC": np.interp(time, [0, 7200], [20.0, 24.0])}  # fmt: skip
    result = gearbox.network().simulate(columns, losses=gearbox.losses(), initial=22.0).columns()
    names = ("oil", "housing_upper", "bearing_1")
    recording = recording_of(
        columns, {name: result[f"T_{name}_degC"] for name in names} | {"P_loss": result["P_loss_W"]}
    )
    return prepare_experiment(gearbox, [recording], [])[1]


def written(error: ModelError, values: Array, experiment: Experiment) -> LearntError:
    return learnt_error(error, values, lambda combination: SD * float(np.linalg.norm(combination)),
                        experiment.machine.model.network)  # fmt: skip


@pytest.mark.parametrize("machine", ["fzg", "heated_rod"])
@pytest.mark.parametrize("group", sorted(WRITABLE))
def test_what_is_written_acts_like_the_straight_lines(
    machine: str, group: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "LEAST", 0.0)
    monkeypatch.setattr(module, "LEAST_SHARE", 0.0)
    experiment = experiment_of(machine)
    error, z = ModelError.of(experiment), np.zeros(len(experiment.unknowns))
    mine = np.array(error.groups) == group
    values = np.where(mine, 3e-3 * np.random.default_rng(2).standard_normal(len(mine)), 0.0)
    here = experiment.point(0, z, rounds=12)
    learnt = written(error, values, experiment)
    there = replace(experiment, machine=learnt.added_to(experiment.machine)).point(0, z, rounds=12)
    # Cold parts jump within the first intervals; there a derivative is that of the middle.
    found, expected = (there.read - here.read)[4:].ravel(), error.combined_responses(here, values[:, None])[4:].ravel()
    sizes = np.linalg.norm(found), np.linalg.norm(expected)
    assert sizes[1] > 0.01
    assert found @ expected > 0.99 * sizes[0] * sizes[1]
    assert sizes[0] == pytest.approx(sizes[1], rel=0.05)


def test_what_is_small_is_left_out_and_sizes_have_standard_errors() -> None:
    experiment = experiment_of("fzg")
    error = ModelError.of(experiment)
    mine = np.array(error.groups) == "a_loss"
    values = np.where(mine, 0.04, 0.0)
    found = written(error, values, experiment)
    assert found.terms and all(term.strength.sd == pytest.approx(SD) for term in found.terms)
    assert not written(error, values * 0.02, experiment).terms
    (churning,) = (term for term in found.terms if term.target == ("churning",))
    assert churning.strength.start == pytest.approx(0.04 * np.sqrt(9))  # of all functions of speed and oil temperature
    assert {"speed", "T_oil", churning.strength.name} == {s.name for s in churning.expression.free_symbols}


def test_heat_that_is_moved_sums_to_nothing() -> None:
    experiment = experiment_of("fzg")
    error = ModelError.of(experiment)
    values = np.where(np.array(error.groups) == "b_split", 0.02, 0.0)
    terms = written(error, values, experiment).terms
    assert {term.kind for term in terms} == {"source"} and not any(term.is_loss for term in terms)
    sizes = {symbol(term.strength.name): term.strength.start for term in terms}
    total = sum(term.expression.xreplace(sizes) for term in terms)
    heats = dict.fromkeys(set().union(*(term.expression.free_symbols for term in terms)), 100.0)
    largest = max(abs(float(term.expression.xreplace(sizes).xreplace(heats))) for term in terms)
    assert abs(float(total.xreplace(heats))) < 2e-3 * largest  # numbers are written with four digits


def test_a_correction_holds_it() -> None:
    experiment, gearbox = experiment_of("fzg"), load_gearbox("fzg")
    error = ModelError.of(experiment)
    values = np.where(np.isin(error.groups, ["a_loss", "b_split"]), 0.02, 0.0)

    def finding(term: Term) -> Finding:
        return Finding.of(term, {term.strength.name: (term.strength.start, term.strength.sd)}, mechanism="model error",
                          grade="learnt")  # fmt: skip

    found = written(error, values, experiment).terms
    correction = Correction.of(gearbox, findings=[finding(term) for term in found])
    assert correction.claims_only() == correction and correction.summary()["findings"] == []
    assert len(correction_text(correction)) < 60_000
    assert {p.name for term in found for p in term.parameters} <= {
        p.name for p in correction.network(gearbox).parameters
    }


def test_the_session_that_is_predicted_deviates_from_what_all_share() -> None:
    experiment = experiment_of("fzg")
    plain = experiment.with_filters(experiment.fit(iterations=0).parts).fit(iterations=0)
    near = NearReadings.of(experiment, ModelError.of(experiment), plain)
    splits = next(one for one in error_classes() if one.name == "splits")
    fit = near.fitted(splits, plain, 0.4, iterations=0).fit
    metric = fit.experiment.metric
    (found,) = metric.explained([part.residual for part in fit.parts])
    deviation = found[metric.shared :]
    assert len(deviation) == len(fit.z) and np.abs(deviation).max() > 0.01
    there, terms = with_learnt_error(fit, near, splits)
    np.testing.assert_allclose(there.z, np.clip(fit.z + deviation, *fit.experiment.bounds))
    assert terms and there.experiment.machine.mixes


def test_classes_that_a_model_can_hold() -> None:
    held = {one.name for one in error_classes() if is_writable(one)}
    assert "splits and small law errors" in held
    assert held.isdisjoint({"none", "full"})
