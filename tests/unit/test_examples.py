"""The example files do what their remarks say."""

from __future__ import annotations

import runpy
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from diagnosis.recordings.read import read_recordings
from models.assembly.gearbox import Gearbox
from models.mechanisms import CATALOGUE, load_mechanisms
from models.mechanisms.user_files import check_placeable

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_the_mapping_of_the_examples_reads_a_recording_from_a_bench(tmp_path: Path, fzg: Gearbox) -> None:
    minutes = np.arange(0.0, 150.0, 0.25)
    table = pd.DataFrame({
        "Zeit": minutes, "n Antrieb": 100.0 + minutes, "M Abtrieb": 120.0, "Raum": 295.15,
        "Sumpf": 22.0 + minutes / 5.0, "Bemerkung": "ruhig",
    })  # fmt: skip
    text = table.astype({"Sumpf": object})
    text.loc[7, "Sumpf"] = "---"
    text["Sumpf"] = text["Sumpf"].astype(str).str.replace(".", ",")
    text.to_csv(tmp_path / "run.csv", sep=";", decimal=",", index=False)
    shutil.copy(EXAMPLES / "mapping.toml", tmp_path / "mapping.toml")
    (recording,) = read_recordings([tmp_path / "run.csv"], fzg.network())
    assert recording.time[-1] == pytest.approx(7185.0) and len(recording.time) == 480  # rows = 0..7200
    np.testing.assert_allclose(recording.inputs["speed"], (100.0 + minutes[:480]) * 30.0 / np.pi)
    np.testing.assert_allclose(recording.inputs["torque"], 120.0 * 0.667)
    np.testing.assert_allclose(recording.inputs["T_ambient"], 22.0)
    assert (recording.inputs["air_speed"] == 2.0).all()
    (oil,) = recording.channels
    assert (oil.name, oil.noise, oil.resolution, oil.lag_s, oil.lag_sd_s, oil.bias_sd) == ("oil", 0.1, 0.1, 20, 10, 0.5)
    assert np.flatnonzero(np.isnan(oil.values)).tolist() == [7]


def test_the_mechanisms_of_the_examples_have_places_and_names_of_their_own(fzg: Gearbox) -> None:
    found = load_mechanisms(EXAMPLES / "mechanisms.toml")
    check_placeable(found, fzg, "mechanisms.toml")
    assert [mechanism.name for mechanism in found] == ["belt_guard", "cold_floor"]
    assert not {mechanism.name for mechanism in found} & set(CATALOGUE)


def test_the_rod_is_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """From the recording in the repository, with the correction written by hand; the errors are those of the page."""
    monkeypatch.setattr("sys.argv", ["heated_rod.py", str(tmp_path / "rod.png")])
    runpy.run_path(str(EXAMPLES / "heated_rod.py"))
    nominal, corrected = (line.split()[1] for line in capsys.readouterr().out.splitlines()[:2])
    page = (EXAMPLES.parent / "docs" / "validation" / "rod.md").read_text(encoding="utf-8")
    assert f"leaves {corrected} K over the 16 h; nominal it is {nominal} K" in page
    assert (tmp_path / "rod.png").read_bytes()[:4] == b"\x89PNG"
