"""Starts of recordings on their shared axis: by dates, else one after the other."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from diagnosis.recordings.recording import Recording
from diagnosis.setup.sessions import start_times
from tests.unit.diagnosis.inference_example import recording_of


def made(name: str, duration: float, at: float | None = None) -> Recording:
    time = np.linspace(0.0, duration, 11)
    columns = {"time_s": time, "speed_rpm": time, "torque_Nm": time, "T_ambient_degC": time}
    recording = replace(recording_of(columns, {}), name=name, sha256=name)
    if at is None:
        return recording
    return replace(recording, start=datetime.fromtimestamp(at, UTC), from_s=at)


def test_without_dates_they_follow_each_other() -> None:
    assert start_times([made("a", 100.0), made("b", 50.0), made("c", 10.0)]) == {"a": 0.0, "b": 100.0, "c": 150.0}


def test_dates_count_if_all_have_them() -> None:
    dated = [made("a", 100.0, 5000.0), made("b", 100.0, 1000.0)]
    assert start_times(dated) == {"a": 4000.0, "b": 0.0}
    assert start_times([*dated, made("c", 1.0)]) == {"a": 0.0, "b": 100.0, "c": 200.0}


def test_a_date_of_the_start_counts_where_times_begin_at_0() -> None:
    """As in MDF files."""
    first, second = (replace(made(name, 100.0, at), from_s=0.0) for name, at in (("a", 1000.0), ("b", 5000.0)))
    assert start_times([first, second]) == {"a": 0.0, "b": 4000.0}


def test_parts_of_a_file_without_dates_lie_as_in_it() -> None:
    """Whatever their order: what is held out may be from before what is learnt from."""
    late, early = (replace(made(name, 100.0), sha256="one file", from_s=at) for name, at in (("a", 700.0), ("b", 50.0)))
    assert start_times([late, early, made("c", 10.0)]) == {"a": 650.0, "b": 0.0, "c": 750.0}
