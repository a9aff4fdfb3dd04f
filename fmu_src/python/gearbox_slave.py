"""A thermal network behind pythonfmu's co-simulation interface: solver and networks are called, nothing else is kept.

The host keeps to the order of calls that FMI prescribes; it is not checked here. pythonfmu answers a host with OK,
Discard (``False``) or, for an exception, Fatal, after which the instance is dead.
"""

from __future__ import annotations

import hashlib
import json
import sys
from collections.abc import Mapping
from dataclasses import fields
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar, NamedTuple

import numpy as np
from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from models.base.types import Array
from models.portable import solver
from models.portable.evaluation import NetworkSystem, NoLosses, efficiency, torque_loss
from models.portable.surrogate import Evaluator, SurrogateLosses

BOUND_TOLERANCE = 1e-9  # a bound converted from another unit, or reached by a ramp, is a rounding off
UNUSABLE = (ValueError, ArithmeticError)  # of the values, or of a heat balance that cannot be solved
LOST = "the state that was to be restored is damaged, or of another FMU: restore another one, or reset"
ERRORS_ONLY = 3


class Variable(NamedTuple):
    """One variable of the FMU: see :class:`builder.fmi.signals.Signal`; network's unit = scale * value + offset."""

    name: str
    unit: str
    role: str
    of: str
    settable: bool
    start: float
    minimum: float
    maximum: float
    scale: float
    offset: float

    def fault(self, value: float) -> str:
        """Why `value` cannot be used."""
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.name} is {value:g}{unit}; {self.minimum:g} to {self.maximum:g}{unit} is possible"


