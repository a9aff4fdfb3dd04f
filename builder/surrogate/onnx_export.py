"""Networks as ONNX files: raw physical inputs to losses in W, scaling and transforms inside, double precision.

One input ``X`` of shape (N, inputs), one output ``Y`` of shape (N, outputs). The metadata contain the columns and the
gearbox definition, preset and seed that the weights come from.

Written with onnx.helper: skl2onnx (1.20) converts of this pipeline only the scalers and an ``MLPRegressor``; it refuses
a ``FunctionTransformer`` with a function and ``TransformedTargetRegressor``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import onnxruntime
from onnx import TensorProto, helper, numpy_helper

from builder.surrogate.doe import random_points
from builder.surrogate.train import TrainingResult
from models.portable.surrogate import KELVIN, LN10, Evaluator, Network

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
        Provenance; columns and bounds are added

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
        content = onnx_model(network, metadata).SerializeToString(deterministic=True)
        deviation = largest_deviation(onnx_evaluator(content), network)
        if not deviation <= TOLERANCE:
            raise ArithmeticError(f"{path.name}: onnxruntime differs from numpy by {deviation:.1e}, above {TOLERANCE}")
        path.write_bytes(content)
        paths.append(path)
    return tuple(paths)


def onnx_evaluator(content: bytes) -> Evaluator:
    """Return the network of an ONNX file's content in onnxruntime: inputs, (N, inputs), to losses [W], (N, outputs)."""
    options = onnxruntime.SessionOptions()
    # One thread: the same bits everywhere, and rows are far too few for more.
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(content, options, providers=["CPUExecutionProvider"])
    return lambda rows: np.asarray(session.run(["Y"], {"X": np.ascontiguousarray(rows, dtype=float)})[0])


def largest_deviation(evaluator: Evaluator, network: Network) -> float:
    """Largest relative difference of an evaluator from the network in numpy, over its bounds and 20 % beyond, [-].

    If an output is not a logarithm the difference is relative to the output's largest value.
    """
    low, high = np.array(network.lower), np.array(network.upper)
    rows = random_points(500, low - 0.2 * (high - low), high + 0.2 * (high - low), seed=0)
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
        self.constants.append(numpy_helper.from_array(array, name))
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
