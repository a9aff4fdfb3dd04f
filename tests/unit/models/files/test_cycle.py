"""Cycles from columns: what is read, and every fault at once."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError
from models.files.cycle import Cycle
from models.quantities.quantities import GEARBOX_INPUTS, Input, named_input

GOOD: dict[str, Any] = {"time_s": [0.0, 1.0], "speed_rpm": [0.0, 100.0], "torque_Nm": [1, 2]}


def with_inputs(*names: str) -> dict[str, Input]:
    """Inputs of a gearbox and further ones of a user."""
    return {**GEARBOX_INPUTS, **{name: named_input(name, "ratio") for name in names}}


def test_reads_what_it_knows() -> None:
    cycle = Cycle.from_columns({**GOOD, "T_ambient_degC": [20.0, 21.0], "note": ["a", "b"]})
    assert len(cycle) == 2
    assert set(cycle.inputs) == {"speed", "torque", "T_ambient"}
    assert cycle.inputs["torque"].dtype == float


def test_extra_inputs_by_their_own_name() -> None:
    cycle = Cycle.from_columns({**GOOD, "valve": [0, 1]}, inputs=with_inputs("valve", "absent"))
    assert cycle.inputs["valve"].tolist() == [0.0, 1.0]
    assert "absent" not in cycle.inputs


def test_one_row_is_a_cycle() -> None:
    assert len(Cycle.from_columns({name: values[:1] for name, values in GOOD.items()})) == 1


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"time_s": [1.0, 1.0]}, "time_s goes from 1 to 1 at row 2"),
        ({"time_s": [0.0, np.nan]}, "time_s is nan at row 2; 1 rows are not finite"),
        ({"time_s": [], "speed_rpm": [], "torque_Nm": []}, "it has no rows"),
        ({"speed_rpm": [0.0, 3e5]}, "speed_rpm is 300000 at row 2; -200000 ... 200000 is possible"),
        ({"T_ambient_degC": [293.0, 293.0]}, "T_ambient_degC is 293 at row 1; .*kelvin are not meant"),
        ({"air_speed_m_s": [-1.0, 1.0]}, "air_speed_m_s is -1 at row 1"),
        ({"torque_Nm": ["x", "y"]}, "numbers are needed"),
        ({"torque_Nm": [[1.0, 2.0]]}, r"torque_Nm has shape \(1, 2\); one value per row"),
        ({"torque_Nm": [1.0, 2.0, 3.0]}, "torque_Nm has 3 rows, but time_s has 2"),
    ],
)
def test_faults(changed: dict[str, Any], says: str) -> None:
    with pytest.raises(InputError, match=says):
        Cycle.from_columns({**GOOD, **changed}, name="run.csv")


def test_all_faults_at_once_with_the_name_of_the_file() -> None:
    with pytest.raises(InputError) as caught:
        Cycle.from_columns({"time_s": [0, 0], "speed_rpm": [np.inf, 1e9]}, name="run.csv")
    lines = str(caught.value).splitlines()
    assert len(lines) == 3
    assert all(line.startswith("run.csv: ") for line in lines)


# ---------------------------------------------------------------------- optional columns under another name


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        *((name, "T_ambient_degC") for name in ("T_amb_degC", "T_ambient", "T_ambient_C", "T_ambient_K", "ambient_degC",
                                                "Tamb_degC", "t_ambient_degc", "T_ambiant_degC", "Temp_ambient [K]",
                                                "amb", "Tamb", "ambient", "ambint", "T_ambient [degX]")),
        *((name, "air_speed_m_s") for name in ("air_speed", "airspeed", "airspeed_m_s", "air_speed_mps",
                                               "Air_Speed_m_s")),
        *((name, "valve_opening") for name in ("valve_openning", "Valve_opening", "valve_opening_m",
                                               "valve_opening (turns/min)")),
    ],
)  # fmt: skip
def test_an_optional_column_under_another_name_is_not_lost(name: str, meant: str) -> None:
    says = rf"run.csv: column {re.escape(name)} is not known; is {meant} meant\? rename it, or remove it"
    with pytest.raises(InputError, match=says):
        Cycle.from_columns({**GOOD, name: [1.0, 2.0]}, name="run.csv", inputs=with_inputs("valve_opening"))
    both = Cycle.from_columns({**GOOD, name: [1.0, 2.0], meant: [3.0, 4.0]}, inputs=with_inputs("valve_opening"))
    assert [3.0, 4.0] in [values.tolist() for values in both.inputs.values()]


@pytest.mark.parametrize(("name", "meant"), [("Time_s", "time_s"), ("Speed", "speed_rpm"), ("torque_NM", "torque_Nm")])
def test_a_needed_column_under_another_name_is_told(name: str, meant: str) -> None:
    says = rf"run.csv: column {name} is not known; is {meant} meant\? rename it, or remove it"
    with pytest.raises(InputError, match=says):
        Cycle.from_columns({name if column == meant else column: v for column, v in GOOD.items()}, name="run.csv")


@pytest.mark.parametrize("gearbox", ["fzg", "la_haute_borne"])
def test_results_and_recordings_are_cycles(gearbox: str) -> None:
    definition = load_gearbox(gearbox)
    network = definition.network()
    result = network.simulate(GOOD, losses=definition.loss_laws()).columns()
    assert set(Cycle.from_columns(result, inputs=network.inputs).inputs) == {*network.inputs}
    recorded = {name: values for name, values in result.items() if name not in ("T_ambient_degC", "air_speed_m_s")}
    others = ("T_cabinet_degC", "wind_speed_m_s", "vehicle_speed_m_s", "speed_m_s", "T_flange_degC", "remark")
    recorded |= dict.fromkeys(others, np.zeros(2))
    kept = set(network.inputs) - {"T_ambient", "air_speed"}
    assert set(Cycle.from_columns(recorded, inputs=network.inputs).inputs) == kept


# ---------------------------------------------------------------------- more rows


def test_refined_rows_are_the_own_ones_and_one_per_interval() -> None:
    cycle = Cycle.from_columns(
        {
            "time_s": [10.0, 12.5, 14.0],
            "speed_rpm": [0.0, 100.0, 40.0],
            "torque_Nm": [5.0, 5.0, 8.0],
            "heat": [1, 2, 3],
        },
        inputs=with_inputs("heat"),
    )
    fine = cycle.refined(1.0)
    assert fine.time.tolist() == [10.0, 11.0, 12.0, 12.5, 13.0, 14.0]
    assert fine.inputs["speed"] == pytest.approx([0.0, 40.0, 80.0, 100.0, 80.0, 40.0])
    own = np.isin(fine.time, cycle.time)
    for name, values in cycle.inputs.items():
        assert fine.inputs[name][own].tolist() == values.tolist()
    assert cycle.refined(100.0).time.tolist() == cycle.time.tolist()


@pytest.mark.parametrize("start", [0.0, 0.7, 1.7e9])
def test_rounding_makes_no_rows(start: float) -> None:
    """0.1 has no exact binary form: the grid meets the rows of a file only nearly."""
    time = np.array([round(start + i / 10, 1) for i in range(301)])
    cycle = Cycle(time, {"speed": 0 * time, "torque": 0 * time})
    assert cycle.refined(0.1).time.tolist() == time.tolist()
    finer = cycle.refined(0.05).time
    assert len(finer) == 601
    assert np.diff(finer) == pytest.approx(0.05, rel=1e-4)


def test_one_row_stays_one_row() -> None:
    one = Cycle.from_columns({name: values[:1] for name, values in GOOD.items()})
    assert one.refined(0.5).time.tolist() == [0.0]


@pytest.mark.parametrize("interval", [0.0, -1.0, 1e-7, np.nan, np.inf])
def test_impossible_intervals(interval: float) -> None:
    with pytest.raises(InputError, match="an output interval of .* s is not possible; 1e-05 s or more is"):
        Cycle.from_columns(GOOD).refined(interval)


def test_too_many_rows_are_refused_with_an_interval_that_is_possible() -> None:
    cycle = Cycle.from_columns({**GOOD, "time_s": [0.0, 86400.0]})
    with pytest.raises(InputError, match=r"gives 8.64e\+06 rows over 86400 s; up to 5000000 .* choose 0.018 s or more"):
        cycle.refined(0.01)
    assert len(cycle.refined(0.018)) == 4_800_001
