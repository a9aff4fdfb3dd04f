"""One time axis for several recordings."""

from __future__ import annotations

from collections.abc import Sequence

from diagnosis.recordings.recording import Recording


def start_times(recordings: Sequence[Recording]) -> dict[str, float]:
    """Start of every recording on the axis that they share, [s].

    Parameters
    ----------
    recordings : sequence of Recording
        If all have dates these count; else they follow each other in this order without gaps. A
        name that comes again (learnt from and predicted) counts once

    Returns
    -------
    dict of str to float
        From 0
    """
    dates = {recording.name: recording.start.timestamp() for recording in recordings if recording.start is not None}
    if all(recording.name in dates for recording in recordings):
        return {name: date - min(dates.values()) for name, date in dates.items()}
    result: dict[str, float] = {}
    now = 0.0
    for recording in recordings:
        if recording.name in result:
            continue
        result[recording.name] = now
        now += float(recording.time[-1])
    return result
