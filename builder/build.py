"""From a definition to an FMU: train, export, package, then drive the reference cycle against the full model."""

from __future__ import annotations

import json
import shutil
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from builder import console
from builder.drive_cycle import COLD_START, reference_cycle
from builder.files import write_table
from builder.fmu import build_python_fmu
from builder.fmu_drive import drive_fmu
from builder.onnx_export import export_onnx
from builder.plots import plot_cycle
from builder.train import TrainingResult, train_surrogate
from builder.version import project_version
from models.errors import InputError
from models.gearbox import Gearbox
from models.types import Array

ALL_CORES = -1


@dataclass(frozen=True, kw_only=True)
class CycleErrors:
    """How far the FMU is from the full model over the reference cycle.

    Attributes
    ----------
    temperature_K : mapping of node to float
        Largest difference, [K]
    loss_mean, loss_worst : float
        Mean and largest difference of the total loss, relative to the full model's at that moment, [-]
    """

    temperature_K: Mapping[str, float]
    loss_mean: float
    loss_worst: float


@dataclass(frozen=True, kw_only=True)
class BuildReport:
    """What a build made and how good it is."""

    gearbox: str
    training: TrainingResult
    cycle: CycleErrors
    seconds: Mapping[str, float]
    files: tuple[Path, ...]

    def as_dict(self) -> dict[str, Any]:
        """The report without timings, so that the same build gives the same file."""
        return {
            **self.training.as_dict(),
            "reference_cycle": {
                "largest_temperature_difference_K": dict(self.cycle.temperature_K),
                "loss_difference_mean": self.cycle.loss_mean,
                "loss_difference_worst": self.cycle.loss_worst,
            },
        }

    def show(self) -> None:
        """Print the summary."""
        rows = [
            [r.component, f"{r.r_squared:.6f}", *(f"{100.0 * v:.2f}" for v in
             (r.median, r.percentile_95, r.corner_median, r.corner_percentile_95))]
            for r in self.training.report
        ]  # fmt: skip
        console.table(
            f"Networks against the full model on {self.training.preset.judged} separate points: relative errors\n"
            "(corner: the lowest tenth of every input)",
            ["loss", "R²", "median %", "p95 %", "corner median %", "corner p95 %"],
            rows,
        )
        worst_node, worst = max(self.cycle.temperature_K.items(), key=lambda item: item[1])
        console.table(
            "FMU against the full model, 600 s reference cycle from 20 °C",
            ["quantity", "difference"],
            [
                [f"temperature, worst node ({worst_node})", f"{worst:.3f} K"],
                ["temperature, oil", f"{self.cycle.temperature_K['oil']:.3f} K"],
                ["total loss, mean", f"{100.0 * self.cycle.loss_mean:.2f} %"],
                ["total loss, worst", f"{100.0 * self.cycle.loss_worst:.2f} %"],
            ],
        )
        console.table("Time", ["step", "s"], [[step, f"{value:.2f}"] for step, value in self.seconds.items()])
        for file in self.files:
            console.out.print(f"wrote {file}")


