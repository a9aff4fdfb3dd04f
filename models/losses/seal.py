"""Friction of radial shaft seals."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from models.base.types import Array, Numeric
from models.losses.loss_term import OIL, SPEED, GearboxData, LossKind, LossTerm, TermInput

LOWEST_BRACKET = 5.0  # the straight line in temperature would turn negative above about 130 degC


def seal_loss_linke(*, d_mm: float, n_rpm: Numeric, T_oil: Numeric, nu_40: float, c_T: float = 1.6) -> Array:
    r"""Power loss of one radial shaft seal after Linke.

    .. math:: P_{VD} = [145 - c_T \vartheta + 350 \lg\lg(\nu_{40} + 0.8)]\, d^2 n \cdot 10^{-7}

    Parameters
    ----------
    d_mm : float
        Shaft diameter under the lip, [mm]
    n_rpm : Numeric, shape (...)
        Speed of that shaft, [1/min], >= 0
    T_oil : Numeric, shape (...)
        Oil sump temperature, [degC]; the bracket is held at 5 or above (about 130 degC)
    nu_40 : float
        Kinematic viscosity at 40 degC (ISO VG), [mm^2/s]
    c_T : float
        Temperature coefficient, [1/K]; 1.6 after Linke, 1.0 as printed in the paper's eq. (10)

    Returns
    -------
    Array, shape (...)
        Power loss, [W]

    References
    ----------
    Linke, "Stirnradverzahnung"; gear programs list it apart from ISO/TR 14179-1 and -2.

    Examples
    --------
    The two seals of the FZG rig at 8.3 m/s, in Linke's and in the printed form:

    >>> linke, printed = (sum(float(seal_loss_linke(d_mm=d, n_rpm=n, T_oil=60.0, nu_40=32.0, c_T=c))
    ...                          for d, n in ((24.0, 2165.7), (54.0, 1443.8))) for c in (1.6, 1.0))
    >>> round(linke, 2), round(printed, 2)
    (61.25, 80.9)
    """
    bracket = 145.0 - c_T * np.asarray(T_oil) + 350.0 * np.log10(np.log10(nu_40 + 0.8))
    return np.asarray(np.maximum(bracket, LOWEST_BRACKET) * d_mm**2 * np.asarray(n_rpm) * 1e-7)


def seal_loss_iso_simple(*, d_mm: float, n_rpm: Numeric) -> Array:
    """Power loss of one radial shaft seal, ``7.69e-6 d^2 n``, without oil or temperature.

    Parameters
    ----------
    d_mm : float
        Shaft diameter under the lip, [mm]
    n_rpm : Numeric, shape (...)
        Speed of that shaft, [1/min], >= 0

    Returns
    -------
    Array, shape (...)
        Power loss, [W]

    References
    ----------
    ISO/TR 14179-2:2001.

    Examples
    --------
    >>> round(float(seal_loss_iso_simple(d_mm=24.0, n_rpm=2165.7) + seal_loss_iso_simple(d_mm=54.0, n_rpm=1443.8)), 1)
    42.0
    """
    return np.asarray(7.69e-6 * d_mm**2 * np.asarray(n_rpm))


@dataclass(frozen=True, kw_only=True)
class SealLaw:
    """One radial shaft seal; reads the speed of the input shaft and the oil temperature."""

    d_mm: float
    model: str
    nu_40: float
    c_T: float
    speed_ratio: float

    def power(self, x: Array) -> Array:
        """Seal loss [W], shape (N, 1), at input speed [1/min] and oil temperature [degC], shape (N, 2)."""
        n = x[:, 0] * self.speed_ratio
        if self.model == "iso_simple":
            return seal_loss_iso_simple(d_mm=self.d_mm, n_rpm=n)[:, None]
        return seal_loss_linke(d_mm=self.d_mm, n_rpm=n, T_oil=x[:, 1], nu_40=self.nu_40, c_T=self.c_T)[:, None]


def seal_terms(gearbox: GearboxData) -> Iterator[LossTerm]:
    """Yield the loss of every ``[[seal]]``."""
    oil = gearbox.lubricant()
    inputs = (TermInput("speed_rpm", SPEED), TermInput("T_oil_degC", OIL))
    for seal in gearbox.seal:
        law = SealLaw(
            d_mm=seal.diameter_mm,
            model=seal.model,
            nu_40=oil.nu_40 if seal.nu_40_mm2_s is None else seal.nu_40_mm2_s,
            c_T=seal.temperature_coefficient,
            speed_ratio=gearbox.speed_ratio[seal.shaft],
        )
        yield LossTerm(kind=SEAL, name=seal.name, components=(seal.name,), node=OIL, inputs=inputs, law=law)


SEAL = LossKind(
    name="seal",
    factors={"seal": "seal losses"},
    network="no_load",
    powers=((1.0, 0.0),),
    law_error={"speed": 0.05, "viscosity": 0.05},
    terms=seal_terms,
)
