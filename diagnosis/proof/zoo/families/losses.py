"""Published loss formulas, written again without the code of the nominal model, for arrays of any shape.

Speeds may be zero; temperatures are degC, everything else SI unless a name has another unit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.base.types import Array
from models.definition.bearing_section import Bearing

GRAVITY = 9.80665
RPM = np.pi / 30.0


# ---------------------------------------------------------------------- friction of the mesh


@dataclass(frozen=True, kw_only=True)
class Contact:
    """A mesh at work, for formulas of a mean friction coefficient.

    Attributes
    ----------
    w : Array
        Normal force per face width, [N/m]
    v_s, v_r : Array
        Mean sliding speed and sum of the rolling speeds at the pitch point, [m/s]
    eta : Array
        Dynamic viscosity, [Pa s]
    nu : Array
        Kinematic viscosity, [mm^2/s]
    R : float
        Reduced radius at the pitch point, [m]
    Ra_um : float
        Mean roughness, [um]
    E_red : float
        Reduced modulus, [Pa]
    """

    w: Array
    v_s: Array
    v_r: Array
    eta: Array
    nu: Array
    R: float
    Ra_um: float
    E_red: float


def friction_schlenk(contact: Contact) -> Array:
    """Schlenk / Niemann, ISO/TR 14179-2: ``0.048 (w / (v_r R))^0.2 eta^-0.05 Ra^0.25``, N/mm, mm, mPa s, um.

    References
    ----------
    Schlenk, thesis, TU Munich 1994; ISO/TR 14179-2:2001. Without the least load of 150 N/mm, as WTplus has it. Verified
    by 0.035 at the FZG pair, 8.3 m/s, 94 N m, 60 degC.
    """
    load = np.maximum(contact.w, 2e3) * 1e-3 / (np.maximum(contact.v_r, 0.02) * contact.R * 1e3)
    return np.asarray(0.048 * load**0.2 * (contact.eta * 1e3) ** -0.05 * contact.Ra_um**0.25)


def friction_benedict_kelley(contact: Contact) -> Array:
    """Benedict and Kelley: ``0.0127 log10(29.66 w / (eta v_s v_r^2))`` with w in N/m, eta in mPa s.

    References
    ----------
    Benedict, Kelley, ASLE Transactions 4 (1961). From memory; verified by converting the US form, 3.17e8 lb/in over
    cP (in/s)^3, and by 0.049 at the FZG pair, 8.3 m/s, 94 N m, 60 degC.
    """
    speeds = np.maximum(contact.v_s, 2e-3) * np.maximum(contact.v_r, 2e-3) ** 2
    inside = 29.66 * np.maximum(contact.w, 5e3) / (contact.eta * 1e3 * speeds)
    return np.asarray(np.clip(0.0127 * np.log10(inside), 0.01, 0.11))


def friction_odonoghue_cameron(contact: Contact) -> Array:
    """O'Donoghue and Cameron: ``0.6 (S + 22) / 35 / (nu^(1/8) v_s^(1/3) v_r^(1/6) R^(1/2))``, inch, cSt, microinch.

    It knows no load. S counts as 10 microinch at least.

    References
    ----------
    O'Donoghue, Cameron, ASLE Transactions 9 (1966). From memory; verified by 0.064 at the FZG pair, 8.3 m/s, 60 degC,
    a third above the highest of the other formulas.
    """
    inch = 0.0254
    v_s, v_r = np.maximum(contact.v_s, 0.05) / inch, np.maximum(contact.v_r, 0.05) / inch
    rough = 0.6 * (max(contact.Ra_um / 0.0254, 10.0) + 22.0) / 35.0
    mu = rough / (contact.nu**0.125 * v_s ** (1.0 / 3.0) * v_r ** (1.0 / 6.0) * np.sqrt(contact.R / inch))
    return np.asarray(np.clip(mu, 0.01, 0.08))  # dry asperities of ground steel end there


def friction_drozdov(contact: Contact) -> Array:
    """Drozdov and Gavrikov: ``1 / (0.8 nu^0.5 v_s + phi v_r + 13.4)``, ``phi = 0.47 - 1.3e-5 p - 4e-4 nu``.

    cSt, m/s, and the Hertz pressure p in kgf/cm2.

    References
    ----------
    Drozdov, Gavrikov, Wear 11 (1968). From memory; verified by 0.048 at the FZG pair, 8.3 m/s, 94 N m, 60 degC, and
    0.07 to 0.03 from 1 to 20 m/s. Fitted to 4 to 500 cSt and 4000 to 16000 kgf/cm2: held inside.
    """
    p = np.sqrt(np.maximum(contact.w, 2e3) * contact.E_red / (2.0 * np.pi * contact.R)) / 98066.5
    nu = np.clip(contact.nu, 4.0, 500.0)
    phi = 0.47 - 1.3e-5 * np.clip(p, 4e3, 1.6e4) - 4e-4 * nu
    return np.asarray(1.0 / (0.8 * np.sqrt(nu) * contact.v_s + phi * contact.v_r + 13.4))


def friction_doleschel(contact: Contact) -> Array:
    """Doleschel (FVA 345): solid and film friction mixed, ``xi mu_F + (1 - xi) mu_EHD``, ``xi = (1 - lambda/2)^2``.

    ``mu_EHD = 0.0335 (p / 1 GPa)^0.3 (v_r / 8.3)^-0.1 (eta / 20)^0.1``, ``mu_F = 0.08 (v_r / 0.2)^-0.1``; lambda by
    Dowson and Higginson's film at the pitch point.

    References
    ----------
    Doleschel, thesis, TU Munich 2002. The constants belong to an oil and come from a test there; these are of the size
    of a mineral oil's, from memory, verified by 0.03 to 0.08 over the FZG range.
    """
    R, E = contact.R, contact.E_red
    p = np.sqrt(np.maximum(contact.w, 2e3) * E / (2.0 * np.pi * R)) * 1e-9
    v_r = np.maximum(contact.v_r, 0.02)
    U, W = contact.eta * 0.5 * v_r / (E * R), np.maximum(contact.w, 2e3) / (E * R)
    h = 2.65 * R * (1.6e-8 * E) ** 0.54 * U**0.7 * W**-0.13
    lam = h * 1e6 / contact.Ra_um
    xi = np.maximum(1.0 - 0.5 * lam, 0.0) ** 2
    film = 0.0335 * p**0.3 * (v_r / 8.3) ** -0.1 * (contact.eta / 0.02) ** 0.1
    return np.asarray(np.clip(xi * 0.08 * (v_r / 0.2) ** -0.1 + (1.0 - xi) * film, 0.005, 0.11))


# ---------------------------------------------------------------------- churning and drag of dipping gears


@dataclass(frozen=True, kw_only=True)
class Dip:
    """One dipping gear.

    Attributes
    ----------
    h, r, b, m : float
        Immersion of the pitch circle, pitch radius, face width, module, [m]
    tooth_height : float
        [m]
    alpha : float
        Pressure angle, [rad]
    volume : float
        Of the oil, [m^3]
    """

    h: float
    r: float
    b: float
    m: float
    z: int
    tooth_height: float
    alpha: float
    volume: float

    @property
    def wetted(self) -> float:
        """Faces, rim and flanks under oil, [m^2]."""
        theta = float(np.arccos(np.clip(1.0 - self.h / self.r, -1.0, 1.0)))
        flanks = 2.0 * self.z * self.tooth_height * theta * self.b / (np.pi * np.cos(self.alpha))
        return float(self.r**2 * (2.0 * theta - np.sin(2.0 * theta)) + 2.0 * self.r * self.b * theta + flanks)


def churning_changenet_2007(dip: Dip, omega: Array, nu: Array, rho: float) -> Array:
    """Changenet and Velex 2007, one gear, [W]; linear in Re between 6000 and 9000.

    References
    ----------
    Changenet, Velex, J. Mech. Des. 129 (2007); exponents as joined by the 2011 formulas at Re = 4000. From memory,
    verified by C_m = 0.0683 at omega = 20 of an independent evaluation.
    """
    if dip.h <= 0.0:
        return np.zeros_like(omega)
    omega = np.maximum(omega, 0.05)
    D, Re, Fr = 2.0 * dip.r, omega * dip.r * dip.b / (nu * 1e-6), omega**2 * dip.r / GRAVITY
    depth, volume, slender = dip.h / D, dip.volume / D**3, dip.b / D
    low = 1.366 * depth**0.45 * volume**0.1 * Fr**-0.6 * np.minimum(Re, 9000.0) ** -0.21 * slender**0.21
    high = 3.644 * depth**0.1 * volume**-0.35 * Fr**-0.88 * slender**0.85
    share = np.clip((Re - 6000.0) / 3000.0, 0.0, 1.0)
    C_m = (1.0 - share) * low + share * high
    return np.asarray(0.5 * rho * omega**3 * dip.wetted * dip.r**3 * C_m)


def churning_changenet_2011(dip: Dip, omega: Array, nu: Array, rho: float) -> Array:
    """Changenet, Leprince, Ville and Velex 2011, one gear, [W]: regime by ``omega^2 (r b m)^(1/3)``.

    References
    ----------
    J. Mech. Des. 133 (2011) 084502. From memory; its formulas join those of 2007 at Re = 4000.
    """
    if dip.h <= 0.0:
        return np.zeros_like(omega)
    omega = np.maximum(omega, 0.05)
    D, Re, Fr = 2.0 * dip.r, omega * dip.r * dip.b / (nu * 1e-6), omega**2 * dip.r / GRAVITY
    depth, volume, slender = dip.h / D, dip.volume / D**3, dip.b / D
    gamma = omega**2 * (dip.r * dip.b * dip.m) ** (1.0 / 3.0)
    drag = np.minimum(Re, 4000.0) ** -0.21
    low = 1.366 * depth**0.45 * volume**0.1 * Fr**-0.6 * drag * slender**0.21
    high = 20.797 * depth**0.1 * volume**-0.35 * Fr**-0.88 * drag * slender**0.85
    share = np.clip((gamma - 750.0) / 500.0, 0.0, 1.0)
    C_m = (1.0 - share) * low + share * high
    return np.asarray(0.5 * rho * omega**3 * dip.wetted * dip.r**3 * C_m)


def churning_lauster(dip: Dip, omega: Array, nu: Array, rho: float) -> Array:
    """Lauster and Boos, one gear: ``C_m = 2.95 (h/r)^1.5 (b/r)^-0.4 (V/r^3)^-0.5 Re^-0.15 Fr^-0.7``, [W].

    Torque ``0.5 rho omega^2 b r^4 C_m``, ``Re = omega r b / nu``, ``Fr = omega^2 r / g``.

    References
    ----------
    Lauster, Boos, VDI-Bericht 488 (1983), for truck gearboxes, as cited by Changenet and Velex 2007. From memory;
    2.2 W at the FZG pair, 8.3 m/s, 60 degC, below Niemann's 7.7 W.
    """
    if dip.h <= 0.0:
        return np.zeros_like(omega)
    omega, r = np.maximum(omega, 0.05), dip.r
    Re, Fr = omega * r * dip.b / (nu * 1e-6), omega**2 * r / GRAVITY
    shape = (dip.h / r) ** 1.5 * (dip.b / r) ** -0.4 * (dip.volume / r**3) ** -0.5
    return np.asarray(0.5 * rho * omega**3 * dip.b * r**4 * 2.95 * shape * Re**-0.15 * Fr**-0.7)


def churning_mauz(e: tuple[float, float], b: float, v_t: Array, omega_2: Array, C_Sp: float = 1.0) -> Array:
    """Mauz, ISO/TR 14179-2, both gears of a mesh: ``C_Sp C_1 exp(C_2 v_t / v_0)`` N m, [W]; a torque at rest fades in.

    References
    ----------
    ISO/TR 14179-2:2001, e_0 = b_0 = 10 mm, v_0 = 10 m/s. From memory; verified by 82 W at the FZG pair, 8.3 m/s.
    """
    depth = (max(e[0], 0.0) + max(e[1], 0.0)) / 10e-3
    C_1 = 0.063 * depth + 0.0128 * (min(b, 0.06) / 10e-3) ** 3
    torque = C_Sp * C_1 * np.exp((depth / 80.0 + 0.2) * v_t / 10.0) * (1.0 - np.exp(-v_t))
    return np.asarray(torque * omega_2)


# ---------------------------------------------------------------------- bearings and seals


def bearing_palmgren(bearing: Bearing, n: Array, F_r: Array, nu: Array, *, f_0: float, f_1: float) -> Array:
    """Palmgren / ISO/TR 14179-2: ``M_0 + M_1``, [W], n in 1/min.

    ``M_0 = 1e-7 f_0 (nu n)^(2/3) d_m^3`` for nu n >= 2000, ``160e-7 f_0 d_m^3`` below; ``M_1 = f_1 F_r d_m``, N mm.

    References
    ----------
    Harris, "Rolling Bearing Analysis"; Palmgren 1959. From memory; verified by M_0 = 57.06 N mm at d_m 60, f_0 2,
    nu 32, 1500 1/min.
    """
    d_m = 0.5 * (bearing.bore_mm + bearing.outside_diameter_mm)
    M_0 = 1e-7 * f_0 * np.maximum(nu * n, 2000.0) ** (2.0 / 3.0) * d_m**3
    M_1 = f_1 * F_r * d_m
    return np.asarray((M_0 + M_1) * 1e-3 * n * RPM)


def bearing_skf(bearing: Bearing, n: Array, F_r: Array, nu: Array, *, R_1: float, mu_bl: float) -> Array:
    """SKF, rolling and sliding of a cylindrical roller bearing without drag, [W], n in 1/min.

    References
    ----------
    SKF, "Rolling bearings" (2018), with S_2 = 0.0015, K_rs = 3e-8, K_Z = 5.1; verified by 127.1 and 9.4 N mm at
    NU 406, 2165.7 1/min, 4463 N, 15.41 mm2/s.
    """
    bore, outside = bearing.bore_mm, bearing.outside_diameter_mm
    d_m, product = 0.5 * (bore + outside), np.maximum(nu * n, 1e-6)
    F = np.maximum(F_r, 15.0)
    inlet = 1.0 / (1.0 + 1.84e-9 * (n * d_m) ** 1.28 * nu**0.64)
    span = (bore + outside) * np.sqrt(5.1 / (2.0 * (outside - bore)))
    starved = np.exp(-3e-8 * product * span)
    M_rr = inlet * starved * R_1 * d_m**2.41 * F**0.31 * product**0.6
    boundary = np.exp(-2.6e-8 * product**1.4 * d_m)
    M_sl = 0.0015 * d_m * F * (boundary * mu_bl + (1.0 - boundary) * 0.02)
    return np.asarray((M_rr + M_sl) * 1e-3 * n * RPM)


def seal_iso_2(d_mm: float, n: Array) -> Array:
    """Seal after ISO/TR 14179-2, ``7.69e-6 d^2 n``, [W]."""
    return np.asarray(7.69e-6 * d_mm**2 * n)


def seal_iso_1(d_mm: float, n: Array) -> Array:
    """Seal after ISO/TR 14179-1, a torque of ``3.737e-3 d`` N m (Viton), [W]; from memory, 8 % above the other part."""
    return np.asarray(3.737e-3 * d_mm * n * RPM)


def seal_linke(d_mm: float, n: Array, T_oil: Array, nu_40: float) -> Array:
    """Seal after Linke, ``(145 - 1.6 T + 350 lg lg(nu_40 + 0.8)) d^2 n 1e-7``, [W]; the bracket is 5 at least.

    References
    ----------
    Linke, "Stirnradverzahnung" (1996); verified by 61.25 W for the two FZG seals at 8.3 m/s, 60 degC.
    """
    bracket = 145.0 - 1.6 * T_oil + 350.0 * np.log10(np.log10(nu_40 + 0.8))
    return np.asarray(np.maximum(bracket, 5.0) * d_mm**2 * n * 1e-7)
