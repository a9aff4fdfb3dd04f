"""Published heat transfer laws for arrays: walls to air, gears and walls to oil, shaft ends to air.

The formulas of :mod:`models.formulas.heat_transfer` are symbolic; these are numbers.
"""

from __future__ import annotations

import numpy as np

from models.base.types import Array

GRAVITY, KELVIN, STEFAN_BOLTZMANN, PRANDTL = 9.80665, 273.15, 5.670374e-8, 0.71


def air(T: Array) -> tuple[Array, Array]:
    """Kinematic viscosity [m^2/s] and conductivity [W/(m K)] of air; Sutherland, and a line through the VDI values."""
    theta = T + KELVIN
    return 1.458e-6 * theta**1.5 / (theta + 110.4) * theta / 352.99, 0.0242 + 7.2e-5 * T


def _rayleigh(T: Array, T_a: Array, L: float) -> tuple[Array, Array, Array]:
    nu, k = air(0.5 * (T + T_a))
    Ra = GRAVITY * np.sqrt((T - T_a) ** 2 + 0.04) / (T_a + KELVIN) * L**3 / nu**2 * PRANDTL
    return Ra, nu, k


def _free_plate(T: Array, T_a: Array, L: float) -> tuple[Array, Array, Array]:
    """Nusselt number of free convection of a vertical plate (Churchill and Chu 1975), and of the air nu and k."""
    Ra, nu, k = _rayleigh(T, T_a, L)
    return (0.825 + 0.387 * Ra ** (1.0 / 6.0) / (1.0 + (0.492 / PRANDTL) ** 0.5625) ** (8.0 / 27.0)) ** 2, nu, k


def churchill_chu(T: Array, T_a: Array, v: Array, L: float) -> Array:
    """Free convection of a vertical plate after Churchill and Chu, forced of a laminar plate, cubes added, [W/(m2 K)].

    References
    ----------
    Churchill, Chu, Int. J. Heat Mass Transfer 18 (1975); 5.2 at 60/27 degC, 0.215 m. Laminar plate 0.664 Re^0.5.
    """
    free, nu, k = _free_plate(T, T_a, L)
    forced = 0.664 * np.sqrt(v * L / nu) * PRANDTL ** (1.0 / 3.0)
    return np.asarray((free**3 + forced**3) ** (1.0 / 3.0) * k / L)


def gnielinski_plate(T: Array, T_a: Array, v: Array, L: float) -> Array:
    """Forced plate after Gnielinski, ``sqrt(Nu_lam^2 + Nu_turb^2)``, with Churchill and Chu's free part, [W/(m2 K)].

    References
    ----------
    VDI heat atlas, G4; 16.2 at 2 m/s, 60/27 degC, 0.215 m.
    """
    free, nu, k = _free_plate(T, T_a, L)
    Re = np.maximum(v * L / nu, 1.0)
    laminar = 0.664 * np.sqrt(Re) * PRANDTL ** (1.0 / 3.0)
    turbulent = 0.037 * Re**0.8 * PRANDTL / (1.0 + 2.443 * Re**-0.1 * (PRANDTL ** (2.0 / 3.0) - 1.0))
    return np.asarray((free**3 + laminar**3 + turbulent**3) ** (1.0 / 3.0) * k / L)


def mcadams(T: Array, T_a: Array, v: Array, L: float) -> Array:
    """McAdams' simplified free convection ``1.42 (dT/L)^0.25`` and his wind line ``3.9 v``, [W/(m2 K)].

    References
    ----------
    Holman, "Heat Transfer", simplified equations; McAdams, "Heat Transmission" (h = 5.7 + 3.8 v for walls in wind, of
    which 5.7 is free convection and radiation). From memory; 5.0 against Churchill and Chu's 5.2 at 60/27 degC.
    """
    rise = np.sqrt((T - T_a) ** 2 + 0.04)
    return np.asarray(1.42 * (rise / L) ** 0.25 + 3.9 * v)


