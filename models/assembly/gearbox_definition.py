"""The whole definition of a gearbox with geometry: its tables, and what must agree between them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Annotated, Self

from pydantic import Field, model_validator

from models.base.errors import did_you_mean
from models.definition.bearing_section import Bearing
from models.definition.machine_definition import MachineDefinition
from models.definition.machine_faults import input_faults, link_faults, name_faults
from models.definition.named_oils import lubricant
from models.definition.sections import (
    Ambient,
    Housing,
    Node,
    Oil,
    OneOrMore,
    Seal,
    Shaft,
    Stage,
    Training,
)
from models.formulas.oil import Oil as Lubricant
from models.losses.loss_model import loss_components, loss_factors
from models.losses.loss_term import MESH, OIL, of_stages
from models.quantities.definition_units import between
from models.quantities.quantities import Input, usual_inputs

BOUNDARY_NODES = ("air", "frame")
FACTORS = (
    *loss_factors(), "h_air", "radiation", "h_oil_housing", "h_oil_gear", "gear_shaft",
    "shaft_bearing", "bearing_housing", "bearing_oil", "housing_joint", "striction", "C_oil", "C_bearings", "C_shafts",
    "C_gears",
)  # fmt: skip
# The model's own names next to nodes and losses: the sum of losses, FMU parameters (initial.T), an input (T_ambient),
# factors on heat capacities of groups (C_bearings).
RESERVED = (
    *BOUNDARY_NODES,
    "oil",
    "mesh",
    "T",
    *loss_components(),
    "total",
    "initial",
    "ambient",
    "bearings",
    "shafts",
    "gears",
)
SHARE_TOLERANCE = 1e-6
STEPPED = 3.0  # ratio of diameters on one shaft, and of lengths along it
WARM_DEGC = 60.0  # of all parts in full operation


class Definition(MachineDefinition):
    """The whole file of a gearbox with geometry."""

    ambient: Ambient
    oil: Oil
    shaft: OneOrMore[Shaft]
    stage: OneOrMore[Stage]
    bearing: OneOrMore[Bearing]
    seal: tuple[Seal, ...] = ()
    housing: Housing
    node: tuple[Node, ...] = ()
    factors: dict[str, Annotated[float, between(1e-3, 1e3)]] = Field(default_factory=dict)
    training: Training

    @property
    def ambient_degC(self) -> float:
        """Temperature of the surroundings where a recording names none."""
        return self.ambient.temperature_degC

    @property
    def full_operation(self) -> tuple[float, float, float]:
        """Speed [1/min] and torque [N m] at the end of ``[training]``, and the temperature of warm parts, [degC]."""
        return self.training.speed_rpm[1], self.training.torque_Nm[1], WARM_DEGC

    @property
    def own_inputs(self) -> dict[str, Input]:
        """Speed, torque, and temperature and speed of the air."""
        air = self.ambient
        return usual_inputs(speed=0.0, torque=0.0, T_ambient=air.temperature_degC, air_speed=air.air_speed_m_s)

    @property
    def own_parts(self) -> tuple[str, ...]:
        """Parts that follow from the geometry."""
        return (*_part_names(self), OIL, *self.mesh_names)

    @property
    def own_boundaries(self) -> tuple[str, ...]:
        """Air and frame."""
        return BOUNDARY_NODES

    @property
    def own_signals(self) -> tuple[str, ...]:
        """Factors and losses of the geometry."""
        return (*self.factor_names, *(f"P_{name}" for name in self.own_losses))

    @property
    def own_losses(self) -> tuple[str, ...]:
        """Names of losses: the fixed ones of every stage, bearings and seals."""
        return (
            *_numbered_losses(self),
            *(bearing.name for bearing in self.bearing),
            *(seal.name for seal in self.seal),
        )

    @property
    def all_factors(self) -> Mapping[str, float]:
        """Every tunable factor of the thermal network by name; 1 if the file does not name it."""
        return {name: self.factors.get(name, 1.0) for name in self.factor_names}

    @property
    def factor_names(self) -> tuple[str, ...]:
        """Names that ``[factors]`` may hold; every part of the housing has its heat capacity's."""
        return (*FACTORS, *(f"C_{part.name}" for part in self.housing.part))

    @property
    def speed_ratio(self) -> Mapping[str, float]:
        """Speed of every shaft over the speed of the input shaft, by shaft name, [-]."""
        ratio = {self.stage[0].driver: 1.0}
        for stage in self.stage:
            ratio[stage.driven] = ratio[stage.driver] * (stage.z[0] / stage.z[1])
        return ratio

    @property
    def torque_ratio(self) -> Mapping[str, float]:
        """Torque of every shaft without losses over the torque of the input shaft, by shaft name, [-]."""
        ratio = {self.stage[0].driver: 1.0}
        for stage in self.stage:
            ratio[stage.driven] = ratio[stage.driver] * (stage.z[1] / stage.z[0])
        return ratio

    @property
    def level_below_axis(self) -> Mapping[str, float]:
        """Oil level below the axis of every shaft, by shaft name, [m]."""
        return {shaft.name: self.oil.level_below_axis + shaft.axis_height for shaft in self.shaft}

    @property
    def mesh_names(self) -> tuple[str, ...]:
        """Thermal nodes of the meshes, in the order of the stages."""
        return of_stages(MESH, len(self.stage))

    def lubricant(self) -> Lubricant:
        """Return the oil as the loss formulas use it."""
        return lubricant(self.oil)

    @model_validator(mode="after")
    def _tables_agree(self) -> Self:
        # What follows reads the tables by their names, and then the shafts along the stages.
        faults = [*_duplicate_names(self), *_unknown_names(self), *name_faults(self), *_names_of_the_model(self)]
        faults = faults or [*_chain(self)]
        faults = faults or [
            *_load_shares(self), *_taper_pairs(self), *_axial_loads(self), *_shafts_in_gears(self),
            *_axis_heights(self), *_stations_of_shafts(self), *_places_along_shafts(self), *_gears_in_housing(self),
            *_oil_level(self), *_oil_volume(self), *input_faults(self), *link_faults(self), *_added_to_geometry(self),
        ]  # fmt: skip
        if faults:
            raise ValueError("\n".join(faults))
        return self


