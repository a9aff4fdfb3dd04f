"""The plant of one definition: its nodes, paths, losses and sizes, and the state that effects act on.

Formulas of heat transfer are the plant's own; the losses are those of the full loss model with other options and
multipliers.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from diagnosis.proof.plant.anatomy import MESH, OIL, SPLASH, SUMP, PlantAnatomy
from diagnosis.proof.plant.cycles import reference_torque, top_speed
from diagnosis.proof.plant.sizes import refuse_unbuilt
from models.assembly.gearbox import Gearbox
from models.base.types import Array

REFERENCE_SPEED = 0.415  # of the top speed
RADIATION_REF = 6.5  # W/(m2 K), of a painted wall at 60 degC
FZG_RISE_K = 46.16  # of the FZG rig's oil above the air at the reference point, by these sizes
INTO_OIL = 0.04  # share of the mesh's heat that the oil takes at once
# Other readings of the friction than the definition's, each scaled to the nominal loss at the reference point; they
# bend the loss by up to 8 % over the speeds. Another film formula would by 25 %, and be missing physics itself.
READINGS: tuple[Mapping[str, object], ...] = (
    {"stage.0.load_sharing": "sanchez_pedrero"},
    {"stage.0.load_sharing": "sanchez_pedrero", "stage.0.friction.thermal_reduction": "murch_wilson"},
    {"stage.0.load_sharing": "equal", "stage.0.friction.thermal_reduction": "gupta_simple"},
)


@dataclass(kw_only=True)
class PlantMoment:
    """The middle of a step, of all runs at once; effects change it through their grip.

    Shapes: (B,) of runs, (B, n) of nodes, (B, c) of loss components, (B, p) of paths, (B, b) of bearings.
    """

    hours: Array
    speed: Array
    torque: Array
    air: Array
    air_speed: Array
    T: Array
    thinning: Array
    bearing_load: Array
    loss: Array
    lost: Array
    heat: Array
    G: Array
    ground: Array
    ground_heat: Array
    capacity: Array


class Plant:
    """All gearboxes of one definition."""

    def __init__(self, gearbox: Gearbox) -> None:
        refuse_unbuilt(gearbox)
        self.gearbox = gearbox
        self.anatomy = PlantAnatomy(gearbox)
        nominal = gearbox.losses()
        self.components = nominal.components
        self.oil = gearbox.lubricant()
        self.losses = tuple(gearbox.with_values(reading).losses() for reading in READINGS)
        self.speed_top = top_speed(gearbox)
        n, M = REFERENCE_SPEED * self.speed_top, reference_torque(gearbox)
        self.speed_ref, self.torque_ref = n, M
        rims = {f"{gear}.rim": 0.5 * (1.0 - INTO_OIL) for gear in self.anatomy.gears}
        self.mesh_spread = {SPLASH: INTO_OIL, **rims}
        # Sizes that effects are relative to: loss at the reference point, heat that the housing sheds per kelvin.
        self.loss_ref = float(nominal.breakdown(speed=n, torque=M, temperatures=80.0)["total"])
        forced, free = self.anatomy.convection
        self.shed_ref = float(np.cbrt(forced**3 + free**3) + RADIATION_REF) * gearbox.housing.outside_area_m2
        self.warmth = self.loss_ref / self.shed_ref / FZG_RISE_K
        at = np.array([n]), np.array([M]), dict.fromkeys(self.anatomy.gears, np.array([80.0]))
        sliding = [float(model.term("mesh").power(*at)[0, 0]) for model in (nominal, *self.losses)]
        self.reading_scale = np.array([sliding[0] / own for own in sliding[1:]])
        paths, index = self.anatomy.paths, self.anatomy.index
        self.a = np.array([index[path.ends[0]] for path in paths])
        self.b = np.array([index[path.ends[1]] for path in paths])
        self.touching = np.zeros((len(paths), len(index)))
        self.touching[np.arange(len(paths)), self.a] = 1.0
        self.touching[np.arange(len(paths)), self.b] = 1.0
        self.columns: dict[str, list[int]] = {}
        for column, path in enumerate(paths):
            self.columns.setdefault(path.name, []).append(column)

    def as_warm(self, T_fzg: float) -> float:
        """Temperature that is as warm for this gearbox as another for the FZG rig, [degC]; 25 degC is cold for all."""
        return 25.0 + (T_fzg - 25.0) * self.warmth

    def place_of(self, component: str) -> str:
        """Where a loss becomes heat."""
        if component in self.anatomy.bearings:
            return component
        return MESH if component.startswith(MESH) else OIL

    def spread_of(self, component: str) -> dict[str, float]:
        """Nodes that take the heat of a loss, and the share of each: the mesh's parts between the rims and the oil."""
        if component.startswith(MESH):
            return dict(self.mesh_spread)
        if component in self.anatomy.bearings:
            return {component: 1.0}
        return {SUMP: 0.7, SPLASH: 0.3} if component == "churning" else {SUMP: 1.0}
