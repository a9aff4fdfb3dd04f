"""Building: what is made appears together or not at all, and an FMU that cannot run here is built all the same."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

from builder import build as builder_build
from builder import fmu_drive
from builder.build import build, cycle_errors, staging
from builder.fmu_drive import runs_here
from builder.native_compile import host_platform
from builder.train import TrainingResult
from models.errors import InputError
from models.gearbox import Gearbox


def written(folder: Path) -> dict[str, str]:
    return {str(p.relative_to(folder)): p.read_text() for p in sorted(folder.rglob("*")) if p.is_file()}


def make(folder: Path, *names: str) -> None:
    with staging(folder) as stage:
        for name in names:
            (stage / name).parent.mkdir(exist_ok=True)
            (stage / name).write_text("new")


def test_files_appear_together(tmp_path: Path) -> None:
    (tmp_path / "report.html").write_text("old")
    (tmp_path / "mine.txt").write_text("mine")
    with staging(tmp_path) as stage:
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


def test_errors_over_a_cycle_are_those_of_the_fmu_against_the_model() -> None:
    model = {"time_s": [0.0, 1.0, 2.0], "T_ambient_degC": [20.0, 20.0, 20.0], "T_oil_degC": [20.0, 30.0, 40.0],
             "T_mesh_degC": [20.0, 50.0, 60.0], "P_loss_W": [100.0, 200.0, 400.0]}  # fmt: skip
    fmu = model | {"T_oil_degC": [20.0, 30.5, 40.25], "T_mesh_degC": [20.0, 47.0, 61.0],
                   "P_loss_W": [101.0, 196.0, 400.0]}  # fmt: skip
    errors = cycle_errors(*({name: np.array(values) for name, values in table.items()} for table in (fmu, model)))
    assert errors.temperature_K == {"oil": 0.5, "mesh": 3.0}
    assert errors.loss_mean == pytest.approx(0.01)
    assert errors.loss_worst == pytest.approx(0.02)


def test_an_fmu_that_cannot_run_here_is_built_and_that_is_told(
    fzg: Gearbox, fzg_training: TrainingResult, fzg_fmu: Path, fzg_native: Path, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    assert runs_here(fzg_native)
    with ZipFile(fzg_fmu) as archive:
        there = {name.split("/")[1] for name in archive.namelist() if name.startswith("binaries/")}
    assert runs_here(fzg_fmu) == (host_platform() in there)
    monkeypatch.setattr(fmu_drive, "host_platform", lambda: "aarch64-darwin")
    monkeypatch.setattr(builder_build, "train_surrogate", lambda *_, **__: fzg_training)
    report = build(fzg, tmp_path, name="fzg")
    report.show()
    shown = capsys.readouterr()
    assert (tmp_path / "fzg.fmu").is_file() and not (tmp_path / "drive_cycle.csv").exists()
    assert "reference cycle from 20" not in shown.out
    assert "note: the python FMU has no binary for this machine" in " ".join(shown.err.split())
    assert "earlier build" not in shown.err
    again = build(fzg, tmp_path, name="other")
    assert [note for note in again.notes if "earlier" in note] == [
        f"{tmp_path / 'fzg.fmu'} is of an earlier build: report.json and networks/ no longer tell about it"
    ]
