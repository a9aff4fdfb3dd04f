"""A gearbox of two stages: what each stage does is what it does alone, and the chain of shafts is checked."""

from __future__ import annotations

import re

import numpy as np
import pytest
import sympy as sp

from builder.surrogate.networks import PRESETS, network_specs
from models.assembly.gearbox import load_gearbox, read_gearbox
from models.base.errors import InputError
from models.files.toml_file import packaged, read_text
from models.mechanisms.places import placements
from models.simulation.thermal_network import Link, ThermalNetwork

TEXT = read_text(packaged("gearboxes", "two_stage"))
TWO = load_gearbox("two_stage")
RATIO = 24 / 85, 24 / 94


def alone(stage: int) -> str:
    """The file with one stage of the two, its shafts, bearings and a seal."""
    blocks = re.split(r"\n(?=\[)", TEXT)
    shafts = (("input", "middle"), ("middle", "output"))[stage]
    kept, number = [], -1
    for block in blocks:
        number += block.startswith("[[stage]]")
        if block.startswith(("[[stage]]", "[stage.")) and number != stage:
            continue
        if block.startswith("[[shaft]]") and re.search(r'name = "(\w+)"', block)[1] not in shafts:
            continue
        if block.startswith(("[[bearing]]", "[[seal]]")) and re.search(r'shaft = "(\w+)"', block)[1] not in shafts:
            continue
        kept.append(block)
    return "\n".join(kept)


def message_about(*changes: tuple[str, str]) -> str:
    text = TEXT
    for old, new in changes:
        assert old in text, f"the file has no {old!r}"
        text = text.replace(old, new, 1)
    with pytest.raises(InputError) as caught:
        read_gearbox(text, file="two.toml")
    return str(caught.value)


def test_speed_falls_and_torque_rises_from_stage_to_stage() -> None:
    assert TWO.speed_ratio == {"input": 1.0, "middle": pytest.approx(RATIO[0]), "output": pytest.approx(np.prod(RATIO))}
    assert TWO.geometry.torque_ratio["output"] == pytest.approx(85 / 24 * 94 / 24)
    for shaft in TWO.speed_ratio:  # power is the same at every shaft
        assert TWO.speed_ratio[shaft] * TWO.geometry.torque_ratio[shaft] == pytest.approx(1.0)


@pytest.mark.parametrize("stage", [0, 1])
@pytest.mark.parametrize("torque", [0.0, 0.3, 40.0, -150.0])
def test_mesh_and_churning_are_those_of_the_stage_alone(stage: int, torque: float) -> None:
    single = read_gearbox(alone(stage), file="alone.toml")
    speed = np.array([0.2, 30.0, 700.0, 1500.0])
    shaft = TWO.stage[stage].driver
    both = TWO.losses_at(speed=speed, torque=torque, temperatures=55.0)
    here = {"speed": speed * TWO.speed_ratio[shaft], "torque": torque * TWO.geometry.torque_ratio[shaft]}
    own = single.losses_at(temperatures=55.0, **here)
    # Below 1 1/min and 1 N m of the input shaft, whichever it is, losses go to zero in their own way.
    above = (np.abs(here["speed"]) >= 1.0) & (abs(torque) >= 1.0)
    for name in ("mesh_sliding", "mesh_rolling", "churning"):
        np.testing.assert_allclose(both[f"{name}_{stage + 1}"][above], own[name][above], rtol=1e-12)
    assert above.sum() == (3 if abs(torque) >= 1.0 else 0)


def test_sliding_is_linear_in_the_torque_below_1_Nm_of_the_input_shaft() -> None:
    half, whole = (TWO.losses_at(speed=900.0, torque=torque, temperatures=60.0) for torque in (0.5, 1.0))
    for stage in (1, 2):
        assert half[f"mesh_sliding_{stage}"] == pytest.approx(0.5 * whole[f"mesh_sliding_{stage}"], rel=1e-12)


def test_the_second_mesh_warms_its_own_gears() -> None:
    network = TWO.network()
    at = {source.name: source.node for source in network.sources}
    assert (at["mesh_sliding_1"], at["mesh_rolling_2"], at["churning_2"]) == ("mesh_1", "mesh_2", "oil")
    linked = {frozenset(link.nodes) for link in network.links}
    assert {frozenset(pair) for pair in (("mesh_2", "pinion_2"), ("mesh_2", "wheel_2"), ("pinion_2", "middle"),
                                         ("wheel_1", "middle"), ("wheel_2", "output"))} <= linked  # fmt: skip
    assert frozenset(("mesh_1", "pinion_2")) not in linked
    assert network.groups["gears"] == ("pinion_1", "wheel_1", "pinion_2", "wheel_2")
    assert network.groups["mesh"] == ("mesh_1", "mesh_2")


