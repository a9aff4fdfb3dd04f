"""One piece of a recording, simulated at some values of the unknowns, and what is linear about it there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from diagnosis.engine.slopes import LawSlopes
from diagnosis.forward.grid import Piece
from diagnosis.forward.network_on_grid import Balance, NetworkOnGrid
from diagnosis.forward.observation import Sensors, reading_columns, readings
from diagnosis.forward.recorder import PASSES
from diagnosis.forward.sensor_fault import delayed
from diagnosis.forward.term_on_grid import TermOnGrid, moved_heat
from diagnosis.forward.trajectory import Heat, Trajectory, parameter_heat, settled_balance
from models.base.types import Array
from models.correction.instruments import Mix
from models.quantities.quantities import is_total_loss
from models.terms.term import Term

FEWEST_AT_ONCE, AT_ONCE = 16, 256  # columns that go through the network and the filter together
VALUES_AT_ONCE = 800_000  # of heats that are held together, per part: bounds the memory of long recordings
MEMORY_STEP = 0.02  # of a prior sd, for parameters that decide on switches and memories


def columns_at_once(intervals: int) -> int:
    """How many columns of so many intervals are held together."""
    return max(FEWEST_AT_ONCE, min(AT_ONCE, VALUES_AT_ONCE // intervals))


class Machine:
    """A network on the grid with the terms outside it, and all derivatives of its laws.

    Parameters
    ----------
    terms : sequence of Term
        What shifts an input or distorts a reading
    mixes : mapping of str to sequence of Mix, optional
        Other nodes that thermometers feel, by channel
    """

    def __init__(
        self, model: NetworkOnGrid, terms: Sequence[Term] = (), mixes: Mapping[str, Sequence[Mix]] | None = None
    ) -> None:
        self.model, self.terms, self.mixes = model, tuple(terms), mixes or {}
        self.inputs = model.laws.inputs
        self.parameter_index = {p.name: i for i, p in enumerate(model.network.parameters)}
        self.on_grid = {term.label: TermOnGrid(model, term) for term in terms}

    @cached_property
    def slopes(self) -> LawSlopes:
        """Derivatives of the laws by parameters that vary, inputs and losses."""
        network = self.model.network
        varying = [p.name for p in network.parameters if p.sd > 0.0 and p.name not in self.model.remembered]
        return LawSlopes(self.model, [*varying, *self.inputs, *(f"P_{c}" for c in network.components)])

    @property
    def shifts(self) -> list[TermOnGrid]:
        """Terms that shift an input."""
        return [on_grid for on_grid in self.on_grid.values() if on_grid.term.kind == "signal"]

    @property
    def passes(self) -> int:
        """Simulations of a piece before its inputs have followed its own temperatures."""
        return PASSES if any(shift.follows for shift in self.shifts) else 1

    @property
    def distortions(self) -> list[TermOnGrid]:
        """Terms that distort a reading."""
        return [on_grid for on_grid in self.on_grid.values() if on_grid.term.kind == "sensor"]


@dataclass(kw_only=True, eq=False)
class Setting:
    """Values with which one piece is simulated and read; unknowns write into it."""

    machine: Machine
    recording: str
    sensors: Sensors
    values: Array
    samples: Array
    of_terms: dict[str, float]
    clock: float = 0.0

    @classmethod
    def of(cls, machine: Machine, piece: Piece) -> Setting:
        """As delivered: parameters at their start, ideal sensors, inputs as recorded."""
        count = len(piece.channels)
        return cls(
            machine=machine, recording=piece.recording,
            sensors=Sensors(channels=piece.channels, lag=np.zeros(count), bias=np.zeros(count), mixes=machine.mixes),
            values=machine.model.start.copy(), samples=np.array(piece.samples),
            of_terms={p.name: p.start for term in machine.terms for p in term.parameters},
        )  # fmt: skip

    def values_of(self, on_grid: TermOnGrid) -> Array:
        """Values of the parameters of a term outside the network."""
        return np.array([self.of_terms[p.name] for p in on_grid.term.parameters])

    def piece(self, piece: Piece, known: Trajectory | None) -> Piece:
        """The piece with its inputs as they probably were."""
        piece = replace(piece, samples=self.samples, lags=self.sensors.lag)
        for shift in self.machine.shifts:
            piece = shift.adjusted(piece, self.values_of(shift), known)
        clocks = [d.constant(self.values_of(d)) for d in self.machine.distortions if d.term.form == "clock"]
        late = self.clock + sum(clocks)
        return replace(piece, late_s=late) if late else piece

    def read(self, trajectory: Trajectory) -> Array:
        """Readings of the sensors, faults included, shape (K + 1, channels)."""
        read = readings(self.machine.model, trajectory, self.sensors)
        for fault in self.machine.distortions:
            read = fault.distorted(trajectory, self.sensors, read, self.values_of(fault))
        return self._by_clock(trajectory, read)

    def passed_on(self, trajectory: Trajectory, changes: Array) -> Array:
        """Changes of readings as faulty sensors and clock show them, shape (K + 1, channels, ...)."""
        for fault in self.machine.distortions:
            changes = fault.passed_on(trajectory, self.sensors, changes, self.values_of(fault))
        return self._by_clock(trajectory, changes)

    def _by_clock(self, trajectory: Trajectory, read: Array) -> Array:
        if not self.clock:
            return read
        late = delayed(read, trajectory.piece.time, self.clock)
        losses = [is_total_loss(name) for name in self.sensors.channels]
        late[:, losses] = read[:, losses]
        return late


@dataclass(frozen=True, kw_only=True, eq=False)
class Column:
    """Effect of one unknown per unit: heat in the network, a change of the readings, or both.

    Attributes
    ----------
    reading : Array, shape (K + 1, channels), or None
        Change of the readings of sound sensors, [K] or [W]
    shown : Array, shape (K + 1, channels), or None
        Change of what is recorded, faults of sensors and clock included
    """

    heat: Heat | None = None
    reading: Array | None = None
    shown: Array | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Point:
    """One piece at some values of the unknowns.

    Attributes
    ----------
    read : Array, shape (K + 1, channels)
        What the sensors read, [degC] or [W]
    """

    setting: Setting
    trajectory: Trajectory
    read: Array

    @property
    def piece(self) -> Piece:
        """The piece, with its inputs as they probably were."""
        return self.trajectory.piece

    @property
    def machine(self) -> Machine:
        """The machine that is simulated."""
        return self.setting.machine

    @property
    def sensors(self) -> Sensors:
        """The sensors."""
        return self.setting.sensors

    @property
    def residual(self) -> Array:
        """Measured minus read, shape (K + 1, channels), NaN where nothing was measured."""
        return np.asarray(self.piece.measured - self.read)

    @property
    def residual_without_error(self) -> Array:
        """Measured minus read without the model error that was assumed, to first order, shape (K + 1, channels)."""
        error = self.piece.error
        if error is None:
            return self.residual
        into = np.pad(error.heat, ((0, 0), (0, len(self.machine.model.coupled))))
        shown = self.setting.passed_on(self.trajectory, error.reading[:, :, None])
        return np.asarray(self.residual + (self.heated(into[:, :, None], error.loss[:, None]) + shown)[:, :, 0])

    @cached_property
    def balance(self) -> Balance:
        """The heat balance along the trajectory."""
        return settled_balance(self.machine.model, self.trajectory)

    @cached_property
    def _heats(self) -> dict[str, Heat]:
        return self.machine.slopes.along(self.trajectory, self.balance)

    def heat_per(self, name: str) -> Heat:
        """Net heat per unit of a parameter or of an input that no loss depends on."""
        model = self.machine.model
        if name not in model.remembered:
            return self._heats[name]
        index = self.machine.parameter_index[name]
        p, value = model.network.parameters[index], float(self.trajectory.values[index])
        step = MEMORY_STEP * p.sd * (value if p.log else 1.0)
        return parameter_heat(model, self.trajectory, index, step)

    def heat_per_relative(self, name: str) -> Heat:
        """Net heat per relative change of an input, through the losses too."""
        trajectory, at = self.trajectory, self.machine.inputs.index(name)
        if name == "torque":
            heat = self.heat_per(name) * trajectory.piece.inputs[:, at]
            components = self.machine.model.network.components
            for component, slope in zip(components, trajectory.tangent.torque_slope.T, strict=True):
                heat = heat + self._heats[f"P_{component}"] * slope
            return heat
        samples, step = np.array(trajectory.piece.samples), 0.01
        samples[..., at] *= 1.0 + step
        return self.moved_heat(samples, step)

    def moved_heat(self, samples: Array, step: float) -> Heat:
        """Net heat per unit of a change of the inputs by so many units, shape of `samples` (K, S, inputs)."""
        piece = replace(self.piece, samples=samples)
        return moved_heat(self.machine.model, self.trajectory, piece) / step

    def term_column(self, label: str, name: str, per_z: float, step_z: float) -> Column:
        """Column of a parameter of a term outside the network, by a difference."""
        term, trajectory, step = self.machine.on_grid[label], self.trajectory, step_z * per_z
        values = self.setting.values_of(term)
        moved = values + step * np.array([p.name == name for p in term.term.parameters])
        if term.term.kind == "sensor":
            read = readings(self.machine.model, trajectory, self.sensors)
            there = term.distorted(trajectory, self.sensors, read, moved)
            here = term.distorted(trajectory, self.sensors, read, values)
            return Column(shown=(there - here) / step * per_z)
        # The trajectory's piece is shifted already: only the difference is added.
        there = term.adjusted(trajectory.piece, moved, trajectory).samples
        here = term.adjusted(trajectory.piece, values, trajectory).samples
        return Column(heat=self.moved_heat(trajectory.piece.samples + there - here, step) * per_z)

    def clock_column(self) -> Array:
        """Change of the readings per second of delay, shape (K + 1, channels)."""
        there, here = (
            replace(self.setting, clock=self.setting.clock + way).read(self.trajectory) for way in (1.0, -1.0)
        )
        return np.asarray(0.5 * (there - here))

    def reading(self, channel: str, values: Array) -> Array:
        """A change of one channel, shape (K + 1, channels)."""
        result = np.zeros(self.read.shape)
        result[:, self.sensors.channels.index(channel)] = values
        return result

    def heated(self, into: Array, loss: Array) -> Array:
        """Change of the readings for many heats in one pass.

        Parameters
        ----------
        into : Array, shape (K, parts + coupled, columns)
            See :class:`diagnosis.forward.trajectory.Heat`
        loss : Array, shape (K, columns)

        Returns
        -------
        Array, shape (K + 1, channels, columns)
        """
        T = self.trajectory.response(into)
        read = reading_columns(self.machine.model, self.trajectory, self.sensors, T, loss)
        return self.setting.passed_on(self.trajectory, read)

    def responses(self, columns: Sequence[Column]) -> Array:
        """Change of the readings per unit of many columns, in one pass, shape (K + 1, channels, columns)."""
        result = np.zeros((*self.read.shape, len(columns)))
        for i, column in enumerate(columns):
            if column.reading is not None:
                result[:, :, i] = column.reading
        result = self.setting.passed_on(self.trajectory, result)
        for i, column in enumerate(columns):
            if column.shown is not None:
                result[:, :, i] += column.shown
        heated = [i for i, column in enumerate(columns) if column.heat is not None]
        for first in range(0, len(heated), AT_ONCE):
            some = heated[first : first + AT_ONCE]
            heats = [heat for i in some if (heat := columns[i].heat) is not None]
            into, loss = (np.stack(each, axis=-1) for each in zip(*((h.into, h.loss) for h in heats), strict=True))
            result[:, :, some] += self.heated(into, loss)
        return result
