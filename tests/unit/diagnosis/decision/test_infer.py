"""A short ride of the rig from calibration to answers, and which candidates are fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import Hypothesis, hypothesis_of
from diagnosis.decision import infer as infer_module
from diagnosis.decision.answer import decide
from diagnosis.decision.infer import (
    NEAR_PLACE,
    PLACES,
    RACED,
    _judged,
    _worth_a_fit,
    infer,
)
from diagnosis.decision.placebo import CandidatesIn, are_trusted, judge_baselines
from diagnosis.decision.posterior import KINDS, Judged, Posterior
from diagnosis.decision.scanned import (
    ScanInClass,
    Scanned,
    as_fits_show,
    counts_less,
    hardly_there,
    in_best_classes,
    scan_at,
    scan_in_classes,
)
from diagnosis.decision.settings import Settings
from diagnosis.engine import calibration as calibration_module
from diagnosis.engine.calibration import Calibration, calibrate_with_error, recalibrate
from diagnosis.engine.families import axis_of, changes, parameters_outside
from diagnosis.engine.fit import Experiment, Fit, calibrate
from diagnosis.engine.learnt import ErrorClass, error_classes, rule
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.refit import with_candidate
from diagnosis.engine.scan import scan
from diagnosis.engine.unknown import TermParameter
from diagnosis.results import notes
from diagnosis.results.findings import heats_of, values_of
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.base.progress import silent
from models.base.types import Array
from models.mechanisms import CATALOGUE, Placed, Scale
from models.network.laws import Parameter, symbol
from models.terms.term import Form, Term
from tests.unit.diagnosis.inference_example import acting, recorded

LOOKED_FOR = ("windage", "air_cooling_change", "sensor_bias", "hot_neighbour")
WINDAGE_W, AT_RPM, HOURS = 150.0, 3300.0, 1.5


def calibrated(
    fzg: Gearbox, windage_W: float, in_baselines_W: Sequence[float] = (0.0,), switched_off: Sequence[str] = (),
    bias_K: float = 0.0,
) -> tuple[Calibration, CandidatesIn]:  # fmt: skip
    """A ride with windage in the oil, or without it, and a biased thermometer, and baselines of other days."""
    train = recorded(fzg, "train", windage_W=windage_W, hours=HOURS)
    train = replace(train, channels=tuple(
        replace(one, values=one.values + bias_K * (one.name == "oil")) for one in train.channels))  # fmt: skip
    healthy = [recorded(fzg, name, seed=2 + at, hours=HOURS, windage_W=windage)
               for at, (name, windage) in enumerate(zip(("april", "may"), in_baselines_W, strict=False))]  # fmt: skip
    setup, experiment = prepare_experiment(fzg, [train], [train], healthy, switched_off=switched_off)
    network = experiment.machine.model.network
    placed = [one for name in LOOKED_FOR for one in CATALOGUE[name].placed(network, setup.scale, setup.channels)]
    dated = [one for one in placed if one.label in ("windage_oil", "sensor_bias_oil")]

    def candidates_in(there: Experiment) -> list[Hypothesis]:
        return [*(hypothesis_of(one) for one in placed), *changes([], dated, axis_of(there), {}),
                *parameters_outside(there)]  # fmt: skip

    return calibrate_with_error(experiment, calibrate(experiment)), candidates_in


def inferred(fzg: Gearbox, windage_W: float, **given: Any) -> Posterior:
    calibration, candidates_in = calibrated(fzg, windage_W, **given)
    found = scan_at(calibration, candidates_in(calibration.fit.experiment))
    return infer(calibration, found, Settings(), candidates_in=candidates_in)


@pytest.fixture(scope="module")
def healthy(fzg: Gearbox) -> Posterior:
    return inferred(fzg, 0.0)


@pytest.fixture(scope="module")
def concealed(fzg: Gearbox) -> Posterior:
    return inferred(fzg, WINDAGE_W)


def test_what_is_not_off_in_the_baselines_has_its_heat_in_them_and_no_note(
    concealed: Posterior, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(notes, "evidence_in_baselines", lambda *_: 50.0)
    answers = decide(concealed)
    fit, effect = answers[0].best.fitted, answers[0].effect
    everything_off, another_off = (replace(fit.experiment, switched_off=frozenset(of)) for of in ((), ("another",)))
    april = [part.point.trajectory.piece.recording for part in fit.parts].index("april")
    for experiment, acts in ((everything_off, False), (another_off, True)):
        assert heats_of(replace(fit, experiment=experiment), effect)[april].any() == acts
        noted = notes.baseline_notes(experiment, concealed, answers)
        assert any("show windage too" in note for note in noted) != acts


def test_a_healthy_machine_stays_silent(healthy: Posterior) -> None:
    assert not healthy.detected and healthy.of("nothing") > 0.9
    assert decide(healthy) == ()


def test_a_concealed_effect_is_detected_and_first(concealed: Posterior) -> None:
    assert concealed.detected
    best = concealed.explanations[0]
    assert best.names == ("windage",) and best.members[0].label == "windage@oil"
    assert sum(concealed.of(kind) for kind in KINDS) == pytest.approx(1.0)
    assert concealed.nothing.fit is not None  # a single baseline does not say how well the machine repeats
    assert concealed.nothing.fit.experiment.most_deviation == 0.2
    answers = decide(concealed)
    assert [one.effect.label for one in answers] == ["windage@oil"]


@pytest.mark.slow
def test_a_baseline_that_brings_evidence_raises_what_is_asked_for(fzg: Gearbox, concealed: Posterior) -> None:
    """Windage acts in the baseline alone: nothing is missing in the recordings, whatever has to be explained."""
    assert concealed.assumed.placebo is not None and concealed.assumed.placebo.log_e_value < 10.0 == concealed.threshold
    found = inferred(fzg, 0.0, in_baselines_W=(WINDAGE_W, 0.0))
    placebo = found.assumed.placebo
    assert placebo is not None
    assert (placebo.session, placebo.mechanism, placebo.place) == ("april", "windage", "oil")
    assert placebo.log_e_value > 10.0 and found.class_threshold == 5.0
    assert found.threshold == found.assumed.placebo.log_e_value
    assert not found.detected
    judged = {one.label: one for one in found.judged if len(one.effects) == 1}
    dated, always, step = judged["windage_step@oil"], judged["windage@oil"], judged["sensor_bias_step@oil"]
    # By two baselines; not of a channel, which may show what the model has of it alone.
    assert [one.effects[0].trusted for one in (dated, always, step)] == [True, False, False]
    (alone,) = [one for one in concealed.judged if one.label == "windage_step@oil"]
    assert not alone.effects[0].trusted  # by one baseline
    assert dated.effects[0].less > 10.0 and always.effects[0].less == 0.0  # over time it counts only beyond that
    assert dated.log_bayes < -dated.effects[0].less + 5.0


@pytest.mark.slow
def test_an_effect_in_the_recordings_raises_nothing(fzg: Gearbox) -> None:
    """Beside a thermometer that reads too high in the recordings, those of the baselines would read too low."""
    found = inferred(fzg, 0.0, in_baselines_W=(0.0, 0.0), bias_K=3.0)
    assert found.assumed.placebo is not None and found.assumed.placebo.log_e_value < 5.0
    assert found.detected and found.explanations[0].names == ("sensor_bias",)
    assert found.nothing.fit is not None  # the baselines repeat, so the recordings do not say otherwise
    assert found.nothing.fit.experiment.most_deviation == rule().repeats >= found.assumed.session_s


def test_changes_over_time_count_beyond_the_baselines_whatever_is_switched_off_in_them(fzg: Gearbox) -> None:
    """Of what always acts only the mechanism that is off is judged in them, and this one has no place."""
    calibration, candidates_in = calibrated(fzg, 0.0, in_baselines_W=(WINDAGE_W, 0.0), switched_off=["none"])
    placebo, judged = judge_baselines(calibration, candidates_in(calibration.fit.experiment), candidates_in)
    assert placebo is None
    less = {one.name: one.less for one in judged}
    assert less["windage_step"] > 10.0 and less["windage"] == 0.0


@pytest.mark.slow
def test_a_baseline_shows_nothing_of_what_has_no_place_in_the_machine(fzg: Gearbox) -> None:
    found = inferred(fzg, 0.0, switched_off=["bearing_fed_by_return"])
    assert found.assumed.placebo is None and found.threshold == 10.0 == rule().detection * found.class_threshold


def test_a_parameter_outside_its_prior_is_no_sign_that_something_is_missing() -> None:
    """What an effect explains less well than a parameter does is no evidence for it."""
    mechanism = Hypothesis(name="windage", place="oil", family="no-load loss", law="windage", variants=np.ones((1, 1)),
                           log_prior=np.log(0.9))  # fmt: skip
    parameter = Hypothesis(name="parameter", place="h_air", family="parameter", unknown=0, variants=np.ones((1, 1)),
                           law="parameter h_air", log_prior=np.log(0.1))  # fmt: skip
    found = Scanned(candidates=(mechanism, parameter), log_bayes=np.array([60.0, 80.0]),
                    classes=(), best=())  # fmt: skip
    assert found.log_e == pytest.approx(60.0 - 80.0 + np.log(9.0))
    unlikely = replace(found, log_bayes=np.array([60.0, -50.0]))
    assert unlikely.log_e == pytest.approx(60.0 + np.log(0.9))


def test_a_change_over_time_counts_less_where_the_model_fits_badly_without_it_or_with_it() -> None:
    full = next(one for one in error_classes() if one.name == "full")
    small = next(one for one in error_classes() if one.name == "splits")
    always = named("windage", "oil")
    dated = replace(always, ending="step")
    assert counts_less((always, dated), full, full).tolist() == [0.0, full.over_time] and full.over_time > 20.0
    assert counts_less((always, dated), full, small).tolist() == [0.0, 0.5 * full.over_time]
    assert not counts_less((always, dated), small, small).any()
    seen = replace(dated, less=40.0)  # in a baseline
    assert counts_less((always, seen), small, small).tolist() == [0.0, 40.0]
    assert counts_less((dated, seen), full, full).tolist() == [full.over_time, 40.0]  # not both


def test_of_what_is_trusted_only_counts_less_what_baselines_bring() -> None:
    full = next(one for one in error_classes() if one.name == "full")
    cooling, probe = (replace(named(name, "oil"), ending="step", trusted=trusted)
                      for name, trusted in (("air_cooling_step", True), ("sensor_bias_step", False)))  # fmt: skip
    assert counts_less((cooling, probe), full, full).tolist() == [0.0, full.over_time]
    assert counts_less((replace(cooling, less=40.0),), full, full).tolist() == [40.0 - full.over_time]


def test_two_baselines_are_trusted_if_they_are_long_enough() -> None:
    assert are_trusted(2, 10.0, 20.0) and are_trusted(3, 40.0, 20.0)
    assert not are_trusted(2, 9.0, 20.0) and not are_trusted(1, 40.0, 20.0)


def test_nothing_gets_the_evidence_that_it_has_from_the_point_of_an_explanation(fzg: Gearbox) -> None:
    """What every fit brings over a calibration in a worse basin is no evidence for a candidate."""
    train = recorded(fzg, "train", windage_W=WINDAGE_W, hours=HOURS)
    setup, experiment = prepare_experiment(fzg, [train], [train], [recorded(fzg, "april", seed=2, hours=HOURS)])
    settled = calibrate_with_error(experiment, calibrate(experiment))
    worse = replace(settled, chosen=replace(settled.chosen, log_evidence=settled.chosen.log_evidence - 50.0))
    placed = CATALOGUE["windage"].placed(experiment.machine.model.network, setup.scale, setup.channels)
    candidates = [hypothesis_of(one) for one in placed]
    right, found = (infer(one, scan_at(one, candidates), Settings()) for one in (settled, worse))
    assert right.log_e > 10.0 and found.log_e == pytest.approx(right.log_e, abs=3.0)
    assert right.elsewhere is None and found.elsewhere is not None
    again = recalibrate(worse, found.elsewhere).chosen
    assert again.error_class == settled.chosen.error_class
    assert again.log_evidence == pytest.approx(settled.chosen.log_evidence, abs=3.0)


def test_the_scan_is_told_for_a_machine_that_repeats_worse(concealed: Posterior) -> None:
    """With sessions that may differ by more, less of the difference between them is evidence."""
    supported, worse = concealed.assumed.repeating
    assert worse.deviation_in_sd >= 2.0 * supported.deviation_in_sd and worse.deviation_in_sd > 0.0
    assert {(one.mechanism, one.place) for one in concealed.assumed.repeating} == {("windage", "oil")}
    assert worse.log_e_value < supported.log_e_value and supported.log_e_value > 5.0


def test_the_scan_is_told_for_less_and_more_model_error(concealed: Posterior, healthy: Posterior) -> None:
    half, assumed, twice = concealed.assumed.scaled_error
    assert (half.factor, assumed.factor, twice.factor) == (0.5, 1.0, 2.0)
    assert {(one.mechanism, one.place) for one in concealed.assumed.scaled_error} == {("windage", "oil")}
    assert all(one.log_e_value > one.threshold for one in concealed.assumed.scaled_error)
    assert all(one.log_e_value < one.threshold for one in healthy.assumed.scaled_error)


def test_candidates_are_judged_with_the_classes_that_are_given(fzg: Gearbox) -> None:
    train = recorded(fzg, "train", windage_W=WINDAGE_W, hours=HOURS)
    setup, experiment = prepare_experiment(fzg, [train], [train])
    calibration = calibrate_with_error(experiment, calibrate(experiment))
    placed = CATALOGUE["windage"].placed(experiment.machine.model.network, setup.scale, setup.channels)
    candidates = [hypothesis_of(one) for one in placed]
    found = scan(calibration.fit, candidates, calibration.near.columns)
    none, splits = error_classes()[:2]

    def scanned(one: ErrorClass) -> tuple[float, float]:
        without, there = scan_in_classes(calibration, found, [none, one]).classes
        return there.ahead - without.ahead, float(there.log_bayes[0] - there.ahead)

    half = replace(splits, amplitudes={"b_split": 0.05, "c_sensor": 0.005, "c_lag": 0.025})
    assert scanned(splits.scaled(0.5)) == pytest.approx(scanned(half), abs=1e-6)
    assert abs(scanned(half)[0] - scanned(splits)[0]) > 0.5
    assert scanned(replace(splits, amplitudes={})) == pytest.approx(
        (np.log(splits.prior / none.prior), scanned(none)[1]), abs=1e-6
    )


def test_its_size_is_found(concealed: Posterior) -> None:
    best = concealed.explanations[0].members[0]
    assert best.fit is not None and concealed.nothing.fit is not None
    count = len(concealed.nothing.fit.z)
    strength, exponent = (u.value(z) for u, z in zip(best.fit.experiment.unknowns[count:], best.fit.z[count:].tolist(),
                                                     strict=True))  # fmt: skip
    term, error = best.effects[0].term, values_of(best.fit, best.effects[0])["windage_oil_strength"][1]
    assert isinstance(term, Placed) and term.scale is not None
    at_full_speed = (AT_RPM / term.scale.speed) ** exponent
    assert abs(strength * at_full_speed - WINDAGE_W) < 3.0 * error * at_full_speed


def test_a_change_at_a_date_competes_under_the_name_of_its_law(concealed: Posterior) -> None:
    members = {one.label: one for one in concealed.explanations[0].members}
    dated = members["windage_step@oil"]
    assert dated.effects[0].how == "from_date" and dated.names == ("windage",)
    # It was there from the first row on: a date brings nothing.
    assert dated.log_bayes < members["windage@oil"].log_bayes + 1.0


def test_a_change_is_fitted_from_the_date_of_the_best_one(fzg: Gearbox, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that has settled on another date, as fits of dates may."""
    date, heat_W = 2400.0, 600.0
    train = recorded(fzg, "train", hours=HOURS)
    setup, healthy = prepare_experiment(fzg, [train], [train])
    placed = CATALOGUE["pump_heat"].placed(healthy.machine.model.network, setup.scale, setup.channels)
    (dated,) = changes([], [one for one in placed if one.place == "oil"], axis_of(healthy), {})
    assert dated.term is not None
    acts = acting(healthy, dated.term, {"strength": heat_W, "since": date, "within": 120.0, "start": 0.0})
    calibration = calibrate_with_error(acts, calibrate(acts))
    effects = [replace(dated, name=name, law=name, variants=np.array([[1.0, since, 120.0, 0.0]]))
               for name, since in (("right", date), ("wrong", 4500.0))]  # fmt: skip

    def settled(_fit: Fit, found: Scanned, index: int, _steps: int) -> Judged:
        experiment, z = with_candidate(calibration.fit, found.candidates[index], 0)
        z[0] = experiment.unknowns[-len(z)].z_of(heat_W)
        fit = experiment.fit(np.concatenate([calibration.fit.z, z]), iterations=0)
        error_class = found.best[index].error_class
        return Judged(effects=(found.candidates[index],), log_bayes=0.0, error_class=error_class, fit=fit)

    monkeypatch.setattr(infer_module, "_refitted", settled)
    monkeypatch.setattr(infer_module, "MOST_TURNS", 0)
    found = scan_in_classes(calibration, scan(calibration.fit, effects, calibration.near.columns))
    found = replace(found, log_bayes=np.array([50.0, 40.0]))
    raced = infer_module._raced(calibration, [(found, lambda one: calibration.in_class(one).fit)], silent)
    right, wrong = (raced[one.label] for one in effects)
    assert right.fit is not None and wrong.fit is not None and right.log_bayes > 50.0
    dates = [fit.experiment.unknowns[-3].value(float(fit.z[-3])) for fit in (right.fit, wrong.fit)]
    assert dates == pytest.approx([date, date], abs=20.0)
    before = infer_module._judged(calibration, settled(calibration.fit, found, 1, 0), spread=0.0)
    assert wrong.log_bayes > before.log_bayes + 50.0


