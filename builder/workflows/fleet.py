"""A fleet: one folder of recordings per gearbox, one report each and one table of all.

Recordings are read here and sent to the workers, reports are sent back: the workers of a cluster need no common file
system.
"""

from __future__ import annotations

import math
import tempfile
import traceback
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from builder.base import console
from builder.base.progress import progress
from diagnosis.decision.settings import Settings
from diagnosis.diagnose_recordings import diagnose
from diagnosis.recordings.names import RECORDING_KINDS
from diagnosis.recordings.read import ByRole, read_by_role
from diagnosis.report.write import files_left_over, write_files
from diagnosis.results.result import Diagnosis
from models.assembly.gearbox import Gearbox
from models.base.atomic_write import atomic_folder
from models.base.errors import InputError
from models.base.parallel import iterate_parallel
from models.correction.correction import Correction
from models.files.output_files import write_table
from models.mechanisms import Mechanism

HELD_OUT = "hold"  # prefix of held-out recordings, or of a folder with them
BASELINE = "baseline"  # of baselines
SUMMARY, HEADING = "summary.csv", 3  # columns by which one is known: later ones changed between versions
ERROR = "error"  # instead of a verdict
NAN = float("nan")


@dataclass(frozen=True, kw_only=True)
class Member:
    """One gearbox of a fleet.

    Attributes
    ----------
    name : str
        Name of its folder
    train, holdout, baseline : tuple of Path
        Recordings to learn from, held-out ones and baselines
    fault : str
        Reason why its folder cannot be used, or ``""``
    """

    name: str
    train: tuple[Path, ...] = ()
    holdout: tuple[Path, ...] = ()
    baseline: tuple[Path, ...] = ()
    fault: str = ""


