"""Every speed that the README claims, measured in one run on this machine: medians of several runs.

python -m benchmarks.run out/fzg/fzg.fmu [out/fzg/fzg_native.fmu ...]
"""

from __future__ import annotations

import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

import fmu_src as native_sources
from builder.drive.driver import drive_fmu
from builder.fmi.reference_cycle import COLD_START, reference_cycle
from models.assembly.gearbox import load_gearbox

STEPS, C_STEPS = 600, 64_800


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


def from_c(fmu: Path) -> list[tuple[str, float, str]]:
    """Full steps of a native FMU from C; nothing where there is no C compiler or no binary for this machine."""
    compiler, description = shutil.which("cc"), read_model_description(fmu)
    binary = f"binaries/linux64/{description.coSimulation.modelIdentifier}.so"
    with zipfile.ZipFile(fmu) as archive, tempfile.TemporaryDirectory() as folder:
        if compiler is None or description.coSimulation.needsExecutionTool or binary not in archive.namelist():
            return []
        archive.extractall(folder)
        host = Path(folder) / "native_steps"
        source = Path(__file__).with_name("native_steps.c")
        headers = Path(native_sources.__file__).parent / "native"
        subprocess.run([compiler, "-O2", "-o", host, source, f"-I{headers}", "-ldl", "-lm"], check=True)
        reals = [v for v in description.modelVariables if v.type == "Real"]
        of = {cause: ",".join(str(v.valueReference) for v in reals if v.causality == cause)
              for cause in ("input", "output")}  # fmt: skip
        rows = []
        for vary, kind in ((0, "constant"), (1, "changing")):
            command = [
                host,
                Path(folder) / binary,
                description.guid,
                str(C_STEPS),
                str(vary),
                of["input"],
                of["output"],
            ]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            start, stepping = map(float, done.stdout.split())
            if not vary:
                rows.append((f"{fmu.name} from C, instantiate and initialise", 1e6 * start, "us"))
            rows += [(f"{fmu.name} from C, full step, {kind} inputs", 1e6 * stepping / C_STEPS, "us"),
                     (f"{fmu.name} from C, 18 h at 1 s, {kind} inputs", stepping, "s")]  # fmt: skip
        return rows


def main() -> None:
    fmus = [Path(name) for name in sys.argv[1:] or ["out/fzg/fzg.fmu"]]
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
    ]
    for fmu in fmus:
        seconds = fmpy_loop(fmu)
        rows += [
            (f"{fmu.name} in FMPy after loading, {STEPS} plain steps of 1 s", seconds, "s"),
            (
                f"{fmu.name} in our driver, 600 s cycle, loading included",
                median_seconds(partial(drive_fmu, fmu, cycle)),
                "s",
            ),
            *from_c(fmu),
        ]
    for label, value, unit in rows:
        print(f"{label:58s} {value:8.3f} {unit}")


if __name__ == "__main__":
    main()
