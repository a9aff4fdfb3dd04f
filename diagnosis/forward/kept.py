"""Results that many columns need of one trajectory: computed once, kept as long as that trajectory."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

Kept = TypeVar("Kept")
Arguments = ParamSpec("Arguments")
_known: WeakKeyDictionary[Any, dict[tuple[Any, ...], Any]] = WeakKeyDictionary()


def kept(function: Callable[Arguments, Kept]) -> Callable[Arguments, Kept]:
    """A function of a model, a trajectory and further values that is computed once for each of them.

    Models and trajectories are compared by identity. The result must not hold the trajectory.
    """

    @wraps(function)
    def found(*args: Arguments.args, **more: Arguments.kwargs) -> Kept:
        model, trajectory, *others = args
        known, key = _known.setdefault(trajectory, {}), (function, model, *others)
        if key not in known:
            known[key] = function(*args, **more)
        result: Kept = known[key]
        return result

    return found
