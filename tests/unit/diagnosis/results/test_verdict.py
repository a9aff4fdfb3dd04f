"""The verdict where nothing is detected."""

from __future__ import annotations

from dataclasses import replace

import pytest

from diagnosis.decision.posterior import Judged, Posterior
from diagnosis.engine.learnt import error_classes, rule
from diagnosis.results.assemble import verdict_of
from diagnosis.results.first_screen import first_screen_of, verdict_text_of
from diagnosis.results.result_parts import Errors, Refuted, spoiled_in
from tests.unit.diagnosis.diagnosis_example import consistent


@pytest.mark.parametrize(("unfit", "badly", "verdict"), [
    (False, False, "consistent"), (True, False, "unexplained"), (False, True, "insufficient_data"),
    (True, True, "unexplained"),
])  # fmt: skip
def test_a_model_that_calibration_makes_worse_or_leaves_far_off_is_not_consistent(
    unfit: bool, badly: bool, verdict: str
) -> None:
    nothing = Judged(effects=(), log_bayes=0.0, error_class=error_classes()[0])
    silent = Posterior(nothing=nothing, judged=(), log_e=-2.0, threshold=10.0, class_threshold=5.0, rule=rule())
    assert verdict_of(silent, (), (), unfit=unfit, badly=badly) == verdict


def test_what_to_check_then_is_told() -> None:
    base = consistent()
    swapped = replace(base, verdict="unexplained", train=replace(base.train, before=3.94, calibrated=8.53))
    screen = dict(first_screen_of(swapped))
    (told,) = screen["Is something missing?"]
    assert "What?" not in screen and not any("nothing" in line for line in screen.get("How sure?", ()))
    assert verdict_text_of(swapped).startswith("The model cannot be brought to fit")
    assert told.startswith(
        "Yes: calibrated, the model is further from what it was learnt from (8.53 K) than as delivered"
    )
    assert "swapped or wrong columns" in told


def test_recordings_that_do_not_fit_one_machine_are_named() -> None:
    """As after a change: calibration makes those after it worse, and those before it better; baselines do not count."""
    base = consistent()
    train = replace(base.train, before=2.2, calibrated=1.9, recordings={
        "before": Errors(3.0, 1.0, 1.0), "after": Errors(1.0, 2.2, 2.2), "april": Errors(1.0, 9.0, 9.0)})  # fmt: skip
    holdout = replace(base.holdout, recordings={"held": Errors(1.0, 2.0, 2.0), "near": Errors(1.0, 1.9, 1.9)})
    spoiled = spoiled_in(train, holdout, baselines=["april"], least_K=0.95)
    assert spoiled == {"after": (1.0, 2.2), "held": (1.0, 2.0)}
    changed = replace(base, verdict="unexplained", train=train, spoiled=spoiled)
    (told,) = dict(first_screen_of(changed))["Is something missing?"]
    assert "further from after (2.20 K, 1.00 K as delivered), held (2.00 K, 1.00 K as delivered), closer" in told
    assert "They do not fit one machine" in told


def test_what_no_explanation_predicts_is_not_healthy() -> None:
    """A fan that switches by speed, which no catalogue has: 987 nat, taken back by the held-out recording."""
    base = consistent()
    taken_back = replace(
        base, verdict="unexplained", log_e_value=-10955.5, threshold=40.0, spoiled={},
        train=replace(base.train, before=5.24, calibrated=4.47), holdout=replace(base.holdout, calibrated=4.54),
        refuted=Refuted(names="cooler_shaft_driven at oil", log_e_value=987.2, log_score_gain=-11942.7),
    )  # fmt: skip
    told, back = dict(first_screen_of(taken_back))["Is something missing?"]
    assert told.startswith("Yes: calibrated, the model is 4.54 K off what was held out, and what explains the")
    assert "control of another kind" in told and "What was learnt from supports cooler_shaft_driven" in back
