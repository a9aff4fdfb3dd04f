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
