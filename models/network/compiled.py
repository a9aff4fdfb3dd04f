"""From the expressions of a network to functions and matrices: the only place where laws become code."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import sympy as sp

from models.base.errors import InputError
from models.base.types import Array
from models.network.laws import NumericLaw, Signals, c_function_source, compile_function, function_source, symbol
from models.network.structure import BASE_SIGNALS, Network
from models.portable.evaluation import Laws

FUNCTIONS = ("boundary", "exchange", "heat", "fixed")
_compiled: WeakKeyDictionary[Network, dict[bool, Laws]] = WeakKeyDictionary()


def compile_laws(network: Network, *, vector: bool) -> Laws:
    """The laws of `network` on arrays (`vector`) or on plain numbers; kept for the next call with the same network."""
    kept = _compiled.setdefault(network, {})
    if vector not in kept:
        functions = {
            name: compile_function(source, name) for name, source in law_source(network, vector=vector).items()
        }
        kept[vector] = laws_of(network, functions)
    return kept[vector]


def laws_of(network: Network, functions: Mapping[str, Callable[..., tuple[Any, ...]]]) -> Laws:
    """Everything the runtime needs of `network`, with its law functions by name."""
    laplacian, to_boundary, injection = structure(network)
    return Laws(
        **functions,
        parts=tuple(part.name for part in network.parts),
        boundaries=tuple(network.boundaries),
        components=network.components,
        sources=tuple(source.name for source in network.sources),
        losses_of_sources=tuple(source.is_loss for source in network.sources),
        inputs=tuple(network.inputs),
        parameters=tuple(parameter.name for parameter in network.parameters),
        states=tuple(state.name for state in network.states),
        varying=tuple(index for index, varies in enumerate(network.varying) if varies),
        laplacian=laplacian,
        to_boundary=to_boundary,
        injection=injection,
        updates=any(state.update is not None for state in network.states),
        numeric=tuple(_on_signals(law) for law in network.numeric_laws.values()),
    )


def law_source(network: Network, *, vector: bool) -> dict[str, str]:
    """Python source of the functions of :class:`~models.portable.evaluation.Laws` by name; the FMU carries the
    plain-number form.

    Raises
    ------
    InputError
        If a heat capacity is missing or depends on more than parameters.
    """
    return {
        name: function_source(name, arguments, expressions, vector=vector)
        for name, (arguments, expressions) in law_expressions(network).items()
    }


def c_law_source(network: Network, places: Mapping[str, str]) -> dict[str, str]:
    """C source of the same functions by name, each ``void law_<name>(const double *s, double *y)``.

    Parameters
    ----------
    network : Network
        Without numeric laws
    places : mapping of str to str
        C expression of every argument

    Raises
    ------
    InputError
        If a heat capacity is missing or depends on more than parameters, or a law uses a function that C lacks.
    """
    functions = law_expressions(network)
    operating = functions.pop("operating", (functions["boundary"][0], [symbol("speed"), symbol("torque")]))
    if network.components:
        functions["operating"] = operating
    return {
        name: c_function_source(name, {argument: places[argument] for argument in arguments}, expressions)
        for name, (arguments, expressions) in functions.items()
    }


def law_expressions(network: Network) -> dict[str, tuple[list[str], list[sp.Expr]]]:
    """Arguments, in order, and expressions of the functions of :class:`~models.portable.evaluation.Laws` by name.

    ``operating`` is there only if speed or torque is shifted or derived.

    Raises
    ------
    InputError
        If a heat capacity is missing or depends on more than parameters.
    """
    derived = {symbol(name): law for name, law in network.derived.items()}
    boundary = {symbol(f"T_{name}"): law.xreplace(derived) for name, law in network.boundaries.items()}
    known = derived | boundary
    parameters = [parameter.name for parameter in network.parameters]
    parts = [f"T_{part.name}" for part in network.parts]
    common = [*BASE_SIGNALS, *network.inputs, *parts, *parameters, *(state.name for state in network.states)]
    with_numeric = [*common, *network.numeric_laws]
    losses = [f"P_{name}" for name in network.components]
    conductances = [link.conductance.xreplace(known) for link in network.links]
    capacities = []
    for part in network.parts:
        if part.capacity is None or {s.name for s in part.capacity.free_symbols} - set(parameters):
            raise InputError(f"node {part.name!r} needs a heat capacity that depends on parameters only")
        capacities.append(part.capacity)
    memory = [state.rate for state in network.states]
    memory += [symbol(state.name) if state.update is None else state.update for state in network.states]
    heats = [expression.xreplace(known) for expression in [*(source.heat for source in network.sources), *memory]]
    moving = [c for c, varying in zip(conductances, network.varying, strict=True) if varying]
    constant = [c for c, varying in zip(conductances, network.varying, strict=True) if not varying]
    functions = {
        "boundary": (common, list(boundary.values())),
        "exchange": (with_numeric, moving),
        "heat": ([*with_numeric, *losses], heats),
        "fixed": (parameters, [*constant, *capacities]),
    }
    if operating := {**network.derived, **network.operating}:
        seen = [operating.get(name, symbol(name)).xreplace(known) for name in ("speed", "torque")]
        functions["operating"] = (common, seen)
    return functions


def structure(network: Network) -> tuple[Array, Array, Array]:
    """Matrices of a network; see :class:`~models.portable.evaluation.Laws` for `laplacian`, `to_boundary` and
    `injection`.
    """
    part = {node.name: index for index, node in enumerate(network.parts)}
    boundaries = list(network.boundaries)
    laplacian = np.zeros((len(network.links), len(part), len(part)))
    to_boundary = np.zeros((len(network.links), len(part), len(boundaries)))
    for index, link in enumerate(network.links):
        for here, there in (link.nodes, link.nodes[::-1]):
            if here in part:
                laplacian[index, part[here], part[here]] += 1.0
                if there in part:
                    laplacian[index, part[here], part[there]] -= 1.0
                else:
                    to_boundary[index, part[here], boundaries.index(there)] += 1.0
    injection = np.zeros((len(network.sources), len(part)))
    for index, source in enumerate(network.sources):
        injection[index, part[source.node]] = 1.0
    return laplacian, to_boundary, injection


def _on_signals(law: NumericLaw) -> Callable[[Mapping[str, Any]], Any]:
    """A numeric law as a function of all signals by name, whether it can work on arrays or branches on one number."""

    def value(by_name: Mapping[str, Any]) -> Any:
        try:
            return law.function(Signals(by_name))
        except (TypeError, ValueError):
            if all(np.ndim(signal) == 0 for signal in by_name.values()):
                raise
        names, columns = list(by_name), np.broadcast_arrays(*by_name.values())
        rows = zip(*(column.reshape(-1).tolist() for column in columns), strict=True)
        values = [float(law.function(Signals(dict(zip(names, row, strict=True))))) for row in rows]
        return np.reshape(values, columns[0].shape)

    return value
