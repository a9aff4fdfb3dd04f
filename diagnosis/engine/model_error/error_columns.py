"""The unknowns of model error and their columns."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from diagnosis.engine.fit import Experiment, Linear
from diagnosis.engine.learnt import ErrorClass
from diagnosis.engine.model_error.anatomy import Anatomy
from diagnosis.engine.model_error.courses import Standard, View
from diagnosis.engine.model_error.groups import GROUPS, Change, HeatChange
from diagnosis.engine.point import Point, columns_at_once
from diagnosis.forward.grid import ErrorCourse
from models.base.types import Array


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelError:
    """The unknowns of model error of one experiment: the same for all its pieces, in one order.

    Attributes
    ----------
    standard : Standard
        Sizes that make the unknowns dimensionless
    changes : tuple of Change
        All changes, each with one unknown or more
    of_changes : tuple of str
        Group of every change
    """

    standard: Standard
    changes: tuple[Change, ...]
    of_changes: tuple[str, ...]

    @classmethod
    def of(cls, experiment: Experiment) -> ModelError:
        """Unknowns of a machine with its recordings, whose sizes are those at the middles of the priors.

        Raises
        ------
        ArithmeticError
            If the temperatures leave all bounds at the middles of the priors.
        """
        middles = np.zeros(len(experiment.unknowns))
        points = [experiment.point(index, middles) for index in range(len(experiment.pieces))]
        machine = Anatomy(experiment, points)
        found = [(group, change) for group, declare in GROUPS.items() for change in declare(machine)]
        groups, changes = zip(*found, strict=True)
        return cls(standard=machine.standard, changes=changes, of_changes=groups)

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Name of every unknown: place and course."""
        return tuple(f"{group}: {label}" for group, change in zip(self.of_changes, self.changes, strict=True)
                     for label in change.labels)  # fmt: skip

    @cached_property
    def groups(self) -> tuple[str, ...]:
        """Group of every unknown."""
        return tuple(group for group, change in zip(self.of_changes, self.changes, strict=True) for _ in change.labels)

    def amplitudes(self, one: ErrorClass) -> Array:
        """Amplitude of every unknown in a class, 0 of those that are absent, shape (unknowns,)."""
        return np.array([one.amplitudes.get(group, 0.0) for group in self.groups])

    def columns(self, point: Point, first: int, last: int, wanted: NDArray[np.bool_] | None = None) -> ErrorCourse:
        """Change per unit of the unknowns from `first` up to `last` (excluded), heat with rates of coupled states.

        The point may be that of an extended machine: everything is found by its name.

        Parameters
        ----------
        wanted : Array of bool, shape (unknowns,), optional
            Changes of which no unknown is wanted are left zero
        """
        view, (points, channels) = View(point, self.standard), point.read.shape
        into = np.zeros((points - 1, point.trajectory.decay.shape[-1], last - first))
        loss, reading = np.zeros((points - 1, last - first)), np.zeros((points, channels, last - first))
        for change, begin, end in self.between(first, last):
            low, high = max(begin, first), min(end, last)
            mine = slice(low - first, high - first)
            if wanted is not None and not wanted[begin:end].any():
                continue
            if isinstance(change, HeatChange):
                heat, course = change.heat(view), change.course.along(view)[:, low - begin : high - begin]
                for part in np.flatnonzero(heat.into.any(axis=0)):  # few
                    into[:, part, mine] = heat.into[:, part, None] * course
                loss[:, mine] = heat.loss[:, None] * course
            else:
                reading[:, point.sensors.channels.index(change.channel), mine.start] = change.reading(
                    view, change.channel
                )
        return ErrorCourse(heat=into, loss=loss, reading=reading)

    def whitened(self, part: Linear) -> Array:
        """Whitened columns of all unknowns per unit, shape (M, unknowns)."""
        result = np.empty((len(part.residual), len(self.groups)))
        for begin, end in self._chunks(part.point):
            result[:, begin:end] = part.filter(_recorded(part.point, self.columns(part.point, begin, end)))
        return result

    def combined_responses(self, point: Point, combinations: Array) -> Array:
        """Change of what is recorded per unit of combinations of the unknowns, shape (K + 1, channels, n)."""
        return _recorded(point, self._combined(point, combinations))

    def courses(self, point: Point, combinations: Array) -> ErrorCourse:
        """Courses of combinations of the unknowns, shape (unknowns, n), along a piece, to simulate with."""
        found = self._combined(point, combinations)
        return replace(found, heat=np.ascontiguousarray(found.heat[:, : point.machine.model.n]))

    def _combined(self, point: Point, combinations: Array) -> ErrorCourse:
        """Change per unit of combinations; see :meth:`columns`."""
        (points, channels), count = point.read.shape, combinations.shape[1]
        wanted = np.asarray(combinations.any(axis=1))
        heat = np.zeros((points - 1, point.trajectory.decay.shape[-1], count))
        loss, reading = np.zeros((points - 1, count)), np.zeros((points, channels, count))
        for begin, end in self._chunks(point):
            found, some = self.columns(point, begin, end, wanted), combinations[begin:end]
            for part in range(heat.shape[1]):
                acting = np.flatnonzero(found.heat[:, part].any(axis=0))  # most heat few parts
                heat[:, part] += found.heat[:, part, acting] @ some[acting]
            loss += found.loss @ some
            acting = np.flatnonzero(found.reading.any(axis=(0, 1)))
            reading += found.reading[:, :, acting] @ some[acting]
        return ErrorCourse(heat=heat, loss=loss, reading=reading)

    def _chunks(self, point: Point) -> Iterator[tuple[int, int]]:
        """Ranges of so many unknowns as memory allows at once."""
        size, count = columns_at_once(len(point.piece.steps)), len(self.groups)
        return ((begin, min(begin + size, count)) for begin in range(0, count, size))

    def between(self, first: int, last: int) -> Iterator[tuple[Change, int, int]]:
        """Changes with unknowns in a range; the first unknown of each and the one after its last."""
        begin = 0
        for change in self.changes:
            end = begin + len(change.labels)
            if end > first and begin < last:
                yield change, begin, end
            begin = end


def _recorded(point: Point, found: ErrorCourse) -> Array:
    """Change of what is recorded by heats and readings, shape (K + 1, channels, n)."""
    return point.heated(found.heat, found.loss) + point.setting.passed_on(point.trajectory, found.reading)
