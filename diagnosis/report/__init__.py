"""A diagnosis as a page for people: self-contained, on any screen and on paper."""

from __future__ import annotations

from pathlib import Path

from diagnosis.report.page import page
from diagnosis.results.result import Diagnosis
from models.base.atomic_write import atomic_file

__all__ = ["page", "write_report"]


def write_report(diagnosis: Diagnosis, path: str | Path) -> None:
    """Write a diagnosis as one HTML file.

    Parameters
    ----------
    path : str or Path
        The file appears whole or not at all

    Raises
    ------
    InputError
        If it cannot be written.
    """
    text = page(diagnosis)
    with atomic_file(Path(path)) as partial:
        partial.write_text(text, encoding="utf-8", newline="\n")
