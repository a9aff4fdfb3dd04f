"""Columns of tables under another name than the required one."""

from __future__ import annotations

import re
from collections.abc import Iterable
from difflib import SequenceMatcher, get_close_matches

KIND_WORDS = frozenset({"t", "temp", "temperature", "p", "power"})
UNIT_WORDS = frozenset({
    "deg", "degc", "c", "celsius", "k", "kelvin", "degf", "f", "w", "kw", "rpm", "nm", "m", "s", "ms", "mps", "km", "h",
    "kmh",
})  # fmt: skip
UNIT = re.compile(r"\s*[\[({][^\[({]*$")  # in brackets at the end of a name, known or not
SHORT_FOR = {"amb": "ambient", "tamb": "ambient", "tambient": "ambient"}


def meant(name: str, lacking: Iterable[str], *, near: float, near_stem: float = 1.0, with_kind: bool = False) -> str:
    """Return the missing column that a name probably means: nearly alike, or other words for it.

    Parameters
    ----------
    lacking : iterable of str
        Columns that are required and not there
    near, near_stem : float
        Likeness (0 to 1) of whole names, and of names without kind and unit, that makes one a slip of the other
    with_kind : bool
        True if other words count only together with a kind or a unit: a column called ``oil`` may be anything

    Returns
    -------
    str
        Empty if no name is similar

    Examples
    --------
    >>> meant("Temp_oil [K]", ["T_oil_degC", "T_ambient_degC"], near=0.9)
    'T_oil_degC'
    >>> meant("T_ambient [degX]", ["T_ambient_degC"], near=0.9)
    'T_ambient_degC'
    >>> meant("oil", ["T_oil_degC"], near=0.9), meant("oil", ["T_oil_degC"], near=0.9, with_kind=True)
    ('T_oil_degC', '')
    """
    by_small = {other.lower(): other for other in lacking}
    close = get_close_matches(name.lower(), by_small, n=1, cutoff=near)
    if close:
        return by_small[close[0]]
    if with_kind and not _words(name) & (KIND_WORDS | UNIT_WORDS):
        return ""
    return next((other for other in by_small.values() if _alike(_stem(name), _stem(other)) >= near_stem), "")


def _alike(a: str, b: str) -> float:
    return SequenceMatcher(None, a, b).ratio() if a and b else 0.0


def _words(name: str) -> frozenset[str]:
    return frozenset(re.split(r"[\W_]+", name.lower())) - {""}


def _stem(name: str) -> str:
    """Return a name without kind and unit: ``ambient`` of ``T_ambient``, ``Temp_amb_C`` and ``ambient_degC``."""
    return "".join(sorted(SHORT_FOR.get(word, word) for word in _words(UNIT.sub("", name)) - KIND_WORDS - UNIT_WORDS))
