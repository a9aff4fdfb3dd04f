"""Plants of the zoo are whole, differ in structure, and are plausible specimens of their definition."""

import tomllib

import numpy as np
import pytest

from diagnosis.proof.plant.cycles import Programme
from diagnosis.proof.zoo import distance
from diagnosis.proof.zoo.families import FAMILIES
from diagnosis.proof.zoo.programmes import programmes
from diagnosis.proof.zoo.simulate import simulate
from diagnosis.proof.zoo.structure import Moment, Variant
from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError
from models.files.toml_file import packaged

DRAWN_FOR = [(name, machine) for name, family in FAMILIES.items() for machine in family.machines]
GEARBOXES = [(name, machine) for name, machine in DRAWN_FOR if machine in ("fzg", "conveyor")]
STANDING_S = 12.0 * 3600.0


def drawn(name, machine, seed=1):
    return FAMILIES[name].draw(load_gearbox(machine), np.random.default_rng(seed))


@pytest.mark.parametrize(("name", "machine"), DRAWN_FOR)
def test_a_plant_is_whole(name, machine):
    """Shares sum to 1, ends exist, bodies are tied to surroundings, and all names lead to nominal ones."""
    gearbox = load_gearbox(machine)
    network = gearbox.network()
    nodes, links = {node.name for node in network.nodes}, {link.name for link in network.links}
    for seed in range(4):
        plant = drawn(name, machine, seed)
        bodies = {body.name for body in plant.bodies}
        ends = bodies | {boundary.name for boundary in plant.boundaries}
        assert len(bodies) == len(plant.bodies)
        assert len({path.name for path in plant.paths}) == len(plant.paths)
        for spread in [source.spread for source in plant.sources] + [probe.mix for probe in plant.probes]:
            assert sum(spread.values()) == pytest.approx(1.0)
            assert set(spread) <= ends
        tied = {boundary.name for boundary in plant.boundaries}
        for _ in plant.bodies:
            tied |= {end for path in plant.paths if tied & set(path.ends) for end in path.ends}
        assert tied == ends
        assert all(set(body.part_of.split("+")) <= nodes for body in plant.bodies)
        assert all(set(path.part_of.split("+")) <= links | nodes | {""} for path in plant.paths)
        made = {name for source in plant.sources for name in source.part_of.split("+")}
        assert made == {source.name for source in network.sources}
        assert {probe.channel for probe in plant.probes} <= nodes
        assert set(plant.spread) <= set(plant.parameters)
        assert plant.inputs == tuple(network.inputs)


@pytest.mark.parametrize(("name", "machine"), DRAWN_FOR)
def test_seeds_differ_in_structure(name, machine):
    graphs = {frozenset(path.ends for path in drawn(name, machine, seed).paths) for seed in range(8)}
    assert len(graphs) >= 4


def test_families_differ_in_laws():
    """At the same temperatures and operation no two families lose the same in a mesh, a bearing or the oil."""
    powers = {}
    for name in ("walls", "rings", "splash", "merged", "open"):
        plant = drawn(name, "fzg", 0)
        speeds, ones = np.array([400.0, 2000.0, 5000.0]), np.ones(3)
        loss = {}
        for source in plant.sources:
            if source.part_of in ("mesh_sliding", "bearing_1", "churning"):
                inputs = {"speed": speeds, "torque": 90.0 * ones, "T_ambient": 25.0 * ones, "air_speed": 2.0 * ones}
                T = {part.name: 60.0 * ones for part in (*plant.bodies, *plant.boundaries)}
                p = {key: value * ones for key, value in plant.parameters.items()}
                watts = source.power(Moment(hours=ones, since_start=ones, inputs=inputs, T=T, p=p))
                loss[source.part_of] = tuple(np.round(watts / watts[1], 3))
        powers[name] = loss
    assert len({loss["mesh_sliding"] for loss in powers.values()}) == 5
    assert len({(loss["bearing_1"], loss["churning"]) for loss in powers.values()}) >= 4


