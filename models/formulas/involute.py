"""Involutes of external gears: pressure angles, profile shift and centre distance, tooth thickness.

Lengths in m, angles in rad. All formulas are those of DIN 3960 / ISO 21771; spur gears are those of helix angle zero.
"""

from __future__ import annotations

import math

from scipy.optimize import brentq

ADDENDUM = 1.0  # h_aP / m_n of the basic rack, ISO 53 profile A


def involute(alpha: float) -> float:
    r"""Involute function, :math:`\mathrm{inv}\,\alpha = \tan\alpha - \alpha` (ISO 21771); both in rad.

    Examples
    --------
    >>> round(involute(math.radians(20.0)), 6)
    0.014904
    """
    return math.tan(alpha) - alpha


def transverse_pressure_angle(alpha_n: float, beta: float) -> float:
    r"""Pressure angle in the transverse plane, [rad], :math:`\tan\alpha_t = \tan\alpha_n / \cos\beta` (ISO 21771).

    Examples
    --------
    >>> round(transverse_pressure_angle(math.radians(20.0), math.radians(15.0)), 5)
    0.36036
    """
    return math.atan(math.tan(alpha_n) / math.cos(beta))


def profile_shift_sum(z: tuple[int, int], alpha_n: float, alpha_wt: float, beta: float = 0.0) -> float:
    r"""Sum of the profile shifts that meshes free of backlash at a working pressure angle (ISO 21771).

    .. math:: x_1 + x_2 = \frac{(z_1 + z_2)(\mathrm{inv}\,\alpha_{wt} - \mathrm{inv}\,\alpha_t)}{2\tan\alpha_n}

    Parameters
    ----------
    z : tuple of int
        Numbers of teeth, [-]
    alpha_n : float
        Pressure angle of the basic rack, [rad]
    alpha_wt : float
        Working pressure angle, [rad]
    beta : float
        Helix angle at the reference circle, [rad]

    Returns
    -------
    float
        Sum of the profile shift coefficients, [-]

    Examples
    --------
    >>> round(profile_shift_sum((16, 24), math.radians(20.0), math.radians(22.4388)), 4)
    0.3532
    """
    alpha_t = transverse_pressure_angle(alpha_n, beta)
    return sum(z) * (involute(alpha_wt) - involute(alpha_t)) / (2.0 * math.tan(alpha_n))


def centre_distance(z: tuple[int, int], m_n: float, alpha_n: float, x_sum: float, beta: float = 0.0) -> float:
    """Centre distance at which two profile-shifted gears mesh free of backlash; inverse of :func:`profile_shift_sum`.

    Parameters
    ----------
    z : tuple of int
        Numbers of teeth, [-]
    m_n : float
        Normal module, [m]
    alpha_n : float
        Pressure angle of the basic rack, [rad]
    x_sum : float
        Sum of the profile shift coefficients, [-]
    beta : float
        Helix angle at the reference circle, [rad]

    Returns
    -------
    float
        Centre distance, [m]; NaN if the shifts are too negative for the teeth to mesh

    Examples
    --------
    >>> round(1e3 * centre_distance((16, 24), 4.5e-3, math.radians(20.0), 0.1817 + 0.1715), 3)
    91.5
    """

    def excess(alpha_wt: float) -> float:
        return profile_shift_sum(z, alpha_n, alpha_wt, beta) - x_sum

    steepest = math.radians(80.0)
    if not excess(0.0) <= 0.0 <= excess(steepest):
        return math.nan
    alpha_wt = float(brentq(excess, 0.0, steepest, xtol=1e-14))
    reference = 0.5 * sum(z) * m_n / math.cos(beta)
    return reference * math.cos(transverse_pressure_angle(alpha_n, beta)) / math.cos(alpha_wt)


def smallest_profile_shift(z: int, alpha_n: float, addendum: float = ADDENDUM, beta: float = 0.0) -> float:
    r"""Profile shift below which the rack undercuts the tooth (DIN 3960).

    .. math:: x = h_{a}^* - \frac{z\sin^2\alpha_t}{2\cos\beta}

    Parameters
    ----------
    z : int
        Number of teeth, [-]
    alpha_n : float
        Pressure angle of the basic rack, [rad]
    addendum : float
        Rack addendum up to which the flank is straight, over the module, [-]; 1.0 gives the theoretical limit,
        14/17 the practical one
    beta : float
        Helix angle at the reference circle, [rad]

    Returns
    -------
    float
        Limiting profile shift coefficient, [-]

    Examples
    --------
    >>> round(smallest_profile_shift(16, math.radians(20.0)), 4)
    0.0642
    """
    return addendum - 0.5 * z * math.sin(transverse_pressure_angle(alpha_n, beta)) ** 2 / math.cos(beta)


def half_tooth_angle(*, z: float, x: float, alpha_n: float, r_b: float, r: float, beta: float = 0.0) -> float:
    r"""Half the angle that a tooth subtends at a radius (ISO 21771).

    .. math:: \psi(r) = \frac{\pi/2 + 2x\tan\alpha_n}{z} + \mathrm{inv}\,\alpha_t - \mathrm{inv}\,\alpha_r,
              \qquad \cos\alpha_r = r_b / r

    Parameters
    ----------
    z : float
        Number of teeth, [-]; that of a virtual spur gear is no whole number
    x : float
        Profile shift coefficient, [-]
    alpha_n : float
        Pressure angle of the basic rack, [rad]
    r_b : float
        Base radius, [m]
    r : float
        Radius, [m]; below r_b the angle of the base circle holds (radial flank)
    beta : float
        Helix angle at the reference circle, [rad]

    Returns
    -------
    float
        Half tooth angle, [rad]; negative beyond the point of the tooth

    Examples
    --------
    >>> round(half_tooth_angle(z=16, x=0.182, alpha_n=math.radians(20.0), r_b=33.829e-3, r=33.829e-3), 5)
    0.12136
    """
    alpha_r = math.acos(min(1.0, r_b / r))
    alpha_t = transverse_pressure_angle(alpha_n, beta)
    return (0.5 * math.pi + 2.0 * x * math.tan(alpha_n)) / z + involute(alpha_t) - involute(alpha_r)
