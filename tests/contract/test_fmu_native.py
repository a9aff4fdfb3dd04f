"""What is special to the native FMU: agreement with Python, what it adds to FMI, packaging, compilers, their cache."""

from __future__ import annotations

import random
import re
import shutil
import struct
import subprocess
import sys
import threading
import zipfile
from collections.abc import Callable
from contextlib import ExitStack
from ctypes import byref, c_char_p, c_double, c_int, c_uint
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy import read_model_description
from fmpy.fmi1 import FMICallException

from builder.base.cache import CACHE_VARIABLE
from builder.drive.driver import drive_fmu, loaded
from builder.fmi.reference_cycle import reference_cycle
from builder.native import compile as native_compile
from builder.native.compile import PLATFORMS, compile_libraries, plan_for
from builder.native.native_fmu import build_native_fmu
from builder.surrogate.train import TrainingResult
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from tests.contract.fmu_host import DISCARD, LOADED, Host, hosted
from tests.contract.native_hosts import run, unpacked

Build = Callable[..., Path]
ROOT = Path(__file__).parents[2]
ERROR = 3
SOURCE = {"one.c": b"int one(void);\nint one(void) { return 1; }\n"}
HAS_ZIG = native_compile._zig() is not None


@pytest.fixture
def host(fzg_native: Path):
    with hosted(fzg_native) as running:
        yield running


def reference(host: Host, name: str) -> int:
    return int(host.fmu.variables[name].valueReference)


# ---------------------------------------------------------------------- agreement


def columns_agree(found: dict[str, Any], expected: dict[str, Any], *, relative: float) -> None:
    assert list(found) == list(expected)
    for name in found:
        kelvin = 273.15 if name.endswith("_degC") else 0.0
        scale = np.max(np.abs(expected[name] + kelvin))
        np.testing.assert_allclose(found[name], expected[name], rtol=0.0, atol=relative * scale, err_msg=name)


def test_cycle_is_that_of_the_network_in_python(fzg_native: Path, fzg: Gearbox, fzg_training: TrainingResult) -> None:
    cycle = reference_cycle(fzg)
    expected = fzg.network().simulate(cycle, losses=fzg_training.losses, initial=20.0)
    columns_agree(drive_fmu(fzg_native, cycle, initial=20.0), expected.columns(), relative=1e-9)


# ---------------------------------------------------------------------- what it adds: input rates, derivatives


def set_rates(host: Host, **rates: float) -> None:
    count = len(rates)
    references = (c_uint * count)(*(reference(host, name) for name in rates))
    orders, values = (c_int * count)(*(1 for _ in rates)), (c_double * count)(*rates.values())
    host.slave.fmi2SetRealInputDerivatives(host.slave.component, references, count, orders, values)


def test_inputs_go_along_their_rates_for_one_step(fzg_native: Path) -> None:
    with hosted(fzg_native) as ramped, hosted(fzg_native) as held:
        set_rates(ramped, speed=20.0, T_ambient=0.5)
        ramped.step(20.0)
        assert ramped.get("speed", "T_ambient", "torque") == [
            LOADED["speed"] + 400.0,
            LOADED["T_ambient"] + 10.0,
            150.0,
        ]
        for piece in range(4000):  # of 5 ms, each held at its middle
            held.set(
                speed=LOADED["speed"] + 20.0 * 0.005 * (piece + 0.5),
                T_ambient=LOADED["T_ambient"] + 0.0025 * (piece + 0.5),
            )
            held.step(0.005)
        held.time = 20.0
        # half of what the solver tolerates in one of its steps
        assert ramped.get("oil.T", "pinion.T") == pytest.approx(held.get("oil.T", "pinion.T"), abs=0.015)
        ramped.step(1.0)
        assert ramped.get("speed")[0] == LOADED["speed"] + 400.0  # held again


def test_value_and_rate_may_be_set_in_any_order_and_a_refused_step_keeps_the_rates(host: Host) -> None:
    set_rates(host, speed=20.0)
    host.set(speed=290.0)
    host.step(1.0)
    assert host.get("speed")[0] == 310.0
    host.step(1.0)
    assert host.get("speed")[0] == 310.0  # a rate is good for one step
    set_rates(host, T_ambient=-10.0)
    text = host.refused(60.0)  # it would end far below what is possible
    assert "T_ambient is -306.85 K" in text
    host.step(1.0)
    assert host.get("T_ambient")[0] == LOADED["T_ambient"] - 10.0


