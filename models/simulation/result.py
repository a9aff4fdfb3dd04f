"""Results of a thermal network: a simulated cycle, and steady states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from models.base.types import Array, Numeric
from models.columns.columns import Columns, What
from models.portable.evaluation import efficiency, torque_loss
from models.quantities.quantities import MEMORY, TOTAL_LOSS, column_of, column_of_input

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Temperatures and losses of a network, at moments or at operating points; subclasses give the shapes.

    Attributes
    ----------
    inputs : mapping of signal to float or Array
    temperatures : mapping of node to float or Array
        [degC], boundary nodes included
    losses : mapping of loss to float or Array
        [W], factors applied
    extra_heat : mapping of source to float or Array
        Sources that are no losses, [W]
    domain_distance : float or Array
        How far outside the loss model's domain, or the range that was named, as a fraction of its range; 0 inside
    """

    inputs: Mapping[str, Numeric]
    temperatures: Mapping[str, Numeric]
    losses: Mapping[str, Numeric]
    extra_heat: Mapping[str, Numeric]
    domain_distance: Numeric

    @property
    def loss(self) -> Numeric:
        """Total loss, [W]."""
        return sum(self.losses.values(), 0.0 * self.domain_distance)

    @property
    def has_shaft(self) -> bool:
        """True if the machine has losses and a shaft of recorded speed and torque."""
        return bool(self.losses) and {"speed", "torque"} <= self.inputs.keys()

    @property
    def torque_loss(self) -> Numeric:
        """Loss torque at the input shaft [N m]; see :func:`models.portable.evaluation.torque_loss`."""
        return _plain(torque_loss(np.asarray(self.loss), np.asarray(self.inputs["speed"])))

    @property
    def efficiency(self) -> Numeric:
        """Efficiency [-]; see :func:`models.portable.evaluation.efficiency`."""
        loss, speed, torque = (np.asarray(v) for v in (self.loss, self.inputs["speed"], self.inputs["torque"]))
        return _plain(efficiency(loss, speed, torque))

    def torque_out(self, ratio: float) -> Numeric:
        """Return the torque at the output shaft [N m].

        Its power is that of the input shaft less the loss, as in :func:`models.portable.evaluation.efficiency`: when
        coasting the output shaft gives the loss as well. Negative if a driving input gives less than the loss.

        Parameters
        ----------
        ratio : float
            Speed of the input shaft over speed of the output shaft, [-]
        """
        return ratio * (self.inputs["torque"] - self.torque_loss)

    def columns(self, *, ratio: float | None = None) -> Columns:
        """Return the columns of a file, in the order of the file contract.

        Parameters
        ----------
        ratio : float or None
            Speed of the input shaft over speed of the output shaft, [-]; with it the output torque is a column too
        """
        table = {column_of_input(name): values for name, values in self.inputs.items()}
        computed = {f"T_{node}": T for node, T in self.temperatures.items()}
        if self.losses:
            computed |= {TOTAL_LOSS: self.loss} | {f"P_loss_{name}": P for name, P in self.losses.items()}
        if self.has_shaft:
            computed |= {"torque_loss": self.torque_loss, "efficiency": self.efficiency}
            computed |= {} if ratio is None else {"torque_out": self.torque_out(ratio)}
        computed |= {"in_domain": np.asarray(self.domain_distance <= 0.0)}
        table |= {column_of(name): values for name, values in computed.items()}
        return Columns((name, np.asarray(values)) for name, values in table.items())

    def to_dataframe(self) -> pd.DataFrame:
        """Return :meth:`columns` as a data frame; variants of parameters below each other."""
        return self.columns().to_dataframe()

    def plot(self, what: What = "temperatures", *, only: Sequence[str] = (), ax: Axes | None = None) -> Axes:
        """Draw temperatures or losses; see :meth:`models.columns.columns.Columns.plot`."""
        return self.columns().plot(what, only=only, ax=ax)


