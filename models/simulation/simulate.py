"""Running a thermal network: through a cycle, or to its steady state."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from models.base.errors import InputError, did_you_mean
from models.base.types import Array
from models.definition.sections import Training
from models.files.cycle import Cycle
from models.network.compiled import compile_laws
from models.network.structure import Losses, Network
from models.portable import solver
from models.portable.evaluation import NetworkSystem, efficiency, torque_loss
from models.portable.surrogate import range_distance
from models.quantities.quantities import TOTAL_LOSS, column_of, column_of_input
from models.simulation.start_temperatures import start_temperatures

STEADY_TOLERANCE_K, STEADY_DISTANCE_K = 1e-9, 1e-6
FIRST_PSEUDO_STEP_S, LARGEST_PSEUDO_STEP_S, SHORTEST_PSEUDO_STEP_S = 1e5, 1e10, 10.0
# A change this much smaller than the one before; without a margin rounding can keep a cycle of two alive.
SETTLING = 0.7
RUNAWAY_K = 1e6
ITERATIONS_WITHOUT_LOSSES = 60  # that all but nearly unstable states need no more than
DIFFERENCE_K = 0.01  # of slopes; the networks' rounding is far below it


def network_system(
    network: Network, losses: Losses, parameters: Mapping[str, ArrayLike] | None = None, *, vector: bool = False
) -> NetworkSystem:
    """A network with its losses and parameter values, ready for the solver.

    Parameters
    ----------
    network : Network
    losses : Losses
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
    """States at the start, shape (n,); see :func:`models.simulation.start_temperatures.start_temperatures`.

    Raises
    ------
    InputError
    """
    parts = [part.name for part in network.parts]
    temperatures = start_temperatures(initial, parts, known=network.node_names)
    return np.array([*temperatures.values(), *(state.start for state in network.states)])


@dataclass(frozen=True, kw_only=True)
class Result:
    """A simulated cycle. With parameter arrays of length B every array but `time` and `inputs` has B in front.

    Attributes
    ----------
    time : Array, shape (N,)
        [s]
    inputs : mapping of signal to Array, shape (N,)
    temperatures : mapping of node to Array, shape (..., N)
        [degC], boundary nodes included
    losses : mapping of loss to Array, shape (..., N)
        [W], factors applied
    extra_heat : mapping of source to Array, shape (..., N)
        Sources that are no losses, [W]
    domain_distance : Array, shape (..., N)
        How far outside the loss model's domain, or the range that was named, as a fraction of its range; 0 inside
    heat_to : mapping of boundary to Array, shape (..., N)
        Heat given to each boundary since the start, [J]
    heat_in, heat_stored : Array, shape (..., N)
        Heat brought in by all sources and stored since the start, [J]
    """

    time: Array
    inputs: Mapping[str, Array]
    temperatures: Mapping[str, Array]
    losses: Mapping[str, Array]
    extra_heat: Mapping[str, Array]
    domain_distance: Array
    heat_to: Mapping[str, Array]
    heat_in: Array
    heat_stored: Array

    @property
    def loss(self) -> Array:
        """Total loss [W], shape (..., N)."""
        return np.asarray(sum(self.losses.values()))

    @property
    def heat_out(self) -> Array:
        """Heat given to all boundaries since the start [J], shape (..., N)."""
        return np.asarray(sum(self.heat_to.values(), np.zeros_like(self.heat_in)))

    @property
    def has_shaft(self) -> bool:
        """True if the machine has losses and a shaft of recorded speed and torque."""
        return bool(self.losses) and {"speed", "torque"} <= self.inputs.keys()

    @property
    def torque_loss(self) -> Array:
        """Loss torque at the input shaft [N m], shape (..., N); see :func:`models.portable.evaluation.torque_loss`."""
        return torque_loss(self.loss, self.inputs["speed"])

    @property
    def efficiency(self) -> Array:
        """Efficiency [-], shape (..., N); see :func:`models.portable.evaluation.efficiency`."""
        return efficiency(self.loss, self.inputs["speed"], self.inputs["torque"])

    def torque_out(self, ratio: float) -> Array:
        """Return the torque at the output shaft [N m], shape (..., N).

        Its power is that of the input shaft less the loss, as in :func:`models.portable.evaluation.efficiency`: when
        coasting the output shaft gives the loss as well. Negative if a driving input gives less than the loss.

        Parameters
        ----------
        ratio : float
            Speed of the input shaft over speed of the output shaft, [-]
        """
        return np.asarray(ratio * (self.inputs["torque"] - self.torque_loss))

    def columns(self, *, ratio: float | None = None) -> dict[str, Array]:
        """Return the result as the columns of a file, in the order of the file contract.

        Parameters
        ----------
        ratio : float or None
            Speed of the input shaft over speed of the output shaft, [-]; with it the output torque is a column too
        """
        table = {"time_s": self.time}
        table |= {column_of_input(name): values for name, values in self.inputs.items()}
        computed = {f"T_{node}": T for node, T in self.temperatures.items()}
        if self.losses:
            computed |= {TOTAL_LOSS: self.loss} | {f"P_loss_{name}": P for name, P in self.losses.items()}
        if self.has_shaft:
            computed |= {"torque_loss": self.torque_loss, "efficiency": self.efficiency}
            computed |= {} if ratio is None else {"torque_out": self.torque_out(ratio)}
        computed |= {"in_domain": np.asarray(self.domain_distance <= 0.0)}
        return table | {column_of(name): values for name, values in computed.items()}


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
    initial : float, mapping of node name to float, or None
        Temperatures at the first row, [degC]; by default the first ambient temperature
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
        For faulty cycles, parameters and initial temperatures.

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
        state = solver.advance(system, state, t, float(cycle.time[row + 1]) - t, table[row], table[row + 1])
        states[..., row + 1, :] = state.states
        heat_in[..., row + 1], heat_out[..., row + 1, :] = state.heat_in, state.heat_out
        if progress is not None and (row % 50 == 49 or row == n_rows - 2):
            progress(row + 1, n_rows - 1)
    return evaluate(
        network, losses, parameters, time=cycle.time, table=table, states=states, heat_in=heat_in, heat_out=heat_out,
        trained=trained,
    )  # fmt: skip


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
        heat_in=heat_in,
        heat_stored=((states - states[..., :1, :])[..., :n_parts] * system.capacities).sum(axis=-1),
    )


