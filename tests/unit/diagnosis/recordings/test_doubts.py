"""Notes on recordings that can be read, but are probably not meant so; a sound one has none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.recordings.read import read_recordings
from models.assembly.gearbox import Gearbox

TIME = 10.0 * np.arange(400)
NUMBERS = np.arange(400)


def table() -> pd.DataFrame:
    warm = 40.0 * (1.0 - np.exp(-TIME / 1500.0))
    return pd.DataFrame({
        "time_s": TIME, "speed_rpm": 1500.0, "torque_Nm": 94.0, "T_ambient_degC": 22.0, "T_oil_degC": 22.0 + warm,
        "T_pinion_degC": 23.0 + 1.1 * warm, "P_loss_W": 300.0,
    })  # fmt: skip


def notes(folder: Path, machine: Gearbox, source: pd.DataFrame) -> tuple[str, ...]:
    source.to_csv(folder / "run.csv", index=False)
    return read_recordings(folder / "run.csv", machine)[0].notes


def in_degF(source: pd.DataFrame) -> pd.DataFrame:
    return source.assign(**{name: source[name] * 1.8 + 32.0 for name in source if str(name).endswith("degC")})


def with_thermometer(first: float) -> pd.DataFrame:
    """With two more thermometers, of which one begins at a given temperature."""
    source = table()
    return source.assign(T_bearing_1_degC=source["T_oil_degC"], T_bearing_2_degC=source["T_oil_degC"] - 22.0 + first)


SWAPPED = {"T_oil_degC": "T_ambient_degC", "T_ambient_degC": "T_oil_degC"}
DOUBTS: dict[str, tuple[pd.DataFrame, str]] = {
    "degF": (in_degF(table()), "T_ambient_degC: 72 degC on average is hot for ambient air"),
    "degF, no ambient": (in_degF(table()).drop(columns="T_ambient_degC"),
                         'all temperatures begin at 72 to 73 degC, alike as in a machine that has cooled'),
    "oil alone in degF": (with_thermometer(22.0).assign(T_oil_degC=in_degF(table())["T_oil_degC"]),
                          "T_oil_degC is 73 K above the other thermometers, and 0.0 K off them if it is in degF"),
    "oil and ambient swapped": (table().rename(columns=SWAPPED),
                                "T_oil_degC is 26 K below T_ambient_degC on average, although a gearbox gives heat"),
    "torque in kN m": (table().assign(torque_Nm=0.094),
                       "P_loss_W is 300 W on average, but speed_rpm and torque_Nm give 14.8 W"),
    "loss in kW": (table().assign(P_loss_W=0.3),
                   "P_loss_W is 0.3 W on average, but speed_rpm and torque_Nm give 1.48e+04 W"),
    "a wrong thermometer": (with_thermometer(25.0), "T_bearing_2_degC begins 2.5 K above the other thermometers"),
    "a torque meter's zero": (table().assign(speed_rpm=np.where(NUMBERS < 300, 1500.0, 0.0),
                                             torque_Nm=np.where(NUMBERS < 300, 86.0, -8.0)),
                              "torque_Nm is -8 N m in the rows at rest: if nothing loads the shaft there"),
    "minutes": (table().assign(time_s=TIME / 60.0), "time_s goes over 66.5 s, in which T_oil_degC moves by"),
    "hours": (table().assign(time_s=TIME / 3600.0), "if it counts minutes or hours, name its unit in a mapping"),
    "milliseconds": (table().assign(time_s=1e3 * NUMBERS), "if it counts milliseconds"),
    "a code in many rows": (table().assign(torque_Nm=np.where((NUMBERS > 99) & (NUMBERS < 150), -9999.0, 94.0)),
                            "torque_Nm: -9999 N m and the like in rows 101-150; 99% of the others are within 94"),
}  # fmt: skip


@pytest.mark.parametrize("case", DOUBTS)
def test_a_doubt_is_the_first_note(tmp_path: Path, fzg: Gearbox, case: str) -> None:
    source, says = DOUBTS[case]
    assert says in notes(tmp_path, fzg, source)[0]


@pytest.mark.parametrize("source", [
    table(), table().drop(columns="T_ambient_degC"),
    table().assign(time_s=600.0 * NUMBERS),  # of a plant's records
    table().assign(T_oil_degC=80.0, T_pinion_degC=110.0).drop(columns="T_ambient_degC"),  # begun at work
    table().assign(T_oil_degC=51.0 + NUMBERS / 100.0, T_pinion_degC=52.0 + NUMBERS / 100.0),  # begun warm, in cool air
    with_thermometer(23.0), with_thermometer(45.0),  # 1 K off; preheated
    table().assign(torque_Nm=1.0), table().assign(torque_Nm=0.0),  # without load
    table().assign(speed_rpm=np.where(NUMBERS < 300, 1500.0, 0.0)),  # clamped
    table().assign(speed_rpm=0.0, torque_Nm=0.0),
])  # fmt: skip
def test_a_sound_recording_raises_none(tmp_path: Path, fzg: Gearbox, source: pd.DataFrame) -> None:
    assert all("was not recorded" in note for note in notes(tmp_path, fzg, source))


def test_a_tolerance_that_is_stated_is_not_asked_for(tmp_path: Path, fzg: Gearbox) -> None:
    column = '[columns.T_bearing_2_degC]\nquantity = "T_bearing_2"\nbias_sd = 3.0\n'
    (tmp_path / "run.toml").write_text(f"schema = 1\n{column}", encoding="utf-8")
    assert all("bias_sd" not in note for note in notes(tmp_path, fzg, with_thermometer(25.0)))


def test_a_start_far_beyond_the_stated_tolerance_is_a_doubt(tmp_path: Path, fzg: Gearbox) -> None:
    column = '[columns.T_bearing_2_degC]\nquantity = "T_bearing_2"\nbias_sd = 0.2\n'
    (tmp_path / "run.toml").write_text(f"schema = 1\n{column}", encoding="utf-8")
    first = notes(tmp_path, fzg, with_thermometer(25.0))[0]
    assert "T_bearing_2_degC begins 2.5 K above the other thermometers" in first
    assert "far more than its tolerance, a bias_sd of 0.2 K" in first
