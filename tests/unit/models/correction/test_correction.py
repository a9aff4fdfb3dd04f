"""Corrections as files, laws as text, and mechanisms that users bring."""

from __future__ import annotations

from pathlib import Path

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from builder.fmi.signals import signal_table
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.errors import InputError
from models.correction.correction import (
    Correction,
    Estimate,
    Finding,
    MeanLoss,
    correction_text,
    read_correction,
    write_correction,
)
from models.definition.messages import validate_section
from models.files.toml_file import parse
from models.mechanisms import CATALOGUE, Scale, load_mechanisms
from models.mechanisms.user_files import check_placeable
from models.network.expressions import expression_text, parse_expression
from models.network.laws import Parameter, symbol
from models.simulation.thermal_network import ExtraState
from models.terms.term import Term

RIG = load_gearbox("fzg")
NETWORK = RIG.network()
SCALE = Scale.of(RIG, speed=2600.0, torque=94.0)


def finding(name: str, strength: float) -> Finding:
    term = CATALOGUE[name].placed(NETWORK, SCALE)[0]
    estimates = {p.name: (p.start, 0.1) for p in term.parameters} | {term.strength.name: (strength, 0.5)}
    return Finding.of(
        term, estimates, mechanism=name, family=term.family, place=term.place, says=term.says, probability=0.9
    )


