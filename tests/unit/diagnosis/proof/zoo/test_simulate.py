"""Runs of zoo plants close their heat balance, and their derivatives are those of the runs."""

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.proof.plant.cycles import Programme
from diagnosis.proof.plant.integrator import sdirk_step
from diagnosis.proof.zoo import run
from diagnosis.proof.zoo.families import FAMILIES
from diagnosis.proof.zoo.programmes import programmes
from diagnosis.proof.zoo.run import follow
from diagnosis.proof.zoo.simulate import (
    LinearRun,
    ParameterDirection,
    StartDirection,
    simulate,
)
from diagnosis.proof.zoo.structure import Body, Boundary, HeatPath, Probe, Source, Variant, ZooChange, ZooPlant
from models.assembly.gearbox import load_gearbox

ROWS = 240


def ones(m):
    return np.ones_like(m.hours)


def block(*, row_s=10.0, G=2.0):
    """One body of 1000 J/K, 2 W/K to air, 20 W."""
    return ZooPlant(
        family="test", gearbox="none", inputs=("T_ambient",),
        bodies=(Body(name="block", capacity=lambda m: 1000.0 * ones(m), part_of="block"),),
        boundaries=(Boundary(name="air", temperature=lambda m: m.inputs["T_ambient"], part_of="air"),),
        paths=(HeatPath(name="block-air", ends=("block", "air"), conductance=lambda m: m.p["G"], part_of="block-air"),),
        sources=(Source(name="heat", power=lambda m: 20.0 * ones(m), spread={"block": 1.0}, is_loss=True, part_of=""),),
        probes=(Probe(channel="block", mix={"block": 1.0}, lag_s=0.0),),
        parameters={"G": G}, spread={"G": 0.1}, loss_W=20.0, row_s=row_s,
    )  # fmt: skip


def held(rows, start=20.0):
    return Programme(
        name="train_1", inputs={"T_ambient": np.full(rows, 20.0)}, random_heat={}, start={"block": start}
    )  # fmt: skip


@pytest.fixture(scope="module")
def gearbox():
    """A plant of the family with the most laws of temperature, and a short warm recording of it."""
    rng = np.random.default_rng(3)
    plant = FAMILIES["splash"].draw(load_gearbox("fzg"), rng)
    whole = programmes(plant, rng)[1]
    inputs = {name: values[:ROWS] for name, values in whole.inputs.items()}
    heat = {name: values[:ROWS] for name, values in whole.random_heat.items()}
    start = {name: 40.0 + 2.0 * k for k, name in enumerate(whole.start)}
    return plant, replace(whole, inputs=inputs, random_heat=heat, start=start, unrecorded=60)


@pytest.mark.parametrize("row_s", [10.0, 600.0])
def test_a_block_warms_as_the_exponential_says(row_s):
    rows = round(4000.0 / row_s) + 1
    outcome = simulate(block(row_s=row_s), held(rows), [Variant(), Variant(parameters={"G": 4.0})])
    t = row_s * np.arange(rows)
    for k, G in enumerate((2.0, 4.0)):
        exact = 20.0 + 20.0 / G * (1.0 - np.exp(-G * t / 1000.0))
        assert np.abs(outcome.T["block"][k] - exact).max() < (2e-4 if row_s < 60.0 else 0.2)
    assert np.all(outcome.P_loss == 20.0)


def test_heat_of_changes_adds_up_to_what_they_warm():
    """A second source, a bridge and a further capacity: what they gave is what the block stored and lost more."""
    changes = (
        ZooChange(kind="source", target="heat", law=lambda m: 0.5 * (m.hours > 0.1)),
        ZooChange(kind="bridge", target="block", other="air", law=lambda m: 0.7 * ones(m)),
        ZooChange(kind="capacity", target="block", law=lambda m: 0.2 * ones(m)),
    )
    plant, rows = block(), 401
    changed = simulate(plant, held(rows), [Variant(changes=changes)])
    rise = changed.T["block"][0] - 20.0
    made = [changed.heat[0][i][:-1].sum() * plant.row_s for i in range(3)]
    lost = 2.0 * (0.5 * (rise[1:] + rise[:-1])).sum() * plant.row_s
    given = 20.0 * (rows - 1) * plant.row_s + made[0] - made[1] + made[2]
    assert given == pytest.approx(1000.0 * rise[-1] + lost, rel=2e-5)


