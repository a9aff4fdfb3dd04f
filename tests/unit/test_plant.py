"""The plant that conceals effects: it keeps its heat balance, is near the model without being it, and effects act."""

from __future__ import annotations

import ast
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

import diagnosis.proof
from diagnosis.proof.conceal import EFFECTS, FAULTS, OUTSIDE, PHYSICS, Plan, draw_case
from diagnosis.proof.cycles import ROW_S, Programme, reference_torque, top_speed
from diagnosis.proof.effect import Concealed
from diagnosis.proof.instruments import lagged, record
from diagnosis.proof.integrator import sdirk_step
from diagnosis.proof.plant import Individual, Outcome, Plant, Run
from models.gearbox import Gearbox, load_gearbox
from models.types import Array

# What scores a diagnosis knows it; what makes the recordings must not.
JUDGES = ("baselines", "outcome", "proof_report", "protocol", "score")  # they compare what the two sides say
PLANT_MODULES = sorted(p for p in Path(diagnosis.proof.__path__[0]).glob("*.py") if p.stem not in JUDGES)
NOT_MECHANICAL = ("heater_thermostat", "solar_soak", "limit_cycle_pump", "phase_change", "drying")
PURE_SOURCES = [n for n in (*PHYSICS, *OUTSIDE) if EFFECTS[n].kind == "source" and n not in ("oil_jet", "oil_added")]
ACT_ON_COLD = ("heater_thermostat", "grease_plug", "sludge_threshold", "phase_change", "drying")
ACTS_W = 0.5  # heat that every effect of usual strength makes at some moment of the programme below


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
    return Programme(name="train_1", speed=speed, torque=torque)


def run_of(programme: Programme, *effects: Concealed, start: float = 60.0, **random_heat: Array) -> Run:
    rows = len(programme)
    individual = Individual(factors={}, reading=0)
    return Run(individual=individual, programme=programme, air=np.full(rows, 25.0), air_speed=np.full(rows, 2.0),
               start=start, random_heat=random_heat, effects=effects)  # fmt: skip


def specimen(plant: Plant, name: str, **changed: float) -> Concealed:
    rng = np.random.default_rng(1)
    effect = EFFECTS[name]
    places = effect.places(plant, rng)
    return Concealed(effect=effect, places=places, parameters={**effect.draw(plant, rng, 1.0), **changed}, strength=1.0)


@pytest.fixture(scope="module")
def with_effects(plant: Plant, programme: Programme) -> Mapping[str, tuple[Outcome, Outcome]]:
    """Outcome of every physical effect beside the one without, from a warm or a cold start, all in one batch."""
    changed: dict[str, dict[str, float]] = {"resonance_loss": {"x": 0.6}, "stick_slip": {"x": 0.12}}
    names = (*PHYSICS, *OUTSIDE)
    starts = {name: 25.0 if name in ACT_ON_COLD else 70.0 for name in names}
    runs = [run_of(programme, specimen(plant, n, **changed.get(n, {})), start=starts[n]) for n in names]
    *outcomes, cold, warm = plant.run([*runs, run_of(programme, start=25.0), run_of(programme, start=70.0)])
    plain = {25.0: cold, 70.0: warm}
    return {name: (outcome, plain[starts[name]]) for name, outcome in zip(names, outcomes, strict=True)}


# ---------------------------------------------------------------------- the plant itself


def test_step_is_second_order_and_settles_fast_nodes() -> None:
    C = np.array([[2000.0, 300.0, 1.0]])
    G = np.array([[0.0, 20.0, 5.0], [20.0, 0.0, 10.0], [5.0, 10.0, 0.0]])
    to_air = np.array([7.0, 0.0, 0.0])
    K = (np.diag(G.sum(axis=1) + to_air) - G)[None]
    heat = np.array([[0.0, 50.0, 100.0]])
    start = np.full((1, 3), 20.0)
    settled = np.linalg.solve(K[0], heat[0])
    exact = settled + expm(-K[0] / C[0][:, None] * 40.0) @ (start[0] - settled)
    errors = []
    for steps in (4, 8):
        T = start
        for _ in range(steps):
            T, mean = sdirk_step(T=T, capacity=C, K=K, heat=heat, dt=40.0 / steps)
        errors.append(np.abs(T[0] - exact).max())
    assert errors[0] < 0.1
    assert errors[0] / errors[1] > 3.0  # 4 for second order
    new, mean = sdirk_step(T=start, capacity=C, K=K, heat=heat, dt=10.0)
    np.testing.assert_allclose(C * (new - start), 10.0 * (heat - np.einsum("bij,bj->bi", K, mean)), rtol=1e-9)


