"""What a diagnosis writes, and what an earlier one left."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from diagnosis.report.write import ALONE, NUMBERS, REPORT, correction_of, files_left_over
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.correction.correction import MeanLoss
from tests.unit.diagnosis.diagnosis_example import missing_physics


def recording(name: str) -> Any:
    return SimpleNamespace(name=name)


def test_files_of_an_earlier_diagnosis_are_known(tmp_path: Path) -> None:
    """What somebody else put there is not among them."""
    (tmp_path / "mine.csv").write_text("time_s\n")
    assert files_left_over(tmp_path, [recording("run_1")], []) == []
    inputs = {"recordings": {"run_1": "", "run_2": ""}, "held_out": {"hold_a": ""}}
    (tmp_path / NUMBERS).write_text(json.dumps({"inputs": inputs}))
    (tmp_path / "run_1.csv").write_text("time_s\n")
    left = files_left_over(tmp_path, [recording("run_1")], [tmp_path / "run_2.csv"])
    assert left == [tmp_path / "hold_a.csv"]  # the other one is read now


def test_what_no_diagnosis_wrote_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / NUMBERS).write_text("[]")
    (tmp_path / ALONE).touch()
    with pytest.raises(InputError, match=f"{ALONE}: exists, and no diagnosis wrote it.*\\n.*{NUMBERS}: exists"):
        files_left_over(tmp_path, [], [])


def test_what_is_read_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / REPORT).touch()
    with pytest.raises(InputError, match=REPORT):
        files_left_over(tmp_path, [], [tmp_path / REPORT])


def test_a_correction_holds_the_mean_loss_as_estimated_and_of_its_model(fzg: Gearbox) -> None:
    found = missing_physics()
    assert correction_of(found, fzg).mean_loss is None
    loss = MeanLoss(estimate_W=220.0, stderr_W=18.0, predicting_W=705.0, delivered_W=216.0)
    assert correction_of(replace(found, model=replace(found.model, mean_loss=loss)), fzg).mean_loss == loss
