"""One smooth ride of the rig, simulated, on the grid, and as an experiment."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.engine.fit import Experiment
from diagnosis.engine.point import Machine
from diagnosis.engine.prepare import usual_unknowns
from diagnosis.forward.grid import Piece, pieces
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.recordings.recording import Recording
from diagnosis.setup.noise import noise_of
from diagnosis.setup.start import start_guess
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.files.cycle import Cycle
from tests.unit.diagnosis.inference_example import CHANNELS, recording_of


@pytest.fixture(scope="session")
def ride() -> dict[str, Array]:
    """Forty minutes of smooth operation, every 10 s."""
    time = np.arange(0.0, 2401.0, 10.0)
    return {
        "time_s": time,
        "speed_rpm": 1800.0 + 900.0 * np.sin(time / 300.0),
        "torque_Nm": 120.0 + 60.0 * np.cos(time / 400.0),
        "T_ambient_degC": np.full(len(time), 22.0),
    }


@pytest.fixture(scope="session")
def simulated(fzg: Gearbox, ride: dict[str, Array]) -> dict[str, Array]:
    cycle = Cycle.from_columns(ride | {"air_speed_m_s": np.full(len(ride["time_s"]), 2.0)})
    return dict(fzg.network().simulate(cycle, losses=fzg.losses(), initial=25.0).columns())


@pytest.fixture(scope="session")
def model(fzg: Gearbox) -> NetworkOnGrid:
    return NetworkOnGrid(fzg.network(), fzg.losses())


@pytest.fixture(scope="session")
def recorded(ride: dict[str, Array], simulated: dict[str, Array]) -> Recording:
    return recording_of(ride, {n: simulated["P_loss_W" if n == "P_loss" else f"T_{n}_degC"] for n in CHANNELS})


@pytest.fixture(scope="session")
def piece(model: NetworkOnGrid, recorded: Recording) -> Piece:
    (found,) = pieces([recorded], model.laws.inputs, CHANNELS, even=True)
    return found


@pytest.fixture(scope="session")
def experiment(model: NetworkOnGrid, piece: Piece, recorded: Recording) -> Experiment:
    white = dict.fromkeys(CHANNELS, 0.2) | {"P_loss": 5.0}
    return Experiment(
        machine=Machine(model),
        pieces=(piece,),
        unknowns=tuple(usual_unknowns(model.network, [recorded], CHANNELS, interval=10.0)),
        noise=(noise_of(model, piece, white, 250.0),),
        starts=(start_guess(model, piece),),
    )