def _part_names(definition: Definition) -> list[str]:
    """Return the names of all parts that have a temperature, but oil and mesh."""
    return [
        *(part.name for part in definition.housing.part),
        *(bearing.name for bearing in definition.bearing),
        *(shaft.name for shaft in definition.shaft),
        *(name for stage in definition.stage for name in stage.names),
    ]


def _duplicate_names(definition: Definition) -> Iterator[str]:
    names = [*_part_names(definition), *(seal.name for seal in definition.seal)]
    for name, count in Counter(names).items():
        if count > 1:
            yield f"name '{name}' is given {count} times; every part and component needs its own"
        if name in (*RESERVED, *definition.mesh_names, *_numbered_losses(definition)):
            yield f"name '{name}' is taken by the model itself; choose another"
    for name, count in Counter(node.name for node in definition.node).items():
        if count > 1:
            yield f"node: '{name}' is overridden {count} times"


def _numbered_losses(definition: Definition) -> Iterator[str]:
    for component in loss_components():
        yield from of_stages(component, len(definition.stage))


def _unknown_names(definition: Definition) -> Iterator[str]:
    shafts = [shaft.name for shaft in definition.shaft]
    references = [("stage.driver", stage.driver) for stage in definition.stage]
    references += [("stage.driven", stage.driven) for stage in definition.stage]
    references += [(f"bearing '{bearing.name}'.shaft", bearing.shaft) for bearing in definition.bearing]
    references += [(f"seal '{seal.name}'.shaft", seal.shaft) for seal in definition.seal]
    for place, name in references:
        if name not in shafts:
            yield f"{place}: there is no shaft '{name}'{did_you_mean(name, shafts)}"
    nodes = definition.own_parts
    for node in definition.node:
        if node.name in BOUNDARY_NODES:
            yield f"node '{node.name}': is a boundary, and has no heat capacity"
        elif node.name not in nodes:
            yield f"node '{node.name}': there is no node '{node.name}'{did_you_mean(node.name, nodes)}"
    for name in definition.factors:
        if name not in definition.factor_names:
            yield f"factors: '{name}' is not a known factor{did_you_mean(name, definition.factor_names)}"


def _names_of_the_model(definition: Definition) -> Iterator[str]:
    """Refuse added parts, boundaries and heats that are called as something of the model."""
    added = [*(part.name for part in definition.part), *(boundary.name for boundary in definition.boundary)]
    nodes = (*definition.own_parts, *definition.own_boundaries)  # reported as given twice
    for name in added:
        if name in (*RESERVED, *_numbered_losses(definition), "housing") and name not in nodes:
            yield f"name '{name}' is taken by the model itself; choose another"
    for heat in definition.heat:
        for name in (heat.name, *(f"{heat.name}_{part}" for part in heat.parts)):
            if name in (*definition.own_losses, "total"):
                yield f"heat '{heat.name}': '{name}' is a loss of the gearbox; choose another name"


def _added_to_geometry(definition: Definition) -> Iterator[str]:
    """Refuse in added tables what the geometry has already, or lacks."""
    for given in definition.input:
        if given.name in definition.own_inputs:
            yield f"input '{given.name}': is an input of every gearbox with geometry; leave it out"
    for boundary in definition.boundary:
        if boundary.input == "T_ambient" and boundary.temperature_degC is not None:
            yield f"boundary '{boundary.name}'.temperature_degC: T_ambient has its value in [ambient]; leave it out"
    for number, link in enumerate(definition.link, start=1):
        if link.standstill_share < 1.0:
            yield (
                f"link #{number}.standstill_share: needs running_rpm in [reference], which a definition with geometry "
                "has not; write the part that depends on the speed as factor"
            )


