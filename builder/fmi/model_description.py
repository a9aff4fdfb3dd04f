"""The ``modelDescription.xml`` of an FMU (FMI 2.0, co-simulation) from its table of signals.

Knows nothing of what runs inside: a Python FMU and a native one differ in the flags and source files that they pass.
The same arguments give the same bytes.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from xml.etree.ElementTree import Element, SubElement, fromstring, indent, tostring

from builder.fmi.signals import Signal, SignalTable
from models.quantities.quantities import TYPES
from models.quantities.units import UNITS, conversion, find_unit

LOG_CATEGORIES: Mapping[str, str] = {
    "logStatusWarning": "The operating point left the range that the networks were trained on",
    "logStatusDiscard": "A step was refused; the state is unchanged",
    "logStatusError": "A call was not allowed, or its values cannot be used",
    "logStatusFatal": "The FMU is damaged or incomplete",
    "logAll": "All messages",
}


@dataclass(frozen=True, kw_only=True)
class Identity:
    """Content of a model description other than its signals.

    Attributes
    ----------
    model_name : str
        For people
    model_identifier : str
        C identifier: name of the binaries
    description, version, author, license, copyright, generation_tool : str
    flags : mapping of str to bool
        Attributes of ``CoSimulation``
    source_files : tuple of str
        Below ``sources/``, for an FMU that can be compiled
    stop_time, step_size : float
        Default experiment, [s]
    """

    model_name: str
    model_identifier: str
    description: str
    version: str
    author: str
    license: str
    copyright: str
    generation_tool: str
    flags: Mapping[str, bool] = field(default_factory=dict)
    source_files: tuple[str, ...] = ()
    stop_time: float = 600.0
    step_size: float = 1.0


def model_description(table: SignalTable, identity: Identity, *, content: bytes = b"") -> bytes:
    """The XML of an FMU.

    Parameters
    ----------
    table : SignalTable
    identity : Identity
    content : bytes
        What else makes up the FMU (or a hash of it): the GUID is a hash of this and of the XML

    Returns
    -------
    bytes
        UTF-8; no date, so that the same FMU is the same file
    """
    digest = hashlib.sha256(_xml(table, identity, guid="") + content).hexdigest()
    parts = (digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32])
    return _xml(table, identity, guid="{" + "-".join(parts) + "}")


def guid_of(xml: bytes) -> str:
    """The GUID in a model description."""
    return str(fromstring(xml).attrib["guid"])  # noqa: S314 - our own


def _xml(table: SignalTable, identity: Identity, *, guid: str) -> bytes:
    root = Element(
        "fmiModelDescription", fmiVersion="2.0", modelName=identity.model_name, guid=guid,
        description=identity.description, author=identity.author, version=identity.version,
        copyright=identity.copyright, license=identity.license, generationTool=identity.generation_tool,
        variableNamingConvention="structured", numberOfEventIndicators="0",
    )  # fmt: skip
    _co_simulation(root, identity)
    _units(root, table)
    _types(root, table)
    categories = SubElement(root, "LogCategories")
    for name, meaning in LOG_CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=meaning)
    SubElement(root, "DefaultExperiment", startTime="0", stopTime=_number(identity.stop_time),
               stepSize=_number(identity.step_size))  # fmt: skip
    variables = SubElement(root, "ModelVariables")
    for signal in table:
        _variable(variables, signal)
    _structure(root, table)
    indent(root, space="  ")
    text: str = tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()


def _co_simulation(root: Element, identity: Identity) -> None:
    element = SubElement(root, "CoSimulation", modelIdentifier=identity.model_identifier)
    for name, value in identity.flags.items():
        element.set(name, _boolean(value))
    if identity.source_files:
        files = SubElement(element, "SourceFiles")
        for name in identity.source_files:
            SubElement(files, "File", name=name)


def _units(root: Element, table: SignalTable) -> None:
    definitions = SubElement(root, "UnitDefinitions")
    for name, unit in UNITS.items():
        signals = [signal for signal in table if signal.unit == name]
        if not signals:
            continue
        element = SubElement(definitions, "Unit", name=name)
        base = SubElement(element, "BaseUnit", {base: str(exponent) for base, exponent in (unit.base or {}).items()})
        _set_affine(base, unit.factor, unit.offset)
        if unit.display is not None:
            display, factor, offset = unit.display
            _set_affine(SubElement(element, "DisplayUnit", name=display), factor, offset)
        own = {s.display for s in signals if s.display_unit and s.display_unit != (unit.display or ("",))[0]}
        for display in sorted(name for name in own if name is not None):
            to_display = conversion(unit, find_unit(display, unit.dimension))
            _set_affine(SubElement(element, "DisplayUnit", name=display), *to_display)


def _types(root: Element, table: SignalTable) -> None:
    definitions = SubElement(root, "TypeDefinitions")
    used = {signal.type for signal in table}
    for name, kind in TYPES.items():
        if name not in used:
            continue
        simple = SubElement(definitions, "SimpleType", name=name, description=kind.description)
        real = SubElement(simple, "Real", quantity=kind.quantity, unit=kind.unit)
        if kind.display is not None:
            real.set("displayUnit", kind.display)
        real.set("nominal", _number(kind.nominal))


def _variable(parent: Element, signal: Signal) -> None:
    variable = SubElement(
        parent, "ScalarVariable", name=signal.name, valueReference=str(signal.reference),
        description=signal.description, causality=signal.causality, variability=signal.variability,
    )  # fmt: skip
    if signal.initial:
        variable.set("initial", signal.initial)
    if signal.is_boolean:
        boolean = SubElement(variable, "Boolean")
        if signal.start is not None:
            boolean.set("start", _boolean(bool(signal.start)))
        return
    real = SubElement(variable, "Real")
    kind = TYPES[signal.type] if signal.type is not None else None
    # Said again although the declared type says it: not every importer looks there.
    texts = {
        "declaredType": signal.type,
        "quantity": kind.quantity if kind else None,
        "unit": signal.unit,
        "displayUnit": signal.display,
    }
    numbers = {"min": signal.minimum, "max": signal.maximum, "nominal": signal.nominal, "start": signal.start}
    for name, text in texts.items():
        if text is not None:
            real.set(name, text)
    for name, number in numbers.items():
        if number is not None and isfinite(number):
            real.set(name, _number(number))


def _structure(root: Element, table: SignalTable) -> None:
    structure = SubElement(root, "ModelStructure")
    outputs = [signal for signal in table if signal.causality == "output"]
    _unknowns(SubElement(structure, "Outputs"), table, ((s, s.depends) for s in outputs))
    _unknowns(SubElement(structure, "InitialUnknowns"), table, ((s, s.depends_initially) for s in outputs))


def _unknowns(parent: Element, table: SignalTable, unknowns: Iterable[tuple[Signal, Sequence[str]]]) -> None:
    for signal, names in unknowns:
        indices = sorted(table[name].reference + 1 for name in names)
        SubElement(parent, "Unknown", index=str(signal.reference + 1), dependencies=" ".join(map(str, indices)))


def _set_affine(element: Element, factor: float, offset: float) -> None:
    if factor != 1.0:
        element.set("factor", _number(factor))
    if offset != 0.0:
        element.set("offset", _number(offset))


def _number(value: float) -> str:
    return repr(float(value)).removesuffix(".0")


def _boolean(value: bool) -> str:
    return "true" if value else "false"
