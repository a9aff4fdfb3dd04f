"""The table of a rolling bearing, with what follows from its type."""

from __future__ import annotations

import math
import re
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from models.definition.sections import Coefficient, Name, Position, Section, Text
from models.quantities.definition_units import between

STEEL = 7850e-9  # kg/mm3
HEAVIEST = 3.0  # times a solid ring of steel: with the seat around it
LARGEST_RING_RATIO = 5.0  # outside diameter over bore; the largest of ISO 15, from memory, is 4 (634: 16 over 4 mm)
# Constants of SKF's friction model by type of bearing: those that a file may leave out, and that of sliding under a
# radial load, which it gives by the series. SKF, "Rolling bearings", 2016; mineral oil.
# S1 of rollers, which acts on an axial load, is 0.16 or 0.17 in all series with a cage.
OF_TYPE: dict[str, dict[str, float]] = {
    "cylindrical_roller": {"K_Z": 5.1, "K_L": 0.65, "mu_EHL": 0.02},
    "deep_groove_ball": {"K_Z": 3.1, "mu_EHL": 0.05},
    "tapered_roller": {"K_Z": 6.0, "K_L": 0.7, "mu_EHL": 0.002},
}
SLIDING_OF_TYPE = {"cylindrical_roller": "S2", "deep_groove_ball": "S1", "tapered_roller": "S1"}
FLANGE_SLIDING = 0.16
NO_FLANGE = re.compile(r"\s*NU?\s*\d")  # N and NU let the shaft move


class Bearing(Section):
    """``[[bearing]]``: one rolling bearing with the constants of the SKF friction model."""

    name: Name
    shaft: Name
    designation: Text
    type: Literal["cylindrical_roller", "deep_groove_ball", "tapered_roller"]
    bore_mm: Annotated[float, between(1.0, 1000.0)]
    outside_diameter_mm: Annotated[float, between(3.0, 2000.0)]
    width_mm: Annotated[float, between(1.0, 500.0)]
    mass_kg: Annotated[float, between(0.001, 1000.0)]
    model: Literal["skf"]
    R1: Annotated[float, between(1e-8, 1e-4)]
    S1: Annotated[float, between(1e-5, 1.0)] | None = None
    S2: Annotated[float, between(1e-5, 1000.0)] | None = None
    K_rs: Annotated[float, between(0.0, 1e-6)] = 3e-8
    K_Z: Annotated[float, between(1.0, 10.0), Field(default=None)]  # these three by the type where they are left out
    K_L: Annotated[float, between(0.1, 2.0)] | None = None
    mu_bl: Coefficient = 0.12
    mu_EHL: Annotated[Coefficient, Field(default=None)]
    oil_level_mm: Annotated[float, between(0.0, 1000.0)] | None = None
    temperature: Literal["mean", "skf_outlet"] = "mean"
    load_share: Annotated[float, between(0.0, 1.0)] | None = None
    position_mm: Position | None = None
    locating: bool | None = None  # none, not false, so that files without helical gears keep their hash
    static_load_kN: Annotated[float, between(0.1, 1e4)] | None = None
    Y: Annotated[float, between(0.3, 5.0)] | None = None
    drag: Literal["2016", "2008"] = "2016"
    heat_dissipation_W_K: Annotated[float, between(0.001, 1000.0)] | None = None

    def oil_level(self, level_below_axis_mm: float) -> float:
        """Oil level above the lowest contact of the outer raceway, [mm]; ``0.6 d_m`` is that contact's radius (SKF).

        Parameters
        ----------
        level_below_axis_mm : float
            Oil level of the sump below the shaft axis, [mm]; read unless the file gives the bearing its own level

        Returns
        -------
        float
            Level H, [mm]; 0 where the bearing is dry
        """
        if self.oil_level_mm is not None:
            return self.oil_level_mm
        return max(0.0, 0.3 * (self.bore_mm + self.outside_diameter_mm) - level_below_axis_mm)

    @property
    def axial_constants(self) -> tuple[float, float]:
        """Constants of an axial load: S1 of rollers; S2 of balls, and their static load rating [N]."""
        if self.type == "deep_groove_ball":
            return float(self.S2 or 0.0), 1e3 * float(self.static_load_kN or 0.0)
        return FLANGE_SLIDING if self.S1 is None else self.S1, 0.0

    def axial_fault(self) -> str | None:
        """Reason why it cannot take the axial force of helical gears; None if it can."""
        if self.type == "cylindrical_roller" and NO_FLANGE.match(self.designation):
            return f"{self.designation} lets the shaft move: an NJ, an NUP, a ball or a taper bearing can locate it"
        if self.type == "deep_groove_ball" and (self.S2 is None or self.static_load_kN is None):
            return "S2 of its series (SKF) and static_load_kN, the rating C0 of the catalogue, are needed"
        return (
            "its load_share is 0, and a locating bearing carries a radial load too" if self.load_share == 0.0 else None
        )

    @property
    def sliding_constant(self) -> float:
        """S2 of a cylindrical roller bearing, S1 of the others, [-]."""
        return float(getattr(self, SLIDING_OF_TYPE[self.type]))

    @model_validator(mode="before")
    @classmethod
    def _with_constants_of_the_type(cls, given: Any) -> Any:
        return OF_TYPE.get(str(given.get("type")), {}) | given if isinstance(given, dict) else given

    @model_validator(mode="after")
    def _constants_are_those_of_the_type(self) -> Self:
        key = SLIDING_OF_TYPE[self.type]
        if getattr(self, key) is None:
            raise ValueError(f"{key} is missing, by which SKF's model calculates the sliding of a {self.type}")
        if self.K_L is not None and "K_L" not in OF_TYPE[self.type]:
            raise ValueError(f"K_L is given, which a {self.type} does not have in SKF's model; leave it out")
        if self.type == "tapered_roller" and (self.Y is None or self.load_share == 0.0):
            raise ValueError(
                "a tapered_roller bearing needs Y, its axial load factor (catalogue), and a load_share above 0"
            )
        return self

    @model_validator(mode="after")
    def _has_one_place(self) -> Self:
        if (self.load_share is None) == (self.position_mm is None):
            raise ValueError("needs either load_share or position_mm, and not both")
        return self

    @model_validator(mode="after")
    def _rings_are_possible(self) -> Self:
        bore, outside = self.bore_mm, self.outside_diameter_mm
        if outside <= bore:
            raise ValueError(f"outside_diameter_mm = {outside:g} is not above bore_mm = {bore:g}")
        if outside > LARGEST_RING_RATIO * bore:
            raise ValueError(
                f"outside_diameter_mm = {outside:g} is {outside / bore:.3g} times bore_mm = {bore:g}; rolling bearings "
                f"have up to 4 times, above {LARGEST_RING_RATIO:g} is refused: correct one of them"
            )
        solid = STEEL * math.pi / 4.0 * (outside**2 - bore**2) * self.width_mm
        if self.mass_kg > HEAVIEST * solid:
            raise ValueError(
                f"mass_kg = {self.mass_kg:g}, but a solid ring of steel of its size has {solid:.3g} kg: correct it"
            )
        return self
