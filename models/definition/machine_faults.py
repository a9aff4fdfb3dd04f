"""Faults of the tables that every definition may have: names, inputs and links that do not agree."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from keyword import iskeyword

from models.base.errors import did_you_mean
from models.definition.machine_definition import Boundary, MachineDefinition


def name_faults(definition: MachineDefinition) -> Iterator[str]:
    """Yield a line per name that is given twice or means something else, and per heat in a part that is not there."""
    parts = [*definition.own_parts, *(part.name for part in definition.part)]
    added = [*(part.name for part in definition.part), *(boundary.name for boundary in definition.boundary)]
    for name, count in Counter([*definition.own_parts, *definition.own_boundaries, *added]).items():
        if count > 1 and name in added:
            yield f"name '{name}' is given {count} times; every part and boundary needs its own"
    repeated = Counter(heat.name for heat in definition.heat)
    yield from repeated_names("heat", repeated)
    signals = (*(given.name for given in definition.input), *(p.name for p in definition.parameter))
    yield from (f"'{name}' has a meaning in formulas; give the input or parameter another name" for name in signals
                if iskeyword(name) or name in ("pi", "math", "numpy"))  # fmt: skip
    for heat in definition.heat:
        for part in heat.parts:
            if part not in parts:
                yield f"heat '{heat.name}'.part: there is no part '{part}'{did_you_mean(part, parts)}"


def repeated_names(what: str, names: Counter[str]) -> Iterator[str]:
    """Yield a line per name of a table `what` that is given twice, or that the model has for temperatures."""
    yield from (f"{what}: '{name}' is given {count} times" for name, count in names.items() if count > 1)
    if "T" in names:
        yield f"{what}: the name 'T' is that of temperatures; choose another"


def input_faults(definition: MachineDefinition) -> Iterator[str]:
    """Yield a line per name in laws that means several things, and per boundary whose input is no temperature."""
    nodes = [*definition.own_parts, *definition.own_boundaries, *(part.name for part in definition.part)]
    taken = Counter(["time", *(p.name for p in definition.parameter), *(f"T_{name}" for name in nodes)])
    taken.update(f"T_{b.name}" for b in definition.boundary if b.input != f"T_{b.name}")
    taken.update({*definition.own_inputs, *definition.derived, *(given.name for given in definition.input),
                  *(b.input for b in definition.boundary)})  # fmt: skip
    taken.update([*definition.own_signals, *_factors(definition)])
    yield from (
        f"'{name}' names several inputs, parameters, factors or nodes" for name, count in taken.items() if count > 1
    )
    for boundary in definition.boundary:
        yield from _boundary_input(boundary, definition)


def _factors(definition: MachineDefinition) -> Iterator[str]:
    """Names that :class:`models.assembly.table_builder.TableBuilder` gives to factors."""
    # Tables of one name are reported as such.
    yield from (f"C_{name}" for name in {part.name for part in definition.part})
    yield from (
        f"{kind}_{a}_{b}" for a, b in {path.between for path in definition.link} for kind in ("G", "standstill")
    )
    yield from (f"{name}_gain" for name in {heat.name for heat in definition.heat})


def _boundary_input(boundary: Boundary, definition: MachineDefinition) -> Iterator[str]:
    named = {given.name for given in definition.input}
    if boundary.input not in named | definition.own_inputs.keys():
        if boundary.temperature_degC is None:
            yield (
                f"boundary '{boundary.name}': '{boundary.input}' is no [[input]]; declare it, or give temperature_degC "
                "for recordings without it"
            )
        return
    quantity = definition.inputs[boundary.input].quantity
    if not quantity.is_temperature:
        kind = next((given.quantity for given in definition.input if given.name == boundary.input), None)
        kind = kind or quantity.dimension
        yield f"boundary '{boundary.name}'.input: '{boundary.input}' is a {kind}, not a temperature"
    elif quantity.unit != "degC":
        yield f"input '{boundary.input}'.unit: the temperature of a boundary is in degC, not {quantity.unit}"


def link_faults(definition: MachineDefinition) -> Iterator[str]:
    """Yield a line per end of a link that is not there, and per link that joins what cannot be joined or is already.

    If every end is there, also per part that no links lead from to any surroundings.
    """
    boundaries = [*definition.own_boundaries, *(b.name for b in definition.boundary)]
    ends = [*definition.own_parts, *(part.name for part in definition.part), *boundaries]
    joined: list[frozenset[str]] = []
    for number, link in enumerate(definition.link, start=1):
        pair, place = frozenset(link.between), f"link #{number}.between"
        for name in link.between:
            if name not in ends:
                yield f"{place}: there is no part or boundary '{name}'{did_you_mean(name, ends)}"
        if len(pair) == 1:
            yield f"{place}: joins '{link.between[0]}' with itself"
        if pair <= set(boundaries):
            yield f"{place}: joins two boundaries; heat between them warms nothing"
        if pair in joined:
            yield f"{place}: {' and '.join(link.between)} are joined already"
        joined.append(pair)
    if all(pair <= set(ends) for pair in joined):  # else a link may be meant to lead there
        yield from _isolated(definition, joined, {*boundaries, *definition.own_parts})


def _isolated(definition: MachineDefinition, joined: list[frozenset[str]], reached: set[str]) -> Iterator[str]:
    """Yield a line per part without a way to surroundings, or to parts that the geometry joins to them."""
    while more := {name for pair in joined if pair & reached for name in pair} - reached:
        reached |= more
    for part in definition.part:
        if part.name not in reached:
            yield (
                f"part '{part.name}': no links lead from it to a [[boundary]], so it would warm for ever; "
                "add a [[link]] to surroundings, or to a part that has one"
            )
