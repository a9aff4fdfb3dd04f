"""Notes on baselines."""

from __future__ import annotations

from diagnosis.results.baseline_notes import baselines_told


def test_an_effect_that_acts_in_the_baselines_is_noted() -> None:
    assert not baselines_told(2.0, {}, "a drift")
    (note,) = baselines_told(20.0, {}, "a drift")
    assert "show a drift too (evidence 20 nats)" in note


def test_a_session_of_another_machine_is_noted() -> None:
    (note,) = baselines_told(0.0, {"april": 10.0, "may": -5.0})
    assert note.startswith("Session 'april' looks like another machine")
