"""The version of this program: of the checkout it runs from, else of the installed package."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import metadata
from pathlib import Path

DISTRIBUTION = "gearbox-thermal-twin"
CHECKOUT = Path(__file__).resolve().parents[1]


@cache
def project_version() -> str:
    """Return the version.

    Examples
    --------
    >>> project_version().count(".")
    2
    """
    project = CHECKOUT / "pyproject.toml"
    if project.is_file():
        return str(tomllib.loads(project.read_text(encoding="utf-8"))["project"]["version"])
    return metadata.version(DISTRIBUTION)


def license_text(distribution: str = DISTRIBUTION) -> str:
    """Return the licence of this program or of an installed distribution.

    Raises
    ------
    FileNotFoundError
        If it comes with none.
    """
    own = CHECKOUT / "LICENSE"
    if distribution == DISTRIBUTION and own.is_file():
        return own.read_text(encoding="utf-8")
    for file in metadata.files(distribution) or ():
        if file.name.upper().startswith("LICEN"):
            return file.read_text(encoding="utf-8")
    raise FileNotFoundError(f"{distribution} is installed without its licence")
