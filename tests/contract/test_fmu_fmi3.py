"""The native FMU of FMI 3.0: the same variables, numbers and behaviour as that of FMI 2.0, in FMPy and in a C host."""

from __future__ import annotations

import re
import sys
import zipfile
from collections.abc import Iterator
from ctypes import byref, c_double, c_void_p
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pandas as pd
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave

from builder.native.compile import PLATFORMS, host_platform
from tests.contract.fmu_host import DISCARD, LOADED, hosted
from tests.contract.native_hosts import Unpacked, compiled, needs_compiler, run, sanitized, unpacked

ERROR = 3
DONE = (
    "GetVersion", "SetDebugLogging", "InstantiateCoSimulation", "FreeInstance", "EnterInitializationMode",
    "ExitInitializationMode", "Terminate", "Reset", "GetFloat64", "SetFloat64", "GetBoolean", "SetBoolean",
    "GetFMUState", "SetFMUState", "FreeFMUState", "SerializedFMUStateSize", "SerializeFMUState",
    "DeserializeFMUState", "GetDirectionalDerivative", "DoStep",
    "InstantiateModelExchange", "InstantiateScheduledExecution",
)  # fmt: skip


@pytest.fixture(scope="module")
def fmu(fzg_native3: Path, tmp_path_factory: pytest.TempPathFactory) -> Unpacked:
    return unpacked(fzg_native3, tmp_path_factory.mktemp("fmi3"))


@pytest.fixture(scope="module")
def fmu2(fzg_native: Path, tmp_path_factory: pytest.TempPathFactory) -> Unpacked:
    return unpacked(fzg_native, tmp_path_factory.mktemp("fmi2"))


class Host3:
    """An instance in FMPy, variables by name."""

    def __init__(self, fmu: Unpacked) -> None:
        self.references = {name: variable.valueReference for name, variable in fmu.variables.items()}
        self.messages: list[tuple[int, str]] = []
        self.slave = FMU3Slave(
            guid=fmu.description.instantiationToken, unzipDirectory=str(fmu.folder), instanceName="test",
            modelIdentifier=fmu.description.coSimulation.modelIdentifier,
        )  # fmt: skip
        self.slave.instantiate(logMessage=lambda _, status, __, text: self.messages.append((status, text.decode())))

    def start(self, time: float = 0.0) -> None:
        self.slave.enterInitializationMode(startTime=time)
        self.set(**LOADED)
        self.slave.exitInitializationMode()

    def set(self, **values: float) -> None:
        self.slave.setFloat64([self.references[name] for name in values], list(values.values()))

    def get(self, *names: str) -> list[float]:
        found: list[float] = self.slave.getFloat64([self.references[name] for name in names])
        return found

    def step(self, time: float, duration: float) -> tuple[bool, bool, bool, float]:
        done: tuple[bool, bool, bool, float] = self.slave.doStep(time, duration)
        return done


@pytest.fixture
def host(fmu: Unpacked) -> Iterator[Host3]:
    running = Host3(fmu)
    running.start()
    yield running
    running.slave.freeInstance()


# ---------------------------------------------------------------------- description


def test_fmpy_finds_no_problem_and_the_archive_is_complete(fzg_native3: Path) -> None:
    assert "No problems found" in run([sys.executable, "-m", "fmpy", "validate", fzg_native3])
    with zipfile.ZipFile(fzg_native3) as archive:
        names = set(archive.namelist())
        build = archive.read("sources/buildDescription.xml").decode()
        licence = archive.read("documentation/licenses/fmi3_headers.txt").decode()
    assert {f"sources/{file}" for file in re.findall(r'SourceFile name="(.*?)"', build)} == {
        name for name in names if name.endswith(".c")
    }
    assert "terminalsAndIcons/icon.png" in names and "model.png" not in names
    assert "Modelica Association" in licence and not [name for name in names if "fmi2" in name]
    (processor,) = {name.split("/")[1] for name in names if name.startswith("binaries/")}
    assert processor in PLATFORMS[str(host_platform())].targets


