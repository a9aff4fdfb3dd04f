"""The public interface of the gearbox thermal twin: everything that scripts may rely on.

Only the names listed in ``__all__`` are promised to stay between releases. They are imported on first use, so that
``import gearbox_twin`` costs nothing.

Examples
--------
>>> from gearbox_twin import load_gearbox
>>> gearbox = load_gearbox("fzg")
>>> loss = gearbox.losses().breakdown(speed=2165.7, torque=302.0, temperatures=85.0)
>>> round(float(loss["total"]), 1) > 0.0
True
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from builder.drive.driver import drive_fmu as drive_fmu
    from builder.workflows.build import build as build_fmu  # noqa: F401 - public as build_fmu
    from diagnosis.diagnose_recordings import diagnose as diagnose
    from diagnosis.recordings.read import read_recordings as read_recordings
    from diagnosis.recordings.recording import Recording as Recording
    from diagnosis.results.result import Diagnosis as Diagnosis
    from models.assembly.gearbox import Gearbox as Gearbox
    from models.assembly.gearbox import load_gearbox as load_gearbox
    from models.base.errors import InputError as InputError
    from models.correction.correction import Correction as Correction
    from models.correction.correction import corrected_network as corrected_network
    from models.correction.correction import read_correction as read_correction
    from models.files.cycle import Cycle as Cycle
    from models.files.cycle_file import read_cycle as read_cycle
    from models.mechanisms import CATALOGUE as CATALOGUE
    from models.mechanisms import Mechanism as Mechanism
    from models.mechanisms import load_mechanisms as load_mechanisms
    from models.simulation.result import Result as Result
    from models.simulation.result import SteadyState as SteadyState
    from models.simulation.simulate import simulate as simulate
    from models.simulation.steady_state import steady_state as steady_state
    from models.simulation.thermal_network import ThermalNetwork as ThermalNetwork

# Where each public name is defined, and its name there.
_DEFINED_IN = {
    "CATALOGUE": "models.mechanisms:CATALOGUE",
    "Correction": "models.correction.correction:Correction",
    "Cycle": "models.files.cycle:Cycle",
    "Diagnosis": "diagnosis.results.result:Diagnosis",
    "Gearbox": "models.assembly.gearbox:Gearbox",
    "InputError": "models.base.errors:InputError",
    "Mechanism": "models.mechanisms:Mechanism",
    "Recording": "diagnosis.recordings.recording:Recording",
    "Result": "models.simulation.result:Result",
    "SteadyState": "models.simulation.result:SteadyState",
    "ThermalNetwork": "models.simulation.thermal_network:ThermalNetwork",
    "build_fmu": "builder.workflows.build:build",
    "corrected_network": "models.correction.correction:corrected_network",
    "diagnose": "diagnosis.diagnose_recordings:diagnose",
    "drive_fmu": "builder.drive.driver:drive_fmu",
    "load_gearbox": "models.assembly.gearbox:load_gearbox",
    "load_mechanisms": "models.mechanisms:load_mechanisms",
    "read_correction": "models.correction.correction:read_correction",
    "read_cycle": "models.files.cycle_file:read_cycle",
    "read_recordings": "diagnosis.recordings.read:read_recordings",
    "simulate": "models.simulation.simulate:simulate",
    "steady_state": "models.simulation.steady_state:steady_state",
}
__all__ = sorted(_DEFINED_IN)
_INSTALLED = Path(__file__).resolve().parents[1]


def __getattr__(name: str) -> Any:
    """Import a public name on first use (PEP 562)."""
    if name not in _DEFINED_IN:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module_name, attribute = _DEFINED_IN[name].split(":")
    package = import_module(module_name.partition(".")[0])
    if _INSTALLED not in Path(str(package.__file__)).resolve().parents:
        raise ImportError(
            f"{name} needs the package {package.__name__!r} of gearbox-thermal-twin, but Python finds "
            f"{package.__file__} first; run from another folder, with `python -P`, or by the command `gearbox-twin`"
        )
    value = getattr(import_module(module_name), attribute)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """The public names."""
    return list(__all__)
