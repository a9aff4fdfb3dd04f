"""Gearboxes by name or from a file: TOML in, one validated :class:`Gearbox` out.

The keys of a file are the classes of :mod:`models.assembly.gearbox_definition`, without geometry those of
:mod:`models.definition.parametric_sections`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from numpy.typing import ArrayLike

from models.assembly.gearbox_definition import Definition
from models.assembly.gearbox_network import build_network, joined_already
from models.assembly.law_faults import law_faults
from models.assembly.parametric import ParametricLosses, build_parametric_network, with_losses_as_laws
from models.base.errors import InputError, did_you_mean
from models.definition.bearing_section import Bearing
from models.definition.definition_file import fault_lines, placed, read_values, refilled, refuse
from models.definition.machine_definition import MachineDefinition, has_geometry
from models.definition.messages import validate_section
from models.definition.nested_values import leaves_of, plain, with_value
from models.definition.parametric_sections import ParametricDefinition
from models.definition.sections import Ambient, Housing, Oil, Seal, Shaft, Stage, Training
from models.definition.values_with_source import Annotations
from models.files.cycle import Cycle
from models.files.toml_file import known_names, names_a_file, packaged, read_text
from models.formulas.oil import Oil as Lubricant
from models.losses.breakdown import Breakdown, break_down
from models.losses.loss_model import LossModel
from models.portable.evaluation import NoLosses
from models.simulation.result import Result, SteadyState
from models.simulation.thermal_network import Losses, ThermalNetwork

if TYPE_CHECKING:
    import pandas as pd

FOLDER = "gearboxes"
DEFAULT_SOURCE = "default of schema 1"
CHANGED_SOURCE = "changed after reading (with_values)"


@dataclass(frozen=True, eq=False, repr=False)
class Gearbox:
    """A validated gearbox definition; :func:`load_gearbox` makes one.

    The tables of the file are attributes (``gearbox.stage[0].face_width_mm``), lists of tables are tuples. Two
    gearboxes are the same when their ``hash`` is.

    Attributes
    ----------
    definition : Definition or ParametricDefinition
        All values, defaults included; the latter where the geometry is not known
    notes : Annotations
        Sources and standard deviations by dotted path
    given : frozenset of str
        Paths that the file (or its named oil) gives; the others are defaults
    file : str
        Name of the file, for messages

    Examples
    --------
    >>> load_gearbox("fzg")
    <Gearbox 'FZG efficiency rig, type C spur gears, b = 14 mm' from fzg.toml>
    """

    definition: Definition | ParametricDefinition
    notes: Annotations
    given: frozenset[str]
    file: str

    def __repr__(self) -> str:
        return f"<Gearbox {self.name!r} from {self.file}>"

    @property
    def name(self) -> str:
        """Name of the gearbox."""
        return self.definition.name

    @property
    def is_parametric(self) -> bool:
        """True if it has no geometry, and its losses are parametric laws."""
        return isinstance(self.definition, ParametricDefinition)

    @property
    def geometry(self) -> Definition:
        """The definition, if it has geometry.

        Raises
        ------
        InputError
            If it has none.
        """
        if isinstance(self.definition, ParametricDefinition):
            raise InputError(
                f"{self.file}: defines a gearbox without geometry ([[part]]); this needs teeth, shafts, "
                "bearings and a housing ([[stage]], [[shaft]], [[bearing]], [housing])"
            )
        return self.definition

    @property
    def ambient(self) -> Ambient:
        """``[ambient]``."""
        return self.geometry.ambient

    @property
    def ambient_degC(self) -> float:
        """Temperature of the surroundings where a cycle or a recording names none."""
        return self.definition.ambient_degC

    @property
    def oil(self) -> Oil:
        """``[oil]``, with the values of the named oil."""
        return self.geometry.oil

    @property
    def shaft(self) -> tuple[Shaft, ...]:
        """``[[shaft]]``."""
        return self.geometry.shaft

    @property
    def stage(self) -> tuple[Stage, ...]:
        """``[[stage]]``, from the input shaft on."""
        return self.geometry.stage

    @property
    def bearing(self) -> tuple[Bearing, ...]:
        """``[[bearing]]``."""
        return self.geometry.bearing

    @property
    def seal(self) -> tuple[Seal, ...]:
        """``[[seal]]``."""
        return self.geometry.seal

    @property
    def housing(self) -> Housing:
        """``[housing]``."""
        return self.geometry.housing

    @property
    def training(self) -> Training:
        """``[training]``."""
        return self.geometry.training

    @property
    def factors(self) -> Mapping[str, float]:
        """Every tunable factor of the thermal network by name; 1 if the file does not name it."""
        return self.geometry.all_factors

    @property
    def sources(self) -> Mapping[str, str]:
        """Sources by dotted path, as written; :meth:`source_of` answers for every value."""
        return self.notes.sources

    @property
    def priors(self) -> Mapping[str, float]:
        """Standard deviation of every single uncertain number by dotted path, in the unit of the key."""
        return self.notes.priors

    @cached_property
    def values(self) -> Mapping[str, Any]:
        """All values as plain tables, defaults included, absent ones left out."""
        dumped = self.definition.model_dump(by_alias=True, exclude_none=True)
        # Lists that a definition without geometry leaves out are no part of its hash; with geometry these tables.
        if self.is_parametric:
            return {key: value for key, value in dumped.items() if value != ()}
        return {key: value for key, value in dumped.items() if value or key not in MachineDefinition.model_fields}

    @cached_property
    def leaves(self) -> Mapping[str, Any]:
        """Every single value by dotted path.

        Examples
        --------
        >>> load_gearbox("fzg").leaves["stage.0.z.1"]
        24
        """
        return dict(leaves_of(self.values))

    @cached_property
    def hash(self) -> str:
        """SHA-256 of the values as canonical JSON; comments, sources, priors and key order do not change it."""
        text = json.dumps(self.values, sort_keys=True, separators=(",", ":"), allow_nan=False)
        return hashlib.sha256(text.encode()).hexdigest()

    @property
    def speed_ratio(self) -> Mapping[str, float]:
        """Speed of every shaft over the speed of the input shaft, by shaft name, [-]."""
        return self.geometry.speed_ratio

    def source_of(self, path: str) -> str:
        """Return where a value comes from.

        Raises
        ------
        InputError
            If the gearbox has no value of that path.

        Examples
        --------
        >>> load_gearbox("fzg").source_of("stage.0.center_distance_mm")
        'Table 1 of the paper'
        """
        if path in self.given:
            return self.notes.source_of(path)
        if path in self.leaves:
            return DEFAULT_SOURCE
        raise InputError(f"{self.file}: {path} is not a value of this gearbox{did_you_mean(path, self.leaves)}")

    def with_values(self, changes: Mapping[str, Any]) -> Self:
        """Return a new, validated gearbox with some values changed; sources and priors stay.

        Another ``oil.named`` changes the whole oil, another ``bearing.N.designation`` the sizes and constants of that
        bearing.

        Parameters
        ----------
        changes : Mapping of str to value
            New values by dotted path, in the unit of the key; names count before what is changed of a named one

        Raises
        ------
        InputError
            If a path does not exist or the changed gearbox is not valid.

        Examples
        --------
        >>> gearbox = load_gearbox("fzg").with_values({"stage.0.friction.mu_solid": 0.07, "factors.h_air": 1.1})
        >>> gearbox.stage[0].friction.mu_solid, gearbox.factors["h_air"]
        (0.07, 1.1)
        >>> round(float(gearbox.with_values({"oil.named": "ISO_VG_220"}).lubricant().kinematic_viscosity(40.0)))
        220
        """
        values: Any = self.values
        notes = Annotations(sources=dict(self.sources), priors=dict(self.priors))
        changed: list[str] = []
        for path, value in sorted(changes.items(), key=lambda item: not item[0].endswith((".named", ".designation"))):
            try:
                values = with_value(values, path.split("."), plain(value))
            except LookupError:
                hint = did_you_mean(path, self.leaves)
                raise InputError(f"{self.file}: {path} is not a value of this gearbox{hint}") from None
            values, whole = refilled(values, path, notes)
            changed.append(whole)
        refuse(notes.faults, values, file=self.file)
        definition = _validate(values, file=self.file)
        notes.sources.update(dict.fromkeys(changes, CHANGED_SOURCE))
        given = {leaf for leaf, _ in leaves_of(values) if any(f"{leaf}.".startswith(f"{path}.") for path in changed)}
        return replace(self, definition=definition, notes=notes, given=self.given | given)

    @property
    def typical_operation(self) -> tuple[float, float]:
        """Speed [1/min] and torque [N m]: half of what surrogates are trained to, without geometry the reference."""
        if isinstance(self.definition, ParametricDefinition):
            return self.definition.operation.speed_rpm, self.definition.operation.torque_Nm
        return 0.5 * max(self.training.speed_rpm), 0.5 * max(self.training.torque_Nm)

    @property
    def viscosity_constants(self) -> tuple[float, float]:
        """Constants m and n of the oil's viscosity, see :func:`models.formulas.oil.kinematic_viscosity_d341`."""
        if isinstance(self.definition, ParametricDefinition):
            return self.definition.viscosity_constants
        oil = self.lubricant()
        return oil.m, oil.n

    def lubricant(self) -> Lubricant:
        """Return the oil as the loss formulas use it."""
        return self.geometry.lubricant()

    def losses(self) -> LossModel:
        """Return the full power-loss model of this gearbox; :meth:`loss_laws` also works without geometry."""
        return LossModel.from_definition(self.geometry)

    def loss_laws(self) -> Losses:
        """Return the losses of its network: the full model, without geometry the parametric laws, or none."""
        if not isinstance(self.definition, ParametricDefinition):
            return self.losses()
        return ParametricLosses(self.definition) if self.definition.loss else NoLosses()

    def network_of_laws(self, network: ThermalNetwork) -> ThermalNetwork:
        """Return a network of this machine as FMUs need it: without geometry its losses are laws of the sources."""
        return (
            with_losses_as_laws(network, self.definition)
            if isinstance(self.definition, ParametricDefinition)
            else network
        )

    def network(self) -> ThermalNetwork:
        """Return the thermal network of this gearbox."""
        if isinstance(self.definition, ParametricDefinition):
            return build_parametric_network(self.definition, self.priors)
        return build_network(self.definition, self.priors)

    def simulate(
        self,
        cycle: Cycle | Mapping[str, ArrayLike],
        *,
        initial: float | Mapping[str, float] | None = None,
        parameters: Mapping[str, ArrayLike] | None = None,
        network: ThermalNetwork | None = None,
    ) -> Result:
        """Simulate a cycle with the full model.

        Parameters
        ----------
        cycle : Cycle, mapping of column name to ArrayLike of shape (N,), or data frame
            ``time_s``, ``speed_rpm``, ``torque_Nm`` ...; straight lines between the rows
        initial : float, mapping of node name to float, or None
            Temperatures at the first row, [degC]; by default the first ambient temperature
        parameters : mapping of name to ArrayLike, shape () or (B,), or None
            Other values of the network's parameters; arrays simulate B variants at once
        network : ThermalNetwork or None
            An extended or corrected one; by default :meth:`network`

        Raises
        ------
        InputError
            For a faulty cycle, initial temperatures, or an unknown parameter.

        Examples
        --------
        >>> cycle = {"time_s": [0.0, 600.0], "speed_rpm": [1500.0, 1500.0], "torque_Nm": [100.0, 100.0]}
        >>> result = load_gearbox("fzg").simulate(cycle, initial=20.0)
        >>> result.temperatures["oil"].round(1)
        array([20. , 30.1])
        >>> load_gearbox("fzg").simulate(cycle, parameters={"h_air": [0.5, 2.0]}).temperatures["oil"].shape
        (2, 2)
        """
        return (network or self.network()).simulate(
            cycle, losses=self.loss_laws(), initial=initial, parameters=parameters,
            trained=None if self.is_parametric else self.training,
        )  # fmt: skip

    def losses_at(
        self, *, speed: ArrayLike, torque: ArrayLike, temperatures: Mapping[str, ArrayLike] | ArrayLike
    ) -> Breakdown:
        """Return the loss of every component, [W], at operating points, with the full model.

        Parameters
        ----------
        speed, torque : ArrayLike, shape () or (N,)
            Of the input shaft, [1/min] and [N m]
        temperatures : ArrayLike, shape () or (N,), or mapping of node to ArrayLike
            Of all nodes, or of each, [degC]

        Raises
        ------
        InputError
            If a node is missing or unknown.

        Examples
        --------
        >>> losses = load_gearbox("fzg").losses_at(speed=2165.7, torque=302.0, temperatures=85.0)
        >>> losses
        <Breakdown: 920.7 W in 9 losses; largest: mesh_sliding 789.2 W, seal_2 30.4 W, bearing_1 26.3 W>
        >>> round(losses["churning"], 1), round(losses["total"], 1)
        (7.7, 920.7)
        >>> points = load_gearbox("fzg").losses_at(speed=[500.0, 1500.0], torque=94.0, temperatures=60.0)
        >>> points.to_dataframe()[["speed_rpm", "P_loss_W", "P_loss_churning_W"]].round(1)
           speed_rpm  P_loss_W  P_loss_churning_W
        0      500.0      87.1                0.9
        1     1500.0     239.3                4.4
        """
        return break_down(self.loss_laws(), speed=speed, torque=torque, temperatures=temperatures)

    def steady_state(
        self,
        *,
        speed: ArrayLike | None = None,
        torque: ArrayLike | None = None,
        inputs: Mapping[str, ArrayLike] | None = None,
        network: ThermalNetwork | None = None,
    ) -> SteadyState:
        """Return temperatures and losses at which nothing changes any more, with the full model.

        Parameters
        ----------
        speed, torque : ArrayLike, shape () or (B,), or None
            Of the input shaft, [1/min] and [N m], of a machine with these inputs; by default 0
        inputs : mapping of input name to ArrayLike, shape () or (B,), or None
            Further inputs, e.g. ``T_ambient`` [degC]
        network : ThermalNetwork or None
            An extended or corrected one; by default :meth:`network`

        Raises
        ------
        InputError
            If an input is unknown, or the torque follows from a power.
        ArithmeticError
            If there is no steady state.

        Examples
        --------
        >>> steady = load_gearbox("fzg").steady_state(speed=1500.0, torque=94.0, inputs={"T_ambient": 30.0})
        >>> round(steady.temperatures["oil"], 1), round(steady.efficiency, 4)
        (66.5, 0.9837)
        """
        return (network or self.network()).steady_state(
            losses=self.loss_laws(), speed=speed, torque=torque, inputs=inputs,
            trained=None if self.is_parametric else self.training,
        )  # fmt: skip

    def to_dataframe(self) -> pd.DataFrame:
        """Return every value by its path: ``value``, its standard deviation ``sd`` where one is given, ``source``.

        Examples
        --------
        >>> table = load_gearbox("fzg").to_dataframe()
        >>> table.loc[["stage.0.z.0", "stage.0.face_width_mm"], ["value", "source"]]
                              value                source
        stage.0.z.0              16  Table 1 of the paper
        stage.0.face_width_mm  14.0  Table 1 of the paper
        """
        import pandas as pd

        rows = [(value, self.priors.get(path), self.source_of(path)) for path, value in self.leaves.items()]
        return pd.DataFrame(rows, index=list(self.leaves), columns=["value", "sd", "source"])


