"""The usual unknowns follow from the recordings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.engine.prepare import CAPACITY_SD, held_out_experiment, prepare_experiment, usual_unknowns
from diagnosis.engine.unknown import ClockOffset, LossDelay, SensorLag
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.recordings.recording import Recording
from models.assembly.gearbox import Gearbox
from tests.unit.diagnosis.inference_example import CHANNELS


def test_air_that_nobody_recorded_is_less_certain(model: NetworkOnGrid, recorded: Recording) -> None:
    sd = []
    for one in (recorded, replace(recorded, assumed=("T_ambient",))):
        found = usual_unknowns(model.network, [one], CHANNELS, interval=10.0)
        sd.append(next(u.parameter.sd for u in found if u.parameter.name == "ambient_offset"))
    assert sd[0] < 1.0 < 3.0 < sd[1]


def test_tolerances_that_are_stated_are_the_priors(model: NetworkOnGrid, recorded: Recording) -> None:
    """A data sheet may know an instrument better than is assumed, or less."""
    known = {"oil": (0.05, None), "P_loss": (0.5, 0.001)}
    stated = replace(
        recorded,
        tolerances={"T_ambient": 1.5, "torque": 0.002},
        channels=tuple(
            replace(c, bias_sd=known.get(c.name, (None, None))[0], gain_sd=known.get(c.name, (None, None))[1])
            for c in recorded.channels
        ),
    )
    usual, found = (
        {u.parameter.name: u.parameter.sd for u in usual_unknowns(model.network, [one], CHANNELS, interval=10.0)}
        for one in (recorded, stated)
    )
    changed = {name: sd for name, sd in found.items() if sd != usual[name]}
    assert changed == {"bias_oil": 0.05, "bias_P_loss": 0.5, "loss_gain": 0.001, "ambient_offset": 1.5,
                       "torque_gain": 0.002}  # fmt: skip


def test_rows_that_are_minutes_apart_are_means(model: NetworkOnGrid, recorded: Recording) -> None:
    """They show neither lags nor which end of the row is stamped; temperatures and inputs may have another one."""
    slow = replace(recorded, time=60.0 * recorded.time)
    fast, means = (usual_unknowns(model.network, [one], CHANNELS, interval=10.0) for one in (recorded, slow))
    for kind, count in ((LossDelay, (1, 0)), (SensorLag, (3, 0)), (ClockOffset, (0, 1))):
        assert [sum(isinstance(u, kind) for u in found) for found in (fast, means)] == [*count]


def test_a_temperature_represents_a_body_that_has_many(model: NetworkOnGrid, recorded: Recording) -> None:
    stated = {p.name: p.sd for p in model.network.parameters}
    found = {
        u.parameter.name: u.parameter.sd for u in usual_unknowns(model.network, [recorded], CHANNELS, interval=1.0)
    }
    capacities = [name for name in found if name.startswith("C_")]
    assert capacities and all(found[name] == max(stated[name], CAPACITY_SD) for name in capacities)
    assert found["mesh"] == pytest.approx(stated["mesh"])
    assert set(found) >= {name for name, sd in stated.items() if sd > 0.0}
    assert np.isfinite(list(found.values())).all()


def test_held_out_pieces_have_the_same_unknowns(fzg: Gearbox, recorded: Recording) -> None:
    setup, experiment = prepare_experiment(fzg, [recorded], [replace(recorded, name="judged")])
    judged = held_out_experiment(setup, experiment)
    assert judged.unknowns == experiment.unknowns and [p.recording for p in judged.pieces] == ["judged"]
