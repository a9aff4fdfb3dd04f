"""Inputs, boundaries, parts, links and heats next to a geometry: the network they make, and faults that are named."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from builder.fmi.reference_cycle import reference_cycle
from builder.workflows.understood import understood
from diagnosis.proof.plant.plant import Plant
from models.assembly.gearbox import Gearbox, load_gearbox, read_gearbox
from models.base.errors import InputError
from models.files.toml_file import packaged, read_text
from models.mechanisms import Scale
from models.network.laws import symbol
from tests.unit.models.around_fzg import TABLES, around_fzg

CYCLE: dict[str, Any] = {"time_s": [0.0, 1800.0], "speed_rpm": [1500.0, 1500.0], "torque_Nm": [94.0, 94.0]}
POWER_W = 0.02 * 1500.0 * 94.0 * 0.1047  # of the motor's heat


@pytest.fixture(scope="module")
def machine() -> Gearbox:
    return around_fzg()


def test_they_are_added_to_the_network_of_the_geometry(machine: Gearbox, fzg: Gearbox) -> None:
    network, plain = machine.network(), fzg.network()
    assert set(network.node_names) - set(plain.node_names) == {"flange", "coolant", "bed"}
    assert list(network.boundaries) == ["air", "frame", "flange", "coolant"]
    assert list(network.inputs) == [*plain.inputs, "coolant_flow", "T_flange", "T_coolant"]
    conductances = {link.nodes: link.conductance for link in network.links[len(plain.links) :]}
    flow, G = symbol("coolant_flow"), symbol("G_housing_upper_flange")
    assert conductances[("housing_upper", "flange")] == 12.0 * G
    assert conductances[("housing_upper", "coolant")].subs(flow, 4.0) == pytest.approx(30.0)
    assert conductances[("housing_lower", "bed")] == 15.0 and conductances[("bed", "air")] == 2.0
    added = {p.name: p.sd for p in network.parameters[len(plain.parameters) :]}
    assert added == pytest.approx({"share": 0.5, "C_bed": 0.3, "G_housing_upper_flange": 0.4})
    assert network.groups["housing"] == ("housing_lower", "housing_upper", "bed")
    assert [(s.name, s.node, s.is_loss) for s in network.sources[len(plain.sources) :]] == [("motor", "shaft_1", False)]


def test_a_gearbox_without_them_is_what_it_was(fzg: Gearbox) -> None:
    assert {"input", "parameter", "boundary", "part", "link", "heat", "recording"}.isdisjoint(fzg.values)
    assert around_fzg((TABLES, "")).hash == fzg.hash


def test_heat_flows_along_the_added_paths(machine: Gearbox) -> None:
    """At rest: the bed between 15 and 2 W/K, and all heat of losses and motor leaves through the boundaries."""
    steady = {"speed_rpm": [1500.0] * 3, "torque_Nm": [94.0] * 3, "coolant_flow": [4.0] * 3, "T_coolant": [30.0] * 3}
    result = machine.simulate({"time_s": [0.0, 3e5, 3e5 + 100.0], **steady}, initial=60.0)
    T = {name: float(values[-1]) for name, values in result.temperatures.items()}
    out = {name: float(heat[2] - heat[1]) / 100.0 for name, heat in result.heat_to.items()}
    assert T["bed"] == pytest.approx((15.0 * T["housing_lower"] + 2.0 * 27.0) / 17.0, abs=1e-4)
    assert out["flange"] == pytest.approx(12.0 * (T["housing_upper"] - 40.0), rel=1e-4)
    assert out["coolant"] == pytest.approx(30.0 * (T["housing_upper"] - 30.0), rel=1e-4)
    assert sum(out.values()) == pytest.approx(sum(loss[-1] for loss in result.losses.values()) + POWER_W, rel=1e-4)


def test_a_cycle_gives_the_temperatures_or_the_definition_does(machine: Gearbox) -> None:
    assumed = machine.simulate(CYCLE, initial=30.0).temperatures
    as_given = machine.simulate(
        {**CYCLE, "T_flange": [40.0, 40.0], "T_coolant": [50.0, 50.0]}, initial=30.0
    ).temperatures
    np.testing.assert_array_equal(assumed["housing_upper"], as_given["housing_upper"])
    hot = machine.simulate({**CYCLE, "T_flange": [90.0, 90.0]}, initial=30.0).temperatures
    assert hot["flange"].tolist() == [90.0, 90.0] and hot["housing_upper"][-1] > assumed["housing_upper"][-1] + 10.0


def test_an_input_without_a_default_is_needed() -> None:
    with pytest.raises(InputError, match="column coolant_flow is missing"):
        around_fzg(("default = 0.0\n", "")).simulate(CYCLE)


def test_values_sources_and_standard_deviations_have_paths(machine: Gearbox) -> None:
    assert machine.source_of("part.0.heat_capacity_J_K") == "weighed"
    assert machine.priors["part.0.heat_capacity_J_K"] == pytest.approx(12000.0)
    changed = machine.with_values({"link.3.conductance_W_K": 3.0})
    assert changed.definition.link[3].conductance_W_K == 3.0 and changed.hash != machine.hash
    with pytest.raises(InputError, match="link #4.between: housing_lower and air are joined by the geometry already"):
        machine.with_values({"link.3.between": ("housing_lower", "air")})


@pytest.mark.parametrize(("old", "new", "message"), [
    ('["bed", "air"]', '["housing_upper", "air"]',
     "link #4.between: housing_upper and air are joined by the geometry already; [factors] scales that path"),
    ('["bed", "air"]', '["frame", "housing_lower"]',
     "link #4.between: frame and housing_lower are joined by the geometry already; foundation_conductance_W_K of"),
    ('["bed", "air"]', '["frame", "air"]', "link #4.between: joins two boundaries; heat between them warms nothing"),
    ('["bed", "air"]', '["flange", "air"]', "link #4.between: joins two boundaries; heat between them warms nothing"),
    ('["bed", "air"]', '["bed", "housing_lower"]', "link #4.between: bed and housing_lower are joined already"),
    ('["bed", "air"]', '["bed", "airr"]', "link #4.between: there is no part or boundary 'airr'; did you mean 'air'?"),
    ("conductance_W_K = 2.0", "conductance_W_K = 2.0\nstandstill_share = 0.5",
     "link #4.standstill_share: needs running_rpm in [reference], which a definition with geometry has not; write"),
    ('name = "bed"', 'name = "oil"', "name 'oil' is given 2 times; every part and boundary needs its own"),
    ('name = "bed"', 'name = "gears"', "name 'gears' is taken by the model itself; choose another"),
    ('name = "bed"', 'name = "housing"', "name 'housing' is taken by the model itself; choose another"),
    ('name = "coolant"', 'name = "frame"', "name 'frame' is given 2 times; every part and boundary needs its own"),
    ('name = "share"', 'name = "h_air"', "'h_air' names several inputs, parameters, factors or nodes"),
    ('name = "share"', 'name = "torque"', "'torque' names several inputs, parameters, factors or nodes"),
    ('name = "share"', 'name = "P_seal_1"', "'P_seal_1' names several inputs, parameters, factors or nodes"),
    ('name = "coolant_flow"\nquantity', 'name = "T_mesh"\nquantity', "'T_mesh' names several inputs, parameters"),
    ('name = "coolant_flow"\nquantity = "volume flow"\nunit = "l/min"\nrange = [0.0, 20.0]', 'name = "air_speed"',
     "input 'air_speed': is an input of every gearbox with geometry; leave it out"),
    ('input = "T_flange"', 'input = "T_ambient"', "boundary 'flange'.temperature_degC: T_ambient has its value in"),
    ('input = "T_flange"', 'input = "speed"', "boundary 'flange'.input: 'speed' is a speed, not a temperature"),
    ("temperature_degC = 40.0\n", "", "boundary 'flange': 'T_flange' is no [[input]]; declare it, or give temperature"),
    ('name = "motor"', 'name = "bearing_1"', "heat 'bearing_1': 'bearing_1' is a loss of the gearbox; choose"),
    ('part = "shaft_1"', 'part = "air"', "heat 'motor'.part: there is no part 'air'; known are: bearing_1"),
    ("abs(speed", "abs(sped", "heat 'motor'.heat_W: 'sped' is no input and no temperature of this definition; did"),
    ('"coolant_flow / 8"', '"coolant_flow / 8 - T_oil / 20"', "link #2.factor: is -1 at T_oil = 20, coolant_flow = 0"),
    ("[[heat]]", "[reference]\nspeed_rpm = 1.0\n\n[[heat]]", "'reference' is not a known key"),
    ("[[heat]]", '[[node]]\nname = "bed"\nheat_capacity_J_K = 1.0\n\n[[heat]]', "node 'bed': there is no node 'bed'"),
])  # fmt: skip
def test_faults_are_named(old: str, new: str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        around_fzg((old, new))


def test_a_part_that_cannot_shed_heat_is_refused() -> None:
    wind = load_gearbox("la_haute_borne")
    nowhere = {"link.1.between": ("oil_inlet", "casing"), "link.3.between": ("oil_inlet", "bearing_1")}
    assert wind.with_values(nowhere).hash != wind.hash  # the casing leads outdoors
    with pytest.raises(InputError, match=r"part 'oil': no links lead from it to a \[\[boundary\]\]"):
        wind.with_values(nowhere | {"link.4.between": ("oil_inlet", "bearing_2")})


def test_what_was_understood_shows_them(machine: Gearbox, fzg: Gearbox) -> None:
    """Heat of the motor at a tenth, at half and at all of 3000 1/min and 350 N m, where [training] ends."""
    nodes, links, _, _, heats = understood(machine)[:5]
    assert ["bed", "part", "", "40000"] in nodes.rows and ["bed - air", "constant", "2"] in links.rows
    assert ["housing_upper - coolant", "coolant_flow", "75"] in links.rows
    rated = 0.02 * 0.1047 * np.prod([machine.training.speed_rpm[1], machine.training.torque_Nm[1]])
    assert [float(cell) for cell in heats.rows[0][1:]] == pytest.approx([0.01 * rated, 0.25 * rated, rated], rel=1e-3)
    assert heats.rows[0][0] == "motor in shaft_1"
    assert not any(table.title.startswith("Heats") for table in understood(fzg))


def test_the_reference_cycle_moves_them(machine: Gearbox) -> None:
    """Half of the range of a flow, and 20 K of a temperature, which losses were not trained to hundreds of."""
    inputs, plain = reference_cycle(machine).inputs, reference_cycle(load_gearbox("fzg")).inputs
    assert inputs["coolant_flow"].max() == 10.0 and inputs["coolant_flow"].min() == 0.0
    assert (inputs["T_coolant"].min(), inputs["T_coolant"].max()) == (50.0, 70.0)
    assert all(np.array_equal(inputs[name], course) for name, course in plain.items())


def test_typical_sizes_count_them(machine: Gearbox, fzg: Gearbox) -> None:
    """The flange's 12 and the bed's 2 W/K lead outward; the jacket's 7.5 W/K per l/min where its flow is known."""
    of = Scale.of(machine).conductance - Scale.of(fzg).conductance
    assert of == pytest.approx(14.0)
    assert Scale.of(machine, inputs={"coolant_flow": 2.0}).conductance - Scale.of(fzg).conductance == pytest.approx(
        29.0
    )


