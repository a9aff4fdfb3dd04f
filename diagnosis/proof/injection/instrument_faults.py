"""Faults of instruments: exact changes of the recorded columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import sympy as sp
from scipy.ndimage import median_filter

from diagnosis.forward.recurrence import lagged
from diagnosis.proof.cases.time_course import TimeCourse
from diagnosis.proof.injection.calibrated_model import CalibratedMachine
from diagnosis.proof.injection.machine_changes import input_shift
from diagnosis.proof.injection.real_recording import RealRecording
from diagnosis.proof.injection.trial import SIZES, SMALLEST, Trial, ladder
from models.base.errors import InputError
from models.base.types import Array
from models.network.laws import symbol
from models.quantities.quantities import node_of_channel

BIAS_K, GAIN = 15.0, 0.15  # at most
LONGEST_LAG_S, LONGEST_LAG_ROWS = 3600.0, 6  # the longer of both
LONGEST_CLOCK_S, LONGEST_CLOCK_ROWS = 3600.0, 12
LONGEST_STUCK_S = 24 * 3600.0
INPUT_OFFSET_K, INPUT_OFFSET, INPUT_GAIN = 6.0, 0.1, 0.2  # the second of the input's usual size
USUAL_PERCENTILE = 95.0
SMOOTH = 7  # rows of a running median


def bias(real: RealRecording, channel: str, course: TimeCourse, rng: np.random.Generator) -> Trial:
    """Reading plus `size` [K]."""
    sizes = ladder(-BIAS_K, BIAS_K, rng)
    shift = sizes[:, None] * np.where(np.isnan(real.channels[channel]), np.nan, course.share(real.time))
    return _sensor(real, channel, course, sizes, "K", shift)


def gain(real: RealRecording, channel: str, course: TimeCourse, rng: np.random.Generator) -> Trial:
    """Reading in degC times ``1 + size``."""
    sizes = ladder(-GAIN, GAIN, rng)
    return _sensor(real, channel, course, sizes, "1", sizes[:, None] * real.channels[channel] * course.share(real.time))


def lag(real: RealRecording, channel: str, course: TimeCourse, _: np.random.Generator) -> Trial:
    """A slower sensor: the reading follows the old one with a time constant of `size` [s]."""
    sizes = max(LONGEST_LAG_S, LONGEST_LAG_ROWS * real.step_s) * np.geomspace(SMALLEST, 1.0, SIZES)
    sizes = sizes[sizes >= 0.1 * real.step_s]
    values, acts = real.channels[channel], course.share(real.time)
    first = int(np.argmax(acts > 0.0))
    whole = real.reading_at(channel, real.time)
    slow = np.stack([lagged(whole[first:], np.diff(real.time[first:]), float(size)) for size in sizes])
    shift = np.zeros((len(sizes), len(values)))
    shift[:, first:] = (slow - whole[first:]) * acts[first:]
    return _sensor(real, channel, course, sizes, "s", np.where(np.isfinite(values), shift, np.nan))


def stuck(real: RealRecording, channel: str, course: TimeCourse, _: np.random.Generator) -> Trial:
    """The reading stays as it was."""
    values, acts = real.channels[channel], course.share(real.time)
    before = np.flatnonzero(np.isfinite(values) & (real.time < course.begins))
    if not len(before):
        raise InputError(f"{channel} has no reading before {course.begins:.0f} s that it could be stuck at")
    held = float(values[before[-1]])
    return _sensor(real, channel, course, np.ones(1), "1", ((held - values) * acts)[None])


def swapped(real: RealRecording, channel: str, course: TimeCourse, rng: np.random.Generator) -> Trial:
    """Two sensors in each other's columns."""
    others = [name for name in real.channels if name != channel]
    other = others[int(rng.integers(len(others)))]
    acts = course.share(real.time)
    # Nothing changes outside its dates, also where one of the two is missing.
    difference = np.where(acts > 0.0, (real.channels[other] - real.channels[channel]) * acts, 0.0)
    trial = _sensor(real, channel, course, np.ones(1), "1", difference[None])
    shifts = {channel: difference[None], other: -difference[None]}
    return replace(
        trial, of=f"{channel},{other}", nodes=(*trial.nodes, node_of_channel(other, real.nodes)), K=shifts,
        columns={f"T_{name}": shift for name, shift in shifts.items()},
    )  # fmt: skip


