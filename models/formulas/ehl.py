"""Elastohydrodynamic line contact: pressure, film thickness, its thermal reduction, roughness and heat.

One author-named function per correlation. All quantities SI, temperatures in degC, arrays broadcast.
"""

from __future__ import annotations

import numpy as np
from scipy.special import erf

from models.base.types import Array, Numeric

H_MIN_OVER_H_C = 0.75  # line contact, minimum over central film (Dowson); from memory, for Matsumoto's lambda only


def reduced_modulus(E_1: float, nu_1: float, E_2: float, nu_2: float) -> float:
    """Reduced elastic modulus of a contact, ``E' = 2 / ((1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2)``, [Pa].

    Examples
    --------
    >>> round(reduced_modulus(206e9, 0.3, 206e9, 0.3) / 1e11, 3)
    2.264
    """
    return 2.0 / ((1.0 - nu_1**2) / E_1 + (1.0 - nu_2**2) / E_2)


def hertz_line(w: Numeric, R: Numeric, E_red: float) -> tuple[Array, Array]:
    """Half-width and peak pressure of a Hertzian line contact.

    ``b_H = sqrt(8 w R / (pi E'))``, ``p_H = 2 w / (pi b_H)``.

    Parameters
    ----------
    w : Numeric, shape (...)
        Load per length, [N/m]
    R : Numeric, shape (...)
        Reduced radius of curvature, [m]
    E_red : float
        Reduced modulus of :func:`reduced_modulus`, [Pa]

    Returns
    -------
    b_H, p_H : Array, shape (...)
        Half-width [m] and peak pressure [Pa]

    References
    ----------
    Johnson, "Contact Mechanics", 1985, section 4.2.

    Examples
    --------
    The FZG type C pair at the pitch point under 200 N m (GEARpie prints 199.6 um, 1347.3 MPa):

    >>> b_H, p_H = hertz_line(200.0 / 33.8289e-3 / 14e-3, 8.3821e-3, reduced_modulus(206e9, 0.3, 206e9, 0.3))
    >>> round(float(b_H) * 1e6, 1), round(float(p_H) / 1e6, 1)
    (199.5, 1347.3)
    """
    b_H = np.sqrt(8.0 * np.asarray(w) * R / (np.pi * E_red))
    return b_H, 2.0 * np.asarray(w) / (np.pi * b_H)


def film_hamrock_dowson(*, F: Numeric, R: Numeric, E_red: float, eta: Numeric, alpha: Numeric, V_e: Numeric) -> Array:
    r"""Central film thickness, :math:`2.69\,R\,G^{0.53}U^{0.67}Q^{-0.067}` (Hamrock-Dowson, long ellipse).

    With :math:`G = \alpha E'`, :math:`U = \eta V_e/(E'R)` and :math:`Q = F/(E'R^2)`.

    Parameters
    ----------
    F : Numeric, shape (...)
        Normal force, [N]
    R : Numeric, shape (...)
        Reduced radius of curvature, [m]
    E_red : float
        Reduced modulus, [Pa]
    eta : Numeric, shape (...)
        Dynamic viscosity at the inlet, [Pa s]
    alpha : Numeric, shape (...)
        Film pressure-viscosity coefficient, [1/Pa]
    V_e : Numeric, shape (...)
        Entrainment (mean) speed, [m/s]

    Returns
    -------
    Array, shape (...)
        [m]

    References
    ----------
    Hamrock, Dowson, J. Lubrication Technology 99 (1977); as used by Arana et al. 2019, eqs. (19)-(22).

    Examples
    --------
    The FZG type C pair at the pitch point, 1500 1/min, 200 N m, oil of 60 degC, [um]:

    >>> oil = {"eta": 0.01307, "alpha": 15.6e-9}
    >>> h = film_hamrock_dowson(F=5912.0, R=8.3821e-3, E_red=2.264e11, V_e=2.194, **oil)
    >>> round(float(h) * 1e6, 3)
    0.163
    """
    G, U = alpha * E_red, eta * V_e / (E_red * R)
    return np.asarray(2.69 * R * G**0.53 * U**0.67 * (F / (E_red * R**2)) ** -0.067)