def test_every_candidate_is_judged_and_the_best_are_fitted(healthy: Posterior, concealed: Posterior) -> None:
    labels = [one.label for one in concealed.judged]
    assert len(labels) == len(set(labels)) and {one.label for one in healthy.judged} <= set(labels)
    fitted = [one for one in concealed.judged if one.fit is not None]
    assert 1 <= len(fitted) < len(labels)
    assert max(concealed.judged, key=lambda one: one.weight) in fitted
    pairs = [one.names for one in concealed.judged if one.kind == "pair"]
    assert pairs and all(first != second for first, second in pairs)  # one law at two places is one name


# ------------------------------------------------------------------ the race


@pytest.mark.parametrize("far_sd", [0.0, np.inf])
def test_fits_begin_at_the_middles_of_the_priors_too_where_the_calibration_went_far(
    fzg: Gearbox, monkeypatch: pytest.MonkeyPatch, far_sd: float
) -> None:
    train, begun = recorded(fzg, "train", windage_W=WINDAGE_W, hours=HOURS), list[bool]()
    setup, experiment = prepare_experiment(fzg, [train], [train])
    calibration = calibrate_with_error(experiment, calibrate(experiment))
    network = experiment.machine.model.network
    placed = [CATALOGUE[name].placed(network, setup.scale, setup.channels)[0] for name in ("windage", "sensor_bias")]
    refitted = infer_module._refitted

    def begins(fit: Fit, found: Scanned, index: int, steps: int) -> Judged:
        if found.candidates[index].name == "windage":
            begun.append(not fit.z.any())
        return refitted(fit, found, index, steps)

    monkeypatch.setattr(infer_module, "_refitted", begins)
    monkeypatch.setattr(calibration_module, "FAR_SD", far_sd)
    posterior = infer(calibration, scan_at(calibration, [hypothesis_of(one) for one in placed]), Settings())
    assert begun == ([False, True] if far_sd == 0.0 else [False])
    best = max(posterior.judged, key=lambda one: one.weight)
    assert best.fit is not None and best.names == ("windage",)
    assert calibration.at_middles(calibration.chosen.error_class).z.tolist() == [0.0] * len(calibration.fit.z)
    monkeypatch.setattr(infer_module, "scan", lambda *_: (_ for _ in ()).throw(InputError("below absolute zero")))
    begun.clear()
    infer(calibration, scan_at(calibration, [hypothesis_of(one) for one in placed]), Settings())
    assert begun == [False]  # from there alone


