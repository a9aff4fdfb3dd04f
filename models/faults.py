"""What is wrong with the tables of a file, as lines for the person who wrote it, as many at once as can be told.

Within, a value has a dotted path that counts the entries of lists from 0 (``bearing.0.mass_kg``). A message names an
entry as its file does: ``bearing 'bearing_1'.mass_kg``, without a name ``finding #1.law``, an only one ``stage.z``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from types import NoneType, UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

from pydantic import TypeAdapter, ValidationError

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
_PATH = re.compile(r"^\w+(?:\.\w+)*")
NAMES = ("name", "label")  # what entries of lists call themselves
LONGEST_NAME = 40


def validated(section: type[S], values: Any, *, file: str, faults: Sequence[str] = (), numbered: bool = False) -> S:
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
        What is already known to be wrong, each beginning with a dotted path
    numbered : bool
        Whether messages keep the dotted paths, because the caller gave values by them

    Raises
    ------
    InputError
        With `faults` and everything that the validation finds, one per line. Values that are valid on their own are
        also held against each other where the rest of their table is not.
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
        lines += [
            line
            for line in _relation_lines(error, section, values)
            if not any(line.startswith(f"{table}:") for table in unfilled)
        ]
    if lines:
        told = lines if numbered else [as_written(line, values) for line in lines]
        raise InputError("\n".join(f"{file}: {line}" for line in dict.fromkeys(told)))
    return table


def as_written(line: str, values: Any) -> str:
    """A line that begins with a dotted path, with the entries of lists named as their file does.

    Examples
    --------
    >>> values = {"stage": ({"z": (16.0, 24)},), "seal": ({"name": "front"}, {"name": "rear"})}
    >>> as_written("seal.1.shaft is missing", values), as_written("stage.0.z.1: must be a whole number", values)
    ("seal 'rear'.shaft is missing", 'stage.z #2: must be a whole number')
    """
    path = _PATH.match(line)
    if path is None:
        return line
    told, node = "", values
    for step in path[0].split("."):
        if isinstance(node, tuple | list) and step.isdecimal():
            told += _entry(node, int(step))
            node = node[int(step)] if int(step) < len(node) else None
        else:
            told = join(told, step)
            node = node.get(step) if isinstance(node, Mapping) else None
    return told + line[path.end() :]


def _entry(entries: Sequence[Any], index: int) -> str:
    names = [_name_of(entry) for entry in entries]
    if index < len(names) and names[index] and names.count(names[index]) == 1:
        return f" '{names[index]}'"
    return "" if index == 0 and len(entries) == 1 else f" #{index + 1}"


def _name_of(entry: Any) -> str:
    named = (entry.get(key) for key in NAMES) if isinstance(entry, Mapping) else ()
    return next((n for n in named if isinstance(n, str) and 0 < len(n) <= LONGEST_NAME and n.isprintable()), "")


def partly(section: type[S], table: Any) -> S:
    """A table with those of its values that are valid on their own; the others are not there as attributes.

    Parameters
    ----------
    section : type of Section
        What the table should be
    table : Any
        As plain values; what is no table gives one without values
    """
    try:
        return section.model_validate(table)
    except ValidationError as error:
        places = [detail["loc"] for detail in error.errors(include_url=False)]
    given = table if isinstance(table, Mapping) else {}
    wrong = {place[0] for place in places if place}
    keys = {key: field.alias or key for key, field in section.model_fields.items()}
    found = {
        key: TypeAdapter[Any](section.model_fields[key].annotation or Any).validate_python(given[name])
        for key, name in keys.items()
        if name in given and name not in wrong
    }
    made = section.model_construct(**found)
    for key, name in keys.items():  # where the value is wrong its default must not stand for it
        if name in wrong or not isinstance(table, Mapping):
            made.__dict__.pop(key, None)
    return made


def _relation_lines(error: ValidationError, section: type[Section], values: Any) -> list[str]:
    """What is wrong between valid values of tables with faults, which pydantic does not look at any more."""
    details = error.errors(include_url=False)
    looked_at = {detail["loc"] for detail in details if detail["type"] == "value_error"}
    tables = {detail["loc"][:depth]: None for detail in details for depth in range(len(detail["loc"]))}
    lines = []
    for place in tables:
        kind, table = _section_at(section, place), _at(values, place)
        if place in looked_at or kind is None or not isinstance(table, Mapping):
            continue
        faults = []
        for check in partly(kind, table).relations():
            try:
                faults += list(check)
            except AttributeError:  # the check needs a value that is not valid
                continue
        if faults:
            path = ".".join(map(str, place))
            lines.append(f"{path}: {'; '.join(faults)}" if path else "; ".join(faults))
    return lines


def _at(values: Any, place: Place) -> Any:
    for step in place:
        inside = isinstance(values, Mapping) and step in values
        inside |= isinstance(values, tuple | list) and isinstance(step, int) and step < len(values)
        if not inside:
            return None
        values = values[step]
    return values


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
    kind = _section_at(section, place)
    return [] if kind is None else [field.alias or key for key, field in kind.model_fields.items()]


def _section_at(section: type[Section], place: Place) -> type[Section] | None:
    """What the table at a place below a section must be; None where there is no table."""
    kind: Any = section
    for step in place:
        if _is_section(kind):
            kind = next((f.annotation for key, f in kind.model_fields.items() if step in (key, f.alias)), None)
        elif get_origin(kind) is dict:
            kind = get_args(kind)[1]
        elif get_origin(kind) is tuple:
            members = [member for member in get_args(kind) if member is not Ellipsis]
            kind = members[min(int(step), len(members) - 1)] if isinstance(step, int) else None
        while get_origin(kind) in (Annotated, Union, UnionType):
            kind = next(member for member in get_args(kind) if member is not NoneType)
    return kind if _is_section(kind) else None


def _is_section(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Section)
