"""What a diagnosis writes, and what an earlier one left."""

from __future__ import annotations

import json
from pathlib import Path

from diagnosis.report.write import NUMBERS, names_of_files, written_earlier


def test_files_of_an_earlier_diagnosis_are_known(tmp_path: Path) -> None:
    """What somebody else put there is not among them."""
    (tmp_path / "mine.csv").write_text("time_s\n")
    assert written_earlier(tmp_path) == frozenset()
    inputs = {"recordings": {"run_1": "", "run_2": ""}, "held_out": {"hold_a": ""}}
    (tmp_path / NUMBERS).write_text(json.dumps({"inputs": inputs}))
    assert written_earlier(tmp_path) == {*names_of_files(()), "run_1.csv", "run_2.csv", "hold_a.csv"}
    (tmp_path / NUMBERS).write_text("[]")
    assert written_earlier(tmp_path) == frozenset()
