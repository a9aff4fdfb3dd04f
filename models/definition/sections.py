"""The tables of a gearbox definition, schema 1: one frozen, validated class per table.

Attributes are the keys of the file, in the units that end their names; the same value in SI has the bare name
(``stage.face_width_mm`` and ``stage.face_width`` [m]). :mod:`models.assembly.gearbox_definition` has the whole file.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal, Self, TypeVar, get_args

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints, model_validator

from models.formulas.geometry import GearPair, gear_pair
from models.formulas.oil import kinematic_viscosity_d341
from models.quantities.definition_units import InSI, between, in_si

T = TypeVar("T")


def _section_in(annotation: Any) -> type[Section] | None:
    """The class of the table in a type such as ``tuple[Stage, ...]`` or ``D341 | None``."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return annotation
    return next(filter(None, map(_section_in, get_args(annotation))), None)


def _at_least_one(entries: tuple[T, ...]) -> tuple[T, ...]:
    if not entries:
        raise ValueError("has no entries; at least one is needed")
    return entries


OneOrMore = Annotated[tuple[T, ...], AfterValidator(_at_least_one)]
Positive = Annotated[float, Field(gt=0.0, le=1e9)]
NotNegative = Annotated[float, Field(ge=0.0, le=1e9)]
Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
Text = Annotated[str, StringConstraints(min_length=1, pattern=r"^[^\x00-\x08\x0b\x0c\x0e-\x1f]*$")]  # as XML
# A whole number of hundreds of digits, which no float holds, is refused before anything is calculated with it.
Teeth = Annotated[int, Field(ge=-(10**9), le=10**9), between(5, 400)]
ThermalConductivity = Annotated[float, between(0.1, 500.0)]
SolidDensity = Annotated[float, between(900.0, 12000.0)]
SolidHeat = Annotated[float, between(100.0, 2500.0)]
HeatCapacity = Annotated[float, between(0.01, 1e8)]
FluidTemperature = Annotated[float, between(-60.0, 250.0, unit="_degC")]
Viscosity = Annotated[float, between(0.5, 1e5, unit="_mm2_s")]
Coefficient = Annotated[float, between(1e-4, 0.5)]
Position = Annotated[float, between(-5000.0, 5000.0)]  # along a shaft, mm


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

    @classmethod
    def known_keys(cls, path: Sequence[int | str]) -> tuple[str, ...]:
        """Return the keys that the table at a path below this one may have."""
        keys = {field.alias or key: field.annotation for key, field in cls.model_fields.items()}
        names = [step for step in path if isinstance(step, str)]
        below = _section_in(keys.get(names[0])) if names else None
        return below.known_keys(path[path.index(names[0]) + 1 :]) if below else tuple(keys)


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

    @model_validator(mode="after")
    def _stiffness_is_plausible(self) -> Self:
        stiffness = self.a1_Pa + self.a2_Pa_per_K * 333.15
        if not 1.5e7 <= stiffness <= 2.5e8:
            raise ValueError(
                f"a1 + a2 T is {stiffness:.3g} Pa at 60 degC, but 1.5e7 to 2.5e8 Pa (pressure-viscosity coefficients "
                "of 4 to 67 1/GPa) is plausible: check the signs, and that T is in K"
            )
        return self


class Gold(Section):
    """Pressure-viscosity coefficient after Gold: ``alpha = s nu^t 1e-9`` [1/Pa], nu in mm2/s.

    A pair such as s = 0.139, t = 0.9904 circulates swapped, and means s = 9.904, t = 0.139.
    """

    s: Annotated[float, between(2.0, 20.0)]
    t: Annotated[float, between(0.05, 0.3)]


