"""Heat ports: what flows to the boundaries, and an energy balance that closes over the interface alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from models.assembly.gearbox import Gearbox
from models.network.laws import symbol
from tests.contract.fmu_host import Host, hosted

TERMS = ("heat_in", "heat_stored", "air.heat", "frame.heat")


def ride(host: Host, step: float, steps: int) -> None:
    """Steps with inputs that change from one to the next."""
    for _ in range(steps):
        share = host.time / 600.0
        host.set(
            speed=300.0 * np.sin(9.0 * share), torque=150.0 * np.cos(7.0 * share), T_ambient=293.15 + 25.0 * share,
            air_speed=2.0 + 2.0 * np.sin(20.0 * share),
        )  # fmt: skip
        host.step(step)


def capacities(gearbox: Gearbox, **factors: float) -> dict[str, float]:
    """Heat capacities by the definition, by the name of a part's temperature, [J/K]."""
    network = gearbox.network()
    values = {symbol(parameter.name): factors.get(parameter.name, parameter.start) for parameter in network.parameters}
    return {f"{p.name}.T": float(p.capacity.xreplace(values)) for p in network.parts if p.capacity is not None}


@pytest.mark.parametrize("step", [0.1, 1.0, 10.0, 60.0])
def test_the_energy_balance_closes(path: Path, step: float, fzg: Gearbox) -> None:
    """What came in and did not go to a boundary is in the capacities of the definition, by the temperatures shown."""
    of_parts = capacities(fzg)
    with hosted(path) as host:
        first = np.array(host.get(*of_parts))
        ride(host, step, min(60, round(600.0 / step)))
        heat_in, stored, air, frame = host.get(*TERMS)
        held = float([*of_parts.values()] @ (np.array(host.get(*of_parts)) - first))
    assert heat_in > 0.0
    assert heat_in - held - air - frame == pytest.approx(0.0, abs=1e-9 * heat_in)
    assert stored == pytest.approx(held, abs=1e-9 * heat_in)


def test_a_capacity_that_is_tuned_in_a_run_stores_nothing_by_itself(path: Path, fzg: Gearbox) -> None:
    of_parts = capacities(fzg, C_oil=2.0)
    with hosted(path) as host:
        ride(host, 10.0, 20)
        before = host.get(*TERMS)
        host.set(**{"factor.C_oil": 2.0})
        assert host.get(*TERMS) == before
        first = np.array(host.get(*of_parts))
        ride(host, 10.0, 20)
        heat_in, stored, _, _ = host.get(*TERMS)
        held = float([*of_parts.values()] @ (np.array(host.get(*of_parts)) - first))
    assert stored - before[1] == pytest.approx(held, abs=1e-9 * heat_in)


def test_a_step_without_length_is_refused(path: Path) -> None:
    with hosted(path) as host:
        host.step(1.0)
        kept = host.get(*TERMS, "air.heat_flow")
        with pytest.raises(FMICallException):
            host.slave.doStep(currentCommunicationPoint=host.time, communicationStepSize=0.0)
        assert host.get(*TERMS, "air.heat_flow") == kept


def test_flows_are_means_over_the_last_step(path: Path) -> None:
    with hosted(path) as host:
        (first,) = host.get("air.heat_flow")  # at the start the flow of the moment
        assert host.get(*TERMS) == [0.0] * 4
        host.step(1e-3)
        assert host.get("air.heat_flow") == pytest.approx([first], abs=1e-3)
        sum_of_steps = 1e-3 * host.get("air.heat_flow")[0]
        for step in (0.5, 20.0, 3.0):
            host.set(T_ambient=293.15 + step)
            host.step(step)
            sum_of_steps += step * host.get("air.heat_flow")[0]
        assert host.get("air.heat") == pytest.approx([sum_of_steps], rel=1e-12)


def test_heat_flows_from_a_warm_boundary_into_the_machine(path: Path) -> None:
    with hosted(path, {"T_ambient": 353.15}) as host:
        host.step(10.0)
        flow, heat, stored = host.get("air.heat_flow", "air.heat", "heat_stored")
    assert flow < 0.0
    assert heat == pytest.approx(10.0 * flow)
    assert stored > 0.0


def test_saved_states_hold_the_heat(path: Path) -> None:
    names = [*TERMS, "air.heat_flow", "frame.heat_flow"]
    with hosted(path) as host:
        ride(host, 5.0, 10)
        saved, time = host.slave.getFMUstate(), host.time
        kept = host.get(*names)
        ride(host, 5.0, 10)
        after = host.get(*names)
        assert after != kept
        host.slave.setFMUstate(saved)
        host.time = time
        assert host.get(*names) == kept
        ride(host, 5.0, 10)
        assert host.get(*names) == after
        host.slave.freeFMUstate(saved)
