"""Bearings by designation: typical sizes and friction constants of what a ``[[bearing]]`` leaves out."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from models.definition.bearing_section import OF_TYPE, SLIDING_OF_TYPE
from models.definition.values_with_source import Annotations
from models.files.toml_file import packaged, parse, read_text

FOLDER, FILE = "bearings", "known"
# Suffixes of cage and design do not count; the friction of a seal in the bearing (RS) is not modelled.
# Under a radial load N, NJ and NUP have the constants of NU.
DESIGNATION = re.compile(r"\s*(N|NJ|NU|NUP)?\s*(\d{3,5})(?!\d)")
SEALED = "RS"  # in a suffix: seals that rub
SIZES = ("bore_mm", "outside_diameter_mm", "width_mm", "mass_kg")
FIFTH = {"deep_groove_ball": ("static_load_kN",), "tapered_roller": ("Y",)}  # what the table has next to the sizes
FILLED = (*SIZES, "static_load_kN", "Y", "R1", "S1", "S2", "type", "model")  # what a designation gives
UNCERTAIN, SD_SHARE = ("mass_kg", "R1", "S1", "S2"), 0.1  # the constants are those of a series, rounded


@cache
def _catalogue() -> dict[str, tuple[dict[str, Any], str, str]]:
    """Values by designation; series, and source of the mass."""
    found = {}
    for series in parse(read_text(packaged(FOLDER, FILE)), file=f"{FILE}.toml")["series"]:
        of_all = {key: series[key] for key in ("type", "R1", "S1", "S2") if key in series} | {"model": "skf"}
        for name, sizes in series["sizes"].items():
            keys = (*SIZES, *FIFTH.get(series["type"], ()))
            values = dict(zip(keys, map(float, sizes), strict=True))
            found[name] = values | of_all, series["name"], series["source"]
    return found


def known_bearings() -> tuple[str, ...]:
    """Return the designations whose sizes and constants are known.

    Examples
    --------
    >>> known_bearings()[0], "6208" in known_bearings()
    ('NU 204', True)
    """
    return tuple(_catalogue())


def known_series() -> list[tuple[str, str, str]]:
    """Return type, series and designations of what is known.

    Examples
    --------
    >>> known_series()[2]
    ('cylindrical roller', 'NU 22', '2205 to 2216')
    """
    series: dict[tuple[str, str], list[str]] = {}
    for name, (values, of_series, _) in _catalogue().items():
        series.setdefault((values["type"].replace("_", " "), of_series), []).append(name.split()[-1])
    return [(kind, name, " to ".join(dict.fromkeys((all_[0], all_[-1])))) for (kind, name), all_ in series.items()]


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
    match = DESIGNATION.match(named) if isinstance(named, str) else None
    name = f"{'NU ' if match[1] else ''}{match[2]}" if match else ""
    sealed = isinstance(named, str) and SEALED in named
    if name in _catalogue() and not sealed:
        values, series, of_mass = _catalogue()[name]
        filled = {key: value for key, value in values.items() if key not in own}
        for key in filled:
            of_key = (
                of_mass
                if key in ("mass_kg", "static_load_kN", "Y")
                else f"{name}, ISO 15 and SKF friction model, series {series}"
            )
            notes.sources[f"{path}.{key}"] = f"typical: {of_key}"
            if key in UNCERTAIN:
                notes.priors[f"{path}.{key}"] = SD_SHARE * filled[key]
        return own | filled
    missing = [key for key in (*SIZES, "R1", "type") if key not in own]
    if not {*SLIDING_OF_TYPE.values()} & {*own}:
        missing.append(SLIDING_OF_TYPE.get(str(own.get("type")), "S1 (balls, tapers) or S2 (rollers)"))
    if missing and sealed and name in _catalogue():
        text = (
            f"{named!r} has seals that rub, and open bearings are known; give {', '.join(missing)}, or {name!r} if the "
            "friction of its seals does not matter"
        )
        notes.faults.append((f"{path}.designation", text))
    elif missing and isinstance(named, str):
        text = (
            f"sizes of {named!r} are not known; give {', '.join(missing)} (known are cylindrical roller bearings as "
            "NU 207, taper roller bearings as 30208 and deep groove ball bearings as 6208, open: "
            "python -m builder check --known). Bearings of other "
            f"types than {', '.join(OF_TYPE)} are not supported: describe their machine without geometry, as "
            "python -m builder new FILE --like reducer does"
        )
        notes.faults.append((f"{path}.designation", text))
    return own
