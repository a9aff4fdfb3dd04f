from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import sympy as sp

from diagnosis.forward import trajectory
from diagnosis.forward.free_running import free_running
from diagnosis.forward.grid import Piece, pieces
from diagnosis.forward.network_on_grid import NetworkOnGrid
from diagnosis.forward.trajectory import simulate
from diagnosis.recordings.read import read_recordings
from models.assembly.gearbox import known_gearboxes, load_gearbox, read_gearbox
from models.assembly.parametric import ParametricLosses
from models.base.errors import InputError
from models.files.toml_file import packaged, read_text
from models.mechanisms import CATALOGUE, Scale
from models.mechanisms.forms import two_point
from models.network.laws import symbol
from models.simulation.thermal_network import ThermalNetwork
from tests.unit.diagnosis.inference_example import named_values

TEXT = read_text(packaged("gearboxes", "la_haute_borne"))
REFERENCE = {"speed": 1800.0, "torque": 10900.0}


@pytest.fixture(scope="module")
def gearbox():
    return load_gearbox("la_haute_borne")


# ---------------------------------------------------------------------- the definition


def test_it_is_one_of_the_gearboxes_and_knows_what_it_lacks(gearbox):
    assert "la_haute_borne" in known_gearboxes()
    assert gearbox.is_parametric and not load_gearbox("fzg").is_parametric
    for ask in (lambda: gearbox.stage, gearbox.lubricant, gearbox.losses, lambda: gearbox.speed_ratio):
        with pytest.raises(InputError, match="without geometry"):
            ask()


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ('between = ["oil", "casing"]', 'between = ["oil", "casin"]', r"no part or boundary 'casin'.*casing"),
        ('between = ["casing", "air"]', 'between = ["outdoor", "air"]', "joins two boundaries"),
        ('between = ["casing", "outdoor"]', 'between = ["air", "casing"]', "joined already"),
        ('between = ["casing", "outdoor"]', 'between = ["casing", "casing"]', "with itself"),
        ('part = "bearing_1"', 'part = "bearing_9"', "no part 'bearing_9'"),
        ('name = "bearing_2"\nheat', 'name = "bearing_1"\nheat', "given 2 times"),
        ('name = "gears"', 'name = "T"', "loss: the name 'T' is that of temperatures; choose another"),
        ('input = "T_ambient"', 'input = "T_nacelle"', "none has input = 'T_ambient'"),
        ("speed_exponent = { value = 1.8", "speed_exponent = { value = 18.0", "speed_exponent"),
        ("no_load_W = { value = 8000.0", "no_loads_W = { value = 8000.0", "'no_loads_W' is not a known key"),
    ],
)
def test_faults_of_a_definition_are_named(old, new, fault):
    assert old in TEXT
    with pytest.raises(InputError, match=fault):
        read_gearbox(TEXT.replace(old, new), file="mine.toml")


def test_a_part_of_a_loss_that_is_zero_is_none(gearbox):
    """Neither a component nor a parameter; a loss without any part is refused."""
    only = gearbox.with_values({"loss.0.no_load_W": 0.0})
    gone = {"gears_no_load", "gears_speed_exponent", "gears_viscosity_exponent"}
    assert {p.name for p in gearbox.network().parameters} - {p.name for p in only.network().parameters} == gone
    point = {"speed": 1500.0, "torque": 5000.0, "temperatures": 60.0}
    before, after = gearbox.losses_at(**point), only.losses_at(**point)
    assert "gears_no_load" in before and "gears_no_load" not in after
    assert after["total"] == pytest.approx(before["total"] - before["gears_no_load"], rel=1e-12)
    with pytest.raises(InputError, match="no_load_W and load_W of 'gears' are both 0"):
        only.with_values({"loss.0.load_W": 0.0})


def test_changed_values_are_checked_as_the_file_is(gearbox):
    changed = gearbox.with_values({"loss.0.load_W": 10000.0})
    assert changed.definition.loss[0].load_W == 10000.0
    with pytest.raises(InputError, match="no part"):
        gearbox.with_values({"loss.0.part": "crankcase"})


# ---------------------------------------------------------------------- losses and network