def test_an_input_may_ramp_to_its_bound(host: Host) -> None:
    """Sums of rounded numbers end a little beyond it; a law that takes a root of the air's speed must not see that."""
    rng = np.random.default_rng(0)
    below = 0
    for value, duration in rng.uniform((0.5, 1.0), (10.0, 9.0), (40, 2)):
        host.set(air_speed=value)
        below += value + (-value / duration) * duration < 0.0
        set_rates(host, air_speed=-value / duration)
        host.step(duration)
        assert 0.0 <= host.get("air_speed")[0] < 1e-14
        assert np.isfinite(list(host.outputs().values())).all()
    assert below > 0
    host.set(air_speed=-1e-6)
    assert "air_speed is -1e-06 m/s; 0 to 200 m/s is possible" in host.refused()


@pytest.mark.parametrize(("name", "order", "value"), [("oil.T", 1, 1.0), ("speed", 2, 1.0), ("speed", 1, np.nan)])
def test_impossible_rates_are_refused(host: Host, name: str, order: int, value: float) -> None:
    arrays = (c_uint * 1)(reference(host, name)), (c_int * 1)(order), (c_double * 1)(value)
    with pytest.raises(FMICallException, match="error"):
        host.slave.fmi2SetRealInputDerivatives(host.slave.component, arrays[0], 1, arrays[1], arrays[2])
    host.step(1.0)


def derivative(host: Host, unknowns: list[str], known: str, *, seed: float = 1.0) -> list[float]:
    found: list[float] = host.slave.getDirectionalDerivative(
        [reference(host, n) for n in unknowns], [reference(host, known)], [seed]
    )
    return found


@pytest.mark.parametrize("known", ["speed", "torque", "T_ambient", "air_speed", "factor.bearing"])
def test_directional_derivatives_are_those_of_the_outputs(host: Host, known: str) -> None:
    host.step(100.0)
    names = [n for n, v in host.fmu.variables.items() if v.causality == "output" and v.type == "Real"]
    found = derivative(host, names, known, seed=2.0)
    before, value = host.outputs(), host.get(known)[0]
    sides = []
    for step in (-1e-5, 1e-5):
        host.set_all({known: value * (1.0 + step)})
        sides.append(np.array(host.get(*names)))
    expected = 2.0 * (sides[1] - sides[0]) / (2e-5 * value)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())
    host.set_all({known: value})
    assert host.outputs() == before
    assert any(found) == (known != "air_speed")  # which acts on the temperatures of later moments only


@pytest.mark.parametrize(("known", "value"), [("speed", 0.03), ("speed", 0.2), ("torque", 0.2)])
def test_derivatives_near_a_knee_are_those_of_its_side(host: Host, known: str, value: float) -> None:
    """Losses go linearly through zero below 1 1/min (0.105 rad/s), and turn with the sign of the torque."""
    host.step(100.0)
    host.set_all({known: value})
    names = ["loss.total", "torque_loss"]
    found, sides = derivative(host, names, known), []
    for step in (-1e-4, 1e-4):
        host.set_all({known: value * (1.0 + step)})
        sides.append(np.array(host.get(*names)))
    np.testing.assert_allclose(found, (sides[1] - sides[0]) / (2e-4 * value), rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("bound", ["min", "max"])
def test_derivatives_at_a_bound_are_those_inside(host: Host, bound: str) -> None:
    host.step(10.0)
    at = float(getattr(host.fmu.variables["factor.mesh"], bound))
    host.set_all({"factor.mesh": at})
    loss = host.get("loss.mesh_sliding")[0]
    assert derivative(host, ["loss.mesh_sliding"], "factor.mesh")[0] == pytest.approx(loss / at, rel=1e-9)
    assert host.get("factor.mesh")[0] == at and host.get("loss.mesh_sliding")[0] == loss


def test_derivatives_are_exact_to_ten_digits_where_they_are_known(host: Host) -> None:
    host.step(10.0)
    loss, power = host.get("loss.mesh_sliding")[0], 300.0 * 150.0
    assert derivative(host, ["loss.mesh_sliding"], "factor.mesh")[0] == pytest.approx(loss, rel=1e-10)
    total = host.get("loss.total")[0]
    assert derivative(host, ["efficiency"], "factor.mesh")[0] == pytest.approx(-loss / power, rel=1e-10)
    assert derivative(host, ["air.T", "oil.T"], "T_ambient") == pytest.approx([1.0, 0.0], abs=1e-10)
    assert host.get("loss.total")[0] == total


def test_derivatives_at_initialization(fzg_native: Path) -> None:
    with hosted(fzg_native, start=False) as host:
        host.enter()
        assert derivative(host, ["oil.T"], "initial.T")[0] == pytest.approx(1.0, rel=1e-10)
        host.slave.exitInitializationMode()
        with pytest.raises(FMICallException, match="error"):
            derivative(host, ["oil.T"], "initial.T")


# ---------------------------------------------------------------------- calls of a host


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="written for Linux")
@pytest.mark.parametrize("seed", range(5))
def test_random_calls_follow_the_state_machine_of_fmi(fzg_native: Path, tmp_path: Path, seed: int) -> None:
    fmu = unpacked(fzg_native, tmp_path)
    assert run([sys.executable, "-m", "tests.contract.native_state_machine", fmu.folder, "60", seed], cwd=ROOT) == ""


