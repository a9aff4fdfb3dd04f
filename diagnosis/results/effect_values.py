"""Numbers of an effect in a fit: its parameters, its heat, when it begins, and when it switches."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from datetime import UTC, timedelta

import numpy as np
import sympy as sp

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.engine.fit import Experiment, Fit
from diagnosis.engine.unknown import SensorBias, Unknown
from diagnosis.forward.term_on_grid import TermOnGrid
from diagnosis.recordings.recording import Recording
from diagnosis.results.result_parts import Change, Switching
from models.base.types import Array
from models.network.laws import symbol
from models.terms.term import Term

FORM_ERROR = 0.1  # of a strength and its heat: laws of the literature are hardly known better
SLOPE_STEP = 1e-4  # of a prior standard deviation
BAND_SD = 2.0  # 95 %
SINCE, LASTING = "_since", "_lasting"  # see diagnosis.candidates.dated
HOT_DEGC = 1e6
Values = Mapping[str, tuple[float, float]]


def slope(unknown: Unknown, z: float) -> float:
    """Magnitude of the change of a value with `z`; at a bound that to the inside."""
    here = unknown.value(z)
    return max(abs(unknown.value(z + way) - here) for way in (SLOPE_STEP, -SLOPE_STEP)) / SLOPE_STEP


def names_of(effect: Hypothesis) -> tuple[str, ...]:
    """Names of the unknowns that belong to an effect."""
    return (effect.place,) if effect.term is None else tuple(p.name for p in effect.term.parameters)


def values_of(fit: Fit, effect: Hypothesis) -> Values:
    """Value and standard error of every parameter of an effect; of one that is not an unknown, its start and 0.

    A law's strength includes the error of its form; the constant bias of a sensor includes what was calibrated of it.
    """
    sd, unknowns = np.sqrt(np.diag(fit.covariance)), fit.experiment.unknowns
    found = {} if effect.term is None else {p.name: (p.start, 0.0) for p in effect.term.parameters}
    for index in _places_of(fit, names_of(effect)):
        unknown, z = unknowns[index], float(fit.z[index])
        found[unknown.parameter.name] = unknown.value(z), slope(unknown, z) * float(sd[index])
    if effect.term is None:
        return found
    name = effect.term.strength.name
    if not effect.term.of_measurement:
        value, error = found[name]
        return {**found, name: (value, math.hypot(error, FORM_ERROR * value))}
    return {**found, name: _whole_bias(fit, effect.term)} if _is_bias(effect.term) else found


def _places_of(fit: Fit, names: Sequence[str]) -> list[int]:
    return [i for i, unknown in enumerate(fit.experiment.unknowns) if unknown.parameter.name in names]


def _is_bias(term: Term) -> bool:
    return term.kind == "sensor" and term.form == "shift" and term.expression == symbol(term.strength.name)


def _whole_bias(fit: Fit, term: Term) -> tuple[float, float]:
    """A constant error of a channel, the calibrated tolerance of its sensor included."""
    chosen = [i for i, unknown in enumerate(fit.experiment.unknowns)
              if unknown.parameter.name == term.strength.name
              or (isinstance(unknown, SensorBias) and unknown.channel == term.target[0])]  # fmt: skip
    unknowns, pick = [fit.experiment.unknowns[i] for i in chosen], np.zeros(len(fit.z))
    zs = fit.z[chosen].tolist()
    pick[chosen] = [slope(unknown, z) for unknown, z in zip(unknowns, zs, strict=True)]
    total = sum(unknown.value(z) for unknown, z in zip(unknowns, zs, strict=True))
    return float(total), float(np.sqrt(pick @ fit.covariance @ pick))


# ---------------------------------------------------------------------- heat


def heats_of(fit: Fit, effect: Hypothesis) -> list[Array]:
    """Heat of an effect over the intervals of every piece, summed over the parts it warms, [W]; none of a fault."""
    if not effect.in_network:
        return []
    values = np.array([[values_of(fit, effect)[name][0] for name in names_of(effect)]])
    return [heat[:, 0] for heat in _heats_with(fit, effect, values)]


def mean_heat_of(fit: Fit, effect: Hypothesis) -> tuple[float, float]:
    """Mean magnitude of the heat of an effect where it may act, and its standard error, [W]; nothing of a fault.

    The error is that of the effect's own parameters, everything else marginalised, and of the form of its law.
    """
    if not effect.in_network:
        return 0.0, 0.0
    own = _places_of(fit, names_of(effect))
    unknowns, covariance = [fit.experiment.unknowns[i] for i in own], fit.covariance[np.ix_(own, own)]
    sd = np.sqrt(np.diag(covariance))
    moved = fit.z[own] + np.concatenate([np.zeros((1, len(own))), np.diag(sd), -np.diag(sd)])
    start = values_of(fit, effect)
    rows = [{name: value for name, (value, _) in start.items()}
            | {u.parameter.name: u.value(z) for u, z in zip(unknowns, row, strict=True)}
            for row in moved.tolist()]  # fmt: skip
    values = np.array([[row[name] for name in names_of(effect)] for row in rows])
    acting = [part.point.trajectory.piece.recording not in fit.experiment.healthy for part in fit.parts]
    steps = np.concatenate([
        part.point.trajectory.piece.steps * acts for part, acts in zip(fit.parts, acting, strict=True)
    ])  # fmt: skip
    means = np.average(np.abs(np.concatenate(_heats_with(fit, effect, values))), axis=0, weights=steps)
    up, down = np.split(means[1:], 2)
    along = np.divide(up - down, 2.0 * sd, out=np.zeros(len(own)), where=sd > 0.0)
    return float(means[0]), math.hypot(float(np.sqrt(along @ covariance @ along)), FORM_ERROR * float(means[0]))


def _heats_with(fit: Fit, effect: Hypothesis, values: Array) -> list[Array]:
    """Heat with each row of `values`, the first as fitted, for its parameters; shape (K, rows) per piece, [W]."""
    assert effect.term is not None  # noqa: S101 - only a term brings heat
    experiment = fit.experiment
    term, result = TermOnGrid(experiment.machine.model, effect.term), []
    for part in fit.parts:
        trajectory = part.point.trajectory
        recording, here = trajectory.piece.recording, np.array(values)
        if effect.clock is not None:
            here[:, names_of(effect).index(effect.clock)] = experiment.starts_at.get(recording, 0.0)
        heat = np.nan_to_num(term.heat(trajectory, here, there=here[0])[0])
        positive, negative = heat.clip(0.0).sum(axis=1), heat.clip(None, 0.0).sum(axis=1)
        total = np.where(positive > -negative, positive, negative)
        result.append(total * (recording not in experiment.healthy))
    return result


# ---------------------------------------------------------------------- when


def change_of(
    values: Values, effect: Hypothesis, experiment: Experiment, recordings: Sequence[Recording]
) -> Change | None:
    """When an effect begins, by the time of the recording in which it does; None if it has no date."""
    if effect.term is None or f"{effect.term.label}{SINCE}" not in values:
        return None
    since, error = values[f"{effect.term.label}{SINCE}"]
    starts = {r.name: experiment.starts_at.get(r.name, 0.0) for r in recordings}
    begun = [name for name, start in starts.items() if start <= since] or [min(starts, key=lambda name: starts[name])]
    recording = next(r for r in recordings if r.name == max(begun, key=lambda name: starts[name]))
    at = since - starts[recording.name]
    lasting = values.get(f"{effect.term.label}{LASTING}")
    return Change(
        recording=recording.name, from_s=at,
        band_s=(at - BAND_SD * error, at + BAND_SD * error) if 0.0 < error < np.inf else None,
        to_s=None if lasting is None else at + lasting[0],
        utc=None if recording.start is None else (recording.start + timedelta(seconds=at)).astimezone(UTC).isoformat(),
    )  # fmt: skip


def switching_of(values: Values, effect: Hypothesis) -> Switching | None:
    """Temperatures at which the two-point control of an effect switches on and off; None if it has none."""
    term = effect.term
    if term is None:
        return None
    set_point, band = f"{term.label}_set_point", f"{term.label}_band"
    switch = next((s.update for s in term.states if s.update is not None), None)
    if switch is None or set_point not in values or band not in values:
        return None
    upper, lower = (values[set_point][0] + way * 0.5 * values[band][0] for way in (1.0, -1.0))
    known = {symbol(name): sp.Float(value) for name, (value, _) in values.items()}
    hot = {s: sp.Float(HOT_DEGC) for s in switch.free_symbols if s.name.startswith("T_")}
    others = {s: sp.Integer(0) for s in switch.free_symbols if s not in known and s not in hot}
    on_when_hot = float(switch.xreplace(known | hot | others)) > 0.5
    return Switching(on_degC=upper, off_degC=lower) if on_when_hot else Switching(on_degC=lower, off_degC=upper)
