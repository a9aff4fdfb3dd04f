"""From a definition to an FMU: train, export, package, then drive the reference cycle against the full model."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from builder.base import console
from builder.drive.driver import drive_fmu, runs_here
from builder.drive.plots import plot_cycle
from builder.fmi.reference_cycle import COLD_START, KNOTS, reference_cycle
from builder.native.compile import NoCompilerError, plan_for
from builder.native.native_fmu import build_native_fmu
from builder.python.python_fmu import build_python_fmu
from builder.surrogate.kept import kept_or_trained
from builder.surrogate.onnx_export import export_onnx
from builder.surrogate.train import ErrorReport, TrainingResult
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.atomic_write import atomic_folder
from models.base.errors import InputError
from models.base.progress import Progress, silent
from models.base.types import Array
from models.base.version import project_version
from models.correction.correction import Correction, corrected_network
from models.files.output_files import write_table
from models.quantities.quantities import MEMORY, node_columns
from models.simulation.thermal_network import ThermalNetwork

if TYPE_CHECKING:
    import pandas as pd

SUFFIX = {"python": "", "native": "_native", "native_fmi3": "_native_fmi3"}  # of the files' names
LABEL = {"python": "python", "native": "native", "native_fmi3": "native FMI 3.0"}  # of the kinds, for people
POOR_LOSS = 0.02  # of the total loss, mean over the reference cycle
ROUGH = 0.05  # relative error of one loss at one of twenty points
VERSIONS = {"2": ("native",), "3": ("native_fmi3",), "both": ("native", "native_fmi3")}  # native kinds by --fmi


@dataclass(frozen=True, kw_only=True)
class CycleErrors:
    """How far the FMU is from the full model over the reference cycle.

    Attributes
    ----------
    temperature_K : mapping of node to float
        Largest difference, [K]
    loss_mean, loss_worst : float
        Mean and largest difference of the total loss, relative to the full model's at that moment, [-]; None without
        a loss
    """

    temperature_K: Mapping[str, float]
    loss_mean: float | None
    loss_worst: float | None


@dataclass(frozen=True, kw_only=True, repr=False)
class BuildReport:
    """Result of a build: its files and their accuracy.

    Attributes
    ----------
    gearbox : str
    training : TrainingResult or None
        None without geometry: the FMU has the laws themselves
    cycles : mapping of FMU file name to CycleErrors
    seconds : mapping of step to float
    files : tuple of Path
    purpose : str
        One line on which FMU is for what
    notes : tuple of str
        On platforms that were left out, and what could not be tried here
    correction : mapping or None
        Of the correction that the FMU carries, see :meth:`models.correction.correction.Correction.summary`
    """

    gearbox: str
    training: TrainingResult | None
    cycles: Mapping[str, CycleErrors]
    seconds: Mapping[str, float]
    files: tuple[Path, ...]
    purpose: str
    notes: tuple[str, ...] = ()
    correction: Mapping[str, Any] | None = None

    def __repr__(self) -> str:
        return f"<BuildReport of {self.gearbox!r}: {', '.join(path.name for path in self.fmus)}>"

    @property
    def fmus(self) -> tuple[Path, ...]:
        """The FMUs among the files."""
        return tuple(path for path in self.files if path.suffix == ".fmu")

    def to_dataframe(self) -> pd.DataFrame:
        """Return the largest difference of every node's temperature [K] to the full model, one column per FMU."""
        import pandas as pd

        return pd.DataFrame({f"{Path(name).stem}_K": dict(cycle.temperature_K) for name, cycle in self.cycles.items()})

    def as_dict(self) -> dict[str, Any]:
        """The report without timings, so that the same build gives the same file."""
        return {
            **({} if self.training is None else self.training.as_dict()),
            "correction": self.correction,
            "reference_cycle": {
                name: {
                    "largest_temperature_difference_K": dict(cycle.temperature_K),
                    "loss_difference_mean": cycle.loss_mean,
                    "loss_difference_worst": cycle.loss_worst,
                }
                for name, cycle in self.cycles.items()
            },
        }

    def show(self) -> None:
        """Print the summary."""
        if self.training is not None:
            self._show_networks(self.training)
        if self.cycles:
            self._show_cycles()
        console.table("Time", ["step", "s"], [[step, f"{value:.2f}"] for step, value in self.seconds.items()])
        for file in self.files:
            console.out.print(f"wrote {file}")
        console.out.print(self.purpose)
        for note in self.notes:
            console.err.print(f"note: {note}", style="yellow")

    @staticmethod
    def _show_networks(training: TrainingResult) -> None:
        rows = [
            [r.component, f"{r.r_squared:.6f}", *(f"{100.0 * v:.2f}" for v in
             (r.median, r.percentile_95, r.corner_median, r.corner_percentile_95))]
            for r in training.report
        ]  # fmt: skip
        console.table(
            f"Networks against the full model on {training.preset.judged} separate points: relative errors\n"
            "(corner: the lowest tenth of every input)",
            ["loss", "R²", "median %", "p95 %", "corner median %", "corner p95 %"],
            rows,
        )
        console.out.print(f"networks: {training.origin}\n")

    def _covered(self) -> str:
        """Say which part of the range of training the cycle reaches."""
        if self.training is None:
            return ""
        losses, (speed, torque) = self.training.losses, KNOTS[:, 1:].max(axis=0)
        (_, n), (_, M) = losses.speed_bounds, losses.torque_bounds
        reached = f"up to {speed * n:.4g} 1/min of {n:g}, {torque * M:.4g} N m of {M:g}"
        return f"\n({reached}; the errors of the networks are those of the whole range)"

    def _show_cycles(self) -> None:
        worst = [max(cycle.temperature_K.items(), key=lambda item: item[1]) for cycle in self.cycles.values()]
        cycles = self.cycles.values()
        rows = [["temperature, worst node", *(f"{value:.3f} K ({node})" for node, value in worst)]]
        if all("oil" in cycle.temperature_K for cycle in cycles):
            rows.append(["temperature, oil", *(f"{cycle.temperature_K['oil']:.3f} K" for cycle in cycles)])
        for label, values in (
            ("mean", [cycle.loss_mean for cycle in cycles]), ("worst", [cycle.loss_worst for cycle in cycles])
        ):  # fmt: skip
            known = [f"{100.0 * value:.2f} %" for value in values if value is not None]
            rows += [[f"total loss, {label}", *known]] if known else []
        console.table(
            f"FMU against the full model, 600 s reference cycle from 20 °C{self._covered()}",
            ["quantity", *(f"difference, {name}" for name in self.cycles)],
            rows,
        )


