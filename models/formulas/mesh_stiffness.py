r"""Stiffness of a pair of teeth in contact, by the potential-energy method; helical teeth by their normal section.

Each tooth is a cantilever of variable section on an elastic gear body. Its compliance is the sum of bending, shear and
axial compression of the tooth and of the turn of its foundation; the two teeth and the Hertzian contact lie in series:

.. math:: \frac{1}{k} = \delta_H + \sum_{i=1,2} (\delta_{t,i} + \delta_{f,i})

Validity. The tooth is an involute down to the base circle and a radial flank from there to the root circle (the fillet
is left out: the tooth is a little too soft). The foundation's polynomials were fitted for 1.4 <= r_f / r_bore <= 7 and
0.01 <= theta_f <= 0.12 rad; outside they are extrapolated. The Hertzian part is linear, so the stiffness does not
depend on the load. No tip relief, no coupling between neighbouring teeth through the gear body.
"""

from __future__ import annotations

import math

import numpy as np

from models.base.types import Array, Numeric
from models.formulas.geometry import GearPair

SHEAR_FACTOR = 1.2  # rectangular section
# Coefficients A ... F of X(h, theta) = A/theta^2 + B h^2 + C h/theta + D/theta + E h + F, for X = L*, M*, P*, Q*.
SAINSOT = np.array(
    [
        [-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045],
        [60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086],
        [-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236],
        [-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904],
    ]
)
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(24)  # on -1 ... 1; 24 points give about ten digits


def hertz_compliance(*, b: float, E: tuple[float, float], nu: tuple[float, float]) -> float:
    r"""Linear contact compliance of two teeth [1]_, :math:`\delta_H = \frac{2}{\pi b}\sum_i (1-\nu_i^2)/E_i`.

    For equal materials this is the printed :math:`4(1-\nu^2)/(\pi E b)`; it does not depend on the radii.

    Parameters
    ----------
    b : float
        Face width, [m]
    E : tuple of float
        Young's moduli of the two gears, [Pa]
    nu : tuple of float
        Poisson's ratios, [-]

    Returns
    -------
    float
        Compliance, [m/N]

    References
    ----------
    .. [1] D. C. H. Yang, J. Y. Lin, "Hertzian damping, tooth friction and bending elasticity in gear impact dynamics",
       J. Mech. Trans. Automation 109 (1987) 189-196. From memory; the stiffness of the pair is verified against
       ISO 6336-1 in the tests.

    Examples
    --------
    >>> round(1e-9 / (14e-3 * hertz_compliance(b=14e-3, E=(206e9, 206e9), nu=(0.3, 0.3))), 1)  # N/(mm um)
    177.8
    """
    return 2.0 / (math.pi * b) * sum((1.0 - nu_i**2) / E_i for E_i, nu_i in zip(E, nu, strict=True))


