"""Time steps of zoo plants: a batch of variants from the first row to the last.

Laws are taken at the middle of every step, temperatures extrapolated to it, as the plant of the own kind does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from diagnosis.proof.plant.cycles import Programme
from diagnosis.proof.plant.integrator import sdirk_step
from diagnosis.proof.zoo.laws import Acting, ZooBalance, ZooLaws, feel
from diagnosis.proof.zoo.structure import Moment, Variant, ZooChange, ZooPlant
from models.base.types import Array

LONGEST_STEP_S = 200.0


class RunClock:
    """Rows and steps of a programme.

    Attributes
    ----------
    at_rows, in_steps : Moment
        Times and inputs of all rows, and of the middles of all steps; temperatures and parameters are still empty
    random_heat : mapping of str to Array, shape (steps,)
        By body, [W]
    """

    def __init__(self, plant: ZooPlant, programme: Programme) -> None:
        self.plant, self.programme = plant, programme
        self.rows = len(programme)
        self.steps_per_row = max(1, round(plant.row_s / LONGEST_STEP_S))
        self.dt = plant.row_s / self.steps_per_row
        self.steps = (self.rows - 1) * self.steps_per_row
        rows = np.arange(self.rows, dtype=float)
        middles = (np.arange(self.steps) + 0.5) / self.steps_per_row
        self.at_rows = self._moment(rows, programme.inputs)
        self.in_steps = self._moment(middles, {n: np.interp(middles, rows, v) for n, v in programme.inputs.items()})
        self.random_heat = {name: np.interp(middles, rows, values) for name, values in programme.random_heat.items()}

    def _moment(self, row: Array, inputs: Mapping[str, Array]) -> Moment:
        since = (row - self.programme.unrecorded) * self.plant.row_s / 3600.0
        hours = np.maximum(self.programme.begins_h + since, 0.0)
        return Moment(hours=hours, since_start=np.maximum(since, 0.0), inputs=inputs, T={}, p={})


@dataclass(kw_only=True, eq=False)
class ZooRun:
    """Everything of a batch at its rows, those before the recording included.

    Attributes
    ----------
    changes : list of ZooChange
        The different ones of all variants
    T_steps : Array, shape (steps + 1, bodies, B)
        [degC]
    made : list of Array, shape (rows, B)
        Heat of every different change in the step after a row, [W]
    """

    clock: RunClock
    laws: ZooLaws
    changes: list[ZooChange]
    T_steps: Array
    made: list[Array]

    @property
    def T(self) -> Array:
        """Temperatures at the rows, shape (rows, bodies, B), [degC]."""
        return self.T_steps[:: self.clock.steps_per_row]

    def at_rows(self, b: int, variant: Variant) -> tuple[Moment, Array]:
        """Moment of all rows of one run, and the values of all laws."""
        ones, values = np.ones(self.clock.rows), {**self.laws.plant.parameters, **variant.parameters}
        p = {name: value * ones for name, value in values.items()}
        raw = replace(self.clock.at_rows, T=dict(zip(self.laws.bodies, self.T[:, :, b].T, strict=True)), p=p)
        moment = feel(raw, [(change, slice(None)) for change in variant.changes])
        return moment, self.laws.values(moment)


def integrate(plant: ZooPlant, programme: Programme, variants: Sequence[Variant]) -> ZooRun:
    """Integrate a batch."""
    clock, B = RunClock(plant, programme), len(variants)
    changes = list({id(change): change for variant in variants for change in variant.changes}.values())
    laws = ZooLaws(plant, [change for change in changes if change.kind == "bridge"])
    acting: Acting = [
        (change, np.array([b for b, variant in enumerate(variants) if any(c is change for c in variant.changes)]))
        for change in changes
    ]
    p = {
        name: np.array([variant.parameters.get(name, value) for variant in variants])
        for name, value in plant.parameters.items()
    }
    loud = np.array([0.0 if variant.quiet else 1.0 for variant in variants])
    n = len(laws.bodies)
    T = np.repeat(np.array([[programme.start[name]] for name in laws.bodies]), B, axis=1)
    before = T
    kept, made = np.empty((clock.steps + 1, n, B)), [np.zeros((clock.rows, B)) for _ in changes]
    steady = np.empty(0)
    fresh: list[int] = []
    for step in range(clock.steps):
        row, part = divmod(step, clock.steps_per_row)
        kept[step] = T
        T_middle = dict(zip(laws.bodies, T + 0.5 * (T - before), strict=True))
        moment = feel(_one_instant(clock.in_steps, step, T=T_middle, p=p), acting)
        if step == 0:
            laws.note_reads(moment)
            steady, fresh = laws.values(moment), laws.changing()
        balance = laws.balance(moment, laws.values(moment, held=steady, fresh=fresh), acting)
        for name, watts in clock.random_heat.items():
            balance.q[laws.body[name]] += watts[step] * loud
        heat = balance.q + laws.heat_from_boundaries(balance)
        new, mean = sdirk_step(T=T.T, capacity=balance.C.T, K=laws.matrix(balance.G), heat=heat.T, dt=clock.dt)
        new, mean = new.T, mean.T
        if part == 0:
            _note_heat(laws, acting, balance, mean, (new - T) / clock.dt, [kept_heat[row] for kept_heat in made])
        before, T = T, new
    kept[-1] = T
    for kept_heat in made:
        kept_heat[-1] = kept_heat[-2] if clock.rows > 1 else 0.0
    return ZooRun(clock=clock, laws=laws, changes=changes, T_steps=kept, made=made)


def _one_instant(m: Moment, k: int, *, T: Mapping[str, Array], p: Mapping[str, Array]) -> Moment:
    """One instant of a moment for all runs of a batch, with their temperatures and parameters."""
    ones = np.ones(len(next(iter(T.values()))))
    inputs = {name: values[k] * ones for name, values in m.inputs.items()}
    return Moment(hours=m.hours[k] * ones, since_start=m.since_start[k] * ones, inputs=inputs, T=T, p=p)


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


def _note_heat(
    laws: ZooLaws, acting: Acting, balance: ZooBalance, mean: Array, rate: Array, into: Sequence[Array]
) -> None:
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
