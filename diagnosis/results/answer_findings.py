"""From answers of the decision to findings: sentence, grade, rivals and numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from diagnosis.candidates.dated import CHANGED, HOURS, STEP, WHILE, changed_law
from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.decision.posterior import Answer, Posterior
from diagnosis.engine.fit import Fit
from diagnosis.recordings.recording import Recording
from diagnosis.results.advice import separation, without_sensor
from diagnosis.results.effect_values import change_of, heats_of, mean_heat_of, names_of, switching_of, values_of
from diagnosis.results.places import node_in
from diagnosis.results.result import LEAST_RIVAL
from diagnosis.results.result_parts import Finding, ParameterValue, Rival
from diagnosis.setup.inference_setup import InferenceSetup, heat_over_time
from models.mechanisms import Mechanism, Placed

# In sentences about a change, whose strength shows which.
EITHER = (("smaller or greater", "smaller", "greater"), ("more or less", "less", "more"))
ENDINGS = (STEP, WHILE, HOURS, "carried_on")


def finding_of(
    answer: Answer, fit: Fit, setup: InferenceSetup, posterior: Posterior, catalogue: Mapping[str, Mechanism],
    recordings: Sequence[Recording],
) -> Finding:  # fmt: skip
    """An answer with the numbers of a fit.

    Parameters
    ----------
    fit : Fit
        With the effect of the answer among its unknowns
    recordings : sequence of Recording
        Learnt from
    """
    effect, term = answer.effect, answer.effect.term
    values, heats = values_of(fit, effect), heats_of(fit, effect)
    pieces = [part.point.trajectory.piece for part in fit.parts]
    mean, stderr = mean_heat_of(fit, effect)
    found = {name: value for name, (value, _) in values.items()}
    units = {p.name: p.unit for p in (setup.nominal.parameters if term is None else term.parameters)}
    prefix = "" if term is None else f"{term.label}_"
    return Finding(
        mechanism=name_in(catalogue, effect),
        family=effect.family,
        place=effect.place,
        node=node_in(setup.nominal, effect),
        kind="parameter" if term is None else "sensor" if term.of_measurement else term.kind,
        says=_says(answer, found),
        reference=term.mechanism.reference if isinstance(term, Placed) else "",
        equation=_equation(effect, found),
        probability=answer.probability,
        log_bayes=answer.best.log_bayes,
        parameters=tuple(
            ParameterValue(name=name.removeprefix(prefix), value=value, stderr=sd, unit=units.get(name, "1"))
            for name, (value, sd) in values.items() if name != effect.clock
        ),
        confusable_with=_rivals(answer, setup, posterior, catalogue),
        heat_mean_W=mean,
        heat_stderr_W=stderr,
        heat_max_W=max((float(np.abs(heat).max()) for heat in heats), default=0.0),
        heat=heat_over_time(pieces, heats) if heats else {},
        term=None if term is None else term.with_values(found),
        grade=answer.grade,
        tie_set=tuple(dict.fromkeys(name_in(catalogue, one) for one, _ in answer.tied)),
        joint_probability=answer.joint,
        acts_like=answer.acts_like,
        date=change_of(values, effect, fit.experiment, recordings),
        switching=switching_of(values, effect),
    )  # fmt: skip


def name_in(catalogue: Mapping[str, Mechanism], effect: Hypothesis) -> str:
    """Name of the law in the catalogue, for one with a date or a course too; else the name of the effect."""
    law = changed_law(effect)
    return next((name for name in (law, *(law + ending for ending in CHANGED)) if name in catalogue), effect.name)


def _says(answer: Answer, found: Mapping[str, float]) -> str:
    effect = answer.effect
    if effect.is_open:
        says = f"A heat at {effect.place.replace('_', ' ')} that is like no law of the catalogue."
    elif isinstance(effect.term, Placed):
        says = effect.term.says
    elif effect.term is None:
        says = f"The parameter {effect.place} is {found[names_of(effect)[0]]:.3g}, far from what the definition allows."
    else:
        says = f"{effect.name.replace('_', ' ').capitalize()} at {effect.place.replace('_', ' ')}."
    for either, less, more in EITHER:
        if effect.term is not None and either in says:
            says = says.replace(either, less if found[effect.term.strength.name] < 0.0 else more)
    says = " ".join(says.split())
    inside = f"{says[:1].lower()}{says[1:]}"
    if answer.acts_like:
        return f"Something acts like this, its cause was not found: {inside}"
    if len(answer.tied) > 1:
        return f"One of several effects that these data do not separate, the most probable: {inside}"
    return says


def _equation(effect: Hypothesis, found: Mapping[str, float]) -> str:
    """The law with its numbers as LaTeX; the time of one with a date is that of the first recording."""
    term = effect.term
    if term is None:
        return ""
    local = {name.removeprefix(f"{term.label}_"): 0.0 if name == effect.clock else value
             for name, value in found.items()}  # fmt: skip
    before = next((term.label.removesuffix(f"_{end}") for end in ENDINGS if term.label.endswith(f"_{end}")), term.label)
    known = {**found, **local, **{f"{before}_{name}": value for name, value in local.items()}}
    return term.with_values(found).equation(known)


def _rivals(
    answer: Answer, setup: InferenceSetup, posterior: Posterior, catalogue: Mapping[str, Mechanism]
) -> tuple[Rival, ...]:
    """Other names at their most probable places: those of the tie set with its probabilities, then everything else."""

    def key(effect: Hypothesis) -> str:
        return effect.label if effect.term is None else name_in(catalogue, effect)

    own, free = answer.effect, without_sensor(setup.nominal, setup.channels)
    others = {effect.label for effect in answer.best.effects}
    odds: dict[str, float] = {}
    alone: dict[str, float] = {}
    where: dict[str, Hypothesis] = {}
    for judged, probability in posterior.ranked:
        with_own = key(own) in {key(effect) for effect in judged.effects}
        for other in judged.effects:
            if other.label not in others and key(other) != key(own):
                odds[key(other)] = odds.get(key(other), 0.0) + probability
                alone[key(other)] = alone.get(key(other), 0.0) + (0.0 if with_own else probability)
                where.setdefault(key(other), other)
    tied: dict[str, float] = {}
    for other, probability in answer.tied:
        if key(other) != key(own):
            tied[key(other)] = tied.get(key(other), 0.0) + probability
            where[key(other)] = other
    return tuple(
        Rival(
            mechanism=name_in(catalogue, where[name]), place=where[name].place, probability=probability,
            separate_by=separation(own, where[name], catalogue, setup.nominal, free,
                                   names=(name_in(catalogue, own), name_in(catalogue, where[name]))),
            instead=name in tied or alone[name] >= LEAST_RIVAL,
        )
        for name, probability in sorted({**odds, **tied}.items(), key=lambda one: (one[0] not in tied, -one[1]))
        if probability >= LEAST_RIVAL
    )  # fmt: skip
