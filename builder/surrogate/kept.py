"""Networks of earlier builds: the same losses, settings, code and libraries are not trained twice.

What only the thermal network has, as walls, links and factors, is not part of the key. Nor is a correction: its laws
act on top of the losses that the networks have learnt.
"""

from __future__ import annotations

import hashlib
import json
import pickle
import platform
from dataclasses import asdict, replace
from datetime import datetime
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from threadpoolctl import threadpool_info

from builder.base.cache import cached_path, keep, recall
from builder.surrogate.networks import Preset
from builder.surrogate.train import ErrorReport, TrainingResult, chosen_preset, train_surrogate
from models.base.progress import Progress, silent
from models.definition.sections import Training
from models.portable.surrogate import SurrogateLosses

if TYPE_CHECKING:
    from models.assembly.gearbox import Gearbox

FOLDER = "networks"
ROOT = Path(__file__).resolve().parents[2]
CODE = ("models", "builder/surrogate")  # with everything that training imports
LIBRARIES = ("numpy", "scipy", "scikit-learn")


def kept_or_trained(
    gearbox: Gearbox,
    *,
    preset: str | Preset = "default",
    samples: int | None = None,
    seed: int = 0,
    jobs: int | None = 1,
    dask: str | None = None,
    retrain: bool = False,
    progress: Progress = silent,
) -> TrainingResult:
    """Return the networks of :func:`builder.surrogate.train.train_surrogate`: kept ones, or train them and keep them.

    Parameters
    ----------
    gearbox, preset, samples, seed, jobs, dask, progress
        See :func:`builder.surrogate.train.train_surrogate`
    retrain : bool
        Train even if they are kept, and replace the kept ones

    Returns
    -------
    TrainingResult
        Its `origin` states which; kept ones are the same to the last bit

    Raises
    ------
    InputError
        As :func:`builder.surrogate.train.train_surrogate`.
    """
    chosen = chosen_preset(preset, samples)
    path = cached_path(f"{FOLDER}/{_key(gearbox, chosen, seed)}.json")
    found = None if retrain else _decoded(recall(path))
    if found is not None:
        return TrainingResult(
            losses=SurrogateLosses.from_dict(found["losses"]),
            report=tuple(ErrorReport(**row) for row in found["report"]),
            preset=chosen,
            seed=seed,
            definition_hash=gearbox.hash,
            gearbox=gearbox.name,
            seconds=found["seconds"],
            origin=f"taken from {_shown(path)} (trained on {found['trained_on']} in {found['seconds']:.0f} s)",
        )
    trained = train_surrogate(gearbox, preset=chosen, seed=seed, jobs=jobs, dask=dask, progress=progress)
    content = {
        "gearbox": gearbox.name,
        "trained_on": f"{datetime.now().astimezone():%Y-%m-%d %H:%M}",
        "seconds": trained.seconds,
        "report": [asdict(row) for row in trained.report],
        "losses": trained.losses.to_dict(),
    }
    kept = keep(path, _encoded(content))
    return replace(trained, origin=f"trained now, kept in {_shown(path)}") if kept else trained


def _key(gearbox: Gearbox, preset: Preset, seed: int) -> str:
    """Hash of all that decides the weights, to their last bit."""
    made_of = {
        "losses": hashlib.sha256(pickle.dumps(gearbox.losses(), protocol=5)).hexdigest(),
        "range": gearbox.training,
        "preset": asdict(preset),
        "seed": seed,
        "code": _code_hash(),
        "libraries": {name: metadata.version(name) for name in LIBRARIES},
        "machine": [platform.python_version(), platform.system(), platform.machine()],
        "blas": sorted(
            [str(one["internal_api"]), str(one["version"]), str(one.get("architecture"))]
            for one in threadpool_info()  # in any order
            if one["user_api"] == "blas"
        ),
    }
    return hashlib.sha256(json.dumps(made_of, sort_keys=True, default=Training.model_dump).encode()).hexdigest()[:32]


@cache
def _code_hash() -> str:
    digest = hashlib.sha256()
    for file in sorted(file for folder in CODE for file in (ROOT / folder).rglob("*.py")):
        digest.update(file.relative_to(ROOT).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


def _encoded(content: dict[str, Any]) -> bytes:
    """JSON below a line with its hash."""
    text = json.dumps(content).encode()
    return hashlib.sha256(text).hexdigest().encode() + b"\n" + text


def _decoded(file: bytes | None) -> dict[str, Any] | None:
    """Content of :func:`_encoded`; None if it is not as it was written."""
    digest, _, text = (file or b"").partition(b"\n")
    if hashlib.sha256(text).hexdigest().encode() != digest:
        return None
    content: dict[str, Any] = json.loads(text)
    return content


def _shown(path: Path | None) -> str:
    """A path as people know it: from the home folder, if it is in there."""
    home = Path.home()
    return f"~/{path.relative_to(home).as_posix()}" if path and path.is_relative_to(home) else str(path)
