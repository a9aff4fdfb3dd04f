"""What a native FMU survives: long runs, many instances and threads, calls in any order, damaged bytes, odd paths."""

from __future__ import annotations

import ctypes
import math
import random
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from builder.fmu_drive import loaded
from builder.train import TrainingResult
from models.errors import InputError
from models.gearbox import Gearbox
from models.simulation import network_system
from tests.contract.fmu_host import hosted
from tests.contract.native_hosts import Unpacked, compiled, needs_compiler, run, unpacked

ROOT = Path(__file__).parents[2]
on_linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="written for Linux")


@pytest.fixture(scope="module")
def fmu(fzg_native: Path, tmp_path_factory: pytest.TempPathFactory) -> Unpacked:
    return unpacked(fzg_native, tmp_path_factory.mktemp("robustness"))


@pytest.fixture(scope="module")
def endurance(fmu: Unpacked, tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """The command of ``endurance.c`` up to the name of the trial."""
    host = compiled("endurance", fmu, tmp_path_factory.mktemp("host") / "endurance")
    return [str(host), *fmu.arguments, fmu.references(*fmu.named("input")), fmu.references(*fmu.named("output"))]


# ---------------------------------------------------------------------- long runs


@needs_compiler
@on_linux
def test_ten_thousand_lives_leave_nothing_behind(endurance: list[str]) -> None:
    grown = int(run([*endurance, "cycles", "10000"]))
    assert grown < 100_000  # less than the smallest block of memory per life


@needs_compiler
@on_linux
def test_64_instances_in_8_threads_give_the_numbers_of_each_alone(endurance: list[str]) -> None:
    run([*endurance, "threads", "64", "8"])


@needs_compiler
@on_linux
def test_a_million_steps_stay_with_a_tight_reference(
    endurance: list[str], fmu: Unpacked, fzg: Gearbox, fzg_training: TrainingResult
) -> None:
    """Steps of 0.1 s through 28 h of changing load: errors do not add up.

    The reference is LSODA at 1e-9 on the same equations, written in Python.
    """
    speeds, torques, held, count = [1500.0, 3000.0, 800.0, 0.0], [100.0, 60.0, 250.0, 0.0], 2500, 1_000_000
    si = ",".join(repr(speed * math.pi / 30.0) for speed in speeds)
    text = run([*endurance, "steps", str(count), si, ",".join(map(repr, torques)), str(held)])
    rows = np.array([[float(cell) for cell in line.split(",")] for line in text.splitlines()])
    found = {name: rows[:, i] for i, name in enumerate(fmu.named("output"))}

    network = fzg.network()
    system = network_system(network, fzg_training.losses)
    T, expected = np.full(len(network.parts), 20.0), []
    for segment in range(count // (10 * held)):
        load = segment % len(speeds)
        inputs = np.array([speeds[load], torques[load], 20.0, 2.0])
        done = solve_ivp(
            lambda t, T, inputs=inputs: system.balance(t, inputs, T).derivative, (0.0, held), T, method="LSODA",
            rtol=1e-9, atol=1e-9,
        )  # fmt: skip
        T = done.y[:, -1]
        expected.append(T)
    for i, part in enumerate(network.parts):
        reference = np.array(expected[-len(speeds) :])[:, i] + 273.15
        assert found[f"{part.name}.T"] == pytest.approx(reference, abs=1e-5), part.name


# ---------------------------------------------------------------------- calls in any order


@on_linux
def test_random_calls_follow_the_state_machine_of_fmi(fmu: Unpacked) -> None:
    assert run([sys.executable, "-m", "tests.contract.native_state_machine", fmu.folder, "300"], cwd=ROOT) == ""


# ---------------------------------------------------------------------- steps of odd lengths


def test_ten_thousand_tiny_steps_are_one_of_a_millisecond(fzg_native: Path) -> None:
    with hosted(fzg_native) as tiny, hosted(fzg_native) as whole:
        tiny.step(1e-7, count=10_000)
        whole.step(1e-3)
        names = [name for name in tiny.fmu.variables if name.endswith(".T") and name != "initial.T"]
        assert tiny.get(*names) == pytest.approx(whole.get(*names), abs=2e-6)


def test_a_step_of_the_longest_length_ends_in_the_steady_state(fzg_native: Path) -> None:
    with hosted(fzg_native) as host:
        host.step(1e9)
        steady = host.outputs()
        host.step(1e6)
        assert host.outputs() == pytest.approx(steady, abs=1e-3)
        assert all(math.isfinite(value) for value in steady.values())


# ---------------------------------------------------------------------- saved states


def test_every_damaged_byte_of_a_saved_state_is_noticed(fzg_native: Path) -> None:
    with hosted(fzg_native) as host:
        host.step(12.3)
        state = host.slave.getFMUstate()
        content = host.slave.serializeFMUstate(state)
        host.slave.freeFMUstate(state)
        component, raw = ctypes.c_void_p(host.slave.component), host.slave.dll.fmi2DeSerializeFMUstate

        def read(changed: bytes) -> int:
            found = ctypes.c_void_p()
            buffer = ctypes.create_string_buffer(changed, len(changed))
            status: int = raw(component, buffer, ctypes.c_size_t(len(changed)), ctypes.byref(found))
            if found:
                host.slave.dll.fmi2FreeFMUstate(component, ctypes.byref(found))
            return status

        assert read(content) == 0
        dice = random.Random(0)
        for place in range(len(content)):
            damaged = bytearray(content)
            damaged[place] ^= dice.randrange(1, 256)
            assert read(bytes(damaged)) == 3, place
        assert {read(content[:length]) for length in range(0, len(content), 7)} == {3}
        assert read(bytes(len(content))) == 3


# ---------------------------------------------------------------------- where it lies


URIS = {
    "file:///": lambda folder: folder.as_uri(),
    "file:/": lambda folder: folder.as_uri().replace("file:///", "file:/"),
    "%XX of every character": lambda folder: "file:///" + "".join(f"%{byte:02X}" for byte in str(folder).encode()),
    "unencoded": lambda folder: f"file://{folder}",
    "path": str,
    "empty": lambda folder: "",
    "missing folder": lambda folder: (folder / "nowhere").as_uri(),
    "nonsense": lambda folder: "%ZZ%n%s://\x01",
    "NULL": lambda folder: None,
}


@pytest.mark.parametrize("name", ["plain", "with blanks in it", "Getriebe-Wärme_齒輪箱", "100 % & 'more' #1"])
def test_it_runs_from_any_folder_with_any_resource_uri(fmu: Unpacked, tmp_path: Path, name: str) -> None:
    folder = tmp_path / name
    folder.mkdir()
    library = ctypes.CDLL(shutil.copy(fmu.library, folder))
    library.fmi2Instantiate.restype = ctypes.c_void_p
    callbacks = (ctypes.c_void_p * 5)()
    for uri in URIS.values():
        text = uri(folder)
        c = library.fmi2Instantiate(
            b"host", 1, fmu.description.guid.encode(), None if text is None else text.encode(), callbacks, 0, 1
        )
        assert c
        instance = ctypes.c_void_p(c)
        zero = ctypes.c_double(0.0)
        assert library.fmi2SetupExperiment(instance, 0, zero, zero, 0, zero) == 0
        assert library.fmi2EnterInitializationMode(instance) == 0
        assert library.fmi2ExitInitializationMode(instance) == 0
        assert library.fmi2DoStep(instance, zero, ctypes.c_double(1.0), 1) == 0
        library.fmi2FreeInstance(instance)
    assert not library.fmi2Instantiate(b"host", 1, b"{another}", None, callbacks, 0, 1)


def test_a_truncated_archive_is_refused(fzg_native: Path, tmp_path: Path) -> None:
    content = fzg_native.read_bytes()
    for share in (0.0, 0.1, 0.5, 0.9, 0.999):
        damaged = tmp_path / "damaged.fmu"
        damaged.write_bytes(content[: int(share * len(content))])
        with pytest.raises(InputError, match="damaged"), loaded(damaged):
            pass
