"""Correlations of the thermal network: how heat passes between air, housing, oil, gears, shafts and bearings.

Every function works on sympy expressions (the network's laws) and, through sympy's evaluation, on plain numbers. They
are written so that they stay finite and real at standstill and without a temperature difference.
"""

from __future__ import annotations

from typing import Any

import sympy as sp

from models.formulas.extremes import Max, Min
from models.quantities.units import KELVIN

STEFAN_BOLTZMANN = 5.670374e-8  # W/(m^2 K^4)
GRAVITY = 9.80665
PRANDTL_AIR = 0.71
RE_DISK_LAMINAR, RE_DISK_TURBULENT = 2.0e5, 2.5e5

Value = Any  # a number or a sympy expression


def air_kinematic_viscosity(T: Value) -> sp.Expr:
    """Kinematic viscosity of air at 1 atm from Sutherland's law and the ideal gas, [m^2/s]; `T` in degC.

    ``1.458e-6 T^1.5 / (T + 110.4)`` [Pa s] over the density ``352.99 / T`` [kg/m^3] with T in kelvin.

    Examples
    --------
    >>> round(float(air_kinematic_viscosity(20.0)) * 1e6, 1)
    15.1
    """
    theta = T + KELVIN
    return 1.458e-6 * theta**1.5 / (theta + 110.4) * theta / 352.99


def air_conductivity(T: Value) -> sp.Expr:
    """Thermal conductivity of air, ``0.0242 + 7.2e-5 T``, [W/(m K)]; `T` in degC, 0 to 150.

    References
    ----------
    Straight line through VDI heat atlas values (0.0242 at 0, 0.0314 at 100 degC); from memory.

    Examples
    --------
    >>> round(float(air_conductivity(60.0)), 4)
    0.0285
    """
    return 0.0242 + 7.2e-5 * T


def _film(T: Value, T_a: Value) -> Value:
    return (T + T_a) / 2


def _grashof(T: Value, T_a: Value, length: Value) -> sp.Expr:
    return GRAVITY * sp.Abs(T - T_a) / (T_a + KELVIN) * length**3 / air_kinematic_viscosity(_film(T, T_a)) ** 2


def convection_iso_14179(*, v_air: Value, T: Value, T_a: Value, length: Value) -> sp.Expr:
    r"""Heat transfer from a housing to air, forced and free, after ISO/TR 14179-2.

    .. math:: h = 0.0086\, Re'^{0.64} / l,\qquad Re' = \sqrt{Re^2 + Gr/2.5}

    Parameters
    ----------
    v_air : Value
        Air speed, [m/s]
    T, T_a : Value
        Wall and air temperature, [degC]
    length : Value
        Flow length (height of the housing), [m]

    Returns
    -------
    sympy.Expr
        [W/(m^2 K)]

    References
    ----------
    ISO/TR 14179-2:2001; from memory, checked against an independent evaluation (25.9 at 2 m/s, 60/27 degC; 1 % apart).

    Examples
    --------
    >>> round(float(convection_iso_14179(v_air=2.0, T=60.0, T_a=27.0, length=0.215)), 1)
    26.2
    """
    Re = v_air * length / air_kinematic_viscosity(_film(T, T_a))
    return 0.0086 * (Re**2 + _grashof(T, T_a, length) / 2.5) ** 0.32 / length


def convection_iso_14179_free(*, T: Value, T_a: Value, length: Value) -> sp.Expr:
    r"""Free convection from a housing after ISO/TR 14179-2.

    .. math:: h = 18\,H^{-0.1}(\Delta T/\Theta_a)^{0.3}

    in W/(m^2 K). Parameters as :func:`convection_iso_14179`. From memory; twice as much as Churchill-Chu on the FZG
    housing at 33 K, and alike at 2 K.

    Examples
    --------
    >>> round(float(convection_iso_14179_free(T=60.0, T_a=27.0, length=0.215)), 1)
    10.8
    """
    return 18.0 * length**-0.1 * (sp.Abs(T - T_a) / (T_a + KELVIN)) ** 0.3


def convection_churchill_chu(*, T: Value, T_a: Value, length: Value) -> sp.Expr:
    r"""Free convection on a vertical wall after Churchill and Chu (1975), [W/(m^2 K)].

    .. math:: Nu = \{0.825 + 0.387 Ra^{1/6} / [1 + (0.492/Pr)^{9/16}]^{8/27}\}^2

    Parameters as :func:`convection_iso_14179`.

    Examples
    --------
    >>> round(float(convection_churchill_chu(T=60.0, T_a=27.0, length=0.215)), 1)
    5.2
    """
    Ra = _grashof(T, T_a, length) * PRANDTL_AIR
    Nu = (0.825 + 0.387 * Ra ** sp.Float(1 / 6) / (1.0 + (0.492 / PRANDTL_AIR) ** (9 / 16)) ** (8 / 27)) ** 2
    return Nu * air_conductivity(_film(T, T_a)) / length