def test_what_is_lost_leaves_through_air_and_frame() -> None:
    steady = TWO.steady_state(speed=1450.0, torque=140.0)
    out = 0.0
    network = TWO.network()
    values = {f"T_{name}": T for name, T in steady.temperatures.items()} | {"air_speed": 1.5, "speed": 1450.0}
    for link in network.links:
        outside = [name for name in link.nodes if name in ("air", "frame")]
        if outside:
            inside = next(name for name in link.nodes if name not in outside)
            numbers = {s: values.get(s.name, 20.0) for s in link.conductance.free_symbols}
            numbers |= {s: p.start for p in network.parameters for s in link.conductance.free_symbols
                        if s.name == p.name}  # fmt: skip
            out += float(link.conductance.xreplace(numbers)) * (steady.temperatures[inside] - 20.0)
    total = sum(steady.losses.values())
    assert out == pytest.approx(total, rel=1e-4)
    assert steady.efficiency == pytest.approx(1.0 - total / (1450.0 * np.pi / 30.0 * 140.0))
    assert 0.95 < steady.efficiency < 0.98  # two helical stages in taper bearings


def test_a_higher_axis_dips_less_and_its_bearings_stand_drier() -> None:
    shafts = [dict(shaft) for shaft in TWO.values["shaft"]]
    lifted = TWO.with_values({"shaft": tuple(s | ({"axis_height_mm": 40.0} if s["name"] == "output" else {})
                                             for s in shafts)})  # fmt: skip
    low, high = (gearbox.losses_at(speed=1500.0, torque=100.0, temperatures=60.0) for gearbox in (TWO, lifted))
    assert high["churning_2"] < 0.7 * low["churning_2"]
    assert high["churning_1"] == low["churning_1"]
    flooded = {"oil.level_below_axis_mm": 0.0}
    low, high = (gearbox.with_values(flooded).losses_at(speed=1500.0, torque=100.0, temperatures=60.0)
                 for gearbox in (TWO, lifted))  # fmt: skip
    assert high["output_far_side"] < low["output_far_side"]


