"""ONNX files against the networks in numpy, their metadata, and reproducible bytes."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import onnx
import onnxruntime
import pytest

from builder.surrogate.networks import PRESETS
from builder.surrogate.onnx_export import TOLERANCE, export_onnx, largest_deviation, onnx_evaluator
from builder.surrogate.train import train_surrogate
from models.assembly.gearbox import load_gearbox

SMALL = {
    "samples": 300,
    "judged": 50,
    "max_iter": 15,
    "starts": 1,
    "hidden": dict.fromkeys(("mesh", "no_load", "bearing"), (4, 3)),
}
VERSION = "1.2.3"


@pytest.fixture(scope="module", params=["default", "paper"])
def trained(request):
    return train_surrogate(load_gearbox("fzg"), preset=replace(PRESETS[request.param], **SMALL), seed=5)


@pytest.fixture(scope="module")
def folder(trained, tmp_path_factory):
    folder = tmp_path_factory.mktemp("networks")
    export_onnx(trained, folder, version=VERSION)
    return folder


def evaluator(folder, name):
    return onnx_evaluator((folder / f"{name}.onnx").read_bytes())


def test_onnxruntime_gives_what_numpy_gives(trained, folder):
    evaluators = {network.name: evaluator(folder, network.name) for network in trained.losses.networks}
    in_onnx = trained.losses.with_evaluators(evaluators)
    random = np.random.default_rng(0)
    n, torque, T = random.uniform(-9e3, 9e3, 80), random.uniform(-400.0, 400.0, 80), random.uniform(-60, 250, (80, 7))
    np.testing.assert_allclose(in_onnx.power(n, torque, T), trained.losses.power(n, torque, T), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(
        in_onnx.power(n[0], torque[0], T[0]), trained.losses.power(n[0], torque[0], T[0]), rtol=1e-9, atol=1e-9
    )


def test_a_wrong_weight_is_detected(trained, folder):
    mesh = trained.losses.networks[0]
    bent = replace(mesh, biases=(*mesh.biases[:2], mesh.biases[2] + 1e-6 * np.abs(mesh.biases[2]).max()))
    assert (
        largest_deviation(evaluator(folder, "mesh"), mesh)
        <= TOLERANCE
        < largest_deviation(evaluator(folder, "mesh"), bent)
    )


def test_graph_takes_physical_inputs_in_double_precision(trained, folder):
    for network in trained.losses.networks:
        session = onnxruntime.InferenceSession(folder / f"{network.name}.onnx", providers=["CPUExecutionProvider"])
        (x,), (y,) = session.get_inputs(), session.get_outputs()
        assert (x.name, x.type, x.shape) == ("X", "tensor(double)", ["N", len(network.inputs)])
        assert (y.name, y.type, y.shape) == ("Y", "tensor(double)", ["N", len(network.outputs)])


def test_metadata_name_gearbox_columns_and_errors(trained, folder):
    metadata = {entry.key: entry.value for entry in onnx.load(folder / "bearings_1.onnx").metadata_props}
    assert metadata["definition_hash"] == load_gearbox("fzg").hash
    assert (metadata["version"], metadata["seed"], metadata["preset"]) == (VERSION, "5", trained.preset.name)
    columns = json.loads(metadata["columns"])
    assert [c["name"] for c in columns["inputs"]] == ["speed_rpm", "radial_load_N", "T_oil_degC", "T_bearing_degC"]
    assert columns["inputs"][2]["upper"] == trained.losses.temperature_bounds[1]
    assert columns["outputs"] == ["bearing_W"]
    assert [e["component"] for e in json.loads(metadata["errors"])] == [f"bearing_{i}" for i in (1, 2, 3, 4)]


def test_same_training_same_bytes(trained, folder, tmp_path):
    again = train_surrogate(load_gearbox("fzg"), preset=trained.preset, seed=5, jobs=2)
    for path in export_onnx(again, tmp_path, version=VERSION):
        assert path.read_bytes() == (folder / path.name).read_bytes()
