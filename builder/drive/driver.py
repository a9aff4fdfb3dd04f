"""Driving an FMU through a cycle with FMPy, from file columns to file columns.

A cycle is straight between its rows, an FMU holds its inputs over a step. So a row in which an input changes is cut in
pieces, and every input value is held half a piece before and half a piece after its moment. The mean over the row is
right, so slow nodes are followed to second order in the piece, and fast ones have settled to the inputs of the moment
at which they are read. An FMU that interpolates its inputs (a native one) is given their rates instead.
"""

from __future__ import annotations

import itertools
import logging
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from ctypes import byref
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from zipfile import ZipFile

import fmpy
import numpy as np
from fmpy import fmi2
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave
from numpy.typing import ArrayLike

from builder.drive.machine_of_fmu import (
    damage_reported,
    description_of,
    fmu_machine,
    memory_variables,
    start_variables,
    temperature_variables,
    to_column,
    to_column_factors,
)
from builder.fmi.signals import input_name, result_column
from builder.native.compile import host_platform
from models.base.errors import InputError, did_you_mean
from models.base.types import Array
from models.columns.columns import Columns
from models.files.cycle import Cycle
from models.quantities.quantities import column_of_input
from models.simulation.start_temperatures import start_memories, start_temperatures

logger = logging.getLogger(__name__)

LONGEST_HELD_S = 0.5  # a piece in which an input changes
LONGEST_RAMP_S = 10.0  # a piece of any ramp, however slow
LARGEST_CHANGE = {"speed": 25.0, "torque": 5.0}  # [1/min], [N m]: a slower ramp is held longer
WARNING, DISCARD = 1, 2
PROGRESS_ROWS = 50

_messages: dict[int | None, list[tuple[int, str]]] = {}  # of every instance, by its component environment
_environments = itertools.count(1)


