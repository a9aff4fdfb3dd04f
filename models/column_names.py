"""Columns of tables under another name than the one that is asked for."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import get_close_matches

KIND_WORDS = frozenset({"t", "temp", "temperature", "p", "power"})
UNIT_WORDS = frozenset({
    "deg", "degc", "c", "celsius", "k", "kelvin", "degf", "f", "w", "kw", "rpm", "nm", "m", "s", "ms", "mps", "km", "h",
    "kmh",
})  # fmt: skip
SHORT_FOR = {"amb": "ambient", "tamb": "ambient", "tambient": "ambient"}


def meant(name: str, lacking: Iterable[str], *, near: float) -> str:
    """The missing column that a name stands for by all appearance: nearly alike, or the same in other words.

    A word alone, as ``oil``, may be anything; with a kind or a unit, or a second word, it is told well enough.

    Parameters
    ----------
    name : str
    lacking : iterable of str
        Columns that are asked for and not there
    near : float
        Likeness of the whole names (0 to 1) that makes one a slip of the other

    Returns
    -------
    str
        Empty if there is none

    Examples
    --------
    >>> meant("Temp_oil [K]", ["T_oil_degC", "T_ambient_degC"], near=0.9)
    'T_oil_degC'
    >>> meant("oil", ["T_oil_degC"], near=0.9)
    ''
    """
    by_small = {other.lower(): other for other in lacking}
    close = get_close_matches(name.lower(), by_small, n=1, cutoff=near)
    if close:
        return by_small[close[0]]
    if len(_words(name)) < 2:
        return ""
    return next((other for other in by_small.values() if _stem(name) and _stem(name) == _stem(other)), "")


def _words(name: str) -> list[str]:
    return [word for word in re.split(r"[\W_]+", name.lower()) if word]


def _stem(name: str) -> str:
    """What a name says beside kind and unit: ``ambient`` of ``T_ambient``, ``Temp_amb_C`` and ``ambient_degC``."""
    return "".join(SHORT_FOR.get(word, word) for word in _words(name) if word not in KIND_WORDS | UNIT_WORDS)
