"""Recordings of a gearbox with a flange, a water jacket and a bed: inputs are read, added paths are calibrated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.engine.fit import calibrate
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.unknown import NetworkParameter
from diagnosis.recordings.read import read_recording
from models.assembly.gearbox import Gearbox
from tests.unit.models.around_fzg import around_fzg

CHANNELS = ("oil", "housing_upper", "housing_lower", "bed")


def recorded(machine: Gearbox, path: Path, seed: int) -> Path:
    """Three hours of the machine itself, its coolant at 50 degC not recorded."""
    rng, time = np.random.default_rng(seed), np.arange(0.0, 10800.0, 20.0)
    step = (time // 1200.0).astype(int)
    columns = {
        "time_s": time, "speed_rpm": rng.uniform(800.0, 3000.0, step.max() + 1)[step],
        "torque_Nm": rng.uniform(40.0, 150.0, step.max() + 1)[step], "T_ambient_degC": np.full(len(time), 22.0),
        "coolant_flow": rng.choice([0.0, 4.0], step.max() + 1)[step], "T_flange": 30.0 + 10.0 * np.sin(time / 1500.0),
    }  # fmt: skip
    made = machine.simulate(columns, initial=22.0).columns()
    read = {f"T_{n}_degC": made[f"T_{n}_degC"] + 0.1 * rng.standard_normal(len(time)) for n in CHANNELS}
    pd.DataFrame(columns | read).to_csv(path, index=False)
    return path


def test_added_paths_are_calibrated(tmp_path: Path) -> None:
    """The bed holds 52 kJ/K in truth, 40 +- 12 in the definition; to the flange it is 18 W/K, not 12 +- 4.8."""
    machine = around_fzg()
    true = machine.with_values({"part.0.heat_capacity_J_K": 52000.0, "link.0.conductance_W_K": 18.0})
    network = machine.network()
    train, hold = (read_recording(recorded(true, tmp_path / f"{seed}.csv", seed), network) for seed in (1, 2))
    assert train.assumed == ("air_speed", "T_coolant") and set(train.inputs) == set(network.inputs)
    setup, experiment = prepare_experiment(machine, [train], [hold])
    fitted = calibrate(experiment)
    pairs = zip(experiment.unknowns, fitted.z, strict=True)
    values = {u.parameter.name: u.value(z) for u, z in pairs if isinstance(u, NetworkParameter)}
    assert values["C_bed"] == pytest.approx(1.3, abs=0.03)
    assert values["G_housing_upper_flange"] == pytest.approx(1.5, abs=0.1)
    assert setup.channels[-1] == "bed"
