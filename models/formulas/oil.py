"""Lubricant properties: viscosity, density, heat capacity and conductivity, pressure-viscosity behaviour.

Temperatures are in degC, pressures in Pa. The plain functions are the formulas, one each; :class:`Oil` holds the
constants of one lubricant and offers the same properties as methods. Functions that the thermal network needs as
symbols too take ``xp``, the module that supplies ``exp`` and ``log``: numpy (default) or sympy.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import Any, Literal

import numpy as np

from models.base.types import Array, Numeric
from models.quantities.units import KELVIN

D341_CONSTANT = 0.7  # mm^2/s, ASTM D341 for nu > 2 mm^2/s; DIN 51563 prints 0.8
P_ROELANDS = 1.96e8  # Pa
P_GOLD = 2e8  # Pa, up to which Gold's coefficient is the mean one
LN10 = float(np.log(10.0))
# Outside this range (degC) the properties are held: no liquid lubricant lives there and D341's double power overflows.
T_LOWEST, T_HIGHEST = -60.0, 400.0
# The Modulus equation is fitted to 0.5-1 GPa; below these bounds its straight lines would turn unphysical.
A_LOWEST_PA = 1.5e7


def d341_constants(T_1: float, nu_1: float, T_2: float, nu_2: float) -> tuple[float, float]:
    r"""Constants of the viscosity-temperature line through any two points after ASTM D341 [1]_.

    .. math:: \lg\lg(\nu + 0.7) = m - n \lg\Theta

    Parameters
    ----------
    T_1, T_2 : float
        Temperatures of the two points, [degC]
    nu_1, nu_2 : float
        Kinematic viscosities there, [mm^2/s]

    Returns
    -------
    (m, n) : tuple of float
        Intercept and slope, [-]

    References
    ----------
    .. [1] ASTM D341, "Standard practice for viscosity-temperature equations and charts for liquid petroleum products".

    Examples
    --------
    >>> m, n = d341_constants(40.0, 32.63, 100.0, 5.45)
    >>> round(m, 4), round(n, 4)
    (9.5468, 3.752)
    """
    y_1, y_2 = (float(np.log10(np.log10(nu + D341_CONSTANT))) for nu in (nu_1, nu_2))
    x_1, x_2 = (float(np.log10(T + KELVIN)) for T in (T_1, T_2))
    n = (y_1 - y_2) / (x_2 - x_1)
    return y_1 + n * x_1, n


TYPICAL_OIL = d341_constants(40.0, 100.0, 100.0, 11.2)  # ISO VG 100, mineral


def kinematic_viscosity_d341(T: Any, m: float, n: float, xp: ModuleType = np) -> Any:
    r"""Kinematic viscosity after ASTM D341, :math:`\lg\lg(\nu+0.7) = m - n\lg\Theta`.

    Parameters
    ----------
    T : Numeric or sympy expression, shape (...)
        Temperature, [degC]
    m, n : float
        Constants of :func:`d341_constants`, [-]
    xp : module
        Supplier of ``exp`` and ``log``

    Returns
    -------
    shape (...)
        Kinematic viscosity, [mm^2/s]

    References
    ----------
    ASTM D341; exact at its two points, within 3 % of DIN 51563 (constant 0.8) from 0 to 150 degC.

    Examples
    --------
    >>> round(float(kinematic_viscosity_d341(60.0, *d341_constants(40.0, 32.63, 100.0, 5.45))), 2)
    15.41
    """
    return xp.exp(LN10 * xp.exp(LN10 * m - n * xp.log(T + KELVIN))) - D341_CONSTANT


def density_linear(T: Any, rho_ref: float, T_ref: float, expansion: float) -> Any:
    """Density of an oil with constant thermal expansion, ``rho_ref (1 - expansion (T - T_ref))``.

    Parameters
    ----------
    T : Numeric or sympy expression, shape (...)
        Temperature, [degC]
    rho_ref : float
        Density at `T_ref`, [kg/m^3]
    T_ref : float
        Reference temperature, [degC]
    expansion : float
        Thermal expansion coefficient, [1/K]; about 7.3e-4 for mineral oils

    Returns
    -------
    shape (...)
        Density, [kg/m^3]

    Examples
    --------
    >>> round(float(density_linear(60.0, 876.8, 15.0, 7.3e-4)), 1)
    848.0
    """
    return rho_ref * (1.0 - expansion * (T - T_ref))


def specific_heat_cragoe(T: Any, rho_15: float) -> Any:
    r"""Specific heat of a petroleum oil after Cragoe, :math:`c_p = 1000(1.685 + 0.00339\vartheta)/\sqrt{s}`.

    Parameters
    ----------
    T : Numeric or sympy expression, shape (...)
        Temperature, [degC], 0 to 200
    rho_15 : float
        Density at 15 degC, [kg/m^3]; ``s = rho_15 / 999`` is the specific gravity

    Returns
    -------
    shape (...)
        Specific heat, [J/(kg K)]

    References
    ----------
    Cragoe, "Thermal properties of petroleum products", NBS Misc. Publ. 97, 1929; from memory, checked against the
    2000-2300 J/(kg K) that FEUP's oil tables give for mineral gear oils.

    Examples
    --------
    >>> round(float(specific_heat_cragoe(60.0, 876.8)))
    2016
    """
    return 1000.0 * (1.685 + 0.00339 * T) / (rho_15 / 999.0) ** 0.5


def conductivity_cragoe(T: Any, rho_15: float) -> Any:
    r"""Thermal conductivity of a petroleum oil after Cragoe, :math:`k = 0.1172(1 - 5.4\cdot10^{-4}\vartheta)/s`.

    Parameters
    ----------
    T : Numeric or sympy expression, shape (...)
        Temperature, [degC]
    rho_15 : float
        Density at 15 degC, [kg/m^3]

    Returns
    -------
    shape (...)
        Thermal conductivity, [W/(m K)]

    References
    ----------
    Cragoe, NBS Misc. Publ. 97, 1929; from memory, checked against FEUP's ``120 (1 - 0.0005 T / 3) / rho`` (4 % apart).

    Examples
    --------
    >>> round(float(conductivity_cragoe(60.0, 876.8)), 3)
    0.129
    """
    return 0.1172 / (rho_15 / 999.0) * (1.0 - 5.4e-4 * T)


def pressure_viscosity_gold(nu: Numeric, s: float, t: float) -> Numeric:
    r"""Pressure-viscosity coefficient after Gold et al., :math:`\alpha = s\,\nu^t\cdot10^{-9}`.

    Parameters
    ----------
    nu : Numeric, shape (...)
        Kinematic viscosity at the same temperature, [mm^2/s]
    s, t : float
        Constants of the base oil, [-]; mineral 9.904 and 0.139. Public re-implementations circulate the digits
        swapped (0.139 and 0.9904), which would give 2.1e-9 1/Pa at 15 mm^2/s instead of 14.5e-9.

    Returns
    -------
    Numeric, shape (...)
        Pressure-viscosity coefficient at 0.2 GPa, ``ln(eta/eta_0)/p``, [1/Pa]

    References
    ----------
    Gold, Schmidt, Dicke, Loos, Assmann, "Viscosity-pressure-temperature behaviour of mineral and synthetic oils",
    J. Synthetic Lubrication 18 (2001); from memory; for FVA 3 within 5 % of the Modulus equation at
    that pressure (40 to 90 degC; 12 % below its limit at none).

    Examples
    --------
    >>> round(float(pressure_viscosity_gold(15.41, 9.904, 0.139)) * 1e9, 1)
    14.5
    """
    return s * nu**t * 1e-9


PressureViscosity = Literal["modulus", "roelands"]


@dataclass(frozen=True, kw_only=True)
class Oil:
    """The constants of one lubricant and its properties.

    Attributes
    ----------
    name : str
    m, n : float
        ASTM D341 constants, [-]
    rho_ref, T_ref, expansion : float
        Density [kg/m^3] at a reference temperature [degC], and thermal expansion [1/K]
    a1, a2, b1, b2 : float
        Constants of the Modulus equation, [Pa], [Pa/K], [-], [1/K], already scaled to this oil's viscosity
    gold_s, gold_t : float
        Constants of :func:`pressure_viscosity_gold`, [-]
    limiting_shear_coefficient : float
        Limiting shear stress over pressure, [-]
    pressure_viscosity : {"modulus", "roelands"}
        Which pressure-viscosity law is used
    specific_heat_constant, conductivity_constant : float or None
        Measured constants [J/(kg K)], [W/(m K)]; Cragoe where None
    schlenk_X_L : float
        Lubricant factor of ISO/TR 14179-2, [-]
    """

    name: str
    m: float
    n: float
    rho_ref: float
    T_ref: float
    expansion: float
    limiting_shear_coefficient: float
    pressure_viscosity: PressureViscosity = "modulus"
    a1: float = 0.0
    a2: float = 0.0
    b1: float = 0.0
    b2: float = 0.0
    gold_s: float = 9.904
    gold_t: float = 0.139
    specific_heat_constant: float | None = None
    conductivity_constant: float | None = None
    schlenk_X_L: float = 1.0

    def kinematic_viscosity(self, T: Numeric) -> Array:
        """Kinematic viscosity [mm^2/s] at `T` [degC], shape (...)."""
        return np.asarray(kinematic_viscosity_d341(_held(T), self.m, self.n))

    def density(self, T: Numeric) -> Array:
        """Density [kg/m^3] at `T` [degC], shape (...)."""
        return np.asarray(density_linear(_held(T), self.rho_ref, self.T_ref, self.expansion))

    def dynamic_viscosity(self, T: Numeric) -> Array:
        """Dynamic viscosity at ambient pressure [Pa s] at `T` [degC], shape (...)."""
        return 1e-6 * self.kinematic_viscosity(T) * self.density(T)

    def specific_heat(self, T: Numeric) -> Array:
        """Specific heat [J/(kg K)] at `T` [degC], shape (...)."""
        if self.specific_heat_constant is not None:
            return np.full_like(np.asarray(T, dtype=float), self.specific_heat_constant)
        return np.asarray(specific_heat_cragoe(_held(T), self.rho_15))

    def conductivity(self, T: Numeric) -> Array:
        """Thermal conductivity [W/(m K)] at `T` [degC], shape (...)."""
        if self.conductivity_constant is not None:
            return np.full_like(np.asarray(T, dtype=float), self.conductivity_constant)
        return np.asarray(conductivity_cragoe(_held(T), self.rho_15))

    @property
    def rho_15(self) -> float:
        """Density at 15 degC, [kg/m^3]."""
        return float(density_linear(15.0, self.rho_ref, self.T_ref, self.expansion))

    @property
    def nu_40(self) -> float:
        """Kinematic viscosity at 40 degC, [mm^2/s]."""
        return float(self.kinematic_viscosity(40.0))

    def thermoviscosity(self, T: Numeric) -> Array:
        r"""Thermo-viscosity coefficient :math:`\beta = -\partial\ln\eta/\partial T` [1/K] at `T` [degC], shape (...).

        The exact derivative of the D341 line and of the linear density.

        Examples
        --------
        >>> from models.assembly.gearbox import load_gearbox
        >>> oil = load_gearbox("fzg").lubricant()
        >>> round(float(oil.thermoviscosity(60.0)), 4)
        0.0335
        """
        T = _held(T)
        nu = self.kinematic_viscosity(T)
        slope = self.n * (nu + D341_CONSTANT) * np.log(nu + D341_CONSTANT) / (nu * (T + KELVIN))
        return np.asarray(slope + self.expansion * self.rho_ref / self.density(T))

    def pressure_viscosity_coefficient(self, T: Numeric, p: Numeric) -> Array:
        r"""Local (secant) pressure-viscosity coefficient :math:`\alpha = \ln(\eta/\eta_0)/p`.

        Modulus equation: ``1/(A + B p)``, ``A = a1 + a2 Theta >= 1.5e7 Pa``, ``B = b1 + b2 Theta >= 0``.
        Roelands: ``Z`` such that at 0.2 GPa it is Gold's coefficient at that temperature.

        Parameters
        ----------
        T : Numeric, shape (...)
            Temperature, [degC]
        p : Numeric, shape (...)
            Pressure, [Pa]; broadcasts with `T`

        Returns
        -------
        Array, shape (...)
            [1/Pa]

        References
        ----------
        Arana, Larranaga, Ulacia, Proc. IMechE Part J 233(2), 2019, eqs. (30)-(33) and Table 3 (Modulus equation);
        Roelands, thesis, Delft 1966.

        Examples
        --------
        >>> from models.assembly.gearbox import load_gearbox
        >>> round(float(load_gearbox("fzg").lubricant().pressure_viscosity_coefficient(60.0, 1e9)) * 1e9, 2)
        11.76
        """
        if self.pressure_viscosity == "modulus":
            A, B = self._modulus(T)
            return np.asarray(1.0 / (A + B * p))
        Z, slope = self._roelands(T)
        ratio = np.asarray(p) / P_ROELANDS
        exponent = slope * np.expm1(Z * np.log1p(ratio))
        return np.asarray(np.where(ratio > 1e-9, exponent / np.maximum(p, 1.0), Z * slope / P_ROELANDS))

    def film_pressure_viscosity_coefficient(self, T: Numeric) -> Array:
        r"""Reciprocal asymptotic isoviscous pressure, :math:`\alpha^* = [\int_0^\infty \eta_0/\eta\,dp]^{-1}`.

        The coefficient that a film-thickness formula wants. Modulus equation: the series
        ``1 / (A (1 + 2 B + 6 B^2))`` of the integral; Roelands: ``alpha_0 / (1 + (1 - Z) / (alpha_0 p_R))``.

        Parameters
        ----------
        T : Numeric, shape (...)
            Temperature, [degC]

        Returns
        -------
        Array, shape (...)
            [1/Pa]

        References
        ----------
        Arana et al. 2019, eqs. (23) and (35); the series is derived here and checked against the integral
        (``tests/unit/models/formulas/test_oil.py``).

        Examples
        --------
        >>> from models.assembly.gearbox import load_gearbox
        >>> round(float(load_gearbox("fzg").lubricant().film_pressure_viscosity_coefficient(60.0)) * 1e9, 1)
        15.6
        """
        if self.pressure_viscosity == "modulus":
            A, B = self._modulus(T)
            return np.asarray(1.0 / (A * (1.0 + 2.0 * B + 6.0 * B**2)))
        Z, slope = self._roelands(T)
        alpha_0 = Z * slope / P_ROELANDS
        return np.asarray(alpha_0 / (1.0 + (1.0 - Z) / (alpha_0 * P_ROELANDS)))

    def _modulus(self, T: Numeric) -> tuple[Array, Array]:
        theta = _held(T) + KELVIN
        return np.maximum(self.a1 + self.a2 * theta, A_LOWEST_PA), np.maximum(self.b1 + self.b2 * theta, 0.0)

    def _roelands(self, T: Numeric) -> tuple[Array, Array]:
        """Exponent Z and ``ln eta_0 + 9.67``, such that the mean coefficient up to 0.2 GPa is Gold's."""
        slope = np.log(self.dynamic_viscosity(T)) + 9.67
        gold = np.asarray(pressure_viscosity_gold(self.kinematic_viscosity(T), self.gold_s, self.gold_t))
        return np.log1p(gold * P_GOLD / slope) / np.log1p(P_GOLD / P_ROELANDS), slope


def modulus_scale(nu_40_measured: float, nu_40: float) -> float:
    """Factor on a1 and a2 that carries Modulus constants from one oil to another of the same base.

    Gold's viscosity exponent 0.139 for mineral oils: ``alpha ~ nu^0.139``, hence ``A ~ nu^-0.139``.

    Parameters
    ----------
    nu_40_measured, nu_40 : float
        Viscosity at 40 degC of the measured oil and of this one, [mm^2/s]

    Returns
    -------
    float
        [-]

    Examples
    --------
    >>> round(modulus_scale(96.0, 32.63), 3)
    1.162
    """
    return float((nu_40_measured / nu_40) ** 0.139)


def _held(T: Numeric) -> Array:
    held: Array = np.minimum(np.maximum(np.asarray(T, dtype=np.float64), T_LOWEST), T_HIGHEST)
    return held
