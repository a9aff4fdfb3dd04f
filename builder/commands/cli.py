"""The verbs and their options. Each verb reads its input, calls one function of this project, and shows the result."""

from __future__ import annotations

import signal
from pathlib import Path
from types import FrameType

import click

from builder.base.example import example
from builder.base.progress import LOADING, progress
from builder.base.workers import worker_options
from builder.commands.add import add
from builder.commands.check import check
from builder.commands.conceal import conceal
from builder.commands.definition_files import new, schema
from builder.commands.diagnose import diagnose
from builder.commands.prove import prove, score
from builder.commands.simulate import simulate
from builder.reproduce.command import reproduce
from models.assembly.gearbox import known_gearboxes, load_gearbox
from models.base.version import DISTRIBUTION, project_version
from models.correction.correction import read_correction

GEARBOX_HELP = f"Name ({', '.join(known_gearboxes())}) or definition file (TOML)."

LONGEST = 80  # characters of a first sentence, which the help of all verbs has in full
GROUPS = {
    "Your machine, and recordings of it": ("new", "check", "add", "schema", "build-fmu", "simulate", "diagnose"),
    "Trust": ("conceal", "prove", "score", "reproduce"),
}


def _stop(_number: int, _frame: FrameType | None) -> None:
    """Let a termination unwind like an interrupt, so that unfinished files are removed."""
    raise KeyboardInterrupt


class _Verbs(click.Group):
    """Verbs in the order of a user's day, each with its first sentence."""

    def format_commands(self, _: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the groups of verbs."""
        for title, names in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(name, self.commands[name].get_short_help_str(LONGEST)) for name in names])


@click.group(cls=_Verbs, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(project_version(), prog_name=DISTRIBUTION)
def commands() -> None:
    """Thermal twin of gearboxes: full model, surrogate, FMU, and diagnosis."""
    signal.signal(signal.SIGTERM, _stop)


@click.command("build-fmu", epilog=example("build-fmu --gearbox conveyor --output out/conveyor"))
@click.option("--gearbox", default="fzg", show_default=True, metavar="NAME|FILE", help=GEARBOX_HELP)
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
@click.option("--correction", type=click.Path(path_type=Path, dir_okay=False), default=None, metavar="FILE",
              help="What diagnose found: the FMU carries it.")  # fmt: skip
@click.option("--claims-only", is_flag=True, help="Of --correction without what is only likely.")
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
    correction: Path | None,
    claims_only: bool,
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
    if claims_only and correction is None:
        raise click.UsageError("--claims-only is about --correction; give both")
    definition = load_gearbox(gearbox)
    found = None if correction is None else read_correction(correction, definition)
    found = found.claims_only() if found and claims_only else found
    folder = output if output is not None else Path("out") / Path(gearbox).stem
    with progress("starting") as told:
        report = build(
            definition, folder, name=Path(gearbox).stem, target=target, platforms=platforms or "host", fmi=fmi or "2",
            preset=preset, samples=samples, seed=seed, jobs=jobs, dask=dask, correction=found, couple=couple,
            retrain=retrain, progress=told,
        )  # fmt: skip
    report.show()


for verb in (new, check, add, schema, build_fmu, simulate, diagnose, conceal, prove, score, reproduce):
    commands.add_command(verb)
