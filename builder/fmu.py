"""A gearbox and its trained networks as an FMU: FMI 2.0 co-simulation, run by Python through pythonfmu.

The FMU is the same file, byte for byte, for the same definition, networks and version.
"""

from __future__ import annotations

import hashlib
import json
import re
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import fmu_src
import models
from builder.fmu_documentation import Kind, documentation
from builder.fmu_reference import reference_run
from builder.model_description import Identity, model_description
from builder.signals import Signal, SignalTable, signal_table
from builder.train import TrainingResult
from builder.units import UNITS
from fmu_src.contents import DATA
from fmu_src.twin import LISTS
from models.atomic_write import atomic_file
from models.compiled import compile_laws, law_source
from models.correction import Correction, corrected_network
from models.errors import InputError
from models.gearbox import Gearbox
from models.network import ThermalNetwork
from models.surrogate import SurrogateLosses
from models.version import project_version

AUTHOR = "gearbox-thermal-twin"
EARLIEST = (1980, 1, 1, 0, 0, 0)  # of a zip file
COPIED = {
    models: ("errors", "types", "solver", "runtime", "surrogate"),
    fmu_src: ("twin", "contents", "onnx_losses", "gearbox_slave"),
}
REQUIREMENTS = "numpy>=2.1\nonnxruntime>=1.20\n"
# pythonfmu 0.7.0 runs the module once more at every instantiation, and then gives back a reference to its globals that
# it never took: without one more each time, the second or third instance crashes the host.
SLAVE = """from {package} import generated
from {package}.gearbox_slave import GearboxSlave

generated.KEPT.append(globals())  # pythonfmu releases one reference too many per instance


class Slave(GearboxSlave):
    \"\"\"FMU {identifier}.\"\"\"

    generated = generated
"""
FLAGS = {
    "needsExecutionTool": True,
    "canHandleVariableCommunicationStepSize": True,
    "canInterpolateInputs": False,
    "canRunAsynchronuously": False,
    "canBeInstantiatedOnlyOncePerProcess": False,
    "canNotUseMemoryManagementFunctions": True,
    "canGetAndSetFMUstate": True,
    "canSerializeFMUstate": True,
    "providesDirectionalDerivative": False,
}


def build_python_fmu(
    gearbox: Gearbox,
    training: TrainingResult,
    networks: Sequence[Path],
    output: Path,
    *,
    network: ThermalNetwork | None = None,
    correction: Correction | None = None,
) -> Path:
    """Package a gearbox as an FMU that needs Python, numpy and onnxruntime where it is used.

    Parameters
    ----------
    gearbox : Gearbox
    training : TrainingResult
        The trained surrogate
    networks : sequence of Path
        Its ONNX files
    output : Path
        The FMU; its stem becomes the model identifier
    network : ThermalNetwork or None
        The thermal network, where it is neither the gearbox's nominal nor the corrected one
    correction : Correction or None
        What a diagnosis found; the FMU has it and says so

    Returns
    -------
    Path
        `output`

    Raises
    ------
    InputError
        If the folder cannot be written to, the network has laws that are no expressions, or the networks are another
        gearbox's.
    """
    network = corrected_network(gearbox, correction) if network is None else network
    refuse_mismatch(network, training.losses, networks)
    with atomic_file(output) as partial, tempfile.TemporaryDirectory(prefix="twin-fmu-") as scratch:
        table = signal_table(gearbox, network, training.losses)
        identity = gearbox_identity(gearbox, output, FLAGS, correction)
        data = twin_data(table, network, training.losses, definition=gearbox.hash)
        files = {DATA: _json(data)} | {path.name: path.read_bytes() for path in networks}
        stage = Path(scratch) / "resources"
        slave, digest = _write_resources(stage, files, network, identity.model_identifier)
        xml = model_description(table, identity, content=digest)
        (stage / "modelDescription.xml").write_bytes(xml)
        (stage / "requirements.txt").write_text(REQUIREMENTS, encoding="utf-8")
        pages = gearbox_pages(gearbox, network, table, identity, training, kind="python")
        built = _with_pythonfmu(slave, stage, Path(scratch) / f"{identity.model_identifier}.fmu")
        _repack(built, partial, pages | {"modelDescription.xml": xml})
    return output