def named(name: str, place: str) -> Hypothesis:
    return Hypothesis(name=name, place=place, family="heat", law=name, variants=np.ones((1, 1)))


def scanned_as(candidates: list[Hypothesis], log_bayes: Array) -> Scanned:
    return Scanned(candidates=tuple(candidates), log_bayes=log_bayes, classes=(), best=())


def test_a_name_is_fitted_at_its_best_place_and_at_a_near_one() -> None:
    candidates = [named("near", "a"), named("near", "b"), named("near", "c"), named("far", "a"), named("far", "b")]
    log_bayes = np.array([20.0, 19.0, 18.5, 15.0, 15.0 - NEAR_PLACE])
    chosen = _worth_a_fit(scanned_as(candidates, log_bayes))
    assert chosen == [0, 1, 3] and PLACES == 2
    assert not _worth_a_fit(scanned_as(candidates, np.full(5, 0.9)))  # nothing explains anything


def test_what_switches_is_fitted_whatever_a_straight_line_says_of_it(fzg: Gearbox) -> None:
    """At its best place: a fan that a calibrated machine had to live with is far from any straight line."""
    network, scale = fzg.network(), Scale.of(fzg, speed=3300.0, torque=150.0)
    placed = [hypothesis_of(one) for name in ("cooler_thermostat", "windage", "fan_thermostat")
              for one in CATALOGUE[name].placed(network, scale)]  # fmt: skip
    chosen = _worth_a_fit(scanned_as(placed, np.linspace(-3.0, -2.0, len(placed))))
    assert sorted({placed[index].name for index in chosen}) == ["cooler_thermostat", "fan_thermostat"]
    assert len(chosen) == 2