def tooth_compliance(roll_C: Numeric, *, psi_b: float, r_b: float, r_f: float, b: float, E: float, nu: float) -> Array:
    r"""Compliance of one tooth to a normal force on its flank: bending, shear and compression [1]_ [2]_.

    .. math::
        \delta_t = \int_{y_f}^{y_C} \left[\frac{12 M^2}{E b (2x)^3} + \frac{1.2\cos^2\alpha_F}{G b\, 2x}
        + \frac{\sin^2\alpha_F}{E b\, 2x}\right] dy, \qquad M = (y_C - y)\cos\alpha_F - x_C\sin\alpha_F

    with y along the centre line of the tooth from the gear's axis, x its half thickness there, and
    :math:`\alpha_F = \varphi_C - \psi_b` the angle of the force against the normal of the centre line. The involute is
    :math:`x = r_b[\sin A + \varphi\cos A],\ y = r_b[\cos A - \varphi\sin A]` with :math:`A = \psi_b - \varphi`.

    Parameters
    ----------
    roll_C : Numeric, shape (...)
        Roll angle of the loaded point, tan(alpha_C) = rho / r_b, [rad]
    psi_b : float
        Half tooth angle at the base circle, [rad]
    r_b, r_f : float
        Base and root radius, [m]
    b : float
        Face width, [m]
    E : float
        Young's modulus, [Pa]
    nu : float
        Poisson's ratio, [-]

    Returns
    -------
    Array, shape (...)
        Displacement along the line of action per unit of force, [m/N]

    References
    ----------
    .. [1] Yang, Lin, J. Mech. Trans. Automation 109 (1987) 189-196.
    .. [2] X. Tian, "Dynamic simulation for system response of gearbox including localized gear faults", University of
       Alberta, 2004 (shear). Both from memory; verified in the tests against an independent quadrature in y and
       against the closed form of a straight cantilever.

    Examples
    --------
    The FZG type C pinion at the pitch point, tip and near the root, in um per kN:

    >>> from models.formulas.geometry import gear_pair
    >>> pair = gear_pair(z=(16, 24), m_n=4.5e-3, alpha_n=math.radians(20.0), b=14e-3, a=91.5e-3, x=(0.182, 0.172))
    >>> psi_b, r_b, r_f = pair.virtual_tooth(0)
    >>> roll = np.array([pair.T1C, pair.T1E, pair.T1A]) / r_b
    >>> (1e9 * tooth_compliance(roll, psi_b=psi_b, r_b=r_b, r_f=r_f, b=pair.b, E=206e9, nu=0.3)).round(2).tolist()
    [0.93, 3.19, 0.47]
    """
    roll = np.asarray(roll_C, dtype=np.float64)[..., np.newaxis]
    alpha_F = roll - psi_b
    x_C, y_C = _involute_point(roll, psi_b, r_b)
    G = E / (2.0 * (1.0 + nu))

    def integrand(x: Array, y: Array) -> Array:
        moment = (y_C - y) * np.cos(alpha_F) - x_C * np.sin(alpha_F)
        thickness = 2.0 * x
        value: Array = (
            12.0 * moment**2 / (E * b * thickness**3)
            + SHEAR_FACTOR * np.cos(alpha_F) ** 2 / (G * b * thickness)
            + np.sin(alpha_F) ** 2 / (E * b * thickness)
        )
        return value

    # The involute flank, integrated over the roll angle (in which it is smooth): dy = r_b phi cos(phi - psi_b) dphi.
    roll_f = math.sqrt(max(0.0, (r_f / r_b) ** 2 - 1.0))
    half = 0.5 * (roll - roll_f)
    phi = roll_f + half * (1.0 + _NODES)
    x, y = _involute_point(phi, psi_b, r_b)
    total = np.sum(integrand(x, y) * r_b * phi * np.cos(phi - psi_b) * half * _WEIGHTS, axis=-1)

    if r_f < r_b:  # the radial flank between root and base circle
        half_radial = 0.5 * (r_b - r_f)
        r = r_f + half_radial * (1.0 + _NODES)
        radial = integrand(r * math.sin(psi_b), r * math.cos(psi_b))
        total = total + np.sum(radial * math.cos(psi_b) * half_radial * _WEIGHTS, axis=-1)
    return np.asarray(total, dtype=np.float64)


def _involute_point(roll: Array, psi_b: float, r_b: float) -> tuple[Array, Array]:
    """Half thickness x and height y of the flank at a roll angle, from the axis along the tooth's centre line, [m]."""
    angle = psi_b - roll
    return r_b * (np.sin(angle) + roll * np.cos(angle)), r_b * (np.cos(angle) - roll * np.sin(angle))


def foundation_compliance(
    roll_C: Numeric, *, psi_b: float, r_b: float, r_f: float, r_bore: float, b: float, E: float
) -> Array:
    r"""Compliance of the gear body under one tooth after Sainsot, Velex and Duverger [1]_.

    .. math::
        \delta_f = \frac{\cos^2\alpha_F}{E b}\left[L^*\left(\frac{u_f}{s_f}\right)^2 + M^*\frac{u_f}{s_f}
        + P^*(1 + Q^*\tan^2\alpha_F)\right], \quad u_f = \frac{r_b}{\cos\alpha_F} - r_f, \quad s_f = 2 r_f\theta_f

    with :math:`\theta_f` the half tooth angle at the root and :math:`L^* \dots Q^*` of :func:`sainsot_coefficients`.

    Parameters
    ----------
    roll_C : Numeric, shape (...)
        Roll angle of the loaded point, [rad]
    psi_b : float
        Half tooth angle at the base circle, [rad]
    r_b, r_f, r_bore : float
        Base, root and bore radius, [m]
    b : float
        Face width, [m]
    E : float
        Young's modulus, [Pa]

    Returns
    -------
    Array, shape (...)
        Displacement along the line of action per unit of force, [m/N]

    References
    ----------
    .. [1] P. Sainsot, P. Velex, O. Duverger, "Contribution of gear body to tooth deflections - a new bidimensional
       analytical formula", J. Mech. Design 126 (2004) 748-752.

    Examples
    --------
    At the same points as in :func:`tooth_compliance`, in um per kN:

    >>> from models.formulas.geometry import gear_pair
    >>> pair = gear_pair(z=(16, 24), m_n=4.5e-3, alpha_n=math.radians(20.0), b=14e-3, a=91.5e-3, x=(0.182, 0.172))
    >>> psi_b, r_b, r_f = pair.virtual_tooth(0)
    >>> sizes = {"psi_b": psi_b, "r_b": r_b, "r_f": r_f, "r_bore": 15e-3, "b": pair.b}
    >>> roll = np.array([pair.T1C, pair.T1E, pair.T1A]) / r_b
    >>> (1e9 * foundation_compliance(roll, E=206e9, **sizes)).round(2).tolist()
    [1.76, 3.59, 1.38]
    """
    theta_f = root_half_angle(psi_b=psi_b, r_b=r_b, r_f=r_f)
    L, M, P, Q = sainsot_coefficients(r_f / r_bore, theta_f)
    alpha_F = np.asarray(roll_C, dtype=np.float64) - psi_b
    lever = (r_b / np.cos(alpha_F) - r_f) / (2.0 * r_f * theta_f)
    bracket = L * lever**2 + M * lever + P * (1.0 + Q * np.tan(alpha_F) ** 2)
    return np.asarray(np.cos(alpha_F) ** 2 / (E * b) * bracket, dtype=np.float64)


