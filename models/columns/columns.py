"""Columns with one row per moment or operating point, as files have them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from models.base.types import Array

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

What = Literal["temperatures", "losses"]
MOST_NAMED = 4  # columns in a repr


class Columns(dict[str, Array]):
    """Columns by their names in files, units included; a dict.

    Arrays have shape (rows,), or (variants, rows) where parameters were arrays.

    Examples
    --------
    >>> columns = Columns(time_s=np.array([0.0, 60.0]), T_oil_degC=np.array([20.0, 21.5]))
    >>> columns
    <Columns: 2 rows of time_s, T_oil_degC>
    >>> columns.to_dataframe()
       time_s  T_oil_degC
    0     0.0        20.0
    1    60.0        21.5
    """

    def __repr__(self) -> str:
        rows = np.broadcast_shapes(*(np.shape(values) for values in self.values())) if self else (0,)
        names = list(self)
        more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
        return f"<Columns: {' x '.join(map(str, rows or (1,)))} rows of {', '.join(names[:MOST_NAMED])}{more}>"

    def __or__(self, other: Mapping[str, Array]) -> Columns:  # type: ignore[override]
        return Columns({**self, **other})

    def to_dataframe(self) -> pd.DataFrame:
        """Return the columns as a data frame; several variants below each other, with a first column ``variant``."""
        import pandas as pd

        shape = np.broadcast_shapes((1,), *(np.shape(values) for values in self.values())) if self else (0,)
        table = {name: np.broadcast_to(values, shape).ravel() for name, values in self.items()}
        if len(shape) > 1:
            table = {"variant": np.repeat(np.arange(shape[0]), shape[1]), **table}
        return pd.DataFrame(table)

    def plot(
        self,
        what: What = "temperatures",
        *,
        only: Sequence[str] = (),
        ax: Axes | None = None,
    ) -> Axes:
        """Draw temperatures or losses over time, or over the first column that changes where there is no time.

        Parameters
        ----------
        what : str
            ``temperatures`` or ``losses``
        only : sequence of str
            Names of nodes or losses; by default all. Losses with numbered names are one curve
        ax : Axes or None
            By default new ones

        Returns
        -------
        Axes

        Raises
        ------
        InputError
            If there is nothing to draw.
        """
        from models.columns.curves import draw_columns  # imports matplotlib

        return draw_columns(self, what, only=only, ax=ax)
