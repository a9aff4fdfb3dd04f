"""Geometry and kinematics of an external pair of cylindrical gears, spur or helical.

Lengths in m, angles in rad. A position on the line of action is its coordinate ``t`` in the transverse plane: the
distance from T1, where the line touches the base circle of gear 1. Gear 1 drives, so a tooth pair enters at A, and
leaves at E; between B and D it is alone (contact ratio below 2; at one face position of helical gears). The plain
functions are the formulas; :func:`gear_pair` checks the input and fills a :class:`GearPair`.

All formulas are those of DIN 3960 / ISO 21771. Spur gears are those of helix angle zero.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from models.base.errors import InputError
from models.base.types import Array, Numeric
from models.formulas.involute import (
    ADDENDUM,
    centre_distance,
    half_tooth_angle,
    profile_shift_sum,
    smallest_profile_shift,
    transverse_pressure_angle,
)

DEDENDUM = 1.25  # h_fP / m_n of the basic rack, ISO 53 profile A
# Below this rack addendum undercut reaches the working flank (DIN 3960: z_min = 14 in place of 17 at 20 degrees).
# The theoretical value 1.0 would refuse FZG type A, whose wheel has x = -0.5 where theory asks for -0.404.
UNDERCUT_ADDENDUM = 14.0 / 17.0
# Departure of x_1 + x_2 from the value that goes with a; beyond it is no rounding or backlash but a wrong number.
SHIFT_SUM_TOLERANCE = 0.05


def gear_loss_factor_ohlendorf(*, z_1: int, u: float, epsilon_1: float, epsilon_2: float, beta_b: float = 0.0) -> float:
    r"""Gear loss factor after Ohlendorf [1]_: rigid teeth, pitch point where one pair carries alone.

    .. math:: H_V = \frac{\pi(u+1)}{z_1 u\cos\beta_b}\,(1 - \varepsilon_\alpha + \varepsilon_1^2 + \varepsilon_2^2)

    Parameters
    ----------
    z_1 : int
        Number of teeth of the driving gear, [-]
    u : float
        Gear ratio z_2 / z_1, [-]
    epsilon_1, epsilon_2 : float
        Tip contact ratios CE / p_b of gear 1 and AC / p_b of gear 2, [-]
    beta_b : float
        Helix angle at the base circle, [rad]

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
    spur = math.pi * (u + 1.0) / (z_1 * u) * (1.0 - (epsilon_1 + epsilon_2) + epsilon_1**2 + epsilon_2**2)
    return spur / math.cos(beta_b)


@dataclass(frozen=True, kw_only=True)
class GearPair:
    """An external pair of cylindrical gears whose input has been checked; built by :func:`gear_pair`.

    Pairs of values belong to gear 1 (driving) and gear 2. Attributes T1A ... T1E are coordinates on the line of action.

    Attributes
    ----------
    z : tuple of int
        Numbers of teeth, [-]
    m_n, b, a : float
        Normal module, face width, working centre distance, [m]
    alpha_n, alpha_t, alpha_wt : float
        Pressure angle of the basic rack, in the transverse plane, and working pressure angle there, [rad]
    beta, beta_b : float
        Helix angle at the reference and at the base circle, [rad]
    x, k : tuple of float
        Profile shift and tip alteration coefficients, [-]
    u : float
        Gear ratio z_2 / z_1, [-]
    r, r_b, r_w, r_a, r_f : tuple of float
        Reference, base, working pitch, tip and root radii, [m]
    p_b : float
        Base pitch in the transverse plane, [m]
    T1T2, T1A, T1B, T1C, T1D, T1E : float
        Length of the line of action, and coordinates: start of contact A, end of contact less one base pitch B, pitch
        point C, start plus one base pitch D, end of contact E, [m]
    epsilon_alpha, epsilon_1, epsilon_2 : float
        Transverse contact ratio, and its shares CE / p_b and AC / p_b, [-]
    epsilon_beta : float
        Overlap ratio, [-]; 0 of spur gears
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
    alpha_t: float
    alpha_wt: float
    beta: float
    beta_b: float
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
    epsilon_beta: float
    rho_red_C: float
    H_V: float

    def curvature_radii(self, t: Numeric) -> tuple[Array, Array, Array]:
        r"""Radii of curvature of the flanks in contact, and of relative curvature (Euler-Savary on involutes).

        .. math:: \rho_1 = t, \quad \rho_2 = \overline{T_1T_2} - t, \quad
                  R = \frac{\rho_1\rho_2}{\overline{T_1T_2}\cos\beta_b}

        Parameters
        ----------
        t : Numeric, shape (...)
            Coordinate on the line of action, [m]

        Returns
        -------
        (rho_1, rho_2, R) : tuple of Array, shape (...)
            Radii of flank 1 and flank 2 in the transverse plane, and of relative curvature across the line of
            contact, [m]
        """
        rho_1 = np.asarray(t, dtype=np.float64)
        rho_2 = self.T1T2 - rho_1
        return rho_1, rho_2, rho_1 * rho_2 / (self.T1T2 * math.cos(self.beta_b))

    def speeds(self, t: Numeric, omega_1: Numeric) -> tuple[Array, Array]:
        """Speeds of the two flanks in the transverse plane, relative to the contact point.

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

    def virtual_tooth(self, gear: int) -> tuple[float, float, float]:
        r"""Tooth of the virtual spur gear that has the tooth's normal section; of a spur gear its own.

        .. math:: z_n = z / (\cos^2\beta_b\cos\beta), \quad r_{bn} = \tfrac12 m_n z_n\cos\alpha_n

        Parameters
        ----------
        gear : int
            0 (driving) or 1 (driven)

        Returns
        -------
        (psi_b, r_b, r_f) : tuple of float
            Half tooth angle at the base circle [rad], base and root radius [m]

        References
        ----------
        ISO 6336-1; from memory, verified by the radius of curvature at the pitch point of unshifted gears, which is
        that of the transverse plane over the cosine of beta_b.
        """
        z_n = self.z[gear] / (math.cos(self.beta_b) ** 2 * math.cos(self.beta))
        r = 0.5 * self.m_n * z_n
        r_b = r * math.cos(self.alpha_n)
        psi_b = half_tooth_angle(z=z_n, x=self.x[gear], alpha_n=self.alpha_n, r_b=r_b, r=r_b)
        return psi_b, r_b, r - self.m_n * (DEDENDUM - self.x[gear])


