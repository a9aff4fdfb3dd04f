"""The assembled diagnosis: ranking, verdict, places, calibration, remaining misfit."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from diagnosis.candidates.explain import Explanation
from diagnosis.decision.stage import Stage
from diagnosis.inference.posterior import Problem
from diagnosis.results import assemble
from models.assembly.gearbox import Gearbox
from tests.unit.diagnosis.inference_example import NOTHING, scored_as


def test_the_ranking_holds_everything_that_was_scored() -> None:
    """Fitted ones by their fits, also where those were refused; the rest by the scan; of open forms those fitted."""
    scores = (("fan", 40.0), ("tank", 30.0), ("wear", 9.0), ("feed", -2.0))
    fan, tank, wear, feed = (scored_as(name, "x", score) for name, score in scores)
    form = replace(fan, hypothesis=replace(fan.hypothesis, name="open_speed", family="open form"))
    fits = tuple(
        Explanation(problem=NOTHING, fit=NOTHING, log_evidence=0.0, found=(s.hypothesis,)) for s in (tank, fan)
    )
    stage = Stage(
        scored=(fan, form, tank, wear, feed), log_e_value=20.0, fits=fits, gains=(55.0, 35.0),
        fitted={"tank@x": 55.0, "fan@x": 35.0, "wear@x": 44.0},
    )  # fmt: skip
    search_found: Any = SimpleNamespace(stages=[stage])
    ranked = assemble._ranking(search_found)
    reported = [(r.mechanism, r.log_bayes) for r in ranked]
    assert reported == [("tank", 55.0), ("fan", 35.0), ("wear", 44.0), ("feed", -2.0)]
    assert ranked[0].probability == pytest.approx(stage.probabilities()[0])
    assert ranked[2].probability == ranked[3].probability == 0.0


@pytest.mark.parametrize(
    ("log_bayes", "heat_W", "says"),
    [(5.0, 50.0, "nothing that"), (90.0, 2.0, "nothing that"), (90.0, 50.0, "about 50 W"), (400.0, 2.0, "about 2 W")],
)
def test_what_remains_is_told_where_it_is_large_or_most_of_it(log_bayes: float, heat_W: float, says: str) -> None:
    def latent(log_bayes: float, heat_W: float) -> Any:
        return SimpleNamespace(log_bayes=log_bayes, mean=[np.full(9, heat_W)], node="oil")

    found: Any = SimpleNamespace(stages=[Stage(scored=(), log_e_value=0.0)])
    train = SimpleNamespace(pieces=[SimpleNamespace(steps=np.full(9, 20.0))])
    case: Any = SimpleNamespace(loss_W=300.0, train=train)
    first, remaining = [latent(1000.0, 80.0)], [latent(log_bayes, heat_W)]
    left = assemble._much_is_left(0.6, first, remaining)
    _, note = assemble._remaining(found, remaining, case, left=left, misfit=0.6, detected=True)
    assert says in note and "allow" not in note
    # What an unknown heat would not help, and is too large all the same, is never called nothing.
    _, note = assemble._remaining(found, remaining, case, left=True, misfit=1.7, detected=True)
    assert "1.7 times what noise and structural floor allow" in note and "nothing that" not in note


@pytest.mark.parametrize(("residual", "verdict"), [(0.8, "missing_physics"), (1.2, "unexplained")])
def test_what_leaves_more_than_noise_and_floor_is_no_explanation(residual: float, verdict: str) -> None:
    # Rows without a reading have nothing to say: they are neither in the sum nor in the count.
    white, read = np.append(np.full(50, residual), np.zeros(30)), np.append(np.ones(50), np.full(30, np.nan))
    parts = [SimpleNamespace(white_residual=sign * white, residual=read) for sign in (1.0, -1.0)]
    fit: Any = SimpleNamespace(parts=parts)
    misfit = Explanation(problem=NOTHING, fit=fit, log_evidence=0.0).misfit
    assert misfit == pytest.approx(residual**2)
    nothing: Any = None
    named: Any = SimpleNamespace(kind="source", family="heat path")
    left = assemble._much_is_left(misfit, (), ())
    assert assemble._verdict(nothing, [named], (), left=left, detected=True, catalogue={}) == verdict


def test_places_of_rivals_add_up_and_those_of_findings_do_not_exclude_one_another(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def look(*hypotheses: tuple[str, float]) -> Any:
        fits = [SimpleNamespace(found=[place]) for place, _ in hypotheses]
        return None, SimpleNamespace(fits=fits, probabilities=lambda: [p for _, p in hypotheses])

    monkeypatch.setattr(assemble, "node_in", lambda _network, place: place)
    monkeypatch.setattr(assemble, "_place", lambda _case, _found, _first, node, weight: (node, pytest.approx(weight)))
    two_coolers = look(("inlet", 0.6), ("inlet", 0.4))
    found: Any = SimpleNamespace(findings=[two_coolers, look(("air", 0.9), ("inlet", 0.09), ("oil", 0.01))])
    something: Any = [None]
    case: Any = SimpleNamespace(nominal=None)
    assert assemble._location(case, found, something, ()) == (("inlet", 1.0), ("air", 0.9))
    found.findings = [look(("inlet", 0.5), ("air", 0.5)), look(("air", 0.5), ("oil", 0.5))]
    assert assemble._location(case, found, something, ()) == (("air", 0.75), ("inlet", 0.5), ("oil", 0.5))


def test_a_place_tells_the_heat_of_all_that_was_found_there(monkeypatch: pytest.MonkeyPatch) -> None:
    hours = np.arange(40) * 360.0
    piece: Any = SimpleNamespace(
        inputs=np.zeros((40, 2)), middle=hours, steps=np.full(40, 360.0), recording="made", segment=0
    )
    part = SimpleNamespace(trajectory=SimpleNamespace(piece=piece, middle=np.full((40, 1), 60.0)))
    heats = {"rain": [np.full(40, -2.0)], "fan": [np.full(40, 35.0)], "bias": []}
    monkeypatch.setattr(assemble, "node_in", lambda _network, _h: "oil")
    monkeypatch.setattr(assemble, "heats_of", lambda _final, h: heats[h])
    case: Any = SimpleNamespace(nominal=SimpleNamespace(parts=[SimpleNamespace(name="oil")]))
    for found, heat in ((["rain", "fan"], 33.0), (["rain", "bias"], -2.0), (["bias"], 0.0)):
        final: Any = SimpleNamespace(found=found, fit=SimpleNamespace(parts=[part]))
        place = assemble._place(case, SimpleNamespace(final=final), (), "oil", 1.0)  # type: ignore[arg-type]
        assert place.heat_mean_W == pytest.approx(heat)


def test_a_parameter_found_far_off_is_told_by_the_prior_of_the_definition(fzg: Gearbox, problem: Problem) -> None:
    """It was fitted under a wider one."""
    index = next(i for i, item in enumerate(problem.unknowns.items) if item.target == "h_air")
    item = problem.unknowns.items[index]
    wide = problem.unknowns.with_prior(index, 4.0 * item.parameter.sd)
    z = np.zeros(len(wide))
    z[index] = 1.5
    fit: Any = SimpleNamespace(z=z, unknowns=wide, covariance=np.eye(len(z)))
    case: Any = SimpleNamespace(train=problem)
    final = Explanation(problem=problem, fit=fit, log_evidence=0.0)
    reported = {c.parameter: c for c in assemble._calibration(case, final)}
    assert reported["h_air"].value == pytest.approx(float(np.exp(6.0 * item.parameter.sd)))
    assert reported["h_air"].shift_in_sd == pytest.approx(6.0)
    assert reported["mesh"].shift_in_sd == 0.0


@pytest.mark.parametrize(("verdict", "assumed", "said"), [
    ("unexplained", {"T_ambient", "air_speed"}, "record T_ambient_degC"),
    ("unexplained", {"air_speed"}, "repeat the operation"),
    ("missing_physics", {"T_ambient"}, ""),
])  # fmt: skip
def test_an_ambient_that_was_not_recorded_is_the_first_thing_to_record(verdict, assumed, said) -> None:
    text = assemble._next_test(verdict, (), (), {}, assumed)
    assert text.startswith(said) and bool(text) == bool(said)
