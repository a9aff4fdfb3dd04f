"""Whitening: innovations of the noise are independent standard normal numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.engine.fit import Experiment
from diagnosis.forward.grid import Piece
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.whitening import Noise, Whitening, reading_variance
from tests.unit.diagnosis.inference_example import CHANNELS, with_measured


@pytest.mark.parametrize(("wander", "draught"), [(0.0, 0.0), (0.3, 0.0), (0.0, 0.2)])
def test_innovations_of_the_noise_are_white(
    model: NetworkOnGrid, piece: Piece, experiment: Experiment, wander: float, draught: float
) -> None:
    """Noise drawn from the noise model itself comes out as independent standard normal numbers."""
    rng = np.random.default_rng(1)
    part = experiment.point(0, np.zeros(len(experiment.unknowns)))
    noise = replace(
        experiment.noise[0], heat_sd=np.where(model.capacities(model.start) > 100.0, 3.0, 0.0), heat_time=400.0,
        wander=wander, draught=draught,
    )  # fmt: skip
    to_air, from_air = np.zeros((2, len(piece.steps), model.n))
    for index, link in enumerate(model.network.links):
        inside = [model.parts.index(node) for node in link.nodes if node in model.parts]
        if len(inside) == 1:
            flow = part.trajectory.balance.conductances[:, index] * part.trajectory.balance.differences[:, index]
            to_air[:, inside[0]] += np.square(flow)
            from_air[:, inside[0]] += flow if link.nodes[1] in model.parts else -flow
    heat_sd = np.where(noise.heat_sd > 0.0, np.sqrt(noise.heat_sd**2 + wander**2 * to_air), 0.0)
    assert wander == 0.0 or heat_sd.max() > 2.0 * noise.heat_sd.max()
    assert draught == 0.0 or draught * np.abs(from_air).max() > 2.0 * noise.heat_sd.max()
    whitening = Whitening(model, part.trajectory, part.sensors, noise)
    steps, draws = piece.steps, 40
    heat = np.empty((len(steps), model.n, draws))
    now = rng.normal(size=(model.n + 1, draws))  # the last one is the draught
    for k, h in enumerate(steps):
        heat[k] = heat_sd[k, :, None] * now[:-1] + draught * from_air[k, :, None] * now[-1]
        rho = np.exp(-h / noise.heat_time)
        now = rho * now + np.sqrt(1.0 - rho**2) * rng.normal(size=now.shape)
    T = part.trajectory.response(heat, np.linalg.cholesky(noise.start) @ rng.normal(size=(model.n, draws)))
    names = list(model.parts)
    rows = [T[:, names.index(n)] for n in CHANNELS[:3]]
    middle = 0.5 * (T[1:] + T[:-1])
    loss = np.einsum("kn,knc->kc", part.trajectory.loss_slope, middle)
    rows.append(np.concatenate([loss[:1], 0.5 * (loss[1:] + loss[:-1]), loss[-1:]]))
    read = np.stack(rows, axis=1)
    sd = np.sqrt(reading_variance(model, part.trajectory, part.sensors, noise))
    innovations = whitening(read + sd[:, :, None] * rng.normal(size=read.shape))
    temperatures = innovations.reshape(len(piece.time), 4, draws)[:, :3]
    assert temperatures.std() == pytest.approx(1.0, abs=0.02)
    lagged_product = np.mean(temperatures[1:] * temperatures[:-1])
    assert abs(lagged_product) < 0.03


def test_missing_readings_show_nothing(piece: Piece, experiment: Experiment) -> None:
    measured = np.array(piece.measured)
    measured[20:60, 1] = np.nan
    part = with_measured(experiment, measured).linearise_piece(0, np.zeros(len(experiment.unknowns)), None)
    white = part.residual.reshape(len(piece.time), -1)
    assert (white[20:60, 1] == 0.0).all()
    assert np.isfinite(part.columns).all()


def test_noise_needs_no_floor(model: NetworkOnGrid, experiment: Experiment) -> None:
    quiet = Noise(
        channel_sd=np.full(4, 0.1), floor_sd=np.zeros(4), loss_relative_sd=0.01, heat_sd=np.zeros(model.n),
        heat_time=100.0, start=np.eye(model.n),
    )  # fmt: skip
    part = experiment.point(0, np.zeros(len(experiment.unknowns)))
    white = Whitening(model, part.trajectory, part.sensors, quiet)(part.residual[:, :, None])
    assert np.isfinite(white).all()
