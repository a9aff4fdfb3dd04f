"""Formulas are uncertain in shape, not only in size: how a loss or a conductance goes with speed, torque and viscosity.

Film formulas and load sharings of the literature differ by the exponents of speed and load as much as by a factor. A
model that may only be scaled takes such a misfit for missing physics. So every group of losses and the main heat paths
may be tilted: one plus ``a ln(x)``, with small priors; the mesh, whose loss is the largest, also bent.
"""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

from diagnosis.candidates.factors import SHAPE
from models.formulas.extremes import Max
from models.losses.loss_model import law_errors
from models.mechanisms import Scale
from models.network.laws import Parameter, symbol
from models.simulation.thermal_network import Link, Source, ThermalNetwork
from models.terms.term import Kind, Term

LOWEST_RATIO = 0.02  # below it a tilt stays as it is
LOWEST_CHANGE = -0.9  # a conductance that is tilted through zero lets a standing gearbox heat itself
# Standard deviation of the tilt per e-fold; those of the losses are in their laws.
LINK_TILTS: Mapping[str, Mapping[str, float]] = {
    "h_air": {"rise": 0.05},
    "h_oil_gear": {"speed": 0.1, "viscosity": 0.05},
    "h_oil_housing": {"speed": 0.05},
}


def shape_terms(network: ThermalNetwork, scale: Scale) -> tuple[Term, ...]:
    """The tilts of a network: terms of relative change that vanish with their only parameter.

    Parameters
    ----------
    network : ThermalNetwork
        With parameters named as the factors of a definition; those it lacks are passed over
    scale : Scale
        Sizes where the tilts have no effect
    """
    found: list[Term] = []
    for factor, tilts in law_errors().items():
        sources = [s for s in network.sources if symbol(factor) in s.heat.free_symbols]
        if sources:
            found += [
                _term("loss_factor", factor, variable, sd, sources, network, scale) for variable, sd in tilts.items()
            ]
    for factor, tilts in LINK_TILTS.items():
        links = [k for k in network.links if symbol(factor) in k.conductance.free_symbols]
        for variable, sd in tilts.items():
            if variable == "rise":
                found += [_term("link_factor", factor, variable, sd, [link], network, scale) for link in links]
            elif links:
                found.append(_term("link_factor", factor, variable, sd, links, network, scale))
    return tuple(found)


def _term(
    kind: Kind, factor: str, variable: str, sd: float, targets: list[Source] | list[Link], network: ThermalNetwork,
    scale: Scale,
) -> Term:  # fmt: skip
    label = f"{SHAPE}{factor}_{variable.replace(' ', '_')}"
    if variable == "rise":
        label += f"_{targets[0].name.split('-')[0]}"
    how, of = "bend" if " " in variable else "tilt", " and ".join(dict.fromkeys(variable.split()))
    parameter = Parameter(
        name=label, start=0.0, sd=sd, lower=-1.0, upper=1.0, log=False,
        description=f"{how} of '{factor}' with {of}, per e-fold",
    )  # fmt: skip
    tilt = symbol(label) * sp.Mul(*(sp.log(_ratio(v, targets, network, scale)) for v in variable.split()))
    return Term(
        label=label, kind=kind, target=tuple(t.name for t in targets), expression=Max(tilt, LOWEST_CHANGE),
        parameters=(parameter,),
    )  # fmt: skip


def _ratio(variable: str, targets: list[Source] | list[Link], network: ThermalNetwork, scale: Scale) -> sp.Expr:
    if variable == "speed":
        value = sp.Abs(symbol("speed")) / scale.speed
    elif variable == "torque":
        value = sp.Abs(symbol("torque")) / scale.torque
    elif variable == "viscosity":
        oil = "T_oil" if "oil" in network.node_names else f"T_{network.parts[0].name}"
        value = scale.viscosity_at(symbol(oil)) / scale.viscosity
    else:
        target = targets[0]
        assert isinstance(target, Link)  # noqa: S101 - only links have a rise
        a, b = (symbol(f"T_{node}") for node in target.nodes)
        value = sp.Abs(a - b) / (scale.temperature - scale.ambient)
    return Max(value, LOWEST_RATIO)
