"""``modelDescription.xml`` and ``buildDescription.xml`` of an FMU of FMI 3.0 for co-simulation.

The same signals with the same value references as in FMI 2.0; the independent variable ``time``, which FMI 3.0 asks
for, comes after them.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from builder.fmi.model_description import (
    DEPENDENCY_KINDS,
    INITIAL_DEPENDENCY_KINDS,
    FmuIdentity,
    add_co_simulation,
    add_experiment,
    add_log_categories,
    add_units,
    dependencies,
    document,
    type_attributes,
    value_attributes,
    with_guid,
)
from builder.fmi.signals import SignalTable
from models.quantities.quantities import TYPES


def model_description3(table: SignalTable, identity: FmuIdentity, *, content: bytes = b"") -> bytes:
    """The XML of an FMU of FMI 3.0; arguments as of :func:`builder.fmi.model_description.model_description`."""
    return with_guid(lambda token: _xml(table, identity, token), content)


def build_description(identity: FmuIdentity) -> bytes:
    """``sources/buildDescription.xml``: the files that a compiler takes."""
    root = Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = SubElement(root, "BuildConfiguration", modelIdentifier=identity.model_identifier)
    files = SubElement(configuration, "SourceFileSet", language="C99")
    for name in identity.source_files:
        SubElement(files, "SourceFile", name=name)
    return document(root)


def _xml(table: SignalTable, identity: FmuIdentity, token: str) -> bytes:
    root = Element(
        "fmiModelDescription", fmiVersion="3.0", modelName=identity.model_name, instantiationToken=token,
        description=identity.description, author=identity.author, version=identity.version,
        copyright=identity.copyright, license=identity.license, generationTool=identity.generation_tool,
        variableNamingConvention="structured",
    )  # fmt: skip
    add_co_simulation(root, identity)
    add_units(root, table)
    types = SubElement(root, "TypeDefinitions")
    for name, kind in TYPES.items():
        if any(signal.type == name for signal in table):
            SubElement(types, "Float64Type", {"name": name, "description": kind.description} | type_attributes(kind))
    add_log_categories(root)
    add_experiment(root, identity)
    _variables(SubElement(root, "ModelVariables"), table)
    _structure(SubElement(root, "ModelStructure"), table)
    return document(root)


def _variables(parent: Element, table: SignalTable) -> None:
    for signal in table:
        attributes = {
            "name": signal.name, "valueReference": str(signal.reference), "description": signal.description,
            "causality": signal.causality, "variability": signal.variability,
        }  # fmt: skip
        initial = {"initial": signal.initial} if signal.initial else {}
        kind = "Boolean" if signal.is_boolean else "Float64"
        SubElement(parent, kind, attributes | initial | value_attributes(signal))
    SubElement(
        parent, "Float64", name="time", valueReference=str(len(table)), causality="independent",
        variability="continuous", description="Simulation time, in seconds",
    )  # fmt: skip


def _structure(parent: Element, table: SignalTable) -> None:
    outputs = [signal for signal in table if signal.causality == "output"]
    for signal in outputs:
        known = dependencies(table, signal, signal.depends, DEPENDENCY_KINDS, first=0)
        SubElement(parent, "Output", {"valueReference": str(signal.reference)} | known)
    for signal in outputs:
        known = dependencies(table, signal, signal.depends_initially, INITIAL_DEPENDENCY_KINDS, first=0)
        SubElement(parent, "InitialUnknown", {"valueReference": str(signal.reference)} | known)
