"""Losses, links, inputs and the measured loss of a network as laws that may change, next to those of the catalogue."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import sympy as sp

from models.mechanisms import Mechanism, Placed, Scale
from models.mechanisms.measurement import FAMILY as MEASUREMENT
from models.mechanisms.places import identifier
from models.network.laws import Parameter, symbol
from models.quantities.quantities import TOTAL_LOSS
from models.simulation.thermal_network import Link, Source, ThermalNetwork
from models.terms.term import Kind

NO_LOAD, LOAD = "no-load loss", "load-dependent loss"
INSIDE, OUTSIDE, HEAT = "heat inside the gearbox", "heat to the surroundings", "heat from outside"
WITHOUT_LOAD = ("churning", "seal", "no_load", "windage")
SHAPE = "shape_"  # begins the names of tilts of a law, see :mod:`diagnosis.setup.shapes`
BEARINGS, AIR, OIL = "bearings", "air", "oil"
FACTOR_SD, GAIN_SD, OFFSET_SD_K, LOSS_OFFSET = 0.3, 0.05, 2.0, 0.05
LOWEST, HIGHEST = -0.95, 30.0


def factors_of(network: ThermalNetwork, scale: Scale, channels: Sequence[str]) -> list[Placed]:
    """Relative changes of all losses and links, and of inputs and instruments that the catalogue has nothing for.

    Parameters
    ----------
    channels : sequence of str
        Measured nodes, or ``P_loss``
    """
    return [*_losses(network, scale), *_links(network, scale), *_instruments(network, scale, channels)]


def _losses(network: ThermalNetwork, scale: Scale) -> Iterator[Placed]:
    """Losses of every bearing, of other nodes, and in the oil those that one parameter multiplies."""
    known = {p.name for p in network.parameters}
    groups: dict[tuple[str, ...], list[Source]] = {}
    for source in network.sources:
        own = sorted(s.name for s in source.heat.free_symbols if s.name in known and not s.name.startswith(SHAPE))
        if not source.is_loss:
            name = source.name.replace("_", " ")
            yield _placed(scale, "source", f"{source.name}_heat", source.node, (source.node,), HEAT,
                          _size(FACTOR_SD, "1"), source.heat, f"The heat of {name} is smaller or greater.")  # fmt: skip
        elif source.node != OIL:
            groups.setdefault((source.node,), []).append(source)
        else:
            groups.setdefault(("", *(own or [source.name])), []).append(source)
    for key, sources in groups.items():
        names = tuple(source.name for source in sources)
        stem = key[0] or (names[0] if len(names) == 1 else "_".join(key[1:]))
        if sources[0].node in network.groups.get(BEARINGS, ()):
            stem = "bearing"
        yield _factor(
            scale, "loss_factor", f"{stem}_loss", key[0] or "_".join(names), names,
            NO_LOAD if any(word in stem for word in WITHOUT_LOAD) else LOAD, f"the loss of {stem.replace('_', ' ')}",
        )  # fmt: skip


def _links(network: ThermalNetwork, scale: Scale) -> Iterator[Placed]:
    """Every link, the links between two groups of nodes together, and all links to the air together."""
    groups: dict[tuple[str, str], list[Link]] = {}
    for link in network.links:
        if not link.conductance.is_zero:
            a, b = (_group(network, node) for node in link.nodes)
            groups.setdefault((b, a) if (b, a) in groups else (a, b), []).append(link)
    for pair, links in groups.items():
        if len(links) > 1:
            yield _link(network, scale, links, "_".join(pair))
        for link in links:
            yield _link(network, scale, [link], identifier(link.name))
    to_air = [link for pair, links in groups.items() if AIR in pair for link in links]
    if len({_group(network, node) for link in to_air for node in link.nodes}) > 2:
        yield _link(network, scale, to_air, AIR)


def _link(network: ThermalNetwork, scale: Scale, links: Sequence[Link], place: str) -> Placed:
    a, b = (_group(network, node).removesuffix("s") for node in links[0].nodes)
    outward = bool(network.boundaries.keys() & set(links[0].nodes))
    name = "air_cooling" if AIR in links[0].nodes else f"{a}_{b}_conductance"
    what = "cooling by air" if AIR in links[0].nodes else f"the conductance between {a} and {b}".replace("_", " ")
    return _factor(scale, "link_factor", name, place, tuple(link.name for link in links),
                   OUTSIDE if outward else INSIDE, what)  # fmt: skip


def _instruments(network: ThermalNetwork, scale: Scale, channels: Sequence[str]) -> Iterator[Placed]:
    for name in network.inputs:
        if name in ("speed", "torque", "T_ambient"):
            continue
        offset = name.startswith("T_")
        law = sp.Integer(1) if offset else symbol(name)
        size = _size(OFFSET_SD_K, "K") if offset else _size(GAIN_SD, "1")
        kind = "offset" if offset else "gain"
        yield _placed(scale, "signal", f"{name}_{kind}", name, (name,), MEASUREMENT, size, law,
                      f"The recorded {name.replace('_', ' ')} is wrong.")  # fmt: skip
    if TOTAL_LOSS in channels and scale.loss > 0.0:
        size = _size(LOSS_OFFSET * scale.loss, "W")
        yield _placed(scale, "sensor", "sensor_bias", TOTAL_LOSS, (TOTAL_LOSS,), MEASUREMENT, size, sp.Integer(1),
                      "The measured loss is wrong by a constant.")  # fmt: skip


def _factor(
    scale: Scale, kind: Kind, name: str, place: str, target: tuple[str, ...], family: str, what: str,
) -> Placed:  # fmt: skip
    says = f"{what[:1].upper()}{what[1:]} is smaller or greater ({{place}})."
    return _placed(scale, kind, name, place, target, family, _size(FACTOR_SD, "1"), sp.Integer(1), says,
                   is_loss=kind == "loss_factor")  # fmt: skip


def _placed(
    scale: Scale, kind: Kind, name: str, place: str, target: tuple[str, ...], family: str, size: Parameter,
    law: sp.Expr, says: str, *, is_loss: bool = False,
) -> Placed:  # fmt: skip
    label = f"{name}_{place}"
    mechanism = Mechanism(
        name=name, family=family, kind=kind, places=(), parameters=lambda _: (size,), law=symbol("strength") * law,
        says=says, reference="none: a change of a law that the model has", sign=0,
        experiment="repeat the operation before and after",
        of_measurement=family == MEASUREMENT,
    )  # fmt: skip
    strength = replace(size, name=f"{label}_strength")
    return Placed(
        mechanism=mechanism, place=place, written={"law": symbol("strength") * law}, scale=scale, label=label,
        kind=kind, target=target, expression=symbol(strength.name) * law, parameters=(strength,), is_loss=is_loss,
        form="shift" if kind == "sensor" else None, of_measurement=family == MEASUREMENT,
    )  # fmt: skip


def _size(sd: float, unit: str) -> Parameter:
    lower, upper = (LOWEST, HIGHEST) if unit == "1" else (-100.0 * sd, 100.0 * sd)
    return Parameter(name="strength", unit=unit, start=0.0, sd=sd, lower=lower, upper=upper, log=False)


def _group(network: ThermalNetwork, node: str) -> str:
    """Group of a node, or the node."""
    return next((name for name, members in network.groups.items() if node in members), node)
