r"""The reduced loss model (ROM-PL): trained networks in place of the full model, behind the same interface.

A :class:`Network` is the plain description of one trained network: bounds, features, weights. :class:`SurrogateLosses`
puts operating points into the networks' input rows, and their outputs back onto the loss components. It reads |speed|
and |torque|; below the lowest trained speed all losses, and below the lowest trained torque the sliding loss, go
linearly to zero, as in the full model (:mod:`models.losses.loss_model`); otherwise inputs are held at the bounds of
training.

Numpy only: this file also runs where neither scikit-learn nor onnxruntime is installed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from models.base.errors import InputError
from models.base.types import Array

FORMAT = 1
KELVIN = 273.15
LN10 = float(np.log(10.0))

Feature = Literal["value", "log", "log_kelvin", "viscosity"]
Evaluator = Callable[[Array], Array]
"""Rows of one network's inputs, shape (N, inputs), to its outputs, shape (N, outputs)."""


def range_distance(
    speed: ArrayLike, torque: ArrayLike, temperatures: ArrayLike, speed_bounds: tuple[float, float],
    torque_bounds: tuple[float, float], temperature_bounds: tuple[float, float],
) -> Array:  # fmt: skip
    """How far an operating point lies outside a range of training; below its lowest speed and torque is inside.

    Parameters
    ----------
    speed, torque : ArrayLike, shape (...)
        [1/min] and [N m], signed
    temperatures : ArrayLike, shape (..., nodes)
        [degC]
    speed_bounds, torque_bounds, temperature_bounds : (float, float)
        Lowest and highest

    Returns
    -------
    Array, shape (...)
        0 inside, else the largest excess of an input as a fraction of that input's range, [-]
    """
    T, (T_low, T_high) = np.asarray(temperatures, dtype=float), temperature_bounds
    (n_low, n_high), (t_low, t_high) = speed_bounds, torque_bounds
    fast = (np.abs(speed) - n_high) / (n_high - n_low)
    heavy = (np.abs(torque) - t_high) / (t_high - t_low)
    off = np.maximum(T - T_high, T_low - T).max(axis=-1) / (T_high - T_low)
    return np.asarray(np.maximum(np.maximum(np.maximum(fast, heavy), off), 0.0))


def share_beyond(value: Array, bounds: tuple[float, float]) -> Array:
    """1 within bounds; below and above them the value as a share of the bound, shape (...).

    A loss is a force times a speed: with a constant coefficient of friction it is in proportion to both.
    """
    low, high = bounds
    return np.minimum(value / low, 1.0) * np.maximum(value / high, 1.0)


def feature_values(kind: Feature, x: Array, viscosity: tuple[float, float]) -> Array:
    r"""Return one kind of feature of physical inputs.

    Parameters
    ----------
    kind : {"value", "log", "log_kelvin", "viscosity"}
        The input itself; its natural logarithm; :math:`\ln\Theta` of a temperature in degC; :math:`\ln(\nu + 0.7)` of
        the oil at that temperature after ASTM D341, that is :math:`\ln 10 \cdot 10^{m - n \lg\Theta}`
    x : Array, shape (...)
        Input in its physical unit
    viscosity : (m, n)
        Constants of ASTM D341, [-]

    Returns
    -------
    Array, shape (...)

    References
    ----------
    ASTM D341; :func:`models.formulas.oil.kinematic_viscosity_d341`.

    Examples
    --------
    >>> ln_nu = feature_values("viscosity", np.array([40.0, 100.0]), (9.5468, 3.7520))
    >>> (np.exp(ln_nu) - 0.7).round(1).tolist()
    [32.7, 5.5]
    """
    if kind == "value":
        return x
    if kind == "log":
        return np.log(x)
    ln_theta = np.log(x + KELVIN)
    if kind == "log_kelvin":
        return ln_theta
    m, n = viscosity
    return np.asarray(LN10 * np.exp(LN10 * m - n * ln_theta))


