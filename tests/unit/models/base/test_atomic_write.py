"""Output files and folders appear whole or not at all."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import pytest

from models.base.atomic_write import atomic_file, atomic_folder
from models.base.errors import InputError


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("old")

    def interrupted() -> None:
        with atomic_file(path) as partial:
            partial.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.csv"]


def written(folder: Path) -> dict[str, str]:
    return {str(p.relative_to(folder)): p.read_text() for p in sorted(folder.rglob("*")) if p.is_file()}


def make(folder: Path, *names: str) -> None:
    with atomic_folder(folder) as stage:
        for name in names:
            (stage / name).parent.mkdir(exist_ok=True)
            (stage / name).write_text("new")


def test_files_appear_together(tmp_path: Path) -> None:
    (tmp_path / "report.html").write_text("old")
    (tmp_path / "mine.txt").write_text("mine")
    with atomic_folder(tmp_path) as stage:
        (stage / "report.html").write_text("new")
        (stage / "sub").mkdir()
        (stage / "sub/a.csv").write_text("new")
        assert (tmp_path / "report.html").read_text() == "old"
    assert written(tmp_path) == {"mine.txt": "mine", "report.html": "new", "sub/a.csv": "new"}


@pytest.mark.parametrize("failing", ["old", "new"])
def test_what_cannot_be_replaced_leaves_all_as_it_was(
    failing: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on Windows, where a tool holds an FMU open."""
    for name in ("a.csv", "b.fmu", "c.json"):
        (tmp_path / name).write_text("old")
    move = Path.replace

    def held(self: Path, target: Path) -> Path:
        if self.name == "b.fmu" and self.read_text() == failing:
            raise PermissionError(13, "Permission denied", str(self))
        return move(self, target)

    monkeypatch.setattr(Path, "replace", held)
    with pytest.raises(InputError, match=r"b\.fmu: cannot be written \(Permission denied\); nothing was replaced"):
        make(tmp_path, "a.csv", "b.fmu", "c.json", "d.txt")
    assert written(tmp_path) == dict.fromkeys(("a.csv", "b.fmu", "c.json"), "old")
    assert not list(tmp_path.glob(".unfinished-*"))


@pytest.mark.parametrize("after", range(8))
def test_an_interrupt_leaves_all_as_it_was(after: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C before or after each of the moves: of four new files, three of which replace an old one."""
    for name in ("a.csv", "b.fmu", "c.json"):
        (tmp_path / name).write_text("old")
    move, moves = Path.replace, iter(range(100))

    def stopped(self: Path, target: Path) -> Path:
        now = next(moves)
        if now == after:
            if after % 2:  # while the system call returns
                move(self, target)
            raise KeyboardInterrupt
        return move(self, target)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", stopped)
        with nullcontext() if after == 7 else pytest.raises(KeyboardInterrupt):
            make(tmp_path, "a.csv", "b.fmu", "c.json", "d.txt")
    old, new = ("a.csv", "b.fmu", "c.json"), ("a.csv", "b.fmu", "c.json", "d.txt")
    assert written(tmp_path) == (dict.fromkeys(new, "new") if after == 7 else dict.fromkeys(old, "old"))
    assert not list(tmp_path.glob(".*"))


def test_what_cannot_be_put_back_is_kept_and_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A virus scanner, say, holds the first file as soon as it is new, and the second one all the time."""
    for name in ("a.csv", "b.fmu"):
        (tmp_path / name).write_text("old")
    move = Path.replace

    def held(self: Path, target: Path) -> Path:
        if (self == tmp_path / "a.csv" and self.read_text() == "new") or self == tmp_path / "b.fmu":
            raise PermissionError(13, "Permission denied", str(self))
        return move(self, target)

    monkeypatch.setattr(Path, "replace", held)
    with pytest.raises(InputError, match=r"could not be put back: .*a\.csv \(it is .*\.replaced-"):
        make(tmp_path, "a.csv", "b.fmu")
    (kept,) = (path for path in tmp_path.glob(".replaced-*/*"))
    assert (kept.read_text(), (tmp_path / "a.csv").read_text()) == ("old", "new")
    assert (tmp_path / "b.fmu").read_text() == "old"


def test_a_file_in_the_place_of_a_folder_is_told(tmp_path: Path) -> None:
    (tmp_path / "networks").write_text("mine")
    with pytest.raises(InputError, match="networks: cannot be written"):
        make(tmp_path, "a.csv", "networks/mesh.onnx")
    assert written(tmp_path) == {"networks": "mine"}


def test_a_file_that_is_held_open_keeps_the_new_one_next_to_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on Windows, where a spreadsheet holds a result open: hours of simulation are not lost."""
    path = tmp_path / "a.csv"
    path.write_text("old")

    def held(self: Path, target: Path) -> Path:
        raise PermissionError(13, "Permission denied", str(target))

    monkeypatch.setattr(Path, "replace", held)
    named = r"a\.csv: cannot be replaced \(Permission denied\); it was written as a_"
    with pytest.raises(InputError, match=named), atomic_file(path) as partial:
        partial.write_text("new")
    kept = sorted(found.name for found in tmp_path.iterdir())
    assert len(kept) == 2 and path.read_text() == "old"
    assert (tmp_path / kept[1]).suffix == ".csv" and (tmp_path / kept[1]).read_text() == "new"


def test_a_full_disk_is_one_line(tmp_path: Path) -> None:
    named = r"a\.csv: cannot be written \(No space left on device\); choose another"
    with pytest.raises(InputError, match=named), atomic_file(tmp_path / "a.csv"):
        raise OSError(28, "No space left on device")
    assert list(tmp_path.iterdir()) == []
