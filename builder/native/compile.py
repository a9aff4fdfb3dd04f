"""C sources to shared libraries: for all platforms with ziglang, which cross-compiles, or for this machine alone.

Libraries are kept in a cache (``GEARBOX_TWIN_CACHE``, by default the user's cache folder; ``off`` for none), keyed by
all that makes them: the same sources, options and compiler are not compiled twice.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from importlib.resources import files
from pathlib import Path

from models.base.atomic_write import atomic_file
from models.base.errors import InputError, did_you_mean

CACHE_VARIABLE = "GEARBOX_TWIN_CACHE"
GET_ZIG = "install ziglang: python -m pip install ziglang"
INCLUDES_STANDARD_HEADERS = {"one.c": b"#include <math.h>\n#include <stdio.h>\nint one(void) { return 1; }\n"}
# NaN and infinity keep their meaning: no -ffast-math. Nobody reads errno or floating-point exceptions.
OPTIONS = (
    "-std=c99", "-O3", "-fno-unroll-loops", "-fno-math-errno", "-fno-trapping-math", "-ffp-contract=fast",
    "-fvisibility=hidden", "-fno-asynchronous-unwind-tables", "-fno-ident", "-g0",
)  # fmt: skip
# A DLL that zig links with its C library has MinGW's static one inside, which takes 80 s of processor time per
# platform to build. Windows' own C library and WINDOWS_RUNTIME are enough.
WINDOWS_RUNTIME = "windows_runtime.c"
WINDOWS_LINK = (
    "-nostdlib", "-lcompiler_rt",
    *(f"-lapi-ms-win-crt-{name}-l1-1-0"
      for name in ("convert", "heap", "math", "runtime", "stdio", "string", "utility")),
)  # fmt: skip


@dataclass(frozen=True)
class Platform:
    """A platform that FMUs are built for.

    Attributes
    ----------
    folder : str
        Below ``binaries/`` in an FMU: of FMI 2.0, or where that has none of FMI 3.0
    target : str
        As zig names it, with the oldest glibc that is supported
    suffix : str
        Of a shared library
    """

    folder: str
    target: str
    suffix: str

    @property
    def is_windows(self) -> bool:
        """True for the platforms of Windows."""
        return self.suffix == ".dll"

    @property
    def code_options(self) -> tuple[str, ...]:
        """Options that compile for this platform."""
        return () if self.is_windows else ("-fPIC",)

    @property
    def link_options(self) -> tuple[str, ...]:
        """Options of this platform's linker, libraries last."""
        return ("-Wl,--no-undefined", "-Wl,--build-id=none", "-lm") if self.suffix == ".so" else ()


PLATFORMS = {
    p.folder: p
    for p in (
        Platform("linux64", "x86_64-linux-gnu.2.17", ".so"),
        Platform("win64", "x86_64-windows-gnu", ".dll"),
        Platform("win32", "x86-windows-gnu", ".dll"),
        Platform("darwin64", "x86_64-macos", ".dylib"),
        Platform("aarch64-linux", "aarch64-linux-gnu.2.17", ".so"),
        Platform("aarch64-darwin", "aarch64-macos", ".dylib"),
        Platform("aarch64-windows", "aarch64-windows-gnu", ".dll"),
    )
}


class NoCompilerError(InputError):
    """There is no C compiler on this machine that native FMUs could be compiled with."""


@dataclass(frozen=True)
class Compiler:
    """A C compiler: the command that runs it, and its version."""

    command: tuple[str, ...]
    version: str
    is_zig: bool


@dataclass(frozen=True)
class Binaries:
    """Shared libraries by the folder of their platform, and a line on platforms that are missing, or ``""``."""

    libraries: Mapping[str, bytes]
    note: str


