"""The plant: heat balance, integrator, distance from the model, effects, instruments, independence of the diagnosis."""

from __future__ import annotations

import ast
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

import diagnosis.proof
from diagnosis.proof.cases.conceal import EFFECTS, OUTSIDE, PHYSICS, draw_case
from diagnosis.proof.cases.concealed_case import FAULTS, Plan
from diagnosis.proof.plant import plant_run
from diagnosis.proof.plant.cycles import ROW_S, Programme, reference_torque, top_speed
from diagnosis.proof.plant.effect import Concealed
from diagnosis.proof.plant.instruments import lagged, record
from diagnosis.proof.plant.integrator import sdirk_step
from diagnosis.proof.plant.plant import Plant
from diagnosis.proof.plant.plant_run import Individual, PlantOutcome, PlantRun, run_plant
from models.assembly.gearbox import Gearbox
from models.base.types import Array

PROOF = Path(diagnosis.proof.__path__[0])
PLANT_MODULES = sorted((*(PROOF / "plant").glob("*.py"), *(PROOF / "cases").glob("*.py")))
NOT_MECHANICAL = ("heater_thermostat", "solar_soak", "limit_cycle_pump", "phase_change", "drying")
PURE_SOURCES = [n for n in (*PHYSICS, *OUTSIDE) if EFFECTS[n].kind == "source" and n not in ("oil_jet", "oil_added")]
ACT_ON_COLD = ("heater_thermostat", "grease_plug", "sludge_threshold", "phase_change", "drying")


@pytest.fixture(scope="module")
def plant(fzg: Gearbox) -> Plant:
    return Plant(fzg)


@pytest.fixture(scope="module")
def programme(fzg: Gearbox) -> Programme:
    """Two hours with standstill, creep, every torque, both ends of the speed and a stair that resonates."""
    n, M = top_speed(fzg), reference_torque(fzg)
    holds = [(0.0, 0.0, 30), (0.15, 1.2, 60), (0.95, 0.4, 150), (0.05, 1.6, 60), (0.6, 1.4, 120), (0.415, 0.3, 60),
             (0.75, 0.6, 100), (0.0, 0.0, 90), (0.25, 1.0, 50)]  # fmt: skip
    speed = np.concatenate([np.full(rows, level * n) for level, _, rows in holds])
    torque = np.concatenate([np.full(rows, load * M) for _, load, rows in holds])
    air = {"T_ambient": np.full(len(speed), 25.0), "air_speed": np.full(len(speed), 2.0)}
    return Programme(name="train_1", inputs={"speed": speed, "torque": torque, **air})


def run_of(programme: Programme, *effects: Concealed, start: float = 60.0, **random_heat: Array) -> PlantRun:
    driven = replace(programme, random_heat=random_heat, start=defaultdict(lambda: start))
    return PlantRun(individual=Individual(factors={}, reading=0), programme=driven, effects=effects)


def specimen(plant: Plant, name: str, **changed: float) -> Concealed:
    rng = np.random.default_rng(1)
    effect = EFFECTS[name]
    places = effect.places(plant, rng)
    return Concealed(effect=effect, places=places, parameters={**effect.draw(plant, rng, 1.0), **changed}, strength=1.0)


@pytest.fixture(scope="module")
def with_effects(plant: Plant, programme: Programme) -> dict[str, tuple[PlantOutcome, PlantOutcome]]:
    """Outcomes with and without every physical effect, from a warm or a cold start, all in one batch."""
    changed: dict[str, dict[str, float]] = {"resonance_loss": {"x": 0.6}, "stick_slip": {"x": 0.12}}
    starts = {name: 25.0 if name in ACT_ON_COLD else 70.0 for name in (*PHYSICS, *OUTSIDE)}
    runs = [run_of(programme, specimen(plant, n, **changed.get(n, {})), start=T) for n, T in starts.items()]
    *outcomes, cold, warm = run_plant(plant, [*runs, run_of(programme, start=25.0), run_of(programme, start=70.0)])
    return {
        name: (outcome, {25.0: cold, 70.0: warm}[T])
        for (name, T), outcome in zip(starts.items(), outcomes, strict=True)
    }


def test_integrator_is_of_second_order_and_keeps_the_heat() -> None:
    C = np.array([[2000.0, 300.0, 1.0]])
    G = np.array([[0.0, 20.0, 5.0], [20.0, 0.0, 10.0], [5.0, 10.0, 0.0]])
    K = (np.diag(G.sum(axis=1) + np.array([7.0, 0.0, 0.0])) - G)[None]
    heat = np.array([[0.0, 50.0, 100.0]])
    start = np.full((1, 3), 20.0)
    settled = np.linalg.solve(K[0], heat[0])
    exact = settled + expm(-K[0] / C[0][:, None] * 40.0) @ (start[0] - settled)
    errors = []
    for steps in (4, 8):
        T = start
        for _ in range(steps):
            T, _mean = sdirk_step(T=T, capacity=C, K=K, heat=heat, dt=40.0 / steps)
        errors.append(np.abs(T[0] - exact).max())
    assert errors[0] < 0.1
    assert errors[0] / errors[1] > 3.0  # 4 for second order
    new, mean = sdirk_step(T=start, capacity=C, K=K, heat=heat, dt=10.0)
    np.testing.assert_allclose(C * (new - start), 10.0 * (heat - np.einsum("bij,bj->bi", K, mean)), rtol=1e-9)


