"""Runs of the plant: integrates many gearboxes at once, each with its parameters, programme and concealed effects.

Conductances and losses are taken at the middle of every 10 s step, temperatures extrapolated to it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.proof.plant.cycles import ROW_S, Programme
from diagnosis.proof.plant.effect import Concealed, Effect, Grip
from diagnosis.proof.plant.integrator import sdirk_step
from diagnosis.proof.plant.laws import PlantLaws
from diagnosis.proof.plant.plant import Plant, PlantMoment
from models.assembly.gearbox import Gearbox
from models.base.types import Array

ORDINARY_SPREAD = 0.5  # of the definition's standard deviations, by which every gearbox is off
INPUTS = ("speed", "torque", "T_ambient", "air_speed")
EXPONENTS = {"forced_exponent": (0.6, 0.02), "oil_exponent": (0.0, 0.03), "exchange_exponent": (0.5, 0.05)}  # mean, sd


@dataclass(frozen=True, kw_only=True)
class Individual:
    """Parameters in which one gearbox differs from another of the same definition.

    Attributes
    ----------
    factors : mapping of str to float
        Multipliers by the names of the definition's tunable factors
    reading : int
        Which of :data:`diagnosis.proof.plant.plant.READINGS` its mesh follows
    forced_exponent, oil_exponent, exchange_exponent : float
        Of the air speed in forced convection, of the speed in gear-to-oil convection (departure from the law) and in
        the exchange between sump and splash, [-]
    """

    factors: Mapping[str, float]
    reading: int
    forced_exponent: float = 0.6
    oil_exponent: float = 0.0
    exchange_exponent: float = 0.5


def factor_sd(gearbox: Gearbox, factor: str) -> float:
    """Standard deviation of the logarithm of a tunable factor, as the definition states it."""
    # A churning formula may be wrong by a factor of e; a plant that uses it twice over in two sd would drown in oil.
    return min(gearbox.priors.get(f"factors.{factor}", 0.2), 0.6)


@dataclass(frozen=True, kw_only=True)
class PlantRun:
    """One gearbox in one recording.

    Attributes
    ----------
    programme : Programme
        With the inputs ``speed``, ``torque``, ``T_ambient`` and ``air_speed``
    """

    individual: Individual
    programme: Programme
    effects: tuple[Concealed, ...] = ()

    def __len__(self) -> int:
        return len(self.programme)


@dataclass(frozen=True, kw_only=True)
class PlantOutcome:
    """Result of one run without the rows before the recording.

    Attributes
    ----------
    T : Array, shape (rows, places)
        Temperatures at the coarse places, [degC]
    P_loss : Array, shape (rows,)
        Mechanical power lost, [W]
    losses : mapping of place to Array, shape (rows,)
        What the components of the loss model lose there, [W]
    heat : tuple of mapping of place to Array, shape (rows,)
        Heat [W] that each effect made in each place
    """

    T: Array
    P_loss: Array
    losses: Mapping[str, Array]
    heat: tuple[Mapping[str, Array], ...]


def run_plant(
    plant: Plant, runs: Sequence[PlantRun], progress: Callable[[int], None] | None = None
) -> list[PlantOutcome]:
    """Integrate runs; those of equal length go through one loop.

    Parameters
    ----------
    progress : callable or None
        Called after every few steps with the number of rows done since the last call

    Returns
    -------
    list of PlantOutcome
        In the order of `runs`
    """
    outcomes: dict[int, PlantOutcome] = {}
    for length in sorted({len(run) for run in runs}):
        members = [i for i, run in enumerate(runs) if len(run) == length]
        batch = _Batch(plant, [runs[i] for i in members])
        outcomes.update(zip(members, batch.integrate(progress), strict=True))
    return [outcomes[i] for i in range(len(runs))]


class _Batch:
    """Runs of equal length on their way through time."""

    def __init__(self, plant: Plant, runs: Sequence[PlantRun]) -> None:
        self.plant, self.runs = plant, runs
        anatomy = plant.anatomy
        self.n = len(anatomy.nodes)
        who = [run.individual for run in runs]
        names = sorted({name for individual in who for name in individual.factors})
        self.laws = PlantLaws(
            plant,
            {name: np.array([individual.factors.get(name, 1.0) for individual in who]) for name in names},
            reading=np.array([individual.reading for individual in who]),
            **{name: np.array([getattr(individual, name) for individual in who]) for name in EXPONENTS},
        )
        # Heat of the unknown by row, run and node, [W].
        self.random_heat = np.zeros((len(runs[0]), len(runs), self.n))
        for member, run in enumerate(runs):
            for place, watts in run.programme.random_heat.items():
                for node, weight in anatomy.members(place).items():
                    self.random_heat[:, member, anatomy.index[node]] += weight * watts
        self.grips = self._grips()

    def _grips(self) -> list[tuple[Effect, Grip]]:
        """Effects of the same kind act in one go on the runs that have them."""
        together: dict[str, list[tuple[int, Concealed, int]]] = {}
        for member, run in enumerate(self.runs):
            for position, effect in enumerate(run.effects):
                together.setdefault(effect.key, []).append((member, effect, position))
        grips = []
        for group in together.values():
            members, specimens, positions = zip(*group, strict=True)
            grips.append((specimens[0].effect, Grip(self.plant, members, specimens, positions, len(self.runs[0]))))
        return grips

    # ------------------------------------------------------------------ time

    def integrate(self, progress: Callable[[int], None] | None) -> list[PlantOutcome]:
        """All rows of all runs."""
        rows, B, anatomy = len(self.runs[0]), len(self.runs), self.plant.anatomy
        driven = [run.programme.inputs for run in self.runs]
        inputs = {name: np.stack([own[name] for own in driven], axis=1) for name in INPUTS}
        inputs["speed"] = np.abs(inputs["speed"])
        skipped = np.array([run.programme.unrecorded for run in self.runs])
        T = np.array([[run.programme.start[node] for node in anatomy.nodes] for run in self.runs])
        before = T
        kept = np.empty((rows, B, len(anatomy.coarse)))
        lost = np.empty((rows, B))
        losses = {place: np.zeros((rows, B)) for place in map(self.plant.place_of, self.plant.components)}
        for row in range(rows):
            kept[row] = T @ anatomy.reading.T
            after = min(row + 1, rows - 1)
            middle = {name: 0.5 * (values[row] + values[after]) for name, values in inputs.items()}
            hours = np.maximum(row + 0.5 - skipped, 0.0) * ROW_S / 3600.0
            moment = self._moment(row, hours, middle, T + 0.5 * (T - before))
            lost[row] = moment.lost
            for k, component in enumerate(self.plant.components):
                losses[self.plant.place_of(component)][row] += moment.loss[:, k]
            before, T = T, self._step(T, moment)
            if progress is not None and row % 20 == 19:
                progress(20 * B)
        return [self._outcome(i, kept, lost, losses) for i in range(B)]

    def _outcome(self, i: int, kept: Array, lost: Array, losses: Mapping[str, Array]) -> PlantOutcome:
        first = self.runs[i].programme.unrecorded
        heat: list[Mapping[str, Array]] = [{} for _ in self.runs[i].effects]
        for _, grip in self.grips:
            for k in np.flatnonzero(grip.members == i):
                heat[grip.positions[k]] = {place: values[first:, k] for place, values in grip.made.items()}
        return PlantOutcome(
            T=kept[first:, i],
            P_loss=lost[first:, i],
            losses={place: values[first:, i] for place, values in losses.items()},
            heat=tuple(heat),
        )

    def _step(self, T: Array, moment: PlantMoment) -> Array:
        plant, B, n = self.plant, len(T), self.n
        K = np.zeros((B, n, n))
        K[:, plant.a, plant.b] = K[:, plant.b, plant.a] = -moment.G
        K[:, np.arange(n), np.arange(n)] = moment.G @ plant.touching + moment.ground
        T = T.copy()
        T[:, list(plant.anatomy.boundary)] = moment.air[:, None]
        heat = moment.heat + moment.ground_heat
        new, _ = sdirk_step(T=T, capacity=moment.capacity, K=K, heat=heat, dt=ROW_S)
        return np.asarray(new)

    def _moment(self, row: int, hours: Array, inputs: Mapping[str, Array], T: Array) -> PlantMoment:
        B, anatomy = len(self.runs), self.plant.anatomy
        bearings = len(anatomy.bearings)
        moment = PlantMoment(
            hours=hours, speed=inputs["speed"].copy(), torque=inputs["torque"].copy(), air=inputs["T_ambient"].copy(),
            air_speed=inputs["air_speed"].copy(), T=T, thinning=np.zeros(B), bearing_load=np.ones((B, bearings)),
            loss=np.zeros((B, len(self.plant.components))), lost=np.zeros(B), heat=self.random_heat[row].copy(),
            G=np.empty(0), ground=np.zeros((B, self.n)), ground_heat=np.zeros((B, self.n)),
            capacity=self.laws.capacity.copy(),
        )  # fmt: skip
        for effect, grip in self.grips:
            grip.moment, grip.row = moment, row
            if effect.before is not None:
                effect.before(grip)
        moment.loss = self.laws.losses(moment)
        moment.G = self.laws.conductances(moment)
        for effect, grip in self.grips:
            if effect.after is not None:
                effect.after(grip)
        moment.lost += moment.loss.sum(axis=1)
        for k, component in enumerate(self.plant.components):
            for node, weight in self.plant.spread_of(component).items():
                moment.heat[:, anatomy.index[node]] += weight * moment.loss[:, k]
        return moment