def convection_flat_plate(*, v_air: Value, T: Value, T_a: Value, length: Value) -> sp.Expr:
    r"""Heat transfer of a plate in parallel flow, [W/(m^2 K)].

    .. math:: Nu = \sqrt{Nu_{lam}^2 + Nu_{turb}^2}\quad\text{(Gnielinski)}

    Free convection is added by the cubic rule of mixed convection, so that standstill of the air stays physical.
    Parameters as :func:`convection_iso_14179`.

    References
    ----------
    VDI heat atlas, section G4; mixed convection Churchill 1977. From memory, checked against an independent evaluation
    (17.6 at 2 m/s, 60/27 degC without the free part).

    Examples
    --------
    >>> round(float(convection_flat_plate(v_air=2.0, T=60.0, T_a=27.0, length=0.215)), 1)
    18.1
    """
    T_film = _film(T, T_a)
    # Below 1 mm/s the turbulent form's Re^-0.1 would divide by zero; free convection rules there anyway.
    Re = Max(v_air, 1e-3) * length / air_kinematic_viscosity(T_film)
    laminar = 0.664 * Re**0.5 * PRANDTL_AIR ** (1 / 3)
    turbulent = 0.037 * Re**0.8 * PRANDTL_AIR / (1.0 + 2.443 * Re**-0.1 * (PRANDTL_AIR ** (2 / 3) - 1.0))
    forced = sp.sqrt(laminar**2 + turbulent**2) * air_conductivity(T_film) / length
    free = convection_churchill_chu(T=T, T_a=T_a, length=length)
    return (forced**3 + free**3) ** sp.Float(1 / 3)


def radiation(*, T: Value, T_a: Value, emissivity: Value) -> sp.Expr:
    """Heat transfer coefficient of radiation to surroundings of air temperature, [W/(m^2 K)]; Stefan-Boltzmann.

    ``emissivity sigma (T^2 + T_a^2) (T + T_a)`` with both in kelvin.

    Examples
    --------
    >>> round(float(radiation(T=60.0, T_a=27.0, emissivity=0.9)), 1)
    6.5
    """
    theta, theta_a = T + KELVIN, T_a + KELVIN
    return emissivity * STEFAN_BOLTZMANN * (theta**2 + theta_a**2) * (theta + theta_a)


def series(*resistances: Value) -> sp.Expr:
    """Conductance of resistances in series, [W/K]."""
    return 1.0 / sum(resistances)


def rotating_disk(*, omega: Value, radius: Value, nu: Value, k: Value, prandtl: Value) -> sp.Expr:
    r"""Mean heat transfer coefficient of a rotating disk's face.

    Laminar :math:`Nu_r = 0.585 Re^{1/2} / (0.6/Pr + 0.95/Pr^{1/3})` below Re = 2e5, turbulent
    :math:`0.021 Re^{0.8} Pr^{1/3}` above 2.5e5, linear between; :math:`Re = \omega r^2/\nu`.

    Parameters
    ----------
    omega : Value
        Speed, [rad/s], >= 0
    radius : Value
        [m]
    nu : Value
        Kinematic viscosity of the fluid, [m^2/s]
    k : Value
        Its conductivity, [W/(m K)]
    prandtl : Value
        Its Prandtl number, [-]

    Returns
    -------
    sympy.Expr
        [W/(m^2 K)]

    References
    ----------
    Cobb, Saunders, Proc. R. Soc. A 236 (1956), Dorfman 1963; from memory.

    Examples
    --------
    A disk of 200 mm in air of 60 degC, in laminar and in turbulent flow:

    >>> air = {"radius": 0.1, "nu": 1.89e-5, "k": 0.0285, "prandtl": 0.71}
    >>> [round(float(rotating_disk(omega=omega, **air)), 1) for omega in (100.0, 1000.0)]
    [20.1, 202.4]
    """
    Re = omega * radius**2 / nu
    laminar = 0.585 * sp.sqrt(Re) / (0.6 / prandtl + 0.95 / prandtl ** sp.Float(1 / 3))
    turbulent = 0.021 * Re**0.8 * prandtl ** sp.Float(1 / 3)
    share = Min(Max((Re - RE_DISK_LAMINAR) / (RE_DISK_TURBULENT - RE_DISK_LAMINAR), 0.0), 1.0)
    return ((1.0 - share) * laminar + share * turbulent) * k / radius


def fling_off(
    *, omega: Value, radius: Value, tooth_height: Value, rho: Value, c: Value, k: Value, prandtl: Value
) -> sp.Expr:
    r"""Mean heat transfer coefficient of teeth that fling off their oil, after de Winter and Blok.

    .. math:: h = 1.14\,\frac{\sqrt\omega}{2\pi}\sqrt{k\rho c}\left(\frac{Pr\,H}{r}\right)^{1/4}

    Parameters
    ----------
    omega : Value
        Speed of the gear, [rad/s], >= 0
    radius : Value
        Pitch radius, [m]
    tooth_height : Value
        [m]
    rho, c, k : Value
        Density [kg/m^3], specific heat [J/(kg K)] and conductivity [W/(m K)] of the oil
    prandtl : Value
        Prandtl number of the oil, [-]

    Returns
    -------
    sympy.Expr
        [W/(m^2 K)]

    References
    ----------
    De Winter, Blok, J. Engineering for Industry 96 (1974); form derived, constant from memory.

    Examples
    --------
    The FZG wheel at 8.3 m/s in oil of 60 degC:

    >>> oil = {"rho": 848.0, "c": 2000.0, "k": 0.129, "prandtl": 203.0}
    >>> round(float(fling_off(omega=151.0, radius=0.0549, tooth_height=9.9e-3, **oil)))
    2565
    """
    film = sp.sqrt(omega) / (2 * sp.pi.evalf()) * sp.sqrt(k * rho * c)
    return 1.14 * film * (prandtl * tooth_height / radius) ** 0.25
