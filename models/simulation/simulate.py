"""Running a thermal network through a cycle."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from models.base.errors import InputError, did_you_mean
from models.base.types import Array
from models.definition.sections import Training
from models.files.cycle import Cycle
from models.network.compiled import compile_laws
from models.network.structure import Losses, Network
from models.portable import solver
from models.portable.evaluation import NetworkSystem
from models.portable.surrogate import range_distance
from models.simulation.result import Result
from models.simulation.start_temperatures import start_memories, start_temperatures


def network_system(
    network: Network, losses: Losses, parameters: Mapping[str, ArrayLike] | None = None, *, vector: bool = False
) -> NetworkSystem:
    """A network with its losses and parameter values, ready for the solver.

    Parameters
    ----------
    parameters : mapping of str to ArrayLike, shape () or (B,), or None
        Values of parameters that differ from their start; arrays run B variants at once
    vector : bool
        Work on arrays even where all parameters are single numbers

    Raises
    ------
    InputError
        If a parameter is unknown or makes a heat capacity not positive, or the losses are another gearbox's.
    """
    given = dict(parameters or {})
    known = [p.name for p in network.parameters]
    for name in given:
        if name not in known:
            raise InputError(f"{name!r} is not a parameter of this network{did_you_mean(name, known)}")
    if tuple(losses.components) != network.components:
        raise InputError("the losses belong to another gearbox; they are: " + ", ".join(losses.components))
    part_names = [part.name for part in network.parts]
    for name in losses.temperature_nodes:
        if name not in part_names:
            raise InputError(f"the losses need the temperature of {name!r}{did_you_mean(name, part_names)}")
    values = [np.asarray(given.get(p.name, p.start), dtype=float) for p in network.parameters]
    vector = vector or any(value.ndim for value in values)
    laws = compile_laws(network, vector=vector)
    try:
        return NetworkSystem(laws, losses, values if vector else [float(v) for v in values], vector=vector)
    except ValueError as error:
        raise InputError(str(error)) from error


def initial_states(network: Network, initial: float | Mapping[str, float]) -> Array:
    """States at the start, shape (n,); see :mod:`models.simulation.start_temperatures`.

    Raises
    ------
    InputError
    """
    parts = [part.name for part in network.parts]
    temperatures = start_temperatures(initial, parts, known=network.node_names)
    memories = start_memories(initial, {state.name: state.start for state in network.states})
    return np.array([*temperatures.values(), *memories.values()])


def input_table(network: Network, cycle: Cycle) -> Array:
    """Inputs of a cycle as one table in the order of the network, defaults filled in, shape (N, inputs)."""
    rows = len(cycle)
    columns = [cycle.inputs.get(name, np.full(rows, given.default)) for name, given in network.inputs.items()]
    return np.stack(columns, axis=-1) if columns else np.zeros((rows, 0))


def simulate(
    network: Network,
    cycle: Cycle | Mapping[str, ArrayLike],
    *,
    losses: Losses,
    initial: float | Mapping[str, float] | None = None,
    parameters: Mapping[str, ArrayLike] | None = None,
    trained: Training | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Result:
    """Temperatures and losses over a cycle.

    Parameters
    ----------
    network : Network
    cycle : Cycle or mapping of column name to ArrayLike, shape (N,)
        Inputs; straight lines between the rows
    losses : Losses
        The full model or a surrogate
    initial : float, mapping of name to float, or None
        Temperatures at the first row, [degC]; by default the first ambient temperature. A mapping has all nodes, and
        may have memories of laws, as ``state_<name>``
    parameters : mapping of name to ArrayLike, shape () or (B,), or None
        Values of tunable parameters; arrays simulate B variants at once
    trained : Training or None
        Range that the definition names; outside it the result's `domain_distance` is above 0 also where the losses
        have no own domain, as the full model
    progress : callable or None
        Called with (rows done, rows in all) now and then

    Returns
    -------
    Result

    Raises
    ------
    InputError
        For faulty cycles, parameters and initial temperatures, and where the laws give no temperatures.

    References
    ----------
    The network of Changenet et al. and Durand de Gevigney et al. that the paper follows, section 5.
    """
    if not isinstance(cycle, Cycle):
        cycle = Cycle.from_columns(cycle, inputs=network.inputs)
    system = network_system(network, losses, parameters)
    table = input_table(network, cycle)
    if initial is None:
        initial = float(surroundings(system, table[:1], vector=system.vector)[0])
    batch = np.broadcast_shapes(*(np.shape(value) for value in system.parameters))
    first = initial_states(network, initial)
    state = solver.start(np.broadcast_to(first, (*batch, len(first))), system.n_boundaries)
    n_rows = len(cycle)
    states = np.empty((*batch, n_rows, len(first)))
    heat_in, heat_out = np.zeros((*batch, n_rows)), np.zeros((*batch, n_rows, system.n_boundaries))
    states[..., 0, :] = state.states
    for row in range(n_rows - 1):
        t = float(cycle.time[row])
        state = advance(system, state, t, float(cycle.time[row + 1]) - t, table[row], table[row + 1])
        states[..., row + 1, :] = state.states
        heat_in[..., row + 1], heat_out[..., row + 1, :] = state.heat_in, state.heat_out
        if progress is not None and (row % 50 == 49 or row == n_rows - 2):
            progress(row + 1, n_rows - 1)
    return evaluate(
        network, losses, parameters, time=cycle.time, table=table, states=states, heat_in=heat_in, heat_out=heat_out,
        trained=trained,
    )  # fmt: skip


def advance(
    system: NetworkSystem, state: solver.State, time: float, duration: float, inputs: Array, inputs_end: Array
) -> solver.State:
    """A step of :func:`models.portable.solver.advance`, whose faults here are those of a definition or a cycle.

    Raises
    ------
    InputError
        If the laws give no temperatures.
    """
    try:
        return solver.advance(system, state, time, duration, inputs, inputs_end)
    except (ArithmeticError, ValueError) as error:
        raise InputError(
            f"the temperatures from {time:g} s on cannot be calculated ({error}); check the definition's laws and the "
            "cycle's units"
        ) from error


def surroundings(system: NetworkSystem, table: Array, *, vector: bool) -> Array:
    """Temperatures around the machine [degC], shape (N,), at inputs of shape (N, inputs): ambient, or a boundary."""
    if "T_ambient" in system.laws.inputs:
        return table[:, system.laws.inputs.index("T_ambient")]
    nothing = np.zeros((len(table), system.n_parts + system.n_states))
    if vector:
        return system.boundary_temperatures(0.0, table, nothing)[..., 0]
    return np.array([system.boundary_temperatures(0.0, row, nothing[0])[0] for row in table])


def evaluate(
    network: Network,
    losses: Losses,
    parameters: Mapping[str, ArrayLike] | None,
    *,
    time: Array,
    table: Array,
    states: Array,
    heat_in: Array,
    heat_out: Array,
    trained: Training | None = None,
) -> Result:
    """All results that follow from inputs and states, over whole arrays at once.

    Parameters
    ----------
    network, losses, parameters
        As for :func:`simulate`
    time : Array, shape (N,)
        [s]
    table : Array, shape (..., N, inputs)
    states : Array, shape (..., N, n)
    heat_in : Array, shape (..., N)
        Heat brought in since the start, [J]
    heat_out : Array, shape (..., N, boundaries)
        Heat given to each boundary since the start, [J]
    trained
        As for :func:`simulate`
    """
    along_time = {name: np.asarray(value, dtype=float)[..., None] for name, value in (parameters or {}).items()}
    system = network_system(network, losses, along_time, vector=True)
    wide = np.broadcast_to(table, (*states.shape[:-1], table.shape[-1]))
    heats, _ = system.flows(time, wide, states)
    boundary = system.boundary_temperatures(time, wide, states)
    n_parts = system.n_parts
    part, given = iter(np.moveaxis(states[..., :n_parts], -1, 0)), iter(np.moveaxis(boundary, -1, 0))
    loss_nodes = [system.laws.parts.index(name) for name in losses.temperature_nodes]
    distance = np.zeros(states.shape[:-1])
    if losses.components:
        point = (*system.operating(time, wide, states), states[..., loss_nodes])
        distance = losses.domain_distance(*point)
        if trained is not None:
            bounds = trained.speed_rpm, trained.torque_Nm, trained.temperature_degC
            distance = np.maximum(distance, range_distance(*point, *bounds))
    return Result(
        time=time,
        inputs=dict(zip(system.laws.inputs, np.moveaxis(table, -1, 0), strict=True)),
        temperatures={n.name: next(part) if n.temperature is None else next(given) for n in network.nodes},
        losses={s.name: heats[..., i] for i, s in enumerate(network.sources) if s.is_loss},
        extra_heat={s.name: heats[..., i] for i, s in enumerate(network.sources) if not s.is_loss},
        domain_distance=distance,
        heat_to=dict(zip(system.laws.boundaries, np.moveaxis(heat_out, -1, 0), strict=True)),
        memories=dict(zip(system.laws.states, np.moveaxis(states[..., n_parts:], -1, 0), strict=True)),
        heat_in=heat_in,
        heat_stored=((states - states[..., :1, :])[..., :n_parts] * system.capacities).sum(axis=-1),
    )
