"""The table of a rolling bearing, with what follows from its type."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from models.definition.sections import Coefficient, Name, Section, Text
from models.quantities.definition_units import between

LARGEST_RING_RATIO = 5.0  # outside diameter over bore; the largest of ISO 15, from memory, is 4 (634: 16 over 4 mm)
# Constants of SKF's friction model by type of bearing: those that a file may leave out, and that of sliding under a
# radial load, which it gives by the series. SKF, "Rolling bearings", 2016; mineral oil.
OF_TYPE: dict[str, dict[str, float]] = {
    "cylindrical_roller": {"K_Z": 5.1, "K_L": 0.65, "mu_EHL": 0.02},
    "deep_groove_ball": {"K_Z": 3.1, "mu_EHL": 0.05},
}
SLIDING_OF_TYPE = {"cylindrical_roller": "S2", "deep_groove_ball": "S1"}


class Bearing(Section):
    """``[[bearing]]``: one rolling bearing with the constants of the SKF friction model."""

    name: Name
    shaft: Name
    designation: Text
    type: Literal["cylindrical_roller", "deep_groove_ball"]
    bore_mm: Annotated[float, between(1.0, 1000.0)]
    outside_diameter_mm: Annotated[float, between(3.0, 2000.0)]
    width_mm: Annotated[float, between(1.0, 500.0)]
    mass_kg: Annotated[float, between(0.001, 1000.0)]
    model: Literal["skf"]
    R1: Annotated[float, between(1e-8, 1e-4)]
    S1: Annotated[float, between(1e-5, 1.0)] | None = None
    S2: Annotated[float, between(1e-5, 1.0)] | None = None
    K_rs: Annotated[float, between(0.0, 1e-6)] = 3e-8
    K_Z: Annotated[float, between(1.0, 10.0), Field(default=None)]  # these three by the type where they are left out
    K_L: Annotated[float, between(0.1, 2.0)] | None = None
    mu_bl: Coefficient = 0.12
    mu_EHL: Annotated[Coefficient, Field(default=None)]
    oil_level_mm: Annotated[float, between(0.0, 1000.0)] | None = None
    temperature: Literal["mean", "skf_outlet"] = "mean"
    load_share: Annotated[float, between(0.0, 1.0)]
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
    def sliding_constant(self) -> float:
        """S1 of a ball bearing, S2 of a roller bearing, [-]."""
        return float(getattr(self, SLIDING_OF_TYPE[self.type]))

    @model_validator(mode="before")
    @classmethod
    def _with_constants_of_the_type(cls, given: Any) -> Any:
        return OF_TYPE.get(str(given.get("type")), {}) | given if isinstance(given, dict) else given

    @model_validator(mode="after")
    def _constants_are_those_of_the_type(self) -> Self:
        own = (*OF_TYPE[self.type], SLIDING_OF_TYPE[self.type])
        for key in ("S1", "S2", "K_L"):
            if getattr(self, key) is None and key in own:
                raise ValueError(f"{key} is missing, by which SKF's model calculates the sliding of a {self.type}")
            if getattr(self, key) is not None and key not in own:
                raise ValueError(f"{key} is given, which a {self.type} does not have in SKF's model; leave it out")
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
        return self
