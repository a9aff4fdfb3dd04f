"""The full power-loss model (F-PL): operating points in, one loss per component out.

:class:`LossModel` is a list of loss terms (:mod:`models.losses.loss_term`). Speed and torque are the input shaft's,
signed;
losses depend on their magnitudes only, are never negative, and go to zero with speed.

To add a loss: write its law, :class:`~models.losses.loss_term.LossKind` and terms in a file like
:mod:`models.losses.seal`, and add
the kind to ``LOSS_KINDS``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from models.base.errors import InputError
from models.base.types import Array
from models.losses.bearing import BEARING
from models.losses.breakdown import Breakdown, break_down
from models.losses.churning import CHURNING
from models.losses.friction import MESH
from models.losses.loss_term import OIL, GearboxData, LossTerm, power_of
from models.losses.seal import SEAL

LOSS_KINDS = (MESH, CHURNING, SEAL, BEARING)
BATCH = 4096  # operating points evaluated at once: keeps the contact-point arrays inside the cache


def loss_factors() -> dict[str, str]:
    """Return the tunable factors on losses and their descriptions.

    Examples
    --------
    >>> list(loss_factors())
    ['mesh', 'rolling', 'churning', 'seal', 'bearing']
    """
    return {factor: text for kind in LOSS_KINDS for factor, text in kind.factors.items()}


def loss_components() -> tuple[str, ...]:
    """Return the fixed names of losses, which no machine element of a definition can have.

    Examples
    --------
    >>> loss_components()
    ('mesh_sliding', 'mesh_rolling', 'churning')
    """
    return tuple(name for kind in LOSS_KINDS for name in kind.components)


def law_errors() -> dict[str, Mapping[str, float]]:
    """Return the standard deviations of the exponents of every loss, by the factor on its first output."""
    return {next(iter(kind.factors)): kind.law_error for kind in LOSS_KINDS}


@dataclass(frozen=True, kw_only=True)
class LossModel:
    """The full model of one gearbox: the sum of its terms."""

    terms: tuple[LossTerm, ...]

    @classmethod
    def from_definition(cls, gearbox: GearboxData) -> LossModel:
        """Build the model that a definition describes."""
        return cls(terms=tuple(term for kind in LOSS_KINDS for term in kind.terms(gearbox)))

    @cached_property
    def components(self) -> tuple[str, ...]:
        """Names of the losses, in the order of :meth:`power`'s last axis."""
        return tuple(name for term in self.terms for name in term.components)

    @cached_property
    def temperature_nodes(self) -> tuple[str, ...]:
        """Node temperatures that are read, in the order of :meth:`power`'s last axis of `temperatures`; oil first."""
        return tuple(dict.fromkeys((OIL, *(node for term in self.terms for node in term.reads))))

    @cached_property
    def reads(self) -> tuple[frozenset[str], ...]:
        """The `temperature_nodes` that each component reads."""
        return tuple(frozenset(term.reads) for term in self.terms for _ in term.components)

    @cached_property
    def groups(self) -> tuple[tuple[LossTerm, ...], ...]:
        """Terms of equal laws together."""
        groups: list[list[LossTerm]] = []
        for term in self.terms:
            group = next((g for g in groups if g[0].kind is term.kind and g[0].law == term.law), None)
            if group is None:
                groups.append([term])
            else:
                group.append(term)
        return tuple(tuple(group) for group in groups)

    def term(self, name: str) -> LossTerm:
        """Return the term of a name: ``mesh``, ``churning``, or a seal's or bearing's."""
        return next(term for term in self.terms if term.name == name)

    def power(self, speed: ArrayLike, torque: ArrayLike, temperatures: ArrayLike) -> Array:
        """Loss of every component.

        Parameters
        ----------
        speed : ArrayLike, shape (...)
            Speed of the input shaft, [1/min], signed
        torque : ArrayLike, shape (...)
            Torque of the input shaft, [N m], signed
        temperatures : ArrayLike, shape (..., len(temperature_nodes))
            [degC]

        Returns
        -------
        Array, shape (..., len(components))
            [W], >= 0

        Raises
        ------
        InputError
            If an input is not finite or a temperature below absolute zero.
        """
        T = np.asarray(temperatures, dtype=float)
        n, torque, _ = np.broadcast_arrays(np.asarray(speed, dtype=float), np.asarray(torque, dtype=float), T[..., 0])
        shape = n.shape
        T = np.broadcast_to(T, (*shape, T.shape[-1])).reshape(-1, T.shape[-1])
        n, torque = n.reshape(-1), torque.reshape(-1)
        refuse_unphysical(n, torque, T, self.temperature_nodes)
        power = np.empty((len(n), len(self.components)))
        for begin in range(0, len(n), BATCH):
            rows = slice(begin, begin + BATCH)
            self._evaluate(n[rows], torque[rows], T[rows], power[rows])
        return power.reshape(*shape, len(self.components))

    def _evaluate(self, speed: Array, torque: Array, T: Array, power: Array) -> None:
        """Fill `power`, shape (N, components), at N operating points."""
        by_node = {node: T[:, column] for column, node in enumerate(self.temperature_nodes)}
        for terms in self.groups:
            for term, losses in zip(terms, power_of(terms, speed, torque, by_node), strict=True):
                power[:, self._columns[term.name]] = losses

    @cached_property
    def _columns(self) -> dict[str, list[int]]:
        return {term.name: [self.components.index(name) for name in term.components] for term in self.terms}

    def breakdown(
        self, *, speed: ArrayLike, torque: ArrayLike, temperatures: Mapping[str, ArrayLike] | ArrayLike
    ) -> Breakdown:
        """Return the loss of every component by name, and the ``total``; see :func:`break_down`."""
        return break_down(self, speed=speed, torque=torque, temperatures=temperatures)

    def domain_distance(self, speed: ArrayLike, torque: ArrayLike, temperatures: ArrayLike) -> Array:
        """Zero: the full model has no training domain. Parameters as :meth:`power`; shape (...)."""
        return np.zeros(np.broadcast_shapes(np.shape(speed), np.shape(torque), np.shape(temperatures)[:-1]))


def refuse_unphysical(n: Array, torque: Array, T: Array, nodes: tuple[str, ...]) -> None:
    """Refuse operating points that no machine has.

    Parameters
    ----------
    n, torque : Array, shape (N,)
        [1/min], [N m]
    T : Array, shape (N, nodes)
        [degC]

    Raises
    ------
    InputError
        If a value is not finite or a temperature below absolute zero.
    """
    for name, unit, values in (("speed", "1/min", n), ("torque", "N m", torque)):
        if not np.isfinite(values).all():
            row = int(np.flatnonzero(~np.isfinite(values))[0])
            raise InputError(f"{name} is {values[row]} {unit} at operating point {row}; finite numbers are needed")
    if not (np.isfinite(T).all() and T.min(initial=0.0) > -273.15):
        row, column = np.argwhere(~(np.isfinite(T) & (T > -273.15)))[0]
        raise InputError(
            f"T_{nodes[column]} is {T[row, column]} degC at operating point {row}; "
            "finite numbers above -273.15 are needed"
        )
