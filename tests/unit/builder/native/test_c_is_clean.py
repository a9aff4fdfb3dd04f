"""The hand-written C of the model through cppcheck, with the configuration in ``fmu_src/native/cppcheck.cfg``."""

from __future__ import annotations

import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from builder.fmi.signals import signal_table
from builder.native.data import model_sources
from builder.native.native_fmu import LOSS_NETWORKS, THERMAL_MODEL, linker_names, native_source
from builder.surrogate.train import TrainingResult
from models.assembly.gearbox import Gearbox

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("cppcheck") is None, reason="cppcheck is not installed"),
]


def test_cppcheck_finds_nothing(tmp_path: Path, fzg: Gearbox, fzg_training: TrainingResult) -> None:
    network, losses = fzg.network(), fzg_training.losses
    files = {name: native_source(name) for name in (*THERMAL_MODEL, *LOSS_NETWORKS, "model.h")}
    files |= model_sources(signal_table(network, losses), network, losses)
    files["linker_names.h"] = linker_names(files, "test")
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    options = shlex.split(native_source("cppcheck.cfg"), comments=True)
    checked = [name for name in (*THERMAL_MODEL, *LOSS_NETWORKS) if name.endswith(".c")]
    done = subprocess.run(["cppcheck", *options, *checked], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
