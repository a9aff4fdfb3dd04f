"""Losses and thermal network of a gearbox without geometry: parametric laws, and as many parts as are known."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike

from models.assembly.table_builder import TableBuilder
from models.base.types import Array
from models.definition.machine_definition import Path
from models.definition.parametric_sections import Loss, ParametricDefinition, TorqueFromPower
from models.formulas.extremes import Max, Min
from models.formulas.oil import T_HIGHEST, T_LOWEST, kinematic_viscosity_d341
from models.losses.loss_model import refuse_unphysical
from models.network.laws import Parameter, symbol
from models.portable.evaluation import RPM
from models.quantities.units import find_unit
from models.simulation.thermal_network import Source, ThermalNetwork

RUN_POWER = 8  # sharpness of the step of a conductance from standstill to running, over speed
RATIOS = (0.02, 50.0)  # of speed, torque or viscosity, beyond which an exponent's deviation has no further effect
# What mechanisms know the parts of a loss by, see models.mechanisms.places.
ACTS_AS: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "gears": {"no_load": ("churning",), "load": ("mesh_sliding",)},
    "bearings": dict.fromkeys(("no_load", "load"), ("factor bearing",)),
    "seals": dict.fromkeys(("no_load", "load"), ("factor seal",)),
    "other": dict.fromkeys(("no_load", "load"), ()),
}
SLOWEST_RPM = 1.0  # below it a torque from a power is that at it


@dataclass(frozen=True)
class ParametricLosses:
    r"""Losses of which only the form is known.

    .. math::

        P = P_0 \left(\frac{n}{n_r}\right)^a \left(\frac{\nu}{\nu_r}\right)^b
            + P_1 \frac{n}{n_r} \left(\frac{M}{M_r}\right)^c

    with the viscosity at the temperature of the part that the loss warms.

    References
    ----------
    ISO/TR 14179-1 and -2: load-independent (churning, seals, no-load bearing friction: exponents of speed from 1 to 3,
    of viscosity from 0 to 0.6) and load-dependent losses (mesh and bearings: proportional to power at constant
    friction).
    """

    definition: ParametricDefinition

    @property
    def components(self) -> tuple[str, ...]:
        """``<name>_no_load`` and ``<name>_load`` of every loss that has such a part."""
        return tuple(f"{loss.name}_{kind}" for loss in self.definition.loss for kind in kinds_of(loss))

    @property
    def temperature_nodes(self) -> tuple[str, ...]:
        """Parts that losses warm."""
        return tuple(dict.fromkeys(loss.part for loss in self.definition.loss))

    @property
    def reads(self) -> tuple[frozenset[str], ...]:
        """Nodes that each component reads: the part that it warms."""
        return tuple(frozenset({loss.part}) for loss in self.definition.loss for _ in kinds_of(loss))

    def power(self, speed: ArrayLike, torque: ArrayLike, temperatures: ArrayLike) -> Array:
        """Losses [W], shape (..., components), at speed [1/min], torque [N m] and temperatures [degC].

        Raises
        ------
        InputError
            If an input is not finite or a temperature below absolute zero.
        """
        reference, nodes = self.definition.operation, self.temperature_nodes
        T = np.asarray(temperatures, dtype=float)
        refuse_unphysical(np.ravel(speed), np.ravel(torque), T.reshape(-1, len(nodes)), nodes)
        n = np.abs(np.asarray(speed, dtype=float)) / reference.speed_rpm
        m = np.abs(np.asarray(torque, dtype=float)) / reference.torque_Nm
        constants = self.definition.viscosity_constants
        nu_ref = kinematic_viscosity_d341(reference.temperature_degC, *constants)
        found = []
        for loss in self.definition.loss:
            T_here = np.clip(T[..., nodes.index(loss.part)], T_LOWEST, T_HIGHEST)
            nu = kinematic_viscosity_d341(T_here, *constants) / nu_ref
            no_load, load = _parts_of(loss, n, m, nu)
            # At standstill nothing is lost, whatever the exponent.
            either = {"no_load": np.where(n > 0.0, no_load, 0.0), "load": load + 0.0 * T_here}
            found += [either[kind] for kind in kinds_of(loss)]
        return np.stack(np.broadcast_arrays(*found), axis=-1)

    def domain_distance(self, speed: ArrayLike, torque: ArrayLike, temperatures: ArrayLike) -> Array:
        """Zero everywhere, shape (...): the laws hold as well, or as badly, at any operating point."""
        T = np.asarray(temperatures, dtype=float)[..., 0]
        return np.zeros(np.broadcast_shapes(np.shape(speed), np.shape(torque), T.shape))


def kinds_of(loss: Loss) -> tuple[str, ...]:
    """Parts of a loss: ``no_load``, ``load``, or both; one that is zero at the reference is zero everywhere."""
    return tuple(kind for kind, size in (("no_load", loss.no_load_W), ("load", loss.load_W)) if size > 0.0)


def _parts_of(loss: Loss, n: Any, m: Any, nu: Any) -> tuple[Any, Any]:
    """No-load and load-dependent part [W] at ratios to the reference, numbers or symbols; see ParametricLosses."""
    no_load = loss.no_load_W * n**loss.speed_exponent * nu**loss.viscosity_exponent
    return no_load, loss.load_W * n * m**loss.torque_exponent


def _ratios(definition: ParametricDefinition, loss: Loss) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Speed, torque and viscosity in the part that a loss warms, over those of the reference, as symbols."""
    at, constants = definition.operation, definition.viscosity_constants
    T = Min(Max(symbol(f"T_{loss.part}"), T_LOWEST), T_HIGHEST)
    nu_ref = kinematic_viscosity_d341(at.temperature_degC, *constants)
    nu = kinematic_viscosity_d341(T, *constants, xp=sp) / nu_ref
    return sp.Abs(symbol("speed")) / at.speed_rpm, sp.Abs(symbol("torque")) / at.torque_Nm, nu


