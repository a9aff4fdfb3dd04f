"""A definition as the program understands it: nodes, links, inputs, losses, oil, and which values are typical."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp

from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.definition.messages import place_in
from models.formulas.oil import kinematic_viscosity_d341
from models.losses.shaft_loads import bearing_loads
from models.network.laws import symbol
from models.portable.evaluation import RPM
from models.quantities.quantities import Input
from models.simulation.thermal_network import ThermalNetwork

SHARES = (("low", 0.1), ("mid", 0.5), ("rated", 1.0))  # of the largest speed, torque and other inputs
OIL_degC = (20.0, 60.0, 100.0)
HOTTEST_DEGC = 250.0  # beyond it nothing of a gearbox is left, and no formula holds
SHOWN_WHOLE = 1000.0  # from which numbers have no decimals
TYPICAL = "typical"  # first word of the source of a value that is no machine's own


@dataclass(frozen=True)
class Grid:
    """A table for people: title, header, rows, and how many of its columns are text."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    text_columns: int = 1


def understood(gearbox: Gearbox) -> list[Grid]:
    """Return the tables that ``check`` prints.

    Parameters
    ----------
    gearbox : Gearbox
    """
    network = gearbox.network()
    tables = [_nodes(gearbox, network), _links(gearbox, network), _inputs(network)]
    if gearbox.loss_laws().components:
        tables.append(_losses(gearbox))
    if any(not source.is_loss for source in network.sources):
        tables.append(_heats(gearbox, network))
    if "oil" in {part.name for part in network.parts}:
        tables.append(_oil(gearbox))
    if gearbox.is_parametric:
        return tables
    return [*tables, _steady(gearbox, network), _bearing_loads(gearbox), *_gears(gearbox)]


def _steady(gearbox: Gearbox, network: ThermalNetwork) -> Grid:
    """Where temperatures settle; nowhere, where losses rise faster than heat leaves."""
    parts = ["oil", *(part.name for part in gearbox.housing.part)]
    rows: list[list[str]] = [[name] for name in [*parts, "hottest bearing"]]
    for _, share in SHARES:
        speed, torque, _ = (share * value for value in gearbox.definition.full_operation)
        try:
            T = gearbox.steady_state(speed=speed, torque=torque).temperatures
        except ArithmeticError:
            T = dict.fromkeys((*parts, *(bearing.name for bearing in gearbox.bearing)), math.inf)
        hottest = max(gearbox.bearing, key=lambda bearing: T[bearing.name]).name
        shown = [f"{T[name]:.1f}" if T[name] <= HOTTEST_DEGC else f"> {HOTTEST_DEGC:g}" for name in (*parts, hottest)]
        for row, value in zip(rows, [*shown[:-1], f"{shown[-1]} ({hottest})"], strict=True):
            row.append(value)
    inputs = network.inputs
    at = _with_units({name: known.default for name, known in inputs.items() if not known.required}, inputs)
    return Grid(f"Where temperatures settle, in degC, at {at}", ["part", *(name for name, _ in SHARES)], rows)


def _with_units(values: Mapping[str, float], inputs: Mapping[str, Input]) -> str:
    """Values of inputs with their units, for a title."""
    return ", ".join(f"{name} {value:g} {inputs[name].quantity.unit}".rstrip() for name, value in values.items())


def _gears(gearbox: Gearbox) -> Iterator[Grid]:
    geometry = gearbox.geometry
    _, torque, _ = geometry.full_operation
    for number, stage in enumerate(gearbox.stage, start=1):
        pair, levels = stage.pair(), [geometry.level_below_axis[shaft] for shaft in stage.shafts]
        rows = [
            [name, f"{2e3 * r_a:.1f}", f"{1e3 * (r_a - level):.1f}" if r_a > level else "not at all"]
            for name, r_a, level in zip(stage.names, pair.r_a, levels, strict=True)
        ]
        of_stage = f" of stage {number}" if len(gearbox.stage) > 1 else ""
        level = " and ".join(dict.fromkeys(f"{1e3 * level:g}" for level in levels))
        title = f"Gears{of_stage}; contact ratio {pair.epsilon_alpha:.3f}; oil {level} mm below their axes"
        if pair.epsilon_beta > 0.0:
            push = torque * geometry.torque_ratio[stage.driver] / pair.r_b[0] * math.tan(pair.beta_b)
            title += f"\n(overlap ratio {pair.epsilon_beta:.3f}; {push:.4g} N along the shafts at {torque:g} N m)"
        yield Grid(title, ["gear", "tip diameter, mm", "dips, mm"], rows)