def test_names_share_the_race() -> None:
    """Many near places of one name take no room from other names."""
    candidates = [
        *(named("one", f"{i}") for i in range(3 * RACED)),
        *(named(f"law_{i}", "a") for i in range(2 * RACED)),
    ]
    log_bayes = 20.0 - 0.01 * np.arange(len(candidates))
    chosen = _worth_a_fit(scanned_as(candidates, log_bayes))
    names = [candidates[i].name for i in chosen]
    assert len(set(names)) == RACED and names.count("one") == PLACES


def test_a_class_that_straight_lines_put_ahead_has_to_show_it_by_a_fit(
    fzg: Gearbox, monkeypatch: pytest.MonkeyPatch
) -> None:
    calibration, candidates_in = calibrated(fzg, 0.0)
    scanned = scan_at(calibration, candidates_in(calibration.fit.experiment))
    found = scan_in_classes(calibration, scanned)
    other, *rest = sorted(found.classes, key=lambda one: one.error_class == calibration.chosen.error_class)
    assert other.error_class != calibration.chosen.error_class
    promised = replace(other, ahead=other.ahead + 500.0, log_bayes=other.log_bayes + 500.0)
    shown = as_fits_show(calibration, in_best_classes([promised, *rest]))
    reached = calibration.fitted_in_class(other.error_class)
    less = shown.in_class(other.error_class)
    assert less.ahead == pytest.approx(reached.log_evidence - calibration.chosen.log_evidence) and less.ahead < 5.0
    np.testing.assert_allclose(less.log_bayes, other.log_bayes + less.ahead - other.ahead)
    assert calibration.in_class(other.error_class) is reached  # fits in that class begin there
    for one in rest:
        if one.ahead <= 1.0:
            np.testing.assert_array_equal(shown.in_class(one.error_class).log_bayes, one.log_bayes)
    monkeypatch.setattr(infer_module, "scan_in_classes", lambda *_: in_best_classes([promised, *rest]))
    posterior = infer(calibration, scanned, Settings(), candidates_in=candidates_in)
    assert not posterior.detected and posterior.log_parameter < posterior.threshold