def test_variables_are_those_of_fmi_2(fmu: Unpacked, fmu2: Unpacked) -> None:
    def shown(variable: Any) -> dict[str, Any]:
        names = ("valueReference", "description", "causality", "variability", "initial", "start", "unit", "displayUnit",
                 "min", "max", "nominal", "quantity")  # fmt: skip
        kind = {"Real": "Float64"}.get(variable.type, variable.type)
        return {name: getattr(variable, name) for name in names} | {"type": kind}

    *same, time = fmu.variables.values()
    assert [shown(v) for v in same] == [shown(v) for v in fmu2.variables.values()]
    assert (time.name, time.causality, time.valueReference) == ("time", "independent", len(same))
    for structure in ("outputs", "initialUnknowns"):
        found, expected = (
            [(u.variable.name, [d.name for d in u.dependencies], u.dependenciesKind)
             for u in getattr(description, structure)]
            for description in (fmu.description, fmu2.description)
        )  # fmt: skip
        assert found == expected
    experiments = [(e.startTime, e.stopTime, e.stepSize, e.tolerance)
                   for e in (fmu.description.defaultExperiment, fmu2.description.defaultExperiment)]  # fmt: skip
    assert experiments[0] == experiments[1] and None not in experiments[0]


# ---------------------------------------------------------------------- numbers


def simulated(path: Path, folder: Path, names: list[str]) -> np.ndarray:
    """The reference inputs that an FMU carries, by FMPy's ``simulate_fmu``."""
    table = pd.read_csv(folder / "documentation/reference_in.csv")
    result = fmpy.simulate_fmu(
        str(path), stop_time=float(table["time"].iloc[-1]), output_interval=10.0, output=names,
        input=table.to_records(index=False), start_values=table.iloc[0, 1:].to_dict(),
    )  # fmt: skip
    return np.array([list(row) for row in result])


def test_fmpy_gives_the_numbers_of_fmi_2_bit_for_bit(
    fzg_native: Path, fzg_native3: Path, fmu: Unpacked, fmu2: Unpacked
) -> None:
    names = [v.name for v in fmu.variables.values() if v.causality == "output"]
    found, expected = simulated(fzg_native3, fmu.folder, names), simulated(fzg_native, fmu2.folder, names)
    assert found[-1, 0] == 600.0
    np.testing.assert_array_equal(found, expected)


@needs_compiler
@pytest.mark.parametrize("kind", ["as delivered", pytest.param("sanitized", marks=pytest.mark.slow)])
def test_a_host_in_c_gives_the_numbers_of_fmi_2(fmu: Unpacked, fmu2: Unpacked, tmp_path: Path, kind: str) -> None:
    table = pd.read_csv(fmu.folder / "documentation/reference_in.csv")
    file = tmp_path / "in.csv"
    table.to_csv(file, index=False)
    printed = []
    for host_name, subject in (("play3", fmu), ("play", fmu2)):
        library = subject.library if kind == "as delivered" else sanitized(subject, tmp_path / f"{host_name}.so")
        options = () if kind == "as delivered" else ("-fsanitize=address,undefined", "-fno-sanitize-recover=all")
        program = compiled(host_name, subject, tmp_path / host_name, *options)
        columns = [subject.references(*table.columns[1:]), fmu2.references(*fmu2.named("output"))]
        printed.append(run([program, library, *subject.arguments[1:], *columns, file]))
    assert printed[0] == printed[1] and len(printed[0].splitlines()) == len(table) - 1


def test_derivatives_and_outputs_at_initialization_are_those_of_fmi_2(fmu: Unpacked, fzg_native: Path) -> None:
    names = ["loss.total", "efficiency", "air.T"]
    running = Host3(fmu)
    running.slave.enterInitializationMode()
    running.set(**LOADED)
    with hosted(fzg_native, start=False) as other:
        other.enter()
        assert running.get(*names) == other.get(*names)
        running.slave.exitInitializationMode()
        other.slave.exitInitializationMode()
        running.step(0.0, 50.0)
        other.step(50.0)
        unknowns, knowns = (
            [running.references[n] for n in names],
            [running.references[n] for n in ("speed", "T_ambient")],
        )
        expected = other.slave.getDirectionalDerivative(unknowns, knowns, [2.0, 1.0])
        assert running.slave.getDirectionalDerivative(unknowns, knowns, [2.0, 1.0]) == expected
    running.slave.freeInstance()


