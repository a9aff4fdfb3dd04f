"""Columns of model error against simulations of machines that are changed in that way, each built independently."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

from diagnosis.engine.fit import Experiment
from diagnosis.engine.model_error import ModelError
from diagnosis.engine.model_error.courses import Coordinate
from diagnosis.engine.point import Machine, Point
from diagnosis.engine.prepare import prepare_experiment
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.observation import readings
from diagnosis.forward.recurrence import lagged
from diagnosis.recordings.read import read_recordings
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.types import Array
from models.network.laws import symbol
from models.simulation.thermal_network import ThermalNetwork
from tests.unit.diagnosis.inference_example import recording_of

DATA = Path(__file__).parents[5] / "examples" / "data"
STEP = 0.01
Change = Callable[[ThermalNetwork, float], ThermalNetwork]


class Case:
    """An experiment, its model error and the point without any."""

    def __init__(self, experiment: Experiment) -> None:
        self.experiment = experiment
        self.point = self.simulated(experiment)
        self.error = ModelError.of(experiment)
        self.columns = self.responses(self.point)

    def responses(self, point: Point, first: int = 0, last: int | None = None) -> Array:
        """Change of what is recorded per unit of some unknowns."""
        return self.error.combined_responses(point, np.eye(len(self.error.groups))[:, first:last])

    def simulated(self, experiment: Experiment) -> Point:
        return experiment.point(0, np.zeros(len(experiment.unknowns)), rounds=12)

    def changed(self, change: Change, step: float) -> Array:
        """Readings of the machine with a changed network."""
        machine = self.experiment.machine
        model = NetworkOnGrid(change(machine.model.network, step), machine.model.losses)
        return self.simulated(replace(self.experiment, machine=Machine(model))).read

    def check(self, label: str, difference: Array, step: float) -> None:
        column = self.columns[:, :, self.error.labels.index(label)]
        # Cold parts jump within the first intervals; there a derivative is that of the middle.
        found, expected = column[4:].ravel(), (difference / step)[4:].ravel()
        sizes = np.linalg.norm(found), np.linalg.norm(expected)
        assert sizes[1] > 0.0, label
        assert found @ expected > 0.99 * sizes[0] * sizes[1], (label, found @ expected / sizes[0] / sizes[1])
        assert sizes[0] == pytest.approx(sizes[1], rel=0.05), label

    def check_change(self, label: str, change: Change, step: float = STEP) -> None:
        self.check(label, self.changed(change, step) - self.changed(change, -step), 2.0 * step)


def test_a_simulation_with_model_error_agrees_with_the_columns(case: Case) -> None:
    values = 1e-3 * np.random.default_rng(4).standard_normal((len(case.error.labels), 1))  # small: to first order
    error = case.error.courses(case.point, values).along(np.ones(1))
    point = case.experiment.point(0, np.zeros(len(case.experiment.unknowns)), rounds=12, error=error)
    expected = (case.columns @ values)[:, :, 0]
    largest = float(np.abs(expected).max())
    assert largest > 0.1
    np.testing.assert_allclose(point.read - case.point.read, expected, atol=0.02 * largest)
    there, here = point.residual_without_error, case.point.residual
    np.testing.assert_allclose(there, here, atol=0.02 * largest)


@pytest.fixture(scope="module")
def case(fzg: Gearbox) -> Case:
    """Three hours with a standstill."""
    time = np.arange(0.0, 10_800.0, 10.0)
    speed = np.interp(time, [600, 660, 4000, 4060, 6500, 6510, 7000, 7010], [900, 2600, 2600, 3300, 3300, 0, 0, 1500])
    torque = np.interp(
        time, [2500, 2510, 6000, 6010, 6500, 6510, 7000, 7010], [60.0, 150.0, 150.0, 90.0, 90, 0, 0, 120]
    )
    columns = {"time_s": time, "speed_rpm": speed, "torque_Nm": torque, "T_ambient_degC": np.full(len(time), 22.0)}
    made = fzg.network().simulate(columns, losses=fzg.losses(), initial=30.0).columns()
    nodes = ("oil", "housing_lower", "bearing_1", "pinion")
    noise = np.random.default_rng(0).standard_normal((len(nodes), len(time)))
    channels = {node: made[f"T_{node}_degC"] + 0.1 * e for node, e in zip(nodes, noise, strict=True)}
    recording = recording_of(columns, channels | {"P_loss": made["P_loss_W"]})
    return Case(prepare_experiment(fzg, [recording], [recording])[1])


@pytest.fixture(scope="module")
def rod() -> Case:
    """The first two hours of a real recording."""
    gearbox = load_gearbox("heated_rod")
    train = read_recordings([f"{DATA / 'heated_rod.csv.gz'}@0..7200"], gearbox.network())
    return Case(prepare_experiment(gearbox, train, train)[1])


def standard(one: Coordinate, raw: sp.Expr) -> sp.Expr:
    """A coordinate as a law."""
    value = sp.log(sp.Max(sp.Abs(raw), one.floor)) if one.floor else raw
    return sp.Max(-3.0, sp.Min(3.0, (value - one.mean) / one.sd)) / 1.5


def coordinates(case: Case, *names: str) -> list[sp.Expr]:
    raw = {"speed": symbol("speed"), "torque": symbol("torque"), "temperature": symbol("T_oil")}
    return [standard(case.error.standard.coordinates[name], raw[name]) for name in names]


def test_a_loss_law(case: Case) -> None:
    n, m, T = coordinates(case, "speed", "torque", "temperature")
    law = sp.exp(-(n**2 + m**2 + T**2) / 2) * n**2 / np.sqrt(2.0) * m

    def change(network: ThermalNetwork, step: float) -> ThermalNetwork:
        return network.with_loss_factor("mesh_sliding", lambda _: sp.exp(step * law) - 1)

    case.check_change("a_loss: heat of mesh_sliding, speed^2 torque^1", change)


def test_a_conductance_law(case: Case) -> None:
    (T,) = coordinates(case, "temperature")

    def change(network: ThermalNetwork, step: float) -> ThermalNetwork:
        return network.with_link_factor("housing_lower-air", lambda _: sp.exp(step * T * sp.exp(-(T**2) / 2)) - 1)

    case.check_change("a_link: path housing_lower-air, temperature^1", change)


def test_finer_laws(case: Case) -> None:
    n, T = coordinates(case, "speed", "temperature")
    changes: dict[str, Change] = {
        "law_deg5: heat of churning, speed^3 temperature^1": lambda network, step: network.with_loss_factor(
            "churning", lambda _: step * sp.exp(-(n**2 + T**2) / 2) * n**3 * T / np.sqrt(6.0)
        ),
        "loss_own: heat of bearing_1, own^1 speed^1": lambda network, step: network.with_loss_factor(
            "bearing_1", lambda s: step * n * sp.Max(-3, sp.Min(3, (s.T_bearing_1 - s.T_oil) / 10.0))
        ),
        "hours: path pinion-shaft_1, hours": lambda network, step: network.with_link_factor(
            "pinion-shaft_1", lambda s: step * s.time / 36_000.0
        ),
        "hours: heat of mesh_sliding, after start": lambda network, step: network.with_loss_factor(
            "mesh_sliding", lambda s: step * sp.exp(-s.time / 3600.0)
        ),
    }
    for label, change in changes.items():
        case.check_change(label, change)


def split(network: ThermalNetwork, source: str, target: str, law: sp.Expr | float) -> ThermalNetwork:
    """A share of a heat goes to another part."""
    (heat,) = (s.heat for s in network.sources if s.name == source)
    (is_loss,) = (s.is_loss for s in network.sources if s.name == source)
    network = network.with_loss_factor(source, lambda _: -law)
    return network.with_source(target, lambda _: law * heat, name="elsewhere", is_loss=is_loss)


def test_heat_splits(case: Case) -> None:
    case.check_change(
        "b_split: mesh_sliding to oil, constant", lambda network, step: split(network, "mesh_sliding", "oil", step)
    )


def test_missing_links(case: Case) -> None:
    conductance = case.error.standard.conductance
    for pair in (("pinion", "wheel"), ("oil", "air")):

        def change(network: ThermalNetwork, step: float, pair: tuple[str, str] = pair) -> ThermalNetwork:
            return network.with_link(*pair, lambda _: step * conductance)

        case.check_change(f"e_link: {'-'.join(pair)}, constant", change)


def with_capacity(network: ThermalNetwork, part: str, factor: float) -> ThermalNetwork:
    nodes = (replace(n, capacity=n.capacity * factor) if n.name == part else n for n in network.nodes)
    return replace(network, nodes=tuple(nodes))


def test_capacity(case: Case) -> None:
    case.check_change("g_cap: capacity of housing_lower, constant",
                      lambda network, step: with_capacity(network, "housing_lower", 1.0 + step))  # fmt: skip


def test_slow_core(case: Case) -> None:
    """A further part that is linked with its own only, with a share of its capacity."""
    experiment, part, time, step = case.experiment, "housing_lower", 600.0, 0.02
    network, at = experiment.machine.model.network, experiment.machine.model.parts.index("housing_lower")
    values = {p.name: p.start for p in network.parameters}
    (C,) = (float(n.capacity.xreplace({symbol(k): sp.Float(v) for k, v in values.items()}))
            for n in network.nodes if n.name == part)  # fmt: skip
    with_core = with_capacity(network, part, 1.0 - step).with_node("core", step * C)
    with_core = with_core.with_link(part, "core", lambda _: step * C / time)
    model = NetworkOnGrid(with_core, experiment.machine.model.losses)
    starts = (np.append(experiment.starts[0], experiment.starts[0][at]),)
    read = case.simulated(replace(experiment, machine=Machine(model), starts=starts)).read
    case.check("d_sub: core of housing_lower, 600 s, constant", read - case.point.read, step)


def test_slow_mass(case: Case) -> None:
    """A further part that is linked with one only, by a share of the machine's conductance."""
    experiment, part, time, step = case.experiment, "housing_lower", 9600.0, 0.02
    at, G = experiment.machine.model.parts.index(part), step * case.error.standard.conductance
    with_mass = experiment.machine.model.network.with_node("mass", G * time).with_link(part, "mass", lambda _: G)
    model = NetworkOnGrid(with_mass, experiment.machine.model.losses)
    starts = (np.append(experiment.starts[0], experiment.starts[0][at]),)
    read = case.simulated(replace(experiment, machine=Machine(model), starts=starts)).read
    case.check("mass: mass at housing_lower, 9600 s, constant", read - case.point.read, step)


