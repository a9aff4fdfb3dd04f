"""Every speed that the README claims, measured in one run on this machine: medians of several runs.

python -m benchmarks.run out/fzg/fzg.fmu
"""

from __future__ import annotations

import shutil
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from builder.drive_cycle import COLD_START, reference_cycle
from builder.fmu_drive import drive_fmu
from models.gearbox import load_gearbox

STEPS = 600


def median_seconds(work: Callable[[], object], runs: int = 5) -> float:
    work()
    seconds = []
    for _ in range(runs):
        begin = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - begin)
    return statistics.median(seconds)


def fmpy_loop(fmu: Path) -> float:
    """Median time of 600 plain steps with FMPy after loading: set 4 inputs, step 1 s, get all outputs."""
    description = read_model_description(fmu)
    folder = extract(str(fmu))
    slave = FMU2Slave(
        guid=description.guid, unzipDirectory=folder, modelIdentifier=description.coSimulation.modelIdentifier
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    inputs = [v.valueReference for v in description.modelVariables if v.causality == "input"]
    outputs = [v.valueReference for v in description.modelVariables if v.causality == "output" and v.type == "Real"]
    clock = 0

    def work() -> None:
        nonlocal clock
        for _ in range(STEPS):
            slave.setReal(inputs, [150.0 + 50.0 * np.sin(0.02 * clock), 90.0, 293.15, 2.0])
            slave.doStep(currentCommunicationPoint=float(clock), communicationStepSize=1.0)
            slave.getReal(outputs)
            clock += 1

    seconds = median_seconds(work)
    slave.terminate()
    slave.freeInstance()
    shutil.rmtree(folder, ignore_errors=True)
    return seconds


def main() -> None:
    fmu = Path(sys.argv[1] if len(sys.argv) > 1 else "out/fzg/fzg.fmu")
    gearbox = load_gearbox("fzg")
    losses, network, cycle = gearbox.losses(), gearbox.network(), reference_cycle(gearbox)
    rng = np.random.default_rng(0)

    def points(count: int) -> tuple[Any, Any, Any]:
        return rng.uniform(1, 6500, count), rng.uniform(1, 350, count), rng.uniform(-20, 200, (count, 7))

    one, many = points(1), points(400)

    def full_cycle() -> object:
        return network.simulate(cycle, losses=losses, initial=COLD_START)

    rows = [
        ("full model, one operating point", 1e3 * median_seconds(lambda: losses.power(*one), 200), "ms"),
        ("full model, per point in a batch of 400", 1e6 / 400 * median_seconds(lambda: losses.power(*many), 50), "us"),
        ("full model, 600 s cycle at 1 s", median_seconds(full_cycle), "s"),
        ("FMU in FMPy after loading, 600 plain steps of 1 s", fmpy_loop(fmu), "s"),
        ("FMU in our driver, 600 s cycle, loading included", median_seconds(lambda: drive_fmu(fmu, cycle)), "s"),
    ]
    for label, value, unit in rows:
        print(f"{label:52s} {value:8.3f} {unit}")


if __name__ == "__main__":
    main()
