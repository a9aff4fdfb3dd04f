"""Geometry and kinematics of an external spur gear pair.

Lengths in m, angles in rad. A position on the line of action is its coordinate ``t``: the distance from T1, where the
line touches the base circle of gear 1. Gear 1 drives, so a tooth pair enters at A, and leaves at E; between B and D it
is alone (contact ratio below 2). The plain functions are the formulas; :func:`gear_pair` checks the input and fills a
:class:`GearPair`.

All formulas are those of DIN 3960 / ISO 21771 for cylindrical gears, with helix angle zero.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from models.base.errors import InputError
from models.base.types import Array, Numeric

ADDENDUM = 1.0  # h_aP / m_n of the basic rack, ISO 53 profile A
DEDENDUM = 1.25  # h_fP / m_n of the basic rack, ISO 53 profile A
# Below this rack addendum undercut reaches the working flank (DIN 3960: z_min = 14 in place of 17 at 20 degrees).
# The theoretical value 1.0 would refuse FZG type A, whose wheel has x = -0.5 where theory asks for -0.404.
UNDERCUT_ADDENDUM = 14.0 / 17.0
# Departure of x_1 + x_2 from the value that goes with a; beyond it is no rounding or backlash but a wrong number.
SHIFT_SUM_TOLERANCE = 0.05


def involute(alpha: float) -> float:
    r"""Involute function, :math:`\mathrm{inv}\,\alpha = \tan\alpha - \alpha` (ISO 21771); both in rad.

    Examples
    --------
    >>> round(involute(math.radians(20.0)), 6)
    0.014904
    """
    return math.tan(alpha) - alpha


def profile_shift_sum(z: tuple[int, int], alpha_n: float, alpha_wt: float) -> float:
    r"""Sum of the profile shifts that meshes free of backlash at a working pressure angle (ISO 21771).

    .. math:: x_1 + x_2 = \frac{(z_1 + z_2)(\mathrm{inv}\,\alpha_{wt} - \mathrm{inv}\,\alpha_n)}{2\tan\alpha_n}

    Parameters
    ----------
    z : tuple of int
        Numbers of teeth, [-]
    alpha_n : float
        Pressure angle of the basic rack, [rad]
    alpha_wt : float
        Working pressure angle, [rad]

    Returns
    -------
    float
        Sum of the profile shift coefficients, [-]

    Examples
    --------
    >>> round(profile_shift_sum((16, 24), math.radians(20.0), math.radians(22.4388)), 4)
    0.3532
    """
    return sum(z) * (involute(alpha_wt) - involute(alpha_n)) / (2.0 * math.tan(alpha_n))


def centre_distance(z: tuple[int, int], m_n: float, alpha_n: float, x_sum: float) -> float:
    """Centre distance at which two profile-shifted gears mesh free of backlash; inverse of :func:`profile_shift_sum`.

    Parameters
    ----------
    z : tuple of int
        Numbers of teeth, [-]
    m_n : float
        Module, [m]
    alpha_n : float
        Pressure angle of the basic rack, [rad]
    x_sum : float
        Sum of the profile shift coefficients, [-]

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
        return profile_shift_sum(z, alpha_n, alpha_wt) - x_sum

    steepest = math.radians(80.0)
    if not excess(0.0) <= 0.0 <= excess(steepest):
        return math.nan
    alpha_wt = float(brentq(excess, 0.0, steepest, xtol=1e-14))
    return 0.5 * sum(z) * m_n * math.cos(alpha_n) / math.cos(alpha_wt)


def smallest_profile_shift(z: int, alpha_n: float, addendum: float = ADDENDUM) -> float:
    r"""Profile shift below which the rack undercuts the tooth, :math:`x = h_{a}^* - z\sin^2\alpha_n/2` (DIN 3960).

    Parameters
    ----------
    z : int
        Number of teeth, [-]
    alpha_n : float
        Pressure angle of the basic rack, [rad]
    addendum : float
        Rack addendum up to which the flank is straight, over the module, [-]; 1.0 gives the theoretical limit,
        14/17 the practical one

    Returns
    -------
    float
        Limiting profile shift coefficient, [-]

    Examples
    --------
    >>> round(smallest_profile_shift(16, math.radians(20.0)), 4)
    0.0642
    """
    return addendum - 0.5 * z * math.sin(alpha_n) ** 2


