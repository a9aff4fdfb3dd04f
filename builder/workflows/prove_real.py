"""A real plant from its definition and its recording to a corrected FMU, in one go."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from builder.native.native_fmu import build_native_fmu
from builder.workflows.held_out_fmu import errors_of, fmu_errors, overall
from diagnosis.diagnose_recordings import diagnose
from diagnosis.engine.fit import calibrate
from diagnosis.engine.predict import predict, rmse
from diagnosis.engine.prepare import held_out_experiment, prepare_experiment
from diagnosis.engine.set_apart import without_channels
from diagnosis.recordings.read import read_by_role
from diagnosis.recordings.recording import Recording
from diagnosis.report.write import CORRECTION, write_files
from diagnosis.results.result import Diagnosis
from diagnosis.results.result_parts import MODELS
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.atomic_write import atomic_folder
from models.base.errors import InputError
from models.base.progress import Progress, silent
from models.base.version import project_version
from models.correction.correction import read_correction

RESULT = "real.json"
SCHEMA = 1
DATA = Path("examples") / "data"
BY_SOUND = "calibrated by the sound channels"
MOST_RATIO, MOST_FMU_K, MOST_S = 0.9, 0.02, 180.0  # after to calibrated by the sound channels; FMU less report; time


@dataclass(frozen=True, kw_only=True)
class RealPlant:
    """A plant with a recording in ``examples/data``.

    Attributes
    ----------
    name : str
    definition : str
        Of the machine as first modelled
    file : str
    train, hold : str
        Parts of it to learn from and to judge by
    broken : tuple of str
        Channels that those who recorded them call broken
    """

    name: str
    definition: str
    file: str
    train: str
    hold: str
    broken: tuple[str, ...] = ()


PLANTS: Mapping[str, RealPlant] = {
    "rod": RealPlant(name="rod", definition="heated_rod", file="heated_rod.csv.gz", train="0..28800",
                     hold="28800..86390", broken=("cell_6__NTC7",)),
}  # fmt: skip


def prove_real(plant: RealPlant, output: Path, *, progress: Progress = silent) -> dict[str, Any]:
    """Diagnose a real plant, build the FMU that its correction makes, and compare that with the held-out recording.

    Parameters
    ----------
    plant : RealPlant
    output : Path
        Gets everything that a diagnosis writes, ``<definition>_native.fmu`` and ``real.json``
    progress : callable
        Told what is being done

    Returns
    -------
    dict
        ``real.json``: errors over the held-out recording by channel, limits, and which of them are kept

    Raises
    ------
    InputError
        If the recording is not there, or no FMU can be built here.
    """
    begin = time.perf_counter()
    file, gearbox = data_file(plant.file), load_gearbox(plant.definition)
    network = gearbox.network()
    train, held, _ = read_by_role([f"{file}@{plant.train}"], [f"{file}@{plant.hold}"], [], network)
    with atomic_folder(output) as stage:
        found = diagnose(train, gearbox, holdout=held, progress=progress)
        progress("writing the report")
        write_files(found, gearbox, [*train, *held], stage)
        correction = read_correction(stage / CORRECTION, gearbox)
        progress("building the FMU")
        fmu = stage / f"{plant.definition}_native.fmu"
        build_native_fmu(
            gearbox, None, fmu, network=gearbox.network_of_laws(correction.network(gearbox)),
            correction=correction, progress=progress,
        )  # fmt: skip
        progress("driving the FMU")
        errors = {state: errors_of(found, state) for state in MODELS} | {
            "fmu": fmu_errors(fmu, correction, found, held)
        }
        progress("calibrating by the sound channels")
        errors[BY_SOUND] = errors_by_sound(plant, gearbox, train, held)
        result = result_of(plant, found, errors, time.perf_counter() - begin)
        (stage / RESULT).write_text(json.dumps(result, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    return result


def errors_by_sound(
    plant: RealPlant, gearbox: Gearbox, train: Sequence[Recording], held: Sequence[Recording]
) -> dict[str, float]:
    """Held-out error of the machine calibrated without the broken channels, by channel, [K].

    A calibration with them is pulled by what is broken: to be better than that is no finding of physics.
    """
    setup, experiment = prepare_experiment(gearbox, train, held)
    fit, judged = calibrate(without_channels(experiment, plant.broken)), held_out_experiment(setup, experiment)
    found = [predict(judged, index, fit.z) for index in range(len(judged.pieces))]
    each = rmse(np.concatenate([one.residual for one in found]), np.concatenate([one.weights for one in found]))
    return dict(zip(setup.channels, each.tolist(), strict=True))


def data_file(name: str) -> Path:
    """A recording of ``examples/data``: of the checkout that this program is from, or that one works in.

    Raises
    ------
    InputError
        If it is in neither, as of a program installed from a wheel.
    """
    root = Path(str(resources.files("builder"))).parent
    for folder in (root / DATA, Path.cwd() / DATA):
        if (folder / name).is_file():
            return folder / name
    raise InputError(
        f"{DATA / name}: is neither next to the program ({root}) nor in the current folder; an installed program has "
        "no recordings: get the source of the project and run the command in its folder"
    )


def result_of(
    plant: RealPlant, found: Diagnosis, errors: Mapping[str, dict[str, float]], seconds: float
) -> dict[str, Any]:
    """The content of ``real.json``.

    Parameters
    ----------
    plant : RealPlant
    found : Diagnosis
    errors : mapping of state to mapping of channel to float
        Over the held-out recording: before, calibrated, after, of the FMU, and calibrated by the sound channels, [K]
    seconds : float
        From start to end
    """
    every = {state: overall(of) for state, of in errors.items()}
    sound = {state: overall(of, plant.broken) for state, of in errors.items()}
    ratio, off = sound["after"] / sound[BY_SOUND], abs(sound["fmu"] - sound["after"])
    return {
        "schema": SCHEMA,
        "plant": plant.name,
        "definition": plant.definition,
        "recording": {"file": plant.file, "train": plant.train, "hold": plant.hold},
        "version": project_version(),
        "verdict": found.verdict,
        "findings": [{"title": one.title, "grade": one.grade, "probability": one.sureness} for one in found.findings],
        "broken": {"known": list(plant.broken), "found": list(found.faulty)},
        "rmse_K": {"all": every, "without_broken": sound},
        "channels": {name: {state: of[name] for state, of in errors.items()} for name in errors["after"]},
        "ratio": ratio,
        "fmu_less_report_K": off,
        "seconds": seconds,
        "limits": {"ratio": MOST_RATIO, "fmu_less_report_K": MOST_FMU_K, "seconds": MOST_S},
        "kept": {
            "broken_found": set(found.faulty) == set(plant.broken),
            "ratio": ratio <= MOST_RATIO,
            "fmu_less_report_K": off <= MOST_FMU_K,
            "seconds": seconds <= MOST_S,
        },
    }


def rows_of(result: Mapping[str, Any]) -> list[list[str]]:
    """The table of a result: what, its value, its limit, and whether it is kept."""
    kept, limits, rmse = result["kept"], result["limits"], result["rmse_K"]
    broken = result["broken"]
    rows = [["broken channels", ", ".join(broken["found"]) or "none found", ", ".join(broken["known"]),
             _word(kept["broken_found"])]]  # fmt: skip
    for which, title in (("without_broken", "without them"), ("all", "with them")):
        rows += [[f"held-out rmse {title}, {state}", f"{rmse[which][state]:.3f} K", "", ""] for state in rmse[which]]
    return [
        *rows,
        [f"after / {BY_SOUND}, without them", f"{result['ratio']:.3f}", f"{limits['ratio']:g}", _word(kept["ratio"])],
        ["FMU less report, without them", f"{result['fmu_less_report_K']:.4f} K",
         f"{limits['fmu_less_report_K']:g} K", _word(kept["fmu_less_report_K"])],
        ["from start to end", f"{result['seconds']:.0f} s", f"{limits['seconds']:g} s", _word(kept["seconds"])],
    ]  # fmt: skip


def _word(kept: bool) -> str:
    return "kept" if kept else "not kept"
