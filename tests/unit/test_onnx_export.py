"""ONNX files: the same numbers as numpy, the same bytes, and no file that is not what it says."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import onnx
import onnxruntime
import pytest

from builder.networks import PRESETS
from builder.onnx_export import TOLERANCE, export_onnx, largest_deviation, load_evaluators, load_onnx
from builder.train import train_surrogate
from models.errors import InputError
from models.gearbox import load_gearbox

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


def test_onnxruntime_gives_what_numpy_gives(trained, folder):
    for network in trained.losses.networks:
        assert largest_deviation(load_onnx(folder / f"{network.name}.onnx"), network) <= TOLERANCE
    evaluators = load_evaluators(trained.losses, folder, definition_hash=trained.definition_hash)
    in_onnx = trained.losses.with_evaluators(evaluators)
    random = np.random.default_rng(0)
    n, torque, T = random.uniform(-9e3, 9e3, 80), random.uniform(-400.0, 400.0, 80), random.uniform(-60, 250, (80, 7))
    np.testing.assert_allclose(in_onnx.power(n, torque, T), trained.losses.power(n, torque, T), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(
        in_onnx.power(n[0], torque[0], T[0]), trained.losses.power(n[0], torque[0], T[0]), rtol=1e-9, atol=1e-9
    )


def test_a_wrong_weight_would_be_seen(trained, folder):
    mesh = trained.losses.networks[0]
    bent = replace(mesh, biases=(*mesh.biases[:2], mesh.biases[2] + 1e-6 * np.abs(mesh.biases[2]).max()))
    assert largest_deviation(load_onnx(folder / "mesh.onnx"), bent) > TOLERANCE


def test_graph_takes_physical_inputs_in_double_precision(trained, folder):
    for network in trained.losses.networks:
        session = onnxruntime.InferenceSession(folder / f"{network.name}.onnx", providers=["CPUExecutionProvider"])
        (x,), (y,) = session.get_inputs(), session.get_outputs()
        assert (x.name, x.type, x.shape) == ("X", "tensor(double)", ["N", len(network.inputs)])
        assert (y.name, y.type, y.shape) == ("Y", "tensor(double)", ["N", len(network.outputs)])


def test_metadata_say_where_the_network_comes_from(trained, folder):
    metadata = load_onnx(folder / "bearings_1.onnx").metadata
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


def _copy(folder, tmp_path, change):
    path = tmp_path / "mesh.onnx"
    path.write_bytes(change((folder / "mesh.onnx").read_bytes()))
    return path


def _flip(content: bytes) -> bytes:
    """Change one bit in the middle of a weight."""
    model = onnx.ModelProto.FromString(content)
    at = content.index(max((t.raw_data for t in model.graph.initializer), key=len)) + 40
    return content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]


def _bare(content: bytes) -> bytes:
    model = onnx.ModelProto.FromString(content)
    del model.metadata_props[:]
    return model.SerializeToString()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda content: b"", "not a network of this version"),
        (lambda content: content[: len(content) // 2], "damaged or not an ONNX file"),
        (lambda content: b"speed,torque\n1,2\n", "damaged or not an ONNX file"),
        (_flip, "does not match its digest"),
        (_bare, "not a network of this version"),
    ],
)
def test_damaged_files_are_refused(folder, tmp_path, change, message):
    with pytest.raises(InputError, match=rf"mesh\.onnx: .*{message}.*build the FMU again"):
        load_onnx(_copy(folder, tmp_path, change))


def test_files_of_another_gearbox_or_network_are_refused(trained, folder, tmp_path):
    mesh, bearings = trained.losses.networks[:2]
    with pytest.raises(InputError, match=r"trained for gearbox definition .*, not for 0123"):
        load_onnx(folder / "mesh.onnx", definition_hash="0123" * 16)
    with pytest.raises(InputError, match=r"holds network 'mesh' .* 'bearings_1' .* is needed"):
        load_onnx(folder / "mesh.onnx", network=bearings)
    with pytest.raises(InputError, match="is needed"):
        load_onnx(folder / "mesh.onnx", network=replace(mesh, upper=(9000.0, *mesh.upper[1:])))
    with pytest.raises(InputError, match=r"mesh\.onnx: the network cannot be read \(No such file"):
        load_evaluators(trained.losses, tmp_path, definition_hash=trained.definition_hash)