def test_heat_balance_closes(plant: Plant, programme: Programme) -> None:
    heat = 5.0 * np.sin(np.arange(len(programme)))
    names = ("cooler_thermostat", "oil_added", "shaft_ends_to_air", "run_in_flanks", "phase_change")
    runs = [run_of(programme, specimen(plant, name), oil=heat) for name in names]
    for name, outcome in zip(names, plant.run(runs), strict=True):
        assert outcome.given > 1e6, name
        assert outcome.stored == pytest.approx(outcome.given - outcome.shed, abs=1e-6 * outcome.given), name


def test_plant_is_near_the_model_and_is_not_the_model(plant: Plant, fzg: Gearbox, programme: Programme) -> None:
    (outcome,) = plant.run([run_of(programme, start=25.0)])
    rows = len(programme)
    columns = {"time_s": np.arange(rows) * ROW_S, "speed_rpm": programme.speed, "torque_Nm": programme.torque,
               "T_ambient_degC": np.full(rows, 25.0), "air_speed_m_s": np.full(rows, 2.0)}  # fmt: skip
    result = fzg.network().simulate(columns, losses=fzg.losses(), initial=25.0)
    for place in ("oil", "housing_lower", "housing_upper", "bearing_1", "bearing_3", "pinion"):
        difference = outcome.T[:, plant.anatomy.coarse.index(place)] - result.temperatures[place]
        assert 0.05 < np.abs(difference).max() < 4.0, place
        assert np.sqrt(np.mean(difference**2)) < 1.0, place
    assert outcome.P_loss.mean() == pytest.approx(result.loss.mean(), rel=0.03)


def test_a_run_does_not_depend_on_its_company(plant: Plant, programme: Programme) -> None:
    runs = [run_of(programme, specimen(plant, name)) for name in ("windage", "oil_tank", "windage")]
    together, alone = plant.run(runs), [plant.run([run])[0] for run in runs]
    for a, b in zip(together, alone, strict=True):
        np.testing.assert_allclose(a.T, b.T, atol=1e-9)
        for place, watts in a.heat[0].items():
            np.testing.assert_allclose(watts, b.heat[0][place], atol=1e-9)


def test_another_gearbox_serves_as_well(programme: Programme) -> None:
    conveyor = Plant(load_gearbox("conveyor"))
    case = draw_case(conveyor, Plan(group="single", effects=("cooler_thermostat",)), seed=(0, 0), name="case")
    assert conveyor.as_warm(25.0) == 25.0
    short = Programme(name="train_1", speed=programme.speed * 0.4, torque=programme.torque * 0.4)
    cooled, plain = conveyor.run([run_of(short, *case.effects), run_of(short)])
    assert np.isfinite(cooled.T).all()
    assert cooled.T.min() < plain.T.min() + 1e-9


def test_many_gearboxes_take_little_longer_than_one(plant: Plant, programme: Programme) -> None:
    """All runs of a set advance together, row by row: sixty cases take minutes, not hours."""

    def processor_s(names: Sequence[str]) -> float:
        runs = [run_of(programme, specimen(plant, name)) for name in names]
        begin = time.process_time()
        plant.run(runs)
        return time.process_time() - begin

    alone = min(processor_s(PHYSICS[:1]), processor_s(PHYSICS[-1:]))
    assert processor_s(PHYSICS) < 0.2 * len(PHYSICS) * alone  # measured: 0.086


# ---------------------------------------------------------------------- effects


@pytest.mark.parametrize("name", [*PHYSICS, *OUTSIDE])
def test_every_effect_acts(name: str, with_effects: Mapping[str, tuple[Outcome, Outcome]]) -> None:
    outcome, without = with_effects[name]
    assert np.isfinite(outcome.T).all()
    assert np.abs(outcome.T - without.T).max() > 0.02, "moves no temperature"
    if EFFECTS[name].before is None:
        assert max(np.abs(watts).max() for watts in outcome.heat[0].values()) > ACTS_W
        main = EFFECTS[name].places(Plant(load_gearbox("fzg")), np.random.default_rng(1))[0]
        assert main in outcome.heat[0], "makes no heat where it is said to sit"


@pytest.mark.parametrize("name", PURE_SOURCES)
def test_measured_loss_knows_mechanical_heat_only(
    name: str, with_effects: Mapping[str, tuple[Outcome, Outcome]]
) -> None:
    """Heat of electricity, sun and melting wax does not turn a shaft; what temperature does to the losses apart."""
    outcome, _ = with_effects[name]
    heat = sum(outcome.heat[0].values())
    beyond = outcome.P_loss - sum(outcome.losses.values())
    assert np.abs(heat).max() > 0.1
    np.testing.assert_allclose(beyond, 0.0 if name in NOT_MECHANICAL else heat, atol=1e-9)


