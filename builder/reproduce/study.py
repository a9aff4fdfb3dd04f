"""Models and simulations that several items share, each made once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np

from builder.fmi.reference_cycle import COLD_START, reference_cycle
from builder.reproduce.printed import OUTPUT_TORQUE, STAGE_S, TABLE_4, TABLE_6_RPM
from builder.surrogate.doe import random_points
from builder.surrogate.train import TrainingResult
from models.assembly.gearbox import Gearbox
from models.base.progress import Progress
from models.base.types import Array, Numeric
from models.files.cycle import Cycle
from models.losses.loss_model import LossModel
from models.portable.surrogate import SurrogateLosses
from models.simulation.result import Result
from models.simulation.steady_state import steady_state
from models.simulation.thermal_network import Losses, ThermalNetwork

FULL, REDUCED, PRINTED = "F-PL", "ROM-PL", "ROM-PL, networks as printed"
MIDDLE = 3  # index of 8.3 m/s, the stage that figures of one speed show
MEDIUM, HIGHEST = 1, 2  # indices of OUTPUT_TORQUE
CHANGE_S = 1.0  # in which the speed of Table 6 changes
# Temperatures that losses without a thermal network are evaluated at; gears at OUTPUT_TORQUE.
T_OIL = 60.0  # degC
BEARING_ABOVE_OIL = 5.0  # K
GEAR_ABOVE_OIL = np.array([0.0, 10.0, 25.0])  # K
CORNER = 0.1  # lowest tenth of every input's range: where cold starts begin
LIMIT = 120.0  # degC: upper bound of the paper's networks (Table 4)
FACTORS = np.geomspace(1.0, 40.0, 41)


@dataclass(frozen=True, kw_only=True)
class StudySettings:
    """How much is computed.

    Attributes
    ----------
    seed : int
    jobs : int
        Processes
    samples : int or None
        Training points per network of our networks; None takes the preset's
    test_points : int
        Points, separate from the training, on which networks are compared with the full model
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
    jobs: int = 1
    samples: int | None = None
    test_points: int = 400
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
    settings : StudySettings
    progress : callable
        Told what is being done
    """

    gearbox: Gearbox
    ours: TrainingResult
    printed: TrainingResult
    fmu: Path
    settings: StudySettings
    progress: Progress

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

    def stated_temperatures(self, output_torque: Any, *, T_oil: float = T_OIL) -> dict[str, Array]:
        """Node temperatures for losses without a thermal network, [degC]: gears are the warmer, the higher T2 [N m]."""
        gears = T_oil + np.interp(output_torque, OUTPUT_TORQUE, GEAR_ABOVE_OIL)
        others = {"oil": np.full_like(gears, T_oil)} | dict.fromkeys(self.gearbox.stage[0].names, gears)
        bearings = np.full_like(gears, T_oil + BEARING_ABOVE_OIL)
        return {node: others.get(node, bearings) for node in self.full.temperature_nodes}

    def by_kind(self, losses: Mapping[str, Numeric]) -> dict[str, Array]:
        """Losses of components added up by kind, [W]."""
        return {
            "sliding": np.asarray(losses["mesh_sliding"]),
            "rolling": np.asarray(losses["mesh_rolling"]),
            "churning": np.asarray(losses["churning"]),
            "seals": np.sum([np.asarray(losses[seal.name]) for seal in self.gearbox.seal], axis=0),
            "bearings": np.sum([np.asarray(losses[bearing.name]) for bearing in self.gearbox.bearing], axis=0),
        }

    def staircase(self, output_torque: float, *, step_s: float) -> Cycle:
        """Return the 18 h of Table 6 at one torque T2 [N m]: six speeds of 3 h each, changed within a second.

        `step_s` is a divisor of 3 h, [s].
        """
        end = STAGE_S * len(TABLE_6_RPM)
        changes = np.arange(STAGE_S, end, STAGE_S)
        time = np.union1d(np.linspace(0.0, end, round(end / step_s) + 1), changes + CHANGE_S)
        # The row at a change belongs to the earlier stage, so that every stage ends with its own speed.
        stage = np.clip(np.ceil(time / STAGE_S).astype(int) - 1, 0, len(TABLE_6_RPM) - 1)
        ambient = self.gearbox.ambient
        return Cycle.from_columns(
            {
                "time_s": time,
                "speed_rpm": self.pinion_speed[stage],
                "torque_Nm": np.full_like(time, output_torque / self.ratio),
                "T_ambient_degC": np.full_like(time, ambient.temperature_degC),
                "air_speed_m_s": np.full_like(time, ambient.air_speed_m_s),
            }
        )

    @cached_property
    def cycle_runs(self) -> dict[str, Result]:
        """The 600 s cycle with the full model, our networks, and the networks as printed."""
        cycle = reference_cycle(self.gearbox)
        models: dict[str, Losses] = {FULL: self.full, REDUCED: self.surrogate, PRINTED: self.printed.losses}
        return {n: self.network.simulate(cycle, losses=losses, initial=COLD_START) for n, losses in models.items()}

    @cached_property
    def network_points(self) -> dict[bool, dict[str, Array]]:
        """Losses [W], shape (points, components), of the full model and both sets of networks.

        False: random points within Table 4, of another seed than the training. True: points in its cold, slow, light
        corner.
        """
        bounds = np.array([*TABLE_4.values()])
        bounds = np.vstack([bounds[:2], np.repeat(bounds[2:], len(self.full.temperature_nodes), axis=0)])
        low, high = bounds.T
        models: dict[str, Losses] = {FULL: self.full, "as printed": self.printed.losses, "ours": self.surrogate}
        return {
            corner: {name: losses.power(x[:, 0], x[:, 1], x[:, 2:]) for name, losses in models.items()}
            for corner, upper in ((False, high), (True, low + CORNER * (high - low)))
            for x in [random_points(self.settings.test_points, low, upper, seed=self.settings.seed + 100 + corner)]
        }

    @cached_property
    def needed_convection(self) -> tuple[float, float]:
        """Factor on the convection, and air speed [m/s], that hold `LIMIT` at the highest load and speed."""
        speed, torque = (np.full_like(FACTORS, v) for v in (self.pinion_speed[-1], self.pinion_torque[HIGHEST]))
        oil_at = partial(steady_oil, self.network, self.full, speed=speed, torque=torque)
        air_speed = self.gearbox.ambient.air_speed_m_s * FACTORS
        by_factor, by_air = (oil_at(parameters={"h_air": FACTORS})[0], oil_at(inputs={"air_speed": air_speed})[0])
        return (
            float(np.exp(np.interp(-LIMIT, -by_factor, np.log(FACTORS)))),
            float(np.exp(np.interp(-LIMIT, -by_air, np.log(air_speed)))),
        )


def steady_oil(
    network: ThermalNetwork, losses: Losses, *, speed: Array, torque: Array, **given: Any
) -> tuple[Array, Array]:
    """Oil temperature [degC] and total loss [W] in steady state at N operating points, each of shape (N,).

    Parameters
    ----------
    network : ThermalNetwork
    losses : Losses
    speed, torque : Array, shape (N,)
        Of the input shaft, [1/min] and [N m]
    **given
        `inputs` and `parameters` of :func:`models.simulation.steady_state.steady_state`
    """
    result = steady_state(network, losses=losses, speed=speed, torque=torque, **given)
    return np.asarray(result.temperatures["oil"]), np.asarray(result.loss)
