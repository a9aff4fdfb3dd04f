"""What many tests share: the default gearbox, and one FMU of it with quickly trained networks."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from threadpoolctl import threadpool_limits

from builder.__main__ import main
from builder.base.cache import CACHE_VARIABLE
from builder.native.native_fmu import build_native_fmu
from builder.python.python_fmu import build_python_fmu
from builder.surrogate.networks import PRESETS
from builder.surrogate.onnx_export import export_onnx
from builder.surrogate.train import TrainingResult, train_surrogate
from models.assembly.gearbox import Gearbox, load_gearbox
from models.simulation.thermal_network import ThermalNetwork

QUICK = replace(PRESETS["default"], samples=400, max_iter=60, starts=1, judged=200)


def pytest_configure() -> None:
    """Several workers share the processor: threads of BLAS would wait for each other."""
    if "PYTEST_XDIST_WORKER" in os.environ:
        os.environ["OPENBLAS_NUM_THREADS"] = "1"  # of the programs that tests start
        threadpool_limits(1)


@pytest.fixture(scope="session", autouse=True)
def cache_of_this_run(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Compiled libraries are shared by the tests of a run; nothing comes from the user's cache or goes there."""
    folder = tmp_path_factory.getbasetemp() / "cache"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(CACHE_VARIABLE, str(folder))
        yield folder


@pytest.fixture(autouse=True)
def no_networks_of_other_tests(cache_of_this_run: Path) -> None:
    """A test that builds an FMU trains its networks."""
    shutil.rmtree(cache_of_this_run / "networks", ignore_errors=True)


@pytest.fixture(scope="session")
def fzg() -> Gearbox:
    return load_gearbox("fzg")


@pytest.fixture(scope="session")
def fzg_training(fzg: Gearbox) -> TrainingResult:
    """Networks of about 1 % error, trained in half a second."""
    return train_surrogate(fzg, preset=QUICK, seed=0)


@pytest.fixture(scope="session")
def fzg_networks(fzg_training: TrainingResult, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, ...]:
    return export_onnx(fzg_training, tmp_path_factory.mktemp("networks"), version="0")


RunCli = Callable[..., int]


@pytest.fixture(scope="session")
def run_cli() -> RunCli:
    """Runs the command line in this process and returns its exit status; `capsys` has what it printed."""

    def run(*arguments: object) -> int:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "argv", ["builder", *map(str, arguments)])
            try:
                main()
            except SystemExit as end:
                return int(end.code or 0)
        return 0

    return run


FmuBuilder = Callable[..., Path]


@pytest.fixture(scope="session")
def build_fmu(fzg: Gearbox, fzg_training: TrainingResult, fzg_networks: tuple[Path, ...]) -> FmuBuilder:
    """Builds an FMU at a path, of the default network or of another one."""

    def build(path: Path, network: ThermalNetwork | None = None) -> Path:
        return build_python_fmu(fzg, fzg_training, fzg_networks, path, network=network)

    return build


@pytest.fixture(scope="session")
def build_native(fzg: Gearbox, fzg_training: TrainingResult) -> FmuBuilder:
    """Builds a native FMU at a path for this machine, of the default network or of another one."""

    def build(path: Path, network: ThermalNetwork | None = None, *, fmi: int = 2) -> Path:
        return build_native_fmu(fzg, fzg_training, path, network=network, platforms="host", fmi=fmi)

    return build


@pytest.fixture(scope="session")
def fzg_native(build_native: FmuBuilder, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_native(tmp_path_factory.mktemp("native") / "fzg.fmu")


@pytest.fixture(scope="session")
def fzg_native3(build_native: FmuBuilder, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_native(tmp_path_factory.mktemp("native3") / "fzg.fmu", fmi=3)


@pytest.fixture(scope="session")
def fzg_fmu(build_fmu: FmuBuilder, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_fmu(tmp_path_factory.mktemp("fmu") / "fzg.fmu")


@pytest.fixture(scope="session")
def recordings_folder() -> Path:
    """Recordings that are not part of this repository: the folder TWIN_RECORDINGS, by default next to the checkout."""
    default = Path(__file__).parents[2] / "shared" / "recordings"
    folder = Path(os.environ.get("TWIN_RECORDINGS", default))
    if not folder.is_dir():
        pytest.skip(f"no recordings at {folder}; name their folder in TWIN_RECORDINGS")
    return folder
