"""TOML documents of users and of the package."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from models.base.errors import InputError, shown

ENDING = ".toml"


def known_names(folder: str) -> tuple[str, ...]:
    """Return the names of the documents in a folder of the package, in alphabetical order."""
    items = (files("models") / folder).iterdir()
    return tuple(sorted(item.name.removesuffix(ENDING) for item in items if item.name.endswith(ENDING)))


def packaged(folder: str, name: str) -> Traversable:
    """Return the document of a known name in a folder of the package."""
    return files("models") / folder / f"{name}{ENDING}"


def read_text(source: Path | Traversable) -> str:
    """Return the text of a document.

    Raises
    ------
    InputError
        If it cannot be read, or is not UTF-8.
    """
    try:
        return source.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        of_fmu = "; only simulate takes an FMU, before the cycle" if source.name.endswith(".fmu") else ""
        raise InputError(f"{source}: is not UTF-8 text (byte {error.start}); TOML must be{of_fmu}") from error
    except (OSError, ValueError) as error:
        raise InputError(f"{source}: cannot be read ({getattr(error, 'strerror', None) or error})") from error


def parse(text: str, *, file: str) -> dict[str, Any]:
    """Return a TOML document as nested tables, lists as tuples.

    Raises
    ------
    InputError
        If it is not TOML; the message names line and column.
    """
    try:
        document: dict[str, Any] = with_tuples(tomllib.loads(text))
        return document
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file}: is not valid TOML: {error}") from error


def with_tuples(node: Any) -> Any:
    """Return nested tables with their lists as tuples."""
    if isinstance(node, dict):
        return {key: with_tuples(item) for key, item in node.items()}
    return tuple(map(with_tuples, node)) if isinstance(node, list) else node


def parse_schema_1(text: str, *, file: str, kind: str) -> dict[str, Any]:
    """Return a TOML document of schema 1 as nested tables, the key ``schema`` included.

    Parameters
    ----------
    file : str
        Name of the file, for the message
    kind : str
        What the document holds, in the plural, for the message

    Raises
    ------
    InputError
        If it is not TOML, or of another schema.
    """
    document = parse(text, file=file)
    number = document.get("schema")
    if number != 1 or isinstance(number, bool):
        raise InputError(f"{file}: schema is {shown(number)}; this program reads {kind} of schema 1")
    return document


def names_a_file(name_or_path: str | Path) -> bool:
    """Return True if a definition file is named (by its ending or a folder), False for a gearbox of the package.

    Examples
    --------
    >>> names_a_file("fzg"), names_a_file("fzg.toml"), names_a_file("mine/fzg")
    (False, True, True)
    """
    path = Path(name_or_path)
    return not isinstance(name_or_path, str) or path.name != name_or_path or bool(path.suffix)
