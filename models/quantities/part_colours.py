"""The table of colours: a part of a machine has one colour in every plot and every report.

Hues are those of Okabe and Ito's palette, which are distinct for people with any colour vision.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

AMBIENT = "#7F8C8D"
MEASURED, CALIBRATED, DELIVERED = "#3C4043", "#8A8F98", "#C4C8CE"  # readings, and models that are compared
# Beginning of a name, and the hue of all parts whose names begin so.
HUES: Mapping[str, str] = {
    "air": AMBIENT,
    "ambient": AMBIENT,
    "outdoor": AMBIENT,
    "nacelle": AMBIENT,
    "room": AMBIENT,
    "frame": "#8C6D46",
    "foundation": "#8C6D46",
    "housing": "#0072B2",
    "oil": "#E69F00",
    "churning": "#E69F00",
    "seal": "#5D4E8C",
    "bearing": "#009E73",
    "shaft": "#CC79A7",
    "pinion": "#D55E00",
    "wheel": "#F0A37A",
    "gear": "#D55E00",
    "mesh": "#8B1E1E",
    "sliding": "#8B1E1E",
    "rolling": "#C97064",
}
OTHER_HUES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#6B6B6B")
# Members of a large family run along a scale of even lightness.
SCALE = ("#440154", "#3B528B", "#21908C", "#4DB35E", "#B8A500")
MOST_SHADES = 5
DARKEST, LIGHTEST = -0.35, 0.45  # shares of black (negative) and of white in the shades of a family
SERIAL = re.compile(r"[_ ]*\d+$")


def part_colours(parts: Iterable[str]) -> dict[str, str]:
    """The colour of every part of a machine.

    Parameters
    ----------
    parts : iterable of str
        All parts of the machine, or all components of its loss, in the order of its network

    Returns
    -------
    dict of str to str
        Name to a colour as ``#RRGGBB``

    Examples
    --------
    >>> colours = part_colours(["oil", "bearing_1", "bearing_2", "T_belt"])
    >>> colours["oil"], colours["bearing_1"] != colours["bearing_2"]
    ('#E69F00', True)
    >>> list(part_colours(["L1", "L2"]).values())
    ['#0072B2', '#D55E00']
    """
    every = list(parts)
    # As long as there are hues, parts of unknown families have one each: L1 to L4 are not four shades of one.
    few = sum(_family(part) not in HUES for part in every) <= len(OTHER_HUES)
    families: dict[str, list[str]] = {}
    for part in every:
        family = _family(part)
        families.setdefault(part if few and family not in HUES else family, []).append(part)
    others = [family for family in families if family not in HUES]
    taken = {HUES[family] for family in families if family in HUES}
    free = sorted(OTHER_HUES, key=lambda hue: hue in taken)  # those that no known part has first
    hues = {**HUES, **{family: free[i % len(free)] for i, family in enumerate(others)}}
    return {
        part: colour
        for family, members in families.items()
        for part, colour in zip(members, _shades(hues[family], len(members)), strict=True)
    }


def _family(part: str) -> str:
    """The beginning of a name that the table has; else the name without its number."""
    return next((hue for hue in HUES if part.startswith(hue)), SERIAL.sub("", part))


def _shades(hue: str, count: int) -> list[str]:
    """As many colours of one family, from dark to light."""
    if count == 1:
        return [hue]
    steps = [i / (count - 1) for i in range(count)]
    if count > MOST_SHADES:
        return [_along_scale(step) for step in steps]
    return [_mixed(hue, DARKEST + step * (LIGHTEST - DARKEST)) for step in steps]


def _mixed(hue: str, share: float) -> str:
    """A colour with a share of white, or of black if it is negative."""
    end = 255.0 if share > 0.0 else 0.0
    return _hex([value + abs(share) * (end - value) for value in _rgb(hue)])


def _along_scale(step: float) -> str:
    at = step * (len(SCALE) - 1)
    low = min(int(at), len(SCALE) - 2)
    return _hex([a + (at - low) * (b - a) for a, b in zip(_rgb(SCALE[low]), _rgb(SCALE[low + 1]), strict=True)])


def _rgb(colour: str) -> list[float]:
    return [float(int(colour[i : i + 2], 16)) for i in (1, 3, 5)]


def _hex(values: Iterable[float]) -> str:
    return "#" + "".join(f"{round(value):02X}" for value in values)
