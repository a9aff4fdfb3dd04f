"""What all items are made from: the gearbox, its full model, both sets of networks and the FMU; and Table 6."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from builder.train import TrainingResult
from models.cycle import Cycle
from models.gearbox import Gearbox
from models.losses import LossModel
from models.network import ThermalNetwork
from models.surrogate import SurrogateLosses
from models.types import Array

# Table 6 of the paper.
PITCH_VELOCITY = np.array([1.0, 2.0, 5.0, 8.3, 15.0, 20.0])  # m/s
TABLE_6_RPM = np.array([174.0, 348.0, 870.0, 1444.0, 2609.0, 3476.0])
OUTPUT_TORQUE = np.array([0.0, 141.0, 453.0])  # N m
STAGE_S = 3.0 * 3600.0
CHANGE_S = 1.0  # in which the speed changes
MIDDLE = 3  # 8.3 m/s, the stage that figures of one speed show
# Node temperatures above the oil's that losses without a thermal network are evaluated at.
BEARING_ABOVE_OIL = 5.0  # K
GEAR_ABOVE_OIL = np.array([0.0, 10.0, 25.0])  # K, at OUTPUT_TORQUE
T_OIL = 60.0  # degC


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How much is computed.

    Attributes
    ----------
    seed : int
    jobs : int
        Processes; -1 for all cores
    samples : int or None
        Training points per network of our networks; None takes the preset's
    judged : int
        Separate points that networks are judged on
    runs : int
        Runs per timing, at most
    longest_s : float
        A timing makes no further run after this time, [s]
    step_s, fine_step_s : float
        Rows of the 18 h cycle, and of the one that shows that they are fine enough, [s]
    trajectories : int
        Of the Morris study
    """

    seed: int = 0
    jobs: int = -1
    samples: int | None = None
    judged: int = 400
    runs: int = 5
    longest_s: float = 30.0
    step_s: float = 10.0
    fine_step_s: float = 1.0
    trajectories: int = 8


@dataclass(frozen=True, kw_only=True)
class Study:
    """The gearbox and its models.

    Attributes
    ----------
    gearbox : Gearbox
    ours, printed : TrainingResult
        Networks of the default preset, and as the paper prints them
    fmu : Path
        Of our networks
    settings : Settings
    """

    gearbox: Gearbox
    ours: TrainingResult
    printed: TrainingResult
    fmu: Path
    settings: Settings

    @cached_property
    def full(self) -> LossModel:
        """The full model, F-PL."""
        return self.gearbox.losses()

    @cached_property
    def network(self) -> ThermalNetwork:
        """The thermal network."""
        return self.gearbox.network()

    @property
    def surrogate(self) -> SurrogateLosses:
        """Our reduced model, ROM-PL."""
        return self.ours.losses

    @property
    def ratio(self) -> float:
        """Pinion speed over wheel speed, [-]; wheel torque over pinion torque."""
        return 1.0 / self.gearbox.speed_ratio[self.gearbox.stage[0].driven]

    @property
    def pinion_speed(self) -> Array:
        """Speeds of Table 6 at the pinion shaft, our input, [1/min], shape (6,)."""
        return TABLE_6_RPM * self.ratio

    @property
    def pinion_torque(self) -> Array:
        """Torques of Table 6 at the pinion shaft, [N m], shape (3,)."""
        return OUTPUT_TORQUE / self.ratio

    def stated_temperatures(self, output_torque: Any, *, T_oil: float = T_OIL) -> Array:
        """Node temperatures for losses without a thermal network, [degC], shape (..., temperature nodes).

        Parameters
        ----------
        output_torque : ArrayLike, shape (...)
            T2, [N m]; the gears are the warmer above the oil, the more torque they carry
        T_oil : float
            [degC]
        """
        gears = T_oil + np.interp(output_torque, OUTPUT_TORQUE, GEAR_ABOVE_OIL)
        columns = [
            (
                np.full_like(gears, T_oil)
                if node == "oil"
                else gears
                if node in self.gearbox.stage[0].names
                else np.full_like(gears, T_oil + BEARING_ABOVE_OIL)
            )
            for node in self.full.temperature_nodes
        ]
        return np.stack(columns, axis=-1)

    def staircase(self, output_torque: float, *, step_s: float, speeds: Array | None = None) -> Cycle:
        """Return the 18 h of Table 6 at one torque: six speeds of 3 h each, changed within a second.

        Parameters
        ----------
        output_torque : float
            T2, [N m]
        step_s : float
            [s]; a divisor of 3 h
        speeds : Array, shape (6,), or None
            Of the pinion, [1/min]; by default Table 6 read as wheel speeds
        """
        speeds = self.pinion_speed if speeds is None else speeds
        end = STAGE_S * len(speeds)
        changes = np.arange(STAGE_S, end, STAGE_S)
        time = np.union1d(np.linspace(0.0, end, round(end / step_s) + 1), changes + CHANGE_S)
        # The row at a change belongs to the earlier stage, so that every stage ends with its own speed.
        stage = np.clip(np.ceil(time / STAGE_S).astype(int) - 1, 0, len(speeds) - 1)
        ambient = self.gearbox.ambient
        return Cycle.from_columns(
            {
                "time_s": time,
                "speed_rpm": speeds[stage],
                "torque_Nm": np.full_like(time, output_torque / self.ratio),
                "T_ambient_degC": np.full_like(time, ambient.temperature_degC),
                "air_speed_m_s": np.full_like(time, ambient.air_speed_m_s),
            }
        )