def known_gearboxes() -> tuple[str, ...]:
    """Return the names of the gearboxes that come with the package.

    Examples
    --------
    >>> "fzg" in known_gearboxes()
    True
    """
    return known_names(FOLDER)


def load_gearbox(name_or_path: str | Path) -> Gearbox:
    """Read a gearbox definition.

    Parameters
    ----------
    name_or_path : str or Path
        Name of a gearbox that comes with the package (``"fzg"``), or a TOML file

    Raises
    ------
    InputError
        With the faults of the file, one per line.

    Examples
    --------
    >>> gearbox = load_gearbox("fzg")
    >>> gearbox.stage[0].face_width_mm, gearbox.stage[0].face_width
    (14.0, 0.014)
    """
    path = Path(name_or_path)
    if names_a_file(name_or_path):
        return read_gearbox(read_text(path), file=str(path))
    name = str(name_or_path)
    if name not in known_gearboxes():
        hint = did_you_mean(name, known_gearboxes())
        raise InputError(f"there is no gearbox named '{name}'{hint} (a file is named with its ending, .toml)")
    source = packaged(FOLDER, name)
    return read_gearbox(read_text(source), file=source.name)


def read_gearbox(text: str, *, file: str) -> Gearbox:
    """Read a gearbox definition from its text; `file` is the name that messages show.

    Raises
    ------
    InputError
        With the faults of the text, one per line.
    """
    values, notes = read_values(text, file=file)
    try:
        definition = _validate(values, file=file)
    except InputError as error:
        # What follows from a fault in the same table, such as all keys of a `like` that is not there, is left out.
        tables = [f"{file}: {place.rpartition('.')[0] or place}" for place, _ in placed(notes.faults, values) if place]
        others = [line for line in str(error).splitlines() if not line.startswith(tuple(tables))]
        raise InputError("\n".join([*fault_lines(notes.faults, values, file=file), *others])) from error
    refuse(notes.faults, values, file=file)
    gearbox = Gearbox(definition, notes, frozenset(path for path, _ in leaves_of(values)), file)
    whole = [path for path in notes.priors if isinstance(gearbox.leaves[path], int)]
    refuse(((path, "is a whole number and cannot have an sd") for path in whole), values, file=file)
    return gearbox


def _validate(values: Mapping[str, Any], *, file: str) -> Definition | ParametricDefinition:
    if not has_geometry(values):
        definition = validate_section(ParametricDefinition, values, file=file)
        refuse(law_faults(definition), values, file=file)
        return definition
    gearbox = validate_section(Definition, values, file=file)
    refuse([*joined_already(gearbox), *law_faults(gearbox)], values, file=file)
    return gearbox
