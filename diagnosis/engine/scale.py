"""The unidentifiable direction of temperatures alone: all heats, conductances and capacities times one factor.

``C dT/dt = P + sum G dT`` keeps its solution when C, P and G grow together. Where nothing in watts is measured and the
definition does not fix a size, recordings identify ratios only (heat over capacity, conductance over capacity).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import sympy as sp

from diagnosis.engine.fit import Experiment, Fit
from diagnosis.engine.unknown import NetworkParameter, Unknown
from models.base.types import Array
from models.network.laws import symbol
from models.quantities.quantities import is_total_loss
from models.simulation.thermal_network import ThermalNetwork


def scale_direction(network: ThermalNetwork, unknowns: Sequence[Unknown]) -> Array:
    """Change of the unknowns that multiplies every heat, conductance and capacity by e.

    Returns
    -------
    Array, shape (unknowns,)
        In standard deviations of their priors
    """
    names = set(sizes(network))
    return np.array([
        unknown.value(0.0) / unknown.per_z(0.0)
        if isinstance(unknown, NetworkParameter) and unknown.parameter.name in names else 0.0
        for unknown in unknowns
    ])  # fmt: skip


def is_of_temperatures(experiment: Experiment) -> bool:
    """True if no loss is measured: temperatures identify ratios of heats, conductances and capacities alone."""
    return not any(map(is_total_loss, experiment.pieces[0].channels))


def at_stated_size(fit: Fit) -> Fit:
    """A fit with the common factor as the definition has it, where temperatures do not know it.

    Model error, whose size is stated in watts, may have moved it: it is larger in a smaller machine.
    """
    experiment = fit.experiment
    network = experiment.network
    if not (is_of_temperatures(experiment) and all_sizes_are_unknown(network, experiment.unknowns)):
        return fit
    direction = scale_direction(network, experiment.unknowns)
    return replace(fit, z=fit.z - direction * float(fit.z @ direction) / float(direction @ direction))


def all_sizes_are_unknown(network: ThermalNetwork, unknowns: Sequence[Unknown]) -> bool:
    """True if every heat, conductance and capacity has a factor among the unknowns."""
    free = {symbol(unknown.parameter.name) for unknown in unknowns if isinstance(unknown, NetworkParameter)}
    factors = free & {symbol(name) for name in sizes(network)}
    return all(not factors.isdisjoint(law.free_symbols) for law in _laws(network) if not law.is_zero)


def sizes(network: ThermalNetwork) -> Iterator[str]:
    """Parameters that multiply all the laws they are in, if these are heats, conductances or capacities."""
    laws = _laws(network)
    others = [law for state in network.states for law in (state.rate, state.update) if law is not None]
    for parameter in network.parameters:
        own = symbol(parameter.name)
        held = [law for law in laws if own in law.free_symbols]
        if held and not any(own in law.free_symbols for law in others) and all(_is_factor(own, law) for law in held):
            yield parameter.name


def _laws(network: ThermalNetwork) -> list[sp.Expr]:
    """Capacities, conductances and heats."""
    laws = [n.capacity for n in network.parts if n.capacity is not None]
    return [*laws, *(link.conductance for link in network.links), *(source.heat for source in network.sources)]


def _is_factor(own: sp.Symbol, law: sp.Expr) -> bool:
    return bool(law.as_independent(own, as_Add=False)[1] == own)
