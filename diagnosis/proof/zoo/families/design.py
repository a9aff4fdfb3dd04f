"""Structure and laws that a family chooses for a one-stage gearbox."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from diagnosis.proof.zoo.families import losses
from models.base.types import Array


@dataclass(frozen=True, kw_only=True)
class GearboxDesign:
    """Structure and laws of one gearbox.

    Attributes
    ----------
    layers : int
        Bodies through every wall, 1 to 3
    one_box : bool
        True if all housing parts are one body
    seats : bool
        True if every bearing has a seat between its outer ring and the walls
    oil : str
        ``sump`` alone, with ``mist``, or with mist and a ``film`` on the upper walls
    gears : str
        ``one`` body, ``rim`` and hub, or a ``rotor`` with the shaft
    shafts : str
        ``one`` body, two ``halves``, or a middle with ``ends``; read where gears are no rotor
    bearings : str
        ``one`` body each, ``rings`` inner and outer, or all of a ``shaft`` in one
    foundation : str
        ``none``, a ``link`` to the frame, or a ``bed`` that warms
    shaft_ends : tuple of str
        Shafts whose end gives heat to air
    flanges : tuple of str
        Shafts that carry a coupling
    stratified : float
        Share of the oil's rise that the air over the upper half has
    draught : float
        Sd of the logarithm of the convection, wandering
    friction : Callable
        Of :mod:`diagnosis.proof.zoo.families.losses`
    churning : {"changenet_2007", "changenet_2011", "lauster", "mauz"}
    bearing : {"palmgren", "skf"}
    seal : {"iso_1", "iso_2", "linke"}
    seal_into : {"oil", "shaft"}
        Where the heat of a lip goes
    convection : Callable
        Of :mod:`diagnosis.proof.zoo.families.films`
    gear_film : {"fling_off", "cylinder"}
    """

    layers: int = 1
    one_box: bool = False
    seats: bool = False
    oil: Literal["sump", "mist", "film"] = "sump"
    gears: Literal["one", "rim", "rotor"] = "one"
    shafts: Literal["one", "halves", "ends"] = "one"
    bearings: Literal["one", "rings", "shaft"] = "one"
    foundation: Literal["none", "link", "bed"] = "none"
    shaft_ends: tuple[str, ...] = ()
    flanges: tuple[str, ...] = ()
    stratified: float = 0.0
    draught: float = 0.0
    friction: Callable[[losses.Contact], Array]
    churning: str
    bearing: str
    seal: str
    seal_into: str = "oil"
    convection: Callable[[Array, Array, Array, float], Array]
    gear_film: str = "fling_off"
