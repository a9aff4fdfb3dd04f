"""Kinds of files, and whether a path is a file or a folder."""

from __future__ import annotations

from pathlib import Path

from models.base.errors import InputError

KINDS = (".csv", ".csv.gz", ".parquet")
EMPTY = "is empty; a header line with column names and rows are needed"
HINTS = {
    (".txt", ".asc", ".dat", ".tsv", ".tab", ".lvm", ".log"): "; rename a table of text to .csv",
    (".xlsx", ".xlsm", ".xls", ".ods"): "; save the sheet as CSV (UTF-8)",
}


def kind_of(path: Path, kinds: tuple[str, ...] = KINDS) -> str:
    """Return the ending of a file, one of `kinds`.

    Raises
    ------
    InputError
        If it is another one, or a folder.
    """
    if is_folder(path):
        raise InputError(f"{path}: is not a file but a folder; name a file in it ({', '.join(kinds)})")
    for kind in kinds:
        if path.name.lower().endswith(kind):
            return kind
    hint = next((text for endings, text in HINTS.items() if path.name.lower().endswith(endings)), "")
    raise InputError(f"{path}: unknown file ending; use one of {', '.join(kinds)}{hint}")


def is_folder(path: Path) -> bool:
    """Return True for a folder; False for names that no file can have (opening them reports that)."""
    try:
        return path.is_dir()
    except (OSError, ValueError):  # too long, or with NUL in it
        return False


def is_file(path: Path) -> bool:
    """Return True for a file; False for names that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def check_file(path: Path) -> None:
    """Refuse what is not a file, or is empty.

    Raises
    ------
    InputError
    """
    try:
        exists, file, folder = path.exists(), path.is_file(), path.is_dir()
        size = path.stat().st_size if file else 0
    except (OSError, ValueError) as error:  # a name that is too long, or holds NUL
        raise InputError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error})") from error
    if not exists:
        raise InputError(f"{path}: no such file")
    if not file:
        raise InputError(f"{path}: is not a file but {'a folder' if folder else 'a device or pipe'}")
    if size == 0:
        raise InputError(f"{path}: {EMPTY}")
