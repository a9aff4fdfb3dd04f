"""Which networks a gearbox gets: inputs, outputs, bounds, the losses to learn, and the presets of training.

One network for the mesh, one for the losses without load, and one for every kind of bearing, used once per bearing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from models.errors import InputError, did_you_mean
from models.losses import SPEED_FLOOR_RPM, TORQUE_FLOOR_NM, LossModel
from models.surrogate import Feature, Use
from models.types import Array

Bounds = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Domain:
    """Range of training.

    Attributes
    ----------
    speed_rpm, torque_Nm : (float, float)
        Bounds of the input shaft's speed [1/min] and torque [N m]
    temperature_degC : (float, float)
        Bounds of all temperatures, [degC]
    """

    speed_rpm: Bounds
    torque_Nm: Bounds
    temperature_degC: Bounds

    def above_floors(self) -> Domain:
        """Return the range above the full model's lowest speed and torque: below, losses are linear.

        Raises
        ------
        InputError
            If nothing is left.
        """
        speed = (max(self.speed_rpm[0], SPEED_FLOOR_RPM), self.speed_rpm[1])
        torque = (max(self.torque_Nm[0], TORQUE_FLOOR_NM), self.torque_Nm[1])
        for name, (low, high) in {"speed_rpm": speed, "torque_Nm": torque}.items():
            if not low < high:
                raise InputError(f"training.{name}: the upper bound {high:g} must be above {low:g}; widen it")
        return Domain(speed_rpm=speed, torque_Nm=torque, temperature_degC=self.temperature_degC)


@dataclass(frozen=True, kw_only=True)
class Preset:
    """How the networks are trained.

    Attributes
    ----------
    name : str
    samples : int
        Points per network; of these 80 % train, 10 % validate, 10 % test
    judged : int
        Further, independent random points that the report is made on
    transforms : bool
        Logarithms of speed, load and reduced losses, viscosity in place of temperature, and points denser at the low
        ends; without, min-max scaling and uniform points, as in the paper
    hidden : mapping of str to (int, int)
        Units of the hidden layers by kind of network (mesh, no_load, bearing); where a kind is not named, by output
        (mesh_sliding ...): every output then has hidden units of its own, which fit it better for the same work
    max_iter, starts, start_iterations, patience, tolerance
        See :class:`builder.levenberg_marquardt.LevenbergMarquardtRegressor`
    domain : Domain, optional
        Range of training; that of the gearbox's ``[training]`` where absent
    """

    name: str
    samples: int
    judged: int
    transforms: bool
    hidden: Mapping[str, tuple[int, int]] = field(hash=False)
    max_iter: int
    starts: int
    start_iterations: int
    patience: int
    tolerance: float
    domain: Domain | None = None


PRESETS: Mapping[str, Preset] = {
    "default": Preset(
        name="default",
        samples=8000,
        judged=2000,
        transforms=True,
        hidden={"mesh_sliding": (48, 16), "mesh_rolling": (16, 10), "no_load": (10, 10), "bearing": (16, 12)},
        max_iter=130,
        starts=2,
        start_iterations=25,
        patience=60,
        tolerance=0.02,
    ),
    # Tables 3 and 4 of the paper. Levenberg-Marquardt is a full-batch method: a batch size of 64 has no counterpart.
    "paper": Preset(
        name="paper",
        samples=400,
        judged=400,
        transforms=False,
        hidden={"mesh": (5, 5), "no_load": (5, 5), "bearing": (5, 5)},
        max_iter=1000,
        starts=6,
        start_iterations=100,
        patience=1000,
        tolerance=0.0,
        domain=Domain(speed_rpm=(50.0, 6500.0), torque_Nm=(1.0, 350.0), temperature_degC=(20.0, 120.0)),
    ),
}


def preset_named(name: str) -> Preset:
    """Return a preset.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if name not in PRESETS:
        raise InputError(f"there is no training preset {name!r}{did_you_mean(name, PRESETS)}")
    return PRESETS[name]


@dataclass(frozen=True)
class MeshLosses:
    """Rows (speed [1/min], torque [N m], both gears' temperatures [degC]) to sliding and rolling loss [W]."""

    model: LossModel

    def __call__(self, rows: Array) -> Array:
        """Evaluate the full model."""
        return self.model.mesh_power(rows[:, 0], rows[:, 1], rows[:, 2:4])


@dataclass(frozen=True)
class NoLoadLosses:
    """Rows (speed [1/min], oil temperature [degC]) to churning and seal losses [W]."""

    model: LossModel

    def __call__(self, rows: Array) -> Array:
        """Evaluate the full model."""
        return self.model.no_load_power(rows[:, 0], rows[:, 1])


@dataclass(frozen=True)
class BearingLosses:
    """Rows (own speed [1/min], radial load [N], oil and bearing temperature [degC]) to the loss [W] of a bearing."""

    model: LossModel
    index: int

    def __call__(self, rows: Array) -> Array:
        """Evaluate the full model."""
        speed = rows[:, 0] / self.model.bearing_speed_ratio[self.index]
        torque = rows[:, 1] / load_per_torque(self.model, self.index)
        return self.model.bearing_power(self.index, speed, torque, rows[:, 2], rows[:, 3])[:, None]


