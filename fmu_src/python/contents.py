"""Reading what the builder put into an FMU, checked to the byte before anything is calculated with it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime

from fmu_src.python.onnx_losses import OnnxLosses
from fmu_src.python.twin import Twin
from models.portable.surrogate import Evaluator

DATA = "twin.json"
ERRORS_ONLY = 3


class DamagedFmu(Exception):
    """A file of the FMU is missing or not as the builder wrote it."""


def load_twin(resources: Path, digests: Mapping[str, str], laws: Mapping[str, Any]) -> Twin:
    """The twin of an extracted FMU.

    Parameters
    ----------
    resources : Path
        Its ``resources`` folder
    digests : mapping of file name to str
        SHA-256 of every data file, as built
    laws : mapping of str to callable
        The generated functions

    Raises
    ------
    DamagedFmu
        If a file is missing, damaged or of another build, or onnxruntime cannot run a network.
    """
    files = {name: _read_verified(resources / name, digest) for name, digest in digests.items()}
    data = json.loads(files[DATA])
    losses = OnnxLosses.from_dict(data["losses"])
    evaluators = {network.name: _session(f"{network.name}.onnx", files) for network in losses.networks}
    return Twin(data, laws, losses.with_evaluators(evaluators))


def _read_verified(path: Path, digest: str) -> bytes:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise DamagedFmu(f"{path.name} cannot be read ({error.strerror}); extract or build the FMU again") from error
    found = hashlib.sha256(content).hexdigest()
    if found != digest:
        raise DamagedFmu(
            f"{path.name} is not as built ({len(content)} bytes, SHA-256 {found:.12}... in place of {digest:.12}...): "
            "damaged, cut off or edited; extract or build the FMU again"
        )
    return content


def _session(name: str, files: Mapping[str, bytes]) -> Evaluator:
    options = onnxruntime.SessionOptions()
    # One thread: a few rows are too little for more, and the same bits come out everywhere.
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = ERRORS_ONLY
    try:
        session = onnxruntime.InferenceSession(files[name], options, providers=["CPUExecutionProvider"])
    except Exception as error:
        raise DamagedFmu(f"{name}: onnxruntime {onnxruntime.__version__} cannot run it ({error})") from error
    names = [output.name for output in session.get_outputs()]
    source = session.get_inputs()[0].name
    run = session.run

    return lambda rows: np.asarray(run(names, {source: rows})[0])
