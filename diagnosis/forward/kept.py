"""Results that many columns need of one trajectory: computed once, kept as long as that trajectory."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, TypeVar, TypeVarTuple
from weakref import WeakKeyDictionary

Model = TypeVar("Model")
Along = TypeVar("Along")
Kept = TypeVar("Kept")
Others = TypeVarTuple("Others")
_known: WeakKeyDictionary[Any, dict[tuple[Any, ...], Any]] = WeakKeyDictionary()


def kept(function: Callable[[Model, Along, *Others], Kept]) -> Callable[[Model, Along, *Others], Kept]:
    """A function of a model, a trajectory and further values that is computed once for each of them.

    Models and trajectories are compared by identity. The result must not hold the trajectory.
    """

    @wraps(function)
    def found(model: Model, trajectory: Along, *others: *Others) -> Kept:
        known, key = _known.setdefault(trajectory, {}), (function, model, *others)
        if key not in known:
            known[key] = function(model, trajectory, *others)
        result: Kept = known[key]
        return result

    return found
