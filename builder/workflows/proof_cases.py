"""Cases of a proof: recordings and truth from a seed, and the evidence that the recordings hold."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from diagnosis.proof.cases.case_files import case_names, write_case, write_cases
from diagnosis.proof.cases.conceal import conceal_set, draw_case, mix_of, mixed_plans
from diagnosis.proof.scoring.lines import ProofSettings
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.atomic_write import atomic_file, atomic_folder
from models.base.errors import InputError
from models.base.parallel import iterate_parallel
from models.base.progress import Progress

if TYPE_CHECKING:
    from diagnosis.proof.cases.concealed_case import Plan
    from diagnosis.proof.zoo.case import ZooPlan

# Of a proof on plants of the zoo.
ZOO_COUNTS = {"control": 20, "single": 13, "date": 9, "sensor": 6, "pair": 5, "outside": 5, "messy": 2}

ZOO_BASELINES = 2  # that every case of the zoo has, whether or not its diagnosis gets them


def keep_to_one_set(settings: ProofSettings, file: Path) -> None:
    """Write down which cases a folder holds.

    Raises
    ------
    InputError
        If they are others.
    """
    made = {key: getattr(settings, key) for key in ("plant", "seed", "cases", "gearbox", "families")}
    if not file.exists():
        with atomic_file(file) as partial:
            partial.write_text(json.dumps(made) + "\n", encoding="utf-8")
    elif json.loads(file.read_text(encoding="utf-8")) != made:
        raise InputError(f"{file.parent}: holds the cases of another proof; choose another output folder")


def make_cases(settings: ProofSettings, recordings: Path, truth: Path, jobs: int, progress: Progress) -> dict[str, str]:
    """Make the recordings and truths of a seed, unless they are there.

    Returns
    -------
    dict of case to str
        The only mechanism of a case, of those that have one and could be left out of the catalogue
    """
    if settings.plant == "given":
        return {}
    names = case_names(settings.cases)
    # The truth of a case is written after its recordings.
    missing = [name for name in names if not (truth / f"{name}.json").exists()]
    if settings.plant == "zoo":
        from diagnosis.proof.zoo.conceal_zoo import zoo_plans

        families = settings.families.split(",") if settings.families else None
        drawn = zoo_plans(settings.seed, mix_of(settings.cases, ZOO_COUNTS), families=families,
                          machine=settings.gearbox or None)  # fmt: skip
        plans = dict(zip(names, drawn, strict=True))
        baselines = max(ZOO_BASELINES, settings.baselines)
        work = [(name, plans[name], recordings, truth, baselines) for name in missing]
        progress("making recordings", len(names) - len(missing), len(names))
        for done, _ in enumerate(iterate_parallel(make_zoo_case, work, jobs=jobs), start=1):
            progress("making recordings", len(names) - len(missing) + done, len(names))
        return {}
    own = mixed_plans(settings.seed, mix_of(settings.cases))
    if missing:
        with atomic_folder(recordings) as stage, atomic_folder(truth) as truth_stage:
            told = partial(progress, "making recordings")
            cases = conceal_set(load_gearbox(settings.gearbox), own, seed=settings.seed, progress=told)
            write_cases(cases, stage, truth_stage)
    return {name: plan.effects[0] for name, plan in zip(names, own, strict=True) if plan.group == "single"}


def make_zoo_case(name: str, plan: ZooPlan, recordings: Path, truth: Path, baselines: int) -> None:
    """Draw a case of the zoo and write its recordings, so many baselines too, and its definition; its truth apart."""
    from diagnosis.proof.zoo.conceal_zoo import files_of_case
    from diagnosis.proof.zoo.draw import draw_case

    write_case(files_of_case(draw_case(plan, name=name, baselines=baselines)), recordings / name, truth)


def add_evidence(settings: ProofSettings, truth: Path, jobs: int, progress: Progress) -> None:
    """Add what the recordings hold for each effect to the truths of the own kind that lack it, a minute per case."""
    gearbox, plans = load_gearbox(settings.gearbox), mixed_plans(settings.seed, mix_of(settings.cases))
    work = [
        (file, gearbox, plan, (settings.seed, i))
        for i, (file, plan) in enumerate(zip(sorted(truth.glob("case_*.json")), plans, strict=True))
        if plan.effects and "oracle" not in json.loads(file.read_text(encoding="utf-8"))["effects"][0]
    ]
    progress("weighing the evidence", 0, len(work))
    for done, _ in enumerate(iterate_parallel(add_evidence_of_case, work, jobs=jobs), start=1):
        progress("weighing the evidence", done, len(work))


def add_evidence_of_case(file: Path, gearbox: Gearbox, plan: Plan, seed: tuple[int, ...]) -> None:
    """Add ``oracle`` to the effects of a truth; of messy cases to the dominant one alone."""
    from diagnosis.proof.plant.plant import Plant
    from diagnosis.proof.zoo.own_kind import design_of_own_kind, effect_on_readings

    plant, facts = Plant(gearbox), json.loads(file.read_text(encoding="utf-8"))
    case = draw_case(plant, plan, seed=seed, name=file.stem)
    design = design_of_own_kind(plant, case.individual, case.runs, case.instruments)
    pairs = list(zip(facts["effects"], case.effects, strict=True))
    for fact, effect in pairs[:1] if plan.group == "messy" else pairs:
        fact["oracle"] = design.nats_of(effect_on_readings(plant, case.runs, case.instruments, [effect])).facts
    with atomic_file(file) as partial:
        partial.write_text(json.dumps(facts, indent=1, sort_keys=True) + "\n", encoding="utf-8")
