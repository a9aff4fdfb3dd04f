"""All families of candidates of an experiment, and their prior."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.candidates.controls import moved_set_points
from diagnosis.candidates.dated import (
    Axis,
    carried_on,
    changing,
    comes_daily,
    each_day,
    for_a_while,
    has_clock,
    in_one_of,
    in_times,
    may_change,
    over_hours,
    step,
    without_repeats,
)
from diagnosis.candidates.factors import factors_of
from diagnosis.candidates.hypotheses import Hypothesis, hypothesis_of, law_of
from diagnosis.engine.fit import Experiment
from diagnosis.engine.learnt import family_priors
from diagnosis.engine.set_apart import standing_still
from diagnosis.engine.unknown import NetworkParameter, SensorBias
from diagnosis.forward.grid import Piece
from diagnosis.setup.inference_setup import STANDSTILL_RPM, InferenceSetup
from models.mechanisms import Placed
from models.mechanisms.ageing import FAMILY as AGEING
from models.mechanisms.forms import EDGE_S
from models.mechanisms.measurement import DAY_S
from models.quantities.quantities import is_total_loss

DATES = 14  # of a long recording
LONG = 0.5  # of the longest recording
SENSOR_SD_K, TOLERANCES = 1.0, 3.0  # of a step of a thermometer: at least, and so many times its tolerance
RADIATION = "radiation_error"  # the one law of the model that is part of a link


def candidates_of(setup: InferenceSetup, experiment: Experiment) -> tuple[Hypothesis, ...]:
    """All that may be missing, wrong, or changed.

    Returns
    -------
    tuple of Hypothesis
        Mechanisms of the catalogue, changes at a date and over hours, laws of time that go on in the next recording,
        other set-points of known controls, parameters outside their priors
    """
    network = experiment.network
    known = {p.name for p in network.parameters}  # what the machine is known to have is there once
    placed = [one for m in setup.catalogue.values() for one in m.placed(network, setup.scale, setup.channels)
              if one.strength.name not in known]  # fmt: skip
    factors = factors_of(network, setup.scale, setup.channels)
    controls = list(moved_set_points(setup.known.findings, setup.scale))
    axis = axis_of(experiment)
    files, still = _spans(experiment), standing_still(experiment)
    several = len(files) > 1
    names = {law_of(name): name for name in setup.catalogue} | {name: name for name in setup.catalogue}
    return tuple(
        replace(one, known_as=names.get(one.name, names.get(one.law)))
        for one in (
            *(hypothesis_of(one) for one in placed if one.form != "stuck"),
            *(
                changing(one, in_times(still[one.place]), axis)
                for one in placed
                if one.form == "stuck" and one.place in still
            ),
            *(
                changing(one, in_one_of(list(files.values())), axis)
                for one in placed
                if one.form == "swapped" and several
            ),
            *changes(factors, placed, axis, _sensor_sd(experiment)),
            *(hypothesis_of(one) for one in controls),
            *(
                changing(one, course, axis, every_shape=True)
                for one in controls
                for course in (step(axis, slow=False), for_a_while(axis))
                if len(course.variants)
            ),
            *(carried_on(one, axis) for one in placed if several and has_clock(one)),
            *(each_day(one, axis) for one in placed if axis.hour is not None and axis.end > DAY_S and comes_daily(one)),
            *parameters_outside(experiment),
        )
    )


def changes(
    factors: Sequence[Placed], catalogue: Sequence[Placed], axis: Axis, sensor_sd: Mapping[str, float]
) -> list[Hypothesis]:
    """Changes of laws over the time axis.

    The model's own laws, radiation, sensors and inputs may have any course; other mechanisms of the catalogue begin at
    a date. Ageing has a course already.
    """
    known = [one for one in catalogue if may_change(one) and one.family != AGEING]
    laws = without_repeats([*factors, *known])
    courses = [step(axis), for_a_while(axis), over_hours(axis)]
    return [
        changing(one, course, axis, sd=sensor_sd.get(one.target[0]) if one.name == "sensor_bias" else None)
        for one in laws
        for course in (
            courses if one in factors or one.of_measurement or one.name == RADIATION else [step(axis, slow=False)]
        )
        if len(course.variants)
    ]


def _sensor_sd(experiment: Experiment) -> dict[str, float]:
    """Prior of a step of every thermometer: some times its tolerance, [K]."""
    return {
        unknown.channel: max(SENSOR_SD_K, TOLERANCES * unknown.parameter.sd)
        for unknown in experiment.unknowns
        if isinstance(unknown, SensorBias) and not is_total_loss(unknown.channel)
    }


def parameters_outside(experiment: Experiment) -> list[Hypothesis]:
    """Every parameter of the network outside its prior."""
    return [
        Hypothesis(name="parameter", place=unknown.parameter.name, family="parameter", unknown=index,
                   law=f"parameter {unknown.parameter.name}", variants=np.ones((1, 1)))
        for index, unknown in enumerate(experiment.unknowns)
        if isinstance(unknown, NetworkParameter)
    ]  # fmt: skip


def axis_of(experiment: Experiment) -> Axis:
    """The time axis of an experiment, with dates at which something may change.

    Long recordings have :data:`DATES` dates, evenly over the time that the machine runs; shorter ones their start and
    their middle. Nothing changes in healthy recordings, or at the first moment of all.
    """
    of_recording: dict[str, list[Piece]] = {}
    for piece in experiment.pieces:
        if piece.recording not in experiment.healthy:
            of_recording.setdefault(piece.recording, []).append(piece)
    spans = _spans(experiment)
    longest = max(last - first for first, last in spans.values())
    dates: list[float] = []
    for name, (first, last) in spans.items():
        start = experiment.starts_at.get(name, 0.0)
        if last - first >= LONG * longest:
            dates += [start + date for date in _running(of_recording[name])]
        else:
            middle = 0.5 * (first + last)
            dates += [start, middle] if dates else [middle]
    end = max(last for _, last in spans.values())
    interval = float(np.median(np.concatenate([piece.steps for piece in experiment.pieces])))
    return Axis(dates=np.array(sorted(dates)), end=end, until=max(end, experiment.until),
                edge_s=2.0 * max(EDGE_S, interval if experiment.slow else 0.0), hour=experiment.hour)  # fmt: skip


def _spans(experiment: Experiment) -> dict[str, tuple[float, float]]:
    """First and last row of every recording that is not healthy, in the order of time, [s] on the axis."""
    spans: dict[str, tuple[float, float]] = {}
    for piece in experiment.pieces:
        if piece.recording not in experiment.healthy:
            start = experiment.starts_at.get(piece.recording, 0.0)
            first, _ = spans.get(piece.recording, (start + float(piece.time[0]), 0.0))
            spans[piece.recording] = first, start + float(piece.time[-1])
    return dict(sorted(spans.items(), key=lambda one: experiment.starts_at.get(one[0], 0.0)))


def _running(pieces: Sequence[Piece]) -> list[float]:
    """Dates in a recording, evenly over the time that the machine runs, [s] since its first row."""
    begin, steps = np.concatenate([p.time[:-1] for p in pieces]), np.concatenate([p.steps for p in pieces])
    runs = np.abs(np.concatenate([p.inputs[:, 0] for p in pieces])) > STANDSTILL_RPM  # of the speed
    if not runs.any():
        runs[:] = True
    passed = np.concatenate([[0.0], np.cumsum(steps * runs)])
    wanted = (np.arange(DATES) + 0.5) / DATES * passed[-1]
    at = np.searchsorted(passed, wanted, side="right") - 1
    at = np.minimum(at, len(begin) - 1)
    return [float(t) for t in begin[at] + wanted - passed[at]]


def with_priors(hypotheses: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
    """All hypotheses with their priors: the share of the family, uniform over its names and then over places.

    The priors of all together are 1.
    """
    places = Counter((h.how, h.name) for h in hypotheses)
    names = Counter(how for how, _ in places)
    shares = family_priors()
    log = np.array([np.log(shares[h.how] / names[h.how] / places[h.how, h.name]) for h in hypotheses])
    log = log - np.logaddexp.reduce(log)
    return tuple(replace(h, log_prior=value) for h, value in zip(hypotheses, log.tolist(), strict=True))
