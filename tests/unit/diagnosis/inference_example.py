"""Recordings made up for the tests of the inference, and a machine with known parameters."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from diagnosis.engine.fit import Experiment
from diagnosis.engine.point import Machine
from diagnosis.engine.unknown import NetworkParameter
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.observation import readings
from diagnosis.forward.trajectory import simulate
from diagnosis.recordings.recording import Channel, Recording
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.correction.correction import Correction, corrected_network
from models.mechanisms import CATALOGUE, Scale
from models.simulation.thermal_network import ThermalNetwork
from models.terms.term import Term

CHANNELS = ("housing_lower", "oil", "bearing_1", "P_loss")
NODES = ("oil", "housing_lower", "bearing_1", "pinion")


def recording_of(columns: dict[str, Array], channels: dict[str, Array]) -> Recording:
    return recording_with(columns["time_s"], channels, speed=columns["speed_rpm"], torque=columns["torque_Nm"],
                  T_ambient=columns["T_ambient_degC"])  # fmt: skip


def recording_with(time: Array, channels: Mapping[str, Array] | None = None, **inputs: Array | float) -> Recording:
    """A recording without gaps, of inputs that may be constant; by default at rest, in air of 22 degC and 2 m/s."""
    given = {"speed": 0.0, "torque": 0.0, "T_ambient": 22.0, "air_speed": 2.0} | inputs
    return Recording(
        name="made", path=Path("made.csv"), time=time,
        inputs={name: np.broadcast_to(np.asarray(values, float), time.shape) for name, values in given.items()},
        channels=tuple(Channel(name=n, values=v) for n, v in (channels or {}).items()),
        segments=(slice(0, len(time)),),
    )  # fmt: skip


def windage_ride(fzg: Gearbox, time: Array, speed: Array, torque: Array, *, windage_W: float, seed: int) -> Recording:
    """The model itself with windage in the oil, with noise of 0.1 K and 1 % of the loss."""
    columns = {"time_s": time, "speed_rpm": speed, "torque_Nm": torque, "T_ambient_degC": np.full(len(time), 22.0)}
    network, scale = fzg.network(), Scale.of(fzg, speed=3300.0, torque=150.0)
    term = next(p for p in CATALOGUE["windage"].placed(network, scale) if p.place == "oil")
    driven = columns | {"air_speed_m_s": np.full(len(time), 2.0)}
    made = term.apply(network, {term.strength.name: windage_W}).simulate(
        driven, losses=fzg.losses(), initial=22.0
    ).columns()  # fmt: skip
    rng = np.random.default_rng(seed)
    read = {n: made[f"T_{n}_degC"] + 0.1 * rng.standard_normal(len(time)) for n in NODES}
    return recording_of(columns, read | {"P_loss": made["P_loss_W"] * (1.0 + 0.01 * rng.standard_normal(len(time)))})


def recorded(
    fzg: Gearbox, name: str, *, windage_W: float = 0.0, drift_K: float = 0.0, factors: dict[str, float] | None = None,
    hours: float = 1.5,
    seed: int = 0, nodes: tuple[str, ...] = NODES, correction: Correction | None = None,
) -> Recording:  # fmt: skip
    """The model itself, with noise; windage in the oil, and a drift of its thermometer over the whole recording."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 3600.0 * hours, 10.0)
    step = (time // 1200.0).astype(int)
    columns = {
        "time_s": time,
        "speed_rpm": rng.uniform(800.0, 3300.0, step.max() + 1)[step],
        "torque_Nm": rng.uniform(40.0, 160.0, step.max() + 1)[step],
        "T_ambient_degC": np.full(len(time), 22.0),
    }
    network = corrected_network(fzg, correction)
    term = next(
        p for p in CATALOGUE["windage"].placed(network, Scale.of(fzg, speed=3300.0, torque=150.0)) if p.place == "oil"
    )
    if windage_W:
        network = term.apply(network, {term.strength.name: windage_W})
    values = factors or {}
    network = replace(network, parameters=tuple(
        replace(p, start=values.get(p.name, 1.0) * p.start) for p in network.parameters))  # fmt: skip
    driven = columns | {"air_speed_m_s": np.full(len(time), 2.0)}
    made = network.simulate(driven, losses=fzg.losses(), initial=22.0).columns()
    read = {n: made[f"T_{n}_degC"] + 0.1 * rng.standard_normal(len(time)) for n in nodes}
    read["oil"] = read["oil"] + drift_K * time / time[-1]
    return replace(recording_of(columns, read), name=name, sha256=hashlib.sha256(name.encode()).hexdigest())


def with_measured(experiment: Experiment, measured: Array) -> Experiment:
    """The experiment with other readings of its only piece."""
    return replace(experiment, pieces=(replace(experiment.pieces[0], measured=measured),))


def with_term(experiment: Experiment, term: Term) -> Experiment:
    """The experiment of a machine that has a term, whose parameters are further unknowns."""
    model = experiment.machine.model
    return replace(
        experiment,
        machine=Machine(NetworkOnGrid(term.apply(model.network), model.losses)),
        unknowns=(*experiment.unknowns, *(NetworkParameter(parameter=p) for p in term.parameters)),
    )


def at(experiment: Experiment, values: Mapping[str, float]) -> Array:
    """Unknowns at their middles, but for some values by name."""
    return np.array([u.z_of(values[u.parameter.name]) if u.parameter.name in values else 0.0
                     for u in experiment.unknowns])  # fmt: skip


def acting(experiment: Experiment, term: Term, values: Mapping[str, float], *, guided: bool = True) -> Experiment:
    """The experiment as it would have been recorded with a term in the machine.

    Parameters
    ----------
    experiment : Experiment
    term : Term
    values : mapping of str to float
        Of the term's parameters, by their names without the label
    guided : bool
        False: switches follow the simulation
    """
    model = NetworkOnGrid(term.apply(experiment.machine.model.network), experiment.machine.model.losses)
    named = {f"{term.label}_{name}": value for name, value in values.items()}
    piece = replace(experiment.pieces[0], guided=guided)
    trajectory = simulate(model, piece, named_values(model.network, named), experiment.starts[0], rounds=12)
    sensors = experiment.setting(0, np.zeros(len(experiment.unknowns))).sensors
    return with_measured(experiment, readings(model, trajectory, sensors))


def named_values(network: ThermalNetwork, given: Mapping[str, float] | None = None) -> Array:
    """Values of all parameters of a network: as delivered, or as given by name."""
    given = given or {}
    return np.array([given.get(p.name, p.start) for p in network.parameters])
