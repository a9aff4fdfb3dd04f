"""The plant's own nodes and heat paths, from the numbers of a gearbox definition.

Finer than the model: every housing part has an inner wall, an outer wall and the bosses that hold the bearings, every
shaft a middle and one end per bearing, every gear a rim and a body, and the oil a sump and what is in the air and on
the walls. The mesh has no node: its heat parts between the rims.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from diagnosis.proof.plant.sizes import BoxSizes
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.formulas import heat_transfer as ht
from models.losses.bearing import OIL_FLOW_HEAT, oil_flow_max

AIR, FRAME, OIL, SUMP, SPLASH, MESH = "air", "frame", "oil", "sump", "splash", "mesh"
BOUNDARY_CAPACITY = 1e15  # J/K: a boundary is a node that nothing warms
QUARTER = 0.25  # of the wall lies before the inner and behind the outer node
BOSS_SHARE, BOSS_CONDUCTANCE = 0.2, 0.35  # of the housing's mass; of the wall's conductance, to either face
SPLASH_SHARE, RIM_SHARE, MIDDLE_SHARE = 0.25, 0.45, 0.4  # of the capacities of oil, gear and shaft
SPLASH_EXCHANGE = 8.0  # conductance between sump and splash over that between oil and housing, at the reference speed
RIM_TO_BODY = 0.15  # of the tooth's height plus the ring: path between their centres over the ring's thickness


@dataclass(frozen=True, kw_only=True)
class PlantPath:
    """A heat path of the plant.

    Attributes
    ----------
    name : str
        Path of the coarse network that it is a part of, e.g. ``oil-housing_lower``
    ends : (str, str)
        Nodes of the plant
    conductance : float
        At the reference point, [W/K]
    factor : str or None
        The definition's tunable factor that it takes
    law : str
        How it depends on the operating point: ``fixed``, ``oil``, ``air``, ``teeth_0`` and ``faces_0`` (of gear 0),
        ``exchange``, ``mesh``
    """

    name: str
    ends: tuple[str, str]
    conductance: float
    factor: str | None
    law: str = "fixed"


class PlantAnatomy:
    """Nodes, capacities and paths of one gearbox."""

    def __init__(self, gearbox: Gearbox) -> None:
        self.gearbox, self.sizes = gearbox, BoxSizes(gearbox)
        self.stage, self.pair = gearbox.stage[0], self.sizes.pair
        self.parts = tuple(part.name for part in gearbox.housing.part)
        self.bearings = tuple(bearing.name for bearing in gearbox.bearing)
        self.gears = self.sizes.gears
        self.shafts = tuple(shaft.name for shaft in gearbox.shaft)
        self.capacities: dict[str, tuple[float, str | None]] = dict(self._capacities())
        self.nodes = tuple(self.capacities)
        self.index = {name: i for i, name in enumerate(self.nodes)}
        self.boundary = (self.index[AIR], self.index[FRAME])
        self.paths = tuple(self._paths())

    @cached_property
    def coarse(self) -> tuple[str, ...]:
        """Places that a sensor or an effect may name, the nodes of the usual network without the mesh."""
        return (*self.parts, OIL, *self.bearings, *self.shafts, *self.gears)

    def members(self, place: str) -> dict[str, float]:
        """Nodes that make up a place and the weight of each, the mean that a sensor there reads."""
        if place in self.parts:
            return {f"{place}.inner": 0.5, f"{place}.outer": 0.5}
        if place == OIL:
            return {SUMP: 1.0}
        if place in self.gears:
            return {f"{place}.rim": 0.5, f"{place}.body": 0.5}
        if place in self.shafts:
            return {f"{place}.middle": 1.0}
        return {place: 1.0}

    @cached_property
    def reading(self) -> Array:
        """Weights of the nodes in what a sensor at every coarse place reads, shape (places, nodes)."""
        weights = np.zeros((len(self.coarse), len(self.nodes)))
        for row, place in enumerate(self.coarse):
            for node, weight in self.members(place).items():
                weights[row, self.index[node]] = weight
        return weights

    # ------------------------------------------------------------------ capacities

    def _capacities(self) -> Iterator[tuple[str, tuple[float, str | None]]]:
        sizes = self.sizes
        yield AIR, (BOUNDARY_CAPACITY, None)
        yield FRAME, (BOUNDARY_CAPACITY, None)
        for part in self.gearbox.housing.part:
            for layer, share in (("inner", 0.4), ("outer", 0.4), ("boss", BOSS_SHARE)):
                yield f"{part.name}.{layer}", (sizes.C_housing * part.area_fraction * share, f"C_{part.name}")
        yield SUMP, (sizes.C_oil * (1.0 - SPLASH_SHARE), "C_oil")
        yield SPLASH, (sizes.C_oil * SPLASH_SHARE, "C_oil")
        for name in self.bearings:
            yield name, (sizes.C_bearing(name), "C_bearings")
        for name in self.shafts:
            whole, ends = sizes.C_shaft(name), sizes.bearings(name)
            middle = MIDDLE_SHARE if ends else 1.0
            yield f"{name}.middle", (whole * middle, "C_shafts")
            for end in ends:
                yield f"{name}.{end}", (whole * (1.0 - middle) / len(ends), "C_shafts")
        for i, gear in enumerate(self.gears):
            yield f"{gear}.rim", (sizes.C_gear(i) * RIM_SHARE, "C_gears")
            yield f"{gear}.body", (sizes.C_gear(i) * (1.0 - RIM_SHARE), "C_gears")

    # ------------------------------------------------------------------ paths

    def _paths(self) -> Iterator[PlantPath]:
        yield from self._housing_paths()
        yield from self._gear_paths()
        yield from self._shaft_and_bearing_paths()

    def _housing_paths(self) -> Iterator[PlantPath]:
        housing = self.gearbox.housing
        wetted = 0.0
        for index, part in enumerate(housing.part):
            name, share = part.name, part.area_fraction
            wall = housing.conductivity_W_mK * self.sizes.wall_area * share / housing.wall_thickness_m
            film = housing.oil_heat_transfer_W_m2K * housing.inside_area_m2 * share
            wetted += film
            # The lowest part is wetted by the sump, the others by what the gears throw.
            yield PlantPath(name=f"oil-{name}", ends=(SPLASH if index else SUMP, f"{name}.inner"),
                       conductance=film, factor="h_oil_housing", law="oil")  # fmt: skip
            through = wall / (1.0 - 2.0 * QUARTER)
            yield PlantPath(
                name=f"wall-{name}", ends=(f"{name}.inner", f"{name}.outer"), conductance=through, factor=None
            )
            for face in ("inner", "outer"):
                yield PlantPath(name=f"boss-{name}", ends=(f"{name}.boss", f"{name}.{face}"),
                           conductance=BOSS_CONDUCTANCE * through, factor=None)  # fmt: skip
            yield PlantPath(name=f"{name}-{AIR}", ends=(f"{name}.outer", AIR),
                       conductance=housing.outside_area_m2 * share, factor=None, law="air")  # fmt: skip
        for above, below in zip(self.parts[1:], self.parts[:-1], strict=True):
            for face in ("inner", "outer"):
                yield PlantPath(name=f"{below}-{above}", ends=(f"{below}.{face}", f"{above}.{face}"),
                           conductance=0.5 * housing.joint_conductance_W_K, factor="housing_joint")  # fmt: skip
        standing = [part.name for part in housing.part if part.foundation]
        for name in standing:
            yield PlantPath(name=f"{name}-{FRAME}", ends=(f"{name}.outer", FRAME),
                       conductance=housing.foundation_conductance_W_K / len(standing), factor=None)  # fmt: skip
        yield PlantPath(name="sump-splash", ends=(SUMP, SPLASH), conductance=SPLASH_EXCHANGE * wetted, factor=None,
                   law="exchange")  # fmt: skip

    def _gear_paths(self) -> Iterator[PlantPath]:
        b, k = self.pair.b, self.stage.material.conductivity_W_mK
        for i, gear in enumerate(self.gears):
            yield PlantPath(name=f"{gear}-oil", ends=(f"{gear}.rim", SPLASH), conductance=1.0, factor="h_oil_gear",
                       law=f"teeth_{i}")  # fmt: skip
            yield PlantPath(name=f"{gear}-oil", ends=(f"{gear}.body", SUMP), conductance=1.0, factor="h_oil_gear",
                       law=f"faces_{i}")  # fmt: skip
            shaft = self.sizes.shafts[i]
            ring = 2.0 * np.pi * k * b / np.log(self.pair.r[i] / (0.5 * self.sizes.shaft(shaft).diameter))
            yield PlantPath(name=f"rim-{gear}", ends=(f"{gear}.rim", f"{gear}.body"), conductance=ring / RIM_TO_BODY,
                       factor=None)  # fmt: skip
            # What the rim adds to the way from the flank to the shaft is taken off the ring.
            yield PlantPath(name=f"{gear}-{shaft}", ends=(f"{gear}.body", f"{shaft}.middle"),
                       conductance=ring / (1.0 - 0.5 * RIM_TO_BODY), factor="gear_shaft")  # fmt: skip
        rims = f"{self.gears[0]}.rim", f"{self.gears[1]}.rim"
        yield PlantPath(name=MESH, ends=rims, conductance=1.0, factor="striction", law="mesh")

    def _shaft_and_bearing_paths(self) -> Iterator[PlantPath]:
        for shaft in self.gearbox.shaft:
            section = shaft.conductivity_W_mK * np.pi / 4.0 * shaft.diameter**2
            along, seat = 0.15 * shaft.length / section, 0.10 * shaft.length / section
            for seated in self.sizes.bearings(shaft.name):
                end, name = f"{shaft.name}.{seated}", f"{shaft.name}-{seated}"
                ring = 0.5 * self.sizes.R_bearing(seated)
                yield PlantPath(name=name, ends=(f"{shaft.name}.middle", end), conductance=1.0 / along,
                           factor="shaft_bearing")  # fmt: skip
                yield PlantPath(name=name, ends=(end, seated), conductance=1.0 / (seat + ring), factor="shaft_bearing")
        for bearing in self.gearbox.bearing:
            outer = 2.0 / self.sizes.R_bearing(bearing.name)
            for part in self.parts:
                yield PlantPath(name=f"{bearing.name}-{part}", ends=(bearing.name, f"{part}.boss"),
                           conductance=outer / len(self.parts), factor="bearing_housing")  # fmt: skip
            through = OIL_FLOW_HEAT * oil_flow_max(bearing.outside_diameter_mm, bearing.width_mm)
            for oil in (SUMP, SPLASH):
                yield PlantPath(name=f"{bearing.name}-oil", ends=(bearing.name, oil), conductance=0.5 * through,
                           factor="bearing_oil")  # fmt: skip

    # ------------------------------------------------------------------ reference values of the laws

    @cached_property
    def half_wall(self) -> float:
        """Resistance of the wall before the inner node, area of the whole box, [K/W]."""
        return QUARTER * self.sizes.R_wall

    @cached_property
    def share(self) -> dict[str, float]:
        """Share of every housing part in the box's area."""
        return {part.name: part.area_fraction for part in self.gearbox.housing.part}

    @cached_property
    def convection(self) -> tuple[float, float]:
        """Forced and free heat transfer to air at the definition's air speed, 60 and 27 degC, [W/(m2 K)].

        Free: ``1.42 (dT / H)^0.25`` of a vertical wall (Holman, "Heat Transfer", simplified equations; from memory).
        Forced: the remainder of the definition's own correlation.
        """
        housing, v_air = self.gearbox.housing, self.gearbox.ambient.air_speed_m_s
        T, T_a, length = 60.0, 27.0, housing.height_m
        if housing.convection == "iso_14179":
            whole = ht.convection_iso_14179(v_air=v_air, T=T, T_a=T_a, length=length)
        elif housing.convection == "flat_plate":
            whole = ht.convection_flat_plate(v_air=v_air, T=T, T_a=T_a, length=length)
        elif housing.convection == "iso_14179_free":
            return 0.0, float(ht.convection_iso_14179_free(T=T, T_a=T_a, length=length))
        else:
            return 0.0, float(ht.convection_churchill_chu(T=T, T_a=T_a, length=length))
        free = min(1.42 * ((T - T_a) / length) ** 0.25, 0.8 * float(whole))
        return float((float(whole) ** 3 - free**3) ** (1.0 / 3.0)), free
