"""Progress of long work: one call that takes words and counts, wherever they are shown."""

from __future__ import annotations

from typing import Protocol


class Progress(Protocol):
    """Called at every step of long work, and as often as something of a step is done."""

    def __call__(self, what: str, done: int = 0, of: int = 0, /) -> None:
        """Take the step in words, and how many of how many are done; 0 of 0 where nothing is counted."""


def silent(_what: str, _done: int = 0, _of: int = 0, /) -> None:
    """Show nothing."""
