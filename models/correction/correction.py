"""A correction: what a diagnosis found, as a small file that people review and every command takes.

A corrected model is the same definition plus this file. Laws are in it as full expressions, so that the file means the
same when the catalogue changes.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import tomli_w
from pydantic import Field, StringConstraints, model_validator

from models.assembly.gearbox import Gearbox
from models.base.atomic_write import atomic_file
from models.base.errors import InputError, did_you_mean
from models.correction.instruments import InputCorrection, SensorCorrection
from models.definition.messages import validate_section
from models.definition.sections import Name, OneOrMore, Section, Text
from models.files.toml_file import parse_schema_1, read_text
from models.network.expressions import Law
from models.network.laws import Parameter
from models.quantities.units import behind_a_number
from models.simulation.thermal_network import ExtraState, ThermalNetwork
from models.terms.law_file import LawParameter, LawState, LawTable
from models.terms.term import FACTORS, Term

if TYPE_CHECKING:
    import pandas as pd

HEADER = "# A correction: the same gearbox definition plus this file is the corrected model.\n"
FAR_SD = 2.0  # standard errors from an estimate, beyond which another number is not the same
BOUND_TOLERANCE = 1e-9  # a fit that ends at a bound may exceed it by rounding
Grade = Literal["claim", "likely", "learnt"]
SHAPE, MODEL_ERROR = "shape", "model error"  # mechanisms of findings that were learnt of them
Sha256 = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")]
NotNegative = Annotated[float, Field(ge=0.0)]


class Identity(Section):
    """``[gearbox]``, ``[[recording]]``: a name and the hash of the content."""

    name: Text
    sha256: Sha256


class Estimate(Section):
    """``[[calibrated]]``: a parameter of the network with its estimate; `prior` is the value as delivered."""

    name: Name
    value: float
    stderr: NotNegative
    unit: Text = "1"
    prior: float | None = None


class MeanLoss(Section):
    """``[mean_loss]``: mean total loss of recordings that measure none, in W.

    `estimate_W` has model error in place, so that the priors of heats, conductances and capacities have their say;
    `by_weight_W` is that with the stated sum of heat capacities, for temperatures give heat over capacity: `stderr_W`
    contains the difference. `predicting_W` is of the model that predicts, `delivered_W` of the definition.
    """

    estimate_W: float
    stderr_W: NotNegative
    predicting_W: float
    delivered_W: float
    by_weight_W: float | None = None

    @property
    def is_far(self) -> bool:
        """True if the model that predicts is not to be asked for losses."""
        return self._is_far(self.predicting_W)

    @property
    def other_by_weight_W(self) -> float | None:
        """The loss of the stated weight, if it makes up most of the error."""
        weighed_W = self.by_weight_W
        return None if weighed_W is None or 2.0 * abs(weighed_W - self.estimate_W) <= self.stderr_W else weighed_W

    @property
    def moved(self) -> bool:
        """True if the definition has another loss: one of both is wrong, or a heat capacity."""
        return self._is_far(self.delivered_W)

    def _is_far(self, other_W: float) -> bool:
        return abs(other_W - self.estimate_W) > FAR_SD * self.stderr_W

    @property
    def warning(self) -> str:
        """Half a sentence for whoever uses that model, where it is far from the estimate; else empty."""
        if not self.is_far:
            return ""
        return (
            f"take no losses from it: {self.predicting_W:.4g} W on average, where {self.estimate_W:.4g} ± "
            f"{self.stderr_W:.3g} W were estimated"
        )


class FoundParameter(LawParameter):
    """``[[finding.parameter]]``: an estimated number in a law."""

    value: float
    stderr: NotNegative
    lower: float
    upper: float

    @model_validator(mode="after")
    def _value_within_limits(self) -> Self:
        if not self.lower <= self.value <= self.upper:
            raise ValueError(f"value = {self.value:g} is outside the limits {self.lower:g} to {self.upper:g}")
        return self


class Finding(LawTable):
    """``[[finding]]``: physics that was left out, or a fault of an instrument.

    The keys from `mechanism` to `grade`, in the order of this class, are for people, see
    :class:`models.mechanisms.Mechanism`; the others are those of :class:`models.terms.term.Term`. `grade` is ``claim``
    for a name that is certain enough, ``likely`` for a tie or what acts like it, ``learnt`` for what names nothing:
    shapes of laws, model error, and effects without a certain name.
    """

    mechanism: Text
    family: str = ""
    place: str = ""
    says: str = ""
    probability: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    grade: Grade = "claim"
    label: Name
    target: OneOrMore[Text]
    weights: tuple[float, ...] = ()
    boundary_temperature: Law | None = None
    parameter: OneOrMore[FoundParameter]

    @model_validator(mode="after")
    def _one_weight_per_target(self) -> Self:
        if self.weights and (self.kind not in FACTORS or len(self.weights) != len(self.target)):
            raise ValueError(
                f"{len(self.weights)} weights for {len(self.target)} targets of a {self.kind}; a loss_factor or "
                "link_factor has one weight for each target, or none"
            )
        return self

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
        grade: Grade = "claim",
    ) -> Finding:
        """Return the finding of a term.

        Parameters
        ----------
        term : Term
            E.g. a mechanism at its place
        estimates : mapping of str to (float, float)
            Value and standard error of every parameter of the term

        The keywords are the fields of the class.

        Raises
        ------
        InputError
            If a parameter has no estimate or an estimate no parameter.
        """
        missing = [p.name for p in term.parameters if p.name not in estimates]
        if missing:
            raise InputError(f"{term.label}: no value was given for {', '.join(missing)}")
        valued = term.with_values({name: value for name, (value, _) in estimates.items()})
        return cls(
            mechanism=mechanism,
            family=family,
            place=place,
            says=says,
            probability=probability,
            grade=grade,
            label=term.label,
            kind=term.kind,
            target=term.target,
            weights=term.weights,
            law=term.expression,
            is_loss=term.is_loss,
            boundary_temperature=term.boundary_temperature,
            form=term.form,
            of_measurement=term.of_measurement,
            parameter=tuple(
                FoundParameter(
                    name=p.name, value=p.start, stderr=estimates[p.name][1], unit=p.unit, lower=p.lower, upper=p.upper,
                    description=p.description,
                )
                for p in valued.parameters
            ),
            state=tuple(LawState(**vars(s)) for s in term.states),
        )  # fmt: skip

    def with_estimates(self, estimates: Mapping[str, tuple[float, float]]) -> Finding:
        """Return the finding with other estimates: value and standard error, by the names of its parameters.

        Parameters without an estimate, and estimates of other parameters, are left as they are.
        """
        values = {name: {"value": value, "stderr": stderr} for name, (value, stderr) in estimates.items()}
        parameters = tuple(p.model_copy(update=values.get(p.name)) for p in self.parameter)
        return self.model_copy(update={"parameter": parameters})

    @property
    def term(self) -> Term:
        """The term with its parameters at the estimated values; their `sd` are the standard errors."""
        return Term(
            label=self.label,
            kind=self.kind,
            target=self.target,
            weights=self.weights,
            expression=self.law,
            parameters=tuple(
                Parameter(
                    name=p.name, unit=p.unit, start=p.value, lower=p.lower, upper=p.upper, sd=p.stderr, log=False,
                    description=p.description,
                )
                for p in self.parameter
            ),
            states=tuple(ExtraState(**dict(s)) for s in self.state),
            is_loss=self.is_loss,
            boundary_temperature=self.boundary_temperature,
            form=self.form,
            of_measurement=self.of_measurement,
        )  # fmt: skip


class Correction(Section):
    """The whole file: findings and calibrated parameters of one gearbox.

    `gearbox` has the hash of the definition's values (:attr:`models.assembly.gearbox.Gearbox.hash`); a file written by
    hand may leave it out. `recordings` has those of the recordings that were used, `version` is that of the program
    that wrote it.
    """

    schema_number: Literal[1] = Field(default=1, alias="schema")
    version: str = ""
    gearbox: Identity | None = None
    recordings: tuple[Identity, ...] = Field(default=(), alias="recording")
    calibration: tuple[Estimate, ...] = Field(default=(), alias="calibrated")
    findings: tuple[Finding, ...] = Field(default=(), alias="finding")
    sensors: tuple[SensorCorrection, ...] = Field(default=(), alias="sensor")
    inputs: tuple[InputCorrection, ...] = Field(default=(), alias="input")
    mean_loss: MeanLoss | None = None

    @model_validator(mode="after")
    def _instruments_are_named_once(self) -> Self:
        tables = Counter([("sensor", s.channel) for s in self.sensors] + [("input", i.name) for i in self.inputs])
        faults = [f"{n} tables [[{kind}]] are about {name!r}; keep one" for (kind, name), n in tables.items() if n > 1]
        if faults:
            raise ValueError("; ".join(faults))
        return self

    def __repr__(self) -> str:
        of = "" if self.gearbox is None else f" of {self.gearbox.name!r}"
        names = ", ".join(self.summary()["findings"]) or "no findings"
        return f"<Correction{of}: {names}; {len(self.calibration)} calibrated>"

    def to_dataframe(self) -> pd.DataFrame:
        """Return every estimated number: ``what`` it belongs to, ``name``, ``value``, ``stderr``, ``unit``."""
        import pandas as pd

        rows = [("calibrated", e.name, e.value, e.stderr, e.unit) for e in self.calibration]
        rows += [(f.label, p.name, p.value, p.stderr, p.unit) for f in self.findings for p in f.parameter]
        return pd.DataFrame(rows, columns=["what", "name", "value", "stderr", "unit"])

    @classmethod
    def of(
        cls,
        gearbox: Gearbox,
        *,
        findings: Iterable[Finding] = (),
        calibration: Iterable[Estimate] = (),
        sensors: Iterable[SensorCorrection] = (),
        inputs: Iterable[InputCorrection] = (),
        recordings: Mapping[str, str] | None = None,
        version: str = "",
        mean_loss: MeanLoss | None = None,
    ) -> Correction:
        """Return the correction of a gearbox; `recordings` are hashes by name."""
        return cls(
            gearbox=Identity(name=gearbox.name, sha256=gearbox.hash),
            recording=tuple(Identity(name=name, sha256=sha256) for name, sha256 in (recordings or {}).items()),
            calibrated=tuple(calibration),
            finding=tuple(findings),
            sensor=tuple(sensors),
            input=tuple(inputs),
            version=version,
            mean_loss=mean_loss,
        )

    def apply(self, network: ThermalNetwork, *, as_recorded: bool = False) -> ThermalNetwork:
        """Return the corrected network.

        Parameters
        ----------
        network : ThermalNetwork
            The nominal one
        as_recorded : bool
            True if its inputs are those that the faulty instruments recorded; see :meth:`models.terms.term.Term.apply`

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
            try:
                network = finding.term.apply(network, as_recorded=as_recorded)
            except InputError as error:
                raise InputError(f"finding '{finding.label}': {error}") from error
        return network

    def network(self, gearbox: Gearbox) -> ThermalNetwork:
        """Return the corrected network of the gearbox that the correction was made for.

        Raises
        ------
        InputError
            If it was made for another definition, or :meth:`apply` refuses.
        """
        self.check_made_for(gearbox)
        return self.apply(gearbox.network())

    def check_instruments(self, nodes: Collection[str], inputs: Collection[str]) -> None:
        """Refuse sensors at nodes and inputs that a machine lacks.

        Raises
        ------
        InputError
            With all of them.
        """
        faults = [fault for sensor in self.sensors for fault in sensor.faults(nodes)]
        faults += [
            f"[[input]] {given.name!r} is no input{did_you_mean(given.name, inputs)}"
            for given in self.inputs
            if given.name not in inputs
        ]
        if faults:
            raise InputError("\n".join(faults))

    def check_made_for(self, gearbox: Gearbox) -> None:
        """Refuse another definition than the one that the correction was made for.

        Raises
        ------
        InputError
            If the values of the definitions differ.
        """
        if self.gearbox is not None and gearbox.hash != self.gearbox.sha256:
            raise InputError(
                f"the correction was made for {self.gearbox.name!r} with definition {self.gearbox.sha256[:12]}, but "
                f"{gearbox.name!r} is {gearbox.hash[:12]}; use the definition it was made for, or diagnose again"
            )

    def claims_only(self) -> Correction:
        """Return the correction without what is only likely; calibrated values and shapes of laws name nothing."""
        return self.model_copy(update={"findings": tuple(f for f in self.findings if f.grade != "likely")})

    def of_machine(self) -> Correction:
        """Return the part of the correction that is about the machine alone.

        Instruments are of a recorder. Shapes of laws and model error are what some recordings left open; every
        diagnosis estimates them again from its own.
        """
        kept = (f for f in self.findings if not f.of_measurement and f.mechanism not in (SHAPE, MODEL_ERROR))
        return self.model_copy(update={"findings": tuple(kept), "sensors": (), "inputs": (), "mean_loss": None})

    def summary(self) -> dict[str, Any]:
        """Return the names of the findings that change the machine, and a hash of the whole, for a report."""
        return {
            "sha256": hashlib.sha256(correction_text(self).encode()).hexdigest(),
            "findings": [
                f"{'likely ' if f.grade == 'likely' else ''}{f.mechanism} at {f.place}"
                for f in self.findings
                if not f.of_measurement and f.grade != "learnt" and f.mechanism not in (SHAPE, MODEL_ERROR)
            ],
        }

    @property
    def has_physics(self) -> bool:
        """True if it changes the machine, and not only what instruments show of it."""
        return bool(self.calibration) or not all(finding.of_measurement for finding in self.findings)

    @property
    def words(self) -> str:
        """Half a sentence about it, for an FMU that contains it."""
        summary, warning = self.summary(), self.mean_loss.warning if self.mean_loss else ""
        names = ", ".join(summary["findings"]) or "calibration"
        return f"corrected by {names} (correction {summary['sha256'][:12]}{f'; {warning}' if warning else ''})"


