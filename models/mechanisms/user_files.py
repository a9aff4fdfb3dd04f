"""Mechanisms that users bring: a TOML file with laws as text, or a Python file with a list ``MECHANISMS``."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Annotated, Any, Literal

import sympy as sp
from pydantic import Field

from models.definition import Name, Section, Text
from models.errors import InputError
from models.expressions import parse_expression
from models.faults import validated
from models.gearbox import Gearbox
from models.laws import Parameter
from models.mechanisms.forms import LARGEST, strength
from models.mechanisms.mechanism import STRENGTH, Mechanism, Memory
from models.mechanisms.scale import Scale
from models.terms import Form, Kind
from models.toml_file import parse, read_text

SCHEMA = 1
Positive = Annotated[float, Field(gt=0.0)]


class _Parameter(Section):
    name: Name
    unit: Text = "1"
    start: float | None = None
    sd: Positive
    lower: float | None = None
    upper: float | None = None
    log: bool = False
    grid: tuple[float, ...] = Field(default=(), strict=False)
    sweep: tuple[Positive, Positive] | None = Field(default=None, strict=False)
    description: str = ""


class _State(Section):
    name: Name
    start: float = 0.0
    rate: Text = "0"
    update: Text | None = None


class _Mechanism(Section):
    name: Name
    family: Text = "user"
    kind: Kind
    places: tuple[Text, ...] = Field(min_length=1, strict=False)
    law: Text
    says: Text
    reference: Text
    experiment: Text
    separate_by: dict[str, Text] = Field(default_factory=dict)
    sign: Literal[-1, 0, 1] = 1
    is_loss: bool = False
    other: Name | None = None
    other_temperature: Text | None = None
    form: Form | None = None
    of_measurement: bool = False
    parameter: tuple[_Parameter, ...] = Field(min_length=1, strict=False)
    state: tuple[_State, ...] = Field(default=(), strict=False)


class _File(Section):
    # "schema" is a method of pydantic's models.
    version_of_schema: Literal[1] = Field(alias="schema")
    mechanism: tuple[_Mechanism, ...] = Field(min_length=1, strict=False)


def load_mechanisms(path: str | Path) -> tuple[Mechanism, ...]:
    """Mechanisms from a file.

    Parameters
    ----------
    path : str or Path
        ``.toml``: tables ``[[mechanism]]`` with the fields of :class:`Mechanism`; laws are texts, parameters
        ``[[mechanism.parameter]]`` (the first called ``strength``), memories ``[[mechanism.state]]``. Nothing of it is
        run. ``.py``: a module with a list ``MECHANISMS``, which is run: give it files of your own only

    Raises
    ------
    InputError
        If the file cannot be read or is not such a file; names that no signal bears show when a mechanism is placed.
    """
    path = Path(path)
    found = _from_python(path) if path.suffix == ".py" else _from_toml(path)
    names = [mechanism.name for mechanism in found]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{path}: mechanism {name!r} is there {names.count(name)} times; give each its own name")
    return found


def check_placeable(mechanisms: Iterable[Mechanism], gearbox: Gearbox, file: str | Path) -> None:
    """See that every mechanism of a file can be placed in a gearbox, whatever is measured.

    Raises
    ------
    InputError
        If one cannot be placed, or has no place there.
    """
    network, scale = gearbox.network(), Scale.of(gearbox)
    for mechanism in mechanisms:
        try:
            placed = mechanism.placed(network, scale)
            told = [place.says for place in placed]
        except InputError as error:
            raise InputError(f"{file}: {error}") from error
        except Exception as error:  # a user's own code runs here
            raise InputError(
                f"{file}: mechanism {mechanism.name!r} fails with {type(error).__name__}: {error}"
            ) from error
        if not told:
            places = ", ".join(repr(place) for place in mechanism.places)
            raise InputError(
                f"{file}: mechanism {mechanism.name!r} has no place in this gearbox; its places are {places}, the "
                f"parts are {', '.join(part.name for part in network.parts)}"
            )


def _from_toml(path: Path) -> tuple[Mechanism, ...]:
    table = parse(read_text(path), file=str(path))
    if table.get("schema") != SCHEMA:
        raise InputError(f"{path}: schema is {table.get('schema')!r}; this program reads mechanisms of schema {SCHEMA}")
    content = validated(_File, table, file=str(path))
    return tuple(_mechanism(entry, f"{path}: mechanism {entry.name}") for entry in content.mechanism)


def _mechanism(entry: _Mechanism, where: str) -> Mechanism:
    def law(text: str, key: str) -> sp.Expr:
        return parse_expression(text, _names(text), where=f"{where}.{key}")

    if entry.parameter[0].name != STRENGTH:
        raise InputError(f"{where}: the first parameter is {entry.parameter[0].name!r}; it must be {STRENGTH!r}")
    parameters = tuple(_parameter(parameter, where) for parameter in entry.parameter)
    return Mechanism(
        name=entry.name,
        family=entry.family,
        kind=entry.kind,
        places=entry.places,
        parameters=lambda _: parameters,
        law=law(entry.law, "law"),
        says=entry.says,
        reference=entry.reference,
        experiment=entry.experiment,
        separate_by=entry.separate_by,
        sign=entry.sign,
        is_loss=entry.is_loss,
        other=entry.other,
        other_temperature=None
        if entry.other_temperature is None
        else law(entry.other_temperature, "other_temperature"),
        states=tuple(
            Memory(
                name=state.name,
                start=lambda _, start=state.start: start,  # type: ignore[misc]
                rate=law(state.rate, f"state {state.name}.rate"),
                update=None if state.update is None else law(state.update, f"state {state.name}.update"),
            )
            for state in entry.state
        ),
        form=entry.form,
        of_measurement=entry.of_measurement,
    )


def _parameter(entry: _Parameter, where: str) -> Parameter:
    where = f"{where}.parameter {entry.name}"
    if entry.name == STRENGTH:
        start, lower = 0.0, strength(entry.sd, entry.unit).lower
        if entry.start not in (None, 0.0) or entry.log:
            raise InputError(f"{where}: a strength starts at 0 and its sd is of the value; leave start and log out")
    elif entry.start is None:
        raise InputError(f"{where}: start is missing")
    else:
        start, lower = entry.start, entry.start / LARGEST if entry.log else entry.start - LARGEST * entry.sd
    upper = start * LARGEST if entry.log else start + LARGEST * entry.sd
    lower, upper = lower if entry.lower is None else entry.lower, upper if entry.upper is None else entry.upper
    if entry.log and start <= 0.0:
        raise InputError(f"{where}: start is {start:g}; a log-normal parameter is positive")
    if not lower <= start <= upper:
        raise InputError(f"{where}: start {start:g} is not within {lower:g} ... {upper:g}")
    for value in entry.grid:
        if not lower <= value <= upper:
            raise InputError(f"{where}: {value:g} of the grid is not within {lower:g} ... {upper:g}")
    if entry.sweep is not None and not lower <= entry.sweep[0] < entry.sweep[1] <= upper:
        low, high = entry.sweep
        raise InputError(f"{where}: the sweep from {low:g} to {high:g} does not rise within {lower:g} ... {upper:g}")
    return Parameter(
        name=entry.name, unit=entry.unit, start=start, lower=lower, upper=upper, sd=entry.sd, log=entry.log,
        grid=entry.grid, sweep=entry.sweep, description=entry.description,
    )  # fmt: skip


def _names(text: str) -> frozenset[str]:
    """All names in a law; whether they are signals is known when it is placed."""
    try:
        return frozenset(
            node.id for node in ast.walk(ast.parse(text.strip(), mode="eval")) if isinstance(node, ast.Name)
        )
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return frozenset()  # the parser says what is wrong


def _from_python(path: Path) -> tuple[Mechanism, ...]:
    spec = spec_from_file_location(f"mechanisms_{path.stem}", path)
    if not path.is_file() or spec is None or spec.loader is None:
        raise InputError(f"{path}: cannot be read as a Python file")
    module = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise InputError(f"{path}: fails with {type(error).__name__}: {error}") from error
    content: Mapping[str, Any] = vars(module)
    found = content.get("MECHANISMS")
    if not isinstance(found, (list, tuple)) or not all(isinstance(entry, Mechanism) for entry in found):
        raise InputError(f"{path}: needs a list MECHANISMS of models.mechanisms.Mechanism")
    return tuple(found)