def test_losses_are_what_the_definition_states_at_the_reference(gearbox):
    losses = gearbox.loss_laws()
    assert isinstance(losses, ParametricLosses)
    T = np.full(len(losses.temperature_nodes), 60.0)
    at = dict(zip(losses.components, losses.power(1800.0, 10900.0, T), strict=True))
    assert at["gears_no_load"] == pytest.approx(8000.0) and at["gears_load"] == pytest.approx(20000.0)
    half = dict(zip(losses.components, losses.power(-900.0, 5450.0, T), strict=True))
    assert half["gears_no_load"] == pytest.approx(8000.0 * 0.5**1.8)
    assert half["gears_load"] == pytest.approx(20000.0 * 0.25)
    assert not losses.power(0.0, 5000.0, T).any()  # nothing turns, nothing is lost
    cold = losses.power(1800.0, 10900.0, T - 40.0)
    assert cold[0] > 1.3 * at["gears_no_load"] and cold[1] == at["gears_load"]


def test_operating_points_that_no_machine_has_are_refused(gearbox):
    """As with geometry."""
    at = {"speed": 1500.0, "torque": 5000.0, "temperatures": 60.0}
    for name, value in (("speed", np.nan), ("torque", np.inf), ("temperatures", -300.0)):
        with pytest.raises(InputError, match="is possible"):
            gearbox.losses_at(**at | {name: value})
    with pytest.raises(InputError, match="numbers of values differ: speed 2, torque 3"):
        gearbox.losses_at(speed=[1.0, 2.0], torque=[1.0, 2.0, 3.0], temperatures=60.0)


def test_each_loss_reads_the_part_that_it_warms():
    gearbox = load_gearbox("la_haute_borne").with_values({"loss.0.part": "bearing_1"})
    losses = gearbox.loss_laws()
    reads = dict(zip(losses.components, losses.reads, strict=True))
    assert reads["gears_no_load"] == {"bearing_1"} and set(losses.temperature_nodes) == frozenset().union(*losses.reads)
    T = np.full(len(losses.temperature_nodes), 60.0)
    warmer = T + 10.0 * (np.array(losses.temperature_nodes) == "bearing_1")
    changed = losses.power(1500.0, 9000.0, warmer) != losses.power(1500.0, 9000.0, T)
    assert changed[losses.components.index("gears_no_load")]
    assert all("bearing_1" in reads[name] for name, it in zip(losses.components, changed, strict=True) if it)


def test_losses_take_arrays_of_any_shape(gearbox):
    losses = gearbox.loss_laws()
    speed, torque = np.linspace(0.0, 1800.0, 12).reshape(3, 4), np.linspace(0.0, 9000.0, 4)
    T = np.full((3, 4, len(losses.temperature_nodes)), 55.0)
    power = losses.power(speed, torque, T)
    assert power.shape == (3, 4, len(losses.components))
    one = losses.power(speed[1, 2], torque[2], T[1, 2])
    np.testing.assert_allclose(power[1, 2], one)
    assert losses.domain_distance(speed, torque, T).shape == (3, 4)


def test_every_uncertain_number_is_a_parameter_and_no_other(gearbox, tmp_path):
    network = gearbox.network()
    names = {p.name for p in network.parameters}
    assert len(names) == len(gearbox.priors)
    assert {"C_oil", "G_oil_casing", "standstill_oil_casing", "gears_no_load", "gears_speed_exponent"} <= names
    stated = '{ value = 4.0e4, sd = "100 %"'
    assert "C_oil_inlet" in names and TEXT.count(stated) == 1
    held = tmp_path / "held.toml"
    held.write_text(TEXT.replace(stated, "{ value = 4.0e4"), encoding="utf-8")
    assert names - {p.name for p in load_gearbox(held).network().parameters} == {"C_oil_inlet"}  # without an sd
    assert network.groups["bearings"] == ("bearing_1", "bearing_2")


def test_the_network_rests_where_its_losses_and_conductances_put_it(gearbox):
    network = gearbox.network()
    rest = network.steady_state(losses=gearbox.loss_laws(), **REFERENCE)
    T = rest.temperatures
    out = 0.0
    for link in network.links:
        if {"air", "outdoor"} & set(link.nodes):
            inner, outer = sorted(link.nodes, key=lambda node: node in ("air", "outdoor"))
            start = {symbol(p.name): p.start for p in network.parameters} | {symbol("speed"): 1800.0}
            out += float(link.conductance.xreplace(start)) * (T[inner] - {"air": 20.0, "outdoor": 10.0}[outer])
    assert out == pytest.approx(rest.loss, rel=1e-6)