def build_parametric_network(definition: ParametricDefinition, priors: Mapping[str, float]) -> ThermalNetwork:
    """Return the network that the tables of a definition without geometry describe.

    Every value with a standard deviation becomes a factor on it: ``C_<part>``, ``G_<part>_<part>``,
    ``standstill_<part>_<part>``, ``<loss>_no_load``, ``<loss>_load``; exponents become deviations from the assumed
    ones: ``<loss>_speed_exponent`` etc.

    Parameters
    ----------
    priors : mapping of str to float
        Standard deviations by dotted path
    """
    return _Builder(definition, priors).network()


def with_losses_as_laws(network: ThermalNetwork, definition: ParametricDefinition) -> ThermalNetwork:
    """Return a network of a definition, perhaps corrected, in which each loss is a law of its source.

    Parameters
    ----------
    network : ThermalNetwork
        With the signals ``P_<loss>`` of :class:`ParametricLosses`
    """
    laws: dict[sp.Symbol, sp.Expr] = {}
    for loss in definition.loss:
        n, m, nu = _ratios(definition, loss)
        no_load, load = _parts_of(loss, n, m, nu)
        either = {"no_load": sp.Piecewise((no_load, n > 0), (sp.Float(0.0), True)), "load": load}
        laws |= {symbol(f"P_{loss.name}_{kind}"): either[kind] for kind in kinds_of(loss)}
    # Losses see a shifted speed or torque (a fault of an instrument); as laws they contain the shift.
    seen = {symbol(name): law for name, law in network.operating.items()}
    laws = {name: law.xreplace(seen) for name, law in laws.items()}
    return replace(
        network,
        components=(),
        operating={},
        sources=tuple(replace(source, heat=source.heat.xreplace(laws)) for source in network.sources),
        states=tuple(state.with_laws(lambda law: law.xreplace(laws)) for state in network.states),
    )


