"""Which recordings ``diagnose`` learns from, which it holds out, and which are baselines."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import diagnosis.recordings.read
from builder.commands.diagnose import diagnose
from builder.workflows import fleet
from diagnosis import diagnose_recordings
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.correction.correction import Correction, Estimate, write_correction


class _ReadError(Exception):
    """Ends the command where it would read the recordings."""


@pytest.fixture
def asked_for(monkeypatch: pytest.MonkeyPatch) -> list[tuple[tuple[str, ...], ...]]:
    """What the command would read: (to learn from, held out, baselines)."""
    asked: list[tuple[tuple[str, ...], ...]] = []

    def read(*given: tuple[str, ...], **_: object) -> None:
        asked.append(given[:3])
        raise _ReadError

    monkeypatch.setattr(diagnosis.recordings.read, "read_by_role", read)
    return asked


@pytest.mark.parametrize(
    ("words", "train", "held"),
    [
        ("a b", ("a", "b"), ()),
        ("a --holdout b", ("a",), ("b",)),
        ("a --holdout b c --jobs 1", ("a",), ("b", "c")),
        ("a --holdout b --holdout c", ("a",), ("b", "c")),
        ("a --holdout b c --holdout d e", ("a",), ("b", "c", "d", "e")),
        ("--holdout b c --jobs 1 a", ("a",), ("b", "c")),
        ("a --holdout=b c", ("a",), ("b", "c")),
        ("--holdout b c -- a --holdout", ("a", "--holdout"), ("b", "c")),
    ],
)
def test_all_up_to_the_next_option_is_held_out(
    words: str, train: tuple[str, ...], held: tuple[str, ...], asked_for: list[tuple[tuple[str, ...], ...]]
) -> None:
    done = CliRunner().invoke(diagnose, words.split())
    assert isinstance(done.exception, _ReadError), done.output
    assert asked_for == [(train, held, ())]


@pytest.mark.parametrize(
    "words",
    [
        "a --baseline b c --holdout d --jobs 1",
        "a --baseline b --holdout d --baseline c",
        "--baseline=b c --holdout d -- a",
        "a --holdout d --baseline b c --switched-off windage",
    ],
)
def test_baselines_are_named_like_held_out_recordings(words: str, asked_for: list[tuple[tuple[str, ...], ...]]) -> None:
    done = CliRunner().invoke(diagnose, words.split())
    assert isinstance(done.exception, _ReadError), done.output
    assert asked_for == [(("a",), ("d",), ("b", "c"))]


@pytest.mark.parametrize(
    ("words", "option"),
    [
        ("a --baseline --jobs 1", "baseline"),
        ("a --baseline", "baseline"),
        ("a --fleet --baseline b", "baseline"),
        ("a --holdout --jobs 1", "--holdout"),
        ("a --holdout", "--holdout"),
        ("a --holdout -- b", "--holdout"),
    ],
)
def test_recordings_that_are_not_named_or_not_possible(words: str, option: str) -> None:
    """As an empty pattern of the shell leaves them; the next option is no recording."""
    done = CliRunner().invoke(diagnose, words.split())
    assert done.exit_code == 2
    assert option in done.output and "Traceback" not in done.output


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ["--baseline", "pinion.csv"],
            "pinion.csv: is a baseline, but measures T_pinion and nothing that the recordings",
        ),
        (["--baseline", "run.csv@0..3000"], "run.csv: is a baseline, but has the rows of 0 ... 29"),
        (
            ["--baseline", "wheel.csv", "--switched-off", "windge"],
            "windge: is not in the catalogue; did you mean 'windage'",
        ),
        (["--switched-off", "windage"], "--switched-off windage: is about baselines, but there are none"),
        (["--baseline", "loss.csv"], "loss.csv: P_loss is "),
        (["--baseline", "idle.csv"], "idle.csv: "),
    ],
)
def test_baselines_that_cannot_be_used(words: list[str], message: str, tmp_path: Path) -> None:
    time = np.arange(0.0, 3600.0, 20.0)
    table = pd.DataFrame({"time_s": time, "speed_rpm": 1500.0, "torque_Nm": 80.0, "T_oil_degC": 22.0 + time / 200.0})
    table.to_csv(tmp_path / "run.csv", index=False)
    table.rename(columns={"T_oil_degC": "T_pinion_degC"}).assign(T_pinion_degC=30.0 + time / 300.0).to_csv(
        tmp_path / "pinion.csv", index=False
    )
    other = table.assign(T_oil_degC=table["T_oil_degC"] + 0.5)
    other.assign(T_wheel_degC=30.0).to_csv(tmp_path / "wheel.csv", index=False)
    other.assign(P_loss_W=0.3 + time / 1e5).to_csv(tmp_path / "loss.csv", index=False)
    other.drop(columns="T_oil_degC").to_csv(tmp_path / "idle.csv", index=False)
    given = [str(tmp_path / word) if ".csv" in word else word for word in words]
    done = CliRunner().invoke(diagnose, [str(tmp_path / "run.csv"), *given, "--output", str(tmp_path / "out")])
    assert isinstance(done.exception, InputError), done.output
    assert message in str(done.exception)
    assert not (tmp_path / "out").exists()


def test_a_recording_is_never_replaced_by_its_prediction(tmp_path: Path) -> None:
    time = np.arange(0.0, 3600.0, 20.0)
    columns = {"time_s": time, "speed_rpm": 1500.0, "torque_Nm": 80.0, "T_oil_degC": 22.0 + time / 200.0}
    for name in ("run", "hold"):
        pd.DataFrame(columns).to_csv(tmp_path / f"{name}.csv", index=False)
        columns["T_oil_degC"] = columns["T_oil_degC"] + 0.5
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    for words in (["run.csv"], ["run.csv@0..3000"], ["run.csv", "--holdout", "hold.csv"]):
        given = [str(tmp_path / word) if word.startswith(("run", "hold")) else word for word in words]
        done = CliRunner().invoke(diagnose, [*given, "--output", str(tmp_path)])
        assert isinstance(done.exception, InputError), done.output
        assert "is read as well and would be replaced" in str(done.exception)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_a_file_that_no_diagnosis_wrote_is_never_replaced(tmp_path: Path) -> None:
    time = np.arange(0.0, 3600.0, 10.0)
    pd.DataFrame({"time_s": time, "speed_rpm": 1500.0, "torque_Nm": 50.0, "T_ambient_degC": 20.0,
                  "T_oil_degC": 30.0 + time / 600.0}).to_csv(tmp_path / "run.csv", index=False)  # fmt: skip
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "run.csv").write_text("mine")
    done = CliRunner().invoke(diagnose, [str(tmp_path / "run.csv"), "--output", str(tmp_path / "out")])
    assert isinstance(done.exception, InputError) and "exists, and no diagnosis wrote it" in str(done.exception)
    assert (tmp_path / "out" / "run.csv").read_text() == "mine"


def test_what_is_known_reaches_the_diagnosis(fzg: Gearbox, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    known = Correction.of(fzg, calibration=[Estimate(name="h_air", value=1.1, stderr=0.1)])
    write_correction(known, tmp_path / "known.toml")
    given: list[object] = []

    def run(*_: object, correction: object, **__: object) -> None:
        given.append(correction)
        raise InputError("no further")

    monkeypatch.setattr(diagnosis.recordings.read, "read_by_role", lambda *_, **__: ((), (), ()))
    monkeypatch.setattr(fleet, "read_by_role", lambda *_, **__: ((), (), ()))
    monkeypatch.setattr(diagnose_recordings, "diagnose", run)
    monkeypatch.setattr(fleet, "diagnose", run)
    (tmp_path / "machines/a").mkdir(parents=True)
    (tmp_path / "machines/a/run.csv").touch()
    for words in ((tmp_path / "run.csv",), (tmp_path / "machines", "--fleet", "--jobs", "1")):
        done = CliRunner().invoke(diagnose, [
            *map(str, words), "--correction", str(tmp_path / "known.toml"), "--output", str(tmp_path / "out"),
        ])  # fmt: skip
        assert "no further" in str(done.exception), done.output
    assert given == [known, known]


def test_notes_on_recordings_are_printed_once_and_own_notes_after(
    capsys: pytest.CaptureFixture[str],
) -> None:
    command = import_module("builder.commands.diagnose")
    recordings = [SimpleNamespace(name=name, notes=("no air_speed_m_s", f"cleaned {name}")) for name in ("a", "b")]
    command._print_notes(recordings)
    assert capsys.readouterr().err.splitlines() == [
        "note: a, b: no air_speed_m_s", "note: a: cleaned a", "note: b: cleaned b",
    ]  # fmt: skip
    found = SimpleNamespace(notes=("in the corrected model loss_gain = 0.5 is at its limit", "a: cleaned a"))
    command._print_own_notes(found, recordings)
    assert capsys.readouterr().out.splitlines() == ["Note: in the corrected model loss_gain = 0.5 is at its limit"]
