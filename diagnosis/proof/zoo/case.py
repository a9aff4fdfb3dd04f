"""A case of the zoo: the hidden plant, what is concealed in it, how it is measured, and what its runs gave."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from diagnosis.proof.plant.cycles import BASELINE, TRAIN, Programme
from diagnosis.proof.plant.instruments import Instruments
from diagnosis.proof.zoo.effects import ZooEffect
from diagnosis.proof.zoo.faults import Fault, spoiled
from diagnosis.proof.zoo.oracle import LOSS, OracleNats
from diagnosis.proof.zoo.recorder import measure
from diagnosis.proof.zoo.simulate import simulate
from diagnosis.proof.zoo.structure import Law, Variant, ZooChange, ZooOutcome, ZooPlant
from models.base.types import Array

GROUPS = ("control", "single", "date", "sensor", "pair", "outside", "messy")
CONTROLS = ("clean", "clean", "parameters_off", "noise_misstated", "lag_wrong")
SEEN_NATS = 3.0

NatsOf = Callable[[Sequence[Mapping[str, Array]]], OracleNats]


@dataclass(frozen=True, kw_only=True)
class ZooPlan:
    """A case before it is drawn.

    Attributes
    ----------
    family : str
        See :func:`~diagnosis.proof.zoo.families.find_family`
    machine : str
        Name or file of the nominal definition
    seed : int
        Of this case
    group : str
        One of :data:`GROUPS`
    kind : str or None
        Of a control one of :data:`CONTROLS`, drawn if None
    """

    family: str
    machine: str
    seed: int
    group: str
    kind: str | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class CaseRuns:
    """Runs of a case.

    Attributes
    ----------
    sets : tuple of tuples of int
        Which effects act in each run of a batch: all, none, and every one alone
    outcomes : mapping of str to ZooOutcome
        By recording; a baseline has one run
    as_recorded : mapping of str to ZooOutcome
        Of the training recordings, with errors of recorded inputs turned into errors of the true ones
    """

    sets: tuple[tuple[int, ...], ...]
    outcomes: Mapping[str, ZooOutcome]
    as_recorded: Mapping[str, ZooOutcome]

    @property
    def none(self) -> int:
        """The run without any effect."""
        return self.sets.index(())


@dataclass(frozen=True, kw_only=True, eq=False)
class ZooCase:
    """One case.

    Attributes
    ----------
    plan : ZooPlan
        With the kind of a control
    plant : ZooPlant
        With the parts that effects bring along
    programmes : tuple of Programme
        Training, held-out and baseline recordings
    effects : tuple of ZooEffect
        At their strengths, the dominant one first
    session_deviation : float
        Standard deviation of the logarithm of every parameter between sessions
    sessions : mapping of str to mapping of str to float
        Parameters in the session of every baseline
    distance_K : float
        From the nominal model, after calibration
    rejected : int
        Plants that were drawn before it and were too near to or too far from the nominal model
    runs : CaseRuns
        What its recordings gave
    nats : OracleNats or None
        Evidence for all effects together; None of a control
    nats_of_effects : tuple of OracleNats
        Evidence for every effect alone
    """

    name: str
    plan: ZooPlan
    plant: ZooPlant
    programmes: tuple[Programme, ...]
    effects: tuple[ZooEffect, ...]
    instruments: Instruments
    session_deviation: float = 0.0
    sessions: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    distance_K: float
    rejected: int = 0
    runs: CaseRuns = CaseRuns(sets=((),), outcomes={}, as_recorded={})
    nats: OracleNats | None = None
    nats_of_effects: tuple[OracleNats, ...] = ()

    @property
    def visible(self) -> bool | None:
        """True if the recordings hold at least 3 nats for the dominant effect; None of a control."""
        return self.nats_of_effects[0].tool >= SEEN_NATS if self.effects else None

    def recordings(self, *kinds: str) -> list[Programme]:
        """Programmes whose names begin with one of some words."""
        return [p for p in self.programmes if p.name.startswith(kinds)]


def run_case(case: ZooCase, *kinds: str) -> CaseRuns:
    """Simulate recordings of a case with all effects, without any, and with every one alone.

    Parameters
    ----------
    kinds : str
        ``train``, ``hold``, ``baseline``
    """
    number = len(case.effects)
    alone = tuple((k,) for k in range(number)) if number > 1 else ()
    sets = (tuple(range(number)), (), *alone) if number else ((),)
    plain, as_felt = [_variant(case, s) for s in sets], [_variant(case, s, felt=True) for s in sets]
    faulty_inputs = any(effect.fault is not None and effect.fault.what == "input" for effect in case.effects)
    outcomes, as_recorded = {}, {}
    for p in case.recordings(*kinds):
        healthy = p.name.startswith(BASELINE)
        variants = [Variant(parameters=case.sessions[p.name])] if healthy else plain
        outcomes[p.name] = simulate(case.plant, p, variants)
        if faulty_inputs and p.name.startswith(TRAIN):
            as_recorded[p.name] = simulate(case.plant, p, as_felt)
    return CaseRuns(sets=sets, outcomes=outcomes, as_recorded=as_recorded)


def nats_of_case(case: ZooCase, runs: CaseRuns, nats_of: NatsOf) -> tuple[OracleNats, tuple[OracleNats, ...]]:
    """Evidence of the training recordings for all effects together, and for each alone."""
    found = [nats_of(differences(case, runs, b)) for b, acting in enumerate(runs.sets) if acting]
    return found[0], tuple(found[1:]) or (found[0],)


def differences(case: ZooCase, runs: CaseRuns, run: int) -> list[dict[str, Array]]:
    """Noise-free readings with the effects of a run minus those without any, by training recording.

    An error of a recorded input is seen as one of the true input in the other direction: that is what it means to a
    method which believes the recorder.

    Returns
    -------
    list of dict of channel to Array, shape (rows,)
        [K], and [W] of :data:`~diagnosis.proof.zoo.oracle.LOSS`
    """
    faults = [fault for fault in (case.effects[k].fault for k in runs.sets[run]) if fault is not None]
    found = []
    for programme in case.recordings(TRAIN):
        sound = measure(case.plant, programme, runs.outcomes[programme.name], runs.none)
        outcome = runs.as_recorded.get(programme.name, runs.outcomes[programme.name])
        measured = measure(case.plant, programme, outcome, run)
        for fault in faults:
            measured = spoiled(measured, fault)
        x = {name: measured.readings[name] - sound.readings[name] for name in case.instruments.channels}
        if case.instruments.loss_noise is not None:
            x[LOSS] = measured.P_loss - sound.P_loss
        found.append(x)
    return found


def _variant(case: ZooCase, acting: Sequence[int], *, felt: bool = False) -> Variant:
    changes: list[ZooChange] = []
    for k in acting:
        effect = case.effects[k]
        changes += effect.changes
        if felt and effect.fault is not None and effect.fault.what == "input":
            changes.append(_as_felt(effect.fault, case.plant))
    return Variant(changes=tuple(changes))


def _as_felt(fault: Fault, plant: ZooPlant) -> ZooChange:
    """The error of a recorded input as one of the true input in the other direction; lags are left out."""
    (name,) = fault.channels
    a, course = -fault.sign * fault.strength, fault.course
    law: Law
    if fault.kind == "offset":
        law = lambda m: a * course.share(m.hours)  # noqa: E731
    elif fault.kind == "input_gain":
        law = lambda m: a * course.share(m.hours) * m.inputs[name]  # noqa: E731
    else:
        probe = next(probe for probe in plant.probes if probe.channel == fault.near)
        bodies = {body.name for body in plant.bodies}
        mix = {name: weight for name, weight in probe.mix.items() if name in bodies}  # laws know no boundary

        def law(m):  # type: ignore[no-untyped-def]
            near = sum(weight * m.T[body] for body, weight in mix.items()) / sum(mix.values())
            return a * course.share(m.hours) * (near - m.inputs[name])

    return ZooChange(kind="input", target=name, law=law)
