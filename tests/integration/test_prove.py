"""A small proof from beginning to end, with recordings of a sixteenth of the usual length, and its blindness."""

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
from builder.workflows import proof_cases
from builder.workflows import prove as driver
from builder.workflows.prove import BLIND, HASHES, diagnose, environment, prove
from diagnosis.proof.cases.conceal import WHOLE
from diagnosis.proof.plant import cycles
from diagnosis.proof.scoring import lines, seeds, truth
from diagnosis.proof.scoring.lines import ProofSettings, Task
from models.assembly.gearbox import known_gearboxes
from models.base.errors import InputError

SETTINGS = ProofSettings(plant="own", seed=77, cases=6)


@pytest.fixture(scope="module", autouse=True)
def short_programmes() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for name in ("STAIR_S", "STANDSTILL_S", "RANDOM_S", "HOLD_STAIRCASE_S", "WARM_UP_S"):
            patch.setattr(cycles, name, getattr(cycles, name) / 16.0)
        yield


@pytest.fixture
def given(tmp_path: Path) -> dict[str, Path]:
    """Three recordings that nobody could diagnose, and their truth."""
    for case in ("a", "b", "c"):
        (tmp_path / "cases" / case).mkdir(parents=True)
        for name in ("train_1", "hold_1", "baseline_1"):
            (tmp_path / "cases" / case / f"{name}.csv").write_text(f"no table of {case}")
    control = {"group": "control", "effects": [], "family": "two_sumps"}
    (tmp_path / "truth.json").write_text(json.dumps(dict.fromkeys(("a", "b", "c"), control)))
    return {"recordings": tmp_path / "cases", "truth": tmp_path / "truth.json"}


def silent(task: Task, files: Any, *_: Any) -> tuple[Task, dict[str, Any]]:
    return task, {"status": "answered", "seconds": 0.1, "sha256": task.case * 3, "recordings": driver.hash_of(files),
                  "answer": {"verdict": "consistent"}, "message": ""}  # fmt: skip


