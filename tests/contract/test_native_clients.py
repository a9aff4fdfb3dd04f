"""The native FMU in the clients that users have: all give the same numbers for the same 600 s."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fmpy import simulate_fmu

from builder.native.compile import compile_libraries
from models.assembly.gearbox import Gearbox
from tests.contract.fmu_host import hosted
from tests.contract.native_hosts import COMPILER, SOURCES, Unpacked, compiled, needs_compiler, objects, run, unpacked

AGREEMENT = 1e-9  # of every output, relative to its value or 1
STEPS = 600
TOOLS = f"{os.environ['PATH']}{os.pathsep}/usr/lib/wine"  # of Debian
WINE = shutil.which("wine64", path=TOOLS) or shutil.which("wine")


@pytest.fixture(scope="module")
def fmu(fzg_native: Path, tmp_path_factory: pytest.TempPathFactory) -> Unpacked:
    return unpacked(fzg_native, tmp_path_factory.mktemp("clients"))


@pytest.fixture(scope="module")
def inputs(fmu: Unpacked) -> pd.DataFrame:
    """One row per second, in which all four inputs change: every client must hold them for the same second."""
    t = np.arange(STEPS + 1.0)
    return pd.DataFrame(
        {
            "time": t,
            "speed": 250.0 + 200.0 * np.sin(t / 60.0),
            "torque": 80.0 + 60.0 * np.cos(t / 45.0),
            "T_ambient": 293.15 + t / 100.0,
            "air_speed": 2.0 + (t // 100) % 3,
        }
    )


@pytest.fixture(scope="module")
def expected(fmu: Unpacked, fzg_native: Path, inputs: pd.DataFrame) -> np.ndarray:
    """Outputs at the end of every second, from plain FMI calls."""
    rows = []
    with hosted(fzg_native, inputs.iloc[0, 1:].to_dict()) as host:
        for row in inputs.iloc[:-1].itertuples():
            host.set(speed=row.speed, torque=row.torque, T_ambient=row.T_ambient, air_speed=row.air_speed)
            host.step(1.0)
            rows.append(host.get(*fmu.named("output")))
    return np.array(rows)


def assert_agree(found: np.ndarray, expected: np.ndarray, names: list[str]) -> None:
    assert found.shape == expected.shape
    difference = np.abs(found - expected) / np.maximum(1.0, np.abs(expected))
    worst = np.unravel_index(np.argmax(difference), difference.shape)
    assert difference[worst] <= AGREEMENT, f"{names[worst[1]]} at row {worst[0]}: {difference[worst]:.3g}"


# ---------------------------------------------------------------------- FMPy


def simulated(path: Path, inputs: pd.DataFrame, names: list[str]) -> np.ndarray:
    """The same seconds by FMPy's ``simulate_fmu``."""
    result = simulate_fmu(
        str(path), stop_time=float(STEPS), output_interval=1.0, input=inputs.to_records(index=False), output=names,
        start_values=inputs.iloc[0, 1:].to_dict(),
    )  # fmt: skip
    return np.array([list(row)[1:] for row in result[1:]])


def test_fmpy_simulates(fzg_native: Path, fmu: Unpacked, inputs: pd.DataFrame, expected: np.ndarray) -> None:
    names = fmu.named("output")
    assert_agree(simulated(fzg_native, inputs, names), expected, names)


def test_fmpy_ends_at_a_refused_step(fzg_native: Path, inputs: pd.DataFrame) -> None:
    """In a process of its own: a host that is not told to end tries the same step for ever."""
    program = (
        "import sys, numpy as np; from fmpy import simulate_fmu\n"
        "rows = [(t, 300.0, 100.0, 293.15 if t < 10 else 20.0, 2.0) for t in range(20)]\n"
        "kinds = [(n, float) for n in ('time', 'speed', 'torque', 'T_ambient', 'air_speed')]\n"
        "done = simulate_fmu(sys.argv[1], stop_time=20.0, output_interval=1.0, input=np.array(rows, dtype=kinds))\n"
        "print(done['time'][-1])"
    )
    said = run([sys.executable, "-c", program, fzg_native])
    assert "if 20 degC is meant, set 293.15" in said
    assert 9.0 <= float(said.splitlines()[-1]) <= 10.0


