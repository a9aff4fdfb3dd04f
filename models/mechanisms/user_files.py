"""Mechanisms that users bring: a TOML file with laws as text, or a Python file with a list ``MECHANISMS``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import sympy as sp
from pydantic import Field, model_validator

from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.definition.messages import validate_section
from models.definition.sections import Name, OneOrMore, Section, Text
from models.files.toml_file import parse_schema_1, read_text
from models.mechanisms.forms import LARGEST, strength
from models.mechanisms.mechanism import STRENGTH, Mechanism, Memory, Placed
from models.mechanisms.scale import Scale
from models.network.expressions import Law
from models.network.laws import Parameter, symbol
from models.terms.law_file import LawParameter, LawTable

Positive = Annotated[float, Field(gt=0.0)]


class PriorParameter(LawParameter):
    """``[[mechanism.parameter]]``: a number in a law with its prior, see :class:`models.network.laws.Parameter`."""

    start: float | None = None
    sd: Positive
    lower: float | None = None
    upper: float | None = None
    log: bool = False
    grid: tuple[float, ...] = ()
    sweep: tuple[Positive, Positive] | None = None

    @property
    def parameter(self) -> Parameter:
        """The parameter, with the limits that the file leaves open."""
        start = self.start or 0.0
        lower, upper = start - LARGEST * self.sd, start + LARGEST * self.sd
        if self.log:
            lower, upper = start / LARGEST, start * LARGEST
        if self.name == STRENGTH:
            lower = strength(self.sd, self.unit).lower
        return Parameter(
            name=self.name,
            unit=self.unit,
            start=start,
            lower=lower if self.lower is None else self.lower,
            upper=upper if self.upper is None else self.upper,
            sd=self.sd,
            log=self.log,
            grid=self.grid,
            sweep=self.sweep,
            description=self.description,
        )

    @model_validator(mode="after")
    def _start_fits_the_prior(self) -> Self:
        if self.name == STRENGTH and (self.start or self.log):
            raise ValueError("a strength starts at 0 and its sd is of the value; leave start and log out")
        if self.name != STRENGTH and self.start is None:
            raise ValueError("start is missing")
        if self.log and self.parameter.start <= 0.0:
            raise ValueError(f"start = {self.start:g} is not above 0; a log-normal parameter is positive")
        return self

    @model_validator(mode="after")
    def _values_within_limits(self) -> Self:
        p = self.parameter
        limits = f"{p.lower:g} to {p.upper:g}"
        for key, value in (("start", p.start), *(("grid", value) for value in p.grid)):
            if not p.lower <= value <= p.upper:
                raise ValueError(f"{key} has {value:g}, outside the limits {limits}")
        if p.sweep is not None and not p.lower <= p.sweep[0] < p.sweep[1] <= p.upper:
            raise ValueError(f"sweep = [{p.sweep[0]:g}, {p.sweep[1]:g}] does not rise within the limits {limits}")
        return self


class MechanismTable(LawTable):
    """``[[mechanism]]``: the fields of :class:`models.mechanisms.Mechanism`."""

    name: Name
    family: Text = "user"
    places: OneOrMore[Text]
    says: Text
    reference: Text
    experiment: Text
    separate_by: dict[str, Text] = Field(default_factory=dict)
    sign: Literal[-1, 0, 1] = 1
    other: Name | None = None
    other_temperature: Law | None = None
    parameter: OneOrMore[PriorParameter]

    @model_validator(mode="after")
    def _strength_comes_first(self) -> Self:
        if self.parameter[0].name != STRENGTH:
            raise ValueError(f"the first parameter is {self.parameter[0].name!r}; it must be {STRENGTH!r}")
        return self

    @property
    def mechanism(self) -> Mechanism:
        """The mechanism that the table declares."""
        parameters = tuple(p.parameter for p in self.parameter)
        return Mechanism(
            name=self.name,
            family=self.family,
            kind=self.kind,
            places=self.places,
            parameters=lambda _: parameters,
            law=self.law,
            says=self.says,
            reference=self.reference,
            experiment=self.experiment,
            separate_by=self.separate_by,
            sign=self.sign,
            is_loss=self.is_loss,
            other=self.other,
            other_temperature=self.other_temperature,
            states=tuple(
                Memory(
                    name=state.name,
                    start=lambda _, start=state.start: start,  # type: ignore[misc]
                    rate=state.rate,
                    update=state.update,
                    averaged_update=state.averaged_update,
                )
                for state in self.state
            ),
            form=self.form,
            of_measurement=self.of_measurement,
        )


class MechanismFile(Section):
    """The whole file."""

    schema_number: Literal[1] = Field(alias="schema")
    mechanism: OneOrMore[MechanismTable]


def load_mechanisms(path: str | Path) -> tuple[Mechanism, ...]:
    """Read mechanisms from a file.

    Parameters
    ----------
    path : str or Path
        ``.toml``: tables ``[[mechanism]]`` with the fields of :class:`Mechanism`; laws are texts, parameters
        ``[[mechanism.parameter]]`` (the first called ``strength``), states ``[[mechanism.state]]``.
        Nothing of it is run. ``.py``: a module with a list ``MECHANISMS``, which is run:
        give only your own files

    Raises
    ------
    InputError
        If the file cannot be read or is not such a file. Unknown signals are found when a mechanism is placed.
    """
    path = Path(path)
    found = _from_python(path) if path.suffix == ".py" else _from_toml(path)
    names = [mechanism.name for mechanism in found]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{path}: mechanism {name!r} is there {names.count(name)} times; give each its own name")
    return found


def check_placeable(mechanisms: Iterable[Mechanism], gearbox: Gearbox, file: str | Path) -> None:
    """Check that every mechanism of a file can be placed in a gearbox.

    Raises
    ------
    InputError
        If one cannot be placed, or has no place there.
    """
    network, scale = gearbox.network(), Scale.of(gearbox)
    for mechanism in mechanisms:
        try:
            placed = mechanism.placed(network, scale)
            sentences = [place.says for place in placed]
            for place in placed:
                _check_strength(place)
        except InputError as error:
            raise InputError(f"{file}: {error}") from error
        except Exception as error:  # a user's own code runs here
            raise InputError(
                f"{file}: mechanism {mechanism.name!r} fails with {type(error).__name__}: {error}"
            ) from error
        if not sentences:
            places = ", ".join(repr(place) for place in mechanism.places)
            raise InputError(
                f"{file}: mechanism {mechanism.name!r} has no place in this gearbox; its places are {places}, the "
                f"parts are {', '.join(part.name for part in network.parts)}"
            )


def _check_strength(placed: Placed) -> None:
    size, law = symbol(placed.strength.name), placed.written["law"]
    absent, slope = (one.xreplace({size: sp.Integer(0)}) for one in (law, law.diff(size)))
    endless = slope.has(sp.zoo, sp.oo, sp.nan)
    if absent != 0 or slope == 0 or endless:
        found = "it has no finite slope" if endless else f"it gives {absent}, and its slope is {slope}"
        raise InputError(
            f"mechanism {placed.mechanism.name!r}: its law must contain {STRENGTH!r}, the size of the effect: 0 "
            f"without the effect, and at first in proportion to it. With {STRENGTH} = 0 {found}"
        )


def _from_toml(path: Path) -> tuple[Mechanism, ...]:
    document = parse_schema_1(read_text(path), file=str(path), kind="mechanisms")
    return tuple(table.mechanism for table in validate_section(MechanismFile, document, file=str(path)).mechanism)


def _from_python(path: Path) -> tuple[Mechanism, ...]:
    if not path.is_file():
        raise InputError(f"{path}: cannot be read as a Python file")
    content: dict[str, Any] = {"__name__": f"mechanisms_{path.stem}", "__file__": str(path)}
    try:  # an import would leave a folder __pycache__ next to the file
        exec(compile(path.read_bytes(), str(path), "exec"), content)  # noqa: S102 - the user's own file
    except (Exception, SystemExit) as error:
        raise InputError(f"{path}: fails with {type(error).__name__}: {error}") from error
    found = content.get("MECHANISMS")
    if not found or not isinstance(found, (list, tuple)) or not all(isinstance(entry, Mechanism) for entry in found):
        raise InputError(f"{path}: needs a list MECHANISMS of models.mechanisms.Mechanism, at least one")
    return tuple(found)
