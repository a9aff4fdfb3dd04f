"""Recordings, scores and judges made up for the tests of the inference."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from diagnosis.inference.posterior import Problem

from diagnosis.candidates.hypotheses import Hypothesis, Scored
from diagnosis.forward.grid import Piece
from diagnosis.forward.network_on_grid import NetworkOnGrid, named_values
from diagnosis.forward.observation import readings
from diagnosis.forward.trajectory import simulate
from diagnosis.recordings.recording import Channel, Recording
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.mechanisms import CATALOGUE, OPEN_FORM, Scale

CHANNELS = ("housing_lower", "oil", "bearing_1", "P_loss")

# A fit without unknowns, and a problem that has no other.
NOTHING: Any = SimpleNamespace(at=lambda fit: fit, unknowns=SimpleNamespace(items=()), z=(), slow=False)


def recording_of(columns: dict[str, Array], channels: dict[str, Array]) -> Recording:
    time = columns["time_s"]
    return Recording(
        name="made", path=Path("made.csv"), sha256="0" * 64, time=time,
        inputs={"speed": columns["speed_rpm"], "torque": columns["torque_Nm"], "T_ambient": columns["T_ambient_degC"],
                "air_speed": np.full(len(time), 2.0)},
        channels=tuple(Channel(name=n, values=v) for n, v in channels.items()), segments=(slice(0, len(time)),),
    )  # fmt: skip


def damaged(fzg: Gearbox, piece: Piece, problem: Problem) -> tuple[Piece, Scale, float]:
    """The ride with a bearing damage that sets in between two moments of the grid; the scale, and the moment [s]."""
    network = problem.model.network
    scale = Scale.of(fzg, speed=2600.0, torque=150.0, duration=float(piece.time[-1]))
    placed, true = CATALOGUE["bearing_damage"].placed(network, scale)[0], 0.29 * scale.duration
    given = dict(zip((p.name for p in placed.parameters), (60.0, true, 0.3), strict=True))
    model = NetworkOnGrid(placed.apply(network), fzg.losses())
    trajectory = simulate(model, piece, named_values(model.network, given), problem.starts[0])
    sensors = problem.unknowns.sensors(CHANNELS, np.zeros(len(problem.unknowns)))
    return replace(piece, measured=readings(model, trajectory, sensors)), scale, true


def scored_as(name: str, place: str, log_bayes: float) -> Scored:
    term: Any = None if name == "parameter" else SimpleNamespace(of_measurement=False, parameters=(), states=())
    family = OPEN_FORM if name.startswith("open_") else ""
    h = Hypothesis(name=name, place=place, family=family, variants=np.ones((1, 1)), term=term)
    return Scored(
        hypothesis=h, log_bayes=log_bayes, best=0, values=np.zeros(1), log_bayes_of=np.array([log_bayes]), expected=0.0
    )


def judge_of(base: Any, gain: Any = 0.0) -> Any:
    """A judge by held-out recordings that gain so much, or what a function of an explanation says."""
    case: Any = SimpleNamespace(holdout=SimpleNamespace(slow=False))
    return SimpleNamespace(case=case, base=base, floor=1.0, gain=gain if callable(gain) else lambda _: gain)
