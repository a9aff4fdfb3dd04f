"""From a posterior made by hand to the result: verdict, findings with their grades, places, fits, JSON, correction."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.answer import Answer
from diagnosis.decision.posterior import Assumed, Expected, Judged, Placebo, Posterior
from diagnosis.engine.calibration import Calibration
from diagnosis.engine.families import candidates_of
from diagnosis.engine.fit import Experiment, Fit
from diagnosis.engine.learnt import error_classes, rule
from diagnosis.engine.outside import outside_of
from diagnosis.engine.refit import with_candidate
from diagnosis.engine.to_predict import calibrated_to_predict
from diagnosis.engine.unknown import NetworkParameter
from diagnosis.forward.whitening import RandomHeat
from diagnosis.proof.scoring.answers import read_answer
from diagnosis.report.page import page
from diagnosis.report.write import correction_of
from diagnosis.results import predictions
from diagnosis.results.assemble import _distinct, _remaining, assemble
from diagnosis.results.findings import change_of, estimates_of
from diagnosis.results.result import Diagnosis
from models.assembly.gearbox import Gearbox
from models.correction.correction import correction_text, read_correction, write_correction
from models.mechanisms import CATALOGUE
from tests.unit.diagnosis.results.assembled_example import (
    NOISE_K,
    WINDAGE_W,
    Assemble,
    Prepared,
    effect_of,
    judged_of,
    posterior_of,
)

DATE_S = 2400.0
BEFORE, RECORDED, AFTER_S = "earlier", "made", 5000.0  # names of recordings, and start of the second one


@pytest.fixture(scope="module")
def claimed(assembled: Assemble, prepared: Prepared, windage: Judged) -> Diagnosis:
    """Windage, 30 nat ahead of foaming oil."""
    far = judged_of(prepared, "hot_neighbour", "housing_lower", 82.0)
    placebo = Placebo(session="april", log_e_value=2.5, mechanism="windage", place="oil")
    assumed = Assumed(session_s=0.2, error_class="no-load losses", placebo=placebo)
    posterior = posterior_of(prepared[2], windage, far, assumed=assumed, remainder=1.5)
    probability = float(posterior.ranked[0][1])
    assert 0.9 < probability < 0.97
    return assembled(
        posterior,
        [Answer(best=windage, effect=windage.effects[0], grade="claim", probability=probability, joint=probability)],
    )


def test_a_claim(claimed: Diagnosis, fzg: Gearbox) -> None:
    (finding,) = claimed.findings
    strength = finding.parameters[0]
    assert claimed.verdict == "missing_physics"
    assert (finding.mechanism, finding.node, finding.grade, finding.kind) == ("windage", "oil", "claim", "source")
    assert abs(strength.value - WINDAGE_W) < 2.0 * strength.stderr < 0.6 * WINDAGE_W
    assert 0.0 < finding.heat_stderr_W < finding.heat_mean_W < finding.heat_max_W < 100.0
    assert [(r.mechanism, r.place) for r in finding.confusable_with] == [("hot_neighbour", "housing_lower")]
    first, second = claimed.location
    assert (first.node, second.node) == ("oil", "housing_lower")
    assert first.probability == pytest.approx(finding.probability)
    assert "speed above" in first.regime and first.when[0][0] == RECORDED
    assert second.heat_max_W == 0.0  # nothing was fitted there
    # Free-running: the nominal model lacks heat, tuning swallows some of it, and what is left then is noise.
    for fits, times in ((claimed.train, 1.1), (claimed.holdout, 1.3)):
        assert fits.before > fits.calibrated > times * fits.after
    assert claimed.holdout.after < 2.0 * NOISE_K
    assert claimed.holdout_gain > 20.0
    assert [(c.recording, c.held_out) for c in claimed.courses] == [(RECORDED, False), ("judged", True)]
    assert {"wheel", "oil"} <= set(claimed.courses[0].after)
    names = {c.parameter for c in claimed.calibration}
    assert "bias_oil" in names and finding.term is not None
    assert not names & {p.name for p in finding.term.parameters}
    assert set(claimed.joint.names) == names | {p.name for p in claimed.terms[0].parameters}


def test_held_out_readings_that_are_predicted_worse_take_the_claim_away(
    assembled: Assemble, prepared: Prepared, windage: Judged, monkeypatch: pytest.MonkeyPatch
) -> None:
    posterior = posterior_of(prepared[2], windage, remainder=1.5)
    claim = Answer(best=windage, effect=windage.effects[0], grade="claim", probability=0.95, joint=0.95)
    less = posterior.class_threshold
    for gain, grade, probability in ((0.9 * -less, "claim", 0.95), (1.1 * -less, "likely", 0.95 * rule().nearest)):
        monkeypatch.setattr(predictions, "log_score_gain", lambda *_, gain=gain: gain)
        found = assembled(posterior, [claim])
        (finding,) = found.findings
        assert (finding.grade, finding.acts_like) == (grade, grade == "likely")
        assert finding.probability == pytest.approx(probability)
        assert found.contradicted is found.to_dict()["fit"]["holdout"]["contradicts_findings"] is (grade == "likely")
        assert not assembled(posterior, []).contradicted  # nothing was found
        assert found.has_correction  # what improves the prediction of the rest goes into the model all the same


def test_where_model_error_is_large_held_out_readings_have_to_confirm_a_claim(
    assembled: Assemble, prepared: Prepared, windage: Judged, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of what always acts: what began at a date may be over by then."""
    monkeypatch.setattr(predictions, "log_score_gain", lambda *_: 0.5)
    dated = replace(windage, effects=tuple(replace(one, ending="step") for one in windage.effects))
    full, none = error_classes()[-1], error_classes()[0]
    for best, grade in ((replace(windage, error_class=full), "likely"), (replace(windage, error_class=none), "claim"),
                        (replace(dated, error_class=full), "claim")):  # fmt: skip
        claim = Answer(best=best, effect=best.effects[0], grade="claim", probability=0.95, joint=0.95)
        found = assembled(posterior_of(prepared[2], best, remainder=1.5), [claim])
        assert found.findings[0].grade == grade and found.contradicted is (grade == "likely")
        confirmed = "held-out recordings do not confirm the findings" not in "\n".join(found.summary())
        assert confirmed is (grade == "claim")


