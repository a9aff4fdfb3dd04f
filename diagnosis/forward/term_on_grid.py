"""A term (a mechanism at its place, or any other addition) evaluated along a trajectory: the heat it brings, the input
it shifts, or the reading it distorts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import compress
from typing import Any

import numpy as np
import sympy as sp

from diagnosis.forward.extra_states import Memories
from diagnosis.forward.grid import Piece
from diagnosis.forward.kept import kept
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.observation import Sensors, boundary_temperatures, to_points
from diagnosis.forward.sensor_fault import distorted, passed_on
from diagnosis.forward.trajectory import Heat, Trajectory, heat_change, losses_along
from models.base.types import Array
from models.network.laws import compile_each, symbol
from models.terms.term import FACTORS, Term

INPUT_STEP: Mapping[str, float] = {"speed": 5.0, "torque": 1.0}
OTHER_INPUT_STEP = 0.25


class TermOnGrid:
    """A term whose laws are functions of arrays.

    Parameters
    ----------
    model : NetworkOnGrid
        The network that the term is added to; it need not be in it
    """

    def __init__(self, model: NetworkOnGrid, term: Term) -> None:
        self.model, self.term = model, term
        network = model.network
        own, states = [p.name for p in term.parameters], [s.name for s in term.states]
        # The term may be in the network already: its own parameters and states are then given apart.
        self._inside = not set(own).isdisjoint(p.name for p in network.parameters)
        self._given = [name not in own and name not in states for name in model.arguments]
        given = [*compress(model.arguments, self._given)]
        arguments = [*given, *own, *states]
        other = sp.Integer(0) if term.boundary_temperature is None else term.boundary_temperature
        laws = [law.xreplace(model.boundary) for law in (term.expression, other)]
        names = {name: f"own_{i}" for i, name in enumerate(own)}
        names |= {f"T_{node}": f"T_place_{i}" for i, node in enumerate(term.target)}
        self._law = _compiled(laws, arguments, names)
        self._memories = Memories(term.states, [*given, *own], model.parts, model.boundary)
        heard = {f"T_{part.name}" for part in network.parts} | {f"P_{c}" for c in network.components}
        heard |= {s.name for s in network.states}
        #: Whether the law asks what the gearbox does, not only what is done to it.
        self.follows = any(s.name in heard for s in laws[0].free_symbols)

    # ------------------------------------------------------------------ the law

    def law(self, trajectory: Trajectory, values: Array, *, at_points: bool = False) -> tuple[Array, Array]:
        """The law, and the temperature of a boundary of the term's own.

        Parameters
        ----------
        values : Array, shape (V, parameters)
            Of the term's own parameters
        at_points : bool
            At the grid points instead of the middles of the intervals (for terms without memory)

        Returns
        -------
        law, temperature : Array, shape (V, K) or (V, K + 1)
        """
        model, piece = self.model, trajectory.piece
        if at_points:
            inputs, T, time = to_points(piece.inputs), trajectory.T, piece.time
            memory = np.zeros((len(T), len(model.network.states)))
            power = np.zeros((len(T), len(model.laws.components)))
        else:
            inputs, T, time, memory = piece.inputs, trajectory.middle, piece.middle, trajectory.memory
            power = losses_along(model, trajectory)
        rows = self._rows(time, inputs, T, trajectory.values, memory, power)
        own = [values[:, index, None] for index in range(values.shape[1])]
        states = self._memories.follow(piece, [*rows, *own], trajectory.seen)
        law, other = self._law(*rows, *own, *states)
        size = (len(values), len(T))
        return np.broadcast_to(np.asarray(law, float), size), np.broadcast_to(np.asarray(other, float), size)

    def _rows(self, time: Array, inputs: Array, T: Array, values: Array, memory: Array, power: Array) -> list[Array]:
        """Arguments of the law from the network, without those of the term itself: shape (K,) each."""
        numbers = (np.full(len(T), value) for value in values)
        return [*compress([time, *inputs.T, *T.T, *numbers, *memory.T, *power.T], self._given)]

    def constant(self, values: Array) -> float:
        """The law where it has nothing but the term's own parameters, of shape (parameters,); else nothing."""
        given = {symbol(p.name): float(v) for p, v in zip(self.term.parameters, values, strict=True)}
        law = sp.sympify(self.term.expression.xreplace(given))
        return float(law) if law.is_number else 0.0

    # ------------------------------------------------------------------ heat

    def heat(self, trajectory: Trajectory, values: Array, there: Array | None = None) -> tuple[Array, Array]:
        """The heat that the term brings to the network.

        Parameters
        ----------
        values : Array, shape (V, parameters)
        there : Array, shape (parameters,), optional
            Values that a network with the term had in this trajectory, where they are others

        Returns
        -------
        heat : Array, shape (K, parts, V)
            [W]
        loss : Array, shape (K, V)
            What of it is mechanical loss, [W]
        """
        model, term = self.model, self.term
        law, other = (a.T for a in self.law(trajectory, values))
        heat = np.zeros((len(law), model.n, len(values)))
        loss = np.zeros(law.shape)
        if term.kind == "source":
            for node in term.target:
                heat[:, model.parts.index(node)] += law / len(term.target)
            loss = law if term.is_loss else loss
        elif term.kind == "link":
            self._link_heat(trajectory, law, other, heat)
        elif term.kind in FACTORS:
            within = np.zeros_like(law)
            if self._inside:
                within = law if there is None else self.law(trajectory, there[None, :])[0].T
            loss = loss + self._factor_heat(trajectory, law, within, heat)
        else:  # an input
            per_unit = input_slope(model, trajectory, term.target[0])
            heat = per_unit.into[:, :, None] * law[:, None, :]
            loss = per_unit.loss[:, None] * law
        return heat, loss

    def _factor_heat(self, trajectory: Trajectory, law: Array, within: Array, heat: Array) -> Array:
        """Adds what a change, shape (K, V), does to the targets to `heat`; returns what of it is loss.

        Their heats have the change `within` in them already: the rest of a loss that is halved is as much again.
        """
        model, balance, loss = self.model, trajectory.balance, np.zeros(law.shape)

        def share(weight: float) -> Array:
            return np.asarray(weight * law / (1.0 + weight * within))

        sources = [source.name for source in model.network.sources]
        links = [link.name for link in model.network.links]
        for name, weight in self.term.weighted:
            if name in links:
                index = links.index(name)
                flow = (balance.conductances[:, index] * balance.differences[:, index])[:, None] * share(weight)
                heat += model.to_parts[index][:, None] * flow[:, None, :]
            else:
                index = sources.index(name)
                extra = share(weight) * balance.sources[:, index, None]
                heat[:, model.parts.index(model.network.sources[index].node)] += extra
                loss += extra
        return loss

    def _link_heat(self, trajectory: Trajectory, conductance: Array, other: Array, heat: Array) -> None:
        model, T = self.model, trajectory.middle
        known = boundary_temperatures(model, trajectory)
        *sides, end = self.term.target
        for node in sides:
            here = T[:, model.parts.index(node), None]
            if end in model.parts:
                there = T[:, model.parts.index(end), None]
            else:
                there = known[end][:, None] if end in known else other
            flow = conductance / len(sides) * (here - there)
            heat[:, model.parts.index(node)] -= flow
            if end in model.parts:
                heat[:, model.parts.index(end)] += flow

    # ------------------------------------------------------------------ inputs and readings

    def adjusted(self, piece: Piece, values: Array, trajectory: Trajectory | None) -> Piece:
        """A piece with the input as it really was, for a term of kind ``signal``; `values` of shape (parameters,)."""
        model = self.model
        if trajectory is None:
            T = np.full((len(piece.steps), model.n), 20.0)
            memory = np.zeros((len(T), len(model.network.states)))
            power = np.zeros((len(T), len(model.laws.components)))
            numbers = model.start
        else:
            # A guess may stem from the network as it was before its latest term, whose numbers come last.
            T, memory = trajectory.middle, np.zeros((len(trajectory.piece.steps), len(model.network.states)))
            memory[:, : trajectory.memory.shape[1]] = trajectory.memory
            numbers = np.concatenate([trajectory.values, model.start[len(trajectory.values) :]])
            power = losses_along(model, trajectory)
        rows = self._rows(piece.middle, piece.inputs, T, numbers, memory, power)
        shift = np.broadcast_to(self._law(*rows, *values.tolist())[0], (len(T),))
        samples = np.array(piece.samples)
        samples[..., model.laws.inputs.index(self.term.target[0])] += shift[:, None]
        return replace(piece, samples=samples)

    def distorted(self, trajectory: Trajectory, sensors: Sensors, read: Array, values: Array) -> Array:
        """Readings with the fault of a term of kind ``sensor``; `values` of shape (parameters,)."""
        return distorted(self.term, *self._fault(trajectory, values), read, self._channels(sensors))

    def passed_on(self, trajectory: Trajectory, sensors: Sensors, changes: Array, values: Array) -> Array:
        """Changes of the readings as distorted by such a fault, shape (K + 1, channels, ...); most are linear."""
        if self.term.form == "shift":
            return changes
        return passed_on(self.term, *self._fault(trajectory, values), changes, self._channels(sensors))

    def _fault(self, trajectory: Trajectory, values: Array) -> tuple[Array, Array]:
        """The law, and time, at the grid points."""
        return self.law(trajectory, values[None, :], at_points=True)[0][0], trajectory.piece.time

    def _channels(self, sensors: Sensors) -> list[int]:
        return [sensors.channels.index(name) for name in self.term.target]