def gearbox_identity(
    gearbox: Gearbox, output: Path, flags: Mapping[str, bool], correction: Correction | None
) -> Identity:
    """What an FMU of a gearbox says about itself."""
    version = project_version()
    model = "reduced-order twin of a detailed loss model" + ("" if correction is None else f", {correction.words}")
    return Identity(
        model_name=gearbox.name,
        model_identifier=model_identifier(output.stem),
        description=f"Power loss and temperatures of {gearbox.name}: {model}",
        version=version,
        author=AUTHOR,
        license="MIT; see documentation/licenses",
        copyright="See documentation/licenses",
        generation_tool=f"gearbox-thermal-twin {version}",
        flags=flags,
    )


def gearbox_pages(
    gearbox: Gearbox,
    network: ThermalNetwork,
    table: SignalTable,
    identity: Identity,
    training: TrainingResult,
    *,
    kind: Kind,
) -> dict[str, bytes]:
    """What an FMU of a gearbox carries for people, by path in the archive."""
    data = twin_data(table, network, training.losses, definition=gearbox.hash)
    reference = reference_run(gearbox, network, table, data, training.losses)
    return documentation(gearbox, table, identity, training, reference, kind=kind)


def model_identifier(name: str) -> str:
    """A name as C identifier, as FMI wants it.

    Examples
    --------
    >>> model_identifier("fzg"), model_identifier("2 stage-box")
    ('fzg', 'gearbox_2_stage_box')
    """
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return plain if re.match(r"[A-Za-z]", plain) else f"gearbox_{plain}"


def twin_data(
    table: SignalTable, network: ThermalNetwork, losses: SurrogateLosses, *, definition: str
) -> dict[str, Any]:
    """Everything that :class:`fmu_src.twin.Twin` needs beside the law functions, as plain numbers and strings."""
    laws = compile_laws(network, vector=False)
    arrays = ("laplacian", "to_boundary", "injection")
    data: dict[str, Any] = {
        "signals": [_slot(signal) for signal in table],
        "network": {
            **{name: list(getattr(laws, name)) for name in LISTS},
            **{name: getattr(laws, name).tolist() for name in arrays},
            "updates": laws.updates,
            "state_starts": [float(state.start) for state in network.states],
        },
        "losses": losses.to_dict(),
        "definition": definition,
    }
    return data | {"identity": hashlib.sha256(_json(data) + _json(law_source(network, vector=False))).hexdigest()}


def _slot(signal: Signal) -> dict[str, Any]:
    """One signal for :class:`fmu_src.twin.Slot`."""
    settable = {"input": "input", "parameter": signal.variability}.get(signal.causality, "")
    unit = UNITS.get(signal.unit or "")
    # Only signals of the network's own quantities are converted; a parameter stays in the unit of its law.
    name, scale, offset = unit.column if unit is not None and signal.role != "factor" else (signal.unit or "", 1.0, 0.0)
    return {
        "name": signal.name,
        "role": signal.role,
        "of": signal.of,
        "unit": signal.unit or "",
        "boolean": signal.is_boolean,
        "settable": settable,
        "start": 0.0 if signal.start is None else float(signal.start),
        "minimum": max(signal.minimum, -sys.float_info.max),
        "maximum": min(signal.maximum, sys.float_info.max),
        "scale": scale,
        "offset": offset,
        "inner_unit": name,
    }


def _json(data: Any) -> bytes:
    return json.dumps(data, indent=1, allow_nan=False).encode()


def refuse_mismatch(network: ThermalNetwork, losses: SurrogateLosses, networks: Sequence[Path]) -> None:
    """Refuse laws that are no expressions, and networks of another gearbox.

    Raises
    ------
    InputError
    """
    if network.numeric_laws:
        raise InputError(
            f"{', '.join(network.numeric_laws)}: this law branches on values or calls numpy, so it simulates but "
            "cannot go into an FMU; write it with arithmetic, sympy functions and sympy.Piecewise"
        )
    if tuple(losses.components) != tuple(network.components):
        raise InputError("the networks were trained for another gearbox; train them for this one")
    missing = {f"{trained.name}.onnx" for trained in losses.networks} - {path.name for path in networks}
    if missing:
        raise InputError(f"the ONNX files {', '.join(sorted(missing))} are missing; export the networks again")


