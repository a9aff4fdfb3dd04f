"""What held-out recordings take back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import hypothesis_of
from diagnosis.decision.posterior import Judged
from diagnosis.engine.learnt import error_classes
from diagnosis.results.held_out import _switches_for_nothing
from models.assembly.gearbox import Gearbox
from models.mechanisms import CATALOGUE, Scale
from tests.unit.diagnosis.diagnosis_example import consistent


@pytest.mark.parametrize(("name", "after_K", "for_nothing"), [
    ("fan_thermostat", 0.48, True), ("fan_thermostat", 0.40, False), ("windage", 0.48, False),
    ("fan_thermostat", np.nan, False),  # nothing is held out
])  # fmt: skip
def test_a_control_that_switches_has_to_bring_held_out_temperatures_nearer(
    fzg: Gearbox, name: str, after_K: float, for_nothing: bool
) -> None:
    """A spray that comes and goes looks like a fan where it is learnt."""
    scale = Scale.of(fzg, speed=3300.0, torque=150.0)
    effect = hypothesis_of(CATALOGUE[name].placed(fzg.network(), scale)[0])
    judged = Judged(effects=(effect,), log_bayes=90.0, error_class=error_classes()[0])
    holdout = replace(consistent().holdout, calibrated=0.413, after=after_K)
    assert _switches_for_nothing(judged, holdout) == for_nothing
