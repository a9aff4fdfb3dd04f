"""What each class and each group of model error is good for: the scan of many cases, each time without one of them.

Run:  python -m benchmarks.ablation scan RECORDINGS [--gearbox NAME] [--jobs 2] --output FILE
      python -m benchmarks.ablation report FILE TRUTH [FILE TRUTH ...]

``scan`` calibrates every case of a folder (a folder each; baselines are not read) and judges all candidates from one
Gram matrix with model error as it is, and with parts of it left out; a line of JSON per case, and an interrupted run
continues. ``report`` compares with the truths. Nothing is calibrated again or fitted, and no channel is set apart.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from diagnosis.decision.scanned import scan_at, scan_in_classes
from diagnosis.decision.settings import Settings
from diagnosis.engine.calibration import calibrate_with_error
from diagnosis.engine.families import candidates_of
from diagnosis.engine.fit import calibrate
from diagnosis.engine.learnt import ErrorClass, error_classes
from diagnosis.engine.model_error.groups import GROUPS
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.proof.cases.case_files import DEFINITION
from diagnosis.proof.scoring.truth import CONTROL, Truth, read_truths
from diagnosis.recordings.read import read_recordings
from diagnosis.recordings.recording import Recording
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.parallel import iterate_parallel

AS_IT_IS = "as it is"
FINE = {"law_deg5", "loss_own", "lag", "hours"}
RATE = Settings().false_alarm_rate


def variants() -> dict[str, Sequence[ErrorClass]]:
    """Classes of model error with parts of them left out, by what is left out."""
    every = error_classes()

    def without(groups: set[str]) -> Sequence[ErrorClass]:
        return [replace(one, amplitudes={name: a for name, a in one.amplitudes.items() if name not in groups})
                for one in every]  # fmt: skip

    return {
        AS_IT_IS: every,
        **{f"without {group}": without({group}) for group in GROUPS},
        "without the fine groups": without(FINE),
        **{f"without the class {one.name}": [other for other in every if other != one] for one in every},
        "none alone": every[:1],
        "full alone": every[-1:],
        "none, splits, full": [one for one in every if one.name in ("none", "splits", "full")],
    }


def read_case(folder: Path, gearbox: str) -> tuple[Gearbox, Sequence[Recording], Sequence[Recording]]:
    """The machine of a case, with a definition of its own or that of the set, and what is learnt from and held out."""
    own = folder / DEFINITION
    machine = load_gearbox(own if own.is_file() else gearbox)
    train, held = (
        read_recordings(sorted(folder.glob(f"{kind}_*.csv*")), machine.network()) for kind in ("train", "hold")
    )
    return machine, train, held


def scan_case(folder: Path, gearbox: str) -> dict[str, Any]:
    """Judge a case with every variant of model error.

    Returns
    -------
    dict
        ``case``, and for every variant ``nothing`` (log evidence of the healthy machine), ``log_e``, ``threshold`` and
        ``names`` (evidence and prior of the best candidate of each mechanism), all in nat
    """
    machine, train, held = read_case(folder, gearbox)
    setup, experiment = prepare_experiment(machine, train, held)
    calibration = calibrate_with_error(experiment, calibrate(experiment))
    found = scan_at(calibration, candidates_of(setup, experiment))
    result: dict[str, Any] = {"case": folder.name}
    for name, classes in variants().items():
        scanned = scan_in_classes(calibration, found, classes)
        nothing = max(float(np.log(one.error_class.prior)) + one.over.log_evidence for one in scanned.classes)
        scanned, threshold = scanned.to_its_best(RATE)
        names: dict[str, float] = {}
        for candidate, weight in zip(scanned.candidates, scanned.weights.tolist(), strict=True):
            names[candidate.mechanism] = max(weight, names.get(candidate.mechanism, -np.inf))
        result[name] = {"nothing": nothing, "log_e": scanned.log_e, "threshold": threshold, "names": names}
    return result


def scan_cases(recordings: Path, gearbox: str, jobs: int, output: Path) -> None:
    done = {case["case"] for case in read(output)} if output.exists() else set()
    folders = [path for path in sorted(recordings.iterdir()) if path.is_dir() and path.name not in done]
    output.parent.mkdir(parents=True, exist_ok=True)
    for number, found in enumerate(iterate_parallel(scan_case, [(path, gearbox) for path in folders], jobs=jobs), 1):
        with output.open("a", encoding="utf-8") as file:
            file.write(json.dumps(found) + "\n")
        print(f"{found['case']}: {number} of {len(folders)}", flush=True)


def read(file: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]


def report(pairs: Sequence[tuple[Path, Path]]) -> None:
    """Print a row for every variant."""
    cases: list[tuple[dict[str, Any], Truth]] = []
    for file, path in pairs:
        truths = read_truths(path)
        cases += [(case, truths[case["case"]]) for case in read(file)]
    healthy = [case for case, truth in cases if truth.group == CONTROL]
    named = [(case, {effect.name for effect in truth.effects} & set(case[AS_IT_IS]["names"])) for case, truth in cases]
    named = [(case, names) for case, names in named if names]
    others = [case for case, truth in cases if truth.group != CONTROL]
    table = Table(
        "model error", "healthy machines above the threshold", "largest excess", "effects above it",
        "true name first", "nat of it, mean", "ahead of the best wrong one, mean", "nat of nothing, mean change",
        title=f"{len(healthy)} healthy machines, {len(others)} with effects, {len(named)} of them with a candidate",
    )  # fmt: skip
    for variant in variants():
        excess = np.array([case[variant]["log_e"] - case[variant]["threshold"] for case in healthy])
        found = [case[variant]["log_e"] > case[variant]["threshold"] for case in others]
        own, ahead = np.array([_weights(case[variant]["names"], names) for case, names in named]).T
        change = [case[variant]["nothing"] - case[AS_IT_IS]["nothing"] for case, _ in cases]
        table.add_row(variant, str(int((excess > 0.0).sum())), f"{excess.max(initial=-np.inf):.0f}", str(sum(found)),
                      str(int((ahead > 0.0).sum())), f"{own.mean():.0f}", f"{ahead.mean():.1f}",
                      f"{np.mean(change):.1f}")  # fmt: skip
    Console(width=240).print(table)


def _weights(names: Mapping[str, float], right: set[str]) -> tuple[float, float]:
    """Evidence and prior of the best right name; the same less that of the best wrong one, parameters left out."""
    own = max(names[name] for name in right)
    return own, own - max(value for name, value in names.items() if name not in (*right, "parameter"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    scanning = verbs.add_parser("scan")
    scanning.add_argument("recordings", type=Path)
    scanning.add_argument("--gearbox", default="fzg")
    scanning.add_argument("--jobs", type=int, default=1)
    scanning.add_argument("--output", type=Path, required=True)
    reporting = verbs.add_parser("report")
    reporting.add_argument("pairs", type=Path, nargs="+", metavar="FILE TRUTH")
    given = parser.parse_args()
    if given.verb == "scan":
        scan_cases(given.recordings, given.gearbox, given.jobs, given.output)
    else:
        report(list(zip(given.pairs[::2], given.pairs[1::2], strict=True)))


if __name__ == "__main__":
    main()