CORRECTION = Correction.of(
    RIG,
    findings=(
        finding("windage", 9.5),
        finding("cooler_thermostat", 6.25),
        finding("torque_gain", 0.02),
        finding("oil_ageing", 0.3),
    ),
    calibration=(Estimate(name="h_air", value=0.9312345678901234, stderr=0.04, prior=1.0),),
    recordings={'first "cold"\n.csv': "0" * 64},
    version="0.1.0",
)
# As version 0.1.0 wrote it, before laws had one schema.
OLD = f"""
schema = 1
version = "0.1.0"

[gearbox]
name = "{RIG.name}"
sha256 = "{RIG.hash}"

[[recording]]
name = "first \\U0000000a.csv"
sha256 = "{"0" * 64}"

[[calibrated]]
name = "h_air"
value = 0.9312345678901234
stderr = 0.04
unit = "1"
prior = 1.0

[[finding]]
mechanism = "windage"
family = "losses"
place = "oil"
says = "The shafts stir air."
probability = 0.9
label = "windage_oil"
kind = "source"
target = ["oil"]
law = "windage_oil_strength*windage_oil_held*(Abs(speed)/2600)**2.9"
is_loss = true
of_measurement = false

[[finding.parameter]]
name = "windage_oil_strength"
value = 9.5
stderr = 0.5
unit = "W"
lower = 0.0
upper = 100.0
description = "size"

[[finding.state]]
name = "windage_oil_held"
start = 1.0
rate = "-windage_oil_held/3600"
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "correction.toml"
    write_correction(CORRECTION, path)
    return path


def test_the_file_holds_everything(file: Path) -> None:
    read = read_correction(file, RIG)
    assert read == CORRECTION
    assert correction_text(read) == file.read_text(encoding="utf-8")


NUMBER = st.floats(allow_nan=False, allow_infinity=False)
TEXTS = st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1)  # control characters are refused


@settings(deadline=None)
@given(value=NUMBER, stderr=st.floats(0.0, allow_infinity=False), prior=st.none() | NUMBER, name=TEXTS, says=TEXTS)
def test_any_text_and_number_survives_the_file(
    value: float, stderr: float, prior: float | None, name: str, says: str
) -> None:
    made = Correction.of(
        RIG,
        findings=[CORRECTION.findings[0].model_copy(update={"says": says})],
        calibration=[Estimate(name="mesh", value=value, stderr=stderr, unit=says, prior=prior)],
        recordings={name: "f" * 64},
    )
    assert validate_section(Correction, parse(correction_text(made), file="x"), file="x") == made


def test_files_of_version_0_1_0_are_read(tmp_path: Path) -> None:
    path = tmp_path / "old.toml"
    path.write_text(OLD, encoding="utf-8")
    read = read_correction(path, RIG)
    assert read.calibration == CORRECTION.calibration
    term = read.findings[0].term
    assert (term.strength.start, term.strength.sd, term.strength.upper, term.is_loss) == (9.5, 0.5, 100.0, True)
    assert term.states[0].rate == -symbol("windage_oil_held") / 3600


def test_corrected_network(file: Path) -> None:
    network = read_correction(file, RIG).network(RIG)
    parameters = {p.name: p for p in network.parameters}
    assert parameters["h_air"].start == 0.9312345678901234
    assert parameters["h_oil_gear"] == next(p for p in NETWORK.parameters if p.name == "h_oil_gear")
    assert parameters["windage_oil_strength"].start == 9.5
    assert network.sources[-1].name == "windage_oil" and network.sources[-1].is_loss
    assert network.links[-1].nodes == ("oil", "cooler_thermostat_oil_coolant")
    assert [state.name for state in network.states] == ["cooler_thermostat_oil_valve", "cooler_thermostat_oil_opening"]


def test_a_twin_gets_true_torque_and_a_recording_the_recorded_one(file: Path) -> None:
    read = read_correction(file, RIG)
    assert read.network(RIG).operating == {}
    seen = read.apply(RIG.network(), as_recorded=True).operating["torque"]
    assert seen.subs({symbol("torque"): 100.0, symbol("torque_gain_torque_strength"): 0.02}) == pytest.approx(102.0)


def test_another_definition_is_refused(file: Path) -> None:
    other = RIG.with_values({"oil.volume_l": 1.0})
    with pytest.raises(InputError, match="made for .*use the definition it was made for, or diagnose again"):
        read_correction(file, RIG).network(other)
    with pytest.raises(InputError, match=r"correction\.toml: the correction was made for"):
        read_correction(file, other)


def test_estimates_must_be_complete() -> None:
    term = CATALOGUE["windage"].placed(NETWORK, SCALE)[0]
    with pytest.raises(InputError, match="no value was given for windage_oil_exponent"):
        Finding.of(term, {"windage_oil_strength": (1.0, 0.1)}, mechanism="windage")


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("schema = 1", "schema = 2", "schema is 2; this program reads corrections of schema 1"),
        ("schema = 1", "", "schema is None"),
        ("schema = 1", "schema = [", "is not valid TOML"),
        ('kind = "source"', 'kind = "sauce"', "finding 'windage_oil'.kind: 'sauce' is not one of .*'source'"),
        (
            'mechanism = "windage"',
            'mechanisme = "windage"',
            "'mechanisme' is not a known key; did you mean 'mechanism'",
        ),
        ("value = 9.5", 'value = "9.5"', "'windage_oil'.parameter 'windage_oil_strength'.value: must be a number"),
        ("value = 9.5", "value = 1e9", "windage_oil_strength': value = 1e.* is outside the limits 0 to"),
        ("value = 9.5", "value = nan", "must be finite"),
        ("stderr = 0.5", "stderr = -0.5", "windage_oil_strength'.stderr"),
        ("Abs(speed)", "Abs(sped)", "finding 'windage_oil': the law .* uses 'sped', .* did you mean 'speed'"),
        ("Abs(speed)", "open('x')", "finding 'windage_oil'.law: not allowed here: .*open.*; functions are Abs"),
        ("Abs(speed)", "speed.real", "finding 'windage_oil'.law: not allowed here: 'speed.real'"),
        ("weights = [", "weights = [\n    1.0,", "'oil_ageing_losses': 9 weights for 8 targets of a loss_factor"),
        ('kind = "source"', 'kind = "source"\nweights = [1.0]', "'windage_oil': 1 weights for 1 targets of a source"),
        ('target = [\n    "oil",\n]', "target = []", "finding 'windage_oil'.target: has no entries"),
        ('target = [\n    "oil",\n]', 'target = ["oill"]', "'oill' is unknown; did you mean 'oil'"),
        ('sha256 = "0000', 'sha256 = "zz00', "sha256"),
        ('name = "h_air"', 'name = "h_aer"', "calibrates 'h_aer', not of this network; did you mean 'h_air'"),
        ("value = 0.93", "value = 111.93", "calibrates 'h_air' to 111.931; 0.05 to 20 is possible"),
    ],
)
def test_faults_of_the_file(file: Path, old: str, new: str, says: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=says) as caught:
        read_correction(file, RIG)
    assert all(line.startswith(f"{file}: ") for line in str(caught.value).splitlines())


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.toml: cannot be read"):
        read_correction(tmp_path / "none.toml", RIG)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"c\.toml: cannot be written"):
        write_correction(CORRECTION, tmp_path / "file" / "c.toml")


def calibrated(**values: float) -> Correction:
    return Correction.of(
        RIG, calibration=[Estimate(name=name, value=value, stderr=0.1) for name, value in values.items()]
    )


@pytest.mark.parametrize(
    ("value", "possible"), [(0.0499, False), (0.05, True), (20.0 * (1.0 + 1e-12), True), (20.01, False)]
)
def test_a_fit_may_end_at_its_bounds_and_not_beyond(value: float, possible: bool) -> None:
    if possible:
        assert {p.name: p.start for p in calibrated(mesh=value).apply(NETWORK).parameters}["mesh"] == value
    else:
        with pytest.raises(InputError, match="0.05 to 20 is possible"):
            calibrated(mesh=value).apply(NETWORK)


def test_the_limits_are_those_of_the_fmu() -> None:
    """A value beyond them would silently widen the FMU's limits."""
    table = signal_table(NETWORK)
    for p in NETWORK.parameters:
        signal = table[f"factor.{p.name}"]
        assert (signal.minimum, signal.maximum) == (p.lower, p.upper)


