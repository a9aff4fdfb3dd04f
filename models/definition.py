"""The definition file of a gearbox, schema 1: one frozen, validated class per table.

Attributes are the keys of the file, in the units that their names tell; the same value in SI has the bare name
(``stage.face_width_mm`` and ``stage.face_width`` [m]). Faults within one table are found here, faults between tables
in :mod:`models.consistency`; :mod:`models.gearbox` reads the file and reports all of them at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, model_validator

from models.errors import InputError
from models.geometry import GearPair, gear_pair
from models.quantity import InSI, between, in_si, optional_pair_in_si, pair_in_si

SCHEMA = 1

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
Text = Annotated[str, StringConstraints(min_length=1)]
# A whole number of hundreds of digits, which no float holds, is refused before anything is calculated with it.
Teeth = Annotated[int, Field(ge=-(10**9), le=10**9), between(5, 400)]
ThermalConductivity = Annotated[float, between(0.1, 500.0)]
SolidDensity = Annotated[float, between(900.0, 12000.0)]
SolidHeat = Annotated[float, between(100.0, 2500.0)]
HeatCapacity = Annotated[float, between(0.01, 1e8)]
FluidTemperature = Annotated[float, between(-60.0, 250.0, unit="_degC")]
Viscosity = Annotated[float, between(0.5, 1e5, unit="_mm2_s")]
Coefficient = Annotated[float, between(1e-4, 0.5)]

# Outside diameter over bore: the largest of ISO 15, from memory, is 4 (634: 16 over 4 mm).
LARGEST_RING_RATIO = 5.0
# Width over the height between bore and outside diameter: 0.8 of an NU 406, about 4 of four-row roller bearings.
RING_SECTION = (0.1, 10.0)
# Mass over that of a solid steel ring of the same envelope: 0.70 to 0.74 of NU 207, 210 and 406; sleeves may add to it.
RING_MASS = (0.1, 2.0)
STEEL_KG_M3 = 7830.0


class Section(BaseModel):
    """One table of the file: strict, frozen, and without room for unknown keys."""

    model_config = ConfigDict(
        extra="forbid",
        frozen=True,
        strict=True,
        allow_inf_nan=False,
        hide_input_in_errors=True,
        ignored_types=(InSI,),
    )

    def relations(self) -> tuple[Iterator[str], ...]:
        """What is wrong between values of this table: texts by independent check.

        Where some values are not valid on their own, :mod:`models.faults` goes through the checks that need the others
        only, so that one reading tells all faults.
        """
        return ()

    @model_validator(mode="after")
    def _values_fit_together(self) -> Self:
        faults = [fault for check in self.relations() for fault in check]
        if faults:
            raise ValueError("; ".join(faults))
        return self


class Ambient(Section):
    """``[ambient]``: the surroundings where a cycle or a recording names none."""

    temperature_degC: Annotated[float, between(-60.0, 80.0)]
    air_speed_m_s: Annotated[float, between(0.0, 60.0)]


class D341(Section):
    """Constants of ``lg lg(nu + 0.7) = m - n lg(T)`` after ASTM D341, nu in mm2/s and T in K."""

    m: Annotated[float, between(4.0, 16.0)]
    n: Annotated[float, between(1.0, 7.0)]


class Modulus(Section):
    """Constants of the modulus equation ``eta = eta_0 exp[p / (A + B p)]``.

    ``A = a1 + a2 T`` and ``B = b1 + b2 T`` with T in K; ``nu_40_mm2_s`` is the viscosity of the oil on which they were
    measured.
    """

    a1_Pa: Annotated[float, between(-1e9, 1e9)]
    a2_Pa_per_K: Annotated[float, between(1e4, 1e7)]
    b1: Annotated[float, between(-1.0, 1.0)]
    b2_per_K: Annotated[float, between(-0.01, 0.01)]
    nu_40_mm2_s: Annotated[float, between(1.0, 2000.0)]

    def relations(self) -> tuple[Iterator[str], ...]:
        """See :meth:`Section.relations`."""
        return (self._stiffness_faults(),)

    def _stiffness_faults(self) -> Iterator[str]:
        stiffness = self.a1_Pa + self.a2_Pa_per_K * 333.15
        if not 1.5e7 <= stiffness <= 2.5e8:
            yield (
                f"a1 + a2 T is {stiffness:.3g} Pa at 60 degC, but 1.5e7 to 2.5e8 Pa (pressure-viscosity coefficients "
                "of 4 to 67 1/GPa) is plausible: check the signs, and that T is in K"
            )


class Gold(Section):
    """Pressure-viscosity coefficient after Gold: ``alpha = s nu^t 1e-9`` [1/Pa], nu in mm2/s."""

    s: float
    t: float

    def relations(self) -> tuple[Iterator[str], ...]:
        """See :meth:`Section.relations`."""
        return (self._swap_faults(),)

    def _swap_faults(self) -> Iterator[str]:
        if not (2.0 <= self.s <= 20.0 and 0.05 <= self.t <= 0.3):
            yield (
                f"s = {self.s:g}, t = {self.t:g} is outside s = 2 to 20, t = 0.05 to 0.3: a pair such as s = 0.139, "
                "t = 0.9904 circulates swapped, and means s = 9.904, t = 0.139"
            )


class Fluid(Section):
    """The properties of an oil, whatever gearbox it is in."""

    name: Text
    base: Literal["mineral", "naphthenic", "pao", "ester", "pag"]
    viscosity_points: tuple[tuple[FluidTemperature, Viscosity], tuple[FluidTemperature, Viscosity]] | None = None
    d341: D341 | None = None
    density_kg_m3: Annotated[float, between(600.0, 1500.0)]
    density_temperature_degC: Annotated[float, between(-20.0, 100.0)] = 15.0
    thermal_expansion_1_K: Annotated[float, between(1e-4, 2e-3)]
    specific_heat_J_kgK: Annotated[float, between(1000.0, 5000.0)] | None = None
    conductivity_W_mK: Annotated[float, between(0.05, 1.0)] | None = None
    pressure_viscosity: Literal["modulus", "roelands"]
    modulus: Modulus | None = None
    gold: Gold | None = None
    limiting_shear_coefficient: Annotated[float, between(0.005, 0.2)]
    schlenk_X_L: Annotated[float, between(0.3, 2.0)]

    def relations(self) -> tuple[Iterator[str], ...]:
        """See :meth:`Section.relations`."""
        return self._viscosity_faults(), self._pressure_faults(), self._point_faults()

    def _viscosity_faults(self) -> Iterator[str]:
        if (self.viscosity_points is None) == (self.d341 is None):
            yield "needs either viscosity_points or d341, and not both"

    def _pressure_faults(self) -> Iterator[str]:
        needed = "modulus" if self.pressure_viscosity == "modulus" else "gold"
        if getattr(self, needed) is None:
            yield f"pressure_viscosity = '{self.pressure_viscosity}' needs the table '{needed}'"

    def _point_faults(self) -> Iterator[str]:
        if self.viscosity_points is None:
            return
        (cold, nu_cold), (hot, nu_hot) = sorted(self.viscosity_points)
        if cold == hot:
            yield f"viscosity_points are both at {hot:g} degC; two different temperatures are needed"
        elif nu_hot >= nu_cold:
            yield (
                f"viscosity_points: {nu_hot:g} mm2/s at {hot:g} degC is not below {nu_cold:g} mm2/s at "
                f"{cold:g} degC; the hotter oil must be the thinner one"
            )


class Oil(Fluid):
    """``[oil]``: the filling. What a named oil leaves open or the file overrides is merged before validation."""

    named: Text | None = None
    level_below_axis_mm: Annotated[float, between(-1000.0, 1000.0)]
    volume_l: Annotated[float, between(0.01, 5000.0)]

    level_below_axis = in_si("level_below_axis_mm")
    volume = in_si("volume_l")


class Shaft(Section):
    """``[[shaft]]``: a solid steel cylinder for heat conduction and storage."""

    name: Name
    length_mm: Annotated[float, between(5.0, 5000.0)]
    diameter_mm: Annotated[float, between(2.0, 1000.0)]
    conductivity_W_mK: ThermalConductivity = 46.0
    heat_capacity_J_K: HeatCapacity | None = None
    surface_to_air: bool = False
    length_in_air_mm: Annotated[float, between(0.1, 5000.0)] | None = None

    length = in_si("length_mm")
    diameter = in_si("diameter_mm")

    @property
    def length_in_air(self) -> float:
        """Length that the surrounding air cools, [m]; the whole one where none is given, nothing without a surface."""
        given = self.length_mm if self.length_in_air_mm is None else self.length_in_air_mm
        return 1e-3 * given if self.surface_to_air else 0.0

    def relations(self) -> tuple[Iterator[str], ...]:
        """See :meth:`Section.relations`."""
        return (self._air_faults(),)

    def _air_faults(self) -> Iterator[str]:
        if self.length_in_air_mm is None:
            return
        if not self.surface_to_air:
            yield f"length_in_air_mm is {self.length_in_air_mm:g}, but surface_to_air is false; set it to true"
        if self.length_in_air_mm > self.length_mm:
            yield f"length_in_air_mm is {self.length_in_air_mm:g}, more than length_mm, which is {self.length_mm:g}"


class Material(Section):
    """``[stage.material]``: the steel of the gears."""

    youngs_modulus_GPa: Annotated[float, between(1.0, 500.0)] = 206.0
    poisson: Annotated[float, between(0.0, 0.49)] = 0.3
    density_kg_m3: SolidDensity = 7830.0
    specific_heat_J_kgK: SolidHeat = 465.0
    conductivity_W_mK: ThermalConductivity = 46.0

    youngs_modulus = in_si("youngs_modulus_GPa")


class Friction(Section):
    """``[stage.friction]``: sliding friction in the mesh."""

    model: Literal["arana", "schlenk"]
    mu_solid: Annotated[float, between(0.005, 0.3)]
    asperity_load_share: Literal["doleschel", "erf", "diab", "matsumoto"] = "doleschel"
    roughness: Literal["mean", "composite", "composite_rms"] = "mean"
    film: Literal["hamrock_dowson", "dowson_toyoda", "grubin"] = "hamrock_dowson"
    thermal_reduction: Literal["gupta", "gupta_simple", "murch_wilson"] = "gupta"
    average: Literal["base_pitch", "path_of_contact"] = "base_pitch"


class Rolling(Section):
    """``[stage.rolling]``: hydrodynamic rolling loss in the mesh."""

    model: Literal["anderson_loewenthal"]
    constant_N_m2: Annotated[float, between(1e6, 1e9)] = 9.0e7


class Churning(Section):
    """``[stage.churning]``: the gears in the oil bath; ``C_Sp`` is the splash factor of the Mauz formula."""

    model: Literal["niemann", "niemann_printed", "mauz", "changenet_velex"]
    C_Sp: Annotated[float, between(0.05, 10.0)] = 1.0


class Stage(Section):
    """``[[stage]]``: one pair of gears; every pair of numbers is (driver, driven)."""

    driver: Name
    driven: Name
    names: tuple[Name, Name] = ("pinion", "wheel")
    z: tuple[Teeth, Teeth]
    module_mm: Annotated[float, between(0.2, 50.0)]
    pressure_angle_deg: Annotated[float, between(10.0, 35.0)]
    helix_angle_deg: Annotated[float, between(-60.0, 60.0)] = 0.0
    face_width_mm: Annotated[float, between(1.0, 1000.0)]
    center_distance_mm: Annotated[float, between(5.0, 5000.0)]
    profile_shift: tuple[Annotated[float, between(-2.0, 3.0)], Annotated[float, between(-2.0, 3.0)]]
    tip_shortening: bool = True
    tip_diameter_mm: tuple[Annotated[float, between(2.0, 5000.0)], Annotated[float, between(2.0, 5000.0)]] | None = None
    bore_mm: tuple[Annotated[float, between(1.0, 2000.0)], Annotated[float, between(1.0, 2000.0)]]
    roughness_Ra_um: tuple[Annotated[float, between(0.01, 20.0)], Annotated[float, between(0.01, 20.0)]]
    material: Material = Material()
    load_sharing: Literal["potential_energy", "sanchez_pedrero", "equal"]
    friction: Friction
    rolling: Rolling
    churning: Churning

    module = in_si("module_mm")
    pressure_angle = in_si("pressure_angle_deg")
    face_width = in_si("face_width_mm")
    center_distance = in_si("center_distance_mm")
    tip_diameter = optional_pair_in_si("tip_diameter_mm")
    roughness_Ra = pair_in_si("roughness_Ra_um")

    @property
    def bore_radius(self) -> tuple[float, float]:
        """Radii of the gear bores, for the compliance of the gear bodies, [m]."""
        return 0.5e-3 * self.bore_mm[0], 0.5e-3 * self.bore_mm[1]

    def pair(self) -> GearPair:
        """Geometry of the pair.

        Raises
        ------
        InputError
            If the numbers make no gear pair (undercut, contact ratio below 1, impossible centre distance, ...).
        """
        return gear_pair(
            z=self.z,
            m_n=self.module,
            alpha_n=self.pressure_angle,
            b=self.face_width,
            a=self.center_distance,
            x=self.profile_shift,
            tip_shortening=self.tip_shortening,
            r_a=None if self.tip_diameter is None else (self.tip_diameter[0] / 2.0, self.tip_diameter[1] / 2.0),
        )

    def relations(self) -> tuple[Iterator[str], ...]:
        """See :meth:`Section.relations`."""
        return self._shaft_faults(), self._pair_faults(), self._bore_faults()

    def _shaft_faults(self) -> Iterator[str]:
        if self.driver == self.driven:
            yield f"driver and driven are both '{self.driver}'; a stage joins two shafts"

    def _pair_faults(self) -> Iterator[str]:
        if self.helix_angle_deg != 0.0:
            yield f"helix_angle_deg = {self.helix_angle_deg:g}: helical gears are not supported yet; only 0 (spur) is"
            return
        try:
            self.pair()
        except InputError as error:
            yield str(error)

    def _bore_faults(self) -> Iterator[str]:
        try:
            pair = self.pair()
        except InputError:
            return
        for name, bore, r_f in zip(self.names, self.bore_mm, pair.r_f, strict=True):
            if bore >= 2e3 * r_f:
                yield f"bore_mm of '{name}' is {bore:g}, not below its root diameter {2e3 * r_f:.4g} mm"


class Bearing(Section):
    """``[[bearing]]``: one rolling bearing with the constants of the SKF friction model."""

    name: Name
    shaft: Name
    designation: Text
    type: Literal["cylindrical_roller"]
    bore_mm: Annotated[float, between(1.0, 1000.0)]
    outside_diameter_mm: Annotated[float, between(3.0, 2000.0)]
    width_mm: Annotated[float, between(1.0, 500.0)]
    mass_kg: Annotated[float, between(0.001, 1000.0)]
    model: Literal["skf"]
    R1: Annotated[float, between(1e-8, 1e-4)]
    S2: Annotated[float, between(1e-5, 1.0)]
    K_rs: Annotated[float, between(0.0, 1e-6)] = 3e-8
    K_Z: Annotated[float, between(1.0, 10.0)] = 5.1
    K_L: Annotated[float, between(0.1, 2.0)] = 0.65
    mu_bl: Coefficient = 0.12
    mu_EHL: Coefficient = 0.02
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

    def relations(self) -> tuple[Iterator[str], ...]:
        """See :meth:`Section.relations`."""
        return self._ring_faults(), self._mass_faults()

    def _ring_faults(self) -> Iterator[str]:
        bore, outside = self.bore_mm, self.outside_diameter_mm
        if outside <= bore:
            yield f"outside_diameter_mm = {outside:g} is not above bore_mm = {bore:g}"
            return
        if outside > LARGEST_RING_RATIO * bore:
            yield (
                f"outside_diameter_mm = {outside:g} is {outside / bore:.3g} times bore_mm = {bore:g}; rolling bearings "
                f"have up to 4 times, above {LARGEST_RING_RATIO:g} is refused: correct one of them"
            )
            return
        ratio = 2.0 * self.width_mm / (outside - bore)
        if not RING_SECTION[0] <= ratio <= RING_SECTION[1]:
            yield (
                f"width_mm = {self.width_mm:g} is {ratio:.3g} times the height of its section, "
                f"{0.5 * (outside - bore):g} mm between bore_mm and outside_diameter_mm; {RING_SECTION[0]:g} to "
                f"{RING_SECTION[1]:g} times is possible: correct one of them"
            )

    def _mass_faults(self) -> Iterator[str]:
        if any(self._ring_faults()):
            return  # there is no ring to compare with
        mass = self.mass_kg
        area = 0.25e-6 * pi * (self.outside_diameter_mm**2 - self.bore_mm**2)
        solid = STEEL_KG_M3 * area * 1e-3 * self.width_mm
        low, high = RING_MASS[0] * solid, RING_MASS[1] * solid
        if not low <= mass <= high:
            meant = ": were grams meant?" if low <= 1e-3 * mass <= high else ""
            yield (
                f"mass_kg = {mass:g} does not fit its size: a solid steel ring of its bore_mm, outside_diameter_mm and "
                f"width_mm has {solid:.3g} kg, so {low:.2g} to {high:.2g} kg is possible{meant}"
            )


class Seal(Section):
    """``[[seal]]``: one radial shaft seal; ``nu_40_mm2_s`` is the grade of the oil (default: its viscosity)."""

    name: Name
    shaft: Name
    diameter_mm: Annotated[float, between(2.0, 2000.0)]
    model: Literal["linke", "iso_simple"]
    nu_40_mm2_s: Annotated[float, between(1.0, 2000.0)] | None = None
    temperature_coefficient: Annotated[float, between(0.0, 3.0)] = 1.6


class HousingPart(Section):
    """``[[housing.part]]``: a share of the housing that has one temperature; neighbours in the file are joined."""

    name: Name
    area_fraction: Annotated[float, between(0.01, 1.0)]
    foundation: bool = False


class Housing(Section):
    """``[housing]``: the box as a whole."""

    inside_area_m2: Annotated[float, between(1e-4, 100.0)]
    outside_area_m2: Annotated[float, between(1e-4, 100.0)]
    height_m: Annotated[float, between(0.01, 5.0)]
    wall_thickness_m: Annotated[float, between(5e-4, 0.3)]
    conductivity_W_mK: ThermalConductivity
    density_kg_m3: SolidDensity = 7200.0
    specific_heat_J_kgK: SolidHeat = 500.0
    oil_heat_transfer_W_m2K: Annotated[float, between(1.0, 1e4)]
    emissivity: Annotated[float, between(0.0, 1.0)]
    convection: Literal["iso_14179", "flat_plate", "iso_14179_free", "churchill_chu"]
    foundation_conductance_W_K: Annotated[float, between(0.0, 1e4)] = 0.0
    joint_conductance_W_K: Annotated[float, between(0.0, 1e5)]
    part: Annotated[tuple[HousingPart, ...], Field(min_length=1)]

    def relations(self) -> tuple[Iterator[str], ...]:
        """See :meth:`Section.relations`."""
        return self._share_faults(), self._foundation_faults()

    def _share_faults(self) -> Iterator[str]:
        total = sum(part.area_fraction for part in self.part)
        if abs(total - 1.0) > 1e-6:
            yield f"the area_fraction of its parts sum to {total:g}, not to 1"

    def _foundation_faults(self) -> Iterator[str]:
        if self.foundation_conductance_W_K > 0.0 and not any(part.foundation for part in self.part):
            yield (
                "foundation_conductance_W_K is above 0, but no part stands on the foundation; "
                "set foundation = true for one of them"
            )


class Node(Section):
    """``[[node]]``: overrides the heat capacity of one node of the thermal network."""

    name: Name
    heat_capacity_J_K: HeatCapacity


class Training(Section):
    """``[training]``: the operating range that the surrogates are trained on, each key (lower, upper)."""

    speed_rpm: tuple[Annotated[float, between(1e-3, 1e5)], Annotated[float, between(1e-3, 1e5)]]
    torque_Nm: tuple[Annotated[float, between(1e-6, 1e6)], Annotated[float, between(1e-6, 1e6)]]
    temperature_degC: tuple[Annotated[float, between(-60.0, 300.0)], Annotated[float, between(-60.0, 300.0)]]

    def relations(self) -> tuple[Iterator[str], ...]:
        """See :meth:`Section.relations`."""
        return tuple(self._order_faults(key) for key in ("speed_rpm", "torque_Nm", "temperature_degC"))

    def _order_faults(self, key: str) -> Iterator[str]:
        low, high = getattr(self, key)
        if low >= high:
            yield f"{key}: the lower bound {low:g} is not below the upper bound {high:g}"


class Definition(Section):
    """The whole file."""

    schema_number: Literal[1] = Field(alias="schema")
    name: Text
    ambient: Ambient
    oil: Oil
    shaft: Annotated[tuple[Shaft, ...], Field(min_length=1)]
    stage: Annotated[tuple[Stage, ...], Field(min_length=1)]
    bearing: Annotated[tuple[Bearing, ...], Field(min_length=1)]
    seal: tuple[Seal, ...] = ()
    housing: Housing
    node: tuple[Node, ...] = ()
    factors: dict[str, Annotated[float, between(1e-3, 1e3)]] = Field(default_factory=dict)
    training: Training
