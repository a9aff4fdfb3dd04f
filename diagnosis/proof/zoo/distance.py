"""How far a healthy plant is from the nominal model of its definition: what calibration of lumped factors leaves.

Plants that are too near or too far are not drawn. This module judges: the nominal model serves here, the plant never
sees it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from diagnosis.engine.fit import NO_SOLUTION, Experiment
from diagnosis.engine.point import Machine, Point
from diagnosis.engine.prepare import usual_unknowns
from diagnosis.engine.unknown import NetworkParameter, Unknown
from diagnosis.forward.grid import Piece, pieces
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.whitening import Noise
from diagnosis.proof.plant.cycles import TRAIN, Programme
from diagnosis.proof.zoo.families.family import PlantFamily
from diagnosis.proof.zoo.programmes import MINUTES_S, programmes
from diagnosis.proof.zoo.simulate import simulate
from diagnosis.proof.zoo.structure import Variant, ZooPlant
from diagnosis.recordings.recording import Channel, Recording
from diagnosis.setup.shaft import shafts, torque_gain, with_shaft
from diagnosis.setup.start import start_guess
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.errors import InputError
from models.base.types import Array

ACCEPTED_K, ACCEPTED_SLOW_K = (0.2, 1.0), (0.5, 3.0)  # gearboxes; machines without geometry in means of minutes
WIDER = 2.0  # times the priors' standard deviations: a factor may go where the data want it
PER_ROW_K = 5.0  # sd of one row: the fit follows the data, the priors hold what they do not show
ITERATIONS = 30
SURE_K = 1e-3  # of start temperatures
THINNED = 3  # of rows of 10 s the plant runs every third here: what it does takes minutes
OIL_DEGC, HOTTEST_DEGC = (30.0, 120.0), 150.0  # the hottest oil of a plausible gearbox, and its hottest reading
MOST_DRAWS = 60


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """A plant that is neither too near nor too far.

    Attributes
    ----------
    rejected : int
        Plants drawn before it
    """

    plant: ZooPlant
    programmes: tuple[Programme, ...]
    distance_K: float
    rejected: int


def draw_plant(family: PlantFamily, machine: str, seed: int, *, baselines: int = 0) -> Drawn:
    """Draw plants of a family until one is at an accepted distance from the nominal model.

    Parameters
    ----------
    machine : str
        Name or file of the nominal definition
    baselines : int
        Healthy recordings before the session

    Raises
    ------
    InputError
        If the definition cannot be split, or no plant of many is accepted.
    """
    gearbox = load_gearbox(machine)
    for rejected in range(MOST_DRAWS):
        rng = np.random.default_rng([seed, rejected, *family.name.encode()])
        plant = family.draw(gearbox, rng)
        low, high = ACCEPTED_SLOW_K if plant.row_s > MINUTES_S else ACCEPTED_K
        session = programmes(plant, rng, baselines=baselines)
        distance = distance_K(plant, session)
        if low <= distance <= high:
            return Drawn(plant=plant, programmes=session, distance_K=distance, rejected=rejected)
    raise InputError(
        f"{gearbox.file}: none of {MOST_DRAWS} plants of the family '{family.name}' is as far from the nominal "
        "model as a healthy one may be; draw another family for this machine"
    )


def distance_K(plant: ZooPlant, session: Sequence[Programme]) -> float:
    """Rms [K] that calibration of the nominal model leaves on noise-free readings of a healthy plant.

    The definition's factors, sensor biases and lags, gain of the torque and offset of the ambient temperature are
    fitted to the training recordings without random heats; infinite if the nominal model cannot follow at all or the
    plant is too cold or too hot.
    """
    gearbox = load_gearbox(plant.gearbox)
    every = 1 if plant.row_s > MINUTES_S else THINNED
    plant = replace(plant, row_s=every * plant.row_s)
    learnt = [_thinned(p, every) for p in session if p.name.startswith(TRAIN)]
    outcomes = [simulate(plant, programme, [Variant(quiet=True)]) for programme in learnt]
    hottest = {name: max(float(o.readings[name].max()) for o in outcomes) for name in outcomes[0].readings}
    plausible = max(hottest.values()) <= HOTTEST_DEGC and OIL_DEGC[0] <= hottest.get("oil", OIL_DEGC[0]) <= OIL_DEGC[1]
    if not gearbox.is_parametric and not plausible:
        return np.inf
    recordings = [
        as_recording(plant, programme, {name: values[0] for name, values in outcome.readings.items()})
        for programme, outcome in zip(learnt, outcomes, strict=True)
    ]
    try:
        return _fitted_rms(_experiment(gearbox, recordings))
    except NO_SOLUTION:
        return np.inf


def _thinned(programme: Programme, every: int) -> Programme:
    """Every so many rows, those before the recording included."""
    return replace(
        programme, inputs={name: values[::every] for name, values in programme.inputs.items()}, random_heat={},
        unrecorded=0,
    )  # fmt: skip


def as_recording(plant: ZooPlant, programme: Programme, readings: dict[str, Array]) -> Recording:
    """A recording of readings, without a file."""
    rows = len(next(iter(readings.values())))
    return Recording(
        name=programme.name,
        path=Path(f"{programme.name}.csv"),
        sha256="",
        time=plant.row_s * np.arange(rows, dtype=float),
        inputs={name: values[-rows:] for name, values in programme.inputs.items()},
        channels=tuple(Channel(name=name, values=values) for name, values in readings.items()),
        segments=(slice(0, rows),),
    )


def _experiment(gearbox: Gearbox, recordings: Sequence[Recording]) -> Experiment:
    """The nominal model and its usual unknowns, without shapes of laws."""
    network = gearbox.network()
    recordings = shafts(recordings, network)
    gain = torque_gain(network)
    network = with_shaft(network)
    model = NetworkOnGrid(network, gearbox.loss_laws())
    channels = sorted((c.name for c in recordings[0].channels), key=lambda name: (model.part_index(name), name))
    cut = pieces(recordings, model.laws.inputs, channels)
    stated = {p.name: p for p in network.parameters}  # priors of the definition, capacities as narrow as it has them
    usual = usual_unknowns(network, recordings, channels, interval=1.0, gain_of_torque=gain)
    return Experiment(
        machine=Machine(model),
        pieces=tuple(cut),
        unknowns=tuple(
            _wider(replace(u, parameter=stated[u.parameter.name]) if isinstance(u, NetworkParameter) else u)
            for u in usual
        ),
        noise=tuple(_per_row(model, piece) for piece in cut),
        starts=tuple(start_guess(model, piece) for piece in cut),
    )


def _wider(unknown: Unknown) -> Unknown:
    return replace(unknown, parameter=replace(unknown.parameter, sd=WIDER * unknown.parameter.sd))


def _per_row(model: NetworkOnGrid, piece: Piece) -> Noise:
    """One noise for every row of every channel, and start temperatures as they are."""
    channels = len(piece.channels)
    return Noise(channel_sd=np.full(channels, PER_ROW_K), floor_sd=np.zeros(channels), loss_relative_sd=0.0,
                 heat_sd=np.zeros(model.n), heat_time=1.0, start=SURE_K**2 * np.eye(model.n))  # fmt: skip


def _fitted_rms(experiment: Experiment) -> float:
    """Root mean square of the residual at the least squares over all rows, [K]."""
    fit = experiment.fit(np.zeros(len(experiment.unknowns)), iterations=ITERATIONS)
    return _rms([part.point for part in fit.parts])


def _rms(points: Sequence[Point]) -> float:
    squares, weights = 0.0, 0.0
    for point in points:
        time, residual = point.trajectory.piece.time, point.residual
        width = np.broadcast_to(np.gradient(time)[:, None], residual.shape)
        seen = np.isfinite(residual)
        squares += float(np.sum(width[seen] * residual[seen] ** 2))
        weights += float(width[seen].sum())
    return float(np.sqrt(squares / weights))
