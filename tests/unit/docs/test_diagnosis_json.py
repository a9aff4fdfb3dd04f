"""The page about ``diagnosis.json`` names every key that the file has."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.unit.diagnosis.diagnosis_example import missing_physics

PAGE = Path(__file__).resolve().parents[3] / "docs" / "reference" / "diagnosis_json.md"
BY_NAME = ("sensors", "recordings", "kinds", "evidence", "inputs")  # keys: channels, recordings, kinds, classes, files


def keys(node: Any) -> set[str]:
    if isinstance(node, list):
        return {key for item in node for key in keys(item)}
    if not isinstance(node, dict):
        return set()
    return set(node) | {key for name, item in node.items() if name not in BY_NAME for key in keys(item)}


def test_every_key_is_on_the_page() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert {
        key for key in keys(missing_physics().to_dict()) if f"`{key}" not in page and f".{key}`" not in page
    } == set()
