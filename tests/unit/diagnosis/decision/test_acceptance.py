"""What is accepted, and what the held-out recordings refuse."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from diagnosis.candidates.explain import Explanation
from diagnosis.decision.stage import Stage, log_e_value
from diagnosis.inference.posterior import Problem
from diagnosis.inference.unknowns import Unknown, Unknowns

from diagnosis.candidates import explain
from diagnosis.candidates.hypotheses import hypothesis_of
from diagnosis.decision import acceptance, search
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.mechanisms import CATALOGUE, Scale
from tests.unit.diagnosis.inference_example import CHANNELS, NOTHING, judge_of, scored_as


def test_another_place_of_the_same_physics_may_be_taken_where_the_best_one_fails(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What the held-out recordings refuse is no rival any more; another name far behind the best is not taken."""

    def explanation(*found: tuple[str, str]) -> Explanation:
        hypotheses = tuple(scored_as(name, place, 0.0).hypothesis for name, place in found)
        return Explanation(problem=NOTHING, fit=NOTHING, log_evidence=0.0, found=hypotheses)

    monkeypatch.setattr(acceptance, "_matters", lambda *_: True)
    monkeypatch.setattr(acceptance, "holds_out", lambda _judge, _start, fit: fit.found[-1].place != "first")
    base = explanation()
    judge = judge_of(base, lambda fit: -20.0 if fit.found[-1].place == "first" else -5.0)
    fits = tuple(explanation(h) for h in (("feed", "first"), ("feed", "second"), ("tank", "oil")))
    stage = Stage(scored=(), log_e_value=90.0, fits=fits, gains=(120.0, 60.0, 55.0))
    found = acceptance.judged(judge, base, stage, 10.0)
    assert found.accepted is not None and found.accepted.found[-1].label == "feed@second"
    assert [fit.found[-1].label for fit in found.fits] == ["feed@second", "tank@oil"]
    assert found.probabilities()[0] > 0.5
    # What they hold for as likely, and whose error is a little too large, stays one.
    close = acceptance.judged(judge_of(base, -5.0), base, stage, 10.0)
    assert close.accepted is not None and close.accepted.labels == ("feed@second",)
    assert [fit.found[-1].label for fit in close.fits] == ["feed@first", "feed@second", "tank@oil"]
    # An open form beside which a name is next to impossible: it has none.
    for ahead, of_ahead, given in (
        ("feed", 13.0, True),
        ("open_standstill", -20.0, True),
        ("open_standstill", 13.0, False),
    ):
        held = {"first": of_ahead, "oil": 15.0}
        speaks = judge_of(base, lambda fit, held=held: held[fit.found[-1].place])
        two = replace(stage, fits=(explanation((ahead, "first")), fits[2]), gains=(120.0, 55.0))
        tank = acceptance.judged(speaks, base, two, 10.0)
        assert (tank.accepted is not None) is given
        assert given or "has no name" in tank.note
    # But not where something else is far more probable than that place.
    rather = acceptance.judged(
        judge, base, replace(stage, fits=(fits[0], fits[2], fits[1]), gains=(120.0, 55.0, 25.0)), 10.0
    )
    assert rather.accepted is None
    others = replace(stage, fits=(fits[0], fits[2]), gains=(120.0, 55.0))
    refused = acceptance.judged(judge, base, others, 10.0)
    assert refused.accepted is None and "held-out data worse" in refused.note


