"""Broken sensors from their recordings to the diagnosis."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from diagnosis.diagnose_recordings import diagnose
from diagnosis.recordings.recording import Recording
from diagnosis.results.result import Diagnosis
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.mechanisms import CATALOGUE
from tests.unit.diagnosis.inference_example import recorded

TRIED = (
    "sensor_stuck", "sensor_bias", "sensor_gain", "sensor_drift", "sensor_lag", "swapped_channels", "clock_offset",
    "windage", "pump_heat", "foundation_conduction", "oil_loss",
)  # fmt: skip
NODES = ("oil", "housing_lower", "housing_upper", "bearing_1", "pinion")


def with_broken(made: Recording, channel: str, broken: Callable[[Array, Array], Array]) -> Recording:
    channels = (replace(c, values=broken(made.time, c.values)) if c.name == channel else c for c in made.channels)
    return replace(made, channels=tuple(channels))


@pytest.fixture(scope="module")
def hanging(fzg: Gearbox) -> Diagnosis:
    """The oil's thermometer hangs in the first recording from 1 h on; in the others it is sound."""
    first, second, held = (recorded(fzg, name, hours=hours, seed=seed, nodes=NODES)
                           for seed, (name, hours) in enumerate((("a", 3.0), ("b", 2.0), ("c", 2.0))))  # fmt: skip
    hangs = with_broken(first, "oil", lambda time, T: np.where(time < 3600.0, T, T[360]))
    return diagnose([hangs, second], fzg, holdout=[held], catalogue={name: CATALOGUE[name] for name in TRIED})


def test_a_sensor_that_hangs_in_one_recording_is_held_in_that_one(hanging: Diagnosis) -> None:
    (finding,) = hanging.findings
    assert hanging.verdict == "sensor_fault" and not hanging.contradicted
    assert (finding.mechanism, finding.place, finding.grade) == ("sensor_stuck", "oil", "claim")
    assert finding.says == (
        "From 1.01 to 2.99 h after the first row of the first recording: the reading of oil stands still."
    )


def test_a_faulty_channel_has_no_say_in_the_calibrated_machine(hanging: Diagnosis) -> None:
    assert hanging.faulty == ("oil",)
    assert hanging.holdout.calibrated < 0.1  # the noise of a row of the others
