"""The public interface of the gearbox thermal twin: everything that scripts may rely on.

Only the names listed in ``__all__`` are promised to stay between releases. They are imported on first use, so that
``import gearbox_twin`` costs nothing. What a function returns prints as one line, has ``to_dataframe()`` with units in
the names of columns, and ``plot()``, which returns matplotlib's ``Axes``.

Examples
--------
Losses at an operating point, then over a sweep of the speed:

>>> from gearbox_twin import load_gearbox
>>> fzg = load_gearbox("fzg")
>>> fzg
<Gearbox 'FZG efficiency rig, type C spur gears, b = 14 mm' from fzg.toml>
>>> fzg.losses_at(speed=1500.0, torque=94.0, temperatures=60.0)
<Breakdown: 239.3 W in 9 losses; largest: mesh_sliding 151.0 W, seal_2 32.7 W, bearing_1 13.0 W>
>>> sweep = fzg.losses_at(speed=[500.0, 1500.0, 3000.0], torque=94.0, temperatures=60.0)
>>> sweep.to_dataframe()[["speed_rpm", "P_loss_W", "P_loss_mesh_sliding_W"]].round(1)
   speed_rpm  P_loss_W  P_loss_mesh_sliding_W
0      500.0      87.1                   63.6
1     1500.0     239.3                  151.0
2     3000.0     461.5                  237.7
>>> ax = sweep.plot()

Temperatures at which it settles, and over a cycle:

>>> steady = fzg.steady_state(speed=1500.0, torque=94.0)
>>> round(steady.temperatures["oil"], 1), round(steady.efficiency, 3)
(63.6, 0.984)
>>> cycle = {"time_s": [0.0, 300.0, 600.0], "speed_rpm": [1500.0] * 3, "torque_Nm": [94.0] * 3}
>>> result = fzg.simulate(cycle, initial=20.0)
>>> result
<Result: 3 rows from 0 to 600 s, 14 nodes, 9 losses>
>>> result.to_dataframe()[["time_s", "T_oil_degC", "P_loss_W"]].round(1)
   time_s  T_oil_degC  P_loss_W
0     0.0        20.0     302.3
1   300.0        25.6     283.5
2   600.0        29.8     272.7

Physics of your own:

>>> fan = fzg.network().with_link("housing", "air", lambda s: 5.0 + s.speed / 1000.0, name="fan")
>>> cooled = fzg.steady_state(speed=1500.0, torque=94.0, network=fan)
>>> round(cooled.temperatures["oil"], 1)
47.2
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from builder.drive.driver import drive_fmu as drive_fmu
    from builder.workflows.build import BuildReport as BuildReport
    from builder.workflows.build import build as build_fmu  # noqa: F401 - public under this name
    from diagnosis.decision.settings import Settings as Settings
    from diagnosis.diagnose_recordings import diagnose as diagnose
    from diagnosis.proof.cases.conceal import conceal as conceal
    from diagnosis.recordings.read import read_recordings as read_recordings
    from diagnosis.recordings.recording import Recording as Recording
    from diagnosis.report.write import correction_of as correction_of
    from diagnosis.report.write import write_files as write_diagnosis  # noqa: F401 - public under this name
    from diagnosis.results.result import Diagnosis as Diagnosis
    from models.assembly.gearbox import Gearbox as Gearbox
    from models.assembly.gearbox import known_gearboxes as known_gearboxes
    from models.assembly.gearbox import load_gearbox as load_gearbox
    from models.base.errors import InputError as InputError
    from models.columns.columns import Columns as Columns
    from models.correction.correction import Correction as Correction
    from models.correction.correction import corrected_network as corrected_network
    from models.correction.correction import read_correction as read_correction
    from models.correction.correction import write_correction as write_correction
    from models.files.cycle import Cycle as Cycle
    from models.files.cycle_file import read_cycle as read_cycle
    from models.losses.breakdown import Breakdown as Breakdown
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
    "Breakdown": "models.losses.breakdown:Breakdown",
    "BuildReport": "builder.workflows.build:BuildReport",
    "CATALOGUE": "models.mechanisms:CATALOGUE",
    "Columns": "models.columns.columns:Columns",
    "Correction": "models.correction.correction:Correction",
    "Cycle": "models.files.cycle:Cycle",
    "Diagnosis": "diagnosis.results.result:Diagnosis",
    "Gearbox": "models.assembly.gearbox:Gearbox",
    "InputError": "models.base.errors:InputError",
    "Mechanism": "models.mechanisms:Mechanism",
    "Recording": "diagnosis.recordings.recording:Recording",
    "Result": "models.simulation.result:Result",
    "Settings": "diagnosis.decision.settings:Settings",
    "SteadyState": "models.simulation.result:SteadyState",
    "ThermalNetwork": "models.simulation.thermal_network:ThermalNetwork",
    "build_fmu": "builder.workflows.build:build",
    "conceal": "diagnosis.proof.cases.conceal:conceal",
    "corrected_network": "models.correction.correction:corrected_network",
    "correction_of": "diagnosis.report.write:correction_of",
    "diagnose": "diagnosis.diagnose_recordings:diagnose",
    "drive_fmu": "builder.drive.driver:drive_fmu",
    "known_gearboxes": "models.assembly.gearbox:known_gearboxes",
    "load_gearbox": "models.assembly.gearbox:load_gearbox",
    "load_mechanisms": "models.mechanisms:load_mechanisms",
    "read_correction": "models.correction.correction:read_correction",
    "read_cycle": "models.files.cycle_file:read_cycle",
    "read_recordings": "diagnosis.recordings.read:read_recordings",
    "simulate": "models.simulation.simulate:simulate",
    "steady_state": "models.simulation.steady_state:steady_state",
    "write_correction": "models.correction.correction:write_correction",
    "write_diagnosis": "diagnosis.report.write:write_files",
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
