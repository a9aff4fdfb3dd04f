"""The verb add: physics that a machine is known to have."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import sympy as sp

from models.assembly.gearbox import Gearbox
from models.correction.correction import read_correction
from models.network.laws import symbol
from tests.conftest import RunCli
from tests.unit.models.around_fzg import TABLES
from tests.unit.models.fzg_file import FZG

FAN = ("fan_thermostat", "--set", "strength=7", "--set", "set_point=55:2")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "known.toml"


def test_given_numbers_are_as_exact_as_said_and_the_others_are_typical(
    fzg: Gearbox, file: Path, run_cli: RunCli, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_cli("add", file, *FAN) == 0
    assert run_cli("add", file, "pump_heat", "--set", "strength=20:5") == 0
    shown = capsys.readouterr().out
    assert "strength   given    additional conductance to the air" in shown and "exact" in shown
    fan, pump = read_correction(file, fzg).findings
    numbers = {p.name.removeprefix("fan_thermostat_housing_"): (p.value, p.stderr) for p in fan.parameter}
    assert numbers == {"strength": (7.0, 0.0), "set_point": (55.0, 2.0), "band": (6.0, 3.0)}
    assert (pump.parameter[0].value, pump.parameter[0].stderr) == (20.0, 5.0)


def test_the_speed_that_numbers_are_relative_to_is_shown(
    fzg: Gearbox, file: Path, run_cli: RunCli, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_cli("add", file, "fan_speed_switch", "--set", "strength=7", "--set", "switch=0.6") == 0
    shown = re.search(r"relative values go by: (\S+) 1/min and \S+ N m", capsys.readouterr().out)
    (fan,) = read_correction(file, fzg).findings
    assert shown
    values = {p.name: p.value for p in fan.parameter} | {"speed": 0.6 * float(shown[1])}
    law = fan.law.xreplace({symbol(name): sp.Float(value) for name, value in values.items()})
    assert float(law) == pytest.approx(3.5, rel=0.02)


def test_the_file_is_of_one_gearbox(file: Path, run_cli: RunCli, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli("add", file, "pump_heat", "--set", "strength=20") == 0
    assert run_cli("add", file, *FAN, "--gearbox", "conveyor") == 2
    assert "was made for 'FZG" in capsys.readouterr().err


def test_a_simulation_has_it(file: Path, tmp_path: Path, run_cli: RunCli) -> None:
    cycle = tmp_path / "cycle.csv"
    pd.DataFrame({"time_s": np.arange(0.0, 14400.0, 60.0), "speed_rpm": 2500.0, "torque_Nm": 94.0}).to_csv(cycle)
    assert run_cli("add", file, *FAN) == 0
    hottest = []
    for given in ((), ("--correction", file)):
        assert run_cli("simulate", cycle, "--gearbox", "fzg", *given, "--output", tmp_path / "r.csv") == 0
        made = pd.read_csv(tmp_path / "r.csv")
        hottest.append((0.5 * (made["T_housing_lower_degC"] + made["T_housing_upper_degC"])).max())
    assert hottest[0] > 62.0 and 57.5 < hottest[1] < 59.0  # on at 55 + 6 / 2 degC


@pytest.mark.parametrize(("words", "says"), [
    (("fan_thermostat",), "the strength of fan_thermostat is missing: additional conductance to the air [W/K]"),
    (("fan_thermostt", "--set", "strength=1"), "did you mean 'fan_thermostat'?"),
    (("fan_thermostat", "--set", "strength=1", "--set", "setpoint=5"), "did you mean 'set_point'?"),
    (("fan_thermostat", "--set", "strength=1", "--set", "set_point=900"), "set_point = 900 is outside -60 to 250 degC"),
    (("fan_speed_switch", "--set", "strength=1", "--set", "switch=900"), "switch = 900 is outside 0.012 to 30 of fan_"),
    (("fan_thermostat", "--set", "strength=nan"), "strength = nan is outside"),
    (("fan_thermostat", "--set", "strength=1:-2"), "the standard error is -2; it is 0 or more"),
    (("fan_thermostat", "--set", "strength"), "is not NAME=VALUE"),
    (("fan_thermostat", "--set", "strength=1", "--set", "strength=2"), "gives a number twice"),
    (("bearing_damage", "--set", "strength=1"), "may be at bearing_1, bearing_2, bearing_3, bearing_4; say where"),
    (("bearing_damage", "--place", "bearing_9", "--set", "strength=1"), "cannot be at 'bearing_9'; did you mean"),
    (("sensor_bias", "--set", "strength=1"), "is a fault of an instrument"),
    (("pump_fast_stage", "--set", "strength=1"), "has no place in fzg.toml"),
])  # fmt: skip
def test_faults_are_said(
    file: Path, run_cli: RunCli, capsys: pytest.CaptureFixture[str], words: tuple[str, ...], says: str
) -> None:
    assert run_cli("add", file, *words) == 2
    assert says in " ".join(capsys.readouterr().err.split())
    assert not file.exists()


def test_what_is_there_is_not_added_twice(file: Path, run_cli: RunCli, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_cli("add", file, *FAN) == 0
    before = file.read_bytes()
    assert run_cli("add", file, *FAN) == 2
    assert "has fan_thermostat at housing already; change its numbers there" in capsys.readouterr().err
    assert file.read_bytes() == before
    assert run_cli("add", file.with_suffix(".csv"), *FAN) == 2


def test_a_warm_coolant_that_is_known_is_no_guess(
    fzg: Gearbox, file: Path, run_cli: RunCli, capsys: pytest.CaptureFixture[str]
) -> None:
    """The limits of a search for an unknown cooler end 20 K above the air."""
    assert run_cli("add", file, "cooler_constant", "--set", "strength=60", "--set", "coolant=65") == 0
    network = read_correction(file, fzg).apply(fzg.network())
    assert fzg.steady_state(network=network).temperatures["oil"] > 35.0  # at rest in air of 27 degC
    file.unlink()
    assert run_cli("add", file, "cooler_constant", "--set", "strength=60", "--set", "coolant=338") == 2
    assert "coolant = 338 is outside -60 to 150 degC" in capsys.readouterr().err


def test_a_coolant_that_the_definition_has_is_not_given_a_second_time(
    tmp_path: Path, file: Path, run_cli: RunCli, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "around.toml").write_text(FZG + TABLES, encoding="utf-8")
    cooler = ("add", file, "cooler_constant", "--gearbox", tmp_path / "around.toml", "--set", "strength=60")
    assert run_cli(*cooler, "--set", "coolant=30") == 2
    assert "coolant of cooler_constant has no effect: " in capsys.readouterr().err and not file.exists()
    assert run_cli(*cooler) == 0
