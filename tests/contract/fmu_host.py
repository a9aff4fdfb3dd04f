"""A host for contract tests: variables by name, SI units, one FMI call per method, statuses as raised by FMPy."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from fmpy import simulate_fmu
from fmpy.fmi1 import FMICallException

from builder.drive.driver import LoadedFmu, loaded

DISCARD = 2
LOADED = {"speed": 300.0, "torque": 150.0, "T_ambient": 293.15, "air_speed": 2.0}


class Host:
    """One instance in a simulation."""

    def __init__(self, fmu: LoadedFmu) -> None:
        self.fmu, self.slave, self.time = fmu, fmu.slave, 0.0

    def _split(self, names: list[str]) -> tuple[list[str], list[str]]:
        booleans = [n for n in names if self.fmu.variables[n].type == "Boolean"]
        return [n for n in names if n not in booleans], booleans

    def _references(self, names: list[str]) -> list[int]:
        return [self.fmu.variables[n].valueReference for n in names]

    def set(self, **values: float) -> None:
        self.set_all(values)

    def set_all(self, values: dict[str, float]) -> None:
        reals, booleans = self._split(list(values))
        if reals:
            self.slave.setReal(self._references(reals), [values[n] for n in reals])
        if booleans:
            self.slave.setBoolean(self._references(booleans), [bool(values[n]) for n in booleans])

    def get(self, *names: str) -> list[float]:
        reals, booleans = self._split(list(names))
        found: dict[str, float] = dict(zip(reals, self.slave.getReal(self._references(reals)), strict=True))
        found |= dict(zip(booleans, self.slave.getBoolean(self._references(booleans)), strict=True))
        return [found[n] for n in names]

    def outputs(self) -> dict[str, float]:
        names = [v.name for v in self.fmu.variables.values() if v.causality == "output"]
        return dict(zip(names, self.get(*names), strict=True))

    def enter(self, values: dict[str, float] | None = None, *, time: float = 0.0) -> None:
        self.time = time
        self.slave.setupExperiment(startTime=time)
        self.slave.enterInitializationMode()
        self.set_all(LOADED | (values or {}))

    def start(self, values: dict[str, float] | None = None, *, time: float = 0.0) -> None:
        self.enter(values, time=time)
        self.slave.exitInitializationMode()

    def step(self, duration: float, *, count: int = 1) -> None:
        for _ in range(count):
            self.slave.doStep(self.time, duration)
            self.time += duration

    def refused(self, duration: float = 1.0, *, time: float | None = None, status: int = DISCARD) -> str:
        """The FMU's messages on a step that it must refuse."""
        self.fmu.messages.clear()
        with pytest.raises(FMICallException) as raised:
            self.slave.doStep(self.time if time is None else time, duration)
        assert raised.value.status == status
        texts = [text for _, text in self.fmu.messages]
        self.fmu.messages.clear()
        assert texts
        return "\n".join(texts)

    @property
    def said(self) -> list[tuple[int, str]]:
        messages, self.fmu.messages[:] = list(self.fmu.messages), []
        return messages


@contextmanager
def hosted(path: Path, values: dict[str, float] | None = None, *, start: bool = True, **options: Any) -> Iterator[Host]:
    with loaded(path) as fmu:
        host = Host(fmu)
        if start:
            host.start(values, **options)
        yield host


def check_reference_run(path: Path, folder: Path) -> None:
    """Drive the inputs that the FMU carries with FMPy; its outputs must be those that it carries."""
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder, [name for name in archive.namelist() if name.startswith("documentation/")])
    given = np.genfromtxt(folder / "documentation/reference_in.csv", delimiter=",", names=True, deletechars="")
    expected = pd.read_csv(folder / "documentation/reference_out.csv")
    names = [name for name in expected.columns if name != "time"]
    result = simulate_fmu(str(path), stop_time=600.0, output_interval=10.0, input=given, output=names)
    assert result["time"].tolist() == expected["time"].tolist()
    for name in names:
        np.testing.assert_allclose(result[name], expected[name], rtol=1e-7, atol=1e-7, err_msg=name)