def test_the_command_line_of_fmpy_validates_and_simulates(fzg_native: Path, tmp_path: Path) -> None:
    fmpy_command = [sys.executable, "-m", "fmpy"]
    assert "No problems found" in run([*fmpy_command, "validate", fzg_native])
    output = tmp_path / "result.csv"
    run([*fmpy_command, "simulate", "--stop-time", "60", "--output-file", output, fzg_native])
    assert len(pd.read_csv(output)) > 10


@pytest.mark.skipif(shutil.which("cmake") is None, reason="no cmake")
@needs_compiler
def test_fmpy_compiles_the_sources_that_it_carries(
    fzg_native: Path, fmu: Unpacked, inputs: pd.DataFrame, expected: np.ndarray, tmp_path: Path
) -> None:
    compiled_here = tmp_path / "fzg.fmu"
    with zipfile.ZipFile(fzg_native) as archive, zipfile.ZipFile(compiled_here, "w") as bare:
        for name in archive.namelist():
            if not name.startswith("binaries/"):
                bare.writestr(name, archive.read(name))
    run([sys.executable, "-m", "fmpy", "compile", compiled_here], cwd=tmp_path)
    names = fmu.named("output")
    assert_agree(simulated(compiled_here, inputs, names), expected, names)


# ---------------------------------------------------------------------- Open Simulation Platform


def test_libcosimpy_simulates(fzg_native: Path, fmu: Unpacked, inputs: pd.DataFrame, expected: np.ndarray) -> None:
    pytest.importorskip("libcosimpy")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    names, second = fmu.named("output"), 10**9
    execution = CosimExecution.from_step_size(step_size=second)
    index = execution.add_local_slave(CosimLocalSlave(fmu_path=str(fzg_native), instance_name="gearbox"))
    manipulator, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(manipulator)
    execution.add_observer(observer)
    given, wanted = ([fmu.variables[n].valueReference for n in group] for group in (inputs.columns[1:], names))
    rows = []
    for values in inputs.iloc[:-1, 1:].to_numpy().tolist():
        assert manipulator.slave_real_values(index, given, values)
        assert execution.step()
        rows.append(list(observer.last_real_values(slave_index=index, variable_references=wanted)))
    assert_agree(np.array(rows), expected, names)


# ---------------------------------------------------------------------- ecos


@pytest.mark.parametrize("fixture", ["fzg_native", "fzg_native3"])
def test_ecos_simulates(
    fixture: str, fmu: Unpacked, inputs: pd.DataFrame, expected: np.ndarray, request: pytest.FixtureRequest
) -> None:
    ecospy = ecos()
    names, rows = fmu.named("output"), []
    with ecospy.EcosSimulationStructure() as structure:
        structure.add_model("gearbox", str(request.getfixturevalue(fixture)))
        with ecospy.EcosSimulation(structure=structure, step_size=1.0) as simulation:
            simulation.init()
            for row in inputs.iloc[:-1, 1:].to_dict("records"):
                for name, value in row.items():
                    simulation.set_real(f"gearbox::{name}", value)
                simulation.step()
                rows.append([simulation.get_real(f"gearbox::{name}") for name in names])
            simulation.terminate()
    assert_agree(np.array(rows), expected, names)


def ecos():
    """ecospy; skips where it or a library that it needs (Debian: libtbb12) is missing."""
    if find_spec("ecospy") is None:
        pytest.skip("ecospy is not installed")
    try:
        import ecospy
    except OSError as error:
        pytest.skip(f"ecospy cannot be loaded: {error}")
    return ecospy


# ---------------------------------------------------------------------- C


def played(
    host: list[str], fmu: Unpacked, library: Path, table: pd.DataFrame, folder: Path, **options: object
) -> np.ndarray:
    """What ``play.c`` prints."""
    file = folder / "in.csv"
    table.to_csv(file, index=False)
    real = "Real" if fmu.description.fmiVersion == "2.0" else "Float64"
    columns = [fmu.references(*table.columns[1:]), fmu.references(*fmu.named("output", real))]
    text = run([*host, library, *fmu.arguments[1:], *columns, file], **options)
    return np.array([[float(cell) for cell in line.split(",")] for line in text.splitlines()])