def _calibration_faults(calibration: Iterable[Estimate], network: ThermalNetwork) -> Iterator[str]:
    """Yield the faults of calibrated values; the limits are those of the fit of a diagnosis, and of an FMU."""
    known = {p.name: p for p in network.parameters}
    for estimate in calibration:
        p = known.get(estimate.name)
        if p is None:
            yield f"{estimate.name!r}, not of this network{did_you_mean(estimate.name, known)}"
            continue
        slack = BOUND_TOLERANCE * abs(estimate.value)
        if not p.lower - slack <= estimate.value <= p.upper + slack:
            unit = behind_a_number(p.unit)
            yield f"{p.name!r} to {estimate.value:g}{unit}; {p.lower:g} to {p.upper:g}{unit} is possible"


def corrected_network(gearbox: Gearbox, correction: Correction | None) -> ThermalNetwork:
    """Return the network of a gearbox, corrected if there is a correction.

    Raises
    ------
    InputError
        If the correction was made for another definition.
    """
    return gearbox.network() if correction is None else correction.network(gearbox)


def parse_correction(path: str | Path) -> Correction:
    """Read a correction without a look at what it corrects.

    Raises
    ------
    InputError
        If the file cannot be read or is not a correction; with file, key and reason.
    """
    file = str(path)
    return validate_section(Correction, parse_schema_1(read_text(Path(path)), file=file, kind="corrections"), file=file)


