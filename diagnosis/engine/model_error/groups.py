"""The groups of model error: one declaration each of what it changes, where, and along which courses.

Every group lists changes for a machine by rules of its structure, never by names, so that they hold for every
definition. The first eleven are the base groups; the others are finer and belong to the largest class only.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from diagnosis.engine.model_error import heats
from diagnosis.engine.model_error.anatomy import AMBIENT, Anatomy, Family
from diagnosis.engine.model_error.courses import (
    AFTER_START,
    CONSTANT,
    LAGGED_DRIVE,
    SINCE_START,
    SPEED,
    TEMPERATURE,
    TORQUE,
    Course,
    OwnTemperature,
    Smooth,
    View,
)
from diagnosis.forward.recurrence import lagged
from diagnosis.forward.trajectory import Heat
from models.base.types import Array
from models.quantities.quantities import TOTAL_LOSS

DEGREE, JOINT_DEGREE = 3, 2  # of smooth laws: of one law or few, and of many links together
FINE_DEGREES = (4, 5)
FEW = 3  # links of a family that have a law each
SENSOR_LAGS_S = (150.0, 600.0)
CORE_TIMES_S = (150.0, 600.0, 2400.0)
MASS_TIMES_S = (9_600.0, 38_400.0)


@dataclass(frozen=True, kw_only=True)
class HeatChange:
    """Heat somewhere along some courses: one unknown per course.

    Attributes
    ----------
    heat : callable
        Heat per unit along the piece of a view
    """

    place: str
    heat: Callable[[View], Heat]
    course: Course = CONSTANT

    @property
    def labels(self) -> tuple[str, ...]:
        """One name per unknown."""
        return tuple(f"{self.place}, {label}" for label in self.course.labels)


@dataclass(frozen=True, kw_only=True)
class ReadingChange:
    """Another reading of one channel: one unknown.

    Attributes
    ----------
    reading : callable
        Change of a channel per unit along the piece of a view, shape (K + 1,), [K] or [W]
    """

    channel: str
    what: str
    reading: Callable[[View, str], Array]

    @property
    def labels(self) -> tuple[str, ...]:
        """One name."""
        return (f"{self.channel}, {self.what}",)


Change = HeatChange | ReadingChange


@dataclass(frozen=True, kw_only=True)
class Near:
    """A thermometer feels a neighbour of its node."""

    node: str

    def __call__(self, view: View, channel: str) -> Array:
        """Along a piece, per share."""
        return _followed(view, channel, self.node) - _followed(view, channel)


@dataclass(frozen=True, kw_only=True)
class Late:
    """A share of what a thermometer feels comes with a time constant, [s]."""

    time: float

    def __call__(self, view: View, channel: str) -> Array:
        """Along a piece, per share."""
        T = _followed(view, channel)
        return np.asarray(lagged(T, view.piece.steps, self.time) - T)


def _followed(view: View, channel: str, node: str | None = None) -> Array:
    """Temperature of a node, by default the sensor's own, as slow as the sensor follows it, shape (K + 1,), [degC]."""
    sensors, own = view.point.sensors, view.model.parts[view.model.part_index(channel)]
    T = view.temperature_at_points(node or own)
    return lagged(T, view.piece.steps, float(sensors.lag[sensors.channels.index(channel)]))


# ---------------------------------------------------------------------- base groups


def loss_laws(machine: Anatomy) -> Iterator[Change]:
    """Heat of sources by what they depend on; of several in a family, or without a parameter, a factor each."""
    for family in machine.source_families:
        yield _of_sources(family.name, family.members, Smooth(coordinates=family.coordinates, highest=DEGREE))
        if len(family.members) > 1 or not family.calibrated:
            yield from (_of_sources(name, (name,)) for name in family.members)


def link_laws(machine: Anatomy) -> Iterator[Change]:
    """Conductances by temperature, speed and what they depend on; a factor each."""
    for family in machine.link_families:
        if smooth := _link_course(machine, family):
            groups = [(name,) for name in family.members] if len(family.members) <= FEW else [family.members]
            yield from (_of_links(group[0] if len(group) == 1 else family.name, group, smooth) for group in groups)
        yield from (_of_links(name, (name,)) for name in family.members)


def heat_splits(machine: Anatomy) -> Iterator[Change]:
    """A share of the heat of a source goes to another part; sources of a family in one part go together."""
    for family in machine.source_families:
        nodes = {source.name: source.node for source in machine.network.sources}
        for node in dict.fromkeys(nodes[name] for name in family.members):
            names = tuple(name for name in family.members if nodes[name] == node)
            for target in machine.split_targets(node):
                heat = heats.SplitHeat(names=names, target=target)
                yield HeatChange(place=f"{' '.join(names)} to {target}", heat=heat)


def sensor_places(machine: Anatomy) -> Iterator[Change]:
    """A thermometer feels a neighbour of its node."""
    for channel in machine.thermometers:
        for node in machine.around_sensor(channel):
            yield ReadingChange(channel=channel, what=f"near {node}", reading=Near(node=node))


def slow_sensors(machine: Anatomy) -> Iterator[Change]:
    """A share of a thermometer's reading comes late."""
    for channel in machine.thermometers:
        for time in machine.resolved(SENSOR_LAGS_S):
            yield ReadingChange(channel=channel, what=f"{time:g} s late", reading=Late(time=time))


def slow_cores(machine: Anatomy) -> Iterator[Change]:
    """A share of a part's capacity lies in a core that follows slowly."""
    for part in machine.parts:
        for time in machine.resolved(CORE_TIMES_S):
            yield HeatChange(place=f"core of {part}, {time:g} s", heat=partial(heats.core_heat, part=part, time=time))