def test_held_out_readings_count_against_what_was_learnt_from(
    assembled: Assemble, prepared: Prepared, windage: Judged, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where both together are below the threshold nothing is detected, and the calibrated machine predicts."""
    posterior = posterior_of(prepared[2], windage, remainder=1.5)
    claim = Answer(best=windage, effect=windage.effects[0], grade="claim", probability=0.95, joint=0.95)
    spare = posterior.log_e - posterior.threshold
    assert spare > 10.0
    for gain, verdict in ((1.0 - spare, "missing_physics"), (-1.0 - spare, "consistent")):
        monkeypatch.setattr(predictions, "log_score_gain", lambda *_, gain=gain: gain)
        found = assembled(posterior, [claim])
        assert found.verdict == verdict and bool(found.findings) is found.has_correction is (found.refuted is None)
    assert found.refuted is not None and found.log_e_value == pytest.approx(posterior.threshold - 1.0)
    assert found.holdout.after == found.holdout.calibrated
    stored = found.to_dict()["significance"]["refuted"]
    assert stored == {"names": "windage at oil", "log_e_value": posterior.log_e, "log_score_gain": -1.0 - spare}
    _, back = dict(found.first_screen)["Is something missing?"]
    assert f"supports windage at oil ({posterior.log_e:.1f} nat)" in back
    assert f"less probable, by {spare + 1.0:.0f} nat; both count." in back
    # The same machine, where much smaller differences matter: it is far off then, and not healthy.
    far = replace(posterior, settings=replace(posterior.settings, matters_K=0.01))
    assert max(found.train.calibrated, found.holdout.calibrated) > 0.02 + found.noise_K
    assert assembled(far, [claim]).verdict == "unexplained"


def test_held_out_readings_are_judged_in_the_draughts_of_the_machine(
    prepared: Prepared, calibration: Calibration, windage: Judged, monkeypatch: pytest.MonkeyPatch
) -> None:
    setup, experiment, plain = prepared
    near, judged_in = calibration.near, []

    def gain(_: Fit, __: Fit, held_out: Experiment, ___: object) -> float:
        judged_in.append(held_out.noise[0])
        return -1.0 if len(judged_in) % 2 else 0.0

    monkeypatch.setattr(predictions, "log_score_gain", gain)
    parts = (0.5, *(1.0,) * (len(experiment.noise[0].heat_sd) - 1))
    for draught, of_parts in ((0.0, ()), (0.03, parts)):
        times = RandomHeat(heat=0.25, draught=draught, parts=of_parts)
        there = replace(near, experiment=near.experiment.with_random_heat(times))
        found = assemble(setup, experiment, posterior_of(plain, windage), [], plain=plain,
                         calibration=replace(calibration, near=there))  # fmt: skip
        assert ("draughts of 3 % of all of it" in found.floor) is (draught > 0.0)
        assert (f"50 % of that in {setup.nominal.parts[0].name}" in found.floor) is bool(of_parts)
        assert found.holdout_gain == 0.0  # with a measured loss no finer than what predicts is calibrated to
    still, coarse, draughty, _ = judged_in
    assert (still.draught, draughty.draught) == (0.0, 0.03)
    coarser = coarse.channel_sd > still.channel_sd
    assert [name for name, one in zip(setup.channels, coarser, strict=True) if one] in ([], ["P_loss"])
    np.testing.assert_array_equal(draughty.heat_sd, still.heat_sd * parts)  # as assumed, less where parts have less


def test_scorers_read_the_numbers(claimed: Diagnosis, fzg: Gearbox) -> None:
    text = json.dumps(claimed.to_dict(), allow_nan=False)
    answer = read_answer(json.loads(text), fzg)
    (claim,) = answer.claims
    assert answer.alarm and answer.node == "oil"
    assert (claim.name, claim.place, claim.what, claim.sign) == ("windage", "oil", "loss", 1)
    assert claim.tied == ("windage", "hot_neighbour") and claim.heat_W == pytest.approx(claimed.findings[0].heat_mean_W)
    assert answer.holdout_K == (claimed.holdout.calibrated, claimed.holdout.after)
    stored = json.loads(text)
    assert stored["schema"] == 1 and stored["model_error"]["class"] == "no-load losses"
    healthy = {"session": "april", "log_e_value": 2.5, "mechanism": "windage", "place": "oil"}
    assert stored["sessions"] == {"deviation_in_sd": 0.2, "repeating": [], "placebo": healthy}
    assert sum(stored["kinds"].values()) == pytest.approx(1.0)
    assert stored["fit"]["holdout"]["log_score_gain"] == pytest.approx(claimed.holdout_gain)


def test_the_summary_answers_in_order(claimed: Diagnosis) -> None:
    lines = claimed.summary()
    told = [next(i for i, line in enumerate(lines) if line.startswith(q)) for q in
            ("Is something missing? Yes", "Where? oil", "What? Claim:", "How sure? claim",
             "How much better? RMSE held-out", "What next?")]  # fmt: skip
    assert told == sorted(told) and told[0] == 1
    text = "\n".join(lines)
    assert "not ruled out instead: hot_neighbour at housing_lower" in text
    assert "class no-load losses" in text
    assert "Between sessions parameters differ by 0.20" in text


def test_a_tie_is_one_item_and_only_likely(assembled: Assemble, prepared: Prepared, windage: Judged) -> None:
    far = judged_of(prepared, "pump_heat", "oil", 88.8)
    posterior = posterior_of(prepared[2], windage, far)
    (_, p), (_, q) = posterior.ranked
    answer = Answer(
        best=windage, effect=windage.effects[0], grade="likely", probability=p, joint=p + q,
        tied=((windage.effects[0], p), (far.effects[0], q)),
    )  # fmt: skip
    found = assembled(posterior, [answer])
    (finding,) = found.findings
    assert finding.tie_set == ("windage", "pump_heat") and finding.sureness == pytest.approx(p + q)
    assert finding.title == "windage or pump_heat at oil"
    assert len(found.location) == 1 and found.location[0].probability == pytest.approx(p + q)
    text = str(found)
    assert "Likely: One of several effects that these data do not separate" in text
    assert "not ruled out" not in text  # the other one is in the name already
    stored = found.to_dict()["findings"][0]
    assert (stored["grade"], stored["tie_set"]) == ("likely", ["windage", "pump_heat"])
    assert stored["joint_probability"] == pytest.approx(p + q)


def _fit_with(plain: Fit, effect: Hypothesis, values: dict[str, float]) -> Fit:
    """The calibrated machine with a term at given values, not fitted."""
    experiment, _ = with_candidate(plain, effect, 0)
    added = experiment.unknowns[len(plain.z) :]
    z = np.array([*plain.z, *(u.z_of(values[u.parameter.name]) for u in added)])
    return experiment.fit(z, plain.trajectories, iterations=0)


@pytest.mark.parametrize("starts_at", [0.0, AFTER_S])
def test_a_link_that_changes_at_a_date_acts_like(
    assembled: Assemble, prepared: Prepared, fzg: Gearbox, starts_at: float
) -> None:
    """Of the family of changes, also in a recording that is not the first on the time axis."""
    setup, experiment, plain = prepared
    starts = {RECORDED: starts_at, "judged": 0.0}
    own = replace(experiment, starts_at=starts)
    effect = next(one for one in candidates_of(setup, own) if one.label == "radiation_for_a_while@housing_air")
    assert effect.term is not None and effect.clock is not None
    values = {"strength": -0.02, "since": starts_at + DATE_S, "lasting": 1800.0, "start": 0.0}
    variant = np.array([[values[p.name.removeprefix(f"{effect.term.label}_")] for p in effect.term.parameters]])
    effect = replace(effect, variants=variant, log_prior=-5.0)
    changed, z = with_candidate(replace(plain, experiment=replace(plain.experiment, starts_at=starts)), effect, 0)
    fit = changed.fit(np.concatenate([plain.z, z]), plain.trajectories, iterations=0)
    judged = Judged(effects=(effect,), log_bayes=60.0, fit=fit, error_class=error_classes()[0])
    answer = Answer(best=judged, effect=effect, grade="likely", probability=0.97, joint=0.97, acts_like=True)
    found = assembled(posterior_of(plain, judged), [answer], experiment=own)
    (finding,) = found.findings
    date = finding.date
    assert finding.acts_like and date is not None and date.recording == RECORDED
    assert date.from_s == pytest.approx(DATE_S) and date.to_s == pytest.approx(4200.0)
    assert date.band_s is not None and date.band_s[0] < DATE_S < date.band_s[1]
    assert date.utc == "2020-01-01T08:40:00+00:00"
    assert [one.date for one in found.ranking] == [date]
    assert {p.name for p in finding.parameters} == {"strength", "since", "lasting"}
    time, heat = finding.heat[RECORDED]
    acts, rests = (np.abs(time - 3300.0) < 800.0), (np.abs(time - 3300.0) > 1300.0)
    assert np.abs(heat[rests]).max() < 0.02 * np.abs(heat[acts]).min()
    text = str(found)
    assert "[acts like radiation_error at housing_air]" in text and f"from 2400 s of {RECORDED} on" in text
    assert "2020-01-01 08:40 UTC, until 4200 s" in text and "since =" not in text
    stored = found.to_dict()["findings"][0]
    assert stored["acts_like"] and stored["date"]["from_s"] == pytest.approx(DATE_S)
    assert read_answer(found.to_dict(), fzg).claims[0].what == "link"
    assert correction_of(replace(found, terms=(effect.term,)), fzg).findings[0].term.label == effect.term.label
    assert "strength" not in finding.equation and "since" not in finding.equation


def test_a_heat_like_no_law_has_no_numbers(assembled: Assemble, prepared: Prepared) -> None:
    setup, experiment, plain = prepared
    heat = next(one for one in outside_of(setup, experiment) if one.place == "oil")
    judged = Judged(effects=(heat,), log_bayes=60.0, error_class=error_classes()[0])
    answer = Answer(best=judged, effect=heat, grade="likely", probability=0.97, joint=0.97, acts_like=True)
    found = assembled(posterior_of(plain, judged), [answer])
    (finding,) = found.findings
    assert (finding.parameters, finding.equation, finding.heat_mean_W) == ((), "", 0.0)
    assert "like no law of the catalogue" in str(found) and "strength" not in str(found)


def test_behind_a_heat_like_no_law_the_most_probable_law_predicts(
    assembled: Assemble, prepared: Prepared, windage: Judged, fzg: Gearbox
) -> None:
    setup, experiment, plain = prepared
    heat = next(one for one in outside_of(setup, experiment) if one.place == "oil")
    judged = Judged(effects=(heat,), log_bayes=120.0, error_class=error_classes()[0])
    answer = Answer(best=judged, effect=heat, grade="likely", probability=0.97, joint=0.97, acts_like=True)
    found = assembled(posterior_of(plain, judged, windage), [answer])
    assert (found.verdict, [one.place for one in found.findings]) == ("unexplained", ["oil"])
    assert [term.label for term in found.terms] == ["windage_oil"]
    assert found.holdout.after < 0.5 * found.holdout.calibrated
    assert "what predicts best, without a certain name (grade learnt): windage oil" in str(found)
    (learnt,) = (one for one in correction_of(found, fzg).findings if one.label == "windage_oil")
    assert learnt.grade == "learnt"


def test_the_band_of_a_date_ends_where_the_recordings_do(prepared: Prepared) -> None:
    setup, experiment, _ = prepared
    effect = next(one for one in candidates_of(setup, experiment) if one.name == "radiation_step")
    assert effect.date is not None
    for since, error, band in ((DATE_S, 100.0, (DATE_S - 200.0, DATE_S + 200.0)),
                               (DATE_S, 1e6, (0.0, experiment.pieces[-1].time[-1])),
                               (-50.0, 25.0, (-50.0, 0.0))):  # fmt: skip
        change = change_of({effect.date: (since, error)}, effect, experiment, setup.recordings)
        assert change is not None and change.band_s == pytest.approx(band)


def test_what_remains_is_told_where_it_was_looked_for(prepared: Prepared, windage: Judged) -> None:
    pair = replace(windage, effects=(*windage.effects, effect_of(prepared[0], prepared[2], "pump_heat", "oil")))
    posterior = posterior_of(prepared[2], windage, pair, remainder=25.0)
    assert _remaining(posterior, None, windage) == "a further effect would still help (evidence 25 nat)"
    assert "25 nat of the second" in _remaining(posterior, None, pair)
    for left, told in ((7.0, "a further effect would still help (evidence 7 nat)"), (1.0, "(evidence 1.0 nat of a")):
        assert told in _remaining(posterior, None, replace(pair, left=left))


def test_of_two_that_act_like_something_on_one_thing_the_larger_is_reported(
    prepared: Prepared, windage: Judged, claimed: Diagnosis
) -> None:
    def answer(name: str, place: str, **given: Any) -> Answer:
        effect = effect_of(prepared[0], prepared[2], name, place)
        usual: dict[str, Any] = {"grade": "likely", "probability": 0.95, "joint": 0.95, "acts_like": True}
        return Answer(best=windage, effect=effect, **usual | given)

    def reported(*found: tuple[Answer, float]) -> list[float]:
        (finding,) = claimed.findings
        pairs = [(a, replace(finding, heat_mean_W=heat)) for a, heat in found]
        return [one.heat_mean_W for _, one in _distinct(pairs)]

    windy, pumped, foggy = (answer(name, place) for name, place in (
        ("windage", "oil"), ("pump_heat", "oil"), ("hot_neighbour", "housing_lower")))  # fmt: skip
    assert reported((windy, 13.0), (foggy, 5.0), (pumped, -108.0)) == [5.0, -108.0]
    assert reported((windy, 0.0), (pumped, 0.0)) == [0.0]
    assert reported((windy, 20.0), (answer("pump_heat", "oil", grade="claim", acts_like=False), 10.0)) == [10.0]


def test_nothing(assembled: Assemble, prepared: Prepared, windage: Judged) -> None:
    weak = replace(windage, log_bayes=1.0, fit=None)
    setup, _, plain = prepared
    fog = effect_of(setup, plain, "hot_neighbour", "housing_lower")
    there = Expected(effect=windage.effects[0], log_bayes=40.0)
    dim = replace(there, effect=fog, log_bayes=8.5)  # 4 nat are needed, and its prior is small
    expected = (there, dim, replace(dim, effect=replace(fog, place="oil"), log_bayes=1.0))
    found = assembled(posterior_of(plain, weak, log_e=-1.0, expected=expected), [])
    assert found.verdict == "consistent" and found.findings == () and found.location == ()
    assert [(u.mechanism, u.place, u.expected) for u in found.unseen] == [("hot_neighbour", "housing_lower", 8.5)]
    assert "What cannot be seen in these data? hot_neighbour: silence" in str(found)
    assert "Is something missing? Nothing that these data show" in str(found)
    assert found.next_test.startswith(CATALOGUE["hot_neighbour"].experiment)
    blind = tuple(replace(one, log_bayes=0.5) for one in expected)
    assert assembled(posterior_of(plain, weak, log_e=-1.0, expected=blind), []).verdict == "insufficient_data"


def test_where_nothing_is_detected_the_name_ahead_is_to_be_tested(
    assembled: Assemble, prepared: Prepared, windage: Judged
) -> None:
    found = assembled(posterior_of(prepared[2], replace(windage, log_bayes=12.0), log_e=2.0), [])
    assert found.verdict == "consistent" and [one.mechanism for one in found.hints] == ["windage"]
    assert found.next_test.startswith(f"{CATALOGUE['windage'].experiment} (it would show windage")


def test_where_nothing_is_detected_the_place_is_told_with_a_condition(
    assembled: Assemble, prepared: Prepared, windage: Judged
) -> None:
    plain, parameter = prepared[2], replace(judged_of(prepared, "hot_neighbour", "housing_lower", 9.0), fit=None)
    parameter = replace(parameter, effects=tuple(replace(one, term=None) for one in parameter.effects))
    weak = replace(windage, log_bayes=2.0)
    found = assembled(posterior_of(plain, weak, parameter, log_e=2.0, log_parameter=3.0), [])
    assert found.verdict == "consistent" and [(one.node, one.probability) for one in found.location] == [("oil", 1.0)]
    assert "Where? If something is missing all the same, most probably in oil (> 0.99)" in str(found)
    assert "sensor" not in found.next_test


def test_detected_without_an_answer_is_unexplained(
    assembled: Assemble, prepared: Prepared, windage: Judged, fzg: Gearbox
) -> None:
    posterior = posterior_of(prepared[2], windage, judged_of(prepared, "hot_neighbour", "housing_lower", 89.0))
    found = assembled(posterior, [])
    assert found.verdict == "unexplained" and [one.mechanism for one in found.nearest] == ["windage", "hot_neighbour"]
    assert "most like: windage at oil (0.58)" in str(found)
    # The prediction needs no name: what was fitted best serves it, as learnt.
    assert found.holdout.after < 0.3 * found.holdout.calibrated
    assert {finding.grade for finding in correction_of(found, fzg).findings} == {"learnt"}


@pytest.fixture
def assembled_alike(prepared: Prepared, calibration: Calibration) -> Assemble:
    """Held out is what was learnt: other readings would contradict what is invented here."""
    setup, experiment, plain = prepared
    alike = replace(setup, holdout=setup.recordings, held_out=setup.learnt)
    predicting = calibrated_to_predict(plain, plain)

    def result(posterior: Posterior, answers: list[Answer]) -> Diagnosis:
        return assemble(alike, experiment, posterior, answers, plain=predicting, calibration=calibration)

    return result


def test_a_parameter(assembled_alike: Assemble, prepared: Prepared) -> None:
    """Out of its prior by five standard deviations: the same unknown with a wider prior."""
    plain, assembled = prepared[2], assembled_alike
    name = "h_air"
    index = next(i for i, u in enumerate(plain.experiment.unknowns) if u.parameter.name == name)
    old = cast(NetworkParameter, plain.experiment.unknowns[index])
    wide = replace(old, parameter=replace(old.parameter, sd=4.0 * old.parameter.sd))
    value = old.value(-5.0)
    unknowns = (*plain.experiment.unknowns[:index], wide, *plain.experiment.unknowns[index + 1 :])
    z = np.array(plain.z)
    z[index] = wide.z_of(value)
    fit = replace(plain.experiment, unknowns=unknowns).fit(z, iterations=0)
    effect = Hypothesis(name="parameter", place=name, family="parameter", unknown=index, law=f"parameter {name}",
                        variants=np.ones((1, 1)), log_prior=-3.0)  # fmt: skip
    judged = Judged(effects=(effect,), log_bayes=40.0, fit=fit, error_class=error_classes()[0])
    answer = Answer(best=judged, effect=effect, grade="claim", probability=0.95, joint=0.95)
    raised = replace(posterior_of(plain, judged, log_e=1.0, log_parameter=40.0), threshold=238.0)  # by a baseline
    found = assembled(raised, [answer])
    assert found.verdict == "parameter_error"  # known parameters raise no alarm
    assert (found.log_e_value, found.threshold, found.further_threshold) == (40.0, 4.0, 4.0)
    assert "No physics, but a parameter is outside its prior: evidence 40.0 nat, 4.0 needed" in str(found)
    (finding,) = found.findings
    assert finding.kind == "parameter" and finding.parameters[0].value == pytest.approx(value)
    row = next(c for c in found.calibration if c.parameter == name)
    assert row.shift_in_sd == pytest.approx(-5.0) and abs(old.z_of(row.value)) < 1.0  # found; in what predicts
    assert f"parameter {name}" in str(found)
    unsure = str(assembled(raised, []))
    assert (
        "most like: parameter h_air" in unsure
        and "Several may be off, or the definition lacks a part or a path" in unsure
    )
    claim = read_answer(found.to_dict(), prepared[0].gearbox).claims[0]
    assert claim.sign == -1 and "air" in claim.nodes


def test_a_sensor_fault(assembled_alike: Assemble, prepared: Prepared, windage: Judged, fzg: Gearbox) -> None:
    (setup, _, plain), assembled = prepared, assembled_alike
    effect = replace(effect_of(setup, plain, "sensor_bias", "oil"), log_prior=-3.0)
    assert effect.term is not None
    fit = _fit_with(plain, effect, {effect.term.strength.name: 0.02})
    judged = Judged(effects=(effect,), log_bayes=70.0, fit=fit, error_class=error_classes()[0])
    claim = Answer(best=judged, effect=effect, grade="claim", probability=0.98, joint=0.98)
    found = assembled(posterior_of(plain, judged), [claim])
    (finding,) = found.findings
    assert (found.verdict, finding.kind, finding.node, finding.heat_mean_W) == ("sensor_fault", "sensor", "oil", 0.0)
    calibrated = {u.parameter.name: u.value(z) for u, z in zip(fit.experiment.unknowns, fit.z.tolist(), strict=True)}
    assert finding.parameters[0].value == pytest.approx(0.02 + calibrated["bias_oil"])
    (term,) = found.terms
    assert term.parameters[0].start == pytest.approx(0.02)  # as estimated
    assert "in the measurement" in str(found)
    assert read_answer(found.to_dict(), fzg).claims[0].what == "sensor"
    tied = Answer(best=judged, effect=effect, grade="likely", probability=0.75, joint=0.97,
                  tied=((effect, 0.75), (windage.effects[0], 0.22)))  # fmt: skip
    assert assembled(posterior_of(plain, judged), [tied]).verdict == "missing_physics"  # no verdict on the sensor
    unreported = replace(tied, acts_like=True)  # it acts on what the claim acts on
    assert assembled(posterior_of(plain, judged), [claim, unreported]).verdict == "sensor_fault"


def test_correction_keeps_grades(claimed: Diagnosis, fzg: Gearbox, tmp_path: Any) -> None:
    likely = replace(claimed, findings=tuple(replace(f, grade="likely") for f in claimed.findings))
    correction = correction_of(likely, fzg)
    path = tmp_path / "correction.toml"
    write_correction(correction, path)
    read = read_correction(path, fzg)
    assert [f.grade for f in read.findings if f.mechanism == "windage"] == ["likely"]
    assert {f.grade for f in read.findings if f.mechanism == "shape"} == {"learnt"}
    left = read.claims_only()
    assert not [f for f in left.findings if f.mechanism == "windage"] and left.calibration == read.calibration
    assert [f for f in correction_of(claimed, fzg).claims_only().findings if f.mechanism == "windage"]
    assert 'grade = "claim"' not in correction_text(correction_of(claimed, fzg))  # the usual one, as in older files


def test_the_calibrated_machine_alone_is_a_correction_too(
    claimed: Diagnosis, prepared: Prepared, fzg: Gearbox, tmp_path: Any
) -> None:
    """Where the findings do not improve the prediction it is the one to predict with."""
    write_correction(correction_of(claimed.calibrated_alone, fzg), tmp_path / "calibrated.toml")
    predicting = calibrated_to_predict(prepared[2], prepared[2])
    read, known = read_correction(tmp_path / "calibrated.toml", fzg), estimates_of(predicting)
    assert not [f for f in read.findings if f.mechanism != "shape"]
    for one in read.calibration:
        assert (one.value, one.stderr) == pytest.approx(known[one.name], rel=1e-6)
    with_findings = {c.parameter: c.value for c in claimed.calibration}
    assert max(abs(one.value / with_findings[one.name] - 1.0) for one in read.calibration) > 0.05
    assert {s.channel: s.bias for s in read.sensors} != {s.channel: s.bias for s in correction_of(claimed, fzg).sensors}


def test_the_report_shows_the_first_screen(claimed: Diagnosis) -> None:
    text = page(claimed)
    for question, _ in claimed.first_screen:
        assert question in text
    assert "refused" not in text and "windage" in text
