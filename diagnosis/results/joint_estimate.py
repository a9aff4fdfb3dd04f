"""The posterior of all parameters together, for programs that go on from a diagnosis."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from models.base.types import Array

DIGITS = 6  # last bits differ between processes, a file must not


@dataclass(frozen=True, kw_only=True, eq=False)
class JointEstimate:
    """Posterior of all unknowns of the model that predicts, as a normal distribution.

    Attributes
    ----------
    names, units : tuple of str
        Of the unknowns: parameters of the network, of sensors and inputs, and of the findings
    values, stderr : Array, shape (unknowns,)
        Posterior means and standard deviations, in those units
    correlation : Array, shape (unknowns, unknowns)
    """

    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    values: Array = field(default_factory=lambda: np.zeros(0))
    stderr: Array = field(default_factory=lambda: np.zeros(0))
    correlation: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def write(self, path: Path) -> None:
        """Write ``posterior.npz``: an array for each attribute, numbers with six digits."""
        arrays: dict[str, NDArray[np.generic]] = {
            "names": np.array(self.names, dtype=str), "units": np.array(self.units, dtype=str),
            "values": _rounded(self.values), "stderr": _rounded(self.stderr),
            "correlation": np.round(self.correlation, DIGITS),
        }  # fmt: skip
        with path.open("wb") as file:
            np.savez(file, allow_pickle=False, **arrays)


def _rounded(values: Array) -> Array:
    return np.array([float(f"{value:.{DIGITS}g}") for value in values.tolist()])
