"""Meaning and typical size of every key of a definition, for the schema, the commented files, and the reference.

Texts are by class of :mod:`models.definition.sections`, :mod:`models.definition.machine_definition` and
:mod:`models.definition.parametric_sections`, then by key.
Units and limits stand in the classes. A typical range is judgement for industrial gearboxes of 1 kW to 1 MW, and limits
nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class KeyText:
    """Meaning of a key, and the range in which it typically lies (in its unit), or ``""``."""

    meaning: str
    typical: str = ""


def _texts(**keys: str | tuple[str, str]) -> dict[str, KeyText]:
    return {key: KeyText(text) if isinstance(text, str) else KeyText(*text) for key, text in keys.items()}


MACHINE = _texts(
    schema="Version of this kind of file; always 1",
    name="Name of this machine, for people",
    input="Signals that recordings, cycles and hosts of the FMU give; laws use them by name",
    parameter="Numbers that several laws share; with an sd they are calibrated",
    boundary="Surroundings of a recorded temperature",
    part="Parts of one temperature each; with geometry those that are added to it, such as a bed",
    link="Heat paths; with geometry those that are added to it",
    heat="Heat by a law",
    recording="What the columns of this machine's recordings mean, as in a mapping file",
)
TEXTS: Mapping[str, Mapping[str, KeyText]] = {
    "Definition": MACHINE | _texts(
        ambient="The surroundings where a cycle or a recording names none",
        oil="The filling",
        shaft="One shaft more than stages; the first one that drives is the input of the model",
        stage="One pair of gears each, spur or helical, from the input shaft on",
        bearing="Rolling bearings; every shaft needs at least one",
        seal="Radial shaft seals",
        housing="The box as a whole",
        node="Heat capacities that are known better than from the geometry",
        factors="Tunable factors on the formulas, 1 by default; with an sd a factor is calibrated",
        training="Operating range that the networks of the FMU are trained on",
    ),
    "Ambient": _texts(
        temperature_degC=("Temperature of the surrounding air", "10 to 40"),
        air_speed_m_s=("Speed of the air along the housing, 0 without a fan", "0 to 3"),
    ),
    "D341": _texts(
        m=("Intercept of the viscosity line", "7 to 10"),
        n=("Slope of the viscosity line", "2.5 to 4"),
    ),
    "Modulus": _texts(
        a1_Pa=("Constant part of A", "-5e7 to 5e7"),
        a2_Pa_per_K=("Part of A that grows with the temperature", "1e5 to 4e5"),
        b1=("Constant part of B", "-0.1 to 0.1"),
        b2_per_K=("Part of B that grows with the temperature", "1e-4 to 4e-4"),
        nu_40_mm2_s=("Viscosity at 40 degC of the oil on which they were measured", "20 to 500"),
    ),
    "Gold": _texts(
        s=("Factor of the pressure-viscosity coefficient", "6 to 11"),
        t=("Exponent of the viscosity", "0.1 to 0.2"),
    ),
    "Oil": _texts(
        named="Oil of the package whose values fill what is not given here: a product, or a grade such as ISO_VG_220",
        name="Name of the oil, for people",
        base="Kind of base oil",
        viscosity_points="Two points of temperature [degC] and kinematic viscosity [mm2/s], mostly at 40 and 100 degC; "
                         "[[40.0, 220.0], [100.0, 19.0]] is about ISO VG 220",
        d341="Constants of the viscosity line, in place of viscosity_points",
        density_kg_m3=("Density at density_temperature_degC", "850 to 1080"),
        density_temperature_degC="Temperature of that density",
        thermal_expansion_1_K=("Relative loss of density per kelvin", "6e-4 to 8e-4"),
        specific_heat_J_kgK=("Specific heat; by Cragoe's formula from the density if not given", "1800 to 2300"),
        conductivity_W_mK=("Thermal conductivity; by Cragoe's formula if not given", "0.12 to 0.15"),
        pressure_viscosity="Law of the viscosity under pressure: modulus needs [oil.modulus], roelands [oil.gold]",
        modulus="Constants of the modulus equation",
        gold="Constants of Gold's pressure-viscosity coefficient",
        limiting_shear_coefficient=("Limiting shear stress over pressure", "0.03 to 0.08"),
        schlenk_X_L=("Lubricant factor of ISO/TR 14179-2", "0.6 to 1"),
        level_below_axis_mm=("Oil level at standstill below the shaft axis, negative above it", "0 to 150"),
        volume_l=("Volume of the filling", "0.5 to 50"),
    ),
    "Shaft": _texts(
        name="Name of the shaft, which gears, bearings and seals refer to",
        length_mm=("Length of the cylinder in place of the shaft", "80 to 800"),
        diameter_mm=("Its diameter; one value for a stepped shaft", "15 to 150"),
        conductivity_W_mK=("Thermal conductivity of the steel", "40 to 50"),
        heat_capacity_J_K=("Heat capacity; from the cylinder if not given", "100 to 10000"),
        surface_to_air="Whether a part of it stands in the air outside",
        length_in_air_mm=("Length of that part; the whole shaft if not given", "20 to 200"),
        axis_height_mm=("Height of its axis above that of the input shaft, negative below it; 0 if not given",
                        "-300 to 300"),
    ),
    "Material": _texts(
        youngs_modulus_GPa=("Young's modulus", "200 to 210"),
        poisson=("Poisson's ratio", "0.28 to 0.3"),
        density_kg_m3=("Density", "7800 to 7900"),
        specific_heat_J_kgK=("Specific heat", "450 to 500"),
        conductivity_W_mK=("Thermal conductivity", "35 to 50"),
    ),
    "Friction": _texts(
        model="Law of the sliding friction",
        mu_solid=("Friction coefficient of the asperities that touch", "0.05 to 0.12"),
        asperity_load_share="Law of the load share of the asperities",
        roughness="How the roughness of both flanks is combined (of_the_law: mean; with erf and diab composite_rms)",
        film="Formula of the film thickness",
        thermal_reduction="Reduction of the film by heating of the inlet",
        average="Over what the friction power is averaged",
        load_floor="false: Schlenk's friction falls with the load below the 150 N/mm of ISO/TR 14179-2 too",
    ),
    "Rolling": _texts(
        model="Law of the rolling loss",
        constant_N_m2=("Its constant", "9e7"),
    ),
    "Churning": _texts(
        model="Law of the churning loss of gears in the oil",
        C_Sp=("Splash factor of the Mauz formula", "0.5 to 2"),
    ),
    "Stage": _texts(
        driver="Name of the driving shaft",
        driven="Name of the driven shaft",
        names="Names of both gears (driver, driven)",
        z=("Numbers of teeth (driver, driven)", "15 to 120"),
        module_mm=("Normal module", "1 to 12"),
        pressure_angle_deg=("Normal pressure angle", "20"),
        helix_angle_deg=("Helix angle at the reference circle, of either hand; 0 of spur gears", "8 to 30"),
        face_width_mm=("Common face width", "10 to 200"),
        center_distance_mm=("Distance of the shaft axes", "50 to 500"),
        profile_shift=("Profile shift coefficients (driver, driven)", "-0.5 to 1"),
        tip_shortening="Whether the tips are shortened to keep the clearance",
        tip_diameter_mm="Tip diameters, where they differ from the basic rack's",
        bore_mm=("Bores of both gears, for the compliance of their bodies", "15 to 150"),
        position_mm=("Middle of the gear along the driving and along the driven shaft, where bearings have positions",
                     "20 to 300"),
        angle_deg=("Angle of its centre line to that of the stage before: 180 in one plane, 0 folded back", "180"),
        roughness_Ra_um=("Arithmetic mean roughness of the flanks (driver, driven)", "0.2 to 0.8 (ground)"),
        material="Steel of the gears",
        load_sharing="Law of the load on one pair of teeth along the path of contact",
        friction="Sliding friction in the mesh",
        rolling="Rolling loss in the mesh",
        churning="The gears in the oil bath",
    ),
    "Bearing": _texts(
        name="Name of the bearing, and of its thermal node",
        like="Name of an earlier bearing: take all its values that are not given here",
        shaft="Name of the shaft that it carries",
        designation="Designation; of known ones (check --known lists them) sizes and constants are filled in",
        type="Kind of bearing",
        bore_mm=("Bore d", "15 to 150"),
        outside_diameter_mm=("Outside diameter D", "35 to 300"),
        width_mm=("Width B", "10 to 70"),
        mass_kg=("Mass", "0.1 to 10"),
        model="Law of the friction moment",
        R1=("Rolling constant of the series (SKF, table of geometry constants)", "1e-6 to 1.5e-6; balls 4e-7"),
        S1=("Sliding constant of the series (SKF): of balls and tapers; of rollers with an axial load, else 0.16",
            "balls 0.002 to 0.004, tapers 0.01 to 0.03"),
        S2=("Sliding constant of the series (SKF): of rollers; of balls with an axial load", "0.0015; balls 4 to 200"),
        K_rs=("Replenishment constant: 3e-8 in a low oil bath, 0 where rollers are flooded (SKF)", "0 to 6e-8"),
        K_Z=("Constant of the bearing type (SKF); by the type if not given", "rollers 5.1, balls 3.1, tapers 6"),
        K_L=("Constant of the roller bearing type (SKF); by the type if not given", "rollers 0.65, tapers 0.7"),
        mu_bl=("Friction coefficient in mixed lubrication", "0.03 to 0.15"),
        mu_EHL=("Friction coefficient of the full film; by the type if not given",
                "rollers 0.02, balls 0.05, tapers 0.002"),
        oil_level_mm=("Oil level above the lowest contact of the outer ring; by the sump if not given", "0 to 30"),
        temperature="Oil temperature in the bearing: mean of sump and bearing, or SKF's outlet temperature",
        load_share=("Share of the tooth forces of its shaft; the shares on a shaft sum to 1", "0.3 to 0.7"),
        position_mm=("Place along its shaft, in place of load_share; then two bearings carry the shaft as a beam",
                     "0 to 500"),
        locating="Whether it takes the axial force of helical gears; one bearing of each shaft does",
        static_load_kN=("Static load rating C0 of a ball bearing, read with an axial load", "5 to 100"),
        Y=("Axial load factor of a taper bearing (catalogue)", "1.3 to 2"),
        drag="Edition of SKF's drag formula",
        heat_dissipation_W_K=("Heat that the seat sheds, read with temperature = 'skf_outlet'", "1 to 10"),
    ),
    "Seal": _texts(
        name="Name of the seal",
        like="Name of an earlier seal: take all its values that are not given here",
        shaft="Name of the shaft that it seals",
        diameter_mm=("Diameter of the shaft at the lip", "15 to 150"),
        model="Law of the seal friction",
        nu_40_mm2_s=("Grade of the oil; its viscosity at 40 degC if not given", "32 to 460"),
        temperature_coefficient=("Coefficient of the temperature in Linke's formula", "1.6"),
    ),
    "HousingPart": _texts(
        name="Name of the part, and of its thermal node",
        area_fraction=("Share of the housing's areas; the shares sum to 1", "0.2 to 1"),
        foundation="Whether it stands on the foundation",
    ),
    "Housing": _texts(
        inside_area_m2=("Wetted area inside", "0.05 to 3"),
        outside_area_m2=("Area outside that gives heat to the air, ribs included", "0.1 to 5"),
        height_m=("Height, the length of free convection", "0.1 to 1"),
        wall_thickness_m=("Thickness of the wall", "0.006 to 0.03"),
        conductivity_W_mK=("Thermal conductivity of the wall", "40 to 50 (cast iron), 150 (aluminium)"),
        density_kg_m3=("Density of the wall", "7200 (cast iron), 2700 (aluminium)"),
        specific_heat_J_kgK=("Specific heat of the wall", "500 (cast iron), 900 (aluminium)"),
        oil_heat_transfer_W_m2K=("Heat transfer coefficient from oil to wall", "100 to 1000"),
        emissivity=("Emissivity of the outside", "0.8 to 0.95 (paint), 0.1 to 0.3 (bare metal)"),
        convection="Law of the convection to air; iso_14179_free and churchill_chu know no air speed",
        foundation_conductance_W_K=("Heat path to the foundation, 0 without one", "0 to 10"),
        joint_conductance_W_K=("Heat path between neighbouring parts", "2 to 50"),
        part="Parts of one temperature each; neighbours in the file are joined",
    ),
    "Node": _texts(
        name="Name of the node",
        heat_capacity_J_K=("Its heat capacity", "2 (mesh) to 1e5"),
    ),
    "Training": _texts(
        speed_rpm=("Lowest and highest speed of the input shaft", "[1, 3000]"),
        torque_Nm=("Lowest and highest torque at the input shaft, by size", "[1, 500]"),
        temperature_degC=("Lowest and highest temperature of any part", "[-20, 150]"),
    ),
    "ParametricDefinition": MACHINE | _texts(
        reference="Where the losses are stated, and the speed between standing and running",
        ambient="The air where a recording names none",
        oil="Two points of the oil's viscosity, known or assumed",
        torque="Torque from a measured power",
        loss="Losses by powers of speed, torque and viscosity",
    ),
    "Reference": _texts(
        speed_rpm=("Speed of the input shaft", "500 to 3000"),
        torque_Nm=("Torque at the input shaft", "10 to 10000"),
        temperature_degC=("Temperature of the oil", "50 to 80"),
        running_rpm=("Speed from which it counts as running", "1 to 500"),
    ),
    "Surroundings": _texts(temperature_degC=("Temperature of the air", "10 to 40")),
    "Lubricant": _texts(
        viscosity_points="Two points of temperature [degC] and kinematic viscosity [mm2/s]; "
                         "[[40.0, 320.0], [100.0, 24.0]] is about ISO VG 320",
    ),
    "NamedInput": _texts(
        name="Name in laws, and of the column in files",
        quantity="Kind of quantity: speed, torque, temperature, power, volume flow, ... or switch",
        unit="Unit of laws, range, default and files",
        range="Lowest and highest plausible value",
        default="Value where a cycle has no such column; without it the column is needed",
        description="What it is, for people",
    ),
    "Boundary": _texts(
        name="Name of the surroundings, which links refer to",
        input="Name of the signal: T_ambient, T_<name>, or an [[input]]",
        temperature_degC=("Temperature where nothing is recorded", "10 to 40"),
    ),
    "Part": _texts(
        name="Name of the part; its temperature is T_<name>",
        heat_capacity_J_K=("Heat capacity: mass times 460 (steel), 500 (iron), 900 (aluminium), 2000 (oil) J/(kg K)",
                           "100 to 1e6"),
        group="What mechanisms take it for: housing, bearings, gears, shafts, or returns of the oil",
    ),
    "Path": _texts(
        between="Two parts, or a part and a boundary; with geometry any of its nodes too",
        conductance_W_K=("Conductance: heat per kelvin", "0.1 to 1000"),
        standstill_share=("Share of it that is left when the gearbox stands; without geometry", "0.1 to 1"),
        factor='Law without unit on the conductance, of inputs and temperatures, such as "oil_flow / 20"',
    ),
    "Heat": _texts(
        name="Name of the heat",
        part="Part that it warms, or several that share it evenly",
        heat_W="Law of inputs and temperatures",
        gain=("Factor on it; with an sd it is calibrated", "1"),
    ),
    "NamedParameter": _texts(
        name="Name in laws",
        start="Its value, above 0",
        unit="Its unit, for people",
        description="What it is, for people",
    ),
    "TorqueFromPower": _texts(
        power="Name of the [[input]] with the power",
        efficiency=("Mechanical over measured power", "motor 0.85 to 0.97; generator 1.03 to 1.18"),
    ),
    "Loss": _texts(
        name="Name of the loss",
        part="Part that it warms",
        kind="What loses it, for mechanisms: gears, bearings, seals or other; unless stated by its part and name",
        no_load_W=("Heat at the reference that does not depend on the load", "0.2 to 1 % of the rated power"),
        speed_exponent=("How that part goes with the speed", "1 to 2"),
        viscosity_exponent=("How that part goes with the viscosity", "0 to 0.6"),
        load_W=("Heat at the reference by the load", "0.5 to 1.5 % of the rated power"),
        torque_exponent=("How that part goes with the torque", "1 to 1.5"),
    ),
}  # fmt: skip