def test_thermostat_has_hysteresis(with_effects: Mapping[str, tuple[Outcome, Outcome]], plant: Plant) -> None:
    outcome, _ = with_effects["cooler_thermostat"]
    p = specimen(plant, "cooler_thermostat").parameters
    oil = outcome.T[:, plant.anatomy.coarse.index("oil")]
    between = (oil > p["T_on"] - p["band"] + 1.0) & (oil < p["T_on"] - 1.0)
    open_share = -outcome.heat[0]["oil"] / (p["a"] * (oil - p["T_water"]))
    assert open_share[between].max() > 0.95
    assert open_share[between].min() < 0.05
    assert (open_share[oil < p["T_on"] - p["band"] - 3.0] < 0.5).all()


def test_effects_that_age_start_anew_when_the_recording_does(plant: Plant, programme: Programme) -> None:
    """During the unrecorded warm-up nothing ages."""
    late = Programme(name="train_3", speed=programme.speed, torque=programme.torque, unrecorded=200)
    (outcome,) = plant.run([run_of(late, specimen(plant, "run_in_seals"))])
    assert len(outcome.T) == len(programme) - 200
    seal = outcome.losses["oil"][0]
    first = outcome.heat[0]["oil"][0] / seal
    assert 0.2 < first < 0.34  # of 1 + 0.5: a third of the loss, churning counted in


# ---------------------------------------------------------------------- measurement


def test_lag_is_of_first_order() -> None:
    step = np.concatenate([np.zeros(5), np.ones(200)])
    reading = lagged(step, 60.0)
    assert reading[4] == 0.0
    assert reading[5 + 5] == pytest.approx(1.0 - np.exp(-1.0), abs=1e-9)  # after 6 rows of 10 s


@pytest.mark.parametrize("name", FAULTS)
def test_every_fault_spoils_its_columns_and_no_others(name: str, plant: Plant, programme: Programme) -> None:
    case = draw_case(plant, Plan(group="sensor", effects=(name,), strength=1.0), seed=(2, 1), name="case")
    run = run_of(programme, start=25.0)
    (outcome,) = plant.run([run])
    sound = record(plant, run, outcome, case.instruments, (), None)
    faulty = record(plant, run, outcome, case.instruments, case.faults, None)
    changed = {column for column in sound if not np.array_equal(sound[column], faulty[column])}
    places = case.effects[0].places
    inputs = {"torque": "torque_Nm", "speed": "speed_rpm", "T_ambient": "T_ambient_degC"}
    if places == ("clock",):
        assert changed == {f"T_{place}_degC" for place in case.instruments.channels}
    elif places[0] in inputs:
        assert changed == {inputs[places[0]]}
    else:
        assert changed == {f"T_{place}_degC" for place in places}


def test_noise_and_steps_are_those_stated(plant: Plant, programme: Programme) -> None:
    case = draw_case(plant, Plan(group="control", kind="clean"), seed=(2, 2), name="case")
    run = run_of(programme, start=25.0)
    (outcome,) = plant.run([run])
    exact = record(plant, run, outcome, case.instruments, (), None)
    noisy = record(plant, run, outcome, case.instruments, (), np.random.default_rng(0))
    error = noisy["T_oil_degC"] - exact["T_oil_degC"]
    assert np.std(error) == pytest.approx(np.hypot(0.2, 0.1 / np.sqrt(12.0)), rel=0.1)
    np.testing.assert_allclose(noisy["T_oil_degC"] * 10.0, np.round(noisy["T_oil_degC"] * 10.0), atol=1e-9)
    loud = exact["P_loss_W"] > 100.0
    relative = noisy["P_loss_W"][loud] / exact["P_loss_W"][loud] - 1.0
    assert 0.015 < np.std(relative) < 0.03


# ---------------------------------------------------------------------- the wall between plant and diagnosis


@pytest.mark.parametrize("module", PLANT_MODULES, ids=lambda p: p.name)
def test_plant_does_not_know_catalogue_or_engine(module: Path) -> None:
    tree = ast.parse(module.read_text(encoding="utf-8"))
    imported = {node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    imported |= {name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names}
    for name in imported:
        assert not name.startswith("models.mechanisms"), name
        assert name.removeprefix("diagnosis.proof.") not in JUDGES, name
        assert not name.startswith("diagnosis") or name.startswith("diagnosis.proof"), name