def _write_resources(
    stage: Path, files: Mapping[str, bytes], network: ThermalNetwork, identifier: str
) -> tuple[Path, bytes]:
    """Write the slave module, its package and the data files; gives the module and a digest of everything.

    Both names carry the digest: Python keeps one module per name in a process, so that a second FMU with modules of the
    same name would silently run the first one's code.
    """
    digests = {name: hashlib.sha256(content).hexdigest() for name, content in sorted(files.items())}
    laws = "\n\n".join(law_source(network, vector=False).values())
    generated = (
        '"""Generated by the builder: the laws of the thermal network, and what the data files must be."""\n\n'
        f"import math\n\nMODEL_IDENTIFIER = {identifier!r}\nKEPT = []\n"
        f"DIGESTS = {json.dumps(digests, indent=4)}\n\n\n{laws}"
    )
    sources = {"generated.py": generated, "__init__.py": ""} | dict(_copied_sources())
    digest = hashlib.sha256(_json(dict(sorted(sources.items())))).hexdigest()
    package = stage / f"{identifier}_{digest[:16]}"
    package.mkdir(parents=True)
    for name, text in sources.items():
        (package / name).write_text(text, encoding="utf-8", newline="\n")
    for name, content in files.items():
        (stage / name).write_bytes(content)
    slave = stage / f"{package.name}_slave.py"
    slave.write_text(SLAVE.format(package=package.name, identifier=identifier), encoding="utf-8", newline="\n")
    return slave, digest.encode()


def _copied_sources() -> Iterator[tuple[str, str]]:
    """The files that run inside, importing each other as one package whatever its name."""
    for package, names in COPIED.items():
        for name in names:
            text = (Path(package.__path__[0]) / f"{name}.py").read_text(encoding="utf-8")
            text = re.sub(r"^from (?:models|fmu_src)(?:\.(\w+))? import", _relative, text, flags=re.MULTILINE)
            if re.search(r"^\s*(?:from|import) (?:models|fmu_src|builder)\b", text, flags=re.MULTILINE):
                raise ImportError(f"{name}.py imports something that does not run inside an FMU")
            yield f"{name}.py", text


def _relative(match: re.Match[str]) -> str:
    return f"from .{match[1] or ''} import"


def _with_pythonfmu(slave: Path, stage: Path, target: Path) -> Path:
    """What pythonfmu's own builder makes of the staged files; it loads the slave once, which tries it out."""
    from pythonfmu import FmuBuilder

    others = [path for path in stage.iterdir() if path != slave]
    with _unchanged_imports(slave.stem.removesuffix("_slave")):
        FmuBuilder.build_FMU(script_file=slave, dest=target, project_files=others)
    return target


@contextmanager
def _unchanged_imports(prefix: str) -> Iterator[None]:
    """Forget what loading the slave leaves behind in this process."""
    path, no_bytecode = list(sys.path), sys.dont_write_bytecode
    sys.dont_write_bytecode = True
    try:
        yield
    finally:
        sys.path[:], sys.dont_write_bytecode = path, no_bytecode
        for name in [name for name in sys.modules if name.startswith(prefix)]:
            del sys.modules[name]


def _repack(built: Path, target: Path, changed: Mapping[str, bytes]) -> None:
    """Write an archive again, some files changed or added."""
    with zipfile.ZipFile(built) as archive:
        content = {name: archive.read(name) for name in archive.namelist()} | dict(changed)
    write_archive(target, content)


def write_archive(target: Path, content: Mapping[str, bytes]) -> None:
    """Write a zip archive: sorted, without times, deflated, so that the same content gives the same bytes."""
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name in sorted(content):
            entry = zipfile.ZipInfo(name, date_time=EARLIEST)
            entry.compress_type, entry.create_system, entry.external_attr = zipfile.ZIP_DEFLATED, 3, 0o644 << 16
            archive.writestr(entry, content[name], compresslevel=9)
