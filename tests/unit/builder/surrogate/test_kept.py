"""Kept networks: the same to the last bit, trained again whenever anything that decides them has changed."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from builder.base.cache import CACHE_VARIABLE
from builder.surrogate import kept
from builder.surrogate.kept import kept_or_trained
from builder.surrogate.train import TrainingResult, train_surrogate
from models.assembly.gearbox import Gearbox, load_gearbox
from models.base.errors import InputError

ROOT = Path(__file__).parents[4]
OPTIONS: dict[str, Any] = {"preset": "paper", "samples": 60, "seed": 1}


@pytest.fixture
def trainings(fzg_training: TrainingResult, monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """One entry for every training, which takes no time here and gives the networks of `fzg_training`."""
    done: list[object] = []

    def quick(gearbox: Gearbox, **options: object) -> TrainingResult:
        done.append((gearbox.name, options))
        return fzg_training

    monkeypatch.setattr(kept, "train_surrogate", quick)
    return done


def kept_files(cache: Path) -> list[Path]:
    return sorted((cache / "networks").glob("*"))


def test_networks_are_trained_once_and_come_back_to_the_last_bit(
    fzg: Gearbox, cache_of_this_run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = train_surrogate(fzg, **OPTIONS)
    trained = kept_or_trained(fzg, **OPTIONS)
    (file,) = kept_files(cache_of_this_run)
    assert trained.origin == f"trained now, kept in {file}"
    monkeypatch.setattr(kept, "train_surrogate", lambda *_, **__: pytest.fail("trained again"))
    again = kept_or_trained(fzg, **OPTIONS)
    assert again.origin.startswith(f"taken from {file} (trained on 2") and again.seconds == trained.seconds
    assert plain.losses.to_dict() == trained.losses.to_dict() == again.losses.to_dict()
    assert plain.as_dict() == again.as_dict()
    x = np.random.default_rng(0).uniform([-100.0, -10.0, *[0.0] * 7], [6000.0, 300.0, *[120.0] * 7], (500, 9))
    there, here = (result.losses.power(x[:, 0], x[:, 1], x[:, 2:]) for result in (plain, again))
    np.testing.assert_array_equal(here, there)


def test_a_kept_training_has_what_the_first_had(fzg: Gearbox, trainings: list[object]) -> None:
    first, second = kept_or_trained(fzg), kept_or_trained(fzg)
    assert len(trainings) == 1
    assert second.report == first.report and second.seconds_by_network == {}


@pytest.mark.parametrize("change", [
    lambda _: {"seed": 2},
    lambda _: {"samples": 61},
    lambda _: {"preset": "default"},
    lambda _: {"gearbox": load_gearbox("conveyor")},
    lambda _: {"gearbox": load_gearbox("fzg").with_values({"oil.density_kg_m3": 870.0})},
    lambda _: {"gearbox": load_gearbox("fzg").with_values({"stage.0.roughness_Ra_um": [0.2, 0.2]})},
    lambda _: {"gearbox": load_gearbox("fzg").with_values({"training.speed_rpm": [1.0, 3000.0]})},
    lambda _: {"retrain": True},
    lambda patch: patch.setattr(kept, "_code_hash", lambda: "of other code") or {},
    lambda patch: patch.setattr(kept.metadata, "version", lambda _: "0.0") or {},
    lambda patch: patch.setattr(kept, "threadpool_info", list) or {},
    lambda patch: patch.setenv(CACHE_VARIABLE, "off") or {},
])  # fmt: skip
def test_another_definition_setting_code_or_library_is_trained(
    change: Callable[[pytest.MonkeyPatch], dict[str, Any]], fzg: Gearbox, trainings: list[object],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    usual: dict[str, Any] = {"gearbox": fzg, **OPTIONS}
    kept_or_trained(**usual)
    kept_or_trained(**usual)
    assert len(trainings) == 1
    kept_or_trained(**usual | change(monkeypatch))
    assert len(trainings) == 2


@pytest.mark.parametrize("value", [
    {"housing.wall_thickness_m": 0.03}, {"factors.churning": 2.0}, {"shaft.0.conductivity_W_mK": 40.0},
    {"ambient.air_speed_m_s": 1.0}, {"name": "another rig"},
])  # fmt: skip
def test_what_the_losses_do_not_depend_on_is_not_trained_again(
    value: dict[str, Any], fzg: Gearbox, trainings: list[object]
) -> None:
    kept_or_trained(fzg)
    other = fzg.with_values(value)
    found = kept_or_trained(other)
    assert len(trainings) == 1 and other.hash != fzg.hash
    assert (found.gearbox, found.definition_hash) == (other.name, other.hash)


def test_what_was_computed_before_does_not_change_the_key() -> None:
    gearbox, preset = load_gearbox("conveyor"), kept.chosen_preset("default")
    key = kept._key(gearbox, preset, 0)
    gearbox.losses_at(speed=1000.0, torque=100.0, temperatures=60.0)
    gearbox.losses().power(1000.0, 100.0, np.full(len(gearbox.losses().temperature_nodes), 60.0))
    assert kept._key(gearbox, preset, 0) == key


def test_workers_and_the_order_in_which_libraries_are_found_change_nothing(
    fzg: Gearbox, trainings: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    found = kept.threadpool_info()
    assert len([one for one in found if one["user_api"] == "blas"]) > 0
    other = {"user_api": "blas", "internal_api": "blis", "version": None, "architecture": "other"}
    monkeypatch.setattr(kept, "threadpool_info", lambda: [other, *found])
    kept_or_trained(fzg, **OPTIONS)
    monkeypatch.setattr(kept, "threadpool_info", lambda: [*reversed(found), other])
    kept_or_trained(load_gearbox("fzg"), **OPTIONS, jobs=2, progress=lambda *_: None)
    assert len(trainings) == 1


def test_another_process_finds_the_same_key(fzg: Gearbox) -> None:
    code = (
        "from builder.surrogate import kept; from models.assembly.gearbox import load_gearbox; "
        "print(kept._key(load_gearbox('fzg'), kept.chosen_preset('default'), 0))"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "1"}
    found = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT, env=environment
    )
    assert found.stdout.strip() == kept._key(fzg, kept.chosen_preset("default"), 0)


@pytest.mark.parametrize("damage", [
    lambda content: b"",
    lambda content: content[:-1000],
    lambda content: content.replace(b"0.1", b"0.2", 1),
    lambda content: b"\xff\xfe" + content,
    lambda content: b"[]",
])  # fmt: skip
def test_a_damaged_file_is_trained_again_and_replaced(
    damage: Callable[[bytes], bytes], fzg: Gearbox, trainings: list[object], cache_of_this_run: Path
) -> None:
    kept_or_trained(fzg)
    (file,) = kept_files(cache_of_this_run)
    whole = file.read_bytes()
    file.write_bytes(damage(whole))
    assert file.read_bytes() != whole
    kept_or_trained(fzg)
    assert len(trainings) == 2
    kept_or_trained(fzg)
    assert len(trainings) == 2 and kept_files(cache_of_this_run) == [file]


def test_where_nothing_can_be_kept_it_is_only_slower(
    fzg: Gearbox, trainings: list[object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "file" / "cache"))
    assert kept_or_trained(fzg).origin == kept_or_trained(fzg).origin == "trained now"
    assert len(trainings) == 2


def test_a_path_in_the_home_folder_is_shown_from_there(
    fzg: Gearbox, trainings: list[object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "kept"))
    assert kept_or_trained(fzg).origin.startswith("trained now, kept in ~/kept/networks/")


def test_faulty_settings_are_refused_before_anything_is_looked_up(fzg: Gearbox) -> None:
    with pytest.raises(InputError, match="did you mean 'paper'"):
        kept_or_trained(fzg, preset="papr")
    with pytest.raises(InputError, match="10 samples per network are too few"):
        kept_or_trained(fzg, samples=10)
