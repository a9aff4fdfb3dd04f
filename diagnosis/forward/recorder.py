"""A recording, a correction and a model made comparable: the model gets the inputs as they probably were, and is read
through the sensors of the recorder.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace

import numpy as np

from diagnosis.forward.recurrence import lagged
from diagnosis.forward.sensor_fault import channel_column, delayed, distorted, law_along
from models.base.types import Array
from models.correction.correction import Correction
from models.correction.instruments import SensorCorrection
from models.files.cycle import Cycle
from models.files.cycle_file import RecordedStart
from models.quantities.quantities import TOTAL_LOSS, column_of_input, is_total_loss, node_columns, node_of_channel

AS_RECORDED = "_as_recorded"  # ending of columns of readings
PASSES = 3  # simulations where an input follows the machine's own temperatures
Columns = Mapping[str, Array]


def simulated_as_recorded(cycle: Cycle, correction: Correction, run: Callable[[Cycle], Columns]) -> dict[str, Array]:
    """Simulate a recording and read it as its recorder did.

    Parameters
    ----------
    cycle : Cycle
        Inputs as recorded
    run : callable
        From a cycle to the columns of a result, of a model that holds the physics of the correction

    Returns
    -------
    dict of column name to Array, shape (N,)
        The result, and ``<column>_as_recorded`` of every input that is corrected, and of every channel of the
        correction as its sensor reads it: what is to be compared with the recording
    """
    late = common_clock(cycle, correction)
    driven = true_inputs(cycle, correction)
    columns = run(driven)
    follows = any(f.kind == "signal" and _hears(f.term.expression.free_symbols) for f in correction.findings)
    for _ in range(PASSES - 1 if follows else 0):
        driven = true_inputs(cycle, correction, columns)
        columns = run(driven)
    recorded = {
        f"{column_of_input(name)}{AS_RECORDED}": values
        for name, values in cycle.inputs.items() if not np.array_equal(values, driven.inputs[name])
    }  # fmt: skip
    return {**columns, **recorded, **read_as_recorded(columns, correction, late=late)}


def common_clock(cycle: Cycle, correction: Correction) -> float:
    """Seconds by which all inputs of a recording are early; 0 if they differ.

    The model then keeps the clock of the inputs, and the readings are late: so a simulation starts with the first row.
    """
    clocks = {one.name: one.clock for one in correction.inputs}
    found = {clocks.get(name, 0.0) for name in cycle.inputs}
    return found.pop() if len(found) == 1 else 0.0


def true_inputs(cycle: Cycle, correction: Correction, result: Columns | None = None) -> Cycle:
    """Inputs of a recording as they probably were: clocks, gains and offsets, then the faults among the findings.

    A clock that all inputs share is left to the readings, see :func:`common_clock`.

    Parameters
    ----------
    cycle : Cycle
        As recorded
    result : mapping of column name to Array, shape (N,), optional
        Of a simulation, for faults that follow the machine's temperatures; without it they are left out

    Raises
    ------
    InputError
        If a fault needs what a result lacks.
    """
    inputs, late = dict(cycle.inputs), common_clock(cycle, correction)
    for one in correction.inputs:
        if one.name in inputs:
            shift = one.clock - late
            values = delayed(inputs[one.name], cycle.time, shift) if shift else inputs[one.name]
            inputs[one.name] = one.gain * values + one.offset
    for term in (finding.term for finding in correction.findings if finding.of_measurement):
        known = result is not None or not _hears(term.expression.free_symbols)
        if term.kind == "signal" and term.target[0] in inputs and known:
            now = {column_of_input(name): values for name, values in inputs.items()}
            inputs[term.target[0]] = inputs[term.target[0]] + law_along(term, {
                **(result or {}), "time_s": cycle.time, **now})  # fmt: skip
    return Cycle(cycle.time, inputs)


def read_as_recorded(columns: Columns, correction: Correction, *, late: float = 0.0) -> dict[str, Array]:
    """Readings of the recorder's sensors over a simulated cycle, faults among the findings included.

    Parameters
    ----------
    columns : mapping of column name to Array, shape (N,)
        Result with true inputs
    late : float
        Seconds by which every reading is late, see :func:`common_clock`

    Returns
    -------
    dict of column name to Array, shape (N,)
        ``T_oil_degC_as_recorded`` of every channel of the correction or of a fault; of all nodes if readings are late
    """
    time, nodes = columns["time_s"], node_columns(columns)
    everything = [*sorted(nodes), TOTAL_LOSS] if late else []
    read = {c: np.asarray(columns[channel_column(c)]) for c in everything if channel_column(c) in columns}
    read |= {
        sensor.channel: _reading(columns, sensor, node_of_channel(sensor.channel, nodes))
        for sensor in correction.sensors
        if channel_column(node_of_channel(sensor.channel, nodes)) in columns
    }
    for term in (finding.term for finding in correction.findings if finding.kind == "sensor"):
        true = {channel: channel_column(node_of_channel(channel, nodes)) for channel in term.target}
        channels = [channel for channel in term.target if true[channel] in columns]
        if channels:
            readings = np.stack([read.get(name, columns[true[name]]) for name in channels], axis=-1)
            readings = distorted(term, law_along(term, columns), time, readings, range(len(channels)))
            read |= dict(zip(channels, readings.T, strict=True))
    return {
        f"{channel_column(channel)}{AS_RECORDED}": delayed(values, time, late) if late else values
        for channel, values in read.items()
    }


def _reading(columns: Columns, sensor: SensorCorrection, node: str) -> Array:
    time, true = columns["time_s"], np.asarray(columns[channel_column(node)], dtype=float)
    if is_total_loss(sensor.channel):
        return sensor.gain * (delayed(true, time, sensor.delay) if sensor.delay else true) + sensor.bias
    steps, mixed = np.diff(time), true
    for one in sensor.mix:
        other = columns.get(channel_column(one.node), columns.get("T_ambient_degC"))
        mixed = mixed + one.share * (lagged(np.asarray(other, dtype=float), steps, one.lag) - true)
    return lagged(mixed, steps, sensor.lag) + sensor.bias


def true_start(start: RecordedStart, correction: Correction) -> RecordedStart:
    """First temperatures of a recording without the biases of their sensors, the first of several at a node."""
    biases = {node_of_channel(s.channel, start.temperatures): s.bias for s in reversed(correction.sensors)}
    return replace(start, temperatures={node: T - biases.get(node, 0.0) for node, T in start.temperatures.items()})


def _hears(symbols: Iterable[object]) -> bool:
    """True if a law needs temperatures or losses of the machine."""
    return any(str(s).startswith(("T_", "P_")) and str(s) not in ("T_ambient", "T_outdoor") for s in symbols)
