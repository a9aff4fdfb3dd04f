"""Columns are drawn with the colour of each part, and named ones only; what cannot be drawn is refused."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot as plt

from models.base.errors import InputError
from models.columns.columns import Columns
from models.columns.curves import loss_curves
from models.quantities.part_colours import part_colours

TIME = np.array([0.0, 3600.0, 10800.0])
COLUMNS = Columns(
    time_s=TIME, speed_rpm=TIME, T_ambient_degC=TIME, T_oil_degC=TIME, T_bearing_1_degC=TIME, T_bearing_2_degC=TIME,
    P_loss_W=3.0 * TIME, P_loss_bearing_1_W=TIME, P_loss_bearing_2_W=2.0 * TIME, in_domain=TIME,
)  # fmt: skip


@pytest.fixture(autouse=True)
def _no_window() -> Iterator[None]:
    mpl.use("Agg")
    yield
    plt.close("all")


def test_temperatures_over_hours_in_the_colours_of_all_parts() -> None:
    ax = COLUMNS.plot(only=["bearing_2", "oil"])
    colours = part_colours(["oil", "bearing_1", "bearing_2"])
    assert [(line.get_label(), line.get_color()) for line in ax.lines] == [
        ("bearing 2", colours["bearing_2"]), ("oil", colours["oil"]),
    ]  # fmt: skip
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("Time in h", "Temperature in °C")
    assert np.asarray(ax.lines[0].get_xdata())[-1] == 3.0


def test_twins_among_losses_are_one_curve() -> None:
    ax = COLUMNS.plot("losses", ax=plt.figure().add_subplot())
    assert [line.get_label() for line in ax.lines] == ["total", "bearings"]
    np.testing.assert_array_equal(ax.lines[1].get_ydata(), 3.0 * TIME)
    one = COLUMNS.plot("losses", only=["bearing_1"], ax=plt.figure().add_subplot())
    assert [line.get_label() for line in one.lines] == ["bearing 1"]


def test_without_time_the_first_column_that_changes_is_the_axis() -> None:
    assert Columns(speed_rpm=np.full(3, 5.0), torque_Nm=TIME, T_oil_degC=TIME).plot().get_xlabel() == "Torque in N m"


def test_variants_lie_below_each_other() -> None:
    table = Columns(time_s=TIME[:2], T_oil_degC=np.array([[1.0, 2.0], [3.0, 4.0]])).to_dataframe()
    assert table.to_dict("list") == {"variant": [0, 0, 1, 1], "time_s": [0.0, 3600.0] * 2, "T_oil_degC": [1, 2, 3, 4]}


@pytest.mark.parametrize(("what", "only", "message"), [
    ("temperature", (), "'temperature' cannot be drawn; did you mean 'temperatures'"),
    ("temperatures", ["oli"], "no temperature 'oli' to draw; did you mean 'oil'"),
    ("losses", ["mesh"], "no loss 'mesh' to draw"),
])  # fmt: skip
def test_what_cannot_be_drawn(what: Any, only: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        COLUMNS.plot(what, only=only)
    with pytest.raises(InputError, match="no loss to draw"):
        Columns(time_s=TIME).plot("losses")
    assert not plt.get_fignums()


def test_parts_of_other_families_do_not_have_the_colour_of_a_known_one() -> None:
    colours = part_colours(["oil", "case", "pinion", "in_a", "flange", "bearing_1"])
    assert len(set(colours.values())) == len(colours)


def test_losses_of_several_stages_are_one_curve() -> None:
    names = ("mesh_sliding_1", "mesh_sliding_2", "churning_1", "churning_2", "bearing_1", "bearing_2")
    columns = {"P_loss_W": np.full(2, 21.0)} | {f"P_loss_{n}_W": np.full(2, float(i)) for i, n in enumerate(names, 1)}
    curves = loss_curves(columns)
    assert {label: values.tolist() for label, (values, _) in curves.items()} == {
        "total": [21.0, 21.0], "mesh_sliding": [3.0, 3.0], "churning": [7.0, 7.0], "bearings": [11.0, 11.0],
    }  # fmt: skip