def test_the_limits_go_with_the_definition() -> None:
    """A factor that starts at 3 may end at 60, as the fit of a diagnosis may."""
    other = RIG.with_values({"factors.churning": 3.0})
    assert calibrated(churning=45.0).apply(other.network())
    with pytest.raises(InputError, match="0.15 to 60 is possible"):
        calibrated(churning=61.0).apply(other.network())


def test_an_open_form_is_a_finding_like_any_other(tmp_path: Path) -> None:
    """A term that no catalogue knows, with a memory and a boundary."""
    a, held = symbol("found_a"), symbol("found_held")
    term = Term(
        label="found",
        kind="link",
        target=("wheel", "found_sink"),
        expression=a * held * sp.Piecewise((1, symbol("T_wheel") > 40), (sp.Rational(1, 3), True)),
        parameters=(Parameter(name="found_a", unit="W/K", start=0.0, lower=-5.0, upper=5.0, log=False),),
        states=(ExtraState(name="found_held", start=1.0, rate=-held / 3600, update=None),),
        boundary_temperature=symbol("T_ambient") + 5,
    )
    found = Finding.of(term, {"found_a": (1.5, 0.2)}, mechanism="open form")
    path = tmp_path / "c.toml"
    write_correction(Correction.of(RIG, findings=[found]), path)
    network = read_correction(path, RIG).network(RIG)
    assert network.links[-1].conductance == term.expression
    assert network.nodes[-1].temperature == term.boundary_temperature
    assert network.states[-1].rate == -held / 3600


# ---------------------------------------------------------------------- laws as text

SPEED, TORQUE = symbol("speed"), symbol("torque")
NONZERO = st.floats(-1e12, 1e12).filter(lambda x: abs(x) > 1e-12)
LAWS = st.recursive(
    st.sampled_from([SPEED, TORQUE, sp.pi, sp.Rational(2, 3)])
    | NONZERO.map(sp.Float)
    | st.integers(1, 9).map(sp.Integer),
    lambda law: st.one_of(
        st.tuples(law, law).map(lambda ab: ab[0] + ab[1]),
        st.tuples(law, law).map(lambda ab: ab[0] * ab[1]),
        st.tuples(law, law).map(lambda ab: sp.Max(*ab)),
        law.map(lambda a: sp.Piecewise((a, (SPEED > 3) & ~(TORQUE <= 0.1)), (sp.tanh(SPEED), True))),
        law.map(lambda a: sp.exp(-sp.Abs(TORQUE)) * a / sp.sqrt(SPEED**2 + 1) ** 2.9),
    ),
    max_leaves=6,
)


