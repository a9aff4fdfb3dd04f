"""What is advised next."""

from __future__ import annotations

from dataclasses import replace

import pytest

from diagnosis.recordings.recording import Recording
from diagnosis.results.advice import data_sheet
from diagnosis.results.result_parts import Calibrated

OFF = Calibrated(parameter="bias_oil", prior=0.0, value=-1.6, stderr=0.1, estimate=-1.67, estimate_stderr=0.1,
                 shift_in_sd=-5.57, unit="K")  # fmt: skip


@pytest.mark.parametrize(("one", "told"), [
    (OFF, "state the tolerance of oil (bias_sd in the mapping; 0.3 K is assumed): it seems to read 1.67 K too little"),
    (replace(OFF, estimate=1.67, shift_in_sd=5.57), "too much"),
    (replace(OFF, shift_in_sd=-2.9), ""),  # as any sensor may be off
    (replace(OFF, parameter="h_air"), ""),  # no instrument
])  # fmt: skip
def test_a_sensor_that_is_far_off_is_looked_up(recorded: Recording, one: Calibrated, told: str) -> None:
    found = data_sheet([recorded], [one])
    assert told in found if told else not found


def test_a_tolerance_that_is_stated_is_not_asked_for(recorded: Recording) -> None:
    channels = tuple(replace(c, bias_sd=0.3) for c in recorded.channels)
    assert not data_sheet([replace(recorded, channels=channels)], [OFF])
