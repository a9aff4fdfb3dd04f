"""Answers of the native FMU to calls and values that are at fault: a status, one message, and nothing changes."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from fmpy.fmi1 import FMICallException

from tests.contract.conftest import Illegal
from tests.contract.fmu_host import Host, hosted

WARNING, ERROR = 1, 3


@pytest.fixture(params=["native"])
def kind(request: pytest.FixtureRequest) -> str:
    """The kind of FMU that checks what FMI forbids; the Python FMU leaves that to the host."""
    return str(request.param)


@pytest.mark.parametrize("duration", [0.0, -1.0, math.nan, math.inf, 1e300])
def test_impossible_step_is_discarded_and_nothing_changes(path: Path, host: Host, duration: float) -> None:
    host.step(5.0)
    before = host.outputs()
    assert "step" in host.refused(duration)
    assert host.outputs() == before
    host.step(5.0)
    with hosted(path) as calm:
        calm.step(5.0, count=2)
        assert calm.outputs() == host.outputs()


def test_step_from_another_time_is_discarded(host: Host) -> None:
    host.step(5.0)
    assert "ended at 5 s" in host.refused(time=3.0)


def test_step_before_initialization_is_refused(path: Path) -> None:
    with hosted(path, start=False) as host:
        assert "initializ" in host.refused(status=ERROR).lower()


@pytest.mark.parametrize(
    ("name", "value", "hint"),
    [
        ("speed", math.nan, "a finite number is needed"),
        ("speed", 1e6, "if 1/min is meant, multiply by pi/30"),
        ("T_ambient", 20.0, "if 20 degC is meant, set 293.15"),
        ("initial.T", 20.0, "if 20 degC is meant, set 293.15"),
    ],
)
def test_a_slip_of_units_is_pointed_out(path: Path, name: str, value: float, hint: str) -> None:
    with hosted(path, start=False) as host:
        host.enter({name: value})
        with pytest.raises(FMICallException, match=r"\(error\)"):
            host.slave.exitInitializationMode()
        ((status, text),) = host.said
        assert status == ERROR
        assert hint in text


def test_calculated_variables_cannot_be_set(host: Host, illegal: Illegal) -> None:
    before = host.outputs()
    with illegal():
        host.set_all({"oil.T": 400.0})
    (said,) = host.said
    assert said[0] == ERROR
    assert "oil.T" in said[1]
    assert host.outputs() == before


def test_fixed_parameters_cannot_be_set_after_the_start(host: Host, illegal: Illegal) -> None:
    with illegal():
        host.set_all({"initial.T": 400.0})
    (said,) = host.said
    assert said[0] == ERROR
    assert host.get("oil.T")[0] == pytest.approx(300.15)


@pytest.mark.parametrize("duration", [100.0, 1.0])
def test_the_warning_names_the_moment_at_which_the_range_was_left(path: Path, duration: float) -> None:
    """Held inputs are outside from the start of the step on, whatever its length; temperatures only drift out."""
    with hosted(path, {"speed": 1000.0}) as host:
        host.step(duration)
        (said,) = host.said
        assert said[1].startswith("at 0 s the operating point is outside the range")
        host.set(speed=300.0)
        host.step(duration)
        assert host.said == []
        host.set(torque=400.0)
        host.step(duration)
        ((status, text),) = host.said
        assert (status, text.partition(" s ")[0]) == (WARNING, f"at {2.0 * duration:g}")
        assert "torque 400 N m (to 350)" in text
    with hosted(path, {"initial.T": 473.0, "T_ambient": 473.0, "torque": 300.0}) as host:
        host.step(100.0)
        ((_, text),) = host.said
        assert text.startswith("at 100 s the operating point is outside")
        assert "pinion" in text


def test_start_temperatures_that_are_not_used_are_reported_once(path: Path) -> None:
    with hosted(path, {"oil.T_start": 353.15, "initial.T": 300.0}) as host:
        assert host.said == [(
            WARNING,
            "oil.T_start is 353.15 K, but initial.uniform is true: all parts start at initial.T = 300 K. "
            "Set initial.uniform to false to start each part at its own",
        )]  # fmt: skip
        assert host.get("oil.T") == pytest.approx([300.0])
        host.step(1.0)
        assert host.said == []
    with hosted(path, {"oil.T_start": 353.15, "mesh.T_start": 310.0, "wheel.T_start": 310.0}) as host:
        ((_, text),) = host.said
        assert text.startswith("oil.T_start is 353.15 K (and 2 more such temperatures are given), but")


@pytest.mark.parametrize(
    "values",
    [{"initial.T": 350.0}, {"oil.T_start": 350.0, "initial.T": 350.0}, {"oil.T_start": 300.15},
     {"oil.T_start": 350.0, "initial.uniform": 0.0}],
)  # fmt: skip
def test_start_temperatures_that_change_nothing_are_not_reported(path: Path, values: dict[str, float]) -> None:
    with hosted(path, values) as host:
        assert host.said == []


def test_an_unknown_value_reference_does_not_kill_the_host(host: Host, illegal: Illegal) -> None:
    with illegal():
        host.slave.setReal([99999], [1.0])
    with illegal():
        assert math.isnan(host.slave.getReal([99999])[0])
    assert any("value reference 99999" in text for _, text in host.fmu.messages)
    host.step(1.0)
    assert math.isfinite(host.slave.getReal([host.fmu.variables["oil.T"].valueReference])[0])