def read_correction(path: str | Path, gearbox: Gearbox) -> Correction:
    """Read a correction of a gearbox; it is applied once to find its faults.

    Raises
    ------
    InputError
        If the file cannot be read, is not a correction, was made for another gearbox, or cannot be applied to its
        network; with file, key and reason.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> from models.assembly.gearbox import load_gearbox
    >>> fzg = load_gearbox("fzg")
    >>> with TemporaryDirectory() as folder:
    ...     made = Correction.of(fzg, calibration=[Estimate(name="h_air", value=0.93, stderr=0.04, prior=1.0)])
    ...     write_correction(made, Path(folder, "correction.toml"))
    ...     correction = read_correction(Path(folder, "correction.toml"), fzg)
    >>> correction
    <Correction of 'FZG efficiency rig, type C spur gears, b = 14 mm': no findings; 1 calibrated>
    >>> correction.to_dataframe()
             what   name  value  stderr unit
    0  calibrated  h_air   0.93    0.04    1
    >>> corrected = correction.network(fzg)
    """
    correction, network = parse_correction(path), gearbox.network()
    try:
        correction.check_made_for(gearbox)
        correction.apply(network, as_recorded=True)
        correction.check_instruments(network.node_names, network.inputs)
    except InputError as error:
        raise InputError("\n".join(f"{path}: {line}" for line in str(error).splitlines())) from error
    return correction


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
    """Return a correction as TOML; numbers are written with all digits, keys at their default left out."""
    return HEADER + tomli_w.dumps({"schema": 1, **correction.model_dump(by_alias=True, exclude_defaults=True)})
