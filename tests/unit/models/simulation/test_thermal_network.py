"""Networks as data: extension, names, groups, and every refusal."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import sympy as sp

from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError
from models.network.compiled import law_source, structure
from models.network.laws import Parameter, symbol
from models.simulation.thermal_network import Link, Node, ThermalNetwork

GEARBOX = load_gearbox("fzg")
NETWORK = GEARBOX.network()


def test_nodes_of_the_rig() -> None:
    assert NETWORK.node_names == (
        "air", "frame", "housing_lower", "housing_upper", "oil", "bearing_1", "bearing_2", "bearing_3", "bearing_4",
        "shaft_1", "shaft_2", "pinion", "wheel", "mesh",
    )  # fmt: skip
    assert len(NETWORK.parts) == 12
    assert NETWORK.groups["housing"] == ("housing_lower", "housing_upper")


def test_capacities_of_the_rig() -> None:
    """Printed by an independent evaluation to 1 J/K; its oil is taken at 80 degC, ours at 60."""
    ones = {symbol(parameter.name): 1.0 for parameter in NETWORK.parameters}
    capacity = {part.name: float(sp.sympify(part.capacity).subs(ones)) for part in NETWORK.parts}
    printed = {"housing_lower": 7057, "housing_upper": 8625, "bearing_1": 349, "shaft_1": 367, "shaft_2": 779,
               "pinion": 184, "wheel": 346}  # fmt: skip
    for node, value in printed.items():
        assert capacity[node] == pytest.approx(value, abs=0.55)
    assert capacity["oil"] == pytest.approx(1568, rel=0.02)


@pytest.mark.parametrize(("changes", "length"), [({}, 0.05), ({"shaft.0.length_in_air_mm": None}, 0.15)])
def test_a_shaft_is_cooled_where_it_stands_out_of_the_box(changes: dict[str, None], length: float) -> None:
    """5 W/(m2 K) at rest; at 1500 1/min Nu = 0.133 Re^(2/3) Pr^(1/3) in air of 20 degC."""
    links = {link.name: link for link in load_gearbox("conveyor").with_values(changes).network().links}
    given = {symbol("T_air"): 20.0, symbol("T_ambient"): 20.0}

    def conductance(speed: float) -> float:
        law = sp.sympify(links["input-air"].conductance)
        return float(law.subs({**given, symbol("speed"): speed}))

    area = np.pi * 0.035 * length
    assert conductance(0.0) == pytest.approx(5.0 * area)
    Re = 1500.0 * np.pi / 30.0 * 0.035**2 / (2.0 * 15.1e-6)
    assert conductance(1500.0) == pytest.approx(
        0.133 * Re ** (2 / 3) * 0.71 ** (1 / 3) * 0.0257 / 0.035 * area, rel=0.02
    )


def test_extending_leaves_the_original_alone() -> None:
    sources, links = len(NETWORK.sources), len(NETWORK.links)
    NETWORK.with_source("oil", 1.0, name="x").with_link("oil", "frame", 1.0).with_node("tank", 100.0)
    assert (len(NETWORK.sources), len(NETWORK.links)) == (sources, links)


def test_groups_share_evenly() -> None:
    network = NETWORK.with_source("housing", 10.0, name="sun").with_link("housing", "frame", lambda s: 3.0)
    assert [(s.name, s.node, s.heat) for s in network.sources[-2:]] == [
        ("sun_housing_lower", "housing_lower", 5.0),
        ("sun_housing_upper", "housing_upper", 5.0),
    ]
    assert [link.conductance for link in network.links[-2:]] == [1.5, 1.5]


def test_new_boundary_by_naming_it() -> None:
    ambient = NETWORK.with_link("oil", "cooler", 5.0)
    assert ambient.nodes[-1] == Node(name="cooler", temperature=symbol("T_ambient"))
    warm = NETWORK.with_link("oil", "cooler", 5.0, temperature=lambda s: 40.0 + 0.01 * s.time)
    assert warm.nodes[-1].temperature == 40.0 + 0.01 * symbol("time")


def test_symbols_serve_for_laws() -> None:
    s = NETWORK.symbols()
    assert NETWORK.with_source("oil", 2.0 * s.T_oil, name="x").sources[-1].heat == 2.0 * symbol("T_oil")


def warm(network: ThermalNetwork, **inputs: float) -> tuple[np.ndarray, np.ndarray]:
    """Oil temperature and total loss at rest in a heavy state."""
    losses = GEARBOX.losses()
    result = network.steady_state(losses=losses, speed=2165.7, torque=94.1, inputs=inputs)
    return result.temperatures["oil"], result.loss


def test_a_factor_on_a_loss_is_one_on_its_heat() -> None:
    network = NETWORK.with_loss_factor("mesh_sliding", lambda s: 0.1 * s.torque / 94.1).with_loss_factor(
        "churning", 1.0
    )
    before = {source.name: source for source in NETWORK.sources}
    at = {symbol("torque"): 94.1}
    for source in network.sources:
        ratio = {"mesh_sliding": 1.1, "churning": 2.0}.get(source.name, 1.0)
        assert float((source.heat / before[source.name].heat).subs(at)) == pytest.approx(ratio)
    twice = NETWORK.with_loss_factor("churning", 1.0).with_loss_factor("churning", 1.0)
    assert twice.sources[2].heat == 4.0 * NETWORK.sources[2].heat


def test_a_factor_on_a_link_is_one_on_its_conductance() -> None:
    network = NETWORK
    for link in NETWORK.links:
        if set(link.nodes) & {"air"}:
            network = network.with_link_factor(link.name, -1.0)
    base = {link.name: link.conductance for link in NETWORK.links}
    for link in network.links:
        assert link.conductance == (0 if "air" in link.nodes else base[link.name])
    half = {link.name: link.conductance for link in NETWORK.with_link_factor("pinion-oil", lambda s: -0.5).links}
    assert (half["pinion-oil"] / base["pinion-oil"]).equals(0.5)


def test_numeric_factors_simulate_as_well() -> None:
    """Two that branch on numbers, on one source: each keeps its own law."""
    plain = NETWORK.with_loss_factor("churning", 0.5).with_loss_factor("churning", 1.0)
    branching = NETWORK.with_loss_factor("churning", lambda s: 0.5 if float(s.T_oil) > -50 else 0.0)
    branching = branching.with_loss_factor("churning", lambda s: 1.0 if float(s.T_oil) > -50 else 0.0)
    assert len(branching.numeric_laws) == 2
    assert warm(branching)[1] == pytest.approx(warm(plain)[1], rel=1e-9)


@pytest.mark.parametrize(
    ("name", "shift"), [("torque", 20.0), ("speed", -500.0), ("T_ambient", 6.0), ("air_speed", -1.0)]
)
def test_a_shifted_input_is_seen_everywhere(name: str, shift: float) -> None:
    """Losses, laws, boundaries and memories, so that nothing differs from giving the shifted input."""
    network = (
        NETWORK.with_state("worn", start=0.0, rate=lambda s: 1e-9 * s.speed * s.torque)
        .with_state("on", start=0.0, update=lambda s: sp.Piecewise((1.0, s.T_oil - s.T_ambient > 25.0), (s.on, True)))
        .with_source("oil", lambda s: 100.0 * s.worn - 20.0 * s.on * s.air_speed, name="extra")
    )
    point = {"speed": 2165.7, "torque": 94.1, "T_ambient": 27.0, "air_speed": 2.0}
    shifted = network.with_signal_shift(name, lambda s: 0.75 * shift).with_signal_shift(name, lambda s: 0.25 * shift)
    cycle = {f"{key}{unit}": [point[key]] * 3 for key, unit in UNITS.items()} | {"time_s": [0.0, 600.0, 1800.0]}
    truth = cycle | {f"{name}{UNITS[name]}": [point[name] + shift] * 3}
    given = shifted.simulate(cycle, losses=GEARBOX.losses(), initial=40.0)
    meant = network.simulate(truth, losses=GEARBOX.losses(), initial=40.0)
    for node in NETWORK.node_names:
        np.testing.assert_allclose(given.temperatures[node], meant.temperatures[node], rtol=1e-9)
    np.testing.assert_allclose(given.loss, meant.loss, rtol=1e-9)
    np.testing.assert_allclose(given.domain_distance, meant.domain_distance)


def test_a_shift_reaches_the_update_for_mean_temperatures() -> None:
    network = NETWORK.with_state("on", start=0.0, update=0.0, averaged_update=symbol("T_ambient") + 1.0)
    assert network.with_signal_shift("T_ambient", 6.0).states[0].averaged_update == symbol("T_ambient") + 7.0


def test_the_domain_is_that_of_what_the_losses_see() -> None:
    class Bounded:
        components, temperature_nodes = NETWORK.components, GEARBOX.losses().temperature_nodes

        def power(self, speed: np.ndarray, torque: np.ndarray, temperatures: np.ndarray) -> np.ndarray:
            return np.zeros((*np.shape(temperatures)[:-1], len(self.components)))

        def domain_distance(self, speed: np.ndarray, torque: np.ndarray, temperatures: np.ndarray) -> np.ndarray:
            return np.asarray(torque) / 100.0

    cycle = {"time_s": [0.0, 60.0], "speed_rpm": [500.0, 500.0], "torque_Nm": [100.0, 100.0]}
    result = NETWORK.with_signal_shift("torque", lambda s: 0.5 * s.torque).simulate(cycle, losses=Bounded())
    assert result.domain_distance.tolist() == [1.5, 1.5]


UNITS = {"speed": "_rpm", "torque": "_Nm", "T_ambient": "_degC", "air_speed": "_m_s"}


def test_a_shift_may_follow_a_boundary_that_follows_the_input() -> None:
    """A probe that the housing warms: the truth is the recorded ambient less a share of the housing's rise above it."""
    network = NETWORK.with_signal_shift("T_ambient", lambda s: -0.1 * (s.T_housing_lower - s.T_air))
    recorded, lower = symbol("T_ambient"), symbol("T_housing_lower")
    assert sp.expand(network.nodes[0].temperature - (recorded - 0.1 * (lower - recorded))) == 0
    assert warm(network)[0] < warm(NETWORK)[0]


