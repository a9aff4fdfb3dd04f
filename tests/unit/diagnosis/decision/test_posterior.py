"""Probabilities and answers of explanations that are made up: no simulation."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision import answer as answer_module
from diagnosis.decision.answer import Answer, decide, withdraw_claim
from diagnosis.decision.infer import _left_to_the_scan
from diagnosis.decision.posterior import KINDS, Judged, Likeness, Posterior
from diagnosis.decision.scanned import Scanned
from diagnosis.decision.settings import Settings
from diagnosis.engine.fit import Fit
from diagnosis.engine.learnt import ErrorClass, error_classes, rule
from models.base.errors import InputError
from models.mechanisms import OPEN_FORM
from models.network.laws import Parameter, symbol
from models.terms.term import Kind, Term

STRONG = 60.0  # nats
WIDTH = rule().temper[0] + rule().temper[1] * STRONG  # nats that count like one, if that is the best
ENOUGH = Settings().claim_from
EACH = -4.0  # log prior of an effect


def effect(
    name: str, place: str = "oil", *, kind: Kind = "source", target: tuple[str, ...] = (), **given: Any
) -> Hypothesis:
    """An effect that acts on its place, or on other targets."""
    label = f"{name}_{place}"
    strength = Parameter(name=f"{label}_strength", unit="W", start=0.0, sd=10.0, lower=-100.0, upper=100.0, log=False)
    term = Term(label=label, kind=kind, target=target or (place,), expression=symbol(strength.name),
                parameters=(strength,))  # fmt: skip
    return Hypothesis(**({"name": name, "place": place, "family": "heat", "term": term, "law": name,
                          "variants": np.ones((1, 1)), "log_prior": EACH} | given))  # fmt: skip


def outside(parameter: str) -> Hypothesis:
    """A parameter outside its prior."""
    return effect("parameter", parameter, term=None, unknown=0, law=f"parameter {parameter}")


def over_hours(law: str) -> Hypothesis:
    return effect(f"{law}_over_hours", law=law, ending="over_hours", clock="start")


def judged(log_bayes: float, *effects: Hypothesis) -> Judged:
    return Judged(effects=effects, log_bayes=log_bayes, error_class=error_classes()[0])


def posterior(*each: Judged, remainder: float | None = None, **given: Any) -> Posterior:
    """Of some explanations; `remainder`: what a further effect explains beside the first one."""
    usual: dict[str, Any] = {"log_e": 100.0, "threshold": 5.0, "class_threshold": 5.0, "rule": rule()}
    if remainder is not None:
        each = (replace(each[0], left=remainder), *each[1:])
    return Posterior(nothing=judged(0.0), judged=each, **(usual | given))


def several(count: int, **given: Any) -> tuple[Judged, ...]:
    """Names that the readings do not separate, each at its place."""
    return tuple(judged(STRONG, effect(f"law_{i}", f"part_{i}", **given)) for i in range(count))


def chances(found: Posterior) -> dict[str, float]:
    return {" + ".join(one.names): one.probability for one in found.explanations}


# ------------------------------------------------------------------ probabilities


def test_the_evidence_of_a_name_is_the_mean_over_its_places() -> None:
    places = [judged(STRONG, effect("everywhere", f"part_{i}")) for i in range(8)]
    one_of_many = [judged(STRONG if i == 0 else -50.0, effect("somewhere", f"part_{i}")) for i in range(8)]
    found = {one.names[0]: one for one in posterior(*places, *one_of_many).explanations}
    assert found["everywhere"].log_bayes == pytest.approx(STRONG)
    assert found["somewhere"].log_bayes == pytest.approx(STRONG - np.log(8.0))
    ratio = found["everywhere"].probability / found["somewhere"].probability
    assert ratio == pytest.approx(np.exp(np.log(8.0) / WIDTH))


def test_places_weigh_in_the_mean_by_their_priors() -> None:
    likely, unlikely = judged(STRONG, effect("law", "a")), judged(0.0, effect("law", "b", log_prior=EACH - np.log(3.0)))
    (found,) = posterior(likely, unlikely).explanations
    assert found.log_bayes == pytest.approx(STRONG + np.log(0.75))
    assert found.members == (likely, unlikely)


def test_a_law_and_its_change_at_a_date_are_one_name() -> None:
    always, dated = effect("windage"), effect("windage_step", law="windage", ending="step", clock="start")
    hours = over_hours("windage")
    (found,) = posterior(judged(20.0, always), judged(STRONG, dated), judged(0.0, hours)).explanations
    assert found.names == ("windage",) and found.members[0].effects == (dated,)


def test_between_names_the_evidence_is_tempered() -> None:
    found = chances(posterior(judged(STRONG, effect("first")), judged(STRONG - 20.0, effect("second"))))
    assert found["first"] / found["second"] == pytest.approx(np.exp(20.0 / WIDTH))


def test_the_prior_of_a_name_does_not_count_between_names() -> None:
    """Only the evidence separates names; more places or a larger family make none of them more probable."""
    found = chances(posterior(judged(STRONG, effect("first", log_prior=2.0 * EACH)), judged(STRONG, effect("second"))))
    assert found["first"] == pytest.approx(found["second"])


def test_names_that_explain_too_little_are_refuted() -> None:
    least = rule().refuted * STRONG
    found = chances(
        posterior(judged(STRONG, effect("best")), judged(least + 0.1, effect("in")), judged(least - 0.1, effect("out")))
    )
    assert found["out"] == 0.0 < found["in"] < found["best"]


def test_probabilities_sum_to_one_with_nothing() -> None:
    parameter = outside("h_air")
    sensor = effect("sensor_bias", kind="sensor")
    pair = judged(STRONG + 8.0, effect("first"), effect("second"))
    every = [judged(STRONG, effect("first")), judged(STRONG, sensor), judged(50.0, parameter), pair,
             judged(STRONG, effect("unknown_heat", family=OPEN_FORM, log_prior=0.0))]  # fmt: skip
    found = posterior(*every, log_e=6.0, log_parameter=4.0, remainder=10.0)
    of_kind = {kind: found.of(kind) for kind in KINDS}
    assert sum(of_kind.values()) == pytest.approx(1.0)
    assert all(p > 0.0 for p in of_kind.values())
    assert sum(p for _, p in found.ranked) == pytest.approx(1.0 - found.of("nothing"))


def test_something_is_as_probable_as_nothing_at_the_threshold() -> None:
    at, above = (posterior(*several(1), log_e=log_e) for log_e in (5.0, 5.0 + rule().doubt))
    assert at.of("nothing") == pytest.approx(0.5) and not at.detected
    assert above.something == pytest.approx(1.0 / (1.0 + np.exp(-1.0))) and above.detected


def test_the_threshold_follows_the_rate_that_is_asked_for() -> None:
    error = ErrorClass(name="made up", prior=1.0, threshold=7.0, amplitudes={})
    usual, often, seldom = (rule().thresholds(error, error, rate) for rate in (rule().rate, 0.1, 0.001))
    assert usual == (pytest.approx(14.0), pytest.approx(7.0))
    assert all(less < middle < more for less, middle, more in zip(often, usual, seldom, strict=True))
    assert rule().thresholds(replace(error, threshold=5.0), replace(error, threshold=5.0), 0.5)[1] == 0.0


def test_a_machine_that_fits_badly_without_the_effect_needs_more_evidence() -> None:
    small = ErrorClass(name="small", prior=0.5, threshold=5.0, amplitudes={})
    large = ErrorClass(name="large", prior=0.5, threshold=60.0, amplitudes={})
    assert rule().thresholds(large, small, rule().rate) == (pytest.approx(65.0), pytest.approx(32.5))


@pytest.mark.parametrize("odds", [0.01, 0.5])
def test_a_cause_outside_the_catalogue_has_the_odds_of_the_user(odds: float) -> None:
    unknown = judged(STRONG, effect("unknown_heat", family=OPEN_FORM, log_prior=0.0))
    found = posterior(*several(4), unknown, settings=Settings(odds_unknown=odds))
    assert found.of("outside") / found.of("mechanism") == pytest.approx(odds)


# ------------------------------------------------------------------ answers


def test_without_enough_evidence_nothing_is_answered() -> None:
    assert decide(posterior(*several(1), log_e=4.9)) == ()
    assert decide(posterior(*several(1))) != ()


def test_a_claim_begins_at_the_probability_of_the_user() -> None:
    found = posterior(judged(STRONG, effect("first")), judged(STRONG - 10.0, effect("second", "mesh")))
    own = found.of_names(["first"])
    assert 0.6 < own < 0.9
    (claim,), (tie,) = (decide(replace(found, settings=Settings(claim_from=own + more))) for more in (-1e-6, 1e-6))
    assert (claim.grade, claim.tied, claim.acts_like) == ("claim", (), False)
    assert claim.probability == pytest.approx(own)
    assert tie.grade == "likely" and len(tie.tied) == 2


@pytest.mark.parametrize("count", [2, 3])
def test_up_to_three_names_are_a_tie(count: int) -> None:
    (answer,) = decide(posterior(*several(count)))
    assert (answer.grade, answer.acts_like, len(answer.tied)) == ("likely", False, count)
    assert answer.tied[0][0] is answer.effect
    assert sum(p for _, p in answer.tied) >= ENOUGH


def test_four_names_are_no_answer() -> None:
    assert decide(posterior(*several(4))) == ()


@pytest.mark.parametrize(("cosine", "answered"), [(0.95, True), (0.85, False)])
def test_it_acts_like_names_that_look_alike(cosine: float, answered: bool) -> None:
    names = several(4)
    likeness = Likeness(labels=tuple(one.label for one in names), cosines=np.full((4, 4), cosine))
    answers = decide(posterior(*names, likeness=likeness))
    assert [(one.grade, one.acts_like, one.tied) for one in answers] == [("likely", True, ())] * answered


@pytest.mark.parametrize(
    ("kind", "target", "answered"),
    [("source", ("oil",), True), ("link", ("oil", "air"), False), ("source", ("mesh",), False)],
)
def test_it_acts_like_names_that_act_on_the_same(kind: Kind, target: tuple[str, ...], answered: bool) -> None:
    others = [judged(STRONG - 0.1, effect(f"law_{i}", f"part_{i}", kind=kind, target=target)) for i in range(3)]
    answers = decide(posterior(judged(STRONG, effect("best", "oil")), *others))
    assert [one.acts_like for one in answers] == [True] * answered


def test_a_course_over_the_hours_is_never_a_claim() -> None:
    (answer,) = decide(posterior(judged(STRONG, over_hours("windage"))))
    assert answer.probability > ENOUGH and (answer.grade, answer.acts_like) == ("likely", True)


@pytest.mark.parametrize(("gain", "limit"), [(STRONG, rule().much_left[0]), (1000.0, 1000.0 * rule().much_left[1])])
def test_where_much_is_left_there_is_no_claim(gain: float, limit: float) -> None:
    """And of the name only the share is stated that turned out right in such cases."""

    def answered(remainder: float) -> Answer:
        (answer,) = decide(posterior(judged(gain, effect("law")), remainder=remainder))
        return answer

    little, much = answered(limit - 0.1), answered(limit + 0.1)
    assert (little.grade, little.acts_like) == ("claim", False)
    assert (much.grade, much.acts_like) == ("likely", True)
    assert much.probability == pytest.approx(rule().nearest * little.probability)


def test_a_claim_that_is_withdrawn_is_the_nearest_name_at_most() -> None:
    found = posterior(*several(3))
    for asked, tied in ((0.5, 2), (0.9, 3)):
        (tie,) = decide(replace(found, settings=Settings(claim_from=asked)))
        assert len(tie.tied) == tied
        left = withdraw_claim(tie, rule())
        assert (left.grade, left.acts_like, left.tied) == ("likely", True, ())
        assert left.joint == pytest.approx(rule().nearest * tie.joint)
        assert withdraw_claim(left, rule()) is left
    (claim,) = decide(posterior(judged(STRONG, effect("law"))))
    left = withdraw_claim(claim, rule())
    assert claim.grade == "claim" and left.grade == "likely"
    assert left.probability == pytest.approx(rule().nearest * claim.probability)


def test_of_names_that_act_on_one_thing_the_joint_probability_is_told() -> None:
    bias, gain = (effect(name, "oil", kind="sensor") for name in ("sensor_bias", "sensor_gain"))
    drift, lag = (effect(name, "oil", kind="sensor") for name in ("sensor_drift", "sensor_lag"))
    (answer,) = decide(posterior(*(judged(STRONG, one) for one in (bias, gain, drift, lag))))
    assert answer.acts_like and answer.probability < 0.3 < ENOUGH < answer.joint
    assert withdraw_claim(answer, rule()).joint == pytest.approx(rule().nearest * answer.joint)  # only once


def test_both_effects_of_a_pair_are_answered() -> None:
    first, second = effect("first"), effect("second", "mesh")
    found = posterior(judged(STRONG, first), judged(STRONG, second), judged(2.0 * STRONG, first, second),
                      remainder=10.0)  # fmt: skip
    answers = decide(found)
    assert [one.effect for one in answers] == [first, second] and found.of("pair") > ENOUGH
    assert [one.grade for one in answers] == ["claim", "claim"]


@pytest.mark.parametrize(("apart_s", "grade"), [(2400.0, "likely"), (2600.0, "claim")])
def test_two_that_begin_at_the_same_time_are_no_claims(apart_s: float, grade: str) -> None:
    """In 100 000 s two dates are less than 2500 s apart in one of twenty cases: one cause is more probable."""
    pair = [effect(name, ending="step", clock="start", date=f"{name}_since") for name in ("first", "second")]
    unknowns = [SimpleNamespace(parameter=SimpleNamespace(name=name), value=float)
                for name in ("first_since", "other", "second_since")]  # fmt: skip
    pieces = [SimpleNamespace(recording=name, duration=100_000.0) for name in ("tested", "healthy")]
    experiment = SimpleNamespace(unknowns=unknowns, pieces=pieces, tested=[0])
    fit = cast(Fit, SimpleNamespace(experiment=experiment, z=np.array([1000.0, 3.0, 1000.0 + apart_s])))
    both = replace(judged(2.0 * STRONG, *pair), fit=fit, left=0.0)
    found = posterior(*(judged(STRONG, one) for one in pair), both, remainder=10.0)
    answers = decide(found)
    assert [(one.grade, one.acts_like, one.one_event) for one in answers] == [
        (grade, grade == "likely", grade == "likely")
    ] * 2
    assert (answers[0].probability < 0.5) == (grade == "likely")


@pytest.mark.parametrize(("second", "of_time", "cosine", "grade"), [
    ("oil", True, -0.6, "likely"),  # sun and rain at once
    ("oil", True, -0.4, "claim"),
    ("mesh", True, -0.6, "claim"),
    ("oil", False, -0.6, "claim"),  # a loss and a cooler: whatever both follow
])  # fmt: skip
def test_two_that_come_and_go_together_are_no_claims(
    monkeypatch: pytest.MonkeyPatch, second: str, of_time: bool, cosine: float, grade: str
) -> None:
    def law(name: str, place: str) -> Hypothesis:
        one = effect(name, place)
        assert one.term is not None
        return replace(one, term=replace(one.term, expression=one.term.expression * symbol("time"))) if of_time else one

    pair = law("first", "oil"), law("second", second)
    heats = {"first_oil": np.array([2.0, 0.0]), f"second_{second}": np.array([cosine, np.sqrt(1.0 - cosine**2)])}
    monkeypatch.setattr(answer_module, "course_of_heat", lambda _, term: heats[term.label])
    fit = cast(Fit, SimpleNamespace(experiment=SimpleNamespace(unknowns=[], pieces=[], healthy=set()), z=np.zeros(0)))
    both = replace(judged(2.0 * STRONG, *pair), fit=fit, left=0.0)
    answers = decide(posterior(*(judged(STRONG, one) for one in pair), both, remainder=10.0))
    assert [(one.grade, one.one_event) for one in answers] == [(grade, grade == "likely")] * 2


@pytest.mark.parametrize(("left", "grade"), [(None, "likely"), (1.0, "claim"), (STRONG, "likely")])
def test_a_pair_is_judged_by_what_it_leaves_itself(left: float | None, grade: str) -> None:
    """One effect leaves the second; without a scan given both, nobody knows that they leave less."""
    first, second = effect("first"), effect("second", "mesh")
    both = replace(judged(2.0 * STRONG, first, second), left=left)
    found = posterior(judged(STRONG, first), judged(STRONG, second), both, remainder=STRONG)
    assert [one.grade for one in decide(found)] == [grade, grade]


def test_a_pair_that_is_not_allowed_refutes_no_single_name() -> None:
    first, second = effect("first"), effect("second")
    found = posterior(judged(20.0, first), judged(18.0, second), judged(100.0, first, second), remainder=4.0)
    assert sum(chances(found).values()) == pytest.approx(found.something) and found.of("pair") == 0.0
    assert decide(found)


def test_a_pair_has_less_prior_than_one_effect() -> None:
    first, second = effect("first"), effect("second", "mesh")
    found = posterior(judged(STRONG, first), judged(-50.0, second), judged(STRONG, first, second))
    values = {one.names: one.log_bayes for one in found.explanations}
    assert values["first", "second"] == pytest.approx(values["first",] + np.log(rule().pair / 2.0))


def test_a_second_effect_is_no_rival_of_the_first() -> None:
    """The first one is certain with the second and without it; the second alone is not answered."""
    first, second = effect("first"), effect("second", "mesh")
    found = posterior(judged(STRONG, first), judged(1.0, second), judged(STRONG + 6.0, first, second),
                      remainder=10.0)  # fmt: skip
    assert 0.1 < found.of("pair") < ENOUGH < found.of_names(["first"])
    answers = decide(found)
    assert [(one.effect.name, one.grade) for one in answers] == [("first", "claim")]


def test_a_second_effect_without_evidence_of_its_own_does_not_compete() -> None:
    first, second = effect("first"), effect("second", "mesh")
    every = judged(STRONG, first), judged(1.0, second), judged(STRONG + 6.0, first, second)
    assert posterior(*every, remainder=4.0).of("pair") == 0.0 < posterior(*every, remainder=6.0).of("pair")


def test_two_faults_of_one_sensor_are_known_by_the_sensor() -> None:
    """Neither name is certain, and the pair is the most probable: together they are, at this sensor."""
    bias, gain = (effect(name, "oil", kind="sensor") for name in ("sensor_bias", "sensor_gain"))
    found = posterior(judged(STRONG, bias), judged(STRONG, gain), judged(STRONG + 2.0 * WIDTH, bias, gain),
                      remainder=10.0)  # fmt: skip
    assert found.of_names(["sensor_bias"]) < ENOUGH and found.of_names(["sensor_gain"]) < ENOUGH
    answers = decide(found)
    assert [(one.effect.place, one.grade, one.acts_like) for one in answers] == [("oil", "likely", True)] * 2


def test_a_fit_at_the_best_place_goes_before_others() -> None:
    here, there, second = effect("first", "oil"), effect("first", "mesh"), effect("second")
    fit = cast(Fit, object())
    pair = replace(judged(2.0 * STRONG, there, second), fit=fit)
    at_the_place = replace(judged(STRONG - 9.0, here, second), fit=fit)
    found = posterior(judged(3.0 * STRONG, here), pair, at_the_place)
    assert next(one.best for one in decide(found)) is at_the_place


def test_a_parameter_outside_its_prior_is_answered_by_its_name() -> None:
    h_air, h_oil = (
        effect("parameter", name, term=None, unknown=i, law=f"parameter {name}")
        for i, name in enumerate(("air", "oil"))
    )
    found = posterior(judged(STRONG, h_air), judged(0.0, h_oil), log_e=-1.0, log_parameter=100.0)
    (answer,) = decide(found)
    assert answer.effect is h_air and answer.grade == "claim"
    assert found.of("parameter") == pytest.approx(found.of_names(["parameter air"]))
    # Where model error is large it stands in for another structure of the machine.
    large = next(one for one in error_classes() if one.is_large)
    (nearest,) = decide(replace(found, judged=(replace(found.judged[0], error_class=large),)))
    assert (nearest.effect, nearest.grade, nearest.acts_like) == (h_air, "likely", True)
    assert nearest.probability < rule().nearest


def test_a_parameter_outside_its_prior_goes_behind_something_that_is_missing() -> None:
    """Next to an effect that is detected a parameter has only what that leaves."""
    parameter = judged(STRONG + 20.0, outside("air"))
    found = posterior(judged(STRONG, effect("windage")), parameter, log_e=9.0, log_parameter=100.0)
    (answer,) = decide(found)
    assert answer.effect.name == "windage" and found.evidence == 9.0
    assert found.of("parameter") == pytest.approx(1.0 - found.something)
    two = judged(STRONG + 40.0, *map(outside, ("air", "oil")))
    (answer,) = decide(replace(found, judged=(replace(found.judged[0], left=50.0), parameter, two)))
    assert answer.effect.name == "windage"  # two of them are no effect either
    silent = replace(found, log_e=4.0)
    assert silent.parameter_outside and silent.evidence == 100.0
    assert decide(silent)[0].effect.name == "parameter"


def test_an_unknown_heat_is_never_a_claim() -> None:
    (answer,) = decide(posterior(judged(STRONG, effect("unknown_heat", family=OPEN_FORM, log_prior=0.0))))
    assert answer.probability > ENOUGH and (answer.grade, answer.acts_like) == ("likely", True)


def test_a_law_with_more_evidence_goes_before_a_heat_like_no_law_there() -> None:
    """A thermometer that drifts looks like any heat into its own small part, and can be fitted."""
    heat = judged(STRONG, effect("unknown_heat", "bearing_1", family=OPEN_FORM, log_prior=0.0))
    drift = judged(STRONG + 9.0, effect("sensor_drift", "bearing_1", kind="sensor"))
    for where, weaker, led in (("bearing_1", 0.0, "sensor_drift"), ("bearing_1", 9.0, "unknown_heat"),
                               ("bearing_2", 0.0, "unknown_heat")):  # fmt: skip
        known = judged(drift.log_bayes - weaker, effect("sensor_drift", where, kind="sensor"))
        found = posterior(heat, replace(known, fit=cast(Fit, object())), settings=Settings(odds_unknown=10.0))
        assert found.explanations[0].names == ("unknown_heat",)
        (answer,) = decide(found)
        assert answer.effect.name == led and answer.joint > ENOUGH
        assert led == "unknown_heat" or [one.name for one, _ in answer.tied] == ["sensor_drift", "unknown_heat"]


def test_what_a_fit_takes_from_a_law_it_takes_at_its_other_places_too() -> None:
    """Else a place that was not fitted would go before the best one, which was."""
    sun, other = [effect("sun", place) for place in ("cover", "base", "wall")], effect("fan", "base")
    every = (*sun, other)
    here = SimpleNamespace(scan=SimpleNamespace(best=[0] * 4), error_class=error_classes()[0])
    first = cast(
        Scanned, SimpleNamespace(candidates=every, log_bayes=np.array([60.0, 58.0, 20.0, 30.0]), best=[here] * 4)
    )
    alone = {one.label: float(value) for one, value in zip(every, first.log_bayes, strict=True)}
    fitted = replace(judged(52.0, sun[0]), fit=cast(Fit, object()))
    failed = judged(20.0, sun[2])
    found = _left_to_the_scan({sun[0].label: fitted, sun[2].label: failed}, first, alone)
    assert {label: one.log_bayes for label, one in found.items()} == {
        "sun@base": 50.0, "sun@wall": 12.0, "fan@base": 30.0
    }  # fmt: skip
    better = replace(fitted, log_bayes=90.0)  # what a fit gains is of its place alone
    assert _left_to_the_scan({sun[0].label: better}, first, alone)["sun@base"].log_bayes == 58.0


def test_a_name_without_a_fit_at_its_best_place_is_answered_by_its_own_fit_and_not_by_a_pair() -> None:
    base, cover = (effect("sun", place) for place in ("base", "cover"))
    fit = cast(Fit, object())
    single = replace(judged(STRONG - 5.0, cover), fit=fit)
    pair = replace(judged(STRONG + 10.0, cover, effect("fan", "base")), fit=fit)
    (answer,) = decide(posterior(judged(STRONG, base), single, pair))
    assert answer.best is single and answer.effect is cover


def test_certainty_is_never_above_one() -> None:
    many = [judged(STRONG, effect("fan", place=str(i))) for i in range(50)]
    found = posterior(*many)
    assert found.of_names(["fan"]) <= 1.0 and found.of("mechanism") <= 1.0


@pytest.mark.parametrize(("name", "value"), [("false_alarm_rate", 0.0), ("claim_from", 1.0), ("odds_unknown", 20.0)])
def test_settings_that_mean_nothing_are_refused(name: str, value: float) -> None:
    with pytest.raises(InputError, match=f"{name} = {value:g} is not possible; .* is"):
        Settings(**{name: value})


def test_an_answer_is_read_off_the_fit_with_most_evidence_for_its_name() -> None:
    """The best place could not be fitted, another one lost the effect; with a second effect it is there."""
    fit = cast(Fit, object())
    fan, other, drag = effect("fan", "oil"), effect("fan", "air"), effect("drag", "shaft")
    unfitted, weak = judged(80.0, fan), replace(judged(20.0, other), fit=fit)
    pair = replace(judged(60.0, drag, fan), fit=fit)
    answers = decide(posterior(unfitted, weak, pair))
    assert [(one.best, one.effect) for one in answers] == [(pair, fan)]
    fitted = replace(unfitted, fit=fit)
    assert [one.best for one in decide(posterior(fitted, weak, pair))] == [fitted]


@pytest.mark.parametrize(("more", "grade"), [(0.1, "claim"), (-0.1, "likely")])
def test_where_model_error_is_large_a_claim_needs_more_evidence(more: float, grade: str) -> None:
    large = next(one for one in error_classes() if one.is_large)
    best = replace(judged(STRONG, effect("law")), error_class=large)
    (answer,) = decide(posterior(best, log_e=rule().named_if_large + more))
    assert (answer.grade, answer.acts_like) == (grade, more < 0.0)
    assert answer.probability == pytest.approx((1.0 if more > 0.0 else rule().nearest), abs=1e-6)


@pytest.mark.parametrize(("gain", "stands"), [(0.0, True), (30.0, False)])
def test_a_name_that_mostly_stands_alone_stands_in_place_of_another_one(gain: float, stands: bool) -> None:
    """Also where both together are one of the explanations, if that is less probable."""
    first, second, third = effect("first"), effect("second", "mesh"), effect("third", "mesh")
    found = posterior(judged(STRONG, first), judged(STRONG - 1.0, second), judged(STRONG - 8.0, third),
                      judged(STRONG + gain, first, second), remainder=15.0)  # fmt: skip
    both = sum(one.probability for one in found.explanations if one.names == ("first", "second"))
    assert (0.0 < both < chances(found)["second"]) == stands
    (answer, *_) = decide(found)
    assert ("second" in [one.law for one, _ in answer.tied]) == stands
