"""Physics of the catalogue that a machine is known to have, with the numbers that are known."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from models.assembly.gearbox import Gearbox
from models.base.errors import InputError, did_you_mean
from models.correction.correction import Finding
from models.mechanisms import CATALOGUE, Placed, Scale
from models.network.laws import Parameter
from models.quantities.units import behind_a_number
from models.simulation.thermal_network import ThermalNetwork

COLDEST_KNOWN, HOTTEST_KNOWN = -60.0, 150.0  # degC, of coolants and set-points that are known
Given = tuple[float, float]  # value and standard error


def known_finding(
    gearbox: Gearbox, network: ThermalNetwork, name: str, given: Mapping[str, Given], *, place: str | None = None
) -> Finding:
    """Return a mechanism of the catalogue at its place in a machine.

    Parameters
    ----------
    gearbox : Gearbox
        The definition, for the sizes that are typical of it
    network : ThermalNetwork
        Of the machine, with what is known of it already
    name : str
        Of the mechanism
    given : mapping of str to (float, float)
        Values and standard errors of its parameters; those that are not given have what is typical of such a machine,
        and their prior as the standard error
    place : str or None
        Where it is; None if it has one place

    Raises
    ------
    InputError
        If there is no such mechanism, place or parameter, a value is outside its limits, or the strength is missing.
    """
    term = _placed(gearbox, network, name, place)
    own = {_local(term, p): p for p in term.parameters}
    for key, (value, _) in given.items():
        if key not in own:
            raise InputError(f"{name} has no parameter {key!r}{did_you_mean(key, own)}; it has {', '.join(own)}")
        p = own[key]
        low, high = p.lower, p.upper
        if p.unit == "degC":  # the limits of a search are narrower
            low, high = min(low, COLDEST_KNOWN), max(high, HOTTEST_KNOWN)
        if not low <= value <= high:
            limits = f"{low:.4g} to {high:.4g}{behind_a_number(p.unit)}"
            raise InputError(f"{key} = {value:g} is outside {limits} of {name}")
        own[key] = replace(p, lower=min(p.lower, value), upper=max(p.upper, value))
    read = {s.name for law in term.laws.values() for s in law.free_symbols}
    for key in given:
        if own[key].name not in read:
            raise InputError(f"{key} of {name} has no effect: {gearbox.file} has surroundings of this name, whose "
                             "temperature counts; leave it out")  # fmt: skip
    strength = term.strength
    if _local(term, strength) not in given:
        raise InputError(f"the strength of {name} is missing: {strength.description or 'its size'} [{strength.unit}], "
                         f"usually about {strength.sd:.2g} on such a machine; give --set strength=VALUE")  # fmt: skip
    term = replace(term, parameters=tuple(own.values()))
    typical = {key: (p.start, p.sd * p.start if p.log else p.sd) for key, p in own.items()}
    estimates = {own[key].name: number for key, number in (typical | dict(given)).items()}
    return Finding.of(term, estimates, mechanism=name, family=term.family, place=term.place, says=term.says)


def _placed(gearbox: Gearbox, network: ThermalNetwork, name: str, place: str | None) -> Placed:
    mechanism = CATALOGUE.get(name)
    if mechanism is None:
        raise InputError(f"there is no mechanism {name!r} in the catalogue{did_you_mean(name, CATALOGUE)}")
    placed = {one.place: one for one in mechanism.placed(network, Scale.of(gearbox))}
    places = ", ".join(placed)
    if any(one.of_measurement for one in placed.values()):
        raise InputError(f"{name} is a fault of an instrument, not of the machine; what is known of sensors and inputs "
                         "stands in a mapping file, or in [[sensor]] and [[input]] of a correction")  # fmt: skip
    if not placed:
        raise InputError(f"{name} has no place in {gearbox.file}")
    if place is None and len(placed) > 1:
        raise InputError(f"{name} may be at {places}; say where with --place")
    if place is not None and place not in placed:
        raise InputError(f"{name} cannot be at {place!r}{did_you_mean(place, placed)}; it may be at {places}")
    return placed[place or next(iter(placed))]


def _local(term: Placed, parameter: Parameter) -> str:
    return parameter.name.removeprefix(f"{term.label}_")
