"""Cases: drawn from a seed alone, the truth apart and true."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from builder.commands.conceal import conceal
from diagnosis.proof.cases.case_files import write_cases
from diagnosis.proof.cases.conceal import EFFECTS, PHYSICS, conceal_set, mixed_plans, random_plans
from diagnosis.proof.cases.concealed_case import CONTROLS, FAULTS, Plan
from diagnosis.proof.plant import cycles
from diagnosis.recordings.read import read_recordings
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError

PLANS = (
    Plan(group="single", effects=("foundation_conduction",), strength=1.0),
    Plan(group="sensor", effects=("sensor_bias",), strength=1.0),
    Plan(group="double", effects=("brake_drag", "solar_soak")),
    Plan(group="control", kind="parameter_far"),
    Plan(group="control", kind="noise_misstated"),
)


@pytest.fixture(scope="module", autouse=True)
def short_programmes() -> Iterator[None]:
    """A tenth of the usual hours."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("STAIR_S", "STANDSTILL_S", "RANDOM_S", "HOLD_STAIRCASE_S", "WARM_UP_S"):
            patch.setattr(cycles, name, 0.1 * getattr(cycles, name))
        yield


@pytest.fixture(scope="module")
def cases(fzg: Gearbox, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The cases of PLANS on disk, in the folders ``recordings`` and ``truth``."""
    folder = tmp_path_factory.mktemp("cases")
    write_cases(conceal_set(fzg, PLANS, seed=3), folder / "recordings", folder / "truth")
    return folder


@pytest.fixture(scope="module")
def truths(cases: Path) -> list[dict]:
    return [json.loads(file.read_text()) for file in sorted((cases / "truth").iterdir())]


def test_recordings_are_readable_and_contain_no_truth(fzg: Gearbox, cases: Path) -> None:
    for folder in (cases / "recordings").iterdir():
        files = sorted(folder.glob("*.csv.gz"))
        assert [p.name[:-7] for p in files] == ["hold_1", "hold_2", "train_1", "train_2", "train_3"]
        texts = [pd.read_csv(p).to_csv() for p in files] + [p.read_text() for p in folder.glob("*.toml")]
        assert not any(name in text for text in texts for name in (*EFFECTS, *CONTROLS, "control"))
    (recording,) = read_recordings([cases / "recordings" / "case_005" / "train_2.csv.gz"], fzg.network())
    oil = next(channel for channel in recording.channels if channel.name == "oil")
    assert (oil.noise, oil.lag_s) == (0.2, 15.0)  # of the data sheet


def test_same_seed_same_bytes_independent_of_other_cases(fzg: Gearbox, cases: Path, tmp_path: Path) -> None:
    write_cases(conceal_set(fzg, PLANS[:1], seed=3), tmp_path / "r", tmp_path / "t", flat=True)
    for path in (cases / "recordings" / "case_001").iterdir():
        assert path.read_bytes() == (tmp_path / "r" / path.name).read_bytes(), path.name
    assert (cases / "truth" / "case_001.json").read_bytes() == (tmp_path / "t" / "case_001.json").read_bytes()


def test_truth_of_every_group(fzg: Gearbox, truths: list[dict]) -> None:
    path, fault, double, far, noisy = truths
    (effect,) = path["effects"]
    assert (effect["name"], effect["nodes"]) == ("foundation_conduction", ["housing_lower"])
    heat = effect["heat_W"]["train"]["housing_lower"]
    assert -150.0 < heat["max"] < heat["mean"] < -30.0  # 3 W/K times 30 K, on a frame that warms up
    assert effect["K"]["train"]["oil"]["rms"] > 4.0 and effect["K"]["train"] == path["K_all"]["train"]
    shift = fault["effects"][0]["K"]["train"]
    assert shift.pop(fault["effects"][0]["nodes"][0])["rms"] == pytest.approx(2.0)
    assert all(size["rms"] == 0.0 for size in (*shift.values(), *fault["K_all"]["train"].values()))
    assert [list(e["heat_W"]["train"]) for e in double["effects"]] == [["shaft_2"], ["housing_upper"]]
    distance = [abs(np.log(far["base_parameters"][n])) / fzg.priors[f"factors.{n}"] for n in fzg.factors]
    assert far["effects"] == [] and np.sum(np.array(distance) > 4.9) == 1
    assert noisy["noise"]["white_K"] >= 0.4 > noisy["noise"]["stated"]["noise"]


def test_plans_follow_their_seed_and_take_every_mechanism_in_turn() -> None:
    counts = {"control": 10, "single": len(PHYSICS), "sensor": len(FAULTS), "messy": 2}
    plans = mixed_plans(1, counts)
    assert plans == mixed_plans(1, counts)
    assert sorted(plan.effects[0] for plan in plans if plan.group == "single") == sorted(PHYSICS)
    assert Counter(plan.kind for plan in plans if plan.group == "control") == dict.fromkeys(CONTROLS, 2)
    assert all(len(set(plan.effects)) == 7 for plan in plans if plan.group == "messy")
    assert [plan.group for plan in plans] != sorted(plan.group for plan in plans)  # the order reveals nothing
    assert random_plans(1, 30) == random_plans(1, 30) != random_plans(2, 30)


def test_verb_writes_a_case_and_keeps_another(tmp_path: Path) -> None:
    options = ["--seed", "5", "--output", str(tmp_path)]

    def run(effect: str) -> Exception | None:
        return CliRunner().invoke(conceal, ["--effect", effect, "--strength", "1", *options]).exception

    assert run("sensor_stuck") is None
    made = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert {"train_1.csv.gz", "case_001.json"} <= {path.name for path in made}
    assert run("sensor_stuck") is None
    with pytest.raises(InputError, match="is of another case"):
        raise run("sensor_bias") or AssertionError
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == made


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("--effect windag", "did you mean 'windage'"),
        ("", "either --effect NAME or --random"),
        ("--effect windage --random", "either --effect NAME or --random"),
        ("--random --strength 1", "--strength goes with --effect"),
        ("--random --truth OUT/recordings/t", "must not lie among the recordings"),
        ("--plant zoo --group singl", "did you mean 'single'"),
        ("--plant zoo --families wals", "did you mean 'walls'"),
        ("--plant zoo --effect windage", "--effect: do not go with --plant zoo"),
        ("--effect windage --baselines 1", "--baselines: go with --plant zoo only"),
        ("--effect windage --group single", "--group: go with --plant zoo only"),
        ("--plant zoo --truth OUT/recordings/t", "must not lie among the recordings"),
    ],
)
def test_verb_refuses(arguments: str, message: str, tmp_path: Path) -> None:
    words = f"{arguments} --seed 1 --output OUT".replace("OUT", str(tmp_path)).split()
    assert message in str(CliRunner().invoke(conceal, words).exception)
    assert not list(tmp_path.iterdir())
