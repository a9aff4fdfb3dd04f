"""Building an FMU, whatever kind it is."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from builder.native.native_fmu import build_native_fmu
from builder.python.python_fmu import build_python_fmu
from builder.surrogate.train import TrainingResult
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.errors import InputError


@pytest.mark.parametrize("build", [partial(build_python_fmu, networks=()), partial(build_native_fmu, platforms="host")])
@pytest.mark.parametrize("other", ["conveyor", "heated_rod"])
def test_networks_of_another_gearbox_leave_no_file(
    build: Callable[..., object], other: str, fzg: Gearbox, fzg_training: TrainingResult, tmp_path: Path
) -> None:
    for gearbox, training in ((load_gearbox(other), fzg_training), (fzg, None)):
        with pytest.raises(InputError, match="another gearbox"):
            build(gearbox, training=training, output=tmp_path / "other.fmu")
    assert list(tmp_path.iterdir()) == []
