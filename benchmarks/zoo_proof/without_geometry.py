"""Kept for proof: machines without geometry of the family ``proof_b``, section 3 of SPECIFICATION.md."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import sympy as sp

from diagnosis.proof.zoo.structure import Law, Moment, ZooPlant
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.base.types import Array
from models.definition.machine_definition import Path
from models.definition.parametric_sections import Loss, ParametricDefinition
from models.formulas.oil import kinematic_viscosity_d341
from models.quantities.units import find_unit

from .parts import KELVIN, Draft, difference, draught, draw_door

STRENGTH = 0.7  # of machines in rows of 10 s; ten seeds: median 0.70 K, at 1.0 it is 1.1 K
STRENGTH_SLOW = 1.0  # of machines in means of 10 minutes
MOST_SPLIT = 5
WEAK, KEPT = 0.15, 0.6


def draw_without_geometry(gearbox: Gearbox, rng: np.random.Generator) -> ZooPlant:
    """Draw one machine."""
    definition = gearbox.definition
    if not isinstance(definition, ParametricDefinition):
        raise InputError(f"{gearbox.file}: has geometry; give a definition with [[part]]")
    return _Machine(gearbox, definition, rng).plant()


def bearing_free_loss(r: Array, nu: Array, share: Array) -> Array:
    """Loss without load over its value at the reference; viscosity over that at the reference."""
    return (share * r + (1.0 - share) * r**2.6) * nu**0.3


def loss_by_load(r: Array, tau: Array, nu: Array) -> Array:
    """Loss by load over its value at the reference."""
    return r * tau**1.25 * nu**-0.08


class _Machine:
    """One draw, in the order of the section."""

    def __init__(self, gearbox: Gearbox, definition: ParametricDefinition, rng: np.random.Generator) -> None:
        self.gearbox, self.definition = gearbox, definition
        self.links = list(definition.link)
        self.d = Draft("proof_b", gearbox, tuple(definition.inputs), {"-".join(p.between) for p in self.links}, rng)
        self.has_speed = "speed" in definition.inputs
        self.row_s = 600.0 if self.has_speed else 10.0
        self.s = STRENGTH_SLOW if self.has_speed else STRENGTH
        self.parts = [part.name for part in definition.part]
        self.upper = {name: k >= len(self.parts) / 2 for k, name in enumerate(self.parts)}
        self.boundaries = [b.name for b in definition.boundary]
        self.G = [self._nominal(path) for path in self.links]
        self.C = {part.name: part.heat_capacity_J_K for part in definition.part}
        self.of_part = {
            part: [k for k, path in enumerate(self.links) if part in path.between] for part in self.parts
        }  # fmt: skip
        self.total = {part: sum(self.G[k] for k in own) for part, own in self.of_part.items()}
        self.weakest = {part: min(self.G[k] for k in own) for part, own in self.of_part.items()}
        self.air = "air" if "air" in self.boundaries else self.boundaries[0]

    def plant(self) -> ZooPlant:
        self._bodies()
        self._missing()
        self._boundaries()
        self._paths()
        self._extra()
        self._sources()
        self._probes()
        self._parameters()
        return self.d.plant(self._service(), heat_counts=True, row_s=self.row_s)

    def _nominal(self, path: Path) -> float:
        """Conductance of a link with the definition's start values, [W/K]."""
        if path.factor is None:
            return path.conductance_W_K
        value = self._value(path.factor, f"the factor of {'-'.join(path.between)}")
        return path.conductance_W_K * value

    def _value(self, text: str, what: str) -> float:
        """Number of an expression with start values and defaults put in."""
        known = {p.name: p.start for p in self.definition.parameter}
        known |= {name: given.default for name, given in self.definition.inputs.items()}
        law = sp.sympify(text, locals={name: sp.Symbol(name) for name in known})
        number = law.subs(known)
        if not (number.is_number and float(number) > 0.0):
            raise InputError(
                f"{self.gearbox.file}: {what} is '{text}', which has no value above 0 at the start values and "
                "defaults; this family needs one: write a factor of parameters and inputs"
            )
        return float(number)

    def _relative_sd(self, path: str, value: float) -> float:
        return self.gearbox.priors.get(path, 0.0) / value if value > 0.0 else 0.0

    # ------------------------------------------------------------------ bodies

    def _bodies(self) -> None:
        d, s = self.d, self.s
        cut = {part: (d.chance(0.45), d.between(0.1, 0.3)) for part in self.parts}
        shells = [part for part, (yes, _) in cut.items() if yes][:MOST_SPLIT]
        shells = shells or [max(self.C, key=lambda part: self.C[part])]
        self.shell: dict[str, list[int]] = {}  # links that the shell of a part takes
        for part in shells:
            outer = [k for k in self.of_part[part] if set(self.links[k].between) & set(self.boundaries)]
            self.shell[part] = outer or [min(self.of_part[part], key=lambda k: self.G[k])]
        candidates: list[str] = []
        for k, part in enumerate(self.parts):
            sd = self._relative_sd(f"part.{k}.heat_capacity_J_K", self.C[part])
            C, x = self.C[part] * float(np.exp(0.3 * sd * d.rng.standard_normal())), cut[part][1]
            d.body(part, part, (1.0 - x) * C if part in self.shell else C)
            if part in self.shell:
                d.body(f"{part}_shell", part, x * C)
            candidates += [part, f"{part}_shell"]
        to_air = [k for k, path in enumerate(self.links) if self.air in path.between]
        pocket = d.chance(0.6)
        chosen = sorted(int(k) for k in d.rng.choice(to_air, len(to_air) // 2, replace=False))
        self.pocketed = chosen if pocket else []
        if self.pocketed:
            whole = sum(self.G[k] for k in chosen)
            self.pocket_part = self._inner(max(chosen, key=lambda k: self.G[k]))
            d.body("pocket", self.pocket_part, lambda m: 600.0 * m.p["k_pocket"] * whole / s)
        self.element: dict[str, str] = {}
        for heat in self.definition.heat:
            name = f"element_{heat.name}"
            if d.chance(0.7):
                d.body(name, heat.parts[0], 0.08 * sum(self.C[part] for part in heat.parts))
                self.element[heat.name] = name
            candidates.append(name)
        self.candidates = [*candidates, "pocket"]

    def _inner(self, k: int) -> str:
        """Part of a link that leads to a boundary."""
        return next(end for end in self.links[k].between if end in self.C)

    # ------------------------------------------------------------------ missing links

    def _missing(self) -> None:
        drawn = [self.d.chance(WEAK * min(self.s, 1.0)) for _ in self.links]
        outside = {k for k, path in enumerate(self.links) if set(path.between) & set(self.boundaries)}
        out, kept = sum(self.G[k] for k in outside), sum(self.G[k] for k in outside)
        self.present = set(range(len(self.links)))
        for k, path in enumerate(self.links):
            ends = [end for end in path.between if end in self.C]
            if not drawn[k] or self.G[k] >= WEAK * min(self.total[end] for end in ends):
                continue
            if k in outside:
                if kept - self.G[k] >= KEPT * out:
                    kept -= self.G[k]
                    self.present.remove(k)
            elif self._joined(self.present - outside - {k}, *ends):
                self.present.remove(k)

    def _joined(self, links: set[int], a: str, b: str) -> bool:
        """True if links between parts lead from one part to another."""
        reached = {a}
        for _ in self.parts:
            for k in links:
                ends = set(self.links[k].between)
                reached |= ends if ends & reached else set()
        return b in reached

    # ------------------------------------------------------------------ boundaries

    def _boundaries(self) -> None:
        d, s = self.d, self.s
        draw_door(d)
        for b in self.definition.boundary:
            signal = b.input
            if b.name == self.air:
                d.boundary(b.name, b.name, lambda m, i=signal: m.inputs[i] + 0.5 * s * m.p["grad"])
                d.boundary("air_up", b.name, lambda m, i=signal: m.inputs[i] + s * m.p["grad"])
            else:
                phase = f"phi_{b.name}"
                d.phases(phase)
                d.boundary(b.name, b.name, self._daily(signal, phase))

    def _daily(self, signal: str, phase: str) -> Law:
        s = self.s
        return lambda m: m.inputs[signal] + 0.5 * s * np.sin(2.0 * np.pi * m.hours / 24.0 + m.p[phase])

    # ------------------------------------------------------------------ paths

    def _end(self, k: int, end: str) -> str:
        """Body or boundary at an end of a link."""
        if end in self.C:
            return f"{end}_shell" if k in self.shell.get(end, []) else end
        if k in self.pocketed:
            return "pocket"
        return "air_up" if end == self.air and self.upper[self._inner(k)] else end

    def _paths(self) -> None:
        d, s = self.d, self.s
        for k, path in enumerate(self.links):
            name = "-".join(path.between)
            sd = self._relative_sd(f"link.{k}.conductance_W_K", path.conductance_W_K)
            d.near(f"k_{name}", 1.0, min(0.25, sd or 0.15))
            if k in self.present:
                a, b = (self._end(k, end) for end in path.between)
                d.path(a, b, name, self._conductance(f"k_{name}", self.G[k], path, a, b))
        for part, taken in self.shell.items():
            inside = sum(self.G[k] for k in taken)
            d.path(part, f"{part}_shell", part, lambda m, g=inside: m.p["k_shell"] * g / s)
        if self.pocketed:
            whole = sum(self.G[k] for k in self.pocketed)
            link = d.link(self.pocket_part, self.air)
            d.path("pocket", self.air, link, lambda m: m.p["k_pocket"] * whole / s)

    def _conductance(self, factor: str, G: float, path: Path, a: str, b: str) -> Law:
        if set(path.between) & set(self.boundaries):
            part = next(end for end in path.between if end in self.C)
            shape = self._outside(a, b, 0.5 if self.upper[part] else 1.0)
        elif path.standstill_share < 1.0:
            shape = self._running(path.standstill_share, a, b)
        else:
            shape = self._solid(a, b)
        return lambda m: m.p[factor] * G * shape(m)

    def _outside(self, a: str, b: str, share: float) -> Law:
        s, at = self.s, self.definition.operation

        def law(m: Moment) -> Array:
            mean = 0.5 * (m.T[a] + m.T[b]) + KELVIN
            rising = 0.35 * (difference(m.T[a], m.T[b]) / 30.0) ** (1.0 / 3.0)
            shape = 1.0 + s * (0.45 + rising + 0.20 * (mean / 300.0) ** 3 - 1.0)
            shape = shape * draught(m, s, share)
            if self.has_speed:
                power = np.maximum(np.abs(m.inputs["speed"]), 1.0) * np.abs(self._torque(m))
                wind = np.sqrt(power / (at.speed_rpm * at.torque_Nm))
                shape = shape * (1.0 + s * m.p["wake"] * np.minimum(wind, 1.2))
            return shape

        return law

    def _running(self, q: float, a: str, b: str) -> Law:
        at, still = self.definition.operation, q**0.8

        def law(m: Moment) -> Array:
            r = np.minimum(np.maximum(np.abs(m.inputs["speed"]), 1.0) / at.speed_rpm, 1.5)
            moved = np.sqrt(r / (0.3 + 0.7 * r)) / self._thickness(0.5 * (m.T[a] + m.T[b])) ** 0.15
            return still + (1.0 - still) * moved

        return law

    def _solid(self, a: str, b: str) -> Law:
        s = self.s
        return lambda m: 1.0 + s * m.p["kappa"] * (0.5 * (m.T[a] + m.T[b]) - 40.0) / 100.0

    def _thickness(self, T: Array) -> Array:
        """Viscosity over that at the reference temperature; 1 without oil."""
        if self.definition.oil is None:
            return np.ones_like(T)
        constants = self.definition.viscosity_constants
        reference = kinematic_viscosity_d341(self.definition.operation.temperature_degC, *constants)
        return kinematic_viscosity_d341(np.clip(T, -30.0, 200.0), *constants) / reference

    def _torque(self, m: Moment) -> Array:
        given = self.definition.torque
        if given is None:
            return m.inputs["torque"]
        omega = np.maximum(np.abs(m.inputs["speed"]), 1.0) * np.pi / 30.0
        watt = find_unit(self.definition.inputs[given.power].quantity.unit, "power").factor
        return given.efficiency * watt * m.inputs[given.power] / omega

    # ------------------------------------------------------------------ extra links

    def _extra(self) -> None:
        d, s = self.d, self.s
        linked = {frozenset(path.between) for path in self.links}
        pairs = [pair for pair in combinations(self.parts, 2) if frozenset(pair) not in linked]
        two = d.chance(0.5)
        for k, at in enumerate(d.rng.permutation(len(pairs))[:2]):
            a, b = pairs[int(at)]
            exists = k == 0 or two
            d.uniform(f"u_{a}-{b}", 0.3, 1.0, exists=exists)
            if exists:
                size = s * float(np.sqrt(self.weakest[a] * self.weakest[b]))
                d.path(a, b, "", lambda m, p=f"u_{a}-{b}", g=size: m.p[p] * g)
        out, part = d.chance(0.5), self.parts[int(d.rng.integers(len(self.parts)))]
        free = [name for name in self.boundaries if frozenset((part, name)) not in linked]
        name = f"u_{part}-{free[0]}" if free else ""
        exists = out and bool(free)
        d.uniform(name, 0.1, 0.4, exists=exists)
        if exists:
            to = "air_up" if free[0] == self.air and self.upper[part] else free[0]
            d.path(part, to, "", lambda m, g=s * self.weakest[part]: m.p[name] * g)

    # ------------------------------------------------------------------ sources

    def _sources(self) -> None:
        d, s = self.d, self.s
        for heat in self.definition.heat:
            signal, gain, factor = heat.heat_W.strip(), heat.gain, f"k_{heat.name}"
            if signal not in self.definition.inputs:
                raise InputError(
                    f"{self.gearbox.file}: the heat '{heat.name}' is '{signal}'; this family knows a plain input only"
                )
            d.near(factor, 1.0, 0.02)
            tilt, count = s * d.between(-0.3, 0.3), len(heat.parts)
            shares = (1.0 + tilt * np.linspace(-1.0, 1.0, count)) / count if count > 1 else np.ones(1)
            into = list(zip(heat.parts, shares.tolist(), strict=True))
            if heat.name in self.element:
                into = [(self.element[heat.name], 1.0)]
                K = self.definition.inputs[signal].quantity.high / 15.0 / count
                for part in heat.parts:
                    d.path(self.element[heat.name], part, part, lambda m, g=K: np.full_like(m.hours, g))
            law: Law = lambda m, i=signal, g=gain, p=factor: m.inputs[i] * g * m.p[p]  # noqa: E731
            d.source(heat.name, heat.name, law, into, is_loss=False)
        for k, loss in enumerate(self.definition.loss):
            names = f"k_nl_{loss.name}", f"k_ld_{loss.name}", f"u_{loss.name}"
            for name, key, value in ((names[0], "no_load_W", loss.no_load_W), (names[1], "load_W", loss.load_W)):
                d.near(name, 1.0, min(0.4, 0.5 * self._relative_sd(f"loss.{k}.{key}", value)))
            d.uniform(names[2], 0.3, 0.7)
            y, own = s * d.between(0.05, 0.2), self._neighbours(loss.part)
            other = own[int(d.rng.integers(len(own)))] if own else loss.part
            d.source(loss.name, loss.name, self._lost(loss, *names), [(loss.part, 1.0 - y), (other, y)])

    def _neighbours(self, part: str) -> list[str]:
        return [end for k in self.of_part[part] for end in self.links[k].between if end in self.C and end != part]

    def _lost(self, loss: Loss, no_load: str, load: str, share: str) -> Law:
        at = self.definition.operation

        def law(m: Moment) -> Array:
            r = np.abs(m.inputs["speed"]) / at.speed_rpm
            tau = np.maximum(self._torque(m), 0.0) / at.torque_Nm
            nu = np.clip(self._thickness(m.T[loss.part]), 0.2, 20.0)
            free = m.p[no_load] * loss.no_load_W * bearing_free_loss(r, nu, m.p[share])
            return free + m.p[load] * loss.load_W * loss_by_load(r, tau, nu)

        return law

    def _service(self) -> dict[str, float]:
        """Inputs at which losses and heats are typical."""
        at, inputs = self.definition.operation, self.definition.inputs
        given = {name: signal.default for name, signal in inputs.items()}
        given |= {heat.heat_W.strip(): 0.5 * inputs[heat.heat_W.strip()].quantity.high for heat in self.definition.heat}
        if self.has_speed:
            given |= {"speed": 0.8 * at.speed_rpm}
            given |= {"torque": 0.5 * at.torque_Nm} if "torque" in inputs else {}
        return given

    # ------------------------------------------------------------------ probes, parameters

    def _probes(self) -> None:
        d, s = self.d, self.s
        lag = (60.0, 400.0) if self.row_s >= 60.0 else (10.0, 60.0)
        for part in self.parts:
            of_shell, of_other, of_air = d.between(0.05, 0.3), d.between(0.0, 0.06), d.between(0.005, 0.03)
            own = self._neighbours(part)
            other = own[int(d.rng.integers(len(own)))] if own else part
            near = (f"{part}_shell", s * of_shell) if part in self.shell else (other, s * of_other)
            d.probe(part, part, [near, (self.air, s * of_air)], d.between(*lag))

    def _parameters(self) -> None:
        d = self.d
        d.uniform("k_shell", 4.0, 12.0)
        d.uniform("k_pocket", 4.0, 10.0)
        d.uniform("kappa", -0.1, 0.1)
        d.uniform("grad", *((0.5, 4.0) if self.has_speed else (0.3, 1.5)))
        d.uniform("wake", 0.05, 0.3)
        d.uniform("door", 0.1, 0.35)
        d.capacities(self.candidates, 0.1)
