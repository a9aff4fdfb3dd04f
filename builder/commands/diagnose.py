"""The verb ``diagnose``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from builder.base import console
from builder.base.options import example, gearbox_option, settings_options, worker_options
from builder.base.progress import LOADING, progress
from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError, did_you_mean
from models.correction.correction import Correction, read_correction

if TYPE_CHECKING:
    from diagnosis.decision.settings import Settings
    from diagnosis.recordings.recording import Recording
    from diagnosis.results.result import Diagnosis
    from models.assembly.gearbox import Gearbox
    from models.mechanisms import Mechanism

MOST_NOTES = 8  # on the terminal


OF_MANY = ("--holdout", "--baseline")  # options that name several recordings


class _OptionsOfMany(click.Command):
    """A command some options of which take every word up to the next option, as in its usage line."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put the option before each of its recordings, because click reads one value per option."""
        words: list[str] = []
        option = ""
        for place, word in enumerate(args):
            if word.startswith("-") and words and words[-1] in OF_MANY:
                raise click.UsageError(f"{words[-1]} names no recording; {word} follows it", ctx)
            if word == "--":
                return super().parse_args(ctx, words + args[place:])
            if word.startswith("-"):
                name = word.partition("=")[0]
                option = name if name in OF_MANY else ""
            elif option and words[-1] != option:
                words.append(option)
            words.append(word)
        return super().parse_args(ctx, words)


@click.command(
    "diagnose",
    cls=_OptionsOfMany,
    options_metavar="",
    epilog=example("diagnose examples/data/heated_rod.csv.gz@0..28800 --gearbox heated_rod"),
)
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING... [OPTIONS]")
@gearbox_option()
@click.option("--holdout", multiple=True, metavar="RECORDING...",
              help="To judge by: all up to the next option.  [default: the last quarter of each]")  # fmt: skip
@click.option("--baseline", multiple=True, metavar="RECORDING...",
              help="The same machine in other sessions, healthy: all up to the next option.")  # fmt: skip
@click.option("--switched-off", multiple=True, metavar="NAME",
              help="Only this mechanism is known to be off in the baselines; may be given several times.  [default: "
                   "every effect is]")  # fmt: skip
@click.option("--mapping", type=click.Path(path_type=Path, dir_okay=False), default=None, metavar="FILE",
              help="What the columns mean.  [default: <stem>.toml or mapping.toml next to each]")  # fmt: skip
@click.option("--correction", type=click.Path(path_type=Path, dir_okay=False), default=None, metavar="FILE",
              help="What is known of the machine already: physics of an earlier correction, or of 'add'.")  # fmt: skip
@click.option("--mechanisms", type=click.Path(path_type=Path, dir_okay=False), multiple=True,
              metavar="FILE", help="Your own mechanisms (.toml or .py), added to the catalogue's.")  # fmt: skip
@click.option("--without-mechanism", "without", multiple=True, metavar="NAME",
              help="Leave one of the catalogue's mechanisms out; may be given several times.")  # fmt: skip
@click.option("--output", type=click.Path(path_type=Path, file_okay=False), default=Path("out/diagnosis"),
              show_default=True, metavar="DIR", help="Folder for the report and what belongs to it.")  # fmt: skip
@settings_options
@click.option("--fleet", is_flag=True,
              help="RECORDING is a folder with one folder per gearbox; hold* in it is held out, baseline* is a "
                   "baseline.")  # fmt: skip
