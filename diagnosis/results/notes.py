"""Notes: baselines with the effect or of another machine, air that no cold machine has, unknowns at limits, recordings
that identify ratios only.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.answer import Answer
from diagnosis.decision.posterior import Posterior
from diagnosis.engine.fit import Experiment, Fit
from diagnosis.engine.scale import scale_direction
from diagnosis.engine.scan import scan, scope_of
from diagnosis.engine.sessions import sessions_apart
from diagnosis.recordings.cold_start import is_isothermal
from diagnosis.setup.start import ambient_at_start, first_readings
from models.quantities.units import behind_a_number

NOTED_FROM = 5.0  # nats
AIR_OFF_K, FEWEST_ALIKE = 2.0, 3  # of the air, from so many thermometers that agree
AT_LIMIT = 1e-6  # of a value, from a limit
LITTLE = 0.01  # of what the recordings know about the sizes one by one: a small part of fixed capacity pretends so much


def baseline_notes(experiment: Experiment, posterior: Posterior, answers: Sequence[Answer]) -> Iterator[str]:
    """Notes on baselines in which the effect acts too, or that look like another machine, or that bring evidence."""
    nothing = posterior.nothing.fit
    if not experiment.healthy or nothing is None:
        return
    for effect in (answer.effect for answer in answers[:1] if answer.effect.term is not None):
        if scope_of(experiment, effect) is None:
            continue  # it may act in them
        acting = evidence_in_baselines(nothing, effect)
        if acting > NOTED_FROM:
            yield (
                f"The baselines show {effect.name} too (evidence {acting:.0f} nat): the reported size is only its "
                "growth since then. Take baselines from before it began, or leave them out."
            )
    for session, nats in sessions_apart((answers[0].best.fit if answers else None) or nothing).items():
        if nats > NOTED_FROM:
            yield (
                f"Session '{session}' looks like another machine, or one that was rebuilt (evidence {nats:.0f} nat): "
                "its parameters are not those of the other recordings. Leave it out if that is so."
            )
    placebo = posterior.assumed.placebo
    if placebo is not None and posterior.threshold == placebo.log_e_value:
        yield (
            f"In the baseline '{placebo.session}' nothing is wrong, but the same test finds "
            f"{placebo.log_e_value:.0f} nat in it ({placebo.mechanism} at {placebo.place}; for as many hours as are "
            "tested). So much is model error: the recordings have to bring more. If that effect may have acted there, "
            "leave the session out."
        )
    single = [one for one in posterior.judged if len(one.effects) == 1]
    if not single:
        return
    ahead = max(single, key=lambda one: one.weight + one.effects[0].less).effects[0]  # if baselines took nothing of it
    if ahead.less > posterior.class_threshold:
        yield (
            f"A baseline, in which nothing changed, seems to show {ahead.name} as well: {ahead.less:.0f} nat of it "
            "(for as many hours as are tested) do not count. If it may have changed there, leave the session out."
        )


def air_notes(experiment: Experiment) -> Iterator[str]:
    """One sentence if in every recording that begins cold and at rest the machine is off the recorded air alike."""
    model = experiment.machine.model
    if "T_ambient" not in model.laws.inputs:
        return
    off = []
    for piece in experiment.pieces:
        firsts, air = [*first_readings(model, piece).values()], ambient_at_start(model, piece)
        if piece.time[0] == 0.0 and len(firsts) >= FEWEST_ALIKE and is_isothermal(firsts, air):
            off.append(float(np.median(firsts)) - air)
    if len(off) > 1 and min(map(abs, off)) > AIR_OFF_K and np.ptp(np.sign(off)) == 0.0:
        low, high = (f"{abs(value):.1f}" for value in sorted((min(off), max(off)), key=abs))
        yield (
            f"In all {len(off)} recordings that begin with one temperature everywhere this is "
            f"{low if low == high else f'{low} to {high}'} K {'above' if off[0] > 0.0 else 'below'} the recorded air: "
            "the air is another one at the gearbox, the probe is wrong, or something next to it keeps it so. How far "
            "the probe may be off is its bias_sd in a mapping."
        )


def evidence_in_baselines(fit: Fit, effect: Hypothesis) -> float:
    """Log Bayes factor of an effect in the baselines alone, as if it acted there, [nat].

    Parameters
    ----------
    fit : Fit
        Machine without the effect; its model error counts
    """
    alone = fit.part(fit.experiment.baselines)
    everywhere = replace(alone, experiment=replace(alone.experiment, healthy=frozenset()))
    return float(scan(everywhere, [effect]).log_bayes[0])


def limit_notes(fit: Fit) -> tuple[str, ...]:
    """One sentence if the model that predicts has unknowns at their limits, where they stand in for something else.

    Shares may be 0 or 1, and what is held is no unknown.
    """
    at = []
    for unknown, z in zip(fit.experiment.unknowns, fit.z.tolist(), strict=True):
        p, value = unknown.parameter, unknown.value(z)
        if p.sd and (p.lower, p.upper) != (0.0, 1.0) and min(value - p.lower, p.upper - value) <= AT_LIMIT * abs(value):
            at.append(f"{p.name} = {value:.4g}{behind_a_number(p.unit)}")
    if not at:
        return ()
    verb = "is at its limit and stands" if len(at) == 1 else "are at their limits and stand"
    return (f"in the corrected model {', '.join(at)} {verb} in for something that it lacks: no estimate",)


def ratio_notes(fit: Fit) -> tuple[str, ...]:
    """One sentence if recordings identify ratios only, so that every watt rests on the priors; else nothing.

    The information that they have along the common factor of all sizes is compared with what they have on the sizes
    one by one.
    """
    direction = scale_direction(fit.experiment.network, fit.experiment.unknowns)
    each = np.concatenate([part.columns for part in fit.parts]) * direction
    together, alone = each.sum(axis=1), np.square(each).sum(axis=0)[direction != 0.0]
    if not len(alone) or float(together @ together) > LITTLE * float(alone.sum()):
        return ()
    sd = 1.0 / np.sqrt(float(direction @ direction))
    text = (
        "only ratios are identified: all heats, conductances and heat capacities together may be larger or smaller by "
        f"one factor without any change of a temperature. That factor rests on the definition's priors (a factor of "
        f"{np.exp(sd):.2f} either way, one standard deviation), and so does every number in W, W/K or J/K; measure the "
        "loss, or one heat flow, to fix it"
    )
    return (text,)