def test_every_mesh_has_its_own_network_and_seals_and_churning_share_one() -> None:
    specs = {spec.name: spec for spec in network_specs(TWO.losses(), TWO.training)}
    assert specs["mesh"].outputs == ("mesh_sliding_1_W", "mesh_rolling_1_W")
    assert specs["mesh_2"].outputs == ("mesh_sliding_2_W", "mesh_rolling_2_W")
    assert specs["mesh_2"].roles == ("mesh_sliding", "mesh_rolling")
    assert set(specs["mesh_2"].roles) <= PRESETS["default"].hidden.keys()
    assert specs["mesh_2"].upper[:2] == (pytest.approx(1800.0 * RATIO[0]), pytest.approx(220.0 / RATIO[0]))
    assert specs["no_load"].outputs == ("churning_1_W", "churning_2_W", "input_seal_W", "output_seal_W")
    rows = np.random.default_rng(1).uniform(specs["mesh_2"].lower, specs["mesh_2"].upper, (20, 4))
    model = TWO.losses()
    for row, found in zip(rows, specs["mesh_2"].losses(rows), strict=True):
        T = {"pinion_2": row[2], "wheel_2": row[3]}
        nodes = [T.get(node, 60.0) for node in model.temperature_nodes]
        whole = model.power(row[0] / RATIO[0], row[1] * RATIO[0], np.array(nodes))
        expected = [whole[model.components.index(name)] for name in ("mesh_sliding_2", "mesh_rolling_2")]
        assert found.tolist() == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ((('driver = "middle"', 'driver = "input"'),),
         "stage #2.driver: is 'input', but the stage before drives 'middle'"),
        ((('driven = "output"', 'driven = "input"'),), "stage #2.driven: 'input' is driven or drives already"),
        ((('names = ["pinion_2"', 'names = ["pinion_1"'),), "name 'pinion_1' is given 2 times"),
        ((('names = ["pinion_2"', 'names = ["mesh_2"'),), "name 'mesh_2' is taken by the model itself"),
        ((('name = "input_seal"', 'name = "churning_1"'),), "name 'churning_1' is taken by the model itself"),
        ((("position_mm = 190.0\nlocating", "position_mm = 0.0\nlocating"),),
         "bearing: those on 'input' need position_mm at two different places"),
        ((("position_mm = [130.0, 130.0]\n", ""),),
         "stage #2.position_mm is missing; the bearings of 'output' have position_mm"),
        ((("position_mm = 0.0\n", "position_mm = 0.0\nload_share = 0.5\n"),),
         "needs either load_share or position_mm, and not both"),
        ((("position_mm = 0.0\n", ""),), "needs either load_share or position_mm, and not both"),
        ((("position_mm = [60.0, 60.0]", "position_mm = [60.0, 60.0]\nangle_deg = 90.0"),),
         "stage #1.angle_deg: there is no stage before it"),
        ((('name = "middle"\n', 'name = "middle"\naxis_height_mm = 150.0\n'),),
         "stage #1: axis_height_mm of its shafts differ by 150, more than its center_distance_mm of 112"),
        ((('name = "input"\n', 'name = "input"\naxis_height_mm = 10.0\n'),),
         "shaft 'input'.axis_height_mm: heights are those above this shaft"),
        ((("height_m = 0.36", "height_m = 0.25"),), "less than the tip diameter of the largest gear, 0.2923 m"),
        ((('position_mm = 190.0\nlocating', 'position_mm = 1900.0\nlocating'),),
         "bearing: position_mm of those on 'input' lie 1900 mm apart, and the shaft's length_mm is 300"),
        ((("position_mm = [130.0, 130.0]", "position_mm = [100.0, 130.0]"),),
         "stage #2.position_mm: 'pinion_2' is 40 mm from 'wheel_1' on 'middle'; with their face widths they need 62.5"),
        ((("position_mm = 190.0\nlocating = true", "position_mm = 190.0"),),
         "bearing: none of those on 'input' is locating"),
    ],
)  # fmt: skip
def test_a_fault_of_the_chain_is_named(changes: tuple[tuple[str, str], ...], words: str) -> None:
    assert words in message_about(*changes)


def test_a_fault_of_the_losses_may_be_in_one_stage_or_in_both() -> None:
    network = TWO.network()
    found = {one.name: one.target for one in placements(network, "loss_factor", "mesh_sliding", ())}
    both = ("mesh_sliding_1", "mesh_sliding_2")
    assert found == {"mesh_sliding": both, "mesh_sliding_1": both[:1], "mesh_sliding_2": both[1:]}
    # What changes with links is one place: which gears are whose stage's the name of a loss does not say.
    (leak,) = placements(network, "loss_factor", "churning+oil-gears", ())
    assert leak.target[:2] == ("churning_1", "churning_2") and len(leak.target) == 6
    assert [one.name for one in placements(network, "source", "mesh", ())] == ["mesh"]
    (every,) = placements(network, "loss_factor", "losses", ())
    assert len(every.target) == 14


@pytest.mark.parametrize("stage", [0, 1])
def test_heat_paths_of_gears_and_mesh_are_those_of_the_stage_alone(stage: int) -> None:
    """At the speed and torque of the stage's own shaft: striction in the contact, and what oil takes from the gears."""
    single = read_gearbox(alone(stage), file="alone.toml")
    shaft = TWO.stage[stage].driver
    here = {"speed": 700.0 * TWO.speed_ratio[shaft], "torque": 90.0 * TWO.geometry.torque_ratio[shaft]}
    both, own = (
        {link.name: float(link.conductance.xreplace(numbers_at(link, network, at))) for link in network.links}
        for network, at in ((TWO.network(), {"speed": 700.0, "torque": 90.0}), (single.network(), here))
    )
    for gear in TWO.stage[stage].names:
        assert both[f"mesh_{stage + 1}-{gear}"] == pytest.approx(own[f"mesh-{gear}"], rel=1e-12)
        assert both[f"{gear}-oil"] == pytest.approx(own[f"{gear}-oil"], rel=1e-12)


def numbers_at(link: Link, network: ThermalNetwork, at: dict[str, float]) -> dict[sp.Symbol, sp.Float]:
    """Symbols of a conductance by their numbers: inputs as given, parameters as they start, all parts at 55 degC."""
    known = at | {p.name: p.start for p in network.parameters}
    return {s: sp.Float(known.get(s.name, 55.0)) for s in link.conductance.free_symbols}