def steady_state(
    network: Network,
    *,
    losses: Losses,
    speed: ArrayLike = 0.0,
    torque: ArrayLike = 0.0,
    inputs: Mapping[str, ArrayLike] | None = None,
    parameters: Mapping[str, ArrayLike] | None = None,
    max_iterations: int = 2000,
) -> Result:
    """Temperatures and losses at which nothing changes any more.

    Parameters
    ----------
    network : Network
    losses : Losses
    speed, torque : ArrayLike, shape () or (B,)
        Of the input shaft, [1/min] and [N m], if the machine has these inputs
    inputs : mapping of input name to ArrayLike, shape () or (B,), or None
        Further inputs, e.g. ``T_ambient``
    parameters : mapping of name to ArrayLike, shape () or (B,), or None
    max_iterations : int

    Returns
    -------
    Result
        With one row, so arrays of shape (..., 1)

    Raises
    ------
    InputError
        If the network has laws with memory, or an input is unknown.
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
    given = dict(inputs or {})
    for name in given:
        if name not in network.inputs:
            raise InputError(f"{name!r} is not an input of this network{did_you_mean(name, network.inputs)}")
    given = {"speed": speed, "torque": torque} | given
    columns = [given.get(name, known.default) for name, known in network.inputs.items()]
    shapes = [np.shape(c) for c in columns] + [np.shape(v) for v in (parameters or {}).values()]
    shape = np.broadcast_shapes(*shapes)
    if len(shape) > 1:
        raise InputError(f"inputs and parameters give an array of shape {shape}; one axis at most is possible")
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
            return evaluate(
                network, losses, wide, time=np.zeros(1), table=table[:, None, :], states=T[:, None, :],
                heat_in=np.zeros((*rows, 1)), heat_out=np.zeros((*rows, 1, system.n_boundaries)),
            )  # fmt: skip
        # Longer steps while it settles, shorter ones where losses that rise with temperature make it overshoot.
        settling = moved < SETTLING * previous
        step = min(step * 3.0, LARGEST_PSEUDO_STEP_S) if settling else max(step / 4.0, SHORTEST_PSEUDO_STEP_S)
        previous = moved
    raise ArithmeticError(
        f"no steady state found (a node still moves by {moved:.3g} K): is there a node without cooling, or do losses "
        "rise with temperature faster than heat leaves?"
    )


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
