"""Data of an FMU about the recordings of its machine: the inputs that they must have, and their usual mapping."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from models.network.structure import Network

FILE = "resources/recording.json"


@dataclass(frozen=True, kw_only=True)
class RecordedColumns:
    """Inputs that a recording must have, the table ``[recording]`` of the definition, and the hash of its values.

    The hash is empty for an FMU of an earlier version.
    """

    required: tuple[str, ...]
    mapping: Mapping[str, Any]
    definition: str = ""


def recorded_file(network: Network, definition: str) -> dict[str, bytes]:
    """Return the file of an FMU about the recordings of its network, by path in the archive.

    `definition` is the hash of the definition's values.
    """
    content = {
        "required": [name for name, given in network.inputs.items() if given.required],
        "mapping": network.recording,
        "definition": definition,
    }
    return {FILE: json.dumps(content, indent=1, default=str).encode()}


def recorded_columns(path: Path) -> RecordedColumns:
    """Read that file from an FMU; an FMU without it requires no input and has no mapping."""
    with ZipFile(path) as archive:
        if FILE not in archive.namelist():
            return RecordedColumns(required=(), mapping={})
        content = json.loads(archive.read(FILE))
    return RecordedColumns(
        required=tuple(content["required"]), mapping=content["mapping"], definition=content.get("definition", "")
    )
