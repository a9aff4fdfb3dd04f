"""Typical sizes of a gearbox and its operation: what the laws of the catalogue are written in ratios to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import sympy as sp

from models.formulas.extremes import Max, Min
from models.formulas.oil import TYPICAL_OIL, kinematic_viscosity_d341
from models.network.laws import symbol

if TYPE_CHECKING:
    from models.assembly.gearbox import Gearbox
    from models.simulation.thermal_network import Losses, ThermalNetwork

HOTTEST, COOLEST_RISE, TYPICAL_RISE = 100.0, 20.0, 50.0  # degC, K, K
TEN_HOURS = 36000.0
EXPONENTS = (-1.0, 1.0)  # within which a loss may go with the viscosity
LEAST = 1e-12  # W, of a loss that is nothing here


@dataclass(frozen=True, kw_only=True)
class Scale:
    """Typical sizes, all positive but the temperatures and the loss of a machine without losses.

    Attributes
    ----------
    speed : float
        Of the input shaft, [1/min]
    torque : float
        At the input shaft, [N m]
    loss : float
        All losses there, [W]; 0 for a machine without losses, to which the heats of the catalogue do not apply
    conductance : float
        From the gearbox to its surroundings, [W/K]
    capacity : float
        Of the largest part, [J/K]
    temperature, ambient : float
        Hot oil and surroundings, [degC]
    duration : float
        Of a recording, [s]
    interval : float
        Between its rows, [s]
    oil_m, oil_n : float
        Constants of the oil's viscosity, see :func:`models.formulas.oil.kinematic_viscosity_d341`
    viscosity_exponents : mapping of str to float
        Of every loss in the network, by the name of its source: d ln(loss) / d ln(viscosity) at these sizes, [-]
    """

    speed: float
    torque: float
    loss: float
    conductance: float
    capacity: float
    temperature: float
    ambient: float
    duration: float
    interval: float = 1.0
    oil_m: float = TYPICAL_OIL[0]
    oil_n: float = TYPICAL_OIL[1]
    viscosity_exponents: Mapping[str, float] = field(default_factory=dict)

    @property
    def viscosity(self) -> float:
        """Kinematic viscosity of the hot oil, [mm^2/s]."""
        return float(kinematic_viscosity_d341(self.temperature, self.oil_m, self.oil_n))

    def viscosity_at(self, T: sp.Expr) -> sp.Expr:
        """Kinematic viscosity [mm^2/s] at a temperature [degC], from -40 to 200 and held there beyond."""
        return kinematic_viscosity_d341(Min(Max(T, -40.0), 200.0), self.oil_m, self.oil_n, xp=sp)

    @classmethod
    def of(
        cls,
        gearbox: Gearbox,
        *,
        speed: float | None = None,
        torque: float | None = None,
        ambient: float | None = None,
        temperature: float | None = None,
        inputs: Mapping[str, float] | None = None,
        duration: float = TEN_HOURS,
        interval: float = 1.0,
    ) -> Scale:
        """The scale of a gearbox.

        Parameters
        ----------
        gearbox : Gearbox
        speed, torque : float or None
            Typical magnitudes of its operation, [1/min] and [N m]; by default half of the training range,
            without geometry those of the reference
        ambient : float or None
            [degC]; by default the definition's
        temperature : float or None
            Of the hot oil, [degC]; by default where the nominal losses and conductances put it
        inputs : mapping of str to float or None
            Typical values of inputs that the definition names; by default their defaults
        duration : float
            Of a recording, [s]
        interval : float
            Between its rows, [s]

        Examples
        --------
        >>> from models.assembly.gearbox import load_gearbox
        >>> scale = Scale.of(load_gearbox("fzg"), speed=2600.0, torque=94.0)
        >>> round(scale.conductance, 1), round(scale.viscosity, 1)
        (6.9, 8.1)
        """
        typical_speed, typical_torque = gearbox.typical_operation
        speed = typical_speed if speed is None else speed
        torque = typical_torque if torque is None else torque
        ambient = gearbox.ambient_degC if ambient is None else ambient
        network, losses, (oil_m, oil_n) = gearbox.network(), gearbox.loss_laws(), gearbox.viscosity_constants
        start = {symbol(p.name): p.start for p in network.parameters}
        here = {symbol(f"T_{name}"): ambient for name in network.boundaries}
        here |= {symbol(f"T_{part.name}"): ambient + TYPICAL_RISE for part in network.parts}
        here |= {symbol(name): given.default for name, given in network.inputs.items()}
        here |= {symbol(name): value for name, value in (inputs or {}).items()}
        here |= {symbol("speed"): speed, symbol("torque"): torque, symbol("time"): 0.0}
        here |= {symbol(state.name): state.start for state in network.states}
        outward = [link.conductance for link in network.links if network.boundaries.keys() & set(link.nodes)]
        conductance = float(sum(law.xreplace(start | here).evalf() for law in outward))
        at = [[ambient + TYPICAL_RISE] * len(losses.temperature_nodes)]
        loss = float(losses.power([speed], [torque], at).sum())
        if temperature is None:
            temperature = min(max(ambient + loss / max(conductance, 1e-9), ambient + COOLEST_RISE), HOTTEST)
        return cls(
            speed=speed,
            torque=torque,
            loss=loss,
            conductance=conductance,
            capacity=max(float(sp.sympify(part.capacity).xreplace(start)) for part in network.parts),
            temperature=max(temperature, ambient + COOLEST_RISE),
            ambient=ambient,
            duration=duration,
            interval=interval,
            oil_m=oil_m,
            oil_n=oil_n,
            viscosity_exponents=_viscosity_exponents(network, losses, (oil_m, oil_n), start | here),
        )


def _viscosity_exponents(
    network: ThermalNetwork, losses: Losses, oil: tuple[float, float], at: Mapping[sp.Symbol, float]
) -> dict[str, float]:
    """Exponent of the viscosity in every loss, by a difference: a colder gearbox has a thicker oil."""
    speed, torque = at[symbol("speed")], at[symbol("torque")]
    middle = at[symbol(f"T_{network.parts[0].name}")]
    logs = []
    for T in (middle - 1.0, middle + 1.0):
        power = losses.power([speed], [torque], [[T] * len(losses.temperature_nodes)])[0]
        here = dict(at) | {symbol(f"T_{part.name}"): T for part in network.parts}
        here |= {symbol(f"P_{name}"): value for name, value in zip(losses.components, power, strict=True)}
        heats = [float(sp.N(source.heat.xreplace(here))) for source in network.sources]
        logs.append(np.log(np.maximum([*heats, kinematic_viscosity_d341(T, *oil)], LEAST)))
    change = logs[1] - logs[0]
    exponents = np.clip(change[:-1] / change[-1], *EXPONENTS)
    return {s.name: float(e) for s, e in zip(network.sources, exponents, strict=True) if s.is_loss}
