"""Amplitudes of model error, learnt on healthy machines of the zoo by pooled type-II maximum likelihood.

Run:  python -m benchmarks.learn_model_error draw CASES --seed S --out FOLDER [--families F ...]
      python -m benchmarks.learn_model_error learn FOLDER [--leave-out FAMILY] [--sweeps 3]

``draw`` simulates healthy cases, families in turn, calibrates each with model error and keeps its Gram matrix as
``<seed>_<case>_<family>_<machine>.npz``; an interrupted run continues. ``learn`` starts from the class full and climbs
the sum of the log evidences along one group's log amplitude after the other; it prints the amplitudes and, for every
family, used or left out, the log evidence gained over no model error and over the classes as they are.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from diagnosis.engine.calibration import calibrate_with_error
from diagnosis.engine.fit import calibrate
from diagnosis.engine.gram import Given, gram_of, whitened_base
from diagnosis.engine.learnt import error_classes, widest_class
from diagnosis.engine.model_error import ModelError
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.proof.cases.case_files import write_case
from diagnosis.proof.zoo.case import ZooPlan
from diagnosis.proof.zoo.conceal_zoo import files_of_case
from diagnosis.proof.zoo.draw import draw_case
from diagnosis.proof.zoo.families import FAMILIES
from diagnosis.recordings.read import read_recordings
from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError
from models.base.types import Array

FACTORS = (3.0, 1.5)  # by which an amplitude is tried, larger and smaller
LEAST_GAIN = 0.1  # nats


@dataclass(frozen=True, kw_only=True, eq=False)
class Healthy:
    """What the readings of a healthy machine have to do with model error, unknowns of the calibration marginalised."""

    family: str
    given: Given
    groups: tuple[str, ...]

    def log_evidence(self, amplitudes: Mapping[str, float]) -> float:
        values = np.array([amplitudes.get(group, 0.0) for group in self.groups])
        return self.given.given(range(len(values)), values).log_evidence


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    draw = verbs.add_parser("draw")
    draw.add_argument("cases", type=int)
    draw.add_argument("--seed", type=int, default=1)
    draw.add_argument("--out", type=Path, required=True)
    draw.add_argument("--families", nargs="+", default=list(FAMILIES), choices=list(FAMILIES))
    learn = verbs.add_parser("learn")
    learn.add_argument("folder", type=Path)
    learn.add_argument("--leave-out", choices=list(FAMILIES))
    learn.add_argument("--sweeps", type=int, default=3)
    options = parser.parse_args()
    if options.verb == "learn":
        report(options.folder, options.leave_out, options.sweeps)
        return
    options.out.mkdir(parents=True, exist_ok=True)
    for case in range(options.cases):
        family = options.families[case % len(options.families)]
        machines = FAMILIES[family].machines
        machine = machines[case // len(options.families) % len(machines)]
        file = options.out / f"{options.seed}_{case}_{family}_{machine}.npz"
        if not file.exists():
            keep(family, machine, options.seed * 1000 + case, file)


def keep(family: str, machine: str, seed: int, file: Path) -> None:
    """Draw a healthy case and write what its readings have to do with model error."""
    gearbox = load_gearbox(machine)
    try:
        case = draw_case(ZooPlan(family=family, machine=machine, seed=seed, group="control", kind="clean"))
    except InputError as error:
        print(f"{file.stem}: {error}")
        return
    with tempfile.TemporaryDirectory() as folder:
        write_case(files_of_case(case), Path(folder), None)
        paths = [str(path) for path in sorted(Path(folder).glob("train_*.csv.gz"))]
        recordings = read_recordings(paths, gearbox.network())
    _, experiment = prepare_experiment(gearbox, recordings, recordings)
    found = calibrate_with_error(experiment, calibrate(experiment))
    fit, error = found.fit, ModelError.of(experiment)
    gram = gram_of(fit.parts, whitened_base(fit.parts, fit.z, [error.whitened(part) for part in fit.parts]))
    count = len(fit.z)
    given = gram.given(range(count))
    kept = [0, *range(1 + count, len(given.matrix))]
    np.savez_compressed(file, matrix=given.matrix[np.ix_(kept, kept)], log_determinant=given.log_determinant,
                        groups=np.array(error.groups), family=family)  # fmt: skip
    evidence = "  ".join(f"{name} {value:.1f}" for name, value in found.evidence.items())
    print(f"{file.stem}: {len(kept) - 1} unknowns, log evidence of the classes {evidence}", flush=True)


def load(folder: Path) -> list[Healthy]:
    found = []
    for file in sorted(folder.glob("*.npz")):
        with np.load(file) as data:
            given = Given(matrix=data["matrix"], log_determinant=float(data["log_determinant"]))
            found.append(Healthy(family=str(data["family"]), given=given, groups=tuple(map(str, data["groups"]))))
    return found


def learnt(cases: Sequence[Healthy], start: Mapping[str, float], sweeps: int) -> dict[str, float]:
    """Amplitudes of greatest pooled log evidence, climbed to one group after the other."""
    best = dict(start)
    reached = sum(case.log_evidence(best) for case in cases)
    for sweep in range(sweeps):
        before, factor = reached, FACTORS[min(sweep, len(FACTORS) - 1)]
        for group in best:
            for way in (factor, 1.0 / factor):
                while True:
                    tried = best | {group: best[group] * way}
                    value = sum(case.log_evidence(tried) for case in cases)
                    if value < reached + LEAST_GAIN:
                        break
                    best, reached = tried, value
        print(f"sweep {sweep + 1}: log evidence {reached - before:+.1f}", flush=True)
    return best


def report(folder: Path, left_out: str | None, sweeps: int) -> None:
    cases, widest = load(folder), widest_class()
    found = learnt([case for case in cases if case.family != left_out], widest.amplitudes, sweeps)
    print("group      as it is    learnt")
    for group, value in found.items():
        print(f"{group:<10} {widest.amplitudes[group]:8.4f}  {value:8.4f}")
    print("family       cases  nats per case over none: classes as they are    FULL   learnt")
    for family in sorted({case.family for case in cases}):
        mine = [case for case in cases if case.family == family]
        none = np.array([case.log_evidence({}) for case in mine])
        mixture = np.array([_mixture(case) for case in mine])
        full, new = (np.array([case.log_evidence(a) for case in mine]) for a in (widest.amplitudes, found))
        mark = " (left out)" if family == left_out else ""
        print(f"{family:<12} {len(mine):5} {np.mean(mixture - none):43.1f} {np.mean(full - none):7.1f} "
              f"{np.mean(new - none):8.1f}{mark}")  # fmt: skip


def _mixture(case: Healthy) -> Array:
    """Log evidence over all classes."""
    each = [np.log(one.prior) + case.log_evidence(one.amplitudes) for one in error_classes()]
    return np.asarray(np.logaddexp.reduce(each))


if __name__ == "__main__":
    main()