def sainsot_coefficients(h: float, theta_f: float) -> tuple[float, float, float, float]:
    r"""Factors L*, M*, P*, Q* of :func:`foundation_compliance`, each
    :math:`A/\theta^2 + Bh^2 + Ch/\theta + D/\theta + Eh + F`.

    Parameters
    ----------
    h : float
        Root radius over bore radius, [-]; fitted for 1.4 to 7
    theta_f : float
        Half tooth angle at the root, [rad]; fitted for 0.01 to 0.12

    Returns
    -------
    (L, M, P, Q) : tuple of float
        The factors, [-]

    Examples
    --------
    >>> [round(factor, 3) for factor in sainsot_coefficients(2.0796, 0.1)]
    [6.89, 1.155, 2.81, 0.487]
    """
    terms = np.array([theta_f**-2, h**2, h / theta_f, 1.0 / theta_f, h, 1.0])
    L, M, P, Q = (SAINSOT @ terms).tolist()
    return L, M, P, Q


def root_half_angle(*, psi_b: float, r_b: float, r_f: float) -> float:
    """Half tooth angle at the root circle, [rad]; that of the base circle where the flank below it is radial."""
    alpha_f = math.acos(min(1.0, r_b / r_f))
    return psi_b - (math.tan(alpha_f) - alpha_f)


def default_bore(pair: GearPair) -> tuple[float, float]:
    """Bore radii for a pair whose bores are not known: a third of the root radii, amid the fitted range, [m]."""
    return pair.r_f[0] / 3.0, pair.r_f[1] / 3.0


def tooth_pair_stiffness(
    pair: GearPair,
    t: Numeric,
    *,
    r_bore: tuple[float, float] | None = None,
    E: tuple[float, float] = (206e9, 206e9),
    nu: tuple[float, float] = (0.3, 0.3),
) -> Array:
    """Stiffness of one pair of teeth that touches at a point of the line of action; see the module's text.

    Of helical gears it is that of the virtual spur pair (:meth:`~models.formulas.geometry.GearPair.virtual_tooth`),
    whose bores have the same ratio to its root circles.

    Parameters
    ----------
    pair : GearPair
        The gears
    t : Numeric, shape (...)
        Coordinate on the line of action, [m]; the caller keeps it between A and E
    r_bore : tuple of float, optional
        Bore radii, [m]; default :func:`default_bore`
    E : tuple of float
        Young's moduli, [Pa]
    nu : tuple of float
        Poisson's ratios, [-]

    Returns
    -------
    Array, shape (...)
        Normal force per displacement along the line of action, [N/m], over the whole face width

    Examples
    --------
    >>> from models.formulas.geometry import gear_pair
    >>> pair = gear_pair(z=(16, 24), m_n=4.5e-3, alpha_n=math.radians(20.0), b=14e-3, a=91.5e-3, x=(0.182, 0.172))
    >>> k = tooth_pair_stiffness(pair, np.array([pair.T1A, pair.T1C, pair.T1E]), r_bore=(15e-3, 15e-3))
    >>> np.round(k / pair.b * 1e-9, 2)  # N/(mm um)
    array([ 7.84, 11.39,  7.65])
    """
    bores = r_bore or default_bore(pair)
    rho_1, rho_2, _ = pair.curvature_radii(t)
    compliance = np.full(rho_1.shape, hertz_compliance(b=pair.b, E=E, nu=nu))
    for i, rho in enumerate((rho_1, rho_2)):
        psi_b, r_b, r_f = pair.virtual_tooth(i)
        roll, bore = rho / math.cos(pair.beta_b) / r_b, bores[i] * r_f / pair.r_f[i]
        compliance += tooth_compliance(roll, psi_b=psi_b, r_b=r_b, r_f=r_f, b=pair.b, E=E[i], nu=nu[i])
        compliance += foundation_compliance(roll, psi_b=psi_b, r_b=r_b, r_f=r_f, r_bore=bore, b=pair.b, E=E[i])
    return np.asarray(1.0 / compliance, dtype=np.float64)
