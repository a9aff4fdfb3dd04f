"""Faults of measurement: what a sensor, a recorder or a clock makes of the truth. The machine itself is sound."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from diagnosis.proof.cases.time_course import ALWAYS, TimeCourse
from diagnosis.proof.plant.instruments import lagged
from models.base.types import Array

FaultKind = Literal["bias", "gain", "drift", "lag", "stuck", "swapped", "clock", "offset", "input_gain", "heated"]
GAIN_FROM = 20.0  # degC, where a sensor with a wrong gain reads right
HEATED_TAU_S = 300.0
AMBIENT = "T_ambient"


@dataclass(frozen=True, kw_only=True)
class Measured:
    """One recording without noise.

    Attributes
    ----------
    hours : Array, shape (rows,)
        Since the first row of the first recording of the session, [h]
    row_s : float
        Interval of the rows, [s]
    inputs : mapping of str to Array, shape (rows,)
        By their names in the nominal network
    readings : mapping of str to Array, shape (rows,)
        By channel, [degC]
    P_loss : Array, shape (rows,)
        Total loss [W], measured or not
    """

    hours: Array
    row_s: float
    inputs: Mapping[str, Array]
    readings: Mapping[str, Array]
    P_loss: Array


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A fault of given strength.

    Attributes
    ----------
    kind : str
        ``bias`` [K], ``gain`` (of the distance to 20 degC), ``drift`` [K/h], ``lag`` [s], ``stuck`` [h] and ``swapped``
        of temperature sensors; ``clock`` [s], by which all temperatures are stamped late; ``offset`` and ``input_gain``
        of a recorded input; ``heated``: share of a neighbour's warmth in the ambient probe
    channels : tuple of str
        Channels or the input; of ``clock`` ``clock``
    nodes : tuple of str
        Nominal nodes of the channels
    near : str
        Of ``heated``: channel of the warm neighbour
    strength : float
        >= 0, in the unit of its kind
    course : TimeCourse
        Of ``stuck`` only its start counts
    """

    kind: FaultKind
    channels: tuple[str, ...]
    nodes: tuple[str, ...] = ()
    near: str = ""
    strength: float
    sign: int = 1
    course: TimeCourse = ALWAYS

    @property
    def what(self) -> Literal["sensor", "input", "clock"]:
        """Kind of thing that it changed, as the truth names it."""
        if self.kind == "clock":
            return "clock"
        return "input" if self.kind in ("offset", "input_gain", "heated") else "sensor"

    @property
    def direction(self) -> int:
        """Sign of the error; 0 where it has none."""
        return 0 if self.kind in ("stuck", "swapped") else self.sign


@dataclass(frozen=True, kw_only=True)
class FaultMaker:
    """Kind of fault: unit and greatest strength.

    Attributes
    ----------
    fault : str
        Kind of the :class:`Fault`
    cap, least : float
        Greatest strength that happens, and the least that stands out of ordinary errors of instruments; of a torque's
        offset in units of the highest torque
    signed : bool
        True if it may go either way
    in_catalogue : bool
        True if the catalogue has a mechanism of its name
    """

    fault: FaultKind
    unit: str
    cap: float
    law: str
    signed: bool = True
    least: float = 0.0
    in_catalogue: bool = True


