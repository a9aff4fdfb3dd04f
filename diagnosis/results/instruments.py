"""Sensors and inputs of a fit, for the tables ``[[sensor]]`` and ``[[input]]`` of a correction."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from diagnosis.engine.fit import Fit
from diagnosis.engine.unknown import (
    ClockOffset,
    InputGain,
    InputOffset,
    LossDelay,
    LossGain,
    SensorBias,
    SensorLag,
    TermParameter,
    Unknown,
    in_scope,
)
from diagnosis.setup.shaft import EFFICIENCY
from models.correction.instruments import InputCorrection, SensorCorrection
from models.network.laws import symbol
from models.quantities.quantities import TOTAL_LOSS
from models.terms.term import Term

Estimate = tuple[float, float]  # value and standard error


@dataclass(kw_only=True)
class _Collected:
    """Numbers by channel or input, and by key of its table."""

    sensors: dict[str, dict[str, Estimate]] = field(default_factory=dict)
    inputs: dict[str, dict[str, Estimate]] = field(default_factory=dict)
    late: Estimate = (0.0, 0.0)

    def delay(self, given: Estimate) -> None:
        """Add to the time by which temperatures come after the inputs."""
        self.late = (self.late[0] + given[0], float(np.hypot(self.late[1], given[1])))

    def add(self, table: dict[str, dict[str, Estimate]], name: str, key: str, given: Estimate) -> None:
        """Put a number in; a second one of a key is added, standard errors as of independent numbers."""
        before = table.setdefault(name, {}).get(key, (0.0, 0.0))
        table[name][key] = (before[0] + given[0], float(np.hypot(before[1], given[1])))

    def scale(self, name: str, factor: Estimate) -> None:
        """Multiply all that was known of an input."""
        own = self.inputs.setdefault(name, {})
        gain = own.get("gain", (1.0, 0.0))
        own["gain"] = (gain[0] * factor[0], float(np.hypot(gain[1] * factor[0], gain[0] * factor[1])))
        if "offset" in own:
            own["offset"] = (own["offset"][0] * factor[0], own["offset"][1] * factor[0])


def sensors_and_inputs_of(
    fit: Fit,
    *,
    findings: Collection[str] = (),
    inputs: Collection[str] | None = None,
) -> tuple[tuple[SensorCorrection, ...], tuple[InputCorrection, ...]]:
    """How the columns of the recorder differ from the machine by a fit, in the first recording that is no baseline.

    Parameters
    ----------
    findings : collection of str
        Labels of terms that the correction has as ``[[finding]]``; they are left out here, because both are applied
    inputs : collection of str, optional
        Of the definition, where the fit has a speed or a torque that the definition lacks

    Returns
    -------
    sensors : tuple of SensorCorrection
        One per channel of the fit, in their order; without those of ideal sensors
    inputs : tuple of InputCorrection
    """
    experiment = fit.experiment
    names = [piece.recording for piece in experiment.pieces]
    recording = next((name for name in names if name not in experiment.healthy), names[0])
    collected, terms = _Collected(), {term.label: term for term in experiment.machine.terms}
    errors = np.sqrt(np.diag(fit.covariance)).tolist()
    after: list[tuple[Term, Estimate]] = []
    for unknown, z, error in zip(experiment.unknowns, fit.z.tolist(), errors, strict=True):
        if not in_scope(unknown, recording):
            continue
        estimate = unknown.value(z), error * unknown.per_z(z)
        if not isinstance(unknown, TermParameter):
            _collect(collected, unknown, estimate)
        elif unknown.label not in findings and unknown.parameter.name == terms[unknown.label].strength.name:
            after.append((terms[unknown.label], estimate))
    for term, estimate in after:  # the engine shifts inputs after gains and offsets
        _collect_term(collected, term, estimate)
    mixes = experiment.machine.mixes
    _collect_clock(collected, experiment.machine.inputs, has_loss=TOTAL_LOSS in experiment.pieces[0].channels)
    return (
        tuple(
            SensorCorrection(
                channel=channel, mix=tuple(mixes.get(channel, ())), **_table(collected.sensors.get(channel, {}))
            )
            for channel in experiment.pieces[0].channels
            if channel in collected.sensors or channel in mixes
        ),
        tuple(
            InputCorrection(name=name, **_table(collected.inputs[name]))
            for name in experiment.machine.inputs
            if name in collected.inputs and (inputs is None or name in inputs)
        ),
    )  # fmt: skip


def _collect(collected: _Collected, unknown: Unknown, estimate: Estimate) -> None:
    """Put an unknown of a sensor or an input in; others are physics."""
    if isinstance(unknown, ClockOffset):
        collected.delay(estimate)
    elif isinstance(unknown, SensorBias):
        collected.add(collected.sensors, unknown.channel, "bias", estimate)
    elif isinstance(unknown, SensorLag):
        collected.add(collected.sensors, unknown.channel, "lag", estimate)
    elif isinstance(unknown, LossGain):
        collected.add(collected.sensors, TOTAL_LOSS, "gain", estimate)
    elif isinstance(unknown, LossDelay):
        collected.add(collected.sensors, TOTAL_LOSS, "delay", estimate)
    elif isinstance(unknown, InputOffset):
        collected.add(collected.inputs, unknown.input, "offset", estimate)
    elif isinstance(unknown, InputGain) and unknown.parameter.name != EFFICIENCY:  # that one is of the definition
        collected.scale(unknown.input, estimate)


def _collect_term(collected: _Collected, term: Term, estimate: Estimate) -> None:
    """Put a term in that is a constant shift or delay, or a gain."""
    if term.kind == "sensor" and term.form == "clock" and _is_constant(term):
        collected.delay(estimate)
    elif term.kind == "sensor" and term.form == "shift" and _is_constant(term):
        for channel in term.target:
            collected.add(collected.sensors, channel, "bias", estimate)
    elif term.kind == "signal" and _is_constant(term):
        collected.add(collected.inputs, term.target[0], "offset", estimate)
    elif term.kind == "signal" and term.expression == symbol(term.strength.name) * symbol(term.target[0]):
        collected.scale(term.target[0], (1.0 + estimate[0], estimate[1]))


def _collect_clock(collected: _Collected, inputs: Sequence[str], *, has_loss: bool) -> None:
    """Turn late temperatures into early inputs; the measured loss has the clock of the inputs."""
    value, error = collected.late
    if not value:
        return
    for name in inputs:
        collected.add(collected.inputs, name, "clock", (value, error))
    if has_loss:
        collected.add(collected.sensors, TOTAL_LOSS, "delay", (-value, error))


def _is_constant(term: Term) -> bool:
    return bool(term.expression == symbol(term.strength.name))


def _table(estimates: Mapping[str, Estimate]) -> dict[str, Any]:
    """Keys of a table: numbers, and their standard errors."""
    values = {key: value for key, (value, _) in estimates.items()}
    return values | {f"{key}_stderr": stderr for key, (_, stderr) in estimates.items()}