def test_several_stages_have_surroundings_too() -> None:
    """Heat in the second mesh warms the oil, whose cooler takes it; numbered names are the model's."""
    text = read_text(packaged("gearboxes", "two_stage"))
    tables = """
[[boundary]]
name = "coolant"
input = "T_coolant"
temperature_degC = 30.0

[[link]]
between = ["oil", "coolant"]
conductance_W_K = 50.0

[[heat]]
name = "brake"
part = "mesh_2"
heat_W = "100.0 + 0.0 * T_mesh_1"
"""
    two = read_gearbox(text + tables, file="two.toml")
    assert two.network().node_names[2] == "coolant" and two.network().sources[-1].node == "mesh_2"
    result = two.simulate({"time_s": [0.0, 1e6, 1e6 + 100.0], "speed_rpm": [0.0] * 3, "torque_Nm": [0.0] * 3})
    assert sum(heat[2] - heat[1] for heat in result.heat_to.values()) == pytest.approx(100.0 * 100.0, rel=1e-3)
    for old, new in (('"brake"', '"churning_2"'), ('name = "coolant"', 'name = "mesh_2"')):
        with pytest.raises(InputError, match="is a loss of the gearbox|'mesh_2' is given 2 times"):
            read_gearbox(text + tables.replace(old, new, 1), file="two.toml")


def test_a_plant_of_the_geometry_alone_refuses_them(machine: Gearbox) -> None:
    with pytest.raises(
        InputError, match=r"has \[\[input\]\], \[\[boundary\]\], \[\[part\]\], \[\[link\]\], \[\[heat\]\]; plants"
    ):
        Plant(machine)
