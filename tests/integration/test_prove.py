"""A small proof from beginning to end, with recordings of a sixteenth of the usual length, and what keeps it honest."""

from __future__ import annotations

import hashlib
import json
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from builder import prove as driver
from builder.__main__ import main
from builder.prove import Work, prove, run_task, work_of
from builder.prove_command import prove as verb
from diagnosis.proof import cycles, protocol
from diagnosis.proof.protocol import BLIND, Settings, Task, plans_of, tasks_of
from models.errors import InputError
from models.gearbox import Gearbox
from models.mechanisms import CATALOGUE

ROOT = Path(__file__).parents[2]
SETTINGS = Settings(seed=77, cases=6, cells_every=0, baselines=False)
SECRETS = ("salt", "base_parameters", "acting_s", "heat_W")  # words of a truth


@pytest.fixture(scope="module", autouse=True)
def short_programmes() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        for name in ("STAIR_S", "STANDSTILL_S", "RANDOM_S", "HOLD_STAIRCASE_S", "WARM_UP_S"):
            patch.setattr(cycles, name, getattr(cycles, name) / 16.0)
        yield


@pytest.fixture(scope="module")
def recorded(fzg: Gearbox, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A proof that was begun: recordings and seals, no verdicts."""
    folder = tmp_path_factory.mktemp("begun") / "proof"
    protocol.begin(SETTINGS, fzg, folder)
    return folder


@pytest.fixture(scope="module")
def proof(recorded: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """A real one: its folder, its numbers, and what lay open while it diagnosed."""
    folder = tmp_path_factory.mktemp("proof") / "proof"
    shutil.copytree(recorded, folder)
    open_then = []

    def look(what: str, _done: int, _of: int) -> None:
        if what == "diagnosing":
            texts = [p.read_bytes() for p in folder.rglob("*") if p.is_file() and p.parent.name != protocol.VERDICTS]
            names = {p.name for p in folder.iterdir()}
            open_then.append((names, [word for word in SECRETS if any(word.encode() in text for text in texts)]))

    return {"folder": folder, "found": prove(SETTINGS, folder, jobs=2, tell=look), "open": open_then}


def answer(_: Work) -> dict[str, Any]:
    """Stands in for a diagnosis where only the order of things is of interest."""
    return {"status": "answered", "seconds": 0.1, "said": {"verdict": "consistent"}, "message": ""}


# ---------------------------------------------------------------------- the real one


def test_every_case_has_an_answer_and_the_score_counts_them(proof: dict[str, Any]) -> None:
    found = proof["found"]
    assert found["protocol"]["failed"] == 0
    assert found["protocol"]["refused"] == 0
    assert len(found["cases"]) == 6
    (removed,) = found["removed"]
    (file,) = (proof["folder"] / protocol.VERDICTS).glob("*removed*.json")
    said = json.loads(file.read_text())["said"]
    ranked = {row["mechanism"] for row in said["ranking"]}
    assert len(ranked) > 20
    gone = removed["truth"][0].split(" at ")[0]
    told = {f["mechanism"] for f in said["findings"]} | {u["mechanism"] for u in said["not_visible"]}
    assert gone in CATALOGUE and gone not in ranked | told
    assert {case["group"] for case in found["cases"]} == {"control", "single", "double", "messy", "outside", "sensor"}
    consistent = next(rule for rule in found["rules"] if rule["key"] == "consistent")
    assert consistent["count"]["of"] + sum(c["truth"][0].startswith("parameter far") for c in found["cases"]) == 1
    assert all(case["verdict"] in ("consistent", "parameter_error", "missing_physics", "sensor_fault", "unexplained",
                                   "insufficient_data") for case in found["cases"])  # fmt: skip
    assert json.loads((proof["folder"] / "proof.json").read_text()) == found
    assert "sealed cases" in (proof["folder"] / "proof.html").read_text()


def test_no_truth_lies_open_while_anything_is_diagnosed(proof: dict[str, Any]) -> None:
    assert len(proof["open"]) == 1 + 7
    for names, secrets in proof["open"]:
        assert names <= {"settings.json", "recordings", "verdicts"}
        assert secrets == []
    # It does once the verdicts are hashed: the words are those of a truth.
    told = (proof["folder"] / "truth" / "case_001.json").read_text()
    assert all(f'"{word}"' in told for word in SECRETS if word not in ("acting_s", "heat_W"))


def test_verdicts_were_hashed_before_the_truth_was_opened(proof: dict[str, Any]) -> None:
    folder = proof["folder"]
    hashes = dict(line.split("  ")[::-1] for line in (folder / "verdicts.sha256").read_text().splitlines())
    assert set(hashes) == {f"verdicts/{p.name}" for p in (folder / "verdicts").iterdir()}
    for name, digest in hashes.items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == digest
    first_truth = min(p.stat().st_mtime_ns for p in (folder / "truth").iterdir())
    assert (folder / "verdicts.sha256").stat().st_mtime_ns <= first_truth
    whole = hashlib.sha256((folder / "verdicts.sha256").read_bytes()).hexdigest()
    assert proof["found"]["protocol"]["verdicts_sha256"] == whole


def test_a_machine_without_truth_and_plant_gives_the_same_bytes(proof: dict[str, Any], tmp_path: Path) -> None:
    room = tmp_path / "elsewhere"
    for package in ("models", "diagnosis", "builder"):
        shutil.copytree(ROOT / package, room / package, ignore=shutil.ignore_patterns("proof", "__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", room)
    assert not (room / "diagnosis" / "proof").exists()
    task = Task(case="case_001")
    work = work_of(proof["folder"] / "recordings", task, "fzg")
    data = tmp_path / "data"
    data.mkdir()
    for name, content in work.files.items():
        (data / name).write_bytes(content)
    command = [sys.executable, "-m", "builder", "diagnose", *work.arguments, "--jobs", "1", "--output", "out"]
    environment = {**driver._environment(), "PYTHONPATH": str(room)}
    done = subprocess.run(command, cwd=data, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    said = json.loads(protocol.verdict_file(proof["folder"], task).read_text())["said"]
    assert (data / "out" / "diagnosis.json").read_bytes() == (json.dumps(said, indent=2) + "\n").encode()


def test_a_finished_proof_is_scored_again_without_new_verdicts(
    proof: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(driver, "run_task", lambda _: pytest.fail("the truth is open"))
    assert prove(SETTINGS, proof["folder"]) == proof["found"]


def test_forged_verdicts_truths_and_recordings_are_found_out(proof: dict[str, Any], tmp_path: Path) -> None:
    def forged(file: str, old: bytes, new: bytes) -> Path:
        folder = tmp_path / file.replace("/", "_")
        shutil.copytree(proof["folder"], folder)
        content = (folder / file).read_bytes()
        assert old in content
        (folder / file).write_bytes(content.replace(old, new, 1))
        return folder

    with pytest.raises(InputError, match=r"the verdicts are not those that verdicts\.sha256 tells of"):
        prove(SETTINGS, forged("verdicts/case_001_rich-full.json", b'"status"', b'"Status"'))
    with pytest.raises(InputError, match="is not the truth that was sealed"):
        prove(SETTINGS, forged("truth/case_002.json", b'"group"', b'"Group"'))
    folder = forged("recordings/case_003/seal.json", b"truth_sha256", b"truth_sha256")
    shutil.rmtree(folder / "truth")
    recording = folder / "recordings" / "case_003" / "hold_1.csv.gz"
    recording.write_bytes(recording.read_bytes() + b"\0")
    with pytest.raises(InputError, match="does not make these recordings again"):
        prove(SETTINGS, folder)
    missing = forged("settings.json", b"{", b"{")
    (missing / "verdicts" / "case_001_rich-full.json").unlink()
    with pytest.raises(InputError, match="the truth is open, but case_001_rich-full.json is missing"):
        prove(SETTINGS, missing)


# ---------------------------------------------------------------------- who sees what


def test_a_process_gets_recordings_and_nothing_else(recorded: Path) -> None:
    work = work_of(recorded / "recordings", Task(case="case_001"), "fzg")
    assert set(work.files) - {"mapping.toml"} == {
        "train_1.csv.gz", "train_2.csv.gz", "train_3.csv.gz", "hold_1.csv.gz", "hold_2.csv.gz"
    }  # fmt: skip
    assert str(SETTINGS.seed) not in work.arguments
    about = json.loads((recorded / "settings.json").read_text())
    assert set(about) == {"settings_sha256", "code_sha256", "scoring_sha256", "version"}


def test_a_diagnosis_cannot_import_the_plant() -> None:
    command = [sys.executable, "-c", BLIND, "conceal", "--effect", "windage", "--seed", "1", "--output", "no"]
    done = subprocess.run(command, capture_output=True, text=True, env=driver._environment())
    assert done.returncode == 1
    assert "diagnosis.proof" in done.stderr
    assert "ModuleNotFoundError" in done.stderr


def test_recordings_that_are_refused_or_fail_are_told_apart(recorded: Path) -> None:
    work = work_of(recorded / "recordings", Task(case="case_001"), "fzg")
    broken = Work(kind="diagnose", files={**work.files, "train_1.csv.gz": b"no table"}, arguments=work.arguments)
    refused = run_task(broken)
    assert (refused["status"], refused["said"]) == ("refused", None)
    assert "train_1.csv.gz" in refused["message"]
    assert run_task(Work(kind="baselines", files={}, arguments=("nothing.csv",)))["status"] == "failed"


def test_baselines_speak_in_the_tongue_of_a_diagnosis(recorded: Path) -> None:
    record = run_task(work_of(recorded / "recordings", Task(case="case_001", kind="baselines"), "fzg"))
    assert record["status"] == "answered", record["message"]
    assert set(record["said"]) == {"naive", "sparse", "black_box"}
    assert record["said"]["naive"]["verdict"] in ("consistent", "missing_physics", "sensor_fault")
    assert 0.0 < record["said"]["black_box"]["rmse_K"] < 30.0


# ---------------------------------------------------------------------- order of things


def test_an_interrupted_proof_goes_on(recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "proof"
    shutil.copytree(recorded, folder)
    kept = folder / "verdicts"
    left = iter(range(3))

    def three(work: Work) -> dict[str, Any]:
        if next(left, None) is not None:
            return answer(work)
        while len(list(kept.glob("*.json"))) < 3:
            time.sleep(0.01)
        raise KeyboardInterrupt

    monkeypatch.setattr(driver, "run_task", three)
    with pytest.raises(KeyboardInterrupt):
        prove(SETTINGS, folder)
    assert len(list(kept.iterdir())) == 3
    assert not (folder / "verdicts.sha256").exists() and not (folder / "truth").exists()
    done = []
    monkeypatch.setattr(driver, "run_task", lambda work: done.append(work.arguments) or answer(work))
    found = prove(SETTINGS, folder)
    assert len(done) == len(tasks_of(SETTINGS, plans_of(SETTINGS))) - 3
    assert {case["verdict"] for case in found["cases"]} == {"consistent"}


def test_code_that_changes_on_the_way_spoils_a_proof(
    recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "proof"
    shutil.copytree(recorded, folder)
    monkeypatch.setattr(driver, "run_task", answer)
    true = protocol.code_hash()
    hashes = iter([true, "another"])
    monkeypatch.setattr(protocol, "code_hash", lambda: next(hashes))
    with pytest.raises(InputError, match="code of the diagnosis was changed while the proof ran"):
        prove(SETTINGS, folder)
    assert not (folder / "truth").exists()
    monkeypatch.setattr(protocol, "code_hash", lambda: "another")
    with pytest.raises(InputError, match="holds a proof with another version of the diagnosis"):
        prove(SETTINGS, folder)


def test_nothing_goes_on_running_after_an_interruption(
    recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "proof"
    shutil.copytree(recorded, folder)
    listening = tmp_path / "listening"
    listening.mkdir()
    # A test run in the background inherits an ignored SIGINT; a user's terminal does not. And a signal that arrives
    # while Python itself is still being loaded ends it with an ordinary failure.
    heeding = (
        "import os, pathlib, signal, time; signal.signal(signal.SIGINT, signal.default_int_handler); "
        f"pathlib.Path({str(listening)!r}, str(os.getpid())).touch(); time.sleep(60)"
    )
    monkeypatch.setattr(driver, "_command", lambda _: [sys.executable, "-c", heeding])
    started: list[subprocess.Popen[str]] = []

    def interrupt() -> None:
        while min(len(list(listening.iterdir())), len(driver._running)) < 2:
            time.sleep(0.05)
        started.extend(driver._running)
        started[0].send_signal(signal.SIGINT)  # as a terminal does with all of them

    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        prove(SETTINGS, folder, jobs=2)
    thread.join()
    assert all(process.poll() is not None for process in started)
    assert not driver._running
    assert not list((folder / "verdicts").glob("*"))


def test_a_cluster_does_the_same(recorded: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed", reason="the extra 'dask' is not installed")
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        driver._executor(1, cluster.scheduler_address) as executor,
    ):
        work = work_of(recorded / "recordings", Task(case="case_001", data="600 s", sensors="poor"), "fzg")
        there = executor.submit(run_task, work).result()
    here = run_task(work)
    assert there["said"] == here["said"]
    assert there["status"] == here["status"]


# ---------------------------------------------------------------------- the verb


def test_help_names_the_defaults_that_hold() -> None:
    told = " ".join(CliRunner().invoke(verb, ["--help"]).output.split())
    assert f"the whole mix, {protocol.WHOLE}]" in told
    assert f"{protocol.UNOPENED_SEED}, which nobody has opened]" in told
    assert protocol.UNOPENED_SEED not in protocol.DEVELOPMENT_SEEDS


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("prove --cases 3 --output OUT", "3 cases are too few"),
        ("prove --jobs 1 --dask tcp://127.0.0.1:1 --output OUT", "exclude each other"),
        ("diagnose OUT.csv --without-mechanism windag", "did you mean 'windage'"),
    ],
)
def test_the_verb_says_what_is_wrong(
    words: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["builder", *words.replace("OUT", str(tmp_path / "out")).split()])
    with pytest.raises(SystemExit) as end:
        main()
    shown = capsys.readouterr()
    assert (end.value.code, shown.out) == (2, "")
    assert message in shown.err
    assert list(tmp_path.iterdir()) == []
