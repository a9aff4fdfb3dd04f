"""A diagnosis as a page for people: self-contained, on any screen and on paper."""

from __future__ import annotations

from pathlib import Path

from diagnosis.report.page import page
from diagnosis.result import Diagnosis
from models.errors import InputError

__all__ = ["page", "write_report"]


def write_report(diagnosis: Diagnosis, path: str | Path) -> None:
    """Write a diagnosis as one HTML file.

    Parameters
    ----------
    diagnosis : Diagnosis
    path : str or Path
        The file appears whole or not at all; its folder must be there

    Raises
    ------
    InputError
        If it cannot be written.
    """
    path = Path(path)
    partial = path.with_name(f".{path.name}.partial")
    text = page(diagnosis)
    try:
        partial.write_text(text, encoding="utf-8", newline="\n")
        partial.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another output") from error
    finally:
        partial.unlink(missing_ok=True)
