"""The plant of the own kind as a plant of the zoo, so that one oracle serves both."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.proof.plant.anatomy import AIR, FRAME, OIL, SPLASH, SUMP
from diagnosis.proof.plant.cycles import TRAIN, Programme
from diagnosis.proof.plant.effect import Concealed
from diagnosis.proof.plant.instruments import Instruments, record
from diagnosis.proof.plant.laws import PlantLaws
from diagnosis.proof.plant.plant import Plant, PlantMoment
from diagnosis.proof.plant.plant_run import (
    EXPONENTS,
    INPUTS,
    ORDINARY_SPREAD,
    Individual,
    PlantRun,
    factor_sd,
    run_plant,
)
from diagnosis.proof.zoo.oracle import LOSS, OracleDesign
from diagnosis.proof.zoo.oracle_columns import design_of
from diagnosis.proof.zoo.simulate import simulate
from diagnosis.proof.zoo.structure import Body, Boundary, HeatPath, Law, Moment, Probe, Source, Variant, ZooPlant
from models.base.types import Array
from models.quantities.quantities import column_of_input

MOMENTS_KEPT = 30


def design_of_own_kind(
    plant: Plant, individual: Individual, runs: Sequence[PlantRun], instruments: Instruments
) -> OracleDesign:
    """The oracle's design of a case of the own kind.

    Parameters
    ----------
    runs : sequence of PlantRun
        All recordings; those whose name starts with ``train`` count
    """
    programmes = [as_programme(plant, run) for run in runs]
    return design_of(as_zoo(plant, individual, instruments), programmes, instruments)


def effect_on_readings(
    plant: Plant, runs: Sequence[PlantRun], instruments: Instruments, effects: Sequence[Concealed]
) -> list[Mapping[str, Array]]:
    """Noise-free readings with effects minus those without any, of the training recordings.

    A fault of a recorded input counts by what the plant would do under the recorded input, less what it does.

    Returns
    -------
    list of mappings of channel to Array, shape (rows,)
    """
    train = [run for run in runs if run.programme.name.startswith(TRAIN)]
    physics = tuple(effect for effect in effects if not effect.is_fault)
    faults = [effect for effect in effects if effect.is_fault]
    twins = [replace(run, effects=kept) for run in train for kept in (physics, ())]
    outcomes = run_plant(plant, twins)
    found: list[Mapping[str, Array]] = []
    for k, run in enumerate(train):
        spoiled = record(plant, run, outcomes[2 * k], instruments, faults, None)
        sound = record(plant, run, outcomes[2 * k + 1], instruments, (), None)
        names = {f"T_{place}_degC": place for place in instruments.channels} | {"P_loss_W": LOSS}
        x = {channel: spoiled[column] - sound[column] for column, channel in names.items()}
        wrong = {name: spoiled[column_of_input(name)] - sound[column_of_input(name)] for name in INPUTS}
        if any(np.any(error != 0.0) for error in wrong.values()):
            predicted = _by_wrong_inputs(plant, run, instruments, wrong)
            x = {channel: values + predicted[channel] for channel, values in x.items()}
        found.append(x)
    return found


def _by_wrong_inputs(
    plant: Plant, run: PlantRun, instruments: Instruments, wrong: Mapping[str, Array]
) -> Mapping[str, Array]:
    """Readings that true inputs cause, less those that recorded inputs would, by channel."""
    zoo, right = as_zoo(plant, run.individual, instruments), as_programme(plant, run)
    # Before the recording the error is that of its first row.
    error = {name: np.pad(values, (right.unrecorded, 0), mode="edge") for name, values in wrong.items()}
    recorded = replace(right, inputs={name: values + error[name] for name, values in right.inputs.items()})
    by_true, by_recorded = (simulate(zoo, programme, [Variant(quiet=True)]) for programme in (right, recorded))
    readings = {name: by_true.readings[name][0] - by_recorded.readings[name][0] for name in by_true.readings}
    return readings | {LOSS: by_true.P_loss[0] - by_recorded.P_loss[0]}


# ---------------------------------------------------------------------- the plant


def as_programme(plant: Plant, run: PlantRun) -> Programme:
    """A run's programme; a random heat goes into the first node of its place."""
    driven, members = run.programme, plant.anatomy.members
    return replace(
        driven,
        inputs={**driven.inputs, "speed": np.abs(driven.inputs["speed"])},
        random_heat={next(iter(members(place))): watts for place, watts in driven.random_heat.items()},
    )


