"""Unknowns of an explanation: small classes with a value and a column.

Every unknown is a standard normal number ``z``. It has a `value`, it can `act` on a simulation, and its `column` is the
exact derivative of the readings. Parameters of a calibration, faults of measurement and candidates all are unknowns.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from diagnosis.engine.point import Column, Point, Setting
from diagnosis.forward.observation import delay_column, to_points
from diagnosis.forward.recurrence import lagged
from models.network.laws import Parameter
from models.quantities.quantities import TOTAL_LOSS

Scope = frozenset[str] | None
LAG_STEP = 0.01  # relative
TERM_STEP = 0.05  # of a prior sd


@dataclass(frozen=True, kw_only=True)
class Unknown(ABC):
    """One number with a normal or log-normal prior.

    Attributes
    ----------
    parameter : Parameter
        Start, prior and bounds
    scope : frozenset of str, or None
        Recordings in which it is there; None for all
    """

    parameter: Parameter
    scope: Scope = None

    def value(self, z: float) -> float:
        """Value at `z`, held at the bounds."""
        p = self.parameter
        value = p.start * np.exp(p.sd * z) if p.log else p.start + p.sd * z
        return float(min(max(value, p.lower), p.upper))

    def z_of(self, value: float) -> float:
        """The ``z`` of the nearest possible value."""
        p = self.parameter
        value = min(max(value, p.lower), p.upper)
        return float(np.log(value / p.start) / p.sd if p.log else (value - p.start) / p.sd)

    def per_z(self, z: float) -> float:
        """Change of the value with `z`, at a bound that to the inside."""
        return self.value(z) * self.parameter.sd if self.parameter.log else self.parameter.sd

    def bounds(self) -> tuple[float, float]:
        """Lowest and highest ``z``."""
        p = self.parameter
        return -np.inf if p.log and p.lower <= 0.0 else self.z_of(p.lower), self.z_of(p.upper)

    @abstractmethod
    def act(self, setting: Setting, z: float) -> None:
        """Put the value into what is simulated and read."""

    @abstractmethod
    def column(self, point: Point, z: float) -> Column:
        """Derivative of the readings with respect to `z`."""


@dataclass(frozen=True, kw_only=True)
class NetworkParameter(Unknown):
    """A parameter of the network's laws."""

    def act(self, setting: Setting, z: float) -> None:
        """Set the parameter."""
        setting.values[setting.machine.parameter_index[self.parameter.name]] = self.value(z)

    def column(self, point: Point, z: float) -> Column:
        """Heat by the exact derivative of the laws."""
        return Column(heat=point.heat_per(self.parameter.name) * self.per_z(z))


@dataclass(frozen=True, kw_only=True)
class SensorBias(Unknown):
    """A constant error of a channel, [K] or [W]."""

    channel: str

    def act(self, setting: Setting, z: float) -> None:
        """Shift the readings."""
        setting.sensors.bias[setting.sensors.channels.index(self.channel)] += self.value(z)

    def column(self, point: Point, z: float) -> Column:
        """A constant."""
        return Column(reading=point.reading(self.channel, np.full(len(point.trajectory.T), self.per_z(z))))


@dataclass(frozen=True, kw_only=True)
class SensorLag(Unknown):
    """Time constant of a temperature sensor, [s]."""

    channel: str

    def act(self, setting: Setting, z: float) -> None:
        """Slow the sensor."""
        setting.sensors.lag[setting.sensors.channels.index(self.channel)] = self.value(z)

    def column(self, point: Point, z: float) -> Column:
        """Difference of the lagged course with the lag."""
        at = point.sensors.channels.index(self.channel)
        T, steps = point.trajectory.T[:, point.machine.model.part_index(self.channel)], point.piece.steps
        lag = float(point.sensors.lag[at])
        there, here = (lagged(T, steps, lag * (1.0 + way)) for way in (LAG_STEP, -LAG_STEP))
        slope = (there - here) / (2.0 * LAG_STEP * lag)
        return Column(reading=point.reading(self.channel, slope * self.per_z(z)))


