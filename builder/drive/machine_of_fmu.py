"""Reading the description of an FMU of this project: its machine, its nodes, the correction that it contains."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import fmpy
import numpy as np

from builder.fmi.recorded import recorded_columns
from builder.fmi.signals import input_name
from diagnosis.recordings.machine import DescribedMachine, Part
from models.base.errors import InputError
from models.correction.correction import Correction
from models.files.toml_file import ENDING
from models.quantities.quantities import GEARBOX_INPUTS, INPUT_KINDS, Input, named_input
from models.quantities.units import UNITS, conversion, find_unit

NEEDED = {"initial.uniform": "parameter", "initial.T": "parameter"}  # of every FMU of this project


@dataclass(frozen=True, kw_only=True)
class FmuMachine(DescribedMachine):
    """A machine as an FMU describes it; its parts are the nodes with a start temperature.

    Attributes
    ----------
    nodes : tuple of str
        Boundaries among them
    memories : mapping of str to float
        Of the laws, with their start values
    definition : str
        Hash of the values of its definition; empty for an FMU of an earlier version
    words : str
        Description, which names the correction that it was built with
    """

    path: Path
    nodes: tuple[str, ...]
    memories: Mapping[str, float]
    definition: str
    words: str

    def refuse_other_correction(self, correction: Correction, *, source: str) -> None:
        """Refuse a correction of another machine, and one that changes the machine if it was not built with it.

        Raises
        ------
        InputError
        """
        made_for = correction.gearbox
        if made_for is not None and self.definition and made_for.sha256 != self.definition:
            raise InputError(
                f"{self.path}: is of definition {self.definition[:12]}, but {source} was made for {made_for.name!r} "
                f"with definition {made_for.sha256[:12]}; use the FMU of that machine, or diagnose again"
            )
        if correction.has_physics and correction.words not in self.words:
            raise InputError(
                f"{self.path}: was not built with {source}, which changes the physics; build it again with build-fmu "
                f"--correction {source}"
            )


def fmu_machine(path: Path) -> FmuMachine:
    """Return the machine that an FMU describes.

    Raises
    ------
    InputError
        If the file is not an FMU of this project.
    """
    description = description_of(path)
    variables = description.modelVariables
    with damage_reported(path):
        recorded = recorded_columns(path)
    inputs = [_input(v, recorded.required) for v in variables if v.causality == "input"]
    return FmuMachine(
        inputs={given.name: given for given in inputs},
        parts=tuple(Part(name) for name in start_variables(variables)),
        recording=recorded.mapping,
        path=path,
        nodes=tuple(temperature_variables(variables)),
        memories={name: float(v.start) for name, v in memory_variables(variables).items()},
        definition=recorded.definition,
        words=description.description or "",
    )


def memory_variables(variables: Iterable[Any]) -> dict[str, Any]:
    """Start variables of the memories, by the name of the memory."""
    before = "initial.state."
    return {v.name.removeprefix(before).strip("'"): v for v in variables if v.name.startswith(before)}


def _input(variable: Any, required: Sequence[str]) -> Input:
    """An input of an FMU: of the table of quantities, else named, in the unit that tools show."""
    name = input_name(variable.name)
    if name in GEARBOX_INPUTS:
        known = GEARBOX_INPUTS[name]
        return replace(known, default=to_column(variable, float(variable.start)))
    dimension = UNITS[variable.unit].dimension if variable.unit in UNITS else "ratio"
    kind = next(kind for kind, (own, _) in INPUT_KINDS.items() if own == dimension)
    bounds = (variable.min, variable.max, variable.start)
    low, high, start = (to_column(variable, float(text)) if text is not None else None for text in bounds)
    return named_input(
        name, kind, unit=variable.displayUnit or variable.unit or "", low=-np.inf if low is None else low,
        high=np.inf if high is None else high, default=start or 0.0, required=name in required,
        description=variable.description or "",
    )  # fmt: skip


def temperature_variables(variables: Iterable[Any]) -> dict[str, Any]:
    """Variables of the temperatures of nodes, by node; boundaries are among them."""
    found = (v for v in variables if v.name.endswith(".T") and v.causality != "parameter")
    return {v.name.removesuffix(".T").strip("'"): v for v in found}


def start_variables(variables: Iterable[Any]) -> dict[str, Any]:
    """Variables of start temperatures by node."""
    return {v.name.removesuffix(".T_start").strip("'"): v for v in variables if v.name.endswith(".T_start")}


def description_of(path: Path) -> Any:
    """The model description of an FMU of this project."""
    try:
        if path.is_dir():
            inside = sorted(path.glob("*.fmu"))
            raise InputError(f"{path}: is not a file but a folder; name an FMU{f', as {inside[0]}' if inside else ''}")
        if not path.is_file():
            raise InputError(f"{path}: no such file")
    except OSError as error:  # a name that is too long, a folder that may not be read
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    if path.suffix == ENDING:
        raise InputError(f"{path}: is not an FMU; a definition is given as --gearbox {path}")
    with damage_reported(path), path.open("rb") as file:  # which fmpy would leave open where it fails
        description = fmpy.read_model_description(file, validate=False)
    if not description.fmiVersion.startswith(("2.", "3.")) or description.coSimulation is None:
        raise InputError(
            f"{path}: is an FMU of FMI {description.fmiVersion}; FMI 2.0 or 3.0 for co-simulation, as of build-fmu, is "
            "needed"
        )
    names = {v.name: v.causality for v in description.modelVariables}
    missing = [name for name, causality in NEEDED.items() if names.get(name) != causality]
    if missing:
        raise InputError(
            f"{path}: is an FMU of another model: it has no {', '.join(missing)}; give one that build-fmu made"
        )
    return description


@contextmanager
def damage_reported(path: Path) -> Iterator[None]:
    """Report whatever fails in the block as a damaged file.

    Raises
    ------
    InputError
    """
    try:
        yield
    except Exception as error:  # whatever zipfile, json, lxml or fmpy find, it is not an FMU
        first = next(iter(str(error).splitlines()), type(error).__name__)
        raise InputError(f"{path}: is not an FMU, or is damaged ({first}); build it again with build-fmu") from error


def to_column(variable: Any, value: Any) -> Any:
    """Convert a value of an FMU to the unit of file columns."""
    scale, offset = to_column_factors(variable)
    return value * scale + offset


def to_column_factors(variable: Any) -> tuple[float, float]:
    """Factor and offset from an FMU's own unit to that of file columns: that which tools show, for a named input."""
    if variable.unit not in UNITS:
        return 1.0, 0.0
    unit = UNITS[variable.unit]
    if variable.causality != "input" or variable.name in GEARBOX_INPUTS:
        return unit.to_column
    return conversion(unit, find_unit(variable.displayUnit or variable.unit, unit.dimension))
