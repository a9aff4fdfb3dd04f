"""Output files and folders that appear whole or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from models.base.errors import InputError


@contextmanager
def atomic_file(path: Path) -> Iterator[Path]:
    """A temporary file in the folder of `path` that replaces `path` if the block ends well, and is deleted otherwise.

    It has the suffix of `path`, for writers that choose the format by it.

    Raises
    ------
    InputError
        If the folder cannot be made or written to, or `path` cannot be replaced: what was written is kept next to it.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=path.suffix, dir=path.parent)
        os.close(handle)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another output") from error
    partial = Path(name)
    try:
        try:
            yield partial
        except OSError as error:  # a full disk
            raise InputError(f"{path}: cannot be written ({error.strerror or error}); choose another output") from error
        if path.is_dir():
            raise InputError(f"{path}: is a folder; name a file")
        partial.chmod(0o644)
        try:
            partial.replace(path)
        except OSError as error:  # on Windows, where a spreadsheet holds it open
            kept = partial.rename(path.with_name(f"{path.stem}_{partial.stem.rpartition('.')[2]}{path.suffix}"))
            raise InputError(
                f"{path}: cannot be replaced ({error.strerror}); it was written as {kept.name} next to it. Close what "
                "holds the old one open, or choose another output"
            ) from error
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def atomic_folder(folder: Path) -> Iterator[Path]:
    """A temporary folder inside `folder` whose files move up if the block ends well, and are deleted otherwise.

    Files of the same name are replaced, all or none; other files in `folder` stay.

    Raises
    ------
    InputError
        If `folder` cannot be made or written to, a file would replace a folder, or an existing file cannot be replaced.
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
        _move_all(folder, {path: folder / path.relative_to(stage) for path in files})
    finally:
        shutil.rmtree(stage, ignore_errors=True)
        for parent in made:  # deepest first; a folder with files in it stays
            with suppress(OSError):
                parent.rmdir()


def _move_all(folder: Path, goals: Mapping[Path, Path]) -> None:
    """Move files to their goals, all or none: replaced files are restored if a move fails or is interrupted.

    Replaced files wait in a hidden folder inside `folder`, which is deleted only when nothing in it is needed.
    """
    for goal in goals.values():
        if goal.is_dir():
            raise InputError(f"{goal}: is a folder; remove it or choose another output")
    replaced = Path(tempfile.mkdtemp(prefix=".replaced-", dir=folder))
    moves: list[tuple[Path, Path]] = []
    try:
        for path, goal in goals.items():
            goal.parent.mkdir(parents=True, exist_ok=True)
            old = [(goal, replaced / str(len(moves)))] if goal.exists() else []
            for source, target in (*old, (path, goal)):
                moves.append((source, target))  # before the move, so that an interrupt finds it
                source.replace(target)
    except BaseException as error:
        kept = _move_back(moves)
        with suppress(OSError):
            replaced.rmdir()
        if not isinstance(error, OSError):
            raise
        result = f"could not be put back: {kept}" if kept else "nothing was replaced"
        raise InputError(
            f"{error.filename}: cannot be written ({error.strerror}); {result}. Close what holds it open, "
            "or choose another output"
        ) from error
    shutil.rmtree(replaced, ignore_errors=True)


def _move_back(moves: Sequence[tuple[Path, Path]]) -> str:
    """Undo moves, the last one first; return the files that cannot be moved back and where they are, or ``""``."""
    left = []
    for source, target in reversed(moves):
        if not target.exists():  # this move was not reached
            continue
        try:
            if source.exists():  # the new file in its place could not be moved away
                raise FileExistsError
            target.replace(source)
        except OSError:
            left.append(f"{source} (it is {target})")
    return ", ".join(left)
