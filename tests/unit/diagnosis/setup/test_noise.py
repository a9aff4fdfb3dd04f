"""The assumed noise of a recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.forward.grid import Piece
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.setup.noise import channel_noise, display_noise, left_by_rounding, loss_noise, noise_of
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from tests.unit.diagnosis.inference_example import CHANNELS, recorded, recording_of


def test_loss_noise_has_a_constant_and_a_relative_part(ride: dict[str, Array]) -> None:
    rng = np.random.default_rng(3)
    truth = np.repeat(np.linspace(20.0, 600.0, 100), 60)
    values = truth * (1.0 + 0.02 * rng.normal(size=len(truth))) + 2.0 * rng.normal(size=len(truth))
    rows = {k: np.resize(v, len(truth)) for k, v in ride.items()} | {"time_s": 10.0 * np.arange(len(truth))}
    constant, relative = loss_noise([recording_of(rows, {"P_loss": values})])
    assert constant == pytest.approx(2.0, abs=0.6)
    assert relative == pytest.approx(0.02, abs=0.002)


def test_watts_are_no_start_temperature(model: NetworkOnGrid, piece: Piece) -> None:
    """How uncertain an unmeasured start is goes with how hot the gearbox is, whatever it loses."""
    white = dict.fromkeys(CHANNELS, 0.2) | {"P_loss": 5.0}
    watts, hot = np.array(piece.measured), np.array(piece.measured)
    watts[0, CHANNELS.index("P_loss")] = 700.0
    hot[0, CHANNELS.index("oil")] = 92.0
    given = [replace(piece, measured=one) for one in (piece.measured, watts, hot)]
    covariances = [noise_of(model, one, white, 250.0).start for one in given]
    sd = [np.sqrt(np.diag(one)) for one in covariances]
    np.testing.assert_array_equal(covariances[1], covariances[0])
    unknown = [index for index, name in enumerate(model.parts) if name not in CHANNELS]
    assert (sd[0][unknown] < 4.0).all()  # everything is near the air of 22 degC
    assert (sd[2][unknown] > 10.0).all() and (sd[2][unknown] < 15.0).all()


def test_a_display_is_off_by_up_to_half_its_step(ride: dict[str, Array]) -> None:
    recording = recording_of(ride, {name: np.zeros(len(ride["time_s"])) for name in ("oil", "bearing_1")})
    stated = tuple(replace(c, resolution=0.5) if c.name == "oil" else c for c in recording.channels)
    tested = replace(recording, channels=stated)
    for every in ([tested], [tested, recording], [recording, tested]):  # one whose step is unknown is no finer one
        found = display_noise(every, ("oil", "bearing_1", "P_loss"), {"oil": 0.1, "bearing_1": 0.1}, 2.0)
        np.testing.assert_allclose(found, [0.5 / np.sqrt(12.0), 0.0, 0.0])
    assert display_noise([tested], ("oil",), {"oil": 0.3}, 0.0) < 0.002


@pytest.mark.parametrize("noise", [0.05, 0.1, 0.2])
def test_noise_lets_a_mean_read_between_the_steps_of_a_display(noise: float) -> None:
    """Against drawn readings, in steps of the display; without noise see the test above."""
    step, rng = 0.5, np.random.default_rng(1)
    true = rng.uniform(0.0, step, 2000)
    read = step * np.round((true[:, None] + noise * rng.standard_normal((2000, 4000))) / step)
    one = float((read - true[:, None]).std())
    of_means = np.hypot(left_by_rounding(step, one), one / np.sqrt(4000.0))
    assert of_means == pytest.approx((read.mean(axis=1) - true).std(), rel=0.05)


def test_noise_of_many_short_pieces_is_that_of_all(fzg: Gearbox) -> None:
    made = recorded(fzg, "made", hours=5.0)
    pieces = tuple(slice(first, first + 5) for first in range(0, 1800, 6))
    short = replace(made, segments=pieces)
    assert channel_noise([short], ["oil"])["oil"] == pytest.approx(0.1, rel=0.1)
    assert channel_noise([replace(made, segments=(*pieces[:10], slice(60, 1800)))], ["oil"])["oil"] < 0.12
