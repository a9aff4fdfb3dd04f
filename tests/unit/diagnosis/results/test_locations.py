"""Where the heat of an effect is, how much, and when."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.candidates.hypotheses import hypothesis_of
from diagnosis.decision.posterior import Judged, Posterior
from diagnosis.engine.fit import calibrate
from diagnosis.engine.learnt import error_classes, rule
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.engine.refit import refit
from diagnosis.recordings.recording import Recording
from diagnosis.results.locations import locations_of
from models.assembly.gearbox import Gearbox
from models.mechanisms import CATALOGUE
from tests.unit.diagnosis.inference_example import recording_of


def ride(gearbox: Gearbox, name: str, hours: float) -> Recording:
    time = np.arange(0.0, 3600.0 * hours, 20.0)
    columns = {"time_s": time, "speed_rpm": np.full_like(time, 2000.0), "torque_Nm": np.full_like(time, 60.0),
               "T_ambient_degC": np.full_like(time, 22.0)}  # fmt: skip
    made = gearbox.network().simulate(columns, losses=gearbox.losses(), initial=22.0).columns()
    nodes = ("oil", "housing_upper", "bearing_1")
    return replace(recording_of(columns, {node: made[f"T_{node}_degC"] for node in nodes}), name=name)


def test_heat_is_that_of_the_tested_hours_and_of_a_probable_explanation(fzg: Gearbox) -> None:
    setup, experiment = prepare_experiment(fzg, [ride(fzg, "may", 1.0)], [], [ride(fzg, "march", 2.0)])
    plain = calibrate(experiment)
    network = plain.experiment.machine.model.network
    term = next(p for p in CATALOGUE["windage"].placed(network, setup.scale, setup.channels) if p.place == "oil")
    h = hypothesis_of(term)
    effect = replace(h, variants=h.variants[[0]])
    fit = refit(plain, effect, 0, 30.0, iterations=4)
    at = next(i for i, u in enumerate(fit.experiment.unknowns) if u.parameter.name == term.strength.name)
    z = fit.z.copy()
    z[at] = fit.experiment.unknowns[at].z_of(30.0)
    judged = Judged(effects=(effect,), log_bayes=50.0, fit=replace(fit, z=z),
                    error_class=error_classes()[0])  # fmt: skip
    nothing = replace(judged, effects=(), log_bayes=0.0, fit=plain)
    posterior = Posterior(nothing=nothing, judged=(judged,), log_e=50.0, threshold=4.0, class_threshold=4.0,
                          rule=rule())  # fmt: skip
    (place,) = locations_of(setup, posterior)
    assert place.regime == "always" and {recording for recording, _, _ in place.when} == {"may"}
    assert abs(place.heat_mean_W - place.heat_max_W) < 0.01 * place.heat_max_W  # the speed is constant
    (unsure,) = locations_of(setup, replace(posterior, log_e=1.0, threshold=20.0))  # where to look first all the same
    assert unsure.heat_mean_W == place.heat_mean_W
    # What was not fitted is most probable there: the heat of another explanation, which is refuted, is not its heat.
    other = Judged(effects=(replace(effect, name="pump_heat", law="pump_heat"),), log_bayes=50.0,
                   error_class=error_classes()[0])  # fmt: skip
    (without,) = locations_of(setup, replace(posterior, judged=(other, replace(judged, log_bayes=5.0))))
    assert without.probability > 0.999 and without.heat_mean_W == 0.0
