"""Kept for proof: the family ``proof_a``, section 1 of SPECIFICATION.md."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from diagnosis.proof.zoo.families.family import PlantFamily
from diagnosis.proof.zoo.structure import Law, Moment, ZooPlant
from models.assembly.gearbox import Gearbox
from models.base.types import Array

from .laws_a import across, bearing_torque, churning, disc, in_mesh, rising, seal_torque, windage
from .parts import GRAVITY, RPM, Box, Draft, fixed, radiation, series, shaft_in_air

STRENGTH = 1.0  # as drawn: medians 0.75 K (fzg, four seeds) and 0.35 K (conveyor, four seeds)


def draw(gearbox: Gearbox, rng: np.random.Generator) -> ZooPlant:
    """Draw one machine."""
    return _Machine(Box(gearbox), rng).plant()


FAMILY = PlantFamily(name="proof_a", description="kept for proof", machines=("fzg", "conveyor"), draw=draw)


class _Machine:
    """One draw, section by section."""

    def __init__(self, box: Box, rng: np.random.Generator) -> None:
        self.box = box
        self.d = Draft(
            "proof_a", box.gearbox, ("speed", "torque", "T_ambient", "air_speed"), set(box.nominal_links()), rng
        )
        self.candidates: list[str] = []

    def plant(self) -> ZooPlant:
        self._bodies()
        self._boundaries()
        self._housing()
        self._oil()
        self._gears()
        self._shafts()
        self._bearings()
        self._surroundings()
        self._sources()
        self._probes()
        self._parameters()
        return self.d.plant(self.box.at_service(), heat_counts=False, row_s=10.0)

    # ------------------------------------------------------------------ 1.1

    def _body(self, exists: bool, name: str, part_of: str, capacity: float) -> None:
        self.candidates.append(name)
        if exists:
            self.d.body(name, part_of, capacity)

    def _bodies(self) -> None:
        box, d = self.box, self.d
        x_w = d.between(0.12, 0.30)
        self._body(True, "sump", "oil", box.C_oil * (1.0 - x_w))
        self._body(True, "wall_oil", "oil", box.C_oil * x_w)
        self.cavity = d.chance(0.7)
        self._body(self.cavity, "cavity", "oil", 3600.0 * (box.A_in / 6.0) ** 1.5 + 0.01 * box.C_oil)
        split = {part: (d.chance(0.6), d.between(0.35, 0.65)) for part in box.parts}
        # Ends of a part: body and share.
        self.ends: dict[str, list[tuple[str, float]]] = {
            part: [(f"{part}_near", x), (f"{part}_far", 1.0 - x)] if cut else [(part, 1.0)]
            for part, (cut, x) in split.items()
        }
        self.seats = d.chance(0.5)
        seat = {name: box.C_seat(name) for name in box.bearings}
        scale = min(1.0, 0.35 * box.C_housing / sum(seat.values()))
        left = 1.0 - self.seats * scale * sum(seat.values()) / box.C_housing
        for part, (cut, x) in split.items():
            capacity = left * box.C_part(part)
            self._body(cut, f"{part}_near", part, capacity * x)
            self._body(cut, f"{part}_far", part, capacity * (1.0 - x))
            self._body(not cut, part, part, capacity)
        for name, capacity in seat.items():
            self._body(self.seats, f"seat_{name}", box.main, scale * capacity)
        self.rings = d.chance(0.75)
        for name in box.bearings:
            self._body(self.rings, f"{name}_in", name, 0.55 * box.C_bearing(name))
            self._body(self.rings, f"{name}_out", name, 0.45 * box.C_bearing(name))
            self._body(not self.rings, name, name, box.C_bearing(name))
        self.rim: dict[int, tuple[bool, float]] = {}
        for i, probability in ((1, 0.8), (0, 0.4)):
            cut, x = d.chance(probability), d.between(0.55, 0.75)
            self.rim[i] = cut, x
            self._body(cut, f"{box.gears[i]}_rim", box.gears[i], x * box.C_gear(i))
            self._body(cut, f"{box.gears[i]}_hub", box.gears[i], (1.0 - x) * box.C_gear(i))
            self._body(not cut, box.gears[i], box.gears[i], box.C_gear(i))
        self.halves = {shaft: d.chance(0.8) for shaft in box.shafts}
        self.stub = {shaft: d.chance(0.5) for shaft in box.shafts}
        for shaft in box.shafts:
            C, stub = box.C_shaft(shaft), self.stub[shaft]
            rest = C * (1.0 - 0.15 * stub)
            self._body(self.halves[shaft], f"{shaft}_drive", shaft, 0.5 * rest)
            self._body(self.halves[shaft], f"{shaft}_free", shaft, 0.5 * rest)
            self._body(not self.halves[shaft], shaft, shaft, rest)
            self._body(stub, f"stub_{shaft}", shaft, 0.15 * C)
        self.plume, self.bed = d.chance(0.6), d.chance(0.65)
        self._body(self.plume, "plume", box.top, 1200.0)
        self.candidates.append("bed")
        if self.bed:
            whole = box.C_housing
            d.body("bed", box.foot, lambda m: m.p["bed_C"] * whole)

    # Bodies by the place they hold; an undivided thing serves for both of its ends.

    def _end(self, part: str, near: bool) -> str:
        return self.ends[part][0 if near else -1][0]

    def _half(self, shaft: str, drive: bool) -> str:
        return f"{shaft}_{'drive' if drive else 'free'}" if self.halves[shaft] else shaft

    def _ring(self, bearing: str, inner: bool) -> str:
        return f"{bearing}_{'in' if inner else 'out'}" if self.rings else bearing

    def _outer_gear(self, i: int) -> str:
        return f"{self.box.gears[i]}_rim" if self.rim[i][0] else self.box.gears[i]

    def _air_of(self, part: str) -> str:
        if part != self.box.top or part == self.box.foot:
            return "air_low"
        return "plume" if self.plume else "air_high"

    # ------------------------------------------------------------------ 1.2

    def _boundaries(self) -> None:
        s, box, d = STRENGTH, self.box, self.d
        d.boundary("air_low", "air", lambda m: m.inputs["T_ambient"] - s * m.p["strat_low"])
        d.boundary("air_high", "air", lambda m: m.inputs["T_ambient"] + s * m.p["strat_high"])
        d.boundary("walls", "air", lambda m: m.inputs["T_ambient"] + s * m.p["d_wall"])
        on_frame = f"{box.foot}-frame" in d.links
        d.boundary("floor", "frame" if on_frame else "air", lambda m: m.inputs["T_ambient"] - s * m.p["d_floor"])
        d.boundary(
            "drive",
            "air",
            lambda m: m.inputs["T_ambient"] + s * m.p["d_drive"] * (0.3 + 0.7 * box.relative_power(m)),
        )
        d.phases("phi_1", "phi_2", "phi_3")

    def _draught(self, far: bool, m: Moment) -> Array:
        later = 1.9 if far else 0.0
        waves = sum(
            np.sin(2.0 * np.pi * m.hours / hours + m.p[f"phi_{k}"] + later)
            for k, hours in ((1, 0.31), (2, 0.83), (3, 2.9))
        )
        return 1.0 + STRENGTH * m.p["gust"] * waves / 3.0

    # ------------------------------------------------------------------ 1.3, 1 to 5

    def _housing(self) -> None:
        s, box, d = STRENGTH, self.box, self.d
        for part, ends in self.ends.items():
            air = self._air_of(part)
            for k, (name, x) in enumerate(ends):
                d.path(name, air, d.link(part, "air"), self._to_air(name, air, box.A_out * box.f(part) * x, k == 1))
        for part, ends in self.ends.items():
            for name, x in ends:
                d.path(name, "walls", d.link(part, "air"), self._to_walls(name, box.A_out * box.f(part) * x))
        if self.plume:
            d.path("plume", "air_high", d.link(box.top, "air"), lambda m: m.p["vent"] * self._draught(False, m))
        round_the_box = 2.0 * (box.H + box.L) / box.L
        for part, ends in self.ends.items():
            if len(ends) == 2:
                lateral = 2.0 * box.k_w * box.t * box.f(part) * round_the_box / s
                d.path(ends[0][0], ends[1][0], part, _constant("k_lat", lateral))
        names = list(self.ends)
        for a, b in pairwise(names):
            for name_a, name_b, x in self._joined(a, b):
                d.path(name_a, name_b, d.link(a, b), _constant("k_joint", box.housing.joint_conductance_W_K * x))

    def _joined(self, a: str, b: str) -> list[tuple[str, str, float]]:
        ends_a, ends_b = self.ends[a], self.ends[b]
        if len(ends_a) == len(ends_b) == 2:
            x = 0.5 * (ends_a[0][1] + ends_b[0][1])
            return [(ends_a[0][0], ends_b[0][0], x), (ends_a[1][0], ends_b[1][0], 1.0 - x)]
        return [(p, q, x * y) for p, x in ends_a for q, y in ends_b]

    def _to_air(self, body: str, air: str, A: float, far: bool) -> Law:
        box = self.box
        reach = 2.5 * box.r_s(0)
        wall = 2.0 * box.k_w * A / box.t

        def law(m: Moment) -> Array:
            stirred = m.p["stir"] * box.omega(box.shaft_of[0], m) * reach
            forced = across(np.sqrt(m.inputs["air_speed"] ** 2 + stirred**2), box.H)
            h = (forced**3 + rising(m.T[body], m.T[air], box.H) ** 3) ** (1.0 / 3.0)
            return series(A * self._draught(far, m) * m.p["k_conv"] * h, wall)

        return law

    def _to_walls(self, body: str, A: float) -> Law:
        return lambda m: A * radiation(m.T[body], m.T["walls"], self.box.housing.emissivity)

    # ------------------------------------------------------------------ 1.3, 6 to 8

    def _oil(self) -> None:
        s, box, d = STRENGTH, self.box, self.d
        for part, ends in self.ends.items():
            for name, x in ends:
                d.path("wall_oil", name, d.link("oil", part), self._film(box.A_in * box.f(part) * x))
        for name, x in self.ends[box.foot]:
            d.path("sump", name, d.link("oil", box.foot), self._floor(0.35 * box.A_in * box.f(box.foot) * x))
        d.path(
            "sump", "wall_oil", "oil", lambda m: 1.5 + m.p["k_spl"] * box.rho_cp(m.T["sump"]) * box.splash(m) / s
        )  # fmt: skip

    def _film(self, A: float) -> Law:
        box = self.box
        wall, width = 2.0 * box.k_w * A / box.t, box.A_in / box.H

        def law(m: Moment) -> Array:
            T = m.T["wall_oil"]
            supply = np.maximum(0.15 * box.splash(m) / width, 5e-7)
            thickness = (3e-6 * box.nu(T) * supply / GRAVITY) ** (1.0 / 3.0)
            wetted = 0.35 + 0.65 * (1.0 - np.exp(-box.v(m) / 3.0))
            return series(m.p["k_film"] * 1.88 * box.k(T) / thickness * A * wetted, wall)

        return law

    def _floor(self, A: float) -> Law:
        box = self.box
        return lambda m: 150.0 * np.sqrt(1.0 + box.v(m) / 5.0) * (box.nu60 / box.nu(m.T["sump"])) ** 0.3 * A

    # ------------------------------------------------------------------ 1.3, 9 to 12

    def _gears(self) -> None:
        box, d = self.box, self.d
        for i, gear in enumerate(box.gears):
            d.path(self._outer_gear(i), "sump", d.link(gear, "oil"), self._gear_oil(i))
        if self.cavity:
            for i, gear in enumerate(box.gears):
                d.path(self._outer_gear(i), "cavity", d.link(gear, "oil"), self._gear_mist(i))
            for name, x in self.ends[box.top]:
                d.path("cavity", name, d.link("oil", box.top), self._mist_top(box.A_in * box.f(box.top) * x))
            d.path("cavity", "wall_oil", "oil", fixed(10.0 * box.A_in))
        for i, gear in enumerate(box.gears):
            cut, x = self.rim[i]
            outside, inside = box.ring(i, x)
            if cut:
                d.path(f"{gear}_rim", f"{gear}_hub", gear, fixed(outside))
            within = inside if cut else float(series(inside, outside))
            shaft = box.shaft_of[i]
            halves = [self._half(shaft, True), self._half(shaft, False)] if self.halves[shaft] else [shaft]
            for half in halves:
                law = self._fit(i, within, 1.0 / len(halves))
                d.path(f"{gear}_hub" if cut else gear, half, d.link(gear, shaft), law)

    def _shafts(self) -> None:
        box, d = self.box, self.d
        for shaft in box.shafts:
            if self.halves[shaft]:
                along = 2.0 * box.along(shaft) / box.shafts[shaft].length
                d.path(f"{shaft}_drive", f"{shaft}_free", shaft, fixed(along))
            for bearing in box.of_shaft(shaft):
                half = self._half(shaft, box.is_drive_end(bearing))
                d.path(half, self._ring(bearing, True), d.link(shaft, bearing), box.shaft_bearing(bearing))

    def _gear_oil(self, i: int) -> Law:
        box, pair = self.box, self.box.pair
        faces = 2.0 * np.pi * pair.r[i] ** 2 * box.f_im[i]
        teeth = pair.z[i] * 4.5 * pair.m_n * pair.b

        def law(m: Moment) -> Array:
            T, v = m.T["sump"], box.v(m)
            h = disc(box.omega(box.shaft_of[i], m, held=True), box.nu(T), box.k(T), box.prandtl(T))
            starved = 1.0 + STRENGTH * (1.0 / np.sqrt(1.0 + (v / m.p["v_starve"]) ** 2) - 1.0)
            wetted = (0.15 + 0.35 * np.minimum(1.0, v / 2.0)) * starved
            return m.p["k_gear"] * h * (faces + teeth * wetted)

        return law

    def _gear_mist(self, i: int) -> Law:
        area = 2.0 * np.pi * self.box.pair.r[i] ** 2
        return lambda m: 40.0 * (np.maximum(self.box.v(m), 0.3) / 10.0) ** 0.7 * area

    def _mist_top(self, A: float) -> Law:
        return lambda m: (8.0 + 3.0 * np.sqrt(self.box.v(m, held=True))) * A

    def _fit(self, i: int, within: float, share: float) -> Law:
        area = 2.0 * np.pi * self.box.r_s(i) * self.box.pair.b
        return lambda m: share * series(within, m.p["h_fit"] * area)

    # ------------------------------------------------------------------ 1.3, 13 to 16

    def _bearings(self) -> None:
        s, box, d = STRENGTH, self.box, self.d
        for bearing in box.bearings if self.rings else ():
            D, bore, B = box.D_d_B(bearing)
            d.path(f"{bearing}_in", f"{bearing}_out", bearing, self._rollers(bearing, 1e3 * (D + bore) * B / s))
        for bearing in box.bearings:
            out = self._ring(bearing, False)
            for place, part, share in self._around(bearing):
                d.path(out, place, d.link(bearing, part), self._gap(bearing, out, place, share))
        for bearing in box.bearings if self.seats else ():
            near, ends = box.is_drive_end(bearing), list(dict.fromkeys((box.foot, box.top)))
            whole = 2.0 * np.pi * box.k_w * 1.5 * box.D_d_B(bearing)[2]
            for part in ends:
                law = _constant("k_seat", whole / len(ends))
                d.path(f"seat_{bearing}", self._end(part, near), d.link(bearing, part), law)
        for bearing in box.bearings:
            rings = [self._ring(bearing, True), self._ring(bearing, False)] if self.rings else [bearing]
            for ring in rings:
                law = self._washed(box.flow(bearing) / len(rings))
                d.path(ring, "wall_oil", d.link(bearing, "oil"), law)

    def _around(self, bearing: str) -> list[tuple[str, str, float]]:
        """Where the fit of a bearing leads: body, nominal part, share."""
        box = self.box
        if self.seats:
            return [(f"seat_{bearing}", box.main, 1.0)]
        ends, near = list(dict.fromkeys((box.foot, box.top))), box.is_drive_end(bearing)
        return [(self._end(part, near), part, 1.0 / len(ends)) for part in ends]

    def _rollers(self, bearing: str, still: float) -> Law:
        box, shaft = self.box, self.box.bearings[bearing].shaft
        n = lambda m: np.maximum(box.n_of(shaft, m), 1.0)  # noqa: E731
        return lambda m: still * m.p["k_roll"] * (1.0 + 0.5 * np.sqrt(n(m) / 1500.0))

    def _gap(self, bearing: str, out: str, place: str, share: float) -> Law:
        box = self.box
        D, _, B = box.D_d_B(bearing)
        neck = 2.0 * np.pi * box.k_w * B / np.log((D + 2.0 * box.t) / D)

        def law(m: Moment) -> Array:
            gap = np.maximum(m.p["g_fit"] - 1.2e-5 * 0.5 * D * (m.T[out] - m.T[place]), 3e-6)
            return share * series(0.13 * np.pi * D * B / gap, neck)

        return law

    def _washed(self, flow: float) -> Law:
        box = self.box

        def law(m: Moment) -> Array:
            reach = 0.1 + 0.9 * np.minimum(1.0, box.v(m, held=True) / 6.0) ** 0.8
            return m.p["k_boil"] * box.rho_cp(m.T["wall_oil"]) * flow * reach

        return law

    # ------------------------------------------------------------------ 1.3, 17 and 18

    def _surroundings(self) -> None:
        s, box, d = STRENGTH, self.box, self.d
        for name, shaft in box.shafts.items():
            half, length, section = self._half(name, True), shaft.length, box.along(name)
            if self.stub[name]:
                d.path(f"stub_{name}", half, name, fixed(section / (0.15 * length + 0.02)))
                law = self._shaft_air(name, np.pi * shaft.diameter * 0.15 * length)
                d.path(f"stub_{name}", "air_low", d.link(name, "air"), law)
                d.path(f"stub_{name}", "drive", "", fixed(s * section / 0.15))
            elif shaft.surface_to_air:
                law = self._shaft_air(name, np.pi * shaft.diameter * shaft.length_in_air)
                d.path(half, "air_low", d.link(name, "air"), law)
        given, foot, below = box.housing.foundation_conductance_W_K, box.foot, "bed" if self.bed else "floor"
        unknown, frame = f"u_{foot}-{below}", d.link(foot, "frame")
        d.uniform(unknown, 0.3, 1.2, exists=given == 0.0)

        def standing(m: Moment) -> Array:
            return np.full_like(m.hours, given) if given > 0.0 else s * m.p[unknown]

        for name, x in self.ends[foot]:
            d.path(name, below, frame, lambda m, x=x: x * standing(m))
        if self.bed:
            d.path("bed", "floor", frame, lambda m: 2.0 * m.p["k_bed"] * np.maximum(standing(m), 1.0))
            d.path("bed", "air_low", frame, fixed(3.0 * box.A_out))

    def _shaft_air(self, shaft: str, area: float) -> Law:
        box, d = self.box, self.box.shafts[shaft].diameter
        return lambda m: area * shaft_in_air(box.omega(shaft, m), d)

    # ------------------------------------------------------------------ 1.4

    def _sources(self) -> None:
        box, d = self.box, self.d
        rims = [self._outer_gear(0), self._outer_gear(1)]
        x_p = 0.44 + d.between(-0.06, 0.06)
        loss = box.mesh(in_mesh, lambda m: 0.5 * (m.T[rims[0]] + m.T[rims[1]]))
        d.source(
            "mesh",
            "mesh_sliding",
            lambda m: m.p["k_mesh"] * loss(m),
            [(rims[0], x_p), (rims[1], 0.88 - x_p), ("wall_oil", 0.12)],
        )
        mist = "cavity" if self.cavity else "sump"
        d.source("churning", "churning", self._churned, [("sump", 0.7), ("wall_oil", 0.2), (mist, 0.1)])
        for bearing in box.bearings:
            inner, outer = self._ring(bearing, True), self._ring(bearing, False)
            spread = [(inner, 0.5), (outer, 0.3), ("wall_oil", 0.2)]
            d.source(bearing, bearing, self._rolling(bearing, inner), spread)
        for seal in box.gearbox.seal:
            half = self._half(seal.shaft, True)
            spread = [(half, 0.5), ("sump", 0.3), (self._end(box.foot, True), 0.2)]
            d.source(seal.name, seal.name, self._sealing(seal.shaft, half, seal_torque(seal.diameter_mm)), spread)
        if self.cavity:
            d.source("windage", "churning", self._blown, [("cavity", 1.0)])
        d.source(
            "motor_radiation",
            "",
            lambda m: STRENGTH * m.p["stray"] * RPM * box.n(m) * box.torque(m),
            [(self._end(box.foot, True), 1.0)],
            is_loss=False,
        )

    def _churned(self, m: Moment) -> Array:
        box, pair = self.box, self.box.pair
        nu = np.minimum(box.nu(m.T["sump"]), 60.0)
        return m.p["k_churn"] * sum(
            churning(
                nu, box.n_of(box.shaft_of[i], m), 2e3 * pair.r_a[i], 1e3 * pair.b, 1e3 * pair.m_n,
                min(1.0, box.e[i] / pair.r_a[i]),
            )
            for i in (0, 1)
        )  # fmt: skip

    def _rolling(self, bearing: str, inner: str) -> Law:
        box, b = self.box, self.box.bearings[bearing]
        d_m = 0.5 * (b.bore_mm + b.outside_diameter_mm)

        def law(m: Moment) -> Array:
            nu = box.nu(0.5 * (m.T[inner] + m.T["wall_oil"]))
            torque = sum(bearing_torque(nu, box.n_of(b.shaft, m), box.radial(bearing, m), d_m))
            return m.p["k_bear"] * 1e-3 * torque * box.starting(b.shaft, m) * box.omega(b.shaft, m)

        return law

    def _sealing(self, shaft: str, half: str, torque: float) -> Law:
        box = self.box

        def law(m: Moment) -> Array:
            thick = np.clip(box.nu(m.T[half]) / box.nu60, 0.3, 8.0) ** 0.25
            return m.p["k_seal"] * torque * thick * box.omega(shaft, m)

        return law

    def _blown(self, m: Moment) -> Array:
        box, pair = self.box, self.box.pair
        eta = box.eta_mPas(m.T["wall_oil"])
        return 0.5 * sum(windage(box.n_of(box.shaft_of[i], m), pair.r_a[i], pair.b, eta) for i in (0, 1))

    # ------------------------------------------------------------------ 1.5

    def _weights(self, *limits: tuple[float, float]) -> list[float]:
        return [STRENGTH * self.d.between(*pair) for pair in limits]

    def _probes(self) -> None:
        box, d = self.box, self.d
        w = self._weights((0.0, 0.3), (0.02, 0.08))
        self._probe("oil", "sump", ["wall_oil", self._end(box.foot, True)], w, (10.0, 45.0))
        for part in box.parts:
            near = d.chance(0.5)
            w = self._weights((0.0, 0.25), (0.02, 0.06))
            places = [self._end(part, not near), self._air_of(part)]
            self._probe(part, self._end(part, near), places, w, (15.0, 60.0))
        for bearing in box.bearings:
            w = self._weights((0.05, 0.2), (0.0, 0.02))
            wall = f"seat_{bearing}" if self.seats else self._end(box.main, box.is_drive_end(bearing))
            self._probe(bearing, self._ring(bearing, False), [wall, "air_low"], w, (5.0, 25.0))
        for shaft in box.shafts:
            drive = d.chance(0.5)
            w = self._weights((0.1, 0.5), (0.0, 0.03))
            self._probe(shaft, self._half(shaft, drive), [self._half(shaft, not drive), "air_low"], w, (5.0, 20.0))
        for i, gear in enumerate(box.gears):
            self._probe(gear, self._outer_gear(i), [f"{gear}_hub"], self._weights((0.1, 0.5)), (3.0, 12.0))

    def _probe(
        self, channel: str, first: str, places: Sequence[str], weights: Sequence[float], lag: tuple[float, float]
    ) -> None:
        self.d.probe(channel, first, list(zip(places, weights, strict=True)), self.d.between(*lag))

    # ------------------------------------------------------------------ 1.6

    def _parameters(self) -> None:
        d = self.d
        d.near("bed_C", 2.0, 0.4, exists=self.bed)
        for name, low, high in (
            ("strat_low", 0.1, 0.6), ("strat_high", 0.2, 0.9), ("d_wall", -1.0, 0.5), ("d_floor", 0.0, 1.5),
            ("d_drive", 1.0, 6.0), ("gust", 0.03, 0.10),
        ):  # fmt: skip
            d.uniform(name, low, high)
        for name, value, sd in (
            ("k_conv", 2.1, 0.15), ("stir", 0.06, 0.4), ("vent", 120.0 * self.box.A_out, 0.3), ("k_lat", 1.0, 0.3),
            ("k_joint", 1.0, 0.3), ("k_film", 1.0, 0.25), ("k_spl", 1.0, 0.4), ("phi", 0.25, 0.3),
            ("k_gear", 1.0, 0.3), ("v_starve", 15.0, 0.3), ("h_fit", 8000.0, 0.4), ("R_k", 1.0, 0.25),
            ("k_roll", 1.0, 0.3), ("g_fit", 15e-6, 0.4), ("k_seat", 1.0, 0.3), ("k_boil", 0.6, 0.4),
            ("k_bed", 1.5, 0.4), ("k_mesh", 1.0, 0.1), ("k_churn", 0.12, 0.3), ("k_bear", 1.0, 0.12),
            ("k_seal", 0.9, 0.15),
        ):  # fmt: skip
            d.near(name, value, sd)
        d.uniform("stray", 0.0, 0.0004)
        d.capacities(self.candidates, 0.08)


def _constant(parameter: str, value: float) -> Law:
    return lambda m: m.p[parameter] * value
