"""Model error that the readings ask for, written into the model: what predicts, and what an FMU holds.

Heat splits, smooth factors of laws, and other nodes that thermometers feel have a form that a model can hold. In the
classes of model error that consist of these the model is written with their most probable values.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from diagnosis.engine.calibration import NearReadings
from diagnosis.engine.fit import Fit
from diagnosis.engine.learnt import ErrorClass
from diagnosis.engine.model_error import ModelError, courses, groups, heats
from diagnosis.engine.model_error.courses import Smooth, Standard
from diagnosis.engine.point import Machine
from diagnosis.forward.network_on_grid import NetworkOnGrid
from models.base.types import Array
from models.correction.instruments import Mix
from models.network.laws import Parameter, symbol
from models.quantities.quantities import node_of_channel
from models.simulation.thermal_network import ThermalNetwork
from models.terms.term import Kind, Term

WRITABLE = frozenset({"a_loss", "a_link", "b_split", "c_sensor", "c_lag"})
LEAST, LEAST_SHARE = 1e-3, 0.05  # relative change, and share of the largest in its law, that is written
DIGITS = 4  # of what is written
PREFIX = "learnt_"
FACTORS: Mapping[Kind, str] = {"loss_factor": "factors of heats", "link_factor": "factors of paths"}
Found = Sequence[tuple[groups.Change, Array, Array]]  # changes, values of their unknowns, and the same among all
Spread = Callable[[Array], float]  # standard deviation of a combination of the unknowns of model error


@dataclass(frozen=True, kw_only=True, eq=False)
class LearntError:
    """Model error by the readings, in a form that a model can hold.

    Attributes
    ----------
    terms : tuple of Term
        Factors of losses and links, and heat that goes elsewhere; the strength is the size, its `sd` the standard error
    mixes : mapping of str to tuple of Mix
        Other nodes that thermometers feel, by channel
    """

    terms: tuple[Term, ...]
    mixes: Mapping[str, tuple[Mix, ...]]

    def added_to(self, machine: Machine) -> Machine:
        """The machine with all of it."""
        network = machine.model.network
        for term in self.terms:
            network = term.apply(network)
        return Machine(NetworkOnGrid(network, machine.model.losses), machine.terms, self.mixes)


def is_writable(one: ErrorClass) -> bool:
    """True if a model can hold all model error of a class, and there is any.

    Not that of the widest class: the machine has another structure than the model there, and what can be held would
    stand in for the rest.
    """
    return bool(one.amplitudes) and set(one.amplitudes) <= WRITABLE


def with_learnt_error(fit: Fit, near: NearReadings, error_class: ErrorClass) -> tuple[Fit, tuple[Term, ...]]:
    """The machine of a fit with the model error of its class written into it.

    The values of the unknowns are those that were fitted with the straight lines of the same model error, deviations of
    the tested session included. Where the fit is linearised, and so its covariance, remains that of the machine
    without: model error is marginalised there.

    Parameters
    ----------
    fit : Fit
        With model error of the class in its metric
    near : NearReadings
        Where model error was linearised

    Returns
    -------
    Fit
        Its experiment has the written machine
    tuple of Term
        What is written into the network
    """
    experiment, metric = fit.experiment, fit.experiment.metric
    directions = near.directions(error_class)
    found = metric.explained([part.residual for part in fit.parts])[experiment.tested[0]]
    z = fit.z.copy()  # in the session that is predicted
    z[: len(found) - metric.shared] += found[metric.shared :]

    def spread(combination: Array) -> float:
        return metric.spread(combination @ directions)

    learnt = learnt_error(near.error, directions @ found[: metric.shared], spread, experiment.network)
    there = replace(experiment, machine=learnt.added_to(experiment.machine))
    return replace(fit, experiment=there, z=np.clip(z, *experiment.bounds)), learnt.terms


def learnt_error(error: ModelError, values: Array, spread: Spread, network: ThermalNetwork) -> LearntError:
    """Terms and mixes of some values of model error.

    Parameters
    ----------
    values : Array, shape (unknowns,)
        Per unit; those of other groups than :data:`WRITABLE` are left out
    network : ThermalNetwork
        That they are added to
    """
    found: list[tuple[groups.Change, Array, Array]] = []
    for one, begin, end in error.between(0, len(values)):
        size = np.abs(values[begin:end])
        own = np.where(size >= max(LEAST, LEAST_SHARE * size.max()), values[begin:end], 0.0)
        if own.any():
            found.append((one, own, np.concatenate([np.zeros(begin), own, np.zeros(len(values) - end)])))
    terms = (*_laws(found, error.standard, spread), *_factors(found, spread), *_moved(found, network, spread))
    return LearntError(terms=terms, mixes=_mixes(found, network.node_names, spread))


def _laws(found: Found, standard: Standard, spread: Spread) -> Iterator[Term]:
    """Factors that follow operation and temperature smoothly, for all sources or links of a family together."""
    for one, own, every in found:
        match one:
            case groups.HeatChange(heat=heats.SourceHeat() | heats.LinkHeat() as heat, course=Smooth() as smooth):
                law = smooth.law(standard, own / np.linalg.norm(own))
                yield _term(f"law of the {one.place}", _kind(heat), heat.names, every, law, spread)


def _factors(found: Found, spread: Spread) -> Iterator[Term]:
    """Constant factors of losses, and of links."""
    of_kinds: dict[Kind, list[tuple[str, float, Array]]] = {}
    for one, own, every in found:
        match one:
            case groups.HeatChange(heat=heats.SourceHeat() | heats.LinkHeat() as heat, course=courses.CONSTANT):
                of_kinds.setdefault(_kind(heat), []).append((heat.names[0], float(own[0]), every))
    for kind, each in of_kinds.items():
        names, factors, unknowns = zip(*each, strict=True)
        term = _term(FACTORS[kind], kind, names, np.sum(unknowns, axis=0), sp.Integer(1), spread)
        yield replace(term, weights=tuple(_rounded(factor / term.strength.start) for factor in factors))


def _moved(found: Found, network: ThermalNetwork, spread: Spread) -> Iterator[Term]:
    """Heat that goes into a node, or less of it, because shares go elsewhere."""
    of_nodes: dict[str, list[tuple[Array, sp.Expr]]] = {}
    for one, own, every in found:
        match one:
            case groups.HeatChange(heat=heats.SplitHeat(names=names, target=target)):
                sources = [source for source in network.sources if source.name in names]  # all in one node
                heat = float(own[0]) * _as_delivered(sp.Add(*(source.heat for source in sources)), network)
                of_nodes.setdefault(sources[0].node, []).append((every, -heat))
                of_nodes.setdefault(target, []).append((every, heat))
    for node, each in of_nodes.items():
        unknowns, moved = zip(*each, strict=True)
        every = np.sum(unknowns, axis=0)
        law = sp.Add(*moved) / float(np.linalg.norm(every))
        yield _term(f"heat into {node}", "source", (node,), every, law, spread)


def _mixes(found: Found, nodes: Collection[str], spread: Spread) -> dict[str, tuple[Mix, ...]]:
    """Other nodes, and temperatures of before, that thermometers feel."""
    mixes: dict[str, tuple[Mix, ...]] = {}
    for one, own, every in found:
        match one:
            case groups.ReadingChange(channel=channel, reading=groups.Near(node=node)):
                lag = 0.0
            case groups.ReadingChange(channel=channel, reading=groups.Late(time=lag)):
                node = node_of_channel(channel, nodes)
            case _:
                continue
        mix = Mix(node=node, share=float(np.clip(own[0], -1.0, 1.0)), lag=lag, stderr=spread(np.sign(every)))
        mixes[channel] = (*mixes.get(channel, ()), mix)
    return mixes


def _kind(heat: heats.SourceHeat | heats.LinkHeat) -> Kind:
    return "loss_factor" if isinstance(heat, heats.SourceHeat) else "link_factor"


def _rounded(number: float) -> float:
    return float(f"{number:.{DIGITS}g}")


def _as_delivered(heat: sp.Expr, network: ThermalNetwork) -> sp.Expr:
    """A heat without what was added to its law, which vanishes with its strength: of a share it is a small change."""
    return heat.xreplace({symbol(p.name): sp.Integer(0) for p in network.parameters if p.start == 0.0})


def _term(
    place: str, kind: Kind, target: tuple[str, ...], values: Array, law: sp.Expr, spread: Spread
) -> Term:  # fmt: skip
    """A law, per unit of the size of the `values` in it, as a term with this size as its strength."""
    label = PREFIX + re.sub(r"\W", "_", place)
    size = float(np.linalg.norm(values))
    strength = Parameter(
        name=f"{label}_size", start=size, lower=0.0, upper=max(1.0, size), sd=spread(values / size), log=False,
        description=f"{place}, {'shares moved' if kind == 'source' else 'relative change'}",
    )  # fmt: skip
    law = law.xreplace({number: sp.Float(_rounded(float(number))) for number in law.atoms(sp.Float)})
    return Term(label=label, kind=kind, target=target, expression=symbol(strength.name) * law, parameters=(strength,))
