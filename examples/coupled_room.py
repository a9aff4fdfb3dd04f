"""A gearbox in a room: two native FMUs that exchange heat and temperature, as SSP, run by FMPy.

    python examples/coupled_room.py [--gearbox-fmu FMU] [--output out/coupled_room]

What the gearbox gives to the air and through its feet (`air.heat_flow`, `frame.heat_flow`) warms a small room; the
room's temperatures are the gearbox's `T_ambient` and `frame.T_in`. The FMU needs the second input: build it with
`python -m builder build-fmu --couple frame`. The room is a definition without geometry, `examples/room.toml`.
Without --gearbox-fmu the gearbox's networks are trained first, which takes half a minute.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from fmpy.ssp import simulation
from fmpy.ssp.ssd import Parameter, ParameterSet
from vehicle_fmus import write_system

from gearbox_twin import Gearbox, InputError, build_fmu, load_gearbox

HERE = Path(__file__).parent
STOP_S, STEP_S = 4.0 * 3600.0, 10.0
OPERATION = {"gearbox.speed": 200.0, "gearbox.torque": 250.0}  # rad/s and N m, held
START_K = 283.15


def build_room(folder: Path) -> Path:
    """Build the FMU of the room for this machine."""
    return build_fmu(HERE / "room.toml", folder, target="native").fmus[0]


def gearbox_on_feet() -> Gearbox:
    """The FZG rig on feet that conduct 4 W/K to the floor; its definition has none."""
    return load_gearbox("fzg").with_values({"housing.foundation_conductance_W_K": 4.0})


def build_gearbox(folder: Path) -> Path:
    """Build the FMU of the gearbox with its frame as a heat port."""
    return build_fmu(gearbox_on_feet(), folder, target="native", couple=("frame",)).fmus[0]


@contextmanager
def start_values() -> Iterator[None]:
    """Give connectors the values that the FMUs start with: FMPy 0.3.32 starts them at 0, a temperature at 0 K."""
    original = simulation.instantiate_fmu

    def instantiate(component: Any, *arguments: Any) -> None:
        original(component, *arguments)
        for connector in component.connectors:
            connector.value = simulation.get_value(component, connector.name)

    simulation.instantiate_fmu = instantiate
    try:
        yield
    finally:
        simulation.instantiate_fmu = original


def run(ssp: Path, stop: float = STOP_S, step: float = STEP_S) -> np.ndarray:
    """All connectors at the end of every step; their times are the beginnings."""
    temperatures = ("gearbox.T_ambient", "gearbox.frame.T_in", "gearbox.initial.T", "room.initial.T")
    values = OPERATION | dict.fromkeys(temperatures, START_K)
    parameters = [Parameter(name=name, type="Real", value=str(value)) for name, value in values.items()]
    with start_values():
        rows: np.ndarray = simulation.simulate_ssp(
            str(ssp), stop_time=stop - 0.5 * step, step_size=step, parameter_set=ParameterSet(parameters=parameters)
        )
    return rows


def main() -> None:
    """Build, run, show the energy balance over both FMUs."""
    parser = argparse.ArgumentParser(description="A gearbox in a room.")
    parser.add_argument("--gearbox-fmu", type=Path, help="native FMU of build-fmu --couple frame; built if not given")
    parser.add_argument("--output", type=Path, default=Path("out/coupled_room"))
    given = parser.parse_args()
    folder: Path = given.output
    folder.mkdir(parents=True, exist_ok=True)
    fmus = {"gearbox": given.gearbox_fmu or build_gearbox(folder / "gearbox"), "room": build_room(folder / "room")}
    try:
        system = write_system(folder / "room.ssp", HERE / "room.ssd", fmus)
    except InputError as error:
        parser.error(str(error))
    rows = run(system)
    print("time/h  oil/degC  room/degC  floor/degC  to air/W  to floor/W")
    for row in rows[359::360]:
        hours = (row["time"] + STEP_S) / 3600.0
        oil, room, floor = (row[name] - 273.15 for name in ("gearbox.oil.T", "room.room.T", "room.floor.T"))
        flows = [row[f"gearbox.{boundary}.heat_flow"] for boundary in ("air", "frame")]
        print(f"{hours:6.1f} {oil:9.1f} {room:10.1f} {floor:11.1f} {flows[0]:9.1f} {flows[1]:11.1f}")
    last = rows[-1]
    given_off = last["gearbox.air.heat"] + last["gearbox.frame.heat"]
    elsewhere = last["gearbox.heat_in"] - given_off - last["gearbox.heat_stored"]  # to boundaries that no room has
    print(f"losses {last['gearbox.heat_in'] / 1e3:.1f} kJ = to air and floor {given_off / 1e3:.1f} kJ", end=" + ")
    print(f"elsewhere {elsewhere / 1e3:.1f} kJ", end=" + ")
    print(f"stored in the gearbox {last['gearbox.heat_stored'] / 1e3:.1f} kJ")
    print(f"the room received {last['room.heat_in'] / 1e3:.1f} kJ (flows arrive one step later)")


if __name__ == "__main__":
    main()
