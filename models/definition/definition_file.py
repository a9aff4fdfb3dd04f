"""From the text of a gearbox definition to its plain values, filled up, with their annotations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypeVar

from models.base.errors import InputError, did_you_mean, shown
from models.definition.bearing_section import OF_TYPE
from models.definition.known_bearings import FILLED, filled_by_designation
from models.definition.messages import place_in
from models.definition.named_oils import read_oil
from models.definition.nested_values import with_value
from models.definition.sections import Fluid
from models.definition.values_with_source import Annotations, strip
from models.files.toml_file import parse_schema_1

T = TypeVar("T")

OIL_OF_SEAL = "nu_40_mm2_s"  # grade of the oil in a seal's law; by default that of the oil
LIKE_KEYS = ("bearing", "seal")  # tables that may have ``like = "<name of an earlier one>"`` and only what differs
# Giving one of these in a gearbox file also replaces the other in the named oil.
ALTERNATIVES = {"viscosity_points": "d341", "d341": "viscosity_points"}


def read_values(text: str, *, file: str) -> tuple[dict[str, Any], Annotations]:
    """Read a gearbox definition from its text.

    Returns
    -------
    dict
        Plain values: tables as dict, lists as tuples, ``like``, known bearings and named oil filled in; not validated
    Annotations
        With faults where there is no source, or an annotation, ``like``, designation or named oil cannot be used

    Raises
    ------
    InputError
        If it is not TOML, or of another schema.
    """
    document = parse_schema_1(text, file=file, kind="gearbox definitions")
    notes = Annotations()
    for key in LIKE_KEYS:
        if key in document:
            document[key] = _filled_from_earlier(document[key], key, notes)
    values = strip(document, notes)
    if "source" not in document:
        notes.faults.append(("", "source is missing; name where the values come from"))
    if isinstance(values.get("oil"), dict) and "named" in values["oil"]:
        values["oil"] = _filled_from_named_oil(values["oil"], notes)
    bearings = values.get("bearing")
    if isinstance(bearings, tuple):
        values["bearing"] = tuple(
            filled_by_designation(own, notes, f"bearing.{index}") if isinstance(own, dict) else own
            for index, own in enumerate(bearings)
        )
    return values, notes


def refilled(values: Mapping[str, Any], path: str, notes: Annotations) -> tuple[Mapping[str, Any], str]:
    """Values in which the oil, or a bearing, got another name: what follows from a name follows from the new one.

    Parameters
    ----------
    path : str
        Dotted path of what was changed
    notes : Annotations
        Gets the sources and standard deviations of what follows, and a fault where the name is not known

    Returns
    -------
    values : mapping
    changed : str
        Path of all that changed: the whole oil; else `path`
    """
    table, _, key = path.rpartition(".")
    if path == "oil.named" and "seal" in values:  # an oil without geometry has no name, which the validation tells
        own = {key: value for key, value in values["oil"].items() if key not in Fluid.model_fields}
        for of_oil in Fluid.model_fields:
            _forget(notes, f"oil.{of_oil}")
        seals = tuple({k: v for k, v in seal.items() if k != OIL_OF_SEAL} for seal in values["seal"])
        return {**values, "oil": _filled_from_named_oil(own, notes), "seal": seals}, table
    if table.startswith("bearing.") and key == "designation":
        bearing = values["bearing"][int(table.removeprefix("bearing."))]
        own = {key: value for key, value in bearing.items() if key not in FILLED}
        for key in FILLED:
            _forget(notes, f"{table}.{key}")
        filled = filled_by_designation(own, notes, table)
        if filled.get("type") != bearing["type"]:  # its constants are those of the other type
            filled = {key: value for key, value in filled.items() if key not in OF_TYPE[bearing["type"]]}
        return with_value(values, table.split("."), filled), table
    return values, path


def _forget(notes: Annotations, start: str) -> None:
    """Drop sources and standard deviations of all paths that begin so."""
    for kept in (notes.sources, notes.priors):
        for path in [path for path in kept if path.startswith(start)]:
            del kept[path]


def refuse(faults: Iterable[tuple[str, str]], values: Any, *, file: str) -> None:
    """Refuse a file that has faults, given by dotted path and text.

    Raises
    ------
    InputError
        If there is any.
    """
    lines = fault_lines(faults, values, file=file)
    if lines:
        raise InputError("\n".join(lines))


def fault_lines(faults: Iterable[tuple[str, str]], values: Any, *, file: str) -> list[str]:
    """Return a line per fault, given by dotted path and text."""
    return [f"{file}: {place}: {text}" if place else f"{file}: {text}" for place, text in placed(faults, values)]


def placed(faults: Iterable[tuple[str, str]], values: Any) -> list[tuple[str, str]]:
    """Return faults by dotted path with the place that a message names."""
    steps = (([int(step) if step.isdecimal() else step for step in path.split(".")], text) for path, text in faults)
    return [(place_in(values, path), text) for path, text in steps]


def _filled_from_earlier(tables: Any, key: str, notes: Annotations) -> Any:
    """Fill tables with a key ``like = "<name>"`` up from the earlier table of that name, annotations included."""
    if not isinstance(tables, tuple):
        return tables  # the validation refuses it
    filled: list[Any] = []
    for index, own in enumerate(tables):
        if isinstance(own, dict) and "like" in own:
            earlier = {t["name"]: t for t in filled if isinstance(t, dict) and isinstance(t.get("name"), str)}
            model = earlier.get(own["like"]) if isinstance(own["like"], str) else None
            if model is None:
                hint = did_you_mean(str(own["like"]), earlier) if earlier else f"; no {key} comes before it"
                notes.faults.append((f"{key}.{index}.like", f"{shown(own['like'])} is no earlier {key}{hint}"))
            own = {**(model or {}), **{k: v for k, v in own.items() if k != "like"}}
        filled.append(own)
    return tuple(filled)


def _filled_from_named_oil(own: dict[str, Any], notes: Annotations) -> dict[str, Any]:
    """Fill ``[oil]`` up from its named oil, value by value, sources and standard deviations included."""
    name = own["named"]
    if not isinstance(name, str):
        notes.faults.append(("oil.named", f"must be a text, not {shown(name)}"))
        return own
    try:
        values, oil_notes = read_oil(name)
    except InputError as error:
        notes.faults.append(("oil.named", str(error)))
        return own
    open_keys = [key for key in values if key not in own and ALTERNATIVES.get(key) not in own]
    notes.sources.update({f"oil.{key}": oil_notes.source_of(key) for key in open_keys})
    notes.sources.update(_rename_oil_paths(oil_notes.sources, open_keys))
    notes.priors.update(_rename_oil_paths(oil_notes.priors, open_keys))
    return own | {key: values[key] for key in open_keys}


def _rename_oil_paths(recorded: Mapping[str, T], keys: Sequence[str]) -> dict[str, T]:
    """Return the annotations at or below some keys of an oil, by their paths in the gearbox."""
    return {f"oil.{path}": item for path, item in recorded.items() if path.partition(".")[0] in keys}
