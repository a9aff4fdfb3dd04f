"""A gearbox in a vehicle: three native FMUs and an SSP, run by FMPy and by another master, over a made-up drive cycle.

    python examples/coupled_vehicle.py [--gearbox-fmu out/fzg/fzg_native.fmu] [--output out/coupled_vehicle]

The drive cycle gives a speed, the vehicle's driver follows it, the gearbox takes speed and torque of its input shaft
and gives its loss torque back. The cycle (urban, road, motorway; `examples/vehicle_cycle.csv`) is no legal test cycle.
Without --gearbox-fmu the networks are trained first, which takes half a minute. The second master is ecos or libcosim,
whichever is installed (`pip install ".[clients]"`; ecos on Debian also needs libtbb12).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
from fmpy.ssp.simulation import simulate_ssp
from vehicle_fmus import build_cycle_fmu, build_vehicle_fmu, write_system

from gearbox_twin import InputError, build_fmu

HERE = Path(__file__).parent
STOP_S, STEP_S = 1200.0, 0.1
NODES = ("oil", "mesh", "pinion", "bearing_1", "housing_upper")
ENERGIES = ("engine", "loss", "road", "brake", "kinetic")
OUTPUTS = [
    "cycle.speed", "vehicle.shaft.speed", "vehicle.shaft.torque", "vehicle.speed", "vehicle.distance",
    *(f"vehicle.energy.{name}" for name in ENERGIES),
    "gearbox.torque_loss", "gearbox.loss.total", *(f"gearbox.{node}.T" for node in NODES),
]  # fmt: skip
# Outputs that follow the inputs at once: ecos shows them after it has passed the new inputs on, the others before.
AT_ONCE = ("gearbox.torque_loss", "gearbox.loss.total")
Run = Mapping[str, np.ndarray]


def build_system(folder: Path, gearbox_fmu: Path) -> Path:
    """Build cycle and vehicle for this machine, and package all three as SSP."""
    cycle = pd.read_csv(HERE / "vehicle_cycle.csv", comment="#")
    cycle_fmu, vehicle_fmu = folder / "cycle.fmu", folder / "vehicle.fmu"
    build_cycle_fmu(cycle_fmu, cycle["time_s"], cycle["speed_km_h"] / 3.6, platforms="host")
    build_vehicle_fmu(vehicle_fmu, platforms="host")
    fmus = {"cycle": cycle_fmu, "vehicle": vehicle_fmu, "gearbox": gearbox_fmu}
    return write_system(folder / "drive_cycle.ssp", HERE / "drive_cycle.ssd", fmus)


def build_gearbox(folder: Path) -> Path:
    """Train the FZG rig's networks and build its native FMU for this machine."""
    return build_fmu("fzg", folder / "gearbox", target="native", jobs=2).fmus[0]


def run_fmpy(ssp: Path, stop: float = STOP_S, step: float = STEP_S) -> Run:
    """All outputs at the end of every step. FMPy also writes the beginning of a step."""
    rows = simulate_ssp(str(ssp), stop_time=stop - 0.5 * step, step_size=step)
    return {"time": rows["time"] + step} | {name: rows[name] for name in OUTPUTS}


def run_ecos(ssp: Path, stop: float = STOP_S, step: float = STEP_S) -> Run:
    """The same from ecos."""
    from ecospy import EcosSimulation

    rows = []
    with EcosSimulation(ssp_path=str(ssp), step_size=step) as simulation:
        simulation.init()
        for _ in range(round(stop / step)):
            simulation.step()
            rows.append([simulation.get_real(name.replace(".", "::", 1)) for name in OUTPUTS])
        simulation.terminate()
    return _columns(rows, step)


