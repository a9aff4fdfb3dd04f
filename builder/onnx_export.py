"""Networks as ONNX files: raw physical inputs to losses in W, scaling and transforms inside, double precision.

One input ``X`` of shape (N, inputs), one output ``Y`` of shape (N, outputs). The file's metadata say what the columns
are, which gearbox definition, preset and seed the weights come from, and carry a digest of the graph.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper, numpy_helper

from builder.doe import random_points
from builder.train import TrainingResult
from models.errors import InputError
from models.surrogate import KELVIN, LN10, Evaluator, Network, SurrogateLosses
from models.types import Array

# Old enough for any onnxruntime since 1.12 (2022); everything used here exists in double precision.
OPSET, IR_VERSION = 17, 8
FORMAT = "gearbox loss network 1"
TOLERANCE = 1e-9  # greatest relative deviation of onnxruntime from numpy


def onnx_model(network: Network, metadata: Mapping[str, str]) -> onnx.ModelProto:
    """Return a network as ONNX model.

    Parameters
    ----------
    network : Network
    metadata : mapping of str to str
        Provenance; columns, bounds and digest are added

    Returns
    -------
    onnx.ModelProto
        The same bytes for the same arguments
    """
    graph = _Graph()
    held = graph.add("Min", graph.add("Max", "X", graph.constant(network.lower)), graph.constant(network.upper))
    parts = []
    for kind, group in groupby(network.features, key=lambda feature: feature[0]):
        columns = graph.constant([column for _, column in group], np.int64)
        value = graph.add("Gather", held, columns, axis=1)
        if kind in ("log_kelvin", "viscosity"):
            value = graph.add("Add", value, graph.constant([KELVIN]))
        if kind != "value":
            value = graph.add("Log", value)
        if kind == "viscosity":
            m, n = network.viscosity
            value = graph.add("Add", graph.add("Mul", value, graph.constant([-n])), graph.constant([LN10 * m]))
            value = graph.add("Mul", graph.add("Exp", value), graph.constant([LN10]))
        parts.append(value)
    features = graph.add("Concat", *parts, axis=1)
    activation = features
    for weights, bias in zip(network.weights[:2], network.biases[:2], strict=True):
        total = graph.add("Add", graph.add("MatMul", activation, graph.constant(weights)), graph.constant(bias))
        activation = graph.add("Sigmoid", total)
    net = graph.add("MatMul", activation, graph.constant(network.weights[2]))
    net = graph.add("Add", net, graph.constant(network.biases[2]))
    net = graph.add("Add", net, graph.add("MatMul", features, graph.constant(network.passed)))
    graph.add("Exp" if network.log_output else "Relu", net, output="Y")

    tensors = [
        helper.make_tensor_value_info(name, TensorProto.DOUBLE, ["N", width])
        for name, width in (("X", len(network.inputs)), ("Y", len(network.outputs)))
    ]
    model = helper.make_model(
        helper.make_graph(graph.nodes, network.name, tensors[:1], tensors[1:], graph.constants),
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        producer_name="",
    )
    onnx.checker.check_model(model)
    described = {
        **metadata,
        "format": FORMAT,
        "network": network.name,
        "columns": json.dumps(_columns(network)),
        "graph_sha256": _digest(model.graph),
    }
    helper.set_model_props(model, dict(sorted(described.items())))
    return model


def export_onnx(result: TrainingResult, folder: str | Path, *, version: str) -> tuple[Path, ...]:
    """Write every network of a trained surrogate to ``<network>.onnx`` and check it in onnxruntime.

    Parameters
    ----------
    result : TrainingResult
    folder : path
        Made if it does not exist
    version : str
        Of this program

    Returns
    -------
    tuple of Path

    Raises
    ------
    ArithmeticError
        If onnxruntime and numpy differ by more than 1e-9.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for network in result.losses.networks:
        metadata = {
            "definition_hash": result.definition_hash,
            "gearbox": result.gearbox,
            "preset": result.preset.name,
            "samples": str(result.preset.samples),
            "seed": str(result.seed),
            "version": version,
            "errors": json.dumps([asdict(row) for row in result.report_of(network.name)]),
        }
        path = folder / f"{network.name}.onnx"
        path.write_bytes(onnx_model(network, metadata).SerializeToString(deterministic=True))
        deviation = largest_deviation(load_onnx(path), network)
        if not deviation <= TOLERANCE:
            raise ArithmeticError(
                f"{path.name}: onnxruntime departs from numpy by {deviation:.1e}, more than {TOLERANCE}"
            )
        paths.append(path)
    return tuple(paths)


@dataclass(frozen=True)
class OnnxNetwork:
    """A network in onnxruntime: rows of physical inputs, shape (N, inputs), to losses [W], shape (N, outputs).

    Attributes
    ----------
    metadata : mapping of str to str
        As written by :func:`onnx_model`
    """

    session: Any
    metadata: Mapping[str, str]

    def __call__(self, rows: Array) -> Array:
        """Run the session."""
        return np.asarray(self.session.run(["Y"], {"X": np.ascontiguousarray(rows, dtype=float)})[0])


