"""The nominal model, calibrated to a recording: how its temperatures change if something in it is changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import sympy as sp

from diagnosis.engine.fit import Fit
from diagnosis.engine.fit import calibrate as fitted
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.unknown import InputGain, InputOffset, NetworkParameter
from diagnosis.forward.recurrence import lagged
from diagnosis.forward.whitening import RandomHeat
from diagnosis.proof.cases.time_course import TimeCourse
from diagnosis.proof.injection.control import Control, find_control
from diagnosis.proof.injection.real_recording import RealRecording
from diagnosis.setup.inference_setup import InferenceSetup
from diagnosis.setup.shaft import shafts
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.base.types import Array
from models.files.cycle import Cycle
from models.network.laws import Parameter, symbol
from models.quantities.quantities import TOTAL_LOSS, is_total_loss, node_of_channel
from models.simulation.result import Result
from models.simulation.simulate import simulate
from models.simulation.thermal_network import Losses, ThermalNetwork

AMPLITUDE, COURSE, SEEN = "injected_size", "injected_course", "injected_seen"
SIZE_AND_COURSE: sp.Expr = symbol(AMPLITUDE) * symbol(COURSE)  # the factor that every change has
HOLD, HELD = "injected_hold", "injected_held"
HOLD_K = 1.0  # change of a held temperature at which its control removes as much heat as all sources make
BLOCK_S = 30.0  # the model runs on means over so long, of recordings with faster rows
# Multiples of the usual structural floor, the lowest that leaves every parameter inside its prior: with a floor that is
# too low a wrong structure pushes parameters to values that no machine has.
FLOORS, INSIDE = (1.0, 10.0, 30.0), 3.5
# Times the median misfit of the sensors, of so many at least: such a sensor is left out of the calibration.
BROKEN, FEWEST_SENSORS = 4.0, 3


@dataclass(frozen=True, kw_only=True, eq=False)
class Differences:
    """Runs with a change of B sizes minus the run without.

    Attributes
    ----------
    readings : mapping of quantity to Array, shape (B, rows)
        ``T_<channel>`` [K] and ``P_loss`` [W] at the rows of the recording
    result : Result
        Of the 1 + B runs, the first without the change; from the block before it begins
    network : ThermalNetwork
        With the change
    sizes : Array, shape (1 + B,)
    first : int
        Block that `result` begins with
    """

    readings: Mapping[str, Array]
    result: Result
    network: ThermalNetwork
    sizes: Array
    first: int


@dataclass(frozen=True, kw_only=True, eq=False)
class CalibratedMachine:
    """The model with the parameters that a recording asks for.

    Attributes
    ----------
    nominal : ThermalNetwork
        Links, sources and nodes as the definition has them
    network : ThermalNetwork
        With the tilts of its laws; see :mod:`diagnosis.setup.shapes`
    start : mapping of node to float
        [degC]
    cycle : Cycle
        Inputs in blocks, as the calibration corrected them; time since the first row
    lags : mapping of channel to float
        Time constants of the sensors, [s]
    misfit_K : mapping of channel to float
        Root mean square of measured minus simulated, [K]
    left_out : tuple of str
        Sensors that the calibration did not use
    control : Control or None
        Two-point control of the machine
    """

    real: RealRecording
    nominal: ThermalNetwork
    network: ThermalNetwork
    losses: Losses
    parameters: Mapping[str, float]
    start: Mapping[str, float]
    cycle: Cycle
    lags: Mapping[str, float]
    misfit_K: Mapping[str, float]
    left_out: tuple[str, ...]
    control: Control | None = None

    @cached_property
    def base(self) -> Result:
        """The run without a change."""
        return simulate(self.network, self.cycle, losses=self.losses, initial=self.start, parameters=self.parameters)

    @cached_property
    def heat_W(self) -> float:
        """Mean heat of all sources, [W]."""
        heats = [*self.base.losses.values(), *self.base.extra_heat.values()]
        return float(np.mean(np.sum(heats, axis=0)))

    def prepared(self) -> ThermalNetwork:
        """Return the network with the size and the course of a change as signals that laws may use.

        A control of the machine holds its temperature as it was without the change, where it is at work.
        """
        size = Parameter(name=AMPLITUDE, start=0.0, lower=-1e12, upper=1e12, log=False)
        network = self.network.with_parameter(size).with_input(COURSE, 0.0)
        if self.control is None:
            return network
        network = network.with_input(HOLD, 0.0).with_input(HELD, 0.0)
        # A path, not a source: the solver takes paths implicitly, and a stiff source costs a hundred times the steps.
        return network.with_link(
            self.control.node, f"{HELD}_temperature", symbol(HOLD), name=HOLD, temperature=symbol(HELD)
        )

    def seen(self, node: str) -> Array:
        """Measured minus simulated temperature of a node in blocks, shape (blocks,), [K]; 0 if it is not measured."""
        for channel in self.real.channels:
            if node_of_channel(channel, [node]) == node:
                measured = self.real.reading_at(channel, self.cycle.time)
                return np.asarray(measured - self.base.temperatures[node])
        return np.zeros(len(self.cycle.time))

    def differences(
        self, changed: ThermalNetwork, sizes: Array, course: TimeCourse, extra: Mapping[str, Array] | None = None
    ) -> Differences:
        """Run the model with a change of several sizes and without.

        Parameters
        ----------
        changed : ThermalNetwork
            Made from :meth:`prepared`; without effect at size 0 and at course 0
        sizes : Array, shape (B,)
        course : Course
        extra : mapping of input to Array, shape (blocks,), or None
            Further inputs
        """
        acts = course.share(self.cycle.time)
        first = max(int(np.argmax(acts != 0.0)) - 1, 0)
        inputs = {**self.cycle.inputs, COURSE: acts, **(extra or {})}
        if self.control is not None:
            active = np.interp(self.cycle.time, self.real.time, self.control.active)
            inputs |= {HOLD: active * self.heat_W / HOLD_K, HELD: self.base.temperatures[self.control.node]}
        sizes = np.concatenate([[0.0], sizes])
        result = simulate(
            changed,
            Cycle(self.cycle.time[first:], {name: values[first:] for name, values in inputs.items()}),
            losses=self.losses,
            initial={part.name: float(self.base.temperatures[part.name][first]) for part in self.network.parts},
            parameters={**self.parameters, AMPLITUDE: sizes},
        )
        steps = np.diff(result.time)
        readings = {}
        for channel in self.real.channels:
            T = result.temperatures[node_of_channel(channel, self.network.node_names)]
            change = lagged((T[1:] - T[:1]).T, steps, self.lags.get(channel, 0.0))
            readings[f"T_{channel}"] = self._at_rows(result.time, change)
        if TOTAL_LOSS in self.real.found.values:
            readings[TOTAL_LOSS] = self._at_rows(result.time, (result.loss[1:] - result.loss[:1]).T)
        return Differences(readings=readings, result=result, network=changed, sizes=sizes, first=first)

    def _at_rows(self, time: Array, values: Array) -> Array:
        """Interpolate to the rows, shape (B, rows), from (blocks, B)."""
        return np.stack([np.interp(self.real.time, time, column) for column in values.T])


def calibrate(gearbox: Gearbox, real: RealRecording) -> CalibratedMachine:
    """Calibrate the nominal model to a recording.

    Sensors that fit far worse than the others are left out: the inference gives every sensor the same trust, and a
    broken one would bend all parameters. The structural floor is the lowest of :data:`FLOORS` at which no parameter
    leaves its prior by more than :data:`INSIDE` standard deviations.

    Raises
    ------
    InputError
        If the model cannot be simulated with these inputs.
    """
    try:
        setup, found, misfit = _fitted(gearbox, real, (), FLOORS[0])
        limit = BROKEN * float(np.median(list(misfit.values())))
        left_out = tuple(name for name, size in misfit.items() if size > limit and len(misfit) >= FEWEST_SENSORS)
        if left_out:
            setup, found, misfit = _fitted(gearbox, real, left_out, FLOORS[0])
        for floor in FLOORS[1:]:
            if _farthest(found) > INSIDE:
                setup, found, misfit = _fitted(gearbox, real, left_out, floor)
    except ArithmeticError as error:
        raise InputError(
            f"{real.path}: the model of {gearbox.file} cannot be calibrated to it ({error}); name another part of the "
            "recording, or inject a fault of measurement"
        ) from error
    first = found.parts[0].point
    network = first.machine.model.network
    return CalibratedMachine(
        real=real, nominal=setup.nominal, network=network, losses=setup.model.losses,
        parameters={p.name: float(value) for p, value in zip(network.parameters, first.setting.values, strict=True)},
        start={part.name: float(T) for part, T in zip(network.parts, first.trajectory.T[0], strict=True)},
        cycle=_cycle(setup, found, real),
        lags=dict(zip(first.sensors.channels, map(float, first.sensors.lag), strict=True)), misfit_K=misfit,
        left_out=left_out, control=find_control(real),
    )  # fmt: skip


def _fitted(
    gearbox: Gearbox, real: RealRecording, left_out: tuple[str, ...], floor: float
) -> tuple[InferenceSetup, Fit, dict[str, float]]:
    """Fit with a multiple of the structural floor; also the misfit of every temperature sensor, [K]."""
    kept = tuple(c for c in real.recording.channels if c.name not in left_out)
    recording = replace(real.recording, channels=kept)
    setup, experiment = prepare_experiment(gearbox, [recording], [recording])
    found = fitted(experiment.with_random_heat(RandomHeat(heat=floor, wander=floor)))
    residual = np.concatenate([part.point.residual for part in found.parts])
    size = np.sqrt(np.nanmean(residual**2, axis=0))
    return setup, found, {n: float(s) for n, s in zip(setup.channels, size, strict=True) if not is_total_loss(n)}


def _farthest(found: Fit) -> float:
    """Return the largest distance of a network parameter from its prior, in standard deviations."""
    pairs = zip(found.experiment.unknowns, found.z, strict=True)
    return max((abs(float(z)) for unknown, z in pairs if isinstance(unknown, NetworkParameter)), default=0.0)


def _cycle(setup: InferenceSetup, found: Fit, real: RealRecording) -> Cycle:
    """Return the inputs in blocks, with the gain of the torque and the offset of the ambient temperature that fit."""
    (recording,) = shafts([real.recording], setup.gearbox.network())
    names = setup.model.laws.inputs
    samples = np.stack([recording.inputs[name] for name in names], axis=-1)
    setting = replace(found.parts[0].point.setting, samples=samples)
    for unknown, z in zip(found.experiment.unknowns, found.z, strict=True):
        if isinstance(unknown, InputGain | InputOffset):
            unknown.act(setting, float(z))
    size = max(1, round(BLOCK_S / real.step_s))
    begins = np.arange(0, len(samples), size)
    counts = np.diff(np.append(begins, len(samples)))
    means = np.add.reduceat(samples, begins, axis=0) / counts[:, None]
    time = np.add.reduceat(recording.time + real.offset_s, begins) / counts
    time[0] = real.offset_s
    return Cycle(time, dict(zip(names, means.T, strict=True)))
