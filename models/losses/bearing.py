"""Friction of rolling bearings after the SKF model (catalogue 2016, pp. 104-106; drag of 2008 as an option).

The catalogue's units are kept inside: mm, N, 1/min, mm^2/s, N mm.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from models.base.root_finding import decreasing_root
from models.base.types import Array, Numeric
from models.formulas.heat_transfer import GRAVITY
from models.formulas.oil import Oil
from models.losses.loss_term import OIL, SPEED, TORQUE, GearboxData, LossKind, LossTerm, TermInput
from models.losses.shaft_loads import bearing_loads
from models.portable.evaluation import RPM

# SKF's drag factor over H/d_m: read off the catalogue's diagram (digitised by the public re-implementation
# JRaposo-m/SKF-Bearing-Selection-Tool); constant beyond the last. Of balls, the enlarged diagram up to 0.2.
V_M_LEVEL = np.array([0, .0126, .0272, .0456, .0611, .0756, .0918, .110, .133, .156, .178, .20, .244, .315, .411, .489,
                      .552, .661, .759, .889, 1.04, 1.20])  # fmt: skip
V_M_ROLLER = np.array([0, 7.3e-6, 1.8e-5, 3.45e-5, 5.33e-5, 7.38e-5, 1.02e-4, 1.36e-4, 1.88e-4, 2.42e-4, 2.97e-4,
                       3.1e-4, 3.78e-4, 4.7e-4, 5.83e-4, 6.72e-4, 7.33e-4, 8.46e-4, 9.42e-4, 1.08e-3, 1.24e-3,
                       1.434e-3])  # fmt: skip
V_M_BALL_LEVEL = np.array([0, .0096, .0193, .0322, .0444, .0559, .0667, .0841, .1007, .1163, .1319, .1504, .1659, .1815,
                           .2004, .2522, .2826, .3239, .3652, .4348, .50, .5978, .6609, .7239, .8087, .8674, .9391,
                           1.002, 1.041, 1.104, 1.154, 1.183, 1.209])  # fmt: skip
V_M_BALL = np.array([0, 1.62e-6, 6.10e-6, 1.06e-5, 1.50e-5, 2.23e-5, 3.14e-5, 5.13e-5, 7.41e-5, 9.81e-5, 1.24e-4,
                     1.58e-4, 1.86e-4, 2.14e-4, 2.47e-4, 3.16e-4, 3.64e-4, 4.05e-4, 4.46e-4, 5.11e-4, 5.66e-4, 6.38e-4,
                     6.75e-4, 7.20e-4, 7.85e-4, 8.36e-4, 9.01e-4, 9.49e-4, 9.79e-4, 1.05e-3, 1.13e-3, 1.22e-3,
                     1.246e-3])  # fmt: skip
# SKF gives the drag formula up to these viscosities (mm^2/s): bearing at most half in oil, and deeper.
DRAG_NU_HALF, DRAG_NU_DEEP = 500.0, 250.0
STARVATION_NU = 500.0  # mm^2/s, up to which thicker oil is taken to starve the rolling contacts further
OIL_FLOW_HEAT = 27.0  # W/K per l/min, SKF; rho c_p of a mineral oil at 60 degC gives 28.5
TEMPERATURE_TOL = 5e-3  # K
# Exponents of d_m and F_r in the rolling and in the sliding variable, without an axial load (SKF 2016, table 2).
EXPONENTS = {"cylindrical_roller": ((2.41, 0.31), (1.0, 1.0)), "deep_groove_ball": ((1.96, 0.54), (-0.26, 5.0 / 3.0)),
             "tapered_roller": ((2.38, 0.31), (0.82, 1.0))}  # fmt: skip
AXIAL_ROLLING = 1.7  # R2 of single row deep groove ball bearings (SKF 2016, table 2a)
AXIAL_TAPERS = (10.9, 2.0)  # R2 and S2 of taper roller bearings, for Y F_a


def oil_flow_max(D_mm: float, B_mm: float) -> float:
    """Greatest oil flow through a bearing, ``D B / 12500`` [l/min], D and B in mm (the paper's eq. 9).

    Examples
    --------
    >>> round(oil_flow_max(90.0, 23.0), 4)
    0.1656
    """
    return D_mm * B_mm / 12500.0


def heat_dissipation_reference(d_mm: float, D_mm: float, B_mm: float) -> float:
    """Heat a bearing housing sheds per kelvin under the reference conditions of ISO 15312.

    ``q_r A_r / 50 K`` with ``q_r = 0.016 W/mm^2`` and ``A_r = pi B (D + d)``. The paper leaves its W_s open.

    Parameters
    ----------
    d_mm, D_mm, B_mm : float
        Bore, outside diameter, width, [mm]

    Returns
    -------
    float
        [W/K]

    References
    ----------
    ISO 15312:2018, reference heat flow of radial bearings up to 50 000 mm^2; from memory.

    Examples
    --------
    >>> round(heat_dissipation_reference(30.0, 90.0, 23.0), 3)
    2.775
    """
    return 0.016 * float(np.pi) * B_mm * (D_mm + d_mm) / 50.0


@dataclass(frozen=True, kw_only=True)
class SkfBearing:
    """A rolling bearing in an oil bath, under a radial load and an axial one in proportion to it.

    Attributes
    ----------
    type : {"cylindrical_roller", "deep_groove_ball", "tapered_roller"}
    d, D, B : float
        Bore, outside diameter, width, [mm]
    H : float
        Oil level above the lowest contact of the outer raceway, [mm]
    mass : float
        [kg]
    R1, S : float
        Geometry constants of the series, [-]: of rolling, and of sliding under a radial load (S2 of rollers, S1 of
        balls)
    axial, S_axial, C_0, Y : float
        Axial over radial load [-], constant of its sliding [-] (S1 of rollers, S2 of balls), static load rating of
        balls [N], axial load factor of tapers [-]
    K_rs, K_Z : float
        Replenishment and bearing constants, [-]
    K_L : float
        Roller constant, [-]; 0 of balls
    mu_bl, mu_EHL : float
        Friction coefficients of mixed lubrication and of the full film, [-]
    drag : {"2016", "2008"}
        Edition of the drag formula
    temperature : {"mean", "skf_outlet"}
        Oil temperature in the bearing: mean of sump and bearing, or by the paper's eq. (8)
    W_s : float
        Heat dissipation for eq. (8), [W/K]
    T_ambient : float
        Ambient temperature for eq. (8), [degC]: the definition's, also where a cycle gives another
    """

    type: Literal["cylindrical_roller", "deep_groove_ball", "tapered_roller"]
    d: float
    D: float
    B: float
    H: float
    mass: float
    R1: float
    S: float
    K_rs: float
    K_Z: float
    K_L: float
    mu_bl: float
    mu_EHL: float
    axial: float = 0.0
    S_axial: float = 0.0
    C_0: float = 0.0
    Y: float = 0.0
    drag: Literal["2016", "2008"] = "2016"
    temperature: Literal["mean", "skf_outlet"] = "mean"
    W_s: float = 0.0
    T_ambient: float = 27.0

    @property
    def d_m(self) -> float:
        """Mean diameter, [mm]."""
        return 0.5 * (self.d + self.D)

    @property
    def lightest_load(self) -> float:
        """Radial load that rests on it at least, taken as twice its own weight (15 N for an NU 406), [N]."""
        return 2.0 * self.mass * GRAVITY

    def friction_moments(self, *, n_rpm: Numeric, F_r: Numeric, nu: Numeric) -> tuple[Array, Array, Array]:
        r"""Rolling, sliding and drag moment.

        .. math::
            M_{rr} &= \phi_{ish}\,\phi_{rs}\,G_{rr}\,(\nu n)^{0.6},\quad
            \phi_{ish} = \frac{1}{1 + 1.84 \cdot 10^{-9} (n d_m)^{1.28} \nu^{0.64}},\quad
            \phi_{rs} = e^{-K_{rs} \nu n (d + D) \sqrt{K_Z / (2 (D - d))}}

            M_{sl} &= G_{sl}\,[\phi_{bl}\,\mu_{bl} + (1 - \phi_{bl})\,\mu_{EHL}],\quad
            \phi_{bl} = e^{-2.6 \cdot 10^{-8} (n \nu)^{1.4} d_m}

            M_{drag} &= V\,n^2 + 1.093 \cdot 10^{-7} n^2 d_m^3 \left(\frac{n d_m^2 f_t}{\nu}\right)^{-1.379} R_s

        with lengths in mm, n in 1/min and :math:`d_m = (d + D) / 2`. The variables of rolling and of sliding:

        - cylindrical rollers: :math:`G_{rr} = R_1 d_m^{2.41} F_r^{0.31}`,
          :math:`G_{sl} = S_2 F_r + S_1 d_m^{0.9} F_a`
        - balls: :math:`G_{rr} = R_1 d_m^{1.96} F_r^{0.54}`, :math:`G_{sl} = S_1 d_m^{-0.26} F_r^{5/3}`; under an axial
          load :math:`G_{rr} = R_1 d_m^{1.96} (F_r + 1.7 F_a / \sin\alpha_F)^{0.54}`,
          :math:`G_{sl} = S_1 d_m^{-0.145} (F_r^5 + S_2 d_m^{1.5} F_a^4 / \sin\alpha_F)^{1/3}`, where
          :math:`\alpha_F` is :math:`24.6 (F_a / C_0)^{0.24}` degrees
        - tapers: :math:`G_{rr} = R_1 d_m^{2.38} (F_r + 10.9 Y F_a)^{0.31}`,
          :math:`G_{sl} = S_1 d_m^{0.82} (F_r + 2 Y F_a)`

        Drag, with :math:`K = K_Z (d + D) / (D - d) \cdot 10^{-12}`, the immersion
        :math:`t = 2 \arccos(1 - H / (0.6 d_m))` and :math:`V_M(H / d_m)` from SKF's diagram:

        - balls: :math:`V = 0.4 V_M K d_m^5`; rollers: :math:`V = 4 V_M K_L K C_w B d_m^4` with
          :math:`l_D = 5 K_L B / d_m`, :math:`C_w = 2.789 \cdot 10^{-10} l_D^3 - 2.786 \cdot 10^{-4} l_D^2
          + 0.0195 l_D + 0.6439`
        - :math:`R_s = 0.36 d_m^2 (t - \sin t) \cdot 0.05 K_Z (D + d) / (D - d)`, and :math:`f_t = \sin(t / 2)`, 1 above
          half a turn

        Parameters
        ----------
        n_rpm : Numeric, shape (...)
            Speed, [1/min], > 0
        F_r : Numeric, shape (...)
            Radial load, [N]; :attr:`axial` times as much acts along the shaft
        nu : Numeric, shape (...)
            Kinematic viscosity in the bearing, [mm^2/s]

        Returns
        -------
        M_rr, M_sl, M_drag : Array, shape (...)
            [N mm]

        References
        ----------
        SKF "Rolling bearings", 2016, pp. 104-106: inlet-shear starvation, kinematic replenishment, mixed friction and
        oil-bath drag. Rollers take an axial load on their flanges. With one, balls meet the raceways at an angle of
        24.6 (F_a / C_0)^0.24 degrees; SKF's sliding variable jumps by d_m^0.115 where it begins. The viscosity in the
        drag moment is held at 500 mm^2/s, where the formula ends (250 for a bearing more than half in oil; limits from
        memory). In the two factors of starvation it is held there too, which is our choice: to the letter they leave an
        NU 207 at 1500 1/min in oil VG 150 of -20 degC a millionth of its rolling friction. K_roll is 1e-12 of the
        catalogue's digits, by its worked magnitudes.

        Examples
        --------
        NU 406 at 2165.7 rpm, 4463 N and 15.41 mm^2/s:

        >>> bearing = SkfBearing(type="cylindrical_roller", d=30, D=90, B=23, H=17, mass=0.75, R1=1e-6, S=0.0015,
        ...                      K_rs=3e-8, K_Z=5.1, K_L=0.65, mu_bl=0.12, mu_EHL=0.02)
        >>> [round(float(M), 1) for M in bearing.friction_moments(n_rpm=2165.7, F_r=4463.0, nu=15.41)]
        [127.1, 9.4, 12.0]
        """
        n, nu = np.asarray(n_rpm, dtype=float), np.asarray(nu, dtype=float)
        d_m, d, D = self.d_m, self.d, self.D
        held = np.minimum(nu, STARVATION_NU)
        starvation = 1.0 / (1.0 + 1.84e-9 * (n * d_m) ** 1.28 * held**0.64)
        replenishment = np.exp(-self.K_rs * held * n * (d + D) * np.sqrt(self.K_Z / (2.0 * (D - d))))
        G_rr, G_sl = self._variables(np.asarray(F_r, dtype=float))
        M_rr = starvation * replenishment * G_rr * (nu * n) ** 0.6
        mixed = np.exp(-2.6e-8 * (n * nu) ** 1.4 * d_m)
        M_sl = G_sl * (mixed * self.mu_bl + (1.0 - mixed) * self.mu_EHL)
        return np.asarray(M_rr), np.asarray(M_sl), self._drag_moment(n, nu)

    def _variables(self, F_r: Array) -> tuple[Array, Array]:
        """SKF's variables of rolling and of sliding friction."""
        d_m, F_a = self.d_m, self.axial * F_r
        of_rolling, of_sliding = EXPONENTS[self.type]
        rolling, sliding = F_r, self.S * d_m ** of_sliding[0] * F_r ** of_sliding[1]
        if self.type == "tapered_roller":
            rolling, push = F_r + AXIAL_TAPERS[0] * self.Y * F_a, F_r + AXIAL_TAPERS[1] * self.Y * F_a
            sliding = self.S * d_m ** of_sliding[0] * push ** of_sliding[1]
        elif self.axial > 0.0 and self.type == "cylindrical_roller":
            sliding = sliding + self.S_axial * d_m**0.9 * F_a
        elif self.axial > 0.0:
            sine = np.sin(np.radians(24.6 * (F_a / self.C_0) ** 0.24))
            rolling = F_r + AXIAL_ROLLING * F_a / sine
            sliding = self.S * d_m**-0.145 * np.cbrt(F_r**5 + self.S_axial * d_m**1.5 * F_a**4 / sine)
        return self.R1 * d_m ** of_rolling[0] * rolling ** of_rolling[1], sliding

    def _drag_moment(self, n: Array, nu: Array) -> Array:
        d_m, d, D = self.d_m, self.d, self.D
        H = min(max(self.H, 0.0), 1.2 * d_m)
        # Its power of nu is a fit; cold oil beyond the limits would brake a NU 406 with kilowatts.
        nu = np.minimum(nu, DRAG_NU_HALF if 0.6 * d_m >= self.H else DRAG_NU_DEEP)
        t = 2.0 * np.arccos(np.clip((0.6 * d_m - H) / (0.6 * d_m), -1.0, 1.0))
        if t == 0.0:
            return np.zeros(np.broadcast_shapes(n.shape, nu.shape))
        rolls = self.K_Z * (d + D) / (D - d) * 1e-12
        if self.type == "deep_groove_ball":
            drag_2008 = float(np.interp(H / d_m, V_M_BALL_LEVEL, V_M_BALL)) * rolls * d_m**5
            drag = 0.4 * drag_2008
        else:
            drag_2008 = 10.0 * float(np.interp(H / d_m, V_M_LEVEL, V_M_ROLLER)) * self.K_L * rolls * self.B * d_m**4
            l_D = 5.0 * self.K_L * self.B / d_m
            drag = 0.4 * (2.789e-10 * l_D**3 - 2.786e-4 * l_D**2 + 0.0195 * l_D + 0.6439) * drag_2008
        if self.drag == "2008":  # one term only; the churning of the rolling elements came with a later edition
            return np.asarray(drag_2008 * n**2 + 0.0 * nu)
        f_t = np.sin(0.5 * t) if t <= np.pi else 1.0
        R_s = 0.36 * d_m**2 * (t - np.sin(t)) * 0.05 * self.K_Z * (D + d) / (D - d)
        churn = 1.093e-7 * d_m**3 * R_s * (n * d_m**2 * f_t / nu) ** -1.379
        return np.asarray((drag + churn) * n**2)

    def loss(self, *, n_rpm: Array, F_r: Array, T_oil: Array, T_bearing: Array, oil: Oil) -> Array:
        """Power loss of the bearing.

        Parameters
        ----------
        n_rpm : Array, shape (...)
            Speed, [1/min], > 0
        F_r : Array, shape (...)
            Radial load, [N]; its own weight at least counts
        T_oil, T_bearing : Array, shape (...)
            Sump and bearing temperature, [degC]
        oil : Oil

        Returns
        -------
        Array, shape (...)
            [W]
        """
        F_r = np.maximum(F_r, self.lightest_load)

        def power(T: Array) -> Array:
            moments = self.friction_moments(n_rpm=n_rpm, F_r=F_r, nu=oil.kinematic_viscosity(T))
            return np.asarray(sum(moments) * n_rpm * RPM * 1e-3)

        if self.temperature == "mean":
            return power(0.5 * (T_oil + T_bearing))
        flow_heat = OIL_FLOW_HEAT * oil_flow_max(self.D, self.B)
        # eq. (8) leaves the range of the two temperatures far off equilibrium; held as the oil could not be elsewhere.
        lowest, highest = np.minimum(T_oil, T_bearing) - 10.0, np.maximum(T_oil, T_bearing) + 60.0

        def excess(T_mean: Array) -> Array:
            outlet = T_oil + (power(T_mean) - self.W_s * (T_bearing - self.T_ambient)) / flow_heat
            return np.asarray(0.5 * (T_oil + np.clip(outlet, lowest, highest)) - T_mean)

        bracket = (0.5 * (T_oil + lowest), 0.5 * (T_oil + highest))
        return power(decreasing_root(excess, *bracket, f_tol=TEMPERATURE_TOL))


@dataclass(frozen=True, kw_only=True)
class BearingLaw:
    """A bearing in the oil of a gearbox; reads its own speed and radial load, oil and bearing temperature."""

    bearing: SkfBearing
    oil: Oil

    def power(self, x: Array) -> Array:
        """Bearing loss [W], shape (N, 1), at speed [1/min], load [N], oil and bearing temperature [degC], (N, 4)."""
        loss = self.bearing.loss(n_rpm=x[:, 0], F_r=x[:, 1], T_oil=x[:, 2], T_bearing=x[:, 3], oil=self.oil)
        return loss[:, None]


def bearing_terms(gearbox: GearboxData) -> Iterator[LossTerm]:
    """Yield the loss of every ``[[bearing]]``.

    Its radial load is that of :func:`models.losses.shaft_loads.bearing_loads`. The locating bearing of a shaft takes
    the whole axial force of helical gears, ``F_bt tan(beta_b)``; two taper bearings share it with what they push each
    other.
    """
    oil, loads = gearbox.lubricant(), bearing_loads(gearbox)
    for table in gearbox.bearing:
        load = loads[table.name]
        d, D, B = table.bore_mm, table.outside_diameter_mm, table.width_mm
        W_s = table.heat_dissipation_W_K
        S_axial, C_0 = table.axial_constants
        bearing = SkfBearing(
            type=table.type,
            d=d,
            D=D,
            B=B,
            H=table.oil_level(gearbox.level_below_axis[table.shaft] * 1e3),
            mass=table.mass_kg,
            R1=table.R1,
            S=table.sliding_constant,
            axial=load.axial_share,
            S_axial=S_axial,
            C_0=C_0,
            Y=table.Y or 0.0,
            K_rs=table.K_rs,
            K_Z=table.K_Z,
            K_L=table.K_L or 0.0,
            mu_bl=table.mu_bl,
            mu_EHL=table.mu_EHL,
            drag=table.drag,
            temperature=table.temperature,
            W_s=heat_dissipation_reference(d, D, B) if W_s is None else W_s,
            T_ambient=gearbox.ambient.temperature_degC,
        )
        inputs = (
            TermInput("speed_rpm", SPEED, gearbox.speed_ratio[table.shaft]),
            TermInput("radial_load_N", TORQUE, load.radial, lowest=bearing.lightest_load),
            TermInput("T_oil_degC", OIL),
            TermInput("T_bearing_degC", table.name),
        )
        law = BearingLaw(bearing=bearing, oil=oil)
        yield LossTerm(kind=BEARING, name=table.name, components=(table.name,), node=table.name, inputs=inputs, law=law)


BEARING = LossKind(
    name="bearing",
    factors={"bearing": "bearing losses"},
    network="bearing",
    alike=True,
    powers=((1.0, 0.0, 0.0, 0.0),),
    law_error={"speed": 0.05, "torque": 0.05},
    terms=bearing_terms,
)
