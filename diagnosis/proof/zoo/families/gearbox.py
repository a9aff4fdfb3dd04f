"""One-stage gearboxes put together from a design: which bodies are split or merged, which paths there are, which laws.

Bodies are named after the nominal node that they are a piece of: ``housing_lower.inner``, ``pinion.rim``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise

import numpy as np

from diagnosis.proof.plant.anatomy import AIR, FRAME
from diagnosis.proof.plant.sizes import T_SERVICE
from diagnosis.proof.zoo.families import films, losses
from diagnosis.proof.zoo.families.builder import Builder, wander
from diagnosis.proof.zoo.families.design import GearboxDesign
from diagnosis.proof.zoo.families.losses import RPM
from diagnosis.proof.zoo.families.sizes import Sizes
from diagnosis.proof.zoo.structure import Law, Moment, ZooPlant, constant
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.definition.bearing_section import Bearing

OIL_TO_WALL = 0.4  # share of the oil's heat transfer that is left at rest
SPAN_H = 80.0  # of a wandering draught before it repeats


def build_gearbox(family: str, gearbox: Gearbox, design: GearboxDesign, rng: np.random.Generator) -> ZooPlant:
    """Put a gearbox together."""
    return _Gearbox(family, gearbox, design, rng).plant()


class _Gearbox:
    """A gearbox in the making."""

    def __init__(self, family: str, gearbox: Gearbox, design: GearboxDesign, rng: np.random.Generator) -> None:
        self.sizes, self.design = Sizes(gearbox), design
        self.b = Builder(family, gearbox, ("speed", "torque", "T_ambient", "air_speed"), rng)
        self.gearbox, self.oil = gearbox, gearbox.lubricant()
        self.n_ref, self.M_ref = self.sizes.reference
        self.parts = [part.name for part in gearbox.housing.part]
        self.at: dict[str, dict[str, str]] = {}  # of a nominal node: places such as "outer", "inner" -> body

    def plant(self) -> ZooPlant:
        self._boundaries()
        self._housing()
        self._oil()
        self._gears_and_shafts()
        self._bearings()
        self._mesh()
        self._churning()
        self._bearing_losses()
        for seal in self.gearbox.seal:
            self._seal_loss(seal.name, seal.shaft, seal.diameter_mm)
        self._probes()
        return self.b.plant(loss_W=self._reference_loss(), row_s=10.0)

    # ------------------------------------------------------------------ boundaries and housing

    def _boundaries(self) -> None:
        b = self.b
        b.boundary(AIR, AIR, lambda m: m.inputs["T_ambient"])
        self.upper_air = AIR
        if self.design.stratified:
            b.draw("stratification", self.design.stratified, 0.3)
            b.boundary(
                "air.upper", AIR,
                lambda m: m.inputs["T_ambient"] + m.p["stratification"] * (m.T["oil.sump"] - m.inputs["T_ambient"]),
            )  # fmt: skip
            self.upper_air = "air.upper"
        if self.design.foundation != "none":
            b.boundary(FRAME, FRAME, lambda m: m.inputs["T_ambient"])
        self.still: Law = (
            wander(b.rng, sd=self.design.draught, tau_h=b.uniform(0.3, 1.5), span_h=SPAN_H)
            if self.design.draught
            else constant(1.0)
        )

    def _housing(self) -> None:
        b, sizes, design, housing = self.b, self.sizes, self.design, self.gearbox.housing
        b.draw("air", 1.0, 0.12)
        b.draw("emissivity", housing.emissivity, 0.05)
        b.draw("wall", 1.0, 0.1)
        whole = "+".join(self.parts)
        groups = (
            {whole: self.parts} if design.one_box and len(self.parts) > 1 else {part: [part] for part in self.parts}
        )
        share_of = {part.name: part.area_fraction for part in housing.part}
        names = {1: ("wall",), 2: ("inner", "outer"), 3: ("inner", "core", "outer")}[design.layers]
        self.groups: dict[str, tuple[str, float]] = {}  # nominal part -> group, its share of the box
        for g, (node, members) in enumerate(groups.items()):
            share = sum(share_of[part] for part in members)
            short = members[0] if len(members) == 1 else "box"
            layers = [b.body(f"{short}.{name}", node, sizes.C_housing * share / design.layers) for name in names]
            slab = sizes.R_wall / share / design.layers
            for a, c in pairwise(layers):
                b.path(a, c, 1.0 / slab, common="wall")
            for part in members:
                self.at[part] = {"inner": layers[0], "outer": layers[-1], "middle": layers[len(layers) // 2]}
                self.groups[part] = short, share
            air = self.upper_air if (g > 0 or len(groups) == 1) else AIR
            self._to_air(layers[-1], air, share, 0.5 * slab)
        distinct = list(dict.fromkeys(self.at[part]["middle"] for part in self.parts))
        for below, above in pairwise(distinct):
            b.path(below, above, housing.joint_conductance_W_K, 0.3)
        if design.foundation != "none":
            self._foundation()

    def _to_air(self, wall: str, air: str, share: float, half_slab: float) -> None:
        housing = self.gearbox.housing
        h, area, L = self.design.convection, housing.outside_area_m2 * share, housing.height_m
        still = self.still

        def conductance(m: Moment) -> Array:
            T, T_a = m.T[wall], m.T[air]
            convection = m.p["air"] * still(m) * h(T, T_a, m.inputs["air_speed"], L)
            surface = area * (convection + films.radiation(T, m.inputs["T_ambient"], m.p["emissivity"]))
            return np.asarray(surface / (1.0 + surface * half_slab))

        self.b.path(wall, air, conductance, 0.05)

    def _foundation(self) -> None:
        b, housing = self.b, self.gearbox.housing
        standing = [part.name for part in housing.part if part.foundation] or self.parts[:1]
        G = housing.foundation_conductance_W_K or b.uniform(0.05, 0.2) * 14.0 * housing.outside_area_m2 / 0.214 * 2.0
        foot = self.at[standing[0]]["outer"]
        if self.design.foundation == "link":
            b.path(foot, FRAME, G, 0.4)
            return
        b.body("bed", standing[0], self.sizes.C_housing * b.uniform(0.3, 1.0), 0.3)
        b.path(foot, "bed", 2.0 * G, 0.3)
        b.path("bed", FRAME, 2.0 * G, 0.4)

    # ------------------------------------------------------------------ oil

    def _oil(self) -> None:
        b, sizes, design, housing = self.b, self.sizes, self.design, self.gearbox.housing
        shares = {"sump": (1.0,), "mist": (0.8, 0.2), "film": (0.7, 0.18, 0.12)}[design.oil]
        names = ("sump", "mist", "film")[: len(shares)]
        for name, share in zip(names, shares, strict=True):
            b.body(f"oil.{name}", "oil", sizes.C_oil * share)
        self.at["oil"] = {"sump": "oil.sump", "mist": "oil.mist" if len(shares) > 1 else "oil.sump"}
        self.at["oil"]["film"] = "oil.film" if len(shares) > 2 else self.at["oil"]["mist"]
        b.draw("oil film", 1.0, 0.15)
        b.draw("splash exponent", 0.5, 0.15)
        A_h = housing.oil_heat_transfer_W_m2K * housing.inside_area_m2
        if len(shares) > 1:
            b.path("oil.sump", "oil.mist", self._splash(b.uniform(4.0, 9.0) * A_h), 0.2)
        if len(shares) > 2:
            b.path("oil.mist", "oil.film", self._splash(b.uniform(3.0, 6.0) * A_h), 0.2)
        done = set()
        for k, part in enumerate(self.parts):
            short, share = self.groups[part]
            if short in done:
                continue
            done.add(short)
            half = 0.5 * sizes.R_wall / share / design.layers
            if short == "box" and design.oil != "sump":
                for place, own in (("sump", 0.5), ("film", 0.5)):
                    self._oil_to_wall(self.at["oil"][place], part, A_h * share * own, half / own)
            else:
                place = "sump" if k == 0 else "film"
                self._oil_to_wall(self.at["oil"][place], part, A_h * share, half)

    def _splash(self, G: float) -> Law:
        """Exchange that grows with speed."""
        n_ref = self.n_ref
        return lambda m: G * (OIL_TO_WALL + (1.0 - OIL_TO_WALL) * (_speed(m) / n_ref) ** m.p["splash exponent"])

    def _oil_to_wall(self, oil: str, part: str, G: float, half_slab: float) -> None:
        splash = self._splash(G)

        def conductance(m: Moment) -> Array:
            film = m.p["oil film"] * splash(m)
            return np.asarray(film / (1.0 + film * half_slab))

        self.b.path(oil, self.at[part]["inner"], conductance, 0.1)

    # ------------------------------------------------------------------ gears and shafts

    def _gears_and_shafts(self) -> None:
        b, sizes, design = self.b, self.sizes, self.design
        b.draw("gear film", 1.0, 0.2)
        for i, (gear, shaft) in enumerate(zip(sizes.gears, sizes.shafts, strict=True)):
            C_gear, C_shaft, R = sizes.C_gear(i), sizes.C_shaft(shaft), sizes.R_gear(i)
            if design.gears == "rotor":
                rotor = b.body(f"{shaft}.rotor", f"{shaft}+{gear}", C_gear + C_shaft)
                self.at[gear] = {"rim": rotor, "hub": rotor}
                self.at[shaft] = {"middle": rotor} | dict.fromkeys(sizes.bearings(shaft), rotor)
            else:
                self._shaft(shaft, C_shaft)
                if design.gears == "rim":
                    rim = b.body(f"{gear}.rim", gear, 0.4 * C_gear)
                    hub = b.body(f"{gear}.hub", gear, 0.6 * C_gear)
                    b.path(rim, hub, 1.0 / (0.35 * R))
                    b.path(hub, self.at[shaft]["middle"], 1.0 / (0.65 * R), 0.2)
                    self.at[gear] = {"rim": rim, "hub": hub}
                else:
                    body = b.body(gear, gear, C_gear)
                    b.path(body, self.at[shaft]["middle"], 1.0 / R, 0.2)
                    self.at[gear] = {"rim": body, "hub": body}
            self._gear_to_oil(i, gear)
            self._shaft_to_air(shaft)

    def _shaft(self, shaft: str, C: float) -> None:
        b, sizes = self.b, self.sizes
        seats = sizes.bearings(shaft)
        if self.design.shafts == "halves" and len(seats) > 1:
            halves = [b.body(f"{shaft}.{k}", shaft, 0.5 * C) for k in ("near", "far")]
            b.path(halves[0], halves[1], 2.0 / sizes.R_shaft(shaft))
            self.at[shaft] = {"middle": halves[0]}
            for k, bearing in enumerate(seats):
                self.at[shaft][bearing] = halves[min(k, 1)]
        elif self.design.shafts == "ends" and seats:
            middle = b.body(f"{shaft}.middle", shaft, 0.4 * C)
            self.at[shaft] = {"middle": middle}
            for bearing in seats:
                end = b.body(f"{shaft}.{bearing}", shaft, 0.6 * C / len(seats))
                b.path(middle, end, 1.0 / (0.15 * sizes.R_shaft(shaft)))
                self.at[shaft][bearing] = end
        else:
            body = b.body(shaft, shaft, C)
            self.at[shaft] = {"middle": body} | dict.fromkeys(seats, body)

    def _gear_to_oil(self, i: int, gear: str) -> None:
        b, sizes, pair, oil = self.b, self.sizes, self.sizes.pair, self.oil
        sump, mist = self.at["oil"]["sump"], self.at["oil"]["mist"]
        rho, c = float(oil.density(T_SERVICE)), float(oil.specific_heat(T_SERVICE))
        k = float(oil.conductivity(T_SERVICE))
        r, height = pair.r[i], pair.r_a[i] - pair.r_f[i]
        teeth = pair.z[i] * height * pair.b
        theta = float(np.arccos(np.clip(1.0 - sizes.tips_under_oil[i] / pair.r_a[i], -1.0, 1.0)))
        faces = 2.0 * np.pi * r**2 * (2.0 * theta - np.sin(2.0 * theta)) / (2.0 * np.pi)
        cylinder = self.design.gear_film == "cylinder"

        def from_teeth(m: Moment) -> Array:
            nu = oil.kinematic_viscosity(m.T[mist])
            prandtl, omega = nu * 1e-6 * rho * c / k, sizes.omega(_speed(m), i)
            if cylinder:
                h = films.jet_sprayed(omega, r, nu, k, prandtl)
                return np.asarray(m.p["gear film"] * h * (0.35 * teeth + faces))
            return np.asarray(m.p["gear film"] * films.fling_off(omega, r, height, rho * c * k, prandtl) * teeth)

        b.path(self.at[gear]["rim"], mist, from_teeth, 0.15, name=f"{gear}.teeth-oil")
        if faces > 0.0 and not cylinder:

            def from_faces(m: Moment) -> Array:
                nu = oil.kinematic_viscosity(m.T[sump])
                prandtl = nu * 1e-6 * rho * c / k
                h = films.rotating_disk(sizes.omega(_speed(m), i), r, nu, k, prandtl)
                return np.asarray(m.p["gear film"] * h * faces)

            b.path(self.at[gear]["hub"], sump, from_faces, 0.15, name=f"{gear}.faces-oil")

    def _shaft_to_air(self, shaft: str) -> None:
        b, section = self.b, self.sizes.shaft(shaft)
        d = section.diameter
        seats = self.sizes.bearings(shaft)
        root = self.at[shaft][seats[0]] if seats else self.at[shaft]["middle"]
        length = section.length_in_air or b.uniform(0.3, 1.2) * d
        stub = section.conductivity_W_mK * np.pi / 4.0 * d**2 / (0.5 * length + d)
        ratio = self.gearbox.speed_ratio[shaft]

        def law(area: float, diameter: float) -> Law:
            return lambda m: films.shaft_end(_speed(m) * ratio * RPM, diameter, m.T[AIR]) * area

        if shaft in self.design.flanges:
            mass = np.pi / 4.0 * (2.5 * d) ** 2 * 0.5 * d
            flange = b.body(f"{shaft}.flange", shaft, mass * self.sizes.steel_per_volume, 0.3)
            b.path(root, flange, stub, 0.3)
            b.path(flange, AIR, law(2.0 * np.pi / 4.0 * (2.5 * d) ** 2, 2.5 * d), 0.3)
        elif shaft in self.design.shaft_ends or section.length_in_air:
            bare = law(np.pi * d * length, d)

            def to_air(m: Moment) -> Array:
                surface = bare(m)
                return np.asarray(surface / (1.0 + surface / stub))

            b.path(root, AIR, to_air, 0.3)

    # ------------------------------------------------------------------ bearings

    def _bearings(self) -> None:
        b, sizes, design = self.b, self.sizes, self.design
        b.draw("seat", b.uniform(0.4, 1.0), 0.15)
        b.draw("through-flow", b.uniform(0.3, 0.9), 0.25)
        for shaft in dict.fromkeys(bearing.shaft for bearing in self.gearbox.bearing):
            names = sizes.bearings(shaft)
            if design.bearings == "shaft" and len(names) > 1:
                body = b.body(f"{shaft}.bearings", "+".join(names), sum(map(sizes.C_bearing, names)))
                for name in names:
                    self.at[name] = {"inner": body, "outer": body}
                self._bearing_paths(shaft, names)
                continue
            for name in names:
                C = sizes.C_bearing(name)
                if design.bearings == "rings":
                    inner = b.body(f"{name}.inner", name, 0.45 * C)
                    outer = b.body(f"{name}.outer", name, 0.55 * C)
                    b.path(inner, outer, 0.7 / sizes.R_bearing(name), 0.3)
                    self.at[name] = {"inner": inner, "outer": outer}
                else:
                    body = b.body(name, name, C)
                    self.at[name] = {"inner": body, "outer": body}
                self._bearing_paths(shaft, [name])

    def _bearing_paths(self, shaft: str, names: list[str]) -> None:
        """Paths of one bearing, or of all of a shaft."""
        b, sizes, design = self.b, self.sizes, self.design
        inner, outer = self.at[names[0]]["inner"], self.at[names[0]]["outer"]
        along = 0.25 if design.shafts == "one" or design.gears == "rotor" else 0.1
        G = sum(1.0 / (along * sizes.R_shaft(shaft) + 0.5 * sizes.R_bearing(name)) for name in names)
        b.path(self.at[shaft][names[0]], inner, G, 0.2)
        to_wall = sum(2.0 / sizes.R_bearing(name) for name in names)
        walls = list(dict.fromkeys(self.at[part]["middle"] for part in self.parts))
        if design.seats:
            node = self.b.nominal[walls[0]].split("+")[0]
            short = names[0] if len(names) == 1 else f"{shaft}.bearings"
            seat = b.body(f"{short}.seat", node, 0.06 * sizes.C_housing * len(names) / len(self.gearbox.bearing))
            b.path(outer, seat, to_wall, 0.2, common="seat")
            for wall in walls:
                b.path(seat, wall, 2.0 * to_wall / len(walls), 0.2, common="seat")
        else:
            for wall in walls:
                b.path(outer, wall, to_wall / len(walls), 0.2, common="seat")
        flow = sum(sizes.through_flow(name) for name in names)
        n_ref = self.n_ref
        place = "mist" if b.chance(0.5) else "sump"
        b.path(
            inner, self.at["oil"][place], lambda m: flow * (0.3 + 0.7 * np.sqrt(_speed(m) / n_ref)), 0.2,
            common="through-flow",
        )  # fmt: skip

    # ------------------------------------------------------------------ losses

    def _mesh(self) -> None:
        b, sizes, pair, oil, design = self.b, self.sizes, self.sizes.pair, self.oil, self.design
        rims = [self.at[gear]["rim"] for gear in sizes.gears]
        sump, H, R = self.at["oil"]["sump"], float(pair.H_V), float(pair.rho_red_C)
        sin, Ra = float(np.sin(pair.alpha_wt)), float(np.mean(sizes.gearbox.stage[0].roughness_Ra)) * 1e6
        bulk = 0.0 if design.friction is losses.friction_schlenk else 0.7

        def sliding(m: Moment) -> Array:
            torque, omega = np.abs(m.inputs["torque"]), _speed(m) * RPM
            v_t = omega * pair.r_w[0]
            T = (1.0 - bulk) * m.T[sump] + bulk * 0.5 * (m.T[rims[0]] + m.T[rims[1]])
            nu = oil.kinematic_viscosity(T)
            contact = losses.Contact(
                w=torque / pair.r_b[0] / pair.b, v_s=H * v_t, v_r=2.0 * v_t * sin,
                eta=nu * 1e-6 * oil.density(T), nu=nu, R=R, Ra_um=Ra, E_red=sizes.E_red,
            )  # fmt: skip
            return np.asarray(torque * omega * H * design.friction(contact))

        into_oil = b.uniform(0.02, 0.12)
        hot = {sump: into_oil, rims[0]: 0.5 * (1.0 - into_oil), rims[1]: 0.5 * (1.0 - into_oil)}
        b.source("mesh_sliding", "mesh_sliding", sliding, hot, 0.08)
        eta_ref, n_ref = float(oil.kinematic_viscosity(T_SERVICE)), self.n_ref
        rolling = 9.0e7 * 0.45e-6 * 2.0 * self.n_ref * RPM * pair.r_w[0] * sin * pair.b * b.uniform(0.6, 1.4)

        def roll(m: Moment) -> Array:
            thick = oil.kinematic_viscosity(0.5 * (m.T[rims[0]] + m.T[rims[1]])) / eta_ref
            return np.asarray(rolling * (_speed(m) / n_ref) ** 1.67 * np.minimum(thick, 8.0) ** 0.5)

        b.source("mesh_rolling", "mesh_rolling", roll, hot, 0.2)
        b_H = np.sqrt(8.0 * R / (np.pi * sizes.E_red * pair.r_b[0] * pair.b))
        k, chi = sizes.k_steel, sizes.k_steel / sizes.steel_per_volume

        def contact(m: Moment) -> Array:
            half = b_H * np.sqrt(np.maximum(np.abs(m.inputs["torque"]), 1.0))
            omega = np.maximum(_speed(m), 1.0) * RPM
            # Both halves in series: the contact's heat source temperature is no body here.
            return np.asarray(half * pair.b * k / 1.06 * np.sqrt(omega * pair.T1C / (chi * half)))

        b.path(rims[0], rims[1], contact, 0.15, name="mesh", part_of="+".join(f"mesh-{gear}" for gear in sizes.gears))

    def _churning(self) -> None:
        b, sizes, pair, oil, design = self.b, self.sizes, self.sizes.pair, self.oil, self.design
        sump, rho = self.at["oil"]["sump"], float(oil.density(T_SERVICE))
        dips, tips = [sizes.dip(0), sizes.dip(1)], sizes.tips_under_oil
        C_Sp = b.uniform(0.2, 0.45)
        law = {
            "changenet_2007": losses.churning_changenet_2007,
            "changenet_2011": losses.churning_changenet_2011,
            "lauster": losses.churning_lauster,
        }.get(design.churning)

        def churning(m: Moment) -> Array:
            n = _speed(m)
            if law is None:
                return losses.churning_mauz(tips, pair.b, n * RPM * pair.r_w[0], sizes.omega(n, 1), C_Sp)
            nu = np.minimum(oil.kinematic_viscosity(m.T[sump]), 500.0)
            return np.asarray(sum(law(dip, sizes.omega(n, i), nu, rho) for i, dip in enumerate(dips)))

        into = {sump: 0.7, self.at["oil"]["mist"]: 0.3} if design.oil != "sump" else {sump: 1.0}
        b.source("churning", "churning", churning, into, 0.2)

    def _bearing_losses(self) -> None:
        b = self.b
        f_0, f_1 = b.uniform(2.2, 4.0), b.uniform(2e-4, 4e-4)
        R_1, mu_bl = b.uniform(0.9, 1.3) * 1e-6, b.uniform(0.05, 0.13)
        for bearing in self.gearbox.bearing:
            if self.design.bearing == "palmgren":
                self._bearing_loss(bearing, partial(losses.bearing_palmgren, bearing, f_0=f_0, f_1=f_1), 500.0)
            else:
                self._bearing_loss(bearing, partial(losses.bearing_skf, bearing, R_1=R_1, mu_bl=mu_bl), np.inf)

    def _bearing_loss(self, bearing: Bearing, law: Callable[[Array, Array, Array], Array], thickest: float) -> None:
        """Loss by a law of speed, force and viscosity, which is held at `thickest`, [mm^2/s]."""
        oil, r_b, name = self.oil, self.sizes.pair.r_b[0], bearing.name
        ratio, share = self.gearbox.speed_ratio[bearing.shaft], float(bearing.load_share or 0.0)
        inner, outer, sump = self.at[name]["inner"], self.at[name]["outer"], self.at["oil"]["sump"]

        def power(m: Moment) -> Array:
            nu = np.minimum(oil.kinematic_viscosity(0.5 * (m.T[inner] + m.T[sump])), thickest)
            return law(_speed(m) * ratio, np.abs(m.inputs["torque"]) / r_b * share, nu)

        into = {inner: 1.0} if inner == outer else {inner: 0.5, outer: 0.5}
        self.b.source(name, name, power, into, 0.12)

    def _seal_loss(self, name: str, shaft: str, d_mm: float) -> None:
        design, sump, nu_40 = self.design, self.at["oil"]["sump"], self.oil.nu_40
        ratio = self.gearbox.speed_ratio[shaft]

        def power(m: Moment) -> Array:
            n = _speed(m) * ratio
            if design.seal == "iso_1":
                return losses.seal_iso_1(d_mm, n)
            return (
                losses.seal_iso_2(d_mm, n) if design.seal == "iso_2" else losses.seal_linke(d_mm, n, m.T[sump], nu_40)
            )

        seats = self.sizes.bearings(shaft)
        root = self.at[shaft][seats[0]] if seats else self.at[shaft]["middle"]
        into = {sump: 1.0} if design.seal_into == "oil" else {root: 0.5, self.at[self.parts[0]]["outer"]: 0.5}
        self.b.source(name, name, power, into, 0.15)

    def _reference_loss(self) -> float:
        ones = np.ones(1)
        T = dict.fromkeys(self.b.nominal, T_SERVICE * ones)
        inputs = {"speed": self.n_ref * ones, "torque": self.M_ref * ones, "T_ambient": 25.0 * ones, "air_speed": ones}
        p = {name: value * ones for name, value in self.b.parameters.items()}
        moment = Moment(hours=ones, since_start=ones, inputs=inputs, T=T, p=p)
        return float(sum(source.power(moment)[0] for source in self.b.sources))

    # ------------------------------------------------------------------ probes

    def _probes(self) -> None:
        b, sizes = self.b, self.sizes
        first = self.at[self.parts[0]]["inner"]
        b.probe("oil", self._mixed({self.at["oil"]["sump"]: 1.0}, {self.at["oil"]["mist"]: 0.1, first: 0.1}))
        for part in self.parts:
            places = self.at[part]
            b.probe(part, self._mixed({places["middle"]: 0.5, places["outer"]: 0.5}, {AIR: 0.04}))
        for shaft in sizes.shafts:
            bearing = sizes.bearings(shaft)[0]
            wall = self.at[self.parts[-1]]["middle"]
            b.probe(bearing, self._mixed({self.at[bearing]["outer"]: 1.0}, {wall: 0.12, AIR: 0.01}))
        gear = sizes.gears[0]
        b.probe(
            gear, self._mixed({self.at[gear]["rim"]: 0.5, self.at[gear]["hub"]: 0.5}, {self.at["oil"]["mist"]: 0.05})
        )

    def _mixed(self, seat: Mapping[str, float], others: Mapping[str, float]) -> dict[str, float]:
        """The seat's bodies, and by chance some of the others up to these shares."""
        mix: dict[str, float] = {}
        for body, weight in seat.items():
            mix[body] = mix.get(body, 0.0) + weight
        for body, share in others.items():
            if self.b.chance(0.6):
                mix[body] = mix.get(body, 0.0) + self.b.uniform(0.0, share)
        return mix


def _speed(m: Moment) -> Array:
    return np.abs(m.inputs["speed"])
