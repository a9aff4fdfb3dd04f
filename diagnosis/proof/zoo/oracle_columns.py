"""Columns of the oracle for a zoo plant: parameters, random heat, start temperatures, and the model error of a tool.

Model error: a smooth function of standard deviation 4 % (polynomial of degree 2 in the inputs of the machine other
than temperatures, and the oil temperature, all standardised over the training recordings) on every source of heat and
every path; 10 % of every path, every capacity, and of the heat of every source that goes to a neighbour instead; 4 % of
every neighbour in what a sensor shows; 0.1 K for every sensor; and what a tool knows that it does not know of its
inputs and of the loss meter (:data:`INPUT_GAIN`, :data:`INPUT_K`, :data:`METER_GAIN`, :data:`METER_ZERO_W`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from diagnosis.proof.plant.cycles import TRAIN, Programme
from diagnosis.proof.plant.instruments import Instruments
from diagnosis.proof.zoo.oracle import LOSS, MEAN_S, OracleDesign, RecordingColumns, averaged
from diagnosis.proof.zoo.run import follow, read_probes
from diagnosis.proof.zoo.simulate import Direction, LinearRun, ParameterDirection, StartDirection
from diagnosis.proof.zoo.structure import Law, Moment, Probe, ZooChange, ZooPlant, constant, times
from models.base.types import Array

SMOOTH_SD, LUMPED_SD, MIXING_SD, SENSOR_K = 0.04, 0.1, 0.04, 0.1
INPUT_GAIN, INPUT_K = {"speed": 0.002}, 0.3  # relative, 1 % of inputs not named; of ambient temperatures
ORDINARY_GAIN = 0.01
METER_GAIN, METER_ZERO_W = 0.02, 2.0
START_K = 0.5  # of every body, and of all together
KNOTS_S = 600.0  # between which a random heat is straight, at least
TOGETHER = 250  # directions that are simulated at once
FARTHEST = 3.0  # standard deviations, where coordinates are held


def design_of(plant: ZooPlant, programmes: Sequence[Programme], instruments: Instruments) -> OracleDesign:
    """The oracle's design of one plant; of `programmes` those whose name starts with ``train`` count.

    Parameters
    ----------
    plant : ZooPlant
        Healthy
    """
    runs = [LinearRun(plant, one) for one in programmes if one.name.startswith(TRAIN)]
    parameters = [ParameterDirection(name=n, step=sd * plant.parameters[n]) for n, sd in plant.spread.items()]
    smooth = _Smooth(plant, runs)
    errors = [*_errors_of_laws(plant, smooth), *_errors_of_splits(plant), *_errors_of_inputs(plant)]
    return OracleDesign([_columns(run, instruments, parameters, errors) for run in runs])


def _columns(
    run: LinearRun,
    instruments: Instruments,
    parameters: Sequence[Direction],
    errors: Sequence[Direction],
) -> RecordingColumns:
    """All columns of one recording."""
    plant, programme = run.laws.plant, run.clock.programme
    probes = [probe for probe in plant.probes if probe.channel in instruments.channels]
    channels = (*(probe.channel for probe in probes), *(() if instruments.loss_noise is None else (LOSS,)))
    per_mean = max(1, round(MEAN_S / plant.row_s))
    whole = {name: run.base_rows.T[name][None] for name in (*run.laws.bodies, *run.laws.boundaries)}
    readings = read_probes(plant, whole, programme.unrecorded)
    loss = run.base_rows.loss[programme.unrecorded :]

    local, mixes = [_starts(plant)], []
    for body, watts in programme.random_heat.items():
        local.append(_random_heat(plant, programme, body, watts))
    directions = [direction for group in local for direction in group.directions]
    found = _responses(run, [*directions, *parameters, *errors], channels, per_mean)
    of_local, of_plant, of_tool = np.split(found, np.cumsum([len(directions), len(parameters)]))
    pieces = np.split(of_local, np.cumsum([len(group.directions) for group in local])[:-1])
    rooted = [np.einsum("ij,icm->jcm", group.root, piece) for group, piece in zip(local, pieces, strict=True)]

    for k, probe in enumerate(probes):
        for error in _errors_of_probe(plant, probe, whole, programme.unrecorded, readings[probe.channel][0]):
            mixes.append(_in_channel(k, len(channels), averaged(error, per_mean)))
    if LOSS in channels:
        last = len(channels) - 1
        mixes.append(_in_channel(last, len(channels), averaged(METER_GAIN * loss, per_mean)))
        mixes.append(_in_channel(last, len(channels), averaged(np.where(loss > 0.0, METER_ZERO_W, 0.0), per_mean)))
    return RecordingColumns(
        channels=channels,
        rows=len(loss),
        rows_per_mean=per_mean,
        step_s=per_mean * plant.row_s,
        white=_white(instruments, averaged(loss, per_mean), len(probes), per_mean),
        local=np.concatenate(rooted),
        plant=of_plant,
        tool=np.concatenate([of_tool, np.array(mixes)]),
    )


def _white(instruments: Instruments, loss: Array, probes: int, per_mean: int) -> Array:
    """Standard deviation of the white noise of means, shape (channels, means)."""
    reading = np.hypot(instruments.noise_K, instruments.quantum_K / np.sqrt(12.0))
    rows = [np.full(len(loss), reading)] * probes
    if instruments.loss_noise is not None:
        relative, absolute = instruments.loss_noise
        rows.append(np.hypot(relative * loss, absolute))
    return np.asarray(np.stack(rows) / np.sqrt(per_mean))


def _responses(run: LinearRun, directions: Sequence[Direction], channels: Sequence[str], per_mean: int) -> Array:
    """Means of the channels along directions, shape (directions, channels, means)."""
    found = []
    for first in range(0, len(directions), TOGETHER):
        readings, loss = run.respond(directions[first : first + TOGETHER])
        rows = [loss if channel == LOSS else readings[channel] for channel in channels]
        found.append(np.stack([averaged(values, per_mean) for values in rows], axis=1))
    return np.concatenate(found)


def _in_channel(channel: int, channels: int, values: Array) -> Array:
    column = np.zeros((channels, len(values)))
    column[channel] = values
    return column


# ---------------------------------------------------------------------- unknowns of one recording


@dataclass(frozen=True, kw_only=True, eq=False)
class _Local:
    """Directions whose amplitudes are correlated: `root` maps independent unknowns to them, shape (directions, k)."""

    directions: Sequence[Direction]
    root: Array


def _starts(plant: ZooPlant) -> _Local:
    names = [body.name for body in plant.bodies]
    root = START_K * np.concatenate([np.eye(len(names)), np.ones((len(names), 1))], axis=1)
    return _Local(directions=[StartDirection(start={name: 1.0}) for name in names], root=root)


def _random_heat(plant: ZooPlant, programme: Programme, body: str, watts: Array) -> _Local:
    """An Ornstein-Uhlenbeck heat with the spread and the correlation time of the one that the plant has."""
    row_h = plant.row_s / 3600.0
    sd = float(np.sqrt(np.mean(watts**2)))
    keep = float(np.clip(watts[1:] @ watts[:-1] / (watts @ watts), 1e-3, 1.0 - 1e-4))
    tau_h = -row_h / np.log(keep)
    first = max(programme.begins_h - programme.unrecorded * row_h, 0.0)
    last = programme.begins_h + (len(watts) - programme.unrecorded) * row_h
    knots = np.linspace(first, last, 2 + int((last - first) / max(KNOTS_S / 3600.0, 0.5 * tau_h, row_h)))
    apart = np.abs(np.subtract.outer(knots, knots))
    root = np.linalg.cholesky(sd**2 * np.exp(-apart / tau_h) + 1e-12 * sd**2 * np.eye(len(knots)))
    changes = [ZooChange(kind="heat", target=body, law=_hat(float(knot), float(knots[1] - knots[0]))) for knot in knots]
    return _Local(directions=changes, root=root)


def _hat(knot_h: float, width_h: float) -> Law:
    return lambda m: np.maximum(1.0 - np.abs(m.hours - knot_h) / width_h, 0.0)


# ---------------------------------------------------------------------- model error of a tool


class _Smooth:
    """Polynomial features of degree 2 of the operating point, for a function of a given standard deviation."""

    def __init__(self, plant: ZooPlant, runs: Sequence[LinearRun]) -> None:
        self.inputs = [name for name in plant.inputs if not name.startswith("T_")]
        oil = [body.name for body in plant.bodies if body.part_of == "oil"]
        self.oil = oil[0] if oil else max(plant.probes[0].mix, key=lambda name: plant.probes[0].mix[name])
        self.held: list[tuple[Moment, Array]] = []
        at = np.concatenate([self._raw(r.whole_rows)[:, r.clock.programme.unrecorded :] for r in runs], axis=1)
        self.mean, self.sd = at.mean(axis=1), at.std(axis=1)
        self.moving = self.sd > 1e-6 * (1.0 + np.abs(self.mean))
        features = self._features(at)
        self.weight = SMOOTH_SD / np.sqrt(np.mean(np.sum(features**2, axis=0)))
        self.count = len(features)

    def _raw(self, m: Moment) -> Array:
        return np.stack([*(np.abs(m.inputs[name]) for name in self.inputs), m.T[self.oil]])

    def _features(self, raw: Array) -> Array:
        """Hermite polynomials: 1, c, (c^2 - 1) / sqrt(2) and products of two coordinates, shape (features, B)."""
        apart = (raw - self.mean[:, None])[self.moving] / self.sd[self.moving, None]
        c = np.clip(apart, -FARTHEST, FARTHEST)
        second = [
            (c[i] ** 2 - 1.0) / np.sqrt(2.0) if i == j else c[i] * c[j]
            for i, j in combinations_with_replacement(range(len(c)), 2)
        ]
        return np.stack([np.ones(c.shape[1]), *c, *second])

    def law(self, feature: int) -> Law:
        """One feature with its weight."""
        return lambda m: np.asarray(self.weight * self._at(m)[feature])

    def _at(self, m: Moment) -> Array:
        # Every feature is asked for in turn at the middles of the steps and at the rows.
        for moment, features in self.held:
            if moment is m:
                return features
        self.held = [*self.held[-1:], (m, self._features(self._raw(m)))]
        return self.held[-1][1]


def _input(name: str) -> Law:
    return lambda m: m.inputs[name]


def _errors_of_laws(plant: ZooPlant, smooth: _Smooth) -> Iterator[ZooChange]:
    laws = [smooth.law(feature) for feature in range(smooth.count)]
    for source in plant.sources:
        yield from (ZooChange(kind="source", target=source.name, law=law) for law in laws)
    for path in plant.paths:
        yield from (ZooChange(kind="path", target=path.name, law=law) for law in laws)
        yield ZooChange(kind="path", target=path.name, law=constant(LUMPED_SD))
    for body in plant.bodies:
        yield ZooChange(kind="capacity", target=body.name, law=constant(LUMPED_SD))


def _errors_of_splits(plant: ZooPlant) -> Iterator[ZooChange]:
    """Heat of a source that goes to another of its bodies, or to a neighbour of the main one, instead."""
    bodies = {body.name for body in plant.bodies}
    for source in plant.sources:
        main = max(source.spread, key=lambda name: source.spread[name])
        for target in dict.fromkeys([*source.spread, *_next_to(plant, main)]):
            if target != main and target in bodies:
                yield ZooChange(kind="heat", target=target, other=main, law=times(LUMPED_SD, source.power))


def _errors_of_inputs(plant: ZooPlant) -> Iterator[ZooChange]:
    for name in plant.inputs:
        if name.startswith("T_"):
            yield ZooChange(kind="input", target=name, law=constant(INPUT_K))
        else:
            gain = INPUT_GAIN.get(name, ORDINARY_GAIN)
            yield ZooChange(kind="input", target=name, law=times(gain, _input(name)))


def _errors_of_probe(
    plant: ZooPlant, probe: Probe, T: Mapping[str, Array], unrecorded: int, reading: Array
) -> Iterator[Array]:
    """A share of every neighbour in the reading, and an offset; shape (rows,)."""
    main = max(probe.mix, key=lambda name: probe.mix[name])
    for name in _next_to(plant, main):
        other = follow(T[name], probe.lag_s, plant.row_s)[0, unrecorded:]
        yield MIXING_SD * (other - reading)
    yield np.full(len(reading), SENSOR_K)


def _next_to(plant: ZooPlant, name: str) -> list[str]:
    """Bodies and boundaries that a path joins to another."""
    pairs = [path.ends for path in plant.paths if name in path.ends]
    return list(dict.fromkeys(b if a == name else a for a, b in pairs))
