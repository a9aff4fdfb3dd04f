"""A correction: what a diagnosis found, as a small file that people review and every verb takes.

A corrected model is the same definition plus this file. Laws stand in it as full expressions, so that the file means
the same whatever becomes of the catalogue.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import sympy as sp
from pydantic import Field, StringConstraints

from models.atomic_write import atomic_file
from models.definition import Name, Section, Text
from models.errors import InputError, did_you_mean
from models.expressions import expression_text, parse_expression
from models.faults import as_written, validated
from models.laws import Parameter
from models.network import ExtraState, ThermalNetwork
from models.terms import FACTORS, Form, Kind, Term
from models.toml_file import parse, read_text

if TYPE_CHECKING:
    from models.gearbox import Gearbox

SCHEMA = 1
BOUND_TOLERANCE = 1e-9  # a bound that a fit ends at is a rounding off
Sha256 = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")]
NotNegative = Annotated[float, Field(ge=0.0)]


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A number that was found.

    Attributes
    ----------
    name : str
        A parameter of the network
    value, stderr : float
    unit : str
    prior : float or None
        The value as delivered
    """

    name: str
    value: float
    stderr: float
    unit: str = "1"
    prior: float | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Finding:
    """Physics that was left out, or a fault of an instrument.

    Attributes
    ----------
    mechanism, family, place, says : str
        For people; see :class:`models.mechanisms.Mechanism`
    term : Term
        Its parameters start at the found values; their `sd` are the standard errors
    probability : float or None
    """

    mechanism: str
    family: str
    place: str
    says: str
    term: Term
    probability: float | None = None

    @classmethod
    def of(
        cls,
        term: Term,
        estimates: Mapping[str, tuple[float, float]],
        *,
        mechanism: str,
        family: str = "",
        place: str = "",
        says: str = "",
        probability: float | None = None,
    ) -> Finding:
        """A finding from a term and what was estimated.

        Parameters
        ----------
        term : Term
            E.g. a mechanism at its place
        estimates : mapping of str to (float, float)
            Value and standard error of every parameter of the term

        Raises
        ------
        InputError
            If a parameter has no estimate or an estimate no parameter.
        """
        missing = [p.name for p in term.parameters if p.name not in estimates]
        if missing:
            raise InputError(f"{term.label}: no value was given for {', '.join(missing)}")
        valued = term.with_values({name: value for name, (value, _) in estimates.items()})
        # Standard errors are of the values themselves, whatever the prior was of.
        found = tuple(replace(p, sd=estimates[p.name][1], log=False, grid=()) for p in valued.parameters)
        plain = Term(**{name: getattr(valued, name) for name in Term.__dataclass_fields__} | {"parameters": found})
        return cls(mechanism=mechanism, family=family, place=place, says=says, term=plain, probability=probability)


@dataclass(frozen=True, kw_only=True, eq=False)
class Correction:
    """Findings and calibrated parameters of one gearbox.

    Attributes
    ----------
    gearbox : str
        Name in the definition
    gearbox_sha256 : str
        Hash of the definition's values, :attr:`models.gearbox.Gearbox.hash`
    findings : tuple of Finding
    calibration : tuple of Estimate
        Parameters of the nominal network
    recordings : mapping of str to str
        SHA-256 of every recording that was learnt from, by name
    version : str
        Of the program that wrote it
    """

    gearbox: str
    gearbox_sha256: str
    findings: tuple[Finding, ...] = ()
    calibration: tuple[Estimate, ...] = ()
    recordings: Mapping[str, str] = field(default_factory=dict)
    version: str = ""

    def apply(self, network: ThermalNetwork, *, as_recorded: bool = False) -> ThermalNetwork:
        """The corrected network.

        Parameters
        ----------
        network : ThermalNetwork
            The nominal one
        as_recorded : bool
            Whether it is driven by inputs as the faulty instruments recorded them; see
            :meth:`models.terms.Term.apply`

        Raises
        ------
        InputError
            If the network lacks a parameter, place or signal, or a calibrated value is outside a parameter's limits.
        """
        faults = list(_calibration_faults(self.calibration, network))
        if faults:
            raise InputError("\n".join(f"the correction calibrates {fault}" for fault in faults))
        values = {estimate.name: estimate.value for estimate in self.calibration}
        calibrated = (replace(p, start=values.get(p.name, p.start)) for p in network.parameters)
        network = replace(network, parameters=tuple(calibrated))
        for finding in self.findings:
            network = finding.term.apply(network, as_recorded=as_recorded)
        return network

    def summary(self) -> dict[str, Any]:
        """What it is, for a report: names of the findings, and a hash of the whole."""
        return {
            "sha256": hashlib.sha256(correction_text(self).encode()).hexdigest(),
            "findings": [f"{f.mechanism} at {f.place}" for f in self.findings if f.mechanism != "shape"],
        }

    @property
    def words(self) -> str:
        """What it is in half a sentence, for an FMU that carries it."""
        summary = self.summary()
        return f"corrected by {', '.join(summary['findings']) or 'calibration'} (correction {summary['sha256'][:12]})"

    def network(self, gearbox: Gearbox, *, as_recorded: bool = False) -> ThermalNetwork:
        """The corrected network of the gearbox that the correction was made for.

        Raises
        ------
        InputError
            If it was made for another definition, or :meth:`apply` refuses.
        """
        _check_made_for(gearbox, self.gearbox, self.gearbox_sha256)
        return self.apply(gearbox.network(), as_recorded=as_recorded)


