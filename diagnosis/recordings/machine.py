"""A machine as the reader of recordings needs it: inputs, parts by name, and the usual mapping of its recordings.

A thermal network has them; of an FMU nothing else is known.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from models.quantities.quantities import Input

if TYPE_CHECKING:
    from models.simulation.thermal_network import ThermalNetwork

RecordedMachine: TypeAlias = "ThermalNetwork | DescribedMachine"


@dataclass(frozen=True)
class Part:
    """A node with a heat capacity, by its name."""

    name: str


@dataclass(frozen=True, kw_only=True)
class DescribedMachine:
    """A machine as its description has it; for the usual mapping see :mod:`diagnosis.recordings.mapping`."""

    inputs: Mapping[str, Input]
    parts: tuple[Part, ...]
    recording: Mapping[str, Any]
