"""The one exception for faulty input, and what makes its text useful."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

SHORTEST_PART = 3  # letters of a part of a name
LONGEST_SHOWN = 60


class InputError(ValueError):
    """Error in the user's input; the message names the input, its place, the limit, and what to do.

    The command line prints the message and exits with status 2.
    """


class Problems:
    """Problems of one file, collected so that one error lists all of them.

    Parameters
    ----------
    file : str or Path
        Name of the file, the start of every line

    Examples
    --------
    >>> problems = Problems("run.csv")
    >>> problems.stop_if_any()
    >>> problems.add("column time_s is missing")
    >>> problems.stop_if_any()
    Traceback (most recent call last):
    models.base.errors.InputError: run.csv: column time_s is missing
    """

    def __init__(self, file: str | Path) -> None:
        self.file = file
        self._texts: list[str] = []

    def __bool__(self) -> bool:
        return bool(self._texts)

    def add(self, text: str) -> None:
        """Collect a problem."""
        self._texts.append(text)

    def stop_if_any(self) -> None:
        """Raise all problems as one error.

        Raises
        ------
        InputError
            One line per problem.
        """
        if self._texts:
            raise InputError("\n".join(f"{self.file}: {text}" for text in dict.fromkeys(self._texts)))


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"`` for the nearest known name or those that hold it, or a list of what is known.

    Examples
    --------
    >>> did_you_mean("facewidth_mm", ["face_width_mm", "module_mm"])
    "; did you mean 'face_width_mm'?"
    >>> did_you_mean("fan", ["fan_thermostat", "windage"])
    "; did you mean 'fan_thermostat'?"
    >>> did_you_mean("qqq", ["b", "a"])
    '; known are: a, b'
    """
    names = sorted(known)
    close = get_close_matches(name, names, n=1)
    if not close and len(name) >= SHORTEST_PART:
        close = [known for known in names if name in known]
    return f"; did you mean {' or '.join(map(repr, close))}?" if close else f"; known are: {', '.join(names)}"


def shown(value: object) -> str:
    """Return a value as a message quotes it, shortened."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits, tables hundreds deep
        return "something too long to show"
    return text if len(text) <= LONGEST_SHOWN else f"{text[: LONGEST_SHOWN - 3]}..."