@needs_compiler
@pytest.mark.skipif(sys.platform == "win32", reason="written for dlopen")
def test_a_host_in_c_simulates(fmu: Unpacked, inputs: pd.DataFrame, expected: np.ndarray, tmp_path: Path) -> None:
    host = compiled("play", fmu, tmp_path / "play")
    assert_agree(played([str(host)], fmu, fmu.library, inputs, tmp_path), expected, fmu.named("output"))


@needs_compiler
@pytest.mark.skipif(shutil.which("nm") is None, reason="needs nm")
def test_two_fmus_are_linked_into_one_program(
    fmu: Unpacked, fzg_native3: Path, build_native: Callable[..., Path], fzg: Gearbox, inputs: pd.DataFrame,
    expected: np.ndarray, tmp_path: Path,
) -> None:  # fmt: skip
    network = fzg.network().with_source("oil", lambda s: 50.0, name="heater")
    other = unpacked(build_native(tmp_path / "heated.fmu", network), tmp_path / "heated")
    parts = {"fzg_": objects(fmu, tmp_path / "one", 2), "heated_": objects(other, tmp_path / "two", 2)}
    third = objects(unpacked(fzg_native3, tmp_path / "fmi3"), tmp_path / "three", 3)
    for prefix, files in (*parts.items(), ("fzg_", third)):
        lines = run(["nm", "-g", "--defined-only", *files]).splitlines()
        names = [line.split()[2] for line in lines if len(line.split()) == 3]
        assert len(names) > 50 and not [name for name in names if not name.startswith(prefix)]
    program = tmp_path / "linked"
    linked = [file for files in parts.values() for file in files]
    run([COMPILER, "-std=gnu99", "-O1", "-DONE=fzg_", "-DTWO=heated_", f"-I{fmu.folder / 'sources'}", "-w",
         "-o", program, SOURCES / "linked.c", *linked, "-ldl", "-lm"])  # fmt: skip
    file = tmp_path / "in.csv"
    inputs.to_csv(file, index=False)
    arguments: list[str] = []
    for subject in (fmu, other):
        columns = [subject.references(*inputs.columns[1:]), subject.references(*subject.named("output"))]
        arguments += [subject.description.guid, *columns]
    found = np.array([
        [float(cell) for cell in line.rstrip(",").split(",")] for line in run([program, *arguments, file]).splitlines()
    ])  # fmt: skip
    names = fmu.named("output")
    assert_agree(found[:, : len(names)], expected, names)
    host = compiled("play", other, tmp_path / "play")
    alone = played([str(host)], other, other.library, inputs, tmp_path)
    assert_agree(found[:, len(names) :], alone, other.named("output"))
    assert np.max(np.abs(found[-1, : len(names)] - alone[-1, : len(names)])) > 1.0  # they are different


# ---------------------------------------------------------------------- Windows, under wine


@pytest.mark.slow  # zig compiles its C library for the host first, which takes a minute and a half
@pytest.mark.skipif(WINE is None, reason="no wine (Debian: wine64)")
@pytest.mark.skipif(find_spec("ziglang") is None, reason="no ziglang, which cross-compiles")
@pytest.mark.parametrize("fmi", [2, 3])
def test_the_windows_library_gives_the_same_under_wine(
    fmu: Unpacked, fzg_native3: Path, inputs: pd.DataFrame, expected: np.ndarray, tmp_path: Path, fmi: int
) -> None:
    names = fmu.named("output")
    fmu = fmu if fmi == 2 else unpacked(fzg_native3, tmp_path / "fmi3")
    sources = {path.name: path.read_bytes() for path in (fmu.folder / "sources").iterdir()}
    library, host = tmp_path / "fzg.dll", tmp_path / "play.exe"
    library.write_bytes(compile_libraries(sources, "win64")["win64/library.dll"])
    zig = [sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu", "-O1", "-w"]
    run([*zig, f"-I{fmu.folder / 'sources'}", "-o", host, SOURCES / ("play.c" if fmi == 2 else "play3.c")])
    environment = os.environ | {"WINEPREFIX": str(tmp_path / "prefix"), "WINEDEBUG": "-all"}
    try:
        found = played([str(WINE), str(host)], fmu, library, inputs, tmp_path, env=environment)
    finally:  # wine leaves its server behind for a while
        server = shutil.which("wineserver", path=TOOLS)
        if server is not None:
            subprocess.run([server, "-k"], env=environment, check=False, capture_output=True)
    assert_agree(found, expected, names)
