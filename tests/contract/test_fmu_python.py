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

import pytest

from builder.drive.driver import loaded
from builder.surrogate.train import TrainingResult
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from tests.contract.fmu_host import hosted

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
        "import pickle, sys; from pathlib import Path; from builder.python.python_fmu import build_python_fmu; "
        "from models.assembly.gearbox import load_gearbox; "
        "training, networks = pickle.loads(Path(sys.argv[1]).read_bytes()); "
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


def test_build_leaves_this_process_as_it_was(build_fmu: Build, tmp_path: Path) -> None:
    path, modules = list(sys.path), set(sys.modules)
    build_fmu(tmp_path / "fzg.fmu")
    assert sys.path == path
    assert not [name for name in set(sys.modules) - modules if name.startswith("fzg_")]


def test_law_that_is_no_expression_is_refused(build_fmu: Build, fzg: Gearbox, tmp_path: Path) -> None:
    network = fzg.network().with_source("oil", lambda s: 5.0 if s.speed > 100.0 else 0.0, name="switched")
    with pytest.raises(InputError, match="Piecewise"):
        build_fmu(tmp_path / "fzg.fmu", network)


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
        (lambda content: None, "mesh.onnx is missing"),
        (lambda content: content[: len(content) // 2], "mesh.onnx is missing, damaged"),
        (lambda content: b"", "mesh.onnx is missing, damaged"),
        (lambda content: content[:1000] + bytes([content[1000] ^ 1]) + content[1001:], "mesh.onnx is missing, damaged"),
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


# ---------------------------------------------------------------------- other networks


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