def drive_fmu(
    path: str | Path,
    cycle: Cycle | Mapping[str, ArrayLike],
    *,
    initial: float | Mapping[str, float] | None = None,
    parameters: Mapping[str, float] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Columns:
    """Drive an FMU through a cycle.

    Parameters
    ----------
    path : str or Path
        An FMU of this project, of any kind
    cycle : Cycle, mapping of column name to ArrayLike of shape (N,), or data frame
        Inputs in the units of file columns; straight lines between the rows
    initial : float, mapping of node name to float, or None
        Temperatures at the first row, [degC]; by default the first ambient temperature, or that of the FMU's first
        boundary
    parameters : mapping of name to float, or None
        Tunable factors, by their name in the network or at the FMI interface
    progress : callable or None
        Called with (rows done, rows in all) now and then

    Returns
    -------
    Columns of shape (N,)
        Those of :meth:`models.simulation.result.Result.columns`. The FMU's warnings go to the log of this
        module.

    Raises
    ------
    InputError
        If the file is not such an FMU or damaged, it has no binary for this machine, or it refuses a value or a step.
    """
    path = Path(path)
    if not isinstance(cycle, Cycle):
        cycle = Cycle.from_columns(cycle, inputs=fmu_machine(path).inputs)
    with loaded(path) as fmu:
        table = _input_table(fmu, cycle)
        fmu.set_parameters(parameters or {})
        return Columns(_simulate_table(fmu, cycle.time, table, initial, progress))


def runs_here(path: Path) -> bool:
    """Return True if an FMU has a binary for this machine."""
    with ZipFile(path) as archive:
        return any(name.startswith(tuple(f"{folder}/" for folder in _binary_folders())) for name in archive.namelist())


def _binary_folders() -> tuple[str, ...]:
    """Folders of this machine's binaries: of FMI 3.0, then of FMI 2.0 (FMPy takes those of x86 on ARM)."""
    return f"binaries/{fmpy.platform_tuple}", f"binaries/{host_platform()}"


@dataclass
class LoadedFmu:
    """An FMU that is instantiated, its variables by their meaning, and the messages that it has logged.

    Attributes
    ----------
    path : Path
    description : fmpy.model_description.ModelDescription
    slave : fmpy.fmi2.FMU2Slave or Slave3
    messages : list of (int, str)
        Status and text, not shown yet
    doing : str
        Part of the simulation, for error messages
    """

    path: Path
    description: Any
    slave: Any = None
    messages: list[tuple[int, str]] = field(default_factory=list)
    doing: str = ""

    def __post_init__(self) -> None:
        """Find the variables."""
        variables = self.description.modelVariables
        self.variables = {v.name: v for v in variables}
        self._inputs = [v for v in variables if v.causality == "input"]
        self.inputs = [input_name(v.name) for v in self._inputs]
        shown = [v for v in variables if v.causality in ("output", "local")]
        self._outputs = [v for v in shown if result_column(v.name) is not None]
        self._booleans = [v.valueReference for v in self._outputs if v.type == "Boolean"]
        self._reals = [v.valueReference for v in self._outputs if v.type != "Boolean"]
        self._input_references = [v.valueReference for v in self._inputs]
        self._orders = [1] * len(self._inputs)
        self._to_si = [to_column_factors(v) for v in self._inputs]
        self._nodes, self._starts = temperature_variables(variables), start_variables(variables)
        self._memories = memory_variables(variables)

    def defaults(self) -> list[float]:
        """Start values of the inputs in the units of file columns."""
        return [to_column(v, float(v.start)) for v in self._inputs]

    def set_inputs(self, values: Sequence[float]) -> None:
        """Set all inputs, given in the units of file columns."""
        self.slave.setReal(self._input_references, [(v - b) / a for v, (a, b) in zip(values, self._to_si, strict=True)])

    @property
    def interpolates(self) -> bool:
        """True if inputs can change linearly through a step."""
        return bool(self.description.coSimulation.canInterpolateInputs)

    def set_rates(self, values: Sequence[float]) -> None:
        """Set the rates of all inputs during the next step, given in the units of file columns per second."""
        rates = [v / a for v, (a, _) in zip(values, self._to_si, strict=True)]
        self.slave.setRealInputDerivatives(self._input_references, self._orders, rates)

    def outputs(self) -> tuple[list[float], list[int]]:
        """Reals in the FMU's own units, and Booleans."""
        return self.slave.getReal(self._reals), self.slave.getBoolean(self._booleans)

    def columns(self, rows: Sequence[tuple[list[float], list[int]]]) -> dict[str, Array]:
        """Columns of rows of :meth:`outputs`, in the order of the FMU."""
        reals, booleans = (iter(np.array(values).T) for values in zip(*rows, strict=True))
        return {
            str(result_column(v.name)): next(booleans).astype(bool)
            if v.type == "Boolean"
            else to_column(v, next(reals))
            for v in self._outputs
        }

    def set_parameters(self, parameters: Mapping[str, float]) -> None:
        """Set tunable factors."""
        known = {name: v for name, v in self.variables.items() if v.variability == "tunable"}
        for name, value in parameters.items():
            variable = known.get(name) or known.get(f"factor.{name}")
            if variable is None:
                hint = did_you_mean(name, known)
                raise InputError(f"{self.path}: {name!r} is not a tunable parameter of this FMU{hint}")
            self.slave.setReal([variable.valueReference], [float(value)])

    def set_initial(self, initial: float | Mapping[str, float]) -> None:
        """Set start values: one temperature for all nodes, or all parts by name, and memories; [degC]."""
        temperatures = start_temperatures(initial, list(self._starts), known=self._nodes, source=str(self.path))
        self.slave.setBoolean([self.variables["initial.uniform"].valueReference], [not isinstance(initial, Mapping)])
        if not isinstance(initial, Mapping):
            self._set_real(self.variables["initial.T"], initial)
            return
        for name, variable in self._starts.items():
            self._set_real(variable, temperatures[name])
        values = start_memories(initial, {name: float(v.start) for name, v in self._memories.items()})
        self.slave.setReal([self._memories[name].valueReference for name in values], list(values.values()))

    def surroundings(self) -> float:
        """Return the ambient temperature, else that of the first boundary, at the inputs that are set, [degC]."""
        boundaries = (v for node, v in self._nodes.items() if node not in self._starts)
        variable = self.variables.get("T_ambient") or next(boundaries)
        return float(to_column(variable, self.slave.getReal([variable.valueReference])[0]))

    def _set_real(self, variable: Any, value: float) -> None:
        scale, offset = to_column_factors(variable)
        self.slave.setReal([variable.valueReference], [(float(value) - offset) / scale])

    def log(self, _environment: int | None, status: int, _category: bytes, message: bytes) -> None:
        """Add a message, as FMI 3.0 passes it on."""
        self.messages.append((status, message.decode("utf-8", "replace").strip()))

    def report_messages(self, when: str) -> None:
        """Pass the FMU's warnings on.

        Raises
        ------
        InputError
            If it has logged an error.
        """
        messages, self.messages[:] = list(self.messages), []
        faults = [text for status, text in messages if status > WARNING]
        if faults:
            raise InputError(f"{self.path}: {when}: " + "; ".join(faults))
        for status, text in messages:
            if status == WARNING:
                logger.warning("%s: %s", self.path, text)


class Slave3(FMU3Slave):  # type: ignore[misc]
    """An FMU of FMI 3.0 in FMPy, with the names of FMI 2.0."""

    getReal, setReal = FMU3Slave.getFloat64, FMU3Slave.setFloat64
    start = 0.0

    def setupExperiment(self, startTime: float) -> None:
        """Keep the start time, which FMI 3.0 takes in the next call."""
        self.start = startTime

    def enterInitializationMode(self) -> None:
        """Begin the initialisation."""
        super().enterInitializationMode(startTime=self.start)


@contextmanager
def loaded(path: Path) -> Iterator[LoadedFmu]:
    """An FMU of this project, extracted to a temporary folder and instantiated; both are removed at the end.

    Raises
    ------
    InputError
        If the file is not such an FMU, is damaged, or has no binary for this machine; and, from the block, if the FMU
        refuses a call.
    """
    path = Path(path)
    fmu = LoadedFmu(path, description_of(path))
    with (
        tempfile.TemporaryDirectory(prefix="twin-fmu-", ignore_cleanup_errors=True) as folder,
        _logged_to(fmu.messages) as callbacks,
    ):
        with damage_reported(path):
            fmpy.extract(str(path), folder)
        identifier = fmu.description.coSimulation.modelIdentifier
        names = [Path(folder, name, identifier + fmpy.sharedLibraryExtension) for name in _binary_folders()]
        binary = next((name for name in names if name.is_file()), names[-1])
        if not binary.is_file():
            raise InputError(f"{path}: has no binary for {fmpy.platform}; build the FMU for this machine")
        try:
            fmu.slave = (fmi2.FMU2Slave if fmu.description.fmiVersion == "2.0" else Slave3)(
                guid=fmu.description.guid, modelIdentifier=identifier, unzipDirectory=folder, instanceName=path.stem,
                libraryPath=str(binary),
            )  # fmt: skip
        except Exception as error:  # fmpy raises plain Exception
            raise InputError(f"{path}: its binary cannot be loaded: {error}") from error
        if isinstance(fmu.slave, Slave3):
            with suppress(Exception):  # plain Exception, where it cannot be instantiated
                fmu.slave.instantiate(loggingOn=True, logMessage=fmu.log)
        else:
            fmu.slave.component = fmu.slave.fmi2Instantiate(
                path.stem.encode(), fmi2.fmi2CoSimulation, fmu.description.guid.encode(),
                _uri(Path(folder, "resources")), byref(callbacks), False, True,
            )  # fmt: skip
        if not fmu.slave.component:
            fmu.slave.freeLibrary()
            fmu.report_messages("it cannot be instantiated")
            raise InputError(f"{path}: it cannot be instantiated, and does not say why; build the FMU again")
        dead = False
        try:
            yield fmu
        except FMICallException as error:
            dead = error.status > DISCARD + 1
            doing = fmu.doing or error.function
            fmu.report_messages(doing)
            raise InputError(f"{path}: {doing}: {error}") from error
        finally:
            if not dead:
                with suppress(FMICallException):
                    fmu.slave.terminate()
                fmu.slave.freeInstance()


def _simulate_table(
    fmu: LoadedFmu, time: Array, table: Array, initial: float | Mapping[str, float] | None,
    progress: Callable[[int, int], None] | None,
) -> dict[str, Array]:  # fmt: skip
    slave, n_rows = fmu.slave, len(time)
    slave.setupExperiment(startTime=float(time[0]))
    slave.enterInitializationMode()
    fmu.set_inputs(table[0].tolist())
    fmu.set_initial(fmu.surroundings() if initial is None else initial)
    slave.exitInitializationMode()
    fmu.report_messages("its start values")
    outputs = [fmu.outputs()]
    fmu.report_messages(f"at {time[0]:g} s")
    for row in range(n_rows - 1):
        begin, end = float(time[row]), float(time[row + 1])
        change = table[row + 1] - table[row]
        fmu.doing = f"between {begin:g} and {end:g} s"
        pieces = _pieces(fmu.inputs, end - begin, table[row], table[row + 1])
        if fmu.interpolates:
            fmu.set_inputs(table[row].tolist())
            if change.any():
                fmu.set_rates((change / (end - begin)).tolist())
            slave.doStep(begin, end - begin)
        elif pieces == 0:
            slave.doStep(begin, end - begin)
        else:
            half = (end - begin) / (2 * pieces)
            slave.doStep(begin, half)
            for piece in range(1, pieces):
                share = piece / pieces
                fmu.set_inputs(((1.0 - share) * table[row] + share * table[row + 1]).tolist())
                slave.doStep(begin + (2 * piece - 1) * half, 2.0 * half)
            fmu.set_inputs(table[row + 1].tolist())
            slave.doStep(end - half, half)
        outputs.append(fmu.outputs())
        if fmu.messages:
            fmu.report_messages(f"at {end:g} s")
        if progress is not None and (row % PROGRESS_ROWS == PROGRESS_ROWS - 1 or row == n_rows - 2):
            progress(row + 1, n_rows - 1)
    columns = {"time_s": time} | {column_of_input(name): table[:, i] for i, name in enumerate(fmu.inputs)}
    return columns | fmu.columns(outputs)


def _pieces(names: Sequence[str], duration: float, begin: Array, end: Array) -> int:
    """Into how many pieces a row is cut: of 0.5 s where an input ramps, of 10 s where it changes little; 0 at rest."""
    changes = (abs(b - a) / LARGEST_CHANGE.get(n, 1.0) for n, a, b in zip(names, begin, end, strict=True))
    change = max(changes, default=0.0)
    if change == 0.0:
        return 0
    return min(int(np.ceil(duration / LONGEST_HELD_S)), int(np.ceil(max(change, duration / LONGEST_RAMP_S))))


def _input_table(fmu: LoadedFmu, cycle: Cycle) -> Array:
    """Inputs in the FMU's order, start values where the cycle has none, shape (N, inputs)."""
    starts = zip(fmu.inputs, fmu.defaults(), strict=True)
    columns = [cycle.inputs.get(name, np.full(len(cycle), start)) for name, start in starts]
    return np.reshape(columns, (len(columns), len(cycle))).T


def _uri(resources: Path) -> bytes:
    """URI of the resources of an FMU; pythonfmu crashes on an encoded one, as it decodes nothing but blanks."""
    uri = resources.resolve().as_uri()
    return (unquote(uri) if (resources / "slavemodule.txt").is_file() else uri).encode()


def _log(environment: int | None, instance: bytes, status: int, category: bytes, message: bytes) -> None:
    """Add a message to the list of its instance; messages of instances that others made go to FMPy's own logger.

    FMPy's C part keeps one logger for the whole process, so this one is never freed.
    """
    messages = _messages.get(environment)
    if messages is None:
        fmi2.printLogMessage(environment, instance, status, category, message)
    else:
        messages.append((status, message.decode("utf-8", "replace").strip()))


_LOGGER = fmi2.fmi2CallbackLoggerTYPE(_log)


@contextmanager
def _logged_to(messages: list[tuple[int, str]]) -> Iterator[Any]:
    """Callbacks for one instance, whose messages are added to a list."""
    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.logger = _LOGGER
    callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmpy.calloc)
    callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmpy.free)
    callbacks.componentEnvironment = next(_environments)
    fmi2.addLoggerProxy(byref(callbacks))
    _messages[callbacks.componentEnvironment] = messages
    try:
        yield callbacks
    finally:
        del _messages[callbacks.componentEnvironment]
