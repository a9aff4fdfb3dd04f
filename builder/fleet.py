"""A fleet: one folder of recordings per gearbox, diagnosed side by side, one report each and one table of all.

Recordings are read here and travel to whoever does the work; reports travel back. So the workers of a cluster need no
common file system.
"""

from __future__ import annotations

import tempfile
import traceback
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, fields
from pathlib import Path

from joblib import Parallel, delayed
from threadpoolctl import threadpool_limits

from builder import console
from builder.build import staging
from builder.doe import on_dask
from builder.files import refuse_to_replace, write_table
from diagnosis import diagnose
from diagnosis.files import names_of_files, write_files
from diagnosis.read_recordings import read_train_and_holdout
from diagnosis.recording import Recording
from diagnosis.result import Diagnosis
from diagnosis.time_axis import RECORDING_KINDS
from models.errors import InputError
from models.gearbox import Gearbox
from models.mechanisms import Mechanism

HELD_OUT = "hold"  # how names of recordings, or of a folder of them, to judge by begin
SUMMARY = "summary.csv"
ERROR = "error"  # in the place of a verdict
NAN = float("nan")


@dataclass(frozen=True, kw_only=True)
class Member:
    """One gearbox of a fleet.

    Attributes
    ----------
    name : str
        Of its folder
    train, holdout : tuple of Path
        Recordings to learn from, and to judge by
    fault : str
        Why its folder cannot be used, or ``""``
    """

    name: str
    train: tuple[Path, ...] = ()
    holdout: tuple[Path, ...] = ()
    fault: str = ""


@dataclass(frozen=True, kw_only=True)
class Row:
    """One gearbox in the summary.

    Attributes
    ----------
    gearbox, verdict : str
        Name of its folder; see :class:`diagnosis.result.Diagnosis`, or ``error``
    found : str
        Mechanisms with place and probability, the first one first
    heat_W : float
        Mean heat of all that was found, [W]; of the unknown heat where it has no form
    p_value : float
    rmse_before_K, rmse_calibrated_K, rmse_after_K : float
        Of held-out temperatures, free-running, [K]
    error : str
        Why there is no diagnosis, or ``""``
    """

    gearbox: str
    verdict: str = ERROR
    found: str = ""
    heat_W: float = NAN
    p_value: float = NAN
    rmse_before_K: float = NAN
    rmse_calibrated_K: float = NAN
    rmse_after_K: float = NAN
    error: str = ""


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What became of one gearbox.

    Attributes
    ----------
    row : Row
    files : mapping of name to bytes
        Report and what belongs to it; empty without a diagnosis
    fault : str
        Traceback, where this program is at fault and not the input
    """

    row: Row
    files: Mapping[str, bytes]
    fault: str = ""


@dataclass(frozen=True, kw_only=True)
class Fleet:
    """The outcome of :func:`diagnose_fleet`: rows by name, and tracebacks of our own faults by name."""

    rows: tuple[Row, ...]
    faults: Mapping[str, str]

    def show(self) -> None:
        """Print the summary."""
        numbers = [
            [f"{r.heat_W:.1f}", *(f"{v:.2f}" for v in (r.rmse_before_K, r.rmse_calibrated_K, r.rmse_after_K))]
            for r in self.rows
        ]
        console.table(
            "Fleet; errors of held-out temperatures in K",
            ["gearbox", "verdict", "found", "heat W", "as delivered", "calibrated", "with what was found"],
            [
                [r.gearbox, r.verdict.replace("_", " "), r.found, *("" if v == "nan" else v for v in n)]
                for r, n in zip(self.rows, numbers, strict=True)
            ],
            text_columns=3,
        )


def members_of(folder: Path, *, without: Path) -> tuple[Member, ...]:
    """The gearboxes of a fleet: every folder in `folder`, with the recordings in it.

    A recording whose name begins with ``hold``, and every one in a folder ``hold...`` inside, is held out.

    Parameters
    ----------
    folder : Path
    without : Path
        Folder that holds no recordings though it may lie there: the output

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
        apart = [p for p in sorted(home.iterdir()) if p.is_dir() and _is_held_out(p)]
        held = [p for p in own if _is_held_out(p)] + [p for inner in apart for p in _recordings(inner)]
    except OSError as error:
        return Member(name=home.name, fault=f"{error.filename}: cannot be read ({error.strerror})")
    train = tuple(p for p in own if not _is_held_out(p))
    kinds = ", ".join(RECORDING_KINDS)
    fault = "" if train else f"{home}: has no recording to learn from ({kinds}; {HELD_OUT}... is held out)"
    return Member(name=home.name, train=train, holdout=tuple(held), fault=fault)