def test_every_candidate_is_judged_in_the_class_that_suits_it() -> None:
    """A small class is far behind without an effect; the effect that explains the readings brings it to the front."""
    candidates = [
        Hypothesis(name=name, place="oil", family="heat", law=name, variants=np.ones((1, 1))) for name in "ab"
    ]
    scanned = SimpleNamespace(candidates=tuple(candidates))

    def in_class(name: str, log_bayes: list[float]) -> ScanInClass:
        error = ErrorClass(name=name, prior=0.5, threshold=5.0, amplitudes={})
        return cast(ScanInClass, SimpleNamespace(error_class=error, scan=scanned, log_bayes=np.array(log_bayes)))

    found = in_best_classes([in_class("full", [18.0, 4.0]), in_class("small", [78.0, -500.0])])
    assert [one.error_class.name for one in found.best] == ["small", "full"]
    np.testing.assert_array_equal(found.log_bayes, [78.0, 4.0])


def test_a_small_share_of_a_held_reading_counts_nothing_in_the_scan() -> None:
    def of_form(form: Form | None) -> Hypothesis:
        strength = Parameter(name="share", start=0.0, sd=1.0, lower=0.0, upper=2.0, log=False)
        term = Term(label="fault", kind="sensor", target=("oil",), expression=symbol("share"), form=form,
                    parameters=(strength,))  # fmt: skip
        return replace(named("fault", "oil"), term=term)

    candidates = [*map(of_form, ("stuck", "stuck", "swapped", "shift", None)), named("windage", "oil")]
    assert hardly_there(candidates, np.array([0.004, 0.5, -0.05, 0.004, 0.004, 0.004])).tolist() == [0, 2]


