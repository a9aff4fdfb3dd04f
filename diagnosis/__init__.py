"""From recordings of a real gearbox to the physics that its model left out.

The names are imported on first use, so that reading recordings does not load the inference.
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
