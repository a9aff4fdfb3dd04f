"""Findings: answers of the decision with their sentences, grades, rivals, and numbers of a fit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from datetime import UTC, timedelta

import numpy as np
import sympy as sp

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.answer import Answer
from diagnosis.decision.posterior import Posterior
from diagnosis.engine.fit import Experiment, Fit
from diagnosis.engine.scan import scope_of, term_on_grid
from diagnosis.engine.unknown import SensorBias
from diagnosis.forward.grid import Piece
from diagnosis.recordings.recording import Recording
from diagnosis.results.advice import separation
from diagnosis.results.joint_estimate import JointEstimate
from diagnosis.results.places import node_in
from diagnosis.results.result_parts import LEAST_RIVAL, Change, Finding, ParameterValue, Rival, Switching, called
from diagnosis.setup.inference_setup import InferenceSetup
from models.base.types import Array
from models.mechanisms import Placed
from models.network.laws import symbol
from models.terms.term import Term

# In sentences about a change, whose strength shows which.
EITHER = (("smaller or greater", "smaller", "greater"), ("more or less", "less", "more"))
UNIT_SLIP = 6.0  # times its value or less that a factor of a loss rarely is; units differ by 9.5, 60, 1000
FORM_ERROR = 0.1  # of a strength and its heat: laws of the literature are hardly known better
BAND_SD = 2.0  # 95 %
HOT_DEGC = 1e6
Values = Mapping[str, tuple[float, float]]


def finding_of(answer: Answer, fit: Fit, setup: InferenceSetup, posterior: Posterior) -> Finding:
    """An answer with the numbers of a fit that has its effect; a heat like no law is never fitted and has none."""
    effect, term = answer.effect, answer.effect.term
    values, heats = values_of(fit, effect), heats_of(fit, effect)
    pieces = [part.point.piece for part in fit.parts]
    mean, stderr = mean_heat_of(fit, effect)
    found = {name: value for name, (value, _) in values.items()}
    units = {p.name: p.unit for p in (setup.nominal.parameters if term is None else term.parameters)}
    prefix = "" if term is None else f"{term.label}_"
    of_heats = {symbol.name for source in setup.nominal.sources for symbol in source.heat.free_symbols}
    return Finding(
        mechanism=effect.mechanism,
        family=effect.family,
        place=effect.place,
        node=node_in(setup.nominal, effect),
        kind="parameter" if term is None else "sensor" if term.of_measurement else term.kind,
        says=_says(answer, found, {p.name: p.start for p in setup.nominal.parameters if p.name in of_heats}),
        reference=term.mechanism.reference if isinstance(term, Placed) else "",
        equation="" if effect.is_open else _equation(effect, found),
        probability=answer.probability,
        log_bayes=answer.best.log_bayes,
        parameters=tuple(
            ParameterValue(name=name.removeprefix(prefix), value=value, stderr=sd, unit=units.get(name, "1"))
            for name, (value, sd) in values.items() if not effect.is_open and name != effect.clock
        ),
        confusable_with=_rivals(answer, setup, posterior),
        heat_mean_W=mean,
        heat_stderr_W=stderr,
        heat_max_W=max((float(np.abs(heat).max()) for heat in heats), default=0.0),
        heat=_over_time(pieces, heats) if heats else {},
        term=None if term is None else term.with_values(found),
        grade=answer.grade,
        tie_set=tuple(dict.fromkeys(called(one.mechanism, one.place) for one, _ in answer.tied)),
        joint_probability=answer.joint,
        acts_like=answer.acts_like,
        date=change_of(values, effect, fit.experiment, setup.recordings),
        switching=switching_of(values, effect),
    )  # fmt: skip


def _says(answer: Answer, found: Mapping[str, float], stated: Mapping[str, float]) -> str:
    """A sentence; `found` are values of parameters by name, `stated` those of the definition that heats depend on."""
    effect = answer.effect
    if effect.is_open:
        says = f"A heat at {effect.place.replace('_', ' ')} that is like no law of the catalogue."
    elif isinstance(effect.term, Placed):
        says = effect.term.says
    elif effect.term is None:
        value, before = found[names_of(effect)[0]], stated.get(effect.place, 0.0)
        says = f"The parameter {effect.place} is {value:.3g}, far from what the definition allows."
        if not 1.0 / UNIT_SLIP < abs(value / before if before else 1.0) < UNIT_SLIP:
            says += (
                f" It has {before:.3g}: look first for a wrong unit of an input, such as N m where kN m are recorded."
            )
    else:
        says = f"{effect.name.replace('_', ' ').capitalize()} at {effect.place.replace('_', ' ')}."
    for either, less, more in EITHER:
        if effect.term is not None and either in says:
            says = says.replace(either, less if found[effect.term.strength.name] < 0.0 else more)
    says = " ".join(says.split())
    inside = f"{says[:1].lower()}{says[1:]}"
    if answer.one_event:
        return f"One of two effects that begin or act together, so of one cause probably; this one acts like: {inside}"
    if answer.acts_like:
        return f"Something acts like this, its cause was not found: {inside}"
    if len(answer.tied) > 1:
        return f"One of several effects that these data do not separate, the most probable: {inside}"
    return says


def _equation(effect: Hypothesis, found: Mapping[str, float]) -> str:
    """The law with its numbers as LaTeX; the time of one with a date is that of the first recording."""
    term = effect.term
    if term is None:
        return ""
    local = {name.removeprefix(f"{term.label}_"): 0.0 if name == effect.clock else value
             for name, value in found.items()}  # fmt: skip
    before = term.label.removesuffix(f"_{effect.ending}")
    known = {**found, **local, **{f"{before}_{name}": value for name, value in local.items()}}
    return term.with_values(found).equation(known)


def _rivals(answer: Answer, setup: InferenceSetup, posterior: Posterior) -> tuple[Rival, ...]:
    """Other names at their most probable places: those of the tie set with its probabilities, then everything else."""

    def key(effect: Hypothesis) -> str:
        return effect.label if effect.term is None else effect.mechanism

    own = answer.effect
    others = {effect.label for effect in answer.best.effects}
    odds: dict[str, float] = {}
    alone: dict[str, float] = {}
    where: dict[str, Hypothesis] = {}
    for judged, probability in posterior.ranked:
        with_own = key(own) in {key(effect) for effect in judged.effects}
        for other in judged.effects:
            if other.label not in others and key(other) != key(own):
                odds[key(other)] = odds.get(key(other), 0.0) + probability
                alone[key(other)] = alone.get(key(other), 0.0) + (0.0 if with_own else probability)
                where.setdefault(key(other), other)
    tied: dict[str, float] = {}
    for other, probability in answer.tied:
        if key(other) != key(own):
            tied[key(other)] = tied.get(key(other), 0.0) + probability
            where[key(other)] = other
    return tuple(
        Rival(
            mechanism=where[name].mechanism, place=where[name].place, probability=probability,
            separate_by=separation(setup, own, where[name]),
            instead=name in tied or alone[name] >= LEAST_RIVAL,
        )
        for name, probability in sorted({**odds, **tied}.items(), key=lambda one: (one[0] not in tied, -one[1]))
        if probability >= LEAST_RIVAL
    )  # fmt: skip


# ---------------------------------------------------------------------- parameters


def estimates_of(fit: Fit) -> Values:
    """Value and standard error of every unknown, by the name of its parameter."""
    sd = np.sqrt(np.diag(fit.covariance))
    return {
        unknown.parameter.name: (unknown.value(z), unknown.per_z(z) * error)
        for unknown, z, error in zip(fit.experiment.unknowns, fit.z.tolist(), sd.tolist(), strict=True)
    }


def joint_estimate_of(fit: Fit) -> JointEstimate:
    """Every unknown with its standard error, and how they correlate; values grow with `z`."""
    estimates, covariance = estimates_of(fit), fit.covariance
    sd = np.sqrt(np.diag(covariance))
    values, stderr = zip(*estimates.values(), strict=True)
    return JointEstimate(
        names=tuple(estimates), units=tuple(unknown.parameter.unit for unknown in fit.experiment.unknowns),
        values=np.array(values), stderr=np.array(stderr), correlation=covariance / np.outer(sd, sd),
    )  # fmt: skip


def names_of(effect: Hypothesis) -> tuple[str, ...]:
    """Names of the unknowns that belong to an effect."""
    return (effect.place,) if effect.term is None else tuple(p.name for p in effect.term.parameters)


def parameters_of(fit: Fit, term: Term) -> Values:
    """Value and standard error of every parameter of a term; of one that is not an unknown, its start and 0."""
    known, switches = estimates_of(fit), switch_errors(fit, term)
    found = {p.name: known.get(p.name, (p.start, 0.0)) for p in term.parameters}
    return {name: (value, math.hypot(error, switches.get(name, 0.0))) for name, (value, error) in found.items()}


def values_of(fit: Fit, effect: Hypothesis) -> Values:
    """Value and standard error of every parameter of an effect, or of the one outside its prior that it is.

    A law's strength includes the error of its form; the constant bias of a sensor includes what was calibrated of it.
    """
    term = effect.term
    if term is None:
        return {effect.place: estimates_of(fit)[effect.place]}
    found, name = parameters_of(fit, term), term.strength.name
    if not term.of_measurement:
        value, error = found[name]
        return {**found, name: (value, math.hypot(error, FORM_ERROR * value))}
    return {**found, name: _whole_bias(fit, term)} if _is_bias(term) else found


def switch_errors(fit: Fit, term: Term) -> dict[str, float]:
    """Return the errors of set-point and band of a two-point control that a straight line does not have, [K].

    Readings say between which two grid points it switched, so a switching temperature is known to about half of what
    the temperature changes from one to the next.
    """
    if (control := _two_point(term)) is None:
        return {}
    state, switch, set_point, band = control
    network = fit.parts[0].point.machine.model.network
    index = [one.name for one in network.states].index(state)
    read = {s.name for s in switch.free_symbols}
    nodes = [i for i, part in enumerate(network.parts) if f"T_{part.name}" in read]
    changes: list[float] = []
    for trajectory in fit.trajectories if nodes else ():
        switched = np.flatnonzero(np.diff(trajectory.memory[:, index])) + 1
        T = trajectory.seen[:, nodes].mean(axis=1)
        changes += (T[switched] - T[switched - 1]).tolist()
    if not changes:
        return {}
    half = 0.5 * float(np.sqrt(np.mean(np.square(changes))))
    return {set_point: half / math.sqrt(2.0), band: half * math.sqrt(2.0)}


def _two_point(term: Term) -> tuple[str, sp.Expr, str, str] | None:
    """The state of a two-point control, its law, and the names of set-point and band; None if a term has none."""
    set_point, band = f"{term.label}_set_point", f"{term.label}_band"
    switches = [(state.name, state.update) for state in term.states if state.update is not None]
    if not switches or not {set_point, band} <= {p.name for p in term.parameters}:
        return None
    return *switches[0], set_point, band


def _is_bias(term: Term) -> bool:
    return term.kind == "sensor" and term.form == "shift" and term.expression == symbol(term.strength.name)


def _whole_bias(fit: Fit, term: Term) -> tuple[float, float]:
    """A constant error of a channel, the calibrated tolerance of its sensor included."""
    chosen = [i for i, unknown in enumerate(fit.experiment.unknowns)
              if unknown.parameter.name == term.strength.name
              or (isinstance(unknown, SensorBias) and unknown.channel == term.target[0])]  # fmt: skip
    unknowns, pick = [fit.experiment.unknowns[i] for i in chosen], np.zeros(len(fit.z))
    zs = fit.z[chosen].tolist()
    pick[chosen] = [unknown.per_z(z) for unknown, z in zip(unknowns, zs, strict=True)]
    total = sum(unknown.value(z) for unknown, z in zip(unknowns, zs, strict=True))
    return float(total), float(np.sqrt(pick @ fit.covariance @ pick))


# ---------------------------------------------------------------------- heat


def heats_of(fit: Fit, effect: Hypothesis) -> list[Array]:
    """Heat of an effect over the intervals of every piece, summed over the parts it warms, [W]; none of a fault."""
    if not effect.in_network:
        return []
    values = np.array([[value for value, _ in values_of(fit, effect).values()]])
    return [heat[:, 0] for heat in _heats_with(fit, effect, values)]


def _over_time(pieces: Sequence[Piece], heats: Sequence[Array]) -> dict[str, tuple[Array, Array]]:
    """Heats of pieces [W] by recording: time at the middles of the intervals [s], and heat."""
    result: dict[str, tuple[Array, Array]] = {}
    for piece, heat in zip(pieces, heats, strict=True):
        time, before = piece.middle, result.get(piece.recording)
        result[piece.recording] = (time, heat) if before is None else (
            np.concatenate([before[0], time]), np.concatenate([before[1], heat]))  # fmt: skip
    return result


def mean_heat_of(fit: Fit, effect: Hypothesis) -> tuple[float, float]:
    """Mean magnitude of the heat of an effect where it may act, and its standard error, [W]; nothing of a fault.

    The error is that of the effect's own parameters, everything else marginalised, and of the form of its law.
    """
    if not effect.in_network:
        return 0.0, 0.0
    names = names_of(effect)
    own = [i for i, unknown in enumerate(fit.experiment.unknowns) if unknown.parameter.name in names]
    unknowns, covariance = [fit.experiment.unknowns[i] for i in own], fit.covariance[np.ix_(own, own)]
    sd = np.sqrt(np.diag(covariance))
    moved = fit.z[own] + np.concatenate([np.zeros((1, len(own))), np.diag(sd), -np.diag(sd)])
    start = values_of(fit, effect)
    rows = [{name: value for name, (value, _) in start.items()}
            | {u.parameter.name: u.value(z) for u, z in zip(unknowns, row, strict=True)}
            for row in moved.tolist()]  # fmt: skip
    values = np.array([[row[name] for name in names] for row in rows])
    scope = scope_of(fit.experiment, effect)
    acting = [scope is None or part.point.piece.recording in scope for part in fit.parts]
    steps = np.concatenate([
        part.point.piece.steps * acts for part, acts in zip(fit.parts, acting, strict=True)
    ])  # fmt: skip
    means = np.average(np.abs(np.concatenate(_heats_with(fit, effect, values))), axis=0, weights=steps)
    up, down = np.split(means[1:], 2)
    along = np.divide(up - down, 2.0 * sd, out=np.zeros(len(own)), where=sd > 0.0)
    return float(means[0]), math.hypot(float(np.sqrt(along @ covariance @ along)), FORM_ERROR * float(means[0]))


def _heats_with(fit: Fit, effect: Hypothesis, values: Array) -> list[Array]:
    """Heat with each row of `values`, the first as fitted, for its parameters; shape (K, rows) per piece, [W]."""
    experiment = fit.experiment
    term, scope, result = term_on_grid(experiment.machine.model, effect.added), scope_of(experiment, effect), []
    for part in fit.parts:
        trajectory = part.point.trajectory
        recording, here = trajectory.piece.recording, np.array(values)
        if effect.clock is not None:
            here[:, names_of(effect).index(effect.clock)] = experiment.starts_at.get(recording, 0.0)
        heat = np.nan_to_num(term.heat(trajectory, here, there=here[0])[0])
        positive, negative = heat.clip(0.0).sum(axis=1), heat.clip(None, 0.0).sum(axis=1)
        total = np.where(positive > -negative, positive, negative)
        result.append(total * (scope is None or recording in scope))
    return result


# ---------------------------------------------------------------------- when


def change_of(
    values: Values, effect: Hypothesis, experiment: Experiment, recordings: Sequence[Recording]
) -> Change | None:
    """When an effect begins, by the time of the recording in which it does; None if it has no date.

    Its band does not go beyond the recordings: before them, and after them, all dates look alike.
    """
    if effect.date is None:
        return None
    since, error = values[effect.date]
    starts = {r.name: experiment.starts_at.get(r.name, 0.0) for r in recordings}
    begun = [name for name, start in starts.items() if start <= since] or [min(starts, key=lambda name: starts[name])]
    recording = next(r for r in recordings if r.name == max(begun, key=lambda name: starts[name]))
    at = since - starts[recording.name]
    ends = (piece.time[-1] + starts[piece.recording] for piece in experiment.pieces if piece.recording in starts)
    first, last = min(starts.values()) - starts[recording.name], float(max(ends)) - starts[recording.name]
    lasting = values.get(effect.date.removesuffix("since") + "lasting")
    return Change(
        recording=recording.name, from_s=at,
        band_s=(max(at - BAND_SD * error, min(first, at)), min(at + BAND_SD * error, last))
        if 0.0 < error < np.inf else None,
        to_s=None if lasting is None else at + lasting[0],
        utc=None if recording.start is None else (recording.start + timedelta(seconds=at)).astimezone(UTC).isoformat(),
    )  # fmt: skip


def switching_of(values: Values, effect: Hypothesis) -> Switching | None:
    """Temperatures at which the two-point control of an effect switches on and off; None if it has none."""
    if effect.term is None or (control := _two_point(effect.term)) is None:
        return None
    _, switch, set_point, band = control
    upper, lower = (values[set_point][0] + way * 0.5 * values[band][0] for way in (1.0, -1.0))
    known = {symbol(name): sp.Float(value) for name, (value, _) in values.items()}
    hot = {s: sp.Float(HOT_DEGC) for s in switch.free_symbols if s.name.startswith("T_")}
    others = {s: sp.Integer(0) for s in switch.free_symbols if s not in known and s not in hot}
    on_when_hot = float(switch.xreplace(known | hot | others)) > 0.5
    on, off = (upper, lower) if on_when_hot else (lower, upper)
    return Switching(on_degC=on, off_degC=off, of=tuple(sorted(s.name.removeprefix("T_") for s in hot)))
