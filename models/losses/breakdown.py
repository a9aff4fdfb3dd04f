"""Losses at operating points by component, of any loss model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from models.base.errors import InputError, did_you_mean
from models.base.shapes import common_shape
from models.base.types import Numeric
from models.columns.columns import Columns
from models.network.structure import Losses
from models.quantities.quantities import TOTAL_LOSS, column_of, column_of_input, implausible, quantity_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

TOTAL = "total"


class Breakdown(dict[str, Numeric]):
    """Losses [W] by component, and their ``total``: floats at one operating point, else arrays; a dict.

    Attributes
    ----------
    speed, torque : float or Array
        Of the input shaft, [1/min] and [N m]
    temperatures : mapping of node to float or Array
        [degC]
    """

    def __init__(
        self, losses: Mapping[str, Numeric], *, speed: Numeric, torque: Numeric, temperatures: Mapping[str, Numeric]
    ) -> None:
        super().__init__(losses)
        self.speed, self.torque, self.temperatures = speed, torque, temperatures

    def __repr__(self) -> str:
        if np.ndim(self[TOTAL]):
            return f"<Breakdown: {len(self) - 1} losses at {' x '.join(map(str, np.shape(self[TOTAL])))} points>"
        largest = sorted((name for name in self if name != TOTAL), key=lambda name: -self[name])[:3]
        shown = ", ".join(f"{name} {self[name]:.1f} W" for name in largest)
        return f"<Breakdown: {self[TOTAL]:.1f} W in {len(self) - 1} losses; largest: {shown}>"

    def columns(self) -> Columns:
        """Return operating points and losses by the names of columns in files."""
        inputs = {"speed": self.speed, "torque": self.torque}
        table = {column_of_input(name): values for name, values in inputs.items()}
        table |= {column_of(f"T_{node}"): values for node, values in self.temperatures.items()}
        table |= {column_of(TOTAL_LOSS): self[TOTAL]}
        table |= {column_of(f"P_loss_{name}"): values for name, values in self.items() if name != TOTAL}
        shape = np.shape(self[TOTAL])
        return Columns((name, np.broadcast_to(values, shape).ravel()) for name, values in table.items())

    def to_dataframe(self) -> pd.DataFrame:
        """Return :meth:`columns` as a data frame, one row per operating point."""
        return self.columns().to_dataframe()

    def plot(self, *, only: Sequence[str] = (), ax: Axes | None = None) -> Axes:
        """Draw the losses over the first of speed, torque and temperatures that changes.

        Parameters
        ----------
        only : sequence of str
            Names of losses; by default all
        ax : Axes or None
        """
        return self.columns().plot("losses", only=only, ax=ax)


def break_down(
    losses: Losses, *, speed: ArrayLike, torque: ArrayLike, temperatures: Mapping[str, ArrayLike] | ArrayLike
) -> Breakdown:
    """Return the loss of every component at operating points.

    Parameters
    ----------
    losses : Losses
    speed, torque : ArrayLike, shape (...)
        Of the input shaft, [1/min] and [N m], signed
    temperatures : mapping of node name to ArrayLike, shape (...), or ArrayLike
        [degC]; without names all nodes have the same

    Raises
    ------
    InputError
        If a node is missing or unknown, or a value not plausible.
    """
    nodes = losses.temperature_nodes
    if not isinstance(temperatures, Mapping):
        temperatures = dict.fromkeys(nodes, temperatures)
    unknown = [name for name in temperatures if name not in nodes]
    if unknown:
        hint = did_you_mean(unknown[0], nodes)
        raise InputError(f"{unknown[0]!r} is not a temperature of the loss model{hint}")
    missing = [name for name in nodes if name not in temperatures]
    if missing:
        raise InputError(f"the temperatures of {', '.join(missing)} are missing; give them in degC")
    values: dict[str, ArrayLike] = {
        "speed": speed,
        "torque": torque,
        **{f"T_{name}": temperatures[name] for name in nodes},
    }
    common_shape(values)
    for name, value in values.items():
        quantity = quantity_of(name)
        if quantity is not None and (fault := implausible(quantity, value)):
            raise InputError(fault)
    columns = np.broadcast_arrays(*(np.asarray(temperatures[name], dtype=float) for name in nodes))
    power = losses.power(speed, torque, np.stack(columns, axis=-1))

    def plain(values: ArrayLike) -> Numeric:
        return np.asarray(values, dtype=float) if np.ndim(values) else float(values)  # type: ignore[arg-type]

    found = {name: plain(power[..., i]) for i, name in enumerate(losses.components)}
    return Breakdown(
        found | {TOTAL: plain(power.sum(axis=-1))}, speed=plain(speed), torque=plain(torque),
        temperatures=dict(zip(nodes, map(plain, columns), strict=True)),
    )  # fmt: skip