def check_viscosity_points(points: Sequence[tuple[float, float]]) -> Sequence[tuple[float, float]]:
    """Two points (temperature, kinematic viscosity) of an oil, refused unless the hotter one is the thinner one."""
    (cold, nu_cold), (hot, nu_hot) = sorted(points)
    if cold == hot:
        raise ValueError(f"viscosity_points are both at {hot:g} degC; two different temperatures are needed")
    if nu_hot >= nu_cold:
        raise ValueError(
            f"viscosity_points: {nu_hot:g} mm2/s at {hot:g} degC is not below {nu_cold:g} mm2/s at {cold:g} degC; the "
            "hotter oil must be the thinner one"
        )
    return points


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

    @model_validator(mode="after")
    def _viscosity_is_given_once(self) -> Self:
        if (self.viscosity_points is None) == (self.d341 is None):
            raise ValueError("needs either viscosity_points or d341, and not both")
        return self

    @model_validator(mode="after")
    def _pressure_viscosity_has_its_table(self) -> Self:
        needed = "modulus" if self.pressure_viscosity == "modulus" else "gold"
        if getattr(self, needed) is None:
            keys = ", ".join((Modulus if needed == "modulus" else Gold).model_fields)
            raise ValueError(f"pressure_viscosity = '{self.pressure_viscosity}' needs [oil.{needed}] with {keys}")
        return self

    @model_validator(mode="after")
    def _viscosity_falls(self) -> Self:
        if self.viscosity_points is not None:
            check_viscosity_points(self.viscosity_points)
        if self.d341 is not None:
            with np.errstate(over="ignore"):
                nu = {T: float(kinematic_viscosity_d341(T, m=self.d341.m, n=self.d341.n)) for T in (40.0, 100.0)}
            for T, value in nu.items():
                if not 0.5 <= value <= 1e5:
                    raise ValueError(f"d341: m = {self.d341.m:g}, n = {self.d341.n:g} give {value:.3g} mm2/s at {T:g} "
                                     "degC; 0.5 to 1e5 is plausible")  # fmt: skip
        return self


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
    axis_height_mm: Annotated[float, between(-2000.0, 2000.0)] | None = None

    length = in_si("length_mm")
    diameter = in_si("diameter_mm")

    @property
    def axis_height(self) -> float:
        """Height of its axis above that of the input shaft, [m]; 0 where none is given."""
        return 1e-3 * (self.axis_height_mm or 0.0)

    @property
    def length_in_air(self) -> float:
        """Length that the surrounding air cools, [m]; the whole one where none is given, nothing without a surface."""
        given = self.length_mm if self.length_in_air_mm is None else self.length_in_air_mm
        return 1e-3 * given if self.surface_to_air else 0.0

    @model_validator(mode="after")
    def _length_in_air_fits(self) -> Self:
        if self.length_in_air_mm is not None:
            if not self.surface_to_air:
                raise ValueError(
                    f"length_in_air_mm is {self.length_in_air_mm:g}, but surface_to_air is false; set it to true"
                )
            if self.length_in_air_mm > self.length_mm:
                raise ValueError(
                    f"length_in_air_mm is {self.length_in_air_mm:g}, more than length_mm, which is {self.length_mm:g}"
                )
        return self


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
    roughness: Literal["of_the_law", "mean", "composite", "composite_rms"] = "of_the_law"
    film: Literal["hamrock_dowson", "dowson_toyoda", "grubin"] = "hamrock_dowson"
    thermal_reduction: Literal["gupta", "gupta_simple", "murch_wilson"] = "gupta"
    average: Literal["base_pitch", "path_of_contact"] = "base_pitch"
    load_floor: bool | None = None


class Rolling(Section):
    """``[stage.rolling]``: hydrodynamic rolling loss in the mesh."""

    model: Literal["anderson_loewenthal"]
    constant_N_m2: Annotated[float, between(1e6, 1e9)] = 9.0e7


MAUZ_WIDEST_MM = 60.0  # at 100 mm, 2166 1/min and 94 N m it would be ten times all other losses of the rig


class Churning(Section):
    """``[stage.churning]``: the gears in the oil bath; ``C_Sp`` is the splash factor of the Mauz formula."""

    model: Literal["niemann", "niemann_printed", "mauz", "changenet_velex", "changenet_2011"]
    C_Sp: Annotated[float, between(0.05, 10.0)] = 1.0


