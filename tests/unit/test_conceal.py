"""Cases: drawn from a seed alone, sealed, the truth apart and true."""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from builder.__main__ import main
from diagnosis.proof import cycles
from diagnosis.proof.case_files import keep_apart, seal_holds
from diagnosis.proof.conceal import (
    CONTROLS,
    EFFECTS,
    FAULTS,
    PHYSICS,
    Plan,
    conceal_set,
    draw_case,
    mixed_plans,
    random_plans,
    simulate_cases,
    twins,
)
from diagnosis.proof.plant import Plant
from diagnosis.read_recordings import read_recordings
from models.errors import InputError
from models.gearbox import Gearbox

PLANS = (
    Plan(group="single", effects=("foundation_conduction",), strength=1.0),
    Plan(group="sensor", effects=("sensor_bias",), strength=1.0),
    Plan(group="double", effects=("brake_drag", "solar_soak")),
    Plan(group="control", kind="parameter_far"),
)


@pytest.fixture(scope="module", autouse=True)
def short_programmes() -> Iterator[None]:
    """A tenth of the usual hours."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("STAIR_S", "STANDSTILL_S", "RANDOM_S", "HOLD_STAIRCASE_S", "WARM_UP_S"):
            patch.setattr(cycles, name, 0.1 * getattr(cycles, name))
        yield


@pytest.fixture(scope="module")
def folders(fzg: Gearbox, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Four cases on disk: recordings, truth."""
    folder = tmp_path_factory.mktemp("cases")
    conceal_set(fzg, PLANS, seed=3, recordings=folder / "recordings", truth=folder / "truth")
    return folder / "recordings", folder / "truth"


def truth(folders: tuple[Path, Path], number: int) -> dict:
    return json.loads((folders[1] / f"case_{number:03d}.json").read_text())


def test_files_of_a_case(folders: tuple[Path, Path]) -> None:
    case = folders[0] / "case_001"
    assert {p.name for p in case.iterdir()} - {"mapping.toml"} == {
        "train_1.csv.gz", "train_2.csv.gz", "train_3.csv.gz", "hold_1.csv.gz", "hold_2.csv.gz", "seal.json"
    }  # fmt: skip
    hours = {}
    for path in case.glob("*.csv.gz"):
        table = pd.read_csv(path)
        assert list(table.columns) == [
            "time_s", "speed_rpm", "torque_Nm", "T_ambient_degC", "air_speed_m_s", "T_oil_degC", "T_housing_lower_degC",
            "T_housing_upper_degC", "T_bearing_1_degC", "T_bearing_3_degC", "T_pinion_degC", "P_loss_W",
        ]  # fmt: skip
        assert (np.diff(table["time_s"]) == 10.0).all()
        hours[path.name[:-7]] = len(table) / 360.0
    assert hours == pytest.approx({"train_1": 1.8, "train_2": 0.2, "train_3": 0.2, "hold_1": 0.2, "hold_2": 0.4})


def test_data_sheet_is_read_as_it_is_written(fzg: Gearbox, tmp_path: Path) -> None:
    plans = [Plan(group="control", kind="noise_misstated")]
    conceal_set(fzg, plans, seed=1, recordings=tmp_path / "r", truth=tmp_path / "t", flat=True)
    facts = json.loads((tmp_path / "t" / "case_001.json").read_text())
    (recording,) = read_recordings([tmp_path / "r" / "train_2.csv.gz"], fzg.network())
    oil = next(channel for channel in recording.channels if channel.name == "oil")
    assert (oil.noise, oil.resolution, oil.lag_s, oil.lag_sd_s) == (0.2, 0.1, 15.0, 5.0)
    assert facts["noise"]["white_K"] >= 0.4, "what is stated is wrong"
    assert facts["noise"]["stated"]["noise"] == 0.2