def _chain(definition: Definition) -> Iterator[str]:
    """Refuse stages that do not follow each other from the input shaft to the output shaft."""
    turning = [definition.stage[0].driver]
    for number, stage in enumerate(definition.stage, start=1):
        if stage.driver != turning[-1]:
            yield (
                f"stage #{number}.driver: is '{stage.driver}', but the stage before drives '{turning[-1]}'; list the "
                "stages from the input shaft on. Branches are not supported: describe such a machine without geometry "
                "(python -m builder new FILE --like reducer)"
            )
        if stage.driven in turning:
            yield f"stage #{number}.driven: '{stage.driven}' is driven or drives already; name the next shaft"
        turning.append(stage.driven)
    if definition.stage[0].angle_deg is not None:
        yield "stage #1.angle_deg: there is no stage before it; leave it out"
    for shaft in definition.shaft:
        if shaft.name not in turning:
            yield f"shaft '{shaft.name}': no stage has it as driver or driven; leave it out"


def _load_shares(definition: Definition) -> Iterator[str]:
    """Refuse bearings that carry more or less than the mesh force of their shaft."""
    for shaft in definition.shaft:
        bearings = [bearing for bearing in definition.bearing if bearing.shaft == shaft.name]
        shares = [bearing.load_share for bearing in bearings if bearing.load_share is not None]
        if not bearings:
            yield f"bearing: none is on the shaft '{shaft.name}'"
        elif len(shares) < len(bearings):
            yield from _positions(definition, shaft.name, bearings)
        elif abs(sum(shares) - 1.0) > SHARE_TOLERANCE:
            yield f"bearing: load_share of the bearings on '{shaft.name}' sum to {sum(shares):g}, not to 1"


def _positions(definition: Definition, shaft: str, bearings: list[Bearing]) -> Iterator[str]:
    """Refuse a shaft that is no beam on two supports of known places."""
    places = {bearing.position_mm for bearing in bearings if bearing.position_mm is not None}
    if len(places) != 2 or len(bearings) != 2:
        yield (
            f"bearing: those on '{shaft}' need position_mm at two different places, one each; with more bearings, or "
            "one, give each a load_share"
        )
    for number, stage in enumerate(definition.stage, start=1):
        if shaft in stage.shafts and stage.position_mm is None:
            yield f"stage #{number}.position_mm is missing; the bearings of '{shaft}' have position_mm"


def _taper_pairs(definition: Definition) -> Iterator[str]:
    """Refuse taper bearings without a partner that they are adjusted against."""
    for shaft in definition.shaft:
        tapers = [b for b in definition.bearing if b.shaft == shaft.name and b.type == "tapered_roller"]
        if len(tapers) not in (0, 2):
            yield f"bearing: {len(tapers)} of those on '{shaft.name}' are taper bearings; they come in adjusted pairs"
        elif tapers and any(b.locating and b not in tapers for b in definition.bearing if b.shaft == shaft.name):
            yield f"bearing: on '{shaft.name}' a taper bearing takes the force along it; no other one is locating"


def _axial_loads(definition: Definition) -> Iterator[str]:
    """Refuse shafts of helical gears whose axial force no bearing can take, or several would."""
    for shaft in definition.shaft:
        angle = max(s.helix_angle_deg for s in definition.stage if shaft.name in s.shafts)
        if angle == 0.0:
            continue
        locating = [bearing for bearing in definition.bearing if bearing.shaft == shaft.name and bearing.locating]
        if len(locating) != 1:
            yield (
                f"bearing: {len(locating) or 'none'} of those on '{shaft.name}' {'are' if locating else 'is'} "
                f"locating; gears of helix_angle_deg = {angle:g} push along their shafts: set locating = true for the "
                "one bearing of each shaft that takes it (a pair that takes one sense each counts as one)"
            )
        elif (fault := locating[0].axial_fault()) is not None:
            yield f"bearing '{locating[0].name}'.locating: {fault}"


def _shafts_in_gears(definition: Definition) -> Iterator[str]:
    """Refuse shafts that are thicker than the gears on them."""
    diameters = {shaft.name: shaft.diameter_mm for shaft in definition.shaft}
    for stage in definition.stage:
        for shaft, gear, r_f in zip(stage.shafts, stage.names, stage.pair().r_f, strict=True):
            if diameters[shaft] >= 2e3 * r_f:
                yield (
                    f"shaft '{shaft}'.diameter_mm: {diameters[shaft]:g} mm is not below the root diameter "
                    f"{2e3 * r_f:.4g} mm of the gear '{gear}' on it"
                )


