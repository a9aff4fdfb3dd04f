"""The verb ``build-fmu``."""

from __future__ import annotations

from pathlib import Path

import click

from builder.base.options import CorrectionFile, correction_options, example, gearbox_option, worker_options
from builder.base.progress import LOADING, progress
from models.assembly.gearbox import load_gearbox


@click.command("build-fmu", epilog=example("build-fmu --gearbox conveyor --output out/conveyor"))
@gearbox_option()
@click.option("--target", type=click.Choice(["python", "native", "both"]), default="both", show_default=True,
              help="Kind of FMU: native (C; needs no other software), python (pythonfmu, ONNX networks in "
                   "onnxruntime), or both; both is python alone without a C compiler or ziglang.")  # fmt: skip
@click.option("--platforms", default=None, metavar="all|host|LIST",
              help="Of a native FMU: host (this machine's), all (with ziglang), or a list such as win64,win32.  "
                   "[default: host]")  # fmt: skip
@click.option("--fmi", type=click.Choice(["2", "3", "both"]), default=None,
              help="Version of a native FMU: 2 (2.0), 3 (3.0), or both in two files.  [default: 2]")  # fmt: skip
@click.option("--output", type=click.Path(path_type=Path, file_okay=False), default=None, metavar="DIR",
              help="Folder for the FMU and what belongs to it.  [default: out/<gearbox>]")  # fmt: skip
@correction_options("What diagnose found: the FMU carries it.")
@click.option("--couple", multiple=True, metavar="BOUNDARY",
              help="Take the temperature of this boundary from an input BOUNDARY.T_in, to couple the FMU with another "
                   "model (may be given several times).")  # fmt: skip
@click.option("--preset", type=click.Choice(["default", "paper"]), default="default", show_default=True,
              help="Networks: default, or as printed in the paper (400 points, 2 x 5).")  # fmt: skip
@click.option("--samples", type=click.IntRange(min=50, max=1_000_000), default=None, metavar="N",
              help="Training points per network.  [default: by preset]")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0, max=2**32 - 1), default=0, show_default=True, metavar="N",
              help="Seed of samples and starts.")  # fmt: skip
@click.option("--retrain", is_flag=True, help="Train the networks even if an earlier build has trained the same.")
@worker_options(jobs_help="Processes on this machine; the result does not depend on it.")
def build_fmu(
    gearbox: str,
    target: str,
    platforms: str | None,
    fmi: str | None,
    output: Path | None,
    correction: CorrectionFile | None,
    couple: tuple[str, ...],
    preset: str,
    samples: int | None,
    seed: int,
    retrain: bool,
    jobs: int,
    dask: str | None,
) -> None:
    """Train the networks of a gearbox and build its FMU."""
    with progress(LOADING):
        from builder.workflows.build import build  # scikit-learn and onnx, which the other verbs need not wait for

    if platforms is not None and target == "python":
        raise click.UsageError("--platforms is about native FMUs; give it without --target python")
    if fmi is not None and target == "python":
        raise click.UsageError("--fmi is about native FMUs, the Python FMU is FMI 2.0; give it without --target python")
    definition = load_gearbox(gearbox)
    found = None if correction is None else correction.read(definition)
    folder = output if output is not None else Path("out") / Path(gearbox).stem
    with progress("starting") as told:
        report = build(
            definition, folder, name=Path(gearbox).stem, target=target, platforms=platforms or "host", fmi=fmi or "2",
            preset=preset, samples=samples, seed=seed, jobs=jobs, dask=dask, correction=found, couple=couple,
            retrain=retrain, progress=told,
        )  # fmt: skip
    report.show()