def _calibration_faults(calibration: Iterable[Estimate], network: ThermalNetwork) -> Iterator[str]:
    """What is wrong with calibrated values; the limits are those that the fit of a diagnosis has, and an FMU's."""
    known = {p.name: p for p in network.parameters}
    for estimate in calibration:
        p = known.get(estimate.name)
        if p is None:
            yield f"{estimate.name!r}, not of this network{did_you_mean(estimate.name, known)}"
            continue
        slack = BOUND_TOLERANCE * abs(estimate.value)
        if not p.lower - slack <= estimate.value <= p.upper + slack:
            unit = "" if p.unit == "1" else f" {p.unit}"
            yield f"{p.name!r} to {estimate.value:g}{unit}; {p.lower:g} to {p.upper:g}{unit} is possible"


def corrected_network(gearbox: Gearbox, correction: Correction | None) -> ThermalNetwork:
    """The network of a gearbox, corrected where there is a correction.

    Raises
    ------
    InputError
        If the correction was made for another definition.
    """
    return gearbox.network() if correction is None else correction.network(gearbox)


def _check_made_for(gearbox: Gearbox, name: str, sha256: str, where: str = "") -> None:
    if gearbox.hash != sha256:
        raise InputError(
            f"{where}the correction was made for {name!r} with definition {sha256[:12]}, but "
            f"{gearbox.name!r} is {gearbox.hash[:12]}; use the definition it was made for, or diagnose again"
        )


# ---------------------------------------------------------------------- the file


class _Parameter(Section):
    name: Name
    value: float
    stderr: NotNegative
    unit: Text
    lower: float
    upper: float
    description: str = ""


class _State(Section):
    name: Name
    start: float
    rate: Text
    update: Text | None = None


class _Finding(Section):
    mechanism: Text
    family: str = ""
    place: str = ""
    says: str = ""
    probability: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    label: Name
    kind: Kind
    target: tuple[Text, ...] = Field(min_length=1, strict=False)
    weights: tuple[float, ...] = Field(default=(), strict=False)
    law: Text
    is_loss: bool = False
    boundary_temperature: Text | None = None
    form: Form | None = None
    of_measurement: bool = False
    parameter: tuple[_Parameter, ...] = Field(min_length=1, strict=False)
    state: tuple[_State, ...] = Field(default=(), strict=False)


class _Calibrated(Section):
    name: Name
    value: float
    stderr: NotNegative
    unit: Text = "1"
    prior: float | None = None


class _Recording(Section):
    name: Text
    sha256: Sha256


class _Definition(Section):
    name: Text
    sha256: Sha256


class _File(Section):
    # "schema" is a method of pydantic's models.
    version_of_schema: Literal[1] = Field(alias="schema")
    version: str = ""
    gearbox: _Definition
    recording: tuple[_Recording, ...] = Field(default=(), strict=False)
    calibrated: tuple[_Calibrated, ...] = Field(default=(), strict=False)
    finding: tuple[_Finding, ...] = Field(default=(), strict=False)


def read_correction(path: str | Path, network: ThermalNetwork, *, made_for: Gearbox | None = None) -> Correction:
    """A correction from its file.

    Parameters
    ----------
    path : str or Path
    network : ThermalNetwork
        The nominal network of the gearbox, whose signals the laws may use
    made_for : Gearbox or None
        Refuse a correction that was made for another one

    Raises
    ------
    InputError
        If the file cannot be read, is not a correction, was made for another gearbox, or a calibrated value or a law
        in it cannot be used; with file, key and reason.
    """
    file = str(path)
    table = parse(read_text(Path(path)), file=file)
    if table.get("schema") != SCHEMA:
        raise InputError(
            f"{file}: schema is {table.get('schema')!r}; this program reads corrections of schema {SCHEMA}"
        )
    content = validated(_File, table, file=file)
    if made_for is not None:
        _check_made_for(made_for, content.gearbox.name, content.gearbox.sha256, f"{file}: ")
    calibration = tuple(
        Estimate(name=c.name, value=c.value, stderr=c.stderr, unit=c.unit, prior=c.prior) for c in content.calibrated
    )
    faults = list(_calibration_faults(calibration, network))
    if faults:
        raise InputError("\n".join(f"{file}: the correction calibrates {fault}" for fault in faults))
    signals = list(network.signals)
    findings = []
    for index, entry in enumerate(content.finding):
        finding = _finding(entry, signals, f"{file}: {as_written(f'finding.{index}', table)}")
        findings.append(finding)
        # A later finding may lean on an earlier one's memories and boundary.
        signals += [p.name for p in finding.term.parameters] + [s.name for s in finding.term.states]
        if finding.term.boundary_temperature is not None:
            signals.append(f"T_{finding.term.target[-1]}")
    return Correction(
        gearbox=content.gearbox.name,
        gearbox_sha256=content.gearbox.sha256,
        findings=tuple(findings),
        calibration=calibration,
        recordings={recording.name: recording.sha256 for recording in content.recording},
        version=content.version,
    )


