"""How the normal force is shared by the tooth pairs in contact, and the points at which the mesh is evaluated.

A pair that touches at coordinate t (from T1, see :mod:`models.formulas.geometry`) has companions at t + j p_b that
lie between A and E; the share R of a pair is its part of the total, so the shares of companions sum to 1. Of helical
gears a line of contact crosses the face at an angle, and the load per length on it is R times the mean one. Every model
here is free of profile errors, crowning and misalignment, and load-independent: shares are computed once per gear pair.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Literal, NamedTuple

import numpy as np
from numpy.polynomial import Chebyshev

from models.base.errors import InputError
from models.base.types import Array, Numeric
from models.formulas.geometry import GearPair
from models.formulas.mesh_stiffness import tooth_pair_stiffness

LoadSharing = Literal["potential_energy", "sanchez_pedrero", "equal", "ohlendorf"]
_ROUNDING = 1e-9  # in base pitches: a pair this close outside A ... E still counts as touching there
# Gauss points of helical gears between two kinks, along the path of contact and over the face: the loss factor is
# within 0.1 % of that with 6 x 6, for helix angles from 0.01 to 30 degrees; sliding losses were within 0.4 %.
_GAUSS = 2
_CHEBYSHEV_DEGREE = 20  # of the stiffness of a pair along the path of contact


class ContactPoints(NamedTuple):
    """Quadrature on the path of contact: the integral of f over A ... E is ``sum(f(t) * dx)``; ``t, dx, share``.

    Of helical gears it goes over the face width too, as a mean.

    Attributes
    ----------
    t : Array, shape (points,)
        Coordinates on the line of action, ascending, [m]
    dx : Array, shape (points,)
        Weights; they sum to the length AE, [m]
    share : Array, shape (points,)
        Share R of the normal force carried there by one pair, [-]; the force in the transverse plane times R over the
        face width is the load per length of the line of contact
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
    r"""Share of the normal force that the tooth pair touching at t carries, at one face position.

    .. math:: R(t) = w(t) \Big/ \sum_j w(t + j p_b), \qquad \overline{T_1A} \le t + j p_b \le \overline{T_1E}

    with the weight w of the model: the stiffness of :func:`models.formulas.mesh_stiffness.tooth_pair_stiffness`
    ("potential_energy"), the closed form of :func:`unit_stiffness_sanchez_pedrero` ("sanchez_pedrero"), or 1
    ("equal" and "ohlendorf", rigid teeth).

    Parameters
    ----------
    pair : GearPair
        The gears
    t : Numeric, shape (...)
        Coordinate on the line of action, [m]
    model : {"potential_energy", "sanchez_pedrero", "equal", "ohlendorf"}
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
    weight = np.where(touching, _weight_of(pair, model, r_bore, E, nu)(companions), 0.0)
    total = weight.sum(axis=-1)
    return np.asarray(weight[..., most] / np.where(total > 0.0, total, 1.0), dtype=np.float64)


def _weight_of(
    pair: GearPair, model: LoadSharing, r_bore: tuple[float, float] | None, E: tuple[float, float],
    nu: tuple[float, float],
) -> Callable[[Array], Array]:  # fmt: skip
    """Weight of a pair by its coordinate between A and E, for the model; parameters as :func:`load_share`."""
    if model == "potential_energy":
        return partial(tooth_pair_stiffness, pair, r_bore=r_bore, E=E, nu=nu)
    if model == "sanchez_pedrero":
        return lambda t: unit_stiffness_sanchez_pedrero((t - pair.T1A) / pair.p_b, pair.epsilon_alpha)
    return np.ones_like


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
    return _between(pair.T1A, pair.T1E, np.concatenate([pair.T1A + steps, pair.T1E - steps, [pair.T1C]]))


def contact_points(
    pair: GearPair,
    n: int = 6,
    *,
    model: LoadSharing = "potential_energy",
    r_bore: tuple[float, float] | None = None,
    E: tuple[float, float] = (206e9, 206e9),
    nu: tuple[float, float] = (0.3, 0.3),
) -> ContactPoints:
    r"""Gauss-Legendre points on every segment between breakpoints of the path of contact, with the load share there.

    Of helical gears a pair at :math:`\xi` base pitches from A on one edge is at :math:`\xi + \varepsilon_\beta \eta`
    of its course where the face position is :math:`\eta`, 0 to 1. All lines of contact share one displacement, so

    .. math:: R(\xi, \eta) = \frac{\kappa(\xi)}{D(\xi + \varepsilon_\beta\eta)}, \qquad
              D(\varphi) = \frac{1}{\varepsilon_\beta}
              \sum_j \int_{\varphi + j - \varepsilon_\beta}^{\varphi + j} \kappa(\xi')\,d\xi'

    with the weight :math:`\kappa` of the model, 0 outside A ... E ("equal": uniform load on the lines of contact).
    "ohlendorf" takes the shares of a spur pair for helical gears too, as ISO/TR 14179-2 and WTplus do.

    Parameters
    ----------
    pair : GearPair
        The gears
    n : int
        Points per segment of spur gears, [-]; there are four segments below contact ratio 2
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
    """
    if pair.epsilon_beta > 0.0 and model != "ohlendorf":
        return _points_on_lines(pair, _weight_of(pair, model, r_bore, E, nu))
    t, dx = _gauss_points(contact_breakpoints(pair), n)
    return ContactPoints(t=t, dx=dx, share=load_share(pair, t, model=model, r_bore=r_bore, E=E, nu=nu))


def _gauss_points(breakpoints: Array, n: int) -> tuple[Array, Array]:
    """Gauss-Legendre points and weights on every segment between breakpoints, each of shape (segments * n,)."""
    nodes, weights = np.polynomial.legendre.leggauss(n)
    half = 0.5 * np.diff(breakpoints)[:, np.newaxis]
    return (breakpoints[:-1, np.newaxis] + half * (1.0 + nodes)).ravel(), (half * weights).ravel()


def _points_on_lines(pair: GearPair, weight: Callable[[Array], Array]) -> ContactPoints:
    """Points over the path of contact and the face width of helical gears; see :func:`contact_points`."""
    path, overlap = pair.epsilon_alpha, pair.epsilon_beta
    kappa = Chebyshev.interpolate(lambda xi: weight(pair.T1A + xi * pair.p_b), _CHEBYSHEV_DEGREE, domain=[0.0, path])
    stiffness = kappa.integ(lbnd=0.0)
    companions = np.arange(-math.ceil(path + overlap) - 1, math.ceil(path + overlap) + 2)
    # Courses phi at which a line of contact begins or ends on one edge of the face, or reaches or leaves the other.
    kinks = np.concatenate([companions + end for end in (0.0, path, overlap, path + overlap)])
    # The load repeats with every whole pitch of the overlap.
    whole, rest = divmod(overlap, 1.0)
    points = []
    for xi, d_xi in np.transpose(
        _gauss_points(_between(0.0, path, np.concatenate([kinks, kinks - overlap, [pair.epsilon_2]])), _GAUSS)
    ):
        over_face = []
        for length, share_of_face in ((1.0, whole / overlap), (rest, 1.0 / overlap)):
            if length * share_of_face > _ROUNDING:
                phi, d_phi = _gauss_points(_between(xi, xi + length, kinks), _GAUSS)
                ends = phi[:, np.newaxis] + companions
                lines = stiffness(np.clip(ends, 0.0, path)) - stiffness(np.clip(ends - overlap, 0.0, path))
                over_face.append(np.stack([kappa(xi) / (lines.sum(axis=-1) / overlap), d_phi * share_of_face]))
        share, weight_of_share = _two_points(*np.concatenate(over_face, axis=-1))
        points.append(np.stack([np.full_like(share, xi), d_xi * weight_of_share, share]))
    xi, weights, share = np.concatenate(points, axis=-1)
    return ContactPoints(t=pair.T1A + xi * pair.p_b, dx=weights * pair.p_b, share=share)


def _two_points(values: Array, weights: Array) -> tuple[Array, Array]:
    """Two values and their weights with the mean, variance and third moment of many, whose weights sum to 1.

    What is smooth in the load has the same mean over them, to third order.
    """
    mean = weights @ values
    deviation = math.sqrt(weights @ (values - mean) ** 2)
    if deviation < _ROUNDING * mean:
        return np.full(2, mean), np.full(2, 0.5)
    skewness = weights @ ((values - mean) / deviation) ** 3
    root = math.hypot(skewness, 2.0)
    steps = 0.5 * np.array([skewness - root, skewness + root])
    return mean + deviation * steps, steps[::-1] * np.array([1.0, -1.0]) / root


def _between(low: float, high: float, candidates: Array) -> Array:
    """Breakpoints from `low` to `high`: both, and the distinct candidates between them."""
    slack = _ROUNDING * (high - low)
    inside = np.sort(candidates[(candidates > low + slack) & (candidates < high - slack)])
    points = np.concatenate([[low], inside, [high]])
    # Of two that coincide up to rounding the first stays; the last is kept apart by the filter above.
    return np.asarray(points[np.concatenate([[True], np.diff(points) > slack])], dtype=np.float64)


def load_sharing_loss_factor(pair: GearPair, points: ContactPoints) -> float:
    r"""Gear loss factor with a given load share: sliding loss over input power at a friction coefficient of 1 [1]_.

    .. math:: H_{VL} = \frac{1}{p_b\cos\beta_b} \int_A^E R(t)\, \frac{|u_1 - u_2|}{\omega_1 r_{b1}}\, dt

    With "equal" sharing and the pitch point where one pair carries alone this is Ohlendorf's factor of spur gears
    exactly. Helical gears have up to a fifth more: at each moment load is away from the pitch point.

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
    .. [1] S. Wimmer, "Design of low-loss gears", dissertation, TU Muenchen, 2006. From memory; verified against
       Ohlendorf's closed form, and for helical gears against that of a uniform load and the sum over slices that
       GEARpie prints.

    Examples
    --------
    >>> from models.formulas.geometry import gear_pair
    >>> pair = gear_pair(z=(16, 24), m_n=4.5e-3, alpha_n=math.radians(20.0), b=14e-3, a=91.5e-3, x=(0.182, 0.172))
    >>> round(load_sharing_loss_factor(pair, contact_points(pair, r_bore=(15e-3, 15e-3))), 4)
    0.1915
    """
    sliding = pair.sliding_speed(points.t, 1.0) / pair.r_b[0]
    return float(np.sum(points.share * sliding * points.dx) / (pair.p_b * math.cos(pair.beta_b)))
