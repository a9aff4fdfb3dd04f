"""How a row of a cycle is cut for an FMU that holds its inputs, and what a result says of it."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from builder.drive import driver
from models.base.errors import InputError
from models.files.cycle import Cycle


@pytest.mark.parametrize(("names", "duration", "begin", "end", "pieces"), [
    (["speed", "torque"], 20.0, [0.0, 0.0], [0.0, 0.0], 0),
    (["speed", "torque"], 20.0, [0.0, 0.0], [500.0, 0.0], 20),  # 25 1/min a piece
    (["speed", "torque"], 20.0, [0.0, 40.0], [20.0, 10.0], 6),  # 5 N m a piece
    (["speed", "torque"], 20.0, [0.0, 0.0], [9000.0, 0.0], 40),  # 0.5 s at least
    (["oil_flow"], 3.2, [2.0], [-7.5], 7),
    (["oil_flow"], 3.2, [2.0], [2.3], 1),
    ([], 20.0, [], [], 0),
])  # fmt: skip
def test_pieces_of_a_row(names: list[str], duration: float, begin: list[float], end: list[float], pieces: int) -> None:
    assert driver._pieces(names, duration, np.array(begin), np.array(end)) == pieces


class Recorder:
    """A slave that notes its inputs and steps; its output is the time integral of the input."""

    def __init__(self) -> None:
        self.now, self.value, self.total, self.steps = 0.0, 0.0, 0.0, list[tuple[float, float, float]]()

    def __getattr__(self, name: str) -> object:
        return lambda *_, **__: None

    def doStep(self, begin: float, duration: float) -> None:
        assert begin == pytest.approx(self.now)
        self.steps.append((begin, duration, self.value))
        self.now, self.total = begin + duration, self.total + self.value * duration


def test_held_inputs_have_the_mean_of_a_ramp_and_end_at_its_end() -> None:
    slave = Recorder()
    fmu: Any = SimpleNamespace(
        slave=slave, inputs=["oil_flow"], interpolates=False, messages=[], doing="", report_messages=lambda _: None,
        set_inputs=lambda values: setattr(slave, "value", values[0]), outputs=lambda: slave.total,
        columns=lambda rows: {"integral": np.array(rows)},
    )  # fmt: skip
    cycle = Cycle(np.array([10.0, 14.0, 16.0]), {"oil_flow": np.array([2.0, 12.0, 12.0])})
    slave.now = 10.0
    seen, starts = list[tuple[int, int]](), list[float]()

    def note(done: int, rows: int) -> None:
        seen.append((done, rows))

    fmu.set_initial = starts.append
    result = driver._simulate_table(fmu, cycle.time, cycle.inputs["oil_flow"][:, None], 25.0, note)
    assert result["integral"] == pytest.approx([0.0, 4.0 * 7.0, 4.0 * 7.0 + 24.0])
    assert result["oil_flow"].tolist() == [2.0, 12.0, 12.0] and result["time_s"].tolist() == [10.0, 14.0, 16.0]
    ramp = [step for step in slave.steps if step[0] < 14.0 - 1e-9]
    assert len(ramp) == 9  # 8 pieces of 0.5 s, half of one at both ends
    assert ramp[0] == pytest.approx((10.0, 0.25, 2.0)) and ramp[-1] == pytest.approx((13.75, 0.25, 12.0))
    assert ramp[1] == pytest.approx((10.25, 0.5, 3.25))
    assert slave.steps[-1] == pytest.approx((14.0, 2.0, 12.0))
    assert seen == [(2, 2)] and starts == [25.0]


def test_a_folder_is_no_fmu(tmp_path: Path) -> None:
    (tmp_path / "box.fmu").write_bytes(b"")
    with pytest.raises(InputError, match=r"is not a file but a folder; name an FMU, as .*box\.fmu"):
        driver.fmu_machine(tmp_path)
