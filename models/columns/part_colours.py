"""The colour of every part, the same in all plots: by its name alone, so that plots need not know of each other.

Okabe and Ito's palette with wine and two neutrals: distinct for people with any colour vision. Parts of one kind share
a colour and differ in their line.
"""

from __future__ import annotations

from collections.abc import Iterable
from zlib import crc32

PALETTE = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#882255")
NEUTRAL, SEALS, TOTAL_COLOUR = "#6B6B6B", "#8C6D31", "#000000"
LINES: tuple[str | tuple[int, tuple[int, ...]], ...] = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3)))
TOTAL = "total"
# First word of a name that decides; losses have the colour of the part that they warm.
WORDS = {
    "oil": PALETTE[4], "churning": PALETTE[4],
    "mesh": PALETTE[1],
    "pinion": PALETTE[3],
    "wheel": PALETTE[6], "gear": PALETTE[6], "gears": PALETTE[6],
    "bearing": PALETTE[2], "bearings": PALETTE[2],
    "shaft": PALETTE[5], "shafts": PALETTE[5],
    "housing": PALETTE[0], "casing": PALETTE[0], "base": PALETTE[0], "body": PALETTE[0], "cover": PALETTE[0],
    "seal": SEALS, "seals": SEALS,
    "air": NEUTRAL, "frame": NEUTRAL, "outdoor": NEUTRAL, "ambient": NEUTRAL, "room": NEUTRAL, "floor": NEUTRAL,
    TOTAL: TOTAL_COLOUR,
}  # fmt: skip
# Place in LINES of words that come in pairs, or that share a colour in one machine.
SECOND = {
    "upper": 1, "rolling": 1, "far": 1, "no": 1, "inlet": 1, "body": 1, "frame": 1, "outdoor": 2, "air": 3, "cover": 2,
    "floor": 2, "seal": 0,
}  # fmt: skip


def part_colour(name: str) -> str:
    """Return the colour of a part, a loss, or a sensor ``<part>__<sensor>``, as ``#RRGGBB``.

    Examples
    --------
    >>> part_colour("bearing_1") == part_colour("bearing_4"), part_colour("oil"), part_colour("total")
    (True, '#E69F00', '#000000')
    """
    words = name.partition("__")[0].split("_")
    known = next((WORDS[word] for word in words if word in WORDS), None)
    if known is not None:
        return known
    number = _number(words)
    return PALETTE[(crc32(name.encode()) if number is None else number - 1) % len(PALETTE)]


def part_looks(names: Iterable[str]) -> dict[str, tuple[str, str | tuple[int, tuple[int, ...]]]]:
    """Return colour and line of parts that are drawn together; no two have both in common while lines last.

    Examples
    --------
    >>> part_looks(["mesh", "bearing_1", "bearing_2"])
    {'mesh': ('#D55E00', '-'), 'bearing_1': ('#009E73', '-'), 'bearing_2': ('#009E73', '--')}
    """
    looks: dict[str, tuple[str, str | tuple[int, tuple[int, ...]]]] = {}
    for name in names:
        colour, first = part_colour(name), _line(name)
        order = (LINES[(first + step) % len(LINES)] for step in range(len(LINES)))
        taken = set(looks.values())
        looks[name] = (colour, next((line for line in order if (colour, line) not in taken), LINES[first]))
    return looks


def _line(name: str) -> int:
    words = name.partition("__")[0].split("_")
    number = _number(words)
    if number is None:
        return sum(SECOND.get(word, 0) for word in words) % len(LINES)
    known = any(word in WORDS for word in words)
    return (number - 1 if known else (number - 1) // len(PALETTE)) % len(LINES)


def _number(words: list[str]) -> int | None:
    return next((int(word) for word in reversed(words) if word.isdecimal() and int(word) > 0), None)
