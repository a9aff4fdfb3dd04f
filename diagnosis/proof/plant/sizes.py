"""Heat capacities and resistances of a gearbox of one stage, from the numbers of its definition."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.definition.bearing_section import Bearing
from models.definition.sections import Shaft
from models.formulas.geometry import GearPair

ADDED = ("input", "boundary", "part", "link", "heat")  # tables that plants do not know
T_SERVICE = 60.0  # degC, where the properties of the oil are taken that plants hold constant


def refuse_unbuilt(gearbox: Gearbox) -> None:
    """Raise InputError for a definition with geometry that no plant is built of."""
    if (count := len(gearbox.stage)) > 1:
        raise InputError(
            f"{gearbox.file}: has {count} stages; concealed cases are made of gearboxes of one stage, in the zoo of "
            "definitions without geometry too: give one of these"
        )
    if any(bearing.load_share is None for bearing in gearbox.bearing):
        raise InputError(f"{gearbox.file}: has bearings with position_mm; concealed cases need their load_share")
    if added := [key for key in ADDED if getattr(gearbox.geometry, key)]:
        raise InputError(
            f"{gearbox.file}: has [[{']], [['.join(added)}]]; plants are made of teeth, shafts, bearings and housing "
            "alone: leave these tables out"
        )


@dataclass(frozen=True)
class BoxSizes:
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

    @property
    def gears(self) -> tuple[str, str]:
        """Names of the gears."""
        return self.gearbox.stage[0].names

    @property
    def shafts(self) -> tuple[str, str]:
        """Names of the driving and the driven shaft."""
        return self.gearbox.stage[0].shafts

    def shaft(self, name: str) -> Shaft:
        """Section of a shaft."""
        return next(shaft for shaft in self.gearbox.shaft if shaft.name == name)

    def bearing(self, name: str) -> Bearing:
        """Section of a bearing."""
        return next(bearing for bearing in self.gearbox.bearing if bearing.name == name)

    def bearings(self, shaft: str) -> list[str]:
        """Bearings of a shaft."""
        return [bearing.name for bearing in self.gearbox.bearing if bearing.shaft == shaft]

    @cached_property
    def wall_area(self) -> float:
        """Mean of the inner and the outer area of all walls, [m^2]."""
        return 0.5 * (self.gearbox.housing.inside_area_m2 + self.gearbox.housing.outside_area_m2)

    # ------------------------------------------------------------------ capacities, [J/K]

    @cached_property
    def C_housing(self) -> float:
        """Heat capacity of all walls."""
        housing = self.gearbox.housing
        return self.wall_area * housing.wall_thickness_m * housing.density_kg_m3 * housing.specific_heat_J_kgK

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
        return housing.wall_thickness_m / (housing.conductivity_W_mK * self.wall_area)

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
