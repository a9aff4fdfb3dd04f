"""The verbs and their options. Each verb reads its input, calls one function of the house, and shows what came out."""

from __future__ import annotations

import signal
import sys
from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from types import FrameType

import click

from builder import console
from builder.conceal_command import conceal
from builder.diagnose_command import diagnose
from builder.files import appearing_whole, read_cycle, read_initial, write_table
from builder.prove_command import prove
from builder.reproduce.command import reproduce
from builder.workers import check_workers
from models.correction import read_correction
from models.cycle import COLUMNS
from models.errors import InputError
from models.gearbox import Gearbox, known_gearboxes, load_gearbox
from models.table_file import kind_of
from models.types import Array

GEARBOX_HELP = f"Name ({', '.join(known_gearboxes())}) or definition file (TOML)."


def _stop(_number: int, _frame: FrameType | None) -> None:
    """Let a termination unwind like an interrupt, so that unfinished files are removed."""
    raise KeyboardInterrupt


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.version_option(package_name="gearbox-thermal-twin")
def commands() -> None:
    """Power loss and temperatures of cylindrical gearboxes: full model, surrogate and FMU."""
    signal.signal(signal.SIGTERM, _stop)


@commands.command("build-fmu")
@click.option("--gearbox", default="fzg", show_default=True, metavar="NAME|FILE", help=GEARBOX_HELP)
@click.option("--target", type=click.Choice(["python", "native", "both"]), default="python", show_default=True,
              help="Kind of FMU: python (pythonfmu, ONNX networks in onnxruntime), native (C; no Python where it "
                   "runs), or both.")  # fmt: skip
@click.option("--platforms", default="all", show_default=True, metavar="all|host|LIST",
              help="Of a native FMU: all (with ziglang, else this machine's), host, e.g. win64,win32.")  # fmt: skip
@click.option("--output", type=click.Path(path_type=Path, file_okay=False), default=None, metavar="DIR",
              help="Folder for the FMU and what belongs to it.  [default: out/<gearbox>]")  # fmt: skip
@click.option("--correction", type=click.Path(path_type=Path, dir_okay=False), default=None, metavar="FILE",
              help="What diagnose found: the FMU carries it.")  # fmt: skip
@click.option("--preset", type=click.Choice(["default", "paper"]), default="default", show_default=True,
              help="Networks: default, or as printed in the paper (400 points, 2 x 5).")  # fmt: skip
@click.option("--samples", type=click.IntRange(min=50, max=1_000_000), default=None, metavar="N",
              help="Training points per network.  [default: by preset]")  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0, max=2**32 - 1), default=0, show_default=True, metavar="N",
              help="Seed of samples and starts.")  # fmt: skip
@click.option("--jobs", type=click.IntRange(min=1), default=None, metavar="N",
              help="Processes on this machine; the result does not depend on it.  [default: all cores]")  # fmt: skip
@click.option("--dask", "dask_address", default=None, metavar="ADDRESS",
              help="Scheduler of a Dask cluster to work on instead, e.g. tcp://host:8786.")  # fmt: skip
def build_fmu(
    gearbox: str,
    target: str,
    platforms: str,
    output: Path | None,
    correction: Path | None,
    preset: str,
    samples: int | None,
    seed: int,
    jobs: int | None,
    dask_address: str | None,
) -> None:
    """Train the networks of a gearbox and build its FMU."""
    from builder.build import build  # imports scikit-learn and onnx, which the other verbs need not wait for

    check_workers(jobs, dask_address)
    definition = load_gearbox(gearbox)
    found = None if correction is None else read_correction(correction, definition.network(), made_for=definition)
    folder = output if output is not None else Path("out") / Path(gearbox).stem
    report = build(
        definition,
        folder,
        name=Path(gearbox).stem,
        target=target,
        platforms=platforms,
        preset=preset,
        samples=samples,
        seed=seed,
        jobs=jobs,
        dask_address=dask_address,
        correction=found,
    )
    report.show()


@commands.command("simulate")
@click.argument("files", nargs=-1, required=True, metavar="[FMU] CYCLE", type=click.Path(path_type=Path))
@click.option("--gearbox", default=None, metavar="NAME|FILE", help=f"Drive the full model instead. {GEARBOX_HELP}")
@click.option("--output", required=True, type=click.Path(path_type=Path), metavar="FILE",
              help="Result: .csv, .csv.gz or .parquet.")  # fmt: skip
@click.option("--initial", default=None, metavar="T|FILE",
              help="Start temperature of all nodes in degC, or a file with T_<node>_degC columns whose last row counts "
                   "(a result to be continued).  [default: first ambient temperature]")  # fmt: skip
