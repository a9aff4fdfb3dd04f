"""Numbers of a one-stage gearbox that loss formulas take from its definition: radii, depths."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from diagnosis.proof.plant.cycles import reference_torque, top_speed
from diagnosis.proof.plant.plant import REFERENCE_SPEED
from diagnosis.proof.plant.sizes import BoxSizes
from diagnosis.proof.zoo.families.losses import RPM, Dip
from models.base.types import Array
from models.formulas.ehl import reduced_modulus


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

    def through_flow(self, name: str) -> float:
        """Most heat that oil takes through a bearing, ``27 D B / 12500``, [W/K] (ISO/TR 14179-2, read in the paper)."""
        b = self.bearing(name)
        return 27.0 * b.outside_diameter_mm * b.width_mm / 12500.0

    def omega(self, n: Array, i: int) -> Array:
        """Speed of a gear, [rad/s], from that of the input, [1/min]."""
        return np.asarray(n * RPM / (1.0 if i == 0 else self.pair.u))