def half_tooth_angle(*, z: int, x: float, alpha_n: float, r_b: float, r: float) -> float:
    r"""Half the angle that a tooth subtends at a radius (ISO 21771).

    .. math:: \psi(r) = \frac{\pi/2 + 2x\tan\alpha_n}{z} + \mathrm{inv}\,\alpha_n - \mathrm{inv}\,\alpha_r,
              \qquad \cos\alpha_r = r_b / r

    Parameters
    ----------
    z : int
        Number of teeth, [-]
    x : float
        Profile shift coefficient, [-]
    alpha_n : float
        Pressure angle of the basic rack, [rad]
    r_b : float
        Base radius, [m]
    r : float
        Radius, [m]; below r_b the angle of the base circle holds (radial flank)

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
    return (0.5 * math.pi + 2.0 * x * math.tan(alpha_n)) / z + involute(alpha_n) - involute(alpha_r)


def gear_loss_factor_ohlendorf(*, z_1: int, u: float, epsilon_1: float, epsilon_2: float) -> float:
    r"""Gear loss factor after Ohlendorf [1]_: rigid teeth, pitch point where one pair carries alone.

    .. math:: H_V = \frac{\pi(u+1)}{z_1 u}\,(1 - \varepsilon_\alpha + \varepsilon_1^2 + \varepsilon_2^2)

    Parameters
    ----------
    z_1 : int
        Number of teeth of the driving gear, [-]
    u : float
        Gear ratio z_2 / z_1, [-]
    epsilon_1, epsilon_2 : float
        Tip contact ratios CE / p_b of gear 1 and AC / p_b of gear 2, [-]

    Returns
    -------
    float
        Gear loss factor, [-]

    References
    ----------
    .. [1] H. Ohlendorf, "Verlustleistung und Erwaermung von Stirnraedern", dissertation, TH Muenchen, 1958;
       the form printed in ISO/TR 14179-2.

    Examples
    --------
    >>> round(gear_loss_factor_ohlendorf(z_1=16, u=1.5, epsilon_1=0.7221, epsilon_2=0.7151), 4)
    0.1949
    """
    return math.pi * (u + 1.0) / (z_1 * u) * (1.0 - (epsilon_1 + epsilon_2) + epsilon_1**2 + epsilon_2**2)


@dataclass(frozen=True, kw_only=True)
class GearPair:
    """An external spur gear pair whose input has been checked; built by :func:`gear_pair`.

    Pairs of values belong to gear 1 (driving) and gear 2. Attributes T1A ... T1E are coordinates on the line of action.

    Attributes
    ----------
    z : tuple of int
        Numbers of teeth, [-]
    m_n, b, a : float
        Module, face width, working centre distance, [m]
    alpha_n, alpha_wt : float
        Pressure angle of the basic rack and working pressure angle, [rad]
    x, k : tuple of float
        Profile shift and tip alteration coefficients, [-]
    u : float
        Gear ratio z_2 / z_1, [-]
    r, r_b, r_w, r_a, r_f : tuple of float
        Reference, base, working pitch, tip and root radii, [m]
    p_b : float
        Base pitch, [m]
    T1T2, T1A, T1B, T1C, T1D, T1E : float
        Length of the line of action, and coordinates: start of contact A, end of contact less one base pitch B, pitch
        point C, start plus one base pitch D, end of contact E, [m]
    epsilon_alpha, epsilon_1, epsilon_2 : float
        Contact ratio, and its shares CE / p_b and AC / p_b, [-]
    rho_red_C : float
        Radius of relative curvature at the pitch point, [m]
    H_V : float
        Gear loss factor after Ohlendorf, [-]
    """

    z: tuple[int, int]
    m_n: float
    b: float
    a: float
    alpha_n: float
    alpha_wt: float
    x: tuple[float, float]
    k: tuple[float, float]
    u: float
    r: tuple[float, float]
    r_b: tuple[float, float]
    r_w: tuple[float, float]
    r_a: tuple[float, float]
    r_f: tuple[float, float]
    p_b: float
    T1T2: float
    T1A: float
    T1B: float
    T1C: float
    T1D: float
    T1E: float
    epsilon_alpha: float
    epsilon_1: float
    epsilon_2: float
    rho_red_C: float
    H_V: float

    def curvature_radii(self, t: Numeric) -> tuple[Array, Array, Array]:
        """Radii of curvature of the flanks in contact, and of relative curvature (Euler-Savary on involutes).

        Parameters
        ----------
        t : Numeric, shape (...)
            Coordinate on the line of action, [m]

        Returns
        -------
        (rho_1, rho_2, R) : tuple of Array, shape (...)
            Radii of flank 1, of flank 2, and of relative curvature rho_1 rho_2 / T1T2, [m]
        """
        rho_1 = np.asarray(t, dtype=np.float64)
        rho_2 = self.T1T2 - rho_1
        return rho_1, rho_2, rho_1 * rho_2 / self.T1T2

    def speeds(self, t: Numeric, omega_1: Numeric) -> tuple[Array, Array]:
        """Speeds of the two flanks along the contact, relative to the contact point.

        Parameters
        ----------
        t : Numeric, shape (...)
            Coordinate on the line of action, [m]
        omega_1 : Numeric, broadcastable with t
            Speed of gear 1, [rad/s]

        Returns
        -------
        (u_1, u_2) : tuple of Array
            Surface speeds omega_i rho_i, [m/s]
        """
        rho_1, rho_2, _ = self.curvature_radii(t)
        omega = np.asarray(omega_1, dtype=np.float64)
        return omega * rho_1, omega / self.u * rho_2

    def sliding_speed(self, t: Numeric, omega_1: Numeric) -> Array:
        """Magnitude of the sliding speed abs(u_1 - u_2), [m/s]; arguments as in :meth:`speeds`."""
        u_1, u_2 = self.speeds(t, omega_1)
        return np.asarray(np.abs(u_1 - u_2), dtype=np.float64)

    def base_half_angle(self, gear: int) -> float:
        """Half tooth angle at the base circle of gear 0 (driving) or 1 (driven), [rad]."""
        r_b = self.r_b[gear]
        return half_tooth_angle(z=self.z[gear], x=self.x[gear], alpha_n=self.alpha_n, r_b=r_b, r=r_b)


def _shape_faults(pair: GearPair) -> list[str]:
    """Faults of the tooth shapes and of their contact."""
    faults = []
    for i in (0, 1):
        gear = f"gear {i + 1}"
        x_least = smallest_profile_shift(pair.z[i], pair.alpha_n, UNDERCUT_ADDENDUM)
        if pair.x[i] < x_least:
            faults.append(
                f"{gear}: profile shift {pair.x[i]:g} undercuts its {pair.z[i]} teeth; "
                f"it must be at least {x_least:.4f} (or take more teeth)"
            )
        if pair.r_a[i] <= max(pair.r_b[i], pair.r_f[i]):
            faults.append(
                f"{gear}: tip diameter {2e3 * pair.r_a[i]:.3f} mm must be above the base diameter "
                f"{2e3 * pair.r_b[i]:.3f} mm and the root diameter {2e3 * pair.r_f[i]:.3f} mm"
            )
            continue
        psi_a = half_tooth_angle(z=pair.z[i], x=pair.x[i], alpha_n=pair.alpha_n, r_b=pair.r_b[i], r=pair.r_a[i])
        if psi_a <= 0.0:
            faults.append(
                f"{gear}: pointed teeth, tip thickness {2e3 * pair.r_a[i] * psi_a:.3f} mm at tip diameter "
                f"{2e3 * pair.r_a[i]:.3f} mm must be above 0; lower its profile shift {pair.x[i]:g} or its tip diameter"
            )
        clearance = pair.a - pair.r_a[i] - pair.r_f[1 - i]
        if clearance < 0.0:
            faults.append(
                f"{gear}: its tip cuts {-1e3 * clearance:.3f} mm into the root of gear {2 - i}; "
                "shorten the tip or raise the centre distance"
            )
    if pair.T1A < 0.0:
        faults.append(
            f"contact would start {-1e3 * pair.T1A:.3f} mm before T1, where gear 1 has no involute: "
            "reduce the tip diameter of gear 2 or raise the profile shift of gear 1"
        )
    if pair.T1E > pair.T1T2:
        faults.append(
            f"contact would end {1e3 * (pair.T1E - pair.T1T2):.3f} mm beyond T2, where gear 2 has no involute: "
            "reduce the tip diameter of gear 1 or raise the profile shift of gear 2"
        )
    if pair.epsilon_alpha < 1.0:
        faults.append(
            f"contact ratio {pair.epsilon_alpha:.3f} must be at least 1: the teeth lose contact; raise the tip "
            "diameters or the numbers of teeth, or lower the profile shifts or the centre distance"
        )
    return faults


def _asked_centre_distance(z: tuple[int, int], m_n: float, alpha_n: float, x_sum: float) -> str:
    a = centre_distance(z, m_n, alpha_n, x_sum)
    return "have no centre distance at all" if math.isnan(a) else f"ask for {1e3 * a:.3f} mm"


def gear_pair(
    *,
    z: tuple[int, int],
    m_n: float,
    alpha_n: float,
    b: float,
    a: float,
    x: tuple[float, float],
    tip_shortening: bool = True,
    r_a: tuple[float, float] | None = None,
) -> GearPair:
    r"""Check a spur gear pair and compute its geometry (DIN 3960 / ISO 21771).

    .. math::
        \cos\alpha_{wt} = \frac{r_{b1}+r_{b2}}{a}, \quad \overline{T_1E} = \sqrt{r_{a1}^2 - r_{b1}^2}, \quad
        \overline{T_1A} = a\sin\alpha_{wt} - \sqrt{r_{a2}^2 - r_{b2}^2}, \quad p_b = \pi m_n\cos\alpha_n

    Parameters
    ----------
    z : tuple of int
        Numbers of teeth of the driving and the driven gear, [-]
    m_n : float
        Module, [m]
    alpha_n : float
        Pressure angle of the basic rack, [rad]
    b : float
        Common face width, [m]
    a : float
        Working centre distance, [m]; kept as given when x_1 + x_2 departs from it by rounding or backlash
    x : tuple of float
        Profile shift coefficients, [-]
    tip_shortening : bool
        Shorten both tips by k = (a - a_0)/m_n - (x_1 + x_2) modules, which keeps the rack's tip clearance; k is held
        at 0 or below
    r_a : tuple of float, optional
        Tip radii, [m]; they override tip_shortening

    Returns
    -------
    GearPair
        The checked pair with all derived lengths

    Raises
    ------
    InputError
        Naming every fault: a centre distance that no mesh can have or that contradicts the profile shifts, undercut,
        pointed teeth, interference, contact ratio below 1.

    Examples
    --------
    FZG type C:

    >>> pair = gear_pair(z=(16, 24), m_n=4.5e-3, alpha_n=math.radians(20.0), b=14e-3, a=91.5e-3, x=(0.182, 0.172))
    >>> round(pair.epsilon_alpha, 5), round(2e3 * pair.r_a[0], 3), round(2e3 * pair.r_a[1], 3)
    (1.43716, 82.452, 118.362)
    """
    r = (0.5 * m_n * z[0], 0.5 * m_n * z[1])
    r_b = (r[0] * math.cos(alpha_n), r[1] * math.cos(alpha_n))
    if a <= sum(r_b):
        raise InputError(
            f"gear pair: centre distance {1e3 * a:g} mm must be above {1e3 * sum(r_b):.3f} mm, the sum of the base "
            f"radii; profile shifts {x[0]:g} and {x[1]:g} {_asked_centre_distance(z, m_n, alpha_n, sum(x))}"
        )
    alpha_wt = math.acos(sum(r_b) / a)
    x_sum = profile_shift_sum(z, alpha_n, alpha_wt)
    if abs(sum(x) - x_sum) > SHIFT_SUM_TOLERANCE:
        raise InputError(
            f"gear pair: centre distance {1e3 * a:g} mm asks for profile shifts that sum to {x_sum:.4f}, but "
            f"{x[0]:g} and {x[1]:g} sum to {sum(x):.4f} and {_asked_centre_distance(z, m_n, alpha_n, sum(x))}; "
            f"correct one of them (the sums may differ by {SHIFT_SUM_TOLERANCE:g})"
        )

    if r_a is None:
        shortening = min(0.0, (a - sum(r)) / m_n - sum(x)) if tip_shortening else 0.0
        r_a = (r[0] + m_n * (ADDENDUM + x[0] + shortening), r[1] + m_n * (ADDENDUM + x[1] + shortening))
    r_f = (r[0] - m_n * (DEDENDUM - x[0]), r[1] - m_n * (DEDENDUM - x[1]))

    u = z[1] / z[0]
    p_b = math.pi * m_n * math.cos(alpha_n)
    T1T2 = a * math.sin(alpha_wt)
    T1C = r_b[0] * math.tan(alpha_wt)
    # A tip inside its base circle is reported as a fault below; until then it counts as lying on it.
    T1E = math.sqrt(max(0.0, r_a[0] ** 2 - r_b[0] ** 2))
    T1A = T1T2 - math.sqrt(max(0.0, r_a[1] ** 2 - r_b[1] ** 2))
    epsilon_1, epsilon_2 = (T1E - T1C) / p_b, (T1C - T1A) / p_b
    pair = GearPair(
        z=z,
        m_n=m_n,
        b=b,
        a=a,
        alpha_n=alpha_n,
        alpha_wt=alpha_wt,
        x=x,
        k=((r_a[0] - r[0]) / m_n - ADDENDUM - x[0], (r_a[1] - r[1]) / m_n - ADDENDUM - x[1]),
        u=u,
        r=r,
        r_b=r_b,
        r_w=(a / (1.0 + u), a * u / (1.0 + u)),
        r_a=r_a,
        r_f=r_f,
        p_b=p_b,
        T1T2=T1T2,
        T1A=T1A,
        T1B=T1E - p_b,
        T1C=T1C,
        T1D=T1A + p_b,
        T1E=T1E,
        epsilon_alpha=(T1E - T1A) / p_b,
        epsilon_1=epsilon_1,
        epsilon_2=epsilon_2,
        rho_red_C=T1C * (T1T2 - T1C) / T1T2,
        H_V=gear_loss_factor_ohlendorf(z_1=z[0], u=u, epsilon_1=epsilon_1, epsilon_2=epsilon_2),
    )
    if faults := _shape_faults(pair):
        raise InputError("gear pair: " + "; ".join(faults))
    return pair
