"""Tables of a definition as it was understood."""

from __future__ import annotations

from builder.workflows.understood import understood
from models.assembly.gearbox import Gearbox, load_gearbox


def test_how_deep_gears_dip_is_shown(fzg: Gearbox) -> None:
    """Tip radii of 41.25 and 59.2 mm, 19 and 45 mm above the oil."""
    full, low = understood(fzg)[-1], understood(fzg.with_values({"oil.level_below_axis_mm": 45.0}))[-1]
    assert full.rows == [["pinion", "82.5", "22.2"], ["wheel", "118.4", "40.2"]]
    assert low.title == "Gears; contact ratio 1.437; oil 45 mm below their axes"
    assert [row[2] for row in low.rows] == ["not at all", "14.2"]


def test_a_machine_without_geometry_has_no_gears() -> None:
    assert not any(table.title.startswith("Gears") for table in understood(load_gearbox("reducer")))


def test_where_temperatures_settle_is_the_steady_state(fzg: Gearbox) -> None:
    table = next(one for one in understood(fzg) if one.title.startswith("Where temperatures settle"))
    low = fzg.steady_state(speed=650.0, torque=35.0).temperatures
    rows = {row[0]: row[1:] for row in table.rows}
    assert rows["oil"][0] == f"{low['oil']:.1f}" and rows["housing_upper"][0] == f"{low['housing_upper']:.1f}"
    assert rows["oil"][2] == "> 250"  # the rig cannot run at the end of [training] for ever
    hottest = max((name for name in low if name.startswith("bearing")), key=lambda name: low[name])
    assert rows["hottest bearing"][0] == f"{low[hottest]:.1f} ({hottest})"


def test_every_stage_and_bearing_has_its_row() -> None:
    two = understood(load_gearbox("two_stage"))
    assert [table.title.split(";")[0] for table in two[-2:]] == ["Gears of stage 1", "Gears of stage 2"]
    loads = {row[0]: row[1:] for row in two[-3].rows}
    assert len(loads) == 6 and loads["middle_far_side"][0] == "508.2"


def test_tables_say_at_which_inputs_they_are(fzg: Gearbox) -> None:
    titles = [table.title for table in understood(fzg)]
    assert any(title.endswith("\n(speed 3250 1/min, torque 175 N m, air_speed 2 m/s)") for title in titles)
    assert "Where temperatures settle, in degC, at T_ambient 27 degC, air_speed 2 m/s" in titles