def host_platform() -> str | None:
    """Return the folder of this machine's platform; None if the platform is not known."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    system = {"linux": "linux", "darwin": "macos", "windows": "windows"}.get(platform.system().lower(), "")
    found = [p.folder for p in PLATFORMS.values() if p.target.startswith(f"{machine}-{system}")]
    return found[0] if system and found else None


def chosen_platforms(text: str) -> tuple[str, ...]:
    """Return the platforms that ``--platforms`` names: ``all``, ``host``, or folders separated by commas.

    Raises
    ------
    InputError
        If a platform, or that of this machine for ``host``, is not known.

    Examples
    --------
    >>> chosen_platforms("win64,linux64")
    ('win64', 'linux64')
    """
    if text == "all":
        return tuple(PLATFORMS)
    if text == "host":
        host = host_platform()
        if host is None:
            raise InputError(f"{platform.machine()} {platform.system()} is no platform that FMUs are built for")
        return (host,)
    names = [name.strip() for name in text.split(",") if name.strip()]
    for name in names:
        if name not in PLATFORMS:
            raise InputError(f"platform {name!r} is not known{did_you_mean(name, [*PLATFORMS, 'all', 'host'])}")
    if not names:
        raise InputError("no platform is named; give 'all', 'host' or a list such as linux64,win64")
    return tuple(dict.fromkeys(names))


@dataclass(frozen=True)
class Plan:
    """Platforms to build, their compiler, and a line on platforms that are missing, or ``""``."""

    compiler: Compiler
    platforms: tuple[str, ...]
    note: str = ""


def plan_for(platforms: str) -> Plan:
    """How the libraries that are asked for can be compiled on this machine.

    Parameters
    ----------
    platforms : str
        As :func:`chosen_platforms` takes it. ``host`` is for use on this machine: its own compiler is preferred, where
        there is one; all others are compiled by ziglang

    Raises
    ------
    NoCompilerError
        If there is no compiler at all.
    InputError
        If a platform is not known, or only ziglang can compile for it.
    """
    wanted, host, zig, own = chosen_platforms(platforms), host_platform(), _zig(), _own_compiler()
    if zig is not None and not (platforms == "host" and own is not None):
        return Plan(zig, wanted)
    if own is None:
        raise NoCompilerError(f"a native FMU needs a C compiler, and no cc, gcc or clang works here; {GET_ZIG}")
    if host is None or host not in wanted:
        raise InputError(f"this machine's own compiler cannot build for {', '.join(wanted)}; {GET_ZIG}")
    left_out = [name for name in wanted if name != host]
    return Plan(own, (host,), f"built for {host} only; for {', '.join(left_out)} {GET_ZIG}" if left_out else "")


def compile_libraries(sources: Mapping[str, bytes], platforms: str = "host") -> Binaries:
    """Compile C sources to shared libraries.

    Parameters
    ----------
    sources : mapping of file name to bytes
        C files and headers, all of one folder
    platforms : str
        See :func:`plan_for`

    Returns
    -------
    Binaries

    Raises
    ------
    InputError
        If there is no compiler for what is asked, or it fails.
    """
    plan = plan_for(platforms)
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        libraries = list(pool.map(partial(_library, sources, plan.compiler), [PLATFORMS[p] for p in plan.platforms]))
    return Binaries(dict(zip(plan.platforms, libraries, strict=True)), plan.note)


@cache
def _zig() -> Compiler | None:
    if importlib.util.find_spec("ziglang") is None:
        return None
    command = (sys.executable, "-m", "ziglang")
    return Compiler((*command, "cc"), _output([*command, "version"]), is_zig=True)


def _own_compiler() -> Compiler | None:
    """Return the compiler that CC names, else the first of cc, gcc and clang that compiles a file.

    Raises
    ------
    InputError
        If CC names no command.
    """
    named = os.environ.get("CC")
    try:
        own = [tuple(shlex.split(named))] if named else [("cc",), ("gcc",), ("clang",)]
    except ValueError as error:
        raise InputError(f"CC is {named!r}, which cannot be read ({error}); correct it or unset it") from error
    for command in own:
        if command and shutil.which(command[0]):
            compiler = Compiler(command, _output([*command, "--version"]), is_zig=False)
            if named or _works(compiler):
                return compiler
    if named:
        raise InputError(f"CC is {named!r}, which cannot be found; correct it or unset it")
    return None


@cache
def _works(compiler: Compiler) -> bool:
    """Return True if a compiler is there with the headers and libraries of C."""
    host = host_platform()
    try:
        return host is not None and bool(_compile(INCLUDES_STANDARD_HEADERS, compiler, PLATFORMS[host]))
    except InputError:
        return False


def _output(command: Sequence[str]) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout  # noqa: S603 - a compiler


def _library(sources: Mapping[str, bytes], compiler: Compiler, target: Platform) -> bytes:
    if compiler.is_zig and target.is_windows:
        runtime = (files("fmu_src") / "native" / WINDOWS_RUNTIME).read_bytes()
        sources = {**sources, WINDOWS_RUNTIME: runtime}
    folder = _cache_folder()
    if folder is None:
        return _compile(sources, compiler, target)
    # zig is the same in every virtual environment, and another compiler's own options are part of its command.
    command = compiler.command[1:] if compiler.is_zig else compiler.command
    made_of = (compiler.version, command, _commands(["*.c"], compiler, target), sorted(sources.items()))
    digest = hashlib.sha256(repr(made_of).encode()).hexdigest()
    kept = folder / f"{digest}{target.suffix}"
    try:
        return kept.read_bytes()
    except OSError:
        library = _compile(sources, compiler, target)
    try:
        with atomic_file(kept) as file:
            file.write_bytes(library)
    except (InputError, OSError):
        pass  # without a cache it is only slower
    return library


def _cache_folder() -> Path | None:
    named = os.environ.get(CACHE_VARIABLE)
    if named == "off":
        return None
    if named:
        return Path(named)
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or Path.home() / "AppData/Local"
    elif sys.platform == "darwin":
        base = Path.home() / "Library/Caches"
    else:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "gearbox-thermal-twin"


def _compile(sources: Mapping[str, bytes], compiler: Compiler, target: Platform) -> bytes:
    with tempfile.TemporaryDirectory(prefix="twin-c-") as folder:
        for name, content in sources.items():
            Path(folder, name).write_bytes(content)
        for options in _commands(sorted(name for name in sources if name.endswith(".c")), compiler, target):
            command = [*compiler.command, *options]
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603
            if done.returncode != 0:
                said = "\n".join((done.stderr or done.stdout).splitlines()[:20])
                raise InputError(f"{' '.join(compiler.command)} cannot compile the FMU for {target.folder}:\n{said}")
        return Path(folder, f"library{target.suffix}").read_bytes()


def _commands(names: Sequence[str], compiler: Compiler, target: Platform) -> list[list[str]]:
    """Options of the compiler's runs; all names are relative: no path of this machine gets into the library."""
    machine = ["-target", target.target] if compiler.is_zig else []
    code = [*machine, *OPTIONS, *target.code_options]
    link = [*machine, "-shared", "-s", "-o", f"library{target.suffix}"]
    if compiler.is_zig and target.is_windows:
        objects = [f"{name}.obj" for name in names]
        compiled = [[*code, "-c", name, "-o", made] for name, made in zip(names, objects, strict=True)]
        return [*compiled, [*link, "-O3", *objects, *WINDOWS_LINK]]
    return [[*code, *link, *names, *target.link_options]]
