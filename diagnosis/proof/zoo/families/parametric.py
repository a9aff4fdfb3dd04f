"""Machines whose definition has no geometry, split and merged along its parts and links.

Every part becomes one body, a core and a skin, or a piece of a body that it shares with its neighbour. Sizes are those
of the definition; laws and further paths are those of the family.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import sympy as sp

from diagnosis.proof.zoo.families.builder import Builder, wander
from diagnosis.proof.zoo.families.family import PlantFamily
from diagnosis.proof.zoo.structure import Law, Moment, ZooPlant, constant, times
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.base.types import Array
from models.definition.machine_definition import Path
from models.definition.parametric_sections import Loss, ParametricDefinition
from models.formulas.oil import kinematic_viscosity_d341
from models.network.expressions import parse_expression

SLOW_ROWS_S, FAST_ROWS_S = 600.0, 10.0
HEAVY_J_K = 1e6  # machines of tons are recorded by their control system, in means over ten minutes
RISE_K = (22.0, 45.0)  # of a machine above its surroundings at the reference, drawn
FAST_EXCHANGE_S = 90.0  # parts that exchange heat faster than this may be one body
SPAN_H = 1500.0


@dataclass(frozen=True, kw_only=True)
class MachineDesign:
    """Structure and laws of a machine without geometry.

    Attributes
    ----------
    split, merge : float
        Share of the parts that get core and skin, and of the fast links whose parts become one body
    free : float
        Exponent of a conductance to surroundings in the temperature difference over that at the reference
    radiant : float
        Share of a conductance to surroundings that is radiation
    contact : float
        Growth of a conductance between parts with temperature, [1/K]
    leaks : int
        Further paths between parts that have none, or to surroundings
    near_air : bool
        True if the machine warms a layer of air around it
    draught : float
        Sd of the logarithm of what surroundings take, wandering
    smooth_standstill : bool
        True if paths fade in with speed in a straight line, False as the square of it
    loss : {"drag", "film"}
    """

    split: float
    merge: float
    free: float
    radiant: float
    contact: float
    leaks: int
    near_air: bool
    draught: float
    smooth_standstill: bool
    loss: str


def draw_blocks(gearbox: Gearbox, rng: np.random.Generator) -> ZooPlant:
    """Cores and skins: free convection and radiation, contacts that close with heat, paths past the neighbours.

    Free convection as dT^0.25 (McAdams, vertical wall), grey radiation (Stefan-Boltzmann); losses by drag as n^2 and a
    seal's n (ISO/TR 14179-2), load by Coulomb's law, m n.
    """
    design = MachineDesign(
        split=float(rng.uniform(0.3, 0.8)),
        merge=0.0,
        free=float(rng.uniform(0.15, 0.33)),
        radiant=float(rng.uniform(0.2, 0.5)),
        contact=float(rng.uniform(0.0, 0.015)),
        leaks=int(rng.integers(1, 4)),
        near_air=False,
        draught=float(rng.uniform(0.03, 0.12)),
        smooth_standstill=True,
        loss="drag",
    )
    return _Machine("blocks", gearbox, design, rng).plant()


def draw_streams(gearbox: Gearbox, rng: np.random.Generator) -> ZooPlant:
    """Fewer bodies than parts, a layer of warm air around them, draughts that come and go.

    Losses by a viscous film, (nu n)^(2/3) n (Palmgren), and by friction that falls with speed, m^1.2 n^0.8 nu^-0.05
    (Schlenk).
    """
    design = MachineDesign(
        split=float(rng.uniform(0.0, 0.3)),
        merge=float(rng.uniform(0.2, 0.7)),
        free=0.0,
        radiant=float(rng.uniform(0.0, 0.2)),
        contact=0.0,
        leaks=int(rng.integers(0, 3)),
        near_air=bool(rng.random() < 0.7),
        draught=float(rng.uniform(0.05, 0.15)),
        smooth_standstill=False,
        loss="film",
    )
    return _Machine("streams", gearbox, design, rng).plant()


class _Machine:
    """A machine in the making."""

    def __init__(self, family: str, gearbox: Gearbox, design: MachineDesign, rng: np.random.Generator) -> None:
        if not isinstance(gearbox.definition, ParametricDefinition):
            raise InputError(
                f"{gearbox.file}: has geometry; the family '{family}' splits definitions without: name another family"
            )
        self.definition, self.design = gearbox.definition, design
        if self.definition.torque is not None:
            raise InputError(
                f"{gearbox.file}: [torque] follows from a power; the zoo needs a recorded torque: name another machine"
            )
        self.b = Builder(family, gearbox, tuple(self.definition.inputs), rng)
        self.capacity = {part.name: part.heat_capacity_J_K for part in self.definition.part}
        self.input_of = {boundary.name: boundary.input for boundary in self.definition.boundary}
        self.core: dict[str, str] = {}
        self.skin: dict[str, str] = {}

    def plant(self) -> ZooPlant:
        self._scale()
        for name, signal in self.input_of.items():
            self.b.boundary(name, name, lambda m, signal=signal: m.inputs[signal])  # type: ignore[misc]
        self._parts()
        self._surroundings()
        for link in self.definition.link:
            self._link(link)
        self._leaks()
        for loss in self.definition.loss:
            self._losses(loss)
        self._heats()
        self._probes()
        heavy = sum(self.capacity.values()) > HEAVY_J_K
        return self.b.plant(loss_W=self.heat_W, row_s=SLOW_ROWS_S if heavy else FAST_ROWS_S)

    def _scale(self) -> None:
        """Make the definition's guesses agree with a plausible rise: conductances to surroundings up, losses down."""
        out = sum(link.conductance_W_K for link in self.definition.link if set(link.between) & set(self.input_of))
        self.rise = self.b.uniform(*RISE_K)
        assumed = sum(loss.no_load_W + loss.load_W for loss in self.definition.loss)
        apart = assumed / (out * self.rise) if assumed else 1.0
        self.outwards, self.loss_scale = float(np.sqrt(apart)), float(1.0 / np.sqrt(apart))
        self.heat_W = assumed * self.loss_scale if assumed else out * self.rise

    # ------------------------------------------------------------------ parts

    def _parts(self) -> None:
        groups = {name: [name] for name in self.capacity}
        for link in self.definition.link:
            a, c = link.between
            if a in self.capacity and c in self.capacity and groups[a] is not groups[c]:
                fast = min(self.capacity[a], self.capacity[c]) / link.conductance_W_K < FAST_EXCHANGE_S
                small = len(groups[a]) + len(groups[c]) <= 3
                if fast and small and self.b.chance(self.design.merge):
                    joined = groups[a] + groups[c]
                    groups.update(dict.fromkeys(joined, joined))
        done: set[str] = set()
        for members in groups.values():
            if members[0] not in done:
                done.update(members)
                self._body(members)

    def _body(self, members: list[str]) -> None:
        b, C = self.b, sum(self.capacity[name] for name in members)
        node = "+".join(members)
        if b.chance(self.design.split):
            share = b.uniform(0.25, 0.6)
            core = b.body(f"{node}.core", node, (1.0 - share) * C, 0.15)
            skin = b.body(f"{node}.skin", node, share * C, 0.15)
            ties = [link for link in self.definition.link if set(link.between) & set(members)]
            inner = max(link.conductance_W_K for link in ties) * b.uniform(1.5, 5.0)
            b.path(core, skin, inner, 0.3)
        else:
            core = skin = b.body(node, node, C, 0.15)
        for name in members:
            self.core[name], self.skin[name] = core, skin

    def _surroundings(self) -> None:
        """Where paths to surroundings end: at a boundary, or at the air that the machine has warmed."""
        self.outside = {name: name for name in self.input_of}
        self.still: Law = constant(1.0)
        if self.design.draught:
            span = SPAN_H if sum(self.capacity.values()) > HEAVY_J_K else 80.0
            self.still = wander(self.b.rng, sd=self.design.draught, tau_h=span / 200.0, span_h=span)
        if self.design.near_air:
            name = next(iter(self.input_of))
            out = sum(link.conductance_W_K for link in self.definition.link if name in link.between) * self.outwards
            layer = self.b.body(f"{name}.near", name, 0.01 * sum(self.capacity.values()), 0.3)
            still = self.still
            G = out * self.b.uniform(4.0, 10.0)
            self.b.path(layer, name, lambda m: G * still(m), 0.2)
            self.outside[name] = layer

    # ------------------------------------------------------------------ paths

    def _link(self, link: Path) -> None:
        a, c = link.between
        factor = self._factor(link.factor)
        awake = self._awake(link)
        if a in self.input_of or c in self.input_of:
            part, boundary = (c, a) if a in self.input_of else (a, c)
            shape = self._outward(self.skin[part], self.outside[boundary], link.conductance_W_K * self.outwards)
            ends = self.skin[part], self.outside[boundary]
        else:
            if self.core[a] == self.core[c]:
                return
            ends = (self.core[a], self.core[c]) if self.b.chance(0.5) else (self.skin[a], self.skin[c])
            shape = self._inward(*ends, link.conductance_W_K)
        self.b.path(*ends, lambda m: shape(m) * factor(m) * awake(m), 0.25, name=f"{a}-{c}")

    def _outward(self, skin: str, air: str, G: float) -> Law:
        design, rise, still = self.design, self.rise, self.still

        def law(m: Moment) -> Array:
            T, T_a = m.T[skin], m.T[air]
            convection = (np.sqrt((T - T_a) ** 2 + 0.25) / rise) ** design.free
            radiation = ((T + T_a + 546.3) / (2.0 * T_a + 546.3 + rise)) ** 3
            return np.asarray(G * still(m) * ((1.0 - design.radiant) * convection + design.radiant * radiation))

        return law

    def _inward(self, a: str, c: str, G: float) -> Law:
        growth, rise = self.design.contact, self.rise
        if not growth:
            return constant(G)
        return lambda m: G * np.clip(1.0 + growth * (0.5 * (m.T[a] + m.T[c]) - 20.0 - 0.5 * rise), 0.3, 3.0)

    def _awake(self, link: Path) -> Law:
        """Share of a conductance that is left when the shaft stands, rising to 1 with speed."""
        if link.standstill_share >= 1.0:
            return constant(1.0)
        share, running = link.standstill_share, self.definition.operation.running_rpm
        power = 1.0 if self.design.smooth_standstill else 2.0
        return lambda m: share + (1.0 - share) * np.minimum(np.abs(m.inputs["speed"]) / running, 1.0) ** power

    def _leaks(self) -> None:
        """Paths that the definition does not have."""
        b, parts = self.b, list(self.capacity)
        typical = float(np.median([link.conductance_W_K for link in self.definition.link]))
        known = {frozenset(link.between) for link in self.definition.link}
        for k in range(self.design.leaks):
            a, c = (str(name) for name in b.rng.choice([*parts, *self.input_of], 2, replace=False))
            if a in self.input_of:
                a, c = c, a
            if a in self.input_of or frozenset((a, c)) in known:
                continue
            outside = c in self.input_of
            end = c if outside else self.core[c]
            if self.core[a] == end:
                continue
            low = min(link.conductance_W_K for link in self.definition.link if a in link.between)
            G = b.uniform(0.05, 0.4) * (low * self.outwards if outside else min(typical, 3.0 * low))
            b.path(self.core[a], end, G, 0.3, name=f"leak {k + 1}: {a}-{c}")

    # ------------------------------------------------------------------ heat

    @cached_property
    def _nu_ref(self) -> float:
        T_ref = self.definition.operation.temperature_degC
        return float(kinematic_viscosity_d341(T_ref, *self.definition.viscosity_constants))

    def _losses(self, loss: Loss) -> None:
        b, place = self.core[loss.part], self.definition.operation
        constants, nu_ref = self.definition.viscosity_constants, self._nu_ref

        def ratios(m: Moment) -> tuple[Array, Array, Array]:
            n = np.abs(m.inputs["speed"]) / place.speed_rpm
            torque = np.abs(m.inputs["torque"]) / place.torque_Nm
            nu = kinematic_viscosity_d341(np.clip(m.T[b], -20.0, 150.0), *constants) / nu_ref
            return n, torque, np.minimum(nu, 20.0)

        def drag(m: Moment) -> Array:
            n, _, nu = ratios(m)
            return np.asarray(0.6 * n**2 * nu**0.1 + 0.4 * n)

        def film(m: Moment) -> Array:
            n, _, nu = ratios(m)
            return np.asarray(n ** (5.0 / 3.0) * nu ** (2.0 / 3.0))

        def coulomb(m: Moment) -> Array:
            n, torque, _ = ratios(m)
            return np.asarray(torque * n)

        def schlenk(m: Moment) -> Array:
            n, torque, nu = ratios(m)
            return np.asarray(torque**1.2 * n**0.8 * nu**-0.05)

        is_drag = self.design.loss == "drag"
        for kind, watts, shape in (
            ("no_load", loss.no_load_W, drag if is_drag else film),
            ("load", loss.load_W, coulomb if is_drag else schlenk),
        ):
            scaled = watts * self.loss_scale
            name = f"{loss.name}_{kind}"
            self.b.source(name, name, times(scaled, shape), self._spread(loss.part), 0.25)

    def _spread(self, part: str) -> dict[str, float]:
        """Mostly into the core of a part, by chance some into its skin or a neighbour."""
        into = {self.core[part]: 1.0}
        neighbours = [
            self.core[name]
            for link in self.definition.link
            if part in link.between
            for name in link.between
            if name != part and name in self.core
        ]
        if neighbours and self.b.chance(0.5):
            other = str(self.b.rng.choice(neighbours))
            into[other] = into.get(other, 0.0) + self.b.uniform(0.05, 0.25)
        return into

    def _heats(self) -> None:
        """Heats by their laws; what several parts share they do not share evenly."""
        for heat in self.definition.heat:
            law = self._factor(heat.heat_W)
            weights = np.exp(0.5 * self.b.rng.standard_normal(len(heat.parts)))
            into: dict[str, float] = {}
            for part, weight in zip(heat.parts, weights, strict=True):
                into[self.skin[part]] = into.get(self.skin[part], 0.0) + float(weight)
            own = heat.name if len(heat.parts) == 1 else "+".join(f"{heat.name}_{part}" for part in heat.parts)
            self.b.source(heat.name, own, times(heat.gain, law), into, 0.02, is_loss=False)

    def _factor(self, text: str | None) -> Law:
        """A law that a definition gives as text, of inputs, parameters at their start and temperatures of parts."""
        if text is None:
            return constant(1.0)
        expression, start = parse_expression(text), {p.name: p.start for p in self.definition.parameter}
        expression = expression.xreplace(
            {s: sp.Float(start[str(s)]) for s in expression.free_symbols if str(s) in start}
        )
        symbols = sorted(expression.free_symbols, key=str)
        names = [str(s) for s in symbols]
        function: Callable[..., Array] = sp.lambdify(symbols, expression, "numpy")
        nodes = {f"T_{name}": body for name, body in self.core.items()} | {f"T_{name}": name for name in self.input_of}

        def law(m: Moment) -> Array:
            arguments = [m.inputs[name] if name in m.inputs else m.T[nodes[name]] for name in names]
            return np.broadcast_to(function(*arguments), m.hours.shape)

        return law

    # ------------------------------------------------------------------ probes

    def _probes(self) -> None:
        columns = self.definition.recording.get("columns", {}).values()
        named = [str(column["quantity"]).removeprefix("T_") for column in columns if "quantity" in column]
        channels = [part for part in self.capacity if part in named] or list(self.capacity)
        air = next(iter(self.input_of))
        for part in channels:
            mix = {self.core[part]: 1.0}
            mix[self.skin[part]] = mix.get(self.skin[part], 0.0) + self.b.uniform(0.0, 1.0)
            if self.b.chance(0.5):
                mix[air] = self.b.uniform(0.0, 0.03) * sum(mix.values())
            self.b.probe(part, mix)


PARAMETRIC_FAMILIES = (
    PlantFamily(
        name="blocks",
        description="cores and skins, free convection, leaks",
        machines=("heated_rod", "la_haute_borne"),
        draw=draw_blocks,
    ),
    PlantFamily(
        name="streams",
        description="merged parts, warmed air, draughts",
        machines=("heated_rod", "la_haute_borne"),
        draw=draw_streams,
    ),
)
