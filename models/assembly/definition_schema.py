"""The JSON schema of a definition file, for editors that complete and check TOML; made from the classes that read it.

It knows what the reading does before validation: a value may be ``{ value = ..., sd = ..., source = "..." }``, every
table may have a ``source``, and ``like``, ``named`` and ``designation`` fill in what a table leaves out. Relations
between tables are left to the program.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from models.assembly.gearbox_definition import FACTORS, Definition
from models.definition.bearing_section import Bearing
from models.definition.definition_file import LIKE_KEYS
from models.definition.key_texts import TEXTS
from models.definition.known_bearings import FILLED, known_bearings
from models.definition.machine_definition import PART, STAGE
from models.definition.named_oils import known_oils
from models.definition.parametric_sections import ParametricDefinition
from models.definition.sections import Oil
from models.definition.values_with_source import join
from models.quantities.definition_units import unit_of

Schema = dict[str, Any]
DRAFT = "http://json-schema.org/draft-07/schema#"  # what TOML editors know
TITLE = "Definition of a machine for the gearbox thermal twin"
SOURCE = {"type": "string", "minLength": 1, "description": "Where the values come from"}
SD = {
    "description": "Standard deviation of what is uncertain: a number in the same unit, or a share as in '20 %'",
    "anyOf": [{"type": ["number", "string"]}, {"type": "array", "items": {}}],
}
SHARED = {"source": SOURCE, "sd": SD}
ROOTS = (Definition, ParametricDefinition)


def definition_schema() -> Schema:
    """Return the JSON schema of a definition, with geometry or without.

    Examples
    --------
    >>> schema = definition_schema()
    >>> schema["definitions"]["Stage"]["properties"]["face_width_mm"]["description"]
    'Common face width [mm]. Typically 10 to 200; 1 to 1000 is accepted.'
    """
    tables: dict[str, Schema] = {}
    for root in ROOTS:
        schema = root.model_json_schema(by_alias=True, ref_template="#/definitions/{model}")
        tables |= schema.pop("$defs")
        tables[root.__name__] = schema
    tables = {name: _table(name, table) for name, table in tables.items()}
    geometry, parametric = (tables[root.__name__] for root in ROOTS)
    keys = geometry["properties"] | parametric["properties"]
    differing = {
        key: _open_table(tables[geometry["properties"][key]["$ref"].rpartition("/")[2]])
        for key in geometry["properties"].keys() & parametric["properties"].keys()
        if geometry["properties"][key] != parametric["properties"][key]
    }
    return {
        "$schema": DRAFT,
        "title": TITLE,
        "type": "object",
        "additionalProperties": False,
        "properties": keys | differing,  # not below "then" alone, where Even Better TOML completes nothing
        "if": {"required": [PART], "not": {"required": [STAGE]}, "additionalProperties": True},
        "then": _kind(parametric, keys, differing),
        "else": _kind(geometry, keys, differing),
        "definitions": SHARED | tables,
    }


def _open_table(table: Schema) -> Schema:
    """A table for completion alone, of which the kind of definition decides what is needed."""
    return {"type": "object", "description": table["description"], "properties": table["properties"]}


def _kind(root: Schema, keys: Iterable[str], differing: Iterable[str]) -> Schema:
    """Keys that one kind of definition needs and must not have, and its tables that the other kind has otherwise."""
    own = root["properties"]
    return {
        "required": root["required"],
        "additionalProperties": True,
        "properties": {key: {"not": {}} for key in keys if key not in own}
        | {key: own[key] for key in sorted(differing)},
    }


def table_classes(root: type[Definition] | type[ParametricDefinition]) -> dict[str, str]:
    """Return the class of every table of a file by its dotted path; ``""`` is the file itself.

    Examples
    --------
    >>> table_classes(Definition)["stage.material"]
    'Material'
    """
    schema = root.model_json_schema(by_alias=True, ref_template="{model}")
    classes = {"": root.__name__}
    pending = [("", schema)]
    while pending:
        path, table = pending.pop()
        for key, item in table["properties"].items():
            if name := next((inner["$ref"] for inner in _tables_in(item) if "$ref" in inner), None):
                classes[join(path, key)] = name
                pending.append((join(path, key), schema["$defs"][name]))
    return classes


def _tables_in(schema: Any) -> Iterator[Mapping[str, Any]]:
    """Yield a schema and all that are nested in it."""
    if isinstance(schema, Mapping):
        yield schema
    inside = schema.values() if isinstance(schema, Mapping) else schema if isinstance(schema, list) else ()
    for item in inside:
        yield from _tables_in(item)


def key_line(table: str, key: str, limits: tuple[float, float] | None) -> str:
    """Return what a key means, with unit, typical and accepted range, in one line.

    Parameters
    ----------
    table : str
        Class of the table
    limits : (float, float) or None
        That it is checked against
    """
    text, symbol = TEXTS[table][key], unit_of(key).symbol
    unit = f" [{symbol}]" if symbol else ""
    typical = f"Typically {text.typical}" if text.typical else ""
    accepted = f"{limits[0]:g} to {limits[1]:g} is accepted" if limits else ""
    ranges = "; ".join(filter(None, (typical, accepted)))
    return f"{text.meaning}{unit}." + (f" {ranges[0].upper()}{ranges[1:]}." if ranges else "")


def limits_of(schema: Any) -> tuple[float, float] | None:
    """Return the limits of the numbers in the schema of a key, if all have the same."""
    found = {(one["minimum"], one["maximum"]) for one in _tables_in(schema) if {"minimum", "maximum"} <= one.keys()}
    return found.pop() if len(found) == 1 else None


def _table(name: str, table: Schema) -> Schema:
    """One table as a file may hold it."""
    keys = {key: _key(name, key, schema) for key, schema in table["properties"].items()}
    required = list(table.get("required", ()))
    made: Schema = {"type": "object", "additionalProperties": False, "description": table.get("description", "")}
    made["properties"] = keys | {"source": _ref("source")}
    if name in {root.__name__ for root in ROOTS}:
        return made | {"title": TITLE, "required": [*required, "source"]}
    if name.lower() in LIKE_KEYS:
        keys = keys | {"like": {"type": "string", "description": TEXTS[name]["like"].meaning}}
        made["properties"] = keys | {"source": _ref("source")}
    return made | {"title": f"[{name}]"} | _requirement(name, required)


def _requirement(name: str, required: list[str]) -> Schema:
    """Keys that a table needs, and what may stand in their place."""
    if name == Oil.__name__:
        own = [key for key in ("level_below_axis_mm", "volume_l") if key in required]
        return {"required": own, "anyOf": [{"required": ["named"]}, {"required": required}]}
    if name == Bearing.__name__:
        known = [key for key in required if key not in FILLED]
        return {"anyOf": [{"required": ["name", "like"]}, {"required": known}]}
    if name.lower() in LIKE_KEYS:
        return {"anyOf": [{"required": ["name", "like"]}, {"required": required}]}
    return {"required": required}


def _key(table: str, key: str, schema: Schema) -> Schema:
    """One key: its plain value, or that with its standard deviation and source."""
    plain: Schema = _draft_7({name: item for name, item in schema.items() if name not in ("title", "default")})
    told: Schema = {"title": key, "description": key_line(table, key, limits_of(schema))}
    if schema.get("default") not in (None, []):
        told["default"] = schema["default"]
    if table == Oil.__name__ and key == "named":
        plain = {"enum": list(known_oils())}
    if table == Bearing.__name__ and key == "designation":
        told["examples"] = list(known_bearings())
    is_table = any("$ref" in one or one.get("type") == "object" for one in _tables_in(schema))
    if key != "factors" and (is_table or key in ("schema", "recording")):
        return told | plain
    if key == "factors":
        factor = _annotated(plain["additionalProperties"])
        names = dict.fromkeys(FACTORS, factor)
        return told | {"type": "object", "additionalProperties": factor,
                       "properties": names | {"source": _ref("source")}}  # fmt: skip
    return told | _annotated(plain)


def _annotated(plain: Schema) -> Schema:
    """A value, or a table of it with its standard deviation and source."""
    parts = {"value": plain, "sd": _ref("sd"), "source": _ref("source")}
    table = {"type": "object", "properties": parts, "required": ["value"], "additionalProperties": False}
    return {"anyOf": [plain, table]}


def _ref(name: str) -> Schema:
    return {"$ref": f"#/definitions/{name}"}


def _draft_7(schema: Any) -> Any:
    """A schema without ``null``, which TOML has not, and with lists as draft 7 writes them."""
    if isinstance(schema, list):
        return [_draft_7(item) for item in schema if item != {"type": "null"}]
    if not isinstance(schema, Mapping):
        return schema
    if len(kinds := [item for item in schema.get("anyOf", ()) if item != {"type": "null"}]) == 1:
        return _draft_7({name: item for name, item in schema.items() if name != "anyOf"} | kinds[0])
    return {"items" if name == "prefixItems" else name: _draft_7(item) for name, item in schema.items()}