def _is_held_out(path: Path) -> bool:
    return path.name.lower().startswith(HELD_OUT)


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
    false_alarm_rate: float,
    jobs: int = 1,
    dask_address: str | None = None,
) -> Fleet:
    """Diagnose every gearbox of a fleet; what goes wrong with one is its row and leaves the others alone.

    Parameters
    ----------
    members : sequence of Member
    gearbox : Gearbox
        Their definition
    output : Path
        Gets a folder per gearbox as it is done, and at the end ``summary.csv``
    mapping : Path or None
        See :func:`diagnosis.read_recordings.read_recordings`
    catalogue, false_alarm_rate
        See :func:`diagnosis.diagnose`
    jobs : int
        Gearboxes side by side on this machine; a single one gets all of them
    dask_address : str or None
        Scheduler of a dask cluster that does the work instead

    Returns
    -------
    Fleet

    Raises
    ------
    InputError
        If the output cannot be written to, or no scheduler answers.
    """
    outcomes: dict[str, Outcome] = {}
    inside = jobs if len(members) == 1 and dask_address is None else 1

    def tasks() -> Iterator[object]:
        network = gearbox.network()
        for member in members:
            try:
                if member.fault:
                    raise InputError(member.fault)
                train, held = read_train_and_holdout(member.train, member.holdout, network, mapping=mapping)
                files = names_of_files((*train, *held))
                refuse_to_replace(
                    [p for r in (*train, *held) for p in r.files], [output / member.name / name for name in files]
                )
            except InputError as error:
                outcomes[member.name] = _refused(member.name, str(error))
            else:
                yield delayed(_diagnosed)(member.name, train, held, gearbox, catalogue, false_alarm_rate, inside)

    with (
        staging(output) as stage,
        on_dask(dask_address) if dask_address else nullcontext(),
        console.progress_bar("diagnosing the fleet") as tell,
    ):
        tell(0, len(members))
        workers = Parallel(
            n_jobs=None if dask_address else min(jobs, len(members)), return_as="generator_unordered", batch_size=1
        )
        try:
            for outcome in workers(tasks()):
                outcomes[outcome.row.gearbox] = _written(outcome, output)
                tell(len(outcomes), len(members))
        except Exception:  # noqa: BLE001 - a worker that died takes along what it did, not what others have done
            lost = traceback.format_exc()
            for member in members:
                if member.name not in outcomes:
                    outcomes[member.name] = _failed(member.name, lost)
        rows = tuple(outcomes[member.name].row for member in members)
        write_table(stage / SUMMARY, {f.name: [getattr(row, f.name) for row in rows] for f in fields(Row)})
    return Fleet(rows=rows, faults={name: o.fault for name, o in sorted(outcomes.items()) if o.fault})


def _diagnosed(
    name: str, train: tuple[Recording, ...], holdout: tuple[Recording, ...], gearbox: Gearbox,
    catalogue: Mapping[str, Mechanism], false_alarm_rate: float, jobs: int,
) -> Outcome:  # fmt: skip
    """The work on one gearbox, wherever it is done."""
    try:
        with threadpool_limits(1), tempfile.TemporaryDirectory() as folder:
            found = diagnose(train, gearbox, holdout=holdout, catalogue=catalogue, false_alarm_rate=false_alarm_rate,
                             jobs=jobs)  # fmt: skip
            written = write_files(found, gearbox, [*train, *holdout], Path(folder))
            return Outcome(row=_row(name, found), files={path.name: path.read_bytes() for path in written})
    except InputError as error:
        return _refused(name, str(error))
    except Exception:  # noqa: BLE001 - told with its traceback at the end, when the others are done
        return _failed(name, traceback.format_exc())


def _refused(name: str, error: str) -> Outcome:
    return Outcome(row=Row(gearbox=name, error=error), files={})


def _failed(name: str, fault: str) -> Outcome:
    last = fault.strip().splitlines()[-1]
    return Outcome(row=Row(gearbox=name, error=f"a fault of this program: {last}"), files={}, fault=fault)


def _written(outcome: Outcome, output: Path) -> Outcome:
    if not outcome.files:
        return outcome
    try:
        with staging(output / outcome.row.gearbox) as stage:
            for name, content in outcome.files.items():
                (stage / name).write_bytes(content)
    except InputError as error:
        return _refused(outcome.row.gearbox, str(error))
    return outcome


def _row(name: str, found: Diagnosis) -> Row:
    unknown = found.location[0].heat_mean_W if found.verdict == "unexplained" and found.location else 0.0
    heat = sum(f.heat_mean_W for f in found.findings) if found.findings else unknown
    return Row(
        gearbox=name,
        verdict=found.verdict,
        found="; ".join(f"{f.mechanism} at {f.place} ({f.probability:.2f})" for f in found.findings),
        heat_W=heat,
        p_value=found.p_value,
        rmse_before_K=found.holdout.before,
        rmse_calibrated_K=found.holdout.calibrated,
        rmse_after_K=found.holdout.after,
    )
