"""Programmes of zoo plants: what their recordings of a session are driven with."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from diagnosis.proof.plant import cycles
from diagnosis.proof.zoo.structure import Programme, ZooPlant
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.types import Array

PAUSE_H = (4.0, 60.0)  # between recordings of one session
RANDOM_HEAT = (0.002, 0.006)  # of the typical loss, sd of a heat that no law describes


def programmes(plant: ZooPlant, rng: np.random.Generator, *, baselines: int = 0) -> tuple[Programme, ...]:
    """Recordings of one session: baselines of the healthy machine, ``train_1`` to 3, ``hold_1`` and 2.

    Parameters
    ----------
    plant : ZooPlant
    rng : numpy.random.Generator
    baselines : int
        How many of ``baseline_1`` ...; they come before the session

    Returns
    -------
    tuple of Programme
    """
    gearbox = load_gearbox(plant.gearbox)
    return _of_gearbox(plant, gearbox, rng, baselines)


def _of_gearbox(plant: ZooPlant, gearbox: Gearbox, rng: np.random.Generator, baselines: int) -> tuple[Programme, ...]:
    session = cycles.programmes(gearbox, rng)
    made, begins = [], 0.0
    for cycle in session:
        made.append(_gearbox_recording(plant, gearbox, cycle, begins, rng))
        begins += len(cycle) * plant.row_s / 3600.0 + float(rng.uniform(*PAUSE_H))
    for k in range(baselines):
        cycle = cycles.programmes(gearbox, rng)[int(rng.integers(1, 3))]
        named = cycles.Programme(
            name=f"baseline_{k + 1}", speed=cycle.speed, torque=cycle.torque, unrecorded=cycle.unrecorded
        )
        made.append(_gearbox_recording(plant, gearbox, named, 0.0, rng))
    return tuple(made)


def _gearbox_recording(
    plant: ZooPlant, gearbox: Gearbox, cycle: cycles.Programme, begins_h: float, rng: np.random.Generator
) -> Programme:
    rows = len(cycle)
    air = cycles.ambient(rows, rng)
    speed_of_air = np.full(rows, gearbox.ambient.air_speed_m_s)
    start = float(air[0] + rng.normal(0.0, 0.5))
    return Programme(
        name=cycle.name,
        inputs={"speed": cycle.speed, "torque": cycle.torque, "T_ambient": air, "air_speed": speed_of_air},
        random_heat=_random_heat(plant, rows, rng, tau_s=(600.0, 1800.0)),
        start={body.name: start for body in plant.bodies},
        unrecorded=cycle.unrecorded,
        begins_h=begins_h,
    )


def _random_heat(
    plant: ZooPlant, rows: int, rng: np.random.Generator, *, tau_s: tuple[float, float]
) -> Mapping[str, Array]:
    """Heat of two or three bodies that no law describes, [W]."""
    restless = rng.choice([body.name for body in plant.bodies], int(rng.integers(2, 4)), replace=False)
    rows_s = plant.row_s / cycles.ROW_S
    return {
        str(body): cycles.ornstein_uhlenbeck(
            rows, rng, sd=plant.loss_W * float(rng.uniform(*RANDOM_HEAT)), tau_s=float(rng.uniform(*tau_s)) / rows_s
        )
        for body in restless
    }
