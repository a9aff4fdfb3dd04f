"""The version of this program: of the checkout it runs from, else of the installed package."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

DISTRIBUTION = "gearbox-thermal-twin"
CHECKOUT = Path(__file__).resolve().parents[2]


@cache
def project_version() -> str:
    """Return the version.

    Examples
    --------
    >>> project_version().count(".")
    2
    """
    project = _checkout()
    return str(project["version"]) if project else metadata.version(DISTRIBUTION)


def _checkout() -> dict[str, Any]:
    """Return the project table of the checkout; empty if installed, even if a foreign pyproject.toml lies there."""
    file = CHECKOUT / "pyproject.toml"
    project = tomllib.loads(file.read_text(encoding="utf-8")).get("project", {}) if file.is_file() else {}
    return project if project.get("name") == DISTRIBUTION else {}


def license_text(distribution: str = DISTRIBUTION) -> str:
    """Return the licence of this program or of an installed distribution.

    Raises
    ------
    FileNotFoundError
        If it comes with none.
    """
    if distribution == DISTRIBUTION and _checkout():
        return (CHECKOUT / "LICENSE").read_text(encoding="utf-8")
    for file in metadata.files(distribution) or ():
        if file.name.upper().startswith("LICEN"):
            return file.read_text(encoding="utf-8")
    raise FileNotFoundError(f"{distribution} is installed without its licence")