class GearboxSlave(Fmi2Slave):  # type: ignore[misc,unused-ignore]
    """One instance of the FMU. The generated module of an FMU has its laws, variables, losses and digests."""

    generated: ClassVar[ModuleType]

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        try:
            self._losses = _load_losses(Path(str(self.resources)), self.generated)
        except Exception as error:
            # Without loggingOn the host learns that it failed, but not why.
            sys.stderr.write(f"{type(self).__module__}: the FMU cannot be instantiated: {error}\n")
            raise
        laws, variables = self.generated.LAWS, [Variable(**row) for row in self.generated.VARIABLES]
        self._given = [variable for variable in variables if variable.settable]
        self._calculated = [variable for variable in variables if not variable.settable]
        self._given_at = np.flatnonzero([variable.settable for variable in variables])
        self._calculated_at = np.flatnonzero([not variable.settable for variable in variables])
        self._minimum, self._maximum = np.array([(v.minimum, v.maximum) for v in self._given]).T
        self._scale, self._offset = np.array([(v.scale, v.offset) for v in self._given]).T
        self._lowest = self._minimum - BOUND_TOLERANCE * np.maximum(1.0, np.abs(self._minimum))
        self._highest = self._maximum + BOUND_TOLERANCE * np.maximum(1.0, np.abs(self._maximum))
        place = {(variable.role, variable.of): index for index, variable in enumerate(self._given)}
        self._inputs = [place["input", name] for name in laws.inputs]
        self._factors = [place["factor", name] for name in laws.parameters]
        self._starts = [place["start_temperature", name] for name in laws.parts]
        self._memories = [place["start_state", name] for name in laws.states]
        self._loss_nodes = [laws.parts.index(name) for name in self._losses.temperature_nodes]
        self._uniform, self._common = place["initial_uniform", ""], place["initial_temperature", ""]
        self._calculated_scale, self._calculated_offset = np.array([(v.scale, v.offset) for v in self._calculated]).T
        self._values = np.array([variable.start for variable in variables])
        self._system: NetworkSystem | None = None
        self._state: solver.State | None = None  # None before the first step: start temperatures can still be set
        self._flows: Array | None = None  # to the boundaries, [W], mean over the last step
        self._time = self._distance = 0.0  # distance from the range of training, at the calculated values
        self._outside = self._fresh = self._lost = False

    # ------------------------------------------------------------------ simulation

    def setup_experiment(
        self,
        start_time: float,
        stop_time: float | None = None,  # noqa: ARG002
        tolerance: float | None = None,  # noqa: ARG002
    ) -> None:
        """Take the start time; stop time and tolerance do not matter to this FMU."""
        # pythonfmu puts the folder in front of sys.path for every instance and never takes it away again.
        sys.path[:] = [entry for entry in sys.path if entry != str(self.resources)]
        self._time = start_time

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Simulate one step with the inputs held; False (Discard) if it cannot be done, then nothing has changed."""
        try:
            if not step_size > 0.0:
                raise ValueError(f"a step of {step_size:g} s; it must be longer than 0 s")
            system, inputs, before = self._present()
            with np.errstate(all="ignore"):
                state = solver.advance(system, before, current_time, step_size, inputs, inputs)
        except UNUSABLE as error:
            self.log(f"the step from {current_time:g} s is refused, the state is unchanged: {error}",
                     Fmi2Status.discard)  # fmt: skip
            return False
        self._state, self._time = state, current_time + step_size
        self._flows = (state.heat_out - before.heat_out) / step_size
        self._calculate()
        if self._distance > 0.0 and not self._outside:
            self._warn(system, inputs, state.states)
        self._outside = self._distance > 0.0
        return True

    def _present(self) -> tuple[NetworkSystem, Array, solver.State]:
        """System, inputs and state at the present values, in the network's units; ValueError if one is unusable."""
        if self._lost:
            raise ValueError(LOST)
        values = self._values[self._given_at]
        usable = np.isfinite(values) & (values >= self._lowest) & (values <= self._highest)
        if not usable.all():
            raise ValueError("; ".join(self._given[i].fault(values[i]) for i in np.flatnonzero(~usable)))
        inner = np.minimum(np.maximum(values, self._minimum), self._maximum) * self._scale + self._offset
        factors = inner[self._factors].tolist()
        if self._system is None or factors != self._system.parameters:
            self._system = NetworkSystem(self.generated.LAWS, self._losses, factors, vector=False)
        state = self._state
        if state is None:
            first = np.array([*self._start_temperatures(), *inner[self._memories]])
            state = solver.start(first, self._system.n_boundaries)
        return self._system, inner[self._inputs], state

    def _start_temperatures(self) -> Array:
        """Temperatures of the parts at the start by the parameters `initial` and `T_start`, [degC]."""
        inner = self._values[self._given_at] * self._scale + self._offset
        T = inner[self._starts]
        return np.full_like(T, inner[self._common]) if inner[self._uniform] == 1.0 else T

    def _warn(self, system: NetworkSystem, inputs: Array, states: Array) -> None:
        """Log the operating point and the range of training that it left."""
        losses, T = self._losses, states[self._loss_nodes]
        speed, torque = system.operating(self._time, inputs, states)
        low, high = losses.temperature_bounds
        self.log(
            f"at {self._time:g} s the operating point is outside the range that the networks were trained on: speed "
            f"{speed:g} 1/min (to {losses.speed_bounds[1]:g}), torque {torque:g} N m (to {losses.torque_bounds[1]:g}), "
            f"temperatures {T.min():.1f} to {T.max():.1f} degC ({low:g} to {high:g}). Losses are extrapolated; "
            "in_domain and domain_distance show how long",
            Fmi2Status.warning,
        )

    # ------------------------------------------------------------------ values

    def get_real(self, vrs: list[int]) -> list[float]:
        """Values of Reals; calculated ones are NaN where the inputs or parameters allow none."""
        if not self._fresh:
            self._calculate()
        values: list[float] = self._values[vrs].tolist()
        return values

    def get_boolean(self, vrs: list[int]) -> list[bool]:
        """Values of Booleans."""
        return [value == 1.0 for value in self.get_real(vrs)]

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set Reals. Whether values can be used is judged when they are."""
        self._values[vrs] = values
        self._fresh = False

    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        """Set Booleans."""
        self.set_real(vrs, [float(value) for value in values])

    def _calculate(self) -> None:
        """Bring the calculated variables up to the present values."""
        try:
            values = (self._outputs() - self._calculated_offset) / self._calculated_scale
        except UNUSABLE as error:
            self.log(f"outputs have no value: {error}", Fmi2Status.error)
            values = np.nan
        self._values[self._calculated_at] = values
        self._fresh = True

    def _outputs(self) -> Array:
        """The calculated variables at the present values, in the network's units."""
        system, inputs, state = self._present()
        laws, n_parts, time, states = system.laws, system.n_parts, self._time, state.states
        with np.errstate(all="ignore"):
            heats, _ = system.flows(time, inputs, states)
            boundaries = system.boundary_temperatures(time, inputs, states)
            point = (*system.operating(time, inputs, states), states[self._loss_nodes]) if laws.components else ()
            self._distance = float(self._losses.domain_distance(*point)) if point else 0.0
            flows = self._flows if self._flows is not None else system.balance(time, inputs, states).heat_out
        is_loss = np.array(laws.losses_of_sources, dtype=bool)
        loss = heats[is_loss].sum()
        found = {"total_loss": loss, "domain_distance": self._distance, "in_domain": self._distance <= 0.0}
        found |= {"heat_in": state.heat_in, "heat_stored": state.heat_in - state.heat_out.sum()}
        if {"speed", "torque"} <= set(laws.inputs):
            speed, torque = (inputs[laws.inputs.index(name)] for name in ("speed", "torque"))
            found |= {"torque_loss": torque_loss(loss, speed), "efficiency": efficiency(loss, speed, torque)}
        named = {
            "temperature": dict(zip((*laws.parts, *laws.boundaries), (*states[:n_parts], *boundaries), strict=True)),
            "loss": dict(zip(laws.sources, heats, strict=True)),
            "heat_flow": dict(zip(laws.boundaries, flows, strict=True)),
            "heat_to_boundary": dict(zip(laws.boundaries, state.heat_out, strict=True)),
            "state": dict(zip(laws.states, states[n_parts:], strict=True)),
        }
        named["heat"] = named["loss"]
        return np.array([named[v.role][v.of] if v.role in named else found[v.role] for v in self._calculated])

    # ------------------------------------------------------------------ state and log

    def _get_fmu_state(self) -> dict[str, Any]:
        """All that the future depends on, as plain numbers: it survives JSON to the last bit."""
        state = self._state
        saved = None if state is None else {f.name: np.asarray(getattr(state, f.name)).tolist() for f in fields(state)}
        return {
            "fmu": type(self).__module__,
            "time": self._time,
            "outside": self._outside,
            "values": self._values.tolist(),
            "state": saved,
            "flows": None if self._flows is None else self._flows.tolist(),
        }

    @staticmethod
    def _fmu_state_from_bytes(state: bytes) -> dict[str, Any]:
        """A state that was saved; empty if it is damaged.

        An exception would end the host, here as in :meth:`_set_fmu_state`: pythonfmu lets it through.
        """
        try:
            return dict(json.loads(state))
        except (TypeError, ValueError):
            return {}

    def _set_fmu_state(self, state: Mapping[str, Any]) -> None:
        """Restore a state; after one that is damaged, or of another FMU, no step is done until another is restored."""
        self._lost, self._fresh = True, False
        try:
            if state["fmu"] != type(self).__module__:
                raise ValueError(LOST)
            saved = state["state"]
            # [()] makes a number of an array without dimensions and leaves others alone.
            restored: dict[str, Any] = {name: np.array(value)[()] for name, value in (saved or {}).items()}
            present = None if saved is None else solver.State(**restored)
            flows = None if state["flows"] is None else np.array(state["flows"])
            values, time, outside = np.array(state["values"]), float(state["time"]), bool(state["outside"])
        except (KeyError, TypeError, ValueError):
            self.log(LOST, Fmi2Status.error)
            return
        self._state, self._flows, self._values, self._time, self._outside = present, flows, values, time, outside
        self._lost = False

    def log(
        self, msg: str, status: Fmi2Status = Fmi2Status.ok, category: str | None = None, debug: bool | None = None
    ) -> None:
        """Log a message; hosts take it as a printf format."""
        super().log(msg.replace("%", "%%"), status, category, debug)