def load_per_torque(model: LossModel, index: int) -> float:
    """Radial load of one bearing per input torque, [N/(N m)]."""
    return float(model.bearing_radial_load(index, np.array([1.0]))[0])


@dataclass(frozen=True, kw_only=True)
class NetworkSpec:
    """One network to train.

    Attributes
    ----------
    name, kind : str
        Kind is mesh, no_load or bearing
    inputs, outputs : tuple of str
        Names with units
    lower, upper : tuple of float
        Bounds of the inputs
    powers : tuple of tuple of float, shape (outputs, inputs)
        Powers of the inputs that the losses are divided by before their logarithm is taken
    losses : callable, (N, inputs) -> (N, outputs)
        The full model
    uses : tuple of Use
    """

    name: str
    kind: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    powers: tuple[tuple[float, ...], ...]
    losses: MeshLosses | NoLoadLosses | BearingLosses
    uses: tuple[Use, ...]

    @property
    def dense(self) -> tuple[Feature, ...]:
        """Feature of each input in which half of the points are uniform."""
        return tuple("viscosity" if name.endswith("_degC") else "log" for name in self.inputs)

    def features(self, *, transforms: bool) -> tuple[tuple[Feature, int], ...]:
        """Features of the network, those of a kind side by side."""
        if not transforms:
            return tuple(("value", column) for column in range(len(self.inputs)))
        logs: list[tuple[Feature, int]] = [("log", i) for i, kind in enumerate(self.dense) if kind == "log"]
        hot = [i for i, kind in enumerate(self.dense) if kind == "viscosity"]
        return (*logs, *(("viscosity", i) for i in hot), *(("log_kelvin", i) for i in hot))


def network_specs(model: LossModel, domain: Domain) -> tuple[NetworkSpec, ...]:
    """Return the networks of a gearbox, the most laborious first."""
    speed, torque, temperature = domain.speed_rpm, domain.torque_Nm, domain.temperature_degC
    bearings = len(model.bearing_speed_ratio)
    no_load = model.components[2 : len(model.components) - bearings]
    bearing_components, bearing_nodes = model.components[-bearings:], model.temperature_nodes[-bearings:]
    gears = model.temperature_nodes[1:3]

    mesh = NetworkSpec(
        name="mesh",
        kind="mesh",
        inputs=("speed_rpm", "torque_Nm", *(f"T_{gear}_degC" for gear in gears)),
        outputs=("mesh_sliding_W", "mesh_rolling_W"),
        lower=(speed[0], torque[0], temperature[0], temperature[0]),
        upper=(speed[1], torque[1], temperature[1], temperature[1]),
        # Rolling goes with film thickness times speed, n^0.67 n.
        powers=((1.0, 1.0, 0.0, 0.0), (1.67, 0.0, 0.0, 0.0)),
        losses=MeshLosses(model),
        uses=(Use("mesh", ("speed", "torque", *gears), (1.0,) * 4, model.components[:2]),),
    )
    unloaded = NetworkSpec(
        name="no_load",
        kind="no_load",
        inputs=("speed_rpm", "T_oil_degC"),
        outputs=tuple(f"{name}_W" for name in no_load),
        lower=(speed[0], temperature[0]),
        upper=(speed[1], temperature[1]),
        powers=((1.5, 0.0), *(((1.0, 0.0),) * (len(no_load) - 1))),
        losses=NoLoadLosses(model),
        uses=(Use("no_load", ("speed", "oil"), (1.0, 1.0), no_load),),
    )
    kinds = []
    for number, group in enumerate(model.bearing_groups, start=1):
        name = f"bearings_{number}"
        ratio = [model.bearing_speed_ratio[i] for i in group]
        load = [load_per_torque(model, i) for i in group]
        # Below the bearing's own weight the load does not matter.
        lightest = model.bearings[group[0]].lightest_load
        heaviest = max(max(load) * torque[1], 2.0 * lightest)
        kinds.append(
            NetworkSpec(
                name=name,
                kind="bearing",
                inputs=("speed_rpm", "radial_load_N", "T_oil_degC", "T_bearing_degC"),
                outputs=("bearing_W",),
                lower=(min(ratio) * speed[0], lightest, temperature[0], temperature[0]),
                upper=(max(ratio) * speed[1], heaviest, temperature[1], temperature[1]),
                powers=((1.0, 0.0, 0.0, 0.0),),
                # The slowest shaft's bearing stays above the full model's lowest speed over all of the range.
                losses=BearingLosses(model, group[int(np.argmin(ratio))]),
                uses=tuple(
                    Use(name, ("speed", "torque", "oil", bearing_nodes[i]), (r, f, 1.0, 1.0), (bearing_components[i],))
                    for i, r, f in zip(group, ratio, load, strict=True)
                ),
            )
        )
    return (mesh, *kinds, unloaded)
