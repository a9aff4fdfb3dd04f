"""Sets of zoo cases: their plans, recordings and truth."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from diagnosis.proof.cases.case_files import DEFINITION, CaseFiles, case_names, files_of_recordings
from diagnosis.proof.cases.conceal import drawn_counts
from diagnosis.proof.plant.cycles import BASELINE
from diagnosis.proof.zoo.case import CONTROLS, GROUPS, ZooCase, ZooPlan
from diagnosis.proof.zoo.draw import draw_case
from diagnosis.proof.zoo.families import FAMILIES, find_family
from diagnosis.proof.zoo.recorder import measure, record
from diagnosis.proof.zoo.truth import truth_of
from models.assembly.gearbox import FOLDER, load_gearbox
from models.base.errors import InputError, did_you_mean
from models.base.types import Array
from models.files.toml_file import names_a_file, packaged, read_text

# Shares of a set in which nothing else is asked for.
ZOO_SHARES = {"control": 0.3, "single": 0.2, "date": 0.15, "sensor": 0.1, "pair": 0.1, "outside": 0.1, "messy": 0.05}


def zoo_plans(
    seed: int, counts: Mapping[str, int], *, families: Sequence[str] | None = None, machine: str | None = None
) -> list[ZooPlan]:
    """Plans of a set, in random order; families take turns, machines of a family are drawn.

    Parameters
    ----------
    counts : mapping of group to int
        How many of each group
    families : sequence of str or None
        Which families; all if None
    machine : str or None
        Name or file of a nominal definition; drawn among those of the family if None

    Raises
    ------
    InputError
        If a group or family is not known, or no family can be drawn for the machine.
    """
    for group in counts:
        if group not in GROUPS:
            raise InputError(f"{group!r} is not a group of cases of the zoo{did_you_mean(group, GROUPS)}")
    chosen = {name: find_family(name) for name in families or FAMILIES}
    rng = np.random.default_rng([seed, 1])
    if machine is not None and families is None:
        fit = {name: family for name, family in chosen.items() if machine in family.machines}
        chosen = fit or chosen  # a definition of the user: the families themselves say what they cannot split
    order = [str(name) for name in rng.permutation(list(chosen))]
    plans: list[ZooPlan] = []
    for group, number in counts.items():
        for i in range(number):
            family = order[len(plans) % len(order)]
            machines = chosen[family].machines
            plans.append(
                ZooPlan(
                    group=group,
                    kind=CONTROLS[i % len(CONTROLS)] if group == "control" else None,
                    family=family,
                    machine=machine or machines[int(rng.integers(len(machines)))],
                    seed=int(rng.integers(2**32)),
                )
            )
    return [plans[i] for i in rng.permutation(len(plans))]


def random_zoo_plans(
    seed: int, number: int, *, families: Sequence[str] | None = None, machine: str | None = None
) -> list[ZooPlan]:
    """Plans drawn in the proportions of :data:`ZOO_SHARES`."""
    return zoo_plans(seed, drawn_counts(seed, number, ZOO_SHARES), families=families, machine=machine)


def conceal_zoo(
    plans: Sequence[ZooPlan],
    *,
    baselines: int = 0,
    session_deviation: float | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Iterator[CaseFiles]:
    """Draw, simulate and record cases of the zoo; further arguments as of :func:`~diagnosis.proof.zoo.draw.draw_case`.

    Parameters
    ----------
    progress : callable or None
        Called with the cases done and in all
    """
    for done, (name, plan) in enumerate(zip(case_names(len(plans)), plans, strict=True), start=1):
        yield files_of_case(draw_case(plan, name=name, baselines=baselines, session_deviation=session_deviation))
        if progress is not None:
            progress(done, len(plans))


def files_of_case(case: ZooCase) -> CaseFiles:
    """Recordings and nominal definition of a case, and its truth."""
    machine = case.plan.machine
    gearbox = load_gearbox(machine)
    source = Path(machine) if names_a_file(machine) else packaged(FOLDER, machine)
    columns = {name: one.quantity.column for name, one in gearbox.network().inputs.items()}
    recordings = files_of_recordings(record_case(case, columns), case.instruments.stated)
    files = {**recordings, DEFINITION: read_text(source).encode()}
    return CaseFiles(name=case.name, files=files, truth=truth_of(case, gearbox.hash, columns))


def record_case(case: ZooCase, columns: Mapping[str, str]) -> dict[str, dict[str, Array]]:
    """Columns by recording, with noise and faults; faults do not reach back to baselines."""
    faults = [effect.fault for effect in case.effects if effect.fault is not None]
    made = {}
    for k, programme in enumerate(case.programmes):
        rng = np.random.default_rng([case.plan.seed, 8, k])
        measured = measure(case.plant, programme, case.runs.outcomes[programme.name], 0)
        acting = [] if programme.name.startswith(BASELINE) else faults
        made[programme.name] = record(measured, case.instruments, acting, columns, rng)
    return made
