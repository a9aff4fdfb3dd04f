"""Sessions of recordings, and which baselines are refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from diagnosis.recordings.recording import Recording
from diagnosis.setup.sessions import check_baselines, session_by_recording
from models.base.errors import InputError
from models.base.types import Array
from tests.unit.diagnosis.inference_example import recording_of

CATALOGUE = ("windage", "pocketing")


@pytest.fixture(scope="module")
def made(ride: dict[str, Array]) -> Recording:
    return recording_of(ride, {"oil": np.full(len(ride["time_s"]), 40.0)})


def named(made: Recording, name: str, **changes: Any) -> Recording:
    return replace(made, name=name, sha256=name, **changes)


def test_every_file_of_baselines_is_a_session_and_all_else_is_one(made: Recording) -> None:
    train, held = named(made, "train"), named(made, "hold")
    april, may = named(made, "april"), named(made, "may")
    found = session_by_recording([train], [held], [april, may])
    assert found == {"train": "", "hold": "", "april": "april", "may": "may"}


def test_parts_of_one_file_are_one_session(made: Recording) -> None:
    train, early = named(made, "train"), replace(made, name="early", sha256="train")
    one, two = named(made, "one"), replace(made, name="two", sha256="one")
    assert session_by_recording([train], (), [early, one, two]) == {
        "train": "",
        "early": "",
        "one": "one",
        "two": "one",
    }


def test_what_a_mapping_states_comes_first(made: Recording) -> None:
    train, late = named(made, "train"), named(made, "late", session="autumn")
    one, two = named(made, "one", session="spring"), named(made, "two", session="spring")
    part = replace(made, name="part", sha256="one")
    assert session_by_recording([train, late], (), [one, two, part]) == {
        "train": "", "late": "autumn", "one": "spring", "two": "spring", "part": "spring",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("channels", "off", "message"),
    [
        (
            ("pinion",),
            (),
            r"made.csv: is a baseline, but measures T_pinion and nothing that the recordings do \(T_oil\)",
        ),
        (("oil", "pinion"), ("windge",), "--switched-off windge: is not in the catalogue; did you mean 'windage'"),
        ((), ("windage",), "--switched-off windage: is about baselines, but there are none"),
    ],
)
def test_refused(channels: tuple[str, ...], off: tuple[str, ...], message: str, made: Recording) -> None:
    ride = {"time_s": made.time, "speed_rpm": made.inputs["speed"], "torque_Nm": made.inputs["torque"],
            "T_ambient_degC": made.inputs["T_ambient"]}  # fmt: skip
    baseline = [recording_of(ride, {c: np.full(len(made.time), 30.0) for c in channels})] if channels else []
    with pytest.raises(InputError, match=message):
        check_baselines([made], baseline, off, catalogue=CATALOGUE)


def test_accepted(made: Recording) -> None:
    check_baselines([made], [], (), catalogue=CATALOGUE)
    check_baselines([made], [named(made, "other")], ("windage",), catalogue=CATALOGUE)
