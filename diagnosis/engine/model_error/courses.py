r"""Courses over time with which a model error may act: smooth functions of operation and temperature, lags, hours.

The smooth ones are the truncated expansion of a squared-exponential kernel of length 1 in standardised coordinates c,

.. math:: \phi_e(c) = e^{-|c|^2/2} \prod_k c_k^{e_k} / \sqrt{e_k!}

so that their sum with independent weights of standard deviation a is nearly a Gaussian process of standard deviation a.

References
----------
Rasmussen, Williams, Gaussian Processes for Machine Learning (2006), sections 2.2 and 4.3.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from math import factorial
from typing import Protocol

import numpy as np
import sympy as sp

from diagnosis.engine.point import Point
from diagnosis.forward.observation import boundary_temperatures, to_points
from diagnosis.forward.recurrence import lagged
from models.base.types import Array
from models.formulas.extremes import Max, Min
from models.network.laws import symbol

SPEED, TORQUE, TEMPERATURE = "speed", "torque", "temperature"
FARTHEST, WIDTH = 3.0, 1.5  # in standard deviations: where a coordinate is held, and the length of the kernel
LAG_S, LAG_REACH = 900.0, 2.0
OWN_SPAN_K, OWN_REACH = 10.0, 3.0
START_S = 3600.0


@dataclass(frozen=True, kw_only=True)
class Coordinate:
    """Standardisation of one coordinate over the rows to learn from.

    Attributes
    ----------
    mean, sd : float
        Of the logarithm for speed and torque, [-]; [K] for the temperature, else in the unit of the input
    floor : float
        Least size of speed [1/min] or torque [N m]; 0 for a coordinate without logarithm
    """

    mean: float
    sd: float
    floor: float = 0.0

    def standardised(self, raw: Array) -> Array:
        """Held within :data:`FARTHEST` standard deviations, in lengths of the kernel."""
        value = np.log(np.maximum(np.abs(raw), self.floor)) if self.floor > 0.0 else raw
        return np.asarray(np.clip((value - self.mean) / self.sd, -FARTHEST, FARTHEST) / WIDTH)

    def law(self, raw: sp.Expr) -> sp.Expr:
        """The standardised coordinate as an expression."""
        value = sp.log(Max(sp.Abs(raw), self.floor)) if self.floor > 0.0 else raw
        return Min(Max((value - self.mean) / self.sd, -FARTHEST), FARTHEST) / WIDTH


@dataclass(frozen=True, kw_only=True, eq=False)
class Standard:
    """Sizes that hold for all pieces, so that an unknown means the same in each.

    Attributes
    ----------
    coordinates : mapping of str to Coordinate
        Speed, torque, temperature and further inputs; those that never act are absent
    warm : tuple of str
        Parts whose mean is the temperature that laws depend on: the oil, or the parts that sources heat
    largest : mapping of str to float
        Largest size of every input, in its unit
    drive : float
        Change of speed [1/min], or of the heat [W] without speed, that counts as one
    hours_s : float
        Time that counts as one, [s]
    heat : float
        Mean heat of all sources, [W]
    conductance : float
        This heat over the mean rise of the parts above ambient, [W/K]
    """

    coordinates: Mapping[str, Coordinate]
    warm: tuple[str, ...]
    largest: Mapping[str, float]
    drive: float
    hours_s: float
    heat: float
    conductance: float

    def coordinate_law(self, coordinate: str) -> sp.Expr:
        """A standardised coordinate as an expression of the network's signals."""
        raw = symbol(coordinate)
        if coordinate == TEMPERATURE:
            raw = sp.Add(*(symbol(f"T_{part}") for part in self.warm)) / len(self.warm)
        return self.coordinates[coordinate].law(raw)


class View:
    """Courses of one piece by name."""

    def __init__(self, point: Point, standard: Standard) -> None:
        self.point, self.standard = point, standard
        self.model, self.trajectory, self.piece = point.machine.model, point.trajectory, point.piece
        network = self.model.network
        self.links = {link.name: index for index, link in enumerate(network.links)}
        self.sources = {source.name: index for index, source in enumerate(network.sources)}
        self._features: dict[tuple[tuple[str, ...], tuple[int, ...]], Array] = {}

    @cached_property
    def boundaries(self) -> Mapping[str, Array]:
        """Temperatures of the boundaries at the middles of the intervals, shape (K,), [degC]."""
        return boundary_temperatures(self.model, self.trajectory)

    def temperature(self, *nodes: str) -> Array:
        """Mean temperature of nodes at the middles of the intervals, shape (K,), [degC]."""
        T, parts = self.trajectory.middle, self.model.parts
        found = [T[:, parts.index(node)] if node in parts else self.boundaries[node] for node in nodes]
        return np.asarray(np.mean(found, axis=0))

    def temperature_at_points(self, node: str) -> Array:
        """Temperature of a node at the grid points, shape (K + 1,), [degC]."""
        parts = self.model.parts
        if node in parts:
            return np.asarray(self.trajectory.T[:, parts.index(node)])
        return to_points(self.boundaries[node])

    def input(self, name: str) -> Array:
        """Mean of an input over the intervals, shape (K,)."""
        return np.asarray(self.piece.inputs[:, self.point.machine.inputs.index(name)])

    @cached_property
    def coordinates(self) -> Mapping[str, Array]:
        """All standardised coordinates, shape (K,)."""
        return {
            name: one.standardised(self.temperature(*self.standard.warm) if name == TEMPERATURE else self.input(name))
            for name, one in self.standard.coordinates.items()
        }

    @cached_property
    def drive(self) -> Array:
        """The quantity that sets the machine's load: its speed, or the heat of all sources; shape (K,)."""
        return self.input(SPEED) if SPEED in self.standard.coordinates else self.point.balance.sources.sum(axis=1)

    def feature(self, names: tuple[str, ...], powers: tuple[int, ...]) -> Array:
        """One smooth function of some coordinates, shape (K,); kept, since many laws use it."""
        if (names, powers) not in self._features:
            c = np.stack([self.coordinates[name] for name in names])
            product = np.prod(c ** np.array(powers)[:, None], axis=0)
            value = np.exp(-0.5 * np.sum(c * c, axis=0)) * product / _scale(powers)
            self._features[names, powers] = value
        return self._features[names, powers]


