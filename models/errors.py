"""The one exception for faulty input, and the helpers that make its text useful."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

LONGEST_SHOWN = 60


class InputError(ValueError):
    """What the user gave cannot be used; the message says what, where, which limit, and what to do.

    The command line prints the message and exits with status 2.
    """


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"`` for the nearest known name, or a list of what is known.

    Examples
    --------
    >>> did_you_mean("facewidth_mm", ["face_width_mm", "module_mm"])
    "; did you mean 'face_width_mm'?"
    >>> did_you_mean("qqq", ["b", "a"])
    '; known are: a, b'
    """
    names = sorted(known)
    close = get_close_matches(name, names, n=1)
    return f"; did you mean '{close[0]}'?" if close else f"; known are: {', '.join(names)}"


def shown(value: object) -> str:
    """Return a value as a message quotes it, shortened."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits, tables hundreds deep
        return "something too long to show"
    return text if len(text) <= LONGEST_SHOWN else f"{text[: LONGEST_SHOWN - 3]}..."
