"""Forms that are in no catalogue: a heat in any part, or a conductance to the air, as a plain function of the signals.

They are scored with the rest, and have to beat it clearly: a law that an engineer knows is worth more than a monomial.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import sympy as sp

from diagnosis.hypotheses import Hypothesis
from models.laws import Parameter, symbol
from models.mechanisms import Scale
from models.network import ThermalNetwork
from models.terms import Term

TYPICAL_SHARE = 0.1  # of the typical loss or conductance


def open_hypotheses(network: ThermalNetwork, scale: Scale, channels: Sequence[str]) -> list[Hypothesis]:
    """A heat of every form in every part that matters, as mechanical loss (where the loss is measured) and not.

    Parameters
    ----------
    network : ThermalNetwork
    scale : Scale
    channels : sequence of str
        What is measured
    """
    found = []
    kinds = (True, False) if "P_loss" in channels else (False,)
    for part in network.parts:
        for form, expression in _forms(part.name, scale):
            for is_loss in kinds:
                found.append(_hypothesis(part.name, form, expression, scale, is_loss=is_loss))
    return found


def _forms(node: str, scale: Scale) -> Iterator[tuple[str, sp.Expr]]:
    n = sp.Abs(symbol("speed")) / scale.speed
    m = sp.Abs(symbol("torque")) / scale.torque
    T = (symbol(f"T_{node}") - scale.ambient) / (scale.temperature - scale.ambient)
    x = symbol("time") / scale.duration
    yield "constant", sp.Integer(1)
    yield "speed", n
    yield "speed squared", n**2
    yield "torque", m
    yield "power", n * m
    yield "temperature", T
    yield "time", x
    for share in (0.25, 0.5, 0.75):
        yield f"speed above {share:g}", sp.Max(n - share, 0)
        yield f"temperature above {share:g}", sp.Max(T - share, 0)
    for centre in (0.3, 0.6, 0.9):
        yield f"speed near {centre:g}", sp.exp(-(((n - centre) / 0.08) ** 2))
    yield "temperature near 0.4", sp.exp(-(((T - 0.4) / 0.1) ** 2))
    yield "standstill", sp.Max(1 - n / 0.02, 0)


def _hypothesis(node: str, form: str, expression: sp.Expr, scale: Scale, *, is_loss: bool) -> Hypothesis:
    label = f"open_{node}_{''.join(c if c.isalnum() else '_' for c in form)}_{'loss' if is_loss else 'heat'}"
    strength = Parameter(
        name=f"{label}_strength", unit="W", start=0.0, sd=TYPICAL_SHARE * scale.loss, lower=-1e6, upper=1e6, log=False,
        description=f"heat that goes with {form}",
    )  # fmt: skip
    term = Term(
        label=label, kind="source", target=(node,), expression=symbol(strength.name) * expression,
        parameters=(strength,), is_loss=is_loss,
    )  # fmt: skip
    return Hypothesis(
        name=f"open form, {form}" + (", a loss" if is_loss else ""), place=node, family="open form", term=term,
        variants=np.ones((1, 1)),
    )  # fmt: skip
