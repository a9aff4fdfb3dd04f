"""From what a zoo plant did to what was recorded: errors of instruments, noise, display steps, dropouts, faults."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.proof.cases.conceal import DATA_SHEET, SLOW_LAG_S
from diagnosis.proof.plant.cycles import Programme
from diagnosis.proof.plant.instruments import Instruments, drop_readings
from diagnosis.proof.zoo.faults import AMBIENT, Fault, Measured, hold_reading, spoiled
from diagnosis.proof.zoo.structure import ZooOutcome, ZooPlant
from models.base.types import Array

SLOW_ROW_S = 60.0  # rows longer than this are means: less noise, lags do not show
NOISE_K, SLOW_NOISE_K = 0.2, 0.1
STEP = {"speed": 0.1, "torque": 0.01}  # of recorded inputs; 0.1 of others
INPUT_NOISE = {AMBIENT: 0.1}


def draw_instruments(plant: ZooPlant, kind: str | None, *, has_loss: bool, rng: np.random.Generator) -> Instruments:
    """Draw the instruments of a case; `kind` is that of a control, see :data:`diagnosis.proof.zoo.case.CONTROLS`."""
    slow = plant.row_s > SLOW_ROW_S
    noise = SLOW_NOISE_K if slow else NOISE_K
    sheet = {"noise": noise, "resolution": 0.1} if slow else DATA_SHEET
    stated = kind in ("noise_misstated", "lag_wrong") or rng.random() < 0.5
    gains = {"torque": 0.008, "speed": 0.001, "heater_power": 0.01}
    temperatures = [name for name in plant.inputs if name.startswith("T_")]
    return Instruments(
        channels=tuple(probe.channel for probe in plant.probes),
        noise_K=noise * float(rng.uniform(2.0, 3.5)) if kind == "noise_misstated" else noise,
        input_gain={name: float(rng.normal(0.0, sd)) for name, sd in gains.items() if name in plant.inputs},
        input_offset={name: float(rng.normal(0.0, 0.2)) for name in temperatures},
        clock_s=float(rng.uniform(-2.0, 2.0)),
        loss_noise=(0.02, max(2.0, 0.005 * plant.loss_W)) if has_loss else None,
        loss_gain=float(rng.normal(0.0, 0.015)),
        loss_offset_W=float(rng.normal(0.0, 1.5)),
        dropouts=int(rng.integers(1, 6)) if rng.random() < 0.3 else 0,
        stated=sheet if stated else None,
    )


def with_slow_sensors(plant: ZooPlant, rng: np.random.Generator) -> ZooPlant:
    """The plant with sensors whose lag is not that of the data sheet."""
    factor = max(1.0, plant.row_s / 60.0)
    probes = tuple(replace(probe, lag_s=factor * float(rng.uniform(*SLOW_LAG_S))) for probe in plant.probes)
    return replace(plant, probes=probes)


def measure(plant: ZooPlant, programme: Programme, outcome: ZooOutcome, run: int) -> Measured:
    """Recording of one run of a batch by perfect instruments."""
    first = programme.unrecorded
    rows = outcome.P_loss.shape[1]
    return Measured(
        hours=np.asarray(programme.begins_h + np.arange(rows) * plant.row_s / 3600.0),
        row_s=plant.row_s,
        inputs={name: programme.inputs[name][first:] for name in plant.inputs},
        readings={name: values[run] for name, values in outcome.readings.items()},
        P_loss=outcome.P_loss[run],
    )


def record(
    measured: Measured,
    instruments: Instruments,
    faults: Sequence[Fault],
    columns: Mapping[str, str],
    rng: np.random.Generator,
) -> dict[str, Array]:
    """Columns of a recording.

    Parameters
    ----------
    measured : Measured
        What perfect instruments would record
    columns : mapping of str to str
        Column of every input

    Returns
    -------
    dict of column name to Array, shape (rows,)
    """
    sound = _with_errors(measured, instruments)
    for fault in faults:
        if fault.kind != "stuck":
            sound = spoiled(sound, fault)
    rows = len(measured.hours)
    inputs = {}
    for name, values in sound.inputs.items():
        step = STEP.get(name, 0.1)
        noisy = values + INPUT_NOISE.get(name, 0.0) * rng.standard_normal(rows)
        inputs[columns[name]] = np.round(noisy / step) * step
    quantum = instruments.quantum_K
    readings = {
        name: np.round((sound.readings[name] + instruments.noise_K * rng.standard_normal(rows)) / quantum) * quantum
        for name in instruments.channels
    }
    for fault in faults:
        if fault.kind == "stuck":
            (name,) = fault.channels
            readings[name] = hold_reading(readings[name], measured, fault)
    drop_readings(readings, instruments.dropouts, rng)
    made = {"time_s": np.asarray(np.arange(rows) * measured.row_s), **inputs}
    made |= {f"T_{name}_degC": values for name, values in readings.items()}
    if instruments.loss_noise is not None:
        made["P_loss_W"] = sound.P_loss + instruments.noise_of_loss(sound.P_loss, rng)
    return made


def _with_errors(measured: Measured, instruments: Instruments) -> Measured:
    """Recording by these instruments without noise and faults."""
    time = measured.hours * 3600.0
    readings = {n: np.interp(time - instruments.clock_s, time, values) for n, values in measured.readings.items()}
    inputs, P_loss = instruments.inputs(measured.inputs), instruments.loss(measured.P_loss)
    return replace(measured, inputs=inputs, readings=readings, P_loss=P_loss)
