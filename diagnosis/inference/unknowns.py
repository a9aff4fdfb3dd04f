"""What is not known exactly when a recording is explained, each with its prior: parameters of the network, of the
sensors, and of the inputs.

Inside the inference every unknown is a standard normal number ``z``: value = start exp(sd z) for a log-normal prior,
start + sd z for a normal one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from diagnosis.forward.grid import Piece
from diagnosis.forward.observation import Sensors
from models.base.types import Array
from models.network.laws import Parameter
from models.quantities.quantities import TOTAL_LOSS, is_total_loss
from models.simulation.thermal_network import ThermalNetwork

Role = Literal["network", "bias", "lag", "loss_gain", "loss_delay", "torque_gain", "ambient_offset", "term"]
BIAS_SD_K, LOSS_OFFSET_SD_W, LOSS_GAIN_SD = 0.3, 2.0, 0.02
LOSS_DELAY_ROWS = 0.5  # whether a row is the mean of the time before its stamp or after it, or a moment, is not known
LAG_S, LAG_SD = 15.0, 0.8  # of its logarithm: a sensor's lag is that of its seat, not of its data sheet
SHORTEST_LAG_S = 3.0
TORQUE_GAIN_SD, AMBIENT_SD_K = 0.01, 0.3
AMBIENT_ASSUMED_SD_K = 4.0  # of a hall whose temperature nobody recorded


@dataclass(frozen=True, kw_only=True)
class Unknown:
    """One number to be found.

    Attributes
    ----------
    role : str
        ``network``: a parameter of it; ``bias`` and ``lag`` of a channel; ``loss_gain`` and ``loss_delay`` of the
        measured total loss;
        ``torque_gain`` and ``ambient_offset`` of the recorded inputs; ``term``: a parameter of a term outside the
        network (an input shifted, a reading distorted)
    target : str
        Name of the parameter or channel
    parameter : Parameter
        Start, prior and bounds
    """

    role: Role
    target: str
    parameter: Parameter

    def value(self, z: float) -> float:
        """The value at `z`, held at the bounds."""
        p = self.parameter
        value = p.start * np.exp(p.sd * z) if p.log else p.start + p.sd * z
        return float(min(max(value, p.lower), p.upper))

    def z_inside(self, value: float) -> float:
        """The standard normal number of the nearest possible value."""
        return self.z(min(max(value, self.parameter.lower), self.parameter.upper))

    def per_z(self, z: float) -> float:
        """Change of the value with `z`, at a bound that to the inside."""
        return self.value(z) * self.parameter.sd if self.parameter.log else self.parameter.sd

    def z(self, value: float) -> float:
        """The standard normal number of a value."""
        p = self.parameter
        return float(np.log(value / p.start) / p.sd if p.log else (value - p.start) / p.sd)


class Unknowns:
    """All unknowns of one explanation, in order.

    Parameters
    ----------
    items : iterable of Unknown
        Those of role ``network`` must cover the parameters of the network that may vary; the others stay at their start
    """

    def __init__(self, items: Iterable[Unknown]) -> None:
        self.items = tuple(items)

    def __len__(self) -> int:
        return len(self.items)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lowest and highest standard normal numbers, each of shape (unknowns,)."""
        parameters = [item.parameter for item in self.items]
        endless = np.array([p.log and p.lower <= 0.0 for p in parameters], dtype=bool)
        lowest = [p.start if none else p.lower for p, none in zip(parameters, endless, strict=True)]
        lower = np.array([item.z(value) for item, value in zip(self.items, lowest, strict=True)])
        upper = np.array([item.z(p.upper) for item, p in zip(self.items, parameters, strict=True)])
        return np.where(endless, -np.inf, lower), upper

    def with_parameters(self, role: Role, parameters: Iterable[Parameter]) -> Unknowns:
        """The same and further ones."""
        added = (Unknown(role=role, target=p.name, parameter=p) for p in parameters)
        return Unknowns((*self.items, *added))

    def with_prior(self, index: int, sd: float) -> Unknowns:
        """The same with another prior for one of them."""
        item = self.items[index]
        wider = replace(item, parameter=replace(item.parameter, sd=sd))
        return Unknowns((*self.items[:index], wider, *self.items[index + 1 :]))

    def of(self, parameters: Iterable[Parameter]) -> list[int]:
        """Where parameters are among them, by name."""
        at = {item.target: index for index, item in enumerate(self.items) if item.role in ("network", "term")}
        return [at[p.name] for p in parameters]

    def values(self, z: Array) -> list[float]:
        """Values of all unknowns."""
        return [item.value(float(x)) for item, x in zip(self.items, z, strict=True)]

    def network_values(self, network: ThermalNetwork, z: Array) -> Array:
        """Values of all parameters of the network."""
        found = {i.target: v for i, v in zip(self.items, self.values(z), strict=True) if i.role == "network"}
        return np.array([found.get(p.name, p.start) for p in network.parameters])

    def term_values(self, names: Sequence[str], z: Array) -> Array:
        """Values of the parameters of a term outside the network."""
        found = {i.target: v for i, v in zip(self.items, self.values(z), strict=True) if i.role == "term"}
        return np.array([found[name] for name in names])

    def sensors(self, channels: Sequence[str], z: Array) -> Sensors:
        """The sensors."""
        lag, bias, gain, delay = np.zeros(len(channels)), np.zeros(len(channels)), 1.0, 0.0
        for item, value in zip(self.items, self.values(z), strict=True):
            if item.role == "lag":
                lag[channels.index(item.target)] = value
            elif item.role == "bias":
                bias[channels.index(item.target)] = value
            elif item.role == "loss_gain":
                gain = value
            elif item.role == "loss_delay":
                delay = value
        return Sensors(channels=tuple(channels), lag=lag, bias=bias, loss_gain=gain, loss_delay=delay)

    def adjusted(self, piece: Piece, inputs: Sequence[str], z: Array) -> Piece:
        """A piece with the inputs as they probably were, and with the lags of its sensors."""
        samples = piece.samples
        for item, value in zip(self.items, self.values(z), strict=True):
            if item.role in ("torque_gain", "ambient_offset") and value != item.parameter.start:
                samples = shifted(samples, inputs, item.role, value)
        return replace(piece, samples=samples, lags=self.sensors(piece.channels, z).lag)


