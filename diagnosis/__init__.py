"""From recordings of a real gearbox to the physics that its model left out.

The way of a diagnosis, which is also an order to read the code in (:func:`diagnosis.diagnose_recordings.diagnose` walks
it from top to bottom):

1. ``recordings``: files become a :class:`~diagnosis.recordings.recording.Recording`: channels, inputs, gaps, units.
2. ``forward.grid``: gap-free pieces on a working grid; ``setup``: noise, start temperatures, plausible recordings.
3. ``forward``: a piece is simulated (``trajectory``), read by its sensors (``observation``), freed of the noise's
   memory (``whitening``).
4. ``engine.unknown``, ``point``, ``slopes``: what is unknown, and what each of it does to the readings (its column).
5. ``engine.fit``, ``metric``, ``model_error``, ``calibration``: unknowns are fitted; what formulas and lumped nodes
   cannot know is integrated over, in classes between which the recordings choose.
6. ``candidates``, ``engine.families``: everything that may be missing, wrong or changed, with its prior.
7. ``engine.scan``, ``gram``: all candidates at once by a straight line; ``refit``: the best of them fitted.
8. ``decision.infer``: scan, race, refit, second scan; ``posterior``: probabilities; ``answer``: claim, likely, a tie.
9. ``results.assemble``: predictions, places, findings, advice as a :class:`~diagnosis.results.result.Diagnosis`;
   ``report``: the page and the files.

``proof`` is apart: plants that hide a known effect, and the scores of any diagnosis of them. Nothing above imports it.

Names are imported on first use, so that reading recordings does not load the inference.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from diagnosis.diagnose_recordings import diagnose
    from diagnosis.results.result import Diagnosis

__all__ = ["Diagnosis", "diagnose"]


def __getattr__(name: str) -> Any:
    if name == "diagnose":
        from diagnosis.diagnose_recordings import diagnose

        return diagnose
    if name == "Diagnosis":
        from diagnosis.results.result import Diagnosis

        return Diagnosis
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
