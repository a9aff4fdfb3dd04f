"""Kept for proof: laws of gearboxes of the family ``proof_b``, section 2 of SPECIFICATION.md."""

from __future__ import annotations

import numpy as np

from diagnosis.proof.zoo.structure import Moment
from models.base.types import Array
from models.formulas.ehl import hertz_line
from models.formulas.oil import pressure_viscosity_gold

from .parts import GRAVITY, Contact, difference


def wind(u: Array) -> Array:
    """Wall in wind after Watmuff et al. 1977 without radiation, nothing without wind, [W/(m^2 K)]."""
    return (2.8 + 3.0 * np.minimum(u, 5.0)) * u / (u + 0.1)


def rising(T: Array, T_air: Array) -> Array:
    """Free convection of a wall after McAdams, turbulent, [W/(m^2 K)]."""
    return 1.31 * difference(T, T_air) ** (1.0 / 3.0)


def cylinder(omega: Array, D: float, nu: Array, k: Array, prandtl: Array) -> Array:
    """Turning cylinder in oil after Becker 1963, [W/(m^2 K)]; nu in mm^2/s."""
    Re = omega * D**2 / (2e-6 * nu)
    return 0.133 * Re ** (2.0 / 3.0) * prandtl ** (1.0 / 3.0) * k / D


def friction_fluid(SR: Array, p_GPa: Array, eta_mPas: Array, V_e: Array, R: Array, S: float) -> Array:
    """Friction of a film after Xu, Kahraman et al. 2007; V_e in m/s, R in m, S in um."""
    SR, eta = np.maximum(SR, 1e-6), np.maximum(eta_mPas, 1.5)
    q = SR * p_GPa * np.log10(eta)
    f = -8.916465 - 0.354068 * q + 2.812084 * np.exp(-q) + 0.620305 * np.exp(S)
    size = p_GPa**1.03303 * SR**1.036077 * V_e**-0.100601 * eta**0.752755 * R**-0.390958
    return np.exp(f) * size


def film(F: Array, R: Array, b: float, E_red: float, eta: Array, alpha: Array, V_e: Array) -> Array:
    """Least film of a line contact after Dowson and Higginson, [m]."""
    return 2.65 * R * (alpha * E_red) ** 0.54 * (eta * V_e / (E_red * R)) ** 0.7 * (F / (b * E_red * R)) ** -0.13


def share_of_film(lambda_: Array) -> Array:
    """Share of the load that the film carries (Zhu and Hu, as in Castro and Seabra)."""
    share = 1.21 * lambda_**0.64 / (1.0 + 0.37 * lambda_**1.26)
    return np.where(lambda_ >= 2.0, 1.0, np.clip(share, 0.0, 1.0))


def in_mesh(m: Moment, c: Contact) -> Array:
    """Friction at the contact points."""
    V_e, F = 0.5 * c.v_r, np.maximum(c.F, 1e-3)
    p_GPa = 1e-9 * hertz_line(F / c.b, c.R, c.E_red)[1]
    fluid = friction_fluid(c.V_s / V_e, p_GPa, c.eta_mPas, V_e, c.R, 0.5 * sum(c.Ra))
    h = film(F, c.R, c.b, c.E_red, 1e-3 * c.eta_mPas, pressure_viscosity_gold(c.nu, 9.904, 0.139), V_e)
    share = share_of_film(1e6 * h / np.hypot(*c.Ra))
    return share**1.2 * fluid + (1.0 - share) * m.p["mu_b"]


def churned_disc(nu: Array, rho: Array, omega: Array, R: float) -> Array:
    """Torque of both faces of a disc in liquid, [N m]; nu in mm^2/s."""
    nu = 1e-6 * nu
    Re = omega * R**2 / nu
    laminar = 0.616 * np.pi * rho * R**4 * np.sqrt(nu * omega**3)
    turbulent = 0.073 * rho * omega**2 * R**5 * np.maximum(Re, 1.0) ** -0.2
    over = np.clip((Re - 2.5e5) / 1e5, 0.0, 1.0)
    return (1.0 - over) * laminar + over * np.maximum(laminar, turbulent)


def thrown(rho: Array, omega: Array, R: float, e: float, module: float, b: float) -> Array:
    """Power of the oil that tooth gaps throw out, [W]."""
    v = omega * R
    filled = 0.5 / np.sqrt(1.0 + v**2 / (60.0 * GRAVITY * R))
    return rho * filled * 0.5 * 2.25 * module * b * v * e / R * v**2


def bearing_torque(nu: Array, n: Array, F: Array, d_m: float) -> Array:
    """Torque in the form of Witte 1973, [N m]; d_m in mm."""
    speed = np.sqrt(np.maximum(n, 1.0) * nu / (2166.0 * 15.4))
    return 0.148 * (d_m / 60.0) ** 2 * speed * (np.maximum(F, 200.0) / 4463.0) ** (1.0 / 3.0)


def seal_torque(thickness: Array, n: Array, d: float) -> Array:
    """Torque of a lip on a film after Hirano and Ishiwata 1965, [N m]; viscosity over that at 60 degC, d in mm."""
    return 3.0e-3 * d * np.maximum(thickness * n * d / 78000.0, 0.02) ** (1.0 / 3.0)
