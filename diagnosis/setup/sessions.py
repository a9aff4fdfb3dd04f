"""Several recordings of one machine: test sessions, their time axis, and baselines, in which the effect cannot act."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from datetime import UTC

import numpy as np

from diagnosis.recordings.recording import Recording
from models.base.errors import InputError, did_you_mean
from models.quantities.quantities import is_total_loss


def session_by_recording(
    train: Sequence[Recording], holdout: Sequence[Recording] = (), baseline: Sequence[Recording] = ()
) -> dict[str, str]:
    """Test session of every recording.

    All that is learnt from and held out is one session, called ``""``; every file of baselines is another, called like
    its first recording. Parts of one file belong together. What a mapping states comes first.

    Returns
    -------
    dict of recording to session
    """
    given = {r.name: r.session for r in (*train, *holdout)}
    of_file = {r.hash: r.session for r in (*train, *holdout)}
    for recording in baseline:
        usual = of_file.setdefault(recording.hash, recording.session or recording.name)
        given[recording.name] = recording.session or usual
    return given


def start_times(recordings: Sequence[Recording]) -> dict[str, float]:
    """Start of every recording on the axis that they share, [s].

    Parameters
    ----------
    recordings : sequence of Recording
        If all have dates these count; else their files follow each other in this order without gaps, and parts of a
        file lie as in it. A name that comes again (learnt from and predicted) counts once

    Returns
    -------
    dict of str to float
        From 0
    """
    dates = {recording.name: recording.start.timestamp() for recording in recordings if recording.start is not None}
    if all(recording.name in dates for recording in recordings):
        return {name: date - min(dates.values()) for name, date in dates.items()}
    files: dict[str, dict[str, Recording]] = {}
    for recording in recordings:
        files.setdefault(recording.hash, {})[recording.name] = recording
    result: dict[str, float] = {}
    now = 0.0
    for parts in files.values():
        first, last = min(part.from_s for part in parts.values()), max(part.to_s for part in parts.values())
        result |= {name: now + part.from_s - first for name, part in parts.items()}
        now += last - first
    return result


def hour_of_start(recordings: Sequence[Recording]) -> float | None:
    """Hour of the day (UTC) at which the axis of :func:`start_times` begins; None if not all have dates."""
    dates = [recording.start for recording in recordings if recording.start is not None]
    if len(dates) < len(recordings):
        return None
    first = min(dates).astimezone(UTC)
    return first.hour + first.minute / 60.0 + first.second / 3600.0


def check_baselines(
    train: Sequence[Recording],
    baseline: Sequence[Recording],
    switched_off: Collection[str] = (),
    *,
    catalogue: Collection[str] = (),
) -> None:
    """Refuse baselines that show nothing of the machine of the recordings.

    Parameters
    ----------
    switched_off : collection of str
        Mechanisms that are known to be off in the baselines
    catalogue : collection of str
        Names of all mechanisms

    Raises
    ------
    InputError
        If a baseline shares no channel with the recordings, or a mechanism is unknown or has no baseline.
    """
    lines = [f"--switched-off {n}: is not in the catalogue{did_you_mean(n, catalogue)}" for n in switched_off
             if n not in catalogue]  # fmt: skip
    if switched_off and not baseline:
        lines.append(
            f"--switched-off {' '.join(switched_off)}: is about baselines, but there are none; name the recordings in "
            "which it is off with --baseline"
        )
    known = _measured(train)
    for recording in baseline:
        own = _measured([recording])
        if own.isdisjoint(known):
            lines.append(
                f"{recording.path}: is a baseline, but measures {_listed(own)} and nothing that the recordings do "
                f"({_listed(known)}); is it of another machine, or does its mapping name other nodes?"
            )
    if lines:
        raise InputError("\n".join(lines))


def _measured(recordings: Sequence[Recording]) -> set[str]:
    return {c.name for r in recordings for c in r.channels if np.isfinite(c.values).any()}


def _listed(channels: Collection[str]) -> str:
    return ", ".join(name if is_total_loss(name) else f"T_{name}" for name in sorted(channels)) or "nothing"
