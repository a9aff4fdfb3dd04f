"""Numbers of a switch, looked for by scans of a grid."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from diagnosis.candidates.hypotheses import Hypothesis, hypothesis_of
from diagnosis.decision.infer import _fitted_on
from diagnosis.decision.posterior import Judged
from diagnosis.engine import switch_grid
from diagnosis.engine.calibration import Calibration
from diagnosis.engine.fit import Experiment, Fit, calibrate
from diagnosis.engine.learnt import error_classes
from diagnosis.engine.refit import refit, with_candidate
from diagnosis.engine.switch_grid import held_numbers, refined, switch_numbers, with_refined_switches
from models.assembly.gearbox import Gearbox
from models.mechanisms import CATALOGUE, Placed, Scale
from tests.unit.diagnosis.inference_example import acting

TRUE = {"strength": 25.0, "set_point": 43.0, "band": 4.0, "coolant": 27.0, "delay": 15.0}


@pytest.fixture(scope="module")
def cooler(fzg: Gearbox, experiment: Experiment) -> Placed:
    return CATALOGUE["cooler_thermostat"].placed(
        experiment.machine.model.network, Scale.of(fzg, speed=2600.0, torque=150.0)
    )[0]


@pytest.fixture(scope="module")
def without(experiment: Experiment, cooler: Placed) -> Fit:
    """The machine calibrated without its cooler."""
    return calibrate(acting(experiment, cooler, TRUE))


def distance(one: Hypothesis) -> tuple[float, float]:
    """Of set-point and band from the true ones, [K]."""
    return abs(float(one.variants[0, 1]) - TRUE["set_point"]), abs(float(one.variants[0, 2]) - TRUE["band"])


def test_what_switches_by_numbers_that_are_not_exact(cooler: Placed, experiment: Experiment, fzg: Gearbox) -> None:
    assert [cooler.parameters[i].name for i in switch_numbers(cooler)] == [
        "cooler_thermostat_oil_set_point", "cooler_thermostat_oil_band"]  # fmt: skip
    assert held_numbers(experiment, [hypothesis_of(cooler)], 40) == [41, 42]
    minutes = replace(experiment, pieces=tuple(replace(piece, slow=True) for piece in experiment.pieces))
    assert held_numbers(minutes, [hypothesis_of(cooler)], 40) == []
    (tank,) = CATALOGUE["oil_tank"].placed(experiment.machine.model.network, Scale.of(fzg))
    assert switch_numbers(tank) == []


def test_numbers_of_a_switch_are_found_between_the_grid(without: Fit, cooler: Placed) -> None:
    coarse = hypothesis_of(cooler)
    near = np.abs(coarse.variants[:, 1] - TRUE["set_point"]) + np.abs(coarse.variants[:, 2] - TRUE["band"])
    found, strength = refined(without, coarse, [int(np.argmin(near))])
    assert len(found.variants) == 1 and strength > 10.0
    assert max(distance(found)) < 1.0 < 10.0 < near.min()


def test_a_fit_begins_at_refined_numbers(without: Fit, cooler: Placed) -> None:
    """From the nearest shape of the grid, 9 K beside, a fit would never come to it."""
    coarse = hypothesis_of(cooler)
    nearest = int(np.argmin(np.abs(coarse.variants[:, 1] - TRUE["set_point"])))
    assert abs(coarse.variants[nearest, 1] - TRUE["set_point"]) > 9.0
    found = refit(without, coarse, nearest, TRUE["strength"])
    assert found.experiment.unknowns[-4].value(float(found.z[-4])) == pytest.approx(TRUE["set_point"], abs=1.0)


@pytest.fixture(scope="module")
def beside(without: Fit, cooler: Placed) -> tuple[Fit, Hypothesis]:
    """A fit that ended at other numbers of the switch, and the effect in it."""
    row = np.array([[1.0, TRUE["set_point"] + 1.0, 1.3 * TRUE["band"], TRUE["coolant"], TRUE["delay"]]])
    effect = replace(hypothesis_of(cooler), variants=row)
    experiment, z = with_candidate(without, effect, 0)
    z[0] = experiment.unknowns[len(without.z)].z_of(TRUE["strength"])
    held = held_numbers(experiment, [effect], len(without.z))
    return experiment.fit(np.concatenate([without.z, z]), without.trajectories, held=held), effect


def test_a_fit_that_ended_beside_them_is_continued_there(without: Fit, beside: tuple[Fit, Hypothesis]) -> None:
    fit, effect = beside
    assert with_refined_switches(fit, [effect], len(without.z)).objective < fit.objective - 10.0


def test_numbers_that_a_scan_hardly_betters_are_not_fitted_again(
    without: Fit, beside: tuple[Fit, Hypothesis], monkeypatch: pytest.MonkeyPatch
) -> None:
    fit, effect = beside
    monkeypatch.setattr(switch_grid, "LEAST_GAIN", 1e6)
    assert with_refined_switches(fit, [effect], len(without.z)) is fit


def test_an_explanation_is_fitted_on_with_refined_switches(without: Fit, beside: tuple[Fit, Hypothesis]) -> None:
    """Where the fit alone has ended."""
    fit, effect = beside
    one = Judged(effects=(effect,), log_bayes=0.0, error_class=error_classes()[0], fit=fit)
    chosen = SimpleNamespace(log_evidence=without.log_evidence, error_class=one.error_class)
    calibration = cast(Calibration, SimpleNamespace(fit=without, chosen=chosen))
    places = held_numbers(without.experiment, [effect], len(without.z))
    ended = min(fit.experiment.fit(fit.z, at=fit.linearised, held=held).objective for held in ((), places))
    assert _fitted_on(calibration, one).fitted.objective < ended - 10.0