def _shape_faults(pair: GearPair) -> list[str]:
    """Faults of the tooth shapes and of their contact."""
    faults = []
    for i in (0, 1):
        gear = f"gear {i + 1}"
        x_least = smallest_profile_shift(pair.z[i], pair.alpha_n, UNDERCUT_ADDENDUM, pair.beta)
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
        psi_a = half_tooth_angle(
            z=pair.z[i], x=pair.x[i], alpha_n=pair.alpha_n, beta=pair.beta, r_b=pair.r_b[i], r=pair.r_a[i]
        )
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


def _asked_centre_distance(z: tuple[int, int], m_n: float, alpha_n: float, x_sum: float, beta: float) -> str:
    a = centre_distance(z, m_n, alpha_n, x_sum, beta)
    return "have no centre distance at all" if math.isnan(a) else f"ask for {1e3 * a:.3f} mm"


def gear_pair(
    *,
    z: tuple[int, int],
    m_n: float,
    alpha_n: float,
    b: float,
    a: float,
    x: tuple[float, float],
    beta: float = 0.0,
    tip_shortening: bool = True,
    r_a: tuple[float, float] | None = None,
) -> GearPair:
    r"""Check a pair of cylindrical gears and compute its geometry (DIN 3960 / ISO 21771).

    .. math::
        \tan\alpha_t = \tan\alpha_n/\cos\beta, \quad \sin\beta_b = \sin\beta\cos\alpha_n, \quad
        r = \frac{m_n z}{2\cos\beta}, \quad r_b = r\cos\alpha_t, \quad
        \varepsilon_\beta = \frac{b\sin\beta}{\pi m_n} \\
        \cos\alpha_{wt} = \frac{r_{b1}+r_{b2}}{a}, \quad \overline{T_1E} = \sqrt{r_{a1}^2 - r_{b1}^2}, \quad
        \overline{T_1A} = a\sin\alpha_{wt} - \sqrt{r_{a2}^2 - r_{b2}^2}, \quad
        p_b = \pi m_n\cos\alpha_t/\cos\beta

    Parameters
    ----------
    z : tuple of int
        Numbers of teeth of the driving and the driven gear, [-]
    m_n : float
        Normal module, [m]
    alpha_n : float
        Pressure angle of the basic rack, [rad]
    b : float
        Common face width, [m]
    a : float
        Working centre distance, [m]; kept as given when x_1 + x_2 departs from it by rounding or backlash
    x : tuple of float
        Profile shift coefficients, [-]
    beta : float
        Helix angle at the reference circle, [rad]; its hand makes no difference
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
    m_t, alpha_t = m_n / math.cos(beta), transverse_pressure_angle(alpha_n, beta)
    beta_b = math.asin(math.sin(beta) * math.cos(alpha_n))
    r = (0.5 * m_t * z[0], 0.5 * m_t * z[1])
    r_b = (r[0] * math.cos(alpha_t), r[1] * math.cos(alpha_t))
    if a <= sum(r_b):
        raise InputError(
            f"gear pair: centre distance {1e3 * a:g} mm must be above {1e3 * sum(r_b):.3f} mm, the sum of the base "
            f"radii; profile shifts {x[0]:g} and {x[1]:g} {_asked_centre_distance(z, m_n, alpha_n, sum(x), beta)}"
        )
    alpha_wt = math.acos(sum(r_b) / a)
    x_sum = profile_shift_sum(z, alpha_n, alpha_wt, beta)
    if abs(sum(x) - x_sum) > SHIFT_SUM_TOLERANCE:
        raise InputError(
            f"gear pair: centre distance {1e3 * a:g} mm asks for profile shifts that sum to {x_sum:.4f}, but "
            f"{x[0]:g} and {x[1]:g} sum to {sum(x):.4f} and {_asked_centre_distance(z, m_n, alpha_n, sum(x), beta)}; "
            f"correct one of them (the sums may differ by {SHIFT_SUM_TOLERANCE:g})"
        )

    if r_a is None:
        shortening = min(0.0, (a - sum(r)) / m_n - sum(x)) if tip_shortening else 0.0
        r_a = (r[0] + m_n * (ADDENDUM + x[0] + shortening), r[1] + m_n * (ADDENDUM + x[1] + shortening))
    r_f = (r[0] - m_n * (DEDENDUM - x[0]), r[1] - m_n * (DEDENDUM - x[1]))

    u = z[1] / z[0]
    p_b = math.pi * m_t * math.cos(alpha_t)
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
        alpha_t=alpha_t,
        alpha_wt=alpha_wt,
        beta=beta,
        beta_b=beta_b,
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
        epsilon_beta=b * math.sin(beta) / (math.pi * m_n),
        rho_red_C=T1C * (T1T2 - T1C) / (T1T2 * math.cos(beta_b)),
        H_V=gear_loss_factor_ohlendorf(z_1=z[0], u=u, epsilon_1=epsilon_1, epsilon_2=epsilon_2, beta_b=beta_b),
    )
    if faults := _shape_faults(pair):
        raise InputError("gear pair: " + "; ".join(faults))
    return pair