class _Builder(TableBuilder[ParametricDefinition]):
    """Assembles the network of one definition."""

    def network(self) -> ThermalNetwork:
        definition = self.definition
        nodes, links = (*self.boundaries(), *self.parts()), self.links()
        losses = [source for index, loss in enumerate(definition.loss) for source in self._sources(index, loss)]
        sources = (*losses, *self.heats())
        derived = {} if definition.torque is None else {"torque": self._torque(definition.torque)}
        groups = self.groups()
        gears = groups.get("gears", tuple(part.name for part in definition.part if part.name == "gears"))
        if gears:  # a part that is gears and shafts
            groups.setdefault("shafts", gears)
        return ThermalNetwork(
            nodes=nodes,
            links=links,
            sources=sources,
            parameters=tuple(self.parameters),
            components=ParametricLosses(definition).components,
            inputs=definition.inputs,
            derived=derived,
            groups=groups,
            recording=definition.recording,
        )

    def conductance(self, index: int, path: Path) -> sp.Expr:
        """Conductance of a path before its `factor`, [W/K]; at rest its `standstill_share`."""
        whole, (a, b) = super().conductance(index, path), path.between
        if path.standstill_share >= 1.0:
            return whole
        share = path.standstill_share * self.factor(
            f"standstill_{a}_{b}", f"link.{index}.standstill_share", path.standstill_share,
            f"factor on the share of the conductance {a} - {b} at standstill", highest=1.0 / path.standstill_share,
        )  # fmt: skip
        speed = sp.Abs(symbol("speed")) / self.definition.operation.running_rpm
        running = speed**RUN_POWER / (1 + speed**RUN_POWER)
        return whole * (share + (1 - share) * running)

    def _torque(self, given: TorqueFromPower) -> sp.Expr:
        """Torque [N m] as power over angular speed, times the efficiency between the two places of measurement."""
        efficiency = given.efficiency * self.factor(
            "efficiency",
            "torque.efficiency",
            given.efficiency,
            f"factor on the efficiency from {given.power} to torque",
        )
        unit = find_unit(self.definition.inputs[given.power].quantity.unit, "power")
        omega = Max(sp.Abs(symbol("speed")), SLOWEST_RPM) * RPM
        return efficiency * unit.factor * symbol(given.power) / omega

    def _sources(self, index: int, loss: Loss) -> Iterator[Source]:
        path = f"loss.{index}"
        n, m, nu = _ratios(self.definition, loss)
        tilts = {"no_load": (("speed", n), ("viscosity", nu)), "load": (("torque", m),)}
        sizes = {"no_load": (loss.no_load_W, "no-load"), "load": (loss.load_W, "load-dependent")}
        for kind in kinds_of(loss):
            name, (size, text) = f"{loss.name}_{kind}", sizes[kind]
            law = self.factor(name, f"{path}.{kind}_W", size, f"factor on the {text} loss {loss.name}")
            for of, ratio in tilts[kind]:
                law *= self._tilt(f"{loss.name}_{of}_exponent", f"{path}.{of}_exponent", ratio)
            # The loss as assumed, times what a recording made of it; its name is the parameter's, so apart from it.
            yield Source(name=name, node=loss.part, heat=symbol(f"P_{name}") * law, is_loss=True,
                         acts_as=ACTS_AS[self._kind(loss)][kind])  # fmt: skip

    def _kind(self, loss: Loss) -> str:
        in_bearing = loss.part in self.groups().get("bearings", ())
        named = "bearings" if in_bearing else "seals" if loss.name.startswith("seal") else "gears"
        return loss.kind or named

    def _tilt(self, name: str, path: str, ratio: sp.Expr) -> sp.Expr:
        """``ratio ** deviation`` of an uncertain exponent."""
        sd = self.priors.get(path, 0.0)
        if sd <= 0.0:
            return sp.Integer(1)
        self.parameters.append(Parameter(
            name=name, start=0.0, lower=-2.0, upper=2.0, sd=sd, log=False, description="deviation from what is assumed",
        ))  # fmt: skip
        return Min(Max(ratio, RATIOS[0]), RATIOS[1]) ** symbol(name)
