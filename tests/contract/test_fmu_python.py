"""What is special to the FMU that runs in Python: packaging, damaged files, other networks, its needs."""

from __future__ import annotations

import hashlib
import importlib
import os
import pickle
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu

from builder.fmu import build_python_fmu
from builder.fmu_drive import drive_fmu, loaded
from builder.train import TrainingResult
from models.cycle import Cycle
from models.errors import InputError
from models.gearbox import Gearbox
from tests.contract.fmu_host import hosted
from tests.contract.networks import extended

Build = Callable[..., Path]
OUTPUTS = ("oil.T", "mesh.T", "loss.total")


def rewritten(source: Path, target: Path, changes: dict[str, bytes | None]) -> Path:
    """A copy of an archive with some files exchanged, or left out."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            content = changes.get(name, old.read(name))
            if content is not None:
                new.writestr(name, content)
    return target


# ---------------------------------------------------------------------- packaging


def test_archive_is_complete(fzg_fmu: Path) -> None:
    with zipfile.ZipFile(fzg_fmu) as archive:
        names = archive.namelist()
        page = archive.read("documentation/index.html").decode()
        assert archive.read("modelDescription.xml") == archive.read("resources/modelDescription.xml")
        assert {entry.compress_type for entry in archive.infolist()} == {zipfile.ZIP_DEFLATED}
    assert names == sorted(names)
    assert {
        "modelDescription.xml",
        "model.png",
        "binaries/linux64/fzg.so",
        "binaries/win64/fzg.dll",
        "documentation/index.html",
        "documentation/licenses/license.txt",
        "documentation/licenses/pythonfmu.txt",
        "documentation/reference_in.csv",
        "documentation/reference_out.csv",
        "resources/mesh.onnx",
        "resources/requirements.txt",
    } <= set(names)
    assert not [name for name in names if "__pycache__" in name or name.endswith(".pyc")]
    for text in ("loss.mesh_sliding", "LD_PRELOAD", "onnxruntime", "in_domain"):
        assert text in page


def test_same_definition_gives_the_same_bytes_in_any_process(
    fzg_fmu: Path, fzg_training: TrainingResult, fzg_networks: tuple[Path, ...], tmp_path: Path
) -> None:
    (tmp_path / "training").write_bytes(pickle.dumps((fzg_training, fzg_networks)))
    script = (
        "import pickle, sys; from pathlib import Path; from builder.fmu import build_python_fmu; "
        "from models.gearbox import load_gearbox; training, networks = pickle.loads(Path(sys.argv[1]).read_bytes()); "
        "build_python_fmu(load_gearbox('fzg'), training, networks, Path(sys.argv[2]))"
    )
    again = tmp_path / "fzg.fmu"
    subprocess.run(
        [sys.executable, "-c", script, str(tmp_path / "training"), str(again)],
        check=True,
        cwd=Path(__file__).parents[2],
        env={**os.environ, "PYTHONHASHSEED": "7"},
    )
    assert again.read_bytes() == fzg_fmu.read_bytes()


def test_guid_follows_the_content(build_fmu: Build, fzg: Gearbox, fzg_fmu: Path, tmp_path: Path) -> None:
    changed = build_fmu(tmp_path / "fzg.fmu", fzg.network().with_source("oil", lambda s: 5.0, name="heater"))
    with loaded(changed) as one, loaded(fzg_fmu) as other:
        assert one.description.guid != other.description.guid


def test_build_leaves_this_process_as_it_was(build_fmu: Build, tmp_path: Path) -> None:
    path, modules = list(sys.path), set(sys.modules)
    build_fmu(tmp_path / "fzg.fmu")
    assert sys.path == path
    assert not [name for name in set(sys.modules) - modules if name.startswith("fzg_")]


def test_folder_that_cannot_be_written_is_refused(build_fmu: Build, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        build_fmu(tmp_path / "file" / "fzg.fmu")


def test_failed_build_leaves_no_file(fzg: Gearbox, fzg_training: TrainingResult, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"mesh\.onnx"):
        build_python_fmu(fzg, fzg_training, [], tmp_path / "fzg.fmu")
    assert list(tmp_path.iterdir()) == []


def test_law_that_is_no_expression_is_refused(build_fmu: Build, fzg: Gearbox, tmp_path: Path) -> None:
    network = fzg.network().with_source("oil", lambda s: 5.0 if s.speed > 100.0 else 0.0, name="switched")
    with pytest.raises(InputError, match="Piecewise"):
        build_fmu(tmp_path / "fzg.fmu", network)


def test_reference_run_is_what_fmpy_finds(fzg_fmu: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(fzg_fmu) as archive:
        archive.extractall(tmp_path, [name for name in archive.namelist() if name.startswith("documentation/")])
    given = np.genfromtxt(tmp_path / "documentation/reference_in.csv", delimiter=",", names=True, deletechars="")
    expected = pd.read_csv(tmp_path / "documentation/reference_out.csv")
    names = [name for name in expected.columns if name != "time"]
    result = simulate_fmu(str(fzg_fmu), stop_time=600.0, output_interval=10.0, input=given, output=names)
    assert result["time"].tolist() == expected["time"].tolist()
    for name in names:
        np.testing.assert_allclose(result[name], expected[name], rtol=1e-7, atol=1e-7, err_msg=name)


# ---------------------------------------------------------------------- where it runs


def test_needs_only_numpy_and_onnxruntime(fzg_fmu: Path, tmp_path: Path) -> None:
    script = f"""
