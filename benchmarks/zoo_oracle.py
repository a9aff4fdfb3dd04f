"""Distribution of the distance to the nominal model and of both oracles over cases of the zoo.

Run:  python benchmarks/zoo_oracle.py N [--seed S] [--families F ...] [--out FOLDER]

Writes one line per case to ``zoo_oracle_S.jsonl`` as it goes; an interrupted run continues. At the end quantiles on the
screen, and histograms in ``zoo_oracle_S.png``.
"""

from __future__ import annotations

import argparse
import json
import resource
import time
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

from diagnosis.proof.zoo.case import GROUPS, ZooPlan
from diagnosis.proof.zoo.draw import draw_case
from diagnosis.proof.zoo.families import FAMILIES
from models.base.errors import InputError

FIGURES = {
    "distance_K": "distance to the nominal model [K]",
    "plant": "D_plant / 2 [nats]",
    "tool": "D_tool / 2 [nats]",
}
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("number", type=int)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--families", nargs="+", default=list(FAMILIES), choices=list(FAMILIES))
    parser.add_argument("--out", type=Path, default=Path())
    options = parser.parse_args()
    lines = options.out / f"zoo_oracle_{options.seed}.jsonl"
    done = [json.loads(line) for line in lines.read_text().splitlines()] if lines.exists() else []
    for k in range(len(done), options.number):
        done.append(_one_case(options.seed, k, options.families))
        with lines.open("a") as file:
            file.write(json.dumps(done[-1]) + "\n")
        print(json.dumps(done[-1]), flush=True)
    _summary(done)
    _picture(done, lines.with_suffix(".png"))


def _one_case(seed: int, k: int, families: list[str]) -> dict[str, Any]:
    """Case `k` of a seed: families in turn, machines, groups and effects at random, no control."""
    rng = np.random.default_rng([seed, k])
    family = families[k % len(families)]
    machine = str(rng.choice(FAMILIES[family].machines))
    group = str(rng.choice([name for name in GROUPS if name != "control"]))
    began = time.process_time()
    about = {"case": k, "family": family, "machine": machine, "group": group}
    try:
        case = draw_case(ZooPlan(family=family, machine=machine, seed=int(rng.integers(2**31)), group=group))
    except InputError as error:
        return about | {"refused": str(error)}
    first = case.nats_of_effects[0]
    return about | {
        "effects": [effect.name for effect in case.effects],
        "distance_K": round(case.distance_K, 3),
        "rejected": case.rejected,
        "plant": round(first.plant, 2),
        "tool": round(first.tool, 2),
        "cpu_s": round(time.process_time() - began, 1),
        "memory_GB": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6, 2),
    }


def _summary(done: list[dict[str, Any]]) -> None:
    drawn = [line for line in done if "tool" in line]
    rejected = sum(line["rejected"] for line in drawn)
    unseen = sum(line["tool"] < 3.0 for line in drawn)
    print(f"{len(drawn)} cases, {len(done) - len(drawn)} refused; plants rejected by their distance: {rejected} "
          f"({rejected / max(rejected + len(drawn), 1):.0%}); below 3 nats: {unseen}")  # fmt: skip
    for name in (*FIGURES, "cpu_s"):
        values = np.quantile([line[name] for line in drawn], QUANTILES)
        print(f"{name:12s}" + "".join(f"{q:>7.0%} {value:<10.3g}" for q, value in zip(QUANTILES, values, strict=True)))


def _picture(done: list[dict[str, Any]], path: Path) -> None:
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, len(FIGURES), figsize=(12, 3.2), layout="constrained")
    drawn = [line for line in done if "tool" in line]
    for ax, (name, label) in zip(axes, FIGURES.items(), strict=True):
        by_family = [[max(line[name], 1e-2) for line in drawn if line["family"] == family] for family in FAMILIES]
        bins = np.geomspace(0.1, 4.0, 25) if name == "distance_K" else np.geomspace(1e-2, 1e5, 36)
        ax.hist(by_family, bins=bins, stacked=True, label=list(FAMILIES))
        ax.set(xscale="log", xlabel=label, ylabel="cases")
    axes[-1].legend(fontsize=6)
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main()
