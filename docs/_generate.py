"""Pages that are made from the program when the site is built: the directive ``{generated} NAME``.

Each function returns Markdown; nothing of it is kept in the repository.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp
from pydantic.json_schema import GenerateJsonSchema
from sphinx.util.docutils import SphinxDirective

from builder.fmi.signals import signal_table
from diagnosis.recordings.mapping import RecordingMapping
from models.assembly.gearbox import load_gearbox
from models.assembly.gearbox_definition import Definition
from models.correction.correction import Correction
from models.definition.key_texts import TEXTS, KeyText
from models.definition.known_bearings import known_series
from models.definition.machine_definition import MachineDefinition
from models.definition.named_oils import known_oils, lubricant, named_oil, read_oil
from models.definition.parametric_sections import ParametricDefinition
from models.definition.values_with_source import Annotations, strip
from models.files.toml_file import packaged, parse, read_text
from models.mechanisms import CATALOGUE, Mechanism, Placed, Scale
from models.network.laws import symbol
from models.quantities.definition_units import unit_of

if TYPE_CHECKING:
    from docutils.nodes import Node
    from pydantic import BaseModel
    from sphinx.application import Sphinx

Schema = Mapping[str, Any]
GEARBOXES = "gearboxes"
EXAMPLES = {Definition: "fzg", ParametricDefinition: "la_haute_borne"}  # whose values stand next to the keys
# Machines in which the catalogue's laws are written out, the first that has a place for it.
MACHINES = {"fzg": {"speed": 3000.0, "torque": 94.0}, "la_haute_borne": {"speed": 1500.0, "torque": 5000.0}}
# The space of a product in a law: between the end of one factor and the beginning of the next.
PRODUCT = re.compile(
    r"((?<=[}\d*)])|(?<=[ =(][A-Za-z])) (?=\\(mathrm|left\(|frac|max|min|tanh|sin|nu)|e\^|[A-Za-z](?![A-Za-z]))"
)
RATIO_IN_BRACKETS = re.compile(r"\\left\(((?:n|M|\\nu)\^\*)\\right\)")  # brackets need not grow with the asterisk
KINDS = {
    "source": "heat into a node",
    "link": "a heat path",
    "loss_factor": "a change of a loss",
    "link_factor": "a change of a heat path",
    "signal": "an input that differs from its record",
    "sensor": "a reading that differs from the temperature",
}


def _cell(text: object) -> str:
    """Text of a table cell: on one line, and without a bar that would end it."""
    return " ".join(str(text).split()).replace("|", r"\|")


def _number(value: float) -> str:
    """Three digits, and a power of ten only where the number would need many zeros."""
    text = f"{value:.3g}"
    return f"{float(text):.0f}" if "e" in text and abs(value) < 1e6 and abs(value) >= 1.0 else text


def _row(*cells: object) -> str:
    return "| " + " | ".join(_cell(cell) for cell in cells) + " |"


def _table(head: tuple[str, ...], rows: list[tuple[object, ...]]) -> Iterator[str]:
    """Yield a Markdown table without the columns that are empty."""
    used = [i for i in range(len(head)) if i == 0 or any(str(row[i]) for row in rows)]
    yield _row(*(head[i] for i in used))
    yield _row(*("---" for _ in used))
    yield from (_row(*(row[i] for i in used)) for row in rows)
    yield ""


def _markdown(docstring: str) -> str:
    """A docstring as Markdown: literals and roles as code, one paragraph per paragraph."""
    text = re.sub(r":\w+:`~?([^`]+)`", r"`\1`", docstring)
    text = re.sub(r"``([^`]+)``", r"`\1`", text)
    return re.sub(r"\n +", "\n", text)


def _placeholders(text: str) -> str:
    """Names with a placeholder, such as T_<node>, as code; bare they would be read as HTML."""
    return re.sub(r"(?<![`\w])\w*<\w+>\w*", r"`\g<0>`", text)


class _Quiet(GenerateJsonSchema):
    """A default that JSON does not have, such as an expression, is left out without a warning."""

    ignored_warning_kinds = frozenset({"skipped-choice", "non-serializable-default"})  # type: ignore[assignment]


class _Tables:
    """Reference of one file: a heading and a table of keys for every pydantic model in it."""

    def __init__(self, model: type[BaseModel], example: str | None, *, only: Container[str] | None = None) -> None:
        self.only = only  # keys at the top of the file
        self.schema = model.model_json_schema(by_alias=True, schema_generator=_Quiet)
        self.definitions: Mapping[str, Schema] = self.schema.get("$defs", {})
        self.values: Mapping[str, Any] = {}
        self.root = model.__name__
        if example is not None:
            self.values = strip(parse(read_text(packaged(GEARBOXES, example)), file=example), Annotations())
        self.example = example

    def markdown(self) -> Iterator[str]:
        """Yield the lines."""
        keys = self.schema["properties"]
        schema = {**self.schema, "properties": {k: v for k, v in keys.items() if self.only is None or k in self.only}}
        if not all(map(_table_in, schema["properties"].values())):
            yield from self._section(self.root, "At the top of the file", schema, self.values)
        yield from self._below(schema, (), self.values)

    def _below(self, schema: Schema, path: tuple[str, ...], values: Any) -> Iterator[str]:
        for key, field in schema["properties"].items():
            name = _table_in(field)
            if not name:
                continue
            below = values.get(key) if isinstance(values, Mapping) else None
            first = below[0] if isinstance(below, tuple) and below else below
            dotted = ".".join((*path, key)) + (".NAME" if field.get("additionalProperties") else "")
            title = f"`[[{dotted}]]`" if "items" in field else f"`[{dotted}]`"
            yield from self._section(name, title, self.definitions[name], first)
            yield from self._below(self.definitions[name], (*path, key), first)

    def _section(self, name: str, title: str, schema: Schema, values: Any) -> Iterator[str]:
        yield f"### {title}"
        yield ""
        if name != self.root:
            text = re.sub(r"^(Table )?(`\[[^`]*`(, )?)+:\s*", "", _markdown(schema.get("description", ""))).strip()
            yield text[:1].upper() + text[1:]
            yield ""
        rows: list[tuple[object, ...]] = []
        for key, field in schema["properties"].items():
            if _table_in(field):
                continue
            text_of = TEXTS.get(name, {}).get(key, KeyText(""))
            unit = unit_of(key).symbol
            given = values.get(key, "") if isinstance(values, Mapping) else ""
            kind, meaning = _type(field) + (f", {unit}" if unit else ""), _placeholders(text_of.meaning)
            rows.append((f"`{key}`", meaning, kind, text_of.typical,
                         _limits(field), _default(key, field, schema.get("required", ())), _value(given)))  # fmt: skip
        if rows:
            yield from _table(
                ("key", "meaning", "value", "typical", "accepted", "default", f"in `{self.example}`"), rows
            )


def _table_in(field: Schema) -> str:
    """Class of the table, or tables, that a key holds; ``""`` for a key with a value."""
    for option in field.get("anyOf", [field]):
        for holder in (option, option.get("items"), option.get("additionalProperties")):
            if isinstance(holder, Mapping) and "$ref" in holder:
                return str(holder["$ref"]).rpartition("/")[2]
    return ""


def _plain(field: Schema) -> Schema:
    """The option of a key that is not null."""
    return next((o for o in field.get("anyOf", ()) if o.get("type") != "null"), field)


def _type(field: Schema) -> str:
    field = _plain(field)
    if "enum" in field:
        return "one of " + ", ".join(f"`{one}`" for one in field["enum"])
    if "const" in field:
        return f"`{field['const']}`"
    kind = field.get("type", "")
    if kind == "array" and "prefixItems" in field:
        return f"{len(field['prefixItems'])} x {_type(field['prefixItems'][0])}"
    if kind == "array":
        return f"list of {_type(field.get('items', {})) or 'values'}"
    names = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true or false",
             "object": "table of numbers"}  # fmt: skip
    return names.get(kind, "text" if "anyOf" not in field else " or ".join(filter(None, map(_type, field["anyOf"]))))


def _limits(field: Schema) -> str:
    field = _plain(field)
    while field.get("type") == "array":
        field = field["prefixItems"][0] if "prefixItems" in field else field.get("items", {})
    low = field.get("minimum", field.get("exclusiveMinimum"))
    high = field.get("maximum", field.get("exclusiveMaximum"))
    if low is None and high is None:
        return ""
    above = "above " if "exclusiveMinimum" in field else ""
    if high is None:
        return f"{above}{low:g} or more" if not above else f"above {low:g}"
    return f"{above}{low:g} to {high:g}" if low is not None else f"up to {high:g}"


def _default(key: str, field: Schema, required: Any) -> str:
    if key in required:
        return "needed"
    default = field.get("default")
    return "" if default in (None, [], {}, "") else _value(default)


def _value(value: Any) -> str:
    if value == "" or value is None:
        return ""
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, Mapping):
        return f"{len(value)} numbers"
    if isinstance(value, tuple | list):
        return "`[" + ", ".join(_value(one).strip("`") for one in value) + "]`"
    return f"`{value:g}`" if isinstance(value, float) else f"`{value}`"


def definition() -> Iterator[str]:
    """Tables and keys that only a definition with geometry has."""
    yield from _Tables(Definition, EXAMPLES[Definition], only=_keys(Definition) - _keys(MachineDefinition)).markdown()


def definition_without_geometry() -> Iterator[str]:
    """Tables and keys that only a definition without geometry has."""
    own = _keys(ParametricDefinition) - _keys(MachineDefinition)
    yield from _Tables(ParametricDefinition, EXAMPLES[ParametricDefinition], only=own).markdown()


def definition_of_both() -> Iterator[str]:
    """Tables and keys that every definition may have."""
    yield from _Tables(ParametricDefinition, EXAMPLES[ParametricDefinition], only=_keys(MachineDefinition)).markdown()


def _keys(model: type[MachineDefinition]) -> set[str]:
    return {field.alias or name for name, field in model.model_fields.items()}


def mapping() -> Iterator[str]:
    """Tables and keys of a mapping file."""
    yield from _Tables(RecordingMapping, None).markdown()


def correction() -> Iterator[str]:
    """Tables and keys of a correction."""
    yield from _Tables(Correction, None).markdown()


def oils() -> Iterator[str]:
    """Oils that a definition may name."""
    rows: list[tuple[object, ...]] = []
    for name in known_oils():
        oil, notes = named_oil(name), read_oil(name)[1]
        viscosity = lubricant(oil).kinematic_viscosity
        points = "; ".join(f"{float(viscosity(T)):.3g}" for T in (40.0, 100.0))
        rows.append((f"`{name}`", oil.name, oil.base, points, f"{oil.density_kg_m3:g}", notes.source_of("")))
    yield from _table(("named", "oil", "base", "mm²/s at 40; 100 °C", "kg/m³", "source"), rows)


def bearings() -> Iterator[str]:
    """Bearings that a definition may name."""
    yield from _table(("type", "series", "known"), known_series())


def variables() -> Iterator[str]:
    """Variables of the FMU of the FZG rig."""
    yield signal_table(load_gearbox("fzg").network()).markdown()


def network() -> Iterator[str]:
    """Nodes, heat paths and time constants of the FZG rig at one operating point where it has settled."""
    rig = load_gearbox("fzg")
    network = rig.network()
    speed, torque = 2165.7, 94.0
    settled = network.steady_state(losses=rig.losses(), speed=[speed], torque=torque)
    values = {p.name: p.start for p in network.parameters} | {
        name: given.default for name, given in network.inputs.items()
    }
    values |= {"speed": speed, "torque": torque, "time": 0.0}
    values |= {f"T_{name}": float(course.flat[-1]) for name, course in settled.temperatures.items()}
    numbers = {symbol(name): value for name, value in values.items()}
    conductance = {link.name: float(sp.N(link.conductance.xreplace(numbers))) for link in network.links}
    capacity = {part.name: float(sp.N(sp.sympify(part.capacity).xreplace(numbers))) for part in network.parts}
    yield f"The FZG rig at {speed:g} 1/min and {torque:g} N m (8.3 m/s), once its temperatures no longer change:"
    yield ""
    yield from _table(
        ("part", "heat capacity in J/K", "settles at, in °C"),
        [(f"`{name}`", _number(value), f"{values[f'T_{name}']:.1f}") for name, value in capacity.items()],
    )
    yield from _table(
        ("heat path", "conductance in W/K"),
        [(" to ".join(f"`{node}`" for node in link.nodes), _number(conductance[link.name])) for link in network.links],
    )
    order = list(capacity)
    matrix = np.zeros((len(order), len(order)))
    for link in network.links:
        for here, there in (link.nodes, link.nodes[::-1]):
            if here in order:
                matrix[order.index(here), order.index(here)] += conductance[link.name] / capacity[here]
                if there in order:
                    matrix[order.index(here), order.index(there)] -= conductance[link.name] / capacity[here]
    constants = sorted((1.0 / rate for rate in np.linalg.eigvals(matrix).real), reverse=True)
    yield f"Time constants in s: {', '.join(map(_number, constants))}."


def mechanisms() -> Iterator[str]:
    """The catalogue by family, every law as it is written for a machine that has a place for it."""
    networks = {
        name: (load_gearbox(name).network(), Scale.of(load_gearbox(name), **at)) for name, at in MACHINES.items()
    }
    families: dict[str, list[Mechanism]] = {}
    for mechanism in CATALOGUE.values():
        families.setdefault(mechanism.family, []).append(mechanism)
    for family, members in families.items():
        yield f"## {family.capitalize()}"
        yield ""
        for mechanism in members:
            places = {name: mechanism.placed(network, scale) for name, (network, scale) in networks.items()}
            yield from _mechanism(mechanism, places)


def _mechanism(mechanism: Mechanism, places: Mapping[str, tuple[Placed, ...]]) -> Iterator[str]:
    yield f"(mechanism-{mechanism.name.replace('_', '-')})="
    yield f"### `{mechanism.name}`"
    yield ""
    yield mechanism.says.format(place="at its place").replace(" (at its place)", "")
    yield ""
    machine = next((name for name, found in places.items() if found), None)
    if machine is not None:
        one = places[machine][0]
        law, *others = one.equation().split(r",\quad ")
        states = [other for other in others if r"\leftarrow" in other or r"/\mathrm{d}t" in other]
        for equation in (law, *states):
            equation = equation.replace(r"\mathrm{d}\mathrm", r"\mathrm{d}\,\mathrm")
            yield "$$\n" + PRODUCT.sub(r" \\, ", RATIO_IN_BRACKETS.sub(r"(\1)", equation)) + "\n$$\n"
        ratios = [other for other in others if other not in states]
        plain = (re.sub(r"\d[\d.]*e[+-]\d+", lambda found: _number(float(found[0])), ratio) for ratio in ratios)
        ratios_text = "".join(f", ${ratio}$" for ratio in plain)
        yield f"Written for `{one.place}` of `{machine}`{ratios_text}.\n"
        local = [(p.name.removeprefix(f"{one.label}_"), p) for p in one.parameters]
        yield from _table(
            ("parameter", "meaning", "unit", "start", "usual size or deviation", "limits"),
            [(f"`{name}`", p.description, "" if p.unit == "1" else p.unit, _number(p.start),
              "" if p.sd is None else _number(p.sd) + (" (of the logarithm)" if p.log else ""),
              f"{_number(p.lower)} to {_number(p.upper)}") for name, p in local],
        )  # fmt: skip
    at = ", ".join(f"`{place}`" for place in mechanism.places)
    yield f"- **Kind**: {KINDS[mechanism.kind]} (`{mechanism.kind}`), at: {at}"
    yield f"- **Source**: {mechanism.reference}"
    yield f"- **Shown best by**: {mechanism.experiment}"
    for other, test in mechanism.separate_by.items():
        yield f"- **Distinguished from** {{ref}}`{other} <mechanism-{other.replace('_', '-')}>` **by**: {test}"
    yield ""


GENERATORS: Mapping[str, Callable[[], Iterator[str]]] = {
    "bearings": bearings,
    "correction": correction,
    "definition": definition,
    "definition_of_both": definition_of_both,
    "definition_without_geometry": definition_without_geometry,
    "mapping": mapping,
    "mechanisms": mechanisms,
    "network": network,
    "oils": oils,
    "variables": variables,
}


class Generated(SphinxDirective):
    """``{generated} NAME``: the Markdown that a function of this module returns, in place of its text.

    The text is for those who read the pages without the site.
    """

    required_arguments = 1
    has_content = True

    def run(self) -> list[Node]:
        """Parse the Markdown."""
        text = "\n".join(GENERATORS[self.arguments[0]]())
        return self.parse_text_to_nodes(text, allow_section_headings=True)


def setup_generated(app: Sphinx) -> None:
    """Register the directive."""
    app.add_directive("generated", Generated)