def build(
    gearbox: Gearbox | str | Path,
    folder: str | Path,
    *,
    name: str | None = None,
    target: str = "both",
    platforms: str = "host",
    fmi: str = "2",
    preset: str = "default",
    samples: int | None = None,
    seed: int = 0,
    jobs: int = 1,
    dask: str | None = None,
    correction: Correction | None = None,
    couple: Sequence[str] = (),
    retrain: bool = False,
    progress: Progress = silent,
) -> BuildReport:
    """Build the FMUs of `gearbox` and try them on the reference cycle; with geometry, train their networks first.

    Networks that an earlier build trained for the same definition and settings are used again.

    Parameters
    ----------
    gearbox : Gearbox, name or path
    folder : str or Path
        Where the files go: ``<name>.fmu`` (python), ``<name>_native.fmu``, ``<name>_native_fmi3.fmu``,
        ``networks/*.onnx``, ``drive_cycle.csv``,
        ``.png`` (``drive_cycle_native`` of the native FMU), ``report.json``. They appear together when all is done;
        files of an earlier build are replaced, others left alone
    name : str or None
        Name of the FMU's file; by default that of the definition's
    target : str
        Kind of FMU: ``python``, ``native`` or ``both``; without a compiler, ``both`` is the Python FMU alone
    platforms : str
        Of a native FMU, see :func:`builder.native.compile.plan_for`
    fmi : str
        Version of the native FMU: ``2``, ``3`` or ``both``
    preset, samples, seed, jobs, dask
        See :func:`builder.surrogate.train.train_surrogate`; `preset`, `samples` and `retrain` with geometry alone
    correction : Correction or None
        What a diagnosis found: the FMU and the full model it is compared with carry it
    couple : sequence of str
        Boundaries whose temperature becomes an input, ``<boundary>.T_in``
    retrain : bool
        Train networks even if an earlier build has trained the same
    progress : callable
        Told what is being done

    Returns
    -------
    BuildReport

    Raises
    ------
    InputError
        If the folder cannot be written to or the options are at fault.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as out:
    ...     report = build("heated_rod", out, target="native")
    ...     driven = drive_fmu(report.fmus[0], {"time_s": [0.0, 600.0], "heater_power": [10.0, 10.0]}, initial=20.0)
    >>> report
    <BuildReport of 'heated rod of three blocks': heated_rod_native.fmu>
    >>> driven.to_dataframe()[["time_s", "T_cell_1_degC"]].round(1)
       time_s  T_cell_1_degC
    0     0.0           20.0
    1   600.0           24.0
    """
    gearbox, folder = gearbox if isinstance(gearbox, Gearbox) else load_gearbox(gearbox), Path(folder)
    name = name or Path(gearbox.file).stem
    if gearbox.is_parametric and (samples is not None or retrain or preset != "default"):
        raise InputError(
            f"{gearbox.file}: has no geometry, so its FMU holds laws and no networks; "
            "leave out samples, preset and retrain"
        )
    kinds, built_for, notes = _planned(target, platforms, fmi)
    network = corrected_network(gearbox, correction)
    for boundary in dict.fromkeys(couple):
        network = network.with_coupled_boundary(boundary)
    inside = gearbox.network_of_laws(network)
    seconds: dict[str, float] = {}
    with atomic_folder(folder) as stage:
        training, networks = None, tuple[Path, ...]()
        if not gearbox.is_parametric:
            with _measure_time("networks", seconds):
                training = kept_or_trained(
                    gearbox, preset=preset, samples=samples, seed=seed, jobs=jobs, dask=dask, retrain=retrain,
                    progress=progress,
                )  # fmt: skip
            notes += _rough(training.report)
            progress("exporting the networks")
            with _measure_time("export", seconds):
                networks = export_onnx(training, stage / "networks", version=project_version())
        fmus = {kind: stage / f"{name}{SUFFIX[kind]}.fmu" for kind in kinds}
        for kind, path in fmus.items():
            with _measure_time(f"package, {LABEL[kind]} FMU", seconds):
                progress(f"packaging the {LABEL[kind]} FMU")
                if kind == "python":
                    build_python_fmu(gearbox, training, networks, path, network=inside, correction=correction)
                else:
                    build_native_fmu(
                        gearbox, training, path, network=inside, platforms=platforms,
                        fmi=3 if kind == "native_fmi3" else 2, correction=correction, progress=progress,
                    )  # fmt: skip
        cycle, losses = reference_cycle(gearbox), gearbox.loss_laws()
        step = "reference cycle, full model"
        with _measure_time(step, seconds):
            told = partial(progress, step)
            full = network.simulate(cycle, losses=losses, initial=COLD_START, progress=told).columns()
        notes += _at_rest(network, full)
        if correction is not None and correction.mean_loss is not None and correction.mean_loss.warning:
            notes.append(f"the corrected model predicts temperatures; {correction.mean_loss.warning}")
        cycles = {}
        for kind, path in fmus.items():
            if not runs_here(path):
                notes.append(f"the {LABEL[kind]} FMU has no binary for this machine: the reference cycle is not driven")
                continue
            step = f"reference cycle, {LABEL[kind]} FMU in FMPy"
            with _measure_time(step, seconds):
                driven = drive_fmu(path, cycle, initial=COLD_START, progress=partial(progress, step))
            progress("drawing the plots")
            cycles[path.name] = cycle_errors(driven, full)
            notes += _poor(path.name, cycles[path.name])
            write_table(stage / f"drive_cycle{SUFFIX[kind]}.csv", driven)
            title = f"{gearbox.name}\n600 s reference cycle, {LABEL[kind]} FMU and full model"
            plot = stage / f"drive_cycle{SUFFIX[kind]}.png"
            plot_cycle(plot, driven, title=title, groups=network.groups, inputs=network.inputs, reference=full)
        report = BuildReport(
            gearbox=gearbox.name, training=training, cycles=cycles, seconds=seconds, files=(),
            purpose=_purpose({kind: path.name for kind, path in fmus.items()}, built_for, networks), notes=tuple(notes),
            correction=None if correction is None else correction.summary(),
        )  # fmt: skip
        (stage / "report.json").write_text(json.dumps(report.as_dict(), indent=2) + "\n", encoding="utf-8")
        made = sorted(path.relative_to(stage) for path in stage.rglob("*") if path.is_file())
    files = tuple(folder / path for path in made)
    return replace(report, files=files, notes=(*report.notes, *_left_from_before(folder, files)))


