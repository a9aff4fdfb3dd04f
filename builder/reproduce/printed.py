"""Values that the paper prints, and values that others print for its rig, its oils and its bearings.

Sources of the others: GEARpie and its gear library (cfernandesFEUP, University of Porto), load stages of the FZG test
(ISO 14635-1 as FEUP codes carry them), Arana et al. 2019 (Table 2), Fernandes et al. for bearing friction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

PAPER = (
    "A Data-Driven Approach to Estimate the Power Loss and Thermal Behaviour of Cylindrical Gearboxes under Transient "
    "Operating Conditions"
)

Row = tuple[str, str | float | tuple[float, float], str]  # quantity, value, path in the definition
TABLE_1: tuple[Row, ...] = (
    ("Center distance in mm", 91.5, "stage.0.center_distance_mm"),
    ("Number of teeth, pinion", 16, "stage.0.z.0"),
    ("Number of teeth, wheel", 24, "stage.0.z.1"),
    ("Normal module in mm", 4.5, "stage.0.module_mm"),
    ("Normal pressure angle in °", 20.0, "stage.0.pressure_angle_deg"),
    ("Helix angle in °", 0.0, "stage.0.helix_angle_deg"),
    ("Face width in mm", 14.0, "stage.0.face_width_mm"),
    ("Addendum modification, pinion", 0.182, "stage.0.profile_shift.0"),
    ("Addendum modification, wheel", 0.172, "stage.0.profile_shift.1"),
    ("Flank roughness, pinion, in µm", 0.174, "stage.0.roughness_Ra_um.0"),
    ("Flank roughness, wheel, in µm", 0.157, "stage.0.roughness_Ra_um.1"),
    ("Bearings", "NU 406", "bearing.0.designation"),
    ("Seal, input shaft, in mm", 24.0, "seal.0.diameter_mm"),
    ("Seal, output shaft, in mm", 54.0, "seal.1.diameter_mm"),
    ("Kin. viscosity at 40 °C in mm²/s", 32.63, "oil.viscosity_points.0.1"),
    ("Kin. viscosity at 100 °C in mm²/s", 5.45, "oil.viscosity_points.1.1"),
    ("Density at 15 °C in kg/m³", 876.8, "oil.density_kg_m3"),
)
TABLE_2: tuple[Row, ...] = (
    ("Gear sliding: partial EHL, Arana et al.", "arana", "stage.0.friction.model"),
    ("Gear rolling: Anderson", "anderson_loewenthal", "stage.0.rolling.model"),
    ("Gear churning: Niemann", "niemann", "stage.0.churning.model"),
    ("Bearings: SKF", "skf", "bearing.0.model"),
    ("Seals: Simmering model", "linke", "seal.0.model"),
)
TABLE_3 = (
    ("Hidden layers", "2"),
    ("Nodes per layer", "5"),
    ("Batch size", "64"),
    ("Epochs", "1000"),
    ("Activation", "sigmoid"),
    ("Training", "Levenberg-Marquardt"),
    ("Samples per network", "400"),
)
TABLE_4 = {"n in 1/min": (50.0, 6500.0), "T in N m": (1.0, 350.0), "all temperatures in °C": (20.0, 120.0)}
TABLE_5: tuple[Row, ...] = (
    ("Gearbox outside surface in m²", 0.214, "housing.outside_area_m2"),
    ("Gearbox inside surface in m²", 0.149, "housing.inside_area_m2"),
    ("Gearbox height in m", 0.215, "housing.height_m"),
    ("Wall thickness in m", 0.024, "housing.wall_thickness_m"),
    ("Heat transfer oil to housing in W/(m² K)", 950.0, "housing.oil_heat_transfer_W_m2K"),
    ("Conductivity of the housing in W/(m K)", 40.0, "housing.conductivity_W_mK"),
    ("Velocity of cooling air in m/s", 2.0, "ambient.air_speed_m_s"),
    ("Temperature of cooling air in °C", (25.0, 29.0), "ambient.temperature_degC"),
    ("Contact surface of forced air in m²", 0.214, "housing.outside_area_m2"),
    ("Length of pinion shaft in m", 0.223, "shaft.0.length_mm"),
    ("Diameter of pinion shaft in m", 0.024, "shaft.0.diameter_mm"),
    ("Length of wheel shaft in m", 0.090, "shaft.1.length_mm"),
    ("Diameter of wheel shaft in m", 0.055, "shaft.1.diameter_mm"),
    ("Conductivity of shafts in W/(m K)", 46.0, "shaft.0.conductivity_W_mK"),
)
# Table 6.
PITCH_VELOCITY = np.array([1.0, 2.0, 5.0, 8.3, 15.0, 20.0])  # m/s
TABLE_6_RPM = np.array([174.0, 348.0, 870.0, 1444.0, 2609.0, 3476.0])
OUTPUT_TORQUE = np.array([0.0, 141.0, 453.0])  # N m
STAGE_S = 3.0 * 3600.0
# Section 6, s.
TIMES = {("600 s", "F-PL"): 6410.0, ("600 s", "ROM-PL"): 3.8, ("18 h", "ROM-PL"): 110.0}


@dataclass(frozen=True)
class GearpieCase:
    """A case of GEARpie, in its units."""

    name: str
    b_mm: float
    X_L: float
    eta_mPas: float
    T_1: float
    n_1: float
    HVL: float
    mu: float
    P_VZP: float
    tip_shortening: bool = False
    Ra_um: tuple[float, float] = (0.4, 0.31)


GEARPIE = (
    GearpieCase("C14", 14.0, 0.846, 13.28, 200.0, 1500.0, 0.1946, 0.0449, 274.37),
    GearpieCase("C40", 40.0, 0.65, 49.85, 215.5, 1800.0, 0.1984, 0.0256, 206.31),
    # Its roughness is not published; both speeds imply 0.24 um.
    GearpieCase("REP", 14.0, 0.65, 11.83, 171.6, 300.0, 0.1914, 0.0421, 43.40, True, (0.24, 0.24)),
    GearpieCase("REP2", 14.0, 0.65, 11.83, 171.6, 1875.0, 0.1914, 0.0292, 188.02, True, (0.24, 0.24)),
)
LOAD_STAGES = {5: 94.1, 9: 302.0}  # pinion torque [N m], 0.5 m arm
# mm^2/s at 40, 60, 80, 90, 100 degC, ASTM D341 with 0.7; printed with two decimals.
PORTO_OILS = {
    "MINR": (316.0, 103.25, 43.68, 30.56, 22.23),
    "MINE": (325.88, 134.76, 66.17, 48.77, 36.98),
    "PAOR": (311.56, 124.98, 60.18, 44.06, 33.23),
    "ESTF": (321.84, 129.9, 62.77, 46.01, 34.72),
    "ESTR": (299.64, 117.6, 55.86, 40.71, 30.59),
    "PAGD": (287.34, 141.46, 78.55, 60.72, 47.92),
    "P150": (148.94, 64.52, 33.15, 24.97, 19.33),
    "FVA3": (99.39, 39.35, 19.28, 14.33, 10.99),
}
ARANA_OILS = {"N100": (97.9, 8.61), "M100": (96.0, 10.6), "PAO100": (94.1, 14.0)}  # at 40 and 100 degC
# Coefficients of roller bearings in a mineral gear oil (MINR), measured by Fernandes et al.
PORTO_BEARINGS = {"mu_bl": 0.0354, "mu_EHL": 0.0177}
