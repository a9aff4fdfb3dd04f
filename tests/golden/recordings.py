"""Recordings of the FZG rig made by its own network: steps of operation, with noise of the sensors, by a seed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from models.assembly.gearbox import Gearbox
from models.files.cycle import Cycle
from models.simulation.thermal_network import ThermalNetwork

SENSORS = ("oil", "housing_lower", "housing_upper", "bearing_1", "bearing_3", "pinion")
NOISE_K = 0.15


def staircase(seed: int, hours: float) -> dict[str, np.ndarray]:
    """Speed and torque in steps of 12 min, a standstill in between, every 30 s."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, hours * 3600.0 + 1.0, 30.0)
    step = (time // 720.0).astype(int)
    count = step.max() + 1
    speed, torque = rng.uniform(300.0, 4000.0, count), rng.uniform(20.0, 250.0, count)
    speed[rng.integers(0, count, max(1, count // 6))] = 0.0
    return {
        "time_s": time, "speed_rpm": speed[step], "torque_Nm": np.where(speed[step] > 0.0, torque[step], 0.0),
        "T_ambient_degC": 23.0 + 0.5 * np.sin(time / 4000.0), "air_speed_m_s": np.full(len(time), 2.0),
    }  # fmt: skip


def record(
    network: ThermalNetwork, gearbox: Gearbox, path: Path, *, seed: int, hours: float, bias: float = 0.0,
    parameters: dict[str, float] | None = None,
) -> Path:  # fmt: skip
    rng = np.random.default_rng(seed)
    rows = staircase(seed, hours)
    result = network.simulate(Cycle.from_columns(rows), losses=gearbox.losses(), initial=24.0,
                              parameters=parameters).columns()  # fmt: skip
    columns = dict(rows)
    for name in SENSORS:
        columns[f"T_{name}_degC"] = result[f"T_{name}_degC"] + NOISE_K * rng.normal(size=len(rows["time_s"]))
    columns["T_housing_upper_degC"] = columns["T_housing_upper_degC"] + bias
    columns["P_loss_W"] = result["P_loss_W"] * (1.0 + 0.02 * rng.normal(size=len(rows["time_s"])))
    pd.DataFrame(columns).to_csv(path, index=False, float_format="%.3f")
    return path
