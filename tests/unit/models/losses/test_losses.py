"""The loss model: names, order, floors, nodes that are read, errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from builder.surrogate.networks import PRESETS
from builder.surrogate.train import train_surrogate
from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError
from models.losses.loss_model import BATCH, LOSS_KINDS
from models.losses.loss_term import LossKind, LossTerm, TermInput

GEARBOX = load_gearbox("fzg")
LOSSES = GEARBOX.losses()
T = dict.fromkeys(LOSSES.temperature_nodes, 60.0)


def test_names_and_order() -> None:
    bearings = tuple(f"bearing_{i}" for i in (1, 2, 3, 4))
    assert LOSSES.components == ("mesh_sliding", "mesh_rolling", "churning", "seal_1", "seal_2", *bearings)
    assert LOSSES.temperature_nodes == ("oil", "pinion", "wheel", *bearings)


READS = {
    "mesh_sliding": {"pinion", "wheel"},
    "mesh_rolling": {"pinion", "wheel"},
    "churning": {"oil"},
    "seal_1": {"oil"},
    "seal_2": {"oil"},
    **{f"bearing_{i}": {"oil", f"bearing_{i}"} for i in (1, 2, 3, 4)},
}


@pytest.mark.parametrize("node", LOSSES.temperature_nodes)
def test_each_loss_reads_its_own_nodes(node: str) -> None:
    gearbox = GEARBOX.with_values({"stage.0.churning.model": "changenet_velex"})
    losses = gearbox.losses()
    before = losses.breakdown(speed=2000.0, torque=100.0, temperatures=T)
    after = losses.breakdown(speed=2000.0, torque=100.0, temperatures={**T, node: 75.0})
    assert dict(zip(losses.components, losses.reads, strict=True)) == READS
    moved = {name for name in losses.components if before[name] != after[name]}
    assert moved == {name for name, nodes in READS.items() if node in nodes}


def test_bearings_run_at_the_speed_of_their_shafts() -> None:
    loss = LOSSES.breakdown(speed=1500.0, torque=0.0, temperatures=60.0)
    slower = LOSSES.breakdown(speed=1000.0, torque=0.0, temperatures=60.0)
    assert loss["bearing_1"] == loss["bearing_2"]
    assert loss["bearing_3"] == pytest.approx(slower["bearing_1"], rel=1e-12)


def test_bearing_load_is_half_the_tooth_force() -> None:
    load = LOSSES.term("bearing_1").inputs[1]
    assert (load.name, load.source, load.factor * 302.0) == ("radial_load_N", "torque", pytest.approx(4463.0, abs=1.0))


def test_a_term_alone_gives_its_components_of_the_whole() -> None:
    rng = np.random.default_rng(3)
    n, torque, temperatures = rng.uniform(-6500, 6500, 50), rng.uniform(-350, 350, 50), rng.uniform(-20, 200, (50, 7))
    n[:5], torque[:5] = rng.uniform(-1.0, 1.0, (2, 5))  # below the floors
    whole = LOSSES.power(n, torque, temperatures)
    by_node = dict(zip(LOSSES.temperature_nodes, temperatures.T, strict=True))
    apart = [term.power(n, torque, {node: by_node[node] for node in term.reads}) for term in LOSSES.terms]
    assert np.concatenate(apart, axis=1) == pytest.approx(whole, rel=1e-12)


def test_a_loss_of_a_new_kind_needs_its_kind_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """A pump: factor, heat in the network, surrogate and FMU signals follow from its loss kind."""

    class Pump:
        def power(self, x: np.ndarray) -> np.ndarray:
            return 0.02 * x[:, :1] * (1.0 + 0.001 * x[:, 1:])

    def pump_terms(gearbox):
        inputs = (TermInput("speed_rpm", "speed"), TermInput("T_oil_degC", "oil"))
        yield LossTerm(kind=PUMP, name="pump", components=("pump",), node="oil", inputs=inputs, law=Pump())

    PUMP = LossKind(
        name="pump", components=("pump",), factors={"pump": "loss of the pump"}, network="no_load",
        powers=((1.0, 0.0),), law_error={"speed": 0.1}, terms=pump_terms,
    )  # fmt: skip
    monkeypatch.setattr("models.losses.loss_model.LOSS_KINDS", (*LOSS_KINDS, PUMP))
    model = GEARBOX.losses()
    assert model.components == (*LOSSES.components, "pump")
    assert model.breakdown(speed=1000.0, torque=0.0, temperatures=50.0)["pump"] == pytest.approx(21.0)
    (heat,) = [source for source in GEARBOX.network().sources if source.name == "pump"]
    assert (heat.node, {s.name for s in heat.heat.free_symbols}) == ("oil", {"pump", "P_pump"})
    preset = replace(PRESETS["default"], samples=200, judged=100, max_iter=30, starts=1)
    trained = train_surrogate(GEARBOX, preset=preset)
    assert trained.report[-1].component == "pump" and trained.report[-1].median < 0.05


def test_floors_are_linear() -> None:
    full = LOSSES.breakdown(speed=1.0, torque=1.0, temperatures=60.0)
    half_speed = LOSSES.breakdown(speed=0.5, torque=1.0, temperatures=60.0)
    half_torque = LOSSES.breakdown(speed=1.0, torque=0.5, temperatures=60.0)
    for name in LOSSES.components:
        assert half_speed[name] == pytest.approx(0.5 * full[name], rel=1e-12)
    assert half_torque["mesh_sliding"] == pytest.approx(0.5 * full["mesh_sliding"], rel=1e-12)
    assert half_torque["mesh_rolling"] == pytest.approx(full["mesh_rolling"], rel=1e-12)


def test_many_points_are_the_same_in_parts() -> None:
    n = np.linspace(0.0, 6000.0, BATCH + 7)
    temperatures = np.full((len(n), 7), 50.0)
    whole = LOSSES.power(n, 50.0, temperatures)
    assert whole[-20:] == pytest.approx(LOSSES.power(n[-20:], 50.0, temperatures[-20:]), rel=1e-12)


def test_no_points() -> None:
    assert LOSSES.power(np.zeros(0), np.zeros(0), np.zeros((0, 7))).shape == (0, 9)


def test_breakdown_total() -> None:
    loss = LOSSES.breakdown(speed=[1000.0, 2000.0], torque=50.0, temperatures=T)
    assert loss["total"] == pytest.approx(sum(loss[name] for name in LOSSES.components))


@pytest.mark.parametrize(
    ("speed", "torque", "temperature", "message"),
    [
        (np.nan, 1.0, 60.0, "speed is nan 1/min at operating point 0"),
        (1.0, np.inf, 60.0, "torque is inf N m at operating point 0"),
        (1.0, 1.0, np.nan, "T_oil is nan degC at operating point 0"),
        (1.0, 1.0, -300.0, "T_oil is -300.0 degC at operating point 0; finite numbers above -273.15"),
    ],
)
def test_unphysical_input_is_refused(speed: float, torque: float, temperature: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        LOSSES.power(speed, torque, np.full(7, temperature))


def test_wrong_temperatures_by_name() -> None:
    with pytest.raises(InputError, match="'wheeel' is not a temperature of the loss model; did you mean 'wheel'"):
        LOSSES.breakdown(speed=1.0, torque=1.0, temperatures={**T, "wheeel": 60.0})
    with pytest.raises(InputError, match="the temperatures of oil, wheel are missing"):
        LOSSES.breakdown(speed=1.0, torque=1.0, temperatures={k: v for k, v in T.items() if k not in ("oil", "wheel")})