# ---------------------------------------------------------------------- behaviour


def test_states_are_restored_and_serialized(host: Host3, fmu: Unpacked, fzg_native: Path) -> None:
    slave, names = host.slave, [n for n, v in fmu.variables.items() if v.causality == "output" and v.type == "Float64"]
    host.step(0.0, 12.5)
    state = slave.getFMUState()
    content = slave.serializeFMUState(state)
    host.set(speed=500.0)
    host.step(12.5, 40.0)
    later = host.get(*names, "time")
    assert later[-1] == 52.5
    slave.setFMUState(state)
    slave.freeFMUState(state)
    assert host.get("time", "speed") == [12.5, LOADED["speed"]]
    host.set(speed=500.0)
    host.step(12.5, 40.0)
    assert host.get(*names, "time") == later
    slave.reset()
    copied = slave.deserializeFMUState(content)
    slave.setFMUState(copied)
    slave.freeFMUState(copied)
    host.set(speed=500.0)
    host.step(12.5, 40.0)
    assert host.get(*names, "time") == later
    with hosted(fzg_native) as other:  # a state of another FMU
        foreign = other.slave.serializeFMUstate(other.slave.getFMUstate())
    with pytest.raises(FMICallException, match="error"):
        slave.deserializeFMUState(foreign)
    assert "cannot be read" in host.messages[-1][1]


def test_no_step_goes_past_the_stop_time(host: Host3) -> None:
    host.slave.reset()
    host.slave.enterInitializationMode(startTime=0.0, stopTime=1.0)
    host.set(**LOADED)
    host.slave.exitInitializationMode()
    with pytest.raises(FMICallException, match="error"):
        host.step(0.0, 1.5)
    assert "past the stop time of 1 s" in host.messages[-1][1]
    assert host.step(0.0, 1.0)[-1] == 1.0


def test_values_that_cannot_be_used_are_refused_until_they_are_corrected(host: Host3) -> None:
    host.step(0.0, 10.0)
    before = host.get("oil.T", "loss.total")
    host.set(T_ambient=20.0)
    with pytest.raises(FMICallException) as raised:
        host.step(10.0, 1.0)
    assert raised.value.status == DISCARD
    assert "if 20 degC is meant, set 293.15" in host.messages[-1][1]
    assert np.isnan(host.get("oil.T")[0])
    host.set(T_ambient=LOADED["T_ambient"])
    assert host.get("oil.T", "loss.total") == before
    with pytest.raises(FMICallException, match="discard"):
        host.step(9.0, 1.0)
    assert host.step(10.0, 1.0) == (False, False, False, 11.0)


def test_fixed_parameters_and_booleans(host: Host3) -> None:
    slave, uniform, inside = host.slave, host.references["initial.uniform"], host.references["in_domain"]
    with pytest.raises(FMICallException, match="error"):
        host.set(**{"initial.T": 300.0})
    with pytest.raises(FMICallException, match="error"):
        slave.setBoolean([uniform], [False])
    assert slave.getBoolean([uniform, inside]) == [True, True]
    host.set(speed=1000.0)
    host.step(0.0, 1.0)
    assert slave.getBoolean([inside]) == [False]
    slave.reset()
    slave.setBoolean([uniform], [False])
    host.set(**{"oil.T_start": 350.0})
    host.start()
    assert host.get("oil.T", "pinion.T") == [350.0, 300.15]


def test_functions_without_use_return_an_error_and_one_message(host: Host3, fmu: Unpacked) -> None:
    header = (fmu.folder / "sources/fmi3Functions.h").read_text()
    names = re.findall(r"^FMI3_Export \w+ +fmi3(\w+);", header, flags=re.MULTILINE)
    assert len(names) == 75
    references = (c_double * 8)()  # zeros: value reference 0
    for name in sorted(set(names) - set(DONE)):
        said = len(host.messages)
        arguments = [byref(references), 1, *[byref(references)] * 6]
        function = getattr(host.slave.dll, f"fmi3{name}")
        function.argtypes = None
        found = function(c_void_p(host.slave.component), *arguments)
        assert (found, len(host.messages)) == (ERROR, said + 1), name
    host.step(0.0, 1.0)