def test_all_sizes_times_one_factor_change_no_temperature(gearbox):
    network, losses = gearbox.network(), gearbox.loss_laws()
    sizes = {p.name: 3.0 for p in network.parameters if re.match(r"C_|G_|.*load$", p.name)}
    # The returning oil's capacity is held; it follows within a minute.
    steady = np.ones(67)
    cycle = {"time_s": 600.0 * np.arange(67), "speed_rpm": 1500.0 * steady, "torque_Nm": 4000.0 * steady}
    one = network.simulate(cycle, losses=losses, initial=30.0).columns()
    three = network.simulate(cycle, losses=losses, initial=30.0, parameters=sizes).columns()
    for node in ("oil", "casing", "bearing_1"):
        np.testing.assert_allclose(three[f"T_{node}_degC"], one[f"T_{node}_degC"], atol=0.6)
    assert three["P_loss_W"][-1] == pytest.approx(3.0 * one["P_loss_W"][-1], rel=0.01)


# ---------------------------------------------------------------------- what the catalogue does with it


def test_a_loss_without_a_number_to_calibrate_is_its_own_law():
    """No standard deviation: the source is the loss as assumed, without a factor."""
    plain = re.sub(r"load_W = \{ value = ([0-9.e+]+)[^}]*\}", r"load_W = \1", TEXT)
    plain = re.sub(r"torque_exponent = \{ value = ([0-9.]+)[^}]*\}", r"torque_exponent = \1", plain)
    assert plain != TEXT
    gearbox = read_gearbox(plain, file="plain.toml")
    exponents = Scale.of(gearbox).viscosity_exponents
    assert all(np.isfinite(value) for value in exponents.values()) and exponents


def test_mechanisms_have_places_where_their_parts_are(gearbox):
    scale = Scale.of(gearbox)
    placed = {name: m.placed(gearbox.network(), scale) for name, m in CATALOGUE.items()}
    assert [p.place for p in placed["cooler_air_thermostat"]] == ["returns_air", "returns_outdoor", "oil_outdoor"]
    assert placed["cooler_air_thermostat"][0].target == ("oil_inlet", "air")
    assert placed["windage"] != () and placed["bearing_preload"] == ()  # there are no shafts
    assert [p.place for p in placed["air_cooling_change"]] == ["housing_air"]  # a group of one node is that node
    rig = load_gearbox("fzg")
    every = [p.place for p in CATALOGUE["air_cooling_change"].placed(rig.network(), Scale.of(rig))]
    assert every == ["housing_air", "housing_lower_air", "housing_upper_air"]
    for name in ("cooler_air_thermostat", "cooler_air_proportional", "bearing_fed_by_return", "pump_fast_stage"):
        assert CATALOGUE[name].placed(rig.network(), Scale.of(rig)) == ()


# ---------------------------------------------------------------------- recordings with the definition's columns


def _scada(path: Path, **changes: object) -> Path:
    rows = 60
    time = pd.date_range("2017-09-01", periods=rows, freq="10min", tz="UTC").strftime("%Y-%m-%dT%H:%M:%SZ")
    table = pd.DataFrame(
        {
            "time_utc": time, "Ds_avg": 1500.0, "Cm_avg": 4000.0, "Yt_avg": 25.0, "Ot_avg": 12.0,
            "Gost_avg": np.linspace(50.0, 55.0, rows), "Git_avg": 50.0, "Gb1t_avg": 60.0, "Gb2t_avg": 61.0,
            "P_avg": 600.0,
        }
    )  # fmt: skip
    for name, values in changes.items():
        table[name] = values
    table = table.drop(columns=[name for name, values in changes.items() if values is None])
    table.to_csv(path, index=False)
    return path


def test_columns_of_the_farm_need_no_mapping_file(gearbox, tmp_path):
    (recording,) = read_recordings([_scada(tmp_path / "R1.csv")], gearbox.network())
    assert {c.name for c in recording.channels} == {"oil", "oil_inlet", "bearing_1", "bearing_2"}
    assert recording.inputs["T_ambient"][0] == 25.0 and recording.inputs["T_outdoor"][0] == 12.0


def test_a_driver_that_was_not_recorded_is_assumed_and_noted(gearbox, tmp_path):
    (recording,) = read_recordings([_scada(tmp_path / "R1.csv", Yt_avg=None)], gearbox.network())
    assert recording.inputs["T_ambient"][0] == 20.0
    assert any("T_ambient_degC was not recorded; 20 is assumed" in note for note in recording.notes)


def test_a_mapping_file_beside_the_recording_comes_first(gearbox, tmp_path):
    file = _scada(tmp_path / "R1.csv")
    (tmp_path / "R1.toml").write_text(
        'schema = 1\ntime = { column = "time_utc", unit = "iso8601" }\n[columns.Ds_avg]\nquantity = "speed"\n'
        '[columns.Cm_avg]\nquantity = "torque"\n[columns.Git_avg]\nquantity = "T_oil"\n'
    )
    (recording,) = read_recordings([file], gearbox.network())
    assert [c.name for c in recording.channels] == ["oil"]
    assert recording.channels[0].values[-1] == 50.0


