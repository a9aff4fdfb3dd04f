"""Notes on baselines, and on unknowns at their limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.posterior import Placebo
from diagnosis.results.notes import baselines_told, limit_notes
from tests.unit.diagnosis.results.assembled_example import Prepared


def test_an_effect_that_acts_in_the_baselines_is_noted() -> None:
    assert not baselines_told(2.0, {}, "a drift")
    (note,) = baselines_told(20.0, {}, "a drift")
    assert "show a drift too (evidence 20 nat)" in note


def test_a_session_of_another_machine_is_noted() -> None:
    (note,) = baselines_told(0.0, {"april": 10.0, "may": -5.0})
    assert note.startswith("Session 'april' looks like another machine")


def test_a_baseline_that_brings_evidence_is_noted() -> None:
    damage = Placebo(session="april", log_e_value=50.6, mechanism="bearing_damage", place="bearing_1")
    (note,) = baselines_told(0.0, {}, placebo=damage)
    assert note.startswith(
        "In the baseline 'april' nothing is wrong, but the same test finds 51 nat in it (bearing_damage"
    )


def test_what_a_baseline_takes_from_a_change_is_noted() -> None:
    step = Hypothesis(name="air_cooling_step", place="air", family="heat", law="air_cooling",
                      variants=np.ones((1, 1)), how="from_date", less=95.0)  # fmt: skip
    (note,) = baselines_told(0.0, {}, ahead=step)
    assert note.startswith("A baseline, in which nothing changed, seems to show air_cooling_step as well: 95 nat of it")
    assert baselines_told(0.0, {}, ahead=replace(step, less=4.0)) == ()
    assert baselines_told(0.0, {}, ahead=step, counts_from=100.0) == ()  # as much comes by chance


def test_unknowns_at_their_limits_are_no_estimates(prepared: Prepared) -> None:
    plain = prepared[2]
    unknowns = plain.experiment.unknowns
    assert limit_notes(plain) == ()
    low, high = (next(i for i, u in enumerate(unknowns) if u.parameter.name == name) for name in ("bias_oil", "h_air"))
    z = plain.z.copy()
    z[low] = unknowns[low].z_of(unknowns[low].parameter.lower)
    (one,) = limit_notes(replace(plain, z=z))
    assert one.startswith("in the corrected model bias_oil = ") and "K is at its limit and stands in" in one
    z[high] = unknowns[high].z_of(unknowns[high].parameter.upper)
    (both,) = limit_notes(replace(plain, z=z))
    assert "are at their limits" in both and "h_air = " in both
    whole = replace(unknowns[high].parameter, lower=0.0, upper=1.0, log=False, start=1.0)
    assert (
        limit_notes(
            replace(
                plain,
                experiment=replace(
                    plain.experiment,
                    unknowns=tuple(replace(u, parameter=whole) if u is unknowns[high] else u for u in unknowns),
                ),
            )
        )
        == ()
    )  # a share may be whole