@pytest.mark.parametrize(("name", "machine"), GEARBOXES)
def test_oil_of_a_loaded_gearbox_is_plausibly_warm(name, machine):
    """The stair of the middle, held for twelve hours: oil between 30 and 120 degC, warmer than the box in air."""
    plant = drawn(name, machine)
    training, rows = load_gearbox(machine).training, round(STANDING_S / 60.0)
    values = {"speed": 0.33 * training.speed_rpm[1], "torque": 0.27 * training.torque_Nm[1], "T_ambient": 25.0}
    values["air_speed"] = load_gearbox(machine).ambient.air_speed_m_s
    programme = Programme(
        name="train_1", inputs={key: np.full(rows, value) for key, value in values.items()}, random_heat={},
        start={body.name: 25.0 for body in plant.bodies},
    )  # fmt: skip
    slow = type(plant)(**{key: getattr(plant, key) for key in plant.__dataclass_fields__} | {"row_s": 60.0})
    readings = simulate(slow, programme, [Variant()]).readings
    oil = readings["oil"][0]
    assert 30.0 < oil[-1] < 120.0
    assert all(25.0 < values[0, -1] < 150.0 for values in readings.values())
    assert np.all(np.diff(oil[:60]) > 0.0)


@pytest.mark.parametrize("machine", ["fzg", "la_haute_borne", "heated_rod"])
def test_programmes_hold_a_session_and_baselines(machine):
    name = "walls" if machine == "fzg" else "streams"
    plant = drawn(name, machine)
    session = programmes(plant, np.random.default_rng(2), baselines=2)
    assert [p.name for p in session] == [
        "train_1",
        "train_2",
        "train_3",
        "hold_1",
        "hold_2",
        "baseline_1",
        "baseline_2",
    ]
    for programme in session:
        assert tuple(programme.inputs) == plant.inputs
        assert set(programme.start) == {body.name for body in plant.bodies}
        assert all(np.isfinite(values).all() for values in programme.inputs.values())
    begins = [p.begins_h for p in session[:5]]
    assert begins == sorted(begins)
    assert begins[0] == 0.0


def test_a_definition_with_two_stages_is_refused():
    gearbox = load_gearbox("fzg")

    class TwoStages:
        file, is_parametric, stage = "two.toml", False, gearbox.stage * 2

    with pytest.raises(InputError, match=r"two.toml: has 2 stages; concealed cases are made of gearboxes of one stage"):
        FAMILIES["walls"].draw(TwoStages(), np.random.default_rng(0))


def test_a_family_refuses_definitions_of_the_other_kind():
    with pytest.raises(InputError, match="heated_rod.toml: has no geometry"):
        drawn("walls", "heated_rod")
    with pytest.raises(InputError, match="fzg.toml: has geometry"):
        drawn("blocks", "fzg")


def test_plants_outside_the_accepted_distances_are_drawn_again(monkeypatch):
    distances = iter([0.1, 5.0, np.inf, 0.6])
    monkeypatch.setattr(distance, "distance_K", lambda plant, session: next(distances))
    found = distance.draw_plant(FAMILIES["merged"], "fzg", 7)
    assert (found.rejected, found.distance_K) == (3, 0.6)
    again = iter([0.6])
    monkeypatch.setattr(distance, "distance_K", lambda plant, session: next(again))
    assert distance.draw_plant(FAMILIES["merged"], "fzg", 7).plant.parameters != found.plant.parameters


@pytest.mark.slow
def test_distance_of_a_gearbox_is_what_lumped_factors_cannot_show():
    plant = drawn("merged", "fzg", 2)
    left = distance.distance_K(plant, programmes(plant, np.random.default_rng(2)))
    assert 0.2 < left < 1.0


def test_definitions_of_the_package_have_a_family():
    names = {machine for family in FAMILIES.values() for machine in family.machines}
    for name in names:
        assert tomllib.loads(packaged("gearboxes", name).read_text())
    assert names == {"fzg", "conveyor", "heated_rod", "la_haute_borne"}