def test_damaged_states_and_those_of_another_fmu_are_refused(
    fzg_native: Path, build_native: Build, fzg: Gearbox, tmp_path: Path
) -> None:
    other_fmu = build_native(tmp_path / "fzg.fmu", fzg.network().with_source("oil", lambda s: 5.0, name="heater"))
    with hosted(fzg_native) as host, hosted(other_fmu) as other:
        host.step(12.3)
        state = host.slave.getFMUstate()
        content = host.slave.serializeFMUstate(state)
        damaged = []
        dice = random.Random(0)
        for place in range(len(content)):
            changed = bytearray(content)
            changed[place] ^= dice.randrange(1, 256)
            damaged.append(bytes(changed))
        damaged += [content[:length] for length in range(0, len(content), 7)]
        for one, wrong in ((other, [content]), (host, damaged)):
            for serialized in wrong:
                with pytest.raises(FMICallException, match="error"):
                    one.slave.deSerializeFMUstate(serialized)
        with pytest.raises(FMICallException, match="error"):
            other.slave.setFMUstate(state)
        assert host.slave.serializeFMUstate(state) == content
        host.slave.freeFMUstate(state)


def test_threads_do_not_touch_each_other(fzg_native: Path) -> None:
    with ExitStack() as stack:  # loaded one after another: FMPy changes the working directory of the process meanwhile
        first, *others = [stack.enter_context(hosted(fzg_native)) for _ in range(5)]
        first.step(0.1, count=2000)
        threads = [threading.Thread(target=host.step, args=(0.1,), kwargs={"count": 2000}) for host in others]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert all(host.outputs() == first.outputs() for host in others)


@pytest.mark.parametrize("start", [0.0, 1e6, 1e8])
@pytest.mark.parametrize("duration", [1e-3, 0.1, 60.0])
def test_the_clock_is_checked_to_its_rounding(fzg_native: Path, start: float, duration: float) -> None:
    """However late: a repeated or omitted step is refused, and a host may count steps or add them up."""
    with hosted(fzg_native, time=start) as host:
        for step in range(1, 1000):
            host.step(duration)
            host.time = start + step * duration
        assert "the last one ended" in host.refused(duration, time=host.time - duration)
        assert "the last one ended" in host.refused(duration, time=host.time + duration)
        host.step(duration, count=1000)


def test_status_can_be_asked(host: Host) -> None:
    slave, component = host.slave, host.slave.component
    host.step(2.5)
    host.refused(-1.0)
    time, status, ended = c_double(), c_int(), c_int()
    slave.fmi2GetRealStatus(component, 2, byref(time))
    slave.fmi2GetStatus(component, 0, byref(status))
    slave.fmi2GetBooleanStatus(component, 3, byref(ended))
    assert (time.value, status.value, ended.value) == (2.5, DISCARD, 1)  # else FMPy tries it for ever
    with pytest.raises(FMICallException, match="discard"):
        slave.fmi2GetStringStatus(component, 1, byref(c_char_p()))


def test_log_categories_can_be_chosen(host: Host) -> None:
    slave, component = host.slave, host.slave.component

    def excursions() -> int:
        host.set(speed=1000.0)
        host.step(1.0)
        host.set(speed=300.0)
        host.step(1.0)
        return len(host.said)

    assert excursions() == 1
    slave.fmi2SetDebugLogging(component, 0, 1, (c_char_p * 1)(b"logStatusWarning"))
    assert excursions() == 0
    assert host.refused(-1.0)
    slave.fmi2SetDebugLogging(component, 1, 1, (c_char_p * 1)(b"logAll"))
    assert excursions() == 1
    slave.fmi2SetDebugLogging(component, 1, 1, (c_char_p * 1)(b"logStatusError"))  # this category and no other
    assert excursions() == 0
    slave.fmi2SetDebugLogging(component, 1, 0, None)
    assert excursions() == 1
    slave.fmi2SetDebugLogging(component, 0, 0, None)
    assert excursions() == 0