def _compiled(
    laws: Sequence[sp.Expr], arguments: Sequence[str], names: Mapping[str, str]
) -> Callable[..., tuple[Any, ...]]:  # fmt: skip
    """Laws as a function; with other `names`, so that those of a mechanism at another place are compiled already."""
    given = {
        symbol(name): symbol(names[name]) for law in laws for name in {s.name for s in law.free_symbols} & set(names)
    }
    return compile_each([names.get(name, name) for name in arguments], [law.xreplace(given) for law in laws])


@kept
def input_slope(model: NetworkOnGrid, trajectory: Trajectory, name: str) -> Heat:
    """Heat per unit of an input."""
    step = INPUT_STEP.get(name, OTHER_INPUT_STEP)
    samples = np.array(trajectory.piece.samples)
    samples[..., model.laws.inputs.index(name)] += step
    return moved_heat(model, trajectory, replace(trajectory.piece, samples=samples)) / step


def moved_heat(model: NetworkOnGrid, trajectory: Trajectory, moved: Piece) -> Heat:
    """Change of heat when the inputs of a piece are others."""
    power = losses_along(model, trajectory)
    if not np.array_equal(moved.samples[..., :2], trajectory.piece.samples[..., :2]):
        power = power + model.loss_at(moved.samples, trajectory.middle) - _losses(model, trajectory)
    return heat_change(model, trajectory, moved, trajectory.values, power, trajectory.memory)


@kept
def _losses(model: NetworkOnGrid, trajectory: Trajectory) -> Array:
    """Nominal losses as computed, not by the tangent."""
    return model.loss_at(trajectory.piece.samples, trajectory.middle)