EXTENSIONS: list[tuple[Callable[[], object], str]] = [
    (lambda: NETWORK.with_source("oill", 1.0, name="x"), "node 'oill' is unknown; did you mean 'oil'"),
    (lambda: NETWORK.with_source("air", 1.0, name="x"), "node 'air' has a given temperature"),
    (lambda: NETWORK.with_source("oil", 1.0, name="churning"), "has a source 'churning' already"),
    (lambda: NETWORK.with_source("oil", lambda s: s.sped, name="x"), "did you mean 'speed'"),
    (
        lambda: NETWORK.with_source("housing", 1.0, name="x").with_source("housing", 2.0, name="x"),
        "has a source 'x_housing_lower' already",
    ),
    (lambda: NETWORK.with_link("pinionn", "oil", 1.0), "node 'pinionn' is unknown; did you mean 'pinion'"),
    (lambda: NETWORK.with_link("oil", "pinionn", 1.0), "node 'pinionn' is unknown; did you mean 'pinion'"),
    (lambda: NETWORK.with_link("oil", "oil", 1.0), "joins two different nodes"),
    (lambda: NETWORK.with_link("housing", "housing_lower", 1.0), "joins two different nodes"),
    (lambda: NETWORK.with_link("pinion", "oil", 1.0), "has a link 'pinion-oil' already"),
    (lambda: NETWORK.with_link("oil", "frame", 1.0, temperature=3.0), "node 'frame' exists"),
    (lambda: NETWORK.with_link("oil", "frame", lambda s: s.P_churning), "depends on the loss 'P_churning'"),
    (lambda: NETWORK.with_loss_factor("churnin", 1.0), "no source 'churnin'; did you mean 'churning'"),
    (lambda: NETWORK.with_loss_factor("churning", lambda s: s.sped), "did you mean 'speed'"),
    (lambda: NETWORK.with_link_factor("pinion-oill", 1.0), "no link 'pinion-oill'; did you mean 'pinion-oil'"),
    (lambda: NETWORK.with_link_factor("pinion-oil", lambda s: s.P_churning), "depends on the loss 'P_churning'"),
    (lambda: NETWORK.with_signal_shift("torqe", 1.0), "'torqe' is not an input of this network; did you mean 'torque'"),
    (lambda: NETWORK.with_signal_shift("time", 1.0), "'time' is not an input"),
    (lambda: NETWORK.with_signal_shift("torque", lambda s: s.P_churning), "depends on the loss 'P_churning'"),
    (lambda: NETWORK.with_signal_shift("torque", lambda s: float(s.speed)), "only where all laws are expressions"),
    (
        lambda: NETWORK.with_source("oil", lambda s: 1.0 if s.speed > 9 else 0.0, name="x").with_signal_shift(
            "speed", 1.0
        ),
        "only where all laws are expressions",
    ),
    (lambda: NETWORK.with_node("oil", 1.0), "has a node 'oil' already"),
    (lambda: NETWORK.with_node("housing", 1.0), "has a node 'housing' already"),
    (lambda: NETWORK.with_node("ambient", 1.0), "has a signal 'T_ambient' already"),
    (lambda: NETWORK.with_node("big tank", 1.0), "'T_big tank' cannot be a signal"),
    (lambda: NETWORK.with_node("tank", lambda s: float(s.C_oil)), "must be a number or a function of parameters"),
    (lambda: NETWORK.with_node("tank", lambda s: s.T_oil), "'T_oil' is not a signal"),
    (lambda: NETWORK.with_boundary("air", 1.0), "has a node 'air' already"),
    (lambda: NETWORK.with_boundary("sea", lambda s: s.T_oil), "'T_oil' is not a signal"),
    (lambda: NETWORK.with_boundary("sea", lambda s: float(s.time)), "must be an expression"),
    (
        lambda: NETWORK.with_coupled_boundary("oil"),
        "'oil' is not a boundary of this network; known are: air, frame",
    ),
    (
        lambda: load_gearbox("heated_rod").network().with_coupled_boundary("air"),
        "boundary 'air' follows the input 'T_ambient' alone: that couples it",
    ),
    (lambda: NETWORK.with_input("speed", 1.0), "has a signal 'speed' already"),
    (lambda: NETWORK.with_input("lambda", 1.0), "'lambda' cannot be a signal"),
    (lambda: NETWORK.with_parameter(Parameter(name="h_air")), "has a signal 'h_air' already"),
    (lambda: NETWORK.with_state("time", start=0.0), "has a signal 'time' already"),
    (lambda: NETWORK.with_state("on", start=0.0, update=lambda s: 1.0 if s.T_oil > 80 else 0.0), "sympy.Piecewise"),
]


@pytest.mark.parametrize(("extend", "says"), EXTENSIONS)
def test_refusals(extend: Callable[[], object], says: str) -> None:
    with pytest.raises(InputError, match=says):
        extend()


def test_structure_conserves_heat_for_any_conductances() -> None:
    """Every column of a link's matrix between two parts sums to zero: what leaves one enters the other."""
    laplacian, to_boundary, injection = structure(NETWORK)
    for index, link in enumerate(NETWORK.links):
        both = not ({"air", "frame"} & set(link.nodes))
        assert laplacian[index].sum() == (0.0 if both else 1.0)
        assert to_boundary[index].sum() == (0.0 if both else 1.0)
        assert np.array_equal(laplacian[index].T, laplacian[index])
    assert (injection.sum(axis=1) == 1.0).all()


def test_a_capacity_must_not_move() -> None:
    moving = ThermalNetwork(
        nodes=(Node(name="a", capacity=symbol("speed")), Node(name="b", temperature=sp.Float(20.0))),
        links=(Link(name="a-b", nodes=("a", "b"), conductance=sp.Float(1.0)),),
    )
    with pytest.raises(InputError, match="node 'a' needs a heat capacity that depends on parameters only"):
        law_source(moving, vector=False)