@pytest.mark.slow  # 90 s; the proofs below go the same way with answers that are made up
def test_a_proof_of_the_own_plant(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One real diagnosis, an interruption, and the order of hashes and truth."""
    file, output = tmp_path / "77.jsonl", tmp_path / "out"
    seen = []

    def some(task: Task, *work: Any) -> tuple[Task, dict[str, Any]]:
        seen.append(task.case)
        if len(seen) == 4:
            raise KeyboardInterrupt
        assert not (output / HASHES).exists()
        return diagnose(task, *work) if task.case == "case_001" else silent(task, *work)

    def weighed(file: Path, *_: Any) -> None:
        assert (output / HASHES).exists()
        facts = json.loads(file.read_text())
        facts["effects"][0]["oracle"] = {"D_plant_nats": 20.0, "D_tool_nats": 10.0}
        file.write_text(json.dumps(facts))

    def opened(path: Path) -> dict[str, truth.Truth]:
        assert len((output / HASHES).read_text().splitlines()) == 6
        return read(path)

    read = truth.read_truths
    monkeypatch.setattr(driver, "diagnose", some)
    monkeypatch.setattr(truth, "read_truths", opened)
    monkeypatch.setattr(proof_cases, "add_evidence_of_case", weighed)
    lines.begin_lines(file, SETTINGS)
    with pytest.raises(KeyboardInterrupt):
        prove(file, output)
    before = file.read_text()
    assert len(before.splitlines()) == 1 + 3
    file.write_text(before + '{"task": {"case": "case_0')  # killed while it wrote
    result = prove(file, output)
    assert file.read_text().startswith(before) and seen == [f"case_00{i}" for i in (1, 2, 3, 4, 4, 5, 6)]
    assert result["cases"] == {"own": 6} and result["failed"] == 0
    first = json.loads(before.splitlines()[1])
    assert first["answer"]["verdict"] != "failed" and len(first["sha256"]) == 64
    assert (output / HASHES).read_text().startswith(f"{first['sha256']}  case_001\n")
    assert {row["group"] for row in result["lines"]} == {"control", "single", "double", "messy", "outside", "sensor"}
    assert {row["group"]: row["D_tool_nats"] for row in result["lines"]} | {"double": 0} == {
        "control": None, "single": 10.0, "double": 0, "messy": 10.0, "outside": 10.0, "sensor": 10.0,
    }  # fmt: skip
    seen.clear()
    assert prove(file, output) == result and not seen
    lines.begin_lines(tmp_path / "78.jsonl", ProofSettings(plant="own", seed=78, cases=6))
    with pytest.raises(InputError, match="holds the cases of another proof"):
        prove(tmp_path / "78.jsonl", output)


def test_a_proof_of_the_zoo_is_continued_while_its_cases_are_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Machines are drawn with the plants, so every case brings its definition; two rounds of making."""
    output, made = tmp_path / "out", []

    def make(name: str, plan: Any, recordings: Path, truths: Path, baselines: int) -> None:
        assert baselines == proof_cases.ZOO_BASELINES
        if len(made) == 4:
            made.append("interrupted")
            raise KeyboardInterrupt
        made.append(name)
        for folder in (recordings / name, truths):
            folder.mkdir(parents=True, exist_ok=True)
        (recordings / name / "train_1.csv").write_text(name)
        (recordings / name / "gearbox.toml").write_text(plan.machine)
        one = {"group": plan.group, "effects": [], "family": plan.family, "machine": plan.machine}
        (truths / f"{name}.json").write_text(json.dumps(one))

    def look(task: Task, files: Any, *work: Any) -> tuple[Task, dict[str, Any]]:
        assert files["gearbox.toml"].decode() in known_gearboxes() and len(made) == 4 + 1 + 3
        return silent(task, files, *work)

    monkeypatch.setattr(proof_cases, "make_zoo_case", make)
    monkeypatch.setattr(driver, "diagnose", look)
    lines.begin_lines(tmp_path / "35.jsonl", ProofSettings(plant="zoo", seed=35, cases=7, gearbox=""))
    with pytest.raises(KeyboardInterrupt):
        prove(tmp_path / "35.jsonl", output)
    result = prove(tmp_path / "35.jsonl", output)
    assert result["cases"]["all"] == 7 and {row["group"] for row in result["lines"]} == set(proof_cases.ZOO_COUNTS)
    assert all(name.startswith("zoo: ") for name in result["cases"] if name != "all")


def test_failures_count_and_other_code_or_recordings_are_refused(
    given: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, output = tmp_path / "given.jsonl", tmp_path / "out"
    lines.begin_lines(file, ProofSettings(plant="given"))
    with pytest.raises(InputError, match="name them with --recordings and --truth"):
        prove(file, output)
    monkeypatch.setattr(driver, "diagnose", lambda t, *w: diagnose(t, *w) if t.case == "a" else silent(t, *w))
    result = prove(file, output, **given)
    (alarms,) = [rule["counts"] for rule in result["rules"] if rule["name"] == "control answered right"]
    assert (alarms["zoo: two_sumps"]["hits"], alarms["zoo: two_sumps"]["of"]) == (2, 3) and result["failed"] == 1
    _, _, records = lines.read_lines(file)
    assert records[Task(case="a")]["status"] == "refused" and "train_1.csv" in records[Task(case="a")]["message"]
    with pytest.raises(InputError, match="holds answers already; continue it"):
        lines.begin_lines(file, SETTINGS)
    (given["recordings"] / "b" / "hold_1.csv").write_text("another")
    with pytest.raises(InputError, match="b was answered from other recordings"):
        prove(file, output, **given)
    monkeypatch.setattr(lines, "code_hash", lambda: "0123456789abcdef")
    with pytest.raises(InputError, match="begun with other code .* here 0123456789ab"):
        prove(file, output, **given)


def test_a_diagnosis_cannot_import_the_plant() -> None:
    command = [sys.executable, "-c", BLIND, "conceal", "--effect", "windage", "--seed", "1", "--output", "no"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment())
    assert done.returncode == 1 and "ModuleNotFoundError" in done.stderr and "diagnosis.proof" in done.stderr


def test_a_diagnosis_gets_copies_of_its_recordings_and_nothing_else(
    given: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    rooms = []

    def run(command: list[str], *, cwd: Path, **_: Any) -> subprocess.CompletedProcess[str]:
        rooms.append((sorted(path.name for path in cwd.iterdir()), command[3:]))
        return subprocess.CompletedProcess(command, 1, None, "broken")

    monkeypatch.setattr(driver.subprocess, "run", run)
    (given["recordings"] / "a" / "gearbox.toml").write_text("name = 1")
    work = lines.files_of(given["recordings"], Task(case="a"))
    _, record = diagnose(Task(case="a"), *work, "fzg")
    assert rooms == [(["gearbox.toml", "hold_1.csv", "train_1.csv"], [
        "diagnose", "train_1.csv", "--holdout", "hold_1.csv", "--gearbox", "gearbox.toml",
        "--output", "out",
    ])]  # fmt: skip
    assert (record["status"], record["answer"], record["message"]) == ("failed", None, "broken")


def test_the_code_hash_covers_what_decides_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for file in ("models/a.py", "diagnosis/b.py", "diagnosis/proof/c.py", "diagnosis/notes.md"):
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text("1")
    monkeypatch.setattr(lines.resources, "files", lambda package: tmp_path / package)
    before = lines.code_hash()
    for file in ("diagnosis/proof/c.py", "diagnosis/notes.md"):
        (tmp_path / file).write_text("2")
    assert lines.code_hash() == before
    (tmp_path / "models" / "a.py").write_text("2")
    assert lines.code_hash() != before


@pytest.mark.parametrize(("sensors", "kept"), [("rich", 5), ("lean", 3), ("poor", 1)])
def test_files_of_a_cell(sensors: Any, kept: int, tmp_path: Path) -> None:
    names = ("oil", "housing_lower", "housing_upper", "pinion")
    columns = ["time_s", "speed_rpm", "T_ambient_degC", *(f"T_{name}_degC" for name in names), "P_loss_W"]
    table = ",".join(columns) + "\n" + ",".join(map(str, range(8))) + "\n"
    folder = tmp_path / "case_001"
    folder.mkdir()
    for name in ("train_1", "train_2", "train_3", "hold_1", "hold_2", "baseline_1"):
        (folder / f"{name}.csv.gz").write_bytes(gzip.compress(table.encode()))
    sheet = "\n\n".join(["schema = 1", *(f"[columns.T_{n}_degC]\nnoise = 0.2" for n in ("oil", "pinion"))])
    (folder / "mapping.toml").write_text(sheet + "\n")
    files, arguments = lines.files_of(tmp_path, Task(case="case_001", sensors=sensors))
    assert len(files) == 6 and arguments[3:] == ["--holdout", "hold_1.csv.gz", "--holdout", "hold_2.csv.gz"]
    head, row = gzip.decompress(files["train_1.csv.gz"]).decode().splitlines()
    values = dict(zip(head.split(","), row.split(","), strict=True))
    assert len(values) == 3 + kept and values["T_oil_degC"] == "3"
    stated = tomllib.loads(files["mapping.toml"].decode())["columns"]
    assert set(stated) == {"T_oil_degC"} | ({"T_pinion_degC"} if sensors == "rich" else set())
    files, arguments = lines.files_of(tmp_path, Task(case="case_001", sensors=sensors), 1)
    assert arguments[-2:] == ["--baseline", "baseline_1.csv.gz"]
    assert gzip.decompress(files["baseline_1.csv.gz"]) == gzip.decompress(files["train_1.csv.gz"])
    with pytest.raises(InputError, match="holds 1 recordings named baseline_\\*, but 2 are asked for"):
        lines.files_of(tmp_path, Task(case="case_001"), 2)
    files, arguments = lines.files_of(tmp_path, Task(case="case_001", data="600 s", removed="windage"), 1)
    assert set(files) == {"train_2.csv.gz", "mapping.toml"}
    assert arguments == ["train_2.csv.gz@0..600", "--without-mechanism", "windage"]


def test_files_of_a_cell_may_be_plain_text_and_know_the_air_outdoors(tmp_path: Path) -> None:
    folder = tmp_path / "case_001"
    folder.mkdir()
    (folder / "train_2.csv").write_text("time_s,T_outdoor_degC,T_oil_degC,T_pinion_degC\n0,1,2,3\n")
    (folder / "mapping.toml").write_text("schema = 1\n\n[columns.T_pinion_degC]\nnoise = 0.2\n")
    poor = Task(case="case_001", sensors="poor", data="600 s")
    files, _ = lines.files_of(tmp_path, poor)
    assert files["train_2.csv"] == b"time_s,T_outdoor_degC,T_oil_degC\n0,1,2\n"
    assert files["mapping.toml"] == b"schema = 1\n"
    (folder / "train_2.csv").rename(folder / "train_2.parquet")
    with pytest.raises(InputError, match="train_2.parquet: sensors can be left out of text"):
        lines.files_of(tmp_path, poor)


def test_verb_refuses(given: dict[str, Path], tmp_path: Path) -> None:
    shown = " ".join(CliRunner().invoke(verb, ["--help"]).output.split())
    assert f"[default: {WHOLE} (own)" in shown and f"[default: {seeds.OWN_PROOF} (own), {seeds.ZOO_PROOF[0]}" in shown
    assert seeds.OWN_PROOF not in seeds.OWN_DEVELOPMENT
    old = tmp_path / "old.jsonl"
    old.write_text("nothing\n")
    recordings, truths = map(str, given.values())
    for arguments, message in (
        (["--cases", "3"], "3 cases are too few"),
        (["--recordings", recordings], "--recordings and --truth go together"),
        (["--recordings", recordings, "--truth", truths, "--seed", "1"], "--seed is for cases that are made"),
        (["--plant", "zoo", "--removed"], "--removed is for --plant own"),
        (["--families", "walls"], "--families is for --plant zoo"),
        (["--baselines", "1"], "the own plant records no baselines"),
        (["--continue", str(old), "--cells-every", "2"], "--cells-every does not go with --continue"),
        (["--continue", str(old)], "is not a file of answers that prove wrote"),
    ):
        done = CliRunner().invoke(verb, [*arguments, "--output", str(tmp_path / "out")])
        assert message in str(done.exception)
    assert not (tmp_path / "out").exists()
    assert hashlib.sha256(old.read_bytes()).hexdigest() == hashlib.sha256(b"nothing\n").hexdigest()
