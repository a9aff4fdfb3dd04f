"""Model error that the readings ask for, written into the model: what predicts, and what an FMU holds.

Heat splits, smooth factors of laws, and what thermometers feel beside their nodes have a form that a model can hold. In
the classes of model error that consist of these the model is written with their most probable values.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import sympy as sp

from diagnosis.engine.calibration import Near
from diagnosis.engine.fit import Fit
from diagnosis.engine.learnt import ErrorClass
from diagnosis.engine.model_error import ModelError, groups, heats
from diagnosis.engine.model_error.courses import Course, Smooth, Standard
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
Spread = Callable[[Array], float]  # standard deviation of a combination of the unknowns of model error


@dataclass(frozen=True, kw_only=True, eq=False)
class LearntError:
    """What the readings say of model error, in a form that a model can hold.

    Attributes
    ----------
    terms : tuple of Term
        Factors of losses and links, and heat that goes elsewhere; the strength is the size, its `sd` the standard error
    mixes : mapping of str to tuple of Mix
        What thermometers feel beside their own nodes, by channel
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
    """True if a model can hold all model error of a class, and there is any."""
    return bool(one.amplitudes) and set(one.amplitudes) <= WRITABLE


def with_learnt_error(fit: Fit, near: Near, error_class: ErrorClass) -> tuple[Fit, tuple[Term, ...]]:
    """The machine of a fit with the model error of its class written into it.

    The values of the unknowns are those that were fitted with the straight lines of the same model error, deviations of
    the tested session included. Where the fit is linearised, and so its covariance, remains that of the machine
    without: model error is marginalised there.

    Parameters
    ----------
    fit : Fit
        With model error of the class in its metric
    near : Near
        Where model error was linearised

    Returns
    -------
    Fit
        Its experiment has the written machine
    tuple of Term
        What is written into the network
    """
    experiment, metric = fit.experiment, fit.experiment.metric
    assert metric is not None  # noqa: S101
    directions = near.directions(error_class)
    tested = next(i for i, piece in enumerate(experiment.pieces) if piece.recording not in experiment.healthy)
    found = metric.explained([part.residual for part in fit.parts])[tested]
    z = fit.z.copy()  # in the session that is predicted
    z[: len(found) - metric.shared] += found[metric.shared :]

    def spread(combination: Array) -> float:
        return metric.spread(combination @ directions)

    learnt = learnt_error(near.error, directions @ found[: metric.shared], spread, experiment.machine.model.network)
    there = replace(experiment, machine=learnt.added_to(experiment.machine))
    return replace(fit, experiment=there, z=z), learnt.terms


def learnt_error(error: ModelError, values: Array, spread: Spread, network: ThermalNetwork) -> LearntError:
    """Terms and mixes of some values of model error.

    Parameters
    ----------
    values : Array, shape (unknowns,)
        Per unit; 0 in other groups than :data:`WRITABLE`
    network : ThermalNetwork
        That they are added to
    """
    terms: list[Term] = []
    moved: dict[str, list[tuple[Array, sp.Expr]]] = {}
    mixes: dict[str, list[Mix]] = {}
    for one, begin, end in error.between(0, len(values)):
        mine = np.zeros(len(values))
        mine[begin:end] = values[begin:end]
        mine[np.abs(mine) < max(LEAST, LEAST_SHARE * np.abs(mine).max())] = 0.0
        if not mine.any():
            continue
        match one:
            case groups.HeatChange(heat=heats.SourceHeat(names=names) | heats.LinkHeat(names=names), course=course):
                kind: Kind = "loss_factor" if isinstance(one.heat, heats.SourceHeat) else "link_factor"
                law = _law(course, error.standard, mine[begin:end])
                place = f"law of the {one.place}" if isinstance(course, Smooth) else one.place
                terms.append(_term(place, kind, names, mine, law, spread))
            case groups.HeatChange(heat=heats.SplitHeat(names=names, target=target)):
                share = float(values[begin])
                for source in (each for each in network.sources if each.name in names):
                    moved.setdefault(source.node, []).append((mine, -share * _as_delivered(source.heat, network)))
                    moved.setdefault(target, []).append((mine, share * _as_delivered(source.heat, network)))
            case groups.ReadingChange(channel=channel, reading=groups.Near(node=node)):
                mixes.setdefault(channel, []).append(_mix(node, 0.0, mine, spread))
            case groups.ReadingChange(channel=channel, reading=groups.Late(time=time)):
                node = node_of_channel(channel, network.node_names)
                mixes.setdefault(channel, []).append(_mix(node, time, mine, spread))
    for node, heat in moved.items():
        unknowns = np.max([np.abs(mine) for mine, _ in heat], axis=0)
        terms.append(_term(f"heat into {node}", "source", (node,), unknowns, sp.Add(*(law for _, law in heat)), spread))
    return LearntError(terms=tuple(terms), mixes={channel: tuple(found) for channel, found in mixes.items()})


def _law(course: Course, standard: Standard, values: Array) -> sp.Expr:
    """Law of a course that a model can hold."""
    if isinstance(course, Smooth):
        return course.law(standard, values)
    return sp.Float(values[0])


def _as_delivered(heat: sp.Expr, network: ThermalNetwork) -> sp.Expr:
    """A heat without what was added to its law, which vanishes with its strength: of a share it is a small change."""
    return heat.xreplace({symbol(p.name): sp.Integer(0) for p in network.parameters if p.start == 0.0})


def _term(
    place: str, kind: Kind, target: tuple[str, ...], values: Array, law: sp.Expr, spread: Spread
) -> Term:  # fmt: skip
    """A law as a term whose strength is the size of the `values` in it."""
    label = PREFIX + re.sub(r"\W", "_", place)
    size = float(np.linalg.norm(values))
    strength = Parameter(
        name=f"{label}_size", start=size, lower=0.0, upper=max(1.0, size), sd=spread(values / size), log=False,
        description=f"{place}, {'shares moved' if kind == 'source' else 'relative change'}",
    )  # fmt: skip
    law = (law / size).xreplace({number: sp.Float(f"{float(number):.{DIGITS}g}") for number in law.atoms(sp.Float)})
    return Term(label=label, kind=kind, target=target, expression=symbol(strength.name) * law, parameters=(strength,))


def _mix(node: str, lag: float, values: Array, spread: Spread) -> Mix:
    size = float(np.linalg.norm(values))
    return Mix(node=node, share=float(values.sum()), stderr=spread(values / size), lag=lag)
