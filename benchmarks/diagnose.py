"""What a diagnosis costs: wall time, processor time and memory, over size of the recordings and of the catalogue.

python -m benchmarks.diagnose [contract] [sizes] [candidates]

The recordings come from the plant of ``conceal`` with a concealed effect, so that every stage of the search runs.
"""

from __future__ import annotations

import argparse
import itertools
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import psutil

from diagnosis.diagnose_recordings import diagnose
from diagnosis.proof.cases.case_files import DECIMALS
from diagnosis.proof.cases.conceal import draw_case
from diagnosis.proof.cases.concealed_case import Plan
from diagnosis.proof.plant.cycles import Programme, ambient, programmes
from diagnosis.proof.plant.instruments import record
from diagnosis.proof.plant.plant import Plant
from diagnosis.proof.plant.plant_run import run_plant
from diagnosis.recordings.read import read_by_role
from diagnosis.report.write import write_files
from models.assembly.gearbox import load_gearbox
from models.mechanisms import CATALOGUE

EFFECT, SEED = "cooler_thermostat", 1
ROW_S = 10.0  # of the plant
NOISE_K, STEP_K, LOSS_NOISE = 0.2, 0.1, 0.02
# (name, hours, seconds between rows)
SIZES = (("6 h at 10 s", 6.0, 10.0), ("26 h at 10 s", 26.0, 10.0), ("3 days at 10 s", 72.0, 10.0),
         ("a week at 10 s", 168.0, 10.0), ("a week at 1 s", 168.0, 1.0))  # fmt: skip
SHARES = (0.25, 0.5, 1.0)
TARGET_S, TARGET_BYTES = 60.0, 2e9  # of the contract's size on two cores
SAMPLED_S = 0.5  # looking at the memory of four processes ten times a second slowed them by a twentieth
HEAD = (("rows", 8), ("mechanisms", 10), ("wall s", 8), ("CPU s", 8), ("peak GB", 8), ("load", 6))


@dataclass(frozen=True, kw_only=True)
class Cost:
    """What one diagnosis took; memory is that of all its processes together, pages they share counted once."""

    rows: int
    mechanisms: int
    wall_s: float
    cpu_s: float
    peak_bytes: float
    load: float
    verdict: str
    stages: dict[str, float]


def make_recordings(folder: Path, lengths_h: Sequence[float], step_s: float, effect: str | None = EFFECT) -> list[Path]:
    """One recording per length, of one gearbox with a concealed effect; the plant's rows, or straight lines between."""
    plant = Plant(load_gearbox("fzg"))
    plan = Plan(group="single", effects=(effect,), strength=1.0) if effect else Plan(group="control", kind="clean")
    case = draw_case(plant, plan, seed=(SEED, 0), name="benchmark")
    rng = np.random.default_rng(SEED)
    runs = []
    for hours in lengths_h:
        rows, speed, torque = round(3600.0 * hours / ROW_S), np.zeros(0), np.zeros(0)
        while len(speed) < rows:
            order = [p for p in programmes(plant.gearbox, rng) if not p.unrecorded]
            for programme in [order[1], *order] if rows < len(order[0]) else order:
                speed = np.append(speed, programme.inputs["speed"])
                torque = np.append(torque, programme.inputs["torque"])
        air = ambient(rows, rng)
        inputs = {"speed": speed[:rows], "torque": torque[:rows], "T_ambient": air,
                  "air_speed": np.full(rows, plant.gearbox.ambient.air_speed_m_s)}  # fmt: skip
        start = dict.fromkeys(plant.anatomy.nodes, float(air[0]))
        programme = Programme(name=f"run_{len(runs) + 1}", inputs=inputs, start=start)
        runs.append(replace(case.runs[0], programme=programme, effects=case.physics))
    paths = []
    for run, outcome in zip(runs, run_plant(plant, runs), strict=True):
        columns = record(plant, run, outcome, case.instruments, (), None)
        at = np.arange(0.0, columns["time_s"][-1] + 0.5 * step_s, step_s)
        table = pd.DataFrame({name: np.interp(at, columns["time_s"], values) for name, values in columns.items()})
        for name in table.columns:
            if name == "P_loss_W":
                table[name] *= 1.0 + LOSS_NOISE * rng.standard_normal(len(at))
            elif name.startswith("T_") and name != "T_ambient_degC":
                table[name] = STEP_K * np.round((table[name] + NOISE_K * rng.standard_normal(len(at))) / STEP_K)
            table[name] = table[name].round(DECIMALS.get(name, 1))
        paths.append(folder / f"{run.programme.name}.csv")
        table.to_csv(paths[-1], index=False)
    return paths