@settings(deadline=None, max_examples=60)
@given(LAWS)
def test_text_of_a_law_gives_the_same_law(law: sp.Expr) -> None:
    text = expression_text(law)
    read_once = expression_text(parse_expression(text))  # sympy multiplies 2*(a + b) out
    assert expression_text(parse_expression(read_once)) == read_once
    at = {SPEED: sp.Float(2.5), TORQUE: sp.Float(0.7)}
    read, written = (complex(expression.xreplace(at).evalf()) for expression in (parse_expression(text), law))
    assert read == pytest.approx(written, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("9**9**9**9", "cannot be used|not a finite"),
        ("1/0", "not a finite"),
        ("log(-1)", "not a finite"),
        ("(" * 3000, "is not an expression"),
        ("", "is not an expression"),
        ("speed; torque", "is not an expression"),
        ("().__class__.__bases__", "not allowed here"),
        ("[speed for speed in (1,)]", "not allowed here"),
        ("lambda: speed", "not allowed here"),
        ("speed^2", r"not allowed here: 'speed \^ 2'; a power is written \*\*"),
        ("'text'", "not allowed here: \"'text'\""),
        ("1j", "not allowed here"),
        ("speed // 2", "not allowed here: 'speed // 2'"),
        ("exp(x=1)", "not allowed here"),
        ("exp(1, 2)", "cannot be used"),
        ("speed > 1", "is a condition, not a number"),
        ("speed + (torque > 1)", "cannot be used"),
        ("Max(speed > 1, 2)", "cannot be used"),
        ("speed == 1", "compare with <"),
        ("Piecewise((1, speed))", "takes pairs"),
        ("Piecewise(speed)", "takes pairs"),
    ],
)
def test_texts_that_are_no_law_are_refused(text: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        parse_expression(text)


# ---------------------------------------------------------------------- mechanisms of users

OWN = """
schema = 1

[[mechanism]]
name = "belt_guard"
kind = "source"
places = ["oil", "each bearings"]
law = "strength * n**exponent * exp(-worn)"
says = "The belt guard hums ({place})."
reference = "own idea"
experiment = "take it off"
is_loss = true

[[mechanism.parameter]]
name = "strength"
unit = "W"
sd = 20.0

[[mechanism.parameter]]
name = "exponent"
start = 2.0
sd = 0.5
grid = [1.5, 2.5]

[[mechanism.state]]
name = "worn"
rate = "n / duration_ref"
"""
AGAIN = OWN.replace("schema = 1", "")


def test_a_mechanism_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(OWN, encoding="utf-8")
    (mechanism,) = load_mechanisms(path)
    places = mechanism.placed(NETWORK, SCALE)
    assert [term.label for term in places] == ["belt_guard_oil", *(f"belt_guard_bearing_{i}" for i in range(1, 5))]
    term = places[0]
    assert term.says == "The belt guard hums (oil)."
    assert term.parameters == (
        Parameter(name="belt_guard_oil_strength", unit="W", start=0.0, lower=0.0, upper=2000.0, sd=20.0, log=False),
        Parameter(
            name="belt_guard_oil_exponent", start=2.0, lower=-48.0, upper=52.0, sd=0.5, log=False, grid=(1.5, 2.5)
        ),
    )
    heat = term.apply(NETWORK).sources[-1].heat
    values = {"speed": 2600.0, "belt_guard_oil_strength": 3.0, "belt_guard_oil_exponent": 2.0, "belt_guard_oil_worn": 0}
    assert float(heat.subs({symbol(k): v for k, v in values.items()})) == pytest.approx(3.0)


def test_a_mechanism_from_python(tmp_path: Path) -> None:
    path = tmp_path / "own.py"
    path.write_text("from models.mechanisms import CATALOGUE\nMECHANISMS = [CATALOGUE['windage']]\n", encoding="utf-8")
    assert load_mechanisms(path) == (CATALOGUE["windage"],)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("schema = 1", "schema = 3", "schema is 3; this program reads mechanisms of schema 1"),
        ('kind = "source"', 'kind = "spring"', "mechanism 'belt_guard'.kind: 'spring' is not one of its values"),
        ('name = "strength"', 'name = "size"', "the first parameter is 'size'; it must be 'strength'|start is missing"),
        ("start = 2.0", "", "mechanism 'belt_guard'.parameter 'exponent': start is missing"),
        ("sd = 20.0", "sd = 20.0\nstart = 1.0", "parameter 'strength': a strength starts at 0"),
        ("grid = [1.5, 2.5]", "grid = [1.5, 99.0]", "parameter 'exponent': grid has 99, outside the limits -48 to 52"),
        ("grid = [1.5, 2.5]", "upper = 1.0", "start has 2, outside the limits -48 to 1"),
        ("grid = [1.5, 2.5]", "sweep = [3.0, 1.0]", r"sweep = \[3, 1\] does not rise within the limits"),
        ("grid = [1.5, 2.5]", "sweep = [1.0]", "mechanism 'belt_guard'.parameter 'exponent'.sweep #2 is missing"),
        ("start = 2.0", "start = -2.0\nlog = true", "a log-normal parameter is positive"),
        ("exp(-worn)", "exec(worn)", "mechanism 'belt_guard'.law: not allowed here: 'exec"),
        ("exp(-worn)", "exp(-worn", "mechanism 'belt_guard'.law: .* is not an expression"),
        ("schema = 1", f"schema = 1\n{AGAIN}", "'belt_guard' is there 2 times"),
        ("strength * n**exponent", "20 * n**exponent", "its law must contain 'strength'"),
        ("strength * n**exponent", "(strength + 5) * n", r"With strength = 0 it gives 5\*n"),
        ("strength * n**exponent", "n / strength", "With strength = 0 it has no finite slope"),
        ("strength * n**exponent", "strength**2 * n", "and its slope is 0"),
        ('places = ["oil", "each bearings"]', 'places = ["oill"]', "no place in this gearbox.*'oill'.*oil"),
        ("({place})", "({ort})", "'belt_guard' fails with KeyError: 'ort'"),
        ("n**exponent", "sped**exponent", "'belt_guard' uses 'sped'.*did you mean 'speed'"),
        ('"exponent"', '"speed"', "'speed' is a signal; name the parameter differently"),
    ],
)
def test_faults_of_a_file_of_mechanisms(tmp_path: Path, fzg: Gearbox, old: str, new: str, says: str) -> None:
    path = tmp_path / "own.toml"
    assert old in OWN
    path.write_text(OWN.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=f"own.toml: .*{says}"):
        check_placeable(load_mechanisms(path), fzg, path)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "cannot be read as a Python file"),
        ("1/0", "fails with ZeroDivisionError"),
        ("x = 1", "needs a list MECHANISMS"),
        ("MECHANISMS = [1]", "needs a list"),
        ("MECHANISMS = []", "needs a list MECHANISMS .*at least one"),
        (
            "from dataclasses import replace\nfrom models.mechanisms import CATALOGUE\n"
            "MECHANISMS = [replace(CATALOGUE['windage'], name='mine', parameters=lambda scale: 1 / 0)]\n",
            "mechanism 'mine' fails with ZeroDivisionError",
        ),
    ],
)
def test_faults_of_a_python_file(tmp_path: Path, fzg: Gearbox, content: str | None, says: str) -> None:
    path = tmp_path / "own.py"
    if content is not None:
        path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=f"own.py: .*{says}"):
        check_placeable(load_mechanisms(path), fzg, path)


def test_an_fmu_does_not_claim_what_is_wrong_with_the_recorder() -> None:
    assert "windage at oil" in CORRECTION.words
    faults = tuple(one.model_copy(update={"of_measurement": True}) for one in CORRECTION.findings)
    at_fault = CORRECTION.model_copy(update={"findings": faults})
    assert at_fault.words.startswith("corrected by calibration (")


@pytest.mark.parametrize(("model_W", "is_warned"), [(1785.0, True), (255.0, False), (257.0, True), (183.0, True)])
def test_a_model_whose_losses_are_not_those_estimated_says_so(tmp_path: Path, model_W: float, is_warned: bool) -> None:
    loss = MeanLoss(estimate_W=220.0, stderr_W=18.0, predicting_W=model_W, delivered_W=216.0)
    write_correction(CORRECTION.model_copy(update={"mean_loss": loss}), tmp_path / "far.toml")
    read = read_correction(tmp_path / "far.toml", RIG)
    assert read.mean_loss == loss and read.of_machine().mean_loss is None
    warning = f"; take no losses from it: {model_W:.0f} W on average, where 220 ± 18 W were estimated)"
    assert read.words.endswith(warning) is is_warned
    assert bool(loss.warning) is is_warned
