"""Bearings by designation: typical sizes and friction constants of what a ``[[bearing]]`` leaves out."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from models.definition.values_with_source import Annotations, strip
from models.files.toml_file import packaged, parse, read_text

FOLDER, FILE = "bearings", "cylindrical_roller"
LAW = {"type": "cylindrical_roller", "model": "skf"}  # of all of them
DESIGNATION = re.compile(r"\s*(NU)\s*(\d{3,4})(?!\d)")  # suffixes of cage and design do not count
NEEDED = ("bore_mm", "outside_diameter_mm", "width_mm", "mass_kg", "R1", "S2")


@cache
def _catalogue() -> dict[str, tuple[dict[str, Any], Annotations]]:
    name = f"{FILE}.toml"
    found = {}
    for table in parse(read_text(packaged(FOLDER, FILE)), file=name)["bearing"]:
        notes = Annotations()
        values = strip(table, notes)
        found[values.pop("designation")] = values, notes
    return found


def known_bearings() -> tuple[str, ...]:
    """Return the designations whose sizes and constants are known.

    Examples
    --------
    >>> known_bearings()[0], "NU 406" in known_bearings()
    ('NU 204', True)
    """
    return tuple(_catalogue())


def filled_by_designation(own: dict[str, Any], notes: Annotations, path: str) -> dict[str, Any]:
    """Return the values of a bearing with what it leaves out, by its designation.

    Parameters
    ----------
    own : dict
        Plain values of a ``[[bearing]]``
    notes : Annotations
        Gets sources and standard deviations of what is filled in, and a fault where a value is missing and the
        designation is not known
    path : str
        Of the bearing, ``bearing.0``

    Examples
    --------
    >>> notes = Annotations()
    >>> filled_by_designation({"designation": "NU 207 ECP", "mass_kg": 0.3}, notes, "bearing.0")["bore_mm"]
    35.0
    >>> notes.sources["bearing.0.bore_mm"]
    'typical: NU 207, ISO 15 and SKF friction model, series NU 2'
    """
    named = own.get("designation")
    missing = [key for key in NEEDED if key not in own]
    if not missing or not isinstance(named, str):
        return own
    match = DESIGNATION.match(named)
    name = f"{match[1]} {match[2]}" if match else ""
    if name not in _catalogue():
        first, *_, last, other = known_bearings()
        known = f"known are {first} to {last} and {other}"
        text = (
            f"sizes of {named!r} are not known; give {', '.join(missing)} ({known}). Bearings other than cylindrical "
            "roller bearings are not supported: describe their machine without geometry, as "
            "python -m builder new FILE --like reducer does"
        )
        notes.faults.append((f"{path}.designation", text))
        return own
    values, its_notes = _catalogue()[name]
    series = f"typical: {name}, ISO 15 and SKF friction model, series {name[:4]}"
    for key in missing:
        notes.sources[f"{path}.{key}"] = its_notes.source_of(key) or series
        if key in its_notes.priors:
            notes.priors[f"{path}.{key}"] = its_notes.priors[key]
    return own | {key: value for key, value in LAW.items() if key not in own} | {key: values[key] for key in missing}
