"""Start values of a simulation: one check for the full model, FMUs and the command line."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

from models.base.errors import InputError, did_you_mean
from models.quantities.quantities import MEMORY

ABSOLUTE_ZERO = -273.15  # degC
HOTTEST_START = 250.0  # degC, of the coldest node; above it kelvin are meant, or the gearbox is long destroyed


def start_temperatures(
    initial: float | Mapping[str, float], nodes: Sequence[str], *, known: Collection[str] = (), source: str = ""
) -> dict[str, float]:
    """Start temperature of every node, [degC].

    Parameters
    ----------
    initial : float or mapping of name to float
        One temperature for all nodes, or one of each, [degC]; memories (``state_<name>``) are left out
    nodes : sequence of str
        Nodes that need a start temperature
    known : collection of str
        Further nodes that `initial` may have, as those of a result have; they are left out
    source : str
        Beginning of the error messages, e.g. the file that holds the temperatures

    Raises
    ------
    InputError
        If nodes are unknown or missing, a temperature is not finite or not above -273.15 degC, or one number for all
        nodes, or every node of a file, is above 250 degC.

    Examples
    --------
    >>> start_temperatures(20.0, ["oil", "housing"])
    {'oil': 20.0, 'housing': 20.0}
    >>> start_temperatures(293.15, ["oil"], source="--initial 293.15")
    Traceback (most recent call last):
    models.base.errors.InputError: --initial 293.15: the start temperature is 293.15; up to 250 degC is possible; if \
kelvin are meant, give 20
    """
    faults = []
    if isinstance(initial, Mapping):
        for name in initial:
            if name not in nodes and name not in known and not name.startswith(MEMORY):
                faults.append(f"start temperature of an unknown node {name!r}{did_you_mean(name, [*nodes, *known])}")
        missing = [name for name in nodes if name not in initial]
        if missing:
            faults.append(
                f"start temperatures are missing for: {', '.join(missing)}; give those of all nodes (a result of "
                "simulate has them), or one for all"
            )
        temperatures = {name: float(initial[name]) for name in nodes if name in initial}
    else:
        try:
            temperatures = dict.fromkeys(nodes, float(initial))
        except (TypeError, ValueError):
            raise InputError(f"the start temperature is {initial!r}; give a number in degC, or one per node") from None
    for name, T in temperatures.items():
        if not ABSOLUTE_ZERO < T < math.inf:
            faults.append(
                f"the start temperature of {name} is {T:g}; a finite number above {ABSOLUTE_ZERO:g} degC is needed"
            )
            break  # often all nodes have the same
    coldest = min(temperatures.values(), default=0.0)
    # Python may continue any state; one number for all nodes, or a file, that hot is in kelvin.
    if not faults and coldest > HOTTEST_START and (source or not isinstance(initial, Mapping)):
        meant = coldest + ABSOLUTE_ZERO
        kelvin = f"; if kelvin are meant, give {meant:g}" if meant <= HOTTEST_START else ""
        faults.append(f"the start temperature is {coldest:g}; up to {HOTTEST_START:g} degC is possible{kelvin}")
    if faults:
        raise InputError("\n".join(f"{source}: {fault}" if source else fault for fault in faults))
    return temperatures


def start_memories(initial: float | Mapping[str, float], memories: Mapping[str, float]) -> dict[str, float]:
    """Start value of every memory of the laws (of a thermostat, of wear ...).

    Parameters
    ----------
    initial : float or mapping of name to float
        Start values; those of memories are called ``state_<name>``
    memories : mapping of str to float
        All memories, with the value that they have where `initial` has none

    Raises
    ------
    InputError
        If a memory is unknown, or its value is not finite.

    Examples
    --------
    >>> start_memories({"oil": 60.0, "state_wear": 0.25}, {"wear": 0.0, "valve": 1.0})
    {'wear': 0.25, 'valve': 1.0}
    """
    given = initial if isinstance(initial, Mapping) else {}
    found = {name.removeprefix(MEMORY): float(value) for name, value in given.items() if name.startswith(MEMORY)}
    for name, value in found.items():
        if name not in memories:
            raise InputError(f"start value of an unknown memory {name!r}{did_you_mean(name, memories)}")
        if not math.isfinite(value):
            raise InputError(f"the start value of the memory {name} is {value:g}; a finite number is needed")
    return dict(memories) | found
