"""What a diagnosis writes, and what an earlier one left."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

from diagnosis.report.write import NUMBERS, left_from_earlier


def test_predictions_of_an_earlier_diagnosis_are_found(tmp_path: Path) -> None:
    """Those that the new one does not replace; what somebody else put there is not among them."""
    now = cast(Any, [SimpleNamespace(name="run_2"), SimpleNamespace(name="hold")])
    for name in ("run_1", "run_2", "hold_a", "mine"):
        (tmp_path / f"{name}.csv").write_text("time_s\n")
    assert left_from_earlier(tmp_path, now) == []
    inputs = {"recordings": {"run_1": "", "run_2": ""}, "held_out": {"hold_a": "", "gone": ""}}
    (tmp_path / NUMBERS).write_text(json.dumps({"inputs": inputs}))
    assert [path.name for path in left_from_earlier(tmp_path, now)] == ["run_1.csv", "hold_a.csv"]
    (tmp_path / NUMBERS).write_text("[]")
    assert left_from_earlier(tmp_path, now) == []
