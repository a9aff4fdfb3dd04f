"""Runs of the plant: integrates many gearboxes at once, each with its parameters, programme and concealed effects.

Conductances and losses are taken at the middle of every 10 s step, temperatures extrapolated to it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.proof.plant.anatomy import MESH, OIL, SPLASH, SUMP, T_SERVICE
from diagnosis.proof.plant.cycles import ROW_S, Programme
from diagnosis.proof.plant.effect import Concealed, Grip, Hook
from diagnosis.proof.plant.integrator import sdirk_step
from diagnosis.proof.plant.plant import Moment, Plant
from models.base.types import Array
from models.formulas.heat_transfer import KELVIN, STEFAN_BOLTZMANN
from models.losses.loss_term import RPM

FILM_REFERENCE_K = 316.65  # film temperature at which the reference of the convection is taken


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


@dataclass(frozen=True, kw_only=True)
class Run:
    """One gearbox in one recording.

    Attributes
    ----------
    individual : Individual
    programme : Programme
    air, air_speed : Array, shape (rows,)
        True ambient temperature [degC] and air speed [m/s]
    start : float
        Temperature of all nodes at the start, [degC]
    random_heat : mapping of place to Array, shape (rows,)
        Heat that no law describes, [W]
    effects : tuple of Concealed
    """

    individual: Individual
    programme: Programme
    air: Array
    air_speed: Array
    start: float
    random_heat: Mapping[str, Array]
    effects: tuple[Concealed, ...] = ()

    def __len__(self) -> int:
        return len(self.programme)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Result of one run without the rows before the recording.

    Attributes
    ----------
    T : Array, shape (rows, places)
        Temperatures at the coarse places, [degC]
    P_loss : Array, shape (rows,)
        Mechanical power lost, [W]
    air, torque : Array, shape (rows,)
        As the gearbox felt them, effects on inputs included
    losses : mapping of place to Array, shape (rows,)
        What the components of the loss model lose there, [W]
    heat : tuple of mapping of place to Array, shape (rows,)
        Heat [W] that each effect made in each place
    stored, given, shed : float
        Heat balance of the whole run, [J]: stored in the nodes, given by all sources, left through boundaries
    """

    T: Array
    P_loss: Array
    air: Array
    torque: Array
    losses: Mapping[str, Array]
    heat: tuple[Mapping[str, Array], ...]
    stored: float
    given: float
    shed: float


@dataclass(kw_only=True)
class _Tally:
    """Heat balance while stepping, shape (B,) each, [J]."""

    stored: Array
    given: Array
    shed: Array


def run_plant(plant: Plant, runs: Sequence[Run], progress: Callable[[int], None] | None = None) -> list[Outcome]:
    """Integrate runs; those of equal length go through one loop.

    Parameters
    ----------
    plant : Plant
    runs : sequence of Run
    progress : callable or None
        Called after every few steps with the number of rows done since the last call

    Returns
    -------
    list of Outcome
        In the order of `runs`
    """
    outcomes: dict[int, Outcome] = {}
    for length in sorted({len(run) for run in runs}):
        members = [i for i, run in enumerate(runs) if len(run) == length]
        batch = _Batch(plant, [runs[i] for i in members])
        outcomes.update(zip(members, batch.integrate(progress), strict=True))
    return [outcomes[i] for i in range(len(runs))]


