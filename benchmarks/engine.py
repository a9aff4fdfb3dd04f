"""What the inference engine costs: CPU time of every stage, and memory.

python -m benchmarks.engine [contract] [control] [week] [turbine RECORDING]

Contract: 26 h of the FZG rig at 10 s with 7 channels, a concealed effect; ``control`` is the same with nothing
concealed, ``week`` 168 h. Every size runs in one process, so other work on the machine changes CPU times little.
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
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.diagnose import make_recordings
from diagnosis.decision.infer import infer
from diagnosis.decision.scanned import scan_at
from diagnosis.decision.settings import Settings
from diagnosis.engine.calibration import calibrate_with_error
from diagnosis.engine.families import candidates_of
from diagnosis.engine.fit import calibrate
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.recordings.read import read_recordings
from models.assembly.gearbox import load_gearbox

CONTRACT_H, WEEK_H, STEP_S = (20.0, 6.0), (168.0,), 10.0
TARGET_S, TARGET_GB, TARGET_WEEK_GB = 30.0, 2.0, 3.0


@dataclass
class Clock:
    """CPU time of stages, [s]."""

    stages: dict[str, float] = field(default_factory=dict)
    _since: float = field(default_factory=time.process_time)
    _of: str = ""

    def mark(self, name: str) -> None:
        """End a stage."""
        now = time.process_time()
        self.stages[name] = self.stages.get(name, 0.0) + now - self._since
        self._since = now

    def told(self, message: str, *_: int) -> None:
        """Progress of the inference: its first word names the stage that begins."""
        if self._of:
            self.mark(self._of)
        self._of = message.split()[0]

    def end(self) -> None:
        """End the last stage that was told."""
        self.mark(self._of)


def stages_of(gearbox: str, recordings: Sequence[str]) -> dict[str, float]:
    """All stages from recordings to a posterior, [s]."""
    machine = load_gearbox(gearbox)
    read, clock = read_recordings(recordings, machine.network()), Clock()
    setup, experiment, *_ = prepare_experiment(machine, read)
    clock.mark("preparation")
    calibration = calibrate_with_error(experiment, calibrate(experiment))
    clock.mark("calibration")
    candidates = candidates_of(setup, experiment)
    clock.mark("candidates placed")
    found = scan_at(calibration, candidates)
    clock.mark("scanning")
    infer(calibration, found, Settings(), progress=clock.told)
    clock.end()
    return clock.stages


def measured(gearbox: str, recordings: Sequence[str]) -> tuple[dict[str, float], float]:
    """Stages [s] and peak memory [GB] in a fresh process."""
    command = [sys.executable, "-m", "benchmarks.engine", "--one", gearbox, *recordings]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    stages, peak = json.loads(text.splitlines()[-1])
    return stages, peak


def show(name: str, gearbox: str, recordings: Sequence[str]) -> None:
    """Print one table."""
    stages, peak = measured(gearbox, recordings)
    whole = sum(stages.values())
    print(f"\n{name}: CPU time [s]\n{'':28}{'':8}{'share':>8}")
    for stage, seconds in stages.items():
        print(f"{stage:28}{seconds:8.2f}{seconds / whole:8.0%}")
    print(f"{'sum':28}{whole:8.2f}{'':8}   target {TARGET_S:.0f} s for contract and control")
    target = TARGET_WEEK_GB if name == "week" else TARGET_GB
    print(f"{'peak memory':28}{peak:8.2f} GB, target {target:.0f} GB", flush=True)


def main() -> None:
    """Run the sizes that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sizes", nargs="*", default=["contract"], help="contract, control, week, turbine RECORDING")
    parser.add_argument("--one", action="store_true", help="GEARBOX RECORDING..., for this script itself")
    given = parser.parse_args()
    if given.one:
        gearbox, *recordings = given.sizes
        stages = stages_of(gearbox, recordings)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e9 if sys.platform == "darwin" else 1e6)
        print(json.dumps([stages, peak]))
        return
    sizes = list(given.sizes)
    with tempfile.TemporaryDirectory() as folder:
        while sizes:
            size = sizes.pop(0)
            if size == "turbine":
                show("turbine", "la_haute_borne", [sizes.pop(0)])
                continue
            room = Path(folder) / size
            room.mkdir()
            hours = WEEK_H if size == "week" else CONTRACT_H
            made = make_recordings(room, hours, STEP_S, effect=None if size == "control" else "windage")
            show(size, "fzg", [str(path) for path in made])


if __name__ == "__main__":
    main()