def run_libcosim(ssp: Path, stop: float = STOP_S, step: float = STEP_S) -> Run:
    """The same from libcosim."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.WARNING)
    execution = CosimExecution.from_ssp_file(str(ssp), round(step * 1e9))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    places: dict[int, list[tuple[str, int]]] = {}
    for name in ("cycle", "vehicle", "gearbox"):
        index = execution.slave_index_from_instance_name(name)
        known = {v.name.decode(): v.reference for v in execution.slave_variables(index)}
        full_names = [full for full in OUTPUTS if full.startswith(f"{name}.")]
        places[index] = [(full, known[full.removeprefix(f"{name}.")]) for full in full_names]
    rows = []
    for _ in range(round(stop / step)):
        if not execution.step():
            raise RuntimeError("libcosim: a step failed")
        values: dict[str, float] = {}
        for index, wanted in places.items():
            found = observer.last_real_values(index, [reference for _, reference in wanted])
            values |= dict(zip((full for full, _ in wanted), found, strict=True))
        rows.append([values[name] for name in OUTPUTS])
    return _columns(rows, step)


def _columns(rows: list[list[float]], step: float) -> Run:
    table = np.array(rows)
    return {"time": step * np.arange(1, len(rows) + 1)} | {name: table[:, i] for i, name in enumerate(OUTPUTS)}


def second_master() -> tuple[str, Callable[[Path], Run]] | None:
    """The other master that is installed."""
    for module, name, run in (("ecospy", "ecos", run_ecos), ("libcosimpy", "libcosim", run_libcosim)):
        try:
            __import__(module)
        except (ImportError, OSError):  # not installed, or a library that it needs is not
            continue
        return name, run
    return None


def difference(a: Run, b: Run) -> float:
    """Largest difference of two runs, relative to an output's largest value."""
    names = [name for name in OUTPUTS if name not in AT_ONCE]
    return float(max(np.max(np.abs(a[name] - b[name])) / max(1.0, np.max(np.abs(b[name]))) for name in names))


def plot(run: Run, path: Path) -> None:
    """Speed, torque, what is lost, and temperatures."""
    minutes = run["time"] / 60.0
    figure, axes = plt.subplots(4, 1, figsize=(8.0, 9.0), sharex=True, layout="constrained")
    axes[0].plot(minutes, 3.6 * run["cycle.speed"], "k--", label="drive cycle")
    axes[0].plot(minutes, 3.6 * run["vehicle.speed"], label="vehicle")
    axes[0].set_ylabel("speed in km/h")
    axes[1].plot(minutes, run["vehicle.shaft.torque"], label="input shaft")
    axes[1].plot(minutes, run["gearbox.torque_loss"], label="loss, fed back")
    axes[1].set_ylabel("torque in N m")
    axes[2].plot(minutes, run["gearbox.loss.total"], label="gearbox")
    axes[2].set_ylabel("loss in W")
    for node in NODES:
        axes[3].plot(minutes, run[f"gearbox.{node}.T"] - 273.15, label=node)
    axes[3].set_ylabel("temperature in degC")
    axes[3].set_xlabel("time in min")
    for ax in axes:
        ax.legend(loc="upper left", fontsize=8.0, frameon=False, ncols=5)
        ax.grid(alpha=0.3)
    figure.savefig(path, dpi=120)
    plt.close(figure)


def main() -> None:
    """Build, run, compare, plot."""
    parser = argparse.ArgumentParser(description="A gearbox in a vehicle over a drive cycle.")
    parser.add_argument("--gearbox-fmu", type=Path, help="native FMU of the FZG rig; built if not given")
    parser.add_argument("--output", type=Path, default=Path("out/coupled_vehicle"))
    given = parser.parse_args()
    folder: Path = given.output
    folder.mkdir(parents=True, exist_ok=True)
    try:
        ssp = build_system(folder, given.gearbox_fmu or build_gearbox(folder))
    except InputError as error:
        parser.error(str(error))
    run = run_fmpy(ssp)
    pd.DataFrame(run).iloc[9::10].round(6).to_csv(folder / "result.csv", index=False)
    plot(run, folder / "result.png")
    work = {name: run[f"vehicle.energy.{name}"][-1] / 1e3 for name in ENERGIES}
    heat = np.sum(run["gearbox.loss.total"]) * STEP_S / 1e3
    print(f"{ssp}: {run['vehicle.distance'][-1] / 1e3:.2f} km, engine {work['engine']:.1f} kJ")
    print("  = " + " + ".join(f"{name} {work[name]:.1f}" for name in ENERGIES[1:]) + " kJ")
    print(f"  heat in the gearbox {heat:.1f} kJ; at the end, degC:", end=" ")
    print(", ".join(f"{node} {run[f'gearbox.{node}.T'][-1] - 273.15:.1f}" for node in NODES))
    other = second_master()
    if other is None:
        print("  no second master: install ecospy or libcosimpy to compare")
        return
    name, run_other = other
    print(f"  {name} and FMPy differ by {difference(run_other(ssp), run):.1e} of an output's largest value")


if __name__ == "__main__":
    main()
