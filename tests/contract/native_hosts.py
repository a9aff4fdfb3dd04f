"""Compiling and running the C hosts of ``native_host/`` on an FMU."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import fmpy
import pytest

SOURCES = Path(__file__).with_name("native_host")
COMPILER = shutil.which("gcc") or shutil.which("clang")
TIMEOUT_S = 300  # of a host; none takes more than seconds
OPTIONS = ("-std=gnu99", "-O1", "-g", "-Wall", "-Wextra", "-Wno-unused-function")

SANITIZED = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer")

THREAD_SANITIZED = ("-fsanitize=thread", "-fno-omit-frame-pointer")

needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler (gcc or clang)")


class Unpacked:
    """An FMU in a folder, and what a host must be told of it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.description = fmpy.read_model_description(str(folder))
        self.variables = {v.name: v for v in self.description.modelVariables}
        name = f"{self.description.coSimulation.modelIdentifier}{fmpy.sharedLibraryExtension}"
        (self.library,) = folder.glob(f"binaries/*/{name}")

    @property
    def arguments(self) -> list[str]:
        """Library, GUID, resources: what every host takes first."""
        return [str(self.library), self.description.guid, (self.folder / "resources").as_uri()]

    def references(self, *names: str) -> str:
        return ",".join(str(self.variables[name].valueReference) for name in names)

    def named(self, causality: str, kind: str = "Real") -> list[str]:
        return [v.name for v in self.variables.values() if v.causality == causality and v.type == kind]


def unpacked(path: Path, folder: Path) -> Unpacked:
    fmpy.extract(str(path), str(folder))
    return Unpacked(folder)


def compiled(name: str, fmu: Unpacked, output: Path, *options: str | Path) -> Path:
    """A host of ``native_host/``, with the FMI headers that the FMU carries."""
    headers = f"-I{fmu.folder / 'sources'}"
    run([str(COMPILER), *OPTIONS, *options, headers, "-o", output, SOURCES / f"{name}.c", "-ldl", "-lm", "-lpthread"])
    return output


def sanitized(fmu: Unpacked, library: Path, sanitizers: Sequence[str] = SANITIZED) -> Path:
    """The library of an FMU, compiled from its own sources with sanitizers."""
    sources = sorted((fmu.folder / "sources").glob("*.c"))
    options = ["-std=c99", "-O1", "-g", "-Wall", "-Wextra", "-Werror", *sanitizers, "-shared", "-fPIC"]
    run([str(COMPILER), *options, "-o", library, *sources, "-lm"])
    return library


def objects(fmu: Unpacked, folder: Path, version: int) -> list[Path]:
    """The sources of an FMU compiled for static linking, with the prefix that the standard asks for."""
    prefix = f"-DFMI{version}_FUNCTION_PREFIX={fmu.description.coSimulation.modelIdentifier}_"
    folder.mkdir()
    sources = sorted((fmu.folder / "sources").glob("*.c"))
    run([str(COMPILER), "-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", prefix, "-c", *sources], cwd=folder)
    return sorted(folder.glob("*.o"))


def run(command: Sequence[str | Path], **options: object) -> str:
    """Standard output of a command that must end well."""
    parts = [str(part) for part in command]
    done = subprocess.run(parts, capture_output=True, text=True, check=False, timeout=TIMEOUT_S, **options)
    assert done.returncode == 0, f"exit status {done.returncode}\n{done.stdout[-2000:]}\n{done.stderr[-6000:]}"
    return done.stdout