def test_a_lag_follows_a_ramp_by_its_time_constant():
    ramp = 0.1 * 10.0 * np.arange(200.0)[None, :]
    assert follow(ramp, 20.0, 10.0)[0, -1] == pytest.approx(ramp[0, -1] - 0.1 * 20.0, abs=1e-3)


def test_heat_balance_closes(gearbox, monkeypatch):
    plant, programme = gearbox
    changes = (
        ZooChange(kind="bridge", target="pinion.rim", other="air", law=lambda m: 3.0 * ones(m)),
        ZooChange(kind="heat", target="oil.sump", law=lambda m: 30.0 * (m.hours > 0.1), other="wheel.rim"),
        ZooChange(kind="capacity", target="oil.sump", law=lambda m: 0.3 * ones(m)),
        ZooChange(kind="input", target="T_ambient", law=lambda m: 5.0 * m.hours),
    )
    stored, given, shed = np.zeros((3, 3))

    def step(*, T, capacity, K, heat, dt):
        new, mean = sdirk_step(T=T, capacity=capacity, K=K, heat=heat, dt=dt)
        stored[:] += (capacity * (new - T)).sum(axis=1)
        given[:] += dt * heat.sum(axis=1)
        shed[:] += dt * (K.sum(axis=2) * mean).sum(axis=1)
        return new, mean

    monkeypatch.setattr(run, "sdirk_step", step)
    run.integrate(plant, programme, [Variant(), Variant(changes=changes), Variant(quiet=True)])
    assert np.all(given > 1e5)
    assert np.abs(stored - given + shed).max() < 1e-9 * given.max()


def test_a_variant_does_not_feel_the_others(gearbox):
    plant, programme = gearbox
    hot = Variant(changes=(ZooChange(kind="heat", target="oil.sump", law=lambda m: 100.0 * ones(m)),))
    together = simulate(plant, programme, [Variant(), hot])
    alone = simulate(plant, programme, [Variant()])
    assert np.abs(together.readings["oil"][0] - alone.readings["oil"][0]).max() < 1e-9
    assert (together.readings["oil"][1] - alone.readings["oil"][0])[-1] > 1.0


def test_tangents_are_differences_of_runs(gearbox):
    plant, programme = gearbox
    box_to_air = next(path.name for path in plant.paths if path.part_of == "housing_upper-air")
    changes = (
        ZooChange(kind="path", target=box_to_air, law=ones),
        ZooChange(kind="source", target="churning", law=lambda m: m.T["oil.sump"] / 60.0, is_loss=True),
        ZooChange(kind="capacity", target="oil.sump", law=ones),
        ZooChange(
            kind="heat", target="wheel.rim", law=lambda m: m.inputs["speed"] / 100.0, other="oil.sump", is_loss=True
        ),
        ZooChange(kind="input", target="torque", law=lambda m: 1.0 + m.hours),
        ZooChange(kind="input", target="T_ambient", law=lambda m: 1.0 * (m.hours > 0.2)),
    )
    names = ("C oil.sump", "air", "P churning", "G mesh", "splash exponent")
    step = 1e-3

    def moved(sign):
        runs = [Variant(changes=(replace(c, law=lambda m, law=c.law: sign * step * law(m)),)) for c in changes]
        return runs + [Variant(parameters={n: plant.parameters[n] * (1.0 + sign * step)}) for n in names]

    there, back = (simulate(plant, programme, moved(sign)) for sign in (1.0, -1.0))
    directions = [*changes, *(ParameterDirection(name=n, step=plant.parameters[n]) for n in names)]
    readings, loss = LinearRun(plant, programme).respond(directions)
    pairs = [(found, there.readings[c], back.readings[c]) for c, found in readings.items()]
    pairs += [(loss, there.P_loss, back.P_loss)]
    for tangent, up, down in pairs:
        difference = (up - down) / (2.0 * step)
        largest = np.abs(difference).max(axis=1)
        assert np.all(np.abs(tangent - difference).max(axis=1) < 2e-4 * largest + 1e-6)


def test_a_start_direction_is_a_difference_of_runs(gearbox):
    plant, programme = gearbox
    warmer = replace(programme, start=programme.start | {"oil.sump": programme.start["oil.sump"] + 1e-3})
    difference = (
        simulate(plant, warmer, [Variant()]).readings["oil"] - simulate(plant, programme, [Variant()]).readings["oil"]
    )
    found = LinearRun(plant, programme).respond([StartDirection(start={"oil.sump": 1.0})])[0]["oil"]
    assert np.abs(found - difference / 1e-3).max() < 1e-4 * np.abs(found).max()
