"""The C of native FMUs against Python: elementary functions, laws, elimination, networks."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp

from builder.fmi.signals import signal_table
from builder.native.compile import OPTIONS
from builder.native.data import model_sources
from builder.native.native_fmu import LOSS_NETWORKS, THERMAL_MODEL, linker_names, native_source
from builder.native.structure import Structure
from builder.surrogate.onnx_export import onnx_evaluator
from builder.surrogate.train import TrainingResult
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.network.compiled import compile_laws, law_expressions
from models.network.laws import c_function_source, symbol
from models.portable.surrogate import SurrogateLosses
from models.simulation.thermal_network import ThermalNetwork
from tests.contract.networks import with_everything

COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C compiler")
Array = np.ndarray[Any, np.dtype[np.float64]]
Library = Callable[..., ctypes.CDLL]


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """Compiles a C text, which may include files, with others, and loads it."""

    def compiled(text: str, files: Mapping[str, str] | None = None, *, beside: tuple[str, ...] = ()) -> ctypes.CDLL:
        folder = tmp_path_factory.mktemp("c")
        headers = {"elementary.h": native_source("elementary.h"), "linker_names.h": linker_names(files or {}, "test")}
        for name, content in {**headers, **(files or {}), "test.c": f'#include "linker_names.h"\n{text}'}.items():
            (folder / name).write_text(content)
        options = [option for option in OPTIONS if option != "-fvisibility=hidden"]
        command = [
            str(COMPILER),
            *options,
            "-Wall",
            "-Wextra",
            "-Werror",
            "-fPIC",
            "-shared",
            "-o",
            "test.so",
            "test.c",
            *beside,
            "-lm",
        ]
        subprocess.run(command, cwd=folder, check=True)
        return ctypes.CDLL(str(folder / "test.so"))

    return compiled


def called(function: Any, *arrays: Array, out: int) -> Array:
    """What a C function on arrays of double writes into its last argument."""
    result = np.full(out + 1, 7.0)  # one more, to see that nothing is written behind
    kept = [np.ascontiguousarray(a, dtype=float) for a in (*arrays, result)]
    function(*(a.ctypes.data_as(ctypes.c_void_p) for a in kept))
    result = kept[-1]
    assert result[-1] == 7.0
    return result[:-1]


# ---------------------------------------------------------------------- elementary functions

ELEMENTARY = """
#include "elementary.h"
void exps(const double *x, double *y) { for (int i = 0; i < 4000; i++) y[i] = bounded_exp(x[i]); }
void logs(const double *x, double *y) { for (int i = 0; i < 4000; i++) y[i] = normal_log(x[i]); }
void sigmoids(const double *x, double *y) { for (int i = 0; i < 4000; i++) y[i] = sigmoid_of_negative(x[i]); }
"""


@pytest.fixture(scope="module")
def elementary(library: Library) -> ctypes.CDLL:
    return library(ELEMENTARY)


@pytest.mark.parametrize("reach", [1e-6, 1.0, 30.0, 700.0])
def test_exp_is_that_of_libm(elementary: ctypes.CDLL, reach: float) -> None:
    x = np.linspace(-reach, reach, 4000)
    np.testing.assert_allclose(called(elementary.exps, x, out=4000), np.exp(x), rtol=5e-16 + reach * 1e-18)


def test_exp_is_held_where_it_would_overflow(elementary: ctypes.CDLL) -> None:
    found = called(elementary.exps, np.repeat([-1e300, -701.0, 701.0, 1e300], 1000), out=4000)
    np.testing.assert_allclose(found, np.repeat(np.exp([-700.0, -700.0, 700.0, 700.0]), 1000), rtol=2e-15)


@pytest.mark.parametrize(("low", "high"), [(-300.0, 300.0), (-0.3, 0.3), (-1e-7, 1e-7)])
def test_log_is_that_of_libm(elementary: ctypes.CDLL, low: float, high: float) -> None:
    x = 10.0 ** np.linspace(low, high, 4000)
    np.testing.assert_allclose(called(elementary.logs, x, out=4000), np.log(x), rtol=4e-16)


@pytest.mark.parametrize("reach", [1e-6, 1.0, 30.0, 700.0])
def test_sigmoid_is_that_of_libm(elementary: ctypes.CDLL, reach: float) -> None:
    y = np.linspace(-reach, reach, 4000)
    np.testing.assert_allclose(called(elementary.sigmoids, y, out=4000), 1.0 / (1.0 + np.exp(y)), rtol=1e-15)


# ---------------------------------------------------------------------- laws

X, Y = symbol("x"), symbol("y")
LAWS = [
    sp.Piecewise((1, X > 2), (2, sp.And(X < 1, Y > 0)), (X / 3, True)),
    sp.Piecewise((3, sp.Or(X < 0, Y < 0)), (4, True)) / sp.Piecewise((2, X > 1), (5, True)),
    sp.Max(X, Y, 3) - sp.Min(X, Y, -1, X * Y),
    sp.sqrt(sp.Abs(X)) + sp.Abs(X) ** sp.Float(0.32) + (2 + sp.Abs(Y)) ** sp.Rational(-1, 3),
    X**2 - Y**-3 + X**17 * sp.Float(1e-12) + (X + Y) ** -1 + sp.Abs(Y) ** sp.Rational(1, 4),
    (5 + X) ** -5.0 + (3 + sp.Abs(X)) ** Y,
    sp.sign(X) * sp.Rational(1, 3) + sp.sign(Y) / 2,
    sp.Mod(X, 3) + sp.Mod(Y, -2),
    sp.pi * X + sp.E * Y + sp.log(5 + X, 10),
    sp.exp(X) * sp.sin(Y) + sp.atan2(X, Y) + sp.tanh(X) + sp.floor(X) + sp.ceiling(Y) + sp.erf(X),
    10**12 * X / 7 + sp.Integer(3) / 2,
]


def test_expressions_in_c_give_what_sympy_gives(library: Library) -> None:
    source = c_function_source("test", {"x": "s[0]", "y": "s[1]"}, LAWS)
    function = library(f'#include "elementary.h"\n{source}').law_test
    rng = np.random.default_rng(0)
    for x, y in [*rng.uniform(-3.0, 3.0, (40, 2)), (0.0, 1.0), (2.0, -1.0), (-3.0, 0.5)]:
        expected = [float(law.subs({X: sp.Float(x, 30), Y: sp.Float(y, 30)}).evalf(25)) for law in LAWS]
        np.testing.assert_allclose(called(function, np.array([x, y]), out=len(LAWS)), expected, rtol=2e-14, atol=1e-15)


def test_a_signal_may_have_any_name(library: Library) -> None:
    """As have the common parts of laws that C names for itself."""
    names = ["x0", "x1", "x2"]
    a, b, c = map(symbol, names)
    laws = [sp.sqrt(1 + (a + b) ** 2) * c, sp.sqrt(1 + (a + b) ** 2) + a, (a + b) ** 2 + c]
    source = c_function_source("test", {name: f"s[{i}]" for i, name in enumerate(names)}, laws)
    assert "const double" in source
    function = library(f'#include "elementary.h"\n{source}').law_test
    expected = [float(law.subs({a: 1.5, b: -0.7, c: 2.5})) for law in laws]
    np.testing.assert_allclose(called(function, np.array([1.5, -0.7, 2.5]), out=3), expected, rtol=1e-15)


def test_function_that_c_lacks_is_refused() -> None:
    with pytest.raises(InputError, match="cannot be written in C"):
        c_function_source("test", {"x": "s[0]"}, [sp.zeta(X)])


def test_law_without_arguments_compiles(library: Library) -> None:
    function = library(c_function_source("test", {}, [sp.Integer(2), sp.Rational(1, 3)])).law_test
    assert called(function, np.zeros(1), out=2).tolist() == [2.0, 1.0 / 3.0]


@pytest.fixture(scope="module", params=["nominal", "extended"])
def network(request: pytest.FixtureRequest, fzg: Gearbox) -> ThermalNetwork:
    return {"nominal": fzg.network(), "extended": with_everything(fzg.network())}[request.param]


@pytest.fixture(scope="module")
def surrogate(fzg_training: TrainingResult) -> SurrogateLosses:
    return fzg_training.losses


@pytest.fixture(scope="module")
def generated(network: ThermalNetwork, fzg: Gearbox, surrogate: SurrogateLosses) -> dict[str, str]:
    return model_sources(signal_table(network, surrogate), network, surrogate)


@pytest.fixture(scope="module")
def model(generated: dict[str, str], library: Library) -> ctypes.CDLL:
    """Laws, structure and losses of a network, with functions that a test can call."""
    files = {name: native_source(name) for name in THERMAL_MODEL + LOSS_NETWORKS} | generated
    text = """
        #include "laws.h"
        #include "loss_networks.h"
        #define EXPORT __attribute__((visibility("default")))
        EXPORT void boundary(const double *s, double *y) { law_boundary(s, y); }
        EXPORT void exchange(const double *s, double *y) { law_exchange(s, y); }
        EXPORT void heat(const double *s, double *y) { law_heat(s, y); }
        EXPORT void fixed(const double *s, double *y) { law_fixed(s, y); }
        EXPORT void portable(const double *p, double *y) { loss_power_portable(p[0], p[1], p + 2, y); }
        EXPORT void chosen(const double *p, double *y) { loss_power_here()(p[0], p[1], p + 2, y); }
        EXPORT void distance(const double *p, double *y) { y[0] = loss_domain_distance(p[0], p[1], p + 2); }
    """
    beside = ("laws.c", "structure.c", "model_data.c", "loss_networks.c")
    return library(text, files, beside=beside)


def test_laws_of_a_network_are_those_of_python(network: ThermalNetwork, model: ctypes.CDLL) -> None:
    laws = compile_laws(network, vector=False)
    arguments = {name: names for name, (names, _) in law_expressions(network).items()}
    groups = [["time"], [*network.inputs], [f"T_{p.name}" for p in network.parts],
              [p.name for p in network.parameters], [s.name for s in network.states] or ["-"],
              [f"P_{name}" for name in network.components]]  # fmt: skip
    order = [name for group in groups for name in group]
    rng = np.random.default_rng(1)
    for _ in range(50):
        values = {name: rng.uniform(0.5, 2.0) for name in order}
        values |= {name: rng.uniform(-40.0, 200.0) for name in order if name.startswith("T_")}
        values |= {"speed": rng.uniform(-6500.0, 6500.0), "torque": rng.uniform(-350.0, 350.0)}
        values |= {state.name: float(rng.integers(0, 2)) for state in network.states}
        everything = np.array([values[name] for name in order])
        for name in ("boundary", "exchange", "heat", "fixed"):
            expected = np.array(getattr(laws, name)(*(values[argument] for argument in arguments[name])), dtype=float)
            given = np.array([values[p] for p in arguments["fixed"]]) if name == "fixed" else everything
            found = called(getattr(model, name), given, out=len(expected))
            np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12, err_msg=name)


# ---------------------------------------------------------------------- elimination


@pytest.mark.parametrize("seed", range(6))
def test_elimination_solves_any_structure(library: Library, seed: int) -> None:
    rng = np.random.default_rng(seed)
    n_parts, n_boundaries, n_links = int(rng.integers(1, 14)), 2, int(rng.integers(1, 40))
    ends = [rng.choice(n_parts + n_boundaries, 2, replace=False).tolist() for _ in range(n_links)]
    sources = rng.integers(0, n_parts, 3).tolist()
    links = tuple((a, b) for a, b in ends)
    structure = Structure(n_parts=n_parts, n_boundaries=n_boundaries, links=links, sources=tuple(sources))
    header = '#include "linker_names.h"\n' + "".join(f"{line};\n" for line in structure.signatures())
    text = f"""
        #include "structure.c"
        void gain(const double *g, const double *T, const double *heat, double *y) {{
            structure_gain(g, T, T + {n_parts}, heat, y);
        }}
        void outflow(const double *g, const double *T, double *y) {{ structure_outflow(g, T, T + {n_parts}, y); }}
        void solved(const double *g, const double *c, const double *q, double *x) {{
            double f[{structure.n_factors}];
            structure_factorize(g, c, 0.7, f);
            structure_solve(f, q, x);
        }}"""
    c = library(text, {"laws.h": header, "structure.c": structure.source()})
    g, T = rng.uniform(0.1, 50.0, n_links), rng.uniform(0.0, 100.0, n_parts + n_boundaries)
    capacity, heat, q = rng.uniform(1.0, 900.0, n_parts), rng.uniform(0.0, 9.0, 3), rng.normal(size=n_parts)
    full = np.zeros((n_parts + n_boundaries,) * 2)
    for (a, b), conductance in zip(ends, g, strict=True):
        full[[a, b], [a, b]] += conductance
        full[[a, b], [b, a]] -= conductance
    gain = -(full @ T)[:n_parts]
    np.add.at(gain, sources, heat)
    np.testing.assert_allclose(called(c.gain, g, T, heat, out=n_parts), gain, rtol=1e-12, atol=1e-9)
    between = np.array([max(a, b) >= n_parts > min(a, b) for a, b in ends])
    to_boundary = np.zeros((n_parts + n_boundaries,) * 2)
    for (a, b), conductance in zip(ends, g * between, strict=True):
        to_boundary[[a, b], [a, b]] += conductance
        to_boundary[[a, b], [b, a]] -= conductance
    outflow = -(to_boundary @ T)[n_parts:]
    np.testing.assert_allclose(called(c.outflow, g, T, out=n_boundaries), outflow, rtol=1e-12, atol=1e-9)
    expected = np.linalg.solve(np.diag(capacity) + 0.7 * full[:n_parts, :n_parts], q)
    np.testing.assert_allclose(called(c.solved, g, capacity, q, out=n_parts), expected, rtol=1e-11, atol=1e-14)


# ---------------------------------------------------------------------- losses


def points(losses: SurrogateLosses, count: int) -> Array:
    """Operating points inside the range of training and up to a fifth of it outside, slow and light ones among them."""
    rng = np.random.default_rng(2)
    speed, torque = ((-1.2 * b[1], 1.2 * b[1]) for b in (losses.speed_bounds, losses.torque_bounds))
    rows = np.column_stack([rng.uniform(*speed, count), rng.uniform(*torque, count),
                            rng.uniform(-60.0, 240.0, (count, len(losses.temperature_nodes)))])  # fmt: skip
    rows[: count // 4, :2] *= 1e-4
    rows[0, 0] = rows[1, 1] = 0.0
    return rows


def test_losses_are_those_of_numpy_and_onnxruntime(
    model: ctypes.CDLL, surrogate: SurrogateLosses, fzg_networks: tuple[Path, ...]
) -> None:
    rows = points(surrogate, 400)
    evaluators = {path.stem: onnx_evaluator(path.read_bytes()) for path in fzg_networks}
    n = len(surrogate.components)
    for losses in (surrogate, surrogate.with_evaluators(evaluators)):
        expected = losses.power(rows[:, 0], rows[:, 1], rows[:, 2:])
        for function in (model.portable, model.chosen):
            found = np.array([called(function, row, out=n) for row in rows])
            np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11)
    distances = np.array([called(model.distance, row, out=1)[0] for row in rows])
    np.testing.assert_allclose(distances, surrogate.domain_distance(rows[:, 0], rows[:, 1], rows[:, 2:]), rtol=1e-14)
    assert 0 < np.sum(distances == 0.0) < len(rows)


def test_generated_text_is_the_same_every_time(
    generated: dict[str, str], network: ThermalNetwork, fzg: Gearbox, surrogate: SurrogateLosses
) -> None:
    assert model_sources(signal_table(network, surrogate), network, surrogate) == generated
