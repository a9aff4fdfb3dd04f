"""The FZG file with faults."""

from __future__ import annotations

from models.files.toml_file import packaged, read_text

FZG = read_text(packaged("gearboxes", "fzg"))


def edited(*changes: tuple[str, str]) -> str:
    """Return the FZG file with texts exchanged (their first occurrence)."""
    text = FZG
    for old, new in changes:
        assert old in text, f"the FZG file has no {old!r}"
        text = text.replace(old, new, 1)
    return text
