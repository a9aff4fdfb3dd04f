"""The full power-loss model (F-PL): operating points in, one loss per component out.

Every loss source (mesh, rolling elements, splashing gears, seals) gives its component or components;
:class:`LossModel` puts them side by side. Speed and torque are the input shaft's, signed; losses depend on their
magnitudes only, are never negative, and go to zero with speed.

Two floors keep real drive cycles finite and continuous: below 1 N m the contact is evaluated at 1 N m and the sliding
loss scaled linearly with torque (eqs. 3-4 of the paper are singular without load); below 1 rpm all losses are evaluated
at 1 rpm and scaled linearly with speed (a constant friction torque).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from models import churning, seal
from models.bearing import SkfRollerBearing, heat_dissipation_reference
from models.ehl import reduced_modulus
from models.errors import InputError, did_you_mean
from models.friction import MeshContact
from models.gearbox_definition import Definition
from models.geometry import GearPair
from models.load_sharing import contact_points
from models.oil import Oil
from models.types import Array

SPEED_FLOOR_RPM = 1.0
TORQUE_FLOOR_NM = 1.0
RPM = np.pi / 30.0
BATCH = 4096  # operating points evaluated at once: keeps the contact-point arrays inside the cache


@dataclass(frozen=True, kw_only=True)
class ChurningLoss:
    """Splashing of both gears of the mesh, by one of the named models."""

    pair: GearPair
    oil: Oil
    model: str
    level_below_axis: float  # m
    oil_volume: float  # m^3
    C_Sp: float = 1.0

    @property
    def immersion(self) -> tuple[float, float]:
        """Immersion depths of pinion and wheel, [m]; not positive where a gear is dry."""
        return self.pair.r_a[0] - self.level_below_axis, self.pair.r_a[1] - self.level_below_axis

    def loss(self, omega_1: Array, T_oil: Array) -> Array:
        """Churning loss [W] at pinion speed [rad/s] and oil temperature [degC], each shape (...)."""
        pair, v_t = self.pair, omega_1 * self.pair.r_w[0]
        omega = (omega_1, omega_1 / pair.u)
        if self.model == "niemann":
            per_gear = [churning.churning_niemann(e=e, b=pair.b, v_t=v_t) for e in self.immersion]
        elif self.model == "niemann_printed":
            per_gear = [
                churning.churning_niemann_printed(e=e, b=pair.b, v_t=v_t, omega=w)
                for e, w in zip(self.immersion, omega, strict=True)
            ]
        elif self.model == "mauz":
            per_gear = [churning.churning_mauz(e=self.immersion, b=pair.b, v_t=v_t, omega_2=omega[1], C_Sp=self.C_Sp)]
        else:
            nu, rho = self.oil.kinematic_viscosity(T_oil), self.oil.density(T_oil)
            per_gear = [
                churning.churning_changenet_velex(
                    # Measured at the pitch circle, as theta and D are; the teeth come as flanks of their own.
                    h=pair.r_w[i] - self.level_below_axis,
                    r_p=pair.r_w[i],
                    b=pair.b,
                    z=pair.z[i],
                    tooth_height=pair.r_a[i] - pair.r_f[i],
                    alpha=pair.alpha_n,
                    V_oil=self.oil_volume,
                    omega=omega[i],
                    nu=nu,
                    rho=rho,
                )
                for i in (0, 1)
            ]
        return np.asarray(sum(per_gear))


@dataclass(frozen=True, kw_only=True)
class SealLoss:
    """One radial shaft seal."""

    d_mm: float
    model: str
    nu_40: float
    c_T: float
    speed_ratio: float

    def loss(self, n_input: Array, T_oil: Array) -> Array:
        """Seal loss [W] at input speed [1/min] and oil temperature [degC], each shape (...)."""
        n = n_input * self.speed_ratio
        if self.model == "iso_simple":
            return seal.seal_loss_iso_simple(d_mm=self.d_mm, n_rpm=n) + 0.0 * T_oil
        return seal.seal_loss_linke(d_mm=self.d_mm, n_rpm=n, T_oil=T_oil, nu_40=self.nu_40, c_T=self.c_T)


@dataclass(frozen=True, kw_only=True)
class LossModel:
    """The full model of one gearbox.

    Attributes
    ----------
    components : tuple of str
        Names of the losses, in the order of :meth:`power`'s last axis
    temperature_nodes : tuple of str
        Node temperatures that are read, in the order of :meth:`power`'s last axis of `temperatures`:
        the oil, the two gears, the bearings
    """

    components: tuple[str, ...]
    temperature_nodes: tuple[str, ...]
    mesh: MeshContact
    churning: ChurningLoss
    seals: tuple[SealLoss, ...]
    bearings: tuple[SkfRollerBearing, ...]
    bearing_speed_ratio: tuple[float, ...]
    bearing_load_per_torque: tuple[float, ...]

    @classmethod
    def from_definition(cls, gearbox: Definition) -> LossModel:
        """Build the model that a definition describes."""
        stage, oil = gearbox.stage[0], gearbox.lubricant()
        pair = stage.pair()
        elastic = (stage.material.youngs_modulus,) * 2, (stage.material.poisson,) * 2
        t, dx, share = contact_points(
            pair, model=stage.load_sharing, r_bore=stage.bore_radius, E=elastic[0], nu=elastic[1]
        )
        rho_1, rho_2, R = pair.curvature_radii(t)
        friction, material = stage.friction, stage.material
        averaged_over = pair.p_b if friction.average == "base_pitch" else pair.T1E - pair.T1A
        _, rho_2_C, rho_red_C = pair.curvature_radii(np.asarray(pair.T1C))
        mesh = MeshContact(
            oil=oil,
            weight=dx / averaged_over,
            share=share,
            rho_1=rho_1,
            rho_2=rho_2,
            R=R,
            r_b1=pair.r_b[0],
            u=pair.u,
            v_sum_C_per_omega=float(pair.T1C + rho_2_C / pair.u),
            rho_red_C=float(rho_red_C),
            b=pair.b,
            E_red=reduced_modulus(material.youngs_modulus, material.poisson, material.youngs_modulus, material.poisson),
            k_steel=material.conductivity_W_mK,
            chi_steel=material.conductivity_W_mK / (material.density_kg_m3 * material.specific_heat_J_kgK),
            Ra=stage.roughness_Ra,
            mu_solid=friction.mu_solid,
            friction=friction.model,
            asperity_share=friction.asperity_load_share,
            roughness=friction.roughness,
            film=friction.film,
            thermal_reduction=friction.thermal_reduction,
            rolling_constant=stage.rolling.constant_N_m2,
        )
        ratio = gearbox.speed_ratio
        level = gearbox.oil.level_below_axis
        return cls(
            components=(
                "mesh_sliding",
                "mesh_rolling",
                "churning",
                *(s.name for s in gearbox.seal),
                *(b.name for b in gearbox.bearing),
            ),
            temperature_nodes=("oil", *stage.names, *(b.name for b in gearbox.bearing)),
            mesh=mesh,
            churning=ChurningLoss(
                pair=pair,
                oil=oil,
                model=stage.churning.model,
                level_below_axis=level,
                oil_volume=gearbox.oil.volume,
                C_Sp=stage.churning.C_Sp,
            ),
            seals=tuple(
                SealLoss(
                    d_mm=s.diameter_mm,
                    model=s.model,
                    nu_40=oil.nu_40 if s.nu_40_mm2_s is None else s.nu_40_mm2_s,
                    c_T=s.temperature_coefficient,
                    speed_ratio=ratio[s.shaft],
                )
                for s in gearbox.seal
            ),
            bearings=tuple(
                SkfRollerBearing(
                    d=b.bore_mm,
                    D=b.outside_diameter_mm,
                    B=b.width_mm,
                    H=b.oil_level(level * 1e3),
                    mass=b.mass_kg,
                    R1=b.R1,
                    S2=b.S2,
                    K_rs=b.K_rs,
                    K_Z=b.K_Z,
                    K_L=b.K_L,
                    mu_bl=b.mu_bl,
                    mu_EHL=b.mu_EHL,
                    drag=b.drag,
                    temperature=b.temperature,
                    W_s=heat_dissipation_reference(b.bore_mm, b.outside_diameter_mm, b.width_mm)
                    if b.heat_dissipation_W_K is None
                    else b.heat_dissipation_W_K,
                    T_ambient=gearbox.ambient.temperature_degC,
                )
                for b in gearbox.bearing
            ),
            bearing_speed_ratio=tuple(ratio[b.shaft] for b in gearbox.bearing),
            bearing_load_per_torque=tuple(b.load_share / pair.r_b[0] for b in gearbox.bearing),
        )

    @cached_property
    def reads(self) -> tuple[frozenset[str], ...]:
        """Which of the `temperature_nodes` each component reads: the mesh its gears, all others the oil."""
        oil, *rest = self.temperature_nodes
        gears, bearings = frozenset(rest[:2]), rest[2:]
        no_load = [frozenset({oil})] * (1 + len(self.seals))
        return (gears, gears, *no_load, *(frozenset({oil, name}) for name in bearings))

    @cached_property
    def bearing_groups(self) -> tuple[tuple[int, ...], ...]:
        """Indices of bearings that are alike: one surrogate serves a group."""
        groups: dict[SkfRollerBearing, list[int]] = {}
        for index, bearing in enumerate(self.bearings):
            groups.setdefault(bearing, []).append(index)
        return tuple(tuple(group) for group in groups.values())

    def power(self, speed: ArrayLike, torque: ArrayLike, temperatures: ArrayLike) -> Array:
        """Loss of every component.

        Parameters
        ----------
        speed : ArrayLike, shape (...)
            Speed of the input shaft, [1/min], signed
        torque : ArrayLike, shape (...)
            Torque of the input shaft, [N m], signed
        temperatures : ArrayLike, shape (..., len(temperature_nodes))
            [degC]

        Returns
        -------
        Array, shape (..., len(components))
            [W], >= 0

        Raises
        ------
        InputError
            If an input is not finite or a temperature below absolute zero.
        """
        T = np.asarray(temperatures, dtype=float)
        n, torque, _ = np.broadcast_arrays(np.asarray(speed, dtype=float), np.asarray(torque, dtype=float), T[..., 0])
        shape = n.shape
        T = np.broadcast_to(T, (*shape, T.shape[-1])).reshape(-1, T.shape[-1])
        n, torque = n.reshape(-1), torque.reshape(-1)
        _refuse_unphysical(n, torque, T, self.temperature_nodes)
        if len(n) <= BATCH:
            return self._power(n, torque, T).reshape(*shape, len(self.components))
        rows = [slice(i, i + BATCH) for i in range(0, len(n), BATCH)]
        parts = [self._power(n[part], torque[part], T[part]) for part in rows]
        return np.concatenate(parts).reshape(*shape, len(self.components))

    def breakdown(
        self, *, speed: ArrayLike, torque: ArrayLike, temperatures: Mapping[str, ArrayLike] | float
    ) -> dict[str, Array]:
        """Loss of every component by name, and the ``total``.

        Parameters
        ----------
        speed, torque : ArrayLike, shape (...)
            Of the input shaft, [1/min] and [N m], signed
        temperatures : mapping of node name to ArrayLike, shape (...), or float
            [degC]; one number serves all nodes

        Returns
        -------
        dict of str to Array, shape (...)
            [W]

        Raises
        ------
        InputError
            If a node is missing or unknown, or a value unphysical.

        Examples
        --------
        >>> from models.gearbox import load_gearbox
        >>> loss = load_gearbox("fzg").losses().breakdown(speed=2165.7, torque=302.0, temperatures=85.0)
        >>> bool(780.0 < loss["mesh_sliding"] < 860.0)
        True
        """
        if not isinstance(temperatures, Mapping):
            temperatures = dict.fromkeys(self.temperature_nodes, temperatures)
        unknown = [name for name in temperatures if name not in self.temperature_nodes]
        if unknown:
            hint = did_you_mean(unknown[0], self.temperature_nodes)
            raise InputError(f"{unknown[0]!r} is not a temperature of the loss model{hint}")
        missing = [name for name in self.temperature_nodes if name not in temperatures]
        if missing:
            raise InputError(f"the temperatures of {', '.join(missing)} are missing; give them in degC")
        columns = np.broadcast_arrays(*(np.asarray(temperatures[name], dtype=float) for name in self.temperature_nodes))
        power = self.power(speed, torque, np.stack(columns, axis=-1))
        return {name: power[..., i] for i, name in enumerate(self.components)} | {"total": power.sum(axis=-1)}

    def domain_distance(self, speed: ArrayLike, torque: ArrayLike, temperatures: ArrayLike) -> Array:
        """Zero: the full model has no training domain. Parameters as :meth:`power`; shape (...)."""
        return np.zeros(np.broadcast_shapes(np.shape(speed), np.shape(torque), np.shape(temperatures)[:-1]))

    def mesh_power(self, speed: Array, torque: Array, T_gears: Array) -> Array:
        """Sliding and rolling loss [W], shape (N, 2), at input speed, torque, shape (N,), and gears' bulk, (N, 2)."""
        n, slow, moment = self._floored(speed, torque)
        sliding, rolling = self.mesh.loss(omega_1=n * RPM, torque=moment, T_1=T_gears[:, 0], T_2=T_gears[:, 1])
        light = np.minimum(np.abs(torque) / TORQUE_FLOOR_NM, 1.0)
        return np.stack((sliding * light * slow, rolling * slow), axis=-1)

    def no_load_power(self, speed: Array, T_oil: Array) -> Array:
        """Churning and seal losses [W], shape (N, 1 + seals), at input speed and oil temperature, shape (N,)."""
        n, slow, _ = self._floored(speed, speed)
        parts = [self.churning.loss(n * RPM, T_oil), *(s.loss(n, T_oil) for s in self.seals)]
        return np.stack(parts, axis=-1) * slow[:, None]

    def bearing_power(self, index: int, speed: Array, torque: Array, T_oil: Array, T_bearing: Array) -> Array:
        """Loss [W] of one bearing at input speed and torque, oil and bearing temperature, all of shape (N,)."""
        return self._group_power((index,), speed, torque, T_oil, T_bearing[:, None])[:, 0]

    def bearing_radial_load(self, index: int, torque: Array) -> Array:
        """Radial load [N] of one bearing at input torque [N m], shape (N,); no own weight."""
        return np.asarray(self.bearing_load_per_torque[index] * np.abs(torque))

    def _power(self, n: Array, torque: Array, T: Array) -> Array:
        power = np.empty((len(n), len(self.components)))
        power[:, 0:2] = self.mesh_power(n, torque, T[:, 1:3])
        first_bearing = 3 + len(self.seals)
        power[:, 2:first_bearing] = self.no_load_power(n, T[:, 0])
        for group in self.bearing_groups:
            columns = [first_bearing + index for index in group]
            T_bearings = T[:, [3 + index for index in group]]
            power[:, columns] = self._group_power(group, n, torque, T[:, 0], T_bearings)
        return power

    def _group_power(self, group: tuple[int, ...], n: Array, torque: Array, T_oil: Array, T_bearings: Array) -> Array:
        """Losses [W] of bearings that are alike, shape (N, group), in one call: they differ in speed and load only."""
        speed, slow, _ = self._floored(n, torque)
        loss = self.bearings[group[0]].loss(
            n_rpm=np.stack([speed * self.bearing_speed_ratio[index] for index in group], axis=-1),
            F_r=np.stack([self.bearing_radial_load(index, torque) for index in group], axis=-1),
            T_oil=T_oil[:, None],
            T_bearing=T_bearings,
            oil=self.mesh.oil,
        )
        return loss * slow[:, None]

    @staticmethod
    def _floored(speed: Array, torque: Array) -> tuple[Array, Array, Array]:
        n = np.abs(speed)
        return (
            np.maximum(n, SPEED_FLOOR_RPM),
            np.minimum(n / SPEED_FLOOR_RPM, 1.0),
            np.maximum(np.abs(torque), TORQUE_FLOOR_NM),
        )


def _refuse_unphysical(n: Array, torque: Array, T: Array, nodes: tuple[str, ...]) -> None:
    for name, unit, values in (("speed", "1/min", n), ("torque", "N m", torque)):
        if not np.isfinite(values).all():
            row = int(np.flatnonzero(~np.isfinite(values))[0])
            raise InputError(f"{name} is {values[row]} {unit} at operating point {row}; finite numbers are needed")
    if not (np.isfinite(T).all() and T.min(initial=0.0) > -273.15):
        row, column = np.argwhere(~(np.isfinite(T) & (T > -273.15)))[0]
        raise InputError(
            f"T_{nodes[column]} is {T[row, column]} degC at operating point {row}; "
            "finite numbers above -273.15 are needed"
        )