def clock(real: RealRecording, _: str, course: TimeCourse, __: np.random.Generator) -> Trial:
    """All temperatures come whole rows late against the inputs; `size` [s].

    It is chosen by the rms change of the median sensor: noise and spikes move as well, and would look like an effect.
    """
    step = real.step_s
    most = int(min(max(LONGEST_CLOCK_S, LONGEST_CLOCK_ROWS * step), course.begins) / step)
    rows = np.unique(np.round(np.geomspace(1, max(most, 1), SIZES)).astype(int))
    acts = course.share(real.time) > 0.0
    columns, K = {}, {}
    for name, values in real.channels.items():
        smooth = median_filter(real.reading_at(name, real.time), SMOOTH)
        shifts, moved = np.zeros((len(rows), len(values))), np.zeros((len(rows), len(values)))
        for k, late in enumerate(rows):
            at = np.searchsorted(real.time, real.time - late * step - 0.5 * step)
            before = acts & (np.abs(real.time[at] - (real.time - late * step)) <= step)
            shifts[k, acts] = np.where(before, values[at], np.nan)[acts] - values[acts]
            moved[k, before] = smooth[at][before] - smooth[before]
        columns[f"T_{name}"], K[name] = shifts, moved
    return Trial(
        what="clock", of="temperatures", nodes=(), course=course, sizes=rows * step, unit="s",
        columns=columns, K=K,
        size_K=np.median([np.sqrt(np.mean(moved[:, acts] ** 2, axis=1)) for moved in K.values()], axis=0),
    )  # fmt: skip


def input_offset(model: CalibratedMachine, name: str, course: TimeCourse, rng: np.random.Generator) -> Trial:
    """Recorded input plus `size`, in the unit inside."""
    real, network = model.real, model.network
    is_temperature = name in network.inputs and network.inputs[name].quantity.is_temperature
    cap = INPUT_OFFSET_K if is_temperature else INPUT_OFFSET * _usual(real.inputs[name])
    sizes = ladder(-cap, cap, rng)
    shift = sizes[:, None] * np.where(np.isnan(real.inputs[name]), np.nan, course.share(real.time))
    unit = network.inputs[name].quantity.unit if name in network.inputs else "1"
    return _input(model, name, sp.Integer(1), course, sizes, unit, shift)


def input_gain(model: CalibratedMachine, name: str, course: TimeCourse, rng: np.random.Generator) -> Trial:
    """Recorded input times ``1 + size``."""
    sizes = ladder(-INPUT_GAIN, INPUT_GAIN, rng)
    shift = sizes[:, None] * model.real.inputs[name] * course.share(model.real.time)
    return _input(model, name, symbol(name), course, sizes, "1", shift)


def _sensor(
    real: RealRecording, channel: str, course: TimeCourse, sizes: Array, unit: str, shift: Array
) -> Trial:  # fmt: skip
    node = node_of_channel(channel, real.nodes)
    return Trial(
        what="sensor", of=channel, nodes=(node,), course=course, sizes=sizes, unit=unit,
        columns={f"T_{channel}": shift}, K={channel: shift},
    )  # fmt: skip


def _input(
    model: CalibratedMachine, name: str, law: sp.Expr, course: TimeCourse, sizes: Array, unit: str, shift: Array
) -> Trial:  # fmt: skip
    K: Mapping[str, Array] = {channel: np.zeros(shift.shape) for channel in model.real.channels}
    if name in model.network.inputs:
        K = input_shift(model, name, law, sizes, course)
    return Trial(
        what="input", of=name, nodes=(), course=course, sizes=sizes, unit=unit, columns={name: shift}, K=K
    )  # fmt: skip


def _usual(values: Array) -> float:
    return float(np.nanpercentile(np.abs(values), USUAL_PERCENTILE))
