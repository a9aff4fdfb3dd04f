"""Steady states of a thermal network."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from models.base.errors import InputError, did_you_mean
from models.base.shapes import common_shape
from models.base.types import Array, Numeric
from models.definition.sections import Training
from models.network.structure import Losses, Network
from models.portable import solver
from models.portable.evaluation import NetworkSystem
from models.quantities.quantities import implausible
from models.simulation.result import Result, SteadyState
from models.simulation.simulate import evaluate, network_system, surroundings

STEADY_TOLERANCE_K, STEADY_DISTANCE_K = 1e-9, 1e-6
FIRST_PSEUDO_STEP_S, LARGEST_PSEUDO_STEP_S, SHORTEST_PSEUDO_STEP_S = 1e5, 1e10, 10.0
# A change this much smaller than the one before; without a margin rounding can keep a cycle of two alive.
SETTLING = 0.7
RUNAWAY_K = 1e6
ITERATIONS_WITHOUT_LOSSES = 60  # that all but nearly unstable states need no more than
DIFFERENCE_K = 0.01  # of slopes; the networks' rounding is far below it


def steady_state(
    network: Network,
    *,
    losses: Losses,
    speed: ArrayLike | None = None,
    torque: ArrayLike | None = None,
    inputs: Mapping[str, ArrayLike] | None = None,
    parameters: Mapping[str, ArrayLike] | None = None,
    trained: Training | None = None,
    max_iterations: int = 2000,
) -> SteadyState:
    """Temperatures and losses at which nothing changes any more.

    Parameters
    ----------
    network : Network
    losses : Losses
    speed, torque : ArrayLike, shape () or (B,), or None
        Of the input shaft, [1/min] and [N m], of a machine with these inputs; by default 0
    inputs : mapping of input name to ArrayLike, shape () or (B,), or None
        Further inputs, e.g. ``T_ambient``
    parameters : mapping of name to ArrayLike, shape () or (B,), or None
    trained : Training or None
        Range that the definition names; outside it the result is not ``in_domain``
    max_iterations : int

    Returns
    -------
    SteadyState

    Raises
    ------
    InputError
        If the network has laws with memory, an input is unknown, or the torque follows from a power.
    ArithmeticError
        If no steady state is found (thermal runaway, or a node that nothing cools).

    Notes
    -----
    Implicit Euler in pseudo-time with the conductance matrix as Jacobian: an iteration that the stiff network damps by
    itself. Where it does not settle, because losses rise with temperature about as fast as heat leaves, their slopes
    join the Jacobian. It ends when no node moves by more than 1e-9 K in a step, and by no more than 1e-6 K in an
    infinite one.
    """
    if network.states:
        raise InputError("a network with laws that have a memory has no steady state; simulate a long cycle instead")
    columns = _inputs(network, speed, torque, inputs or {})
    shape = common_shape({**dict(zip(network.inputs, columns, strict=True)), **(parameters or {})})
    if len(shape) > 1 or 0 in shape:
        raise InputError(f"inputs and parameters give an array of shape {shape}; one axis of at least one is possible")
    rows = np.broadcast_shapes(shape, (1,))
    table = np.stack([np.broadcast_to(np.asarray(c, dtype=float), rows) for c in columns], axis=-1)
    wide = {p.name: np.broadcast_to(np.asarray((parameters or {}).get(p.name, p.start), float), rows)
            for p in network.parameters}  # fmt: skip
    system = network_system(network, losses, wide, vector=True)
    T = np.repeat(surroundings(system, table, vector=True)[:, None], system.n_parts, axis=1)
    step, previous, moved = FIRST_PSEUDO_STEP_S, np.inf, np.inf
    for iteration in range(max_iterations):
        balance = system.balance(0.0, table, T)
        if iteration == ITERATIONS_WITHOUT_LOSSES:  # from here on Newton's method, damped where it overshoots
            step, previous = LARGEST_PSEUDO_STEP_S, np.inf
        if iteration >= ITERATIONS_WITHOUT_LOSSES:
            balance = replace(balance, matrix=_jacobian(system, table, T, balance))
        inverse = np.linalg.inv(np.eye(system.n_parts) / step - balance.matrix)
        change = (inverse @ balance.derivative[..., None])[..., 0]
        moved = float(np.max(np.abs(change)))
        if not moved < RUNAWAY_K:
            break
        T = T + change
        if moved <= STEADY_TOLERANCE_K and _distance(balance) <= STEADY_DISTANCE_K:
            found = evaluate(
                network, losses, wide, time=np.zeros(1), table=table[:, None, :], states=T[:, None, :],
                heat_in=np.zeros((*rows, 1)), heat_out=np.zeros((*rows, 1, system.n_boundaries)),
                trained=trained,
            )  # fmt: skip
            return _at_points(found, shape)
        # Longer steps while it settles, shorter ones where losses that rise with temperature make it overshoot.
        settling = moved < SETTLING * previous
        step = min(step * 3.0, LARGEST_PSEUDO_STEP_S) if settling else max(step / 4.0, SHORTEST_PSEUDO_STEP_S)
        previous = moved
    raise ArithmeticError(
        f"no steady state found (a node still moves by {moved:.3g} K): is there a node without cooling, or do losses "
        "rise with temperature faster than heat leaves?"
    )


def _inputs(
    network: Network, speed: ArrayLike | None, torque: ArrayLike | None, others: Mapping[str, ArrayLike]
) -> list[ArrayLike]:
    """Inputs in the order of the network, their defaults filled in."""
    shaft = {"speed": speed, "torque": torque}
    given = {name: value for name, value in shaft.items() if value is not None} | dict(others)
    for name, value in given.items():
        if name in network.derived:
            sources = {s.name for s in network.derived[name].free_symbols} & set(network.inputs)
            needed = ", ".join(f"{source!r}: ..." for source in sorted(sources - {"speed"}))
            raise InputError(
                f"{name!r} follows from {', '.join(sorted(sources))} here; give inputs = {{{needed}}} in its place"
            )
        if name not in network.inputs:
            raise InputError(f"{name!r} is not an input of this network{did_you_mean(name, network.inputs)}")
        if fault := implausible(network.inputs[name].quantity, value):
            raise InputError(fault)
    given = {"speed": 0.0, "torque": 0.0} | given
    return [given.get(name, known.default) for name, known in network.inputs.items()]


def _at_points(result: Result, shape: tuple[int, ...]) -> SteadyState:
    """Leave the axis of time out, and for a single operating point that of the points."""

    def at(values: Array) -> Numeric:
        of_points = np.reshape(values, (*(shape or (1,)),))
        return of_points if shape else float(of_points[0])

    groups = (result.inputs, result.temperatures, result.losses, result.extra_heat)
    inputs, temperatures, lost, extra_heat = ({name: at(v) for name, v in group.items()} for group in groups)
    return SteadyState(
        inputs=inputs, temperatures=temperatures, losses=lost, extra_heat=extra_heat,
        domain_distance=at(result.domain_distance),
    )  # fmt: skip


def _jacobian(system: NetworkSystem, table: Array, T: Array, balance: solver.Balance) -> Array:
    """Slopes of the nodes' temperatures per second over all temperatures by differences, those of losses included."""
    columns = []
    for part in range(system.n_parts):
        moved = T.copy()
        moved[:, part] += DIFFERENCE_K
        columns.append((system.balance(0.0, table, moved).derivative - balance.derivative) / DIFFERENCE_K)
    return np.stack(columns, axis=-1)


def _distance(balance: solver.Balance) -> float:
    """How far the nodes would move in an infinite step, [K]; infinite where a node has no cooling."""
    try:
        move = np.linalg.solve(balance.matrix, balance.derivative[..., None])
    except np.linalg.LinAlgError:
        return np.inf
    return float(np.max(np.abs(move)))
