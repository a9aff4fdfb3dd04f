"""Whitening and evidence against plain linear algebra: innovations, Bayes factors, unknown heat."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from diagnosis.inference.evidence import Marginal, strength
from diagnosis.inference.latent import knots_of, latent_heat
from diagnosis.inference.posterior import Problem

from diagnosis.forward.grid import Piece, pieces
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.whitening import Noise, Whitening, reading_variance
from diagnosis.setup.noise import loss_noise
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.files.cycle import Cycle
from tests.unit.diagnosis.inference_example import CHANNELS, recording_of


def test_innovations_of_the_noise_are_white(model: NetworkOnGrid, piece: Piece, problem: Problem) -> None:
    """Noise drawn from the noise model itself comes out as independent standard normal numbers."""
    rng = np.random.default_rng(1)
    part = problem.linearise(0, np.zeros(len(problem.unknowns)), None)
    noise = replace(
        problem.noise[0], heat_sd=np.where(model.capacities(model.start) > 100.0, 3.0, 0.0), heat_time=400.0
    )
    whitening = Whitening(model, part.trajectory, part.sensors, noise)
    steps, draws = piece.steps, 40
    heat = np.empty((len(steps), model.n, draws))
    now = noise.heat_sd[:, None] * rng.normal(size=(model.n, draws))
    for k, h in enumerate(steps):
        heat[k] = now
        rho = np.exp(-h / noise.heat_time)
        now = rho * now + noise.heat_sd[:, None] * np.sqrt(1.0 - rho**2) * rng.normal(size=now.shape)
    T = part.trajectory.response(heat, noise.start_sd[:, None] * rng.normal(size=(model.n, draws)))
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


def test_an_unknown_heat_is_seen_where_it_is_and_told_with_its_size(
    fzg: Gearbox, model: NetworkOnGrid, ride: dict[str, Array], problem: Problem
) -> None:
    """60 W that come to the oil after 20 min; beside readings of the model itself there is none."""
    nodes, watts = ("oil", "housing_lower", "bearing_1"), 60.0
    network = fzg.network().with_source("oil", lambda s: watts / (1.0 + sp.exp((1200.0 - s.time) / 60.0)), name="extra")
    cycle = Cycle.from_columns(ride | {"air_speed_m_s": np.full(len(ride["time_s"]), 2.0)})
    heated = network.simulate(cycle, losses=fzg.losses(), initial=25.0).columns()
    channels = {n: heated["P_loss_W" if n == "P_loss" else f"T_{n}_degC"] for n in CHANNELS}
    (read,) = pieces([recording_of(ride, channels)], model.laws.inputs, CHANNELS, even=True)
    found = {}
    for which, those in (("none", problem), ("heated", problem.changed(pieces=[read]))):
        fit = those.fit()
        found[which] = [
            latent_heat(model, fit, Marginal.of(fit), node, loss_W=250.0, is_loss=False, knots=knots_of(those.pieces))
            for node in nodes
        ]
    assert all(heat.log_bayes < 0.0 and np.abs(heat.mean[0]).max() < 2.0 for heat in found["none"])
    oil, *others = found["heated"]
    assert oil.log_bayes > 5.0 + max(heat.log_bayes for heat in others)
    late, sd = float(oil.mean[0][-5]), float(oil.sd[0][-5])
    assert abs(late - watts) < 2.0 * sd < 0.8 * watts
    assert late > oil.mean[0][5] + 20.0


def test_missing_readings_say_nothing(model: NetworkOnGrid, piece: Piece, problem: Problem) -> None:
    measured = np.array(piece.measured)
    measured[20:60, 1] = np.nan
    holed = problem.changed(pieces=[replace(piece, measured=measured)])
    part = holed.linearise(0, np.zeros(len(problem.unknowns)), None)
    white = part.white_residual.reshape(len(piece.time), -1)
    assert (white[20:60, 1] == 0.0).all()
    assert np.isfinite(part.white_columns).all()


@pytest.mark.parametrize("sign", [-1, 0, 1])
def test_log_bayes_factor_is_the_integral_over_the_strength(sign: int) -> None:
    rng = np.random.default_rng(2)
    x, residual, sd = rng.normal(size=30), rng.normal(size=30) + 0.4, 0.7
    found = strength(np.array([x @ residual]), np.array([x @ x]), sd, sign)
    s = np.linspace(-8.0 * sd, 8.0 * sd, 400_001)
    prior = np.exp(-0.5 * (s / sd) ** 2) / (sd * np.sqrt(2.0 * np.pi))
    if sign:
        prior = np.where(sign * s > 0.0, 2.0 * prior, 0.0)
    ratio = np.exp(s * (x @ residual) - 0.5 * s**2 * (x @ x))
    assert found.log_bayes[0] == pytest.approx(np.log(np.trapezoid(prior * ratio, s)), abs=1e-3)


def test_loss_noise_has_a_constant_and_a_relative_part(ride: dict[str, Array]) -> None:
    rng = np.random.default_rng(3)
    truth = np.repeat(np.linspace(20.0, 600.0, 100), 60)
    values = truth * (1.0 + 0.02 * rng.normal(size=len(truth))) + 2.0 * rng.normal(size=len(truth))
    rows = {k: np.resize(v, len(truth)) for k, v in ride.items()} | {"time_s": 10.0 * np.arange(len(truth))}
    constant, relative = loss_noise([recording_of(rows, {"P_loss": values})])
    assert constant == pytest.approx(2.0, abs=0.6)
    assert relative == pytest.approx(0.02, abs=0.002)


def test_noise_needs_no_floor(model: NetworkOnGrid, piece: Piece, problem: Problem) -> None:
    quiet = Noise(
        channel_sd=np.full(4, 0.1), floor_sd=np.zeros(4), loss_relative_sd=0.01, heat_sd=np.zeros(model.n),
        heat_time=100.0, start_sd=np.ones(model.n),
    )  # fmt: skip
    part = problem.linearise(0, np.zeros(len(problem.unknowns)), None)
    white = Whitening(model, part.trajectory, part.sensors, quiet)(part.residual[:, :, None])
    assert np.isfinite(white).all()
