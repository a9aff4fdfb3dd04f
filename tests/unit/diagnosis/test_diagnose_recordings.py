"""Which calibration is judged, and how often: a diagnosis with its stages replaced."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from diagnosis import diagnose_recordings
from models.assembly.gearbox import Gearbox
from tests.unit.diagnosis.inference_example import recorded


@pytest.mark.parametrize(("seen_from", "again", "judged", "reported"), [
    (["first"], 5.0, ["first", "second"], "second"),  # a better basin was seen, and it is better
    (["first", "second"], 5.0, ["first", "second"], "second"),  # once more, and no third time
    (["first"], -5.0, ["first"], "first"),  # with its own model error it is not
    ([], 5.0, ["first"], "first"),
])  # fmt: skip
def test_all_is_judged_once_more_from_a_better_basin(
    fzg: Gearbox, monkeypatch: pytest.MonkeyPatch, seen_from: list[str], again: float, judged: list[str], reported: str
) -> None:
    def calibration(name: str, log_evidence: float) -> Any:
        return SimpleNamespace(name=name, chosen=SimpleNamespace(log_evidence=log_evidence), of_others=None)

    found: list[str] = []

    def infer(given: Any, *_: object, **__: object) -> Any:
        found.append(given.name)
        return SimpleNamespace(name=given.name, elsewhere="there" if given.name in seen_from else None)

    stages: dict[str, Any] = {
        "prepare_experiment": lambda *_, **__: (None, SimpleNamespace(pieces=[SimpleNamespace(recording="made")])),
        "calibrate": lambda *_: None,
        "calibrate_apart": lambda *_: (None, ()),
        "calibrate_with_error": lambda *_: calibration("first", 0.0),
        "recalibrate": lambda *_: calibration("second", again),
        "start_with_switches": lambda *_: None, "candidates_of": lambda *_: (), "outside_of": lambda *_: (),
        "infer": infer, "faulty_channels": lambda *_: (), "decide": lambda *_: (),
        "assemble": lambda setup, experiment, posterior, *_, **given: (posterior.name, given["calibration"].name),
    }  # fmt: skip
    for name, stage in stages.items():
        monkeypatch.setattr(diagnose_recordings, name, stage)
    result: Any = diagnose_recordings.diagnose(recorded(fzg, "made", hours=0.5), fzg)
    assert found == judged and result == (reported, reported)
