"""Train, build the FMU, recompute every item of the paper, write the report."""

from __future__ import annotations

import platform
import time
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import numpy as np

from builder.python.python_fmu import build_python_fmu
from builder.reproduce import drive, losses, networks, others, rig, speed, stages
from builder.reproduce.report import Item, Report
from builder.reproduce.study import Study, StudySettings
from builder.surrogate.onnx_export import export_onnx
from builder.surrogate.train import train_surrogate
from models.assembly.gearbox import load_gearbox
from models.base.atomic_write import atomic_folder
from models.base.progress import Progress, silent
from models.base.version import project_version

GEARBOX = "fzg"
# In the order of the paper; items that it does not have come last.
ITEMS = (
    rig.design_scheme,
    rig.rig_scheme,
    rig.characteristics,
    rig.loss_models,
    rig.equations_as_printed,
    losses.losses_over_speed,
    losses.breakdown_over_torque,
    networks.hyperparameters,
    networks.training_bounds,
    networks.network_scheme,
    networks.predictions,
    networks.cold_start_corner,
    rig.thermal_network,
    rig.thermal_parameters,
    drive.profile,
    drive.power_loss,
    drive.temperatures,
    # Before the items that start worker processes, which may still be running afterwards.
    speed.computation_times,
    rig.kinematic_condition,
    stages.eighteen_hours,
    stages.boundary_conditions,
    others.sensitivity,
    others.published_numbers,
    losses.loss_map,
)


def reproduce(folder: Path, *, settings: StudySettings | None = None, progress: Progress = silent) -> Report:
    """Recompute the paper and write the report.

    Parameters
    ----------
    folder : Path
        Where ``report.html``, ``report.json``, ``figures/``, the FMU and its networks go; they appear together when all
        is done, files of an earlier report are replaced, others left alone
    settings : StudySettings or None
    progress : callable
        Told what is being done

    Returns
    -------
    Report

    Raises
    ------
    InputError
        If the folder cannot be written to.
    """
    begin = time.perf_counter()
    settings = settings or StudySettings()
    gearbox = load_gearbox(GEARBOX)
    with atomic_folder(folder) as stage:
        printed = train_surrogate(
            gearbox,
            preset="paper",
            seed=settings.seed,
            jobs=settings.jobs,
            progress=partial(_told, progress, "as printed"),
        )
        ours = train_surrogate(
            gearbox, seed=settings.seed, jobs=settings.jobs, samples=settings.samples,
            progress=partial(_told, progress, "ours"),
        )  # fmt: skip
        progress("packaging the FMU")
        exported = export_onnx(ours, stage / "networks", version=project_version())
        fmu = build_python_fmu(gearbox, ours, exported, stage / f"{GEARBOX}.fmu")
        items: list[Item] = []
        study = Study(gearbox=gearbox, ours=ours, printed=printed, fmu=fmu, settings=settings,
                      progress=lambda what, *_: progress(what, len(items), len(ITEMS)))  # fmt: skip
        items += (recompute(study) for recompute in ITEMS)
        provenance = {
            "version": project_version(),
            "definition": f"{GEARBOX}, SHA-256 {gearbox.hash[:16]}",
            "seed": str(settings.seed),
            "machine": f"{platform.machine()}, Python {platform.python_version()}, numpy {np.__version__}",
            "made": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
            "took": f"{time.perf_counter() - begin:.0f} s",
        }
        report = Report(items, provenance)
        report.write(stage, progress)
    return report


def _told(progress: Progress, which: str, what: str, done: int = 0, of: int = 0, /) -> None:
    progress(f"networks {which}: {what}", done, of)
