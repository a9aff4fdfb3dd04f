"""Results kept with a trajectory."""

from __future__ import annotations

import gc

from diagnosis.forward import kept as module
from diagnosis.forward.kept import kept


class Thing:
    """Compared by identity."""


def test_is_computed_once_for_each_model_trajectory_and_value() -> None:
    calls: list[str] = []

    @kept
    def count(_: Thing, __: Thing, name: str) -> int:
        calls.append(name)
        return len(calls)

    @kept
    def another(_: Thing, __: Thing, name: str) -> str:
        return name

    model, trajectory, other = Thing(), Thing(), Thing()
    assert [count(model, trajectory, "a") for _ in range(3)] == [1, 1, 1]
    assert count(model, trajectory, "b") == 2
    assert count(other, trajectory, "a") == 3
    assert count(model, other, "a") == 4
    assert another(model, trajectory, "a") == "a"


def test_goes_with_its_trajectory() -> None:
    trajectory = Thing()
    gc.collect()
    before = len(module._known)
    kept(lambda _, __: 1)(Thing(), trajectory)
    assert len(module._known) == before + 1
    del trajectory
    gc.collect()
    assert len(module._known) == before