@worker_options(
    jobs_help="Gearboxes of a fleet at the same time.",
    dask_help="Scheduler of a Dask cluster that the gearboxes of a fleet are spread over.",
)
def diagnose(
    recordings: tuple[str, ...],
    gearbox: str,
    holdout: tuple[str, ...],
    baseline: tuple[str, ...],
    switched_off: tuple[str, ...],
    mapping: Path | None,
    correction: Path | None,
    mechanisms: tuple[Path, ...],
    without: tuple[str, ...],
    output: Path,
    settings: Settings,
    jobs: int,
    fleet: bool,
    dask: str | None,
) -> None:
    """Say whether recordings agree with the model, and what differs.

    Where they do not agree it names the part, the physics, and how strong that is.

    RECORDING is a table (.csv, .csv.gz, .parquet, .mf4) with the columns of a cycle and what was measured:
    T_<node>_degC, P_loss_W. FILE+FILE joins files that follow each other in time; FILE@FROM..TO is a part.

    Of a fleet every gearbox gets its own report, and all together one table (summary.csv).
    """
    with progress(LOADING):
        from diagnosis.diagnose_recordings import diagnose as run
        from diagnosis.recordings.read import read_by_role
        from diagnosis.report.write import files_left_over, write_files
        from models.base.atomic_write import atomic_folder
        from models.mechanisms import CATALOGUE
        from models.mechanisms.user_files import check_placeable, load_mechanisms

    _check_options(recordings, (*holdout, *baseline), dask, fleet=fleet)
    if click.get_current_context().get_parameter_source("gearbox") is ParameterSource.DEFAULT:
        console.err.print(f"note: the machine is taken to be {gearbox!r}, the FZG rig; --gearbox names another one")
    definition = load_gearbox(gearbox)
    known = None if correction is None else read_correction(correction, definition)
    catalogue = dict(CATALOGUE)
    for file in mechanisms:
        own = load_mechanisms(file)
        check_placeable(own, definition, file)
        for mechanism in own:
            if mechanism.name in catalogue:
                raise InputError(f"{file}: a mechanism {mechanism.name!r} exists already; give yours another name")
            catalogue[mechanism.name] = mechanism
    for name in without:
        if catalogue.pop(name, None) is None:
            raise InputError(f"--without-mechanism {name}: is not in the catalogue{did_you_mean(name, CATALOGUE)}")
    if fleet:
        _diagnose_fleet(
            Path(recordings[0]), definition, output, mapping=mapping, catalogue=catalogue, correction=known,
            switched_off=switched_off, settings=settings, jobs=jobs, dask=dask,
        )  # fmt: skip
        return
    with progress("reading the recordings"):
        train, held, healthy = read_by_role(recordings, holdout, baseline, definition.network(), mapping=mapping)
    given = [
        *(p for r in (*train, *held, *healthy) for p in r.files),
        *mechanisms,
        Path(gearbox),
        *(file for file in (mapping, correction) if file),
    ]
    old = files_left_over(output, (*train, *held), given)
    _print_notes((*train, *held, *healthy))
    with atomic_folder(output) as stage, progress("starting") as tell:
        found = run(train, definition, holdout=held, baseline=healthy, switched_off=switched_off, correction=known,
                    settings=settings, catalogue=catalogue, progress=tell)  # fmt: skip
        tell("writing the report")
        written = [path.name for path in write_files(found, definition, [*train, *held], stage)]
    for path in old:
        path.unlink(missing_ok=True)
    console.out.print("\n".join(found.summary()))
    _print_own_notes(found, (*train, *held, *healthy))
    console.out.print()
    for name in written:
        console.out.print(f"wrote {output / name}")


def _print_notes(recordings: Sequence[Recording]) -> None:
    """Print the first notes on cleaned, assumed or unused data; the report has all of them."""
    names: dict[str, list[str]] = {}
    for recording in recordings:
        for note in recording.notes:
            names.setdefault(note, []).append(recording.name)
    notes = [f"{', '.join(of)}: {note}" for note, of in names.items()]
    for note in notes[:MOST_NOTES]:
        console.err.print(f"note: {note}")
    if len(notes) > MOST_NOTES:
        console.err.print(f"and {len(notes) - MOST_NOTES} more: the report lists all notes")


def _print_own_notes(found: Diagnosis, recordings: Sequence[Recording]) -> None:
    """Print the notes of a diagnosis that are not about its recordings."""
    known = {f"{recording.name}: {note}" for recording in recordings for note in recording.notes}
    for note in found.notes:
        if note not in known:
            console.out.print(f"Note: {note}")


def _check_options(recordings: tuple[str, ...], others: tuple[str, ...], dask: str | None, *, fleet: bool) -> None:
    if not fleet and dask is not None:
        raise click.UsageError("--dask spreads the gearboxes of a fleet; give --fleet with it")
    if fleet and (len(recordings) != 1 or others):
        raise click.UsageError(
            "--fleet takes one folder, with a folder per gearbox; hold* in it is held out, baseline* is a baseline"
        )


def _diagnose_fleet(
    folder: Path, gearbox: Gearbox, output: Path, *, mapping: Path | None, catalogue: Mapping[str, Mechanism],
    correction: Correction | None, switched_off: tuple[str, ...], settings: Settings, jobs: int, dask: str | None,
) -> None:  # fmt: skip
    from builder.workflows.fleet import SUMMARY, diagnose_fleet, members_of, show_summary

    outcomes = diagnose_fleet(
        members_of(folder, without=output), gearbox, output, mapping=mapping, catalogue=catalogue,
        correction=correction, switched_off=switched_off, settings=settings, jobs=jobs, dask=dask,
    )  # fmt: skip
    rows = [outcome.row for outcome in outcomes]
    show_summary(rows)
    console.out.print(f"wrote {output / SUMMARY}, and a folder for each that was diagnosed")
    faults = [f"{outcome.row['gearbox']}:\n{outcome.fault}" for outcome in outcomes if outcome.fault]
    for fault in faults:
        console.err.print(fault, style="red")
    failed = [f"{row['gearbox']}: {row['error']}" for row in rows if row["error"]]
    if failed:
        message = "\n".join([f"{len(failed)} of {len(outcomes)} gearboxes could not be diagnosed:", *failed])
        if faults:
            console.err.print(message, style="red")
            raise SystemExit(1)
        raise InputError(message)
