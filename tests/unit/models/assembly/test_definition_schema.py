"""The JSON schema of definitions accepts what the program reads, refuses what it refuses, and explains every key."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from models.assembly import commented_definition as module
from models.assembly.commented_definition import commented_definition
from models.assembly.definition_schema import ROOTS, definition_schema, table_classes
from models.assembly.gearbox import known_gearboxes, load_gearbox, read_gearbox
from models.definition.definition_file import OIL_OF_SEAL
from models.definition.key_texts import TEXTS
from models.files.toml_file import packaged, read_text
from tests.unit.models.around_fzg import TABLES, around_fzg
from tests.unit.models.fzg_file import FZG

ROOT = Path(__file__).parents[4]
VALIDATOR = jsonschema.Draft7Validator(definition_schema())


def faults(text: str) -> list[str]:
    return [".".join(map(str, fault.absolute_path)) for fault in VALIDATOR.iter_errors(tomllib.loads(text))]


@pytest.mark.parametrize("name", known_gearboxes())
def test_the_machines_of_the_package_fit(name: str) -> None:
    VALIDATOR.check_schema(VALIDATOR.schema)
    assert faults(read_text(packaged("gearboxes", name))) == []


def test_an_example_fits() -> None:
    assert faults((ROOT / "examples/room.toml").read_text(encoding="utf-8")) == []


def test_a_geometry_with_its_surroundings_fits() -> None:
    assert faults(FZG + TABLES) == []
    assert "link.0" in faults(FZG + TABLES.replace("conductance_W_K = { value", "conductance = { value", 1))


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("face_width_mm = 14.0", "face_width_mm = 0.014", "stage.0.face_width_mm"),
        ("face_width_mm = 14.0", "facewidth_mm = 14.0", "stage.0"),
        ("module_mm = 4.5", "", "stage.0"),
        ('model = "arana"', 'model = "aranna"', "stage.0.friction.model"),
        ('like = "bearing_1"', "", "bearing.1"),
        ('designation = "NU 406"', "", "bearing.0"),
        ('named = "FZG_mineral_32"', "", "oil"),
        ('source = "the paper, Tables 1, 2, 4 and 5"', "", ""),
        ("mesh = { value = 1.0, sd", "mesh = { value = 1e4, sd", "factors.mesh"),
    ],
)
def test_a_fault_is_found_where_it_is(old: str, new: str, place: str) -> None:
    text = read_text(packaged("gearboxes", "fzg"))
    assert old in text
    assert place in faults(text.replace(old, new, 1))


@pytest.mark.parametrize(
    ("name", "more", "place"),
    [
        ("fzg", '[[loss]]\nname = "x"\npart = "oil"\nno_load_W = 1.0\nload_W = 1.0', "loss"),
        ("heated_rod", "[housing]\nheight_m = 0.2", "housing"),
        ("la_haute_borne", "[oil.gold]\ns = 1.0", "oil"),
        ("fzg", "[[stages]]\nz = [1, 2]", ""),
    ],
)
def test_a_table_of_the_other_kind_of_definition_is_a_fault(name: str, more: str, place: str) -> None:
    assert place in faults(f"{read_text(packaged('gearboxes', name))}\n{more}\n")


def test_editors_find_every_table_without_a_condition() -> None:
    """Even Better TOML completes and explains nothing that stands below "then" or "else" alone."""
    schema: dict[str, Any] = definition_schema()
    for root in ROOTS:
        assert set(schema["definitions"][root.__name__]["properties"]) <= set(schema["properties"])
    for table in schema["properties"].values():
        assert {"$ref", "type", "anyOf", "const"} & set(table)
    assert set(schema["properties"]["oil"]["properties"]) == set(schema["definitions"]["Oil"]["properties"])


def test_every_key_is_explained() -> None:
    """A key without a meaning would stand in the schema, the commented files and the reference without one."""
    tables: dict[str, Any] = definition_schema()["definitions"]
    for root in ROOTS:
        for name in table_classes(root).values():
            keys = set(tables[name]["properties"]) - {"source"}
            assert keys == set(TEXTS[name]), name
            assert all(tables[name]["properties"][key].get("description") for key in keys)


@pytest.mark.parametrize("like", known_gearboxes())
def test_a_commented_definition_is_the_machine_that_it_began_from(like: str) -> None:
    text = commented_definition(like, name="mine", file="mine.toml", schema="definition.schema.json")
    own, begun_from = read_gearbox(text, file="mine.toml"), load_gearbox(like)
    assert own.name == "mine"
    seals = {f"seal.{index}.{OIL_OF_SEAL}" for index in range(2)}  # left out: it follows the oil
    assert {**own.leaves, "name": ""} == {k: v for k, v in begun_from.leaves.items() if k not in seals} | {"name": ""}
    assert own.priors == begun_from.priors
    assert faults(text) == []
    assert text.startswith("#:schema definition.schema.json\n")


def test_a_commented_definition_keeps_and_explains_surroundings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "read_text", lambda _: FZG + TABLES)
    text = commented_definition("fzg", name="mine", file="mine.toml", schema="definition.schema.json")
    own, around = read_gearbox(text, file="mine.toml"), around_fzg()
    assert own.network().node_names == around.network().node_names and own.priors == around.priors
    assert [one.conductance_W_K for one in own.definition.link] == [12.0, 60.0, 15.0, 2.0]
    assert "# Heat by a law.\n[[heat]]\n# Name of the heat.\n" in text and "\n# gain = 1.0\n" in text


def test_a_default_that_a_comment_shows_can_be_uncommented() -> None:
    text = commented_definition("conveyor", name="mine", file="mine.toml", schema="x.json")
    assert "\n# K_rs = 3e-08\n" in text
    assert read_gearbox(text.replace("\n# K_rs = 3e-08\n", "\nK_rs = 6e-8\n"), file="mine.toml").bearing[0].K_rs == 6e-8
