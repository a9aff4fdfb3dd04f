"""From a gearbox definition to its thermal network: which nodes there are, what links them, where the losses go.

Boundaries: air and frame (ambient temperature). Parts, in order: housing parts, oil, bearings, shafts, gears, meshes.
The structure is the 14-element network of Durand de Gevigney et al. that the paper follows (section 5, fig. 9); the
laws are those of :mod:`models.formulas.heat_transfer`, with the numbers of the definition and the tunable factors as
parameters.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import sympy as sp

from models.assembly.gearbox_definition import Definition
from models.assembly.table_builder import with_tables
from models.definition.bearing_section import Bearing
from models.definition.sections import Shaft, Stage
from models.formulas import heat_transfer as ht
from models.formulas.ehl import reduced_modulus
from models.formulas.extremes import Max, Min
from models.formulas.geometry import GearPair
from models.formulas.oil import (
    T_HIGHEST,
    T_LOWEST,
    conductivity_cragoe,
    density_linear,
    kinematic_viscosity_d341,
    specific_heat_cragoe,
)
from models.losses.bearing import OIL_FLOW_HEAT, oil_flow_max
from models.losses.loss_model import LossModel, loss_factors
from models.losses.loss_term import MESH, OIL, SPEED_FLOOR_RPM, TORQUE_FLOOR_NM
from models.network.laws import Parameter, symbol
from models.portable.evaluation import RPM
from models.simulation.thermal_network import Link, Node, Source, ThermalNetwork

AIR, FRAME = "air", "frame"
T_SERVICE = 60.0  # degC, where the oil's heat capacity is taken (constant: it varies by 5 % over the service range)
MESH_CAPACITY = 2.0  # J/K, replaces a node without mass: 0.1 s is far below every other time constant
DEFAULT_FACTOR_SD = 0.2
FACTOR_TEXT = {
    **loss_factors(),
    "h_air": "convection from the housing to air",
    "radiation": "radiation from the housing",
    "h_oil_housing": "convection from oil to housing",
    "h_oil_gear": "convection from gears to oil",
    "gear_shaft": "conduction from gears to shafts",
    "shaft_bearing": "conduction from shafts to bearings",
    "bearing_housing": "conduction from bearings to housing",
    "bearing_oil": "through-flow of oil in the bearings",
    "housing_joint": "conduction between housing parts",
    "striction": "conduction from the contact into the gears",
}


def build_network(gearbox: Definition, priors: Mapping[str, float]) -> ThermalNetwork:
    """Return the thermal network of a gearbox.

    Parameters
    ----------
    priors : mapping of str to float
        Standard deviations by dotted path

    Returns
    -------
    ThermalNetwork
        With the tunable factors of the definition as parameters, ``T_ambient`` and ``air_speed`` as inputs, the groups
        ``housing``, ``bearings``, ``shafts`` and ``gears``, and the added inputs, nodes, links and heats of the file

    References
    ----------
    Changenet, Oviedo-Marlot, Velex, J. Mech. Des. 128 (2006); Durand de Gevigney, Changenet, Ville, Velex, Mech. Mach.
    Theory 67 (2013). Layout from memory; Table 5 of the paper for the FZG values.
    """
    return with_tables(_Builder(gearbox, priors).network(), gearbox, priors)


def joined_already(gearbox: Definition) -> list[tuple[str, str]]:
    """Return ``[[link]]`` between nodes that the geometry joins, as dotted path (none) and message."""
    own = {frozenset(link.nodes) for link in _Builder(gearbox, {}).links()} if gearbox.link else set()
    faults = []
    for number, link in enumerate(gearbox.link, start=1):
        if frozenset(link.between) in own:
            known = "foundation_conductance_W_K of [housing] is" if FRAME in link.between else "[factors] scales"
            pair = " and ".join(link.between)
            faults.append(("", f"link #{number}.between: {pair} are joined by the geometry already; {known} that path"))
    return faults


class _Builder:
    """The definition at hand while its network is put together."""

    def __init__(self, gearbox: Definition, priors: Mapping[str, float]) -> None:
        self.gearbox, self.priors = gearbox, priors
        self.gears = tuple(_gears(gearbox))
        self.losses = LossModel.from_definition(gearbox)
        self.overrides = {node.name: node.heat_capacity_J_K for node in gearbox.node}
        self.housing_parts = tuple(part.name for part in gearbox.housing.part)
        self.speed = sp.Abs(symbol("speed"))

    def network(self) -> ThermalNetwork:
        gearbox = self.gearbox
        return ThermalNetwork(
            nodes=tuple(self.nodes()),
            links=tuple(self.links()),
            sources=tuple(self.sources()),
            parameters=tuple(self.parameters()),
            components=self.losses.components,
            inputs=gearbox.inputs,
            groups={
                "housing": self.housing_parts,
                "bearings": tuple(bearing.name for bearing in gearbox.bearing),
                "shafts": tuple(shaft.name for shaft in gearbox.shaft),
                "gears": tuple(gear.name for gear in self.gears),
            }
            | ({MESH: gearbox.mesh_names} if len(gearbox.stage) > 1 else {}),
        )

    # ------------------------------------------------------------------ parameters, nodes, sources

    def parameters(self) -> Iterator[Parameter]:
        for name, value in self.gearbox.all_factors.items():
            text = FACTOR_TEXT.get(name, f"heat capacity of {name.removeprefix('C_')}")
            sd = self.priors.get(f"factors.{name}", DEFAULT_FACTOR_SD)
            yield Parameter(
                name=name,
                start=value,
                lower=value / 20.0,
                upper=value * 20.0,
                sd=sd,
                description=f"factor on the {text}",
            )

    def nodes(self) -> Iterator[Node]:
        housing, oil = self.gearbox.housing, self.gearbox.lubricant()
        ambient = symbol("T_ambient")
        yield Node(name=AIR, temperature=ambient)
        yield Node(name=FRAME, temperature=ambient)
        wall = 0.5 * (housing.inside_area_m2 + housing.outside_area_m2) * housing.wall_thickness_m
        wall_capacity = wall * housing.density_kg_m3 * housing.specific_heat_J_kgK
        for part in housing.part:
            yield self._part(part.name, wall_capacity * part.area_fraction, f"C_{part.name}")
        filling = self.gearbox.oil.volume * float(oil.density(T_SERVICE) * oil.specific_heat(T_SERVICE))
        yield self._part(OIL, filling, "C_oil")
        steel = self.gearbox.stage[0].material
        for bearing in self.gearbox.bearing:
            yield self._part(bearing.name, bearing.mass_kg * steel.specific_heat_J_kgK, "C_bearings")
        per_volume = steel.density_kg_m3 * steel.specific_heat_J_kgK
        for shaft in self.gearbox.shaft:
            own = shaft.heat_capacity_J_K
            cylinder = per_volume * np.pi / 4.0 * shaft.diameter**2 * shaft.length
            yield self._part(shaft.name, cylinder if own is None else own, "C_shafts")
        for gear in self.gears:
            ring = np.pi * (gear.r**2 - self._shaft_radius(gear) ** 2) * gear.pair.b
            yield self._part(gear.name, gear.heat_per_volume * ring, "C_gears")
        for mesh in self.gearbox.mesh_names:
            yield self._part(mesh, MESH_CAPACITY, None)

    def _part(self, name: str, capacity: float, factor: str | None) -> Node:
        value = sp.Float(self.overrides.get(name, capacity))
        return Node(name=name, capacity=value if factor is None else value * symbol(factor))

    def sources(self) -> Iterator[Source]:
        for term in self.losses.terms:
            for component, factor in zip(term.components, term.kind.factors, strict=True):
                heat = symbol(factor) * symbol(f"P_{component}")
                yield Source(name=component, node=term.node, heat=heat, is_loss=True)

    # ------------------------------------------------------------------ links

    def links(self) -> Iterator[Link]:
        yield from self._housing_links()
        yield from self._gear_links()
        yield from self._shaft_links()
        yield from self._bearing_links()

    @staticmethod
    def _link(a: str, b: str, conductance: sp.Expr | float) -> Link:
        return Link(name=f"{a}-{b}", nodes=(a, b), conductance=sp.sympify(conductance))

    def _housing_links(self) -> Iterator[Link]:
        housing = self.gearbox.housing
        mean_area = 0.5 * (housing.inside_area_m2 + housing.outside_area_m2)
        half_wall = 0.5 * housing.wall_thickness_m / (housing.conductivity_W_mK * mean_area)
        for part in housing.part:
            share = part.area_fraction
            inner = symbol("h_oil_housing") * housing.oil_heat_transfer_W_m2K * housing.inside_area_m2 * share
            yield self._link(OIL, part.name, ht.series(1 / inner, half_wall / share))
        for part in housing.part:
            share = part.area_fraction
            T, T_a = symbol(f"T_{part.name}"), symbol(f"T_{AIR}")
            h = symbol("h_air") * self._convection(T, T_a)
            h += symbol("radiation") * ht.radiation(T=T, T_a=T_a, emissivity=housing.emissivity)
            surface = h * housing.outside_area_m2 * share
            # Not as a sum of resistances: without radiation and temperature difference the surface conducts nothing.
            yield self._link(part.name, AIR, surface / (1.0 + surface * half_wall / share))
        for upper, lower in zip(self.housing_parts[1:], self.housing_parts[:-1], strict=True):
            yield self._link(lower, upper, symbol("housing_joint") * housing.joint_conductance_W_K)
        standing = [part for part in housing.part if part.foundation]
        for part in standing:
            yield self._link(part.name, FRAME, housing.foundation_conductance_W_K / len(standing))

    def _convection(self, T: sp.Expr, T_a: sp.Expr) -> sp.Expr:
        housing, v_air = self.gearbox.housing, symbol("air_speed")
        length = housing.height_m
        if housing.convection == "iso_14179":
            return ht.convection_iso_14179(v_air=v_air, T=T, T_a=T_a, length=length)
        if housing.convection == "flat_plate":
            return ht.convection_flat_plate(v_air=v_air, T=T, T_a=T_a, length=length)
        if housing.convection == "iso_14179_free":
            return ht.convection_iso_14179_free(T=T, T_a=T_a, length=length)
        return ht.convection_churchill_chu(T=T, T_a=T_a, length=length)

    def _gear_links(self) -> Iterator[Link]:
        for gear in self.gears:
            yield self._link(gear.name, OIL, symbol("h_oil_gear") * self._gear_to_oil(gear))
        for gear in self.gears:
            k = gear.stage.material.conductivity_W_mK
            ring = 2.0 * np.pi * k * gear.pair.b / np.log(gear.r / self._shaft_radius(gear))
            yield self._link(gear.name, gear.shaft, symbol("gear_shaft") * ring)
        for mesh, stage in zip(self.gearbox.mesh_names, self.gearbox.stage, strict=True):
            for name in stage.names:
                yield self._link(mesh, name, symbol("striction") * self._striction(stage))

    def _gear_to_oil(self, gear: _Gear) -> sp.Expr:
        """Immersed faces as a rotating disk, teeth by fling-off; oil properties at sump temperature.

        The immersed fraction is the tip circle's, the area the reference circle's: half of the ring outside it is gap.
        The tip circle's area gives 11.5 and 18.1 in place of 10.4 and 16.3 W/K (FZG, 8.3 m/s, 77.7 degC); metal alone
        gives 10.0 and 16.0.
        """
        oil, pair, index = self.gearbox.lubricant(), gear.pair, gear.index
        T = Min(Max(symbol(f"T_{OIL}"), T_LOWEST), T_HIGHEST)  # as the losses do
        nu = kinematic_viscosity_d341(T, oil.m, oil.n, xp=sp) * 1e-6
        rho = density_linear(T, oil.rho_ref, oil.T_ref, oil.expansion)
        c = specific_heat_cragoe(T, oil.rho_15) if oil.specific_heat_constant is None else oil.specific_heat_constant
        k = conductivity_cragoe(T, oil.rho_15) if oil.conductivity_constant is None else oil.conductivity_constant
        prandtl = nu * rho * c / k
        omega = self.speed * RPM * (self.gearbox.speed_ratio[gear.stage.driver] / (1.0 if index == 0 else pair.u))
        r_a, r, height = pair.r_a[index], gear.r, pair.r_a[index] - pair.r_f[index]
        theta = np.arccos(np.clip(self.gearbox.level_below_axis[gear.shaft] / r_a, -1.0, 1.0))
        immersed = (2.0 * theta - np.sin(2.0 * theta)) / (2.0 * np.pi)
        disk = ht.rotating_disk(omega=omega, radius=r, nu=nu, k=k, prandtl=prandtl)
        teeth = ht.fling_off(omega=omega, radius=r, tooth_height=height, rho=rho, c=c, k=k, prandtl=prandtl)
        # Half of the flanks is taken to carry oil; a gear that does not reach the sump is wetted through the mesh.
        return disk * 2.0 * np.pi * r**2 * immersed + teeth * pair.z[index] * height * pair.b

    def _striction(self, stage: Stage) -> sp.Expr:
        """Inverse of the mean rise under a fast band source at the pitch point, the law of the flash temperature."""
        steel, pair = stage.material, stage.pair()
        torque = Max(sp.Abs(symbol("torque")), TORQUE_FLOOR_NM)
        arm = pair.r_b[0] / self.gearbox.torque_ratio[stage.driver]  # tooth force = torque of the input shaft / arm
        omega = Max(self.speed, SPEED_FLOOR_RPM) * (RPM * self.gearbox.speed_ratio[stage.driver])
        E_red = reduced_modulus(steel.youngs_modulus, steel.poisson, steel.youngs_modulus, steel.poisson)
        b_H = sp.sqrt(8.0 * torque / (arm * pair.b) * pair.rho_red_C / (np.pi * E_red))
        line, across = pair.b / np.cos(pair.beta_b), pair.T1C * np.cos(pair.beta_b)
        k, chi = steel.conductivity_W_mK, steel.conductivity_W_mK / (steel.density_kg_m3 * steel.specific_heat_J_kgK)
        return 2.0 * b_H * line * k / 1.06 * sp.sqrt(omega * across / (chi * b_H))

    def _shaft_links(self) -> Iterator[Link]:
        for shaft in self.gearbox.shaft:
            if shaft.length_in_air:
                yield self._link(shaft.name, AIR, self._shaft_to_air(shaft))
            for bearing in self.gearbox.bearing:
                if bearing.shaft == shaft.name:
                    section = shaft.conductivity_W_mK * np.pi / 4.0 * shaft.diameter**2
                    path = 0.25 * shaft.length / section + 0.5 * self._ring(bearing)
                    yield self._link(shaft.name, bearing.name, symbol("shaft_bearing") / path)

    def _shaft_to_air(self, shaft: Shaft) -> sp.Expr:
        """A rotating cylinder in air, ``Nu = 0.133 Re^(2/3) Pr^(1/3)`` (Becker 1963), at rest 5 W/(m2 K)."""
        T_a = symbol(f"T_{AIR}")
        nu, k = ht.air_kinematic_viscosity(T_a), ht.air_conductivity(T_a)
        omega = self.speed * RPM * self.gearbox.speed_ratio[shaft.name]
        Re = omega * shaft.diameter**2 / (2.0 * nu)
        h = 0.133 * Re ** sp.Float(2 / 3) * ht.PRANDTL_AIR ** (1 / 3) * k / shaft.diameter
        return Max(h, 5.0) * np.pi * shaft.diameter * shaft.length_in_air

    def _bearing_links(self) -> Iterator[Link]:
        for bearing in self.gearbox.bearing:
            outer = 1.0 / (0.5 * self._ring(bearing))
            for part in self.housing_parts:
                conductance = symbol("bearing_housing") * outer / len(self.housing_parts)
                yield self._link(bearing.name, part, conductance)
            through = OIL_FLOW_HEAT * oil_flow_max(bearing.outside_diameter_mm, bearing.width_mm)
            yield self._link(bearing.name, OIL, symbol("bearing_oil") * through)

    def _ring(self, bearing: Bearing) -> float:
        """Radial resistance of a bearing taken as a solid steel ring, [K/W]."""
        k = self.gearbox.stage[0].material.conductivity_W_mK
        ratio = bearing.outside_diameter_mm / bearing.bore_mm
        return float(np.log(ratio) / (2.0 * np.pi * k * bearing.width_mm * 1e-3))

    def _shaft_radius(self, gear: _Gear) -> float:
        shaft = next(s for s in self.gearbox.shaft if s.name == gear.shaft)
        return 0.5 * shaft.diameter


@dataclass(frozen=True, kw_only=True)
class _Gear:
    """One gear of a stage; `index` is 0 of the driver's, 1 of the other one."""

    name: str
    shaft: str
    stage: Stage
    pair: GearPair
    index: int

    @property
    def r(self) -> float:
        """Reference radius, [m]."""
        return self.pair.r[self.index]

    @property
    def heat_per_volume(self) -> float:
        """Heat capacity of its steel, [J/(m3 K)]."""
        return self.stage.material.density_kg_m3 * self.stage.material.specific_heat_J_kgK


def _gears(gearbox: Definition) -> Iterator[_Gear]:
    for stage in gearbox.stage:
        pair = stage.pair()
        for index, (name, shaft) in enumerate(zip(stage.names, stage.shafts, strict=True)):
            yield _Gear(name=name, shaft=shaft, stage=stage, pair=pair, index=index)
