"""Development families of one-stage gearboxes."""

from __future__ import annotations

import numpy as np

from diagnosis.proof.zoo.families import losses
from diagnosis.proof.zoo.families.family import Family
from diagnosis.proof.zoo.families.gearbox import Design, build_gearbox
from diagnosis.proof.zoo.families.sizes import refuse_unsplit
from diagnosis.proof.zoo.structure import ZooPlant
from models.assembly.gearbox import Gearbox


def _shafts(gearbox: Gearbox, rng: np.random.Generator, probability: float) -> tuple[str, ...]:
    """Some of the shafts."""
    return tuple(shaft.name for shaft in gearbox.shaft if rng.random() < probability)


def draw_walls(gearbox: Gearbox, rng: np.random.Generator) -> ZooPlant:
    """Thick walls: two or three bodies through every wall and a seat for every bearing; free convection by chance.

    Schlenk's friction, Changenet and Velex 2007, Palmgren, seals of ISO/TR 14179-2, Churchill and Chu.
    """
    refuse_unsplit(gearbox)
    design = Design(
        layers=int(rng.integers(2, 4)),
        seats=bool(rng.random() < 0.7),
        oil="mist" if rng.random() < 0.4 else "sump",
        gears="one",
        shafts="halves" if rng.random() < 0.5 else "one",
        bearings="one",
        foundation="link" if rng.random() < 0.5 else "none",
        stratified=float(rng.uniform(0.02, 0.08)) if rng.random() < 0.6 else 0.0,
        shaft_ends=_shafts(gearbox, rng, 0.3),
        friction=losses.friction_schlenk,
        churning="changenet_2007",
        bearing="palmgren",
        seal="iso_2",
        convection="gnielinski_plate",
    )
    return build_gearbox("walls", gearbox, design, rng)


MACHINES = ("fzg", "conveyor")
GEARBOX_FAMILIES = (Family(name="walls", description="thick walls and seats", machines=MACHINES, draw=draw_walls),)
