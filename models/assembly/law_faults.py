"""Faults of the laws in a definition: heats, and factors on conductances."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from models.base.errors import InputError, did_you_mean
from models.definition.machine_definition import MachineDefinition
from models.network.expressions import parse_expression
from models.network.laws import compile_each

COLD_DEGC = 20.0  # from which to the temperature of full operation factors on conductances are tried


def law_faults(definition: MachineDefinition) -> list[tuple[str, str]]:
    """Return laws of a definition that cannot be used, as dotted path and message."""
    nodes = (*definition.own_parts, *definition.own_boundaries, *(part.name for part in definition.part),
             *(boundary.name for boundary in definition.boundary))  # fmt: skip
    known = ["time", *definition.inputs, *definition.derived, *(f"T_{name}" for name in nodes),
             *(parameter.name for parameter in definition.parameter)]  # fmt: skip
    laws = [(f"heat.{i}.heat_W", heat.heat_W) for i, heat in enumerate(definition.heat)]
    laws += [(f"link.{i}.factor", path.factor) for i, path in enumerate(definition.link) if path.factor is not None]
    faults = []
    for path, text in laws:
        try:
            law = parse_expression(text)
        except InputError as error:
            faults.append((path, str(error)))
            continue
        used = sorted(s.name for s in law.free_symbols)
        unknown = [name for name in used if name not in known]
        faults += [
            (path, f"{name!r} is no input and no temperature of this definition{did_you_mean(name, known)}")
            for name in unknown
        ]
        if not unknown:
            faults += [(path, fault) for fault in _unusable(law, definition, heat=path.startswith("heat."))]
    return faults


def _unusable(law: sp.Expr, definition: MachineDefinition, *, heat: bool) -> Iterator[str]:
    """A fault if a law is infinite, or a factor below 0, at low, middle or high values of what is in it."""
    speed, torque, temperature = definition.full_operation
    ranges = {"time": (0.0, 1e5), "speed": (0.0, speed), "torque": (0.0, torque)}
    ranges |= {p.name: (p.start, p.start) for p in definition.parameter}
    for name, given in definition.inputs.items():
        if name not in ranges and not given.quantity.is_temperature:
            ranges[name] = given.quantity.low, given.quantity.high
    names = sorted(s.name for s in law.free_symbols)
    warm = COLD_DEGC, temperature
    levels = [np.linspace(*ranges.get(name, warm), 3) for name in names]
    points = [grid.ravel() for grid in np.meshgrid(*(level[np.isfinite(level)] for level in levels))]
    with np.errstate(all="ignore"):  # what is no real number there may be one where the machine runs
        (values,) = compile_each(names, [law])(*points)
    values = np.broadcast_to(np.asarray(values, dtype=float), points[0].shape if points else (1,))

    def first(bad: NDArray[np.bool_]) -> str:
        index = int(np.flatnonzero(bad)[0])
        where = ", ".join(f"{name} = {point[index]:g}" for name, point in zip(names, points, strict=True))
        return f"is {values[index]:.3g}" + (f" at {where}" if where else "")

    if (below := values < 0.0).any() and not heat:
        yield f"{first(below)}; a conductance is never negative: keep it above 0, with Max(0, ...)"
    elif (infinite := np.isinf(values)).any():
        yield f"{first(infinite)}; keep what it divides by away from 0: Max(0.1, ...), or another range"