def as_zoo(plant: Plant, individual: Individual, instruments: Instruments) -> ZooPlant:
    """One gearbox of the own kind as a plant of the zoo, with the same laws.

    Returns
    -------
    ZooPlant
        Its parameters are the factors of the definition and the exponents
    """
    shared, anatomy, gearbox = _SharedLaws(plant, individual.reading), plant.anatomy, plant.gearbox
    parts: dict[str, int] = {}
    paths = []
    for k, path in enumerate(anatomy.paths):
        parts[path.name] = parts.get(path.name, 0) + 1
        name = f"{path.name}.{parts[path.name]}"
        paths.append(HeatPath(name=name, ends=path.ends, conductance=shared.conductance(k), part_of=path.name))
    exponents = {name: getattr(individual, name) for name in EXPONENTS}
    return ZooPlant(
        family="own_kind",
        gearbox=gearbox.name,
        inputs=INPUTS,
        bodies=tuple(
            Body(name=node, capacity=shared.capacity(k), part_of=_place(node))
            for k, node in enumerate(anatomy.nodes)
            if node not in (AIR, FRAME)
        ),
        boundaries=tuple(Boundary(name=name, temperature=_ambient, part_of=name) for name in (AIR, FRAME)),
        paths=tuple(paths),
        sources=tuple(
            Source(name=name, power=shared.power(k), spread=plant.spread_of(name), is_loss=True, part_of=name)
            for k, name in enumerate(plant.components)
        ),
        probes=tuple(
            Probe(channel=place, mix=anatomy.members(place), lag_s=instruments.lag_s[place])
            for place in instruments.channels
        ),
        # An exponent may be zero: its parameter is one more.
        parameters={**individual.factors, **{name: 1.0 + value for name, value in exponents.items()}},
        spread={
            **{name: ORDINARY_SPREAD * factor_sd(gearbox, name) for name in individual.factors},
            **{name: sd / (1.0 + exponents[name]) for name, (_, sd) in EXPONENTS.items()},
        },
        loss_W=plant.loss_ref,
    )


def _ambient(m: Moment) -> Array:
    return m.inputs["T_ambient"]


def _place(node: str) -> str:
    return OIL if node in (SUMP, SPLASH) else node.partition(".")[0]


class _SharedLaws:
    """Laws that are evaluated together, once per moment."""

    def __init__(self, plant: Plant, reading: int) -> None:
        self.plant, self.reading = plant, reading
        self.held: tuple[Moment | None, Array, Array, Array] = (None, np.empty(0), np.empty(0), np.empty(0))
        anatomy = plant.anatomy
        self.warm = (SUMP, *(f"{gear}.rim" for gear in anatomy.gears), *anatomy.bearings)
        self.losses: list[tuple[list[Array], Array]] = []

    def conductance(self, k: int) -> Law:
        return lambda m: np.asarray(self._at(m)[1][:, k])

    def power(self, k: int) -> Law:
        return lambda m: np.asarray(self._at(m)[2][:, k])

    def capacity(self, k: int) -> Law:
        return lambda m: np.asarray(self._at(m)[3][:, k])

    def _at(self, m: Moment) -> tuple[Moment | None, Array, Array, Array]:
        if self.held[0] is not m:
            laws, moment = self._laws(m), self._moment(m)
            losses = self._losses(m, laws, moment) * laws.loss_factor
            self.held = (m, laws.conductances(moment), losses, laws.capacity)
        return self.held

    def _losses(self, m: Moment, laws: PlantLaws, moment: PlantMoment) -> Array:
        """Losses without their factors, kept for moments that differ in nothing that they read."""
        read = [m.inputs["speed"], m.inputs["torque"], *(m.T[name] for name in self.warm)]
        for known, losses in self.losses:
            if all(a is b for a, b in zip(read, known, strict=True)):
                return losses
        self.losses = [*self.losses[-MOMENTS_KEPT:], (read, laws.losses_at_one(moment))]
        return self.losses[-1][1]

    def _laws(self, m: Moment) -> PlantLaws:
        p = dict(m.p)
        exponents = {name: p.pop(name) - 1.0 for name in EXPONENTS}
        return PlantLaws(self.plant, p, reading=np.full(len(m.hours), self.reading), **exponents)

    def _moment(self, m: Moment) -> PlantMoment:
        B, anatomy = len(m.hours), self.plant.anatomy
        none = np.zeros(B)
        air = m.inputs["T_ambient"]
        return PlantMoment(
            hours=m.hours, speed=m.inputs["speed"], torque=m.inputs["torque"], air=air,
            air_speed=m.inputs["air_speed"],
            T=np.stack([air if node in (AIR, FRAME) else m.T[node] for node in anatomy.nodes], axis=1),
            thinning=none, bearing_load=np.ones((B, len(anatomy.bearings))), loss=none, lost=none, heat=none,
            G=none, ground=none, ground_heat=none, capacity=none,
        )  # fmt: skip
