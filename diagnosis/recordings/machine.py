"""Interface of a machine to the reader of recordings; a thermal network and an FMU give it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from models.quantities.quantities import Input


class Named(Protocol):
    """Something with a name."""

    @property
    def name(self) -> str:
        """Its name."""


class RecordedMachine(Protocol):
    """A machine that recordings are made of.

    A recording may have measured its parts; for the usual mapping see :mod:`diagnosis.recordings.mapping`.
    """

    @property
    def inputs(self) -> Mapping[str, Input]:
        """Inputs by name."""

    @property
    def parts(self) -> Sequence[Named]:
        """Nodes with a heat capacity."""

    @property
    def recording(self) -> Mapping[str, Any]:
        """Usual mapping of recordings."""


@runtime_checkable
class MachineDefinition(Protocol):
    """A definition of such a machine, as a gearbox."""

    def network(self) -> RecordedMachine:
        """Return the machine."""


@dataclass(frozen=True)
class Part:
    """A node by its name."""

    name: str


@dataclass(frozen=True, kw_only=True)
class DescribedMachine:
    """A machine of which nothing else is known; see :class:`RecordedMachine`."""

    inputs: Mapping[str, Input]
    parts: tuple[Part, ...]
    recording: Mapping[str, Any]
