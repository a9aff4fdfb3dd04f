"""Results kept with a trajectory."""

from __future__ import annotations

import gc
from collections.abc import Callable

from diagnosis.forward import kept as module
from diagnosis.forward.kept import kept


class Thing:
    """Compared by identity."""


def found(calls: list[int]) -> Callable[[], int]:
    """Counts its calls, and gives their number."""

    def count() -> int:
        calls.append(1)
        return len(calls)

    return count


def test_is_computed_once_for_each_model_trajectory_and_name() -> None:
    calls: list[int] = []
    model, trajectory, other = Thing(), Thing(), Thing()
    assert [kept(model, trajectory, "a", found(calls)) for _ in range(3)] == [1, 1, 1]
    assert kept(model, trajectory, "b", found(calls)) == 2
    assert kept(other, trajectory, "a", found(calls)) == 3
    assert kept(model, other, "a", found(calls)) == 4


def test_goes_with_its_trajectory() -> None:
    trajectory = Thing()
    gc.collect()
    before = len(module._known)
    kept(Thing(), trajectory, "a", lambda: 1)
    assert len(module._known) == before + 1
    del trajectory
    gc.collect()
    assert len(module._known) == before
