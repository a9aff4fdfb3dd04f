"""The heat balance of a plant at one moment, from its laws and the changes of its runs.

A moment holds any number of instants: B runs at one time, or one run at all its times. A law's reads are noted once, so
that laws of parameters alone are evaluated once and a derivative evaluates only the laws that its variable reaches.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from scipy.sparse import coo_array

from diagnosis.proof.zoo.structure import Law, Moment, ZooChange, ZooPlant
from models.base.types import Array

Key = tuple[str, str]
Acting = Sequence[tuple[ZooChange, Array | slice]]  # a change and the columns of a moment that it acts on


@dataclass(kw_only=True, eq=False)
class ZooBalance:
    """Heat balance of all bodies, one column per instant.

    Attributes
    ----------
    T : mapping of str to Array, shape (B,)
        Of bodies and boundaries, [degC]
    G : Array, shape (paths + bridges, B)
        Conductances, [W/K]
    C : Array, shape (bodies, B)
        Capacities, [J/K]
    q : Array, shape (bodies, B)
        Heat made in bodies, [W]
    loss : Array, shape (B,)
        Mechanical power lost, [W]
    made : list of Array, shape (B,)
        Per change: what it adds to a conductance [W/K], power [W], capacity [J/K] or input
    """

    T: Mapping[str, Array]
    G: Array
    C: Array
    q: Array
    loss: Array
    made: list[Array]


class ZooLaws:
    """Laws of a plant in the order boundaries, paths, sources, capacities.

    Parameters
    ----------
    bridges : sequence of ZooChange
        Changes that add a path
    """

    def __init__(self, plant: ZooPlant, bridges: Sequence[ZooChange] = ()) -> None:
        self.plant = plant
        self.bodies = [body.name for body in plant.bodies]
        self.body = {name: k for k, name in enumerate(self.bodies)}
        self.boundaries = [boundary.name for boundary in plant.boundaries]
        self.path = {path.name: k for k, path in enumerate(plant.paths)}
        self.source = {source.name: k for k, source in enumerate(plant.sources)}
        self.bridge = {id(change): len(plant.paths) + k for k, change in enumerate(bridges)}
        self.ends = [path.ends for path in plant.paths] + [(change.target, change.other) for change in bridges]
        self.laws: list[Law] = [
            *(boundary.temperature for boundary in plant.boundaries),
            *(path.conductance for path in plant.paths),
            *(source.power for source in plant.sources),
            *(body.capacity for body in plant.bodies),
        ]
        self.cut = np.cumsum([len(plant.boundaries), len(plant.paths), len(plant.sources)])
        self.spread = np.zeros((len(self.bodies), len(plant.sources)))
        for k, source in enumerate(plant.sources):
            for body, share in source.spread.items():
                self.spread[self.body[body], k] = share
        self.is_loss = np.array([float(source.is_loss) for source in plant.sources])
        self._lay_paths()

    def _lay_paths(self) -> None:
        """Linear maps from conductances to the matrix of the balance and to the heat from boundaries."""
        n = len(self.bodies)
        rows: list[int] = []
        columns: list[int] = []
        signs: list[float] = []
        self.from_boundary: list[tuple[int, int, str]] = []  # path, body, boundary
        for k, ends in enumerate(self.ends):
            i, j = self.body.get(ends[0]), self.body.get(ends[1])
            for own in (i, j):
                if own is not None:
                    rows, columns, signs = [*rows, own * n + own], [*columns, k], [*signs, 1.0]
            if i is not None and j is not None:
                rows, columns, signs = [*rows, i * n + j, j * n + i], [*columns, k, k], [*signs, -1.0, -1.0]
            elif i is not None:
                self.from_boundary.append((k, i, ends[1]))
            elif j is not None:
                self.from_boundary.append((k, j, ends[0]))
        self.to_matrix = coo_array((signs, (rows, columns)), shape=(n * n, len(self.ends))).tocsr()
        held = [path for path, _, _ in self.from_boundary]
        self.boundary_paths = np.array(held, dtype=int)
        self.to_bodies = np.zeros((n, len(held)))
        for column, (_, body, _) in enumerate(self.from_boundary):
            self.to_bodies[body, column] = 1.0

    # ------------------------------------------------------------------ what laws read

    def note_reads(self, moment: Moment) -> None:
        """Find out what every law reads, at any moment."""
        boundaries = {name: law(moment) for name, law in zip(self.boundaries, self.laws, strict=False)}
        whole = replace(moment, T={**moment.T, **boundaries})
        self.reads: list[set[Key]] = []
        for law in self.laws:
            noted = _Noted(whole)
            law(cast(Moment, noted))
            self.reads.append(noted.notes)
        for k in range(len(self.boundaries), len(self.laws)):
            for kind, name in tuple(self.reads[k]):
                if kind == "T" and name in boundaries:
                    self.reads[k] |= self.reads[self.boundaries.index(name)]

    def reached_by(self, key: Key) -> list[int]:
        """Laws that read an input, a parameter or the temperature of a body."""
        return [k for k, reads in enumerate(self.reads) if key in reads]

    def changing(self) -> list[int]:
        """Laws that read more than parameters."""
        return [k for k, reads in enumerate(self.reads) if any(kind != "p" for kind, _ in reads)]

    # ------------------------------------------------------------------ values

    def values(self, moment: Moment, *, held: Array | None = None, fresh: Sequence[int] | None = None) -> Array:
        """Values of all laws, shape (laws, B).

        Parameters
        ----------
        moment : Moment
            With the temperatures of bodies
        held : Array, shape (laws, B), or None
            Values of the laws that are not in `fresh`
        fresh : sequence of int or None
            Laws to evaluate, in order; None: all
        """
        values = np.empty((len(self.laws), len(moment.hours))) if held is None else held.copy()
        chosen, count = range(len(self.laws)) if fresh is None else fresh, len(self.boundaries)
        for k in chosen:
            if k < count:
                values[k] = self.laws[k](moment)
        whole = replace(moment, T=self.temperatures(moment, values))
        for k in chosen:
            if k >= count:
                values[k] = self.laws[k](whole)
        return values

    def temperatures(self, moment: Moment, values: Array) -> Mapping[str, Array]:
        """Temperatures of bodies and boundaries."""
        return {**moment.T, **dict(zip(self.boundaries, values, strict=False))}

    def balance(self, moment: Moment, values: Array, acting: Acting) -> ZooBalance:
        """Heat balance with all changes but those of inputs, which `moment` and `values` already hold."""
        _, G, P, C = np.split(values, self.cut)
        B = values.shape[1]
        T = self.temperatures(moment, values)
        whole = replace(moment, T=T)
        bridges = np.zeros((len(self.ends) - len(G), B))
        G, P, C = np.concatenate([G, bridges]), P.copy(), C.copy()
        extra, extra_loss, made = np.zeros((len(self.bodies), B)), np.zeros(B), []
        for change, members in acting:
            amount = np.zeros(B)
            amount[members] = np.broadcast_to(change.law(whole), (B,))[members]
            if change.kind == "path":
                k = self.path[change.target]
                amount = amount * G[k]
                G[k] += amount
            elif change.kind == "bridge":
                G[self.bridge[id(change)]] += amount
            elif change.kind == "source":
                k = self.source[change.target]
                amount = amount * P[k]
                P[k] += amount
            elif change.kind == "capacity":
                k = self.body[change.target]
                amount = amount * C[k]
                C[k] += amount
            elif change.kind == "heat":
                extra[self.body[change.target]] += amount
                if change.other in self.body:
                    extra[self.body[change.other]] -= amount
                extra_loss += change.is_loss * amount
            made.append(amount)
        return ZooBalance(T=T, G=G, C=C, q=self.spread @ P + extra, loss=self.is_loss @ P + extra_loss, made=made)

    def matrix(self, G: Array) -> Array:
        """Conductances between bodies, shape (B, bodies, bodies), [W/K]."""
        n = len(self.bodies)
        return np.ascontiguousarray((self.to_matrix @ G).T).reshape(-1, n, n)

    def heat_from_boundaries(self, balance: ZooBalance) -> Array:
        """Conductance to a boundary times its temperature, shape (bodies, B), [W]."""
        if not self.from_boundary:
            return np.zeros_like(balance.q)
        T = np.stack([balance.T[name] for _, _, name in self.from_boundary])
        return np.asarray(self.to_bodies @ (balance.G[self.boundary_paths] * T))


def feel(moment: Moment, acting: Acting) -> Moment:
    """Moment with the inputs as the machine feels them: with what changes of kind ``input`` add."""
    inputs = dict(moment.inputs)
    for change, members in acting:
        if change.kind == "input":
            amount = np.zeros(len(moment.hours))
            amount[members] = np.broadcast_to(change.law(moment), amount.shape)[members]
            inputs[change.target] = inputs[change.target] + amount
    return replace(moment, inputs=inputs)


class _Noted:
    """A moment that notes what is read from it."""

    def __init__(self, moment: Moment) -> None:
        self.moment, self.notes = moment, cast("set[Key]", set())
        self.inputs = _NotedMapping("inputs", moment.inputs, self.notes)
        self.T = _NotedMapping("T", moment.T, self.notes)
        self.p = _NotedMapping("p", moment.p, self.notes)

    @property
    def hours(self) -> Array:
        self.notes.add(("time", "hours"))
        return self.moment.hours

    @property
    def since_start(self) -> Array:
        self.notes.add(("time", "since_start"))
        return self.moment.since_start


class _NotedMapping(Mapping[str, Array]):
    def __init__(self, kind: str, content: Mapping[str, Array], notes: set[Key]) -> None:
        self.kind, self.content, self.notes = kind, content, notes

    def __getitem__(self, name: str) -> Array:
        self.notes.add((self.kind, name))
        return self.content[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.content)

    def __len__(self) -> int:
        return len(self.content)