@pytest.mark.parametrize(("form", "share", "possible"), [
    ("swapped", 0.95, True), ("swapped", 0.2, False),
    ("stuck", 0.95, True), ("stuck", 0.5, True), ("stuck", 0.004, False),
])  # fmt: skip
def test_a_share_of_a_swap_or_of_a_held_reading_is_refused_with_a_number(
    form: Form, share: float, possible: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    strength = Parameter(name="swap", start=0.0, sd=1.0, lower=-2.0, upper=2.0, log=False)
    term = Term(label="swap", kind="sensor", target=("oil", "pinion"), expression=symbol("swap"), form=form,
                parameters=(strength,))  # fmt: skip
    swap = Hypothesis(name="swapped_channels", place="oil_pinion", family="measurement", term=term, law="swap",
                      variants=np.ones((1, 1)))  # fmt: skip
    unknown = TermParameter(parameter=strength, label="swap")
    experiment = SimpleNamespace(unknowns=[unknown])
    fit = SimpleNamespace(z=np.array([share]), covariance=np.eye(1), experiment=experiment)
    monkeypatch.setattr(infer_module, "fit_over_sessions", lambda *_: SimpleNamespace(log_evidence=50.0))
    sure = ErrorClass(name="sure", prior=1.0, threshold=5.0, amplitudes={})
    one = Judged(effects=(swap,), log_bayes=40.0, fit=cast(Fit, fit), error_class=sure)
    chosen = SimpleNamespace(log_evidence=10.0, error_class=sure)
    calibration = SimpleNamespace(chosen=chosen, fit=SimpleNamespace(z=np.zeros(0)))
    found = _judged(cast(Calibration, calibration), one, 0.0)
    assert np.isfinite(found.log_bayes)
    assert (found.log_bayes == 40.0) is possible and (found.log_bayes < -100.0) is not possible
