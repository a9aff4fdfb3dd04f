"""The next step: the experiment or the sensor that decides. Only what is possible is advised."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from diagnosis.candidates.hypotheses import Hypothesis
from diagnosis.recordings.recording import Recording
from diagnosis.results.places import node_in
from diagnosis.results.result import Diagnosis
from diagnosis.results.result_parts import NO_CLAIM, Calibrated
from diagnosis.setup.inference_setup import InferenceSetup
from models.quantities.quantities import is_total_loss, node_of_channel

OTHER_OPERATION = "a second recording with other speeds and torques"
TURNING = ("mesh", "pinion", "wheel", "gear", "shaft", "sun", "planet", "carrier")  # no wire leads there
WORTH_ASKING = 0.05  # probability of a rival, from which telling it apart is the next thing
OTHER_PLACE = 0.1  # probability of a further place, from which a sensor there is


def without_sensor(setup: InferenceSetup) -> frozenset[str]:
    """Parts that have no thermometer and can have one."""
    parts = [part.name for part in setup.nominal.parts]
    measured = {node_of_channel(name, parts) for name in setup.channels if not is_total_loss(name)}
    return frozenset(p for p in parts if p not in measured and not p.startswith(TURNING))


def separation(setup: InferenceSetup, own: Hypothesis, other: Hypothesis) -> str:
    """The experiment, or the sensor, that distinguishes two effects."""
    if own.name == other.name:
        node, free = node_in(setup.nominal, other), without_sensor(setup)
        return f"a temperature sensor at {node.replace('_', ' ')}" if node in free else OTHER_OPERATION
    catalogue = setup.catalogue
    known = [(catalogue[a], b) for a, b in ((own.mechanism, other.mechanism), (other.mechanism, own.mechanism))
             if a in catalogue]  # fmt: skip
    for mechanism, rival in known:
        if rival in mechanism.separate_by:
            return mechanism.separate_by[rival]
    if other.term is not None and other.term.of_measurement:
        known = known[::-1]  # an instrument is tested more easily than a machine
    return known[0][0].experiment if known else OTHER_OPERATION


def data_sheet(recordings: Sequence[Recording], calibration: Sequence[Calibrated]) -> str:
    """The tolerance to look up, of the sensor that seems to be off most; empty if none is, or it is stated."""
    unstated = {f"bias_{c.name}": c.column or c.name for r in recordings for c in r.channels if c.bias_sd is None}
    off = [one for one in calibration if one.is_far and one.parameter in unstated]
    if not off:
        return ""
    worst = max(off, key=lambda one: abs(one.shift_in_sd))
    usual, way = abs(worst.estimate / worst.shift_in_sd), "little" if worst.estimate < 0.0 else "much"
    return (
        f"state the tolerance of {unstated[worst.parameter]} (bias_sd in the mapping; {usual:.2g} {worst.unit} is "
        f"assumed): it seems to read {abs(worst.estimate):.2f} {worst.unit} too {way}"
    )


def next_test(setup: InferenceSetup, d: Diagnosis) -> str:
    """The next measurement after a diagnosis; empty if there is nothing to ask for."""
    if d.verdict == "consistent" and d.missed:
        return (f"diagnose {d.missed[0]} with the recordings that agree as baselines (--baseline): it shows what "
                "changed between them")  # fmt: skip
    assumed = {name for recording in (*setup.recordings, *setup.holdout) for name in recording.assumed}
    if d.verdict == "unexplained" and "T_ambient" in assumed:
        return "record T_ambient_degC: it is taken as constant, so changes of the air look like heat at other parts"
    if not d.findings and (sheet := data_sheet(setup.recordings, d.model.calibration)):
        return sheet
    instead = [[rival for rival in finding.confusable_with if rival.instead] for finding in d.findings]
    asked = [rivals[0].separate_by for rivals in instead if rivals and rivals[0].probability >= WORTH_ASKING]
    if asked:
        return asked[0]
    if d.verdict in NO_CLAIM:
        return _for_more(setup, d)
    free = without_sensor(setup)
    for place in d.location[1:]:
        if place.probability >= OTHER_PLACE and place.node in free:
            return f"a temperature sensor at {place.node.replace('_', ' ')}: it shows if the heat is there"
    if d.verdict == "unexplained":
        return "repeat the operation in which the model is wrong, and change one input at a time"
    if d.findings and d.findings[0].mechanism in setup.catalogue:
        return setup.catalogue[d.findings[0].mechanism].experiment
    return ""


def _for_more(setup: InferenceSetup, d: Diagnosis) -> str:
    """The experiment where nothing was detected: of the name ahead of all others, or of most that cannot be seen."""
    ahead = [hint.laws[0] for hint in d.hints if hint.laws[0] in setup.catalogue]
    if ahead:
        return f"{setup.catalogue[ahead[0]].experiment} (it would show {ahead[0]}, which is ahead of all other names)"
    if not d.unseen:
        return ""
    wanted = Counter(one.needed for one in d.unseen).most_common(1)[0][0]
    shown = " and ".join(one.mechanism for one in d.unseen if one.needed == wanted)
    return f"{wanted} (it would show {shown}, which these data cannot)"
