"""A machine that begins cold has one temperature; one that begins warm is as its thermometers show it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.forward.grid import Piece
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.recordings.cold_start import is_isothermal
from diagnosis.setup.start import start_covariance, start_guess
from models.base.types import Array
from tests.unit.diagnosis.inference_example import CHANNELS


def spread(covariance: Array, of: Array) -> float:
    """Standard deviation of a weighted sum of start temperatures, [K]."""
    return float(np.sqrt(of @ covariance @ of))


@pytest.mark.parametrize(
    ("readings", "expected"),
    [
        pytest.param([20.5, 20.9, 20.3, 24.0], True, id="one thermometer of four is off"),
        pytest.param([21.5, 21.9, 21.8, 25.0], False, id="oil that cools down last"),
        pytest.param([20.2, 20.6, 24.0], False, id="of three it may be the machine"),
        pytest.param([21.0, 21.4], True, id="two that agree"),
        pytest.param([21.0], False, id="one alone"),
        pytest.param([20.2, 20.6, 20.0, 26.0], False, id="a preheated part"),
        pytest.param([20.0, 20.2, 23.0, 17.0], False, id="two are off"),
        pytest.param([50.0, 50.5, 50.2, 50.1], False, id="in operation"),
    ],
)
def test_readings_of_a_machine_that_stood_still_agree(readings: list[float], expected: bool) -> None:
    assert is_isothermal(readings, 20.0) == expected


def test_a_cold_machine_is_known_better_in_differences_than_as_a_whole(model: NetworkOnGrid, piece: Piece) -> None:
    measured = np.array(piece.measured)
    measured[0, :3] = 22.0, 22.3, 23.4
    one = replace(piece, measured=measured)
    np.testing.assert_array_equal(start_guess(model, one), 22.3)
    covariance = start_covariance(model, one)
    difference = np.zeros(model.n)
    difference[:2] = 1.0, -1.0
    above_air = 22.3 - piece.inputs[0, model.laws.inputs.index("T_ambient")]
    assert spread(covariance, difference) == pytest.approx(np.sqrt(2.0) * (0.3 + 0.1 * above_air))
    assert spread(covariance, np.full(model.n, 1.0 / model.n)) == pytest.approx(2.0, rel=0.01)


def test_a_warm_machine_is_as_measured(model: NetworkOnGrid, piece: Piece) -> None:
    measured = np.array(piece.measured)
    measured[0, :3] = 60.0, 52.0, 70.0
    one = replace(piece, measured=measured)
    guess = start_guess(model, one)
    np.testing.assert_allclose([guess[model.part_index(name)] for name in CHANNELS[:3]], [60.0, 52.0, 70.0])
    covariance = start_covariance(model, one)
    np.testing.assert_array_equal(covariance, np.diag(np.diag(covariance)))
    assert np.sqrt(np.diag(covariance)).min() == pytest.approx(2.0)


def test_a_part_without_a_reading_is_between_its_neighbours(model: NetworkOnGrid, piece: Piece) -> None:
    """By its conductances, and by the air."""
    measured = np.full_like(piece.measured, np.nan)
    measured[0, :3] = 60.0, 60.0, 60.0
    guess = start_guess(model, replace(piece, measured=measured))
    ambient = piece.inputs[0, model.laws.inputs.index("T_ambient")]
    seen = {model.part_index(name) for name in CHANNELS[:3]}
    others = [guess[i] for i in range(model.n) if i not in seen]
    assert all(ambient < T <= 60.0 + 1e-6 for T in others)
    gears = guess[model.parts.index("wheel")]  # in the oil, far from the air
    upper = guess[model.parts.index("housing_upper")]  # gives heat to the air
    assert upper < gears - 0.5
