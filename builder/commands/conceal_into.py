"""``conceal --into``: a known effect put into a recording of a real machine."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from builder.base import console
from builder.base.progress import LOADING, progress
from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError


def conceal_into(
    recording: str,
    gearbox: str,
    *,
    effect: str | None,
    place: str | None,
    date: str | None,
    control: bool,
    cases: int | None,
    seed: int,
    output: Path,
    truth: Path | None,
) -> None:
    """Write recordings of a real machine with an injection each, and the truth into another folder.

    Parameters
    ----------
    recording : str
        ``FILE`` or ``FILE@start..end``
    gearbox : str
        Name or file of its definition
    effect, place, date : str or None
        Kind, place and begin of the injection; drawn where not named
    control : bool
        True to inject nothing
    cases : int or None
        Number of cases, a folder each; None: one, flat
    seed : int
    output : Path
        Its folder ``recordings`` gets the recordings
    truth : Path or None
        By default the folder ``truth`` in `output`

    Raises
    ------
    InputError
        If the recording, the machine and the wish do not go together, or something would be overwritten or cannot be
        written.
    """
    with progress(LOADING):
        from diagnosis.proof.cases.case_files import staged_folders
        from diagnosis.proof.injection.inject import Injector, Wish, inject_set  # imports scipy

    if control and (effect is not None or place is not None or date is not None):
        raise InputError("--control injects nothing; leave out --effect, --place and --date")
    with progress("reading the recording"):
        injector = Injector(load_gearbox(gearbox), recording)
    recordings, truth = output / "recordings", truth or output / "truth"
    _keep_other_files(recordings, injector.written)
    with (
        staged_folders(recordings, truth) as (stage, truth_stage),
        progress("injecting") as told,
    ):
        names = inject_set(
            injector, Wish(kind=effect, place=place, date=date, control=control), 1 if cases is None else cases,
            seed=seed, recordings=stage, truth=truth_stage, flat=cases is None, progress=partial(told, "injecting"),
        )  # fmt: skip
    for name in names:
        console.out.print(f"wrote {recordings / ('' if cases is None else name)}, {truth / name}.json")


def _keep_other_files(recordings: Path, written: frozenset[str]) -> None:
    """Refuse a folder with files that are no part of the cases: a mapping file among them would change their meaning.

    Raises
    ------
    InputError
        Also if the source itself lies there.
    """
    for file in sorted(path for path in recordings.rglob("*") if path.is_file()):
        if file.name not in written:
            raise InputError(f"{recordings}: holds other files ({file.name}); choose another output")