def film_dowson_toyoda(*, w: Numeric, R: Numeric, E_red: float, eta: Numeric, alpha: Numeric, V_e: Numeric) -> Array:
    r"""Central film thickness of a line contact, :math:`3.06\,R\,U^{0.69}G^{0.56}W^{-0.10}`, [m].

    Parameters, G and U as :func:`film_hamrock_dowson`, with `w` the load per length [N/m] and :math:`W = w/(E'R)`.

    References
    ----------
    Dowson, Toyoda, 5th Leeds-Lyon Symposium, 1978; from memory, within 21 % of Hamrock-Dowson at the FZG pitch point.

    Examples
    --------
    The FZG type C pair at the pitch point, see :func:`film_hamrock_dowson`, [um]:

    >>> oil = {"eta": 0.01307, "alpha": 15.6e-9}
    >>> h = film_dowson_toyoda(w=5912.0 / 14e-3, R=8.3821e-3, E_red=2.264e11, V_e=2.194, **oil)
    >>> round(float(h) * 1e6, 3)
    0.197
    """
    G, U = alpha * E_red, eta * V_e / (E_red * R)
    return np.asarray(3.06 * R * U**0.69 * G**0.56 * (w / (E_red * R)) ** -0.10)


def film_grubin(*, w: Numeric, R: Numeric, E_red: float, eta: Numeric, alpha: Numeric, V_e: Numeric) -> Array:
    r"""Central film thickness of a line contact, :math:`1.95\,R\,(GU)^{8/11}W^{-1/11}`, [m].

    Parameters, G and U as :func:`film_hamrock_dowson`, with `w` the load per length [N/m] and :math:`W = w/(E'R)`.

    References
    ----------
    Grubin, 1949; from memory, within 11 % of Hamrock-Dowson at the FZG pitch point.

    Examples
    --------
    The FZG type C pair at the pitch point, see :func:`film_hamrock_dowson`, [um]:

    >>> oil = {"eta": 0.01307, "alpha": 15.6e-9}
    >>> h = film_grubin(w=5912.0 / 14e-3, R=8.3821e-3, E_red=2.264e11, V_e=2.194, **oil)
    >>> round(float(h) * 1e6, 3)
    0.18
    """
    G, U = alpha * E_red, eta * V_e / (E_red * R)
    return np.asarray(1.95 * R * (G * U) ** (8.0 / 11.0) * (w / (E_red * R)) ** (-1.0 / 11.0))


def thermal_reduction_gupta(*, p_H: Numeric, E_red: float, L: Numeric, slide_roll_ratio: Numeric) -> Array:
    r"""Thermal reduction of the film thickness after Gupta et al., numerator held at 0.1 or above.

    .. math:: \Phi_T = \frac{1 - 13.2 (p_H/E') L^{0.42}}{1 + 0.213 (1 + 2.23\,SRR^{0.83}) L^{0.64}}

    Parameters
    ----------
    p_H : Numeric, shape (...)
        Hertz pressure, [Pa]
    E_red : float
        Reduced modulus, [Pa]
    L : Numeric, shape (...)
        Thermal loading parameter :func:`thermal_loading`, [-]
    slide_roll_ratio : Numeric, shape (...)
        Sliding speed over entrainment speed, [-]

    Returns
    -------
    Array, shape (...)
        [-]

    References
    ----------
    Gupta, Cheng, Zhu, Forster, Schrand, Tribology Transactions 35 (1992); Arana et al. 2019, eq. (24).

    Examples
    --------
    >>> round(float(thermal_reduction_gupta(p_H=1.35e9, E_red=2.264e11, L=0.764, slide_roll_ratio=0.5)), 3)
    0.662
    """
    numerator = np.maximum(1.0 - 13.2 * (p_H / E_red) * L**0.42, 0.1)
    return np.asarray(numerator / (1.0 + 0.213 * (1.0 + 2.23 * slide_roll_ratio**0.83) * L**0.64))