class Stage(Section):
    """``[[stage]]``: one pair of gears; every pair of numbers is (driver, driven)."""

    driver: Name
    driven: Name
    names: tuple[Name, Name] = ("pinion", "wheel")
    z: tuple[Teeth, Teeth]
    module_mm: Annotated[float, between(0.2, 50.0)]
    pressure_angle_deg: Annotated[float, between(10.0, 35.0)]
    helix_angle_deg: Annotated[float, between(0.0, 45.0)] = 0.0
    face_width_mm: Annotated[float, between(1.0, 1000.0)]
    center_distance_mm: Annotated[float, between(5.0, 5000.0)]
    profile_shift: tuple[Annotated[float, between(-2.0, 3.0)], Annotated[float, between(-2.0, 3.0)]]
    tip_shortening: bool = True
    tip_diameter_mm: tuple[Annotated[float, between(2.0, 5000.0)], Annotated[float, between(2.0, 5000.0)]] | None = None
    bore_mm: tuple[Annotated[float, between(1.0, 2000.0)], Annotated[float, between(1.0, 2000.0)]]
    position_mm: tuple[Position, Position] | None = None
    angle_deg: Annotated[float, between(-180.0, 180.0)] | None = None
    roughness_Ra_um: tuple[Annotated[float, between(0.01, 20.0)], Annotated[float, between(0.01, 20.0)]]
    material: Material = Material()
    load_sharing: Literal["potential_energy", "sanchez_pedrero", "equal", "ohlendorf"]
    friction: Friction
    rolling: Rolling
    churning: Churning

    module = in_si("module_mm")
    pressure_angle = in_si("pressure_angle_deg")
    helix_angle = in_si("helix_angle_deg")
    face_width = in_si("face_width_mm")
    center_distance = in_si("center_distance_mm")
    tip_diameter = InSI[tuple[float, float] | None]("tip_diameter_mm")
    roughness_Ra = InSI[tuple[float, float]]("roughness_Ra_um")

    @property
    def shafts(self) -> tuple[str, str]:
        """Names of the driving and the driven shaft."""
        return self.driver, self.driven

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
            beta=self.helix_angle,
            tip_shortening=self.tip_shortening,
            r_a=None if self.tip_diameter is None else (self.tip_diameter[0] / 2.0, self.tip_diameter[1] / 2.0),
        )

    @model_validator(mode="after")
    def _joins_two_shafts(self) -> Self:
        if self.driver == self.driven:
            raise ValueError(f"driver and driven are both '{self.driver}'; a stage joins two shafts")
        return self

    @model_validator(mode="after")
    def _churning_formula_holds(self) -> Self:
        if self.churning.model == "mauz" and self.face_width_mm > MAUZ_WIDEST_MM:
            raise ValueError(
                f"churning.model = 'mauz' with face_width_mm = {self.face_width_mm:g}: its torque goes with the cube "
                f"of the face width and is refused beyond {MAUZ_WIDEST_MM:g} mm; take 'changenet_2011'"
            )
        return self

    @model_validator(mode="after")
    def _gears_are_possible(self) -> Self:
        for name, bore, r_f in zip(self.names, self.bore_mm, self.pair().r_f, strict=True):
            if bore >= 2e3 * r_f:
                raise ValueError(f"bore_mm of '{name}' is {bore:g}, not below its root diameter {2e3 * r_f:.4g} mm")
        return self


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
    part: OneOrMore[HousingPart]

    @model_validator(mode="after")
    def _shares_sum_to_one(self) -> Self:
        total = sum(part.area_fraction for part in self.part)
        if abs(total - 1.0) > 1e-6:
            raise ValueError(f"the area_fraction of its parts sum to {total:g}, not to 1")
        return self

    @model_validator(mode="after")
    def _inside_is_not_larger(self) -> Self:
        if self.inside_area_m2 > self.outside_area_m2:
            raise ValueError(
                f"inside_area_m2 = {self.inside_area_m2:g} is above outside_area_m2 = {self.outside_area_m2:g}; a box "
                "has more area outside: correct one of them"
            )
        return self

    @model_validator(mode="after")
    def _foundation_has_a_part(self) -> Self:
        if self.foundation_conductance_W_K > 0.0 and not any(part.foundation for part in self.part):
            raise ValueError(
                "foundation_conductance_W_K is above 0, but no part stands on the foundation; "
                "set foundation = true for one of them"
            )
        return self


class Node(Section):
    """``[[node]]``: overrides the heat capacity of one node of the thermal network."""

    name: Name
    heat_capacity_J_K: HeatCapacity


class Training(Section):
    """``[training]``: the operating range that the surrogates are trained on, each key (lower, upper)."""

    speed_rpm: tuple[Annotated[float, between(1e-3, 1e5)], Annotated[float, between(1e-3, 1e5)]]
    torque_Nm: tuple[Annotated[float, between(1e-6, 1e6)], Annotated[float, between(1e-6, 1e6)]]
    temperature_degC: tuple[Annotated[float, between(-60.0, 300.0)], Annotated[float, between(-60.0, 300.0)]]

    @model_validator(mode="after")
    def _bounds_are_ordered(self) -> Self:
        for key in ("speed_rpm", "torque_Nm", "temperature_degC"):
            low, high = getattr(self, key)
            if low >= high:
                raise ValueError(f"{key}: the lower bound {low:g} is not below the upper bound {high:g}")
        return self