def test_rows_minutes_apart_guide_the_memories_by_sharpened_means(gearbox, tmp_path):
    # A triangle of period four rows whose corners lie at the edges of rows: means hide half of a row's slope.
    means = 50.0 + np.tile([1.0, 1.0, -1.0, -1.0], 15)
    (recording,) = read_recordings([_scada(tmp_path / "R1.csv", Gost_avg=means)], gearbox.network())
    (piece,) = pieces([recording], ("speed", "torque", "T_ambient", "T_outdoor"), ("oil",))
    assert piece.guided and piece.slow
    seen = piece.guide(("oil", "casing"))
    np.testing.assert_allclose(seen[1:-1, 0], 50.0 + 2.0 * np.sign(means[1:-1] - 50.0))
    assert np.isnan(seen[:, 1]).all()  # what is not measured stays as simulated


# ---------------------------------------------------------------------- switches over weeks


def _thermostat() -> ThermalNetwork:
    gearbox = load_gearbox("la_haute_borne")
    cooler = CATALOGUE["cooler_air_thermostat"].placed(gearbox.network(), Scale.of(gearbox))[0]
    return cooler.with_values(
        {
            "cooler_air_thermostat_returns_air_strength": 1500.0,
            "cooler_air_thermostat_returns_air_set_point": 57.5,
            "cooler_air_thermostat_returns_air_band": 4.5,
        }
    ).apply(gearbox.network())


def _steady_day() -> Piece:
    """Ten-minute rows of one operating point, nothing measured."""
    time = np.arange(0.0, 86400.0, 600.0)
    inputs = np.array(np.broadcast_to([1500.0, 4000.0, 25.0, 12.0], (len(time) - 1, 5, 4)))
    nothing = np.empty((len(time), 0))
    return Piece(recording="", time=time, samples=inputs, channels=(), measured=nothing, counts=nothing, slow=True)


def test_a_thermostat_runs_free_as_the_solver_has_it():
    gearbox, network = load_gearbox("la_haute_borne"), _thermostat()
    model = NetworkOnGrid(network, gearbox.loss_laws())
    found = free_running(model, replace(_steady_day(), guided=True), model.start, np.full(model.n, 50.0))
    oil = found.T[:, model.parts.index("oil")]
    fine = {
        "time_s": np.arange(0.0, 86400.0, 60.0), "speed_rpm": np.full(1440, 1500.0), "torque_Nm": np.full(1440, 4000.0),
        "T_ambient_degC": np.full(1440, 25.0), "T_outdoor": np.full(1440, 12.0),
    }  # fmt: skip
    truth = network.simulate(fine, losses=gearbox.loss_laws(), initial=50.0).columns()["T_oil_degC"]
    late = slice(60, None)
    assert 54.0 < oil[late].min() < 56.5 and 58.5 < oil[late].max() < 61.0

    def switchings(T: np.ndarray) -> int:
        return int(np.sum(np.diff(np.sign(T - T.mean())) != 0))

    assert switchings(oil[late]) >= 4
    # Its intervals are a minute long here, and the cycle lasts half an hour.
    assert switchings(oil[late]) == pytest.approx(switchings(truth[600:]), rel=0.15)
    assert oil[late].mean() == pytest.approx(truth[600:].mean(), abs=0.5)


def test_losses_linearised_in_the_cold_do_not_stay_so_when_it_runs():
    """Thick oil at the start: a few rounds leave a bearing many kelvin too cold for weeks."""
    gearbox, network = load_gearbox("la_haute_borne"), _thermostat()
    model = NetworkOnGrid(network, gearbox.loss_laws())
    piece = _steady_day()
    steep = {"bearing_1_viscosity_exponent": 1.0}
    from_cold = free_running(model, piece, named_values(network, steep), np.full(model.n, 5.0))
    count = len(piece.time)
    fine = {
        "time_s": piece.time, "speed_rpm": np.full(count, 1500.0), "torque_Nm": np.full(count, 4000.0),
        "T_ambient_degC": np.full(count, 25.0), "T_outdoor": np.full(count, 12.0),
    }  # fmt: skip
    truth = network.simulate(fine, losses=gearbox.loss_laws(), initial=5.0, parameters=steep).columns()
    late = slice(60, None)
    found = from_cold.T[late, model.parts.index("bearing_1")]
    assert found.mean() == pytest.approx(truth["T_bearing_1_degC"][late].mean(), abs=0.3)


