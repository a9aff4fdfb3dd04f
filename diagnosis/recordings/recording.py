"""A recording: the inputs of a gearbox and what was measured in it over time."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from diagnosis.recordings.time_axis import Clock
from models.base.types import Array
from models.columns.columns import Columns, What
from models.files.cycle import Cycle
from models.quantities.quantities import column_of, is_total_loss

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


@dataclass(frozen=True, kw_only=True, eq=False)
class Channel:
    """One measured quantity.

    Attributes
    ----------
    name : str
        The node, or ``P_loss`` for the total loss
    values : Array, shape (rows,)
        [degC] or [W]; NaN where missing
    noise : float or None
        White standard deviation of one row as its mapping file states it, [K] or [W]
    resolution : float
        Quantum of the values as stated, else as found in them, [K] or [W]; 0 if there is none
    lag_s : float or None
        Time constant of the sensor as stated, [s]
    lag_sd_s : float or None
        Its uncertainty as stated, [s]
    bias_sd : float or None
        Tolerance of the sensor as stated, [K] or [W]
    gain_sd : float or None
        Relative tolerance of its scale as stated
    column : str
        Name in the file
    """

    name: str
    values: Array
    noise: float | None = None
    resolution: float = 0.0
    lag_s: float | None = None
    lag_sd_s: float | None = None
    bias_sd: float | None = None
    gain_sd: float | None = None
    column: str = ""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Recording:
    """Inputs and measurements of one gearbox over time.

    Attributes
    ----------
    name : str
        Of its file; different for recordings that are read together
    path : Path
        Its file, for messages; names joined by ``+`` if there are several
    files : tuple of Path
        In the order of time
    sha256 : str
        Of the file; of the hashes of several; empty if it is of no file
    time : Array, shape (rows,)
        Since the recording's first row, [s], strictly increasing
    start : datetime or None
        Of the first row, if the file has dates
    from_s : float
        First row in the file's own time, [s], dates since 1970
    clock : Clock or None
        The file's time column
    rows : array of int, shape (rows,)
        Numbers of the rows in the file, counted from 1 and through all files
    inputs : mapping of signal to Array, shape (rows,)
        Every input of the network; free of NaN
    channels : tuple of Channel
    segments : tuple of slice
        Gap-free pieces
    tolerances : mapping of str to float
        Of inputs, as stated: T_ambient [K], torque relative to its scale
    assumed : tuple of str
        Inputs that were not recorded; they have the value of the definition
    notes : tuple of str
        What was cleaned or assumed
    session : str
        Test session as its mapping file states it; empty if it does not
    parts : tuple of str
        Nodes of the machine, measured or not
    """

    name: str
    path: Path
    files: tuple[Path, ...] = ()
    sha256: str = ""
    time: Array
    start: datetime | None = None
    from_s: float = 0.0
    clock: Clock | None = None
    rows: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    inputs: Mapping[str, Array]
    channels: tuple[Channel, ...]
    segments: tuple[slice, ...]
    tolerances: Mapping[str, float] = field(default_factory=dict)
    assumed: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    session: str = ""
    parts: tuple[str, ...] = ()

    def __repr__(self) -> str:
        begin = "" if self.start is None else f" from {self.start:%Y-%m-%d %H:%M} UTC"
        rows = f"{len(self.time)} rows over {self.time[-1] / 3600.0:.1f} h{begin}"
        return f"<Recording {self.name!r}: {rows}; {', '.join(c.name for c in self.channels)}>"

    @cached_property
    def hash(self) -> str:
        """SHA-256 of its file, the same for all parts of it; of its values if it is of no file."""
        if self.sha256:
            return self.sha256
        columns = {"time": self.time, **self.inputs, **{f"T_{c.name}": c.values for c in self.channels}}
        digest = hashlib.sha256()
        for name, values in sorted(columns.items()):
            digest.update(name.encode() + np.ascontiguousarray(values, dtype=float).tobytes())
        return digest.hexdigest()

    @property
    def to_s(self) -> float:
        """Last row in the file's own time, [s]."""
        return self.from_s + float(self.time[-1])

    @property
    def cycle(self) -> Cycle:
        """The inputs, to simulate with."""
        return Cycle(self.time, self.inputs)

    def columns(self) -> Columns:
        """Return inputs and measurements by the names of columns in files; NaN where missing."""
        return self.cycle.columns() | {
            column_of(c.name if is_total_loss(c.name) else f"T_{c.name}"): c.values for c in self.channels
        }

    def to_dataframe(self) -> pd.DataFrame:
        """Return :meth:`columns` as a data frame; its index is the time (UTC) if the file has dates."""
        table = self.columns().to_dataframe()
        if self.start is not None:
            import pandas as pd

            table.index = pd.DatetimeIndex(self.start + pd.to_timedelta(self.time, unit="s"), name="time")
        return table

    def plot(self, what: What = "temperatures", *, only: Sequence[str] = (), ax: Axes | None = None) -> Axes:
        """Draw the measured temperatures, or the total loss, over time; see :meth:`Columns.plot`."""
        from models.columns.curves import draw_columns  # imports matplotlib

        return draw_columns(self.columns(), what, only=only, ax=ax, parts=self.parts if what == "temperatures" else ())
