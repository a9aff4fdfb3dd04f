"""Results that many columns need of one trajectory: computed once, kept as long as that trajectory."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

Kept = TypeVar("Kept")
_known: WeakKeyDictionary[Any, dict[tuple[Any, str], Any]] = WeakKeyDictionary()


def kept(model: object, trajectory: object, name: str, found: Callable[[], Kept]) -> Kept:
    """The result of `found`, computed at the first call with this trajectory of a model.

    Parameters
    ----------
    model, trajectory : object
        Compared by identity
    name : str
        Of the result
    found : callable
        Computes the result, which must not hold the trajectory
    """
    known = _known.setdefault(trajectory, {})
    if (model, name) not in known:
        known[model, name] = found()
    result: Kept = known[model, name]
    return result