def thermal_reduction_gupta_simple(*, L: Numeric, slide_roll_ratio: Numeric) -> Array:
    """Thermal reduction without pressure, ``1 / (1 + 0.1 (1 + 14.8 SRR^0.83) L^0.64)``, [-].

    References
    ----------
    The form that FEUP's GEARpie uses, there after Gupta et al. 1992.

    Examples
    --------
    >>> round(float(thermal_reduction_gupta_simple(L=0.764, slide_roll_ratio=0.5)), 3)
    0.56
    """
    return np.asarray(1.0 / (1.0 + 0.1 * (1.0 + 14.8 * slide_roll_ratio**0.83) * L**0.64))


def thermal_reduction_murch_wilson(*, L: Numeric) -> Array:
    """Thermal reduction of pure rolling, ``3.94 / (3.94 + L^0.62)``, [-].

    References
    ----------
    Murch, Wilson, J. Lubrication Technology 97 (1975); from memory, tends to 1 for L -> 0.

    Examples
    --------
    >>> round(float(thermal_reduction_murch_wilson(L=0.764)), 3)
    0.823
    """
    return np.asarray(3.94 / (3.94 + L**0.62))


def thermal_loading(*, eta: Numeric, beta: Numeric, V_e: Numeric, k_oil: Numeric) -> Array:
    """Thermal loading parameter ``eta beta V_e^2 / k_oil``, [-].

    Parameters
    ----------
    eta : Numeric
        Dynamic viscosity at the inlet, [Pa s]
    beta : Numeric
        Thermo-viscosity coefficient, [1/K]
    V_e : Numeric
        Entrainment speed, [m/s]
    k_oil : Numeric
        Conductivity of the oil, [W/(m K)]

    Examples
    --------
    Mineral oil VG 32 at 60 degC and 15 m/s:

    >>> round(float(thermal_loading(eta=0.01307, beta=0.0335, V_e=15.0, k_oil=0.129)), 3)
    0.764
    """
    return np.asarray(eta * beta * V_e**2 / k_oil)


def asperity_share_doleschel(h: Numeric, Ra_mean: float) -> Array:
    r"""Load share of the asperities after Doleschel, :math:`\xi = (1 - \lambda/2)^2` for :math:`\lambda < 2`.

    Parameters
    ----------
    h : Numeric, shape (...)
        Central film thickness, thermal reduction included, [m]
    Ra_mean : float
        ``(Ra_1 + Ra_2) / 2``, [m]

    Returns
    -------
    Array, shape (...)
        [-], 1 for no film, 0 from ``lambda = 2`` on

    References
    ----------
    Doleschel, thesis, TU Munich 2003; Arana et al. 2019, Table 1.

    Examples
    --------
    >>> asperity_share_doleschel(np.array([0.0, 1e-7, 4e-7]), 1e-7)
    array([1.  , 0.25, 0.  ])
    """
    return np.asarray(np.maximum(1.0 - 0.5 * np.asarray(h) / Ra_mean, 0.0) ** 2)


def asperity_share_erf(h: Numeric, Rq_composite: float) -> Array:
    """Share of the load that asperities carry, ``1 - erf(lambda)`` with the composite r.m.s. roughness.

    References
    ----------
    Arana et al. 2019, Table 1.

    Examples
    --------
    A film of 0.163 um on surfaces of 0.234 um together:

    >>> round(float(asperity_share_erf(0.163e-6, 0.234e-6)), 3)
    0.325
    """
    return np.asarray(1.0 - erf(np.asarray(h) / Rq_composite))


def asperity_share_diab(h: Numeric, Rq_composite: float) -> Array:
    """Share of the load that asperities carry after Diab, ``(1 - erf(lambda / sqrt 2)) / 4``.

    References
    ----------
    Arana et al. 2019, Table 1; the factor 1/4 stands there, so the share ends at 0.25 without a film.

    Examples
    --------
    >>> round(float(asperity_share_diab(0.163e-6, 0.234e-6)), 3)
    0.122
    """
    return np.asarray(0.25 * (1.0 - erf(np.asarray(h) / (np.sqrt(2.0) * Rq_composite))))


