"""What pydantic finds wrong with a table, as lines for the person who wrote the file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any, TypeVar, get_args

from pydantic import ValidationError

from models.annotated import join
from models.definition import Section
from models.errors import InputError, did_you_mean

S = TypeVar("S", bound=Section)
Place = tuple[int | str, ...]

EXPECTED = {
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "string_type": "a text",
    "bool_type": "true or false",
    "tuple_type": "a list",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "dict_type": "a table",
}


_FILLED_BY = re.compile(r"^[\w.]+\.(named|like): ")


def validated(section: type[S], values: Any, *, file: str, faults: Sequence[str] = ()) -> S:
    """Return the validated table.

    Parameters
    ----------
    section : type of Section
        What the table must be
    values : Any
        The table as plain values
    file : str
        Name of the file, for the message
    faults : sequence of str
        What is already known to be wrong

    Raises
    ------
    InputError
        With `faults` and everything that the validation finds, one per line.
    """
    lines = list(faults)
    try:
        table = section.model_validate(values)
    except ValidationError as error:
        # A table that another file or table should have filled lacks the rest as well: one fault, not ten.
        unfilled = [line.partition(": ")[0].rpartition(".")[0] for line in faults if _FILLED_BY.search(line)]
        lines += [
            line
            for line in fault_lines(error, section)
            if not (" is missing" in line and any(line.startswith(f"{table}.") for table in unfilled))
        ]
    if lines:
        raise InputError("\n".join(f"{file}: {line}" for line in dict.fromkeys(lines)))
    return table


def fault_lines(error: ValidationError, section: type[Section]) -> list[str]:
    """Return one line per fault, each beginning with the dotted path of the value.

    A missing key is not reported beside an unknown one that is a misspelling of it.
    """
    details = error.errors(include_url=False)
    misspelt = {
        (*detail["loc"][:-1], match)
        for detail in details
        if detail["type"] == "extra_forbidden"
        for match in get_close_matches(str(detail["loc"][-1]), _known_keys(section, detail["loc"][:-1]), n=1)
    }
    places = [detail["loc"] for detail in details]

    def follows_from_another(detail: Any) -> bool:
        place = detail["loc"]
        if detail["type"] == "too_short":  # pydantic does not count the faulty entries of a list
            return any(other[: len(place)] == place and len(other) > len(place) for other in places)
        return detail["type"] == "missing" and place in misspelt

    return [_line(section, detail) for detail in details if not follows_from_another(detail)]


def _line(section: type[Section], detail: Any) -> str:
    place, kind, given = detail["loc"], detail["type"], shown(detail["input"])
    path = ""
    for step in place:
        path = join(path, step)
    if kind == "extra_forbidden":
        return f"{path} is not a known key{did_you_mean(str(place[-1]), _known_keys(section, place[:-1]))}"
    if kind == "missing":
        return f"{path} is missing"
    if kind == "finite_number":
        return f"{path}: must be finite, not {given}"
    if kind == "literal_error":
        known = re.findall(r"'([^']*)'", detail["ctx"]["expected"]) or [detail["ctx"]["expected"]]
        return f"{path}: {given} is not one of its values{did_you_mean(str(detail['input']), known)}"
    if kind == "string_pattern_mismatch":
        return f"{path}: {given} must be a name of letters, digits and underscores that begins with a letter"
    if kind in ("too_long", "too_short"):
        return f"{path}: has too {'many' if kind == 'too_long' else 'few'} entries"
    if kind == "value_error":
        message = str(detail["ctx"]["error"])
        return f"{path}: {message}" if path else message
    if kind in EXPECTED:
        return f"{path}: must be {EXPECTED[kind]}, not {given}"
    return f"{path}: {detail['msg']}, not {given}"


def shown(value: Any) -> str:
    """Return what was given, in short."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits, tables hundreds deep
        return "something too long to show"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _known_keys(section: type[Section], place: Place) -> list[str]:
    """Return the keys of the table at a place below a section."""
    kind: Any = section
    for step in place:
        if isinstance(step, str) and isinstance(kind, type) and issubclass(kind, Section):
            kind = next((f.annotation for key, f in kind.model_fields.items() if step in (key, f.alias)), None)
        while get_args(kind):  # tuple[Section, ...] or Section | None
            kind = get_args(kind)[0]
    if not (isinstance(kind, type) and issubclass(kind, Section)):
        return []
    return [field.alias or key for key, field in kind.model_fields.items()]
