"""Laws of the plant: losses and conductances of many gearboxes at once, each with its parameters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from diagnosis.proof.plant.anatomy import MESH, OIL, SUMP
from diagnosis.proof.plant.plant import Plant, PlantMoment
from diagnosis.proof.plant.sizes import T_SERVICE
from models.base.types import Array
from models.formulas.heat_transfer import STEFAN_BOLTZMANN
from models.portable.evaluation import RPM
from models.quantities.units import KELVIN

FILM_REFERENCE_K = 316.65  # film temperature at which the reference of the convection is taken


class PlantLaws:
    """Losses, conductances and capacities of B gearboxes of one definition.

    Parameters
    ----------
    factors : mapping of str to Array, shape (B,)
        Multipliers by the names of the definition's tunable factors; 1 where a name is missing
    reading : Array of int, shape (B,)
        Which of :data:`diagnosis.proof.plant.plant.READINGS` the mesh follows
    forced_exponent, oil_exponent, exchange_exponent : Array, shape (B,)
        See :class:`diagnosis.proof.plant.plant_run.Individual`

    Attributes
    ----------
    capacity : Array, shape (B, n)
        [J/K]
    """

    def __init__(
        self,
        plant: Plant,
        factors: Mapping[str, Array],
        *,
        reading: Array,
        forced_exponent: Array,
        oil_exponent: Array,
        exchange_exponent: Array,
    ) -> None:
        self.plant, anatomy = plant, plant.anatomy
        one = np.ones(len(reading))

        def of(name: str | None) -> Array:
            return one if name is None else factors.get(name, one)

        self.base = np.stack([path.conductance * of(path.factor) for path in anatomy.paths], axis=1)
        self.capacity = np.stack([value * of(name) for value, name in anatomy.capacities.values()], axis=1)
        names = [_factor_of(component) for component in plant.components]
        self.loss_factor = np.stack([of(name) for name in names], axis=1)
        self.h_air, self.radiation = of("h_air"), of("radiation")
        self.reading = reading
        self.forced, self.oil_exponent, self.exchange = forced_exponent, oil_exponent, exchange_exponent
        self.loss_factor[:, 0] *= plant.reading_scale[self.reading]

    def losses(self, moment: PlantMoment) -> Array:
        """Loss of every component, shape (B, c), [W]; thinner oil is read as hotter oil, except by the seals."""
        return np.asarray(self.losses_at_one(moment) * self.loss_factor)

    def losses_at_one(self, moment: PlantMoment) -> Array:
        """Losses with all factors at 1, shape (B, c), [W]."""
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
        return np.asarray(np.concatenate(columns, axis=1))

    def conductances(self, moment: PlantMoment) -> Array:
        """Conductance of every path, shape (B, p), [W/K]."""
        G = self.base.copy()
        for column, path in enumerate(self.plant.anatomy.paths):
            if path.law != "fixed":
                G[:, column] = self._law(path.law, column, moment)
        return G

    def _law(self, law: str, column: int, moment: PlantMoment) -> Array:
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

    def _to_air(self, node: str, area: Array, moment: PlantMoment) -> Array:
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

    def _striction(self, moment: PlantMoment) -> Array:
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


def _factor_of(component: str) -> str:
    own = {"mesh_sliding": "mesh", "mesh_rolling": "rolling", "churning": "churning"}
    return own.get(component, component.partition("_")[0])
