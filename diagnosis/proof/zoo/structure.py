"""A plant as an abstract graph: bodies that store heat, paths between them, sources of heat, and probes.

Laws are functions of a :class:`Moment`, many runs at once. What a plant is made of refers to the nominal model by names
only: ``part_of`` states which node, link or source of the nominal network a thing is a piece of.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from models.base.types import Array


@dataclass(frozen=True, kw_only=True, eq=False)
class Moment:
    """The middle of a step, of B runs at once; every value has the shape (B,).

    Attributes
    ----------
    hours : Array
        Since the first row of the first recording of the session, [h]; it runs on through later recordings
    since_start : Array
        Since the first row of this recording, [h]; 0 before it
    inputs : mapping of str to Array
        True inputs of the machine by their names in the nominal network (``speed`` [1/min], ``torque`` [N m],
        ``T_ambient`` [degC], ...)
    T : mapping of str to Array
        Temperatures of bodies and boundaries by name, [degC]
    p : mapping of str to Array
        Parameters of the plant by name
    """

    hours: Array
    since_start: Array
    inputs: Mapping[str, Array]
    T: Mapping[str, Array]
    p: Mapping[str, Array]


Law = Callable[[Moment], Array]
Kind = Literal["path", "source", "capacity", "heat", "bridge", "input"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Body:
    """Something that stores heat.

    Attributes
    ----------
    capacity : Law
        [J/K]
    part_of : str
        Node of the nominal network, e.g. ``housing_lower``; several joined by ``+`` if it is made of several
    """

    name: str
    capacity: Law
    part_of: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Boundary:
    """A temperature that the plant does not change.

    Attributes
    ----------
    temperature : Law
        [degC]
    part_of : str
        Boundary node of the nominal network, e.g. ``air``
    """

    name: str
    temperature: Law
    part_of: str


@dataclass(frozen=True, kw_only=True, eq=False)
class HeatPath:
    """A way for heat between two bodies, or a body and a boundary.

    Attributes
    ----------
    ends : (str, str)
    conductance : Law
        [W/K]
    part_of : str
        Link of the nominal network by its name there, e.g. ``oil-housing_lower``, several joined by ``+``; of a path
        inside one nominal node the name of this node; empty if the nominal network has no such link
    """

    name: str
    ends: tuple[str, str]
    conductance: Law
    part_of: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Source:
    """Heat that is made in the machine.

    Attributes
    ----------
    power : Law
        [W]
    spread : mapping of str to float
        Share of every body; the sum is 1
    is_loss : bool
        True if it is mechanical power that a measured total loss shows
    part_of : str
        Component or source of the nominal model, e.g. ``churning``, ``mesh_sliding``, ``bearing_1``, ``seal_input``;
        several joined by ``+``
    """

    name: str
    power: Law
    spread: Mapping[str, float]
    is_loss: bool
    part_of: str


@dataclass(frozen=True, kw_only=True)
class Probe:
    """A temperature sensor at its seat.

    Attributes
    ----------
    channel : str
        Name of the channel in a recording, mostly a nominal node
    mix : mapping of str to float
        Weights of bodies and boundaries whose temperature it shows; the sum is 1
    lag_s : float
        Time constant, [s]
    """

    channel: str
    mix: Mapping[str, float]
    lag_s: float


@dataclass(frozen=True, kw_only=True, eq=False)
class ZooPlant:
    """One machine of the zoo.

    Attributes
    ----------
    gearbox : str
        Name or file of the nominal definition that a diagnosis gets
    inputs : tuple of str
        Names of the inputs that its laws read
    parameters : mapping of str to float
        Of this machine
    spread : mapping of str to float
        Standard deviation of the logarithm of every parameter between machines of this family; a parameter that may be
        zero or negative is not in it
    loss_W : float
        Typical mechanical loss or heat input, [W]
    row_s : float
        Interval of the recordings, [s]
    """

    family: str
    gearbox: str
    inputs: tuple[str, ...]
    bodies: tuple[Body, ...]
    boundaries: tuple[Boundary, ...]
    paths: tuple[HeatPath, ...]
    sources: tuple[Source, ...]
    probes: tuple[Probe, ...]
    parameters: Mapping[str, float]
    spread: Mapping[str, float]
    loss_W: float
    row_s: float = 10.0


@dataclass(frozen=True, kw_only=True, eq=False)
class ZooChange:
    """A departure of one run from its plant: a concealed effect, or a direction in which an oracle looks.

    Attributes
    ----------
    kind : str
        ``path``: conductance of `target` times ``1 + law``; ``source``: power of `target` times ``1 + law``;
        ``capacity``: of body `target` times ``1 + law``; ``heat``: `law` [W] into body `target` (out of `other` if that
        is given: heat that goes elsewhere); ``bridge``: a further path of `law` [W/K] between `target` and `other`;
        ``input``: input `target` plus `law`, as the machine feels it and the recorder does not
    target : str
    law : Law
        May read everything of the moment, ``hours`` for changes at a date
    other : str
    is_loss : bool
        Of a ``heat``: True if a measured total loss shows it; that of ``source`` follows the source
    """

    kind: Kind
    target: str
    law: Law
    other: str = ""
    is_loss: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Variant:
    """One run of a batch: parameters that differ from the plant's, and changes.

    Attributes
    ----------
    parameters : mapping of str to float
        Values in place of the plant's own
    quiet : bool
        True to leave out the random heats
    """

    parameters: Mapping[str, float] = field(default_factory=dict)
    changes: tuple[ZooChange, ...] = ()
    quiet: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class ZooOutcome:
    """Result of the recorded rows of B runs.

    Attributes
    ----------
    T : mapping of str to Array, shape (B, rows)
        Temperatures of bodies and boundaries, [degC]
    readings : mapping of str to Array, shape (B, rows)
        Of every probe, with its lag, without noise, [degC]
    P_loss : Array, shape (B, rows)
        Mechanical loss, [W]
    heat : sequence of B mappings of int to Array, shape (rows,)
        Heat [W] that each change of a run, by its place in ``changes``, made: of a ``path`` or ``bridge`` the further
        heat that flows from the first end to the second
    """

    T: Mapping[str, Array]
    readings: Mapping[str, Array]
    P_loss: Array
    heat: Sequence[Mapping[int, Array]]


def constant(value: float) -> Law:
    """A law that has one value at all times."""
    return lambda m: np.full_like(m.hours, value)


def times(factor: float, law: Law) -> Law:
    """A law times a number."""
    return lambda m: np.asarray(factor * law(m))