class _Batch:
    """Runs of equal length on their way through time."""

    def __init__(self, plant: Plant, runs: Sequence[Run]) -> None:
        self.plant, self.runs = plant, runs
        anatomy, B = plant.anatomy, len(runs)
        self.n = len(anatomy.nodes)
        factor = [run.individual.factors for run in runs]

        def of(name: str | None) -> Array:
            return np.array([1.0 if name is None else f.get(name, 1.0) for f in factor])

        self.base = np.stack([path.conductance * of(path.factor) for path in anatomy.paths], axis=1)
        self.capacity = np.stack([value * of(name) for value, name in anatomy.capacities.values()], axis=1)
        names = [self._factor_of(component) for component in plant.components]
        self.loss_factor = np.stack([of(name) for name in names], axis=1)
        self.h_air, self.radiation = of("h_air"), of("radiation")
        pick = [run.individual for run in runs]
        self.reading = np.array([p.reading for p in pick])
        self.forced = np.array([p.forced_exponent for p in pick])
        self.oil_exponent = np.array([p.oil_exponent for p in pick])
        self.exchange = np.array([p.exchange_exponent for p in pick])
        self.loss_factor[:, 0] *= plant.reading_scale[self.reading]
        self.random_heat = self._random_heat(B)
        self.grips = self._grips()

    @staticmethod
    def _factor_of(component: str) -> str:
        own = {"mesh_sliding": "mesh", "mesh_rolling": "rolling", "churning": "churning"}
        return own.get(component, component.partition("_")[0])

    def _random_heat(self, B: int) -> Array:
        """Heat of the unknown by row, run and node, shape (rows, B, nodes), [W]."""
        heat = np.zeros((len(self.runs[0]), B, self.n))
        for member, run in enumerate(self.runs):
            for place, watts in run.random_heat.items():
                for node, weight in self.plant.anatomy.members(place).items():
                    heat[:, member, self.plant.anatomy.index[node]] += weight * watts
        return heat

    def _grips(self) -> list[tuple[Concealed, Grip]]:
        """Effects of the same kind act in one go on the runs that have them."""
        together: dict[str, list[tuple[int, Concealed, int]]] = {}
        for member, run in enumerate(self.runs):
            for position, effect in enumerate(run.effects):
                together.setdefault(effect.key, []).append((member, effect, position))
        grips = []
        for group in together.values():
            members, specimens, positions = zip(*group, strict=True)
            grips.append((specimens[0], Grip(self.plant, members, specimens, positions)))
        return grips

    # ------------------------------------------------------------------ time

    def integrate(self, progress: Callable[[int], None] | None) -> list[Outcome]:
        """All rows of all runs."""
        rows, B, anatomy = len(self.runs[0]), len(self.runs), self.plant.anatomy
        inputs = {
            "speed": np.stack([np.abs(run.programme.speed) for run in self.runs], axis=1),
            "torque": np.stack([run.programme.torque for run in self.runs], axis=1),
            "air": np.stack([run.air for run in self.runs], axis=1),
            "air_speed": np.stack([run.air_speed for run in self.runs], axis=1),
        }
        skipped = np.array([run.programme.unrecorded for run in self.runs])
        T = np.repeat(np.array([[run.start] for run in self.runs]), self.n, axis=1)
        before = T
        kept = np.empty((rows, B, len(anatomy.coarse)))
        felt = {name: np.empty((rows, B)) for name in ("air", "torque", "lost")}
        losses = {place: np.zeros((rows, B)) for place in map(self.plant.place_of, self.plant.components)}
        tally = _Tally(stored=np.zeros(B), given=np.zeros(B), shed=np.zeros(B))
        for _, grip in self.grips:
            grip.prepare(rows)
        for row in range(rows):
            kept[row] = T @ anatomy.reading.T
            after = min(row + 1, rows - 1)
            middle = {name: 0.5 * (values[row] + values[after]) for name, values in inputs.items()}
            hours = np.maximum(row + 0.5 - skipped, 0.0) * ROW_S / 3600.0
            moment = self._moment(hours, middle, T + 0.5 * (T - before), self.random_heat[row])
            for name, values in (("air", moment.air), ("torque", moment.torque), ("lost", moment.lost)):
                felt[name][row] = values
            for k, component in enumerate(self.plant.components):
                losses[self.plant.place_of(component)][row] += moment.loss[:, k]
            before, T = T, self._step(T, moment, tally)
            if progress is not None and row % 20 == 19:
                progress(20 * B)
        return [self._outcome(i, kept, felt, losses, tally) for i in range(B)]

    def _outcome(
        self, i: int, kept: Array, felt: Mapping[str, Array], losses: Mapping[str, Array], tally: _Tally
    ) -> Outcome:
        first = self.runs[i].programme.unrecorded
        heat: list[Mapping[str, Array]] = [{} for _ in self.runs[i].effects]
        for _, grip in self.grips:
            for k in np.flatnonzero(grip.members == i):
                heat[grip.positions[k]] = {place: values[first:, k] for place, values in grip.made.items()}
        return Outcome(
            T=kept[first:, i],
            P_loss=felt["lost"][first:, i],
            air=felt["air"][first:, i],
            torque=felt["torque"][first:, i],
            losses={place: values[first:, i] for place, values in losses.items()},
            heat=tuple(heat),
            stored=float(tally.stored[i]),
            given=float(tally.given[i]),
            shed=float(tally.shed[i]),
        )

    def _step(self, T: Array, moment: Moment, tally: _Tally) -> Array:
        plant, B, n = self.plant, len(T), self.n
        K = np.zeros((B, n, n))
        K[:, plant.a, plant.b] = K[:, plant.b, plant.a] = -moment.G
        K[:, np.arange(n), np.arange(n)] = moment.G @ plant.touching + moment.ground
        boundary = list(plant.anatomy.boundary)
        T = T.copy()
        T[:, boundary] = moment.air[:, None]
        heat = moment.heat + moment.ground_heat
        new, mean = sdirk_step(T=T, capacity=moment.capacity, K=K, heat=heat, dt=ROW_S)
        own = np.setdiff1d(np.arange(n), boundary)
        tally.stored += (moment.capacity * (new - T))[:, own].sum(axis=1)
        tally.given += ROW_S * moment.heat.sum(axis=1)
        for path in np.flatnonzero(np.isin(plant.b, boundary)):
            tally.shed += ROW_S * moment.G[:, path] * (mean[:, plant.a[path]] - mean[:, plant.b[path]])
        tally.shed += ROW_S * (moment.ground * mean - moment.ground_heat).sum(axis=1)
        return np.asarray(new)

    # ------------------------------------------------------------------ laws

    def _moment(self, hours: Array, inputs: Mapping[str, Array], T: Array, random_heat: Array) -> Moment:
        B, anatomy = len(self.runs), self.plant.anatomy
        bearings = len(anatomy.bearings)
        moment = Moment(
            hours=hours, speed=inputs["speed"].copy(), torque=inputs["torque"].copy(), air=inputs["air"].copy(),
            air_speed=inputs["air_speed"].copy(), T=T, thinning=np.zeros(B), bearing_load=np.ones((B, bearings)),
            loss=np.zeros((B, len(self.plant.components))), lost=np.zeros(B), heat=random_heat.copy(),
            G=np.empty(0), ground=np.zeros((B, self.n)), ground_heat=np.zeros((B, self.n)),
            capacity=self.capacity.copy(),
        )  # fmt: skip
        self._act("before", moment)
        moment.loss = self._losses(moment)
        moment.G = self._conductances(moment)
        self._act("after", moment)
        self._place_losses(moment)
        return moment

    def _act(self, when: str, moment: Moment) -> None:
        for effect, grip in self.grips:
            hook: Hook | None = getattr(effect.effect, when)
            grip.moment = moment
            if hook is not None:
                hook(grip)
            if when == "after":
                grip.next_row()

    def _losses(self, moment: Moment) -> Array:
        """Loss of every component, shape (B, c), [W]; thinner oil is read as hotter oil, except by the seals."""
        index, anatomy = self.plant.anatomy.index, self.plant.anatomy
        oil = moment.T[:, index[SUMP]]
        thin = moment.thinning
        gears = {gear: moment.T[:, index[f"{gear}.rim"]] + thin for gear in anatomy.gears}
        mesh = np.empty((len(oil), 2))
        for reading in np.unique(self.reading):
            of = self.reading == reading
            at = {gear: T[of] for gear, T in gears.items()}
            mesh[of] = self.plant.losses[reading].term("mesh").power(moment.speed[of], moment.torque[of], at)
        columns = [mesh]
        for term in self.plant.losses[0].terms:
            if term.name in anatomy.bearings:
                load = moment.torque * moment.bearing_load[:, anatomy.bearings.index(term.name)]
                at = {OIL: oil + thin, term.name: moment.T[:, index[term.name]] + thin}
                columns.append(term.power(moment.speed, load, at))
            elif term.name != MESH:
                columns.append(term.power(moment.speed, moment.torque, {OIL: oil}))
        return np.asarray(np.concatenate(columns, axis=1) * self.loss_factor)

    def _conductances(self, moment: Moment) -> Array:
        G = self.base.copy()
        for column, path in enumerate(self.plant.anatomy.paths):
            if path.law != "fixed":
                G[:, column] = self._law(path.law, column, moment)
        return G

    def _law(self, law: str, column: int, moment: Moment) -> Array:
        plant, anatomy = self.plant, self.plant.anatomy
        base, index = self.base[:, column], anatomy.index
        path = anatomy.paths[column]
        relative = moment.speed / plant.speed_ref
        if law == "oil":
            wall = anatomy.half_wall / anatomy.share[path.ends[1].removesuffix(".inner")]
            return np.asarray(1.0 / (1.0 / base + wall))
        if law == "exchange":
            return np.asarray(base * (0.3 + 0.7 * relative**self.exchange))
        if law == "air":
            return self._to_air(path.ends[0], base, moment)
        if law == MESH:
            # Half of a contact's conductance to one gear: heat crosses from rim to rim through both in series.
            return np.asarray(0.5 * base * self._striction(moment))
        kind, _, gear = law.partition("_")
        to_oil = self._gear_to_oil(kind, int(gear), moment.T[:, index[SUMP]], moment.speed)
        return np.asarray(base * to_oil * np.maximum(relative, 0.02) ** self.oil_exponent)

    def _to_air(self, node: str, area: Array, moment: Moment) -> Array:
        """Wall to air with radiation, behind the quarter of the wall; mixed convection by the cubic rule."""
        anatomy = self.plant.anatomy
        T, T_a = moment.T[:, anatomy.index[node]], moment.air
        forced_ref, free_ref = anatomy.convection
        v_ref = max(self.plant.gearbox.ambient.air_speed_m_s, 0.1)
        forced = forced_ref * (np.maximum(moment.air_speed, 0.0) / v_ref) ** self.forced
        free = free_ref * (np.abs(T - T_a) / 33.0) ** 0.25
        theta, theta_a = T + KELVIN, T_a + KELVIN
        forced = forced * (0.5 * (theta + theta_a) / FILM_REFERENCE_K) ** -0.8  # hot air is thin
        emissivity = self.plant.gearbox.housing.emissivity
        h = self.h_air * np.cbrt(forced**3 + free**3)
        h = h + self.radiation * emissivity * STEFAN_BOLTZMANN * (theta**2 + theta_a**2) * (theta + theta_a)
        wall = anatomy.half_wall / anatomy.share[node.removesuffix(".outer")]
        return np.asarray(1.0 / (1.0 / np.maximum(h * area, 1e-9) + wall))

    def _striction(self, moment: Moment) -> Array:
        """Conductance from the contact into one gear, [W/K]: flash temperature at the pitch point, exponents rounded.

        ``b_H ~ T^(1/2)`` and ``G ~ (b_H u)^(1/2)``: Blok's law, with 0.48 and 0.26 in place of 1/2 and 1/4.
        """
        pair, steel = self.plant.anatomy.pair, self.plant.anatomy.stage.material
        k = steel.conductivity_W_mK
        chi = k / (steel.density_kg_m3 * steel.specific_heat_J_kgK)
        E_red = steel.youngs_modulus / (1.0 - steel.poisson**2)
        M, n = self.plant.torque_ref, self.plant.speed_ref
        b_H = np.sqrt(8.0 * M / (pair.r_b[0] * pair.b) * 0.24 * pair.T1T2 / (np.pi * E_red))
        reference = 2.0 * b_H * pair.b * k / 1.06 * np.sqrt(n * RPM * pair.T1C / (chi * b_H))
        speed = np.maximum(moment.speed, 1.0) / n
        torque = np.maximum(np.abs(moment.torque), 1.0) / M
        return np.asarray(reference * speed**0.48 * torque**0.26)

    def _gear_to_oil(self, kind: str, gear: int, T_oil: Array, speed: Array) -> Array:
        """Faces: a disk with laminar and turbulent part by a power sum; teeth: a film flung off every turn. [W/K].

        Smooth where the usual forms change regime; constants as in Dorfman 1963 and de Winter, Blok 1974, from memory.
        """
        oil, pair = self.plant.oil, self.plant.anatomy.pair
        omega = np.maximum(speed, 0.0) * RPM / (1.0 if gear == 0 else pair.u)
        nu = oil.kinematic_viscosity(T_oil) * 1e-6
        rho, c, k = oil.density(T_SERVICE), oil.specific_heat(T_SERVICE), oil.conductivity(T_SERVICE)
        prandtl = nu * rho * c / k
        r, height = pair.r[gear], pair.r_a[gear] - pair.r_f[gear]
        if kind == "teeth":
            film = 1.14 * np.sqrt(omega * k * rho * c) / (2.0 * np.pi) * (prandtl * height / r) ** 0.25
            return np.asarray(film * pair.z[gear] * height * pair.b)
        level = self.plant.gearbox.oil.level_below_axis / pair.r_a[gear]
        theta = np.arccos(np.clip(level, -1.0, 1.0))
        immersed = (2.0 * theta - np.sin(2.0 * theta)) / (2.0 * np.pi)
        Re = omega * r**2 / nu
        nusselt = ((0.6 * np.sqrt(Re)) ** 6 + (0.019 * Re**0.8) ** 6) ** (1.0 / 6.0) * np.cbrt(prandtl)
        return np.asarray(nusselt * k / r * 2.0 * np.pi * r**2 * immersed)

    def _place_losses(self, moment: Moment) -> None:
        """Losses into the nodes: the mesh's parts between the rims and the oil, churning and seals into the oil."""
        index, components = self.plant.anatomy.index, self.plant.components
        moment.lost += moment.loss.sum(axis=1)
        mesh = moment.loss[:, 0] + moment.loss[:, 1]
        for node, weight in self.plant.mesh_spread.items():
            moment.heat[:, index[node]] += weight * mesh
        for k, component in enumerate(components[2:], start=2):
            if component in self.plant.anatomy.bearings:
                moment.heat[:, index[component]] += moment.loss[:, k]
            else:
                splash = 0.3 if component == "churning" else 0.0
                moment.heat[:, index[SUMP]] += (1.0 - splash) * moment.loss[:, k]
                moment.heat[:, index[SPLASH]] += splash * moment.loss[:, k]