@pytest.mark.parametrize(("less", "at_once"), [(60.0, False), (119.0, True)])
def test_what_promises_has_its_chance_before_anything_less_likely(
    monkeypatch: pytest.MonkeyPatch, less: float, at_once: bool
) -> None:
    """An effect that needs a second one beside it, and a fault that does not: that one stands if none is found."""
    base = Explanation(problem=NOTHING, fit=NOTHING, log_evidence=0.0)
    wear, fault = (replace(base, found=(scored_as(name, "x", 0.0).hypothesis,)) for name in ("wear", "fault"))
    monkeypatch.setattr(acceptance, "_matters", lambda *_: True)
    monkeypatch.setattr(acceptance, "holds_out", lambda _judge, _start, fit: fit.labels == fault.labels)
    stage = Stage(scored=(), log_e_value=90.0, fits=(wear, fault), gains=(120.0, less))
    found = acceptance.judged(judge_of(base, 400.0), base, stage, 10.0)
    assert found.accepted is not None and found.accepted.labels == (fault if at_once else wear).labels
    assert found.tentative is not at_once and [fit.labels for fit in found.fits] == [wear.labels, fault.labels]
    monkeypatch.setattr(search, "first", lambda _: base)
    monkeypatch.setattr(search, "candidates_of", lambda *_: ())
    monkeypatch.setattr(search, "floored", lambda fit: fit)
    monkeypatch.setattr(search, "_others", lambda *_: [])
    nothing_more = Stage(scored=(), log_e_value=0.0)
    coming = iter((found, nothing_more, nothing_more))
    monkeypatch.setattr(search, "_look", lambda *_: next(coming))
    assert search.search(NOTHING, {}).final.labels == fault.labels