def _scale(powers: tuple[int, ...]) -> float:
    return float(np.sqrt(np.prod([factorial(power) for power in powers])))


class Course(Protocol):
    """Some functions of time."""

    @property
    def labels(self) -> tuple[str, ...]:
        """One name per function."""

    def along(self, view: View) -> Array:
        """Values at the middles of the intervals, shape (K, functions), [-]."""


@dataclass(frozen=True, kw_only=True)
class Single:
    """One function of time.

    Attributes
    ----------
    label : str
        Its name
    values : callable
        Its values at the middles of the intervals of a view, shape (K,), [-]
    """

    label: str
    values: Callable[[View], Array]

    @property
    def labels(self) -> tuple[str, ...]:
        """Its name."""
        return (self.label,)

    def along(self, view: View) -> Array:
        """The function."""
        return self.values(view)[:, None]


@dataclass(frozen=True, kw_only=True)
class Smooth:
    """All smooth functions of some coordinates from degree `lowest` to `highest`."""

    coordinates: tuple[str, ...]
    lowest: int = 1
    highest: int

    @property
    def powers(self) -> Iterator[tuple[int, ...]]:
        """Exponents of the functions."""
        of_any = product(range(self.highest + 1), repeat=len(self.coordinates))
        return (powers for powers in of_any if self.lowest <= sum(powers) <= self.highest)

    @property
    def labels(self) -> tuple[str, ...]:
        """Coordinates with their exponents."""
        return tuple(
            " ".join(f"{name}^{power}" for name, power in zip(self.coordinates, powers, strict=True) if power)
            for powers in self.powers
        )

    def along(self, view: View) -> Array:
        """The functions."""
        return np.stack([view.feature(self.coordinates, powers) for powers in self.powers], axis=1)

    def law(self, standard: Standard, values: Array) -> sp.Expr:
        """Sum of the functions times `values`, shape (functions,), of the network's signals."""
        c = [standard.coordinate_law(name) for name in self.coordinates]
        terms = (
            value / _scale(powers) * sp.Mul(*(x**power for x, power in zip(c, powers, strict=True)))
            for value, powers in zip(values.tolist(), self.powers, strict=True)
        )
        return sp.exp(-sp.Add(*(x**2 for x in c)) / 2) * sp.Add(*terms)


@dataclass(frozen=True, kw_only=True)
class OwnTemperature:
    """By how much warmer than the oil a loss's own parts are: x, x^2/2, and x with the speed."""

    nodes: tuple[str, ...]
    coordinates: tuple[str, ...]

    @property
    def labels(self) -> tuple[str, ...]:
        """Powers of the difference."""
        return ("own^1", "own^2", *(f"own^1 {name}^1" for name in self.coordinates))

    def along(self, view: View) -> Array:
        """The functions, per :data:`OWN_SPAN_K`."""
        x = (view.temperature(*self.nodes) - view.temperature(*view.standard.warm)) / OWN_SPAN_K
        x = np.clip(x, -OWN_REACH, OWN_REACH)
        return np.stack([x, 0.5 * x * x, *(x * view.coordinates[name] for name in self.coordinates)], axis=1)


def _lagged_drive(view: View) -> Array:
    """By how much faster, or hotter, the machine ran before."""
    middle = view.piece.middle
    change = (lagged(view.drive, np.diff(middle), LAG_S) - view.drive) / view.standard.drive
    return np.asarray(np.clip(change, -LAG_REACH, LAG_REACH))


CONSTANT = Single(label="constant", values=lambda view: np.ones(len(view.piece.steps)))
LAGGED_DRIVE = Single(label="before", values=_lagged_drive)
SINCE_START = Single(label="hours", values=lambda view: view.piece.middle / view.standard.hours_s)
AFTER_START = Single(label="after start", values=lambda view: np.exp(-view.piece.middle / START_S))