@dataclass(frozen=True, kw_only=True, repr=False)
class Result(Outcome):
    """A simulated cycle. With parameter arrays of length B every array but `time` and `inputs` has B in front.

    Attributes
    ----------
    time : Array, shape (N,)
        [s]
    inputs : mapping of signal to Array, shape (N,)
    temperatures, losses, extra_heat : mapping of str to Array, shape (..., N)
        As in :class:`Outcome`
    domain_distance : Array, shape (..., N)
    memories : mapping of str to Array, shape (..., N)
        Memories of the laws (of a thermostat, of wear ...); with the temperatures they continue a simulation
    heat_to : mapping of boundary to Array, shape (..., N)
        Heat given to each boundary since the start, [J]
    heat_in, heat_stored : Array, shape (..., N)
        Heat brought in by all sources and stored since the start, [J]

    Examples
    --------
    >>> from models.assembly.gearbox import load_gearbox
    >>> cycle = {"time_s": [0.0, 300.0, 600.0], "speed_rpm": [1500.0] * 3, "torque_Nm": [100.0] * 3}
    >>> result = load_gearbox("fzg").simulate(cycle, initial=20.0)
    >>> result
    <Result: 3 rows from 0 to 600 s, 14 nodes, 9 losses>
    >>> result.to_dataframe()[["time_s", "T_oil_degC", "P_loss_W"]].round(1)
       time_s  T_oil_degC  P_loss_W
    0     0.0        20.0     312.7
    1   300.0        25.8     293.4
    2   600.0        30.1     282.4
    """

    time: Array
    inputs: Mapping[str, Array]
    temperatures: Mapping[str, Array]
    losses: Mapping[str, Array]
    extra_heat: Mapping[str, Array]
    domain_distance: Array
    memories: Mapping[str, Array]
    heat_to: Mapping[str, Array]
    heat_in: Array
    heat_stored: Array

    def __repr__(self) -> str:
        variants = "".join(f"{n} x " for n in self.heat_in.shape[:-1])
        rows = f"{variants}{len(self.time)} rows from {self.time[0]:g} to {self.time[-1]:g} s"
        return f"<Result: {rows}, {len(self.temperatures)} nodes, {len(self.losses)} losses>"

    @property
    def loss(self) -> Array:
        """Total loss [W], shape (..., N)."""
        return np.asarray(super().loss)

    @property
    def heat_out(self) -> Array:
        """Heat given to all boundaries since the start [J], shape (..., N)."""
        return np.asarray(sum(self.heat_to.values(), np.zeros_like(self.heat_in)))

    def columns(self, *, ratio: float | None = None) -> Columns:
        """Return the columns of a file, time first; see :meth:`Outcome.columns`."""
        memories = {f"{MEMORY}{name}": values for name, values in self.memories.items()}
        return Columns(time_s=self.time) | super().columns(ratio=ratio) | memories


@dataclass(frozen=True, kw_only=True, repr=False)
class SteadyState(Outcome):
    """State in which nothing changes: floats at one operating point, else arrays of shape (B,).

    Examples
    --------
    >>> from models.assembly.gearbox import load_gearbox
    >>> steady = load_gearbox("fzg").steady_state(speed=[500.0, 1500.0], torque=94.0)
    >>> steady
    <SteadyState: 2 operating points, 14 nodes, 9 losses>
    >>> steady.to_dataframe()[["speed_rpm", "T_oil_degC", "P_loss_W", "efficiency"]].round(3)
       speed_rpm  T_oil_degC  P_loss_W  efficiency
    0      500.0      40.296    88.814       0.982
    1     1500.0      63.573   242.417       0.984
    """

    def __repr__(self) -> str:
        points = np.size(self.domain_distance)
        where = "1 operating point" if points == 1 else f"{points} operating points"
        return f"<SteadyState: {where}, {len(self.temperatures)} nodes, {len(self.losses)} losses>"


def _plain(values: Array) -> Numeric:
    """Return an array of no axes as a float."""
    return values if np.ndim(values) else float(values)