def _bearing_loads(gearbox: Gearbox) -> Grid:
    (speed, torque, _), loads = gearbox.geometry.full_operation, bearing_loads(gearbox.geometry)
    rows = [
        [bearing.name, f"{speed * gearbox.speed_ratio[bearing.shaft]:.4g}", f"{torque * load.radial:.4g}",
         f"{torque * load.radial * load.axial_share:.4g}"]
        for bearing in gearbox.bearing for load in [loads[bearing.name]]
    ]  # fmt: skip
    title = f"Bearings at {speed:g} 1/min and {torque:g} N m of the input shaft"
    return Grid(title, ["bearing", "speed, 1/min", "radial load, N", "axial load, N"], rows)


def conductances(gearbox: Gearbox, network: ThermalNetwork) -> dict[str, float]:
    """Conductance of every link at the middle operating point with warm parts, [W/K]."""
    values = _signals(gearbox, network, dict(SHARES)["mid"])
    return {link.name: _value(link.conductance, network, values) for link in network.links}


def _signals(gearbox: Gearbox, network: ThermalNetwork, share: float) -> dict[str, float]:
    """Time, inputs, temperatures of parts and parameters by name, at a share of what is rated."""
    speed, torque, warm = gearbox.definition.full_operation
    values = {"time": 0.0, **{p.name: p.start for p in network.parameters}}
    for name, known in network.inputs.items():
        low, high = known.quantity.low, known.quantity.high
        driven = not known.quantity.is_temperature and np.isfinite(high) and name != "air_speed"
        values[name] = low + share * (high - low) if driven else known.default
    driven_by = {"speed": share * speed, "torque": share * torque}
    values |= {name: value for name, value in driven_by.items() if name in network.inputs}
    return values | {f"T_{part.name}": warm for part in network.parts}


def _value(law: sp.Expr, network: ThermalNetwork, values: Mapping[str, float]) -> float:
    """A law at known signals; temperatures of boundaries follow from their own laws."""
    laws = {symbol(name): derived for name, derived in network.derived.items()}
    laws |= {symbol(f"T_{name}"): temperature for name, temperature in network.boundaries.items()}
    numbers = {symbol(name): sp.Float(value) for name, value in values.items()}
    value = complex(law.xreplace(laws).xreplace(laws).xreplace(numbers))
    return value.real if value.imag == 0.0 else math.nan


def _nodes(gearbox: Gearbox, network: ThermalNetwork) -> Grid:
    values = _signals(gearbox, network, 0.5)
    rows = []
    for node in network.nodes:
        if node.temperature is not None:
            law = str(node.temperature)
            at = f"{_value(node.temperature, network, values):.4g} degC"
            rows.append([node.name, "surroundings", f"{law}, {at}", ""])
        else:
            assert node.capacity is not None  # noqa: S101 - a part has a capacity
            sources = [source.name for source in network.sources if source.node == node.name]
            rows.append([node.name, "part", ", ".join(sources), _number(_value(node.capacity, network, values))])
    title = f"{len(network.nodes)} nodes; heat capacities in J/K"
    return Grid(title, ["node", "kind", "warmed by, or temperature", "J/K"], rows, 3)


def _links(gearbox: Gearbox, network: ThermalNetwork) -> Grid:
    found, constants = conductances(gearbox, network), {p.name for p in network.parameters}
    rows = []
    for link in network.links:
        varies = sorted({s.name for s in link.conductance.free_symbols} - constants)
        rows.append([" - ".join(link.nodes), ", ".join(varies) or "constant", _number(found[link.name])])
    *_, warm = gearbox.definition.full_operation
    read = {one.name for link in network.links for one in link.conductance.free_symbols}
    mid = _signals(gearbox, network, dict(SHARES)["mid"])
    at = _with_units({name: mid[name] for name in network.inputs if name in read}, network.inputs)
    outside = {node.name for node in network.nodes if node.temperature is not None}
    to_outside = sum(found[link.name] for link in network.links if len(outside.intersection(link.nodes)) == 1)
    title = f"{len(network.links)} links; conductances in W/K at mid operation, parts at {warm:g} degC"
    title += f"; {_number(to_outside)} to the surroundings in all"
    title += f"\n({at})" if at else ""
    return Grid(title, ["between", "depends on", "W/K"], rows, 2)


