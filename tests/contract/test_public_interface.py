"""The public package: everything it promises is there, costs nothing until used, and survives a user's own folders."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import gearbox_twin

COMMAND = Path(sys.executable).with_name("gearbox-twin")


def _run(*arguments: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(a) for a in arguments], cwd=cwd, capture_output=True, text=True, check=False)


@pytest.fixture
def crowded(tmp_path: Path) -> Path:
    """A user's project with packages of the same names as ours."""
    for name in ("models", "builder", "diagnosis", "fmu_src"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(f"raise RuntimeError('the user has a {name}')\n")
    return tmp_path


@pytest.mark.parametrize("name", gearbox_twin.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(gearbox_twin, name) is not None


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no_such_name"):
        _ = gearbox_twin.no_such_name


def test_importing_costs_nothing() -> None:
    code = "import sys, gearbox_twin; print(*sorted({'numpy', 'sympy', 'models', 'builder'} & set(sys.modules)))"
    run = _run(sys.executable, "-c", code, cwd=Path(gearbox_twin.__file__).parents[1])
    assert (run.returncode, run.stdout.strip()) == (0, "")


@pytest.mark.slow  # CI builds an FMU in the project's own folder with what was installed
@pytest.mark.skipif(not COMMAND.exists(), reason="the command is not installed in this environment")
def test_the_command_works_next_to_packages_of_the_same_names(crowded: Path) -> None:
    quick = ("--target", "python", "--preset", "paper", "--samples", "50")
    run = _run(COMMAND, "build-fmu", *quick, "--jobs", "2", "--output", "out", cwd=crowded)
    assert run.returncode == 0, run.stderr
    assert list((crowded / "out").glob("*.fmu"))


def test_a_package_in_the_way_is_named(crowded: Path) -> None:
    for name in ("models", "builder", "diagnosis", "fmu_src"):
        (crowded / name / "__init__.py").write_text("")
    run = _run(sys.executable, "-c", "import gearbox_twin; gearbox_twin.load_gearbox", cwd=crowded)
    assert run.returncode == 1
    assert str(crowded / "models") in run.stderr and "gearbox-twin" in run.stderr
