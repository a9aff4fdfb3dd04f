"""The summary of a diagnosis on a terminal."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from diagnosis.decision.posterior import Assumed, Placebo, ScaledError
from diagnosis.decision.settings import Settings
from diagnosis.report import finding_charts
from diagnosis.report.page import page
from diagnosis.results.first_screen import EITHER, FAR, VERDICT_TEXT, predicting_told
from diagnosis.results.number_format import number
from diagnosis.results.result import Diagnosis
from diagnosis.results.result_parts import CalibratedModel, Change, Errors, Fits, Ranked, Rival, Switching
from models.correction.correction import MeanLoss
from tests.unit.diagnosis.diagnosis_example import (
    consistent,
    insufficient_data,
    missing_physics,
    two_effects,
    unexplained,
)


def told(diagnosis: Diagnosis, question: str) -> str:
    return "\n".join(dict(diagnosis.first_screen).get(question, ()))


def test_the_verdict_stands_first_then_the_questions_in_order() -> None:
    lines = missing_physics().summary()
    assert lines[0] == f"missing physics: {VERDICT_TEXT['missing_physics']}"
    asked = ["Is something missing?", "Where?", "What?", "How sure?", "How much better?", "What next?",
             "What cannot be seen in these data?"]  # fmt: skip
    assert [line.split("?")[0] + "?" for line in lines[1:] if not line.startswith(" ")] == asked
    assert "5.21 K as delivered, 3.62 K calibrated, 0.52 K with the findings" in str(missing_physics())
    assert "41.3 nat, 3.9 needed" in lines[1]


def test_where_little_could_be_seen_the_summary_states_how_much_could_hide_and_the_option() -> None:
    line = "Not decided: 30 effects could hide that change a temperature by 4 K (--matters-K)"
    asked = replace(insufficient_data(), settings=Settings(matters_K=4.0))
    answer = told(asked, "Is something missing?")
    assert answer.startswith(line) and answer.endswith(
        f"Evidence {asked.log_e_value:.1f} nat, {asked.threshold:.1f} needed."
    )


def test_what_each_size_of_model_error_needs_stands_with_the_evidence() -> None:
    half = ScaledError(factor=0.5, log_e_value=31.4, threshold=40.0, mechanism="windage", place="oil")
    as_assumed = replace(half, factor=1.0, log_e_value=29.2, threshold=10.0)
    one_name = replace(missing_physics(), assumed=Assumed(scaled_error=(half, as_assumed)))
    sure = told(one_name, "How sure?")
    assert "half as large 31 nat (40 needed), as assumed 29 nat (10 needed): windage at oil ahead." in sure
    two_names = (half, replace(as_assumed, mechanism="pocketing", place="mesh"))
    sure = told(replace(one_name, assumed=Assumed(scaled_error=two_names)), "How sure?")
    assert "31 nat (40 needed; windage at oil ahead), as assumed 29 nat (10 needed; pocketing at mesh ahead)." in sure


def test_a_baseline_that_raises_the_threshold_is_told_with_it() -> None:
    healthy = Placebo(session="march", log_e_value=38.0, mechanism="windage", place="oil")
    raised = replace(missing_physics(), assumed=Assumed(placebo=healthy), threshold=38.0)
    assert "38.0 needed (as much as the baseline 'march' brings)" in told(raised, "Is something missing?")
    little = replace(raised, threshold=raised.further_threshold)
    assert "needed (false-alarm rate of 5 % asked for)" in told(little, "Is something missing?")


def test_evidence_against_still_air_is_told_where_draughts_are_more_probable() -> None:
    line = "Against the machine in still air it is 48.8 nat; without an effect draughts are more probable, by 7.5 nat."
    draughts = Assumed(draughts_ahead=7.5)
    assert line in told(replace(missing_physics(), assumed=draughts), "How sure?")
    assert "draughts" not in told(missing_physics(), "How sure?")
    assert "draughts" not in told(replace(consistent(), assumed=draughts), "How sure?")


def test_a_diagnosis_of_the_loss_alone_has_a_summary() -> None:
    """Only losses were measured in the rows that count: no temperature has an error."""
    nan = replace(consistent().train, before=math.nan, calibrated=math.nan, found=math.nan, after=math.nan)
    (answer,) = dict(replace(consistent(), train=nan, holdout=nan).first_screen)["Is something missing?"]
    assert answer.startswith("Nothing that these data show")


def test_what_has_no_place_is_told() -> None:
    none = replace(missing_physics(), unseen=(), not_tried=("bearing_preload",))
    line = told(none, "What cannot be seen in these data?")
    assert line == "Not tried, having no place in this machine and its recordings: bearing_preload."


def test_of_an_instrument_and_a_place_with_heat_the_heat_is_told() -> None:
    place = missing_physics().location[0]
    torque = replace(place, nodes=("torque",), probability=0.99, heat_mean_W=0.0, heat_max_W=0.0)
    assert told(replace(missing_physics(), location=(torque,)), "Where?").endswith("no heat")
    where = told(replace(missing_physics(), location=(torque, replace(place, probability=0.98))), "Where?")
    assert where.startswith(f"torque (0.99), {place.node} (0.98); in {place.node} ") and " W added on average " in where


def test_a_claim_and_something_likely_stand_apart_by_words() -> None:
    claim, likely = two_effects().findings
    rivals = missing_physics().findings[0].confusable_with
    tied = ("bearing_seat_contact", "pocketing")
    likely = replace(likely, grade="likely", tie_set=tied, joint_probability=0.93, confusable_with=rivals)
    both = replace(two_effects(), findings=(claim, likely))
    what, sure = told(both, "What?"), told(both, "How sure?")
    assert what.startswith("Claim: A thermostat") and "\nLikely: " in what
    assert (
        "bearing_seat_contact at bearing_1_housing or pocketing at oil: likely, probability of one of these 0.93"
        in sure
    )
    assert "not ruled out instead: churning_swirl at oil (0.02)" in sure  # and the tied one is not told twice


def test_names_that_only_act_like_it_are_told_as_such() -> None:
    (finding,) = missing_physics().findings
    found = replace(missing_physics(), findings=(replace(finding, grade="likely", acts_like=True),))
    assert "[acts like windage at oil]" in told(found, "What?")
    assert "likely, probability of this name, the nearest one, 0.91" in told(found, "How sure?")


def test_nearest_names_of_one_kind_at_one_place_are_told_together() -> None:
    (finding,) = missing_physics().findings
    near = replace(finding, grade="likely", acts_like=True)
    other, elsewhere = replace(near, mechanism="pump_heat", says="A pump heats."), replace(near, place="pinion")
    found = replace(missing_physics(), findings=(near, elsewhere, other))
    assert found.items == ((near, other), (elsewhere,))
    what = told(found, "What?")
    assert "[acts like windage with pump_heat at oil]" in what and "[acts like windage at pinion]" in what
    assert "\n  with it: A pump heats." in what
    assert "acts like windage with pump_heat at oil: likely" in told(found, "How sure?")


def test_dates_and_switches() -> None:
    (finding,) = missing_physics().findings
    change = Change(recording="train_1", from_s=20634.0, band_s=(20100.0, 21100.0))
    found = replace(finding, date=change, switching=Switching(on_degC=73.0, off_degC=67.0, of=("oil",)))
    what = told(replace(missing_physics(), findings=(found,)), "What?")
    assert "on at 73.0 degC, off at 67.0 degC (oil)" in what
    assert "from 5.73 h of train_1 on (5.58 h to 5.86 h)" in what
    stored = replace(missing_physics(), findings=(found,)).to_dict()["findings"][0]
    assert stored["date"] == {"recording": "train_1", "from_s": 20634.0, "band_s": [20100.0, 21100.0], "to_s": None,
                              "utc": None}  # fmt: skip
    assert stored["switching"] == {"on_degC": 73.0, "off_degC": 67.0, "of": ("oil",)}


def test_numbers_that_are_others_in_the_model_that_predicts_are_told() -> None:
    base = missing_physics()
    (finding,) = base.findings
    assert finding.term is not None
    name, first = finding.term.strength.name, replace(finding.parameters[0], name="strength")
    finding = replace(finding, parameters=(first,))
    assert first.stderr > 0.0
    far = first.value + 2.5 * first.stderr
    near, there = (finding.term.with_values({name: first.value + times * first.stderr}) for times in (1.5, 2.5))
    assert predicting_told(replace(base, terms=(near,)), finding) == ""
    line = f"in the model that predicts (correction.toml): strength = {number(far)} {first.unit}"
    assert line in told(replace(base, terms=(there,), findings=(finding,)), "What?")
    assert "in the model that predicts" not in str(base)


def test_a_tie_of_measurement_and_machine_is_told_as_either() -> None:
    base = missing_physics()
    (finding,) = base.findings
    tied = replace(finding, grade="likely", kind="sensor", tie_set=("air_speed_gain", "windage"))
    either = replace(base, findings=(tied,))
    assert str(either).splitlines()[0].endswith(EITHER)
    assert "Yes, in the measurement or in the model: evidence" in told(either, "Is something missing?")
    for other in (replace(tied, kind="source"), replace(tied, tie_set=())):  # physics leads; and a name alone
        found = replace(base, findings=(tied, other))
        assert EITHER not in str(found) and "in the measurement" not in told(found, "Is something missing?")


def test_what_is_nearest_to_something_without_a_name_is_told() -> None:
    ranking = tuple(
        Ranked(mechanism=name, place="mesh", family="", log_bayes=log_bayes, probability=probability, laws=(name,))
        for name, log_bayes, probability in (
            ("unknown_loss", 190.0, 0.65), ("unknown_heat", 170.0, 0.33), ("bearing_preload", 70.0, 0.02)
        )
    )  # fmt: skip
    nameless = replace(unexplained(), findings=(), ranking=ranking)
    reported = "most like: unknown_loss at mesh (0.65), unknown_heat at mesh (0.33)."
    assert reported in told(nameless, "What?")
    assert "<b>Most like:</b> unknown loss at mesh (0.65)" in page(nameless)
    begun = Change(recording="train_1", from_s=20634.0, band_s=(20100.0, 21100.0))
    dated = replace(nameless, ranking=(replace(ranking[0], date=begun), *ranking[1:]))
    since = "(0.65; from 5.73 h of train_1 on (5.58 h to 5.86 h))"
    assert f"unknown_loss at mesh {since}, unknown_heat at" in told(dated, "What?")
    assert f"unknown loss at mesh {since}, " in page(dated)
    assert dated.to_dict()["ranking"][0]["date"]["from_s"] == 20634.0
    for other in (unexplained(), replace(consistent(), ranking=ranking)):
        assert other.nearest == () and "most like" not in str(other) and "<b>Most like" not in page(other)


def test_the_probability_of_a_name_is_that_of_all_its_places() -> None:
    places = tuple(
        Ranked(mechanism="windage", place=place, family="", log_bayes=9.0, probability=0.09, laws=("windage",))
        for place in ("oil", "gears", "wheel", "pinion")
    )
    spread = replace(unexplained(), findings=(), ranking=places)
    assert "most like: windage at oil (0.36)." in told(spread, "What?")
    assert "none has a probability of 0.1" in told(replace(spread, ranking=places[:1]), "What?")


def test_parameters_in_a_tie_have_names_of_their_own() -> None:
    (finding,) = missing_physics().findings
    h_air, h_oil = "parameter h_air", "parameter h_oil"
    rivals = tuple(Rival(mechanism="parameter", place=place, probability=p, separate_by="a warm-up")
                   for place, p in (("h_oil", 0.45), ("h_wheel", 0.03)))  # fmt: skip
    tied = replace(finding, mechanism="parameter", place="h_air", kind="parameter", grade="likely",
                   tie_set=(h_air, h_oil), joint_probability=0.95, confusable_with=rivals)  # fmt: skip
    assert tied.title == f"{h_air} or {h_oil}" and replace(tied, tie_set=()).title == h_air
    found = replace(missing_physics(), verdict="parameter_error", findings=(tied,))
    assert "not ruled out instead: parameter h_wheel (0.03)" in told(found, "How sure?")
    ranking = tuple(Ranked(mechanism="parameter", place=place, family="parameter", log_bayes=20.0, probability=p,
                           laws=(f"parameter {place}",)) for place, p in (("h_air", 0.5), ("h_oil", 0.45)))  # fmt: skip
    names = finding_charts._names(replace(found, ranking=ranking))
    assert [(label.replace("<br>", " "), grade) for label, grade, _ in names] == [
        ("parameter h air", "likely"), ("parameter h oil", "likely")
    ]  # fmt: skip


def test_parameters_far_from_their_priors_are_told_the_farthest_first() -> None:
    usual = consistent()
    assert "Far from" not in str(usual) and usual.verdict_text.startswith("Nothing stands out")  # all within 2.6 sd
    seal, bearing, *rest = usual.calibration
    far = (replace(bearing, parameter="bearing", estimate=1.9, shift_in_sd=3.2),
           replace(seal, parameter="seal", estimate=0.319, shift_in_sd=-4.57))  # fmt: skip
    moved = replace(usual, model=CalibratedModel(calibration=(*far, *rest)))
    line = (
        "Far from what was expected: seal = 0.319 (factor on the seal losses; 4.6 sd), "
        "bearing = 1.9 (factor on the bearing losses; 3.2 sd)"
    )
    assert told(moved, "What?") == f"{line}: check what they rest on, or whether a part or a path is missing."
    assert moved.verdict_text == FAR
    assert f"{line}." in told(replace(missing_physics(), model=moved.model), "How sure?")


def test_a_loss_that_is_not_measured_is_given_with_its_error_and_with_what_predicts() -> None:
    loss = MeanLoss(estimate_W=449.0, stderr_W=29.0, predicting_W=462.0, delivered_W=480.0, by_weight_W=460.0)
    light = replace(missing_physics(), model=CalibratedModel(mean_loss=loss.model_copy(update={"by_weight_W": 610.0})))
    assert "449 ± 29 W estimated (610 W if all heat capacities together are as the" in told(light, "How much better?")
    usual = replace(missing_physics(), model=CalibratedModel(mean_loss=loss))
    line = "Mean total loss, not measured: 449 ± 29 W estimated, 480 W as delivered, 462 W in the model that predicts"
    assert line in told(usual, "How much better?").splitlines()
    assert usual.to_dict()["mean_loss"] == {
        "estimate_W": 449.0, "stderr_W": 29.0, "predicting_W": 462.0, "delivered_W": 480.0, "by_weight_W": 460.0
    }  # fmt: skip
    far = replace(usual, model=CalibratedModel(mean_loss=loss.model_copy(update={"predicting_W": 508.0})))
    assert "508 W in the model that predicts: more than its error" in told(far, "How much better?")
    moved = replace(usual, model=CalibratedModel(mean_loss=loss.model_copy(update={"delivered_W": 600.0})))
    assert "predicts. Without a measured loss watts rest on the heat capacities" in told(moved, "How much better?")
    assert "Mean total loss" not in str(missing_physics()) and missing_physics().to_dict()["mean_loss"] is None


def test_every_likely_place_is_told_with_what_the_first_one_does() -> None:
    """A cooler at the inlet, and air that was not recorded: both are true."""
    base = missing_physics()
    first, other = base.location
    both = replace(
        base, location=(first, replace(other, nodes=("air",), probability=0.52), replace(other, probability=0.48))
    )
    heat = "21.0 W added on average over the recordings, 66.0 W at most"
    expected = f"oil (0.96), air (0.52); {heat}; speed above 2900 1/min"
    assert told(both, "Where?") == expected


def test_evidence_that_is_hardly_enough_says_probably() -> None:
    clear = missing_physics()
    assert told(clear, "Is something missing?").startswith("Yes, in the model: evidence")
    hardly = replace(clear, kinds={**clear.kinds, "nothing": 0.48})
    assert told(hardly, "Is something missing?").startswith("Probably, in the model: evidence")


def test_a_larger_held_out_error_is_not_called_better() -> None:
    base = missing_physics()
    worse = replace(base, holdout=replace(base.holdout, after=4.0), holdout_gain=93.0, contradicted=True)
    assert "not closer than with the calibrated model: predict with calibrated.toml" in told(worse, "How much better?")
    assert "not closer" not in told(replace(base, holdout_gain=93.0), "How much better?")
    better = told(worse, "How much better?")
    both = "predict with calibrated.toml; with model error allowed for they are more probable with the correction"
    assert both in better and "predicted better" not in better
    assert "by 93 nat of log score\nSo the held-out recordings contradict the findings (larger error of" in better
    assert "more probable" not in told(replace(worse, holdout_gain=-93.0), "How much better?")
    assert "contradict" not in told(base, "How much better?")
    unconfirmed = told(replace(base, holdout_gain=-30.0, contradicted=True), "How much better?")
    assert "predicted worse than by the calibrated model, by 30 nat of log score\nSo" in unconfirmed
    assert "contradict the findings (less probable readings)" in unconfirmed
    back = "the held-out readings take 30.0 nat of it back"
    assert back in told(replace(base, holdout_gain=-30.0), "Is something missing?")
    assert "of it back" not in told(base, "Is something missing?")
    withdrawn = told(replace(base, holdout_gain=-30.0, contradicted=True, terms=()), "How much better?")
    assert "and the corrected model does without them" in withdrawn
    kept = replace(base, holdout_gain=-30.0, contradicted=True, terms=tuple(f.term for f in base.findings if f.term))
    assert "does without them" not in told(kept, "How much better?")
    assert "by less than one nat of log score" in told(replace(base, holdout_gain=-0.3), "How much better?")
    assert "log score" not in told(replace(base, holdout_gain=0.0), "How much better?")  # nothing was fitted


def test_a_held_out_recording_that_loses_is_named() -> None:
    base = missing_physics()
    recordings = {"run_7": Errors(3.0, 0.5, 0.3), "run_8": Errors(3.0, 0.5, 0.5 + 2.0 * base.noise_K)}
    mixed = replace(base, holdout=replace(base.holdout, recordings=recordings))
    lines = told(mixed, "How much better?")
    assert "run_8 alone is not closer: 0.50 K calibrated" in lines and "run_7" not in lines
    assert "alone" not in told(base, "How much better?")


def test_names_ahead_are_hints_where_nothing_is_detected() -> None:
    """Each law once, no pairs, none with little evidence, and only where something may be missing."""
    base, (place, *_) = consistent(), missing_physics().location
    first, second, *_ = base.ranking
    names = (
        replace(first, laws=("a", "b"), log_bayes=40.0), replace(first, log_bayes=30.4),
        replace(first, place="elsewhere", log_bayes=20.0), replace(second, log_bayes=10.1),
        replace(second, laws=("other",), log_bayes=9.9),
    )  # fmt: skip
    hints = "pump_heat at oil (30 nat), aeration at oil_gears (10 nat)"
    asked = replace(base, ranking=names, location=(place,))
    assert told(asked, "What?") == f"Not shown by these data, but ahead of all other names: {hints}."
    assert not replace(asked, location=()).hints and not replace(asked, ranking=names[-1:]).hints
    assert not replace(asked, verdict="missing_physics").hints


def test_a_fault_of_many_channels_names_the_first_two() -> None:
    base = missing_physics()
    place = replace(
        base.location[0], nodes=("oil", "wheel", "pinion", "cover", "base"), heat_mean_W=0.0, heat_max_W=0.0
    )
    asked = replace(base, verdict="sensor_fault", location=(place,))
    assert "oil, wheel and 3 more (" in told(asked, "Where?")


def test_a_held_out_recording_of_a_machine_that_changed_is_no_agreement() -> None:
    base = consistent()
    assert base.missed == () and "missed" not in told(base, "How much better?")
    far = base.train.after + 2.0 * base.settings.matters_K + 3.0 * base.train.after
    recordings = {
        "good": Errors(1.0, 0.4, 0.4),
        "moved": Errors(1.0, far, far),
        "worse": Errors(1.0, far + 1.0, far + 1.0),
    }
    changed = replace(base, holdout=replace(base.holdout, recordings=recordings))
    assert changed.missed == ("worse", "moved")
    assert changed.verdict_text == "What was learnt from agrees with the model; held-out worse, moved do not."
    assert "in what was learnt from" in told(changed, "Is something missing?")
    assert f"moved is missed: {far:.2f} K" in told(changed, "How much better?")
    assert replace(changed, settings=replace(base.settings, matters_K=2.0 * far)).missed == ()


@pytest.mark.parametrize(("gain", "more_K", "contradicted"), [
    (3.0, -0.2, False), (-4.9, -0.2, False), (-5.1, -0.2, True), (3.0, 0.09, False), (3.0, 0.11, True),
    (0.0, 0.0, False), (np.nan, np.nan, False),
])  # fmt: skip
def test_what_held_out_recordings_contradict(gain: float, more_K: float, contradicted: bool) -> None:
    fits = Fits(before=3.0, calibrated=0.5, found=0.5, after=0.5 + more_K, sensors={}, recordings={})
    assert fits.contradict(gain, noise_K=0.1, needed=5.0) is contradicted


def test_laws_of_one_name_at_one_place_are_one_item() -> None:
    (finding,) = missing_physics().findings
    twice = replace(missing_physics(), findings=(finding, replace(finding, parameters=())))
    assert len(twice.items) == 1
    assert told(twice, "What?").count("Claim:") == 1
    assert told(twice, "How sure?").count("probability") == 1


def test_without_a_claim_the_verdict_is_only_probable() -> None:
    (finding,) = missing_physics().findings
    likely = replace(missing_physics(), findings=(replace(finding, grade="likely"),))
    assert "probably" in likely.verdict_text and "probably" not in missing_physics().verdict_text


def test_a_place_of_several_nodes_has_all_of_them() -> None:
    base = missing_physics()
    place = replace(base.location[0], nodes=("housing_lower", "housing_upper"))
    assert told(replace(base, location=(place,)), "Where?").startswith("housing_lower and housing_upper (0.96); 21")


def test_why_little_could_be_seen_is_told() -> None:
    base = insufficient_data()
    assert "because the recordings are too short or too calm for them" in told(base, "Is something missing?")
    far = replace(base, holdout=replace(base.holdout, calibrated=4.61))
    why = "because the model fits this machine badly: calibrated, it is 4.61 K off what was held out"
    assert why in told(far, "Is something missing?")
    assert why not in told(replace(far, settings=Settings(matters_K=5.0)), "Is something missing?")


def test_a_recording_that_is_another_one_is_named() -> None:
    base = missing_physics()
    alike = {"run_1": Errors(3.0, 0.9, 0.8), "run_2": Errors(3.0, 0.9, 1.0), "run_3": Errors(3.0, 2.6, 1.6)}
    for matters_K, off_K, is_told in ((0.6, 1.6, False), (0.6, 1.7, True), (0.9, 1.7, False)):
        recordings = alike | {"run_3": Errors(3.0, 2.6, off_K)}
        settings = replace(base.settings, matters_K=matters_K)
        lines = told(replace(base, settings=settings, train=replace(base.train, recordings=recordings)),
                     "How much better?")  # fmt: skip
        assert (
            f"run_3 alone is missed by {off_K:.2f} K, the others that were learnt from by 0.90 K" in lines
        ) is is_told
    alone = replace(base, train=replace(base.train, recordings={"run_3": Errors(3.0, 2.6, 1.7)}))
    assert "alone is missed" not in told(alone, "How much better?")


def test_findings_with_which_temperatures_are_no_closer_are_not_called_better() -> None:
    base = missing_physics()
    farther = replace(base, holdout_gain=92.0, contradicted=True, holdout=replace(base.holdout, found=9.0))
    lines = told(farther, "How much better?")
    assert "do not confirm the findings (temperatures are no closer with them): no name is a claim" in lines
    assert "predicted better" not in lines
    assert "predicted better" in told(replace(base, holdout_gain=92.0), "How much better?")


def test_what_an_fmu_misses_without_the_recorder_is_shown_where_it_is_more_than_noise() -> None:
    base = missing_physics()
    for more, is_told in ((0.9, False), (1.1, True)):
        off_K = base.holdout.after + more * base.noise_K
        lines = told(replace(base, as_stated_K=off_K), "How much better?")
        assert (f"With instruments as stated held-out temperatures are missed by {off_K:.2f} K" in lines) is is_told