def load_onnx(path: str | Path, *, network: Network | None = None, definition_hash: str | None = None) -> OnnxNetwork:
    """Read a network from an ONNX file.

    Parameters
    ----------
    path : path
    network : Network, optional
        What its columns and bounds must be
    definition_hash : str, optional
        Gearbox definition that it must come from

    Raises
    ------
    InputError
        If the file is missing, damaged, not one of ours, or does not match.
    """
    path = Path(path)
    again = "build the FMU again"
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path.name}: the network cannot be read ({error.strerror}); {again}") from error
    try:
        model = onnx.ModelProto.FromString(content)
        metadata = {entry.key: entry.value for entry in model.metadata_props}
        columns = json.loads(metadata.get("columns", "null"))
    except Exception as error:  # protobuf's DecodeError has no public home; whatever it is, the file is not ONNX
        raise InputError(f"{path.name}: damaged or not an ONNX file ({len(content)} bytes); {again}") from error
    if metadata.get("format") != FORMAT:
        raise InputError(f"{path.name}: not a network of this version (no metadata 'format = {FORMAT}'); {again}")
    if metadata.get("graph_sha256") != _digest(model.graph):
        raise InputError(
            f"{path.name}: the graph does not match its digest, so the file was damaged or edited; {again}"
        )
    if network is not None and columns != _columns(network):
        raise InputError(
            f"{path.name}: holds network {metadata.get('network')!r} with columns {columns}; "
            f"network {network.name!r} with columns {_columns(network)} is needed; {again}"
        )
    if definition_hash is not None and metadata.get("definition_hash") != definition_hash:
        raise InputError(
            f"{path.name}: was trained for gearbox definition {metadata.get('definition_hash', '(none)'):.12}..., "
            f"not for {definition_hash:.12}...; the definition was changed since, so {again}"
        )
    options = onnxruntime.SessionOptions()
    # One thread: the same bits everywhere, and rows are far too few for more.
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    try:
        session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime's exceptions share no base class
        raise InputError(f"{path.name}: onnxruntime cannot run it ({error}); {again}") from error
    return OnnxNetwork(session, metadata)


def load_evaluators(surrogate: SurrogateLosses, folder: str | Path, *, definition_hash: str) -> dict[str, Evaluator]:
    """Read the ONNX file of every network of a surrogate, for :meth:`SurrogateLosses.with_evaluators`.

    Raises
    ------
    InputError
        If a file is missing, damaged or does not match.
    """
    return {
        network.name: load_onnx(Path(folder) / f"{network.name}.onnx", network=network, definition_hash=definition_hash)
        for network in surrogate.networks
    }


def read_network(path: str | Path, network: Network) -> Network:
    """A network with the bounds, weights and biases that its ONNX file holds.

    Parameters
    ----------
    path : path
    network : Network
        What it is: name, columns, features

    Raises
    ------
    InputError
        If the file is missing, damaged, or another network's.
    """
    evaluator = load_onnx(path, network=network)
    graph = onnx.load_model(str(path)).graph
    constants = {tensor.name: numpy_helper.to_array(tensor) for tensor in graph.initializer}
    products = [node for node in graph.node if node.op_type == "MatMul"]
    made = {node.output[0] for node in products}
    given = {node.op_type: constants[node.input[1]].ravel() for node in graph.node if node.op_type in ("Min", "Max")}
    biases = [constants[n.input[1]].ravel() for n in graph.node
              if n.op_type == "Add" and n.input[0] in made and n.input[1] in constants]  # fmt: skip
    *weights, passed = (constants[node.input[1]] for node in products)
    read = replace(
        network, lower=tuple(given["Max"].tolist()), upper=tuple(given["Min"].tolist()),
        weights=(weights[0], weights[1], weights[2]), biases=(biases[0], biases[1], biases[2]), passed=passed,
    )  # fmt: skip
    if not largest_deviation(evaluator, read) <= TOLERANCE:
        raise InputError(f"{Path(path).name}: is not built as this version builds networks; build the FMU again")
    return read


def largest_deviation(evaluator: Evaluator, network: Network, *, count: int = 500) -> float:
    """Largest relative difference of an evaluator from the network in numpy, over its bounds and 20 % beyond, [-].

    Where an output is not a logarithm the difference is relative to the output's largest value.
    """
    low, high = np.array(network.lower), np.array(network.upper)
    rows = random_points(count, low - 0.2 * (high - low), high + 0.2 * (high - low), seed=0)
    expected = network(rows)
    scale = expected if network.log_output else np.abs(expected).max(axis=0)
    return float((np.abs(evaluator(rows) - expected) / np.maximum(scale, np.finfo(float).tiny)).max())


class _Graph:
    """Nodes and constants of a graph, numbered in the order in which they are added."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.constants: list[onnx.TensorProto] = []

    def constant(self, values: Any, dtype: type = np.float64) -> str:
        array: Any = np.ascontiguousarray(values, dtype=dtype)
        if array.ndim == 1 and dtype is np.float64:
            array = array[None]
        name = f"c{len(self.constants)}"
        kind = TensorProto.INT64 if dtype is np.int64 else TensorProto.DOUBLE
        self.constants.append(helper.make_tensor(name, kind, array.shape, array.tobytes(), raw=True))
        return name

    def add(self, operator: str, *inputs: str, output: str | None = None, **attributes: Any) -> str:
        name = output or f"v{len(self.nodes)}"
        self.nodes.append(helper.make_node(operator, list(inputs), [name], name=f"n{len(self.nodes)}", **attributes))
        return name


def _columns(network: Network) -> dict[str, Any]:
    return {
        "inputs": [
            {"name": name, "lower": low, "upper": high}
            for name, low, high in zip(network.inputs, network.lower, network.upper, strict=True)
        ],
        "outputs": list(network.outputs),
    }


def _digest(graph: onnx.GraphProto) -> str:
    """SHA-256 of all constants and of what is done with them."""
    digest = hashlib.sha256()
    for tensor in graph.initializer:
        digest.update(f"{tensor.name} {tensor.data_type} {list(tensor.dims)}\n".encode())
        digest.update(tensor.raw_data)
    for node in graph.node:
        digest.update(f"\n{node.op_type} {list(node.input)} {list(node.output)}".encode())
    return digest.hexdigest()
