"""Every speed that the README claims, measured in one run on this machine: medians, and ratios to the full model.

python -m benchmarks.run out/fzg/fzg.fmu
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from builder.drive_cycle import COLD_START, reference_cycle
from builder.fmu_drive import drive_fmu, loaded_fmu
from models.gearbox import load_gearbox

RUNS = 5


def median_seconds(work: Callable[[], object], runs: int = RUNS) -> float:
    work()
    seconds = []
    for _ in range(runs):
        begin = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - begin)
    return statistics.median(seconds)


def main() -> None:
    fmu = Path(sys.argv[1] if len(sys.argv) > 1 else "out/fzg/fzg.fmu")
    gearbox = load_gearbox("fzg")
    losses, network, cycle = gearbox.losses(), gearbox.network(), reference_cycle(gearbox)
    rng = np.random.default_rng(0)

    def points(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return rng.uniform(1, 6500, count), rng.uniform(1, 350, count), rng.uniform(-20, 200, (count, 7))

    one, many = points(1), points(400)
    rows = [
        ("full model, one operating point", median_seconds(lambda: losses.power(*one), 200) * 1e3, "ms"),
        ("full model, per point in a batch of 400", median_seconds(lambda: losses.power(*many), 50) / 400 * 1e6, "us"),
        (
            "600 s cycle at 1 s, full model",
            median_seconds(lambda: network.simulate(cycle, losses=losses, initial=COLD_START)),
            "s",
        ),
    ]
    with loaded_fmu(fmu) as loaded:
        rows.append(
            (
                "600 s cycle at 1 s, FMU in FMPy, loaded",
                median_seconds(lambda: loaded.drive(cycle, initial=COLD_START)),
                "s",
            )
        )
    rows.append(
        (
            "600 s cycle at 1 s, FMU in FMPy, with loading",
            median_seconds(lambda: drive_fmu(fmu, cycle, initial=COLD_START)),
            "s",
        )
    )
    width = max(len(row[0]) for row in rows)
    for label, value, unit in rows:
        print(f"{label:{width}s}  {value:8.3f} {unit}")


if __name__ == "__main__":
    main()