def test_no_step_goes_past_the_stop_time(fzg_native: Path) -> None:
    with loaded(fzg_native) as fmu:
        host = Host(fmu)
        fmu.slave.setupExperiment(startTime=0.0, stopTime=2.0)
        fmu.slave.enterInitializationMode()
        host.set_all(LOADED)
        fmu.slave.exitInitializationMode()
        host.step(1.0)
        assert "the step would end at 2.5 s, past the stop time of 2 s" in host.refused(1.5, status=ERROR)
        host.step(1.0)  # an error changed nothing
        assert host.time == 2.0


# ---------------------------------------------------------------------- packaging


def test_archive_is_complete(fzg_native: Path) -> None:
    with zipfile.ZipFile(fzg_native) as archive:
        names = archive.namelist()
        page = archive.read("documentation/index.html").decode()
        licence = archive.read("documentation/licenses/fmi2_headers.txt").decode()
    description = read_model_description(str(fzg_native))
    files = {f for c in description.buildConfigurations for group in c.sourceFileSets for f in group.sourceFiles}
    assert {f"sources/{name}" for name in files} == {n for n in names if n.endswith(".c")}
    assert names == sorted(names)
    assert {
        "model.png", "documentation/index.html", "documentation/licenses/license.txt", "sources/fmi2Functions.h",
        "documentation/reference_in.csv", "documentation/reference_out.csv",
    } <= set(names)  # fmt: skip
    assert [name for name in names if name.startswith("resources/")] == ["resources/recording.json"]
    assert not [name for name in names if "pythonfmu" in name]
    assert "documentation/licenses/elementary.txt" in names
    assert "Modelica Association" in licence
    for text in ("loss.mesh_sliding", "fmi2SetRealInputDerivatives", "fmpy compile FILE.fmu", "in_domain"):
        assert text in page
    assert "onnx" not in page.lower()


def test_only_fmi_functions_are_exported_and_only_libc_is_needed(fzg_native: Path, tmp_path: Path) -> None:
    if not sys.platform.startswith("linux") or shutil.which("nm") is None:
        pytest.skip("needs nm on Linux")
    with zipfile.ZipFile(fzg_native) as archive:
        (library,) = (n for n in archive.namelist() if n.startswith("binaries/"))
        archive.extract(library, tmp_path)
    listed = subprocess.run(["nm", "-D", tmp_path / library], capture_output=True, text=True, check=True).stdout
    lines = [line.split() for line in listed.splitlines()]
    exported = {line[-1] for line in lines if line[-2] == "T"}
    assert {name for name in exported if not name.startswith(("fmi2", "_init", "_fini"))} == set()
    assert len([name for name in exported if name.startswith("fmi2")]) == 34
    needed = {line[-1].partition("@")[0] for line in lines if line[-2] == "U"}
    known = {
        "bcmp", "calloc", "free", "malloc", "memcmp", "memcpy", "memset", "pow", "exp", "fmax", "snprintf", "vsnprintf",
        "strcmp", "strcpy", "strlen", "strncmp", "strncpy", "__stack_chk_fail", "__snprintf_chk", "__vsnprintf_chk",
    }  # fmt: skip
    assert needed <= known
    if HAS_ZIG:
        assert max(tuple(map(int, v.split("."))) for v in re.findall(r"@GLIBC_([\d.]+)", listed)) <= (2, 17)


def test_same_content_gives_the_same_bytes_with_and_without_cache(
    build_native: Build, fzg_native: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, "off")
    again = build_native(tmp_path / "fzg.fmu")
    with zipfile.ZipFile(again) as one, zipfile.ZipFile(fzg_native) as other:
        assert one.namelist() == other.namelist()
        assert [name for name in one.namelist() if one.read(name) != other.read(name)] == []
    assert again.read_bytes() == fzg_native.read_bytes()


# ---------------------------------------------------------------------- compilers and cache


def test_the_cache_follows_the_sources_and_can_be_done_without(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))
    first = compile_libraries(SOURCE, "host")
    (kept,) = (tmp_path / "cache").iterdir()
    kept.write_bytes(b"from the cache")
    assert list(compile_libraries(SOURCE, "host").values()) == [b"from the cache"]
    compile_libraries({"one.c": SOURCE["one.c"].replace(b"return 1", b"return 2")}, "host")
    assert len(list((tmp_path / "cache").iterdir())) == 2
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "file" / "cache"))
    assert compile_libraries(SOURCE, "host") == first


