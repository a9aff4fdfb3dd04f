"""Which calibration is judged, and how often: a diagnosis with its stages replaced."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from diagnosis import diagnose_recordings
from models.assembly.gearbox import Gearbox
from tests.unit.diagnosis.inference_example import recorded


def diagnosed(fzg: Gearbox, monkeypatch: pytest.MonkeyPatch, **stages: Any) -> Any:
    """What is reported, and the calibration that it is reported with; stages that are not given do nothing."""
    idle: dict[str, Any] = {
        "prepare_experiment": lambda *_, **__: (None, SimpleNamespace(pieces=[SimpleNamespace(recording="made")])),
        "calibrate": lambda *_: None, "calibrate_apart": lambda *_: (None, ()),
        "start_with_switches": lambda *_: None, "calibrated_to_predict": lambda *_: None,
        "candidates_of": lambda *_: (), "outside_of": lambda *_: (),
        "scan_at": lambda *_: None, "faulty_channels": lambda *_: (), "decide": lambda *_: (),
        "assemble": lambda setup, experiment, posterior, *_, **given: (posterior.name, given["calibration"].name),
    }  # fmt: skip
    for name, stage in (idle | stages).items():
        monkeypatch.setattr(diagnose_recordings, name, stage)
    return diagnose_recordings.diagnose(recorded(fzg, "made", hours=0.5), fzg)


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
        return SimpleNamespace(name=name, chosen=SimpleNamespace(log_evidence=log_evidence), of_others=None, fit=None)

    found: list[str] = []

    def infer(given: Any, *_: object, **__: object) -> Any:
        found.append(given.name)
        return SimpleNamespace(name=given.name, elsewhere="there" if given.name in seen_from else None, detected=False)

    result = diagnosed(
        fzg, monkeypatch, infer=infer, calibrate_with_error=lambda *_: calibration("first", 0.0),
        calibrate_in_draughts=lambda *_: None,
        recalibrate=lambda first, _: calibration("second", again) if again > 0.0 else first,
    )  # fmt: skip
    assert found == judged and result == (reported, reported)


@pytest.mark.parametrize(("worth", "detected", "reported"), [
    (["still", "draughts"], {"still": 60.0}, "still"),  # an effect in still air, against draughts
    (["still", "draughts"], {"still": 60.0, "draughts": 70.0}, "draughts"),
    (["draughts"], {}, "draughts"),
    (["still", "draughts"], {}, "draughts"),  # nothing: the machine that is more probable
])  # fmt: skip
def test_effects_are_weighed_in_still_air_and_in_draughts(
    fzg: Gearbox, monkeypatch: pytest.MonkeyPatch, worth: list[str], detected: dict[str, float], reported: str
) -> None:
    both: dict[str, Any] = {
        name: SimpleNamespace(name=name, chosen=SimpleNamespace(log_evidence=evidence), of_others=None, fit=None)
        for name, evidence in (("still", 0.0), ("draughts", 100.0))
    }
    rivals: list[float] = []

    def infer(given: Any, *_: object, rival: float, **__: object) -> Any:
        rivals.append(rival)
        return SimpleNamespace(name=given.name, elsewhere=None, detected=given.name in detected,
                               log_e=detected.get(given.name, -5.0))  # fmt: skip

    result = diagnosed(
        fzg, monkeypatch, infer=infer, calibrate_with_error=lambda *_: both["still"],
        calibrate_in_draughts=lambda *_: both["draughts"],
        worth_weighing=lambda scanned: [one for one in scanned if one[0].name in worth],
    )  # fmt: skip
    assert result == (reported, reported)
    assert rivals == [100.0] * len(worth)  # an effect has to exceed the machine in draughts
