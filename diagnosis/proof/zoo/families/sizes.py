"""Numbers of a one-stage gearbox that its definition gives: areas, masses, radii, depths, but no law of losses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from diagnosis.proof.plant.anatomy import T_SERVICE
from diagnosis.proof.plant.cycles import reference_torque, top_speed
from diagnosis.proof.plant.plant import REFERENCE_SPEED
from diagnosis.proof.zoo.families.losses import RPM, Dip, Roller
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.base.types import Array
from models.definition.sections import Bearing, Shaft
from models.formulas.ehl import reduced_modulus
from models.formulas.geometry import GearPair


def refuse_unsplit(gearbox: Gearbox) -> None:
    """Raise InputError for a definition that no family of gearboxes splits."""
    if gearbox.is_parametric:
        raise InputError(
            f"{gearbox.file}: has no geometry; this family splits gearboxes with teeth, shafts and bearings: name a "
            "family for definitions without geometry"
        )
    if len(gearbox.stage) != 1:
        raise InputError(
            f"{gearbox.file}: has {len(gearbox.stage)} stages; the zoo splits gearboxes of one stage and definitions "
            "without geometry: give one of these"
        )


@dataclass(frozen=True)
class Sizes:
    """Sizes of one gearbox.

    Parameters
    ----------
    gearbox : Gearbox
        With geometry, of one stage
    """

    gearbox: Gearbox

    @cached_property
    def pair(self) -> GearPair:
        """Geometry of the gear pair."""
        return self.gearbox.stage[0].pair()

    @cached_property
    def steel_per_volume(self) -> float:
        """Heat capacity of steel, [J/(m^3 K)]."""
        steel = self.gearbox.stage[0].material
        return steel.density_kg_m3 * steel.specific_heat_J_kgK

    @property
    def k_steel(self) -> float:
        """Conductivity of steel, [W/(m K)]."""
        return self.gearbox.stage[0].material.conductivity_W_mK

    @cached_property
    def E_red(self) -> float:
        """Reduced modulus of the flanks, [Pa]."""
        steel = self.gearbox.stage[0].material
        return reduced_modulus(steel.youngs_modulus, steel.poisson, steel.youngs_modulus, steel.poisson)

    @property
    def gears(self) -> tuple[str, str]:
        """Names of the gears."""
        return self.gearbox.stage[0].names

    @property
    def shafts(self) -> tuple[str, str]:
        """Names of the driving and the driven shaft."""
        return self.gearbox.stage[0].driver, self.gearbox.stage[0].driven

    @cached_property
    def reference(self) -> tuple[float, float]:
        """Speed [1/min] and torque [N m] of the programmes where a machine is compared with the next."""
        return REFERENCE_SPEED * top_speed(self.gearbox), reference_torque(self.gearbox)

    def shaft(self, name: str) -> Shaft:
        """Section of a shaft."""
        return next(shaft for shaft in self.gearbox.shaft if shaft.name == name)

    def bearing(self, name: str) -> Bearing:
        """Section of a bearing."""
        return next(bearing for bearing in self.gearbox.bearing if bearing.name == name)

    def bearings(self, shaft: str) -> list[str]:
        """Bearings of a shaft."""
        return [bearing.name for bearing in self.gearbox.bearing if bearing.shaft == shaft]

    # ------------------------------------------------------------------ capacities, [J/K]

    @cached_property
    def C_housing(self) -> float:
        """Heat capacity of all walls."""
        housing = self.gearbox.housing
        area = 0.5 * (housing.inside_area_m2 + housing.outside_area_m2)
        return area * housing.wall_thickness_m * housing.density_kg_m3 * housing.specific_heat_J_kgK

    @cached_property
    def C_oil(self) -> float:
        """Heat capacity of the filling."""
        oil = self.gearbox.lubricant()
        return self.gearbox.oil.volume * float(oil.density(T_SERVICE) * oil.specific_heat(T_SERVICE))

    def C_gear(self, i: int) -> float:
        """Heat capacity of a gear, a ring up to the pitch circle."""
        bore = 0.5 * self.shaft(self.shafts[i]).diameter
        return float(np.pi * (self.pair.r[i] ** 2 - bore**2) * self.pair.b * self.steel_per_volume)

    def C_shaft(self, name: str) -> float:
        """Heat capacity of a shaft, a cylinder."""
        shaft = self.shaft(name)
        cylinder = self.steel_per_volume * np.pi / 4.0 * shaft.diameter**2 * shaft.length
        return float(shaft.heat_capacity_J_K or cylinder)

    def C_bearing(self, name: str) -> float:
        """Heat capacity of a bearing."""
        return float(self.bearing(name).mass_kg * self.gearbox.stage[0].material.specific_heat_J_kgK)

    # ------------------------------------------------------------------ resistances, [K/W]

    @cached_property
    def R_wall(self) -> float:
        """Resistance of the whole wall, from face to face."""
        housing = self.gearbox.housing
        area = 0.5 * (housing.inside_area_m2 + housing.outside_area_m2)
        return housing.wall_thickness_m / (housing.conductivity_W_mK * area)

    def R_gear(self, i: int) -> float:
        """Resistance of a gear between shaft and pitch circle."""
        bore = 0.5 * self.shaft(self.shafts[i]).diameter
        return float(np.log(self.pair.r[i] / bore) / (2.0 * np.pi * self.k_steel * self.pair.b))

    def R_shaft(self, name: str) -> float:
        """Resistance of a whole shaft along its length."""
        shaft = self.shaft(name)
        return float(shaft.length / (shaft.conductivity_W_mK * np.pi / 4.0 * shaft.diameter**2))

    def R_bearing(self, name: str) -> float:
        """Resistance of a bearing, a solid ring."""
        bearing = self.bearing(name)
        ratio = bearing.outside_diameter_mm / bearing.bore_mm
        return float(np.log(ratio) / (2.0 * np.pi * self.k_steel * bearing.width_mm * 1e-3))

    # ------------------------------------------------------------------ for loss formulas

    def dip(self, i: int) -> Dip:
        """A gear in the oil."""
        pair, oil = self.pair, self.gearbox.oil
        return Dip(
            h=pair.r_w[i] - oil.level_below_axis,
            r=pair.r_w[i],
            b=pair.b,
            m=pair.m_n,
            z=pair.z[i],
            tooth_height=pair.r_a[i] - pair.r_f[i],
            alpha=pair.alpha_wt,
            volume=oil.volume,
        )

    @cached_property
    def tips_under_oil(self) -> tuple[float, float]:
        """Depths of the tips of both gears, [m]."""
        level = self.gearbox.oil.level_below_axis
        return self.pair.r_a[0] - level, self.pair.r_a[1] - level

    def roller(self, name: str) -> Roller:
        """A bearing."""
        b = self.bearing(name)
        return Roller(
            d_m=0.5 * (b.bore_mm + b.outside_diameter_mm),
            bore=b.bore_mm,
            outside=b.outside_diameter_mm,
            width=b.width_mm,
        )

    def ratio(self, shaft: str) -> float:
        """Speed of a shaft over that of the input."""
        return self.gearbox.speed_ratio[shaft]

    def through_flow(self, name: str) -> float:
        """Most heat that oil takes through a bearing, ``27 D B / 12500``, [W/K] (ISO/TR 14179-2, read in the paper)."""
        b = self.bearing(name)
        return 27.0 * b.outside_diameter_mm * b.width_mm / 12500.0

    def nominal_links(self) -> Iterator[str]:
        """Names of the links in the nominal network of the definition."""
        parts = [part.name for part in self.gearbox.housing.part]
        for part in self.gearbox.housing.part:
            yield from (f"oil-{part.name}", f"{part.name}-air")
            if part.foundation:
                yield f"{part.name}-frame"
        yield from (f"{below}-{above}" for below, above in pairwise(parts))
        for gear, shaft in zip(self.gears, self.shafts, strict=True):
            yield from (f"{gear}-oil", f"{gear}-{shaft}", f"mesh-{gear}")
        yield from (f"{shaft.name}-air" for shaft in self.gearbox.shaft if shaft.length_in_air)
        for bearing in self.gearbox.bearing:
            yield f"{bearing.shaft}-{bearing.name}"
            yield from (f"{bearing.name}-{part}" for part in parts)
            yield f"{bearing.name}-oil"

    def omega(self, n: Array, i: int) -> Array:
        """Speed of a gear, [rad/s], from that of the input, [1/min]."""
        return np.asarray(n * RPM / (1.0 if i == 0 else self.pair.u))
