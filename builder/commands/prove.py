"""The verbs ``prove`` and ``score``."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click
from click.core import ParameterSource

from builder.base import console
from builder.base.options import example, gearbox_option, jobs_option
from builder.base.progress import LOADING, progress
from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError

if TYPE_CHECKING:
    from diagnosis.proof.scoring.lines import ProofSettings

MADE = ("plant", "cases", "seed", "families", "removed")  # options of cases that are made
REAL = ("rod",)  # plants with a recording in examples/data
ONLY_NEW = (*MADE, "gearbox", "cells_every", "baselines", "answers")  # that an old file has
NOT_REAL = (*ONLY_NEW, "recordings", "truth", "continued", "jobs")


@click.command("prove", epilog=example("prove --real rod"))
@click.option("--plant", type=click.Choice(["own", "zoo"]), default="own", show_default=True,
              help="Kind of plant that makes the cases.")  # fmt: skip
@click.option("--cases", type=click.IntRange(min=1, max=10_000), default=None, metavar="N",
              help="Number of cases.  [default: 251 (own), 60 (zoo)]")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0, max=2**32 - 1), default=None, metavar="N",
              help="Seed of the cases.  [default: 2044 (own), 3003 (zoo), which nobody has opened]")  # fmt: skip
@click.option("--recordings", type=click.Path(path_type=Path, file_okay=False, exists=True), default=None,
              metavar="DIR", help="Recordings that exist, a folder per case, in place of --plant.")  # fmt: skip
@click.option("--truth", type=click.Path(path_type=Path, exists=True), default=None, metavar="FILE|DIR",
              help="Truth of --recordings: one file, or <case>.json in a folder.")  # fmt: skip
@gearbox_option("Name or definition file (TOML).  [default: fzg; zoo: drawn by family]", default=None)
@click.option("--families", default="", metavar="NAME,...",
              help="Zoo: families of plants to draw from.  [default: all]")  # fmt: skip
@click.option("--cells-every", type=click.IntRange(min=0), default=0, show_default=True, metavar="N",
              help="Every N-th case is also diagnosed with fewer sensors and shorter recordings; 0: none.")  # fmt: skip
@click.option("--baselines", type=click.IntRange(min=0, max=20), default=0, show_default=True, metavar="N",
              help="Baselines of a case (baseline_*) that its diagnosis gets, the first N.")  # fmt: skip
@click.option("--removed", is_flag=True,
              help="Own plant: mechanisms that are alone in a case once more with their entry removed.")  # fmt: skip
@click.option("--real", type=click.Choice(REAL), default=None,
              help="A real plant from start to FMU instead: diagnosis, corrected FMU, comparison.")  # fmt: skip
@click.option("--answers", type=click.Path(path_type=Path, dir_okay=False), default=None, metavar="FILE",
              help="File that gets a line per case.  [default: <seed>.jsonl in --output]")  # fmt: skip
@click.option("--continue", "continued", type=click.Path(path_type=Path, dir_okay=False, exists=True), default=None,
              metavar="FILE", help="Continue the proof of this file of answers: its options, its folder.")  # fmt: skip
@jobs_option()
@click.option("--output", type=click.Path(path_type=Path, file_okay=False), default=Path("out/proof"),
              show_default=True, metavar="DIR", help="Folder for recordings, truth and scores.")  # fmt: skip
@click.pass_context
def prove(
    context: click.Context, plant: Literal["own", "zoo"], cases: int | None, seed: int | None, recordings: Path | None,
    truth: Path | None, gearbox: str | None, families: str, cells_every: int, baselines: int, removed: bool,
    real: str | None, answers: Path | None, continued: Path | None, jobs: int, output: Path,
) -> None:  # fmt: skip
    """Test the diagnosis blindly on sealed cases, and score it.

    Hide effects, diagnose blindly, hash the answers, open the truth, score. Every diagnosis is a process that gets the
    recordings of one case and nothing else. Its answer is added to a file, with which an interrupted proof is
    continued.
    """
    typed = [name for name in NOT_REAL if context.get_parameter_source(name) == ParameterSource.COMMANDLINE]
    if real is not None:
        if typed:
            raise InputError(f"--{_dashed(typed[0])} does not go with --real, which is one recording of a real plant")
        _prove_real(real, output)
        return
    with progress(LOADING):
        from builder.workflows.prove import prove as run
        from diagnosis.proof.scoring.lines import ProofSettings, begin_lines

    if (recordings is None) != (truth is None):
        raise InputError("--recordings and --truth go together: a folder per case, and what is concealed in them")
    if continued is not None:
        wrong = [name for name in typed if name in ONLY_NEW]
        if wrong:
            raise InputError(f"--{_dashed(wrong[0])} does not go with --continue: {continued} has its options")
        file = continued
        if context.get_parameter_source("output") != ParameterSource.COMMANDLINE:
            output = file.parent
    elif recordings is not None:
        wrong = [name for name in typed if name in MADE]
        if wrong:
            raise InputError(f"--{_dashed(wrong[0])} is for cases that are made; --recordings names cases that exist")
        load_gearbox(gearbox or "fzg")
        file = answers or output / "given.jsonl"
        begin_lines(file, ProofSettings(plant="given", gearbox=gearbox or "fzg", cells_every=cells_every,
                                        baselines=baselines))  # fmt: skip
    else:
        settings = _settings_of_made(plant, cases, seed, gearbox=gearbox, families=families, cells_every=cells_every,
                                     baselines=baselines, removed=removed)  # fmt: skip
        file = answers or output / f"{settings.seed}.jsonl"
        begin_lines(file, settings)
    with progress("starting") as told:
        result = run(file, output, recordings=recordings, truth=truth, jobs=jobs, progress=told)
    _show(result, output)
    console.out.print(f"wrote {file}")


@click.command("score", epilog=example("score out/diagnoses --truth out/concealed/truth"))
@click.argument("results", type=click.Path(path_type=Path, file_okay=False, exists=True), metavar="RESULTS")
@click.option("--truth", type=click.Path(path_type=Path, exists=True), required=True, metavar="FILE|DIR",
              help="Truth: one file, or <case>.json in a folder.")  # fmt: skip
@gearbox_option()
@click.option("--output", type=click.Path(path_type=Path, file_okay=False), default=Path("out/score"),
              show_default=True, metavar="DIR", help="Folder for the scores.")  # fmt: skip
def score(results: Path, truth: Path, gearbox: str, output: Path) -> None:
    """Score the diagnoses of any method against the truth.

    RESULTS holds <case>/diagnosis.json for every case of the truth. A case without a readable file counts as failed.
    """
    from diagnosis.proof.scoring.answers import read_answer
    from diagnosis.proof.scoring.lines import Task
    from diagnosis.proof.scoring.outcome import outcome
    from diagnosis.proof.scoring.truth import read_truths

    truths, machine = read_truths(truth), load_gearbox(gearbox)
    if not any((results / case / "diagnosis.json").exists() for case in truths):
        raise InputError(f"{results}: holds no <case>/diagnosis.json of the cases in {truth}")
    records: dict[Task, dict[str, Any]] = {}
    for case in truths:
        try:
            answer = json.loads((results / case / "diagnosis.json").read_text(encoding="utf-8"))
            read_answer(answer, machine)
            records[Task(case=case)] = {"status": "answered", "answer": answer}
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            records[Task(case=case)] = {"status": "failed", "answer": None}
    _show(outcome(truths, records, machine), output)


def _settings_of_made(
    plant: Literal["own", "zoo"], cases: int | None, seed: int | None, *, gearbox: str | None, families: str,
    cells_every: int, baselines: int, removed: bool,
) -> ProofSettings:  # fmt: skip
    """Settings of a proof with cases that are made; refuses what does not fit the kind of plant."""
    from builder.workflows.proof_cases import ZOO_COUNTS
    from diagnosis.proof.cases.conceal import PROOF_MIX, mix_of
    from diagnosis.proof.scoring.lines import ProofSettings
    from diagnosis.proof.scoring.seeds import OWN_PROOF, ZOO_PROOF

    if plant == "own" and families:
        raise InputError("--families is for --plant zoo")
    if plant == "zoo" and removed:
        raise InputError("--removed is for --plant own; the zoo has effects outside the catalogue")
    if plant == "own" and baselines:
        raise InputError("--baselines is for --plant zoo and --recordings; the own plant records no baselines")
    mix, chosen, machine = (PROOF_MIX, OWN_PROOF, "fzg") if plant == "own" else (ZOO_COUNTS, ZOO_PROOF[0], "")
    number = sum(mix_of(cases or sum(mix.values()), mix).values())  # refuses too few
    return ProofSettings(plant=plant, seed=chosen if seed is None else seed, cases=number, gearbox=gearbox or machine,
                         families=families, cells_every=cells_every, baselines=baselines, removed=removed)  # fmt: skip


def _prove_real(name: str, output: Path) -> None:
    with progress(LOADING):
        from builder.workflows.prove_real import PLANTS, RESULT, prove_real, rows_of
    with progress("starting") as told:
        result = prove_real(PLANTS[name], output, progress=told)
    for finding in result["findings"]:
        console.out.print(f"{finding['grade']}: {finding['title']} ({finding['probability']:.2f})")
    console.table(f"{name}: {result['verdict'].replace('_', ' ')}", ["", "", "limit", ""], rows_of(result))
    console.out.print(f"wrote {output / RESULT}, report, correction and FMU next to it")


def _dashed(name: str) -> str:
    return {"continued": "continue"}.get(name, name.replace("_", "-"))


def _show(result: Mapping[str, Any], output: Path) -> None:
    """Print the tables and write the files of scores."""
    from builder.workflows.proof_files import PAGE, write_scores
    from diagnosis.proof.scoring.outcome import tables_of

    kinds = list(result["cases"])
    for title, header, rows in tables_of(result, kinds[:1]):
        console.table(title, header, rows, text_columns=1 if len(header) < 6 else 5)
    if len(kinds) > 1:
        console.out.print(f"By kind of plant: {output / PAGE}")
    if result["role_of_seed"] not in (None, "proof"):
        console.out.print(f"These cases are open ({result['role_of_seed']}): their scores are no proof.")
    if result["failed"]:
        console.out.print(f"{result['failed']} diagnoses ended without an answer; they count as wrong.")
    for path in write_scores(result, output):
        console.out.print(f"wrote {path}")
