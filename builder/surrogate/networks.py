"""The table of networks of a gearbox: inputs, outputs, bounds, the losses to learn; and the presets of training.

It is derived from the loss terms: one network for the mesh, one for the losses without load, and one for every kind of
bearing, used once per bearing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from models.base.errors import InputError
from models.base.types import Array
from models.definition.sections import Training
from models.losses.loss_model import LossModel
from models.losses.loss_term import SPEED, SPEED_FLOOR_RPM, TORQUE, TORQUE_FLOOR_NM, LossTerm
from models.portable.surrogate import Feature, Use


def above_floors(trained: Training) -> Training:
    """Return the range of training above the full model's lowest speed and torque: below, losses are linear.

    Raises
    ------
    InputError
        If nothing is left.
    """
    speed = (max(trained.speed_rpm[0], SPEED_FLOOR_RPM), trained.speed_rpm[1])
    torque = (max(trained.torque_Nm[0], TORQUE_FLOOR_NM), trained.torque_Nm[1])
    for name, (low, high) in {"speed_rpm": speed, "torque_Nm": torque}.items():
        if not low < high:
            raise InputError(f"training.{name}: the upper bound {high:g} must be above {low:g}; widen it")
    return trained.model_copy(update={"speed_rpm": speed, "torque_Nm": torque})


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
        Units of the hidden layers by kind of network (mesh, no_load, bearing), `OTHER_HIDDEN` for others; where all
        outputs (mesh_sliding ...) are named instead, each has separate hidden units, which fit it better for the same
        work
    max_iter, starts, start_iterations, patience, tolerance
        See :class:`builder.surrogate.levenberg_marquardt.LevenbergMarquardtRegressor`
    domain : Training, optional
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
    domain: Training | None = None


OTHER_HIDDEN = (10, 10)  # of a network that a preset does not name
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
        domain=Training(speed_rpm=(50.0, 6500.0), torque_Nm=(1.0, 350.0), temperature_degC=(20.0, 120.0)),
    ),
}


@dataclass(frozen=True, kw_only=True)
class NetworkSpec:
    """One network to train: derived from the loss terms that it learns.

    Attributes
    ----------
    name, kind : str
        Name of the network, and of the size in :attr:`Preset.hidden`
    outputs : tuple of str
        Names with units
    lower, upper : tuple of float
        Bounds of the inputs
    terms : tuple of LossTerm
        If `shared`, the terms of one law, of which each uses the network for itself; else terms that read the same
        inputs, whose losses are its outputs
    shared : bool
    """

    name: str
    kind: str
    outputs: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    terms: tuple[LossTerm, ...]
    shared: bool

    @property
    def sampled(self) -> tuple[LossTerm, ...]:
        """Terms that the full model is sampled for: of a shared network the one on the slowest shaft that has a load.

        Its speed stays above the full model's lowest speed over all of the range.
        """
        loaded = [term for term in self.terms if all(i.factor > 0.0 for i in term.inputs)]
        return (min(loaded or self.terms, key=lambda term: term.inputs[0].factor),) if self.shared else self.terms

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names with units."""
        return tuple(i.name for i in self.terms[0].inputs)

    @property
    def roles(self) -> tuple[str, ...]:
        """Of every output the fixed name of its loss, without the number of a stage; else that of its kind."""
        return tuple(
            role for term in self.sampled for role in term.kind.components or (term.kind.name,) * len(term.components)
        )

    @property
    def powers(self) -> Array:
        """Powers of the inputs that losses are divided by before their logarithm is taken, (outputs, inputs)."""
        return np.concatenate([term.kind.powers for term in self.sampled])

    @property
    def dense(self) -> tuple[Feature, ...]:
        """Feature of each input in which half of the points are uniform."""
        return tuple("log" if i.source in (SPEED, TORQUE) else "viscosity" for i in self.terms[0].inputs)

    @property
    def uses(self) -> tuple[Use, ...]:
        """Every use of the network."""
        groups = [(term,) for term in self.terms] if self.shared else [self.terms]
        return tuple(
            Use(
                self.name,
                tuple(i.source for i in terms[0].inputs),
                tuple(i.factor for i in terms[0].inputs),
                tuple(name for term in terms for name in term.components),
            )
            for terms in groups
        )

    def features(self, *, transforms: bool) -> tuple[tuple[Feature, int], ...]:
        """Features of the network, those of one type next to each other."""
        if not transforms:
            return tuple(("value", column) for column in range(len(self.inputs)))
        logs: list[tuple[Feature, int]] = [("log", i) for i, kind in enumerate(self.dense) if kind == "log"]
        hot = [i for i, kind in enumerate(self.dense) if kind == "viscosity"]
        return (*logs, *(("viscosity", i) for i in hot), *(("log_kelvin", i) for i in hot))

    def losses(self, rows: Array) -> Array:
        """Losses of the full model [W], shape (N, outputs), at rows of inputs, shape (N, inputs)."""
        found = []
        for term in self.sampled:
            at = {i.source: rows[:, column] / i.factor for column, i in enumerate(term.inputs)}
            found.append(term.power(at[SPEED], at.get(TORQUE, at[SPEED]), at))
        return np.concatenate(found, axis=1)


def network_specs(model: LossModel, domain: Training) -> tuple[NetworkSpec, ...]:
    """Return the networks of a gearbox, those of the most inputs (the most laborious) first."""
    learnt: dict[str, list[LossTerm]] = {}
    for terms in model.groups:
        kind = terms[0].kind
        known = [name for name, others in learnt.items() if others[0].kind.network == kind.network]
        if kind.alike:
            name = f"{kind.network}s_{len(known) + 1}"
        else:  # together with what reads the same inputs; meshes of two stages do not
            together = (name for name in known if learnt[name][0].inputs == terms[0].inputs)
            name = next(together, f"{kind.network}_{len(known) + 1}" if known else kind.network)
        learnt.setdefault(name, []).extend(terms)
    specs = [_spec(name, tuple(terms), domain) for name, terms in learnt.items()]
    return tuple(sorted(specs, key=lambda spec: -len(spec.inputs)))


def _spec(name: str, terms: tuple[LossTerm, ...], domain: Training) -> NetworkSpec:
    kind, bounds = terms[0].kind, []
    ranges = {SPEED: domain.speed_rpm, TORQUE: domain.torque_Nm}
    for column, first in enumerate(terms[0].inputs):
        factors = [term.inputs[column].factor for term in terms]
        low, high = ranges.get(first.source, domain.temperature_degC)
        if first.lowest is None:
            bounds.append((min(factors) * low, max(factors) * high))
        else:
            bounds.append((first.lowest, max(max(factors) * high, 2.0 * first.lowest)))
    lower, upper = zip(*bounds, strict=True)
    components = [component for term in terms for component in term.components]
    return NetworkSpec(
        name=name,
        kind=kind.network,
        outputs=(f"{kind.name}_W",) if kind.alike else tuple(f"{component}_W" for component in components),
        lower=lower,
        upper=upper,
        terms=terms,
        shared=kind.alike,
    )
