"""Time steps of zoo plants: a batch of variants from the first row to the last.

Laws are taken at the middle of every step, temperatures extrapolated to it, as the plant of the own kind does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from diagnosis.proof.plant.cycles import Programme
from diagnosis.proof.plant.integrator import sdirk_step
from diagnosis.proof.zoo.laws import Acting, Balance, Laws, feel
from diagnosis.proof.zoo.structure import Change, Moment, Variant, ZooPlant
from models.base.types import Array

LONGEST_STEP_S = 200.0


@dataclass(frozen=True, kw_only=True)
class HeatBalance:
    """Heat of a whole run, rows before the recording included, shape (B,) each, [J].

    Attributes
    ----------
    stored : Array
        In the bodies at the end, less that at the start
    given : Array
        By sources, random heats and changes
    shed : Array
        Left through boundaries
    """

    stored: Array
    given: Array
    shed: Array


@dataclass(kw_only=True, eq=False)
class Run:
    """Everything of a batch at its rows, those before the recording included.

    Attributes
    ----------
    T : Array, shape (rows, bodies, B)
        [degC]
    T_steps : Array, shape (steps + 1, bodies, B)
        [degC]
    made : list of Array, shape (rows, B)
        Heat of every different change in the step after a row, [W]
    """

    T: Array
    T_steps: Array
    made: list[Array]
    balance: HeatBalance


class Clock:
    """Steps of a programme and its inputs between them."""

    def __init__(self, plant: ZooPlant, programme: Programme) -> None:
        self.plant, self.programme = plant, programme
        self.rows = len(programme)
        self.steps_per_row = max(1, round(plant.row_s / LONGEST_STEP_S))
        self.dt = plant.row_s / self.steps_per_row
        self.steps = (self.rows - 1) * self.steps_per_row
        at = np.arange(self.rows, dtype=float)
        middle = (np.arange(self.steps) + 0.5) / self.steps_per_row
        self.at_rows = self._times(at)
        self.in_steps = self._times(middle)
        self.inputs_at_rows = programme.inputs
        self.inputs_in_steps = {name: np.interp(middle, at, values) for name, values in programme.inputs.items()}
        self.random_heat = {name: np.interp(middle, at, values) for name, values in programme.random_heat.items()}

    def _times(self, row: Array) -> tuple[Array, Array]:
        since = (row - self.programme.unrecorded) * self.plant.row_s / 3600.0
        return np.maximum(self.programme.begins_h + since, 0.0), np.maximum(since, 0.0)


def integrate(
    plant: ZooPlant, programme: Programme, variants: Sequence[Variant]
) -> tuple[Run, Clock, Laws, list[Change]]:
    """Integrate a batch: the run, its clock, its laws, the different changes."""
    clock, B = Clock(plant, programme), len(variants)
    unique = list({id(change): change for variant in variants for change in variant.changes}.values())
    laws = Laws(plant, [change for change in unique if change.kind == "bridge"])
    acting: Acting = [
        (change, np.array([b for b, variant in enumerate(variants) if any(c is change for c in variant.changes)]))
        for change in unique
    ]
    p = {
        name: np.array([variant.parameters.get(name, value) for variant in variants])
        for name, value in plant.parameters.items()
    }
    loud = np.array([0.0 if variant.quiet else 1.0 for variant in variants])
    n = len(laws.bodies)
    T = np.repeat(np.array([[programme.start[name]] for name in laws.bodies]), B, axis=1)
    before = T
    kept, made = np.empty((clock.steps + 1, n, B)), [np.zeros((clock.rows, B)) for _ in unique]
    stored, given, shed = np.zeros(B), np.zeros(B), np.zeros(B)
    steady = np.empty(0)
    fresh: list[int] = []
    for step in range(clock.steps):
        row, part = divmod(step, clock.steps_per_row)
        kept[step] = T
        raw = moment_of_batch(clock, step, T + 0.5 * (T - before), laws.bodies, p)
        moment = feel(raw, acting)
        if step == 0:
            laws.note_reads(moment)
            steady, fresh = laws.values(moment), laws.changing()
        balance = laws.balance(moment, laws.values(moment, held=steady, fresh=fresh), acting)
        for name, watts in clock.random_heat.items():
            balance.q[laws.body[name]] += watts[step] * loud
        inflow = laws.heat_from_boundaries(balance)
        K = laws.matrix(balance.G)
        new, mean = sdirk_step(T=T.T, capacity=balance.C.T, K=K, heat=(balance.q + inflow).T, dt=clock.dt)
        new, mean = new.T, mean.T
        stored += (balance.C * (new - T)).sum(axis=0)
        given += clock.dt * balance.q.sum(axis=0)
        for path, body, _ in laws.from_boundary:
            shed += clock.dt * balance.G[path] * mean[body]
        shed -= clock.dt * inflow.sum(axis=0)
        if part == 0:
            _note_heat(laws, acting, balance, mean, (new - T) / clock.dt, [kept_heat[row] for kept_heat in made])
        before, T = T, new
    kept[-1] = T
    for kept_heat in made:
        kept_heat[-1] = kept_heat[-2] if clock.rows > 1 else 0.0
    run = Run(
        T=kept[:: clock.steps_per_row],
        T_steps=kept,
        made=made,
        balance=HeatBalance(stored=stored, given=given, shed=shed),
    )
    return run, clock, laws, unique


def moment_of_batch(clock: Clock, step: int, T: Array, bodies: Sequence[str], p: Mapping[str, Array]) -> Moment:
    """Middle of a step of B runs."""
    hours, since = clock.in_steps
    ones = np.ones(T.shape[1])
    return Moment(
        hours=hours[step] * ones,
        since_start=since[step] * ones,
        inputs={name: values[step] * ones for name, values in clock.inputs_in_steps.items()},
        T=dict(zip(bodies, T, strict=True)),
        p=p,
    )


def rows_of_run(laws: Laws, clock: Clock, variant: Variant, T: Array) -> tuple[Moment, Array]:
    """Moment of all rows of one run and the values of all laws, from temperatures of the shape (rows, bodies)."""
    ones = np.ones(clock.rows)
    hours, since = clock.at_rows
    p = {name: variant.parameters.get(name, value) * ones for name, value in laws.plant.parameters.items()}
    raw = Moment(
        hours=hours,
        since_start=since,
        inputs=clock.inputs_at_rows,
        T={name: T[:, k] for k, name in enumerate(laws.bodies)},
        p=p,
    )
    moment = feel(raw, [(change, slice(None)) for change in variant.changes])
    return moment, laws.values(moment)


def read_probes(plant: ZooPlant, T: Mapping[str, Array], first: int) -> dict[str, Array]:
    """Readings of probes for temperatures of the shape (B, rows), from row `first` on."""
    readings = {}
    for probe in plant.probes:
        seat = sum(weight * T[name] for name, weight in probe.mix.items())
        readings[probe.channel] = follow(np.asarray(seat), probe.lag_s, plant.row_s)[:, first:]
    return readings


def follow(seat: Array, lag_s: float, row_s: float) -> Array:
    """First-order lag behind a temperature that is straight between rows, shape (B, rows)."""
    if lag_s <= 0.0:
        return seat
    keep = np.exp(-row_s / lag_s)
    last = 1.0 - (1.0 - keep) * lag_s / row_s
    earlier = (1.0 - keep) - last
    filtered, _ = lfilter([last, earlier], [1.0, -keep], seat, zi=(1.0 - last) * seat[:, :1])
    return np.asarray(filtered)


def _note_heat(laws: Laws, acting: Acting, balance: Balance, mean: Array, rate: Array, into: Sequence[Array]) -> None:
    """Write down what every change gave in a step, [W]."""
    where = {**balance.T, **dict(zip(laws.bodies, mean, strict=True))}
    for (change, _), made, row in zip(acting, balance.made, into, strict=True):
        if change.kind == "path":
            ends = laws.ends[laws.path[change.target]]
            row[:] = made * (where[ends[0]] - where[ends[1]])
        elif change.kind == "bridge":
            row[:] = made * (where[change.target] - where[change.other])
        elif change.kind == "capacity":
            row[:] = -made * rate[laws.body[change.target]]
        elif change.kind in ("source", "heat"):
            row[:] = made
