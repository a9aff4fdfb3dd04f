"""Sensors and inputs of a fit, for the tables ``[[sensor]]`` and ``[[input]]`` of a correction."""

from __future__ import annotations

from collections.abc import Collection, Mapping
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
Entry = tuple[str, str, str]  # table, channel or input, and key
LATE: Entry = ("clock", "", "late")  # the time by which temperatures come after the inputs


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
    terms = {term.label: term for term in experiment.machine.terms}
    errors = np.sqrt(np.diag(fit.covariance)).tolist()
    numbers, after = list[tuple[Entry, Estimate]](), list[tuple[Entry, Estimate]]()
    for unknown, z, error in zip(experiment.unknowns, fit.z.tolist(), errors, strict=True):
        if not in_scope(unknown, recording):
            continue
        estimate = unknown.value(z), error * unknown.per_z(z)
        if not isinstance(unknown, TermParameter):
            numbers += [(entry, estimate) for entry in _entries_of(unknown)]
        elif unknown.label not in findings and unknown.parameter.name == terms[unknown.label].strength.name:
            after += _numbers_of(terms[unknown.label], estimate)
    found: dict[Entry, Estimate] = {}
    for entry, estimate in (*numbers, *after):  # the engine shifts inputs after gains and offsets
        _put(found, entry, estimate)
    channels, driven, mixes = experiment.pieces[0].channels, experiment.machine.inputs, experiment.machine.mixes
    late, error = found.get(LATE, (0.0, 0.0))
    if late:  # late temperatures are early inputs; the measured loss has the clock of the inputs
        for name in driven:
            _put(found, ("input", name, "clock"), (late, error))
        if TOTAL_LOSS in channels:
            _put(found, ("sensor", TOTAL_LOSS, "delay"), (-late, error))
    sensors = {channel: _table(found, "sensor", channel) for channel in channels}
    true_inputs = {name: _table(found, "input", name) for name in driven if inputs is None or name in inputs}
    return (
        tuple(
            SensorCorrection(channel=channel, mix=tuple(mixes.get(channel, ())), **keys)
            for channel, keys in sensors.items() if keys or channel in mixes
        ),
        tuple(InputCorrection(name=name, **keys) for name, keys in true_inputs.items() if keys),
    )  # fmt: skip


def _entries_of(unknown: Unknown) -> list[Entry]:
    """The entry of an unknown of a sensor or an input; none of physics."""
    match unknown:
        case ClockOffset():
            return [LATE]
        case SensorBias():
            return [("sensor", unknown.channel, "bias")]
        case SensorLag():
            return [("sensor", unknown.channel, "lag")]
        case LossGain():
            return [("sensor", TOTAL_LOSS, "gain")]
        case LossDelay():
            return [("sensor", TOTAL_LOSS, "delay")]
        case InputOffset():
            return [("input", unknown.input, "offset")]
        case InputGain() if unknown.parameter.name != EFFICIENCY:  # that one is of the definition
            return [("input", unknown.input, "gain")]
    return []


def _numbers_of(term: Term, estimate: Estimate) -> list[tuple[Entry, Estimate]]:
    """The entries of a term that is a constant shift or delay, or a gain, with its strength."""
    strength = symbol(term.strength.name)
    is_constant = term.expression == strength
    if term.kind == "sensor" and term.form == "clock" and is_constant:
        return [(LATE, estimate)]
    if term.kind == "sensor" and term.form == "shift" and is_constant:
        return [(("sensor", channel, "bias"), estimate) for channel in term.target]
    if term.kind == "signal" and is_constant:
        return [(("input", term.target[0], "offset"), estimate)]
    if term.kind == "signal" and term.expression == strength * symbol(term.target[0]):
        return [(("input", term.target[0], "gain"), (1.0 + estimate[0], estimate[1]))]
    return []


def _put(found: dict[Entry, Estimate], entry: Entry, given: Estimate) -> None:
    """Add a number to that of an entry; a gain of an input multiplies all that was known of it. Errors: independent."""
    table, name, key = entry
    value, error = given
    if (table, key) != ("input", "gain"):
        before = found.get(entry, (0.0, 0.0))
        found[entry] = before[0] + value, float(np.hypot(before[1], error))
        return
    gain, gain_error = found.get(entry, (1.0, 0.0))
    found[entry] = gain * value, float(np.hypot(gain_error * value, gain * error))
    offset = (table, name, "offset")
    if offset in found:
        found[offset] = found[offset][0] * value, found[offset][1] * value


def _table(found: Mapping[Entry, Estimate], table: str, name: str) -> dict[str, Any]:
    """Keys of a channel or an input: numbers, and their standard errors."""
    own = {key: estimate for (where, of, key), estimate in found.items() if (where, of) == (table, name)}
    values = {key: value for key, (value, _) in own.items()}
    return values | {f"{key}_stderr": stderr for key, (_, stderr) in own.items()}
