"""Kept for proof: the family ``proof_b``, sections 2 and 3 of SPECIFICATION.md."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from diagnosis.proof.zoo.families.family import PlantFamily
from diagnosis.proof.zoo.structure import Law, Moment, ZooPlant
from models.assembly.gearbox import Gearbox
from models.base.types import Array

from .laws_b import bearing_torque, churned_disc, cylinder, in_mesh, rising, seal_torque, thrown, wind
from .parts import (
    Box,
    Draft,
    draught,
    draw_door,
    fixed,
    radiation,
    series,
    shaft_in_air,
)
from .without_geometry import draw_without_geometry

STRENGTH = 0.25  # of gearboxes; fzg, five seeds: median 0.99 K, at 1.0 it is 1.06 K
MIDDLE = 0.45  # relative height of bearings


def draw(gearbox: Gearbox, rng: np.random.Generator) -> ZooPlant:
    """Draw one machine."""
    return draw_without_geometry(gearbox, rng) if gearbox.is_parametric else _Machine(Box(gearbox), rng).plant()


FAMILY = PlantFamily(
    name="proof_b",
    description="kept for proof",
    machines=("fzg", "conveyor", "heated_rod", "la_haute_borne"),
    draw=draw,
)


class _Machine:
    """One draw, section by section."""

    def __init__(self, box: Box, rng: np.random.Generator) -> None:
        self.box = box
        self.d = Draft(
            "proof_b", box.gearbox, ("speed", "torque", "T_ambient", "air_speed"), set(box.nominal_links()), rng
        )
        self.candidates: list[str] = []

    def plant(self) -> ZooPlant:
        self._bodies()
        self._boundaries()
        self._housing()
        self._oil()
        self._rotors()
        self._surroundings()
        self._sources()
        self._probes()
        self._parameters()
        return self.d.plant(self.box.at_service(), heat_counts=False, row_s=10.0)

    # ------------------------------------------------------------------ 2.1

    def _body(self, exists: bool, name: str, part_of: str, capacity: float) -> None:
        self.candidates.append(name)
        if exists:
            self.d.body(name, part_of, capacity)

    def _bodies(self) -> None:
        box, d = self.box, self.d
        x_c = d.between(0.35, 0.65)
        returns, x_r = d.chance(0.5), d.between(0.05, 0.15)
        filled = box.C_oil * (1.0 - returns * x_r)
        self._body(True, "oil_cold", "oil", x_c * filled)
        self._body(True, "oil_hot", "oil", (1.0 - x_c) * filled)
        self._body(returns, "oil_return", "oil", x_r * box.C_oil)
        self.returned = "oil_return" if returns else "oil_hot"
        self._rotor_bodies()
        self.bearing_body: dict[str, str] = {}
        for shaft in box.shafts:
            own, merged = box.of_shaft(shaft), d.chance(0.4)
            C = {bearing: box.C_bearing(bearing) for bearing in own}
            self._body(merged, f"bearings_{shaft}", own[0], sum(C.values()))
            for bearing in own:
                self._body(not merged, bearing, bearing, C[bearing])
                self.bearing_body[bearing] = f"bearings_{shaft}" if merged else bearing
        count = 3 + int(d.rng.integers(0, 3))
        self.lid, self.frame, self.neighbour = d.chance(0.5), d.chance(0.5), d.chance(0.5)
        self._slices(count)
        self._body(self.lid, "lid", box.top, 0.12 * box.C_part(box.top))
        whole = box.C_housing
        self.candidates += ["frame", "neighbour"]
        if self.frame:
            d.body("frame", box.foot, lambda m: m.p["frame_C"] * whole)
        if self.neighbour:
            d.body("neighbour", box.shaft_of[0], lambda m: m.p["nb_C"] * whole)

    def _rotor_bodies(self) -> None:
        """Gears and shafts; which body a shaft's ends and a gear's teeth are."""
        box, d = self.box, self.d
        (pinion, wheel), (first, second) = box.gears, box.shaft_of
        one, x = d.chance(0.35), d.between(0.5, 0.8)
        self._body(one, "rotor_1", pinion, box.C_shaft(first) + box.C_gear(0))
        self._body(not one, "core_1", first, box.C_shaft(first) + (1.0 - x) * box.C_gear(0))
        self._body(not one, "rim_1", pinion, x * box.C_gear(0))
        core, y = d.chance(0.5), d.between(0.5, 0.8)
        inner = (1.0 - y) * box.C_gear(1)
        self._body(True, "shaft_2", second, box.C_shaft(second) + (0.0 if core else inner))
        self._body(core, "core_2", wheel, inner)
        self._body(True, "rim_2", wheel, y * box.C_gear(1))
        self.one, self.core, self.rim_share = one, core, (x, y)
        self.rims = ("rotor_1" if one else "rim_1", "rim_2")
        self.shaft_body = {first: "rotor_1" if one else "core_1", second: "shaft_2"}

    def _slices(self, count: int) -> None:
        """Slices from below: name, nominal part, share of the area, relative height, area outside."""
        box = self.box
        order = [box.foot, *(part for part in box.parts if part != box.foot)]
        pieces = {part: max(1, round(box.f(part) * count)) for part in order}
        parts = [part for part in order for _ in range(pieces[part])]
        self.names = [f"slice_{k + 1}" for k in range(len(parts))]
        self.part = dict(zip(self.names, parts, strict=True))
        self.a = {name: box.f(part) / pieces[part] for name, part in self.part.items()}
        upper = np.cumsum(list(self.a.values()))
        self.y = {
            name: float(top) - 0.5 * self.a[name] for name, top in zip(self.names, upper, strict=True)
        }  # fmt: skip
        outside = {name: a * {self.names[0]: 0.7, self.names[-1]: 1.3}.get(name, 1.0) for name, a in self.a.items()}
        self.A = {name: box.A_out * share / sum(outside.values()) for name, share in outside.items()}
        if self.lid:
            self.A[self.names[-1]] -= 0.12 * box.A_out
        for name, part in self.part.items():
            left = 0.88 if self.lid and part == box.top else 1.0
            self.d.body(name, part, left * box.C_part(part) / pieces[part])
        self.candidates += [f"slice_{k}" for k in range(1, 2 + 5 + len(box.parts))]
        self.middle = sorted(self.names, key=lambda name: abs(self.y[name] - MIDDLE))[:2]

    # ------------------------------------------------------------------ 2.2

    def _boundaries(self) -> None:
        s, d = STRENGTH, self.d
        for name, y in self.y.items():
            d.boundary(
                f"air_{name.removeprefix('slice_')}",
                "air",
                lambda m, y=y: m.inputs["T_ambient"] + s * m.p["grad"] * (y - 0.4),
            )
        d.boundary("walls", "air", lambda m: m.inputs["T_ambient"] - s * m.p["d_wall"])
        d.boundary("hall", "air", lambda m: m.inputs["T_ambient"])
        draw_door(d)

    def _air(self, name: str) -> str:
        return f"air_{name.removeprefix('slice_')}"

    # ------------------------------------------------------------------ 2.3, 1 to 3

    def _housing(self) -> None:
        box, d, top = self.box, self.d, self.names[-1]
        for k, (name, part) in enumerate(self.part.items()):
            share = 1.0 if k < len(self.names) / 2 else 0.5
            d.path(name, self._air(name), d.link(part, "air"), self._to_air(name, self.A[name], share))
        for name, part in self.part.items():
            d.path(name, "walls", d.link(part, "air"), self._to_walls(name, self.A[name]))
        if self.lid:
            air, A, link = self._air(top), 0.12 * box.A_out, d.link(box.top, "air")
            d.path(
                "lid", air, link,
                lambda m: A * 1.16 * rising(m.T["lid"], m.T[air]) * draught(m, STRENGTH, 0.5),
            )  # fmt: skip
            d.path("lid", "walls", link, self._to_walls("lid", A))
        for a, b in pairwise(self.names):
            section = box.k_w * box.t * 2.0 * (box.H + box.L) * 2.0 / (box.H * (self.a[a] + self.a[b])) / STRENGTH
            joint = box.housing.joint_conductance_W_K
            same = self.part[a] == self.part[b]
            d.path(a, b, d.link(self.part[a], self.part[b]), self._upward(section, 0.0 if same else joint))
        if self.lid:
            d.path(top, "lid", box.top, fixed(0.5 * box.housing.joint_conductance_W_K))

    def _to_air(self, body: str, A: float, share: float) -> Law:
        air = self._air(body)

        def law(m: Moment) -> Array:
            h = (wind(m.inputs["air_speed"]) ** 3 + rising(m.T[body], m.T[air]) ** 3) ** (1.0 / 3.0)
            return A * h * m.p["k_air"] * draught(m, STRENGTH, share)

        return law

    def _to_walls(self, body: str, A: float) -> Law:
        return lambda m: A * radiation(m.T[body], m.T["walls"], self.box.housing.emissivity)

    def _upward(self, section: float, joint: float) -> Law:
        if joint == 0.0:
            return lambda m: m.p["k_vert"] * section
        return lambda m: series(m.p["k_vert"] * section, joint)

    # ------------------------------------------------------------------ 2.3, 4 and 5

    def _oil(self) -> None:
        box, d = self.box, self.d
        y_L = d.between(0.25, 0.45)
        for name, part in self.part.items():
            layer = "oil_cold" if self.y[name] <= y_L else "oil_hot"
            d.path(name, layer, d.link("oil", part), self._wall_oil(box.A_in * self.a[name], layer))
        if self.lid:
            area = 0.05 * box.A_in
            d.path(
                "lid", "oil_hot", d.link("oil", box.top),
                lambda m: area * (15.0 + 4.0 * np.sqrt(box.v(m, held=True))),
            )  # fmt: skip
        d.path("oil_hot", "oil_cold", "oil", self._mixed)
        if self.returned == "oil_return":
            whole = list(box.bearings)
            for layer in ("oil_hot", "oil_cold"):
                d.path("oil_return", layer, "oil", lambda m: m.p["k_ret"] * sum(self._carried(b, m) for b in whole))

    def _wall_oil(self, A: float, layer: str) -> Law:
        box = self.box
        wall = 2.0 * box.k_w * A / box.t

        def law(m: Moment) -> Array:
            moved = 0.15 + np.sqrt(box.v(m, held=True) / 8.0) * np.exp(-box.v(m) / 40.0)
            shape = np.clip(moved * (box.nu60 / box.nu(m.T[layer])) ** 0.4, 0.1, 3.0)
            return series(m.p["h_oil"] * shape * A, wall)

        return law

    def _bulk(self, m: Moment) -> Array:
        return 0.5 * (m.T["oil_cold"] + m.T["oil_hot"])

    def _mixed(self, m: Moment) -> Array:
        box, T = self.box, self._bulk(m)
        stirred = box.rho_cp(T) * box.splash(m) * m.p["k_mix"] / STRENGTH
        return 2.0 + stirred * (box.nu60 / box.nu(T)) ** 0.25

    def _carried(self, bearing: str, m: Moment) -> Array:
        """Heat that the oil through a bearing carries, [W/K]."""
        reach = 0.1 + 0.9 * np.minimum(1.0, self.box.v(m) / 6.0)
        return self.box.rho_cp(self._bulk(m)) * self.box.flow(bearing) * reach

    # ------------------------------------------------------------------ 2.3, 6 to 10

    def _rotors(self) -> None:
        box, d = self.box, self.d
        for i, gear in enumerate(box.gears):
            layers = {"oil_hot": 0.6, "oil_cold": 0.4} if box.e[i] > 0.0 else {"oil_hot": 1.0}
            for layer, share in layers.items():
                d.path(self.rims[i], layer, d.link(gear, "oil"), self._gear_oil(i, layer, share))
        (pinion, wheel), (first, second) = box.gears, box.shaft_of
        if not self.one:
            d.path("rim_1", "core_1", d.link(pinion, first), fixed(box.ring(0, self.rim_share[0])[0]))
        outside, inside = box.ring(1, self.rim_share[1])
        if self.core:
            d.path("rim_2", "core_2", wheel, fixed(outside))
            d.path("core_2", "shaft_2", d.link(wheel, second), lambda m: m.p["k_hub"] * inside)
        else:
            law: Law = lambda m: series(outside, m.p["k_hub"] * inside)  # noqa: E731
            d.path("rim_2", "shaft_2", d.link(wheel, second), law)
        merged: dict[str, list[str]] = {}
        for bearing, body in self.bearing_body.items():
            merged.setdefault(body, []).append(bearing)
        for body, own in merged.items():
            shaft, laws = box.bearings[own[0]].shaft, [box.shaft_bearing(b) for b in own]
            d.path(self.shaft_body[shaft], body, d.link(shaft, own[0]), lambda m, laws=laws: sum(f(m) for f in laws))
        for body, own in merged.items():
            seat = sum(np.pi * box.D_d_B(b)[0] * box.D_d_B(b)[2] * 0.35 for b in own)
            for name in self.middle:
                share = seat / len(self.middle)
                d.path(body, name, d.link(own[0], self.part[name]), lambda m, A=share: m.p["h_seat"] * A)
        for body, own in merged.items():
            d.path(
                body, self.returned, d.link(own[0], "oil"),
                lambda m, own=own: m.p["k_boil"] * sum(self._carried(b, m) for b in own),
            )  # fmt: skip

    def _gear_oil(self, i: int, layer: str, share: float) -> Law:
        box, r_a = self.box, self.box.pair.r_a[i]
        rim, faces = 2.0 * np.pi * r_a * box.pair.b * 1.8, 2.0 * np.pi * box.pair.r[i] ** 2 * box.f_im[i]

        def law(m: Moment) -> Array:
            T, omega = m.T[layer], box.omega(box.shaft_of[i], m, held=True)
            h = cylinder(omega, 2.0 * r_a, box.nu(T), box.k(T), box.prandtl(T))
            return share * m.p["k_gear"] * h * (rim * (0.2 + 0.3 * np.minimum(1.0, box.v(m) / 2.0)) + faces)

        return law

    # ------------------------------------------------------------------ 2.3, 11 to 13

    def _surroundings(self) -> None:
        s, box, d = STRENGTH, self.box, self.d
        for name, shaft in box.shafts.items():
            if d.chance(0.5) or shaft.surface_to_air:
                area = s * np.pi * shaft.diameter * 0.2 * shaft.length
                law = self._shaft_air(name, area)
                d.path(self.shaft_body[name], "hall", d.link(name, "air"), law)
        given, foot, below = box.housing.foundation_conductance_W_K, box.foot, "frame" if self.frame else "hall"
        unknown, frame = f"u_slice_1-{below}", d.link(foot, "frame")
        d.uniform(unknown, 0.2, 0.9, exists=given == 0.0)
        d.path("slice_1", below, frame, fixed(given) if given > 0.0 else lambda m: s * m.p[unknown])
        if self.frame:
            d.path("frame", "hall", frame, lambda m: m.p["k_frame"] * 6.0 * box.A_out)
        first, touched = box.shaft_of[0], self.middle[0]
        passed = f"u_neighbour-{touched}"
        d.uniform(passed, 0.05, 0.3, exists=self.neighbour)
        if self.neighbour:
            along = s * box.along(first) / (0.4 * box.shafts[first].length)
            d.path(self.shaft_body[first], "neighbour", "", fixed(along))
            d.path("neighbour", touched, "", lambda m: s * m.p[passed])
            d.path("neighbour", "hall", "", self._neighbour_hall)

    def _neighbour_hall(self, m: Moment) -> Array:
        return m.p["k_nb"] * 8.0 * self.box.A_out

    def _shaft_air(self, shaft: str, area: float) -> Law:
        box, d = self.box, self.box.shafts[shaft].diameter
        return lambda m: area * shaft_in_air(box.omega(shaft, m), d)

    # ------------------------------------------------------------------ 2.4

    def _sources(self) -> None:
        box, d, rims = self.box, self.d, self.rims
        x_p = d.between(0.35, 0.5)
        loss = box.mesh(in_mesh, lambda m: 0.5 * (m.T[rims[0]] + m.T[rims[1]]))
        spread = [(rims[0], x_p), ("oil_hot", 0.15), (rims[1], 0.85 - x_p)]
        d.source("mesh", "mesh_sliding", lambda m: m.p["k_mesh"] * loss(m), spread)
        d.source("churning", "churning", self._churned, [("oil_hot", 0.6), ("oil_cold", 0.4)])
        for bearing, body in self.bearing_body.items():
            d.source(bearing, bearing, self._rolling(bearing, body), [(body, 0.75), (self.returned, 0.25)])
        for seal in box.gearbox.seal:
            shaft = self.shaft_body[seal.shaft]
            spread = [(shaft, 0.35), (self.middle[0], 0.25), ("oil_hot", 0.4)]
            d.source(seal.name, seal.name, self._sealing(seal.shaft, shaft, seal.diameter_mm), spread)
        if self.neighbour:
            d.source("neighbour_loss", "", self._lost_next_door, [("neighbour", 1.0)], is_loss=False)

    def _churned(self, m: Moment) -> Array:
        box, pair, T = self.box, self.box.pair, self._bulk(m)
        nu, rho, power = box.nu(T), box.rho(T), np.zeros_like(m.hours)
        for i, shaft in enumerate(box.shaft_of):
            omega = box.omega(shaft, m)
            power = power + box.f_im[i] * churned_disc(nu, rho, omega, pair.r_a[i]) * omega
            power = power + thrown(rho, omega, pair.r_a[i], box.e[i], pair.m_n, pair.b)
        return m.p["k_churn"] * power

    def _rolling(self, bearing: str, body: str) -> Law:
        box, b = self.box, self.box.bearings[bearing]
        d_m = 0.5 * (b.bore_mm + b.outside_diameter_mm)

        def law(m: Moment) -> Array:
            nu = box.nu(0.5 * (m.T[body] + m.T[self.returned]))
            torque = bearing_torque(nu, box.n_of(b.shaft, m), box.radial(bearing, m), d_m)
            return m.p["k_bear"] * torque * box.starting(b.shaft, m) * box.omega(b.shaft, m)

        return law

    def _sealing(self, shaft: str, body: str, diameter: float) -> Law:
        box = self.box

        def law(m: Moment) -> Array:
            thickness = box.nu(0.5 * (m.T[body] + m.T["oil_hot"])) / box.nu60
            return m.p["k_seal"] * seal_torque(thickness, box.n_of(shaft, m), diameter) * box.omega(shaft, m)

        return law

    def _lost_next_door(self, m: Moment) -> Array:
        return m.p["dT_nb"] * self._neighbour_hall(m) * np.minimum(self.box.relative_power(m), 2.0)

    # ------------------------------------------------------------------ 2.5

    def _weight(self, low: float, high: float) -> float:
        return STRENGTH * self.d.between(low, high)

    def _probes(self) -> None:
        box, d = self.box, self.d
        foreign = [("oil_hot", self._weight(0.1, 0.6)), ("slice_1", self._weight(0.02, 0.08))]
        d.probe("oil", "oil_cold", foreign, d.between(10.0, 60.0))
        for part in box.parts:
            own = [name for name in self.names if self.part[name] == part]
            first = own[int(d.rng.integers(len(own)))]
            k, up = self.names.index(first), d.chance(0.5)
            near = next(self.names[j] for j in ((k + 1, k - 1) if up else (k - 1, k + 1)) if 0 <= j < len(self.names))
            foreign = [(near, self._weight(0.0, 0.3)), (self._air(first), self._weight(0.02, 0.06))]
            d.probe(part, first, foreign, d.between(20.0, 90.0))
        for bearing, body in self.bearing_body.items():
            foreign = [(self.middle[0], self._weight(0.05, 0.25)), ("oil_return", self._weight(0.0, 0.1))]
            d.probe(bearing, body, foreign, d.between(5.0, 30.0))
        (first, second), (pinion, wheel) = box.shaft_of, box.gears
        d.probe(first, self.shaft_body[first], [("hall", self._weight(0.01, 0.04))], d.between(5.0, 20.0))
        foreign = [("rim_2", self._weight(0.0, 0.2)), ("hall", self._weight(0.01, 0.04))]
        d.probe(second, "shaft_2", foreign, d.between(5.0, 20.0))
        d.probe(pinion, self.rims[0], [("oil_hot", self._weight(0.0, 0.15))], d.between(3.0, 15.0))
        inner = "core_2" if self.core else "shaft_2"
        d.probe(wheel, "rim_2", [(inner, self._weight(0.1, 0.5))], d.between(3.0, 15.0))

    # ------------------------------------------------------------------ 2.6

    def _parameters(self) -> None:
        d = self.d
        d.near("frame_C", 2.5, 0.4)
        d.near("nb_C", 3.0, 0.4)
        d.uniform("grad", 0.5, 2.0)
        d.uniform("d_wall", -0.5, 1.5)
        d.uniform("door", 0.1, 0.35)
        for name, value, sd in (
            ("k_air", 2.5, 0.15), ("k_vert", 1.0, 0.3), ("h_oil", 0.6 * self.box.housing.oil_heat_transfer_W_m2K, 0.25),
            ("k_mix", 0.4, 0.4), ("phi", 0.25, 0.3), ("k_ret", 0.8, 0.3), ("k_gear", 1.0, 0.3), ("k_hub", 0.8, 0.25),
            ("R_k", 1.0, 0.25), ("h_seat", 4000.0, 0.4), ("k_boil", 0.5, 0.4), ("k_frame", 0.5, 0.4),
            ("k_nb", 1.0, 0.3), ("mu_b", 0.09, 0.08), ("k_mesh", 1.1, 0.1), ("k_churn", 0.7, 0.3),
            ("k_bear", 1.1, 0.12), ("k_seal", 1.0, 0.15),
        ):  # fmt: skip
            d.near(name, value, sd)
        d.uniform("dT_nb", 8.0, 25.0)
        d.capacities(self.candidates, 0.1)
