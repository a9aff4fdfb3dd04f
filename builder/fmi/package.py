"""Parts that every FMU of a gearbox has, and the archive that they go into."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from builder.fmi.documentation import Kind, documentation
from builder.fmi.model_description import FmuIdentity
from builder.fmi.recorded import recorded_file
from builder.fmi.reference import reference_run
from builder.fmi.signals import SignalTable, signal_table
from builder.surrogate.train import TrainingResult
from models.assembly.gearbox import Gearbox
from models.base.atomic_write import atomic_file
from models.base.errors import InputError
from models.base.version import project_version
from models.correction.correction import Correction, corrected_network
from models.portable.evaluation import NoLosses
from models.portable.surrogate import SurrogateLosses
from models.simulation.thermal_network import ThermalNetwork

AUTHOR = "gearbox-thermal-twin"
EARLIEST = (1980, 1, 1, 0, 0, 0)  # time of files in a zip file


@dataclass(frozen=True, kw_only=True)
class CommonParts:
    """Parts that the FMU of a gearbox has in all kinds, and what the parts of one kind follow from.

    Attributes
    ----------
    network : ThermalNetwork
    losses : SurrogateLosses or None
        None for a network without loss components
    table : SignalTable
    identity : FmuIdentity
    pages : mapping of path to bytes
        Documentation, and what the FMU knows of recordings, by path in the archive
    """

    network: ThermalNetwork
    losses: SurrogateLosses | None
    table: SignalTable
    identity: FmuIdentity
    pages: Mapping[str, bytes]


def common_parts(
    gearbox: Gearbox,
    training: TrainingResult | None,
    output: Path,
    *,
    network: ThermalNetwork | None,
    correction: Correction | None,
    kind: Kind,
) -> CommonParts:
    """Parts of the FMU of a gearbox that do not depend on its kind.

    Parameters
    ----------
    gearbox : Gearbox
    training : TrainingResult or None
        The trained surrogate; None for a network without loss components
    output : Path
        The FMU; its stem becomes the model identifier
    network : ThermalNetwork or None
        The thermal network, if it is neither the gearbox's nominal nor the corrected one
    correction : Correction or None
        Findings of a diagnosis; the FMU contains them and its documentation lists them
    kind : Kind
        Kind of the FMU, for its documentation

    Raises
    ------
    InputError
        If the network has laws that are no expressions, or the networks are another gearbox's.
    """
    network = corrected_network(gearbox, correction) if network is None else network
    losses = None if training is None else training.losses
    if network.numeric_laws:
        raise InputError(
            f"{', '.join(network.numeric_laws)}: this law branches on values or calls numpy, so it simulates but "
            "cannot go into an FMU; write it with arithmetic, sympy functions and sympy.Piecewise"
        )
    table = signal_table(network, losses)
    identity = gearbox_identity(gearbox, output, correction)
    reference = reference_run(gearbox, network, table, losses)
    pages = documentation(gearbox, table, identity, training, reference, kind=kind) | recorded_file(
        network, gearbox.hash
    )
    return CommonParts(network=network, losses=losses, table=table, identity=identity, pages=pages)


def gearbox_identity(gearbox: Gearbox, output: Path, correction: Correction | None) -> FmuIdentity:
    """Description of an FMU of a gearbox, without its capabilities."""
    version = project_version()
    model = "thermal network" if gearbox.is_parametric else "reduced-order twin of a detailed loss model"
    subject = "Temperatures" if isinstance(gearbox.loss_laws(), NoLosses) else "Power loss and temperatures"
    model += f", {correction.words}" if correction is not None and correction.has_physics else ""
    return FmuIdentity(
        model_name=gearbox.name,
        model_identifier=model_identifier(output.stem),
        description=f"{subject} of {gearbox.name}: {model}",
        version=version,
        author=AUTHOR,
        generation_tool=f"gearbox-thermal-twin {version}",
    )


def model_identifier(name: str) -> str:
    """A name as C identifier, as FMI wants it.

    Examples
    --------
    >>> model_identifier("fzg"), model_identifier("2 stage-box")
    ('fzg', 'gearbox_2_stage_box')
    """
    plain = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return plain if re.match(r"[A-Za-z]", plain) else f"gearbox_{plain}"


def package_fmu(output: Path, description: bytes, *parts: Mapping[str, bytes]) -> None:
    """Write an FMU.

    Parameters
    ----------
    output : Path
    description : bytes
        ``modelDescription.xml``
    *parts : mapping of path to bytes
        Binaries, resources, sources, documentation by their path in the archive

    Raises
    ------
    InputError
        If the folder cannot be written to.
    """
    content = {name: file for part in parts for name, file in part.items()} | {"modelDescription.xml": description}
    with atomic_file(output) as partial:
        write_archive(partial, content)


def write_archive(target: Path, content: Mapping[str, bytes]) -> None:
    """Write a zip archive: sorted, without times, deflated, so that the same content gives the same bytes."""
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for name in sorted(content):
            entry = zipfile.ZipInfo(name, date_time=EARLIEST)
            entry.compress_type, entry.create_system, entry.external_attr = zipfile.ZIP_DEFLATED, 3, 0o644 << 16
            archive.writestr(entry, content[name], compresslevel=9)
