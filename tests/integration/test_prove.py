"""A small proof from beginning to end, with recordings of a sixteenth of the usual length, and its protocol."""

from __future__ import annotations

import gzip
import hashlib
import json
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from builder.commands.prove import prove as verb
from builder.workflows import prove as driver
from builder.workflows.prove import environment, prove, run_task, work_of
from diagnosis.proof.plant import cycles
from diagnosis.proof.scoring import protocol
from diagnosis.proof.scoring.protocol import BLIND, Settings, Task
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError

SETTINGS = Settings(seed=77, cases=6, cells_every=0)
SECRETS = ("base_parameters", "acting_s", "heat_W")  # keys of a truth


@pytest.fixture(scope="module", autouse=True)
def short_programmes() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for name in ("STAIR_S", "STANDSTILL_S", "RANDOM_S", "HOLD_STAIRCASE_S", "WARM_UP_S"):
            patch.setattr(cycles, name, getattr(cycles, name) / 16.0)
        yield


def diagnose_some(task: Task, files: Any, arguments: Any) -> tuple[Task, dict[str, Any]]:
    """Two real diagnoses, one of them with an entry removed; the others are made up."""
    if task.removed or task.case == "case_001":
        return run_task(task, files, arguments)
    return task, {"status": "answered", "seconds": 0.1, "answer": {"verdict": "consistent"}, "message": ""}


