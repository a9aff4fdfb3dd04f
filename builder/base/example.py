"""One example in the help of every verb."""

from __future__ import annotations

PROGRAM = "python -m builder"


def example(*commands: str) -> str:
    r"""Return the last lines of a verb's help: commands as they are typed, without the program's name.

    Examples
    --------
    >>> example("check mine.toml")
    '\x08\nExample:\n  python -m builder check mine.toml'
    """
    word = "Example" if len(commands) == 1 else "Examples"
    return "\n".join(["\b", f"{word}:", *(f"  {PROGRAM} {command}" for command in commands)])