def shifted(samples: Array, inputs: Sequence[str], role: str, value: float) -> Array:
    """Inputs with another torque gain or ambient offset, shape (K, S, inputs)."""
    moved = np.array(samples)
    if role == "torque_gain":
        moved[..., inputs.index("torque")] *= value
    elif "T_ambient" in inputs:
        moved[..., inputs.index("T_ambient")] += value
    return moved


def unknowns_of(
    network: ThermalNetwork, channels: Sequence[str], *, lags: Mapping[str, float] | None = None,
    bias_sd: Mapping[str, float] | None = None, slow: bool = False, interval: float = 10.0,
    ambient_assumed: bool = False, torque_gain: Parameter | None = None,
) -> Unknowns:  # fmt: skip
    """The usual unknowns of a network and its sensors.

    Parameters
    ----------
    network : ThermalNetwork
    channels : sequence of str
    lags, bias_sd : mapping of channel to float
        Time constants [s] and tolerances [K] as their data sheets state them
    slow : bool
        Whether the rows lie minutes apart: they show no usual lag of a sensor then
    interval : float
        Between rows, [s]
    ambient_assumed : bool
        Whether the ambient temperature was not recorded
    torque_gain : Parameter or None
        Factor on a torque that follows from a power
    """
    lags, bias_sd = lags or {}, bias_sd or {}
    items = [Unknown(role="network", target=p.name, parameter=p) for p in network.parameters if p.sd > 0.0]
    for name in channels:
        if is_total_loss(name):
            gain = Parameter(name="loss_gain", start=1.0, sd=LOSS_GAIN_SD, lower=0.5, upper=2.0, log=False)
            offset = _normal("bias_P_loss", "W", 0.0, LOSS_OFFSET_SD_W)
            items += [Unknown(role="loss_gain", target=TOTAL_LOSS, parameter=gain),
                      Unknown(role="bias", target=TOTAL_LOSS, parameter=offset)]  # fmt: skip
            if not slow:
                delay = _normal("delay_P_loss", "s", 0.0, LOSS_DELAY_ROWS * interval)
                items.append(Unknown(role="loss_delay", target=TOTAL_LOSS, parameter=delay))
        else:
            items.append(
                Unknown(
                    role="bias",
                    target=name,
                    parameter=_normal(f"bias_{name}", "K", 0.0, max(bias_sd.get(name, 0.0), BIAS_SD_K)),
                )
            )
            if slow:
                continue
            lag = Parameter(
                name=f"lag_{name}", unit="s", start=max(lags.get(name, LAG_S), SHORTEST_LAG_S), sd=LAG_SD,
                lower=0.01, upper=1e4, log=True,
                description=f"time constant of the sensor at {name}",
            )  # fmt: skip
            items.append(Unknown(role="lag", target=name, parameter=lag))
    torque = Parameter(name="torque_gain", start=1.0, sd=TORQUE_GAIN_SD, lower=0.5, upper=2.0, log=False,
                       description="true over recorded torque")  # fmt: skip
    if network.components:
        items.append(Unknown(role="torque_gain", target="torque", parameter=torque_gain or torque))
    if "T_ambient" in network.inputs:
        ambient = _normal("ambient_offset", "K", 0.0, AMBIENT_ASSUMED_SD_K if ambient_assumed else AMBIENT_SD_K)
        items.append(Unknown(role="ambient_offset", target="T_ambient", parameter=ambient))
    return Unknowns(items)


def _normal(name: str, unit: str, start: float, sd: float) -> Parameter:
    return Parameter(name=name, unit=unit, start=start, sd=sd, lower=-1e6, upper=1e6, log=False)
