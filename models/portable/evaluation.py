"""A compiled network with its losses and parameter values: what the solver integrates. numpy only.

This file and :mod:`models.portable.solver` also run inside the FMU, with the same generated law functions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

# Relative: inside an FMU these files form a package of another, unique name.
from .solver import Balance, LossesAt, error_weights, times

Array = NDArray[np.float64]
RPM = np.pi / 30.0
TORQUE_LOSS_FLOOR = RPM  # rad/s: below 1 rpm the loss torque goes linearly through zero, as the losses do
LEAST_POWER = 1e-6  # W; less is rounding at a shaft that stands


@dataclass(frozen=True, kw_only=True)
class Laws:
    """The laws of a network as functions and its structure as matrices.

    Attributes
    ----------
    parts, boundaries : tuple of str
        Nodes whose temperature is a state, and nodes of given temperature
    sources, losses_of_sources : tuple of str, tuple of bool
        Names of the sources, and which of them are mechanical losses
    inputs, parameters, states : tuple of str
        Names of the inputs without time, parameters, and extra states
    boundary : callable
        common signals -> temperatures of the boundaries, [degC]
    exchange : callable
        common signals -> conductances of the links that vary, [W/K]
    heat : callable
        common signals, losses -> heats of the sources [W], rates of the extra states, their updates
    fixed : callable
        parameters -> conductances that do not vary [W/K], heat capacities [J/K]
    varying : tuple of int
        Indices of the links that vary
    laplacian : Array, shape (links, parts, parts)
        Heat leaving the parts per conductance and temperature
    to_boundary : Array, shape (links, parts, boundaries)
    injection : Array, shape (sources, parts)
    updates : bool
        Whether an extra state has a discrete update
    numeric : tuple of callable
        Laws that were not traced: mapping of all signals by name -> number
    operating : callable or None
        common signals -> speed [1/min] and torque [N m] as the losses see them; None: the inputs of these names

    Notes
    -----
    Common signals, in order: time, inputs, temperatures of the parts, parameters, extra states, then the boundary
    function takes no more, the others the values of the numeric laws.
    """

    parts: tuple[str, ...]
    boundaries: tuple[str, ...]
    components: tuple[str, ...]
    sources: tuple[str, ...]
    losses_of_sources: tuple[bool, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    states: tuple[str, ...]
    boundary: Callable[..., tuple[Any, ...]]
    exchange: Callable[..., tuple[Any, ...]]
    heat: Callable[..., tuple[Any, ...]]
    fixed: Callable[..., tuple[Any, ...]]
    varying: tuple[int, ...]
    laplacian: Array
    to_boundary: Array
    injection: Array
    updates: bool = False
    numeric: tuple[Callable[[Mapping[str, Any]], Any], ...] = ()
    operating: Callable[..., tuple[Any, ...]] | None = None


class LossSource(Protocol):
    """The losses as the runtime needs them; see :class:`models.simulation.thermal_network.Losses`."""

    @property
    def temperature_nodes(self) -> tuple[str, ...]:
        """Nodes whose temperatures are read."""
        ...

    def power(self, speed: Any, torque: Any, temperatures: Any) -> Array:
        """Losses [W], shape (..., components)."""
        ...


class NoLosses:
    """Losses of a network whose heat sources are all laws: none."""

    components: tuple[str, ...] = ()
    temperature_nodes: tuple[str, ...] = ()
    reads: tuple[frozenset[str], ...] = ()

    def power(self, speed: Any, torque: Any, temperatures: Any) -> Array:  # noqa: ARG002
        """Losses of no component, shape (..., 0)."""
        return np.zeros((*np.shape(temperatures)[:-1], 0))

    def domain_distance(self, speed: Any, torque: Any, temperatures: Any) -> Array:  # noqa: ARG002
        """Zero everywhere, shape (...)."""
        return np.zeros(np.shape(temperatures)[:-1])


class NetworkSystem:
    """A network, its losses and parameter values: a :class:`models.portable.solver.System`.

    Parameters
    ----------
    parameters : sequence of float or Array
        Values of ``laws.parameters``, in order; arrays evaluate several variants at once
    vector : bool
        Whether `laws` work on arrays. Then states may have any shape (..., n) that the parameters broadcast to;
        otherwise they have shape (n,).

    Raises
    ------
    ValueError
        If a heat capacity is not positive or a conductance not finite.
    """

    def __init__(self, laws: Laws, losses: LossSource, parameters: Sequence[Any], *, vector: bool) -> None:
        self.laws, self.losses, self.vector = laws, losses, vector
        self.parameters = list(parameters)
        self.n_parts, self.n_states, self.n_boundaries = len(laws.parts), len(laws.states), len(laws.boundaries)
        n_links = laws.laplacian.shape[0]
        n, m = self.n_parts, self.n_boundaries
        # One product of the conductances gives the heat that leaves the parts per part temperature, and what comes from
        # the boundaries per boundary temperature.
        blocks = (laws.laplacian.reshape(n_links, -1), laws.to_boundary.reshape(n_links, -1))
        self._structure = np.concatenate(blocks, axis=1)
        self._leaving, self._coupling = slice(0, n * n), slice(n * n, n * (n + m))
        self._loss_nodes = np.array([laws.parts.index(name) for name in losses.temperature_nodes], dtype=int)
        self._varying = np.array(laws.varying, dtype=int)
        constant = [index for index in range(n_links) if index not in laws.varying]
        batch = np.broadcast_shapes(*(np.shape(value) for value in parameters)) if vector else ()
        fixed = self._stacked(laws.fixed(*self.parameters), batch)
        self.capacities = fixed[..., len(constant) :]
        if not (np.isfinite(fixed).all() and (self.capacities > 0.0).all()):
            raise ValueError("heat capacities must be positive and conductances finite; check the parameters")
        self._per_capacity = 1.0 / self.capacities
        memory = np.ones((*self.capacities.shape[:-1], self.n_states))
        self.error_weights = np.concatenate((error_weights(self.capacities), memory), axis=-1)
        self._conductances = np.zeros((*batch, n_links))
        self._conductances[..., constant] = fixed[..., : len(constant)]

    def power(self, time: Any, inputs: Array, states: Array) -> Array:
        """Nominal losses [W], shape (..., components)."""
        if not self.laws.components:
            return np.zeros((*states.shape[:-1], 0))
        speed, torque = self.operating(time, inputs, states)
        return self.losses.power(speed, torque, states[..., self._loss_nodes])

    def operating(self, time: Any, inputs: Array, states: Array) -> tuple[Array, Array]:
        """Speed [1/min] and torque [N m] as the losses see them, each of shape (...)."""
        if self.laws.operating is None:
            speed, torque = (self.laws.inputs.index(name) for name in ("speed", "torque"))
            return inputs[..., speed], inputs[..., torque]
        values = self._stacked(self.laws.operating(*self._common(time, inputs, states)), states.shape[:-1])
        return values[..., 0], values[..., 1]

    def boundary_temperatures(self, time: Any, inputs: Array, states: Array) -> Array:
        """Temperatures of the boundary nodes [degC], shape (..., boundaries)."""
        return self._stacked(self.laws.boundary(*self._common(time, inputs, states)), states.shape[:-1])

    def flows(self, time: Any, inputs: Array, states: Array) -> tuple[Array, Array]:
        """Heats of the sources [W], shape (..., sources); rates and updates of the extra states, (..., 2 states)."""
        power = self.power(time, inputs, states)
        signals = self._with_numeric(self._common(time, inputs, states), power)
        return self._flows(signals, power, states.shape[:-1])

    def balance(self, time: float, inputs: Array, states: Array, near: Balance | None = None) -> Balance:
        """Heat balance; see :class:`models.portable.solver.System`."""
        n, m, shape = self.n_parts, self.n_boundaries, states.shape[:-1]
        losses = self._losses_at(time, inputs, states, near)
        power = np.zeros((*shape, 0)) if losses is None else losses.power
        common = self._common(time, inputs, states)
        signals = self._with_numeric(common, power)
        if self.vector:
            conductances = np.array(np.broadcast_to(self._conductances, (*shape, self._conductances.shape[-1])))
        else:
            conductances = self._conductances.copy()
        conductances[..., self._varying] = self._stacked(self.laws.exchange(*signals), shape)
        exchanged = conductances @ self._structure
        leaving = exchanged[..., self._leaving].reshape(*shape, n, n)
        coupling = exchanged[..., self._coupling].reshape(*shape, n, m)
        to_boundary = np.swapaxes(coupling, -1, -2)
        heats, memory = self._flows(signals, power, shape)
        T, T_boundary = states[..., :n], self._stacked(self.laws.boundary(*common), shape)
        rate = (heats @ self.laws.injection + times(coupling, T_boundary) - times(leaving, T)) * self._per_capacity
        matrix = leaving * -self._per_capacity[..., None]
        heat_out = times(to_boundary, T) - to_boundary.sum(axis=-1) * T_boundary
        if self.n_states:
            rate = np.concatenate((rate, memory[..., : self.n_states]), axis=-1)
            matrix = np.pad(matrix, [(0, 0)] * len(shape) + [(0, self.n_states)] * 2)
            to_boundary = np.pad(to_boundary, [(0, 0)] * (len(shape) + 1) + [(0, self.n_states)])
        return Balance(
            derivative=rate,
            matrix=matrix,
            heat_in=heats.sum(axis=-1),
            heat_out=heat_out,
            heat_out_slope=to_boundary,
            losses=losses,
        )

    def _losses_at(self, time: Any, inputs: Array, states: Array, near: Balance | None) -> LossesAt | None:
        """Losses, those of `near` where they are still good; None without components."""
        if not self.laws.components:
            return None
        point = (*self.operating(time, inputs, states), states[..., self._loss_nodes])
        if near is not None and near.losses is not None and near.losses.still(*point):
            return near.losses
        return LossesAt(*point, self.losses.power(*point))

    def updated(self, time: float, inputs: Array, states: Array) -> Array:
        """States after the discrete updates of the extra states; see :class:`models.portable.solver.System`."""
        if not self.laws.updates:
            return states
        _, memory = self.flows(time, inputs, states)
        return np.concatenate((states[..., : self.n_parts], memory[..., self.n_states :]), axis=-1)

    def _flows(self, signals: list[Any], power: Array, shape: tuple[int, ...]) -> tuple[Array, Array]:
        losses = np.moveaxis(power, -1, 0) if self.vector else power.tolist()
        values = self._stacked(self.laws.heat(*signals, *losses), shape)
        n_sources = len(self.laws.sources)
        return values[..., :n_sources], values[..., n_sources:]

    def _common(self, time: Any, inputs: Array, states: Array) -> list[Any]:
        if self.vector:
            given, columns = list(np.moveaxis(inputs, -1, 0)), list(np.moveaxis(states, -1, 0))
        else:  # plain numbers: the generated math code is far faster on them than on numpy scalars
            given, columns = inputs.tolist(), states.tolist()
        return [time, *given, *columns[: self.n_parts], *self.parameters, *columns[self.n_parts :]]

    def _with_numeric(self, common: list[Any], power: Array) -> list[Any]:
        if not self.laws.numeric:
            return common
        laws = self.laws
        names = ["time", *laws.inputs, *(f"T_{part}" for part in laws.parts), *laws.parameters, *laws.states]
        by_name = dict(zip(names, common, strict=True))
        by_name |= {f"T_{name}": T for name, T in zip(laws.boundaries, laws.boundary(*common), strict=True)}
        by_name |= {f"P_{name}": power[..., i] for i, name in enumerate(laws.components)}
        return [*common, *(law(by_name) for law in laws.numeric)]

    def _stacked(self, values: tuple[Any, ...], shape: tuple[int, ...]) -> Array:
        if not self.vector:
            # A broken power of a negative number is complex in plain Python, and no number in numpy and C.
            return np.array([np.nan if isinstance(value, complex) else value for value in values], dtype=float)
        if not values:
            return np.zeros((*shape, 0))
        return np.stack([np.broadcast_to(np.asarray(value, dtype=float), shape) for value in values], axis=-1)


def torque_loss(loss: Any, speed: Any) -> Array:
    """Loss torque at the input shaft, signed as the speed, [N m]; linear through zero below 1 rpm.

    Parameters
    ----------
    loss : Array or float, shape (...)
        [W]
    speed : Array or float, shape (...)
        [1/min]
    """
    omega = np.asarray(speed) * RPM
    return np.asarray(loss * np.sign(omega) / np.maximum(np.abs(omega), TORQUE_LOSS_FLOOR))


def efficiency(loss: Any, speed: Any, torque: Any) -> Array:
    """Power out over power in, [-].

    Driving (speed times torque positive): ``1 - loss / P``, 0 where the loss exceeds the power given. Coasting: what
    arrives at the input shaft over what the output shaft gave, ``P / (P + loss)``. Without power (at most 1e-6 W) 0.

    Parameters
    ----------
    loss : Array or float, shape (...)
        [W]
    speed, torque : Array or float, shape (...)
        Of the input shaft, [1/min] and [N m]
    """
    power = np.asarray(speed) * RPM * torque
    useful = np.where(power < 0.0, -power, np.maximum(power - loss, 0.0))
    given = np.where(power < 0.0, loss - power, power)
    turns = given > LEAST_POWER
    return np.asarray(np.where(turns, useful / np.where(turns, given, 1.0), 0.0))