def test_seal_binds_the_truth(folders: tuple[Path, Path], tmp_path: Path) -> None:
    own = folders[1] / "case_001.json"
    assert seal_holds(folders[0] / "case_001", own)
    assert not seal_holds(folders[0] / "case_002", own)
    changed = tmp_path / "case_001.json"
    changed.write_text(own.read_text().replace("foundation_conduction", "water_jacket"))
    assert not seal_holds(folders[0] / "case_001", changed)
    with pytest.raises(InputError, match="cannot be read"):
        seal_holds(folders[0] / "case_001", tmp_path / "none.json")


def test_recordings_do_not_tell(folders: tuple[Path, Path]) -> None:
    for path in folders[0].rglob("*"):
        if path.is_file():
            content = pd.read_csv(path).to_csv() if path.name.endswith(".gz") else path.read_text()
            assert not any(name in content for name in (*EFFECTS, *CONTROLS, "control", "salt"))


def test_same_seed_same_bytes_whatever_the_company(fzg: Gearbox, folders: tuple[Path, Path], tmp_path: Path) -> None:
    conceal_set(fzg, PLANS[:1], seed=3, recordings=tmp_path / "r", truth=tmp_path / "t", flat=True)
    for path in (folders[0] / "case_001").iterdir():
        assert path.read_bytes() == (tmp_path / "r" / path.name).read_bytes(), path.name
    assert (folders[1] / "case_001.json").read_bytes() == (tmp_path / "t" / "case_001.json").read_bytes()


def test_truth_of_a_heat_path(folders: tuple[Path, Path]) -> None:
    facts = truth(folders, 1)
    (effect,) = facts["effects"]
    assert (effect["name"], effect["catalogue"], effect["nodes"]) == (
        "foundation_conduction", "foundation_conduction", ["housing_lower"]
    )  # fmt: skip
    heat = effect["heat_W"]["train"]["housing_lower"]
    assert -150.0 < heat["max"] < heat["mean"] < -30.0  # 3 W/K times 30 K, on a frame that warms up
    assert effect["K"]["train"]["oil"]["rms"] > 4.0
    assert effect["K"]["train"] == facts["K_all"]["train"]
    assert facts["practical"] == [True]


def test_truth_of_a_fault_of_measurement(folders: tuple[Path, Path]) -> None:
    facts = truth(folders, 2)
    (effect,) = facts["effects"]
    place = effect["nodes"][0]
    assert effect["K"]["train"][place]["rms"] == pytest.approx(2.0)
    assert all(size["rms"] == 0.0 for name, size in effect["K"]["train"].items() if name != place)
    assert all(size["rms"] == 0.0 for size in facts["K_all"]["train"].values()), "the gearbox itself is sound"


def test_truth_of_two_effects_tells_them_apart(folders: tuple[Path, Path]) -> None:
    facts = truth(folders, 3)
    drag, sun = facts["effects"]
    assert [drag["name"], sun["name"]] == ["brake_drag", "solar_soak"]
    assert list(drag["heat_W"]["train"]) == ["shaft_2"]
    assert list(sun["heat_W"]["train"]) == ["housing_upper"]
    both = facts["K_all"]["train"]["oil"]["max"]
    assert both < drag["K"]["train"]["oil"]["max"] + sun["K"]["train"]["oil"]["max"] + 0.5


def test_controls_conceal_nothing(folders: tuple[Path, Path], fzg: Gearbox) -> None:
    facts = truth(folders, 4)
    assert facts["effects"] == []
    distance = [abs(np.log(facts["base_parameters"][n])) / fzg.priors[f"factors.{n}"] for n in fzg.factors]
    assert np.sum(np.array(distance) > 4.9) == 1, "one parameter five standard deviations off"


def test_parameters_of_a_gearbox_lie_within_their_priors(fzg: Gearbox) -> None:
    plant = Plant(fzg)
    for i, kind in enumerate(("clean", "parameters_off")):
        factors = draw_case(plant, Plan(group="control", kind=kind), seed=(5, i), name="case").individual.factors
        sds = [abs(np.log(value)) / fzg.priors[f"factors.{name}"] for name, value in factors.items()]
        assert max(sds) <= (1.0, 2.0)[i] + 1e-9


