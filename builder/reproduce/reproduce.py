"""The whole of it: train, build the FMU, recompute every item of the paper, write the report."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from builder.fmu import build_python_fmu
from builder.onnx_export import export_onnx
from builder.reproduce.drive import drive_cycle
from builder.reproduce.item import Item
from builder.reproduce.long_run import long_run
from builder.reproduce.losses import breakdown_over_torque, loss_map, losses_over_speed
from builder.reproduce.networks import predictors
from builder.reproduce.published import published
from builder.reproduce.report import Report, write_report
from builder.reproduce.schemes import schemes, thermal_network
from builder.reproduce.sensitivity import sensitivity
from builder.reproduce.speed import speed
from builder.reproduce.study import Settings, Study
from builder.reproduce.tables import definition_tables, equations_as_printed, pitch_velocities_are_the_wheels
from builder.train import train_surrogate
from models.atomic_write import atomic_folder
from models.gearbox import load_gearbox
from models.version import project_version

GEARBOX = "fzg"


def reproduce(
    folder: Path, *, settings: Settings | None = None, progress: Callable[[str], None] = lambda _: None
) -> Report:
    """Recompute the paper and write the report.

    Parameters
    ----------
    folder : Path
        Where ``report.html``, ``report.json``, ``figures/``, the FMU and its networks go; they appear together when all
        is done, files of an earlier report are replaced, others left alone
    settings : Settings or None
    progress : callable
        Called with a line of text at every stage

    Returns
    -------
    Report

    Raises
    ------
    InputError
        If the folder cannot be written to.
    """
    begin = time.perf_counter()
    settings = settings or Settings()
    gearbox = load_gearbox(GEARBOX)
    with atomic_folder(folder) as stage:
        progress("training: networks as printed")
        printed = train_surrogate(gearbox, preset="paper", seed=settings.seed, jobs=settings.jobs)
        progress("training: our networks")
        ours = train_surrogate(gearbox, seed=settings.seed, jobs=settings.jobs, samples=settings.samples)
        progress("packaging the FMU")
        networks = export_onnx(ours, stage / "networks", version=project_version())
        fmu = build_python_fmu(gearbox, ours, networks, stage / f"{GEARBOX}.fmu")
        study = Study(gearbox=gearbox, ours=ours, printed=printed, fmu=fmu, settings=settings)
        items = recompute(study, progress)
        provenance = (
            ("version", project_version()),
            ("definition", f"{GEARBOX}, SHA-256 {gearbox.hash[:16]}"),
            ("seed", str(settings.seed)),
            ("machine", f"{platform.machine()}, Python {platform.python_version()}, numpy {np.__version__}"),
            ("made", datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")),
            ("took", f"{time.perf_counter() - begin:.0f} s"),
        )
        report = Report(items=tuple(items), provenance=provenance)
        write_report(report, stage, progress)
    return report


def recompute(study: Study, progress: Callable[[str], None]) -> list[Item]:
    """All items, in the order of the paper; what the paper does not have comes last."""
    # Timings first: later, worker processes of other items may still be about.
    timing = speed(study, progress)
    progress("schemes and tables")
    fig_1, fig_2 = schemes(study)
    table_1, table_2, table_5 = definition_tables(study)
    progress("losses")
    section_3 = [table_1, table_2, equations_as_printed(study), losses_over_speed(study), breakdown_over_torque(study)]
    progress("networks")
    *section_4, corner = predictors(study)
    progress("thermal network and drive cycle")
    section_5 = [thermal_network(study), table_5]
    section_6 = [*drive_cycle(study), timing, pitch_velocities_are_the_wheels(study)]
    fig_13, boundaries = long_run(study, progress)
    return [
        fig_1,
        fig_2,
        *section_3,
        *section_4,
        corner,
        *section_5,
        *section_6,
        fig_13,
        boundaries,
        sensitivity(study, progress),
        published(study),
        loss_map(study),
    ]
