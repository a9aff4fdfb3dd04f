"""An unknown heat in a part: what no catalogue has, as a few smooth functions of the operation, judged together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import sympy as sp

from diagnosis.candidates.dated import LINEAR_S, SETTLING_S, Axis
from diagnosis.candidates.hypotheses import Hypothesis
from models.base.types import Array
from models.formulas.extremes import Min
from models.mechanisms import OPEN_FORM, Scale
from models.mechanisms.scale import TYPICAL_RISE
from models.network.laws import Parameter, symbol
from models.simulation.thermal_network import ThermalNetwork
from models.terms.term import Term

SHARE = 0.1  # of the typical loss, or of the heat that a typical rise drives to the surroundings
RUNS_FROM = 0.02  # of the reference speed


def unknown_heats(network: ThermalNetwork, scale: Scale, axis: Axis, *, losses: bool) -> list[Hypothesis]:
    """An unknown heat in every part, and an unknown loss.

    Parameters
    ----------
    losses : bool
        True if the total loss is measured: it then shows a loss and not a heat

    Returns
    -------
    list of Hypothesis
        The variants of each are its functions one by one: columns that are marginalised together, see
        :func:`diagnosis.engine.outside.judge_outside`
    """
    ways = (False, True) if losses and scale.loss > 0.0 else (False,)
    return [_unknown(network, scale, axis, part.name, is_loss) for part in network.parts for is_loss in ways]


def shaped(hypothesis: Hypothesis, weights: Array) -> Hypothesis:
    """An unknown heat with one shape.

    Parameters
    ----------
    weights : Array, shape (functions,)
        Of its functions, [W]

    Returns
    -------
    Hypothesis
        Strength 1 W means these weights over their root of the sum of squares
    """
    variant = np.array(hypothesis.variants[0])
    variant[1:-1] = weights / max(float(np.linalg.norm(weights)), 1e-12)
    return replace(hypothesis, variants=variant[None, :])


def _functions(network: ThermalNetwork, scale: Scale, node: str, now: sp.Expr) -> dict[str, sp.Expr]:
    """Smooth functions of the operation, of the order of 1."""
    found = {"constant": sp.Integer(1), "rise": (symbol(f"T_{node}") - scale.ambient) / TYPICAL_RISE,
             "hours": now / LINEAR_S, "fading": sp.exp(-now / SETTLING_S)}  # fmt: skip
    if scale.loss > 0.0:
        n, m = sp.Abs(symbol("speed")) / scale.speed, sp.Abs(symbol("torque")) / scale.torque
        found |= {"speed": n, "speed_squared": n**2, "torque": m, "power": n * m}
    else:
        typical = {name: abs(given.default) or 1.0 for name, given in network.inputs.items()}
        found |= {name: symbol(name) / size for name, size in typical.items() if not name.startswith("T_")}
    return found


def _unknown(network: ThermalNetwork, scale: Scale, axis: Axis, node: str, is_loss: bool) -> Hypothesis:
    name = "unknown_loss" if is_loss else "unknown_heat"
    label = f"{name}_{node}"
    clock = axis.clock(label)
    functions = _functions(network, scale, node, Min(symbol("time") + symbol(clock.name), axis.until))
    size = SHARE * (scale.loss or scale.conductance * TYPICAL_RISE)
    strength = Parameter(name=f"{label}_strength", unit="W", start=0.0, sd=size, lower=-100.0 * size,
                         upper=100.0 * size, log=False)  # fmt: skip
    shares = tuple(
        Parameter(name=f"{label}_{one}", start=0.0, sd=0.0, lower=-1.0, upper=1.0, log=False) for one in functions
    )
    law = sp.Add(*(symbol(p.name) * f for p, f in zip(shares, functions.values(), strict=True)))
    if is_loss:
        n = sp.Abs(symbol("speed")) / scale.speed
        law *= n / (n + RUNS_FROM)
    term = Term(
        label=label, kind="source", target=(node,), expression=symbol(strength.name) * law,
        parameters=(strength, *shares, clock), is_loss=is_loss,
    )  # fmt: skip
    count = len(shares)
    variants = np.column_stack([np.ones(count), np.eye(count), np.full(count, clock.start)])
    return Hypothesis(name=name, place=node, family=OPEN_FORM, term=term, law=name, variants=variants, clock=clock.name)
