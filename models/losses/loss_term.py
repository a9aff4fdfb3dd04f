"""One term of the power loss: which components it gives, where its heat goes, what it reads, and its law.

A law file (:mod:`models.losses.friction`, :mod:`models.losses.churning`, :mod:`models.losses.seal`,
:mod:`models.losses.bearing`) declares its
:class:`LossKind` and makes the :class:`LossTerm` objects of a gearbox. The full model, the thermal network, the
surrogate and the native data are derived from these lists.

Two floors keep real drive cycles finite and continuous: below 1 rpm of the input shaft all losses are evaluated at
1 rpm and scaled linearly with speed (a constant friction torque); below 1 N m the mesh is evaluated at 1 N m and its
sliding loss scaled linearly with torque (eqs. 3-4 of the paper are singular without load).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from models.base.types import Array
from models.definition.bearing_section import Bearing
from models.definition.sections import Ambient, Seal, Stage
from models.definition.sections import Oil as OilTable
from models.formulas.oil import Oil

SPEED_FLOOR_RPM = 1.0
TORQUE_FLOOR_NM = 1.0
OIL, MESH = "oil", "mesh"
SPEED, TORQUE = "speed", "torque"


class GearboxData(Protocol):
    """Tables that loss terms are made from; a :class:`~models.assembly.gearbox_definition.Definition` has them."""

    @property
    def stage(self) -> tuple[Stage, ...]: ...  # noqa: D102
    @property
    def bearing(self) -> tuple[Bearing, ...]: ...  # noqa: D102
    @property
    def seal(self) -> tuple[Seal, ...]: ...  # noqa: D102
    @property
    def oil(self) -> OilTable: ...  # noqa: D102
    @property
    def ambient(self) -> Ambient: ...  # noqa: D102
    @property
    def speed_ratio(self) -> Mapping[str, float]: ...  # noqa: D102
    @property
    def torque_ratio(self) -> Mapping[str, float]: ...  # noqa: D102
    @property
    def level_below_axis(self) -> Mapping[str, float]: ...  # noqa: D102
    def lubricant(self) -> Oil: ...  # noqa: D102


def of_stages(name: str, stages: int) -> tuple[str, ...]:
    """Names of what every stage has: the bare name in a gearbox of one stage, else numbered.

    Examples
    --------
    >>> of_stages("mesh", 1), of_stages("mesh", 2)
    (('mesh',), ('mesh_1', 'mesh_2'))
    """
    return (name,) if stages == 1 else tuple(f"{name}_{number}" for number in range(1, stages + 1))


class Law(Protocol):
    """A loss formula with the numbers of one machine element."""

    def power(self, x: Array) -> Array:
        """Losses [W], shape (N, outputs), at rows of the term's inputs, shape (N, inputs), above the floors."""
        ...


@dataclass(frozen=True)
class TermInput:
    """One input of a law.

    Attributes
    ----------
    name : str
        Quantity and unit, for example ``radial_load_N``
    source : str
        ``speed`` [1/min] or ``torque`` [N m] of the input shaft, or the node whose temperature [degC] is read
    factor : float
        Input = factor * source: 1, the speed ratio of a shaft [-], the radial load per torque [N/(N m)]
    lowest : float, optional
        Value below which the law does not depend on the input
    """

    name: str
    source: str
    factor: float = 1.0
    lowest: float | None = None


@dataclass(frozen=True, kw_only=True)
class LossKind:
    """Properties that all loss terms of one law share.

    Attributes
    ----------
    name : str
    components : tuple of str
        Fixed names of its losses; empty if they have the names of machine elements in the definition
    factors : mapping of str to str
        Tunable factor of the thermal network on every output, and its description
    torque_driven : tuple of bool
        Per output: True if it is linear in torque below the torque floor
    network : str
        Neural network that learns it. Terms that name the same network are learnt together, as outputs of one network
    alike : bool
        True if every law has its own network, used once by every term of that law
    powers : tuple of tuple of float, shape (outputs, inputs)
        Powers of the inputs that a loss is divided by before the logarithm of it is learnt
    law_error : mapping of str to float
        Standard deviation of the exponents of speed, torque and viscosity (and of products of two logarithms), per
        e-fold: the published formulas of this loss differ by about as much
    terms : callable
        Makes the terms of a gearbox
    """

    name: str
    components: tuple[str, ...] = ()
    factors: Mapping[str, str]
    torque_driven: tuple[bool, ...] = (False,)
    network: str
    alike: bool = False
    powers: tuple[tuple[float, ...], ...]
    law_error: Mapping[str, float]
    terms: Callable[[GearboxData], Iterator[LossTerm]]


@dataclass(frozen=True, kw_only=True)
class LossTerm:
    """A law at its place in a gearbox.

    Attributes
    ----------
    kind : LossKind
    name : str
    components : tuple of str
        Names of its losses, one per output of the law
    node : str
        Where the heat goes
    inputs : tuple of TermInput
        What the law reads, in the order of its columns
    law : Law
    """

    kind: LossKind = field(repr=False)
    name: str
    components: tuple[str, ...]
    node: str
    inputs: tuple[TermInput, ...]
    law: Law

    @property
    def reads(self) -> tuple[str, ...]:
        """Nodes whose temperatures the law reads."""
        return tuple(i.source for i in self.inputs if i.source not in (SPEED, TORQUE))

    @property
    def torque_driven(self) -> tuple[str, ...]:
        """Components that are linear in torque below the torque floor."""
        return tuple(c for c, driven in zip(self.components, self.kind.torque_driven, strict=True) if driven)

    def power(self, speed: Array, torque: Array, temperatures: Mapping[str, Array]) -> Array:
        """Losses of this term.

        Parameters
        ----------
        speed, torque : Array, shape (N,)
            Of the input shaft, [1/min] and [N m], signed
        temperatures : mapping of node to Array, shape (N,)
            [degC], at least of the nodes that it reads

        Returns
        -------
        Array, shape (N, components)
            [W]
        """
        return np.asarray(power_of((self,), speed, torque, temperatures)[0])


def power_of(terms: Sequence[LossTerm], speed: Array, torque: Array, temperatures: Mapping[str, Array]) -> Array:
    """Losses [W], shape (terms, N, outputs), of terms of the same law; parameters as :meth:`LossTerm.power`.

    One call of the law for all terms: an array operation costs the same for one bearing as for four.
    """
    n, moment = np.abs(speed), np.abs(torque)
    point = {**temperatures, SPEED: np.maximum(n, SPEED_FLOOR_RPM), TORQUE: moment}
    columns = np.array([[point[i.source] * i.factor for i in term.inputs] for term in terms])
    rows = columns.transpose(1, 0, 2).reshape(columns.shape[1], -1).T
    power = terms[0].law.power(rows).reshape(len(terms), len(n), -1)
    light = np.minimum(moment / TORQUE_FLOOR_NM, 1.0)
    slow = np.minimum(n / SPEED_FLOOR_RPM, 1.0)
    return np.asarray(power * np.where(terms[0].kind.torque_driven, light[:, None], 1.0) * slow[:, None])
