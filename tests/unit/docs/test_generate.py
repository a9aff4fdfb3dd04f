"""Pages that are made from the program."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType

import pytest

from models.mechanisms import CATALOGUE

DOCS = Path(__file__).resolve().parents[3] / "docs"


@pytest.fixture(scope="module")
def generate() -> ModuleType:
    pytest.importorskip("sphinx")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", [str(DOCS), *sys.path])
        return importlib.import_module("_generate")


def test_a_key_has_its_unit_limits_default_and_an_example(generate: ModuleType) -> None:
    rows = "\n".join(generate.definition()).splitlines()
    (row,) = (row for row in rows if row.startswith("| `pressure_angle_deg`"))
    assert "number, deg" in row
    assert "10 to 35" in row
    assert "needed" in row
    assert row.endswith("| `20` |")
    (row,) = (row for row in rows if row.startswith("| `convection`"))
    assert "one of `iso_14179`, `flat_plate`" in row


def test_every_mechanism_has_an_entry_that_others_can_link_to(generate: ModuleType) -> None:
    page = "\n".join(generate.mechanisms())
    for name in CATALOGUE:
        assert f"(mechanism-{name.replace('_', '-')})=\n### `{name}`" in page


def test_a_bar_does_not_end_a_cell(generate: ModuleType) -> None:
    assert list(generate._table(("a", "b"), [("x|y", "")])) == ["| a |", "| --- |", r"| x\|y |", ""]


def test_tables_of_both_kinds_of_definition_are_written_once(generate: ModuleType) -> None:
    kinds = (generate.definition, generate.definition_of_both, generate.definition_without_geometry)
    titles = [[line for line in kind() if line.startswith("### ")] for kind in kinds]
    assert "### `[[link]]`" in titles[1] and "### `[[stage]]`" in titles[0] and "### `[[loss]]`" in titles[2]
    assert set(titles[1]) & {*titles[0], *titles[2]} == {"### At the top of the file"}
    assert any(line.startswith("| `factors` |") for line in generate.definition())
    assert any(line.startswith("| `schema` |") for line in generate.definition_of_both())


@pytest.mark.parametrize("name", ["correction", "mapping", "network", "oils", "bearings", "variables"])
def test_pages_are_not_empty(generate: ModuleType, name: str) -> None:
    assert len("\n".join(generate.GENERATORS[name]())) > 100