def _axis_heights(definition: Definition) -> Iterator[str]:
    """Refuse axes that are further apart in height than their centre distance."""
    height = {shaft.name: 1e3 * shaft.axis_height for shaft in definition.shaft}
    if height[definition.stage[0].driver] != 0.0:
        yield f"shaft '{definition.stage[0].driver}'.axis_height_mm: heights are those above this shaft; leave it out"
    for number, stage in enumerate(definition.stage, start=1):
        apart = abs(height[stage.driver] - height[stage.driven])
        if apart > stage.center_distance_mm:
            yield (
                f"stage #{number}: axis_height_mm of its shafts differ by {apart:g}, more than its "
                f"center_distance_mm of {stage.center_distance_mm:g}"
            )


def _stations_of_shafts(definition: Definition) -> Iterator[str]:
    """Refuse seals and bearings that no station of their shaft can have."""
    diameters = {shaft.name: shaft.diameter_mm for shaft in definition.shaft}
    stations = [(f"seal '{seal.name}'.diameter_mm", seal.diameter_mm, seal.shaft) for seal in definition.seal]
    stations += [(f"bearing '{one.name}'.bore_mm", one.bore_mm, one.shaft) for one in definition.bearing]
    for place, diameter, shaft in stations:
        if not 1.0 / STEPPED < diameter / diameters[shaft] < STEPPED:
            yield (
                f"{place}: {diameter:g} mm on a shaft of {diameters[shaft]:g} mm; up to {STEPPED:g} times thicker or "
                "thinner is accepted"
            )


def _places_along_shafts(definition: Definition) -> Iterator[str]:
    """Refuse bearings much farther apart than their shaft is long, and gears that are in each other."""
    for shaft in definition.shaft:
        bearings = [bearing for bearing in definition.bearing if bearing.shaft == shaft.name]
        places = [bearing.position_mm for bearing in bearings if bearing.position_mm is not None]
        apart = max(places, default=0.0) - min(places, default=0.0)
        if apart > STEPPED * shaft.length_mm:  # of a cylinder in place of the shaft
            yield (
                f"bearing: position_mm of those on '{shaft.name}' lie {apart:g} mm apart, and the shaft's length_mm is "
                f"{shaft.length_mm:g}; up to {STEPPED:g} times as much is accepted"
            )
    for number, (before, after) in enumerate(pairwise(definition.stage), start=2):
        if before.position_mm is not None and after.position_mm is not None:
            apart = abs(after.position_mm[0] - before.position_mm[1])
            needed = 0.5 * (before.face_width_mm + after.face_width_mm)
            if apart < needed:
                yield (
                    f"stage #{number}.position_mm: '{after.names[0]}' is {apart:g} mm from '{before.names[1]}' on "
                    f"'{after.driver}'; with their face widths they need {needed:g} mm"
                )


def _gears_in_housing(definition: Definition) -> Iterator[str]:
    """Refuse a housing that is lower than its largest gear."""
    height = definition.housing.height_m
    largest = 2.0 * max(radius for stage in definition.stage for radius in stage.pair().r_a)
    if height < largest:
        yield (
            f"housing.height_m: {height:g} m is less than the tip diameter of the largest gear, {largest:.4g} m: "
            "correct one of them"
        )


def _oil_level(definition: Definition) -> Iterator[str]:
    """Refuse an oil level outside the housing."""
    level, height = definition.oil.level_below_axis_mm, 1e3 * definition.housing.height_m
    # An axis is at least as far from floor and lid as the gear on it is large.
    rooms = [
        (1e3 * definition.level_below_axis[shaft] - level, height - 1e3 * r_a)
        for stage in definition.stage
        for shaft, r_a in zip(stage.shafts, stage.pair().r_a, strict=True)
    ]
    low, high = max(-room - lift for lift, room in rooms), min(room - lift for lift, room in rooms)
    if not low <= level <= high:
        yield (
            f"oil.level_below_axis_mm: {level:g} mm is outside the housing, whose height_m is {1e-3 * height:g}; "
            f"with its gears {low:.4g} to {high:.4g} mm is possible (positive below the axis)"
        )


def _oil_volume(definition: Definition) -> Iterator[str]:
    """Refuse more oil than a body of the housing's inside area can hold: a ball, by the isoperimetric inequality."""
    volume, area = definition.oil.volume_l, definition.housing.inside_area_m2
    most = 1e3 * area**1.5 / (6.0 * math.sqrt(math.pi))
    if volume > most:
        yield (
            f"oil.volume_l: {volume:g} l do not fit into the housing; with its inside_area_m2 of {area:g} even a ball "
            f"holds no more than {most:.3g} l: correct one of them"
        )
