"""What a verb is given is what the function behind it gets."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

import builder.workflows.build
from builder.commands.cli import commands
from diagnosis import diagnose_recordings
from diagnosis.decision.settings import Settings
from models.assembly.gearbox import Gearbox
from models.correction.correction import Correction, Estimate, write_correction
from models.mechanisms import CATALOGUE

ROOT = Path(__file__).parents[2]


class _AskedError(Exception):
    """Raised in place of the work."""


def invoked(*words: object) -> None:
    done = CliRunner().invoke(commands, [str(word) for word in words])
    assert isinstance(done.exception, _AskedError), done.output


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    time = np.arange(0.0, 3600.0, 20.0)
    columns = {"time_s": time, "speed_rpm": 1500.0, "torque_Nm": 80.0, "T_oil_degC": 22.0 + time / 200.0}
    pd.DataFrame(columns).to_csv(tmp_path / "run.csv", index=False)
    return tmp_path / "run.csv"


def recorder(asked: list[dict[str, Any]]) -> Any:
    def ask(*_: object, **options: Any) -> object:
        asked.append(options)
        raise _AskedError

    return ask


def test_diagnose_passes_catalogue_and_rate_on(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[dict[str, Any]] = []
    monkeypatch.setattr(diagnose_recordings, "diagnose", recorder(asked))
    usual = ("diagnose", recording, "--output", tmp_path / "out")
    invoked(*usual)
    own = ROOT / "examples/mechanisms.toml"
    numbers = (
        "--false-alarm-rate",
        0.01,
        "--matters-K",
        2,
        "--matters-W",
        5,
        "--claim-from",
        0.8,
        "--odds-unknown",
        0.2,
    )
    invoked(*usual, "--without-mechanism", "windage", "--mechanisms", own, *numbers)
    plain, special = asked
    assert set(plain["catalogue"]) == set(CATALOGUE)
    assert set(CATALOGUE) - set(special["catalogue"]) == {"windage"}
    assert f'name = "{min(set(special["catalogue"]) - set(CATALOGUE))}"' in own.read_text()
    assert plain["settings"] == Settings()
    assert special["settings"] == Settings(
        false_alarm_rate=0.01, matters_K=2.0, matters_W=5.0, claim_from=0.8, odds_unknown=0.2
    )


def test_build_passes_correction_preset_and_platforms_on(
    fzg: Gearbox, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[dict[str, Any]] = []
    monkeypatch.setattr(builder.workflows.build, "build", recorder(asked))
    correction = Correction.of(fzg, calibration=[Estimate(name="mesh", value=1.07, stderr=0.02)])
    write_correction(correction, tmp_path / "correction.toml")
    usual = ("build-fmu", "--output", tmp_path / "out")
    invoked(*usual)
    invoked(*usual, "--correction", tmp_path / "correction.toml", "--preset", "paper", "--target", "native",
            "--platforms", "win64", "--samples", 300, "--seed", 4, "--retrain")  # fmt: skip
    plain, special = asked
    names = ("target", "platforms", "preset", "samples", "seed", "retrain")
    assert tuple(plain[name] for name in names) == ("both", "host", "default", None, 0, False)
    assert tuple(special[name] for name in names) == ("native", "win64", "paper", 300, 4, True)
    assert plain["correction"] is None
    assert [(c.name, c.value) for c in special["correction"].calibration] == [("mesh", 1.07)]