import sys
from fmpy import simulate_fmu
start_values = {{"speed": 300.0, "torque": 150.0}}
result = simulate_fmu({str(fzg_fmu)!r}, stop_time=2.0, output_interval=1.0, start_values=start_values)
assert result["oil.T"][-1] > 293.15
heavy = {{"scipy", "sympy", "pydantic", "sklearn", "onnx", "pandas", "models", "builder", "fmu_src"}} & set(sys.modules)
assert not heavy, heavy
assert not [entry for entry in sys.path if "resources" in entry], sys.path
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, cwd=tmp_path,
                          env={k: v for k, v in os.environ.items() if k != "PYTHONPATH"})  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""


@pytest.mark.parametrize(
    ("damage", "named"),
    [
        (lambda content: None, "mesh.onnx cannot be read"),
        (lambda content: content[: len(content) // 2], "mesh.onnx is not as built"),
        (lambda content: b"", "mesh.onnx is not as built"),
        (lambda content: content[:1000] + bytes([content[1000] ^ 1]) + content[1001:], "mesh.onnx is not as built"),
    ],
)
def test_damaged_network_stops_the_instantiation(
    fzg_fmu: Path,
    tmp_path: Path,
    damage: Callable[[bytes], bytes | None],
    named: str,
    capfd: pytest.CaptureFixture[str],
) -> None:
    with zipfile.ZipFile(fzg_fmu) as archive:
        content = damage(archive.read("resources/mesh.onnx"))
    broken = rewritten(fzg_fmu, tmp_path / "broken.fmu", {"resources/mesh.onnx": content})
    with pytest.raises(InputError, match=named), loaded(broken):
        pass
    assert named in capfd.readouterr().err  # a host without logging sees it too


def test_damaged_data_stops_the_instantiation(fzg_fmu: Path, tmp_path: Path) -> None:
    broken = rewritten(fzg_fmu, tmp_path / "broken.fmu", {"resources/twin.json": b"{}"})
    with pytest.raises(InputError, match=r"twin\.json is not as built"), loaded(broken):
        pass


def test_paths_with_blanks_and_other_letters(fzg_fmu: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "Prüfstand Ω 齿轮 100%"
    (folder / "tmp ü").mkdir(parents=True)
    monkeypatch.setattr("tempfile.tempdir", str(folder / "tmp ü"))
    copy = folder / "Getriebe ä b.fmu"
    copy.write_bytes(fzg_fmu.read_bytes())
    cycle = Cycle.from_columns({"time_s": [0.0, 1.0], "speed_rpm": [1000.0, 1000.0], "torque_Nm": [100.0, 100.0]})
    assert drive_fmu(copy, cycle)["T_oil_degC"][-1] > 27.0
    assert list((folder / "tmp ü").iterdir()) == []


# ---------------------------------------------------------------------- other networks


def test_extended_network_runs_as_in_python(
    build_fmu: Build, fzg: Gearbox, fzg_training: TrainingResult, tmp_path: Path
) -> None:
    network = extended(fzg.network())
    path = build_fmu(tmp_path / "extended box.fmu", network)
    assert validate_fmu(str(path)) == []
    time = np.arange(0.0, 121.0)
    columns = {"time_s": time, "speed_rpm": 0.0 * time + 2000.0, "torque_Nm": 0.0 * time + 200.0, "pump_flow": time}
    cycle = Cycle.from_columns(columns, extra=("pump_flow",))
    expected = network.simulate(cycle, losses=fzg_training.losses, initial=25.0)
    driven = drive_fmu(path, cycle, initial=25.0)
    assert list(driven) == list(expected.columns())
    assert driven["P_loss_pump_W"][-1] == pytest.approx(360.0)
    assert driven["T_cellar_degC"] == pytest.approx(10.0 + 0.0 * time)
    heater = expected.extra_heat["heater (electric)"]
    assert 0.0 < np.mean(heater > 0.0) < 1.0
    with hosted(path) as host:
        assert host.get("heat.'heater (electric)'", "state.heater_on") == [4000.0, 1.0]
        host.step(1.0, count=60)
        assert host.get("heat.'heater (electric)'", "state.heater_on") == [0.0, 0.0]
        state, time_0 = host.slave.getFMUstate(), host.time
        host.step(100.0)
        first = host.outputs()
        host.slave.setFMUstate(state)
        host.time = time_0
        host.step(100.0)
        assert host.outputs() == first
        host.slave.freeFMUstate(state)


def test_different_fmus_do_not_touch_each_other(build_fmu: Build, fzg: Gearbox, fzg_fmu: Path, tmp_path: Path) -> None:
    other_fmu = build_fmu(tmp_path / "fzg.fmu", fzg.network().with_source("oil", lambda s: s.speed, name="heater"))
    assert hashlib.sha256(other_fmu.read_bytes()).digest() != hashlib.sha256(fzg_fmu.read_bytes()).digest()

    def alone(path: Path) -> list[float]:
        with hosted(path) as host:
            host.step(1.0, count=20)
            return host.get(*OUTPUTS)

    expected = alone(fzg_fmu), alone(other_fmu)
    assert expected[1][0] > expected[0][0] + 1.0
    with hosted(other_fmu) as second, hosted(fzg_fmu) as first:
        for _ in range(20):
            first.step(1.0)
            second.step(1.0)
        assert (first.get(*OUTPUTS), second.get(*OUTPUTS)) == expected


def test_messages_are_safe_as_printf_formats(fzg_fmu: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with zipfile.ZipFile(fzg_fmu) as archive:
        archive.extractall(tmp_path)
    resources = str(tmp_path / "resources")
    monkeypatch.syspath_prepend(resources)
    module = importlib.import_module((tmp_path / "resources/slavemodule.txt").read_text())
    slave = module.Slave(instance_name="a", resources=resources)
    slave.log("at 100 %s")
    assert slave.log_queue[-1].msg == "at 100 %%s"