def test_a_faulty_source_is_refused_with_the_compilers_words() -> None:
    with pytest.raises(InputError, match=r"(?s)cannot compile the FMU for .*one\.c"):
        compile_libraries({"one.c": b"int one(void) { return missing; }\n"}, "host")


def test_compiler_of_the_environment_is_taken_or_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(native_compile, "_zig", lambda: None)
    monkeypatch.setenv("CC", "no-such-compiler -m64")
    with pytest.raises(InputError, match="no-such-compiler"):
        plan_for("host")
    monkeypatch.setenv("CC", "gcc 'x")
    with pytest.raises(InputError, match="cannot be read .*correct it or unset it"):
        plan_for("host")


@pytest.mark.skipif(native_compile._own_compiler() is None, reason="no C compiler")
def test_without_ziglang_the_machines_own_compiler_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(native_compile, "_zig", lambda: None)
    assert not plan_for("host").compiler.is_zig
    assert compile_libraries(SOURCE, "host")
    with pytest.raises(InputError, match="own compiler cannot build for win32"):
        plan_for("win32")


def test_restrict_is_written_as_microsofts_compiler_knows_it(fzg_native: Path) -> None:
    with zipfile.ZipFile(fzg_native) as archive:
        names = [name for name in archive.namelist() if re.match(r"sources/.*\.[ch]$", name)]
        users = {name for name in names if re.search(rb"\brestrict\b", archive.read(name))}
    assert users == {"sources/linker_names.h"}  # which defines RESTRICT


def binaries_in(fmu: Path) -> set[str]:
    with zipfile.ZipFile(fmu) as archive:
        return {name.removeprefix("binaries/") for name in archive.namelist() if name.startswith("binaries/")}


@pytest.mark.slow
@pytest.mark.skipif(not HAS_ZIG, reason="no ziglang")
def test_all_platforms_are_built_and_the_bytes_are_reproducible(
    fzg: Gearbox, fzg_training: TrainingResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(CACHE_VARIABLE, "off")
    builds = [
        build_native_fmu(fzg, fzg_training, tmp_path / folder / "fzg.fmu", platforms="all") for folder in ("a", "b")
    ]
    assert binaries_in(builds[0]) == {f"{name}/fzg{platform.suffix}" for name, platform in PLATFORMS.items()}
    assert builds[0].read_bytes() == builds[1].read_bytes()
    starts = {".so": b"\x7fELF", ".dll": b"MZ", ".dylib": b"\xca\xfe\xba\xbe"}  # the last is a universal binary
    with zipfile.ZipFile(builds[0]) as archive:
        for name, platform in PLATFORMS.items():
            assert archive.read(f"binaries/{name}/fzg{platform.suffix}").startswith(starts[platform.suffix])
        universal = archive.read("binaries/darwin64/fzg.dylib")
    with hosted(builds[0]) as host:
        host.step(1.0)
    third = build_native_fmu(fzg, fzg_training, tmp_path / "fzg.fmu", platforms="darwin64", fmi=3)
    assert binaries_in(third) == {"x86_64-darwin/fzg.dylib", "aarch64-darwin/fzg.dylib"}
    processors, names, oldest = zip(*map(mac_library, slices(universal)), strict=True)
    assert processors == (0x01000007, 0x0100000C)  # x86_64 and arm64
    assert names == ("@rpath/fzg.dylib",) * 2 and oldest == (11 << 16,) * 2


def slices(universal: bytes) -> list[bytes]:
    """Libraries in a universal binary (mach-o/fat.h)."""
    magic, count = struct.unpack_from(">II", universal)
    assert magic == 0xCAFEBABE
    entries = [struct.unpack_from(">IIIII", universal, 8 + 20 * i) for i in range(count)]
    assert all(offset % (1 << alignment) == 0 for _, _, offset, _, alignment in entries)
    return [universal[offset : offset + size] for _, _, offset, size, _ in entries]


def mac_library(content: bytes) -> tuple[int, str, int]:
    """Processor, install name and oldest macOS of a Mach-O library (mach-o/loader.h)."""
    place, name, oldest = 32, "", 0
    for _ in range(struct.unpack_from("<I", content, 16)[0]):
        command, size = struct.unpack_from("<II", content, place)
        if command == 0x0D:
            (start,) = struct.unpack_from("<I", content, place + 8)
            name = content[place + start : place + size].rstrip(b"\0").decode()
        elif command == 0x32:
            oldest = struct.unpack_from("<I", content, place + 12)[0]
        place += size
    return struct.unpack_from("<I", content, 4)[0], name, oldest
