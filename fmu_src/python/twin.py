"""The thermal twin as an FMU sees it: values by reference in SI units outside, the thermal network inside.

Knows nothing of pythonfmu. A call that cannot be done raises :class:`Refused` and leaves everything as it was.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from models.base.types import Array
from models.portable import solver
from models.portable.evaluation import Laws, NetworkSystem, efficiency, torque_loss

LISTS = (
    "parts", "boundaries", "components", "sources", "losses_of_sources", "inputs", "parameters", "states", "varying"
)  # fmt: skip
LONGEST_STEP_S = 1e9
BOUND_TOLERANCE = 1e-9
TIME_TOLERANCE = 1e-6  # of the time itself, where a host's clock and ours are compared


class Refused(Exception):
    """Refusal of a call of the host; the text gives the reason and what to do. The state is as before."""


@dataclass(frozen=True, kw_only=True)
class Slot:
    """One signal inside: see :class:`builder.fmi.signals.Signal`.

    Attributes
    ----------
    name, role, of, unit : str
    boolean : bool
    settable : str
        ``"input"``, ``"fixed"`` (before the simulation starts), ``"tunable"``, or ``""``
    start : float
    minimum, maximum : float
    scale, offset : float
        Value in the network's unit = scale * value + offset
    """

    name: str
    role: str
    of: str
    unit: str
    boolean: bool
    settable: str
    start: float
    minimum: float
    maximum: float
    scale: float
    offset: float

    def fault(self, value: float) -> str | None:
        """Why `value` cannot be used, or None."""
        if not math.isfinite(value):
            return f"{self.name} is {value}; a finite number is needed"
        slack = BOUND_TOLERANCE * max(1.0, abs(value))  # a bound converted from another unit is a rounding off
        if self.minimum - slack <= value <= self.maximum + slack:
            return None
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        text = f"{self.name} is {value:g}{unit}; {self.minimum:g} to {self.maximum:g}{unit} is possible"
        if self.unit == "K" and self.minimum <= value + 273.15 <= self.maximum:
            text += f". It is given in kelvin: if {value:g} degC is meant, set {value + 273.15:g}"
        elif self.unit == "rad/s":
            text += ". It is given in rad/s: if 1/min is meant, multiply by pi/30"
        return text


class Losses(Protocol):
    """Interface of the losses to the twin; :class:`models.portable.surrogate.SurrogateLosses` has it too."""

    @property
    def temperature_nodes(self) -> tuple[str, ...]:
        """Nodes whose temperatures are read."""
        ...

    @property
    def speed_bounds(self) -> tuple[float, float]:
        """Range of training, [1/min]."""
        ...

    @property
    def torque_bounds(self) -> tuple[float, float]:
        """Range of training, [N m]."""
        ...

    @property
    def temperature_bounds(self) -> tuple[float, float]:
        """Range of training, [degC]."""
        ...

    def power(self, speed: Any, torque: Any, temperatures: Any) -> Array:
        """Losses [W], shape (components,)."""
        ...

    def domain_distance(self, speed: Any, torque: Any, temperatures: Any) -> Any:
        """How far outside the range of training, as a fraction of it; 0 inside."""
        ...


class Twin:
    """One gearbox in one simulation.

    Parameters
    ----------
    data : mapping
        What the builder wrote: signals, network, identity
    laws : mapping of str to callable
        The generated functions of :class:`models.portable.evaluation.Laws`
    losses : Losses
    """

    def __init__(self, data: Mapping[str, Any], laws: Mapping[str, Any], losses: Losses) -> None:
        network = data["network"]
        given: dict[str, Any] = {key: tuple(network[key]) for key in LISTS} | dict(laws)
        n_links, n_parts, n_boundaries = (len(network[key]) for key in ("laplacian", "parts", "boundaries"))
        self._laws = Laws(
            **given,
            laplacian=np.array(network["laplacian"], dtype=float),
            to_boundary=np.array(network["to_boundary"], dtype=float).reshape(n_links, n_parts, n_boundaries),
            injection=np.array(network["injection"], dtype=float),
            updates=network["updates"],
        )
        self._losses = losses
        self._identity: str = data["identity"]
        self._state_starts: list[float] = list(network["state_starts"])
        self.slots = tuple(Slot(**slot) for slot in data["signals"])
        self.values = [slot.start for slot in self.slots]
        self._affine = [(slot.scale, slot.offset) for slot in self.slots]
        self._inputs = self._by_role("input", self._laws.inputs)
        self._factors = self._by_role("factor", self._laws.parameters)
        self._starts = self._by_role("start_temperature", self._laws.parts)
        nodes = {slot.of: i for i, slot in enumerate(self.slots) if slot.role == "temperature"}
        self._part_outputs = [nodes[name] for name in self._laws.parts]
        self._boundary_outputs = [nodes[name] for name in self._laws.boundaries]
        sources = {slot.of: i for i, slot in enumerate(self.slots) if slot.role in ("loss", "heat")}
        self._source_outputs = [sources[name] for name in self._laws.sources]
        self._memory_outputs = self._by_role("state", self._laws.states)
        self._single = {slot.role: i for i, slot in enumerate(self.slots)}
        self._is_loss = np.array(self._laws.losses_of_sources, dtype=bool)
        self._loss_nodes = np.array([self._laws.parts.index(name) for name in losses.temperature_nodes])
        self._system: NetworkSystem | None = None
        self._state: solver.State | None = None  # None until the start temperatures are taken over
        self._fresh = False
        self._outside = False
        self._asked_to_start = False
        self.initialized = False
        self.time = 0.0

    def _by_role(self, role: str, names: Sequence[str]) -> list[int]:
        found = {slot.of: i for i, slot in enumerate(self.slots) if slot.role == role}
        return [found[name] for name in names]

    # ------------------------------------------------------------------ values

    def set(self, references: Sequence[int], values: Sequence[float]) -> list[str]:
        """Set values; gives what could not be set and why. Whether values can be used is judged when they are."""
        refused = []
        for reference, value in zip(references, values, strict=True):
            slot = self.slots[reference]
            if slot.settable == "input":
                self.values[reference] = value
            elif slot.settable == "tunable" or (slot.settable == "fixed" and not self.initialized):
                if value != self.values[reference]:
                    self._system = None
                self.values[reference] = value
            elif slot.settable == "fixed":
                refused.append(f"{slot.name} can be set before the simulation starts only; it stays as it was")
            else:
                refused.append(f"{slot.name} is calculated and cannot be set")
        self._fresh = False
        return refused

    def get(self, references: Sequence[int]) -> list[float]:
        """Values by reference.

        Raises
        ------
        Refused
            If inputs or parameters are such that there are none.
        """
        if not self._fresh:
            self._evaluate()
        values = self.values
        return [values[reference] for reference in references]

    def blank(self) -> None:
        """Make all calculated values NaN: there are none until an input or parameter changes."""
        for index, slot in enumerate(self.slots):
            if not slot.settable:
                self.values[index] = math.nan
        self.values[self._single["in_domain"]] = 0.0
        self._fresh = True

    # ------------------------------------------------------------------ simulation

    def start(self, time: float) -> None:
        """Set the time at which the simulation starts, [s].

        Raises
        ------
        Refused
            If it is not a finite number.
        """
        if not math.isfinite(time):
            raise Refused(f"the simulation cannot start at {time} s; a finite time is needed")
        self.time = time
        self._fresh = False

    def initialize(self) -> str | None:
        """End the initialization: the start temperatures are taken over; gives a warning, or None.

        Raises
        ------
        Refused
            If they or other values cannot be used. When they are corrected, the first step does it again.
        """
        self._asked_to_start = True
        _, _, self._state = self._prepared()
        self.initialized = True
        return self._unused_starts()

    def _unused_starts(self) -> str | None:
        """A warning about start temperatures that were given but are not used."""
        common = self.values[self._single["initial_temperature"]]
        given = [i for i in self._starts if self.values[i] not in (self.slots[i].start, common)]
        if self.values[self._single["initial_uniform"]] == 0.0 or not given:
            return None
        more = f" (and {len(given) - 1} more such temperatures are given)" if len(given) > 1 else ""
        return (
            f"{self.slots[given[0]].name} is {self.values[given[0]]:g} K{more}, but initial.uniform is true: all parts "
            f"start at initial.T = {common:g} K. Set initial.uniform to false to start each part at its own"
        )

    def step(self, time: float, duration: float) -> str | None:
        """Simulate one communication step with the inputs held; gives a warning, or None.

        Parameters
        ----------
        time, duration : float
            Start and length of the step, [s]

        Raises
        ------
        Refused
            If values or times cannot be used, or the heat balance has no solution.
        """
        if not self._asked_to_start:
            raise Refused("the simulation has not been initialized; no step can be done")
        if not (math.isfinite(time) and math.isfinite(duration)):
            raise Refused(f"a step from {time} s of {duration} s is not possible; finite times are needed")
        if not 0.0 < duration <= LONGEST_STEP_S:
            raise Refused(f"a step of {duration:g} s is not possible; above 0 and up to {LONGEST_STEP_S:g} s is")
        if abs(time - self.time) > TIME_TOLERANCE * max(1.0, abs(time), duration):
            raise Refused(
                f"the step starts at {time:g} s, but the last one ended at {self.time:g} s; "
                "to go back, restore an FMU state saved there"
            )
        warnings = [] if self.initialized else [self.initialize()]
        system, inputs, before = self._prepared()
        was_outside = self._outside
        try:
            with np.errstate(all="ignore"):
                at_once = not was_outside and self._is_outside(time, system, inputs, before.states)
                state = solver.advance(system, before, time, duration, inputs, inputs)
                outside = self._is_outside(time + duration, system, inputs, state.states)
        except Exception as error:  # whatever it is, the host gets an answer and keeps its simulation
            raise Refused(f"the heat balance cannot be solved from {time:g} s on: {error}") from error
        self._state, self.time, self._fresh, self._outside = state, time + duration, False, outside
        # One warning when the range is left, of the first moment that it was seen; none while it stays outside.
        if at_once:
            warnings.append(self._excursion(time, system, inputs, before.states))
        elif outside and not was_outside:
            warnings.append(self._excursion(self.time, system, inputs, state.states))
        return ". ".join(text for text in warnings if text is not None) or None

    def _is_outside(self, time: float, system: NetworkSystem, inputs: Array, states: Array) -> bool:
        operating = system.operating(time, inputs, states)
        return float(self._losses.domain_distance(*operating, states[self._loss_nodes])) > 0.0

    def _excursion(self, time: float, system: NetworkSystem, inputs: Array, states: Array) -> str:
        """A warning of the operating point that was found outside the range of training at `time`."""
        speed, torque = system.operating(time, inputs, states)
        T = states[self._loss_nodes]
        losses = self._losses
        point = [
            ("speed", speed, losses.speed_bounds[1], "1/min"),
            ("torque", torque, losses.torque_bounds[1], "N m"),
        ]
        texts = [f"{name} {value:g} {unit} (to {high:g})" for name, value, high, unit in point if abs(value) > high]
        low, high = losses.temperature_bounds
        texts += [
            f"{node} {value:.1f} degC ({low:g} to {high:g})"
            for node, value in zip(losses.temperature_nodes, T.tolist(), strict=True)
            if not low <= value <= high
        ]
        return (
            f"at {time:g} s the operating point is outside the range that the networks were trained on: "
            f"{', '.join(texts)}. Losses are held at the edge of the range; in_domain and domain_distance show how long"
        )

    def _prepared(self) -> tuple[NetworkSystem, Array, solver.State]:
        """System, inputs in the network's units, and state at this moment.

        Raises
        ------
        Refused
            If a value cannot be used.
        """
        faults = []
        if self._system is None:
            faults += self._faults(range(len(self.slots)))
        else:
            faults += self._faults(self._inputs)
        if faults:
            raise Refused("; ".join(faults))
        if self._system is None:
            parameters = [self._inner(index) for index in self._factors]
            try:
                self._system = NetworkSystem(self._laws, self._losses, parameters, vector=False)
            except (ValueError, ArithmeticError) as error:
                raise Refused(f"the parameters cannot be used: {error}") from error
        inputs = np.array([self._inner(index) for index in self._inputs])
        if self.initialized and self._state is not None:
            return self._system, inputs, self._state
        uniform = self.values[self._single["initial_uniform"]] != 0.0
        common = self._single["initial_temperature"]
        T = [self._inner(common if uniform else index) for index in self._starts]
        return self._system, inputs, solver.start(np.array([*T, *self._state_starts]))

    def _faults(self, indices: Sequence[int]) -> list[str]:
        found = (self.slots[i].fault(self.values[i]) for i in indices if self.slots[i].settable)
        return [fault for fault in found if fault is not None]

    def _inner(self, index: int) -> float:
        slot, (scale, offset) = self.slots[index], self._affine[index]
        return min(max(self.values[index], slot.minimum), slot.maximum) * scale + offset

    def _evaluate(self) -> None:
        system, inputs, state = self._prepared()
        states = state.states
        try:
            with np.errstate(all="ignore"):
                heats, _ = system.flows(self.time, inputs, states)
                boundary = system.boundary_temperatures(self.time, inputs, states)
                operating = system.operating(self.time, inputs, states)
                distance = float(self._losses.domain_distance(*operating, states[self._loss_nodes]))
        except Exception as error:  # as in step
            raise Refused(f"the outputs cannot be calculated at {self.time:g} s: {error}") from error
        n_parts = len(self._part_outputs)
        all_states = states.tolist()
        self._put(self._part_outputs, all_states[:n_parts])
        self._put(self._boundary_outputs, boundary.tolist())
        self._put(self._source_outputs, heats.tolist())
        self._put(self._memory_outputs, all_states[n_parts:])
        loss = float(heats[self._is_loss].sum())
        single, values = self._single, self.values
        values[single["total_loss"]] = loss
        values[single["torque_loss"]] = float(torque_loss(loss, inputs[0]))
        values[single["efficiency"]] = float(efficiency(loss, inputs[0], inputs[1]))
        values[single["domain_distance"]] = distance
        values[single["in_domain"]] = float(distance <= 0.0)
        self._fresh = True

    def _put(self, indices: Sequence[int], values: Sequence[float]) -> None:
        for index, value in zip(indices, values, strict=True):
            scale, offset = self._affine[index]
            self.values[index] = (value - offset) / scale

    # ------------------------------------------------------------------ the whole state

    def snapshot(self) -> dict[str, Any]:
        """Everything that the future depends on, as plain numbers: it survives JSON to the last bit."""
        state = self._state
        return {
            "identity": self._identity,
            "time": self.time,
            "asked_to_start": self._asked_to_start,
            "initialized": self.initialized,
            "outside": self._outside,
            "values": [value for value, slot in zip(self.values, self.slots, strict=True) if slot.settable],
            "state": None if state is None else {
                "states": state.states.tolist(),
                "step": float(state.step),
                "heat_in": float(state.heat_in),
                "heat_out": float(state.heat_out),
            },
        }  # fmt: skip

    def restore(self, snapshot: Mapping[str, Any]) -> None:
        """Go back to a :meth:`snapshot`.

        Raises
        ------
        Refused
            If it is another FMU's.
        """
        settable = [index for index, slot in enumerate(self.slots) if slot.settable]
        if snapshot.get("identity") != self._identity or len(snapshot["values"]) != len(settable):
            raise Refused("the state was saved by another FMU; it cannot be restored here")
        for index, value in zip(settable, snapshot["values"], strict=True):
            self.values[index] = value
        state = snapshot["state"]
        if state is None:
            self._state = None
        else:
            self._state = solver.State(
                states=np.array(state["states"], dtype=float),
                step=state["step"],
                heat_in=np.array(state["heat_in"]),
                heat_out=np.array(state["heat_out"]),
            )
        self.time, self._outside = snapshot["time"], snapshot["outside"]
        self._asked_to_start, self.initialized = snapshot["asked_to_start"], snapshot["initialized"]
        self._system, self._fresh = None, False