def asperity_share_matsumoto(h: Numeric, Rz_sum: float) -> Array:
    """Share of the load that asperities carry after Matsumoto, ``lg(1/lambda) / 2`` held in 0 ... 1.

    Parameters
    ----------
    h : Numeric, shape (...)
        Central film thickness, [m]; the minimum film is taken as 0.75 of it
    Rz_sum : float
        ``Rz_1 + Rz_2``, [m]

    References
    ----------
    Arana et al. 2019, Table 1.

    Examples
    --------
    >>> round(float(asperity_share_matsumoto(0.163e-6, 2e-6)), 3)
    0.607
    """
    lam = H_MIN_OVER_H_C * np.asarray(h) / Rz_sum
    return np.asarray(np.clip(-0.5 * np.log10(np.maximum(lam, 1e-4)), 0.0, 1.0))


def fluid_friction(
    *, p_mean: Numeric, eta: Numeric, alpha: Numeric, V_s: Numeric, h: Numeric, shear_limit: float
) -> Array:
    r"""Friction coefficient of a thermal EHL film with limiting shear stress.

    .. math:: \mu_f = \min\left[\frac{2\Lambda}{\alpha\bar p}
              \sinh^{-1}\frac{\eta\alpha V_s}{2\Lambda h},\ \Lambda\right]

    Parameters
    ----------
    p_mean : Numeric, shape (...)
        Mean contact pressure, [Pa]
    eta : Numeric, shape (...)
        Dynamic viscosity at film temperature and mean pressure, [Pa s]
    alpha : Numeric, shape (...)
        Local pressure-viscosity coefficient at film temperature and Hertz pressure, [1/Pa]
    V_s : Numeric, shape (...)
        Sliding speed, [m/s], >= 0
    h : Numeric, shape (...)
        Film thickness, thermal reduction included, [m]
    shear_limit : float
        Limiting shear stress over pressure, [-]

    Returns
    -------
    Array, shape (...)
        [-]

    References
    ----------
    Arana et al. 2019, eq. (13); the paper's eq. (4). Their Eyring stress is ``2 Lambda / alpha`` (Bair, Winer 1989).

    Examples
    --------
    >>> film = {"p_mean": 1.06e9, "alpha": 11.8e-9, "h": 0.15e-6, "shear_limit": 0.047}
    >>> [round(float(fluid_friction(eta=eta, V_s=1.0, **film)), 4) for eta in (1.0, 1e4)]
    [0.0057, 0.047]
    """
    eyring = 2.0 * shear_limit / alpha
    return np.asarray(np.minimum(eyring / p_mean * np.arcsinh(eta * V_s / (eyring * h)), shear_limit))


def heat_partition(u_1: Numeric, u_2: Numeric) -> Array:
    """Share of the frictional heat that enters body 1 of two of the same steel, ``sqrt u1 / (sqrt u1 + sqrt u2)``.

    Parameters
    ----------
    u_1, u_2 : Numeric, shape (...)
        Surface speeds, [m/s]

    References
    ----------
    Arana et al. 2019, eq. (17) with the bulk temperatures known (M = 0).

    Examples
    --------
    >>> round(float(heat_partition(4.0, 1.0)), 3)
    0.667
    """
    root_1, root_2 = np.sqrt(u_1), np.sqrt(u_2)
    return np.asarray(root_1 / (root_1 + root_2))


def band_source_resistance(*, b_H: Numeric, u: Numeric, k: float, chi: float) -> Array:
    r"""Mean surface temperature rise per heat flux under a fast-moving band source, [m^2 K/W].

    .. math:: \Delta\vartheta / q = (1.06 / k)\sqrt{\chi b_H / u}

    Parameters
    ----------
    b_H : Numeric, shape (...)
        Half-width of the band, [m]
    u : Numeric, shape (...)
        Speed of the surface through the band, [m/s]
    k : float
        Conductivity of the body, [W/(m K)]
    chi : float
        Thermal diffusivity of the body, [m^2/s]

    References
    ----------
    Blok 1937: maximum ``2 q/k sqrt(chi t / pi)`` with ``t = 2 b_H / u``, mean 2/3 of it, which is 1.06; Arana et al.
    2019, eq. (27).

    Examples
    --------
    >>> float(round(2.0 / 3.0 * 2.0 * (2.0 / np.pi) ** 0.5, 2))
    1.06
    """
    return np.asarray(1.06 / k * np.sqrt(chi * b_H / u))