def hilpert_box(T: Array, T_a: Array, v: Array, L: float) -> Array:
    """A square box across a stream after Hilpert, ``0.102 Re^0.675 Pr^(1/3)``, free by VDI ``0.15 Ra^(1/3)``.

    References
    ----------
    Hilpert 1933, in Incropera, table of non-circular cylinders, 5e3 < Re < 1e5. From memory; verified by
    16.4 at 2 m/s, 60/27 degC, 0.215 m, that of Gnielinski's plate.
    """
    Ra, nu, k = _rayleigh(T, T_a, L)
    return np.asarray((0.15 * Ra ** (1.0 / 3.0) + 0.102 * (v * L / nu) ** 0.675 * PRANDTL ** (1.0 / 3.0)) * k / L)


def iso_14179(T: Array, T_a: Array, v: Array, L: float) -> Array:
    """ISO/TR 14179-2: ``0.0086 Re'^0.64 / L``, ``Re' = sqrt(Re^2 + Gr/2.5)``, [W/(m2 K)].

    References
    ----------
    ISO/TR 14179-2:2001. From memory; verified by 26 at 2 m/s, 60/27 degC, 0.215 m.
    """
    Ra, nu, _ = _rayleigh(T, T_a, L)
    return np.asarray(0.0086 * ((v * L / nu) ** 2 + Ra / PRANDTL / 2.5) ** 0.32 / L)


def radiation(T: Array, T_a: Array, emissivity: Array | float) -> Array:
    """Heat transfer coefficient of grey radiation (Stefan-Boltzmann), [W/(m^2 K)]."""
    a, b = T + KELVIN, T_a + KELVIN
    return np.asarray(emissivity * STEFAN_BOLTZMANN * (a**2 + b**2) * (a + b))


def rotating_disk(omega: Array, radius: float, nu: Array, k: float, prandtl: Array) -> Array:
    """Face of a disk in oil after Dorfman, laminar below Re = 2e5 and turbulent above 2.5e5, [W/(m^2 K)].

    References
    ----------
    Dorfman, "Hydrodynamic Resistance and the Heat Loss of Rotating Solids" (1963), Cobb and Saunders 1956; from memory,
    as :func:`models.formulas.heat_transfer.rotating_disk`.
    """
    Re = omega * radius**2 / (nu * 1e-6)
    laminar = 0.585 * np.sqrt(Re) / (0.6 / prandtl + 0.95 / prandtl ** (1.0 / 3.0))
    turbulent = 0.021 * Re**0.8 * prandtl ** (1.0 / 3.0)
    share = np.clip((Re - 2e5) / 5e4, 0.0, 1.0)
    return np.asarray(((1.0 - share) * laminar + share * turbulent) * k / radius)


def fling_off(omega: Array, radius: float, tooth_height: float, rho_c_k: float, prandtl: Array) -> Array:
    """Teeth that fling off their oil after de Winter and Blok, [W/(m^2 K)].

    References
    ----------
    J. Engineering for Industry 96 (1974); as :func:`models.formulas.heat_transfer.fling_off`.
    """
    return np.asarray(
        1.14 * np.sqrt(omega) / (2.0 * np.pi) * np.sqrt(rho_c_k) * (prandtl * tooth_height / radius) ** 0.25
    )


def jet_sprayed(omega: Array, radius: float, nu: Array, k: float, prandtl: Array) -> Array:
    """A gear as a cylinder that turns in oil, ``0.133 Re^(2/3) Pr^(1/3)``, with Re of its diameter, [W/(m^2 K)].

    References
    ----------
    Becker, Int. J. Heat Mass Transfer 6 (1963): cylinders in water, Re 1e3 to 1e5.
    """
    D = 2.0 * radius
    return np.asarray(0.133 * (omega * D**2 / (2.0 * nu * 1e-6)) ** (2.0 / 3.0) * prandtl ** (1.0 / 3.0) * k / D)


def shaft_end(omega: Array, diameter: float, T_a: Array) -> Array:
    """A turning shaft in air after Becker, at rest 5, [W/(m^2 K)]."""
    nu, k = air(T_a)
    Re = omega * diameter**2 / (2.0 * nu)
    return np.asarray(np.maximum(0.133 * Re ** (2.0 / 3.0) * PRANDTL ** (1.0 / 3.0) * k / diameter, 5.0))
