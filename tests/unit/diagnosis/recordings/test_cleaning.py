"""Cleaning of recorded columns: holes, outliers, dropouts, hanging sensors and the resolution."""

from __future__ import annotations

import numpy as np
import pytest

from diagnosis.recordings.cleaning import bridged, dropouts, outliers, resolution_of, steady_rows, stuck_rows


def test_a_slowly_sampled_input_is_no_row_of_holes() -> None:
    time = np.arange(0.0, 1000.0, 10.0)
    values = np.where(np.arange(100) % 20 == 0, time, np.nan)
    filled, known = bridged(time, values, 60.0)
    np.testing.assert_allclose(filled[:81], time[:81])
    assert known.all()


def test_outliers_go_and_steps_waves_and_noise_stay() -> None:
    rng = np.random.default_rng(0)
    values = 40.0 + rng.normal(0.0, 0.2, 500)
    values[200:] += 30.0
    values[300:360] += 12.0 * np.sin(np.linspace(0.0, np.pi, 60))
    assert not outliers(values, least=8.0).any()
    values[[100, 250, 251, 400]] += [60.0, -50.0, -50.0, 9.0]
    assert np.flatnonzero(outliers(values, least=8.0)).tolist() == [100, 250, 251, 400]


def test_the_top_of_a_sharp_wave_is_no_outlier() -> None:
    """From a nacelle's temperature while a fan runs, ten minutes from row to row."""
    values = np.concatenate([np.full(30, 28.0), [27.85, 15.94, 11.88, 13.78, 20.4], np.full(30, 26.0)])
    values += 0.3 * np.sin(np.arange(len(values)))
    assert not outliers(values, least=8.0).any()


def test_dropouts_to_a_constant_go_and_a_hanging_sensor_stays() -> None:
    values = 60.0 + 0.1 * (np.arange(400) % 7)
    values[100:150] = 0.0
    values[300:] = values[300]
    values[200:220] = [80.0] * 10 + [100.0] * 10  # a start in steps, not away and back
    values[220:] += 60.0
    assert np.flatnonzero(dropouts(values)).tolist() == list(range(100, 150))
    time = 60.0 * np.arange(400.0)
    other = 40.0 + 0.05 * np.arange(400.0)
    first, end, which, moved = stuck_rows(time, {"oil": values, "pinion": other})["oil"]
    assert (first, end, which) == (300, 400, "pinion")
    assert moved == pytest.approx(99 * 0.05)


@pytest.mark.parametrize(
    ("rows", "step", "slope", "hangs"),
    [(31, 60.0, 0.1, True), (30, 60.0, 0.1, False), (31, 60.0, 0.06, False), (19, 120.0, 0.2, False)],
)
def test_a_hanging_sensor(rows: int, step: float, slope: float, hangs: bool) -> None:
    """Equal for 20 rows and half an hour while another moves by more than 2 K."""
    values, other = 60.0 + 0.1 * np.arange(200.0), 40.0 + slope * np.arange(200.0)
    values[100 : 100 + rows] = values[100]
    found = stuck_rows(step * np.arange(200.0), {"oil": values, "pinion": other})
    assert found == ({"oil": (100, 100 + rows, "pinion", pytest.approx(slope * (rows - 1)))} if hangs else {})


@pytest.mark.parametrize("quantum", [0.1, 0.0625, 1.0, 0.25 * 5.0 / 9.0])
def test_the_resolution_is_found(quantum: float) -> None:
    values = quantum * np.round(np.random.default_rng(0).normal(300.0, 20.0, 500) / quantum)
    assert resolution_of(values) == pytest.approx(quantum, rel=1e-5)
    assert resolution_of(values[:1]) == 0.0
    assert resolution_of(np.concatenate([values, values + 1e-9])) == pytest.approx(quantum, rel=1e-4)  # converted twice


def test_a_hole_in_an_input_makes_no_other_row_steady() -> None:
    speed = np.full(400, 500.0)
    speed[100:102] = 3000.0
    whole = steady_rows({"speed": speed})
    speed[350] = np.nan
    holed = steady_rows({"speed": speed})
    assert not whole[100] and whole[300]
    np.testing.assert_array_equal(holed[:300], whole[:300])
    assert not holed[350]
