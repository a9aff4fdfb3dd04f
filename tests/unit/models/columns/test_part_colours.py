"""Every part has one colour, and no two parts of a machine look the same."""

from __future__ import annotations

import pytest

from models.assembly.gearbox import known_gearboxes, load_gearbox
from models.columns.part_colours import LINES, PALETTE, part_colour, part_looks


@pytest.mark.parametrize("name", known_gearboxes())
def test_no_two_nodes_or_losses_of_a_machine_look_the_same(name: str) -> None:
    network = load_gearbox(name).network()
    for names in (network.node_names, network.components):
        assert len(set(part_looks(names).values())) == len(names)


def test_a_colour_does_not_depend_on_what_else_is_drawn() -> None:
    alone, together = part_looks(["wheel"]), part_looks(["oil", "mesh", "wheel"])
    assert alone["wheel"] == together["wheel"]
    assert part_colour("oil__sump_probe") == part_colour("oil") != part_colour("mesh_sliding")
    assert [part_colour(f"cell_{i}") for i in (1, 2, 8)] == [PALETTE[0], PALETTE[1], PALETTE[0]]


def test_more_parts_than_lines_are_drawn_all_the_same() -> None:
    looks = part_looks([f"bearing_{i}" for i in range(1, 10)])
    assert len(looks) == 9 and len(set(looks.values())) == len(LINES)