# Row of a gearbox in the summary, as it is without a diagnosis: name of its folder, verdict, mechanisms with place and
# probability, their mean heat or the unknown one, errors of held-out temperatures (free-running), why there is none.
Row = dict[str, Any]
NO_DIAGNOSIS: Mapping[str, Any] = {
    "gearbox": "", "verdict": ERROR, "found": "", "heat_W": NAN, "log_e_value": NAN, "threshold": NAN,
    "rmse_before_K": NAN, "rmse_calibrated_K": NAN, "rmse_after_K": NAN, "error": "",
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class MemberOutcome:
    """Result of one gearbox.

    Attributes
    ----------
    row : Row
    files : mapping of name to bytes
        Report and what belongs to it; empty without a diagnosis
    fault : str
        Traceback of an error in this program, or ``""``
    """

    row: Row
    files: Mapping[str, bytes] = field(default_factory=dict)
    fault: str = ""


def members_of(folder: Path, *, without: Path) -> tuple[Member, ...]:
    """The gearboxes of a fleet: every folder in `folder`, with the recordings in it.

    A recording whose name begins with ``hold``, and every one in a folder ``hold...`` inside, is held out; those of
    ``baseline...`` are baselines.

    Parameters
    ----------
    folder : Path
    without : Path
        The output folder, which may be inside and is no gearbox

    Raises
    ------
    InputError
        If the folder cannot be read or has no folder of a gearbox.
    """
    try:
        inside = sorted(p for p in folder.iterdir() if p.is_dir() and not p.name.startswith("."))
    except OSError as error:
        raise InputError(f"{folder}: cannot be read ({error.strerror}); --fleet takes a folder of folders") from error
    homes = [home for home in inside if home.resolve() not in (without.resolve(), *without.resolve().parents)]
    if not homes:
        own = "; it holds recordings itself: name them, without --fleet" if _recordings(folder) else ""
        raise InputError(f"{folder}: has no folder of a gearbox in it, one per gearbox with its recordings{own}")
    return tuple(_member(home) for home in homes)


def _member(home: Path) -> Member:
    try:
        own = _recordings(home)
        inside = [p for p in sorted(home.iterdir()) if p.is_dir()]
        held, healthy = (
            tuple(p for p in own if _is_called(p, role))
            + tuple(p for inner in inside if _is_called(inner, role) for p in _recordings(inner))
            for role in (HELD_OUT, BASELINE)
        )
    except OSError as error:
        return Member(name=home.name, fault=f"{error.filename}: cannot be read ({error.strerror})")
    train = tuple(p for p in own if p not in (*held, *healthy))
    kinds = ", ".join(RECORDING_KINDS)
    fault = "" if train else f"{home}: has no recording to learn from ({kinds}; {HELD_OUT}... is held out)"
    return Member(name=home.name, train=train, holdout=held, baseline=healthy, fault=fault)


def _is_called(path: Path, role: str) -> bool:
    return path.name.lower().startswith(role)


def _recordings(folder: Path) -> list[Path]:
    return [
        p for p in sorted(folder.iterdir())
        if p.name.lower().endswith(RECORDING_KINDS) and not p.name.startswith(".") and p.is_file()
    ]  # fmt: skip


def diagnose_fleet(
    members: Sequence[Member],
    gearbox: Gearbox,
    output: Path,
    *,
    mapping: Path | None,
    catalogue: Mapping[str, Mechanism],
    correction: Correction | None = None,
    switched_off: Sequence[str] = (),
    settings: Settings,
    jobs: int = 1,
    dask: str | None = None,
) -> list[MemberOutcome]:
    """Diagnose every gearbox of a fleet; an error with one is its row in the summary, and the others go on.

    Parameters
    ----------
    members : sequence of Member
    gearbox : Gearbox
        Their definition
    output : Path
        Gets a folder per gearbox as soon as it is done, and at the end ``summary.csv``
    mapping : Path or None
        See :func:`diagnosis.recordings.read.read_recordings`
    catalogue, correction, switched_off, settings
        See :func:`diagnosis.diagnose_recordings.diagnose`
    jobs : int
        Gearboxes at the same time on this machine
    dask : str or None
        Scheduler of a Dask cluster that does the work instead

    Returns
    -------
    list of MemberOutcome
        In the order of `members`

    Raises
    ------
    InputError
        If the output cannot be written to, or no scheduler answers.
    """
    _refuse_to_replace_summary(output / SUMMARY)
    outcomes, old = dict[str, MemberOutcome](), dict[str, list[Path]]()

    def readable() -> Iterator[tuple[object, ...]]:
        network = gearbox.network()
        for member in members:
            try:
                if member.fault:
                    raise InputError(member.fault)
                train, held, healthy = read_by_role(
                    member.train, member.holdout, member.baseline, network, mapping=mapping
                )
                read = [p for r in (*train, *held, *healthy) for p in r.files]
                old[member.name] = files_left_over(output / member.name, (*train, *held), read)
                recordings = (train, held, healthy)
                yield member.name, recordings, gearbox, catalogue, correction, switched_off, settings
            except InputError as error:
                outcomes[member.name] = _without_diagnosis(member.name, error)

    with atomic_folder(output) as stage, progress("diagnosing the fleet") as show:
        show("diagnosing the fleet", 0, len(members))
        try:
            for outcome in iterate_parallel(_diagnose, readable(), jobs=min(jobs, len(members)), dask=dask):
                name = outcome.row["gearbox"]
                outcomes[name] = _write(outcome, output, old[name])
                show("diagnosing the fleet", len(outcomes), len(members))
        except InputError:
            raise
        except Exception as error:  # noqa: BLE001 - a worker that dies takes along what is not done yet
            for member in members:
                outcomes.setdefault(member.name, _without_diagnosis(member.name, error))
        rows = [outcomes[member.name].row for member in members]
        write_table(stage / SUMMARY, {key: [row[key] for row in rows] for key in NO_DIAGNOSIS})
    return [outcomes[member.name] for member in members]


def _diagnose(
    name: str, recordings: ByRole, gearbox: Gearbox, catalogue: Mapping[str, Mechanism], correction: Correction | None,
    switched_off: Sequence[str], settings: Settings,
) -> MemberOutcome:  # fmt: skip
    train, holdout, baseline = recordings
    try:
        with tempfile.TemporaryDirectory() as folder:
            found = diagnose(train, gearbox, holdout=holdout, baseline=baseline, switched_off=switched_off,
                             catalogue=catalogue, correction=correction, settings=settings)  # fmt: skip
            written = write_files(found, gearbox, [*train, *holdout], Path(folder))
            return MemberOutcome(row=_row(name, found), files={path.name: path.read_bytes() for path in written})
    except Exception as error:  # noqa: BLE001 - shown with its traceback at the end, when the others are done
        return _without_diagnosis(name, error)


def _without_diagnosis(name: str, error: Exception) -> MemberOutcome:
    fault = "" if isinstance(error, InputError) else "".join(traceback.format_exception(error))
    text = f"a fault of this program: {fault.splitlines()[-1]}" if fault else str(error)
    return MemberOutcome(row={**NO_DIAGNOSIS, "gearbox": name, "error": text}, fault=fault)


def _refuse_to_replace_summary(path: Path) -> None:
    """Refuse to write over a table that no fleet wrote."""
    try:
        with path.open(encoding="utf-8") as file:
            header = file.readline()
    except (OSError, ValueError):
        header = ""
    if path.exists() and not header.startswith(",".join(list(NO_DIAGNOSIS)[:HEADING])):
        raise InputError(f"{path}: exists, and no fleet wrote it; choose another --output")


def _write(outcome: MemberOutcome, output: Path, old: Sequence[Path]) -> MemberOutcome:
    if not outcome.files:
        return outcome
    try:
        with atomic_folder(output / outcome.row["gearbox"]) as stage:
            for name, content in outcome.files.items():
                (stage / name).write_bytes(content)
    except InputError as error:
        return _without_diagnosis(outcome.row["gearbox"], error)
    for path in old:
        path.unlink(missing_ok=True)
    return outcome


def _row(name: str, found: Diagnosis) -> Row:
    unknown = found.location[0].heat_mean_W if found.verdict == "unexplained" and found.location else 0.0
    return {
        **NO_DIAGNOSIS,
        "gearbox": name,
        "verdict": found.verdict,
        "found": "; ".join(f"{f.grade}: {f.title} ({f.sureness:.2f})" for f in found.findings),
        "heat_W": sum(f.heat_mean_W for f in found.findings) if found.findings else unknown,
        "log_e_value": found.log_e_value,
        "threshold": found.threshold,
        "rmse_before_K": found.holdout.before,
        "rmse_calibrated_K": found.holdout.calibrated,
        "rmse_after_K": found.holdout.after,
    }


def show_summary(rows: Sequence[Row]) -> None:
    """Print the summary."""
    console.table(
        "Fleet; errors of held-out temperatures in K",
        ["gearbox", "verdict", "found", "heat W", "as delivered", "calibrated", "with findings"],
        [
            [r["gearbox"], r["verdict"].replace("_", " "), r["found"], _number(r["heat_W"], 1),
             *(_number(r[key], 2) for key in ("rmse_before_K", "rmse_calibrated_K", "rmse_after_K"))]
            for r in rows
        ],
        text_columns=3,
    )  # fmt: skip


def _number(value: float, decimals: int) -> str:
    return "" if math.isnan(value) else f"{value:.{decimals}f}"
