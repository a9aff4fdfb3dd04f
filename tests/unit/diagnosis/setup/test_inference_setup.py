"""Setting up the inference: what is learnt from never holds a reading of what is judged by."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from diagnosis.engine.fit import calibrate
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.recordings.recording import Channel, Recording
from diagnosis.setup.inference_setup import HELD_OUT_SHARE, START_S, first_part, last_part
from models.assembly.gearbox import Gearbox
from models.files.cycle import Cycle

CHANNELS = ("oil", "housing_lower")


@pytest.fixture(scope="module")
def recordings(fzg: Gearbox) -> tuple[Recording, Recording]:
    """Two rides of an hour, every 20 s."""
    made = []
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        time = np.arange(0.0, 3601.0, 20.0)
        step = (time // 600.0).astype(int)
        inputs = {
            "speed": rng.uniform(800.0, 3000.0, step.max() + 1)[step],
            "torque": rng.uniform(40.0, 200.0, step.max() + 1)[step],
            "T_ambient": np.full(len(time), 22.0), "air_speed": np.full(len(time), 2.0),
        }  # fmt: skip
        cycle = Cycle(time=time, inputs=inputs)
        result = fzg.network().simulate(cycle, losses=fzg.losses(), initial=25.0).temperatures
        channels = tuple(Channel(name=n, values=result[n] + 0.2 * rng.normal(size=len(time))) for n in CHANNELS)
        made.append(Recording(
            name=f"ride_{seed}", path=Path(f"ride_{seed}.csv"), time=time, inputs=inputs,
            channels=channels, segments=(slice(0, len(time)),),
        ))  # fmt: skip
    return made[0], made[1]


def hotter(recording: Recording) -> Recording:
    return replace(recording, channels=tuple(replace(c, values=c.values + 5.0) for c in recording.channels))


def test_readings_held_out_do_not_touch_what_is_learnt(fzg: Gearbox, recordings: tuple[Recording, Recording]) -> None:
    train, hold = recordings
    (one, mine), (other, theirs) = (prepare_experiment(fzg, [train], [held]) for held in (hold, hotter(hold)))
    assert [p.recording for p in one.learnt] == ["ride_1"]
    assert [p.recording for p in one.held_out] == ["ride_2"]
    for a, b in zip(one.learnt, other.learnt, strict=True):
        np.testing.assert_array_equal(a.measured, b.measured)
    assert not np.array_equal(one.held_out[0].measured, other.held_out[0].measured)
    np.testing.assert_array_equal(calibrate(mine).z, calibrate(theirs).z)


def test_without_a_held_out_recording_the_last_quarter_is_held_out(
    fzg: Gearbox, recordings: tuple[Recording, Recording]
) -> None:
    case, _ = prepare_experiment(fzg, [recordings[0]])
    (learnt,), (judged,) = case.learnt, case.held_out
    time, read = learnt.time, np.isfinite(learnt.measured).all(axis=1)
    late = time > time[0] + (1.0 - HELD_OUT_SHARE) * (time[-1] - time[0])
    assert pytest.approx(0.25) == HELD_OUT_SHARE and 0.2 < late.mean() < 0.3
    assert np.isnan(learnt.measured[late]).all() and read[~late].all()
    early = time <= time[0] + START_S
    seen = np.isfinite(judged.measured).all(axis=1)
    np.testing.assert_array_equal(seen, late | early)
    assert 0.0 < early.mean() < 0.4


def test_splitting_leaves_the_given_pieces_alone(fzg: Gearbox, recordings: tuple[Recording, Recording]) -> None:
    whole = prepare_experiment(fzg, [recordings[0]], [recordings[1]])[0].learnt
    before = whole[0].measured.copy()
    first_part(whole[0]), last_part(whole[0])
    np.testing.assert_array_equal(whole[0].measured, before)