def _inputs(network: ThermalNetwork) -> Grid:
    rows = [
        [name, known.column, f"{known.quantity.low:g} to {known.quantity.high:g} {known.quantity.unit}",
         "needed" if known.required else f"{known.default:g} where not given"]
        for name, known in network.inputs.items()
    ]  # fmt: skip
    return Grid("Inputs of cycles, recordings and the FMU", ["input", "column", "plausible", "default"], rows, 4)


def _heats(gearbox: Gearbox, network: ThermalNetwork) -> Grid:
    """Heats that are no losses, at three values of all inputs."""
    points = [_signals(gearbox, network, share) for _, share in SHARES]
    sources = [source for source in network.sources if not source.is_loss]
    heats = [[_value(source.heat, network, values) for source in sources] for values in points]
    names = [f"{source.name} in {source.node}" for source in sources]
    return _by_point("Heats in W, inputs at 10, 50 and 100 % of their range", names, np.array(heats))


def _losses(gearbox: Gearbox) -> Grid:
    """Losses by component at three operating points."""
    laws, (*rated, warm) = gearbox.loss_laws(), gearbox.definition.full_operation
    speed, torque = (np.array([share * value for _, share in SHARES]) for value in rated)
    temperatures = np.full((len(SHARES), len(laws.temperature_nodes)), warm)
    losses = np.asarray(laws.power(speed, torque, temperatures))
    at = "; ".join(
        f"{name} {_number(n)} 1/min, {_number(M)} N m" for (name, _), n, M in zip(SHARES, speed, torque, strict=True)
    )
    end = "[reference]" if gearbox.is_parametric else "the end of [training]"
    title = f"Losses in W, all parts at {warm:g} degC; rated is {end}\n({at})"
    table = _by_point(title, list(laws.components), losses)
    power = speed * RPM * torque
    share = [f"{100.0 * value:.3g} %" for value in losses.sum(axis=1) / power]
    return Grid(title, table.header, [*table.rows, ["share of the power", *share]])


def _by_point(title: str, names: Sequence[str], watts: Array) -> Grid:
    rows = [[name, *(_number(value) for value in watts[:, column])] for column, name in enumerate(names)]
    rows.append(["total", *(_number(value) for value in watts.sum(axis=1))])
    return Grid(title, ["", *(name for name, _ in SHARES)], rows)


def _oil(gearbox: Gearbox) -> Grid:
    m, n = gearbox.viscosity_constants
    rows = [["viscosity, mm2/s", *(_number(float(kinematic_viscosity_d341(T, m, n))) for T in OIL_degC)]]
    if not gearbox.is_parametric:
        oil = gearbox.lubricant()
        rows.append(["density, kg/m3", *(_number(float(oil.density(T))) for T in OIL_degC)])
        rows.append(["specific heat, J/(kg K)", *(_number(float(oil.specific_heat(T))) for T in OIL_degC)])
    named = f" ({gearbox.oil.name})" if not gearbox.is_parametric else ""
    return Grid(f"Oil{named}", ["", *(f"{T:g} degC" for T in OIL_degC)], rows)


def _number(value: float) -> str:
    return f"{value:.4g}" if abs(value) < SHOWN_WHOLE else f"{value:.0f}"


def typical_values(gearbox: Gearbox) -> list[str]:
    """Return a line for the values of every table that are typical of a size or a grade, and none of this machine.

    Parameters
    ----------
    gearbox : Gearbox
    """
    found: dict[tuple[str, str], list[str]] = {}
    for path, value in gearbox.leaves.items():
        source = gearbox.source_of(path)
        if source.startswith(TYPICAL):
            steps = [int(step) if step.isdecimal() else step for step in path.split(".")]
            table = place_in(gearbox.values, steps[:2] if isinstance(steps[1], int) else steps[:1])
            key = place_in(gearbox.values, steps).removeprefix(table).lstrip(".")
            found.setdefault((table, source), []).append(f"{key} {value}")
    return [f"{place}: {', '.join(values)} ({source})" for (place, source), values in found.items()]
