"""Which recordings ``diagnose`` learns from, which it holds out, and which are baselines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import diagnosis.recordings.read
from builder.commands.diagnose import diagnose
from models.base.errors import InputError


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


@pytest.mark.parametrize("words", ["a --baseline --jobs 1", "a --baseline", "a --fleet --baseline b"])
def test_baselines_that_are_not_named_or_not_possible(words: str) -> None:
    done = CliRunner().invoke(diagnose, words.split())
    assert done.exit_code == 2
    assert "baseline" in done.output and "Traceback" not in done.output


@pytest.mark.parametrize("words", ["a --holdout --jobs 1", "a --holdout", "a --holdout -- b"])
def test_held_out_recordings_that_are_not_named_are_missed(words: str) -> None:
    """As an empty pattern of the shell leaves them; the next option is no recording."""
    done = CliRunner().invoke(diagnose, words.split())
    assert done.exit_code == 2
    assert "--holdout" in done.output and "Traceback" not in done.output


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
