"""The ``modelDescription.xml`` of an FMU (FMI 2.0, co-simulation) from its table of signals.

Independent of the code inside: a Python FMU and a native one differ in the flags and source files that they pass. The
same arguments give the same bytes. FMI 3.0: :mod:`builder.fmi.model_description3`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from xml.etree.ElementTree import Element, SubElement, fromstring, indent, tostring

from builder.fmi.signals import Signal, SignalTable
from models.quantities.quantities import TYPES, Type
from models.quantities.units import UNITS, conversion, find_unit

DEPENDENCY_KINDS = ("constant", "tunable")
INITIAL_DEPENDENCY_KINDS = ("constant",)  # parameters may change before the simulation starts
STOP_TIME, TOLERANCE = 600.0, 1e-4  # of the default experiment, [s]; of the solver: .03 K at 300 K
LOG_CATEGORIES: Mapping[str, str] = {
    "logStatusWarning": "Done, but look at it: outside the range of the networks, or a value that does not count",
    "logStatusDiscard": "A step was refused; the state is unchanged",
    "logStatusError": "A call was not allowed, or its values cannot be used",
    "logStatusFatal": "The FMU is damaged or incomplete",
    "logAll": "All messages",
}


@dataclass(frozen=True, kw_only=True)
class FmuIdentity:
    """Content of a model description other than its signals.

    Attributes
    ----------
    model_name : str
        For people
    model_identifier : str
        C identifier: name of the binaries
    description, version, author, license, copyright, generation_tool : str
    flags : mapping of str to bool or int
        Attributes of ``CoSimulation``
    source_files : tuple of str
        Below ``sources/``, for an FMU that can be compiled
    step_size : float
        Of the default experiment, [s]
    """

    model_name: str
    model_identifier: str
    description: str
    version: str
    author: str
    generation_tool: str
    license: str = "MIT; see documentation/licenses"
    copyright: str = "See documentation/licenses"
    flags: Mapping[str, bool | int] = field(default_factory=dict)
    source_files: tuple[str, ...] = ()
    step_size: float = 1.0


def model_description(table: SignalTable, identity: FmuIdentity, *, content: bytes = b"") -> bytes:
    """The XML of an FMU.

    Parameters
    ----------
    table : SignalTable
    identity : FmuIdentity
    content : bytes
        What else makes up the FMU (or a hash of it): the GUID is a hash of this and of the XML

    Returns
    -------
    bytes
        UTF-8; no date, so that the same FMU is the same file
    """
    return with_guid(lambda guid: _xml(table, identity, guid=guid), content)


def with_guid(xml: Callable[[str], bytes], content: bytes) -> bytes:
    """Insert a GUID, a hash of the content and of the XML with an empty GUID."""
    digest = hashlib.sha256(xml("") + content).hexdigest()
    parts = (digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32])
    return xml("{" + "-".join(parts) + "}")


def guid_of(xml: bytes) -> str:
    """The GUID in a model description; in FMI 3.0 the instantiation token."""
    attributes = fromstring(xml).attrib  # noqa: S314 - our own
    return attributes.get("guid") or attributes["instantiationToken"]


def _xml(table: SignalTable, identity: FmuIdentity, *, guid: str) -> bytes:
    root = Element(
        "fmiModelDescription", fmiVersion="2.0", modelName=identity.model_name, guid=guid,
        description=identity.description, author=identity.author, version=identity.version,
        copyright=identity.copyright, license=identity.license, generationTool=identity.generation_tool,
        variableNamingConvention="structured", numberOfEventIndicators="0",
    )  # fmt: skip
    element = add_co_simulation(root, identity)
    if identity.source_files:
        files = SubElement(element, "SourceFiles")
        for name in identity.source_files:
            SubElement(files, "File", name=name)
    add_units(root, table)
    _types(root, table)
    add_log_categories(root)
    add_experiment(root, identity)
    variables = SubElement(root, "ModelVariables")
    for signal in table:
        _variable(variables, signal)
    _structure(root, table)
    return document(root)


def document(root: Element) -> bytes:
    """An XML file."""
    indent(root, space="  ")
    text: str = tostring(root, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()


def add_log_categories(root: Element) -> None:
    """The log categories."""
    categories = SubElement(root, "LogCategories")
    for name, meaning in LOG_CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=meaning)


def add_experiment(root: Element, identity: FmuIdentity) -> None:
    """The default experiment."""
    experiment = {"stopTime": STOP_TIME, "tolerance": TOLERANCE, "stepSize": identity.step_size}
    attributes = {name: number(value) for name, value in experiment.items()}
    SubElement(root, "DefaultExperiment", {"startTime": "0"} | attributes)


def add_co_simulation(root: Element, identity: FmuIdentity) -> Element:
    """Capabilities of the FMU."""
    element = SubElement(root, "CoSimulation", modelIdentifier=identity.model_identifier)
    for name, value in identity.flags.items():
        element.set(name, boolean(value) if isinstance(value, bool) else str(value))
    return element


def add_units(root: Element, table: SignalTable) -> None:
    """The units that signals have, with their base units and display units."""
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
        SubElement(simple, "Real", type_attributes(kind))


def type_attributes(kind: Type) -> dict[str, str]:
    """Attributes of a declared type."""
    display = {} if kind.display is None else {"displayUnit": kind.display}
    return {"quantity": kind.quantity, "unit": kind.unit} | display | {"nominal": number(kind.nominal)}


def _variable(parent: Element, signal: Signal) -> None:
    variable = SubElement(
        parent, "ScalarVariable", name=signal.name, valueReference=str(signal.reference),
        description=signal.description, causality=signal.causality, variability=signal.variability,
    )  # fmt: skip
    if signal.initial:
        variable.set("initial", signal.initial)
    SubElement(variable, "Boolean" if signal.is_boolean else "Real", value_attributes(signal))


def value_attributes(signal: Signal) -> dict[str, str]:
    """Attributes of a signal's value: unit, bounds, start value."""
    if signal.is_boolean:
        return {} if signal.start is None else {"start": boolean(bool(signal.start))}
    kind = TYPES[signal.type] if signal.type is not None else None
    # Said again although the declared type says it: not every importer looks there.
    texts = {
        "declaredType": signal.type,
        "quantity": kind.quantity if kind else None,
        "unit": signal.unit,
        "displayUnit": signal.display,
    }
    numbers = {"min": signal.minimum, "max": signal.maximum, "nominal": signal.nominal, "start": signal.start}
    return {name: text for name, text in texts.items() if text is not None} | {
        name: number(value) for name, value in numbers.items() if value is not None and isfinite(value)
    }