@dataclass(frozen=True, kw_only=True)
class LossGain(Unknown):
    """Gain of the measured total loss, [-]."""

    def act(self, setting: Setting, z: float) -> None:
        """Scale the reading of the loss."""
        setting.sensors.loss_gain *= self.value(z)

    def column(self, point: Point, z: float) -> Column:
        """The loss itself."""
        loss = to_points(point.trajectory.loss)
        return Column(reading=point.reading(TOTAL_LOSS, loss * self.per_z(z)))


@dataclass(frozen=True, kw_only=True)
class LossDelay(Unknown):
    """Delay of the measured total loss behind the inputs, [s]."""

    def act(self, setting: Setting, z: float) -> None:
        """Delay the reading of the loss."""
        setting.sensors.loss_delay += self.value(z)

    def column(self, point: Point, z: float) -> Column:
        """Minus the rate of the loss."""
        slope = delay_column(point.trajectory, point.sensors.loss_delay) * point.sensors.loss_gain
        return Column(reading=point.reading(TOTAL_LOSS, slope * self.per_z(z)))


@dataclass(frozen=True, kw_only=True)
class InputGain(Unknown):
    """True over recorded value of an input, [-]."""

    input: str

    def act(self, setting: Setting, z: float) -> None:
        """Scale the input."""
        setting.samples[..., setting.machine.inputs.index(self.input)] *= self.value(z)

    def column(self, point: Point, z: float) -> Column:
        """Heat per relative change of the input, as it was taken in this simulation."""
        return Column(heat=point.heat_per_relative(self.input) * (self.per_z(z) / self.value(z)))


@dataclass(frozen=True, kw_only=True)
class InputOffset(Unknown):
    """True less recorded value of an input that no loss depends on, in its unit."""

    input: str

    def act(self, setting: Setting, z: float) -> None:
        """Shift the input."""
        setting.samples[..., setting.machine.inputs.index(self.input)] += self.value(z)

    def column(self, point: Point, z: float) -> Column:
        """Heat by the exact derivative of the laws."""
        return Column(heat=point.heat_per(self.input) * self.per_z(z))


@dataclass(frozen=True, kw_only=True)
class ClockOffset(Unknown):
    """Time by which the readings of temperatures come after the inputs, [s]."""

    def act(self, setting: Setting, z: float) -> None:
        """Delay the readings."""
        setting.clock += self.value(z)

    def column(self, point: Point, z: float) -> Column:
        """Difference of the delayed readings."""
        return Column(shown=point.clock_column() * self.per_z(z))


@dataclass(frozen=True, kw_only=True)
class TermParameter(Unknown):
    """A parameter of a term outside the network: an input shifted, or a reading distorted."""

    label: str
    step: float = TERM_STEP

    def act(self, setting: Setting, z: float) -> None:
        """Set the term's parameter."""
        setting.of_terms[self.parameter.name] = self.value(z)

    def column(self, point: Point, z: float) -> Column:
        """Difference of the shifted heat or of the distorted reading."""
        return point.term_column(self.label, self.parameter.name, self.per_z(z), self.step)


@dataclass(frozen=True, kw_only=True)
class Held(Unknown):
    """A parameter of a term that is not fitted.

    Attributes
    ----------
    of_recording : mapping of str to float
        Value in every recording; elsewhere the start of the parameter
    """

    of_recording: Mapping[str, float] = field(default_factory=dict)

    def value(self, z: float) -> float:  # noqa: ARG002 - of the protocol
        """The start of the parameter."""
        return self.parameter.start

    def z_of(self, value: float) -> float:  # noqa: ARG002 - of the protocol
        """Zero."""
        return 0.0

    def bounds(self) -> tuple[float, float]:
        """Zero and zero."""
        return 0.0, 0.0

    def act(self, setting: Setting, z: float) -> None:
        """Set the parameter in the network, or in the term outside it."""
        value = self.of_recording.get(setting.recording, self.value(z))
        index = setting.machine.parameter_index.get(self.parameter.name)
        if index is not None:
            setting.values[index] = value
        else:
            setting.of_terms[self.parameter.name] = value

    def column(self, point: Point, z: float) -> Column:  # noqa: ARG002 - of the protocol
        """Nothing."""
        return Column()


def in_scope(unknown: Unknown, recording: str) -> bool:
    """True if an unknown is there in a recording."""
    return unknown.scope is None or recording in unknown.scope
