"""Notes on baselines, and on unknowns at their limits."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.answer import Answer
from diagnosis.decision.posterior import Assumed, Judged, Placebo
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.results import notes
from diagnosis.results.notes import limit_notes
from models.assembly.gearbox import Gearbox
from tests.unit.diagnosis.inference_example import recorded
from tests.unit.diagnosis.results.assembled_example import Prepared, posterior_of


@pytest.fixture
def noted(
    prepared: Prepared, windage: Judged, monkeypatch: pytest.MonkeyPatch
) -> Callable[..., tuple[str, ...]]:  # fmt: skip
    """Notes on a baseline, where windage is the answer."""
    _, experiment, plain = prepared
    answers = [Answer(best=windage, effect=windage.effects[0], grade="claim", probability=0.95, joint=0.95)]

    def notes_of(
        *judged: Judged, acting: float = 0.0, apart: Mapping[str, float] | None = None, threshold: float = 4.0,
        **given: Any,
    ) -> tuple[str, ...]:  # fmt: skip
        monkeypatch.setattr(notes, "evidence_in_baselines", lambda *_: acting)
        monkeypatch.setattr(notes, "sessions_apart", lambda _: dict(apart or {}))
        posterior = replace(posterior_of(plain, *judged, **given), threshold=threshold)
        return tuple(notes.baseline_notes(replace(experiment, healthy=frozenset({"april"})), posterior, answers))

    return notes_of


@pytest.mark.parametrize(
    ("air_degC", "read"), [((19.0, 18.6), "3.0 to 3.4 K above"), ((19.0, 22.0), ""), ((21.0, 21.0), "")]
)
def test_air_that_no_cold_machine_has_is_noted(fzg: Gearbox, air_degC: tuple[float, float], read: str) -> None:
    """A machine that has not been at rest for long enough is off in some recordings alone."""
    made = [recorded(fzg, name, hours=0.5) for name in ("monday", "tuesday")]
    recordings = [
        replace(one, inputs={**one.inputs, "T_ambient": np.full(len(one.time), air)})
        for one, air in zip(made, air_degC, strict=True)
    ]
    _, experiment = prepare_experiment(fzg, recordings)
    told = list(notes.air_notes(experiment))
    assert len(told) == bool(read) and all(read in note for note in told)


def test_an_effect_that_acts_in_the_baselines_is_noted(noted: Callable[..., tuple[str, ...]]) -> None:
    assert not noted(acting=2.0)
    (note,) = noted(acting=20.0)
    assert "show windage too (evidence 20 nat)" in note


def test_a_session_of_another_machine_is_noted(noted: Callable[..., tuple[str, ...]]) -> None:
    (note,) = noted(apart={"april": 10.0, "may": -5.0})
    assert note.startswith("Session 'april' looks like another machine")


def test_a_baseline_that_brings_evidence_is_noted(noted: Callable[..., tuple[str, ...]]) -> None:
    damage = Placebo(session="april", log_e_value=50.6, mechanism="bearing_damage", place="bearing_1")
    (note,) = noted(assumed=Assumed(placebo=damage), threshold=50.6)
    assert note.startswith(
        "In the baseline 'april' nothing is wrong, but the same test finds 51 nat in it (bearing_damage"
    )
    assert not noted(assumed=Assumed(placebo=damage), threshold=60.0)  # that is not what it has to reach


def test_what_a_baseline_takes_from_a_change_is_noted(noted: Callable[..., tuple[str, ...]], windage: Judged) -> None:
    step = Hypothesis(name="air_cooling_step", place="air", family="heat", law="air_cooling",
                      variants=np.ones((1, 1)), ending="step", less=95.0)  # fmt: skip

    def behind(taken: float) -> Judged:
        return replace(windage, effects=(replace(step, less=taken),), log_bayes=20.0, fit=None)

    (note,) = noted(windage, behind(95.0))
    assert note.startswith("A baseline, in which nothing changed, seems to show air_cooling_step as well: 95 nat of it")
    assert noted(windage, behind(60.0)) == ()  # behind all the same
    assert noted(behind(4.0)) == ()  # as much comes by chance


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
    # A share may be whole, and what is held is no unknown.
    for other in (
        {"lower": 0.0, "upper": 1.0, "log": False, "start": 1.0},
        {"sd": 0.0, "start": unknowns[high].parameter.upper},
    ):
        p = replace(unknowns[high].parameter, **other)
        one_other = tuple(replace(u, parameter=p) if u is unknowns[high] else u for u in unknowns)
        at_limits = z.copy()
        at_limits[low] = 0.0
        there = replace(plain.experiment, unknowns=one_other)
        assert limit_notes(replace(plain, experiment=there, z=at_limits)) == ()