def once(train: Sequence[str], holdout: Sequence[str], share: float) -> None:
    """Diagnose as the verb does, in a separate process; print time and memory as JSON."""
    marks = [("start and reading", time.perf_counter())]
    gearbox = load_gearbox("fzg")
    names = sorted(CATALOGUE)
    kept = {EFFECT, *names[:: round(1.0 / share)]}
    catalogue = {name: CATALOGUE[name] for name in names if name in kept}
    learnt, judged, _ = read_by_role(train, holdout, (), gearbox.network())
    found = diagnose(learnt, gearbox, holdout=judged, catalogue=catalogue,
                     progress=lambda line, *_: marks.append((line, time.perf_counter())))  # fmt: skip
    marks.append(("writing the report", time.perf_counter()))
    with tempfile.TemporaryDirectory() as folder:
        write_files(found, gearbox, [*learnt, *judged], Path(folder))
    marks.append(("", time.perf_counter()))
    stages: dict[str, float] = {}
    for (name, begin), (_, end) in itertools.pairwise(marks):
        stages[name] = stages.get(name, 0.0) + end - begin
    rows = sum(len(r.time) for r in (*learnt, *judged))
    json.dump({"rows": rows, "mechanisms": len(catalogue), "verdict": found.verdict, "stages": stages}, sys.stdout)


def measured(train: Sequence[Path], holdout: Sequence[Path], *, share: float = 1.0) -> Cost:
    """Run a diagnosis in a separate process and watch it from outside."""
    given = {"train": [*map(str, train)], "holdout": [*map(str, holdout)], "share": share}
    code = f"from benchmarks.diagnose import once; once(**{given!r})"
    load, begin = psutil.getloadavg()[0], time.perf_counter()
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    cpu: dict[int, float] = {}
    peak = 0.0
    while process.poll() is None:
        total = 0.0
        try:
            root = psutil.Process(process.pid)
            for one in (root, *root.children(recursive=True)):
                times = one.cpu_times()
                cpu[one.pid] = times.user + times.system
                total += getattr(one.memory_full_info(), "pss", one.memory_info().rss)
        except psutil.Error:
            pass  # it ended between two looks
        peak = max(peak, total)
        time.sleep(SAMPLED_S)
    wall = time.perf_counter() - begin
    assert process.stdout is not None  # noqa: S101 - a pipe was asked for
    text = process.stdout.read()
    if process.returncode != 0:
        raise SystemExit(f"the diagnosis ended with status {process.returncode}")
    return Cost(wall_s=wall, cpu_s=sum(cpu.values()), peak_bytes=peak, load=load, **json.loads(text))


def exponent(x: Sequence[float], y: Sequence[float]) -> float:
    """Slope of the straight line through the logarithms."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def show(title: str, costs: Sequence[tuple[str, Cost]]) -> None:
    print(f"\n{title}")
    head = " ".join(f"{name:>{width}s}" for name, width in HEAD)
    print(f"{'':22s} {head}  verdict")
    for name, c in costs:
        print(f"{name:22s} {c.rows:8d} {c.mechanisms:10d} {c.wall_s:8.1f} {c.cpu_s:8.1f} {c.peak_bytes / 1e9:8.2f} "
              f"{c.load:6.1f}  {c.verdict}")  # fmt: skip
    for name, c in costs:
        parts = ", ".join(f"{stage} {seconds:.1f}" for stage, seconds in c.stages.items() if seconds >= 0.05)
        print(f"  {name}: wall s of {parts}")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("what", nargs="*", default=["contract", "sizes", "candidates"])
    parser.add_argument("--sizes", type=int, default=len(SIZES), help="how many of the sizes, smallest first")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if {"contract", "candidates"} & set(given.what):
            paths = make_recordings(folder, (16.0, 2.0, 2.0, 2.0, 4.0), 10.0)
            shares = SHARES if "candidates" in given.what else (1.0,)
            costs = [measured(paths[:3], paths[3:], share=share) for share in shares]
            rows = [(f"{share:.2f} of the catalogue", c) for share, c in zip(shares, costs, strict=True)]
            show("Five recordings, 26 h together at 10 s, 7 channels", rows)
            whole = costs[-1]
            print(f"targets: {whole.wall_s:.1f} of {TARGET_S:.0f} s, {whole.peak_bytes / 1e9:.2f} of "
                  f"{TARGET_BYTES / 1e9:.0f} GB")  # fmt: skip
            if len(costs) > 1:
                counts = [c.mechanisms for c in costs]
                print(f"CPU time ~ mechanisms^{exponent(counts, [c.cpu_s for c in costs]):.2f}")
        if "sizes" in given.what:
            rows = []
            for label, hours, step_s in SIZES[: given.sizes]:
                paths = make_recordings(folder, (0.75 * hours, 0.25 * hours), step_s)
                rows.append((label, measured(paths[:1], paths[1:])))
            show("One recording to learn from, one to judge by", rows)
            even = [(hours, c) for (_, hours, step_s), (_, c) in zip(SIZES, rows, strict=False) if step_s == ROW_S]
            if len(even) > 1:
                hours = [h for h, _ in even]
                print(f"at 10 s: CPU time ~ hours^{exponent(hours, [c.cpu_s for _, c in even]):.2f}, "
                      f"memory ~ hours^{exponent(hours, [c.peak_bytes for _, c in even]):.2f}")  # fmt: skip


if __name__ == "__main__":
    main()
