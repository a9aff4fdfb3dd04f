"""A broken thermistor of a real recording is set apart; sound ones are not, and the parameters stay in their priors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import hypothesis_of
from diagnosis.engine import set_apart, to_predict
from diagnosis.engine.calibration import calibrate_with_error
from diagnosis.engine.fit import Experiment, Fit, calibrate
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.refit import refit
from diagnosis.engine.scan import scan
from diagnosis.engine.set_apart import calibrate_apart, without_channels
from diagnosis.engine.to_predict import calibrated_to_predict, refit_to_predict
from diagnosis.engine.unknown import SensorBias
from diagnosis.forward.whitening import AS_ASSUMED, RandomHeat
from diagnosis.recordings.read import read_recordings
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.types import Array
from models.mechanisms import CATALOGUE, Scale
from tests.unit.diagnosis.inference_example import recorded

DATA = Path(__file__).parents[4] / "examples" / "data"
BROKEN = "cell_6__NTC7"


@cache
def rod() -> tuple[Experiment, Fit]:
    gearbox = load_gearbox("heated_rod")
    recordings = read_recordings([f"{DATA / 'heated_rod.csv.gz'}@0..10800"], gearbox.network())
    experiment = prepare_experiment(gearbox, recordings, recordings)[1]
    return experiment, calibrate(experiment)


def test_a_broken_sensor_is_set_apart_and_pulls_nothing_to_its_bounds() -> None:
    experiment, plain = rod()
    fit, apart = calibrate_apart(experiment, plain)
    assert apart == (BROKEN,)
    assert np.abs(plain.z).max() > 10.0  # what it does to a calibration with it
    assert np.abs(fit.z).max() < 4.0


def test_sound_sensors_are_not_set_apart() -> None:
    experiment, _ = rod()
    sound = without_channels(experiment, [BROKEN])
    plain = calibrate(sound)
    fit, apart = calibrate_apart(sound, plain)
    assert apart == ()
    assert fit is plain


def with_broken(fzg: Gearbox, broken: Callable[[Array, Array], Array]) -> Experiment:
    """Five hours with a bearing's thermometer that reads something of its time and values; noise of 0.1 K."""
    made = recorded(fzg, "made", hours=5.0, nodes=("oil", "housing_lower", "housing_upper", "bearing_1", "pinion"))
    channels = [replace(c, values=broken(made.time, c.values)) if c.name == "bearing_1" else c for c in made.channels]
    return prepare_experiment(fzg, [replace(made, channels=tuple(channels))], [made])[1]


@pytest.mark.parametrize(("broken", "bent"), [
    (lambda time, T: T + 25.0 * (time > 7200.0), ("SUSPECT",)),  # the start misses it most
    (lambda time, T: np.where(np.abs(time - 7200.0) < 3600.0, T[360], T), ("SUSPECT", "SUSPECT_AT_START")),
])  # fmt: skip
def test_a_broken_sensor_is_a_suspect_by_the_start_and_by_standing_still(
    fzg: Gearbox, broken: Callable[[Array, Array], Array], bent: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where a calibration has bent itself round it, so that the other signs are missing."""
    for name in bent:
        monkeypatch.setattr(set_apart, name, np.inf)
    experiment = with_broken(fzg, broken)
    assert calibrate_apart(experiment, calibrate(experiment))[1] == ("bearing_1",)


def test_what_is_wrong_with_a_channel_that_was_apart_is_found(fzg: Gearbox) -> None:
    """Its readings are back in a fit that never saw them, far from an optimum."""
    too_high = with_broken(fzg, lambda _, T: 1.6 * T)
    base = calibrate_with_error(too_high, calibrate(without_channels(too_high, ["bearing_1"])), ["bearing_1"]).fit
    placed = CATALOGUE["sensor_gain"].placed(too_high.machine.model.network, Scale.of(fzg), too_high.pieces[0].channels)
    scanned = scan(base, [hypothesis_of(one) for one in placed if one.place == "bearing_1"])
    strength = float(scanned.singles(scanned.gram.given(scanned.unknowns)).value[0])
    found = refit(base, scanned.candidates[0], scanned.best[0], strength)
    assert found.experiment.unknowns[-1].value(float(found.z[-1])) == pytest.approx(0.6, abs=0.02)
    assert found.log_evidence > base.log_evidence + 1000.0


def test_how_far_a_session_may_deviate_the_sound_channels_say_for_all() -> None:
    gearbox = load_gearbox("heated_rod")
    path = DATA / "heated_rod.csv.gz"
    train, healthy = read_recordings([f"{path}@0..5400", f"{path}@14400..19800"], gearbox.network())
    experiment = prepare_experiment(gearbox, [train], [train], [healthy])[1]
    found = calibrate_with_error(experiment, calibrate(without_channels(experiment, [BROKEN])), [BROKEN])
    assert found.of_others is not None and found.of_others.near.experiment.most_deviation == 0.2  # of one baseline
    assert found.near.experiment.most_deviation == 0.2 < experiment.most_deviation


def test_a_fit_without_error_keeps_the_values_of_faulty_sensors_and_has_the_assumed_random_heat(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    experiment, plain = rod()
    fit, apart = calibrate_apart(experiment, plain)
    at = next(i for i, u in enumerate(experiment.unknowns) if isinstance(u, SensorBias) and u.channel == BROKEN)
    z = fit.z.copy()
    z[at] = 9.0
    bent = next(i for i, u in enumerate(experiment.unknowns) if isinstance(u, SensorBias) and u.channel != BROKEN)
    z[bent] += 5.0  # by the broken one
    less = experiment.with_random_heat(RandomHeat(heat=0.25, wander=0.25))
    given = less.with_filters(plain.parts).fit(z, iterations=0)
    found = refit_to_predict(given, fit, apart)
    assert found.z[at] == 9.0
    assert found.experiment.noise == experiment.noise and found.experiment.random_heat == AS_ASSUMED
    assert np.delete(found.z, at) == pytest.approx(np.delete(calibrated_to_predict(fit, fit).z, at), abs=0.3)
    monkeypatch.setattr(to_predict, "all_sizes_are_unknown", lambda *_: False)  # where instruments stay
    found = refit_to_predict(given, fit, apart)
    assert found.z[at] == 9.0 and found.z[bent] == fit.z_in(given.experiment)[bent]
