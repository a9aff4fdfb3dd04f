"""Programmes of zoo plants: what their recordings of a session are driven with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.proof.plant import cycles
from diagnosis.proof.plant.cycles import Programme
from diagnosis.proof.zoo.structure import ZooPlant
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.types import Array
from models.definition.parametric_sections import ParametricDefinition

PAUSE_H = (4.0, 60.0)  # between recordings of one session
RANDOM_HEAT = (0.002, 0.006)  # of the typical loss, sd of a heat that no law describes
HOURS = {"train_1": 12.0, "train_2": 5.0, "train_3": 5.0, "hold_1": 2.5, "hold_2": 3.5}
DAYS = {"train_1": 14.0, "train_2": 5.0, "train_3": 5.0, "hold_1": 5.0, "hold_2": 5.0}
MINUTES_S = 60.0  # rows further apart belong to machines that are recorded for weeks


def programmes(plant: ZooPlant, rng: np.random.Generator, *, baselines: int = 0) -> tuple[Programme, ...]:
    """Recordings of one session: ``train_1`` to 3, ``hold_1`` and 2, and ``baseline_1`` ... of the healthy machine.

    Parameters
    ----------
    baselines : int
        How many baselines; each is a session before this one, with its clock at 0

    Returns
    -------
    tuple of Programme
        Gearboxes: about 22 h and 6 h at 10 s. Machines without geometry: hours, or weeks in means of ten minutes
    """
    gearbox = load_gearbox(plant.gearbox)
    if isinstance(gearbox.definition, ParametricDefinition):
        return _of_machine(plant, gearbox.definition, rng, baselines)
    return _of_gearbox(plant, gearbox, rng, baselines)


def random_heat(
    plant: ZooPlant, rows: int, rng: np.random.Generator, *, tau_s: tuple[float, float]
) -> dict[str, Array]:
    """Heat of two or three bodies that no law describes, [W]."""
    bodies = [body.name for body in plant.bodies]
    restless = rng.choice(bodies, min(len(bodies), int(rng.integers(2, 4))), replace=False)
    per_row = plant.row_s / cycles.ROW_S  # the process is made for rows of 10 s
    return {
        str(body): cycles.ornstein_uhlenbeck(
            rows, rng, sd=plant.loss_W * float(rng.uniform(*RANDOM_HEAT)), tau_s=float(rng.uniform(*tau_s)) / per_row
        )
        for body in restless
    }


# ---------------------------------------------------------------------- gearboxes


def _of_gearbox(plant: ZooPlant, gearbox: Gearbox, rng: np.random.Generator, baselines: int) -> tuple[Programme, ...]:
    made, begins = [], 0.0
    for cycle in cycles.programmes(gearbox, rng):
        made.append(_gearbox_recording(plant, gearbox, cycle, cycle.name, begins, rng))
        begins += (len(cycle) - cycle.unrecorded) * plant.row_s / 3600.0 + float(rng.uniform(*PAUSE_H))
    for k in range(baselines):
        cycle = cycles.programmes(gearbox, rng)[(1, 4, 2)[k % 3]]  # random, staircase, random from warm
        made.append(_gearbox_recording(plant, gearbox, cycle, f"baseline_{k + 1}", 0.0, rng))
    return tuple(made)


def _gearbox_recording(
    plant: ZooPlant, gearbox: Gearbox, cycle: Programme, name: str, begins_h: float, rng: np.random.Generator
) -> Programme:
    rows = len(cycle)
    air = cycles.ambient(rows, rng)
    start = float(air[0] + rng.normal(0.0, 0.5))
    return replace(
        cycle,
        name=name,
        inputs={**cycle.inputs, "T_ambient": air, "air_speed": np.full(rows, gearbox.ambient.air_speed_m_s)},
        random_heat=random_heat(plant, rows, rng, tau_s=(600.0, 1800.0)),
        start={body.name: start for body in plant.bodies},
        begins_h=begins_h,
    )


# ---------------------------------------------------------------------- machines without geometry


def _of_machine(
    plant: ZooPlant, definition: ParametricDefinition, rng: np.random.Generator, baselines: int
) -> tuple[Programme, ...]:
    slow = plant.row_s > MINUTES_S
    hours = {name: 24.0 * days for name, days in DAYS.items()} if slow else HOURS
    made, begins = [], 0.0
    for name, length in hours.items():
        made.append(_machine_recording(plant, definition, name, length, begins, rng))
        begins += length + float(rng.uniform(*PAUSE_H))
    for k in range(baselines):
        length = hours[("train_2", "hold_2")[k % 2]]
        made.append(_machine_recording(plant, definition, f"baseline_{k + 1}", length, 0.0, rng))
    return tuple(made)


def _machine_recording(
    plant: ZooPlant,
    definition: ParametricDefinition,
    name: str,
    hours: float,
    begins_h: float,
    rng: np.random.Generator,
) -> Programme:
    slow = plant.row_s > MINUTES_S
    rows = round(3600.0 * hours / plant.row_s) + 1
    t_h = np.arange(rows) * plant.row_s / 3600.0
    inputs: dict[str, Array] = {}
    load = np.zeros(rows)
    if definition.loss:
        wind = _wind(rows, plant.row_s, rng)
        speed, load = _operation(wind)
        inputs["speed"] = definition.operation.speed_rpm * speed
        inputs["torque"] = definition.operation.torque_Nm * load
    weather = rng.uniform(4.0, 14.0) + 3.0 * np.sin(2.0 * np.pi * (t_h - rng.uniform(0.0, 24.0)) / 24.0)
    weather = weather + _wander(rows, plant.row_s, rng, sd=3.0, tau_h=60.0)
    for boundary in definition.boundary:
        if not slow:
            inputs[boundary.input] = cycles.ambient(rows, rng)
        elif boundary.input == "T_ambient" and len(definition.boundary) > 1:
            # The air of a nacelle: warmer than outdoors, more so under load of the last hours.
            warmed = _mean_of_three_hours(load, plant.row_s)
            inputs["T_ambient"] = weather + rng.uniform(3.0, 7.0) + rng.uniform(5.0, 10.0) * warmed
        else:
            inputs[boundary.input] = weather
    _add_named_inputs(plant, definition, inputs, rows, rng)
    air = float(inputs[definition.boundary[0].input][0])
    warmth = float(rng.uniform(0.0, 20.0)) if slow else 0.0
    return Programme(
        name=name,
        inputs={signal: inputs[signal] for signal in plant.inputs},
        random_heat=random_heat(plant, rows, rng, tau_s=(3600.0, 4 * 3600.0) if slow else (600.0, 1800.0)),
        start={body.name: air + warmth + float(rng.normal(0.0, 0.1)) for body in plant.bodies},
        begins_h=begins_h,
    )


def _add_named_inputs(
    plant: ZooPlant, definition: ParametricDefinition, inputs: dict[str, Array], rows: int, rng: np.random.Generator
) -> None:
    """Inputs of the definition that drive its heats: steps between levels; all others at their default."""
    driving = " ".join(heat.heat_W for heat in definition.heat)
    for given in definition.input:
        if given.name in inputs:
            continue
        low, high = given.bounds
        level = given.as_input().default
        if given.name in driving and given.quantity == "power":
            steps = _steps(rows, plant.row_s, rng)
            inputs[given.name] = np.clip(plant.loss_W * steps, low, high)
        elif given.quantity == "switch":
            inputs[given.name] = (_steps(rows, plant.row_s, rng) > 0.5).astype(float)
        else:
            inputs[given.name] = np.full(rows, level)


def _steps(rows: int, row_s: float, rng: np.random.Generator) -> Array:
    """Levels from 0 to 1.2 that hold for one to four hours, the first about 1."""
    values = np.empty(rows)
    row, level = 0, float(rng.uniform(0.8, 1.1))
    while row < rows:
        hold = round(float(rng.uniform(1.0, 4.0)) * 3600.0 / row_s)
        values[row : row + hold] = level
        row += hold
        level = 0.0 if rng.random() < 0.3 else float(rng.uniform(0.3, 1.2))
    return values


def _wind(rows: int, row_s: float, rng: np.random.Generator) -> Array:
    """Wind speed over that of full power: about a day's memory, and gusts that ten minutes do not quite average out."""
    slow = _wander(rows, row_s, rng, sd=0.35, tau_h=14.0)
    gusts = _wander(rows, row_s, rng, sd=0.07, tau_h=0.3)
    return np.asarray(rng.uniform(0.5, 0.75) * np.exp(slow - 0.06) + gusts)


def _operation(wind: Array) -> tuple[Array, Array]:
    """Speed and torque over their reference: idle below cut-in, then the cube of the wind up to full power."""
    power = np.clip((wind**3 - 0.02) / 0.98, 0.0, 1.0)
    running = power > 0.005
    speed = np.where(running, np.clip(0.55 + 0.6 * wind, 0.6, 1.0), 0.03)
    torque = np.where(running, power / speed, 0.0)
    return np.asarray(speed), np.asarray(torque)


def _wander(rows: int, row_s: float, rng: np.random.Generator, *, sd: float, tau_h: float) -> Array:
    return cycles.ornstein_uhlenbeck(rows, rng, sd=sd, tau_s=3600.0 * tau_h * cycles.ROW_S / row_s)


def _mean_of_three_hours(values: Array, row_s: float) -> Array:
    count = max(1, round(3.0 * 3600.0 / row_s))
    padded = np.concatenate([np.full(count - 1, values[0]), values])
    return np.convolve(padded, np.full(count, 1.0 / count), mode="valid")
