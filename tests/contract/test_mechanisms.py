"""ONE suite over every mechanism of the catalogue and every open form, at its places in two gearboxes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from math import prod
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from fmpy.validation import validate_fmu

from builder.drive.driver import drive_fmu
from builder.surrogate.train import TrainingResult
from models.assembly.gearbox import load_gearbox
from models.base.types import Array
from models.correction.correction import Correction, Finding, parse_correction, write_correction
from models.files.cycle import Cycle
from models.mechanisms import CATALOGUE, Mechanism, Placed, Scale
from models.network.compiled import law_source
from models.network.laws import compile_function, function_source, symbol
from models.simulation.result import Result
from models.simulation.thermal_network import ThermalNetwork

MOST_STARTS = 24  # combinations of shape parameters that a search can afford per place
DURATION = 7200.0
GEARBOXES = {name: load_gearbox(name) for name in ("fzg", "conveyor")}


def with_circulation(network: ThermalNetwork) -> ThermalNetwork:
    """Neither circulates its oil, or knows the air outdoors; some mechanisms sit there."""
    larger = network.with_node("oil_inlet", 400.0).with_link("oil", "oil_inlet", 8.0).with_input("T_outdoor", 5.0)
    return replace(larger, groups={**network.groups, "returns": ("oil_inlet",)})


NETWORKS = {name: with_circulation(gearbox.network()) for name, gearbox in GEARBOXES.items()}
SCALES = {
    "fzg": Scale.of(GEARBOXES["fzg"], speed=2600.0, torque=94.0, duration=DURATION),
    "conveyor": Scale.of(GEARBOXES["conveyor"], duration=DURATION),
}


@dataclass(frozen=True)
class PlainLosses:
    """Losses of a simple form: the suite is about what mechanisms do to a network, whatever its losses."""

    components: tuple[str, ...]
    temperature_nodes: tuple[str, ...]
    speed: float
    torque: float
    total: float

    def power(self, speed: Array, torque: Array, temperatures: Array) -> Array:
        n, m = np.abs(speed) / self.speed, np.abs(torque) / self.torque
        total = self.total * n * (0.5 + 0.5 * m) * np.exp(-0.003 * (temperatures[..., 0] - 60.0))
        shares = np.full(len(self.components), 0.5 / (len(self.components) - 1))
        shares[self.components.index("mesh_sliding")] = 0.5
        return np.asarray(total[..., None] * shares)

    def domain_distance(self, speed: Array, torque: Array, temperatures: Array) -> Array:
        return np.zeros(np.broadcast_shapes(np.shape(speed), np.shape(temperatures)[:-1]))


@cache
def losses(gearbox: str) -> PlainLosses:
    full, scale = GEARBOXES[gearbox].losses(), SCALES[gearbox]
    return PlainLosses(full.components, full.temperature_nodes, scale.speed, scale.torque, 1.6 * scale.loss)


@cache
def cycle(gearbox: str) -> Cycle:
    """Cold standstill, speeds from creep to twice the reference, torques, and a hot standstill."""
    scale = SCALES[gearbox]
    time = np.linspace(0.0, DURATION, 61)
    speed = scale.speed * np.interp(time / DURATION, [0, 0.15, 0.16, 0.3, 0.31, 0.6, 0.61, 0.8, 0.81, 1],
                                    [0, 0, 0.4, 0.5, 1.6, 2.0, 1.0, 1.0, 0, 0])  # fmt: skip
    torque = scale.torque * np.interp(time / DURATION, [0, 0.1, 0.2, 0.5, 0.7, 1], [0, 0.1, 1.5, 0.3, 2.0, 0.2])
    ambient = scale.ambient + 2.0 * np.sin(time / 1500.0)
    return Cycle(time, {"speed": speed, "torque": torque, "T_ambient": ambient})


def simulate(gearbox: str, network: ThermalNetwork, parameters: Mapping[str, Array] | None = None) -> Result:
    start = SCALES[gearbox].ambient
    # Where the gearbox stops, the solver is off by up to 0.1 K in the mesh.
    fine = cycle(gearbox).refined(30.0)
    return network.simulate(fine, losses=losses(gearbox), initial=start, parameters=parameters)


def parts(network: ThermalNetwork, result: Result) -> Array:
    return np.stack([result.temperatures[part.name] for part in network.parts])


@cache
def placed(name: str, gearbox: str = "fzg") -> tuple[Placed, ...]:
    found = CATALOGUE[name].placed(NETWORKS[gearbox], SCALES[gearbox])
    return found if name in CATALOGUE else (found[0], found[-1])  # forms have a place in every part


def usual(term: Placed) -> dict[str, float]:
    """The term at the size that it typically has, and the first shape of its grid, or the middle one of its sweep.

    Of forms the last one: what fades at once is gone before anything is warm.
    """
    first = 0 if term.name in CATALOGUE else -1
    strength = term.strength
    size = min(strength.sd, strength.upper) if term.sign >= 0 else max(-strength.sd, strength.lower)
    shapes = {
        p.name: prod(p.sweep) ** 0.5 if p.sweep else p.grid[first] if p.grid else p.start for p in term.parameters
    }
    return shapes | {strength.name: size}


@cache
def nominal(gearbox: str) -> Array:
    return parts(NETWORKS[gearbox], simulate(gearbox, NETWORKS[gearbox]))


@cache
def last_place(name: str) -> Result:
    """The rig with the mechanism at the last of its places."""
    term = placed(name)[-1]
    return simulate("fzg", term.apply(NETWORKS["fzg"], usual(term), as_recorded=True))


def brings_heat(mechanism: Mechanism) -> bool:
    return mechanism.kind != "sensor"


EVERY = pytest.mark.parametrize("name", CATALOGUE)
PHYSICAL = pytest.mark.parametrize("name", [n for n, mechanism in CATALOGUE.items() if brings_heat(mechanism)])


@EVERY
class TestDeclaration:
    def test_says_what_it_is(self, name: str) -> None:
        mechanism = CATALOGUE[name]
        assert mechanism.name == name
        assert mechanism.says.endswith(".") and mechanism.reference and mechanism.experiment and mechanism.family
        assert set(mechanism.separate_by) <= set(CATALOGUE) - {name}
        several = len(placed(name)) > 1
        assert ("{place}" in mechanism.says) or not several or len({p.target[-1] for p in placed(name)}) > 1

    def test_has_a_place_in_both_gearboxes(self, name: str) -> None:
        for gearbox in GEARBOXES:
            found = placed(name, gearbox)
            assert found
            assert len({term.label for term in found}) == len(found)

    def test_parameters_are_sound(self, name: str) -> None:
        for term in placed(name):
            assert term.parameters[0].name == f"{term.label}_strength"
            for p in term.parameters:
                assert p.lower <= p.start <= p.upper and p.sd > 0.0
                assert all(p.lower <= value <= p.upper for value in p.grid)
                assert p.start > 0.0 or not p.log
            strength = term.strength
            assert strength.start == 0.0 and not strength.log and not strength.grid
            assert (strength.lower < 0.0) == (term.sign <= 0) and (strength.upper > 0.0) == (term.sign >= 0)
            assert prod(len(p.grid) or 1 for p in term.parameters[1:]) <= MOST_STARTS

    def test_law_is_linear_in_the_strength_and_nothing_else_feels_it(self, name: str) -> None:
        for term in placed(name):
            strength = symbol(term.strength.name)
            # By substitution: a derivative of Piecewise would hide a constant in one case.
            at = [term.expression.subs(strength, value) for value in (0, 1, 3)]
            assert at[0] == 0 and at[1] != 0
            assert sp.expand(at[2] - 3 * at[1]).is_zero or sp.simplify(at[2] - 3 * at[1]).is_zero
            for key, law in term.laws.items():
                assert key == "law" or strength not in law.free_symbols

    def test_equation_reads_well(self, name: str) -> None:
        for term in placed(name):
            for equation in (term.equation(), term.equation(usual(term)), super(Placed, term).equation()):
                assert equation.count("{") == equation.count("}") and " = " in equation
                assert term.label.replace("_", r"\_") + r"\_" not in equation
            assert "strength" in term.equation() and "strength" not in term.equation(usual(term))
            assert "{" not in term.says


def samples(count: int = 300) -> tuple[dict[str, Array], ThermalNetwork]:
    """Signals of all kinds of operation, standstill, reversal, deep cold and great heat among them."""
    network, rng = NETWORKS["fzg"], np.random.default_rng(0)
    values = {name: rng.uniform(-30.0, 200.0, count) for name in network.signals if name.startswith("T_")}
    values |= {name: rng.uniform(0.0, 500.0, count) for name in network.signals if name.startswith("P_")}
    values |= {p.name: np.full(count, p.start) for p in network.parameters}
    values |= {
        "time": rng.uniform(0.0, 1e6, count),
        "speed": rng.uniform(-6500.0, 6500.0, count) * (rng.random(count) > 0.2),
        "torque": rng.uniform(-350.0, 350.0, count) * (rng.random(count) > 0.2),
        "air_speed": rng.uniform(0.0, 10.0, count),
    }
    return values, network


@EVERY
def test_finite_and_alike_for_arrays_and_numbers(name: str) -> None:
    values, _ = samples()
    rng = np.random.default_rng(1)
    for term in placed(name):
        own = {p.name: np.full(300, v) for p, v in zip(term.parameters, usual(term).values(), strict=True)}
        own |= {s.name: rng.choice([0.0, 0.3, 1.0, 50.0], 300) for s in term.states}
        everything = values | own
        arguments, laws = list(everything), list(term.laws.values())
        vector = compile_function(function_source("law", arguments, laws, vector=True), "law")
        scalar = compile_function(function_source("law", arguments, laws, vector=False), "law")
        with np.errstate(all="raise", under="ignore"):
            arrays = np.stack([np.broadcast_to(value, (300,)) for value in vector(*everything.values())], axis=-1)
        rows = zip(*(column.tolist() for column in everything.values()), strict=True)
        assert np.isfinite(arrays).all()
        np.testing.assert_allclose(arrays, [scalar(*row) for row in rows], rtol=1e-12, atol=1e-300)


@PHYSICAL
class TestInANetwork:
    @pytest.mark.parametrize("gearbox", GEARBOXES)
    def test_every_parameter_moves_something_and_without_strength_nothing_moves(self, name: str, gearbox: str) -> None:
        term = placed(name, gearbox)[0]
        base = NETWORKS[gearbox]
        network = term.apply(base, as_recorded=True)
        assert network is not base
        variants = [usual(term), usual(term) | {term.strength.name: 0.0}]
        for p in term.parameters:
            for step in (p.sd, -p.sd):  # a switch acts at the end of a step, so that small changes may do nothing
                moved = variants[0][p.name] * np.exp(step) if p.log else variants[0][p.name] + step
                variants.append(variants[0] | {p.name: min(max(moved, p.lower), p.upper)})
        columns = {p.name: np.array([variant[p.name] for variant in variants]) for p in term.parameters}
        T = parts(network, simulate(gearbox, network, columns))
        assert np.isfinite(T).all()
        for index, p in enumerate(term.parameters):
            assert np.max(np.abs(T[:, 2 * index + 2 : 2 * index + 4] - T[:, :1])) > 1e-3, p.name
        assert np.max(np.abs(T[:, 1] - T[:, 0])) > 0.01
        # Other variants take part in the choice of the step.
        assert np.max(np.abs(T[: len(base.parts), 1] - nominal(gearbox))) < 0.2

    def test_only_a_loss_counts_as_loss(self, name: str) -> None:
        term = placed(name)[0]
        if term.kind not in ("source", "link"):
            return
        network = term.apply(NETWORKS["fzg"], usual(term))
        new = [source for source in network.sources if source.name.startswith(term.label)]
        assert len(new) == (len(term.target) if term.kind == "source" else 0)
        assert all(source.is_loss == CATALOGUE[name].is_loss for source in new)

    def test_a_group_shares_what_one_place_has(self, name: str) -> None:
        term = placed(name)[-1]
        network = term.apply(NETWORKS["fzg"], usual(term))
        if term.kind == "source":
            added = sum(source.heat for source in network.sources[len(NETWORKS["fzg"].sources) :])
            assert sp.simplify(added - term.expression) == 0
        elif term.kind == "link":
            added = sum(link.conductance for link in network.links[len(NETWORKS["fzg"].links) :])
            assert sp.simplify(added - term.expression) == 0

    def test_heat_is_conserved(self, name: str) -> None:
        result = last_place(name)
        balance = result.heat_in - result.heat_out - result.heat_stored
        assert np.max(np.abs(balance)) < 1e-6 * np.max(np.abs(result.heat_in))

    def test_can_be_exported(self, name: str) -> None:
        """The laws of an FMU are these functions on plain numbers; none may stand for something untraced."""
        for term in placed(name):
            network = term.apply(NETWORKS["fzg"], usual(term), as_recorded=True)
            assert not network.numeric_laws
            for function, source in law_source(network, vector=False).items():
                assert compile_function(source, function)

    def test_survives_the_file(self, name: str, tmp_path: Path) -> None:
        base, gearbox = NETWORKS["fzg"], GEARBOXES["fzg"]
        term = placed(name)[-1]
        estimates = {key: (value, 0.1 * abs(value)) for key, value in usual(term).items()}
        finding = Finding.of(term, estimates, mechanism=name, place=term.place, says=term.says)
        correction = Correction.of(gearbox, findings=(finding,))
        write_correction(correction, tmp_path / "correction.toml")
        read = parse_correction(tmp_path / "correction.toml")  # the network is that of the test, with more inputs
        again = simulate("fzg", read.apply(base, as_recorded=True))
        np.testing.assert_allclose(parts(base, again), parts(base, last_place(name)), rtol=0.0, atol=1e-6)
        assert {p.name: (p.start, p.sd) for p in read.findings[0].term.parameters} == estimates


def test_the_foundation_is_a_mass_between_two_conductances() -> None:
    feet, air, capacity = sp.symbols("feet air capacity", positive=True)
    here, ambient = symbol("T_housing_lower"), symbol("T_ambient")
    term = next(one for one in placed("foundation_conduction") if one.place == "housing_lower")
    numbers = {"strength": feet * air / (feet + air), "feet": feet / air, "lag": capacity / (feet + air)}
    given = {symbol(f"{term.label}_{name}"): value for name, value in numbers.items()}
    (frame,) = term.states
    rise = symbol(frame.name)
    flow = feet * (here - ambient - rise)
    assert sp.simplify(term.expression.xreplace(given) + flow) == 0
    assert sp.simplify(frame.rate.xreplace(given) - (flow - air * rise) / capacity) == 0


@pytest.mark.parametrize("name", ["oil_tank", "motor_flange", "foundation_conduction"])
def test_what_stands_still_as_cold_as_the_air_stays_so(name: str) -> None:
    """A machine is defined at 20 degC and started at -30: tank, motor, bed are as cold as the air, too."""
    scale, term = SCALES["conveyor"], placed(name, "conveyor")[0]
    at_rest = Cycle(
        np.array([0.0, 3600.0]), {"speed": np.zeros(2), "torque": np.zeros(2), "T_ambient": np.full(2, -30.0)}
    )
    network = term.apply(NETWORKS["conveyor"], usual(term), as_recorded=True)
    result = network.simulate(at_rest, losses=losses("conveyor"), initial=-30.0)
    assert scale.ambient == 20.0
    np.testing.assert_allclose(parts(network, result), -30.0, atol=1e-6)


@PHYSICAL
def test_a_fault_of_an_instrument_is_none_of_the_gearbox(name: str) -> None:
    for term in placed(name):
        network = NETWORKS["fzg"]
        assert (term.apply(network) is network) == CATALOGUE[name].of_measurement


def test_all_at_once_in_an_fmu(build_fmu: Callable[..., Path], fzg_training: TrainingResult, tmp_path: Path) -> None:
    """Every law, memory, boundary and shifted input inside one FMU does what it does in the network."""
    network = NETWORKS["fzg"]
    for name in CATALOGUE:
        if brings_heat(CATALOGUE[name]):
            network = placed(name)[0].apply(network, usual(placed(name)[0]), as_recorded=True)
    path = build_fmu(tmp_path / "all.fmu", network)
    assert validate_fmu(str(path)) == []
    short = cycle("fzg")
    moving = Cycle(np.linspace(0.0, 600.0, 61), {k: v[20] + 0.0 * v for k, v in short.inputs.items()})
    expected = network.simulate(moving, losses=fzg_training.losses, initial=60.0)
    driven = drive_fmu(path, moving, initial=60.0)
    for part in network.parts:
        np.testing.assert_allclose(driven[f"T_{part.name}_degC"], expected.temperatures[part.name], atol=1e-6)
    np.testing.assert_allclose(driven["P_loss_W"], expected.loss, rtol=1e-6)


@pytest.mark.parametrize("name", [n for n, m in CATALOGUE.items() if not brings_heat(m)])
def test_a_fault_of_a_sensor_leaves_the_network_alone(name: str) -> None:
    network = NETWORKS["fzg"]
    for term in placed(name):
        assert term.apply(network, as_recorded=True) is network
        assert term.form is not None and term.of_measurement


def test_channels_limit_the_faults_of_sensors() -> None:
    network, scale = NETWORKS["fzg"], SCALES["fzg"]
    channels = ("oil", "pinion", "P_loss")

    def targets(name: str) -> list[tuple[str, ...]]:
        return [term.target for term in CATALOGUE[name].placed(network, scale, channels)]

    assert targets("sensor_bias") == [("oil",), ("pinion",)]
    assert targets("sensor_stuck") == [("oil",), ("pinion",), ("P_loss",)]
    assert targets("swapped_channels") == [("oil", "pinion")]
    assert targets("clock_offset") == [("oil", "pinion"), channels]  # the loss may be on the clock of the inputs


def test_no_place_in_a_network_without_the_part() -> None:
    network = NETWORKS["fzg"]
    bare = replace(network, sources=tuple(s for s in network.sources if not s.name.startswith("seal")))
    assert placed("run_in_seals") and not CATALOGUE["run_in_seals"].placed(bare, SCALES["fzg"])


def test_heaters_and_coolers_of_hot_oil_are_both_looked_for() -> None:
    """Else the one with the same two thresholds takes the place of the other."""
    grids = {}
    for name in ("heater_thermostat", "cooler_thermostat"):
        (term,) = placed(name)
        (set_point,) = (p for p in term.parameters if p.name.endswith("set_point"))
        grids[name] = [(T - term.scale.ambient) / (term.scale.temperature - term.scale.ambient) for T in set_point.grid]
    heater, cooler = grids.values()
    assert min(heater) < 0.15 and max(heater) == pytest.approx(1.0) and max(cooler) >= 1.0
    assert max(np.diff(sorted(heater))) < 0.21


def test_fans_follow_the_speed() -> None:
    """On the shaft by the power law, by a switch within a tenth of its speed; backwards as forwards, none at rest."""
    reference = SCALES["fzg"].speed
    speed = reference * np.array([0.0, 0.54, 0.66, 1.0, -1.0, 2.0])
    expected = {
        "fan_on_shaft": pytest.approx(np.abs(speed / reference) ** 0.7),
        "fan_speed_switch": pytest.approx([0.0, 0.0, 1.0, 1.0, 1.0, 1.0], abs=0.1),
    }
    for name, shares in expected.items():
        (term,) = placed(name)
        values = {symbol(p.name): p.start for p in term.parameters} | {symbol(term.strength.name): 1.0}
        law = term.expression.subs(values)
        assert [float(law.subs(symbol("speed"), value)) for value in speed] == shares


def test_a_catalogue_to_choose_from() -> None:
    assert len(CATALOGUE) >= 32
    assert all(mechanism.placed(NETWORKS["fzg"], SCALES["fzg"]) for mechanism in CATALOGUE.values())
