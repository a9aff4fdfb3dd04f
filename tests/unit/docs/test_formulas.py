"""The page of formulas: each of them has an example with its number, which the doctests check."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[3] / "docs/reference/formulas.md").read_text(encoding="utf-8")
DIRECTIVE = re.compile(r"^\.\. (currentmodule|autofunction|autoclass):: (\S+)(?:\n   :members: (\w+))?", re.MULTILINE)


def formulas() -> list[object]:
    """What the page shows."""
    module, found = "", list[object]()
    for kind, name, member in DIRECTIVE.findall(PAGE):
        if kind == "currentmodule":
            module = name
        else:
            one = getattr(import_module(module), name)
            found.append(getattr(one, member) if member else one)
    return found


@pytest.mark.parametrize("formula", formulas(), ids=lambda one: one.__qualname__)
def test_a_formula_has_an_example(formula: object) -> None:
    assert ">>> " in (formula.__doc__ or "")


def test_the_page_has_formulas_of_every_loss() -> None:
    modules = {getattr(one, "__module__", "") for one in formulas()}
    assert len(formulas()) > 50
    assert {f"models.losses.{name}" for name in ("friction", "churning", "bearing", "seal", "shaft_loads")} <= modules