SENSOR_FAULTS: Mapping[str, FaultMaker] = {
    "sensor_bias": FaultMaker(fault="bias", unit="K", cap=8.0, least=0.3, law="reading + a"),
    "sensor_gain": FaultMaker(fault="gain", unit="1", cap=0.15, law="reading + a (reading - 20 degC)"),
    "sensor_drift": FaultMaker(fault="drift", unit="K/h", cap=0.5, law="reading + a t, t in hours over all recordings"),
    "sensor_lag": FaultMaker(fault="lag", unit="s", cap=900.0, signed=False,
                             law="a first-order lag of a seconds more"),
    "sensor_stuck": FaultMaker(fault="stuck", unit="h", cap=12.0, signed=False,
                               law="the reading stands still for a hours"),
    "swapped_channels": FaultMaker(fault="swapped", unit="1", cap=1.0, signed=False, law="two channels exchanged"),
    "clock_offset": FaultMaker(fault="clock", unit="s", cap=600.0, least=6.0,
                               law="temperatures are stamped a seconds late"),
}  # fmt: skip
INPUT_FAULTS: Mapping[str, FaultMaker] = {
    "torque_offset": FaultMaker(fault="offset", unit="N m", cap=0.15, least=0.01, law="recorded torque = true + a"),
    "torque_gain": FaultMaker(fault="input_gain", unit="1", cap=0.2, least=0.02,
                              law="recorded torque = true (1 + a)"),
    "speed_gain": FaultMaker(fault="input_gain", unit="1", cap=0.15, least=0.004,
                             law="recorded speed = true (1 + a)"),
    "heater_power_gain": FaultMaker(fault="input_gain", unit="1", cap=0.2, least=0.02,
                                    law="recorded power = true (1 + a)", in_catalogue=False),
    "ambient_probe_offset": FaultMaker(fault="offset", unit="K", cap=8.0, least=0.5,
                                       law="recorded ambient = true + a"),
    "ambient_probe_heated": FaultMaker(fault="heated", unit="1", cap=0.3, signed=False,
                                       law="recorded ambient = true + a (neighbour - true), 300 s late"),
}  # fmt: skip


def input_of(name: str) -> str:
    """Input that a fault of :data:`INPUT_FAULTS` spoils."""
    return AMBIENT if name.startswith("ambient") else name.rpartition("_")[0]


def spoiled(measured: Measured, fault: Fault) -> Measured:
    """The recording with a fault; of noisy readings :func:`hold_reading` does what ``stuck`` does."""
    if fault.what == "input":
        (name,) = fault.channels
        return replace(measured, inputs={**measured.inputs, name: _spoiled_input(measured, fault)})
    share, a = fault.course.share(measured.hours), fault.sign * fault.strength
    readings = dict(measured.readings)
    if fault.kind == "swapped":
        one, other = fault.channels
        there = share > 0.5
        readings[one] = np.where(there, measured.readings[other], measured.readings[one])
        readings[other] = np.where(there, measured.readings[one], measured.readings[other])
        return replace(measured, readings=readings)
    for name in readings if fault.kind == "clock" else fault.channels:
        if fault.kind == "stuck":
            readings[name] = hold_reading(readings[name], measured, fault)
        else:
            readings[name] = _SPOIL[fault.kind](readings[name], a, share, measured, fault.course)
    return replace(measured, readings=readings)


def hold_reading(values: Array, measured: Measured, fault: Fault) -> Array:
    """A stuck sensor repeats its last reading, noise and all, from the start of its course for so many hours."""
    held = (measured.hours >= fault.course.begins) & (measured.hours < fault.course.begins + fault.strength)
    return np.where(held, values[int(np.argmax(held))], values)


def _spoiled_input(measured: Measured, fault: Fault) -> Array:
    (name,) = fault.channels
    true, a = measured.inputs[name], fault.sign * fault.strength * fault.course.share(measured.hours)
    if fault.kind == "offset":
        return np.asarray(true + a)
    if fault.kind == "input_gain":
        return np.asarray(true * (1.0 + a))
    return np.asarray(true + a * lagged(measured.readings[fault.near] - true, HEATED_TAU_S, measured.row_s))


_Spoil = Callable[[Array, float, Array, Measured, TimeCourse], Array]


def _drifted(values: Array, a: float, share: Array, m: Measured, course: TimeCourse) -> Array:
    start = max(course.begins, 0.0)
    return np.asarray(values + a * np.clip(np.minimum(m.hours, course.ends) - start, 0.0, None) * (share > 0.0))


def _slowed(values: Array, a: float, share: Array, m: Measured, _: TimeCourse) -> Array:
    return np.asarray((1.0 - share) * values + share * lagged(values, max(a, 1e-9), m.row_s))


def _late(values: Array, a: float, share: Array, m: Measured, _: TimeCourse) -> Array:
    time = m.hours * 3600.0
    return np.asarray(np.interp(time - a * share, time, values))


_SPOIL: Mapping[str, _Spoil] = {
    "bias": lambda values, a, share, _m, _c: np.asarray(values + a * share),
    "gain": lambda values, a, share, _m, _c: np.asarray(values + a * share * (values - GAIN_FROM)),
    "drift": _drifted,
    "lag": _slowed,
    "clock": _late,
}
