"""The vehicle FMU by itself, and the gearbox in it: energy books, masters, the example as users run it."""

from __future__ import annotations

import math
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu

from builder.vehicle import PARAMETERS, build_cycle_fmu, build_vehicle_fmu, vehicle_table, write_system
from examples.coupled_vehicle import ENERGIES, STEP_S, Run, build_system, difference, run_ecos, run_fmpy, run_libcosim
from models.errors import InputError
from tests.contract.native_hosts import SANITIZED, compiled, needs_compiler, run, sanitized, unpacked
from tests.contract.test_native_clients import ecos

EXAMPLES = Path(__file__).parents[2] / "examples"
GRAVITY, AIR_DENSITY = 9.81, 1.2
VALUES = {name: row[1] for name, row in PARAMETERS.items()}
PER_SPEED = VALUES["ratio"] / VALUES["tyre_radius"]
MASS = VALUES["mass"] + VALUES["inertia.shaft"] * PER_SPEED**2 + VALUES["inertia.wheels"] / VALUES["tyre_radius"] ** 2


@pytest.fixture(scope="module")
def vehicle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_vehicle_fmu(tmp_path_factory.mktemp("vehicle") / "vehicle.fmu", platforms="host").path


@pytest.fixture(scope="module")
def ssp(fzg_native: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_system(tmp_path_factory.mktemp("system"), fzg_native)


@pytest.fixture(scope="module")
def coupled(ssp: Path) -> Run:
    return run_fmpy(ssp)


# ---------------------------------------------------------------------- the vehicle


def driven(path: Path, stop: float, *, interval: float = 1.0, **values: float) -> np.ndarray:
    names = [s.name for s in vehicle_table() if s.causality == "output"]
    return simulate_fmu(str(path), stop_time=stop, output_interval=interval, start_values=values, output=names)


def books(row: np.void) -> float:
    """What is missing between the works and the energy of motion, [J]."""
    engine, loss, road, brake, kinetic = (float(row[f"energy.{name}"]) for name in ENERGIES)
    return engine - loss - road - brake - kinetic


def test_fmpy_finds_no_problem(vehicle: Path, tmp_path: Path) -> None:
    assert validate_fmu(str(vehicle)) == []
    assert validate_fmu(str(build_cycle_fmu(tmp_path / "cycle.fmu", [0, 1], [0, 1], platforms="host").path)) == []


@pytest.mark.parametrize("slope", [0.0, 0.04, -0.04])
def test_at_steady_speed_the_engine_carries_road_and_loss(vehicle: Path, slope: float) -> None:
    v, loss = 15.0, 2.0
    end = driven(vehicle, 120.0, speed_demand=v, slope=slope, torque_loss=loss)[-1]
    weight, length = VALUES["mass"] * GRAVITY, math.hypot(1.0, slope)
    road = 0.5 * AIR_DENSITY * VALUES["drag_area"] * v**2 + weight * (VALUES["rolling_resistance"] + slope) / length
    assert end["speed"] == pytest.approx(v, abs=1e-6)
    assert end["shaft.speed"] == pytest.approx(v * PER_SPEED, abs=1e-5)
    assert end["shaft.torque"] == pytest.approx(road / PER_SPEED + loss, rel=1e-4)
    assert books(end) == pytest.approx(0.0, abs=1e-6)


def test_engine_and_brakes_keep_their_limits(vehicle: Path) -> None:
    up = driven(vehicle, 20.0, interval=0.1, speed_demand=60.0)
    power = up["shaft.torque"] * up["shaft.speed"]
    assert np.max(up["shaft.torque"]) == pytest.approx(VALUES["engine.torque_max"], rel=1e-3)
    assert np.max(power) <= 1.01 * VALUES["engine.power_max"]
    first = np.diff(up["speed"])[5] / 0.1  # full torque, hardly any road load yet
    resistance = VALUES["mass"] * GRAVITY * VALUES["rolling_resistance"]
    assert first == pytest.approx((up["shaft.torque"][6] * PER_SPEED - resistance) / MASS, rel=0.03)


def test_brakes_keep_their_limit(vehicle: Path) -> None:
    """From full speed to rest: 6 m/s^2 by the brakes, and what the road and the braking engine take."""
    demand = np.array(
        [(0.0, 30.0), (60.0, 30.0), (60.1, 0.0), (90.0, 0.0)], dtype=[("time", float), ("speed_demand", float)]
    )
    names = ["speed", "shaft.torque"]
    run = simulate_fmu(str(vehicle), stop_time=90.0, output_interval=0.1, input=demand, output=names)
    assert run["speed"][600] == pytest.approx(30.0, abs=0.5) and run["speed"][-1] == 0.0
    assert run["shaft.torque"].min() >= -VALUES["engine.torque_braking"] * (1.0 + 1e-9)
    air, weight = 0.5 * AIR_DENSITY * VALUES["drag_area"] * 30.0**2, VALUES["mass"] * GRAVITY
    road = air + weight * VALUES["rolling_resistance"]
    most = 6.0 * VALUES["mass"] + VALUES["engine.torque_braking"] * PER_SPEED + road
    slower = -np.diff(run["speed"][600:]) / 0.1
    moving = run["speed"][600:-1] > 1.0
    assert 0.97 * most / MASS < slower[moving].max() < 1.001 * most / MASS


def test_steps_of_communication_do_not_matter_with_inputs_held(vehicle: Path) -> None:
    coarse = driven(vehicle, 60.0, interval=1.0, speed_demand=20.0, torque_loss=1.0)
    fine = driven(vehicle, 60.0, interval=0.1, speed_demand=20.0, torque_loss=1.0)
    for name in coarse.dtype.names[1:]:
        assert fine[name][::10] == pytest.approx(coarse[name], rel=1e-9, abs=1e-9), name


def test_loss_torque_never_drives(vehicle: Path) -> None:
    end = driven(vehicle, 600.0, torque_loss=50.0)[-1]
    assert end["speed"] == end["energy.loss"] == 0.0
    end = driven(vehicle, 60.0, torque_loss=-50.0, speed_demand=10.0)[-1]  # as the gearbox signs it in reverse
    assert end["energy.loss"] > 0.0


def test_a_step_too_long_for_a_vehicle_is_refused(vehicle: Path) -> None:
    # In a process of its own: in a long test process, FMPy's call of doStep ended twice in an illegal instruction,
    # alone it never has. The cause is not known; see the changelog.
    code = (
        "from fmpy import simulate_fmu\n"
        f"found = simulate_fmu({str(vehicle)!r}, stop_time=4000.0, output_interval=4000.0, output=['speed'])\n"
        "print(found['time'].tolist())\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "too long for a vehicle" in done.stdout + done.stderr
    assert done.stdout.splitlines()[-1] == "[0.0, 0.0]"  # FMPy ends at a refused step


def test_the_cycle_is_straight_between_its_rows_and_held_at_its_ends(tmp_path: Path) -> None:
    t, v = [0.5, 2.0, 3.0, 7.5], [3.0, 4.5, 0.0, 1.0]
    cycle = build_cycle_fmu(tmp_path / "cycle.fmu", t, v, platforms="host").path
    found = simulate_fmu(str(cycle), stop_time=9.0, output_interval=0.25, output=["speed"])
    assert found["speed"] == pytest.approx(np.interp(found["time"], t, v), abs=1e-12)


@pytest.mark.parametrize(
    ("time", "speed", "match"),
    [
        ([0.0], [1.0], "two or more rows"),
        ([0.0, 1.0], [1.0], "two or more rows"),
        ([0.0, 0.0], [1.0, 1.0], "increase"),
        ([0.0, 1.0], [1.0, math.nan], "finite"),
    ],
)
def test_a_faulty_cycle_is_refused(time: list[float], speed: list[float], match: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=match):
        build_cycle_fmu(tmp_path / "cycle.fmu", time, speed, platforms="host")


def test_a_system_without_its_fmus_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere.fmu"):
        write_system(tmp_path / "x.ssp", EXAMPLES / "drive_cycle.ssd", {"gearbox": tmp_path / "nowhere.fmu"})
    assert not (tmp_path / "x.ssp").exists()


@needs_compiler
@pytest.mark.skipif(sys.platform == "win32", reason="written for dlopen")
def test_the_vehicle_under_the_sanitizers(vehicle: Path, tmp_path: Path) -> None:
    fmu = unpacked(vehicle, tmp_path / "vehicle")
    t = np.arange(0.0, 120.0, 0.5)
    table = pd.DataFrame({"time": t, "speed_demand": 10.0 + 10.0 * np.sin(t / 10.0), "slope": 0.0, "torque_loss": 1.0})
    table.to_csv(tmp_path / "in.csv", index=False)
    host = compiled("play", fmu, tmp_path / "play", *SANITIZED)
    library = sanitized(fmu, tmp_path / "sanitized.so")
    columns = [fmu.references(*table.columns[1:]), fmu.references("speed", "distance")]
    text = run([host, library, *fmu.arguments[1:], *columns, tmp_path / "in.csv"])
    assert len(text.splitlines()) == len(t) - 1


# ---------------------------------------------------------------------- the gearbox in the vehicle


def test_the_vehicle_follows_the_cycle(coupled: Run) -> None:
    wrong = coupled["vehicle.speed"] - coupled["cycle.speed"]
    assert np.sqrt(np.mean(wrong**2)) < 1.0 / 3.6
    assert np.max(np.abs(wrong)) < 3.5 / 3.6
    assert coupled["vehicle.speed"][-1] == pytest.approx(0.0, abs=1e-3)


def test_the_energy_books_close(coupled: Run) -> None:
    """Inside the vehicle to rounding; between the FMUs, which pass powers on at every 0.1 s, to 0.1 %."""
    work = {name: coupled[f"vehicle.energy.{name}"] for name in ENERGIES}
    missing = work["engine"] - work["loss"] - work["road"] - work["brake"] - work["kinetic"]
    assert np.max(np.abs(missing)) < 1e-11 * work["engine"][-1]
    heat = np.cumsum(coupled["gearbox.loss.total"]) * STEP_S
    assert heat[-1] == pytest.approx(work["loss"][-1], rel=1e-3)
    assert heat[-1] > 0.02 * work["engine"][-1]


def test_the_works_are_those_of_the_motion(coupled: Run) -> None:
    """Road, engine and motion, calculated again from what is seen outside."""
    v, work = coupled["vehicle.speed"], {name: coupled[f"vehicle.energy.{name}"] for name in ENERGIES}
    drag = 0.5 * AIR_DENSITY * VALUES["drag_area"] * v**2
    rolling = VALUES["mass"] * GRAVITY * VALUES["rolling_resistance"]
    assert np.sum((drag + rolling) * v) * STEP_S == pytest.approx(work["road"][-1], rel=2e-3)
    power = coupled["vehicle.shaft.torque"] * coupled["vehicle.shaft.speed"]
    assert np.sum(power) * STEP_S == pytest.approx(work["engine"][-1], rel=5e-3)
    assert np.sum(v) * STEP_S == pytest.approx(coupled["vehicle.distance"][-1], rel=1e-6)
    assert work["kinetic"] == pytest.approx(0.5 * MASS * v**2, rel=1e-9, abs=1e-9)


def test_the_gearbox_works_inside_its_range_and_warms_up(coupled: Run) -> None:
    assert 4000.0 < np.max(coupled["vehicle.shaft.speed"]) * 30.0 / math.pi < 6500.0
    assert 40.0 < np.max(np.abs(coupled["vehicle.shaft.torque"])) < 350.0
    assert np.max(coupled["gearbox.oil.T"]) > coupled["gearbox.oil.T"][0] + 10.0


def test_finer_communication_gives_the_same_temperatures(ssp: Path, coupled: Run) -> None:
    fine = run_fmpy(ssp, stop=400.0, step=0.02)
    for node in ("oil", "pinion", "housing_upper"):
        name = f"gearbox.{node}.T"
        assert coupled[name][:4000] == pytest.approx(fine[name][4::5], abs=0.02), node


def test_ecos_agrees_with_fmpy(ssp: Path, coupled: Run) -> None:
    ecos()
    assert difference(run_ecos(ssp), coupled) == 0.0


@pytest.mark.skipif(find_spec("libcosimpy") is None, reason="libcosimpy is not installed")
def test_libcosim_agrees_with_fmpy(ssp: Path, coupled: Run) -> None:
    assert difference(run_libcosim(ssp), coupled) < 2e-10


def test_the_example_as_users_run_it(fzg_native: Path, tmp_path: Path) -> None:
    said = run([
        sys.executable, EXAMPLES / "coupled_vehicle.py", "--gearbox-fmu", fzg_native, "--output", tmp_path,
    ], cwd=EXAMPLES.parent, env=None)  # fmt: skip
    assert "20.40 km" in said
    assert (tmp_path / "result.png").stat().st_size > 10_000
    assert len(pd.read_csv(tmp_path / "result.csv")) == 1200
