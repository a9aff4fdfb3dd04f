"""How the normal force is shared by the tooth pairs in contact, and the points at which the mesh is evaluated.

A pair that touches at coordinate t (from T1, see :mod:`models.formulas.geometry`) has companions at t + j p_b that
lie between
A and E; the share R of a pair is its part of the total, so the shares of companions sum to 1. Every model here is free
of profile errors and load-independent: shares are computed once per gear pair.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np

from models.base.errors import InputError
from models.base.types import Array, Numeric
from models.formulas.geometry import GearPair
from models.formulas.mesh_stiffness import tooth_pair_stiffness

LoadSharing = Literal["potential_energy", "sanchez_pedrero", "equal"]
_ROUNDING = 1e-9  # in base pitches: a pair this close outside A ... E still counts as touching there


class ContactPoints(NamedTuple):
    """Quadrature on the path of contact: the integral of f over A ... E is ``sum(f(t) * dx)``; ``t, dx, share``.

    Attributes
    ----------
    t : Array, shape (points,)
        Coordinates on the line of action, ascending, [m]
    dx : Array, shape (points,)
        Weights; they sum to the length AE, [m]
    share : Array, shape (points,)
        Share R of the normal force carried there by one pair, [-]
    """

    t: Array
    dx: Array
    share: Array


def load_share(
    pair: GearPair,
    t: Numeric,
    *,
    model: LoadSharing = "potential_energy",
    r_bore: tuple[float, float] | None = None,
    E: tuple[float, float] = (206e9, 206e9),
    nu: tuple[float, float] = (0.3, 0.3),
) -> Array:
    r"""Share of the normal force that the tooth pair touching at t carries.

    .. math:: R(t) = w(t) \Big/ \sum_j w(t + j p_b), \qquad \overline{T_1A} \le t + j p_b \le \overline{T_1E}

    with the weight w of the model: the stiffness of :func:`models.formulas.mesh_stiffness.tooth_pair_stiffness`
    ("potential_energy"), the closed form of :func:`unit_stiffness_sanchez_pedrero` ("sanchez_pedrero"), or 1
    ("equal", rigid teeth).

    Parameters
    ----------
    pair : GearPair
        The gears
    t : Numeric, shape (...)
        Coordinate on the line of action, [m]
    model : {"potential_energy", "sanchez_pedrero", "equal"}
        Which weight
    r_bore, E, nu : tuple of float
        Bore radii [m], Young's moduli [Pa] and Poisson's ratios [-] of the two gears; read by "potential_energy" only

    Returns
    -------
    Array, shape (...)
        Share R, [-]; 0 outside A ... E. At B and D, where it jumps, the value of the side with more pairs

    Raises
    ------
    InputError
        For "sanchez_pedrero" with a contact ratio of 2 or more.

    Examples
    --------
    >>> from models.formulas.geometry import gear_pair
    >>> pair = gear_pair(z=(16, 24), m_n=4.5e-3, alpha_n=math.radians(20.0), b=14e-3, a=91.5e-3, x=(0.182, 0.172))
    >>> at = np.array([pair.T1A, pair.T1B, pair.T1C, pair.T1D, pair.T1E])
    >>> load_share(pair, at, r_bore=(15e-3, 15e-3)).round(3)
    array([0.422, 0.584, 1.   , 0.578, 0.416])
    >>> load_share(pair, at, model="sanchez_pedrero").round(3)
    array([0.355, 0.645, 1.   , 0.645, 0.355])
    """
    position = np.asarray(t, dtype=np.float64)
    most = math.ceil(pair.epsilon_alpha)
    companions = position[..., np.newaxis] + np.arange(-most, most + 1) * pair.p_b
    slack = _ROUNDING * pair.p_b
    touching = (companions >= pair.T1A - slack) & (companions <= pair.T1E + slack)
    companions = np.clip(companions, pair.T1A, pair.T1E)  # weights are defined there only; `touching` masks the rest

    if model == "potential_energy":
        weight = tooth_pair_stiffness(pair, companions, r_bore=r_bore, E=E, nu=nu)
    elif model == "sanchez_pedrero":
        weight = unit_stiffness_sanchez_pedrero((companions - pair.T1A) / pair.p_b, pair.epsilon_alpha)
    else:
        weight = np.ones_like(companions)
    weight = np.where(touching, weight, 0.0)
    total = weight.sum(axis=-1)
    return np.asarray(weight[..., most] / np.where(total > 0.0, total, 1.0), dtype=np.float64)


def unit_stiffness_sanchez_pedrero(xi: Numeric, epsilon_alpha: float) -> Array:
    r"""Stiffness of a tooth pair over its largest value, closed form after Sanchez, Pleguezuelos and Pedrero [1]_.

    .. math:: v(\xi) = \cos[b_0(\xi - \varepsilon_\alpha/2)], \qquad
              b_0 = \left[\tfrac12(1 + \varepsilon_\alpha/2)^2 - 1\right]^{-1/2}

    Parameters
    ----------
    xi : Numeric, shape (...)
        Profile coordinate, distance from A over the base pitch, [-]
    epsilon_alpha : float
        Contact ratio, [-]; between 1 and 2

    Returns
    -------
    Array, shape (...)
        Relative stiffness, [-]; 1 in the middle of the path of contact

    Raises
    ------
    InputError
        If the contact ratio is 2 or more.

    References
    ----------
    .. [1] M. B. Sanchez, M. Pleguezuelos, J. I. Pedrero, "Enhanced model of load distribution along the line of contact
       for non-standard involute external gears", Meccanica 48 (2013) 527-543. From memory; checked against the
       potential-energy model of this package. Fitted to teeth of the standard rack.

    Examples
    --------
    >>> round(float(unit_stiffness_sanchez_pedrero(0.0, 1.43716)), 4)
    0.5056
    """
    if not 1.0 <= epsilon_alpha < 2.0:
        raise InputError(
            f"load sharing 'sanchez_pedrero' holds for contact ratios from 1 to below 2, not {epsilon_alpha:.3f}; "
            "use 'potential_energy'"
        )
    b_0 = (0.5 * (1.0 + 0.5 * epsilon_alpha) ** 2 - 1.0) ** -0.5
    return np.asarray(np.cos(b_0 * (np.asarray(xi, dtype=np.float64) - 0.5 * epsilon_alpha)), dtype=np.float64)


def contact_breakpoints(pair: GearPair) -> Array:
    """Where the mesh has a kink or a jump: A, E, the pitch point, and every change of the number of pairs.

    Parameters
    ----------
    pair : GearPair
        The gears

    Returns
    -------
    Array, shape (breakpoints,)
        Coordinates on the line of action, ascending and distinct, [m]; A, B, C, D, E in some order below contact
        ratio 2
    """
    steps = np.arange(math.ceil(pair.epsilon_alpha) + 1) * pair.p_b
    candidates = np.concatenate([pair.T1A + steps, pair.T1E - steps, [pair.T1C]])
    slack = _ROUNDING * pair.p_b
    inside = candidates[(candidates > pair.T1A + slack) & (candidates < pair.T1E - slack)]
    points = np.sort(np.concatenate([[pair.T1A], inside, [pair.T1E]]))
    distinct = np.concatenate([[True], np.diff(points) > slack])
    # Of two that coincide up to rounding the first stays; E, which is last, is kept apart by the filter above.
    return np.asarray(points[distinct], dtype=np.float64)


def contact_points(
    pair: GearPair,
    n: int = 6,
    *,
    model: LoadSharing = "potential_energy",
    r_bore: tuple[float, float] | None = None,
    E: tuple[float, float] = (206e9, 206e9),
    nu: tuple[float, float] = (0.3, 0.3),
) -> ContactPoints:
    """Gauss-Legendre points on every segment between breakpoints of the path of contact, with the load share there.

    Parameters
    ----------
    pair : GearPair
        The gears
    n : int
        Points per segment, [-]; there are four segments below contact ratio 2
    model, r_bore, E, nu
        As in :func:`load_share`

    Returns
    -------
    ContactPoints
        Coordinates, weights and shares

    Raises
    ------
    InputError
        From :func:`load_share`.

    Examples
    --------
    >>> from models.formulas.geometry import gear_pair
    >>> pair = gear_pair(z=(16, 24), m_n=4.5e-3, alpha_n=math.radians(20.0), b=14e-3, a=91.5e-3, x=(0.182, 0.172))
    >>> points = contact_points(pair, r_bore=(15e-3, 15e-3))
    >>> points.t.size, round(1e3 * float(points.dx.sum()), 3)
    (24, 19.092)
    >>> round(load_sharing_loss_factor(pair, points), 4)
    0.1915
    """
    nodes, weights = np.polynomial.legendre.leggauss(n)
    breakpoints = contact_breakpoints(pair)
    half = 0.5 * np.diff(breakpoints)[:, np.newaxis]
    t = (breakpoints[:-1, np.newaxis] + half * (1.0 + nodes)).ravel()
    dx = (half * weights).ravel()
    return ContactPoints(t=t, dx=dx, share=load_share(pair, t, model=model, r_bore=r_bore, E=E, nu=nu))


def load_sharing_loss_factor(pair: GearPair, points: ContactPoints) -> float:
    r"""Gear loss factor with a given load share: sliding loss over input power at a friction coefficient of 1 [1]_.

    .. math:: H_{VL} = \frac{1}{p_b} \int_A^E R(t)\, \frac{|u_1 - u_2|}{\omega_1 r_{b1}}\, dt

    With "equal" sharing and the pitch point where one pair carries alone this is Ohlendorf's factor exactly.

    Parameters
    ----------
    pair : GearPair
        The gears
    points : ContactPoints
        Quadrature and share, from :func:`contact_points`

    Returns
    -------
    float
        Load-dependent loss factor, P = P_in H_VL mu_m, [-]

    References
    ----------
    .. [1] S. Wimmer, "Design of low-loss gears", dissertation, TU Muenchen, 2006; spur form. From memory; verified
       against Ohlendorf's closed form.
    """
    sliding = pair.sliding_speed(points.t, 1.0) / pair.r_b[0]
    return float(np.sum(points.share * sliding * points.dx) / pair.p_b)
