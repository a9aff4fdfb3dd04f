"""Development families of one-stage gearboxes: each has its own graph and its own published laws.

Inside a family every machine draws which of the optional splits, merges and paths it has.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from diagnosis.proof.plant.sizes import refuse_unbuilt
from diagnosis.proof.zoo.families import films, losses
from diagnosis.proof.zoo.families.design import GearboxDesign
from diagnosis.proof.zoo.families.family import PlantFamily
from diagnosis.proof.zoo.families.gearbox import build_gearbox
from diagnosis.proof.zoo.structure import ZooPlant
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError

MACHINES = ("fzg", "conveyor")
GEARBOX_FAMILIES: list[PlantFamily] = []

DrawDesign = Callable[[Gearbox, np.random.Generator], GearboxDesign]


def _family(name: str, description: str) -> Callable[[DrawDesign], DrawDesign]:
    """Enter a family whose designs the decorated function draws."""

    def enter(draw_design: DrawDesign) -> DrawDesign:
        def draw(gearbox: Gearbox, rng: np.random.Generator) -> ZooPlant:
            if gearbox.is_parametric:
                raise InputError(
                    f"{gearbox.file}: has no geometry; this family splits gearboxes with teeth, shafts and bearings: "
                    "name a family for definitions without geometry"
                )
            refuse_unbuilt(gearbox)
            return build_gearbox(name, gearbox, draw_design(gearbox, rng), rng)

        GEARBOX_FAMILIES.append(PlantFamily(name=name, description=description, machines=MACHINES, draw=draw))
        return draw_design

    return enter


@_family("walls", "thick walls in layers, seats, warmer air above")
def draw_walls(gearbox: Gearbox, rng: np.random.Generator) -> GearboxDesign:
    """Thick walls: two or three bodies through every wall, a seat for every bearing, warmer air over the upper half.

    Friction of Schlenk without its least load, churning of Changenet and Velex 2007, bearings of Palmgren, seals of
    ISO/TR 14179-2, Gnielinski's plate.
    """
    return GearboxDesign(
        layers=int(rng.integers(2, 4)),
        seats=_coin(rng, 0.7),
        oil="mist" if _coin(rng, 0.4) else "sump",
        shafts="halves" if _coin(rng, 0.5) else "one",
        foundation="link" if _coin(rng, 0.5) else "none",
        stratified=float(rng.uniform(0.02, 0.08)) if _coin(rng, 0.6) else 0.0,
        shaft_ends=_some_shafts(gearbox, rng, 0.3),
        friction=losses.friction_schlenk,
        churning="changenet_2007",
        bearing="palmgren",
        seal="iso_2",
        convection=films.gnielinski_plate,
    )


@_family("rings", "bearings and shafts in detail")
def draw_rings(gearbox: Gearbox, rng: np.random.Generator) -> GearboxDesign:
    """Bearings in detail: rings inner and outer, seats, shafts with ends, seals that heat shaft and wall.

    Friction of Benedict and Kelley, churning of Changenet et al. 2011, bearings of SKF without drag, Linke's seals, a
    box across a stream after Hilpert.
    """
    return GearboxDesign(
        layers=2 if _coin(rng, 0.4) else 1,
        seats=_coin(rng, 0.5),
        oil="sump" if _coin(rng, 0.5) else "mist",
        gears="rim" if _coin(rng, 0.3) else "one",
        shafts="ends" if _coin(rng, 0.7) else "halves",
        bearings="rings",
        foundation="link" if _coin(rng, 0.3) else "none",
        shaft_ends=_some_shafts(gearbox, rng, 0.4),
        friction=losses.friction_benedict_kelley,
        churning="changenet_2011",
        bearing="skf",
        seal="linke",
        seal_into="shaft",
        convection=films.hilpert_box,
    )


@_family("splash", "oil as sump, mist and film; rims and hubs")
def draw_splash(_: Gearbox, rng: np.random.Generator) -> GearboxDesign:
    """Oil in three places, rim and hub: what the gears throw has its own temperature, and a film on the walls.

    Friction of Drozdov and Gavrikov, churning of Mauz, bearings of Palmgren, seals of ISO/TR 14179-1, gears as
    cylinders in oil after Becker, ISO/TR 14179-2 outside.
    """
    return GearboxDesign(
        layers=2 if _coin(rng, 0.5) else 1,
        oil="film" if _coin(rng, 0.6) else "mist",
        gears="rim",
        shafts="halves" if _coin(rng, 0.4) else "one",
        bearings="shaft" if _coin(rng, 0.3) else "one",
        stratified=float(rng.uniform(0.03, 0.1)) if _coin(rng, 0.3) else 0.0,
        draught=float(rng.uniform(0.02, 0.06)) if _coin(rng, 0.4) else 0.0,
        friction=losses.friction_drozdov,
        churning="mauz",
        bearing="palmgren",
        seal="iso_1",
        convection=films.iso_14179,
        gear_film="cylinder",
    )


@_family("merged", "coarser than the model, on a bed")
def draw_merged(gearbox: Gearbox, rng: np.random.Generator) -> GearboxDesign:
    """Coarser than the nominal model: gear and shaft are one rotor, bearings of a shaft one body, the box often too.

    Friction of O'Donoghue and Cameron, churning of Lauster and Boos, bearings of SKF, Linke's seals, McAdams'
    wall; the box stands on a bed that warms, or on a frame.
    """
    return GearboxDesign(
        one_box=_coin(rng, 0.6),
        layers=1 if _coin(rng, 0.5) else 2,
        oil="mist" if _coin(rng, 0.3) else "sump",
        gears="rotor",
        bearings="shaft" if _coin(rng, 0.7) else "one",
        foundation="bed" if _coin(rng, 0.6) else "link",
        shaft_ends=_some_shafts(gearbox, rng, 0.3),
        friction=losses.friction_odonoghue_cameron,
        churning="lauster",
        bearing="skf",
        seal="linke",
        convection=films.mcadams,
    )


@_family("open", "couplings, shaft ends, bed and draughts")
def draw_open(gearbox: Gearbox, rng: np.random.Generator) -> GearboxDesign:
    """Open to its surroundings: couplings, shaft ends in air, a bed, draughts, warmer air above.

    Friction of Doleschel (solid and film mixed), churning of Changenet et al. 2011, bearings of Palmgren, seals of
    ISO/TR 14179-2, Churchill and Chu with a laminar plate.
    """
    flanges = _some_shafts(gearbox, rng, 0.6)
    return GearboxDesign(
        layers=2 if _coin(rng, 0.4) else 1,
        gears="rim" if _coin(rng, 0.4) else "one",
        shafts="halves" if _coin(rng, 0.6) else "one",
        bearings="rings" if _coin(rng, 0.3) else "one",
        foundation="bed" if _coin(rng, 0.5) else "link",
        shaft_ends=tuple(shaft.name for shaft in gearbox.shaft),
        flanges=flanges,
        stratified=float(rng.uniform(0.03, 0.1)) if _coin(rng, 0.5) else 0.0,
        draught=float(rng.uniform(0.02, 0.08)),
        friction=losses.friction_doleschel,
        churning="changenet_2011",
        bearing="palmgren",
        seal="iso_2",
        seal_into="shaft" if _coin(rng, 0.5) else "oil",
        convection=films.churchill_chu,
    )


def _coin(rng: np.random.Generator, probability: float) -> bool:
    return bool(rng.random() < probability)


def _some_shafts(gearbox: Gearbox, rng: np.random.Generator, probability: float) -> tuple[str, ...]:
    return tuple(shaft.name for shaft in gearbox.shaft if rng.random() < probability)
