"""Cases of the zoo for the verb ``conceal``."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from builder.base import console
from builder.base.progress import LOADING, progress


def conceal_in_zoo(
    *,
    seed: int,
    output: Path,
    truth: Path | None,
    cases: int | None,
    machine: str | None,
    families: str | None,
    group: str | None,
    baselines: int,
    session_deviation: float | None,
) -> None:
    """Draw and write cases of the zoo; arguments are the options of the verb.

    Raises
    ------
    InputError
        If a group or family is not known, a definition cannot be split, or a folder cannot be written to.
    """
    with progress(LOADING):
        from diagnosis.proof.cases.case_files import staged_folders
        from diagnosis.proof.zoo.conceal_zoo import conceal_zoo, random_zoo_plans, zoo_plans

    names = None if families is None else [name.strip() for name in families.split(",")]
    number = 1 if cases is None else cases
    if group is None:
        plans = random_zoo_plans(seed, number, families=names, machine=machine)
    else:
        plans = zoo_plans(seed, {group: number}, families=names, machine=machine)
    recordings, truth = output / "recordings", truth or output / "truth"
    with (
        staged_folders(recordings, truth) as (stage, truth_stage),
        progress("concealing") as told,
    ):
        made = conceal_zoo(plans, recordings=stage, truth=truth_stage, flat=cases is None, baselines=baselines,
                           session_deviation=session_deviation, progress=partial(told, "concealing"))  # fmt: skip
    for name in made:
        console.out.print(f"wrote {recordings / ('' if cases is None else name)}, {truth / name}.json")