def _rough(report: Sequence[ErrorReport]) -> list[str]:
    """A note if a network is far from its loss somewhere."""
    worst = max(report, key=lambda one: one.percentile_95)
    if worst.percentile_95 < ROUGH:
        return []
    advice = "good for a trial; train on more points (--samples) before you use its losses"
    return [f"{worst.component} is {worst.percentile_95:.0%} off and more at one of twenty points: {advice}"]


def _poor(fmu: str, errors: CycleErrors) -> list[str]:
    """A note if the losses of an FMU are far from those of the full model on average."""
    if errors.loss_mean is None or errors.loss_mean < POOR_LOSS:
        return []
    advice = "train larger networks (--preset default) or on more points (--samples) before you use its losses"
    return [f"{fmu}: the total loss is {errors.loss_mean:.1%} off the full model on average; {advice}"]


def _at_rest(network: ThermalNetwork, full: Mapping[str, Array]) -> list[str]:
    """A note if controls keep their position in the reference cycle, so that it does not test them."""
    columns = [f"{MEMORY}{state.name}" for state in network.states if state.update is not None]
    still = ", ".join(name for name in columns if np.ptp(full[name]) == 0.0)
    advice = "drive the FMU over a recording in which they switch (`simulate`)"
    return [f"controls that rest in the reference cycle are not compared ({still}): {advice}"] if still else []


