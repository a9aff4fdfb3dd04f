"""Puts a plant together piece by piece; every piece gets a parameter that differs from machine to machine."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import PurePath

import numpy as np

from diagnosis.proof.plant.cycles import ROW_S, ornstein_uhlenbeck
from diagnosis.proof.zoo.structure import Body, Boundary, HeatPath, Law, Moment, Probe, Source, ZooPlant
from models.assembly.gearbox import Gearbox
from models.base.types import Array

FARTHEST_SD = 2.0


class Builder:
    """A plant in the making.

    Parameters
    ----------
    family : str
        Its name
    gearbox : Gearbox
        Nominal definition, of which names alone are read
    inputs : tuple of str
        Inputs of the nominal network that laws read
    """

    def __init__(self, family: str, gearbox: Gearbox, inputs: tuple[str, ...], rng: np.random.Generator) -> None:
        self.family, self.gearbox, self.inputs, self.rng = family, PurePath(gearbox.file).stem, inputs, rng
        self.links = frozenset(link.name for link in gearbox.network().links)
        self.bodies: list[Body] = []
        self.boundaries: list[Boundary] = []
        self.paths: list[HeatPath] = []
        self.sources: list[Source] = []
        self.probes: list[Probe] = []
        self.parameters: dict[str, float] = {}
        self.spread: dict[str, float] = {}
        self.nominal: dict[str, str] = {}  # body or boundary -> node of the nominal network

    # ------------------------------------------------------------------ pieces

    def draw(self, name: str, value: float, spread: float) -> str:
        """Draw a positive parameter around a value; its name."""
        z = float(np.clip(self.rng.standard_normal(), -FARTHEST_SD, FARTHEST_SD))
        self.parameters[name] = value * float(np.exp(spread * z))
        self.spread[name] = spread
        return name

    def body(self, name: str, part_of: str, capacity: float, spread: float = 0.08) -> str:
        """Add a body of about so many J/K; its name."""
        parameter = self.draw(f"C {name}", capacity, spread)
        self.bodies.append(Body(name=name, capacity=lambda m: m.p[parameter], part_of=part_of))
        self.nominal[name] = part_of
        return name

    def boundary(self, name: str, part_of: str, temperature: Law) -> str:
        """Add a boundary; its name."""
        self.boundaries.append(Boundary(name=name, temperature=temperature, part_of=part_of))
        self.nominal[name] = part_of
        return name

    def path(
        self, a: str, b: str, conductance: float | Law, spread: float = 0.15, *, common: str = "", name: str = "",
        part_of: str | None = None,
    ) -> str:  # fmt: skip
        """Add a way for heat of about so many W/K; its name.

        Parameters
        ----------
        a, b : str
            Bodies or boundaries
        conductance : float or Law
            [W/K]
        spread : float
            Of the logarithm of the path's factor
        common : str
            A parameter that this conductance is also multiplied by
        name : str
            Default ``a-b``
        part_of : str or None
            Links of the nominal network; None: those between the nominal nodes of the ends
        """
        name = name or f"{a}-{b}"
        parameter = self.draw(f"G {name}", 1.0, spread)

        def law(m: Moment) -> Array:
            value = m.p[parameter] * (conductance(m) if callable(conductance) else conductance)
            return value * m.p[common] if common else value

        self.paths.append(
            HeatPath(name=name, ends=(a, b), conductance=law, part_of=self._link(a, b) if part_of is None else part_of)
        )
        return name

    def source(
        self, name: str, part_of: str, power: Law, into: Mapping[str, float], spread: float = 0.15,
        *, is_loss: bool = True
    ) -> str:  # fmt: skip
        """Add heat of about so many W that parts among bodies by the shares of `into`; its name."""
        parameter = self.draw(f"P {name}", 1.0, spread)
        total = sum(into.values())
        self.sources.append(
            Source(
                name=name,
                power=lambda m: m.p[parameter] * power(m),
                spread={body: share / total for body, share in into.items()},
                is_loss=is_loss,
                part_of=part_of,
            )
        )
        return name

    def probe(self, channel: str, mix: Mapping[str, float]) -> None:
        """Add a sensor with a lag of 8 to 25 s; weights are scaled to the sum 1."""
        total = sum(mix.values())
        lag = float(self.rng.uniform(8.0, 25.0))
        self.probes.append(Probe(channel=channel, mix={k: w / total for k, w in mix.items()}, lag_s=lag))

    def chance(self, probability: float) -> bool:
        """True with a probability."""
        return bool(self.rng.random() < probability)

    def uniform(self, low: float, high: float) -> float:
        """A number between two."""
        return float(self.rng.uniform(low, high))

    def plant(self, *, loss_W: float, row_s: float) -> ZooPlant:
        """The plant of all pieces."""
        return ZooPlant(
            family=self.family,
            gearbox=self.gearbox,
            inputs=self.inputs,
            bodies=tuple(self.bodies),
            boundaries=tuple(self.boundaries),
            paths=tuple(self.paths),
            sources=tuple(self.sources),
            probes=tuple(self.probes),
            parameters=self.parameters,
            spread=self.spread,
            loss_W=loss_W,
            row_s=row_s,
        )

    # ------------------------------------------------------------------ names in the nominal network

    def _link(self, a: str, b: str) -> str:
        """Links of the nominal network between the nodes of two ends, joined by ``+``; a node for a path inside it."""
        found = []
        for i in self.nominal[a].split("+"):
            for j in self.nominal[b].split("+"):
                if i == j:
                    return i
                found += [name for name in (f"{i}-{j}", f"{j}-{i}") if name in self.links]
        return "+".join(dict.fromkeys(found))


def wander(rng: np.random.Generator, *, sd: float, tau_h: float, span_h: float) -> Law:
    """A law that wanders about 1 as the exponential of an Ornstein-Uhlenbeck process of the time.

    Parameters
    ----------
    sd : float
        Of the logarithm
    tau_h, span_h : float
        Correlation time and length of the process before it repeats, [h]
    """
    step = tau_h / 8.0
    count = int(np.ceil(span_h / step)) + 1
    factor = np.exp(sd * ornstein_uhlenbeck(count, rng, sd=1.0, tau_s=8.0 * ROW_S))
    times = np.arange(count) * step

    def law(m: Moment) -> Array:
        return np.interp(m.hours, times, factor, period=times[-1])

    return law
