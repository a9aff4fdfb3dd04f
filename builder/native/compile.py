"""C sources to shared libraries: for all platforms with ziglang, which cross-compiles, or for this machine alone.

Libraries are kept (:mod:`builder.base.cache`), keyed by all that makes them: the same sources, options and compiler are
not compiled twice.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import shlex
import shutil
import struct
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from importlib.resources import files
from pathlib import Path

from builder.base.cache import cached_path, keep, recall
from models.base.errors import InputError, did_you_mean
from models.base.progress import Progress, silent

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
    targets : mapping of str to str
        Processors: folder below ``binaries/`` in FMI 3.0, and the target as zig names it, with the oldest system that
        is supported. In FMI 2.0 all are in one folder, those of macOS in one universal library
    suffix : str
        Of a shared library
    """

    targets: Mapping[str, str]
    suffix: str


# By the folder below binaries/ in FMI 2.0
PLATFORMS = {
    "linux64": Platform({"x86_64-linux": "x86_64-linux-gnu.2.17"}, ".so"),
    "win64": Platform({"x86_64-windows": "x86_64-windows-gnu"}, ".dll"),
    "win32": Platform({"x86-windows": "x86-windows-gnu"}, ".dll"),
    "darwin64": Platform({"x86_64-darwin": "x86_64-macos.11.0", "aarch64-darwin": "aarch64-macos.11.0"}, ".dylib"),
    "aarch64-linux": Platform({"aarch64-linux": "aarch64-linux-gnu.2.17"}, ".so"),
    "aarch64-windows": Platform({"aarch64-windows": "aarch64-windows-gnu"}, ".dll"),
}


@dataclass(frozen=True)
class Library:
    """A shared library to be compiled: for one processor of a platform.

    Attributes
    ----------
    folder : str
        Of the platform, key of :data:`PLATFORMS`
    processor : str
        Key of :attr:`Platform.targets`
    name : str
        Without suffix
    """

    folder: str
    processor: str
    name: str

    @property
    def file(self) -> str:
        """Name of the file."""
        return f"{self.name}{PLATFORMS[self.folder].suffix}"

    @property
    def target(self) -> str:
        """Target as zig names it."""
        return PLATFORMS[self.folder].targets[self.processor]

    @property
    def is_windows(self) -> bool:
        """True for the platforms of Windows."""
        return self.file.endswith(".dll")

    @property
    def code_options(self) -> tuple[str, ...]:
        """Options that compile for this platform."""
        return () if self.is_windows else ("-fPIC",)

    @property
    def link_options(self) -> tuple[str, ...]:
        """Options of this platform's linker, libraries last."""
        if self.file.endswith(".so"):
            return ("-Wl,--no-undefined", "-Wl,--build-id=none", "-lm")
        return () if self.is_windows else (f"-Wl,-install_name,@rpath/{self.file}",)


class NoCompilerError(InputError):
    """There is no C compiler on this machine that native FMUs could be compiled with."""


@dataclass(frozen=True)
class Compiler:
    """A C compiler: the command that runs it, and its version."""

    command: tuple[str, ...]
    version: str
    is_zig: bool


def _host_processor() -> str:
    """Folder of this machine in FMI 3.0."""
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    return f"{machine}-{platform.system().lower()}"


