"""The reference run that an FMU carries: inputs, and the outputs that belong to them, for checking an import."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from builder.fmi.reference_cycle import reference_cycle
from builder.fmi.signals import Signal, SignalTable, start_temperature
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.portable import solver
from models.portable.evaluation import NoLosses
from models.portable.surrogate import SurrogateLosses
from models.simulation.result import Result
from models.simulation.simulate import advance, evaluate, initial_states, input_table, network_system
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
    gearbox: Gearbox, network: ThermalNetwork, table: SignalTable, surrogate: SurrogateLosses | None
) -> ReferenceRun:
    """Run the reference cycle through the network of an FMU.

    Parameters
    ----------
    gearbox, network, table, surrogate
        What the FMU is made of
    """
    cycle = reference_cycle(gearbox, step_s=STEP_S)
    losses = NoLosses() if surrogate is None else surrogate
    rows = input_table(network, cycle)
    system = network_system(network, losses)
    starts = initial_states(network, start_temperature(network))
    held = np.concatenate((rows[:1], rows[:-1]))  # at the end of a step its inputs still hold
    states = [solver.start(starts, system.n_boundaries)]
    for begin, end, row in zip(cycle.time[:-1], cycle.time[1:], rows[:-1], strict=True):
        states.append(advance(system, states[-1], float(begin), float(end - begin), row, row))
    result = evaluate(
        network, losses, None, time=cycle.time, table=held, states=np.stack([s.states for s in states]),
        heat_in=np.array([s.heat_in for s in states]), heat_out=np.array([s.heat_out for s in states]),
    )  # fmt: skip
    at_start = system.balance(float(cycle.time[0]), rows[0], starts).heat_out
    means = np.diff([s.heat_out for s in states], axis=0) / np.diff(cycle.time)[:, None]
    flows = dict(zip(system.laws.boundaries, np.vstack((at_start, means)).T, strict=True))
    inputs, outputs = table.of_role("input"), [signal for signal in table if signal.causality == "output"]
    return ReferenceRun(
        {"time": cycle.time} | {s.name: _at_fmi(s, rows[:, i]) for i, s in enumerate(inputs)},
        {"time": cycle.time} | {s.name: _at_fmi(s, _values(result, flows, s)) for s in outputs},
    )


def _values(result: Result, flows: Mapping[str, Array], signal: Signal) -> Array:
    """An output over time in the network's units; `flows` are the mean heat flows to the boundaries."""
    families = {
        "temperature": result.temperatures, "loss": result.losses, "heat": result.extra_heat, "heat_flow": flows,
        "heat_to_boundary": result.heat_to,
    }  # fmt: skip
    if signal.role in families:
        return families[signal.role][signal.of]
    if signal.role == "in_domain":
        return np.asarray(result.domain_distance <= 0.0, dtype=float)
    single = {"total_loss": "loss", "torque_loss": "torque_loss", "efficiency": "efficiency",
              "domain_distance": "domain_distance", "heat_in": "heat_in", "heat_stored": "heat_stored"}  # fmt: skip
    values: Array = getattr(result, single[signal.role])
    return values


def csv(columns: Mapping[str, Array]) -> bytes:
    """Columns as CSV with nine digits, comma-separated, names in quotes."""
    lines = [",".join(f'"{name}"' for name in columns)]
    rows: Sequence[Sequence[float]] = np.stack(list(columns.values()), axis=-1).tolist()
    lines += [",".join(f"{value:.9g}" for value in row) for row in rows]
    return ("\n".join(lines) + "\n").encode()


def _at_fmi(signal: Signal, values: Array) -> Array:
    scale, offset = signal.to_inner
    return (values - offset) / scale
