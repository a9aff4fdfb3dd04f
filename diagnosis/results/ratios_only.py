"""The unidentifiable direction of temperatures alone: all heats, conductances and capacities times one factor.

``C dT/dt = P + sum G dT`` keeps its solution when C, P and G grow together. Where nothing in watts was measured, and
the definition does not fix a size, a recording identifies ratios only (heat over capacity, conductance over capacity),
and every watt in the result rests on the priors. Whether it is so is asked of the fit itself: the information that the
recordings have along this direction is compared with what they have on the sizes one by one.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import sympy as sp

from diagnosis.engine.fit import Fit
from diagnosis.engine.unknown import NetworkParameter
from models.base.types import Array
from models.network.laws import symbol
from models.simulation.thermal_network import ThermalNetwork

LITTLE = 0.01  # of what the recordings know about the sizes one by one: a small part of fixed capacity pretends so much


def ratio_notes(fit: Fit) -> tuple[str, ...]:
    """One sentence if the recordings identify ratios only; nothing if they identify sizes."""
    direction = scale_direction(fit)
    each = np.concatenate([part.columns for part in fit.parts]) * direction
    together, alone = each.sum(axis=1), np.square(each).sum(axis=0)[direction != 0.0]
    if not len(alone) or float(together @ together) > LITTLE * float(alone.sum()):
        return ()
    sd = 1.0 / np.sqrt(float(direction @ direction))
    text = (
        "only ratios are identified: all heats, conductances and heat capacities together may be larger or smaller by "
        f"one factor without any change of a temperature. That factor rests on the definition's priors (a factor of "
        f"{np.exp(sd):.2f} either way, one standard deviation), and so does every number in W, W/K or J/K; measure the "
        "loss, or one heat flow, to fix it"
    )
    return (text,)


def scale_direction(fit: Fit) -> Array:
    """Change of the unknowns that multiplies every heat, conductance and capacity by e.

    Returns
    -------
    Array, shape (unknowns,)
        In standard deviations of their priors
    """
    names = set(sizes(fit.experiment.machine.model.network))
    return np.array([
        unknown.value(z) / unknown.per_z(z)
        if isinstance(unknown, NetworkParameter) and unknown.parameter.name in names else 0.0
        for unknown, z in zip(fit.experiment.unknowns, fit.z.tolist(), strict=True)
    ])  # fmt: skip


def sizes(network: ThermalNetwork) -> Iterator[str]:
    """Parameters that multiply all the laws they are in, if these are heats, conductances or capacities."""
    laws = [n.capacity for n in network.parts if n.capacity is not None]
    laws += [link.conductance for link in network.links] + [source.heat for source in network.sources]
    others = [law for state in network.states for law in (state.rate, state.update) if law is not None]
    for parameter in network.parameters:
        own = symbol(parameter.name)
        held = [law for law in laws if own in law.free_symbols]
        if held and not any(own in law.free_symbols for law in others) and all(_is_factor(own, law) for law in held):
            yield parameter.name


def _is_factor(own: sp.Symbol, law: sp.Expr) -> bool:
    return bool(law.as_independent(own, as_Add=False)[1] == own)
