"""Our own numbers of last time; ``tests/golden/regenerate.py`` says when and how they are written."""

from __future__ import annotations

import json
from typing import Any

import pytest

from tests.golden.regenerate import FILE, golden

KEPT: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def now() -> dict[str, Any]:
    return golden()


@pytest.mark.parametrize("part", ["losses_W", "cycle", "heat_J"])
def test_nothing_moved(now: dict[str, Any], part: str) -> None:
    assert set(now[part]) == set(KEPT[part])
    for name, values in KEPT[part].items():
        assert now[part][name] == pytest.approx(values, rel=1e-9, abs=1e-9), name


def test_same_points(now: dict[str, Any]) -> None:
    assert now["points"] == KEPT["points"]