def _finding(entry: _Finding, signals: list[str], where: str) -> Finding:
    for parameter in entry.parameter:
        if not parameter.lower <= parameter.value <= parameter.upper:
            limits = f"{parameter.lower:g} ... {parameter.upper:g}"
            raise InputError(f"{where}.parameter {parameter.name} is {parameter.value:g}; {limits} is possible")
    if entry.weights and (entry.kind not in FACTORS or len(entry.weights) != len(entry.target)):
        raise InputError(
            f"{where}.weights: {len(entry.weights)} weights for {len(entry.target)} targets of a {entry.kind}; "
            "a loss_factor or link_factor has one for each target, or none"
        )
    own = [p.name for p in entry.parameter] + [s.name for s in entry.state]
    names = [*signals, *own]

    def law(text: str, key: str) -> sp.Expr:
        return parse_expression(text, names, where=f"{where}.{key}")

    temperature = entry.boundary_temperature
    term = Term(
        label=entry.label,
        kind=entry.kind,
        target=entry.target,
        weights=entry.weights,
        expression=law(entry.law, "law"),
        parameters=tuple(
            Parameter(
                name=p.name, unit=p.unit, start=p.value, lower=p.lower, upper=p.upper, sd=p.stderr, log=False,
                description=p.description,
            )
            for p in entry.parameter
        ),
        states=tuple(
            ExtraState(
                name=s.name,
                start=s.start,
                rate=law(s.rate, f"state {s.name}.rate"),
                update=None if s.update is None else law(s.update, f"state {s.name}.update"),
            )
            for s in entry.state
        ),
        is_loss=entry.is_loss,
        boundary_temperature=None if temperature is None else law(temperature, "boundary_temperature"),
        form=entry.form,
        of_measurement=entry.of_measurement,
    )  # fmt: skip
    return Finding(
        mechanism=entry.mechanism, family=entry.family, place=entry.place, says=entry.says, term=term,
        probability=entry.probability,
    )  # fmt: skip


def write_correction(correction: Correction, path: str | Path) -> None:
    """Write a correction; the same correction gives the same bytes.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with atomic_file(Path(path)) as partial:
        partial.write_text(correction_text(correction), encoding="utf-8", newline="\n")


def correction_text(correction: Correction) -> str:
    """A correction as TOML."""
    lines = [
        "# Found by a diagnosis: the same gearbox definition plus this file is the corrected model.",
        *_entries({"schema": SCHEMA, "version": correction.version}),
        *_table("[gearbox]", {"name": correction.gearbox, "sha256": correction.gearbox_sha256}),
    ]
    for name, sha256 in correction.recordings.items():
        lines += _table("[[recording]]", {"name": name, "sha256": sha256})
    for estimate in correction.calibration:
        values = {key: getattr(estimate, key) for key in ("name", "value", "stderr", "unit", "prior")}
        lines += _table("[[calibrated]]", values)
    for finding in correction.findings:
        lines += _finding_lines(finding)
    return "\n".join(lines) + "\n"


def _finding_lines(finding: Finding) -> list[str]:
    term, temperature = finding.term, finding.term.boundary_temperature
    lines = _table(
        "[[finding]]",
        {
            "mechanism": finding.mechanism,
            "family": finding.family,
            "place": finding.place,
            "says": finding.says,
            "probability": finding.probability,
            "label": term.label,
            "kind": term.kind,
            "target": list(term.target),
            "weights": list(term.weights) or None,
            "law": expression_text(term.expression),
            "is_loss": term.is_loss,
            "boundary_temperature": None if temperature is None else expression_text(temperature),
            "form": term.form,
            "of_measurement": term.of_measurement,
        },
    )
    for p in term.parameters:
        values = {"name": p.name, "value": p.start, "stderr": p.sd, "unit": p.unit, "lower": p.lower, "upper": p.upper}
        lines += _table("[[finding.parameter]]", values | {"description": p.description})
    for s in term.states:
        laws = {"rate": expression_text(s.rate), "update": None if s.update is None else expression_text(s.update)}
        lines += _table("[[finding.state]]", {"name": s.name, "start": s.start} | laws)
    return lines


def _table(head: str, values: Mapping[str, Any]) -> list[str]:
    return ["", head, *_entries(values)]


def _entries(values: Mapping[str, Any]) -> list[str]:
    return [f"{key} = {_toml(value)}" for key, value in values.items() if value is not None]


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, str):
        escaped = "".join(_escaped(character) for character in value)
        return f'"{escaped}"'
    if not math.isfinite(value):
        raise ValueError(f"a correction cannot hold the number {value}")
    return repr(value) if isinstance(value, int) else repr(float(value))


def _escaped(character: str) -> str:
    if character in '\\"':
        return f"\\{character}"
    return character if character.isprintable() else f"\\U{ord(character):08x}"
