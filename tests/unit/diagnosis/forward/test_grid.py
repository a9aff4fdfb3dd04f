"""The working grid: fine where something happens, coarse where nothing does, and nothing lost by it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from diagnosis.forward.free_running import free_running
from diagnosis.forward.grid import FREE_S, INTERVAL_S, LONGEST, SAMPLES, Piece, pieces, stands_for, too_short, white_sd
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.recurrence import lagged
from diagnosis.recordings.recording import Recording
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.mechanisms import CATALOGUE, Scale
from tests.unit.diagnosis.inference_example import recording_with

INPUTS = ("speed", "torque", "T_ambient", "air_speed")
TIME = np.arange(0.0, 7201.0, 10.0)
COARSE = LONGEST * INTERVAL_S


def recorded(time: Array, speed: Array | float = 1500.0, oil: Array | None = None) -> Recording:
    return recording_with(time, {} if oil is None else {"oil": oil}, speed=speed, torque=120.0)


def piece_of(
    time: Array = TIME, *, speed: Array | float = 1500.0, oil: Array | None = None, even: bool = False
) -> Piece:
    (found,) = pieces([recorded(time, speed, oil)], INPUTS, () if oil is None else ("oil",), even=even)
    return found


def step_at(piece: Piece, time: float) -> float:
    return float(piece.steps[np.searchsorted(piece.time, time, side="right") - 1])


def test_fine_where_the_operation_jumps() -> None:
    piece = piece_of(speed=np.where(TIME < 3000.0, 1500.0, 2500.0))
    assert step_at(piece, 2985.0) == step_at(piece, 3005.0) == step_at(piece, 3045.0) == INTERVAL_S
    assert step_at(piece, 2500.0) == step_at(piece, 4000.0) == COARSE
    assert piece.time[0] == 0.0
    assert piece.time[-1] == 7200.0


def test_a_stop_in_the_last_row_is_not_cut_off() -> None:
    """Ten seconds are left of the last interval: they count if the machine stops in them."""
    time = TIME[:-1]
    assert piece_of(time).time[-1] == 7180.0
    stops = piece_of(time, speed=np.where(time < 7190.0, 1500.0, 0.0))
    assert stops.time[-2:].tolist() == [7180.0, 7190.0]
    assert stops.inputs[-1, 0] == pytest.approx(750.0) and stops.inputs[-2, 0] == 1500.0


def test_pieces_that_are_too_short_are_told() -> None:
    """Eight rows of 10 s have four grid points."""
    whole = recorded(TIME)
    torn = replace(whole, segments=(slice(0, 600), slice(600, 608), slice(608, 721)))
    assert list(too_short([whole], pieces([whole], INPUTS, ()))) == []
    (note,) = too_short([torn], pieces([torn], INPUTS, ()))
    assert note == "made: 1 of 3 pieces without gaps are too short to simulate and not used"


def test_a_drift_is_followed() -> None:
    """Within an interval inputs change by a hundredth at most."""
    speed = 1500.0 * (1.0 + 0.3 * np.sin(TIME / 1500.0))
    piece = piece_of(speed=speed)
    ranges = np.ptp(piece.samples[..., 0], axis=1)
    longer = piece.steps > INTERVAL_S
    assert longer.any()
    assert ranges[longer].max() < 0.0125 * np.percentile(speed, 95)  # means over cells are compared, not rows


@pytest.mark.parametrize("step", [1.0, 10.0, 15.0, 30.0])
def test_noise_of_the_inputs_and_slow_rows_leave_the_grid_coarse(step: float) -> None:
    """The reading of a speed trembles by 1 %; rows up to a minute apart are merged in a calm, as shorter ones are."""
    time = np.arange(0.0, 7201.0, step)
    steps = np.where(time < 3000.0, 1500.0, 2500.0)
    piece = piece_of(time, speed=steps * (1.0 + np.random.default_rng(0).normal(0.0, 0.003, len(time))))
    calm = piece.steps[(piece.middle > 1000.0) & (piece.middle < 2900.0)]
    assert calm.max() == LONGEST * INTERVAL_S // step * step
    assert calm.mean() > 60.0
    assert step_at(piece, 3005.0) == max(step, INTERVAL_S if step <= 10.0 else 0.0)
    assert len(piece.steps) < 7200.0 / INTERVAL_S / 2


def test_noise_is_no_event_and_a_corner_is_one() -> None:
    rng = np.random.default_rng(0)
    noise = rng.normal(0.0, 0.2, len(TIME))
    drift = 40.0 + 20.0 * (1.0 - np.exp(-TIME / 4000.0))
    assert len(piece_of(oil=drift + noise).steps) < len(TIME) / 2 / 4
    corner = drift + np.maximum(TIME - 4000.0, 0.0) * 1.0 / 60.0  # a cooler that closes: 1 K/min from then on
    assert step_at(piece_of(oil=corner + noise), 4005.0) == INTERVAL_S


def test_what_a_jump_bends_is_smooth_and_needs_no_fine_grid() -> None:
    speed = np.where(TIME < 3000.0, 1500.0, 2500.0)
    after = np.maximum(TIME - 3000.0, 0.0)
    settling = 40.0 + 20.0 * (1.0 - np.exp(-after / 150.0))
    assert step_at(piece_of(speed=speed, oil=settling), 3500.0) == COARSE
    assert step_at(piece_of(oil=settling), 3100.0) == INTERVAL_S  # without a jump of the inputs it may be a switch


def test_a_switch_that_acts_soon_after_a_jump_is_not_jumped_over() -> None:
    """Ever longer intervals follow a jump, but none across a peak."""
    speed = np.where(TIME < 3000.0, 1500.0, 2500.0)
    heating = 40.0 + np.maximum(TIME - 3000.0, 0.0) / 60.0
    noise = np.random.default_rng(0).normal(0.0, 0.2, len(TIME))
    peak = heating - np.maximum(TIME - 3520.0, 0.0) * 3.0 / 60.0  # 520 s later a cooler opens
    piece = piece_of(speed=speed, oil=peak + noise)
    assert step_at(piece_of(speed=speed, oil=heating + noise), 3525.0) > 2 * INTERVAL_S
    assert piece.measured[:, 0].max() > peak.max() - 0.4


def test_measurements_are_those_of_the_rows_around() -> None:
    """Of a straight line nothing is lost, however long the intervals beside a grid point are."""
    piece = piece_of(speed=np.where(TIME < 3000.0, 1500.0, 2500.0), oil=30.0 + TIME / 300.0)
    assert len(set(piece.steps)) > 2
    np.testing.assert_allclose(piece.measured[1:-1, 0], 30.0 + piece.time[1:-1] / 300.0, atol=1e-9)
    assert piece.counts.sum() == len(TIME)


def test_time_that_grid_points_stand_for() -> None:
    piece = piece_of(speed=np.where(TIME < 3000.0, 1500.0, 2500.0))
    assert stands_for(piece.time).sum() == pytest.approx(7200.0)
    assert piece_of(even=True).steps.tolist() == [INTERVAL_S] * 360


def test_finer_has_the_same_inputs() -> None:
    speed = np.where(TIME < 3000.0, 1500.0, 2500.0) + TIME / 100.0
    piece = piece_of(speed=speed)
    fine, at = piece.finer()
    assert set(fine.steps) == {FREE_S}
    np.testing.assert_array_equal(fine.time[at], piece.time)
    for k in range(len(piece.steps)):
        assert fine.inputs[at[k] : at[k + 1], 0].mean() == pytest.approx(piece.inputs[k, 0])
    slow = piece_of(np.arange(0.0, 60001.0, 600.0))
    fine, at = slow.finer()
    assert set(np.diff(at)) == {2 * SAMPLES}
    np.testing.assert_allclose(fine.steps, 300.0 / SAMPLES)


def test_switches_run_free_as_on_an_even_grid(fzg: Gearbox) -> None:
    (placed,) = CATALOGUE["cooler_thermostat"].placed(fzg.network(), Scale.of(fzg, speed=1500.0, torque=120.0))
    model = NetworkOnGrid(placed.apply(fzg.network()), fzg.losses())
    values = model.start.copy()
    for name, value in (("strength", 25.0), ("set_point", 45.0)):
        values[[p.name for p in model.network.parameters].index(f"{placed.label}_{name}")] = value
    time = np.arange(0.0, 14401.0, 10.0)
    coarse, even = piece_of(time), piece_of(time, even=True)
    assert len(coarse.steps) < len(even.steps) / 4
    oil = model.parts.index("oil")
    found, expected = (free_running(model, p, values, np.full(model.n, 25.0)) for p in (coarse, even))
    switched = np.abs(np.diff(expected.memory[:, model.switches[0]])).sum()
    assert switched > 4  # on and off, again and again
    expected_there = np.interp(coarse.time, even.time, expected.T[:, oil])
    np.testing.assert_allclose(found.T[:, oil], expected_there, atol=1e-9)  # both run in steps of FREE_S


def test_a_slow_sensor_guides_switches_by_what_it_does_not_show_yet() -> None:
    true = 40.0 + 0.04 * TIME + 3.0 * np.sin(TIME / 200.0)
    even = piece_of(oil=true, even=True)
    at = np.interp(even.time, TIME, true)
    shown = lagged(at, even.steps, 60.0)
    assert np.abs(shown - at).max() > 2.0
    piece = replace(even, measured=shown[:, None], lags=np.array([60.0]))
    assert np.abs(piece.guide(("oil",))[:, 0] - at)[5:-1].max() < 0.1
    assert np.abs(replace(piece, lags=None).guide(("oil",))[:, 0] - at)[5:].max() > 2.0
    assert np.isnan(replace(piece, guided=False).guide(("oil",))).all()


def test_noise_hides_no_peak_that_a_switch_has_made() -> None:
    """Of 39 peaks at 70 and 40 valleys at 64 degC every one counts as reached; of the means a third of the peaks do."""
    time = np.arange(0.0, 24001.0, 10.0)
    saw = 67.0 + 3.0 * (2.0 * np.abs(2.0 * ((time / 600.0) % 1.0) - 1.0) - 1.0)
    oil = saw + np.random.default_rng(1).normal(0.0, 0.2, len(time))
    piece = replace(piece_of(time, oil=oil, even=True), guided=True)
    seen, measured = piece.guide(("oil",))[:, 0], piece.measured[:, 0]

    def around(signal: Array, first: int) -> list[Array]:
        return [signal[np.abs(piece.time - t) < 100.0] for t in range(first, 24000, 600)]

    assert all(peak.max() > 70.0 for peak in around(seen, 600))
    assert all(valley.min() < 64.0 for valley in around(seen, 300))
    assert sum(peak.max() > 70.0 for peak in around(measured, 600)) < 20
    away = np.abs((piece.time % 300.0) - 150.0) < 90.0
    assert np.abs(seen - measured)[away].mean() < 0.15


def test_a_switch_acts_for_its_share_of_an_interval(fzg: Gearbox) -> None:
    (placed,) = CATALOGUE["cooler_thermostat"].placed(fzg.network(), Scale.of(fzg, speed=1500.0, torque=120.0))
    model = NetworkOnGrid(placed.apply(fzg.network()), fzg.losses())
    names = [p.name for p in model.network.parameters]
    values = model.start.copy()
    values[names.index(f"{placed.label}_set_point")], values[names.index(f"{placed.label}_band")] = 60.0, 4.0
    piece = piece_of(np.arange(0.0, 101.0, 10.0), even=True)
    seen = np.full((len(piece.time), model.n), 50.0)
    seen[:, model.parts.index("oil")] = [58.0, 61.0, 63.0, 59.0, 57.0, 57.0]  # on at 62, off at 58
    power = np.zeros((len(piece.steps), len(model.laws.components)))
    np.testing.assert_allclose(model.memory(piece, seen, seen, values, power)[:, 0], [0.0, 0.5, 1.0, 0.5, 0.0])


def test_the_first_minutes_of_a_piece() -> None:
    piece = piece_of(oil=30.0 + TIME / 300.0)
    early = piece.until(600.0)
    assert early.time[-1] <= 600.0 < piece.time[len(early.time)]
    assert len(early.steps) == len(early.samples) == len(early.measured) - 1 == len(early.counts) - 1
    assert len(piece.until(0.0).steps) == 1


def test_a_pulsating_input_keeps_its_mean() -> None:
    time = np.arange(0.0, 3601.0, 1.0)
    for phase in range(4):  # on for 1 s of 4 s, which the parts of an interval would alias
        pulses = np.where((time.astype(int) + phase) % 4 == 0, 2000.0, 0.0)
        piece = piece_of(time, speed=pulses, even=True)
        np.testing.assert_allclose(piece.inputs[:, 0], 500.0, atol=1e-9)


def test_noise_of_a_channel_with_gaps_is_that_of_its_values() -> None:
    values = np.random.default_rng(0).normal(0.0, 0.3, 4000)
    sparse = np.where(np.arange(4000) % 5 == 0, values, np.nan)
    assert white_sd(sparse) == pytest.approx(0.3, rel=0.1)


@pytest.mark.parametrize("noise", [0.05, 0.07, 0.08, 0.1, 0.15, 0.2])
def test_noise_of_a_display_is_that_of_its_values(noise: float) -> None:
    """Its differences are whole steps, so their median is one step for noise of 0.05 and of 0.08 alike."""
    values = np.linspace(20.0, 60.0, 4000) + np.random.default_rng(0).normal(0.0, noise, 4000)
    shown = np.round(10.0 * values) / 10.0
    assert white_sd(shown) == pytest.approx(np.hypot(noise, 0.1 / np.sqrt(12.0)), rel=0.05)


def test_a_display_that_hardly_moves_has_no_noise() -> None:
    assert white_sd(np.round(np.linspace(20.0, 30.0, 4000), 1)) == 0.0 == white_sd(np.full(100, 20.0))


@pytest.mark.parametrize("unit_s", [60.0, 3600.0, 86400.0])
def test_times_that_are_rounded_in_another_unit_end_with_the_last_row(unit_s: float) -> None:
    for rows in range(101, 401, 7):
        time = np.array([float(f"{2.0 * row / unit_s:.12g}") for row in range(rows)]) * unit_s
        assert time[-1] - INTERVAL_S < piece_of(time).time[-1] <= time[-1]
