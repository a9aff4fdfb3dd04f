"""Files that take time to make, kept for later runs in the user's cache folder.

``GEARBOX_TWIN_CACHE`` names another folder, or is ``off`` for none. Losing a file costs time and nothing else.
"""

from __future__ import annotations

import os
from pathlib import Path

from platformdirs import user_cache_path

from models.base.atomic_write import atomic_file
from models.base.errors import InputError
from models.base.version import DISTRIBUTION

CACHE_VARIABLE = "GEARBOX_TWIN_CACHE"


def cached_path(name: str) -> Path | None:
    """Where a file is kept; None if nothing is to be kept."""
    named = os.environ.get(CACHE_VARIABLE)
    if named == "off":
        return None
    return (Path(named) if named else user_cache_path(DISTRIBUTION, appauthor=False)) / name


def recall(path: Path | None) -> bytes | None:
    """Return the content of a kept file; None if there is none that can be read."""
    try:
        return None if path is None else path.read_bytes()
    except OSError:
        return None


def keep(path: Path | None, content: bytes) -> bool:
    """Keep a file; it appears whole, whoever else writes or reads it. False if it cannot be kept."""
    if path is None:
        return False
    try:
        with atomic_file(path) as file:
            file.write_bytes(content)
    except (InputError, OSError):
        return False
    return True
