"""Load-independent losses of dip-lubricated gears."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from models.base.types import Array, Numeric
from models.formulas.geometry import GearPair
from models.formulas.heat_transfer import GRAVITY
from models.formulas.oil import Oil
from models.losses.loss_term import OIL, SPEED, GearboxData, LossKind, LossTerm, TermInput, of_stages
from models.portable.evaluation import RPM

RE_LAMINAR, RE_TURBULENT = 6000.0, 9000.0  # of 2007
GAMMA_CALM, GAMMA_SWIRLING, RE_2011 = 750.0, 1250.0, 4000.0  # m/s^2, m/s^2, -


def churning_niemann(*, e: float, b: float, v_t: Numeric) -> Array:
    r"""Churning loss of one dipping gear after Niemann.

    .. math:: P[\mathrm{kW}] = \frac{e[\mathrm{mm}]\, b[\mathrm{mm}]\, v_t^{1.5}}{2.72\cdot 10^6}

    The paper's eq. (6) multiplies this by the angular speed and reads it in SI, which is impossible by its dimension
    (748 kW for the FZG wheel at 8.3 m/s); the original is a power.

    Parameters
    ----------
    e : float
        Immersion depth, [m]; no loss where not positive
    b : float
        Face width, [m]
    v_t : Numeric, shape (...)
        Pitch line velocity, [m/s], >= 0

    Returns
    -------
    Array, shape (...)
        [W]

    References
    ----------
    Niemann, Winter, "Maschinenelemente II"; from memory, 1.5 to 3 times below Changenet-Velex on
    the FZG rig (1 to 20 m/s, 60 degC).

    Examples
    --------
    >>> round(sum(float(churning_niemann(e=e, b=14e-3, v_t=8.3)) for e in (22.226e-3, 40.181e-3)), 2)
    7.68
    """
    return np.asarray(max(e, 0.0) * b * np.asarray(v_t) ** 1.5 / 2.72e-3)


def churning_niemann_printed(*, e: float, b: float, v_t: Numeric, omega: Numeric) -> Array:
    """The paper's eq. (6) to the letter, ``omega e v_t^1.5 b / 2.72e-6`` in SI: 748 kW for the FZG wheel at 8.3 m/s.

    Kept to compare the print with our reading of it; parameters as :func:`churning_niemann`, `omega` in rad/s.

    Examples
    --------
    >>> round(float(churning_niemann_printed(e=40.2e-3, b=14e-3, v_t=8.3, omega=151.2)) / 1e3)
    748
    """
    return np.asarray(np.asarray(omega) * max(e, 0.0) * b * np.asarray(v_t) ** 1.5 / 2.72e-6)


def churning_mauz(*, e: tuple[float, float], b: float, v_t: Numeric, omega_2: Numeric, C_Sp: float = 1.0) -> Array:
    r"""Churning loss of a gear pair after Mauz (ISO/TR 14179-2).

    .. math:: T_H = C_{Sp} C_1 e^{C_2 v_t / v_0},\quad
              C_1 = 0.063\frac{e_1+e_2}{e_0} + 0.0128\left(\frac{b}{b_0}\right)^3,\quad
              C_2 = \frac{e_1+e_2}{80 e_0} + 0.2

    Parameters
    ----------
    e : (float, float)
        Immersion depths of pinion and wheel, [m]
    b : float
        Face width, [m]
    v_t : Numeric, shape (...)
        Pitch line velocity, [m/s]
    omega_2 : Numeric, shape (...)
        Wheel speed, [rad/s], >= 0
    C_Sp : float
        Splash oil factor, [-]

    Returns
    -------
    Array, shape (...)
        [W]

    References
    ----------
    ISO/TR 14179-2:2001 with e0 = b0 = 10 mm, v0 = 10 m/s; from memory, four times Changenet-Velex at 8.3 m/s on
    the FZG rig.

    Examples
    --------
    The FZG rig at 8.3 m/s, both gears dipping:

    >>> round(float(churning_mauz(e=(22e-3, 40e-3), b=14e-3, v_t=8.3, omega_2=151.2)), 1)
    81.0
    """
    depth = (max(e[0], 0.0) + max(e[1], 0.0)) / 10e-3
    if depth == 0.0:
        return np.zeros(np.shape(omega_2))
    C_1 = 0.063 * depth + 0.0128 * (b / 10e-3) ** 3
    return np.asarray(C_Sp * C_1 * np.exp((depth / 80.0 + 0.2) * np.asarray(v_t) / 10.0) * omega_2)


def churning_changenet_velex(
    *, h: float, r_p: float, b: float, z: int, tooth_height: float, alpha: float, V_oil: float, omega: Numeric,
    nu: Numeric, rho: Numeric, beta: float = 0.0
) -> Array:  # fmt: skip
    r"""Churning loss of one dipping gear after Changenet and Velex (2007).

    .. math:: P = \tfrac12 \rho\,\omega^3 S_m R_p^3 C_m

    ``C_m = 1.366 (h/D)^.45 (V/D^3)^.1 Fr^-.6 Re^-.21 (b/D)^.21`` below Re = 6000,
    ``3.644 (h/D)^.1 (V/D^3)^-.35 Fr^-.88 (b/D)^.85`` above 9000, linear in Re between; ``Re = omega R_p b / nu``,
    ``Fr = omega^2 R_p / g``. The regimes meet on small gears only: on a wheel of 170 mm the loss rises fourfold
    from Re = 6000 to 9000, and falls when such an oil gets colder. :func:`churning_changenet_2011` does not.

    Parameters
    ----------
    h : float
        Immersion depth of the pitch circle, [m]; no loss where not positive
    r_p : float
        Pitch radius, [m]
    b : float
        Face width, [m]
    z : int
        Number of teeth
    tooth_height : float
        [m]
    alpha : float
        Pressure angle in the transverse plane, [rad]
    V_oil : float
        Oil volume, [m^3]
    omega : Numeric, shape (...)
        Speed of the gear, [rad/s], > 0
    nu : Numeric, shape (...)
        Kinematic viscosity, [mm^2/s]
    rho : Numeric, shape (...)
        Density, [kg/m^3]
    beta : float
        Helix angle, [rad]

    Returns
    -------
    Array, shape (...)
        [W]

    References
    ----------
    Changenet, Velex, "A model for the prediction of churning losses in geared transmissions", J. Mech. Des. 129 (2007);
    from memory. Which constant goes with which exponents is confirmed by the four formulas of Changenet, Leprince,
    Ville, Velex, J. Mech. Des. 133 (2011): there 1.366 Re^-.21 ends as 0.239 and 20.797 Re^-.21 as 3.644 at Re = 4000.

    Examples
    --------
    A gear of 100 mm, dipping 20 mm, at 20 and at 1000 rad/s:

    >>> gear = {"h": 0.02, "r_p": 0.05, "b": 0.014, "z": 24, "tooth_height": 0.01, "alpha": 0.349066, "V_oil": 1e-3}
    >>> oil = {"nu": 15.41, "rho": 848.0}
    >>> [round(float(churning_changenet_velex(omega=omega, **gear, **oil)), 4) for omega in (20.0, 1000.0)]
    [0.1636, 95.3485]
    """
    omega = np.asarray(omega)
    Re = omega * r_p * b / (np.asarray(nu) * 1e-6)
    share = np.clip((Re - RE_LAMINAR) / (RE_TURBULENT - RE_LAMINAR), 0.0, 1.0)
    calm, swirling = _regimes(h, r_p, b, V_oil, omega)
    C_m = (1.0 - share) * 1.366 * calm * np.minimum(Re, RE_TURBULENT) ** -0.21 + share * 3.644 * swirling
    return np.asarray(0.5 * rho * omega**3 * _wetted(h, r_p, b, z, tooth_height, alpha, beta) * r_p**3 * C_m)


def churning_changenet_2011(
    *, h: float, r_p: float, b: float, z: int, tooth_height: float, alpha: float, V_oil: float, omega: Numeric,
    nu: Numeric, rho: Numeric, module: float, beta: float = 0.0
) -> Array:  # fmt: skip
    r"""Churning loss of one dipping gear after Changenet, Leprince, Ville and Velex (2011).

    As :func:`churning_changenet_velex`, but the acceleration ``gamma = omega^2 (R_p b m)^(1/3)`` of the oil sets the
    regime: the first formula up to 750 m/s^2, the second from 1250 on, linear in gamma between. In both
    ``Re^-.21`` ends at Re = 4000: ``0.239`` is ``1.366 Re^-.21`` there, and ``3.644`` is ``20.797 Re^-.21``.

    Parameters
    ----------
    module : float
        [m]; all others as :func:`churning_changenet_velex`

    Returns
    -------
    Array, shape (...)
        [W]

    References
    ----------
    Changenet, Leprince, Ville, Velex, "A note on flow regimes and churning loss modeling", J. Mech. Des. 133 (2011);
    from memory, checked against an independent evaluation on the FZG rig (16.1 W at 8.3 m/s, 0.9 l at 60 degC).

    Examples
    --------
    The gear of :func:`churning_changenet_velex`:

    >>> gear = {"h": 0.02, "r_p": 0.05, "b": 0.014, "z": 24, "tooth_height": 0.01, "alpha": 0.349066, "V_oil": 1e-3}
    >>> oil = {"nu": 15.41, "rho": 848.0}
    >>> losses = churning_changenet_2011(omega=np.array([20.0, 1000.0]), module=4.5e-3, **gear, **oil)
    >>> losses.round(4).tolist()
    [0.1636, 95.3463]
    """
    omega = np.asarray(omega)
    Re = omega * r_p * b / (np.asarray(nu) * 1e-6)
    gamma = omega**2 * (r_p * b * module) ** (1.0 / 3.0)
    share = np.clip((gamma - GAMMA_CALM) / (GAMMA_SWIRLING - GAMMA_CALM), 0.0, 1.0)
    calm, swirling = _regimes(h, r_p, b, V_oil, omega)
    C_m = np.minimum(Re, RE_2011) ** -0.21 * ((1.0 - share) * 1.366 * calm + share * 20.797 * swirling)
    return np.asarray(0.5 * rho * omega**3 * _wetted(h, r_p, b, z, tooth_height, alpha, beta) * r_p**3 * C_m)


def _wetted(h: float, r_p: float, b: float, z: int, tooth_height: float, alpha: float, beta: float) -> float:
    """Wetted area [m^2] of both faces, the rim, and both flanks of the dipping teeth; 0 of a dry gear."""
    theta = float(np.arccos(np.clip(1.0 - h / r_p, -1.0, 1.0)))
    flanks = 2.0 * z * tooth_height * theta * b / (np.pi * np.cos(alpha) * np.cos(beta))
    return float(r_p**2 * (2.0 * theta - np.sin(2.0 * theta)) + 2.0 * r_p * b * theta + flanks)


def _regimes(h: float, r_p: float, b: float, V_oil: float, omega: Array) -> tuple[Array, Array]:
    """Geometry and Froude number in the drag of a gear that throws the oil off, and of one that takes it round."""
    D, Fr = 2.0 * r_p, omega**2 * r_p / GRAVITY
    dips, volume, width = max(h, 0.0) / D, V_oil / D**3, b / D
    calm = dips**0.45 * volume**0.1 * width**0.21 * Fr**-0.6
    swirling = dips**0.1 * volume**-0.35 * width**0.85 * Fr**-0.88
    return np.asarray(calm), np.asarray(swirling)


@dataclass(frozen=True, kw_only=True)
class ChurningLaw:
    """Splashing of both gears of a mesh, by one of the named models; reads input speed and oil temperature.

    ``speed_ratio`` is the pinion's speed over that of the input shaft.
    """

    pair: GearPair
    oil: Oil
    model: str
    level_below_axis: tuple[float, float]  # m
    oil_volume: float  # m^3
    C_Sp: float = 1.0
    speed_ratio: float = 1.0

    @property
    def immersion(self) -> tuple[float, float]:
        """Immersion depths of both gears, [m], at most their diameters; not positive if the gear is dry."""
        return self._depth(0, self.pair.r_a), self._depth(1, self.pair.r_a)

    def _depth(self, gear: int, radii: tuple[float, float]) -> float:
        return min(radii[gear] - self.level_below_axis[gear], 2.0 * radii[gear])

    def power(self, x: Array) -> Array:
        """Churning loss [W], shape (N, 1), at speed [1/min] and oil temperature [degC], shape (N, 2)."""
        omega_1, T_oil = x[:, 0] * self.speed_ratio * RPM, x[:, 1]
        pair, v_t = self.pair, omega_1 * self.pair.r_w[0]
        omega = (omega_1, omega_1 / pair.u)
        match self.model:
            case "niemann":
                per_gear = [churning_niemann(e=e, b=pair.b, v_t=v_t) for e in self.immersion]
            case "niemann_printed":
                per_gear = [
                    churning_niemann_printed(e=e, b=pair.b, v_t=v_t, omega=w)
                    for e, w in zip(self.immersion, omega, strict=True)
                ]
            case "mauz":
                wheel = omega_1 / max(1.0, pair.u)  # the gear with more teeth, whichever drives
                per_gear = [churning_mauz(e=self.immersion, b=pair.b, v_t=v_t, omega_2=wheel, C_Sp=self.C_Sp)]
            case _:
                changenet = churning_changenet_velex
                if self.model == "changenet_2011":
                    changenet = partial(churning_changenet_2011, module=pair.m_n)
                nu, rho = self.oil.kinematic_viscosity(T_oil), self.oil.density(T_oil)
                per_gear = [
                    changenet(
                        # Measured at the pitch circle, as theta and D are; the tooth flanks are a separate area.
                        h=self._depth(i, pair.r_w),
                        r_p=pair.r_w[i],
                        b=pair.b,
                        z=pair.z[i],
                        tooth_height=pair.r_a[i] - pair.r_f[i],
                        alpha=pair.alpha_t,
                        beta=pair.beta,
                        V_oil=self.oil_volume,
                        omega=omega[i],
                        nu=nu,
                        rho=rho,
                    )
                    for i in (0, 1)
                ]
        return np.asarray(sum(per_gear))[:, None]


def churning_terms(gearbox: GearboxData) -> Iterator[LossTerm]:
    """Yield the churning loss of every stage."""
    inputs = (TermInput("speed_rpm", SPEED), TermInput("T_oil_degC", OIL))
    for name, stage in zip(of_stages("churning", len(gearbox.stage)), gearbox.stage, strict=True):
        level = gearbox.level_below_axis
        law = ChurningLaw(
            pair=stage.pair(),
            oil=gearbox.lubricant(),
            model=stage.churning.model,
            level_below_axis=(level[stage.driver], level[stage.driven]),
            oil_volume=gearbox.oil.volume,
            C_Sp=stage.churning.C_Sp,
            speed_ratio=gearbox.speed_ratio[stage.driver],
        )
        yield LossTerm(kind=CHURNING, name=name, components=(name,), node=OIL, inputs=inputs, law=law)


CHURNING = LossKind(
    name="churning",
    components=("churning",),
    factors={"churning": "churning loss"},
    network="no_load",
    powers=((1.5, 0.0),),
    law_error={"speed": 0.1, "viscosity": 0.05},
    terms=churning_terms,
)
