"""The reference run that an FMU carries: inputs, and the outputs that belong to them, for checking an import."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from builder.fmi.reference_cycle import reference_cycle
from builder.fmi.signals import START_TEMPERATURE, Signal, SignalTable
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.portable import solver
from models.portable.evaluation import NoLosses
from models.portable.surrogate import KELVIN, SurrogateLosses
from models.simulation.simulate import Result, evaluate, initial_states, input_table, network_system
from models.simulation.thermal_network import ThermalNetwork

STEP_S = 10.0


@dataclass(frozen=True)
class ReferenceRun:
    """Columns of both tables by FMI name, ``time`` first, in the FMU's own units.

    Inputs are held from their row to the next; outputs are those at the end of each step, the first row those at the
    start, as FMPy's ``simulate_fmu`` gives them.
    """

    inputs: Mapping[str, Array]
    outputs: Mapping[str, Array]


def reference_run(
    gearbox: Gearbox, network: ThermalNetwork, table: SignalTable, losses: SurrogateLosses | None
) -> ReferenceRun:
    """Run the reference cycle through the network of an FMU, inputs held in each step as FMI holds them.

    Parameters
    ----------
    gearbox, network, table, losses
        What the FMU is made of
    """
    cycle = reference_cycle(gearbox, step_s=STEP_S)
    surrogate = NoLosses() if losses is None else losses
    system = network_system(network, surrogate)
    rows = input_table(network, cycle)
    states = [solver.start(initial_states(network, START_TEMPERATURE - KELVIN))]
    for begin, end, row in zip(cycle.time[:-1], cycle.time[1:], rows[:-1], strict=True):
        states.append(solver.advance(system, states[-1], float(begin), float(end - begin), row, row))
    result = evaluate(
        network, surrogate, None, time=cycle.time, table=np.concatenate((rows[:1], rows[:-1])),
        states=np.stack([state.states for state in states]),
        heat=np.array([[state.heat_in for state in states], [state.heat_out for state in states]]),
    )  # fmt: skip
    inputs, outputs = table.of_role("input"), [signal for signal in table if signal.causality == "output"]
    return ReferenceRun(
        {"time": cycle.time} | {signal.name: _outside(signal, rows[:, i]) for i, signal in enumerate(inputs)},
        {"time": cycle.time} | {signal.name: _outside(signal, _output(result, signal)) for signal in outputs},
    )


def _output(result: Result, signal: Signal) -> Array:
    """An output over time in the network's unit."""
    named = {"temperature": result.temperatures, "loss": result.losses, "heat": result.extra_heat}
    if signal.role in named:
        return named[signal.role][signal.of]
    if signal.role == "in_domain":
        return np.asarray(result.domain_distance <= 0.0, dtype=float)
    attribute = "loss" if signal.role == "total_loss" else signal.role
    return np.asarray(getattr(result, attribute))


def _outside(signal: Signal, values: Array) -> Array:
    """Values in the network's unit as the FMU shows them."""
    scale, offset = signal.to_inner
    return (values - offset) / scale


def csv(columns: Mapping[str, Array]) -> bytes:
    """Columns as CSV with nine digits, comma-separated, names in quotes."""
    lines = [",".join(f'"{name}"' for name in columns)]
    rows: Sequence[Sequence[float]] = np.stack(list(columns.values()), axis=-1).tolist()
    lines += [",".join(f"{value:.9g}" for value in row) for row in rows]
    return ("\n".join(lines) + "\n").encode()
