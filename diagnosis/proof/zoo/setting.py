"""A plant as an effect sees it: which things belong to a nominal one, usual sizes, and changes of them.

An effect acts on things by what they are a part of in the nominal model, so the same effect fits plants of every
structure.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from diagnosis.proof.plant.cycles import TRAIN, Programme
from diagnosis.proof.zoo.structure import (
    Body,
    Boundary,
    HeatPath,
    Law,
    Moment,
    ZooChange,
    ZooOutcome,
    ZooPlant,
    constant,
    times,
)
from models.base.types import Array

What = Literal["loss", "link", "capacity", "heat", "sensor", "input", "clock"]


class UnfitError(Exception):
    """An effect needs something that this plant does not have; another effect is drawn then."""


@dataclass(frozen=True, kw_only=True)
class Changed:
    """One thing that an effect changed, by the names of the nominal model.

    Attributes
    ----------
    of : str
        Loss, link, node, channel or input; of a further link its two ends joined by ``-``
    nodes : tuple of str
        Nominal nodes that it concerns
    sign : int
        1: more of it, -1: less, 0: neither
    is_loss : bool
        Of a heat: True if it is mechanical power
    """

    what: What
    of: str
    nodes: tuple[str, ...]
    sign: int
    is_loss: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Parts:
    """Things that an effect brings along; without the effect they do nothing that can be measured.

    Attributes
    ----------
    like : mapping of str to str
        Body whose temperature at the first row each of the bodies has; empty: the air's
    """

    bodies: tuple[Body, ...] = ()
    boundaries: tuple[Boundary, ...] = ()
    paths: tuple[HeatPath, ...] = ()
    like: Mapping[str, str] = field(default_factory=dict)

    @property
    def names(self) -> set[str]:
        """Names of its bodies and boundaries."""
        return {body.name for body in self.bodies} | {boundary.name for boundary in self.boundaries}


@dataclass(frozen=True, kw_only=True, eq=False)
class Act:
    """Changes of an effect at a strength of 1, and what they are called."""

    changes: tuple[ZooChange, ...] = ()
    changed: tuple[Changed, ...] = ()
    parts: Parts = Parts()

    def __add__(self, other: Act) -> Act:
        a, b = self.parts, other.parts
        return Act(
            changes=self.changes + other.changes,
            changed=self.changed + other.changed,
            parts=Parts(
                bodies=a.bodies + b.bodies,
                boundaries=a.boundaries + b.boundaries,
                paths=a.paths + b.paths,
                like={**a.like, **b.like},
            ),
        )


def is_part(thing: str, of: str) -> bool:
    """True if a ``part_of``, which may join several names by ``+``, holds a name."""
    return of in thing.split("+")


def soft(z: Array) -> Array:
    """Smooth step from 0 to 1, 0.5 at 0."""
    return np.asarray(0.5 * (1.0 + np.tanh(0.5 * z)))


class EffectSetting:
    """A plant and what an effect must know of it: which things belong to a nominal one, and usual sizes.

    Parameters
    ----------
    healthy : ZooOutcome
        Of one training recording without any effect, one run
    groups : mapping of str to tuple of str
        Nominal nodes by what they are: ``housing``, ``bearings``, ``shafts``, ``gears``, ``returns``

    Attributes
    ----------
    loss : float
        Typical loss, [W]
    shed : float
        Heat that the machine sheds per kelvin that it is warmer than the air, [W/K]
    hours, span : float
        Length of the training recordings, and from the first row of the session to the last, pauses included, [h]
    """

    def __init__(
        self,
        plant: ZooPlant,
        programmes: Sequence[Programme],
        healthy: ZooOutcome,
        groups: Mapping[str, tuple[str, ...]],
    ) -> None:
        self.plant, self.groups = plant, groups
        train = [p for p in programmes if p.name.startswith(TRAIN)]
        self.programmes = train
        values = {name: np.concatenate([p.inputs[name][p.unrecorded :] for p in train]) for name in plant.inputs}
        self.reference = {name: float(np.quantile(np.abs(v), 0.97)) or 1.0 for name, v in values.items()}
        self.healthy = {name: series[0] for name, series in healthy.T.items()}
        self.air_mean = float(values["T_ambient"].mean())
        names = [body.name for body in plant.bodies]
        self.rise = max(float(np.mean([self.healthy[n].mean() for n in names])) - self.air_mean, 1.0)
        self.loss, self.shed = plant.loss_W, plant.loss_W / self.rise
        last = max(programmes, key=lambda p: p.begins_h)
        self.span = last.begins_h + (len(last) - last.unrecorded) * plant.row_s / 3600.0
        self.hours = sum(len(p) - p.unrecorded for p in train) * plant.row_s / 3600.0
        self.typical = Moment(
            hours=np.ones(1), since_start=np.ones(1),
            inputs={name: np.full(1, v.mean()) for name, v in values.items()},
            T={name: np.full(1, v.mean()) for name, v in self.healthy.items()},
            p={name: np.full(1, v) for name, v in plant.parameters.items()},
        )  # fmt: skip

    # ------------------------------------------------------------------ what there is

    def capacities(self, node: str) -> dict[str, float]:
        """Bodies of a nominal node and the heat capacity of each, [J/K].

        Raises
        ------
        UnfitError
            If the plant has none.
        """
        sizes = {b.name: float(b.capacity(self.typical)[0]) for b in self.plant.bodies if is_part(b.part_of, node)}
        if not sizes:
            raise UnfitError(node)
        return sizes

    def bodies(self, node: str) -> dict[str, float]:
        """Bodies of a nominal node and the share of each in its heat capacity."""
        sizes = self.capacities(node)
        return {name: size / sum(sizes.values()) for name, size in sizes.items()}

    def group(self, name: str) -> tuple[str, ...]:
        """Nominal nodes of a group that the plant has bodies of."""
        nodes = tuple(node for node in self.groups.get(name, ()) if node in self.nodes)
        if not nodes:
            raise UnfitError(name)
        return nodes

    @cached_property
    def nodes(self) -> tuple[str, ...]:
        """Nominal nodes that the plant has bodies of."""
        return tuple(dict.fromkeys(node for b in self.plant.bodies for node in b.part_of.split("+") if node))

    @cached_property
    def links(self) -> tuple[str, ...]:
        """Nominal links that the plant has paths of."""
        return tuple(dict.fromkeys(n for path in self.plant.paths for n in path.part_of.split("+") if "-" in n))

    def link_between(self, here: Sequence[str], there: Sequence[str]) -> tuple[str, ...]:
        """Nominal links that lead from one of some nodes to one of others.

        Raises
        ------
        UnfitError
            If the plant has none.
        """
        found = []
        for link in self.links:
            a, _, b = link.partition("-")
            if (a in here and b in there) or (b in here and a in there):
                found.append(link)
        if not found:
            raise UnfitError(f"{here}-{there}")
        return tuple(found)

    def losses(self, *names: str) -> tuple[str, ...]:
        """Nominal losses whose name is, or begins with, one of some names.

        Raises
        ------
        UnfitError
            If the plant has none.
        """
        found = tuple(
            one for one in self.losses_all if any(one == name or one.startswith(f"{name}_") for name in names)
        )
        if not found:
            raise UnfitError(str(names))
        return found

    @cached_property
    def losses_all(self) -> tuple[str, ...]:
        """Nominal losses that the plant has sources of."""
        return tuple(dict.fromkeys(n for s in self.plant.sources if s.is_loss for n in s.part_of.split("+") if n))

    def date(self, rng: np.random.Generator, low: float, high: float) -> float:
        """A time of the training recordings, between two shares of their rows, [h] since the first row."""
        wanted = float(rng.uniform(low, high)) * self.hours
        for programme in self.programmes:
            length = (len(programme) - programme.unrecorded) * self.plant.row_s / 3600.0
            if wanted < length:
                return programme.begins_h + wanted
            wanted -= length
        raise AssertionError

    def speed(self) -> Law:
        """Speed over its highest value, >= 0, [-]."""
        return self._relative("speed")

    def load(self) -> Law:
        """Torque over its highest value, >= 0, [-]."""
        return self._relative("torque")

    def _relative(self, name: str) -> Law:
        if name not in self.plant.inputs:
            raise UnfitError(name)
        top = self.reference[name]
        return lambda m: np.abs(m.inputs[name]) / top

    def temperature(self, node: str) -> Law:
        """Mean temperature of a nominal node, [degC]."""
        shares = self.bodies(node)
        return lambda m: np.asarray(sum(share * m.T[name] for name, share in shares.items()))

    def quantile(self, node: str, q: float) -> float:
        """Temperature that a node of the healthy plant is below for a share of the recording `healthy`, [degC]."""
        return float(np.quantile(sum(share * self.healthy[name] for name, share in self.bodies(node).items()), q))

    # ------------------------------------------------------------------ acts at a strength of 1

    def heat(self, node: str, law: Law, *, sign: int = 1, is_loss: bool = False) -> Act:
        """Heat `law` [W] into a node; `sign` is what it mostly does."""
        changes = tuple(
            ZooChange(kind="heat", target=body, law=times(share, law), is_loss=is_loss)
            for body, share in self.bodies(node).items()
        )
        return Act(changes=changes, changed=(Changed(what="heat", of=node, nodes=(node,), sign=sign, is_loss=is_loss),))

    def loss_factor(self, names: Sequence[str], law: Law, *, sign: int = 1, is_loss: bool = True) -> Act:
        """Nominal losses (or other heats) times ``1 + law``."""
        what: What = "loss" if is_loss else "heat"
        sources = [s for s in self.plant.sources if any(is_part(s.part_of, name) for name in names)]
        nodes = {name: self._heated(name) for name in names}
        return Act(
            changes=tuple(ZooChange(kind="source", target=source.name, law=law) for source in sources),
            changed=tuple(Changed(what=what, of=n, nodes=nodes[n], sign=sign, is_loss=is_loss) for n in names),
        )

    def _heated(self, source: str) -> tuple[str, ...]:
        """Nominal nodes that a nominal source heats in this plant."""
        home = {body.name: body.part_of.split("+") for body in self.plant.bodies}
        return tuple(
            dict.fromkeys(
                node
                for one in self.plant.sources
                if is_part(one.part_of, source)
                for body in one.spread
                for node in home[body]
            )
        )

    def link_factor(self, names: Sequence[str], law: Law, *, sign: int = 1) -> Act:
        """Conductances of nominal links times ``1 + law``."""
        known = self.nodes
        return Act(
            changes=tuple(
                ZooChange(kind="path", target=p.name, law=law)
                for p in self.plant.paths
                if any(is_part(p.part_of, name) for name in names)
            ),
            changed=tuple(
                Changed(what="link", of=n, nodes=tuple(node for node in n.split("-") if node in known), sign=sign)
                for n in names
            ),
        )

    def bridge(self, node: str, other: str, law: Law, *, called: str = "", parts: Parts | None = None) -> Act:
        """A further way for heat of `law` [W/K] between a node and a body or boundary, called `called` in the truth."""
        changes = tuple(
            ZooChange(kind="bridge", target=body, other=other, law=times(share, law))
            for body, share in self.bodies(node).items()
        )
        changed = Changed(what="link", of=f"{node}-{called or other}", nodes=(node,), sign=1)
        return Act(changes=changes, changed=(changed,), parts=parts or Parts())

    def capacity(self, node: str, law: Law, *, sign: int = 1) -> Act:
        """Heat capacity of a node times ``1 + law``."""
        return Act(
            changes=tuple(ZooChange(kind="capacity", target=body, law=law) for body in self.bodies(node)),
            changed=(Changed(what="capacity", of=node, nodes=(node,), sign=sign),),
        )

    def input_shift(self, name: str, law: Law, *, sign: int = 1) -> Act:
        """Input plus `law` as the machine feels it."""
        if name not in self.plant.inputs:
            raise UnfitError(name)
        return Act(
            changes=(ZooChange(kind="input", target=name, law=law),),
            changed=(Changed(what="input", of=name, nodes=(), sign=sign),),
        )

    # ------------------------------------------------------------------ parts that effects bring along

    def air(self) -> str:
        """Name of a boundary that is a part of the air.

        Raises
        ------
        UnfitError
            If the plant has none.
        """
        for boundary in self.plant.boundaries:
            if is_part(boundary.part_of, "air"):
                return boundary.name
        raise UnfitError("air")

    def boundary(self, name: str, temperature: Law) -> Parts:
        """A boundary of given temperature [degC] that an effect brings along."""
        return Parts(boundaries=(Boundary(name=name, temperature=temperature, part_of=""),))

    def follower(self, name: str, node: str, tau_s: float) -> Parts:
        """A small body that follows a node with a time constant: the feeler of a valve or thermostat."""
        body, size = max(self.capacities(node).items(), key=lambda item: item[1])
        small = 1e-4 * size
        return Parts(
            bodies=(Body(name=name, capacity=constant(small), part_of=""),),
            paths=(
                HeatPath(name=f"{name}-{body}", ends=(name, body), conductance=constant(small / tau_s), part_of=""),
            ),
            like={name: body},
        )

    def reservoir(self, name: str, capacity: float, to_air: float) -> Parts:
        """A body that only sheds heat to the air [W/K], until an effect connects it."""
        air = self.air()
        return Parts(
            bodies=(Body(name=name, capacity=constant(capacity), part_of=""),),
            paths=(HeatPath(name=f"{name}-{air}", ends=(name, air), conductance=constant(to_air), part_of=""),),
            like={name: ""},
        )

    def lag(self, rng: np.random.Generator, longest_s: float) -> float:
        """Time constant, drawn evenly from a minute on; at least a row, [s]."""
        return max(float(rng.uniform(60.0, longest_s)), self.plant.row_s)


def either(rng: np.random.Generator) -> int:
    """1 or -1."""
    return 1 if rng.random() < 0.5 else -1


def pick(names: Sequence[str], rng: np.random.Generator) -> str:
    """One of some names."""
    return names[int(rng.integers(len(names)))]
