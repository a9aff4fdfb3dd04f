"""Cycles from columns: what is read, and every fault at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from models.cycle import Cycle
from models.errors import InputError

GOOD: dict[str, Any] = {"time_s": [0.0, 1.0], "speed_rpm": [0.0, 100.0], "torque_Nm": [1, 2]}


def test_reads_what_it_knows() -> None:
    cycle = Cycle.from_columns({**GOOD, "T_ambient_degC": [20.0, 21.0], "note": ["a", "b"]})
    assert len(cycle) == 2
    assert set(cycle.inputs) == {"speed", "torque", "T_ambient"}
    assert cycle.inputs["torque"].dtype == float


def test_extra_inputs_by_their_own_name() -> None:
    cycle = Cycle.from_columns({**GOOD, "valve": [0, 1]}, extra=("valve", "absent"))
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
        ({"torque_Nm": ["x", "y"]}, "torque_Nm holds something that is not a number"),
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