def test_mixed_plans_take_every_mechanism_in_turn() -> None:
    plans = mixed_plans(1, {"control": 10, "single": len(PHYSICS), "sensor": len(FAULTS), "messy": 2})
    singles = [plan.effects[0] for plan in plans if plan.group == "single"]
    assert sorted(singles) == sorted(PHYSICS)
    assert Counter(plan.kind for plan in plans if plan.group == "control") == dict.fromkeys(CONTROLS, 2)
    assert all(len(set(plan.effects)) == 7 for plan in plans if plan.group == "messy")
    assert plans == mixed_plans(1, {"control": 10, "single": len(PHYSICS), "sensor": len(FAULTS), "messy": 2})
    assert [plan.group for plan in plans] != sorted(plan.group for plan in plans), "the order must not tell"
    with pytest.raises(InputError, match=r"'singel' is not a group of cases; did you mean 'single'\?"):
        mixed_plans(1, {"singel": 1})


def test_random_plans_follow_their_seed() -> None:
    assert random_plans(1, 30) == random_plans(1, 30)
    assert random_plans(1, 30) != random_plans(2, 30)
    assert len({plan.group for plan in random_plans(1, 200)}) == 6


def test_twins_leave_one_effect_out(fzg: Gearbox) -> None:
    plant = Plant(fzg)
    double = draw_case(plant, PLANS[2], seed=(1, 1), name="case")
    first, second = double.effects
    assert twins(double) == [(first, second), (), (second,), (first,)]
    assert twins(draw_case(plant, PLANS[1], seed=(1, 1), name="case")) == [()]


def test_progress_is_told(fzg: Gearbox) -> None:
    told: list[tuple[int, int]] = []
    case = draw_case(Plant(fzg), PLANS[3], seed=(1, 1), name="case")
    simulate_cases(Plant(fzg), [case], lambda done, of: told.append((done, of)))
    assert told == sorted(told)
    assert told[-1][0] > 0.95 * told[-1][1]


def test_truth_may_not_lie_among_the_recordings(tmp_path: Path) -> None:
    for inside in ("r", "r/t"):
        with pytest.raises(InputError, match="must not lie among the recordings"):
            keep_apart(tmp_path / "r", tmp_path / inside)
    keep_apart(tmp_path / "r", tmp_path / "t")


# ---------------------------------------------------------------------- the verb


def run(*arguments: object) -> int:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["builder", *map(str, arguments)])
        try:
            main()
        except SystemExit as end:
            return int(end.code or 0)
    return 0


def test_verb_writes_a_case(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("conceal", "--effect", "sensor_stuck", "--strength", 1, "--seed", 5, "--output", tmp_path) == 0
    assert (tmp_path / "recordings" / "train_1.csv.gz").is_file()
    assert seal_holds(tmp_path / "recordings", tmp_path / "truth" / "case_001.json")
    assert "sealed" in capsys.readouterr().out
    # The same case may be made again, another one must not take its place.
    made = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert run("conceal", "--effect", "sensor_stuck", "--strength", 1, "--seed", 5, "--output", tmp_path) == 0
    for other in (("--effect", "sensor_bias"), ("--effect", "sensor_bias", "--cases", 1)):  # both have a case_001.json
        assert run("conceal", *other, "--seed", 5, "--output", tmp_path) == 2
        told = " ".join(capsys.readouterr().err.split())
        assert "is of another case, which would be lost; choose another output" in told
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == made


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--effect", "windag"), "'windag' is not an effect that can be concealed; did you mean 'windage'?"),
        ((), "conceal takes either --effect NAME or --random"),
        (("--effect", "windage", "--random"), "conceal takes either --effect NAME or --random"),
        (("--random", "--strength", "1"), "--strength goes with --effect; --random draws it"),
        (("--effect", "windage", "--gearbox", "fgz"), "there is no gearbox named 'fgz'"),
    ],
)
def test_verb_refuses(
    arguments: tuple[str, ...], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("conceal", *arguments, "--seed", 1, "--output", tmp_path) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_verb_lists_effects(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("conceal", "--list") == 0
    listed = capsys.readouterr().out
    assert all(name in listed for name in EFFECTS)
