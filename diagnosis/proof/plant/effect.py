"""Effects, and the grip by which they act on the plant."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Literal

import numpy as np

from diagnosis.proof.plant.anatomy import MESH, OIL, SPLASH, SUMP
from diagnosis.proof.plant.plant import Plant, PlantMoment
from models.base.types import Array

MEASUREMENT = "measurement"
Kind = Literal["source", "link", "loss_factor", "link_factor", "signal", "sensor", "parameter"]
Hook = Callable[["Grip"], None]
Spoil = Callable[["Concealed", "Recorded"], None]
Places = Callable[[Plant, np.random.Generator], tuple[str, ...]]
Draw = Callable[[Plant, np.random.Generator, float], Mapping[str, float]]


@dataclass(frozen=True)
class Effect:
    """Physics that the plant can hide.

    Attributes
    ----------
    places : callable
        Of the plant and a random generator: places of one specimen, the main one first
    draw : callable
        Of the plant, the generator and the strength (1 nominal): parameters of one specimen
    law : str
        The law in words and symbols, for the truth
    before, after : callable or None
        Act on the inputs before, and on heat and conductances after the losses are known
    spoil : callable or None
        Acts on what is recorded: of a fault of measurement
    after_noise : bool
        True if it acts on readings with noise and steps
    catalogue : bool
        Whether the diagnosis has a mechanism of this name
    """

    name: str
    kind: Kind
    places: Places
    draw: Draw
    law: str
    _: KW_ONLY
    family: str
    before: Hook | None = None
    after: Hook | None = None
    spoil: Spoil | None = None
    after_noise: bool = False
    catalogue: bool = True


def acts(
    kind: Kind, places: Places, draw: Draw, law: str, *,
    family: str, table: dict[str, Effect], on_inputs: bool = False, before: Hook | None = None, catalogue: bool = True,
) -> Callable[[Hook], Hook]:  # fmt: skip
    """Enter the decorated function into a table of effects, under its name.

    Parameters
    ----------
    on_inputs : bool
        True if the function acts before the losses are known, see :class:`Effect`
    before : callable or None
        A second function, which does
    """

    def enter(hook: Hook) -> Hook:
        name, hooks = hook.__name__, (hook, None) if on_inputs else (before, hook)
        table[name] = Effect(name, kind, places, draw, law, family=family, before=hooks[0], after=hooks[1],
                             catalogue=catalogue)  # fmt: skip
        return hook

    return enter


@dataclass(frozen=True, kw_only=True)
class Concealed:
    """One specimen of an effect: where it sits and how strong it is."""

    effect: Effect
    places: tuple[str, ...]
    parameters: Mapping[str, float]
    strength: float

    @property
    def is_fault(self) -> bool:
        """True if it acts in the measurement, not in the plant."""
        return self.effect.family == MEASUREMENT

    @property
    def key(self) -> str:
        """Specimens of one key act together."""
        return "@".join((self.effect.name, *self.places))


@dataclass(frozen=True, kw_only=True)
class Recorded:
    """A recording on its way, which faults of measurement change.

    Attributes
    ----------
    time : Array, shape (rows,)
        [s]
    housing : Array, shape (rows,)
        True temperature of the last part of the housing, [degC]
    inputs, readings : dict of str to Array, shape (rows,)
        Recorded inputs by name, and temperatures by place, [degC]
    """

    time: Array
    housing: Array
    inputs: dict[str, Array]
    readings: dict[str, Array]


class Grip:
    """The hold of one effect on the runs that have it; every value has the shape (m,) of these runs.

    Parameters
    ----------
    members : Array of int, shape (m,)
        Which runs of the batch
    specimens : sequence of Concealed
        One per member, all of the same effect and places
    positions : sequence of int
        Which of its run's effects each specimen is
    rows : int
        Of these runs

    Attributes
    ----------
    made : dict of place to Array, shape (rows, m)
        Heat [W] that the effect made
    memory : dict of str to Array, shape (m,)
        What the effect remembers from row to row; laws fill it
    """

    def __init__(
        self, plant: Plant, members: Sequence[int], specimens: Sequence[Concealed], positions: Sequence[int], rows: int
    ) -> None:
        self.plant, self.members, self.positions = plant, np.asarray(members), tuple(positions)
        self.places = specimens[0].places
        names = specimens[0].parameters
        self.p = {name: np.array([specimen.parameters[name] for specimen in specimens]) for name in names}
        self.moment: PlantMoment
        self.row, self.rows = 0, rows
        self.made: dict[str, Array] = {}
        self.memory: dict[str, Array] = {}

    # ------------------------------------------------------------------ reading

    @property
    def hours(self) -> Array:
        """Time since the recording was switched on, [h]; 0 before."""
        return np.asarray(self.moment.hours[self.members])

    @property
    def x(self) -> Array:
        """Speed over the top speed (20 m/s on the FZG rig), [-]."""
        return np.asarray(self.moment.speed[self.members] / self.plant.speed_top)

    @property
    def y(self) -> Array:
        """Torque over the reference torque (94 N m on the FZG rig), [-], >= 0."""
        return np.asarray(np.abs(self.moment.torque[self.members]) / self.plant.torque_ref)

    @property
    def air(self) -> Array:
        """Ambient temperature, [degC]."""
        return np.asarray(self.moment.air[self.members])

    def T(self, place: str) -> Array:
        """Temperature of a place, [degC]."""
        index = self.plant.anatomy.index
        return np.asarray(
            sum(w * self.moment.T[self.members, index[node]] for node, w in self.plant.anatomy.members(place).items())
        )

    def loss(self, component: str) -> Array:
        """Loss of a component as it stands, [W]."""
        return np.asarray(self.moment.loss[self.members, self.plant.components.index(component)])

    def remembered(self, name: str, start: Array | float) -> Array:
        """A memory, made at first use."""
        return self.memory.setdefault(name, np.broadcast_to(np.asarray(start, dtype=float), self.members.shape).copy())

    def switched(self, value: Array, on_above: Array, off_below: Array) -> Array:
        """1 from where `value` rises above `on_above` until it falls below `off_below`, else 0."""
        state = self.remembered("switch", 0.0)
        self.memory["switch"] = np.where(value > on_above, 1.0, np.where(value < off_below, 0.0, state))
        return self.memory["switch"]

    # ------------------------------------------------------------------ acting

    def heat(self, place: str, watts: Array, *, lost: bool) -> None:
        """Put heat into a place (``mesh`` included); `lost`: it is mechanical power, and shows in the measured loss."""
        members, moment, anatomy = self.members, self.moment, self.plant.anatomy
        spread = self.plant.mesh_spread if place == MESH else anatomy.members(place)
        for node, weight in spread.items():
            moment.heat[members, anatomy.index[node]] += weight * watts
        if lost:
            moment.lost[members] += watts
        self._note(place, watts)

    def factor(self, component: str, change: Array) -> None:
        """Change a loss by a relative amount."""
        column = self.plant.components.index(component)
        more = change * self.moment.loss[self.members, column]
        self.moment.loss[self.members, column] += more
        self._note(self.plant.place_of(component), more)

    def conduct(self, path: str, change: Array, *, place: str) -> None:
        """Change the conductance of a path by a relative amount; `place` is where its heat is counted."""
        members, moment, anatomy = self.members, self.moment, self.plant.anatomy
        home = self._nodes_of(place)
        for column in self.plant.columns[path]:
            more = change * moment.G[members, column]
            a, b = int(self.plant.a[column]), int(self.plant.b[column])
            T_a, T_b = (moment.air[members] if i in anatomy.boundary else moment.T[members, i] for i in (a, b))
            moment.G[members, column] += more
            self._note(place, more * ((T_b - T_a) if a in home else (T_a - T_b)))

    def sink(self, place: str, G: Array, T_other: Array) -> Array:
        """A heat path [W/K] to something of a given temperature [degC]; returns the heat that the place takes, [W]."""
        members, moment = self.members, self.moment
        for node, weight in self.plant.anatomy.members(place).items():
            i = self.plant.anatomy.index[node]
            moment.ground[members, i] += weight * G
            moment.ground_heat[members, i] += weight * G * T_other
        watts = np.asarray(G * (T_other - self.T(place)))
        self._note(place, watts)
        return watts

    def capacity(self, place: str, change: Array) -> None:
        """Change the heat capacity of a place by a relative amount."""
        for node in self._nodes_of(place):
            self.moment.capacity[self.members, node] *= 1.0 + change

    def _nodes_of(self, place: str) -> tuple[int, ...]:
        anatomy = self.plant.anatomy
        if place == OIL:
            return anatomy.index[SUMP], anatomy.index[SPLASH]
        return tuple(i for name, i in anatomy.index.items() if name == place or name.startswith(f"{place}."))

    def _note(self, place: str, watts: Array) -> None:
        if place not in self.made:
            self.made[place] = np.zeros((self.rows, len(self.members)))
        self.made[place][self.row] += watts
