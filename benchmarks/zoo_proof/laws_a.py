"""Kept for proof: laws of the family ``proof_a``, section 1 of SPECIFICATION.md."""

from __future__ import annotations

import numpy as np

from diagnosis.proof.zoo.structure import Moment
from models.base.types import Array

from .parts import GRAVITY, KELVIN, PRANDTL, Contact, difference

NU_FILM, K_FILM = 1.7e-5, 0.0272  # air at the housing


def across(u: Array, length: float) -> Array:
    """Square prism across the wind after Jakob, [W/(m^2 K)]."""
    return 0.102 * (u * length / NU_FILM) ** 0.675 * PRANDTL ** (1.0 / 3.0) * K_FILM / length


def rising(T: Array, T_air: Array, length: float) -> Array:
    """Free convection of a wall after Churchill and Chu, [W/(m^2 K)]."""
    beta = 1.0 / (0.5 * (T + T_air) + KELVIN)
    Ra = GRAVITY * beta * difference(T, T_air) * length**3 / NU_FILM**2 * PRANDTL
    root = 0.825 + 0.387 * Ra ** (1.0 / 6.0) / (1.0 + (0.492 / PRANDTL) ** (9.0 / 16.0)) ** (8.0 / 27.0)
    return root**2 * K_FILM / length


def disc(omega: Array, nu: Array, k: Array, prandtl: Array) -> Array:
    """Levich's disc, [W/(m^2 K)]; nu in mm^2/s."""
    return 0.62 * k * prandtl ** (1.0 / 3.0) * np.sqrt(omega / (1e-6 * nu))


def friction_benedict_kelley(load: Array, eta_mPas: Array, V_s: Array, v_r: Array, S: float) -> Array:
    """Benedict and Kelley's friction; load in N/mm."""
    argument = 29660.0 * load / (eta_mPas * np.maximum(V_s, 1e-3) * v_r**2)
    mu = 0.0127 * 1.13 / (1.13 - min(S, 0.8)) * np.log10(np.maximum(argument, 1.0001))
    return np.clip(mu, 0.01, 0.085)


def in_mesh(_: Moment, c: Contact) -> Array:
    """Friction at the contact points."""
    return friction_benedict_kelley(1e-3 * c.F / c.b, c.eta_mPas, c.V_s, c.v_r, 0.5 * sum(c.Ra))


def churning(nu: Array, n: Array, D: float, b: float, module: float, dipped: float) -> Array:
    """Losses of one gear in oil after ISO/TR 14179-1, [W]; lengths in mm, without a factor."""
    rough = (7.93 - 4.648 / module) / np.sqrt(np.tan(np.deg2rad(10.0)))
    return 1e3 * dipped * n**3 / 0.2e26 * (7.37 * nu * D**4.7 * b * rough + 1.474 * nu * D**5.7)


def bearing_torque(nu: Array, n: Array, F: Array, d_m: float) -> tuple[Array, Array]:
    """Palmgren's torques of a cylindrical roller bearing without and with load, [N mm]; d_m in mm."""
    return 3.0 * 1e-7 * d_m**3 * np.maximum(nu * n, 2000.0) ** (2.0 / 3.0), 0.0003 * F * d_m


def seal_torque(d: float) -> float:
    """Torque of a seal of fluoro rubber after ISO/TR 14179-1, [N m]; d in mm."""
    return 3.737e-3 * d


def windage(n: Array, R: float, b: float, eta_mPas: Array) -> Array:
    """Anderson and Loewenthal in their air full of oil, [W]."""
    return 2.82e-4 * (1.0 + 2.3 * b / R) * n**2.8 * R**4.6 * (0.028 * eta_mPas + 0.019) ** 0.2