def host_platform() -> str | None:
    """Return this machine's platform; None if it is not known."""
    return next((name for name, of in PLATFORMS.items() if _host_processor() in of.targets), None)


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
        As :func:`chosen_platforms` takes it. ziglang compiles, where it is installed: for the oldest systems that are
        supported; else this machine's own compiler does, for a C library as new as this machine's

    Raises
    ------
    NoCompilerError
        If there is no compiler at all.
    InputError
        If a platform is not known, or only ziglang can compile for it.
    """
    wanted, host, zig = chosen_platforms(platforms), host_platform(), _zig()
    if zig is not None:
        return Plan(zig, wanted)
    own = _own_compiler()
    if own is None:
        raise NoCompilerError(f"a native FMU needs a C compiler, and no cc, gcc or clang works here; {GET_ZIG}")
    if host is None or host not in wanted:
        raise InputError(f"this machine's own compiler cannot build for {', '.join(wanted)}; {GET_ZIG}")
    left_out = [name for name in wanted if name != host]
    return Plan(own, (host,), f"built for {host} only; for {', '.join(left_out)} {GET_ZIG}" if left_out else "")


def compile_libraries(
    sources: Mapping[str, bytes], platforms: str = "host", *, name: str = "library", fmi: int = 2,
    progress: Progress = silent,
) -> dict[str, bytes]:  # fmt: skip
    """Compile C sources to shared libraries.

    Parameters
    ----------
    sources : mapping of file name to bytes
        C files and headers, all of one folder
    platforms : str
        See :func:`plan_for`
    name : str
        Of the library, without suffix
    fmi : int
        Version of FMI, 2 or 3, that the folders are for
    progress : callable
        Told what is being waited for

    Returns
    -------
    dict of str to bytes
        Shared libraries by their path below ``binaries/``

    Raises
    ------
    InputError
        If there is no compiler for what is asked, or it fails.
    """
    plan = plan_for(platforms)
    wanted = [
        Library(folder, processor, name)
        for folder in plan.platforms
        for processor in PLATFORMS[folder].targets
        if plan.compiler.is_zig or processor == _host_processor()
    ]
    command = "ziglang" if plan.compiler.is_zig else plan.compiler.command[0]
    waiting = f"waiting for the C compiler ({command}), {', '.join(plan.platforms)}"
    progress(waiting, 0, len(wanted))
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        compiled = []
        for content in pool.map(partial(_library, sources, plan.compiler), wanted):
            compiled.append(content)
            progress(waiting, len(compiled), len(wanted))
    found: dict[str, list[bytes]] = {}
    for library, content in zip(wanted, compiled, strict=True):
        folder = library.folder if fmi == 2 else library.processor
        found.setdefault(f"{folder}/{library.file}", []).append(content)
    return {path: parts[0] if len(parts) == 1 else universal_binary(parts) for path, parts in found.items()}


def universal_binary(libraries: Sequence[bytes]) -> bytes:
    """Join Mach-O libraries of several processors in one file, as ``lipo`` does (``mach-o/fat.h``)."""
    alignment = 14  # 2^14 bytes: a page of an ARM Mac
    head, body = struct.pack(">II", 0xCAFEBABE, len(libraries)), b""
    first = 1 << alignment
    for library in libraries:
        processor, variant = struct.unpack_from("<II", library, 4)
        head += struct.pack(">IIIII", processor, variant, first + len(body), len(library), alignment)
        body += library + bytes(-len(library) % first)
    return head.ljust(first, b"\0") + body


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
        # Backslashes are part of a path on Windows.
        words = [word.strip('"') for word in shlex.split(named, posix=os.name != "nt")] if named else []
        own = [tuple(words)] if named else [("cc",), ("gcc",), ("clang",)]
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
        return host is not None and bool(
            _compile(INCLUDES_STANDARD_HEADERS, compiler, Library(host, _host_processor(), "one"))
        )
    except InputError:
        return False


def _output(command: Sequence[str]) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout  # noqa: S603 - a compiler


def _library(sources: Mapping[str, bytes], compiler: Compiler, wanted: Library) -> bytes:
    if compiler.is_zig and wanted.is_windows:
        runtime = (files("fmu_src") / "native" / WINDOWS_RUNTIME).read_bytes()
        sources = {**sources, WINDOWS_RUNTIME: runtime}
    # zig is the same in every virtual environment, and another compiler's own options are part of its command.
    command = compiler.command[1:] if compiler.is_zig else compiler.command
    made_of = (compiler.version, command, _commands(["*.c"], compiler, wanted), sorted(sources.items()))
    digest = hashlib.sha256(repr(made_of).encode()).hexdigest()
    path = cached_path(f"{digest}-{wanted.file}")
    library = recall(path)
    if library is None:
        library = _compile(sources, compiler, wanted)
        keep(path, library)
    return library


def _compile(sources: Mapping[str, bytes], compiler: Compiler, library: Library) -> bytes:
    with tempfile.TemporaryDirectory(prefix="twin-c-") as folder:
        for name, content in sources.items():
            Path(folder, name).write_bytes(content)
        for options in _commands(sorted(name for name in sources if name.endswith(".c")), compiler, library):
            command = [*compiler.command, *options]
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)  # noqa: S603
            if done.returncode != 0:
                said = "\n".join((done.stderr or done.stdout).splitlines()[:20])
                raise InputError(
                    f"{' '.join(compiler.command)} cannot compile the FMU for {library.processor}:\n{said}"
                )
        return Path(folder, library.file).read_bytes()


def _commands(names: Sequence[str], compiler: Compiler, library: Library) -> list[list[str]]:
    """Options of the compiler's runs; all names are relative: no path of this machine gets into the library."""
    machine = ["-target", library.target] if compiler.is_zig else []
    code = [*machine, *OPTIONS, *library.code_options]
    link = [*machine, "-shared", "-s", "-o", library.file]
    if compiler.is_zig and library.is_windows:
        objects = [f"{name}.obj" for name in names]
        compiled = [[*code, "-c", name, "-o", made] for name, made in zip(names, objects, strict=True)]
        return [*compiled, [*link, "-O3", *objects, *WINDOWS_LINK]]
    return [[*code, *link, *names, *library.link_options]]
