"""Numbers of a one-stage gearbox that loss formulas take from its definition: radii, depths, links."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise

import numpy as np

from diagnosis.proof.plant.cycles import reference_torque, top_speed
from diagnosis.proof.plant.plant import REFERENCE_SPEED
from diagnosis.proof.plant.sizes import BoxSizes, refuse_unbuilt
from diagnosis.proof.zoo.families.losses import RPM, Dip, Roller
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.base.types import Array
from models.formulas.ehl import reduced_modulus


def refuse_unsplit(gearbox: Gearbox) -> None:
    """Raise InputError for a definition that no family of gearboxes splits."""
    if gearbox.is_parametric:
        raise InputError(
            f"{gearbox.file}: has no geometry; this family splits gearboxes with teeth, shafts and bearings: name a "
            "family for definitions without geometry"
        )
    refuse_unbuilt(gearbox)


class Sizes(BoxSizes):
    """Sizes of one gearbox, with what loss formulas need."""

    @cached_property
    def E_red(self) -> float:
        """Reduced modulus of the flanks, [Pa]."""
        steel = self.gearbox.stage[0].material
        return reduced_modulus(steel.youngs_modulus, steel.poisson, steel.youngs_modulus, steel.poisson)

    @cached_property
    def reference(self) -> tuple[float, float]:
        """Speed [1/min] and torque [N m] of the programmes where a machine is compared with the next."""
        return REFERENCE_SPEED * top_speed(self.gearbox), reference_torque(self.gearbox)

    def dip(self, i: int) -> Dip:
        """A gear in the oil."""
        pair, oil = self.pair, self.gearbox.oil
        return Dip(
            h=pair.r_w[i] - oil.level_below_axis,
            r=pair.r_w[i],
            b=pair.b,
            m=pair.m_n,
            z=pair.z[i],
            tooth_height=pair.r_a[i] - pair.r_f[i],
            alpha=pair.alpha_wt,
            volume=oil.volume,
        )

    @cached_property
    def tips_under_oil(self) -> tuple[float, float]:
        """Depths of the tips of both gears, [m]."""
        level = self.gearbox.oil.level_below_axis
        return self.pair.r_a[0] - level, self.pair.r_a[1] - level

    def roller(self, name: str) -> Roller:
        """A bearing."""
        b = self.bearing(name)
        return Roller(
            d_m=0.5 * (b.bore_mm + b.outside_diameter_mm),
            bore=b.bore_mm,
            outside=b.outside_diameter_mm,
            width=b.width_mm,
        )

    def ratio(self, shaft: str) -> float:
        """Speed of a shaft over that of the input."""
        return self.gearbox.speed_ratio[shaft]

    def through_flow(self, name: str) -> float:
        """Most heat that oil takes through a bearing, ``27 D B / 12500``, [W/K] (ISO/TR 14179-2, read in the paper)."""
        b = self.bearing(name)
        return 27.0 * b.outside_diameter_mm * b.width_mm / 12500.0

    def nominal_links(self) -> Iterator[str]:
        """Names of the links in the nominal network of the definition."""
        parts = [part.name for part in self.gearbox.housing.part]
        for part in self.gearbox.housing.part:
            yield from (f"oil-{part.name}", f"{part.name}-air")
            if part.foundation:
                yield f"{part.name}-frame"
        yield from (f"{below}-{above}" for below, above in pairwise(parts))
        for gear, shaft in zip(self.gears, self.shafts, strict=True):
            yield from (f"{gear}-oil", f"{gear}-{shaft}", f"mesh-{gear}")
        yield from (f"{shaft.name}-air" for shaft in self.gearbox.shaft if shaft.length_in_air)
        for bearing in self.gearbox.bearing:
            yield f"{bearing.shaft}-{bearing.name}"
            yield from (f"{bearing.name}-{part}" for part in parts)
            yield f"{bearing.name}-oil"

    def omega(self, n: Array, i: int) -> Array:
        """Speed of a gear, [rad/s], from that of the input, [1/min]."""
        return np.asarray(n * RPM / (1.0 if i == 0 else self.pair.u))
