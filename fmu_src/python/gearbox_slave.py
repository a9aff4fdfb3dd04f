"""The twin behind pythonfmu's co-simulation interface.

pythonfmu answers a host with OK, Discard (``False``) or, for an exception, Fatal, after which the instance is dead. So
what can be refused is refused with a message, and exceptions are left to damaged FMUs and calls that no host may make.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar
from xml.etree import ElementTree as ET

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from fmu_src.python.contents import load_twin
from fmu_src.python.twin import Refused

LAWS = ("boundary", "exchange", "heat", "fixed", "operating")  # the last only where speed or torque is shifted


class GearboxSlave(Fmi2Slave):  # type: ignore[misc,unused-ignore]
    """One instance of the FMU. The generated slave module of an FMU names the generated functions and digests."""

    generated: ClassVar[ModuleType]

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self._folder = Path(str(self.resources))
        self.modelName = self.generated.MODEL_IDENTIFIER
        try:
            laws = {name: getattr(self.generated, name) for name in LAWS if hasattr(self.generated, name)}
            self._twin = load_twin(self._folder, self.generated.DIGESTS, laws)
        except Exception as error:
            # Without loggingOn the host is told that it failed, but not why.
            sys.stderr.write(f"{self.modelName}: the FMU cannot be instantiated: {error}\n")
            raise
        self._complained = ""

    def to_xml(self, model_options: Mapping[str, str] | None = None) -> Any:  # noqa: ARG002
        """The model description that the builder wrote."""
        return ET.parse(self._folder / "modelDescription.xml").getroot()  # noqa: S314 - our own file

    # ------------------------------------------------------------------ life

    def setup_experiment(
        self,
        start_time: float,
        stop_time: float | None = None,  # noqa: ARG002
        tolerance: float | None = None,  # noqa: ARG002
    ) -> None:
        """Take the start time; stop time and tolerance do not matter to this FMU."""
        # pythonfmu puts the folder in front of sys.path for every instance and never takes it away again.
        sys.path[:] = [entry for entry in sys.path if entry != str(self.resources)]
        try:
            self._twin.start(start_time)
        except Refused as refusal:
            self._complain(refusal)

    def exit_initialization_mode(self) -> None:
        """Take over the start temperatures."""
        try:
            warning = self._twin.initialize()
        except Refused as refusal:
            self._complain(refusal)
        else:
            if warning is not None:
                self.log(warning, Fmi2Status.warning)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Simulate one step; False (Discard) if it cannot be done."""
        try:
            warning = self._twin.step(current_time, step_size)
        except Refused as refusal:
            self.log(f"step refused, state unchanged: {refusal}", Fmi2Status.discard)
            return False
        self._complained = ""
        if warning is not None:
            self.log(warning, Fmi2Status.warning)
        return True

    # ------------------------------------------------------------------ values

    def get_real(self, vrs: list[int]) -> list[float]:
        """Values of Reals; NaN where the inputs or parameters allow none, with a message."""
        return self._get(vrs)

    def get_boolean(self, vrs: list[int]) -> list[bool]:
        """Values of Booleans."""
        return [value != 0.0 for value in self._get(vrs)]

    def set_real(self, vrs: list[int], values: list[float]) -> None:
        """Set Reals."""
        self._set(vrs, values)

    def set_boolean(self, vrs: list[int], values: list[bool]) -> None:
        """Set Booleans."""
        self._set(vrs, [float(value) for value in values])

    def _get(self, vrs: list[int]) -> list[float]:
        if self._unknown(vrs):
            return [math.nan] * len(vrs)
        try:
            return self._twin.get(vrs)
        except Refused as refusal:
            self._complain(refusal)
            self._twin.blank()
            return self._twin.get(vrs)

    def _set(self, vrs: list[int], values: list[float]) -> None:
        if not self._unknown(vrs):
            for text in self._twin.set(vrs, values):
                self.log(text, Fmi2Status.error)

    def _unknown(self, vrs: list[int]) -> bool:
        """Log and return True if a value reference is unknown; an exception would be fatal to the host."""
        unknown = [vr for vr in vrs if not 0 <= vr < len(self._twin.slots)]
        if unknown:
            self.log(f"there is no variable with value reference {unknown[0]}; the call does nothing", Fmi2Status.error)
        return bool(unknown)

    def _complain(self, refusal: Refused) -> None:
        """Log a fault of values once, not at every get."""
        if str(refusal) != self._complained:
            self._complained = str(refusal)
            self.log(str(refusal), Fmi2Status.error)

    def log(
        self, msg: str, status: Fmi2Status = Fmi2Status.ok, category: str | None = None, debug: bool | None = None
    ) -> None:
        """Log a message; hosts take it as a printf format."""
        super().log(msg.replace("%", "%%"), status, category, debug)

    # ------------------------------------------------------------------ state

    def _get_fmu_state(self) -> dict[str, Any]:
        return self._twin.snapshot()

    def _set_fmu_state(self, state: dict[str, Any]) -> None:
        self._twin.restore(state)
        self._complained = ""