@pytest.mark.parametrize(("label", "index", "at"), [("offset of torque", 1, 0.01), ("gain of speed", 0, 0.01)])
def test_inputs(case: Case, label: str, index: int, at: float) -> None:
    piece = case.experiment.pieces[0]
    largest = np.abs(piece.samples[..., 1]).max()

    def read(step: float) -> Array:
        samples = np.array(piece.samples)
        if index == 1:
            samples[..., 1] += step * largest * (samples[..., 0] > 33.0)
        else:
            samples[..., 0] *= 1.0 + step
        return case.simulated(replace(case.experiment, pieces=(replace(piece, samples=samples),))).read

    case.check(f"f_input: {label}, constant", read(at) - read(-at), 2.0 * at)


def test_sensors(case: Case) -> None:
    """The course that a sensor follows is mixed before its lag."""
    trajectory, model, sensors = case.point.trajectory, case.experiment.machine.model, case.point.sensors
    at = model.parts.index("bearing_1")
    for neighbour, course in {"shaft_1": trajectory.T[:, model.parts.index("shaft_1")], "air": 22.0}.items():
        mixed = np.array(trajectory.T)
        mixed[:, at] = 0.9 * mixed[:, at] + 0.1 * course
        read = readings(model, replace(trajectory, T=mixed), sensors)
        case.check(f"c_sensor: bearing_1, near {neighbour}", read - case.point.read, 0.1)
    # Two lags in series: the response to a jump is a difference of two exponentials.
    own, late = float(sensors.lag[0]), 600.0
    T = trajectory.T[:, model.part_index(sensors.channels[0])]
    alone, slow = (lagged(T, trajectory.piece.steps, lag) for lag in (own, late))
    expected = (late * slow - own * alone) / (late - own) - alone
    column = case.columns[:, 0, case.error.labels.index(f"c_lag: {sensors.channels[0]}, 600 s late")]
    np.testing.assert_allclose(column, expected, atol=0.01 * np.ptp(expected))
    zero = case.columns[:, :, case.error.labels.index("p_zero: P_loss, zero")]
    expected_zero = np.zeros_like(zero)
    expected_zero[:, sensors.channels.index("P_loss")] = case.error.standard.heat
    np.testing.assert_array_equal(zero, expected_zero)