def test_a_switching_that_no_row_shows_does_not_send_learning_astray(monkeypatch):
    """Means that never fall to where the cooler switches off: followed blindly, it would cool for hours."""
    gearbox, network = load_gearbox("la_haute_borne"), _thermostat()
    model = NetworkOnGrid(network, gearbox.loss_laws())
    piece = _steady_day()
    start = np.full(model.n, 50.0)
    truth = free_running(model, piece, model.start, start).T[:, [model.parts.index("oil")]]
    hidden = np.where(piece.time[:, None] > 30000.0, np.maximum(truth, 57.5), truth)
    learnt = replace(piece, channels=("oil",), measured=hidden, counts=np.ones_like(hidden), guided=True)

    def farthest() -> float:
        T = simulate(model, learnt, model.start, start)
        return float(np.abs(T.T[:, model.parts.index("oil")] - truth[:, 0]).max())

    near = farthest()
    monkeypatch.setattr(trajectory, "ASTRAY_K", 1e6)
    assert near < 12.0 < 15.0 < farthest()


@pytest.mark.parametrize(("above", "cold", "hot"), [(1.0, 0.0, 1.0), (0.0, 1.0, 0.0)])
def test_coolers_and_heaters_switch_the_other_way_round_also_in_means(above, cold, hot):
    memory = two_point("valve", above=above)
    for law in (memory.update, memory.averaged_update):
        for T, was, then in ((40.0, 0.0, cold), (40.0, 1.0, cold), (70.0, 0.0, hot), (70.0, 1.0, hot),
                             (55.0, 0.0, 0.0), (55.0, 1.0, 1.0)):  # fmt: skip
            signals = SimpleNamespace(T_oil=sp.Float(T), valve=sp.Float(was), set_point=55.0, band=6.0)
            assert float(law(signals)) == pytest.approx(then, abs=1e-6)


# ---------------------------------------------------------------------- places of mechanisms


def places(text, name):
    gearbox = read_gearbox(text, file="mine.toml")
    found = CATALOGUE[name].placed(gearbox.network(), Scale.of(gearbox))
    return {term.place: term.target for term in found}


def test_losses_are_what_their_part_and_name_tell():
    """Gears churn without load and slide by it; all of a bearing is one place; seals go by their name."""
    assert places(TEXT, "oil_level_thermal") == {"churning": ("gears_no_load",)}
    assert places(TEXT, "gear_wear") == {"mesh_sliding": ("gears_load",)}
    bearings = tuple(f"bearing_{i}_{kind}" for i in (1, 2) for kind in ("no_load", "load"))
    assert places(TEXT, "bearing_additive") == {"bearing": bearings}
    assert places(TEXT, "misalignment") == {
        "mesh_sliding": ("gears_load",), "bearing_1": bearings[:2], "bearing_2": bearings[2:],
    }  # fmt: skip
    assert places(TEXT, "run_in_seals") == {}
    seal = '[[loss]]\nname = "seals"\npart = "casing"\nno_load_W = 300.0\nload_W = 0.0\n'
    assert places(TEXT + seal, "run_in_seals") == {"seal": ("seals_no_load",)}
    assert places(TEXT + seal, "oil_level_thermal") == {"churning": ("gears_no_load",)}
    pump = seal.replace('"seals"', '"pump"').replace("no_load_W", 'kind = "other"\nno_load_W')
    assert places(TEXT + pump, "oil_level_thermal") == {"churning": ("gears_no_load",)}


def test_gears_are_taken_for_the_shafts_where_these_are_no_part():
    assert places(TEXT, "bearing_preload") == places(TEXT, "brake_drag") == {}
    part = '[[part]]\nname = "gears"\nheat_capacity_J_K = 1e5\n[[link]]\nbetween = ["gears", "bearing_1"]\n'
    text = TEXT + part + "conductance_W_K = 50.0\n"
    assert places(text, "brake_drag") == {"gears": ("gears",)}
    assert set(places(text, "bearing_preload")) == {"bearing", "bearing_1", "bearing_2"}
    both = text + part[part.index("[[link]]") :].replace("bearing_1", "bearing_2") + "conductance_W_K = 50.0\n"
    assert set(places(both, "bearing_preload")) == {"bearing", "bearing_1", "bearing_2"}
    shaft = part.replace('"gears"', '"rotor"').replace("1e5", '1e5\ngroup = "shafts"')
    assert places(text + shaft + "conductance_W_K = 5.0\n", "brake_drag") == {"rotor": ("rotor",)}
