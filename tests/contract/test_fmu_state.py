"""The state of every kind of FMU: saved, serialized, restored, and separate for each instance."""

from __future__ import annotations

from pathlib import Path

import pytest
from fmpy.fmi1 import FMICallException

from tests.contract.fmu_host import LOADED, Host, hosted

# ---------------------------------------------------------------------- the whole state


def run(host: Host) -> list[dict[str, float]]:
    outputs = []
    for speed in (500.0, 20.0, 1000.0, 300.0):
        host.set(speed=speed)
        host.step(3.7, count=2)
        outputs.append(host.outputs())
    return outputs


def test_replay_from_a_saved_state_is_exact(host: Host) -> None:
    def replay() -> tuple[list[dict[str, float]], list[tuple[int, str]]]:
        host.step(1.0)
        return run(host), host.said

    host.set(speed=1000.0)  # outside the range of training: that it has warned is part of the state
    host.set_all({"factor.bearing": 1.5})
    host.step(12.3)
    assert len(host.said) == 1
    state, time = host.slave.getFMUstate(), host.time
    first = replay()
    host.set_all({"factor.bearing": 0.5})
    host.step(100.0)
    host.slave.setFMUstate(state)
    host.time = time
    assert host.get("factor.bearing") == [1.5]
    assert replay() == first
    host.slave.freeFMUstate(state)


def test_serialized_state_continues_in_another_instance(path: Path, host: Host) -> None:
    host.step(12.3)
    state = host.slave.getFMUstate()
    content = host.slave.serializeFMUstate(state)
    host.slave.freeFMUstate(state)
    time, first = host.time, run(host)
    with hosted(path) as other:
        restored = other.slave.deSerializeFMUstate(content)
        other.slave.setFMUstate(restored)
        other.time = time
        assert run(other) == first


def test_a_damaged_state_is_refused_and_the_host_goes_on(host: Host) -> None:
    host.step(12.3)
    state = host.slave.getFMUstate()
    content = host.slave.serializeFMUstate(state)
    host.slave.freeFMUstate(state)

    def go_on_from(serialized: bytes) -> None:
        host.slave.setFMUstate(host.slave.deSerializeFMUstate(serialized))
        host.step(1.0)

    without_values = content.replace(b'"values"', b'"valuex"')  # of the Python FMU; the native one has no names
    for damaged in (content[: len(content) // 2], b"\xff" + content[1:], b"[1, 2]", without_values[:-1] + b"}"):
        with pytest.raises(FMICallException):  # the native FMU when it is read, the Python FMU at the next step
            go_on_from(damaged)
    go_on_from(content)


def test_state_saved_in_initialization_can_be_restored(path: Path) -> None:
    with hosted(path, start=False) as host:
        host.slave.setupExperiment(startTime=0.0)
        host.slave.enterInitializationMode()
        host.set_all(LOADED | {"initial.T": 310.0})
        state = host.slave.getFMUstate()
        host.set_all({"initial.T": 350.0})
        host.slave.exitInitializationMode()
        host.step(10.0)
        host.slave.setFMUstate(state)
        host.time = 0.0
        host.slave.exitInitializationMode()
        assert host.get("oil.T")[0] == pytest.approx(310.0)


def test_reset_begins_anew(host: Host) -> None:
    first = run(host)
    host.slave.terminate()
    host.slave.reset()
    host.start()
    assert run(host) == first


# ---------------------------------------------------------------------- several in one process


def test_instances_do_not_touch_each_other(path: Path) -> None:
    with hosted(path) as alone:
        expected = run(alone)
    with hosted(path) as first, hosted(path, {"initial.T": 350.0}) as second:
        outputs = []
        for speed in (500.0, 20.0, 1000.0, 300.0):
            for host in (first, second):
                host.set(speed=speed)
                host.step(3.7, count=2)
            outputs.append(first.outputs())
        assert outputs == expected
        assert second.outputs()["oil.T"] > first.outputs()["oil.T"] + 10.0