def test_what_is_likely_and_too_small_is_not_told_as_something_unlikely_and_large(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    nothing = NOTHING
    here, there, before = (
        Explanation(problem=nothing, fit=nothing, log_evidence=0.0, found=(scored_as(name, place, 0.0).hypothesis,))
        for name, place in (("valve", "air"), ("valve", "outdoor"), ("cooler", "air"))
    )
    monkeypatch.setattr(acceptance, "holds_out", lambda *_: True)
    monkeypatch.setattr(
        acceptance, "_matters", lambda _case, _fit, h, _times=1.0: h.place == "outdoor" or h is before.found[0]
    )
    for gains, accepted in (((120.0, 70.0), None), ((120.0, 119.0), there)):
        stage = Stage(scored=(), log_e_value=90.0, fits=(here, there), gains=gains)
        found = acceptance.judged(judge_of(before, 40.0), replace(before, found=()), stage, 10.0).accepted
        assert (found.found if found is not None else None) == (accepted.found if accepted is not None else None)


@pytest.mark.parametrize(("holds", "named"), [(True, None), (False, "heater@oil")])
def test_what_is_too_small_and_refused_hides_nothing(
    monkeypatch: pytest.MonkeyPatch, *, holds: bool, named: str | None
) -> None:
    """A lag that nobody would notice is ahead of a heater: only if the held-out recordings hold it is that the end."""
    cooler, lag, heater = (scored_as(n, "oil", 0.0).hypothesis for n in ("cooler", "lag", "heater"))
    base, small, large = (
        Explanation(problem=NOTHING, fit=NOTHING, log_evidence=0.0, found=found)
        for found in ((cooler,), (cooler, lag), (cooler, heater))
    )
    monkeypatch.setattr(acceptance, "holds_out", lambda _judge, _start, fit: holds or fit.found[-1] is not lag)
    monkeypatch.setattr(acceptance, "_matters", lambda _case, _fit, h, _times=1.0: h is not lag)
    stage = Stage(scored=(), log_e_value=90.0, fits=(small, large), gains=(300.0, 217.0))
    accepted = acceptance.judged(judge_of(base, 40.0), replace(base, found=()), stage, 10.0).accepted
    assert (accepted.labels[-1] if accepted is not None else None) == named


@pytest.mark.parametrize(("z", "away"), [(9.0, True), (7.0, False)])
def test_an_explanation_that_sends_a_capacity_away_is_none(
    fzg: Gearbox, problem: Problem, z: float, away: bool
) -> None:
    (h, *_) = (hypothesis_of(lag) for lag in CATALOGUE["sensor_lag"].placed(fzg.network(), Scale.of(fzg), CHANNELS))
    assert h.term is not None
    own = [Unknown(role="term", target=p.name, parameter=p) for p in h.term.parameters]

    def explanation(found: Any, *shifts: tuple[str, float]) -> Explanation:
        items = (*problem.unknowns.items, *(own if found else ()))
        at = np.zeros(len(items))
        for target, value in shifts:
            at[[i.target for i in items].index(target)] = value
        fit: Any = SimpleNamespace(unknowns=Unknowns(items), z=at)
        return Explanation(problem=problem, fit=fit, log_evidence=0.0, found=found)

    base = explanation(())
    assert acceptance._drives_away(base, explanation((h,), ("C_oil", -z))) is away
    assert not acceptance._drives_away(explanation((), ("C_oil", -z)), explanation((h,), ("C_oil", -z - 1.0)))
    for item in own:
        assert not acceptance._drives_away(base, explanation((h,), (item.target, z)))


def test_what_is_too_small_to_matter_shapes_nothing_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    base = Explanation(problem=NOTHING, fit=NOTHING, log_evidence=0.0)
    small = replace(base, found=(scored_as("lag", "oil", 0.0).hypothesis,))
    first = Stage(scored=(), log_e_value=90.0, fits=(small,), gains=(120.0,), accepted=small, matters=False)
    end = Stage(scored=(), log_e_value=0.0)
    monkeypatch.setattr(search, "first", lambda _: base)
    monkeypatch.setattr(search, "candidates_of", lambda *_: ())
    monkeypatch.setattr(search, "floored", lambda fit: fit)
    monkeypatch.setattr(search, "_needed_of", lambda _judge, _start, accepted: accepted)
    for matters in (True, False):
        coming = iter((replace(first, matters=matters), end))
        monkeypatch.setattr(search, "_look", lambda *_, coming=coming: next(coming))
        found = search.search(NOTHING, {})
        assert found.detected is matters
        assert (found.final is small) is matters and (found.final is found.calibrated) is not matters
        assert found.judge.base is found.final and len(found.findings) == int(matters)


def test_names_share_their_weight_among_their_places() -> None:
    nothing = [scored_as("a", str(i), 0.0) for i in range(7)] + [scored_as("water_jacket", "x", 0.0)]
    assert log_e_value(nothing) == pytest.approx(0.0)
    many = [scored_as("a", "0", 12.0), *(scored_as("a", str(i), 0.0) for i in range(1, 7)), scored_as("b", "", 0.0)]
    one = [scored_as("a", "0", 0.0), *(scored_as("a", str(i), 0.0) for i in range(1, 7)), scored_as("b", "", 12.0)]
    assert log_e_value(one) - log_e_value(many) == pytest.approx(np.log(7.0), abs=0.01)
    # One parameter far off is no less likely because there are many.
    others = [scored_as("a", "0", 0.0), scored_as("parameter", "mesh", 12.0)]
    more = [scored_as("parameter", str(i), -50.0) for i in range(8)]
    assert log_e_value(others) - log_e_value([*others, *more]) == pytest.approx(np.log(10.0 / 2.0), abs=0.01)


def test_what_one_place_found_is_tried_at_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    nothing: Any = None
    fit: Any = SimpleNamespace(z=np.array([1.0, 2.0]), courses=("course",), without_parts=lambda: fit)

    def explanation(name: str, place: str, log_evidence: float) -> Explanation:
        h = replace(scored_as(name, place, 0.0).hypothesis, variants=np.ones((3, 2)))
        return Explanation(problem=nothing, fit=fit, found=(h,), log_evidence=log_evidence)

    tried: list[tuple[str, Any]] = []

    def better(there: Explanation, z: Array, guesses: Any, _: int) -> Explanation:
        tried.append((there.found[-1].label, guesses))
        assert z is fit.z
        return replace(there, log_evidence=70.0)

    monkeypatch.setattr(explain, "_better", better)
    fits = [explanation("rain", "upper", 50.0), explanation("rain", "lower", 10.0), explanation("sun", "lower", 20.0)]
    found = explain._elsewhere(fits, 1)
    assert [e.log_evidence for e in found] == [50.0, 70.0, 20.0]
    assert tried == [("rain@lower", ("course",))]
    # Beside another explanation there are other unknowns: nothing to start from.
    elsewhere = replace(fits[1], found=(fits[2].found[-1], fits[1].found[-1]))
    assert [e.log_evidence for e in explain._elsewhere([fits[0], elsewhere], 1)] == [50.0, 10.0]
    assert len(tried) == 1