def build(
    gearbox: Gearbox,
    folder: Path,
    *,
    name: str,
    target: str = "python",
    preset: str = "default",
    samples: int | None = None,
    seed: int = 0,
    jobs: int | None = None,
    dask_address: str | None = None,
) -> BuildReport:
    """Train the networks of `gearbox`, build its FMU and try it on the reference cycle.

    Parameters
    ----------
    gearbox : Gearbox
    folder : Path
        Where the files go: ``<name>.fmu``, ``networks/*.onnx``, ``drive_cycle.csv`` and ``.png``, ``report.json``.
        They appear together when all is done; files of an earlier build are replaced, others left alone
    name : str
        Name of the FMU's file
    target : str
        Kind of FMU: ``python``
    preset, samples, seed, jobs, dask_address
        See :func:`builder.train.train_surrogate`; `jobs` None takes all cores

    Returns
    -------
    BuildReport

    Raises
    ------
    InputError
        If the folder cannot be written to or the options are at fault.
    """
    if target != "python":
        raise InputError(f"target {target!r} is not known; 'python' is")
    seconds: dict[str, float] = {}
    with staging(folder) as stage:
        with _timed("train", seconds), _spoken() as tell:
            training = train_surrogate(
                gearbox, preset=preset, samples=samples, seed=seed,
                jobs=ALL_CORES if jobs is None else jobs, dask_address=dask_address, progress=tell,
            )  # fmt: skip
        with _timed("export and package", seconds), _spoken() as tell:
            tell("packaging the FMU")
            networks = export_onnx(training, stage / "networks", version=project_version())
            fmu = build_python_fmu(gearbox, training, networks, stage / f"{name}.fmu")
        cycle = reference_cycle(gearbox)
        network = gearbox.network()
        losses = gearbox.losses()
        with _timed("reference cycle, full model", seconds), console.progress_bar("full model") as progress:
            full = network.simulate(cycle, losses=losses, initial=COLD_START, progress=progress).columns()
        with _timed("reference cycle, FMU in FMPy", seconds), console.progress_bar("FMU in FMPy") as progress:
            driven = drive_fmu(fmu, cycle, initial=COLD_START, progress=progress)
        errors = cycle_errors(driven, full)
        write_table(stage / "drive_cycle.csv", driven)
        title = f"{gearbox.name}\n600 s reference cycle, FMU and full model"
        plot_cycle(stage / "drive_cycle.png", driven, title=title, groups=network.groups, reference=full)
        report = BuildReport(gearbox=gearbox.name, training=training, cycle=errors, seconds=seconds, files=())
        (stage / "report.json").write_text(json.dumps(report.as_dict(), indent=2) + "\n", encoding="utf-8")
    files = tuple(folder / path for path in
                  (f"{name}.fmu", *(f"networks/{p.name}" for p in networks), "drive_cycle.csv", "drive_cycle.png",
                   "report.json"))  # fmt: skip
    return BuildReport(gearbox=gearbox.name, training=training, cycle=errors, seconds=seconds, files=files)


def cycle_errors(driven: Mapping[str, Array], reference: Mapping[str, Array]) -> CycleErrors:
    """Compare two results over the same rows, in the columns of the file contract."""
    nodes = [
        name for name in reference if name.startswith("T_") and name.endswith("_degC") and name != "T_ambient_degC"
    ]
    loss = np.abs(driven["P_loss_W"] - reference["P_loss_W"]) / reference["P_loss_W"]
    return CycleErrors(
        temperature_K={name[2:-5]: float(np.max(np.abs(driven[name] - reference[name]))) for name in nodes},
        loss_mean=float(loss.mean()),
        loss_worst=float(loss.max()),
    )


@contextmanager
def staging(folder: Path) -> Iterator[Path]:
    """A hidden folder inside `folder` whose files move up when the block ends well, and vanish otherwise.

    Raises
    ------
    InputError
        If `folder` cannot be made or written to, or a file would replace a folder.
    """
    made = [parent for parent in (folder, *folder.parents) if not parent.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        stage = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=folder))
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}); choose another output folder") from error
    try:
        yield stage
        files = sorted(path for path in stage.rglob("*") if path.is_file())
        for path in files:
            if (folder / path.relative_to(stage)).is_dir():
                raise InputError(f"{folder / path.relative_to(stage)}: is a folder; remove it or choose another output")
        for path in files:
            goal = folder / path.relative_to(stage)
            goal.parent.mkdir(parents=True, exist_ok=True)
            path.replace(goal)
    finally:
        shutil.rmtree(stage, ignore_errors=True)
        for parent in made:  # deepest first; with files in it the folder stays
            with suppress(OSError):
                parent.rmdir()


@contextmanager
def _timed(step: str, seconds: dict[str, float]) -> Iterator[None]:
    begin = time.perf_counter()
    yield
    seconds[step] = time.perf_counter() - begin


@contextmanager
def _spoken() -> Iterator[Any]:
    """Stages of long work as a changing line on a terminal, nothing in a pipe."""
    if not console.err.is_terminal:
        yield lambda _: None
        return
    with console.err.status("starting") as status:
        yield lambda line: status.update(line)
