"""Corrections as files, laws as text, and mechanisms that users bring."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import sympy as sp

from models.correction import Correction, Estimate, Finding, correction_text, read_correction, write_correction
from models.errors import InputError
from models.expressions import LONGEST, expression_text, parse_expression
from models.gearbox import Gearbox, load_gearbox
from models.laws import Parameter, symbol
from models.mechanisms import CATALOGUE, Mechanism, Scale, load_mechanisms
from models.mechanisms.user_files import check_placeable
from models.network import ExtraState
from models.terms import Term

RIG = load_gearbox("fzg")
NETWORK = RIG.network()
SCALE = Scale.of(RIG, speed=2600.0, torque=94.0)


def finding(name: str, strength: float) -> Finding:
    term = CATALOGUE[name].placed(NETWORK, SCALE)[0]
    estimates = {p.name: (p.start, 0.1) for p in term.parameters} | {term.strength.name: (strength, 0.5)}
    return Finding.of(
        term, estimates, mechanism=name, family=term.family, place=term.place, says=term.says, probability=0.9
    )


CORRECTION = Correction(
    gearbox=RIG.name,
    gearbox_sha256=RIG.hash,
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


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "correction.toml"
    write_correction(CORRECTION, path)
    return path


def test_the_file_holds_everything(file: Path) -> None:
    read = read_correction(file, NETWORK)
    assert correction_text(read) == correction_text(CORRECTION) == file.read_text(encoding="utf-8")
    assert read.recordings == CORRECTION.recordings
    assert read.calibration == CORRECTION.calibration
    assert [f.term.expression for f in read.findings] == [f.term.expression for f in CORRECTION.findings]
    assert [f.says for f in read.findings] == [f.says for f in CORRECTION.findings]
    assert [f.term.weighted for f in read.findings] == [f.term.weighted for f in CORRECTION.findings]


def test_corrected_network(file: Path) -> None:
    network = read_correction(file, NETWORK).network(RIG)
    parameters = {p.name: p for p in network.parameters}
    assert parameters["h_air"].start == 0.9312345678901234
    assert parameters["h_oil_gear"] == next(p for p in NETWORK.parameters if p.name == "h_oil_gear")
    assert parameters["windage_oil_strength"].start == 9.5
    assert network.sources[-1].name == "windage_oil" and network.sources[-1].is_loss
    assert network.links[-1].nodes == ("oil", "cooler_thermostat_oil_coolant")
    assert [state.name for state in network.states] == ["cooler_thermostat_oil_valve", "cooler_thermostat_oil_opening"]


def test_a_twin_gets_true_torque_and_a_recording_the_recorded_one(file: Path) -> None:
    read = read_correction(file, NETWORK)
    assert read.network(RIG).operating == {}
    seen = read.network(RIG, as_recorded=True).operating["torque"]
    assert seen.subs({symbol("torque"): 100.0, symbol("torque_gain_torque_strength"): 0.02}) == pytest.approx(102.0)


def test_in_half_a_sentence() -> None:
    own = f"(correction {CORRECTION.summary()['sha256'][:12]})"
    assert CORRECTION.words == f"corrected by {', '.join(CORRECTION.summary()['findings'])} {own}"
    assert "windage" in CORRECTION.words
    assert replace(CORRECTION, findings=()).words.startswith("corrected by calibration (correction ")


def test_another_definition_is_refused(file: Path) -> None:
    other = RIG.with_values({"oil.volume_l": 1.0})
    with pytest.raises(InputError, match="made for .*use the definition it was made for, or diagnose again"):
        read_correction(file, NETWORK).network(other)


def test_a_parameter_of_another_network_is_refused() -> None:
    wrong = replace(CORRECTION, calibration=(Estimate(name="h_aer", value=1.0, stderr=0.1),))
    with pytest.raises(InputError, match="'h_aer', not of this network; did you mean 'h_air'"):
        wrong.apply(NETWORK)


def test_estimates_must_be_complete() -> None:
    term = CATALOGUE["windage"].placed(NETWORK, SCALE)[0]
    with pytest.raises(InputError, match="no value was given for windage_oil_exponent"):
        Finding.of(term, {"windage_oil_strength": (1.0, 0.1)}, mechanism="windage")
    complete = {"windage_oil_strength": (1.0, 0.1), "windage_oil_exponent": (2.9, 0.1)}
    with pytest.raises(InputError, match="'windage_oil_strenth' is not a parameter of windage_oil; did you mean"):
        Finding.of(term, complete | {"windage_oil_strenth": (1.0, 0.1)}, mechanism="windage")


def test_a_number_that_is_none_is_not_written(tmp_path: Path) -> None:
    calibration = (Estimate(name="h_air", value=float("nan"), stderr=0.1),)
    with pytest.raises(ValueError, match="cannot hold the number nan"):
        write_correction(replace(CORRECTION, calibration=calibration), tmp_path / "c.toml")
    assert not list(tmp_path.iterdir())


FAULTS = [
    ("schema = 1", "schema = 2", "schema is 2; this program reads corrections of schema 1"),
    ("schema = 1", "", "schema is None"),
    ("schema = 1", "schema = [", "is not valid TOML"),
    ('kind = "source"', 'kind = "sauce"', "finding 'windage_oil'.kind"),
    ('mechanism = "windage"', 'mechanisme = "windage"', "mechanisme is not a known key; did you mean 'mechanism'"),
    ("value = 9.5", 'value = "9.5"', "finding 'windage_oil'.parameter 'windage_oil_strength'.value: must be a number"),
    ("value = 9.5", "value = 1e9", "windage_oil_strength is 1e"),
    ("value = 9.5", "value = nan", "must be finite"),
    ("stderr = 0.5", "stderr = -0.5", "stderr"),
    ("Abs(speed)", "Abs(sped)", "finding 'windage_oil'.law: 'sped' is not a signal; did you mean 'speed'"),
    ("Abs(speed)", "open('x')", "finding 'windage_oil'.law: 'open' is not a function"),
    ("Abs(speed)", "speed.real", "finding 'windage_oil'.law: .* has no place in a law"),
    ("weights = [", "weights = [1.0, ", "'oil_ageing_losses'.weights: 9 weights for 8 targets of a loss_factor"),
    (
        'target = ["oil"]',
        'target = ["oil"]\nweights = [1.0]',
        "'windage_oil'.weights: 1 weights for 1 targets of a source",
    ),
    ('target = ["oil"]', "target = []", "finding 'windage_oil'.target: has too few entries"),
    ('sha256 = "0000', 'sha256 = "zz00', "sha256"),
]


@pytest.mark.parametrize(("old", "new", "says"), FAULTS)
def test_faults_of_the_file(file: Path, old: str, new: str, says: str) -> None:
    text = file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=says) as caught:
        read_correction(file, NETWORK)
    assert str(caught.value).startswith(str(file))


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.toml: cannot be read"):
        read_correction(tmp_path / "none.toml", NETWORK)
    with pytest.raises(InputError, match=r"c\.toml: cannot be written"):
        write_correction(CORRECTION, tmp_path / "nowhere" / "c.toml")


def test_an_open_form_is_a_finding_like_any_other(tmp_path: Path) -> None:
    """A term that no catalogue knows, with a memory and a boundary of its own."""
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
    write_correction(replace(CORRECTION, findings=(found,), calibration=()), path)
    network = read_correction(path, NETWORK).network(RIG)
    assert network.links[-1].conductance == term.expression
    assert network.nodes[-1].temperature == term.boundary_temperature
    assert network.states[-1].rate == -held / 3600


# ---------------------------------------------------------------------- laws as text


@pytest.mark.parametrize(
    "law",
    [
        0.1 + symbol("speed") ** 2.9 / 7,
        sp.Rational(2, 3) * symbol("speed") ** sp.Rational(1, 3),
        sp.Max(symbol("speed") - 1e-300, -1.5e300, 0),
        sp.Piecewise((1, (symbol("speed") > 3) & (symbol("torque") <= 0.1)), (symbol("torque"), True)),
        sp.exp(-symbol("speed") / 3) * sp.tanh(symbol("torque")) * sp.Abs(symbol("torque")) * sp.sqrt(symbol("speed")),
    ],
)
def test_text_of_a_law_gives_the_same_law(law: sp.Expr) -> None:
    assert parse_expression(expression_text(law), ["speed", "torque"], where="x") == law


HOSTILE = [
    ("9**9**9**9", "not a finite"),
    ("2**(10**9)", "cannot be used|not a finite"),
    ("exp(exp(exp(exp(exp(10)))))", "cannot be used|not a finite"),
    ("1/0", "not a finite"),
    ("1e999", "not a finite"),
    ("log(-1)", "not a finite|cannot be used"),
    ("(" * 3000, "is not an expression"),
    ("-" * 5000 + "1", "is not an expression|nested deeper"),
    ("+".join(["speed"] * (LONGEST // 6 + 1)), "too long"),
    ("1" * 5000, "is not an expression"),
    ("().__class__.__bases__", "has no place"),
    ("[speed for speed in (1,)]", "has no place"),
    ("lambda: speed", "has no place"),
    ("'text'", "is not a number"),
    ("1j", "is not a number"),
    ("speed > 1", "is a condition, not a number"),
    ("speed + (torque > 1)", "is a condition where a number"),
    ("Piecewise((1, speed))", "is a number where a condition"),
    ("Piecewise(speed)", "takes pairs"),
    ("speed == 1", "compare with <"),
    ("speed // 2", "has no place"),
    ("exp(x=1)", "no named arguments"),
    ("exp(1, 2)", "cannot be used"),
    ("", "is not an expression"),
    ("speed; torque", "is not an expression"),
]


@pytest.mark.parametrize(("text", "says"), HOSTILE)
def test_hostile_laws_are_refused(text: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        parse_expression(text, ["speed", "torque"], where="file: law")


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


def test_a_mechanism_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(OWN, encoding="utf-8")
    (mechanism,) = load_mechanisms(path)
    places = mechanism.placed(NETWORK, SCALE)
    assert [term.label for term in places] == ["belt_guard_oil", *(f"belt_guard_bearing_{i}" for i in range(1, 5))]
    term = places[0]
    assert term.says == "The belt guard hums (oil)."
    assert term.strength == Parameter(
        name="belt_guard_oil_strength", unit="W", start=0.0, lower=0.0, upper=2000.0, sd=20.0, log=False
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
        ("schema = 1", "schema = 3", "schema is 3"),
        ('kind = "source"', 'kind = "spring"', "mechanism 'belt_guard'.kind"),
        ('name = "strength"', 'name = "size"', "the first parameter is 'size'; it must be 'strength'"),
        ("start = 2.0", "", "belt_guard.parameter exponent: start is missing"),
        ("grid = [1.5, 2.5]", "grid = [1.5, 99.0]", "99 of the grid is not within"),
        ("grid = [1.5, 2.5]", "upper = 1.0", "start 2 is not within"),
        ("grid = [1.5, 2.5]", "sweep = [3.0, 1.0]", "the sweep from 3 to 1 does not rise within"),
        ("grid = [1.5, 2.5]", "sweep = [1.0]", "mechanism 'belt_guard'.parameter 'exponent'.sweep #2 is missing"),
        ("start = 2.0", "start = -2.0\nlog = true", "a log-normal parameter is positive"),
        ("exp(-worn)", "exec(worn)", "'exec' is not a function"),
        ("exp(-worn)", "exp(-worn", "is not an expression"),
    ],
)
def test_faults_of_a_file_of_mechanisms(tmp_path: Path, old: str, new: str, says: str) -> None:
    path = tmp_path / "own.toml"
    assert old in OWN
    path.write_text(OWN.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=says):
        load_mechanisms(path)


def test_what_only_a_network_knows_shows_when_it_is_placed(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(OWN.replace("n**exponent", "sped**exponent"), encoding="utf-8")
    with pytest.raises(InputError, match="'belt_guard' uses 'sped'.*did you mean 'speed'"):
        load_mechanisms(path)[0].placed(NETWORK, SCALE)
    path.write_text(OWN.replace('"exponent"', '"speed"'), encoding="utf-8")
    with pytest.raises(InputError, match="'speed' is a signal; name the parameter differently"):
        load_mechanisms(path)[0].placed(NETWORK, SCALE)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("1/0", "fails with ZeroDivisionError"),
        ("x = 1", "needs a list MECHANISMS"),
        ("MECHANISMS = [1]", "needs a list"),
    ],
)
def test_faults_of_a_python_file(tmp_path: Path, content: str, says: str) -> None:
    path = tmp_path / "own.py"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=says):
        load_mechanisms(path)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("strength * n**exponent", "20 * n**exponent", "its law must hold 'strength'"),
        ('places = ["oil", "each bearings"]', 'places = ["oill"]', "no place in this gearbox.*'oill'.*oil"),
        ("({place})", "({ort})", "'belt_guard' fails with KeyError: 'ort'"),
        ("n**exponent", "sped**exponent", "'belt_guard' uses 'sped'"),
    ],
)  # fmt: skip
def test_what_cannot_be_placed_is_told_at_once(tmp_path: Path, fzg: Gearbox, old: str, new: str, says: str) -> None:
    path = tmp_path / "own.toml"
    assert old in OWN
    check_placeable(load_mechanisms_from(path, OWN), fzg, path)
    with pytest.raises(InputError, match=f"own.toml: .*{says}"):
        check_placeable(load_mechanisms_from(path, OWN.replace(old, new, 1)), fzg, path)


def test_parameters_of_a_python_file_that_fail_are_told(tmp_path: Path, fzg: Gearbox) -> None:
    path = tmp_path / "own.py"
    path.write_text(
        "from dataclasses import replace\nfrom models.mechanisms import CATALOGUE\n"
        "MECHANISMS = [replace(CATALOGUE['windage'], name='mine', parameters=lambda scale: 1 / 0)]\n",
        encoding="utf-8",
    )
    with pytest.raises(InputError, match="own.py: mechanism 'mine' fails with ZeroDivisionError"):
        check_placeable(load_mechanisms(path), fzg, path)


def load_mechanisms_from(path: Path, content: str) -> tuple[Mechanism, ...]:
    path.write_text(content, encoding="utf-8")
    return load_mechanisms(path)


def test_names_are_unique(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(OWN + OWN.replace("schema = 1", ""), encoding="utf-8")
    with pytest.raises(InputError, match="'belt_guard' is there 2 times"):
        load_mechanisms(path)


def test_a_missing_python_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read as a Python file"):
        load_mechanisms(tmp_path / "none.py")