def _load_losses(resources: Path, generated: ModuleType) -> Any:
    """The losses of an extracted FMU: none, or a surrogate whose networks onnxruntime evaluates."""
    if generated.LOSSES is None:
        return NoLosses()
    networks = {name: _network(resources / f"{name}.onnx", digest) for name, digest in generated.DIGESTS.items()}
    return SurrogateLosses.from_dict(generated.LOSSES).with_evaluators(networks)


def _network(path: Path, digest: str) -> Evaluator:
    """A network of the FMU in onnxruntime, its file checked to the byte."""
    import onnxruntime  # here: an FMU without networks does not need it

    content = path.read_bytes() if path.is_file() else b""
    if hashlib.sha256(content).hexdigest() != digest:
        raise ValueError(f"{path} is missing, damaged or of another FMU; extract or build the FMU again")
    options = onnxruntime.SessionOptions()
    # One thread: a few rows are too little for more, and the same bits come out everywhere.
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = ERRORS_ONLY
    session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    names, source = [output.name for output in session.get_outputs()], session.get_inputs()[0]

    @lru_cache(maxsize=1)  # a step begins at the operating point whose outputs have just been read
    def run(rows: bytes) -> Array:
        given = np.frombuffer(rows).reshape(-1, source.shape[1])
        return np.asarray(session.run(names, {source.name: given})[0])

    return lambda rows: run(rows.tobytes())
