"""Runs of zoo plants, many variants of one plant in one batch, and their derivatives."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from diagnosis.proof.plant.cycles import Programme
from diagnosis.proof.plant.integrator import GAMMA
from diagnosis.proof.zoo.laws import ZooBalance, feel
from diagnosis.proof.zoo.run import integrate, read_probes
from diagnosis.proof.zoo.structure import Moment, Variant, ZooChange, ZooOutcome, ZooPlant
from models.base.types import Array

STEP_K, RELATIVE_STEP = 1e-3, 1e-5  # of differences of laws: temperatures [K], and parameters and inputs
ROWS_AT_ONCE = 200


@dataclass(frozen=True, kw_only=True)
class ParameterDirection:
    """A direction of :class:`LinearRun`: the parameter `name` of the plant grows by `step` per unit amplitude.

    Attributes
    ----------
    step : float
        In the unit of the parameter; its value times the logarithm's standard deviation for one standard deviation
    """

    name: str
    step: float


@dataclass(frozen=True, kw_only=True)
class StartDirection:
    """A direction of :class:`LinearRun`: bodies start warmer by these amounts per unit amplitude.

    Attributes
    ----------
    start : mapping of str to float
        [K] by body
    """

    start: Mapping[str, float]


Direction = ZooChange | ParameterDirection | StartDirection


def simulate(plant: ZooPlant, programme: Programme, variants: Sequence[Variant]) -> ZooOutcome:
    """Integrate variants of a plant over one programme, all in one batch.

    Parameters
    ----------
    plant : ZooPlant
    programme : Programme
    variants : sequence of Variant

    Returns
    -------
    ZooOutcome
        Of the recorded rows. ``heat`` is the mean over the step after a row; of a change of a capacity it is the heat
        that the capacity gives, of an input zero.
    """
    run = integrate(plant, programme, variants)
    laws = run.laws
    first = programme.unrecorded
    place = {id(change): k for k, change in enumerate(run.changes)}
    P_loss, boundary = [], []
    for b, variant in enumerate(variants):
        moment, values = run.at_rows(b, variant)
        acting = [(change, slice(None)) for change in variant.changes]
        P_loss.append(laws.balance(moment, values, acting).loss[first:])
        boundary.append(values[: len(laws.boundaries)])
    whole = {name: run.T[:, k].T for k, name in enumerate(laws.bodies)}
    whole |= {name: np.stack([own[k] for own in boundary]) for k, name in enumerate(laws.boundaries)}
    heat = [
        {i: run.made[place[id(change)]][first:, b] for i, change in enumerate(variant.changes)}
        for b, variant in enumerate(variants)
    ]
    return ZooOutcome(
        T={name: values[:, first:] for name, values in whole.items()},
        readings=read_probes(plant, whole, first),
        P_loss=np.stack(P_loss),
        heat=heat,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Push:
    """Forces and direct responses of one direction.

    Attributes
    ----------
    into : mapping of int to (Array, Array), shape (steps,)
        Force on a body in both stages of every step, [W]
    outputs : mapping of int to Array, shape (rows,)
        Direct derivative of an output
    start : Array, shape (bodies,)
        [K]
    """

    into: Mapping[int, tuple[Array, Array]]
    outputs: Mapping[int, Array]
    start: Array


class LinearRun:
    """A run of the plant as it is, and its linear time steps for any number of directions.

    The derivatives of its heat balance are differences of laws, every law over all steps at once; the directions go
    through the same time step as the run.
    """

    def __init__(self, plant: ZooPlant, programme: Programme) -> None:
        run = integrate(plant, programme, [Variant()])
        self.laws, self.clock = run.laws, run.clock
        start = run.T_steps[:-1, :, 0].T  # (bodies, steps)
        before = np.concatenate([start[:, :1], start[:, :-1]], axis=1)
        self.raw = self._moment(run.clock.in_steps, start + 0.5 * (start - before))
        self.raw_rows = self._moment(run.clock.at_rows, run.T[:, :, 0].T)
        self.base, self.values = self._evaluate(self.raw)
        self.base_rows, self.values_rows = self._evaluate(self.raw_rows)
        self.whole = replace(self.raw, T=self.base.T)
        self.whole_rows = replace(self.raw_rows, T=self.base_rows.T)
        self._stages(start)

    def _moment(self, m: Moment, T: Array) -> Moment:
        p = {k: np.full(len(m.hours), v) for k, v in self.laws.plant.parameters.items()}
        return replace(m, T=dict(zip(self.laws.bodies, T, strict=True)), p=p)

    def _evaluate(
        self, raw: Moment, held: Array | None = None, fresh: Sequence[int] | None = None
    ) -> tuple[ZooBalance, Array]:
        values = self.laws.values(raw, held=held, fresh=fresh)
        return self.laws.balance(raw, values, ()), values

    def _stages(self, start: Array) -> None:
        """Temperatures and rates of the two stages of every step, and the matrices of the step."""
        laws, base, dt = self.laws, self.base, self.clock.dt
        self.K = laws.matrix(base.G)
        n = len(laws.bodies)
        M = GAMMA * dt * self.K
        M[:, np.arange(n), np.arange(n)] += base.C.T
        self.inverse = np.linalg.inv(M)
        heat = base.q + laws.heat_from_boundaries(base)
        for name, watts in self.clock.random_heat.items():
            heat[laws.body[name]] += watts
        rate_1 = _apply(self.inverse, heat - _apply(self.K, start))
        second = start + (1.0 - GAMMA) * dt * rate_1
        rate_2 = _apply(self.inverse, heat - _apply(self.K, second))
        stage_1 = start + GAMMA * dt * rate_1
        stage_2 = second + GAMMA * dt * rate_2
        self.stages = ((stage_1, rate_1), (stage_2, rate_2))

    # ------------------------------------------------------------------ derivatives of the heat balance

    def _forces(self, base: ZooBalance, moved: ZooBalance, T: Array, rate: Array, step: float) -> Array:
        """Derivative of ``q - K T - C dT/dt`` between two balances at temperatures of bodies, (bodies, columns)."""
        laws = self.laws
        force = (moved.q - base.q - (moved.C - base.C) * rate) / step
        dG = (moved.G - base.G) / step
        for path in map(int, np.flatnonzero(np.any(dG != 0.0, axis=1))):
            a, b = laws.ends[path]
            i, j = laws.body.get(a), laws.body.get(b)
            flow = dG[path] * ((T[i] if i is not None else base.T[a]) - (T[j] if j is not None else base.T[b]))
            if i is not None:
                force[i] -= flow
            if j is not None:
                force[j] += flow
        for path, body, boundary in laws.from_boundary:
            force[body] += moved.G[path] * (moved.T[boundary] - base.T[boundary]) / step
        return np.asarray(force)

    def _both_stages(self, moved: ZooBalance, step: float) -> tuple[Array, Array]:
        return tuple(self._forces(self.base, moved, T, rate, step) for T, rate in self.stages)  # type: ignore[return-value]

    @cached_property
    def _jacobians(self) -> tuple[Array, Array, Array]:
        """Derivatives to temperatures: of both stages at mid-step (steps, n, n), of the outputs (rows, outputs, n)."""
        laws, n = self.laws, len(self.laws.bodies)
        J = [np.zeros((self.clock.steps, n, n)) for _ in self.stages]
        J_out = np.zeros((self.clock.rows, 1 + len(laws.boundaries), n))
        for k, name in enumerate(laws.bodies):
            fresh = laws.reached_by(("T", name))
            if not fresh:
                continue
            moved = self._moved(self.raw, self.values, "T", name, STEP_K, fresh)
            for J_stage, force in zip(J, self._both_stages(moved, STEP_K), strict=True):
                J_stage[:, :, k] = force.T
            moved = self._moved(self.raw_rows, self.values_rows, "T", name, STEP_K, fresh)
            J_out[:, :, k] = (self._outputs(moved) - self._outputs(self.base_rows)).T / STEP_K
        return J[0], J[1], J_out

    def _outputs(self, balance: ZooBalance) -> Array:
        """Loss and the temperatures of boundaries, shape (outputs, columns)."""
        return np.stack([balance.loss, *(balance.T[name] for name in self.laws.boundaries)])

    def _moved(
        self, raw: Moment, values: Array, kind: str, name: str, step: Array | float, fresh: list[int]
    ) -> ZooBalance:
        field = dict(getattr(raw, kind))
        field[name] = field[name] + step
        return self._evaluate(replace(raw, **{kind: field}), values, fresh)[0]  # type: ignore[arg-type]

    def _along(self, direction: Direction) -> _Push:
        still = np.zeros(len(self.laws.bodies))
        steps: list[Array | float]
        if isinstance(direction, StartDirection):
            for name, kelvin in direction.start.items():
                still[self.laws.body[name]] = kelvin
            return _Push(into={}, outputs={}, start=still)
        if isinstance(direction, ParameterDirection):
            kind, name, steps = "p", direction.name, [direction.step, direction.step]
        elif direction.kind == "input":
            kind, name = "inputs", direction.target
            steps = [feel(raw, [(direction, slice(None))]).inputs[name] - raw.inputs[name]
                     for raw in (self.raw, self.raw_rows)]  # fmt: skip
        else:
            return self._push_of_change(direction, still)
        fresh = self.laws.reached_by((kind, name))
        moved = self._moved(self.raw, self.values, kind, name, RELATIVE_STEP * steps[0], fresh)
        at_rows = self._moved(self.raw_rows, self.values_rows, kind, name, RELATIVE_STEP * steps[1], fresh)
        early, late = self._both_stages(moved, RELATIVE_STEP)
        direct = (self._outputs(at_rows) - self._outputs(self.base_rows)) / RELATIVE_STEP
        pushed = np.flatnonzero(np.any((early != 0.0) | (late != 0.0), axis=1))
        return _Push(into={int(k): (early[k], late[k]) for k in pushed}, outputs=dict(enumerate(direct)), start=still)

    def _push_of_change(self, change: ZooChange, still: Array) -> _Push:
        """Forces of a change without a balance of all bodies."""
        laws = self.laws
        amount = np.broadcast_to(change.law(self.whole), self.clock.steps)
        at_rows = np.broadcast_to(change.law(self.whole_rows), self.clock.rows)
        into: dict[int, tuple[Array, Array]] = {}
        outputs = {}
        if change.kind == "path":
            k = laws.path[change.target]
            G = amount * self.base.G[k]
            for own, other in (laws.ends[k], laws.ends[k][::-1]):
                if own in laws.body:
                    ends = [
                        [T[laws.body[name]] if name in laws.body else self.base.T[name] for name in (own, other)]
                        for T, _ in self.stages
                    ]
                    into[laws.body[own]] = (G * (ends[0][1] - ends[0][0]), G * (ends[1][1] - ends[1][0]))
        elif change.kind == "source":
            k = laws.source[change.target]
            watts = amount * self.values[laws.cut[1] + k]
            into = {int(b): (laws.spread[b, k] * watts,) * 2 for b in np.flatnonzero(laws.spread[:, k])}
            outputs = {0: laws.is_loss[k] * at_rows * self.values_rows[laws.cut[1] + k]}
        elif change.kind == "capacity":
            b = laws.body[change.target]
            into[b] = (-amount * self.base.C[b] * self.stages[0][1][b], -amount * self.base.C[b] * self.stages[1][1][b])
        else:
            into[laws.body[change.target]] = (amount, amount)
            if change.other in laws.body:
                into[laws.body[change.other]] = (-amount, -amount)
            outputs = {0: change.is_loss * at_rows}
        return _Push(into=into, outputs=outputs, start=still)

    # ------------------------------------------------------------------ response

    def respond(self, directions: Sequence[Direction]) -> tuple[dict[str, Array], Array]:
        """Derivatives of the readings by channel, and of the loss, shape (directions, rows)."""
        laws, clock = self.laws, self.clock
        J_1, J_2, J_out = self._jacobians
        along = [self._along(direction) for direction in directions]
        dT = np.stack([push.start for push in along], axis=1)
        before = dT
        seats = [name for probe in laws.plant.probes for name in probe.mix]
        wanted = [name for name in laws.bodies if name in seats]
        of_wanted = np.array([laws.body[name] for name in wanted])
        T = np.empty((len(wanted), len(directions), clock.rows))
        outputs = np.zeros((1 + len(laws.boundaries), len(directions), clock.rows))
        for column, push in enumerate(along):
            for output, direct in push.outputs.items():
                outputs[output, column] = direct
        for step, (transit, of_middle, forced) in enumerate(self._chunks(J_1, J_2, along)):
            row, part = divmod(step, clock.steps_per_row)
            if part == 0:
                T[:, :, row] = dT[of_wanted]
                outputs[:, :, row] += J_out[row] @ dT
            middle = dT + 0.5 * (dT - before)
            before, dT = dT, transit @ dT + of_middle @ middle + forced
        T[:, :, -1] = dT[of_wanted]
        outputs[:, :, -1] += J_out[-1] @ dT
        seat = dict(zip(wanted, T, strict=True)) | dict(zip(laws.boundaries, outputs[1:], strict=True))
        first = clock.programme.unrecorded
        return read_probes(laws.plant, seat, first), outputs[0][:, first:]

    def _chunks(self, J_1: Array, J_2: Array, along: Sequence[_Push]) -> Iterator[tuple[Array, Array, Array]]:
        """Per step: matrices of the temperatures at its start and at its middle, and what the directions add."""
        dt, n = self.clock.dt, len(self.laws.bodies)
        eye = np.eye(n)
        for first in range(0, self.clock.steps, ROWS_AT_ONCE):
            part = slice(first, min(first + ROWS_AT_ONCE, self.clock.steps))
            inverse, K = self.inverse[part], self.K[part]
            F_1, F_2 = np.zeros((2, len(K), n, len(along)))
            for column, push in enumerate(along):
                for body, (force_1, force_2) in push.into.items():
                    F_1[:, body, column], F_2[:, body, column] = force_1[part], force_2[part]
            # rate_1 = inverse (F_1 - K dT), second = dT + (1 - g) dt rate_1, rate_2 = inverse (F_2 - K second)
            decay = inverse @ K
            second = eye - (1.0 - GAMMA) * dt * decay
            last = eye - GAMMA * dt * decay
            transit = last @ second
            early, late = (1.0 - GAMMA) * dt * (last @ inverse), GAMMA * dt * inverse
            yield from zip(transit, early @ J_1[part] + late @ J_2[part], early @ F_1 + late @ F_2, strict=True)


def _apply(matrices: Array, vectors: Array) -> Array:
    """Products of (columns, n, n) and (n, columns)."""
    return np.asarray(np.einsum("kij,jk->ik", matrices, vectors))
