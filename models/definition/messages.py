"""Messages about the tables of a file that is not valid: one line per fault, with file, table, key, value and limit.

Internally a value has a path that counts the entries of lists from 0 (``bearing.0.mass_kg``). A message names an entry
as its file does: ``bearing 'bearing_1'.mass_kg``, without a name ``finding #1.law``, a single one ``stage.z``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from typing import Any, TypeVar

from pydantic import ValidationError

from models.base.errors import InputError, did_you_mean, shown
from models.definition.sections import Section

S = TypeVar("S", bound=Section)

EXPECTED = {
    "float_type": "a number",
    "int_type": "a whole number",
    "string_type": "a text",
    "bool_type": "true or false",
    "tuple_type": "a list",
    "model_type": "a table",
    "dict_type": "a table",
}
MESSAGES = {
    "missing": "is missing",
    "finite_number": "must be finite, not {given}",
    "string_pattern_mismatch": "{given} must be a name of letters, digits and underscores that begins with a letter",
    "too_long": "has too many entries",
    **{kind: f"must be {expected}, not {{given}}" for kind, expected in EXPECTED.items()},
}
NAMES = ("name", "label")  # keys that name the entries of lists
LONGEST_NAME = 40


def validate_section(section: type[S], values: Any, *, file: str) -> S:
    """Return the validated table.

    Parameters
    ----------
    section : type of Section
    values : Any
        The table as plain values
    file : str
        Name of the file, for the message

    Raises
    ------
    InputError
        With everything that is wrong, one fault per line. Relations between values of a table are checked only if
        each value is valid.
    """
    try:
        return section.model_validate(values)
    except ValidationError as error:
        raise input_error(error, values, section=section, file=file) from error


def input_error(error: ValidationError, values: Any, *, section: type[Section], file: str) -> InputError:
    """Return the message about a table that is not valid, for the person who wrote the file."""
    lines, details = [], error.errors(include_url=False)
    misspelt = {place for detail in details if detail["type"] == "extra_forbidden"
                for place in _meant(detail["loc"], section)}  # fmt: skip
    for detail in details:
        place = place_in(values, detail["loc"])
        if detail["type"] == "missing" and detail["loc"] in misspelt:
            continue  # the misspelt key is named
        if detail["type"] == "extra_forbidden":
            *table, key = detail["loc"]
            hint = did_you_mean(str(key), section.known_keys(table))
            place = place_in(values, table)
            lines.append(f"{place}: '{key}' is not a known key{hint}" if place else f"'{key}' is not a known key{hint}")
            continue
        prefix = f"{place} " if detail["type"] == "missing" else f"{place}: " if place else ""
        lines += [f"{prefix}{line}" for line in _message(detail).splitlines()]
    return InputError("\n".join(f"{file}: {line}" for line in dict.fromkeys(lines)))


def _meant(path: Sequence[int | str], section: type[Section]) -> list[tuple[int | str, ...]]:
    """Paths of the key that an unknown one may have been meant for; none or one."""
    *table, key = path
    return [(*table, near) for near in get_close_matches(str(key), section.known_keys(table), n=1)]


def _message(detail: Any) -> str:
    kind, given = detail["type"], detail["input"]
    if kind == "value_error":
        return str(detail["ctx"]["error"])
    if kind == "literal_error":
        known = detail["ctx"]["expected"].replace(" or ", ", ").replace("'", "").split(", ")
        return f"{shown(given)} is not one of its values{did_you_mean(str(given), known)}"
    return MESSAGES.get(kind, f"{detail['msg']}, not {{given}}").format(given=shown(given))


def place_in(values: Any, path: Sequence[int | str]) -> str:
    """Return a path as a message names it.

    Examples
    --------
    >>> values = {"stage": ({"z": (16.0, 24)},), "seal": ({"name": "front"}, {"name": "rear"})}
    >>> place_in(values, ("seal", 1, "shaft")), place_in(values, ("stage", 0, "z", 1))
    ("seal 'rear'.shaft", 'stage.z #2')
    """
    place, node = "", values
    for step in path:
        if isinstance(node, tuple | list) and isinstance(step, int):
            place += _entry(node, step)
            node = node[step] if step < len(node) else None
        else:
            place = f"{place}.{step}" if place else str(step)
            node = node.get(step) if isinstance(node, Mapping) else None
    return place


def _entry(entries: Sequence[Any], index: int) -> str:
    names = [_name_of(entry) for entry in entries]
    if index < len(names) and names[index] and names.count(names[index]) == 1:
        return f" '{names[index]}'"
    return "" if index == 0 and len(entries) == 1 else f" #{index + 1}"


def _name_of(entry: Any) -> str:
    names = (entry.get(key) for key in NAMES) if isinstance(entry, Mapping) else ()
    return next((n for n in names if isinstance(n, str) and 0 < len(n) <= LONGEST_NAME and n.isprintable()), "")