def _planned(target: str, platforms: str, fmi: str) -> tuple[tuple[str, ...], tuple[str, ...], list[str]]:
    """Kinds of FMU that can be built here, platforms of the native one, and notes on omitted platforms.

    Called before the training, so that a missing compiler is known early.

    Raises
    ------
    InputError
        If the target is not known, or what is asked for explicitly cannot be built.
    """
    if fmi not in VERSIONS:
        raise InputError(f"FMI {fmi} is not known; 2, 3 and both are")
    native = VERSIONS[fmi]
    kinds = {"python": ("python",), "native": native, "both": ("python", *native)}.get(target)
    if kinds is None:
        raise InputError(f"target {target!r} is not known; python, native and both are")
    if target == "python":
        return kinds, (), []
    try:
        plan = plan_for(platforms)
    except NoCompilerError as error:
        if target == "native":
            raise
        return ("python",), (), [f"native FMU is not built: {error}"]
    return kinds, plan.platforms, [f"native FMU {plan.note}"] if plan.note else []


def _purpose(names: Mapping[str, str], platforms: Sequence[str], networks: Sequence[Path]) -> str:
    """Say which FMU is for what, in one line."""
    native = f"needs no other software, for {', '.join(platforms)}"
    native += "" if len(platforms) > 1 else " (--platforms all: for all)"
    needs = {
        "native": native,
        "native_fmi3": f"(FMI 3.0) {native}",
        "python": "runs on Python with numpy" + (" and onnxruntime" if networks else ""),
    }
    return "; ".join(f"{names[kind]} {text}" for kind, text in needs.items() if kind in names)


def _left_from_before(folder: Path, files: Sequence[Path]) -> list[str]:
    return [
        f"{path} is of an earlier build: report.json and networks/ no longer describe it"
        for path in sorted(folder.glob("*.fmu"))
        if path not in files
    ]


def cycle_errors(driven: Mapping[str, Array], reference: Mapping[str, Array]) -> CycleErrors:
    """Compare two results over the same rows, in the columns of the file contract."""
    nodes = node_columns(reference)
    temperatures = {node: float(np.max(np.abs(driven[name] - reference[name]))) for node, name in nodes.items()}
    loss = reference.get("P_loss_W", np.zeros(1))
    lost = loss > 0.0
    if not lost.any():
        return CycleErrors(temperature_K=temperatures, loss_mean=None, loss_worst=None)
    off = np.abs(driven["P_loss_W"] - loss)[lost] / loss[lost]
    return CycleErrors(temperature_K=temperatures, loss_mean=float(off.mean()), loss_worst=float(off.max()))


@contextmanager
def _measure_time(step: str, seconds: dict[str, float]) -> Iterator[None]:
    begin = time.perf_counter()
    yield
    seconds[step] = time.perf_counter() - begin
