"""Faults between the tables of a gearbox definition: names, references, sums, and what is not supported yet.

Runs on the tables as they were written, whether or not each of them is valid on its own, so that one reading of a file
reports everything that is wrong with it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from math import pi, sqrt
from typing import Any, TypeVar

from models.definition import Bearing, Housing, Oil, Seal, Section, Shaft, Stage
from models.errors import InputError, did_you_mean
from models.faults import partly
from models.parametric import KEY, parametric_faults

S = TypeVar("S", bound=Section)

BOUNDARY_NODES = ("air", "frame")
COMPONENTS = ("mesh_sliding", "mesh_rolling", "churning")
FACTORS = (
    "mesh", "rolling", "churning", "seal", "bearing", "h_air", "radiation", "h_oil_housing", "h_oil_gear", "gear_shaft",
    "shaft_bearing", "bearing_housing", "bearing_oil", "housing_joint", "striction", "C_oil", "C_bearings", "C_shafts",
    "C_gears",
)  # fmt: skip
# The model's own names beside nodes and losses: the sum of losses, FMU parameters (initial.T), an input (T_ambient),
# factors on heat capacities of groups (C_bearings).
RESERVED = (*BOUNDARY_NODES, "oil", "mesh", *COMPONENTS, "total", "initial", "ambient", "bearings", "shafts", "gears")
SHARE_TOLERANCE = 1e-6
SEAT_RATIO = 3.0  # a stepped shaft's diameters at seals, bearings and gears are within so many times of each other


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
        *_seals_and_shafts(values),
        *_oil_and_housing(values),
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


def _partly(values: Any, key: str, section: type[S], *needed: str) -> dict[int, S]:
    """Return the tables of a list with those of their values that are valid on their own, by position.

    Tables without a valid value for the attributes `needed` are left out.
    """
    found = {index: partly(section, table) for index, table in _tables(values, key)}
    return {index: table for index, table in found.items() if all(hasattr(table, name) for name in needed)}


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
    for name, count in Counter(own).items():
        if count > 1:
            yield f"name '{name}' is given {count} times; every part and component needs its own"
        if name in RESERVED:
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
    """Refuse bearings that carry more or less than the mesh force of their shaft; silent if any share is unknown."""
    bearings = _partly(values, "bearing", Bearing, "shaft", "load_share")
    if len(bearings) < len(list(_tables(values, "bearing"))):
        return
    for shaft in dict.fromkeys(_names(values, "shaft")):
        shares = [bearing.load_share for bearing in bearings.values() if bearing.shaft == shaft]
        if not shares:
            yield f"bearing: none is on the shaft '{shaft}'"
        elif abs(sum(shares) - 1.0) > SHARE_TOLERANCE:
            yield f"bearing: load_share of the bearings on '{shaft}' sum to {sum(shares):g}, not to 1"


def _shafts_and_gears(values: Mapping[str, Any]) -> Iterator[str]:
    shafts = {shaft.name: (index, shaft) for index, shaft in _partly(values, "shaft", Shaft, "name").items()}
    stages = list(_partly(values, "stage", Stage).values())
    for stage in stages:
        try:
            gears = list(zip((stage.driver, stage.driven), stage.names, stage.pair().r_f, strict=True))
        except (AttributeError, InputError):  # told of the stage itself
            continue
        for name, gear, r_f in gears:
            index, shaft = shafts.get(name, (0, None))
            if shaft is not None and getattr(shaft, "diameter_mm", 0.0) >= 2e3 * r_f:
                yield (
                    f"shaft.{index}.diameter_mm: {shaft.diameter_mm:g} mm is not below the root diameter "
                    f"{2e3 * r_f:.4g} mm of the gear '{gear}' on it"
                )
    carrying = [getattr(stage, side, None) for stage in stages for side in ("driver", "driven")]
    if carrying and len(set(carrying)) == len(carrying) and set(carrying) <= set(_names(values, "shaft")):
        for name, (index, _) in shafts.items():
            if name not in carrying:
                yield f"shaft.{index}: no stage drives the shaft '{name}'"


def _seals_and_shafts(values: Mapping[str, Any]) -> Iterator[str]:
    """Refuse seals that fit none of the diameters that are known of their shaft."""
    shafts = {shaft.name: shaft for shaft in _partly(values, "shaft", Shaft, "name", "diameter_mm").values()}
    bearings = _partly(values, "bearing", Bearing, "shaft", "bore_mm").values()
    for index, seal in _partly(values, "seal", Seal, "shaft", "diameter_mm").items():
        diameter, name = seal.diameter_mm, seal.shaft
        bores = [bearing.bore_mm for bearing in bearings if bearing.shaft == name]
        if name not in shafts or not bores:
            continue
        thickness = shafts[name].diameter_mm
        low, high = min(*bores, thickness) / SEAT_RATIO, max(*bores, thickness) * SEAT_RATIO
        if not low <= diameter <= high:
            bore = " and ".join(f"{bore:g}" for bore in dict.fromkeys(bores))
            yield (
                f"seal.{index}.diameter_mm: {diameter:g} mm does not fit the shaft '{name}', whose bearings have a "
                f"bore of {bore} mm and whose diameter_mm is {thickness:g}; {low:.3g} to {high:.3g} mm (a third of "
                "the smallest to three times the largest of these) is possible"
            )


def _oil_and_housing(values: Mapping[str, Any]) -> Iterator[str]:
    """Refuse oil that the housing cannot hold, and a level outside it."""
    oil, housing = partly(Oil, values.get("oil")), partly(Housing, values.get("housing"))
    area, volume = getattr(housing, "inside_area_m2", None), getattr(oil, "volume_l", None)
    if area is not None and volume is not None:
        most = 1e3 * area**1.5 / (6.0 * sqrt(pi))  # of all bodies of a surface a sphere holds the most
        if volume > most:
            meant = ": were millilitres meant?" if 0.01 <= 1e-3 * volume <= most else ""
            yield (
                f"oil.volume_l: {volume:g} l does not go into the housing, whose inside_area_m2 = {area:g} encloses "
                f"{most:.3g} l at most{meant}"
            )
    height, level = getattr(housing, "height_m", None), getattr(oil, "level_below_axis_mm", None)
    radii = {gear: r for stage in _partly(values, "stage", Stage).values() for gear, r in _tip_radii(stage).items()}
    if height is None or level is None or not radii:
        return
    gear, radius = max(radii.items(), key=lambda item: item[1])
    # The largest gear has room in the housing above and below its axis, so that neither floor nor roof is farther off.
    farthest = max(1e3 * height - radius, radius)
    if abs(level) > farthest:
        side, effect = ("below its floor", "no gear would reach the oil") if level > 0.0 else ("above its roof", "")
        yield (
            f"oil.level_below_axis_mm: {level:g} mm is outside the housing, {side}{effect and ': '}{effect}; with "
            f"height_m = {height:g} and the tip radius {radius:.4g} mm of '{gear}', {-farthest:.4g} to {farthest:.4g} "
            "mm is possible (positive below the axis)"
        )


def _tip_radii(stage: Stage) -> dict[str, float]:
    """Tip radii of a stage's gears by name, [mm]; none where its values make no gear pair."""
    try:
        return {name: 1e3 * r_a for name, r_a in zip(stage.names, stage.pair().r_a, strict=True)}
    except (AttributeError, InputError):
        return {}


def _nodes_and_factors(values: Mapping[str, Any]) -> Iterator[str]:
    parts = tuple(_names(values.get("housing"), "part"))
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
