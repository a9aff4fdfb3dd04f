"""The structure of a machine as model error needs it: families of laws and their coordinates, neighbours, sizes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from diagnosis.engine.fit import Experiment
from diagnosis.engine.model_error.courses import SPEED, TEMPERATURE, TORQUE, Coordinate, Standard
from diagnosis.engine.point import Point
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.observation import boundary_temperatures
from models.base.types import Array
from models.quantities.quantities import is_total_loss
from models.simulation.thermal_network import Link, Source, ThermalNetwork

OIL, AMBIENT = "oil", "T_ambient"
FLOOR_SHARE = 0.01  # of the largest speed or torque: less is standstill
LEAST_LOG_SD, LEAST_K, LEAST_SHARE = 0.3, 5.0, 0.01  # of coordinates: of logarithms, temperatures, other inputs
DRIVE_SHARE, DAY_PART, LEAST_HOURS_S = 0.6, 0.3, 36_000.0
LEAST_RISE_K = 5.0
PROBES, PROBE_SHARE, PROBE_K, FELT = 40, 1.2, 10.0, 1e-4
NEIGHBOURS, MOST_PAIRS = 4, 120
RESOLVED = 0.5  # of the time between rows: faster memories do not show


@dataclass(frozen=True, kw_only=True)
class Family:
    """Sources or links that are scaled by one parameter.

    Attributes
    ----------
    coordinates : tuple of str
        Quantities that their laws depend on
    calibrated : bool
        True if a parameter scales them already
    """

    name: str
    members: tuple[str, ...]
    coordinates: tuple[str, ...]
    calibrated: bool


class Anatomy:
    """Laws and places that model error may act on, in one order for all pieces.

    Parameters
    ----------
    points : sequence of Point
        Its pieces, simulated: they give the sizes
    """

    def __init__(self, experiment: Experiment, points: Sequence[Point]) -> None:
        self.model: NetworkOnGrid = experiment.machine.model
        self.network: ThermalNetwork = self.model.network
        self.points = points
        self.channels = experiment.pieces[0].channels
        self.parts = self.model.parts
        self.oil = OIL if OIL in self.parts else None
        self.steps = np.concatenate([point.piece.steps for point in points])
        self.inputs = np.concatenate([point.piece.inputs for point in points])
        self.names = experiment.machine.inputs
        self.random_heat_lasts = experiment.noise[0].goes_with_capacity
        self.conducting = [link for link in self.network.links if not link.conductance.is_zero]

    # ------------------------------------------------------------------ sizes

    def mean(self, values: Array) -> Array:
        """Mean over the time of all pieces, along the first axis."""
        return np.asarray(np.average(values, axis=0, weights=self.steps))

    @cached_property
    def temperatures(self) -> Mapping[str, Array]:
        """Temperatures of all nodes at the middles of all intervals, [degC]."""
        rows = [point.trajectory for point in self.points]
        T = np.concatenate([t.middle for t in rows])
        found = {part: T[:, index] for index, part in enumerate(self.parts)}
        of_rows = [boundary_temperatures(self.model, t) for t in rows]
        return found | {name: np.concatenate([each[name] for each in of_rows]) for name in self.model.laws.boundaries}

    @cached_property
    def sources_W(self) -> Array:
        """Heats of all sources, shape (rows, sources)."""
        return np.concatenate([point.balance.sources for point in self.points])

    @cached_property
    def conductances(self) -> Mapping[str, float]:
        """Mean conductance of every link, [W/K]."""
        mean = self.mean(np.concatenate([point.balance.conductances for point in self.points]))
        return {link.name: float(value) for link, value in zip(self.network.links, mean, strict=True)}

    @cached_property
    def ambient(self) -> str | None:
        """The boundary with most heat paths."""
        count = {name: sum(name in link.nodes for link in self.conducting) for name in self.model.laws.boundaries}
        return max(count, key=lambda name: count[name], default=None)

    @cached_property
    def outer(self) -> tuple[str, ...]:
        """Parts with a heat path to the surroundings."""
        near = {node for link in self.conducting if self.ambient in link.nodes for node in link.nodes}
        return tuple(part for part in self.parts if part in near)

    @cached_property
    def warm(self) -> tuple[str, ...]:
        """The oil, or the parts that sources heat."""
        heated = tuple(dict.fromkeys(source.node for source in self.network.sources))
        return (self.oil,) if self.oil else heated or tuple(self.parts)

    @cached_property
    def standard(self) -> Standard:
        """Sizes over all pieces."""
        largest = {name: float(np.abs(column).max()) for name, column in zip(self.names, self.inputs.T, strict=True)}
        drive = np.abs(self.sources_W.sum(axis=1)).max()
        T = np.stack([self.temperatures[part] for part in self.parts], axis=1)
        outside = self.temperatures[self.ambient] if self.ambient else T.min()
        rise = float(np.sqrt(self.mean(np.square(T - np.reshape(outside, (-1, 1))).mean(axis=1))))
        heat = float(self.mean(np.abs(self.sources_W).sum(axis=1)))
        last = max(float(point.piece.time[-1]) for point in self.points)
        return Standard(
            coordinates=self.coordinates, warm=self.warm, largest=largest,
            drive=DRIVE_SHARE * max(largest[SPEED] if SPEED in self.coordinates else float(drive), 1e-6),
            hours_s=max(LEAST_HOURS_S, DAY_PART * last), heat=heat, conductance=heat / max(rise, LEAST_RISE_K),
        )  # fmt: skip

    @cached_property
    def coordinates(self) -> Mapping[str, Coordinate]:
        """Standardised over the rows: speed and torque while the machine turns."""
        found = {}
        columns = dict(zip(self.names, np.abs(self.inputs).T, strict=True))
        floors = {name: FLOOR_SHARE * float(columns[name].max()) for name in (SPEED, TORQUE)}
        turning = columns[SPEED] > floors[SPEED]
        for name, floor in floors.items():
            if floor > 0.0:
                rows = turning if turning.any() else columns[name] > floor
                mean, sd = self._spread(np.log(np.maximum(columns[name], floor)), rows)
                found[name] = Coordinate(mean=mean, sd=max(sd, LEAST_LOG_SD), floor=floor)
        T = np.mean([self.temperatures[part] for part in self.warm], axis=0)
        mean, sd = self._spread(T, np.ones(len(T), dtype=bool))
        found[TEMPERATURE] = Coordinate(mean=mean, sd=max(sd, LEAST_K))
        for name, column in zip(self.names, self.inputs.T, strict=True):
            mean, sd = self._spread(column, np.ones(len(T), dtype=bool))
            if name not in (SPEED, TORQUE) and sd > LEAST_SHARE * float(np.abs(column).max()):
                found[name] = Coordinate(mean=mean, sd=sd)
        return found

    def _spread(self, values: Array, rows: Array) -> tuple[float, float]:
        weights = np.where(rows, self.steps, 0.0)
        mean = float(np.average(values, weights=weights))
        return mean, float(np.sqrt(np.average(np.square(values - mean), weights=weights)))

    # ------------------------------------------------------------------ laws

    @cached_property
    def felt_by_losses(self) -> Mapping[str, tuple[str, ...]]:
        """Coordinates that every loss of the loss model depends on: tried out on some rows."""
        losses, components = self.model.losses, self.network.components
        if not components:
            return {}
        rows = np.linspace(0, len(self.steps) - 1, min(PROBES, len(self.steps))).astype(int)
        speed, torque = (self.inputs[rows, self.names.index(name)] for name in (SPEED, TORQUE))
        T = np.stack([self.temperatures[node][rows] for node in losses.temperature_nodes], axis=1)
        here = losses.power(speed, torque, T)
        there = {
            SPEED: losses.power(PROBE_SHARE * speed, torque, T),
            TORQUE: losses.power(speed, PROBE_SHARE * torque, T),
            TEMPERATURE: losses.power(speed, torque, T + PROBE_K),
        }
        size = FELT * np.abs(here).max(axis=0)
        felt = {name: np.abs(power - here).max(axis=0) > size for name, power in there.items()}
        return {component: tuple(name for name in there if felt[name][index] and name in self.coordinates)
                for index, component in enumerate(components)}  # fmt: skip

    def _felt(self, law: Source | Link) -> set[str]:
        expression = law.heat if isinstance(law, Source) else law.conductance
        names = {s.name for s in expression.free_symbols}
        felt = {name for name in names if name in self.coordinates and name != AMBIENT}
        if any(name == f"T_{node}" for name in names for node in self.network.node_names):
            felt.add(TEMPERATURE)
        for component, also in self.felt_by_losses.items():
            felt |= set(also) if f"P_{component}" in names else set()
        return felt

    def _families(self, laws: Sequence[Source] | Sequence[Link]) -> list[Family]:
        """Laws that share their parameters; one without any is a separate family."""
        varying = {p.name for p in self.network.parameters if p.sd > 0.0}
        found: dict[tuple[str, ...], list[Source | Link]] = {}
        for law in laws:
            expression = law.heat if isinstance(law, Source) else law.conductance
            named = tuple(sorted(varying & {s.name for s in expression.free_symbols}))
            found.setdefault(named or (law.name,), []).append(law)
        families = []
        for key, members in found.items():
            felt = set[str]().union(*(self._felt(member) for member in members))
            families.append(Family(
                name=members[0].name if len(members) == 1 else " ".join(key), members=tuple(m.name for m in members),
                coordinates=tuple(name for name in self.coordinates if name in felt), calibrated=set(key) <= varying,
            ))  # fmt: skip
        return families

    @cached_property
    def source_families(self) -> list[Family]:
        """Sources by the parameters that scale them; what depends on nothing may still go with temperature."""
        found = self._families(self.network.sources)
        return [replace(family, coordinates=family.coordinates or (TEMPERATURE,)) for family in found]

    @cached_property
    def link_families(self) -> list[Family]:
        """Links that conduct, by the parameters that scale them."""
        return self._families(self.conducting)

    def own_nodes(self, source: Source) -> tuple[str, ...]:
        """Parts whose temperature a loss may follow other than the oil's; of oil losses the best-linked part."""
        names = {s.name for s in source.heat.free_symbols}
        read = {node for node in self.parts if f"T_{node}" in names}
        for component, nodes in zip(self.network.components, self.model.losses.reads, strict=False):
            read |= set(nodes) if f"P_{component}" in names else set()
        own = tuple(part for part in self.parts if part in read - {self.oil}) or (source.node,)
        if own != self.warm:
            return own
        return tuple(node for node in self.neighbours(source.node) if node in self.parts)[:1]

    # ------------------------------------------------------------------ places

    def neighbours(self, node: str) -> tuple[str, ...]:
        """Nodes with a heat path to this one, the best first."""
        found: dict[str, float] = {}
        for link in self.conducting:
            if node in link.nodes:
                other = link.nodes[1 - link.nodes.index(node)]
                found[other] = found.get(other, 0.0) + self.conductances[link.name]
        return tuple(sorted(found, key=lambda name: -found[name]))

    def around_sensor(self, channel: str) -> tuple[str, ...]:
        """Nodes that a thermometer may feel in part: the best linked ones, and the surroundings."""
        node = self.parts[self.model.part_index(channel)]
        near = self.neighbours(node)[:NEIGHBOURS]
        more = (self.ambient,) if self.ambient and self.ambient not in near else ()
        return near + more

    @cached_property
    def thermometers(self) -> tuple[str, ...]:
        """Channels that are temperatures."""
        return tuple(name for name in self.channels if not is_total_loss(name))

    def split_targets(self, node: str) -> tuple[str, ...]:
        """Parts that heat made in a part may go to instead: linked ones and the oil; oil carries it anywhere."""
        near = {*self.neighbours(node), *self.warm} if self.oil else set(self.neighbours(node))
        return tuple(part for part in self.parts if part != node and (node == self.oil or part in near))

    @cached_property
    def unlinked(self) -> list[tuple[str, str]]:
        """Pairs of parts, or of a part and the surroundings, without a heat path; at most :data:`MOST_PAIRS`, those
        with the largest temperature differences.
        """
        linked = {frozenset(link.nodes) for link in self.conducting}
        dead = [link.nodes for link in self.network.links if link.conductance.is_zero]
        outside = [(part, self.ambient) for part in self.parts] if self.ambient else []
        pairs = [*combinations(self.parts, 2), *outside, *dead]
        open_pairs = list(dict.fromkeys(pair for pair in pairs if frozenset(pair) not in linked))
        apart = [float(self.mean(np.square(self.temperatures[a] - self.temperatures[b]))) for a, b in open_pairs]
        kept = sorted(np.argsort(apart)[::-1][:MOST_PAIRS].tolist())
        return [open_pairs[index] for index in kept]

    def resolved(self, times: Sequence[float]) -> tuple[float, ...]:
        """Of some time constants those that the rows can show."""
        return tuple(time for time in times if time >= RESOLVED * float(np.median(self.steps)))