def feature_matrix(x: Array, features: Sequence[tuple[Feature, int]], viscosity: tuple[float, float]) -> Array:
    """Return the features, shape (N, features), of inputs, shape (N, inputs); each is a type and an input's column."""
    return np.stack([feature_values(kind, x[:, column], viscosity) for kind, column in features], axis=-1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Network:
    """One trained network with its scaling folded into the weights: physical inputs to losses in W.

    Outputs are ``exp(net + passed)`` where `log_output`, else ``max(net + passed, 0)``; ``net`` is the network of two
    sigmoid layers, ``passed`` a linear part straight from the features (the powers of speed and torque that the targets
    were reduced by).

    Attributes
    ----------
    inputs, outputs : tuple of str
        Names with units (``"speed_rpm"``, ``"mesh_sliding_W"``)
    lower, upper : tuple of float
        Bounds of training per input; inputs are held there
    features : tuple of (Feature, int)
        Kind and input of every feature, see :func:`feature_values`
    viscosity : (float, float)
        Constants m, n of ASTM D341 of the oil, [-]
    weights : three Arrays, shape (features, H1), (H1, H2), (H2, outputs)
    biases : three Arrays, shape (H1,), (H2,), (outputs,)
    passed : Array, shape (features, outputs)
    """

    name: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    features: tuple[tuple[Feature, int], ...]
    viscosity: tuple[float, float]
    weights: tuple[Array, Array, Array]
    biases: tuple[Array, Array, Array]
    passed: Array
    log_output: bool

    def __call__(self, rows: Array) -> Array:
        """Outputs [W], shape (N, outputs), at inputs of shape (N, inputs), held at the bounds."""
        x = np.clip(rows, self.lower, self.upper)
        features = feature_matrix(x, self.features, self.viscosity)
        activation = features
        for weights, bias in zip(self.weights[:2], self.biases[:2], strict=True):
            activation = 0.5 + 0.5 * np.tanh(0.5 * (activation @ weights + bias))
        net = activation @ self.weights[2] + self.biases[2] + features @ self.passed
        return np.asarray(np.exp(net) if self.log_output else np.maximum(net, 0.0))

    def to_dict(self) -> dict[str, Any]:
        """Return the network as plain lists, numbers and strings (JSON)."""
        return {f.name: _plain(getattr(self, f.name)) for f in fields(self)}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Return the network of :meth:`to_dict`."""
        w_1, w_2, w_3 = (np.array(w, dtype=float) for w in data["weights"])
        b_1, b_2, b_3 = (np.array(b, dtype=float) for b in data["biases"])
        return cls(
            name=data["name"],
            inputs=tuple(data["inputs"]),
            outputs=tuple(data["outputs"]),
            lower=tuple(data["lower"]),
            upper=tuple(data["upper"]),
            features=tuple((kind, column) for kind, column in data["features"]),
            viscosity=_pair(data["viscosity"]),
            weights=(w_1, w_2, w_3),
            biases=(b_1, b_2, b_3),
            passed=np.array(data["passed"], dtype=float),
            log_output=data["log_output"],
        )


@dataclass(frozen=True)
class Use:
    """One use of a network: where its inputs come from and where its outputs go.

    Attributes
    ----------
    network : str
        Name of the network; bearings that are alike share one
    sources : tuple of str
        ``"speed"``, ``"torque"`` or the name of a temperature node, one per input of the network
    factors : tuple of float
        Input = factor * source: 1, the speed ratio of a bearing's shaft [-], its radial load per torque [N/(N m)]
    components : tuple of str
        Loss components, one per output of the network
    """

    network: str
    sources: tuple[str, ...]
    factors: tuple[float, ...]
    components: tuple[str, ...]


class _Stack:
    """All uses of all networks as one block-diagonal network: a dozen array operations per call for any number.

    Takes the input rows of all uses next to each other and returns their outputs in that order. Sigmoids are written as
    tanh, with the factors of ``sigmoid(z) = (1 + tanh(z/2))/2`` folded into the weights.
    """

    def __init__(self, networks: Sequence[Network]) -> None:
        starts = np.cumsum([0, *(len(n.inputs) for n in networks)])
        listed = [
            (kind, int(s) + c, n.viscosity) for n, s in zip(networks, starts, strict=False) for kind, c in n.features
        ]
        # Features of one kind (and one oil) are computed together: they are regrouped, and the weights' rows with them.
        groups = sorted({(kind, oil) for kind, _, oil in listed})
        order = [i for group in groups for i, (kind, _, oil) in enumerate(listed) if (kind, oil) == group]
        self._features = [
            (kind, np.array([c for k, c, o in listed if (k, o) == (kind, oil)]), oil) for kind, oil in groups
        ]
        self._lower = np.concatenate([n.lower for n in networks])
        self._upper = np.concatenate([n.upper for n in networks])
        w_1, w_2, w_3 = (_block_diagonal([n.weights[depth] for n in networks]) for depth in range(3))
        b_1, b_2, b_3 = (np.concatenate([n.biases[depth] for n in networks]) for depth in range(3))
        self._w_1, self._b_1 = 0.5 * w_1[order], 0.5 * b_1
        self._w_2, self._b_2 = 0.25 * w_2, 0.5 * (b_2 + 0.5 * w_2.sum(axis=0))
        self._w_3, self._b_3 = 0.5 * w_3, b_3 + 0.5 * w_3.sum(axis=0)
        self._passed = _block_diagonal([n.passed for n in networks])[order]
        self._log = np.concatenate([np.full(len(n.outputs), n.log_output) for n in networks])
        self._all_log = bool(self._log.all())

    def __call__(self, rows: Array) -> Array:
        x = np.minimum(np.maximum(rows, self._lower), self._upper)
        features = np.concatenate(
            [feature_values(kind, x.take(columns, axis=-1), oil) for kind, columns, oil in self._features], axis=-1
        )
        hidden = features @ self._w_1
        hidden += self._b_1
        hidden = np.tanh(hidden, out=hidden) @ self._w_2
        hidden += self._b_2
        net = np.tanh(hidden, out=hidden) @ self._w_3
        net += features @ self._passed
        net += self._b_3
        if self._all_log:
            return np.exp(net, out=net)
        return np.where(self._log, np.exp(np.where(self._log, net, 0.0)), np.maximum(net, 0.0))


def _block_diagonal(blocks: Sequence[Array]) -> Array:
    matrix = np.zeros(np.sum([block.shape for block in blocks], axis=0))
    row = column = 0
    for block in blocks:
        matrix[row : row + block.shape[0], column : column + block.shape[1]] = block
        row, column = row + block.shape[0], column + block.shape[1]
    return matrix


@dataclass(frozen=True, kw_only=True, eq=False)
class SurrogateLosses:
    """Reduced loss model, interchangeable with :class:`models.losses.loss_model.LossModel`.

    Attributes
    ----------
    components, temperature_nodes : tuple of str
        As in the full model
    speed_bounds, torque_bounds, temperature_bounds : (float, float)
        Range of training of the input shaft's speed [1/min] and torque [N m], and of all temperatures [degC]
    torque_driven : tuple of str
        Components that go linearly to zero below the lowest trained torque (sliding)
    evaluators : mapping of network name to Evaluator, optional
        What computes the networks, for example onnxruntime sessions; by default numpy does, all in one
    """

    components: tuple[str, ...]
    temperature_nodes: tuple[str, ...]
    networks: tuple[Network, ...]
    uses: tuple[Use, ...]
    speed_bounds: tuple[float, float]
    torque_bounds: tuple[float, float]
    temperature_bounds: tuple[float, float]
    torque_driven: tuple[str, ...]
    evaluators: Mapping[str, Evaluator] | None = None

    def with_evaluators(self, evaluators: Mapping[str, Evaluator]) -> SurrogateLosses:
        """Return this surrogate with its networks computed by `evaluators` (one per network name)."""
        return replace(self, evaluators=evaluators)

    @cached_property
    def reads(self) -> tuple[frozenset[str], ...]:
        """The `temperature_nodes` that each component reads."""
        nodes = frozenset(self.temperature_nodes)
        found = {component: nodes.intersection(use.sources) for use in self.uses for component in use.components}
        return tuple(found[component] for component in self.components)

    @cached_property
    def _used_networks(self) -> tuple[Network, ...]:
        by_name = {network.name: network for network in self.networks}
        return tuple(by_name[use.network] for use in self.uses)

    @cached_property
    def _gather(self) -> tuple[NDArray[np.intp], Array]:
        """Column of (speed, torque, temperatures...) and factor for every input of every use, side by side."""
        columns = {name: i for i, name in enumerate(("speed", "torque", *self.temperature_nodes))}
        index = [columns[source] for use in self.uses for source in use.sources]
        return np.array(index), np.array([factor for use in self.uses for factor in use.factors])

    @cached_property
    def _held(self) -> tuple[Array, Array]:
        """Bounds that operating points are held at. Each network knows its own lowest load."""
        bounds = [
            self.speed_bounds,
            (0.0, self.torque_bounds[1]),
            *[self.temperature_bounds] * len(self.temperature_nodes),
        ]
        lowest, highest = np.array(bounds).T
        return lowest, highest

    @cached_property
    def _scatter(self) -> tuple[NDArray[np.intp], Array]:
        """Output column of every component, and 1 where it goes to zero with the torque."""
        served = [component for use in self.uses for component in use.components]
        driven = [float(name in self.torque_driven) for name in self.components]
        return np.array([served.index(name) for name in self.components]), np.array(driven)

    @cached_property
    def _evaluate(self) -> Evaluator:
        """Input rows of all uses next to each other to their outputs next to each other."""
        if self.evaluators is None:
            return _Stack(self._used_networks)
        inputs = np.cumsum([0, *(len(n.inputs) for n in self._used_networks)])
        outputs = np.cumsum([0, *(len(n.outputs) for n in self._used_networks)])
        plan = []
        for network in self.networks:
            uses = [i for i, used in enumerate(self._used_networks) if used is network]
            read = np.array([np.arange(inputs[i], inputs[i + 1]) for i in uses])
            written = np.array([np.arange(outputs[i], outputs[i + 1]) for i in uses])
            plan.append((self.evaluators[network.name], read, written))

        def evaluate(rows: Array) -> Array:
            result = np.empty((*rows.shape[:-1], outputs[-1]))
            for run, read, written in plan:  # the uses of one network as one batch of rows
                batch = rows[..., read]
                result[..., written] = run(batch.reshape(-1, batch.shape[-1])).reshape(*rows.shape[:-1], *written.shape)
            return result

        return evaluate

    def power(self, speed: ArrayLike, torque: ArrayLike, temperatures: ArrayLike) -> Array:
        """Loss of every component.

        Outside the range of training the networks are held at its bounds; their losses go on in proportion to the
        speed, and those that vanish with the torque in proportion to that.

        Parameters
        ----------
        speed : ArrayLike, shape (...)
            Speed of the input shaft, [1/min], signed
        torque : ArrayLike, shape (...)
            Torque of the input shaft, [N m], signed
        temperatures : ArrayLike, shape (..., len(temperature_nodes))
            [degC]

        Returns
        -------
        Array, shape (..., len(components))
            [W], >= 0
        """
        n, moment, T = np.abs(speed), np.abs(torque), np.asarray(temperatures, dtype=float)
        shape = T.shape[:-1]
        if not n.shape == moment.shape == shape:
            shape = np.broadcast_shapes(n.shape, moment.shape, shape)
        point = np.empty((*shape, 2 + T.shape[-1]))
        point[..., 0], point[..., 1], point[..., 2:] = n, moment, T
        index, factors = self._gather
        lowest, highest = self._held
        rows = np.minimum(np.maximum(point, lowest), highest).take(index, axis=-1)
        rows *= factors
        order, driven = self._scatter
        losses = self._evaluate(rows).take(order, axis=-1)
        speed_share = share_beyond(point[..., :1], self.speed_bounds)
        torque_share = share_beyond(point[..., 1:2], self.torque_bounds)
        losses *= speed_share * (driven * torque_share + (1.0 - driven))
        return losses

    def domain_distance(self, speed: ArrayLike, torque: ArrayLike, temperatures: ArrayLike) -> Array:
        """How far an operating point lies outside the range of training.

        Below the lowest speed and torque counts as inside: there the loss is known to go to zero.

        Parameters
        ----------
        speed, torque : ArrayLike, shape (...)
            As in :meth:`power`
        temperatures : ArrayLike, shape (..., len(temperature_nodes))
            [degC]

        Returns
        -------
        Array, shape (...)
            0 inside, else the largest excess of an input as a fraction of that input's trained range, [-]
        """
        bounds = self.speed_bounds, self.torque_bounds, self.temperature_bounds
        return range_distance(speed, torque, temperatures, *bounds)

    def to_dict(self) -> dict[str, Any]:
        """Return the surrogate as plain lists, numbers and strings (JSON); evaluators are not part of it."""
        return {
            "format": FORMAT,
            "components": list(self.components),
            "temperature_nodes": list(self.temperature_nodes),
            "speed_rpm": list(self.speed_bounds),
            "torque_Nm": list(self.torque_bounds),
            "temperature_degC": list(self.temperature_bounds),
            "torque_driven": list(self.torque_driven),
            "uses": [{f.name: _plain(getattr(use, f.name)) for f in fields(use)} for use in self.uses],
            "networks": [network.to_dict() for network in self.networks],
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> SurrogateLosses:
        """Return the surrogate of :meth:`to_dict`.

        Raises
        ------
        InputError
            If it was written by another version.
        """
        if data.get("format") != FORMAT:
            raise InputError(f"not a surrogate of format {FORMAT}; build it again with this version")
        return cls(
            components=tuple(data["components"]),
            temperature_nodes=tuple(data["temperature_nodes"]),
            networks=tuple(Network.from_dict(network) for network in data["networks"]),
            uses=tuple(
                Use(use["network"], tuple(use["sources"]), tuple(use["factors"]), tuple(use["components"]))
                for use in data["uses"]
            ),
            speed_bounds=_pair(data["speed_rpm"]),
            torque_bounds=_pair(data["torque_Nm"]),
            temperature_bounds=_pair(data["temperature_degC"]),
            torque_driven=tuple(data["torque_driven"]),
        )


def _plain(value: Any) -> Any:
    """A field of a network or its use as lists, numbers and strings."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    return [_plain(item) for item in value] if isinstance(value, tuple) else value


def _pair(values: Iterable[float]) -> tuple[float, float]:
    low, high = values
    return low, high
