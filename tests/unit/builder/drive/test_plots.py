"""Which temperatures the plot of a cycle draws."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from builder.drive import plots


def test_of_a_group_the_hottest_is_drawn_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[set[str]] = []
    original = plots.draw_curves

    def draw(axes: Any, time: Any, curves: Any, names: Any) -> None:
        drawn.append(set(curves))
        original(axes, time, curves, names)

    monkeypatch.setattr(plots, "draw_curves", draw)
    names = ("oil", "bearing_1", "bearing_2", "bearing_3", "bearing_4", "air")
    columns = {"time_s": np.array([0.0, 60.0]), "speed_rpm": np.full(2, 1500.0), "torque_Nm": np.full(2, 90.0)}
    columns |= {f"T_{name}_degC": np.array([20.0, 90.0 if name == "bearing_3" else 50.0]) for name in names}
    plots.plot_cycle(tmp_path / "run.png", columns, title="run", groups={"bearings": names[1:5]})
    assert drawn == [{"oil", "bearing_1", "bearing_3", "bearing_4"}]