@pytest.fixture(scope="module")
def proof(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Folder and numbers of a proof that was interrupted once, and the secrets in its folder while it diagnosed."""
    folder = tmp_path_factory.mktemp("proof") / "proof"
    readable = []

    def look(step: str, done: int, of: int) -> None:
        if step == "diagnosing":
            texts = [p.read_text() for p in folder.rglob("*.*") if p.suffix in (".json", ".toml") and "answers" not in str(p)]  # noqa: E501 # fmt: skip
            readable.append([p.name for p in folder.iterdir() if p.name in ("truth", "answers.sha256")])
            readable.append([word for word in SECRETS if any(word in text for text in texts)])
            if done == 2 and of and len(readable) < 8:
                raise KeyboardInterrupt

    patch = pytest.MonkeyPatch()
    patch.setattr(driver, "run_task", diagnose_some)
    with pytest.raises(KeyboardInterrupt):
        prove(SETTINGS, folder, progress=look)
    kept = {p: p.stat().st_mtime_ns for p in (folder / "answers").iterdir()}
    numbers = prove(SETTINGS, folder, jobs=2, progress=look)
    patch.undo()
    assert len(kept) == 2 and all(path.stat().st_mtime_ns == time for path, time in kept.items())
    return {"folder": folder, "numbers": numbers, "readable": readable}


def test_every_case_is_counted(proof: dict[str, Any]) -> None:
    numbers, folder = proof["numbers"], proof["folder"]
    assert (numbers["protocol"]["diagnoses"], numbers["protocol"]["failed"], numbers["protocol"]["refused"]) == (
        7,
        0,
        0,
    )
    assert {case["group"] for case in numbers["cases"]} == {"control", "single", "double", "messy", "outside", "sensor"}
    (removed,) = numbers["removed"]
    (file,) = (folder / "answers").glob("*removed*.json")
    ranked = {row["mechanism"] for row in json.loads(file.read_text())["answer"]["ranking"]}
    assert len(ranked) > 20 and removed["truth"][0].split(" at ")[0] not in ranked
    assert json.loads((folder / "proof.json").read_text()) == numbers
    assert "sealed cases" in (folder / "proof.html").read_text()


def test_truth_is_not_readable_while_anything_is_diagnosed(proof: dict[str, Any]) -> None:
    assert len(proof["readable"]) > 2 * 7 and not any(proof["readable"])
    truth = (proof["folder"] / "truth" / "case_001.json").read_text()
    assert "base_parameters" in truth
    work = work_of(proof["folder"] / "recordings", Task(case="case_001"), "fzg")
    assert {name.partition(".")[0] for name in work[0]} - {"mapping"} == {"train_1", "train_2", "train_3", "hold_1", "hold_2"}  # noqa: E501 # fmt: skip
    assert "77" not in work[1] and "77" not in (proof["folder"] / "settings.json").read_text().split()
    command = [sys.executable, "-c", BLIND, "conceal", "--effect", "windage", "--seed", "1", "--output", "no"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment())
    assert done.returncode == 1 and "ModuleNotFoundError" in done.stderr and "diagnosis.proof" in done.stderr


def test_answers_were_fixed_before_the_truth_was_opened(
    proof: dict[str, Any], fzg: Gearbox, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = proof["folder"]
    hashes = dict(line.split("  ")[::-1] for line in (folder / "answers.sha256").read_text().splitlines())
    assert hashes == {f"answers/{p.name}": hashlib.sha256(p.read_bytes()).hexdigest() for p in (folder / "answers").iterdir()}  # noqa: E501 # fmt: skip
    assert (folder / "answers.sha256").stat().st_mtime_ns <= min(p.stat().st_mtime_ns for p in folder.glob("truth/*"))
    assert proof["numbers"]["protocol"]["answers_sha256"] == hashlib.sha256((folder / "answers.sha256").read_bytes()).hexdigest()  # noqa: E501 # fmt: skip
    monkeypatch.setattr(driver, "run_task", lambda *_: pytest.fail("the truth is open"))
    assert prove(SETTINGS, folder) == proof["numbers"]
    with pytest.raises(InputError, match="holds a proof with other options"):
        protocol.begin(Settings(seed=78, cases=6), fzg, folder)
    (folder / "answers" / "case_001_rich-full.json").unlink()
    with pytest.raises(InputError, match="is missing, but all answers were fixed"):
        prove(SETTINGS, folder)
    monkeypatch.setattr(protocol, "code_hash", lambda: "another")
    with pytest.raises(InputError, match="another version of the code"):
        prove(SETTINGS, folder)


@pytest.mark.parametrize(("sensors", "kept"), [("rich", 5), ("lean", 3), ("poor", 1)])
def test_files_of_a_cell(sensors: Any, kept: int, tmp_path: Path) -> None:
    names = ("oil", "housing_lower", "housing_upper", "pinion")
    columns = ["time_s", "speed_rpm", "T_ambient_degC", *(f"T_{name}_degC" for name in names), "P_loss_W"]
    table = ",".join(columns) + "\n" + ",".join(map(str, range(8))) + "\n"
    folder = tmp_path / "case_001"
    folder.mkdir()
    for name in ("train_1", "train_2", "train_3", "hold_1", "hold_2"):
        (folder / f"{name}.csv.gz").write_bytes(gzip.compress(table.encode()))
    sheet = "\n\n".join(["schema = 1", *(f"[columns.T_{n}_degC]\nnoise = 0.2" for n in ("oil", "pinion"))])
    (folder / "mapping.toml").write_text(sheet + "\n")
    files, arguments = protocol.files_of(tmp_path, Task(case="case_001", sensors=sensors))
    assert len(files) == 6 and arguments[3:] == ["--holdout", "hold_1.csv.gz", "--holdout", "hold_2.csv.gz"]
    head, row = gzip.decompress(files["train_1.csv.gz"]).decode().splitlines()
    values = dict(zip(head.split(","), row.split(","), strict=True))
    assert len(values) == 3 + kept and values["T_oil_degC"] == "3"
    stated = tomllib.loads(files["mapping.toml"].decode())["columns"]
    assert set(stated) == {"T_oil_degC"} | ({"T_pinion_degC"} if sensors == "rich" else set())
    files, arguments = protocol.files_of(tmp_path, Task(case="case_001", data="600 s", removed="windage"))
    assert set(files) == {"train_2.csv.gz", "mapping.toml"}
    assert arguments == ["train_2.csv.gz@0..600", "--without-mechanism", "windage"]


def test_refused_recordings_are_an_answer() -> None:
    _, record = run_task(Task(case="case_001"), {"train_1.csv": b"no table"}, ["train_1.csv"])
    assert (record["status"], record["answer"]) == ("refused", None)
    assert "train_1.csv" in record["message"]


def test_verb_refuses_and_names_the_defaults_that_hold(tmp_path: Path) -> None:
    shown = " ".join(CliRunner().invoke(verb, ["--help"]).output.split())
    assert f"the whole mix, {protocol.WHOLE}]" in shown and f"{protocol.UNOPENED_SEED}, which nobody has" in shown
    assert protocol.UNOPENED_SEED not in protocol.DEVELOPMENT_SEEDS
    done = CliRunner().invoke(verb, ["--cases", "3", "--output", str(tmp_path / "out")])
    assert "3 cases are too few" in str(done.exception) and not list(tmp_path.iterdir())
