"""What the inference engine costs.

python -m benchmarks.engine [contract] [control] [week] [turbine RECORDING] [--jobs 1]

Contract: 26 h of the FZG rig at 10 s with 7 channels; preparation, calibration, Gram matrix of all candidates of the
catalogue with 300 further columns, and five refits. ``control`` is the same with nothing concealed.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from benchmarks.diagnose import make_recordings
from diagnosis.engine.candidates import refit_all, scan
from diagnosis.engine.families import candidates_of
from diagnosis.engine.fit import Linearised, calibrate
from diagnosis.engine.metric import Metric
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.recordings.read import read_recordings
from models.assembly.gearbox import load_gearbox
from models.mechanisms import CATALOGUE

FURTHER, REFITS = 300, 5
LONGEST_KNOT = 60  # intervals over which a further column keeps its value


@dataclass
class Clock:
    """Wall time of stages, [s]."""

    stages: dict[str, float] = field(default_factory=dict)
    _since: float = field(default_factory=time.perf_counter)

    def mark(self, name: str) -> None:
        """End a stage."""
        now = time.perf_counter()
        self.stages[name] = now - self._since
        self._since = now


def stages_of(gearbox: str, recordings: Sequence[str], jobs: int) -> dict[str, float]:
    """Wall time of all stages, [s]."""
    machine = load_gearbox(gearbox)
    read, clock = read_recordings(recordings, machine.network()), Clock()
    setup, experiment = prepare_experiment(machine, read)
    clock.mark("preparation")
    fit = calibrate(experiment)
    clock.mark("calibration")
    candidates = candidates_of(setup, experiment, CATALOGUE)
    clock.mark("candidates placed")
    rng, parts = np.random.default_rng(0), experiment.machine.model.n
    further = []
    for part in fit.parts:
        count = len(part.point.trajectory.piece.steps)
        knots = rng.standard_normal((count // LONGEST_KNOT + 1, parts, FURTHER))
        into = np.repeat(knots, LONGEST_KNOT, axis=0)[:count] * setup.loss_W * 0.01
        further.append(part.filter(part.point.heated(into, np.zeros((count, FURTHER)))))
    nothing = tuple(np.zeros((len(N), 0)) for N in further)
    metric = Metric(sessions=(tuple(range(len(further))),), shared=tuple(further), own=nothing)
    experiment = replace(fit.experiment, metric=metric)
    fit = replace(fit, experiment=experiment, linearised=Linearised.of(fit.parts, metric))
    clock.mark("-")
    found = scan(fit, candidates)
    clock.mark("columns and Gram matrix")
    given = found.gram.given(found.unknowns).given(found.further)
    singles = found.singles(given)
    found.pairs(given)
    clock.mark("all singles and pairs")
    order = np.argsort(-singles.log_bayes)[:REFITS]
    chosen = [(found.candidates[k], found.best[k], float(singles.value[k])) for k in order]
    refit_all(fit, chosen, jobs=jobs)
    clock.mark("five refits")
    del clock.stages["-"]
    return clock.stages


def measured(gearbox: str, recordings: Sequence[str], jobs: int) -> tuple[dict[str, float], float]:
    """Stages [s] and peak memory [GB] in a fresh process (of that process alone)."""
    command = [sys.executable, "-m", "benchmarks.engine", "--one", gearbox, *recordings, "--jobs", str(jobs)]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    stages, peak = json.loads(text.splitlines()[-1])
    return stages, peak


def show(name: str, gearbox: str, recordings: Sequence[str], jobs: int) -> None:
    """Print one table."""
    stages, peak_GB = measured(gearbox, recordings, jobs)
    whole = sum(stages.values())
    print(f"\n{name}: wall time with {jobs} process(es) [s]")
    for stage, seconds in stages.items():
        print(f"{stage:28}{seconds:8.2f}{seconds / whole:8.0%}")
    print(f"{'sum':28}{whole:8.2f}\n{'peak memory of one process':28}{peak_GB:8.2f} GB", flush=True)


def main() -> None:
    """Run the sizes that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sizes", nargs="*", default=["contract"], help="contract, control, week, turbine RECORDING")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--one", action="store_true", help="GEARBOX RECORDING..., for this script itself")
    given = parser.parse_args()
    if given.one:
        gearbox, *recordings = given.sizes
        stages = stages_of(gearbox, recordings, given.jobs)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e9 if sys.platform == "darwin" else 1e6)
        print(json.dumps([stages, peak]))
        return
    sizes = list(given.sizes)
    with tempfile.TemporaryDirectory() as folder:
        while sizes:
            size = sizes.pop(0)
            if size == "turbine":
                show("turbine", "la_haute_borne", [sizes.pop(0)], given.jobs)
                continue
            room = Path(folder) / size
            room.mkdir()
            hours = (168.0,) if size == "week" else (20.0, 6.0)
            made = make_recordings(room, hours, 10.0, effect=None if size == "control" else "windage")
            show(size, "fzg", [str(path) for path in made], given.jobs)


if __name__ == "__main__":
    main()
