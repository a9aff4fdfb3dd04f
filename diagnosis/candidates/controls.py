"""Controls that the machine is known to have, with other set-points than the known ones."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from models.correction.correction import Finding
from models.mechanisms import Mechanism, Placed, Scale
from models.mechanisms.forms import share
from models.network.laws import Parameter, symbol

MOVED = "moved_set_point"  # ends the names of these laws
SET_POINT, BAND = "set_point", "band"
TRIED_K = (-20.0, -10.0, -5.0, -2.5, 2.5, 5.0, 10.0, 20.0)  # of a set-point, from the known one
SD_K = 10.0


def moved_set_points(known: Iterable[Finding], scale: Scale) -> Iterator[Placed]:
    """Every control that is known, with another set-point.

    The law is a share (the strength) of the way from the known control to the same one with the other set-point, which
    has its own memories.

    Parameters
    ----------
    known : iterable of Finding
        In the network already
    """
    for finding in known:
        term = finding.term
        at = {p.name: p for p in term.parameters}.get(f"{term.label}_{SET_POINT}")
        if at is not None:
            yield _moved(finding, at, scale)


def _moved(finding: Finding, at: Parameter, scale: Scale) -> Placed:
    term = finding.term
    label, band = f"{term.label}_{MOVED}", f"{term.label}_{BAND}"
    grid = tuple(at.start + step for step in TRIED_K if at.lower <= at.start + step <= at.upper)
    others = [replace(at, sd=max(SD_K, at.sd), grid=grid), *(p for p in term.parameters if p.name == band)]
    old = [*(p.name for p in others), *(s.name for s in term.states)]
    names = {name: f"{label}_{name.removeprefix(f'{term.label}_')}" for name in old}
    moved = {symbol(name): symbol(new) for name, new in names.items()}
    strength = replace(share("1: wholly"), name=f"{label}_strength")
    law = term.expression.xreplace(moved) - term.expression
    states = tuple(
        replace(state.with_laws(lambda law: law.xreplace(moved)), name=names[state.name]) for state in term.states
    )
    parameters = (strength, *(replace(one, name=names[one.name]) for one in others))
    what = finding.mechanism.replace("_", " ")
    mechanism = Mechanism(
        name=f"{finding.mechanism}_{MOVED}", family=finding.family, kind=term.kind, places=(),
        parameters=lambda _: parameters, law=symbol("strength") * law,
        says=f"The known {what} has another set-point ({{place}}).",
        reference="none: a change of a control that is known",
        experiment="read the set-point, or heat up slowly at constant load past it",
    )  # fmt: skip
    moving = Placed(
        mechanism=mechanism, place=finding.place or term.label, written={}, scale=scale, label=label, kind=term.kind,
        target=term.target, weights=term.weights, expression=symbol(strength.name) * law,
        parameters=parameters, states=states, is_loss=term.is_loss, of_measurement=term.of_measurement,
    )  # fmt: skip
    local = {new: symbol(new.name.removeprefix(f"{label}_")) for new in (symbol(strength.name), *moved.values())}
    return replace(moving, written={key: law.xreplace(local) for key, law in moving.laws.items()})