def _structure(root: Element, table: SignalTable) -> None:
    structure = SubElement(root, "ModelStructure")
    outputs, unknowns = SubElement(structure, "Outputs"), SubElement(structure, "InitialUnknowns")
    for signal in (signal for signal in table if signal.causality == "output"):
        index = {"index": str(signal.reference + 1)}
        known = dependencies(table, signal, signal.depends, DEPENDENCY_KINDS, first=1)
        SubElement(outputs, "Unknown", index | known)
        known = dependencies(table, signal, signal.depends_initially, INITIAL_DEPENDENCY_KINDS, first=1)
        SubElement(unknowns, "Unknown", index | known)


def dependencies(
    table: SignalTable, signal: Signal, names: Sequence[str], kinds: Sequence[str], *, first: int
) -> dict[str, str]:
    """Attributes of an unknown: the signals that it depends on, by their number from `first` on, and how.

    Only kinds of `kinds` are named; without a kind a signal is "dependent", which is also what it means to name none.
    """
    found = sorted(names, key=lambda name: table[name].reference)
    attributes = {"dependencies": " ".join(str(table[name].reference + first) for name in found)}
    named = [kind if (kind := signal.linear.get(name, "")) in kinds else "dependent" for name in found]
    if set(named) - {"dependent"}:
        attributes["dependenciesKind"] = " ".join(named)
    return attributes


def _set_affine(element: Element, factor: float, offset: float) -> None:
    if factor != 1.0:
        element.set("factor", number(factor))
    if offset != 0.0:
        element.set("offset", number(offset))


def number(value: float) -> str:
    """A number in XML, exact to the last bit."""
    return repr(float(value)).removesuffix(".0")


def boolean(value: bool) -> str:
    """A Boolean in XML."""
    return "true" if value else "false"
