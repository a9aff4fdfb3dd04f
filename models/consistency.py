"""Faults between the tables of a gearbox definition: names, references, sums, and what is not supported yet.

Runs on the tables as they were written, whether or not each of them is valid on its own, so that one reading of a file
reports everything that is wrong with it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any, TypeVar

from pydantic import ValidationError

from models.definition import Bearing, HousingPart, Section, Shaft, Stage
from models.errors import did_you_mean
from models.parametric import KEY, parametric_faults

S = TypeVar("S", bound=Section)

BOUNDARY_NODES = ("air", "frame")
COMPONENTS = ("mesh_sliding", "mesh_rolling", "churning")
FACTORS = (
    "mesh", "rolling", "churning", "seal", "bearing", "h_air", "radiation", "h_oil_housing", "h_oil_gear", "gear_shaft",
    "shaft_bearing", "bearing_housing", "bearing_oil", "housing_joint", "striction", "C_oil", "C_bearings", "C_shafts",
    "C_gears",
)  # fmt: skip
SHARE_TOLERANCE = 1e-6


def factor_names(housing_parts: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names that ``[factors]`` may hold, for a housing of these parts.

    Examples
    --------
    >>> factor_names(("lower", "upper"))[-2:]
    ('C_lower', 'C_upper')
    """
    return (*FACTORS, *(f"C_{part}" for part in housing_parts))


def consistency_faults(values: Mapping[str, Any]) -> list[str]:
    """Return what is wrong between the tables, one text per fault, each beginning with a dotted path.

    Parameters
    ----------
    values : Mapping
        The file as plain values: tables as mappings, lists as tuples
    """
    if KEY in values:
        return list(parametric_faults(values))
    return [
        *_unsupported(values),
        *_duplicate_names(values),
        *_unknown_shafts(values),
        *_shares(values),
        *_shafts_and_gears(values),
        *_nodes_and_factors(values),
    ]


def _tables(values: Any, key: str) -> Iterator[tuple[int, Mapping[str, Any]]]:
    """Yield the well-formed tables of a list of tables with their positions."""
    items = values.get(key, ()) if isinstance(values, Mapping) else ()
    for index, item in enumerate(items if isinstance(items, tuple) else ()):
        if isinstance(item, Mapping):
            yield index, item


def _names(values: Any, key: str) -> list[str]:
    return [table["name"] for _, table in _tables(values, key) if isinstance(table.get("name"), str)]


def _valid(values: Any, key: str, section: type[S]) -> dict[int, S]:
    """Return those tables of a list that are valid on their own, by position."""
    found = {}
    for index, table in _tables(values, key):
        try:
            found[index] = section.model_validate(table)
        except ValidationError:
            continue
    return found


def _gear_names(values: Mapping[str, Any]) -> list[str]:
    names: list[str] = []
    for _, stage in _tables(values, "stage"):
        given = stage.get("names", Stage.model_fields["names"].default)
        names += [name for name in given if isinstance(name, str)] if isinstance(given, tuple) else []
    return names


def _unsupported(values: Mapping[str, Any]) -> Iterator[str]:
    for key, limit, what in (("stage", 1, "more than one stage"), ("shaft", 2, "more than two shafts")):
        count = len(list(_tables(values, key)))
        if count > limit:
            yield f"{key}: has {count} entries, and {what} is not supported yet"


def _duplicate_names(values: Mapping[str, Any]) -> Iterator[str]:
    own = [
        *_names(values.get("housing"), "part"),
        *_names(values, "bearing"),
        *_names(values, "shaft"),
        *_names(values, "seal"),
        *_gear_names(values),
    ]
    reserved = (*BOUNDARY_NODES, "oil", "mesh", *COMPONENTS)
    for name, count in Counter(own).items():
        if count > 1:
            yield f"name '{name}' is given {count} times; every part and component needs its own"
        if name in reserved:
            yield f"name '{name}' is taken by the model itself; choose another"
    for name, count in Counter(_names(values, "node")).items():
        if count > 1:
            yield f"node: '{name}' is overridden {count} times"


def _unknown_shafts(values: Mapping[str, Any]) -> Iterator[str]:
    shafts = _names(values, "shaft")
    for key, references in (("stage", ("driver", "driven")), ("bearing", ("shaft",)), ("seal", ("shaft",))):
        for index, table in _tables(values, key):
            for reference in references:
                name = table.get(reference)
                if isinstance(name, str) and name not in shafts:
                    yield f"{key}.{index}.{reference}: there is no shaft '{name}'{did_you_mean(name, shafts)}"


def _shares(values: Mapping[str, Any]) -> Iterator[str]:
    """Refuse bearings that carry more or less than the mesh force of their shaft; silent if any bearing is invalid."""
    bearings = _valid(values, "bearing", Bearing)
    if len(bearings) < len(list(_tables(values, "bearing"))):
        return
    for shaft in dict.fromkeys(_names(values, "shaft")):
        shares = [bearing.load_share for bearing in bearings.values() if bearing.shaft == shaft]
        if not shares:
            yield f"bearing: none is on the shaft '{shaft}'"
        elif abs(sum(shares) - 1.0) > SHARE_TOLERANCE:
            yield f"bearing: load_share of the bearings on '{shaft}' sum to {sum(shares):g}, not to 1"


def _shafts_and_gears(values: Mapping[str, Any]) -> Iterator[str]:
    shafts = {shaft.name: (index, shaft) for index, shaft in _valid(values, "shaft", Shaft).items()}
    stages = _valid(values, "stage", Stage)
    for stage in stages.values():
        for name, gear, r_f in zip((stage.driver, stage.driven), stage.names, stage.pair().r_f, strict=True):
            index, shaft = shafts.get(name, (0, None))
            if shaft is not None and shaft.diameter_mm >= 2e3 * r_f:
                yield (
                    f"shaft.{index}.diameter_mm: {shaft.diameter_mm:g} mm is not below the root diameter "
                    f"{2e3 * r_f:.4g} mm of the gear '{gear}' on it"
                )
    if len(stages) == len(list(_tables(values, "stage"))) > 0:
        carrying = {name for stage in stages.values() for name in (stage.driver, stage.driven)}
        for name, (index, _) in shafts.items():
            if name not in carrying:
                yield f"shaft.{index}: no stage drives the shaft '{name}'"


def _nodes_and_factors(values: Mapping[str, Any]) -> Iterator[str]:
    parts = tuple(part.name for part in _valid(values.get("housing"), "part", HousingPart).values())
    nodes = [*parts, "oil", *_names(values, "bearing"), *_names(values, "shaft"), *_gear_names(values), "mesh"]
    for index, table in _tables(values, "node"):
        name = table.get("name")
        if name in BOUNDARY_NODES:
            yield f"node.{index}: '{name}' is a boundary, and has no heat capacity"
        elif isinstance(name, str) and name not in nodes:
            yield f"node.{index}: there is no node '{name}'{did_you_mean(name, nodes)}"
    factors = values.get("factors", {})
    for name in factors if isinstance(factors, Mapping) else ():
        known = factor_names(parts)
        if name not in known:
            yield f"factors.{name} is not a known factor{did_you_mean(name, known)}"
