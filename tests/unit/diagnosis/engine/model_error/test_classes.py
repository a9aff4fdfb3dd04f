"""Classes of model error, and the groups that they find in machines of different kinds."""

from __future__ import annotations

from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from diagnosis.engine.fit import Experiment
from diagnosis.engine.learnt import ErrorClass, error_classes
from diagnosis.engine.model_error import ModelError
from diagnosis.engine.model_error.groups import GROUPS
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.recordings.read import read_recordings
from models.assembly.gearbox import load_gearbox
from tests.unit.diagnosis.inference_example import recording_of

DATA = Path(__file__).parents[5] / "examples" / "data"
BASE = ("a_loss", "a_link", "b_split", "c_sensor", "c_lag", "d_sub", "mass", "e_link", "f_input", "g_cap", "p_zero")
FINER = ("law_deg5", "loss_own", "lag", "hours")


def real(name: str, recording: str) -> Experiment:
    gearbox = load_gearbox(name)
    train = read_recordings([f"{DATA / recording}"], gearbox.network())
    return prepare_experiment(gearbox, train, train)[1]


@cache
def made(name: str) -> Experiment:
    gearbox, time = load_gearbox(name), np.arange(0.0, 7200.0, 10.0)
    columns = {"time_s": time, "speed_rpm": np.interp(time, [600, 4000], [900, 1500]),
               "torque_Nm": np.interp(time, [600, 5000], [10.0, 30.0]),
               "T_ambient_degC": np.full(len(time), 22.0)}  # fmt: skip
    result = gearbox.network().simulate(columns, losses=gearbox.losses(), initial=22.0).columns()
    recording = recording_of(columns, {"oil": result["T_oil_degC"], "P_loss": result["P_loss_W"]})
    return prepare_experiment(gearbox, [recording], [recording])[1]


def test_groups_of_machines_with_geometry() -> None:
    fzg, conveyor = (Counter(ModelError.of(made(name)).groups) for name in ("fzg", "conveyor"))
    assert tuple(fzg) == tuple(GROUPS) == (*BASE, *FINER)
    # 12 parts, 27 links that conduct, 9 sources in 5 families: sliding, rolling, churning, seals, bearings.
    assert fzg["a_loss"] == 19 + 19 + 9 + 9 + 19 + 2 + 4
    assert fzg["law_deg5"] == 3 * 36 + 2 * 11
    assert (fzg["g_cap"], fzg["d_sub"], fzg["c_sensor"], fzg["c_lag"]) == (12, 36, 5, 2)
    assert fzg["e_link"] == 12 * 11 // 2 - 25 + 12 - 2 + 1
    assert (fzg["lag"], fzg["hours"]) == (27 + 9, 27 + 9 + 9)
    assert tuple(conveyor) == tuple(fzg) and conveyor["g_cap"] == 13


def test_groups_of_a_machine_without_speed_torque_oil_and_losses() -> None:
    error = ModelError.of(real("heated_rod", "heated_rod.csv.gz@0..7200"))
    count = Counter(error.groups)
    assert set(GROUPS) - set(count) == {"p_zero", "mass"}  # random heat may last for hours
    # 23 links, 12 of them to air; 5 sources in 1 family; 13 thermometers at 12 parts.
    assert (count["a_loss"], count["e_link"], count["g_cap"]) == (3 + 5, 12 * 11 // 2 - 11, 12)
    assert (count["b_split"], count["c_lag"], count["lag"]) == (9, 26, 23 + 5)
    assert not any("speed" in label or "torque" in label for label in error.labels)


def test_groups_of_a_machine_with_slow_rows() -> None:
    error = ModelError.of(real("la_haute_borne", "la_haute_borne_R80736.csv.gz@2017-09-01..2017-09-04"))
    count = Counter(error.groups)
    assert set(GROUPS) - set(count) == {"p_zero", "mass"}  # random heat may last for hours
    # Rows of ten minutes do not show 150 s.
    assert (count["d_sub"], count["c_lag"]) == (2 * 5, 4)
    assert "f_input: offset of T_outdoor, constant" in error.labels
    assert "a_loss: heat of gears_load, torque^1" in error.labels


def test_classes() -> None:
    classes = error_classes()
    assert sum(one.prior for one in classes) == pytest.approx(1.0)
    assert len({one.name for one in classes}) == len(classes)
    for one in classes:
        assert set(one.amplitudes) <= set(GROUPS) and all(value > 0.0 for value in one.amplitudes.values())
    full = [one for one in classes if set(one.amplitudes) == set(GROUPS)]
    assert full[0].name == "full"
    assert all(one in full or set(one.amplitudes) <= set(BASE) for one in classes)
    # Who allows laws to err by a tenth needs more evidence than who allows them 3 %.
    large = [one for one in classes if one.amplitudes.get("a_loss", 0.0) >= 0.1]
    assert {one.name for one in large} > {one.name for one in full}
    assert min(one.threshold for one in large) > max(one.threshold for one in classes if one not in large)


def test_amplitudes() -> None:
    error = ModelError.of(made("fzg"))
    one = ErrorClass(name="made up", prior=1.0, threshold=5.0, amplitudes={"a_loss": 0.1, "e_link": 0.02})
    found = error.amplitudes(one)
    assert found.shape == (len(error.labels),)
    for value, group in zip(found, error.groups, strict=True):
        assert value == {"a_loss": 0.1, "e_link": 0.02}.get(group, 0.0)
    assert len(set(error.labels)) == len(error.labels)
