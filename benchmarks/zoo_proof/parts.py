"""Kept for proof: sizes of a one-stage gearbox, laws and the draft of a plant that both families share.

Section numbers in comments are those of SPECIFICATION.md.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from diagnosis.proof.zoo.structure import Body, Boundary, HeatPath, Law, Moment, Probe, Source, ZooPlant
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.base.types import Array
from models.formulas.ehl import reduced_modulus
from models.formulas.load_sharing import contact_points

RPM = np.pi / 30.0
GRAVITY, KELVIN, STEFAN_BOLTZMANN = 9.80665, 273.15, 5.670374e-8
PRANDTL = 0.71  # of air
FARTHEST_SD = 2.5
RUNNING = 0.4  # of the training maxima: where losses are typical


def difference(a: Array, b: Array) -> Array:
    """Temperature difference for powers, [K]."""
    return np.maximum(np.abs(a - b), 0.1)


def fixed(value: float) -> Law:
    """Law of a constant."""
    return lambda m: np.full_like(m.hours, value)


def series(*conductances: Array | float) -> Array:
    """Conductances one after the other."""
    return 1.0 / sum(1.0 / g for g in conductances)


def radiation(T: Array, T_walls: Array, emissivity: float) -> Array:
    """Grey radiation, [W/(m^2 K)]."""
    a, b = T + KELVIN, T_walls + KELVIN
    return emissivity * STEFAN_BOLTZMANN * (a**2 + b**2) * (a + b)


def shaft_in_air(omega: Array, d: float) -> Array:
    """Turning cylinder after Becker 1963, Re at least 800, [W/(m^2 K)]; at 15 to 30 degC (1.3.17)."""
    Re = np.maximum(omega * d**2 / (2.0 * 1.6e-5), 800.0)
    return 0.133 * Re ** (2.0 / 3.0) * PRANDTL ** (1.0 / 3.0) * 0.026 / d


def draught(m: Moment, strength: float, share: float) -> Array:
    """Factor of convection while a door is open (2.2)."""
    waves = sum(np.sin(2.0 * np.pi * m.hours / m.p[f"tau_{k}"] + m.p[f"phi_{k}"]) for k in (1, 2))
    return 1.0 + strength * share * m.p["door"] / (1.0 + np.exp(-12.0 * (waves - 1.2)))


def draw_door(draft: Draft) -> None:
    """Draw when the door is open (2.2)."""
    draft.uniform("tau_1", 0.7, 1.5)
    draft.uniform("tau_2", 2.5, 5.0)
    draft.phases("phi_1", "phi_2")


class Draft:
    """A plant in the making.

    Parameters
    ----------
    family : str
    gearbox : Gearbox
    inputs : tuple of str
    links : collection of str
        Links of the nominal network
    rng : numpy.random.Generator
    """

    def __init__(
        self,
        family: str,
        gearbox: Gearbox,
        inputs: tuple[str, ...],
        links: Collection[str],
        rng: np.random.Generator,
    ) -> None:
        self.family, self.gearbox, self.inputs, self.links, self.rng = family, gearbox, inputs, set(links), rng
        self.bodies: dict[str, Body] = {}
        self.boundaries: dict[str, Boundary] = {}
        self.paths: list[HeatPath] = []
        self.sources: list[Source] = []
        self.probes: list[Probe] = []
        self.parameters: dict[str, float] = {}
        self.spread: dict[str, float] = {}

    # ------------------------------------------------------------------ random numbers

    def chance(self, probability: float) -> bool:
        """Draw true with a probability."""
        return bool(self.rng.random() < probability)

    def between(self, low: float, high: float) -> float:
        """Draw a number that is no parameter."""
        return float(self.rng.uniform(low, high))

    def near(self, name: str, value: float, sd: float, *, exists: bool = True) -> None:
        """Draw a parameter near a value."""
        z = float(np.clip(self.rng.standard_normal(), -FARTHEST_SD, FARTHEST_SD))
        if exists:
            self.parameters[name], self.spread[name] = value * float(np.exp(sd * z)), sd

    def uniform(self, name: str, low: float, high: float, *, exists: bool = True) -> None:
        """Draw a parameter between two numbers."""
        value = self.between(low, high)
        if exists:
            self.parameters[name] = value
            if low > 0.0:
                self.spread[name] = float(np.log(high / low)) / 12.0**0.5

    def phases(self, *names: str) -> None:
        """Draw phases."""
        for name in names:
            self.parameters[name] = self.between(0.0, 2.0 * np.pi)

    def capacities(self, names: Sequence[str], sd: float) -> None:
        """Draw a factor for each body that may exist."""
        for name in names:
            self.near(f"C_{name}", 1.0, sd, exists=name in self.bodies)

    # ------------------------------------------------------------------ pieces

    def body(self, name: str, part_of: str, capacity: float | Law) -> None:
        """Add a body of so many J/K."""
        factor = f"C_{name}"
        law = capacity if callable(capacity) else None
        fixed = 0.0 if callable(capacity) else float(capacity)
        own: Law = (lambda m: m.p[factor] * fixed) if law is None else (lambda m: m.p[factor] * law(m))
        self.bodies[name] = Body(name=name, capacity=own, part_of=part_of)

    def boundary(self, name: str, part_of: str, temperature: Law) -> None:
        """Add a boundary."""
        self.boundaries[name] = Boundary(name=name, temperature=temperature, part_of=part_of)

    def path(self, a: str, b: str, part_of: str, conductance: Law) -> None:
        """Add a way for heat."""
        self.paths.append(HeatPath(name=f"{a}-{b}", ends=(a, b), conductance=conductance, part_of=part_of))

    def source(
        self, name: str, part_of: str, power: Law, spread: Sequence[tuple[str, float]], *, is_loss: bool = True
    ) -> None:
        """Add heat; of a body that is named twice the shares add."""
        shares: dict[str, float] = {}
        for body, share in spread:
            shares[body] = shares.get(body, 0.0) + share
        self.sources.append(Source(name=name, power=power, spread=shares, is_loss=is_loss, part_of=part_of))

    def probe(self, channel: str, first: str, foreign: Sequence[tuple[str, float]], lag_s: float) -> None:
        """Add a sensor on a body with weights of others; those of places that do not exist go to the first."""
        mix = {first: 1.0}
        for place, weight in foreign:
            if place != first and (place in self.bodies or place in self.boundaries):
                mix[place] = mix.get(place, 0.0) + weight
                mix[first] -= weight
        self.probes.append(Probe(channel=channel, mix=mix, lag_s=lag_s))

    def link(self, a: str, b: str) -> str:
        """Nominal link between two nominal nodes; empty if there is none, the node of a path inside it."""
        if a == b:
            return a
        return next((name for name in (f"{a}-{b}", f"{b}-{a}") if name in self.links), "")

    # ------------------------------------------------------------------ plant

    def plant(self, service: Mapping[str, float], *, heat_counts: bool, row_s: float) -> ZooPlant:
        """The plant of all pieces, its typical loss taken at inputs with all bodies at 60 degC."""
        plant = ZooPlant(
            family=self.family,
            gearbox=self.gearbox.file.removesuffix(".toml"),
            inputs=self.inputs,
            bodies=tuple(self.bodies.values()),
            boundaries=tuple(self.boundaries.values()),
            paths=tuple(self.paths),
            sources=tuple(self.sources),
            probes=tuple(self.probes),
            parameters=self.parameters,
            spread=self.spread,
            loss_W=1.0,
            row_s=row_s,
        )
        read: set[str] = set()
        moment = moment_of(plant, service, 60.0, read)
        for piece in plant.bodies:
            piece.capacity(moment)
        for path in plant.paths:
            path.conductance(moment)
        power = [float(np.max(source.power(moment))) for source in plant.sources]
        loss = sum(w for w, source in zip(power, plant.sources, strict=True) if source.is_loss or heat_counts)
        # What no law reads belongs to pieces that this machine does not have.
        return replace(
            plant,
            parameters={name: value for name, value in self.parameters.items() if name in read},
            spread={name: sd for name, sd in self.spread.items() if name in read},
            loss_W=loss,
        )


class _Noted(dict[str, Array]):
    """Parameters that note which of them are read."""

    def __init__(self, values: Mapping[str, Array], read: set[str]) -> None:
        super().__init__(values)
        self.read = read

    def __getitem__(self, name: str) -> Array:
        self.read.add(name)
        return super().__getitem__(name)


def moment_of(
    plant: ZooPlant,
    inputs: Mapping[str, float | Array],
    T: float | Array | Mapping[str, float],
    read: set[str] | None = None,
) -> Moment:
    """Moments with bodies at temperatures, boundaries as they are; names of parameters read go to `read`."""
    ones = np.ones(np.shape(next(iter(inputs.values()))) or 1)
    p = _Noted({name: value * ones for name, value in plant.parameters.items()}, set() if read is None else read)
    given = {name: value * ones for name, value in inputs.items()}
    at = {b.name: ones * (T[b.name] if isinstance(T, Mapping) else T) for b in plant.bodies}
    bare = Moment(hours=0.0 * ones, since_start=0.0 * ones, inputs=given, T=at, p=p)
    held = {b.name: np.broadcast_to(b.temperature(bare), ones.shape) for b in plant.boundaries}
    return Moment(hours=bare.hours, since_start=bare.since_start, inputs=given, T={**at, **held}, p=p)


class Box:
    """Sizes of a gearbox of one stage, section 0.

    Parameters
    ----------
    gearbox : Gearbox
    """

    def __init__(self, gearbox: Gearbox) -> None:
        if len(gearbox.stage) != 1:
            raise InputError(
                f"{gearbox.file}: has {len(gearbox.stage)} stages; the zoo splits gearboxes of one stage and "
                "definitions without geometry: give one of these"
            )
        self.gearbox = gearbox
        self.stage, self.housing, self.filling = gearbox.stage[0], gearbox.housing, gearbox.oil
        self.pair, self.oil = self.stage.pair(), gearbox.lubricant()
        self.gears = self.stage.names
        self.shafts = {shaft.name: shaft for shaft in gearbox.shaft}
        self.shaft_of = (self.stage.driver, self.stage.driven)
        self.bearings = {bearing.name: bearing for bearing in gearbox.bearing}
        steel = self.stage.material
        self.k_s, self.rho_c = steel.conductivity_W_mK, steel.density_kg_m3 * steel.specific_heat_J_kgK
        self.c_s = steel.specific_heat_J_kgK
        self.E_red = reduced_modulus(steel.youngs_modulus, steel.poisson, steel.youngs_modulus, steel.poisson)
        self.points = contact_points(self.pair, 6, model="sanchez_pedrero")
        self.Ra = tuple(self.stage.roughness_Ra_um)
        self.parts = {part.name: part for part in self.housing.part}
        standing = [part.name for part in self.housing.part if part.foundation]
        self.foot, self.top = (standing or list(self.parts))[0], list(self.parts)[-1]
        self.main = max(self.parts, key=lambda name: self.parts[name].area_fraction)
        self.A_in, self.A_out = self.housing.inside_area_m2, self.housing.outside_area_m2
        self.t, self.k_w, self.H = self.housing.wall_thickness_m, self.housing.conductivity_W_mK, self.housing.height_m
        self.rho_c_w = self.housing.density_kg_m3 * self.housing.specific_heat_J_kgK
        self.L = self.A_out / (4.0 * self.H)
        self.nu60 = float(self.nu(np.array(60.0)))
        self.e = tuple(max(r - self.filling.level_below_axis, 0.0) for r in self.pair.r_a)
        self.f_im = tuple(_wetted(e / r) for e, r in zip(self.e, self.pair.r_a, strict=True))
        self.deepest = int(np.argmax(self.e))
        self.C_oil = self.filling.volume * float(self.oil.density(60.0) * self.oil.specific_heat(60.0))
        self.max_speed, self.max_torque = gearbox.training.speed_rpm[1], gearbox.training.torque_Nm[1]
        self.reference_W = RUNNING**2 * self.max_speed * RPM * self.max_torque

    # ------------------------------------------------------------------ capacities, [J/K]

    def f(self, part: str) -> float:
        """Area fraction of a housing part."""
        return self.parts[part].area_fraction

    def C_part(self, part: str) -> float:
        """Housing part."""
        return 0.5 * (self.A_in + self.A_out) * self.t * self.rho_c_w * self.f(part)

    @property
    def C_housing(self) -> float:
        """All housing parts."""
        return sum(self.C_part(part) for part in self.parts)

    def C_bearing(self, name: str) -> float:
        """Bearing."""
        return self.bearings[name].mass_kg * self.c_s

    def C_seat(self, bearing: str) -> float:
        """Ring of the wall around a bearing."""
        D, _, B = self.D_d_B(bearing)
        return self.rho_c_w * np.pi * ((0.5 * D + self.t) ** 2 - (0.5 * D) ** 2) * 1.5 * B

    def C_shaft(self, name: str) -> float:
        """Shaft."""
        shaft = self.shafts[name]
        return self.rho_c * np.pi * shaft.diameter**2 * shaft.length / 4.0

    def C_gear(self, i: int) -> float:
        """Gear as a ring up to the reference circle."""
        return self.rho_c * np.pi * (self.pair.r[i] ** 2 - self.r_s(i) ** 2) * self.pair.b

    # ------------------------------------------------------------------ lengths, conductances

    def r_s(self, i: int) -> float:
        """Radius of the shaft of a gear, [m]."""
        return 0.5 * self.shafts[self.shaft_of[i]].diameter

    def D_d_B(self, bearing: str) -> tuple[float, float, float]:
        """Outside diameter, bore and width of a bearing, [m]."""
        b = self.bearings[bearing]
        return 1e-3 * b.outside_diameter_mm, 1e-3 * b.bore_mm, 1e-3 * b.width_mm

    def of_shaft(self, shaft: str) -> list[str]:
        """Bearings of a shaft: the drive end first."""
        return [name for name, bearing in self.bearings.items() if bearing.shaft == shaft]

    def is_drive_end(self, bearing: str) -> bool:
        """True of the first bearing of its shaft."""
        return self.of_shaft(self.bearings[bearing].shaft)[0] == bearing

    def along(self, shaft: str) -> float:
        """Conductivity times section of a shaft, [W m/K]."""
        return self.k_s * np.pi * self.shafts[shaft].diameter ** 2 / 4.0

    def shaft_bearing(self, bearing: str) -> Law:
        """Path from a shaft into a bearing (1.3.12)."""
        shaft = self.bearings[bearing].shaft
        length, ring = 0.25 * self.shafts[shaft].length / self.along(shaft), 0.08 / (self.k_s * self.D_d_B(bearing)[2])
        return lambda m: 1.0 / (m.p["R_k"] * length + ring)

    def ring(self, i: int, x: float) -> tuple[float, float]:
        """Conductances of a gear outside and inside the radius that leaves the share x of its mass outside, [W/K]."""
        r, r_s = self.pair.r[i], self.r_s(i)
        r_m = np.sqrt(r**2 - x * (r**2 - r_s**2))
        flat = 2.0 * np.pi * self.k_s * self.pair.b
        return flat / np.log(r / r_m), flat / np.log(r_m / r_s)

    # ------------------------------------------------------------------ operation

    def n(self, m: Moment) -> Array:
        """Speed of the input, [1/min]."""
        return np.abs(m.inputs["speed"])

    def n_of(self, shaft: str, m: Moment) -> Array:
        """Speed of a shaft, [1/min]."""
        return self.gearbox.speed_ratio[shaft] * self.n(m)

    def omega(self, shaft: str, m: Moment, *, held: bool = False) -> Array:
        """Speed of a shaft, [rad/s]; held for powers."""
        n = self.n_of(shaft, m)
        return RPM * (np.maximum(n, 1.0) if held else n)

    def v(self, m: Moment, *, held: bool = False) -> Array:
        """Pitch line velocity, [m/s]."""
        return self.omega(self.shaft_of[0], m, held=held) * self.pair.r_w[0]

    def torque(self, m: Moment) -> Array:
        """Torque of the input, [N m]."""
        return np.abs(m.inputs["torque"])

    def relative_power(self, m: Moment) -> Array:
        """Power over that at 0.4 of the maxima."""
        return self.omega(self.shaft_of[0], m) * self.torque(m) / self.reference_W

    def at_service(self) -> dict[str, float]:
        """Inputs at which losses are typical."""
        ambient = self.gearbox.ambient
        return {
            "speed": RUNNING * self.max_speed,
            "torque": RUNNING * self.max_torque,
            "T_ambient": ambient.temperature_degC,
            "air_speed": ambient.air_speed_m_s,
        }

    # ------------------------------------------------------------------ oil

    def nu(self, T: Array) -> Array:
        """Viscosity, [mm^2/s]."""
        return self.oil.kinematic_viscosity(_held(T))

    def eta_mPas(self, T: Array) -> Array:
        """Dynamic viscosity, [mPa s]."""
        return 1e3 * self.oil.dynamic_viscosity(_held(T))

    def rho(self, T: Array) -> Array:
        """Density, [kg/m^3]."""
        return self.oil.density(_held(T))

    def rho_cp(self, T: Array) -> Array:
        """Heat capacity of a volume, [J/(m^3 K)]."""
        return self.oil.density(_held(T)) * self.oil.specific_heat(_held(T))

    def k(self, T: Array) -> Array:
        """Conductivity, [W/(m K)]."""
        return self.oil.conductivity(_held(T))

    def prandtl(self, T: Array) -> Array:
        """Prandtl number."""
        return self.rho_cp(T) * 1e-6 * self.nu(T) / self.k(T)

    def splash(self, m: Moment) -> Array:
        """Oil that the deepest gear throws, [m^3/s]."""
        i = self.deepest
        depth = max(self.e[i] / self.pair.r_a[i], 0.05)
        thrown = m.p["phi"] * 2.25 * self.pair.m_n * 0.5 * self.pair.b * self.v(m) * depth
        return np.minimum(thrown, 0.5 * self.filling.volume)

    def flow(self, bearing: str) -> float:
        """Most oil that flows through a bearing, [m^3/s]."""
        D, _, B = self.D_d_B(bearing)
        return 1e6 * D * B / 12500.0 / 60000.0

    # ------------------------------------------------------------------ losses

    def radial(self, bearing: str, m: Moment) -> Array:
        """Load of a bearing, [N]."""
        return np.maximum(self.bearings[bearing].load_share * self.torque(m) / self.pair.r_b[0], 15.0)

    def starting(self, shaft: str, m: Moment) -> Array:
        """Factor of bearing torques below 20 1/min."""
        return np.minimum(self.n_of(shaft, m) / 20.0, 1.0)

    def mesh(self, friction: Callable[[Moment, Contact], Array], T: Callable[[Moment], Array]) -> Law:
        """Sliding loss of the mesh from a friction law at the contact points (1.4)."""

        def power(m: Moment) -> Array:
            contact = Contact(self, m, T(m))
            local = friction(m, contact) * contact.F * self.pair.sliding_speed(contact.t, contact.omega)
            return np.sum(local * contact.dx, axis=0) / self.pair.p_b

        return power

    # ------------------------------------------------------------------ nominal names

    def nominal_links(self) -> Iterator[str]:
        """Names of the links in the nominal network."""
        names = list(self.parts)
        for part in self.housing.part:
            yield from (f"oil-{part.name}", f"{part.name}-air")
            if part.foundation:
                yield f"{part.name}-frame"
        yield from (f"{a}-{b}" for a, b in pairwise(names))
        for gear, shaft in zip(self.gears, self.shaft_of, strict=True):
            yield from (f"{gear}-oil", f"{gear}-{shaft}")
        yield from (f"{name}-air" for name, shaft in self.shafts.items() if shaft.length_in_air)
        for name, bearing in self.bearings.items():
            yield from (f"{bearing.shaft}-{name}", f"{name}-oil", *(f"{name}-{part}" for part in names))


class Contact:
    """What a friction law sees at the points of the path of contact, shape (points, B).

    Parameters
    ----------
    box : Box
    m : Moment
    T : Array, shape (B,)
        Temperature of the flanks, [degC]
    """

    def __init__(self, box: Box, m: Moment, T: Array) -> None:
        pair = box.pair
        self.t, self.dx = box.points.t[:, None], box.points.dx[:, None]
        self.omega = box.omega(box.shaft_of[0], m)[None, :]
        turning = box.omega(box.shaft_of[0], m, held=True)[None, :]
        self.F = box.points.share[:, None] * (box.torque(m) / pair.r_b[0])[None, :]
        u_1, u_2 = pair.speeds(self.t, turning)
        self.V_s, self.v_r = np.abs(u_1 - u_2), u_1 + u_2
        self.R = pair.curvature_radii(self.t)[2]
        self.b, self.nu, self.eta_mPas = pair.b, box.nu(T)[None, :], box.eta_mPas(T)[None, :]
        self.Ra, self.E_red = box.Ra, box.E_red


def _held(T: Array) -> Array:
    return np.clip(T, -30.0, 200.0)


def _wetted(depth: float) -> float:
    """Share of a face in oil, from the depth over the radius."""
    theta = np.arccos(np.clip(1.0 - depth, -1.0, 1.0))
    return float((2.0 * theta - np.sin(2.0 * theta)) / (2.0 * np.pi))
