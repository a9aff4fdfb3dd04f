"""Building an FMU, whatever kind it is."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from builder.native.native_fmu import build_native_fmu
from builder.python.python_fmu import build_python_fmu
from builder.surrogate.train import TrainingResult
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError


@pytest.mark.parametrize("build", [build_python_fmu, partial(build_native_fmu, platforms="host")])
def test_a_failed_build_leaves_no_file(
    build: Callable[..., object], fzg: Gearbox, fzg_training: TrainingResult, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=r"mesh\.onnx"):
        build(fzg, fzg_training, [], tmp_path / "fzg.fmu")
    assert list(tmp_path.iterdir()) == []
