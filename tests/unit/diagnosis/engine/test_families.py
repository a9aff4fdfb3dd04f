"""Changes at a date in simulated recordings: columns, scan, date and refit; unknown heat; the prior."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
import sympy as sp

from diagnosis.candidates.dated import Axis
from diagnosis.candidates.hypotheses import How, Hypothesis
from diagnosis.engine.families import axis_of, candidates_of, with_priors
from diagnosis.engine.fit import Experiment, Fit, calibrate
from diagnosis.engine.outside import judge_outside, outside_of
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.refit import refit, with_candidate
from diagnosis.engine.scan import Scan, columns_of, scan
from diagnosis.recordings.recording import Recording
from diagnosis.setup.inference_setup import InferenceSetup
from models.assembly.gearbox import Gearbox
from models.base.types import Array
from models.mechanisms import CATALOGUE
from models.network.laws import symbol
from tests.unit.diagnosis.inference_example import recorded, recording_of

NODES = ("oil", "housing_lower", "housing_upper", "bearing_1", "pinion")
CHANGE, SINCE_S = -0.25, 9_100.0
AIR, LOOKED_FOR = "air_cooling_step@housing_air", ("air_cooling_change", "windage", "sensor_bias", "radiation_error")


def simulated(fzg: Gearbox, name: str, hours: float, seed: int, since: float | None) -> Recording:
    """A recording in which the conductance from housing to air falls at a time; None: not at all."""
    time = np.arange(0.0, 3600.0 * hours, 20.0)
    share = time / time[-1]
    speed = np.interp(share, [0.3, 0.31, 0.7, 0.71], [2600.0, 1800.0, 1800.0, 3000.0])
    columns = {"time_s": time, "speed_rpm": speed, "torque_Nm": np.full(len(time), 120.0),
               "T_ambient_degC": np.full(len(time), 22.0)}  # fmt: skip
    network = fzg.network()
    if since is not None:
        change = sp.Piecewise((CHANGE, symbol("time") >= since), (0, True))
        for link in ("housing_lower-air", "housing_upper-air"):
            network = network.with_link_factor(link, change)
    driven = columns | {"air_speed_m_s": np.full(len(time), 2.0)}
    made = network.simulate(driven, losses=fzg.losses(), initial=22.0).columns()
    noise = np.random.default_rng(seed)
    measured = {node: made[f"T_{node}_degC"] + 0.1 * noise.standard_normal(len(time)) for node in NODES}
    return replace(recording_of(columns, measured), name=name)


@pytest.fixture(scope="module")
def recordings(fzg: Gearbox) -> list[Recording]:
    """Healthy, then a change, and a later one in which it is there from the start."""
    return [simulated(fzg, "before", 2.0, 1, None), simulated(fzg, "during", 5.0, 2, SINCE_S - 7180.0 + 2000.0),
            simulated(fzg, "after", 1.5, 3, 0.0)]  # fmt: skip


@pytest.fixture(scope="module")
def prepared(fzg: Gearbox, recordings: list[Recording]) -> tuple[InferenceSetup, Experiment]:
    return prepare_experiment(fzg, recordings, recordings[:1])


@pytest.fixture(scope="module")
def fit(prepared: tuple[InferenceSetup, Experiment]) -> Fit:
    return calibrate(prepared[1])


@pytest.fixture(scope="module")
def axis(fit: Fit) -> Axis:
    return axis_of(fit.experiment)


@pytest.fixture(scope="module")
def candidates(prepared: tuple[InferenceSetup, Experiment]) -> tuple[Hypothesis, ...]:
    setup, experiment = prepared
    return candidates_of(replace(setup, catalogue={name: CATALOGUE[name] for name in LOOKED_FOR}), experiment)


@pytest.fixture(scope="module")
def found(fit: Fit, candidates: tuple[Hypothesis, ...]) -> Scan:
    return scan(fit, candidates)


@pytest.fixture(scope="module")
def air(candidates: tuple[Hypothesis, ...]) -> Hypothesis:
    return next(h for h in candidates if h.label == AIR)


def on_axis(fit: Fit) -> float:
    """The true date on the shared axis."""
    return fit.experiment.starts_at["during"] + SINCE_S - 7180.0 + 2000.0


def test_recordings_follow_each_other_and_dates_spread_over_the_long_one(fit: Fit, axis: Axis) -> None:
    assert list(fit.experiment.starts_at) == ["before", "during", "after"]
    start = fit.experiment.starts_at["during"]
    inside = [d for d in axis.dates if start < d < fit.experiment.starts_at["after"]]
    assert len(inside) == 14
    assert np.ptp(np.diff(inside)) < 1.0
    assert fit.experiment.starts_at["after"] in axis.dates
    healthy = axis_of(replace(fit.experiment, healthy=frozenset({"before"})))
    assert healthy.dates.min() > start
    shorter = axis_of(replace(fit.experiment, healthy=frozenset({"after"})))
    assert shorter.end <= fit.experiment.starts_at["after"] < axis.end  # nothing changes in a baseline


def test_the_change_wins_in_the_scan(fit: Fit, found: Scan, axis: Axis) -> None:
    single = found.singles(found.gram.given(found.unknowns))
    best = int(np.argmax(single.log_bayes))
    assert found.candidates[best].name in ("air_cooling_step", "radiation_step")
    at = [c.label for c in found.candidates].index(AIR)
    assert single.log_bayes[best] - single.log_bayes[at] < 5.0
    undated = [x for c, x in zip(found.candidates, single.log_bayes, strict=True) if c.how == "always"]
    assert single.log_bayes[at] > max(undated) + 20.0


def test_date_and_strength_are_found(fit: Fit, air: Hypothesis, axis: Axis) -> None:
    found, true = scan(fit, [air]), on_axis(fit)
    single = found.singles(found.gram.given(found.unknowns))
    refitted = refit(fit, air, found.best[0], float(single.value[0]))
    added = refitted.experiment.unknowns[len(fit.z) :]
    values = {u.parameter.name: (u.value(z), sd) for u, z, sd in zip(
        added, refitted.z[len(fit.z) :], np.sqrt(np.diag(refitted.covariance))[len(fit.z) :], strict=True)}  # fmt: skip
    strength, since, within, clock = added
    value, z_sd = values[strength.parameter.name]
    assert abs(value - CHANGE) < 3.0 * z_sd * strength.parameter.sd
    assert abs(values[since.parameter.name][0] + 0.5 * values[within.parameter.name][0] - true) < 300.0
    assert clock.value(0.0) == axis.end
    assert refitted.log_evidence > fit.log_evidence + 50.0


def test_columns_are_those_of_repeated_simulation(fit: Fit, air: Hypothesis) -> None:
    """Zero before the date, as simulated with a small change in the recording in which it comes and in the next one."""
    variant = int(np.argmin(np.abs(air.variants[:14, 1] - on_axis(fit))))
    experiment, own = with_candidate(fit, air, variant)
    size = 0.01
    for index, part in enumerate(fit.parts):
        one = replace(air, variants=air.variants[[variant]])
        column = columns_of(fit.experiment, part, [one])[0][:, :, 0]
        own[0] = experiment.unknowns[len(fit.z)].z_of(size)
        there = experiment.point(index, np.concatenate([fit.z, own]), part.point.trajectory, rounds=12).read
        own[0] = experiment.unknowns[len(fit.z)].z_of(-size)
        back = experiment.point(index, np.concatenate([fit.z, own]), part.point.trajectory, rounds=12).read
        difference = (there - back) / (2.0 * size)
        name = part.point.trajectory.piece.recording
        if name == "before":
            assert np.abs(column).max() == 0.0
        else:
            assert np.linalg.norm(difference - column) < 0.03 * np.linalg.norm(column)
        if name == "after":
            assert np.abs(column[30]).max() > 0.1  # on from the start


def test_healthy_recordings_know_nothing_of_a_candidate(fit: Fit, candidates: tuple[Hypothesis, ...]) -> None:
    experiment = replace(fit.experiment, healthy=frozenset({"after"}))
    healthy = replace(fit, experiment=experiment)
    chosen = [c for c in candidates if c.label in (AIR, "windage@oil", "sensor_bias_step@oil")]
    known = scan(healthy, chosen)
    assert all(np.diag(known.gram.of_recording["after"])[1 + i] == 0.0 for i in known.of_candidates)
    assert all(np.diag(known.gram.of_recording["during"])[1 + i] > 0.0 for i in known.of_candidates)
    refitted = refit(healthy, chosen[0], 0, 10.0)
    strength = refitted.experiment.unknowns[len(fit.z)]
    assert strength.scope == frozenset({"before", "during"})
    last = len(fit.parts) - 1
    setting = refitted.experiment.setting(last, refitted.z)
    assert setting.values[setting.machine.parameter_index[strength.parameter.name]] == 0.0


def test_a_sensor_that_steps_is_dated_and_fitted(
    fzg: Gearbox, recordings: list[Recording], candidates: tuple[Hypothesis, ...]
) -> None:
    """One kelvin more from a moment of the second recording on."""
    during = simulated(fzg, "during", 5.0, 2, None)

    def shifted(recording: Recording, since: float) -> Recording:
        step: Array = np.where(recording.time >= since, 1.0, 0.0)
        return replace(recording, channels=tuple(
            replace(c, values=c.values + step) if c.name == "oil" else c for c in recording.channels))  # fmt: skip

    later = shifted(simulated(fzg, "after", 1.5, 3, None), 0.0)
    _, experiment = prepare_experiment(fzg, [recordings[0], shifted(during, 8000.0), later], recordings[:1])
    calibrated = calibrate(experiment)
    step = next(h for h in candidates if h.label == "sensor_bias_step@oil")
    found, first = scan(calibrated, [step]), len(calibrated.z)
    single = found.singles(found.gram.given(found.unknowns))
    refitted = refit(calibrated, step, found.best[0], float(single.value[0]))
    strength, since = (u.value(float(z)) for u, z in zip(refitted.experiment.unknowns[first : first + 2],
                                                         refitted.z[first : first + 2], strict=True))  # fmt: skip
    assert strength == pytest.approx(1.0, abs=0.15)
    assert abs(since - experiment.starts_at["during"] - 8000.0) < 300.0
    assert refitted.log_evidence > calibrated.log_evidence + 50.0


def test_an_unknown_heat_is_seen_where_it_acts(prepared: tuple[InferenceSetup, Experiment], fit: Fit) -> None:
    """The change at a date is a heat in the housing, most of all; refitted in its shape it explains about as much."""
    setup, experiment = prepared
    found = judge_outside(fit, outside_of(setup, experiment))
    assert all(heat.is_open for heat, _ in found)
    of_place = {heat.place: log_bayes for heat, log_bayes in found}
    best, most = max(found, key=lambda one: one[1])
    assert most > 20.0
    assert most > of_place["shaft_1"] and best.term is not None
    refitted = refit(fit, best, 0, best.term.strength.sd)
    assert refitted.log_evidence - fit.log_evidence > 0.7 * most


def test_a_loss_that_changes_has_the_name_of_its_parameter(candidates: tuple[Hypothesis, ...]) -> None:
    """Not those of its tilts too, which multiply it as well."""
    losses = {one.name.removesuffix("_loss_step") for one in candidates if one.name.endswith("_loss_step")}
    assert losses == {"mesh", "churning", "seal", "bearing"}


def test_prior_of_families(candidates: tuple[Hypothesis, ...]) -> None:
    """Shares of the families; names in a family are alike, and so are places of a name."""
    prior = np.exp([one.log_prior for one in with_priors(candidates)])
    assert prior.sum() == pytest.approx(1.0)
    share = {how: sum(p for p, h in zip(prior, candidates, strict=True) if h.how == how) for how in get_args(How)}
    assert share["from_date"] / share["always"] == pytest.approx(0.2 / 0.6)
    assert share["over_hours"] / share["always"] == pytest.approx(0.1 / 0.6)
    assert share["parameter"] / share["always"] == pytest.approx(0.05)
    of_name = {h.name: 0.0 for h in candidates if h.how == "always"}
    for p, h in zip(prior, candidates, strict=True):
        if h.how == "always":
            of_name[h.name] += p
    assert np.ptp(list(of_name.values())) < 1e-12


def test_a_reading_that_stands_still_is_a_candidate_in_those_times_only(fzg: Gearbox) -> None:
    made = [recorded(fzg, name, hours=hours, seed=seed) for seed, (name, hours) in enumerate((("a", 3.0), ("b", 2.0)))]
    values = made[0].channels[0].values
    still = np.where(np.abs(made[0].time - 5000.0) <= 2000.0, values[300], values)
    first = replace(made[0], channels=(replace(made[0].channels[0], values=still), *made[0].channels[1:]))
    setup, experiment = prepare_experiment(fzg, [first, made[1]], [made[1]])
    (found,) = [one for one in candidates_of(setup, experiment) if one.law == "sensor_stuck"]
    assert (found.name, found.place) == ("sensor_stuck_for_a_while", made[0].channels[0].name)
    assert found.term is not None and found.date is None
    acts = sp.lambdify([symbol("time"), *(symbol(p.name) for p in found.term.parameters)], found.term.expression)
    assert [float(acts(at, 1.0, 0.0)) for at in (2700.0, 3100.0, 6900.0, 7300.0)] == [0.0, 1.0, 1.0, 0.0]
    assert acts(3600.0, 1.0, experiment.starts_at["b"]) == 0.0


def test_names_of_columns_may_be_exchanged_in_one_file_alone(fzg: Gearbox) -> None:
    made = [recorded(fzg, name, hours=hours, seed=seed) for seed, (name, hours) in enumerate((("a", 1.5), ("b", 1.0)))]
    first, second = made[1].channels[:2]
    exchanged = (replace(first, values=second.values), replace(second, values=first.values), *made[1].channels[2:])
    setup, experiment = prepare_experiment(fzg, [made[0], replace(made[1], channels=exchanged)], made[:1])
    swaps = [one for one in candidates_of(setup, experiment) if one.law == "swapped_channels" and one.clock]
    (found,) = [one for one in swaps if {first.name, second.name} == set(one.added.target)]
    names = [p.name.removeprefix(f"{found.added.label}_") for p in found.added.parameters]
    assert names == ["strength", "since", "lasting", "start"]
    start = experiment.starts_at["b"]
    long, short = (float(piece.time[-1]) for piece in experiment.pieces)
    assert found.variants[:, 1:3].tolist() == [[0.0, long], [start, short]]
    acts = sp.lambdify([symbol("time"), *(symbol(p.name) for p in found.added.parameters)], found.added.expression)
    assert [float(acts(at, 1.0, start, short, start)) for at in (0.0, short, short + 20.0)] == [1.0, 1.0, 0.0]
    assert float(acts(long, 1.0, start, short, 0.0)) == 0.0
    middles = experiment.fit(iterations=0)  # a calibration bends itself round it
    judged = scan(middles, swaps)
    singles = judged.singles(judged.gram.given(judged.unknowns))
    best = int(np.argmax(singles.log_bayes))
    assert swaps[best] is found and judged.best[best] == 1  # the second recording
    assert singles.value[best] == pytest.approx(1.0, abs=0.02)
    refitted = refit(middles, found, 1, float(singles.value[best]))
    assert refitted.log_evidence > calibrate(experiment).log_evidence + 1000.0
    alone = prepare_experiment(fzg, made[:1], made[1:])
    assert not [one for one in candidates_of(*alone) if one.law == "swapped_channels" and one.clock]


def test_what_grows_is_known_to_the_end_of_the_last_recording(fzg: Gearbox) -> None:
    made = [recorded(fzg, name, hours=hours, seed=seed) for seed, (name, hours) in enumerate((("a", 1.0), ("b", 0.5)))]
    setup, experiment = prepare_experiment(fzg, made[:1], made[1:])
    axis = axis_of(experiment)
    assert axis.end == pytest.approx(3590.0, abs=30.0)
    assert axis.until == made[0].time[-1] + made[1].time[-1]
    for one in outside_of(setup, experiment):
        assert one.term is not None
        at = {symbol(p.name): float(p.name.endswith("_hours") or p is one.term.strength) for p in one.term.parameters}
        now = {symbol(p.name): p.start for p in one.term.parameters if p.name == one.clock} | {symbol("speed"): 1e3}
        later, last = (float(one.term.expression.xreplace(at | now | {symbol("time"): time}))
                       for time in (1e6, axis.until - axis.end))  # fmt: skip
        assert later == pytest.approx(last) and later > 0.0