def test_the_rod(rod: Case) -> None:
    """A machine without speed, torque, losses or oil."""
    T = standard(rod.error.standard.coordinates["temperature"], sum(symbol(f"T_cell_{i}") for i in range(1, 6)) / 5)

    def heater(network: ThermalNetwork, step: float) -> ThermalNetwork:
        for i in range(1, 6):
            network = network.with_loss_factor(f"heater_cell_{i}", lambda _: step * T * sp.exp(-(T**2) / 2))
        return network

    conductance = rod.error.standard.conductance
    changes: dict[str, Change] = {
        "a_loss: heat of heater_gain, temperature^1": heater,
        "hours: path cell_5-cell_6, hours": lambda network, step: network.with_link_factor(
            "cell_5-cell_6", lambda s: step * s.time / 36_000.0
        ),
        "a_link: path cell_5-cell_6, constant": lambda network, step: network.with_link_factor(
            "cell_5-cell_6", lambda _: step
        ),
        "b_split: heater_cell_5 to cell_6, constant": lambda network, step: split(
            network, "heater_cell_5", "cell_6", step
        ),
        "e_link: cell_1-cell_12, constant": lambda network, step: network.with_link(
            "cell_1", "cell_12", lambda _: step * conductance
        ),
        "g_cap: capacity of cell_3, constant": lambda network, step: with_capacity(network, "cell_3", 1.0 + step),
    }
    for label, change in changes.items():
        rod.check_change(label, change)


def test_nothing_is_without_a_number(case: Case, rod: Case) -> None:
    for each in (case, rod):
        assert np.isfinite(each.columns).all()
    standing = case.experiment.pieces[0].inputs[:, 0] == 0.0
    assert standing.any()


def test_parts_of_the_columns(case: Case) -> None:
    """Any range gives what the whole gives, whitened or not, also at the point of a machine with one more part."""
    some = case.responses(case.point, 70, 133)
    np.testing.assert_allclose(some, case.columns[:, :, 70:133], atol=1e-12)
    (part,) = case.experiment.linearise(np.zeros(len(case.experiment.unknowns))).parts
    whitened = part.filter(case.responses(part.point))
    np.testing.assert_allclose(case.error.whitened(part), whitened, atol=1e-9)
    machine = case.experiment.machine
    network = machine.model.network.with_node("tank", 500.0).with_link("tank", "oil", lambda _: 1e-9)
    starts = (np.append(case.experiment.starts[0], 30.0),)
    experiment = replace(case.experiment, machine=Machine(NetworkOnGrid(network, machine.model.losses)), starts=starts)
    extended = case.responses(case.simulated(experiment), 70, 133)
    np.testing.assert_allclose(extended, some, atol=1e-3 * np.abs(some).max())