def slow_masses(machine: Anatomy) -> Iterator[Change]:
    """A mass behind a part that gives heat to the surroundings: a frame, a bed, a foundation.

    Where random heat may last for hours, it represents them.
    """
    for part in () if machine.random_heat_lasts else machine.outer:
        for time in MASS_TIMES_S:
            yield HeatChange(place=f"mass at {part}, {time:g} s", heat=partial(heats.mass_heat, part=part, time=time))


def missing_links(machine: Anatomy) -> Iterator[Change]:
    """A heat path between nodes that have none, as a share of the machine's conductance."""
    for pair in machine.unlinked:
        yield HeatChange(place="-".join(pair), heat=partial(heats.pair_heat, pair=pair))


def input_errors(machine: Anatomy) -> Iterator[Change]:
    """Offset of the torque, gains of the other inputs, offsets of temperatures; those of the calibration left out."""
    for name in machine.names:
        if name in (SPEED, TORQUE) and not {SPEED, TORQUE} <= set(machine.coordinates):
            continue
        if name == TORQUE:
            yield HeatChange(place="offset of torque", heat=heats.torque_heat)
        elif machine.network.inputs[name].quantity.is_temperature:
            if name != AMBIENT:
                yield HeatChange(place=f"offset of {name}", heat=partial(heats.offset_heat, name=name))
        elif machine.standard.largest[name] > 0.0:
            yield HeatChange(place=f"gain of {name}", heat=partial(heats.gain_heat, name=name))


def capacities(machine: Anatomy) -> Iterator[Change]:
    """Heat capacity of every part."""
    return (HeatChange(place=f"capacity of {part}", heat=partial(heats.capacity_heat, part=part))
            for part in machine.parts)  # fmt: skip


def loss_zero(machine: Anatomy) -> Iterator[Change]:
    """Zero of the measured total loss, as a share of the mean heat."""
    if TOTAL_LOSS in machine.channels:
        yield ReadingChange(channel=TOTAL_LOSS, what="zero", reading=_zero)


# ---------------------------------------------------------------------- finer groups


def fine_loss_laws(machine: Anatomy) -> Iterator[Change]:
    """Loss laws of higher degree."""
    for family in machine.source_families:
        course = Smooth(coordinates=family.coordinates, lowest=FINE_DEGREES[0], highest=FINE_DEGREES[1])
        yield _of_sources(family.name, family.members, course)


def losses_by_own_temperature(machine: Anatomy) -> Iterator[Change]:
    """Heat of sources by how much warmer than the oil their own parts are."""
    by = tuple(name for name in (SPEED,) if name in machine.coordinates)
    for source in machine.network.sources:
        if own := machine.own_nodes(source):
            yield _of_sources(source.name, (source.name,), OwnTemperature(nodes=own, coordinates=by))


def memories(machine: Anatomy) -> Iterator[Change]:
    """Losses and links by the operation before."""
    return _everything(machine, LAGGED_DRIVE)


def ageing(machine: Anatomy) -> Iterator[Change]:
    """Losses and links by the hours, losses by the time after the start."""
    yield from _everything(machine, SINCE_START)
    yield from (_of_sources(source.name, (source.name,), AFTER_START) for source in machine.network.sources)


GROUPS: Mapping[str, Callable[[Anatomy], Iterator[Change]]] = {
    "a_loss": loss_laws, "a_link": link_laws, "b_split": heat_splits, "c_sensor": sensor_places,
    "c_lag": slow_sensors, "d_sub": slow_cores, "mass": slow_masses, "e_link": missing_links, "f_input": input_errors,
    "g_cap": capacities, "p_zero": loss_zero,
    "law_deg5": fine_loss_laws, "loss_own": losses_by_own_temperature, "lag": memories, "hours": ageing,
}  # fmt: skip


# ---------------------------------------------------------------------- pieces of the declarations


def _of_sources(place: str, names: tuple[str, ...], course: Course = CONSTANT) -> HeatChange:
    return HeatChange(place=f"heat of {place}", heat=heats.SourceHeat(names=names), course=course)


def _of_links(place: str, names: tuple[str, ...], course: Course = CONSTANT) -> HeatChange:
    return HeatChange(place=f"path {place}", heat=heats.LinkHeat(names=names), course=course)


def _everything(machine: Anatomy, course: Course) -> Iterator[Change]:
    yield from (_of_sources(source.name, (source.name,), course) for source in machine.network.sources)
    yield from (_of_links(link.name, (link.name,), course) for link in machine.conducting)


def _link_course(machine: Anatomy, family: Family) -> Smooth | None:
    """Free convection outside, flow inside; a few others by their own laws, many together by operation."""
    by = tuple(name for name in (SPEED, TEMPERATURE) if name in machine.coordinates)
    ends = [set(link.nodes) for link in machine.conducting if link.name in family.members]
    if not any(nodes <= set(machine.parts) for nodes in ends):
        more = [name for name in family.coordinates if name not in (SPEED, TORQUE, TEMPERATURE)]
        by, degree = (TEMPERATURE, *more), DEGREE
    elif len(family.members) > FEW:
        degree = JOINT_DEGREE
    elif all(machine.oil in nodes for nodes in ends):
        degree = DEGREE
    else:
        by, degree = family.coordinates, JOINT_DEGREE
    return Smooth(coordinates=by, highest=degree) if by else None


def _zero(view: View, _: str) -> Array:
    return np.full(len(view.trajectory.T), view.standard.heat)
