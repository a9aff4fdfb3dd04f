"""Single numbers of every law: published, worked by hand from the printed formula, or of an independent evaluation.

The independent evaluation was made with a separate program from the same sources, for the FZG rig with type C gears,
FVA 3 oil and NU 406 bearings; its numbers are known to their printed digits.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from models.assembly.gearbox import load_gearbox
from models.formulas import ehl, heat_transfer, mesh_stiffness, oil
from models.losses import bearing, churning, friction, seal

GEARBOX = load_gearbox("fzg")
PAIR, OIL = GEARBOX.stage[0].pair(), GEARBOX.lubricant()
NU_406 = GEARBOX.losses().term("bearing_1").law.bearing
E_RED = ehl.reduced_modulus(206e9, 0.3, 206e9, 0.3)
INDEPENDENT = "independent evaluation"
F = 200.0 / PAIR.r_b[0]
# Pitch point at 1500 rpm, 200 N m, 60 degC.
CONTACT: dict[str, Any] = {
    "R": PAIR.rho_red_C, "E_red": E_RED, "eta": float(OIL.dynamic_viscosity(60.0)),
    "alpha": float(OIL.film_pressure_viscosity_coefficient(60.0)), "V_e": 1500.0 * np.pi / 30.0 * PAIR.T1C,
}  # fmt: skip
GEAR: dict[str, Any] = {
    "h": 0.02, "r_p": 0.05, "b": 0.014, "z": 24, "tooth_height": 0.01, "alpha": np.radians(20.0), "V_oil": 1e-3,
    "nu": 15.41, "rho": 848.0,
}  # fmt: skip
SHEAR: dict[str, Any] = {"p_mean": 8e8, "eta": 50.0, "alpha": 1.2e-8, "h": 2e-7, "shear_limit": 0.047}
EYRING = 2.0 * 0.047 / 1.2e-8
DISK: dict[str, float] = {"radius": 0.059, "nu": 9.4e-6, "k": 0.127, "prandtl": 128.0}
SCHLENK: dict[str, Any] = {"v_sum_C": 8.0, "rho_red_C": 8e-3, "eta_oil": 0.01, "Ra": 0.4e-6, "X_L": 1.0}


def disk_speed(Re: float) -> float:
    return Re * DISK["nu"] / DISK["radius"] ** 2


def changenet(laminar: bool, omega: float) -> float:
    """Changenet and Velex written out: gear half dipped to theta = arccos 0.6, flanks counted."""
    theta = np.arccos(0.6)
    S_m = 0.05**2 * (2 * theta - np.sin(2 * theta)) + 0.1 * 0.014 * theta
    S_m += 2 * 24 * 0.01 * theta * 0.014 / (np.pi * np.cos(np.radians(20)))
    Fr = omega**2 * 0.05 / 9.80665
    if laminar:
        C_m = 1.366 * 0.2**0.45 * Fr**-0.6 * (omega * 0.05 * 0.014 / 15.41e-6) ** -0.21 * 0.14**0.21
    else:
        C_m = 3.644 * 0.2**0.1 * Fr**-0.88 * 0.14**0.85
    return float(0.5 * 848 * omega**3 * S_m * 0.05**3 * C_m)


class Point(NamedTuple):
    """A law at one point; the tolerance is relative, or half a printed digit as `half`."""

    law: Callable[..., Any]
    arguments: dict[str, Any]
    value: Any
    source: str
    rel: float = 1e-9
    half: float = 0.0


POINTS = [
    # Oil
    *(Point(OIL.kinematic_viscosity, {"T": T}, nu, INDEPENDENT, 0.0, 5.1e-3)
      for T, nu in ((20.0, 88.57), (40.0, 32.63), (60.0, 15.41), (90.0, 6.77), (120.0, 3.75))),
    *(Point(OIL.density, {"T": T}, rho, INDEPENDENT, 0.0, 0.05)
      for T, rho in ((20.0, 873.6), (40.0, 860.8), (60.0, 848.0), (90.0, 828.8), (120.0, 809.6))),
    *(Point(OIL.dynamic_viscosity, {"T": T}, eta, INDEPENDENT, 2e-3)
      for T, eta in ((20.0, 0.0774), (40.0, 0.0281), (60.0, 0.01307), (90.0, 0.00561), (120.0, 0.00304))),
    *(Point(lambda T: 1e9 * OIL.pressure_viscosity_coefficient(T, 0.0), {"T": T}, alpha, "modulus equation", 0.0, 0.05)
      for T, alpha in ((40.0, 17.9), (60.0, 16.4), (90.0, 14.5))),
    *(Point(lambda nu: 1e9 * np.asarray(oil.pressure_viscosity_gold(nu, 9.904, 0.139)),
            {"nu": float(OIL.kinematic_viscosity(T))}, alpha, "Gold", 0.0, 0.05)
      for T, alpha in ((40.0, 16.1), (60.0, 14.5), (90.0, 12.9))),
    Point(lambda: oil.modulus_scale(96.0, 32.63), {}, 1.162, "modulus equation", 0.0, 5e-4),
    Point(lambda: oil.modulus_scale(50.0, 50.0), {}, 1.0, "modulus equation"),
    Point(lambda: 1e9 * np.asarray(OIL.pressure_viscosity_coefficient(60.0, 1e9)), {}, 11.76, INDEPENDENT, 0.0, 5.1e-3),
    # Line contact
    Point(lambda: 1e6 * ehl.hertz_line(F / PAIR.b, PAIR.rho_red_C, E_RED)[0], {}, 199.5, INDEPENDENT, 0.0, 0.051),
    Point(lambda: 1e-6 * ehl.hertz_line(F / PAIR.b, PAIR.rho_red_C, E_RED)[1], {}, 1347.0, INDEPENDENT, 0.0, 0.51),
    Point(ehl.film_hamrock_dowson, CONTACT | {"F": F}, 0.163e-6, INDEPENDENT, 0.0, 5e-10),
    Point(ehl.film_dowson_toyoda, CONTACT | {"w": F / PAIR.b}, 0.197e-6, INDEPENDENT, 0.0, 5e-10),
    Point(ehl.film_grubin, CONTACT | {"w": F / PAIR.b}, 0.180e-6, INDEPENDENT, 0.0, 5e-10),
    Point(lambda: ehl.hertz_line(4e5, 8e-3, E_RED)[1], {}, np.sqrt(4e5 * E_RED / (2 * np.pi * 8e-3)), "Hertz"),
    Point(ehl.thermal_reduction_gupta, {"p_H": 0.005 * E_RED, "E_red": E_RED, "L": 0.5, "slide_roll_ratio": 0.4},
          (1 - 0.066 * 0.5**0.42) / (1 + 0.213 * (1 + 2.23 * 0.4**0.83) * 0.5**0.64), "Gupta, by hand"),
    Point(ehl.thermal_reduction_gupta, {"p_H": 2e9, "E_red": E_RED, "L": 1e4, "slide_roll_ratio": 0.0},
          0.1 / (1.0 + 0.213 * 1e4**0.64), "Gupta, numerator held at 0.1"),
    Point(ehl.thermal_reduction_gupta_simple, {"L": 0.5, "slide_roll_ratio": 0.4},
          1 / (1 + 0.1 * (1 + 14.8 * 0.4**0.83) * 0.5**0.64), "Gupta, by hand"),
    Point(ehl.thermal_reduction_gupta, {"p_H": 1e9, "E_red": E_RED, "L": 0.0, "slide_roll_ratio": 0.3}, 1.0, "no heat"),
    Point(ehl.thermal_reduction_gupta_simple, {"L": 0.0, "slide_roll_ratio": 0.3}, 1.0, "no heat"),
    Point(ehl.thermal_reduction_murch_wilson, {"L": 0.0}, 1.0, "no heat"),
    Point(ehl.thermal_reduction_murch_wilson, {"L": 0.5}, 3.94 / (3.94 + 0.5**0.62), "Murch and Wilson, by hand"),
    Point(ehl.band_source_resistance, {"b_H": 2e-4, "u": 3.0, "k": 46.0, "chi": 1.263e-5},
          4 / 3 * np.sqrt(2 / np.pi) / 46.0 * np.sqrt(1.263e-5 * 2e-4 / 3.0), "Blok; 1.06 rounds 1.0638", 4e-3),
    Point(lambda: ehl.asperity_share_doleschel(1e-7, 1e-7), {}, 0.25, "Doleschel"),
    Point(lambda: ehl.asperity_share_erf(1e-7, 1e-7), {}, 1.0 - 0.8427008, "erf(1)", 0.0, 1e-7),
    Point(lambda: ehl.asperity_share_diab(1e-7, 1e-7), {}, 0.25 * (1.0 - 0.6826895), "erf(1/sqrt 2)", 0.0, 1e-7),
    Point(lambda: ehl.asperity_share_matsumoto(1e-7 / 0.75, 1e-6), {}, 0.5, "Matsumoto"),
    Point(ehl.fluid_friction, SHEAR | {"V_s": 1e-6}, 50.0 * 1e-6 / 2e-7 / 8e8, "Newton", 1e-6),
    Point(ehl.fluid_friction, SHEAR | {"V_s": 0.1}, EYRING / 8e8 * np.arcsinh(50.0 * 0.1 / (EYRING * 2e-7)), "Eyring"),
    Point(ehl.fluid_friction, SHEAR | {"V_s": 1e9}, 0.047, "limiting shear stress"),
    Point(lambda: ehl.heat_partition(4.0, 1.0), {}, 2.0 / 3.0, "equal mean rise of both surfaces"),
    Point(ehl.thermal_loading, {"eta": 0.013, "beta": 0.0335, "V_e": 5.0, "k_oil": 0.129},
          0.013 * 0.0335 * 25 / 0.129, "definition"),
    # Friction
    Point(friction.friction_schlenk, SCHLENK | {"F_bt_per_b": 300e3},
          0.048 * (300 / 64) ** 0.2 * 10**-0.05 * 0.4**0.25, "Schlenk, by hand"),
    Point(friction.friction_schlenk, SCHLENK | {"F_bt_per_b": 1e3},
          0.048 * (150 / 64) ** 0.2 * 10**-0.05 * 0.4**0.25, "Schlenk, load held at 150 N/mm"),
    Point(friction.rolling_loss_anderson, {"h": 1e-7, "v_r": 10.0, "b": 0.014, "constant": 9.0e7}, 1.26, "Anderson"),
    Point(lambda: mesh_stiffness.hertz_compliance(b=14e-3, E=(206e9, 206e9), nu=(0.3, 0.3)), {},
          4.0 * 0.91 / (np.pi * 206e9 * 14e-3), "equal steels"),
    # Bearings: NU 406, 4463 N, 15.41 mm2/s; rolling, sliding and drag moment, N mm
    *(Point(NU_406.friction_moments, {"n_rpm": n, "F_r": 4463.0, "nu": 15.41}, moments, INDEPENDENT, 0.0, 0.051)
      for n, moments in ((2165.7, (127.1, 9.4, 12.0)), (5214.0, (193.5, 8.0, 64.0)), (261.0, (37.8, 41.8, 0.5)))),
    Point(lambda: bearing.oil_flow_max(90.0, 23.0), {}, 0.1656, "SKF, table", 0.0, 5e-5),
    Point(lambda: bearing.heat_dissipation_reference(30.0, 90.0, 23.0), {}, 2.775, "SKF, table", 0.0, 5e-4),
    # Churning
    Point(lambda: sum(churning.churning_niemann(e=r - 19e-3, b=PAIR.b, v_t=8.3) for r in PAIR.r_a), {}, 7.68,
          INDEPENDENT, 5e-3),
    Point(churning.churning_mauz, {"e": (22.226e-3, 40.181e-3), "b": 14e-3, "v_t": 8.3, "omega_2": 1.0}, 0.5394,
          "Mauz, by hand: C1 = 0.4283, C2 = 0.278", 0.0, 2e-4),
    Point(churning.churning_changenet_velex, GEAR | {"omega": 20.0}, changenet(True, 20.0), "Changenet, laminar"),
    Point(churning.churning_changenet_velex, GEAR | {"omega": 1e3}, changenet(False, 1e3), "Changenet, turbulent"),
    # Seals
    *(Point(lambda c: sum(seal.seal_loss_linke(d_mm=d, n_rpm=n, T_oil=60.0, nu_40=32.0, c_T=c)
                          for d, n in ((24.0, 2165.7), (54.0, 1443.8))), {"c": c}, watts, INDEPENDENT, 0.0, 5.1e-3)
      for c, watts in ((1.6, 61.25), (1.0, 80.90))),
    Point(seal.seal_loss_linke, {"d_mm": 24.0, "n_rpm": 1000.0, "T_oil": 60.0, "nu_40": 32.0}, 6.465,
          "Linke, by hand: (145 - 96 + 350 lg lg 32.8) 24^2 1000 1e-7", 0.0, 5e-4),
    Point(seal.seal_loss_linke, {"d_mm": 24.0, "n_rpm": 1000.0, "T_oil": 300.0, "nu_40": 32.0},
          seal.LOWEST_BRACKET * 24.0**2 * 1000.0 * 1e-7, "Linke, bracket held"),
    Point(seal.seal_loss_iso_simple, {"d_mm": 10.0, "n_rpm": 1000.0}, 0.769, "ISO/TR 14179"),
    # Heat transfer
    *(Point(lambda T: 1e6 * heat_transfer.air_kinematic_viscosity(T), {"T": T}, nu, "VDI heat atlas", 0.02)
      for T, nu in ((0.0, 13.5), (20.0, 15.3), (100.0, 23.2))),
    *(Point(heat_transfer.air_conductivity, {"T": T}, k, "VDI heat atlas", 0.03) for T, k in ((0.0, 0.024),
                                                                                             (100.0, 0.031))),
    *(Point(heat_transfer.convection_churchill_chu, {"T": T, "T_a": 27.0, "length": 0.215}, 6.5, "5 to 8 W/(m2 K)",
            0.0, 1.5) for T in (57.0, 127.0)),
    Point(lambda: 80.0 * heat_transfer.radiation(T=100.0, T_a=20.0, emissivity=0.8), {},
          0.8 * 5.670374e-8 * (373.15**4 - 293.15**4), "Stefan and Boltzmann"),
    Point(lambda: heat_transfer.series(2.0, 3.0), {}, 0.2, "definition"),
    Point(lambda omega: heat_transfer.rotating_disk(omega=omega, **DISK) * 0.059 / 0.127, {"omega": disk_speed(1e4)},
          0.585 * 100.0 / (0.6 / 128.0 + 0.95 / 128.0 ** (1 / 3)), "rotating disk, laminar"),
    Point(lambda omega: heat_transfer.rotating_disk(omega=omega, **DISK) * 0.059 / 0.127, {"omega": disk_speed(1e6)},
          0.021 * 1e6**0.8 * 128.0 ** (1 / 3), "rotating disk, turbulent"),
    Point(heat_transfer.fling_off, {"omega": 100.0, "radius": 0.05, "tooth_height": 0.01, "rho": 850.0, "c": 2000.0,
                                    "k": 0.13, "prandtl": 100.0},
          1.14 * 10.0 / (2 * np.pi) * np.sqrt(0.13 * 850 * 2000) * 20.0**0.25, "fling-off, by hand"),
]  # fmt: skip


@pytest.mark.parametrize("point", POINTS, ids=lambda p: f"{getattr(p.law, '__name__', 'law')}, {p.source}")
def test_point(point: Point) -> None:
    found = point.law(**point.arguments)
    assert np.asarray(found, float) == pytest.approx(np.asarray(point.value), rel=point.rel or 1e-15, abs=point.half)
