"""The verb ``diagnose``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from builder import console
from models.errors import InputError
from models.gearbox import known_gearboxes, load_gearbox

if TYPE_CHECKING:
    from diagnosis.recording import Recording
    from models.gearbox import Gearbox


@click.command("diagnose")
@click.argument("recordings", nargs=-1, required=True, metavar="RECORDING...")
@click.option("--gearbox", default="fzg", show_default=True, metavar="NAME|FILE",
              help=f"Name ({', '.join(known_gearboxes())}) or definition file (TOML).")  # fmt: skip
@click.option("--holdout", multiple=True, metavar="RECORDING",
              help="To judge by; may be given several times.  [default: the last quarter of each]")  # fmt: skip
@click.option("--mapping", type=click.Path(path_type=Path, dir_okay=False), default=None, metavar="FILE",
              help="What the columns mean.  [default: <stem>.toml or mapping.toml beside each]")  # fmt: skip
@click.option("--mechanisms", type=click.Path(path_type=Path, dir_okay=False), multiple=True,
              metavar="FILE", help="Your own mechanisms (.toml or .py), beside the catalogue's.")  # fmt: skip
@click.option("--output", type=click.Path(path_type=Path, file_okay=False), default=Path("out/diagnosis"),
              show_default=True, metavar="DIR", help="Folder for the report and what belongs to it.")  # fmt: skip
@click.option("--false-alarm-rate", type=click.FloatRange(min=1e-4, max=0.5), default=0.05, show_default=True,
              metavar="P", help="How often recordings that agree may be called inconsistent.")  # fmt: skip
@click.option("--jobs", type=click.IntRange(min=1), default=None, metavar="N",
              help="Processes on this machine.  [default: all cores]")  # fmt: skip
def diagnose(
    recordings: tuple[str, ...],
    gearbox: str,
    holdout: tuple[str, ...],
    mapping: Path | None,
    mechanisms: tuple[Path, ...],
    output: Path,
    false_alarm_rate: float,
    jobs: int | None,
) -> None:
    """Say whether recordings of a real gearbox agree with its model; if not, where, and by what physics.

    RECORDING is a table (.csv, .csv.gz, .parquet, .mf4), or a part of one (FILE@start..end), with the columns of a
    cycle and what was measured: T_<node>_degC, P_loss_W.
    """
    from builder.build import staging
    from diagnosis import diagnose as run
    from diagnosis.files import write_files
    from models.mechanisms import CATALOGUE
    from models.mechanisms.user_files import load_mechanisms

    definition = load_gearbox(gearbox)
    catalogue = dict(CATALOGUE)
    for file in mechanisms:
        for mechanism in load_mechanisms(file):
            if mechanism.name in catalogue:
                raise InputError(f"{file}: a mechanism {mechanism.name!r} exists already; give yours another name")
            catalogue[mechanism.name] = mechanism
    train, held = _read(recordings, definition, mapping), _read(holdout, definition, mapping)
    with staging(output) as stage, _told() as tell:
        found = run(train, definition, holdout=held, false_alarm_rate=false_alarm_rate, catalogue=catalogue,
                    jobs=_jobs(jobs), progress=tell)  # fmt: skip
        tell("writing the report")
        names = [path.name for path in write_files(found, definition, [*train, *held], stage)]
    for line in found.summary():
        console.out.print(line, markup=False)
    console.out.print()
    for name in names:
        console.out.print(f"wrote {output / name}")


def _read(paths: tuple[str, ...], gearbox: Gearbox, mapping: Path | None) -> tuple[Recording, ...]:
    from diagnosis.recording import read_recordings

    return read_recordings(paths, gearbox.network(), mapping=mapping) if paths else ()


def _jobs(asked: int | None) -> int:
    from joblib import cpu_count

    return int(cpu_count()) if asked is None else asked


@contextmanager
def _told() -> Iterator[Callable[[str], None]]:
    """What is being done, as a changing line on a terminal, nothing in a pipe."""
    if not console.err.is_terminal:
        yield lambda _: None
        return
    with console.err.status("reading") as status:
        yield lambda line: status.update(line)
