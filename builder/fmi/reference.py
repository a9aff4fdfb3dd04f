"""The reference run that an FMU carries: inputs, and the outputs that belong to them, for checking an import."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from builder.fmi.reference_cycle import reference_cycle
from builder.fmi.signals import SignalTable
from fmu_src.python.twin import Twin
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.network.compiled import law_source
from models.network.laws import compile_function
from models.portable.surrogate import SurrogateLosses
from models.simulation.simulate import input_table
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
    gearbox: Gearbox, network: ThermalNetwork, table: SignalTable, data: Mapping[str, Any], losses: SurrogateLosses
) -> ReferenceRun:
    """Run the reference cycle through the code and the networks of an FMU.

    Parameters
    ----------
    gearbox, network, table, losses
        What the FMU is made of
    data : mapping
        As the FMU carries it (:func:`builder.fmi.twin_data.twin_data`)
    """
    cycle = reference_cycle(gearbox, step_s=STEP_S)
    twin = Twin(data, _functions(network), losses)
    inputs, outputs = table.of_role("input"), [s for s in table if s.causality == "output"]
    rows = input_table(network, cycle)
    scales, offsets = np.array([signal.to_inner for signal in inputs]).T
    si = (rows - offsets) / scales
    references = [signal.reference for signal in outputs]
    twin.set([signal.reference for signal in inputs], si[0].tolist())
    twin.start(float(cycle.time[0]))
    twin.initialize()
    values = [twin.get(references)]
    for row in range(len(cycle) - 1):
        twin.set([signal.reference for signal in inputs], si[row].tolist())
        twin.step(float(cycle.time[row]), float(cycle.time[row + 1] - cycle.time[row]))
        values.append(twin.get(references))
    columns = np.array(values)
    return ReferenceRun(
        {"time": cycle.time} | {signal.name: si[:, i] for i, signal in enumerate(inputs)},
        {"time": cycle.time} | {signal.name: columns[:, i] for i, signal in enumerate(outputs)},
    )


def csv(columns: Mapping[str, Array]) -> bytes:
    """Columns as CSV with nine digits, comma-separated, names in quotes."""
    lines = [",".join(f'"{name}"' for name in columns)]
    rows: Sequence[Sequence[float]] = np.stack(list(columns.values()), axis=-1).tolist()
    lines += [",".join(f"{value:.9g}" for value in row) for row in rows]
    return ("\n".join(lines) + "\n").encode()


def _functions(network: ThermalNetwork) -> dict[str, Any]:
    return {name: compile_function(source, name) for name, source in law_source(network, vector=False).items()}