def test_heat_balance_closes(plant: Plant, programme: Programme, monkeypatch: pytest.MonkeyPatch) -> None:
    names = ("cooler_thermostat", "oil_added", "shaft_ends_to_air", "run_in_flanks", "phase_change")
    stored, given, shed = np.zeros((3, len(names)))
    boundary = list(plant.anatomy.boundary)
    own = np.setdiff1d(np.arange(len(plant.anatomy.nodes)), boundary)

    def step(*, T: Array, capacity: Array, K: Array, heat: Array, dt: float) -> tuple[Array, Array]:
        new, mean = sdirk_step(T=T, capacity=capacity, K=K, heat=heat, dt=dt)
        stored[:] += (capacity * (new - T))[:, own].sum(axis=1)
        given[:] += dt * heat.sum(axis=1)
        shed[:] += dt * (K.sum(axis=2) * mean).sum(axis=1)
        for node in boundary:
            shed[:] -= dt * (K[:, own, node] * (mean[:, own] - mean[:, [node]])).sum(axis=1)
        return new, mean

    monkeypatch.setattr(plant_run, "sdirk_step", step)
    heat = 5.0 * np.sin(np.arange(len(programme)))
    run_plant(plant, [run_of(programme, specimen(plant, name), oil=heat) for name in names])
    assert np.all(given > 1e6)
    assert np.all(np.abs(stored - given + shed) < 1e-6 * given)


def test_plant_is_near_the_model_and_is_not_the_model(plant: Plant, fzg: Gearbox, programme: Programme) -> None:
    (outcome,) = run_plant(plant, [run_of(programme, start=25.0)])
    rows = len(programme)
    inputs = programme.inputs
    columns = {"time_s": np.arange(rows) * ROW_S, "speed_rpm": inputs["speed"], "torque_Nm": inputs["torque"],
               "T_ambient_degC": np.full(rows, 25.0), "air_speed_m_s": np.full(rows, 2.0)}  # fmt: skip
    result = fzg.network().simulate(columns, losses=fzg.losses(), initial=25.0)
    for place in ("oil", "housing_lower", "housing_upper", "bearing_1", "bearing_3", "pinion"):
        difference = outcome.T[:, plant.anatomy.coarse.index(place)] - result.temperatures[place]
        assert 0.05 < np.abs(difference).max() < 4.0, place
        assert np.sqrt(np.mean(difference**2)) < 1.0, place
    assert outcome.P_loss.mean() == pytest.approx(result.loss.mean(), rel=0.03)


@pytest.mark.parametrize("name", [*PHYSICS, *OUTSIDE])
def test_every_effect_acts_at_its_place(
    name: str, plant: Plant, with_effects: dict[str, tuple[PlantOutcome, PlantOutcome]]
) -> None:
    outcome, without = with_effects[name]
    assert np.isfinite(outcome.T).all()
    assert np.abs(outcome.T - without.T).max() > 0.02
    if EFFECTS[name].before is None:
        assert max(np.abs(watts).max() for watts in outcome.heat[0].values()) > 0.5
        assert specimen(plant, name).places[0] in outcome.heat[0]


@pytest.mark.parametrize("name", PURE_SOURCES)
def test_measured_loss_contains_mechanical_heat_only(
    name: str, with_effects: dict[str, tuple[PlantOutcome, PlantOutcome]]
) -> None:
    outcome, _ = with_effects[name]
    heat = sum(outcome.heat[0].values())
    assert np.abs(heat).max() > 0.1
    beyond = outcome.P_loss - sum(outcome.losses.values())
    np.testing.assert_allclose(beyond, 0.0 if name in NOT_MECHANICAL else heat, atol=1e-9)


@pytest.mark.parametrize("name", FAULTS)
def test_every_fault_changes_its_columns_and_no_others(name: str, plant: Plant, programme: Programme) -> None:
    case = draw_case(plant, Plan(group="sensor", effects=(name,), strength=1.0), seed=(2, 1), name="case")
    run = run_of(programme, start=25.0)
    (outcome,) = run_plant(plant, [run])
    sound, faulty = (record(plant, run, outcome, case.instruments, faults, None) for faults in ((), case.faults))
    changed = {column for column in sound if not np.array_equal(sound[column], faulty[column])}
    places = case.effects[0].places
    inputs = {"torque": "torque_Nm", "speed": "speed_rpm", "T_ambient": "T_ambient_degC"}
    if places == ("clock",):
        places = case.instruments.channels
    assert changed == {inputs.get(place, f"T_{place}_degC") for place in places}


def test_noise_resolution_and_lag_of_instruments(plant: Plant, programme: Programme) -> None:
    case = draw_case(plant, Plan(group="control", kind="clean"), seed=(2, 2), name="case")
    run = run_of(programme, start=25.0)
    (outcome,) = run_plant(plant, [run])
    exact = record(plant, run, outcome, case.instruments, (), None)
    noisy = record(plant, run, outcome, case.instruments, (), np.random.default_rng(0))
    error = noisy["T_oil_degC"] - exact["T_oil_degC"]
    assert np.std(error) == pytest.approx(np.hypot(0.2, 0.1 / np.sqrt(12.0)), rel=0.1)
    np.testing.assert_allclose(noisy["T_oil_degC"] * 10.0, np.round(noisy["T_oil_degC"] * 10.0), atol=1e-9)
    step = lagged(np.concatenate([np.zeros(5), np.ones(200)]), 60.0)
    assert step[4] == 0.0 and step[10] == pytest.approx(1.0 - np.exp(-1.0), abs=1e-9)  # after 6 rows of 10 s


@pytest.mark.parametrize("module", PLANT_MODULES, ids=lambda p: p.name)
def test_plant_imports_neither_catalogue_nor_diagnosis_nor_scoring(module: Path) -> None:
    tree = ast.parse(module.read_text(encoding="utf-8"))
    imported = {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    imported |= {name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names}
    for name in imported:
        assert not name.startswith("models.mechanisms"), name
        assert not name.startswith("diagnosis.proof.scoring"), name
        assert not name.startswith("diagnosis") or name.startswith("diagnosis.proof"), name
