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
    from builder.build import build as build_fmu  # noqa: F401 - public as build_fmu
    from builder.files import read_cycle as read_cycle
    from builder.fmu_drive import drive_fmu as drive_fmu
    from diagnosis.diagnose_recordings import diagnose as diagnose
    from diagnosis.read_recordings import read_recordings as read_recordings
    from diagnosis.recording import Recording as Recording
    from diagnosis.result import Diagnosis as Diagnosis
    from models.correction import Correction as Correction
    from models.correction import corrected_network as corrected_network
    from models.correction import read_correction as read_correction
    from models.cycle import Cycle as Cycle
    from models.errors import InputError as InputError
    from models.gearbox import Gearbox as Gearbox
    from models.gearbox import load_gearbox as load_gearbox
    from models.mechanisms import CATALOGUE as CATALOGUE
    from models.mechanisms import Mechanism as Mechanism
    from models.mechanisms import load_mechanisms as load_mechanisms
    from models.network import ThermalNetwork as ThermalNetwork
    from models.simulation import Result as Result
    from models.simulation import simulate as simulate
    from models.simulation import steady_state as steady_state

# Where each public name is defined, and its name there.
_DEFINED_IN = {
    "CATALOGUE": "models.mechanisms:CATALOGUE",
    "Correction": "models.correction:Correction",
    "Cycle": "models.cycle:Cycle",
    "Diagnosis": "diagnosis.result:Diagnosis",
    "Gearbox": "models.gearbox:Gearbox",
    "InputError": "models.errors:InputError",
    "Mechanism": "models.mechanisms:Mechanism",
    "Recording": "diagnosis.recording:Recording",
    "Result": "models.simulation:Result",
    "ThermalNetwork": "models.network:ThermalNetwork",
    "build_fmu": "builder.build:build",
    "corrected_network": "models.correction:corrected_network",
    "diagnose": "diagnosis.diagnose_recordings:diagnose",
    "drive_fmu": "builder.fmu_drive:drive_fmu",
    "load_gearbox": "models.gearbox:load_gearbox",
    "load_mechanisms": "models.mechanisms:load_mechanisms",
    "read_correction": "models.correction:read_correction",
    "read_cycle": "builder.files:read_cycle",
    "read_recordings": "diagnosis.read_recordings:read_recordings",
    "simulate": "models.simulation:simulate",
    "steady_state": "models.simulation:steady_state",
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
