"""The native and the Python FMU of a gearbox of two stages: each mesh has its own network, fed by its own shaft."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fmpy.validation import validate_fmu

from builder.drive.driver import drive_fmu
from builder.fmi.reference_cycle import reference_cycle
from builder.native.native_fmu import build_native_fmu
from builder.python.python_fmu import build_python_fmu
from builder.surrogate.onnx_export import export_onnx
from builder.surrogate.train import TrainingResult, train_surrogate
from models.assembly.gearbox import load_gearbox
from models.files.cycle import Cycle
from tests.conftest import QUICK

TWO = load_gearbox("two_stage")


@pytest.fixture(scope="module")
def training() -> TrainingResult:
    return train_surrogate(TWO, preset=QUICK, seed=0)


def test_quick_networks_know_every_loss(training: TrainingResult) -> None:
    assert [row.component for row in training.report] == list(TWO.losses().components)
    assert min(row.r_squared for row in training.report) > 0.995
    assert max(row.median for row in training.report) < 0.03


def test_both_fmus_are_the_network_with_the_surrogate(training: TrainingResult, tmp_path: Path) -> None:
    """The native one along ramps of the inputs, too; the Python one holds them over a step."""
    time = np.linspace(0.0, 600.0, 61)
    held = Cycle.from_columns({"time_s": time, "speed_rpm": np.full(61, -1450.0), "torque_Nm": np.full(61, 130.0)})
    onnx = export_onnx(training, tmp_path / "networks", version="0")
    native = build_native_fmu(TWO, training, tmp_path / "two.fmu", platforms="host")
    python = build_python_fmu(TWO, training, onnx, tmp_path / "two_python.fmu")
    for fmu, cycle in ((native, reference_cycle(TWO)), (native, held), (python, held)):
        assert validate_fmu(str(fmu)) == []
        expected = TWO.network().simulate(cycle, losses=training.losses, initial=20.0).columns()
        driven = drive_fmu(fmu, cycle, initial=20.0)
        assert {"P_loss_mesh_sliding_2_W", "P_loss_churning_2_W", "T_mesh_2_degC"} <= set(driven)
        for name, values in expected.items():
            scale = np.max(np.abs(values + (273.15 if name.endswith("_degC") else 0.0)))
            np.testing.assert_allclose(driven[name], values, rtol=0.0, atol=1e-9 * scale, err_msg=name)


def test_it_is_the_full_model_within_the_error_of_the_quick_networks(training: TrainingResult) -> None:
    cycle = reference_cycle(TWO)
    full = TWO.simulate(cycle, initial=20.0)
    found = TWO.network().simulate(cycle, losses=training.losses, initial=20.0)
    for node, T in full.temperatures.items():
        assert np.abs(found.temperatures[node] - T).max() < 0.5, node