@click.option("--correction", type=click.Path(path_type=Path, dir_okay=False), default=None,
              metavar="FILE", help="What diagnose found: the full model carries it.")  # fmt: skip
@click.option("--plot", type=click.Path(path_type=Path), default=None, metavar="FILE", help="Plot: .png, .pdf or .svg.")
def simulate(
    files: tuple[Path, ...],
    gearbox: str | None,
    output: Path,
    initial: str | None,
    correction: Path | None,
    plot: Path | None,
) -> None:
    """Drive a CYCLE with an FMU, or with the full model of a gearbox (--gearbox).

    CYCLE is a table (.csv, .csv.gz, .parquet) with the columns time_s, speed_rpm, torque_Nm and, where known,
    T_ambient_degC and air_speed_m_s.
    """
    if len(files) > 2 or (len(files) == 2) == (gearbox is not None):
        raise InputError("simulate takes FMU CYCLE, or --gearbox NAME|FILE and CYCLE")
    if plot is not None and plot.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise InputError(f"{plot}: plots are written as .png, .pdf or .svg")
    if correction is not None and gearbox is None:
        raise InputError(
            "--correction goes with --gearbox; an FMU is built with its correction (build-fmu --correction)"
        )
    kind_of(output)  # told before the work, not after it
    start = None if initial is None else read_initial(initial)
    if gearbox is not None:
        columns, groups = _simulate_gearbox(load_gearbox(gearbox), files[0], start, correction)
        title = f"{load_gearbox(gearbox).name}: {files[0].name}, full model"
    else:
        columns, groups = _simulate_fmu(files[0], files[1], start)
        title = f"{files[0].name}: {files[1].name}"
    with nullcontext() if plot is None else appearing_whole(plot) as picture:
        if picture is not None:
            from builder.plots import plot_cycle

            plot_cycle(picture, columns, title=title, groups=groups)
        write_table(output, columns)
    _show_cycle(columns, [output] if plot is None else [output, plot])


def _simulate_gearbox(
    gearbox: Gearbox, cycle_file: Path, initial: float | dict[str, float] | None, correction: Path | None
) -> tuple[dict[str, Array], Mapping[str, tuple[str, ...]]]:
    network = gearbox.network()
    if correction is not None:
        network = read_correction(correction, network, made_for=gearbox).network(gearbox)
    cycle = read_cycle(cycle_file, extra=tuple(name for name in network.inputs if name not in COLUMNS))
    if isinstance(initial, dict):
        initial = {name: T for name, T in initial.items() if name in {part.name for part in network.parts}}
    with console.progress_bar("simulating") as progress:
        result = network.simulate(cycle, losses=gearbox.loss_laws(), initial=initial, progress=progress)
    return result.columns(), network.groups


def _simulate_fmu(
    fmu: Path, cycle_file: Path, initial: float | dict[str, float] | None
) -> tuple[dict[str, Array], Mapping[str, tuple[str, ...]]]:
    from builder.fmu_drive import drive_fmu, fmu_inputs

    cycle = read_cycle(cycle_file, extra=fmu_inputs(fmu))
    with console.progress_bar("driving the FMU") as progress:
        columns = drive_fmu(fmu, cycle, initial=initial, progress=progress)
    return columns, {}


def _show_cycle(columns: Mapping[str, Array], files: list[Path]) -> None:
    inputs = [name for name, *_ in COLUMNS.values()]
    shown = [n for n in columns if n.startswith("T_") and n.endswith("_degC") and n not in inputs]
    temperatures = {n[2:-5]: columns[n] for n in shown}
    rows = [[n, f"{v[0]:.1f}", f"{v.max():.1f}", f"{v[-1]:.1f}"] for n, v in temperatures.items()]
    console.table("Temperatures in degC", ["node", "first", "highest", "last"], rows)
    losses = {n: v for n, v in columns.items() if n.startswith("P_loss")}
    rows = [
        [
            n.removeprefix("P_loss_").removesuffix("_W") if n != "P_loss_W" else "total",
            f"{v.mean():.1f}",
            f"{v.max():.1f}",
        ]
        for n, v in losses.items()
    ]
    console.table("Losses in W", ["loss", "mean of rows", "highest"], rows)
    outside = int((~columns["in_domain"].astype(bool)).sum())
    if outside:
        console.err.print(
            f"warning: {outside} of {len(columns['time_s'])} rows are outside the surrogate's training domain; "
            "in_domain shows which",
            style="yellow",
        )
    for file in files:
        console.out.print(f"wrote {file}")
    sys.stdout.flush()


commands.add_command(diagnose)
commands.add_command(reproduce)
commands.add_command(conceal)
commands.add_command(prove)
