"""An experiment with baselines: an effect that they lack, one that they have, and another machine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import Hypothesis, hypothesis_of
from diagnosis.engine.calibration import calibrate_with_error
from diagnosis.engine.fit import Experiment, Fit, calibrate
from diagnosis.engine.outside import SIZES, judge_outside, outside_of
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.refit import refit
from diagnosis.engine.scan import scan
from diagnosis.engine.sessions import over_sessions, sessions_apart
from diagnosis.recordings.recording import Recording
from diagnosis.results.notes import evidence_in_baselines
from diagnosis.setup.inference_setup import InferenceSetup
from models.assembly.gearbox import Gearbox
from models.mechanisms import CATALOGUE, Scale
from tests.unit.diagnosis.inference_example import NODES, recorded

WINDAGE_W = 60.0


@pytest.fixture(scope="module")
def prepared(fzg: Gearbox) -> tuple[InferenceSetup, Experiment]:
    train, held = recorded(fzg, "train", windage_W=WINDAGE_W), recorded(fzg, "hold", seed=1, hours=0.5)
    healthy = recorded(fzg, "april", seed=2, nodes=(*NODES, "wheel"))
    return prepare_experiment(fzg, [train], [held], [healthy], switched_off=("windage",))


@pytest.fixture(scope="module")
def drift(fzg: Gearbox) -> Hypothesis:
    placed = CATALOGUE["sensor_drift"].placed(fzg.network(), Scale.of(fzg, speed=3300.0, torque=150.0, duration=5400.0))
    return next(hypothesis_of(p) for p in placed if p.place == "oil")


def calibrated(fzg: Gearbox, train: Recording, healthy: Recording) -> Fit:
    return calibrate(prepare_experiment(fzg, [train], [train], [healthy])[1])


def test_baselines_are_pieces_of_another_session(prepared: tuple[InferenceSetup, Experiment]) -> None:
    setup, experiment = prepared
    assert [piece.recording for piece in experiment.pieces] == ["train", "april"]
    assert [piece.recording for piece in setup.held_out] == ["hold"]
    assert experiment.session_of == {"train": "", "hold": "", "april": "april"}
    assert experiment.healthy == {"april"} and "wheel" in setup.channels
    assert np.isfinite(experiment.pieces[1].measured).any(axis=0).all()


def test_where_an_effect_may_act(prepared: tuple[InferenceSetup, Experiment]) -> None:
    _, experiment = prepared
    assert experiment.scope_of("windage") == {"train", "hold"} and experiment.scope_of("pocketing") is None
    assert experiment.scope_of("pocketing", dated=True) == {"train", "hold"}
    nothing_acts = replace(experiment, switched_off=frozenset())
    assert nothing_acts.scope_of("pocketing") == {"train", "hold"}
    assert replace(nothing_acts, healthy=frozenset()).scope_of("windage") is None


def test_an_effect_is_scanned_and_fitted_where_it_may_act(prepared: tuple[InferenceSetup, Experiment]) -> None:
    """With the baseline the strength comes out; the reading of the baseline does not hang on it."""
    setup, experiment = prepared
    fit = calibrate(experiment)
    placed = CATALOGUE["windage"].placed(experiment.machine.model.network, setup.scale, setup.channels)
    windage = next(hypothesis_of(p) for p in placed if p.place == "oil")
    found = scan(fit, [windage])
    at = found.of_candidates[0] + 1
    assert not found.gram.of_recording["april"][:, at].any() and found.gram.of_recording["train"][at, at] > 0.0
    reached = refit(fit, windage, found.best[0], float(found.singles(found.gram.given(found.unknowns)).value[0]))
    unknown, z = reached.experiment.unknowns[len(fit.z)], float(reached.z[len(fit.z)])
    sd = unknown.parameter.sd * float(np.sqrt(reached.covariance[len(fit.z), len(fit.z)]))
    assert abs(unknown.value(z) - WINDAGE_W) < 3.0 * sd
    columns = {p.point.setting.recording: p.columns for p in reached.parts}
    assert not columns["april"][:, len(fit.z) :].any() and columns["train"][:, len(fit.z)].any()


def test_an_unknown_heat_is_judged_over_deviations_between_sessions(
    prepared: tuple[InferenceSetup, Experiment],
) -> None:
    """One function of a heat has the evidence that the same column has among the candidates."""
    setup, experiment = prepared
    fit = calibrate(experiment)
    whole = next(one for one in outside_of(setup, experiment) if one.place == "oil")
    function = replace(whole, variants=whole.variants[1:2])
    found = scan(fit, [function])
    over = over_sessions(found.gram, experiment, found.unknowns)
    sizes = [over.weighed([replace(found, sd=size * found.sd).singles(given).log_bayes for given in over.given])
             for size in SIZES]  # fmt: skip
    ((_, log_bayes),) = judge_outside(fit, [function])
    assert log_bayes == pytest.approx(float(np.log(np.mean(np.exp(sizes)))), rel=1e-9)


def test_without_held_out_recordings_baselines_are_whole(fzg: Gearbox) -> None:
    train, healthy = recorded(fzg, "train", hours=0.5), recorded(fzg, "april", hours=0.5, seed=2)
    setup, experiment = prepare_experiment(fzg, [train], (), [healthy])
    last = [piece.time[np.isfinite(piece.measured).any(axis=1)][-1] for piece in experiment.pieces]
    assert last[0] <= 0.76 * 1800.0 and last[1] > 0.95 * 1800.0
    assert [piece.recording for piece in setup.held_out] == ["train"]


def test_an_effect_that_acts_in_the_baseline_is_seen_there(fzg: Gearbox, drift: Hypothesis) -> None:
    """With it in the baseline the evidence is large, without it none."""
    train = recorded(fzg, "train", drift_K=3.0)
    found = {}
    for kelvin in (0.0, 3.0):
        fit = calibrated(fzg, train, recorded(fzg, "april", drift_K=kelvin, seed=2))
        found[kelvin] = evidence_in_baselines(fit, drift)
    assert found[0.0] < 2.0 < 20.0 < found[3.0]


@pytest.mark.slow
def test_another_machine_is_told_apart(fzg: Gearbox) -> None:
    train = recorded(fzg, "train")
    found = {}
    for name, factors in {
        "same": {},
        "other": {"C_oil": 2.5, "C_housing_lower": 2.5, "h_air": 3.0, "h_oil_housing": 0.3, "mesh": 1.8},
    }.items():
        healthy = recorded(fzg, "april", seed=2, factors=factors)
        _, experiment = prepare_experiment(fzg, [train], [train], [healthy])
        found[name] = sessions_apart(calibrate_with_error(experiment, calibrate(experiment)).fit)["april"]
    assert found["same"] < -5.0 and found["other"] > 10.0, found
