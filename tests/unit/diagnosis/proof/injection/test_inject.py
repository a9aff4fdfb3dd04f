"""Injections into real recordings: exact where they claim it, by the calibrated model where not, and nothing else."""

from __future__ import annotations

import gzip
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner

from builder.commands.conceal import conceal
from diagnosis.proof.cases.case_files import write_cases
from diagnosis.proof.cases.time_course import TimeCourse
from diagnosis.proof.injection.control import Control, find_control
from diagnosis.proof.injection.inject import Injector, Wish, inject_set
from diagnosis.proof.injection.instrument_faults import stuck, swapped
from diagnosis.proof.injection.kinds import KINDS
from diagnosis.proof.injection.machine_changes import heat
from diagnosis.proof.injection.real_recording import read_real_recording
from diagnosis.proof.injection.trial import choose_size
from diagnosis.recordings.read import read_recording
from models.assembly.gearbox import load_gearbox
from models.base.errors import InputError
from models.files.cycle import Cycle

DATA = Path(__file__).parents[5] / "examples" / "data"
ROD, TURBINE = DATA / "heated_rod.csv.gz", DATA / "la_haute_borne_R80736.csv.gz"


@pytest.fixture(scope="module")
def rod() -> Injector:
    return Injector(load_gearbox("heated_rod"), f"{ROD}@0..30000")


def inject(injector: Injector, folder: Path, *, seed: int = 1, number: int = 1, **wish: object) -> tuple[dict, Path]:
    """Truth and recording of the first case."""
    cases = inject_set(injector, Wish(**wish), number, seed=seed)
    write_cases(cases, folder / "recordings", folder / "truth", flat=number == 1)
    truth = json.loads((folder / "truth" / "case_001.json").read_text())
    return truth, folder / "recordings" / ("" if number == 1 else "case_001") / f"{injector.real.stem}.csv.gz"


def changed_columns(file: Path, injector: Injector) -> dict[str, np.ndarray]:
    """Differences of the columns that are not as they were, shape (rows,)."""
    first = int(injector.real.found.rows[0]) - 1
    before = pd.read_csv(injector.real.path).iloc[first : first + len(injector.real.time)].reset_index(drop=True)
    after = pd.read_csv(file)
    assert list(after.columns) == list(before.columns)
    assert len(after) == len(before)
    return {name: (after[name] - before[name]).to_numpy() for name in before if not after[name].equals(before[name])}


def test_the_control_is_the_recording(rod: Injector, tmp_path: Path) -> None:
    truth, file = inject(Injector(rod.gearbox, str(ROD)), tmp_path, control=True)
    assert gzip.decompress(file.read_bytes()) == gzip.decompress(ROD.read_bytes())
    assert truth["group"] == "control"
    assert truth["changed"] == truth["effects"] == []
    assert truth["source"]["sha256"] == read_recording(ROD, rod.gearbox.network()).sha256


def test_a_bias_is_exact(rod: Injector, tmp_path: Path) -> None:
    truth, file = inject(rod, tmp_path, kind="bias", place="cell_6__NTC6", date="12000")
    (changed,), (effect,) = truth["changed"], truth["effects"]
    ((name, difference),) = changed_columns(file, rod).items()
    acting = (rod.real.time >= 12000.0) & ((rod.real.time < changed["to_s"]) | (changed["course"] == "step"))
    assert name == "NTC6_degC"
    np.testing.assert_allclose(difference, np.where(acting, effect["size"], 0.0), atol=0.6e-4)
    assert (changed["what"], changed["of"], changed["nodes"]) == ("sensor", "cell_6__NTC6", ["cell_6"])
    assert changed["sign"] == np.sign(effect["size"])
    assert not truth["approximate"]


def test_a_late_clock_moves_whole_rows(rod: Injector, tmp_path: Path) -> None:
    truth, file = inject(rod, tmp_path, kind="clock", date="6000")
    late = round(truth["effects"][0]["size"] / 10.0)
    before, after = pd.read_csv(ROD), pd.read_csv(file)
    assert set(changed_columns(file, rod)) == {name for name in before if name.startswith("NTC")}
    assert after["NTC3_degC"][600:].tolist() == before["NTC3_degC"][600 - late : 3000 - late].tolist()


def test_a_stuck_sensor_shows_its_last_reading(rod: Injector, tmp_path: Path) -> None:
    truth, file = inject(rod, tmp_path, kind="stuck", place="cell_1", date="3000")
    end = int(np.ceil(truth["changed"][0]["to_s"] / 10.0))
    after = pd.read_csv(file)["NTC1_degC"]
    assert set(after[300:end]) == {after[299]}
    assert after[end] != after[299]


def test_gaps_before_a_fault_are_not_its_own(rod: Injector) -> None:
    """A sensor that starts late: what is swapped later changes nothing before, and nothing can be stuck before."""
    late = np.where(rod.real.time < 3000.0, np.nan, rod.real.channels["cell_1"])
    two = tuple(one for one in rod.real.recording.channels if one.name in ("cell_1", "cell_2"))
    found = replace(rod.real.found, values={**rod.real.found.values, "T_cell_1": late})
    real = replace(rod.real, recording=replace(rod.real.recording, channels=two), found=found)
    trial = swapped(real, "cell_1", TimeCourse(kind="step", begins=12000.0, ends=30000.0), np.random.default_rng(0))
    for shift in trial.columns.values():
        assert (shift[0][real.time < 12000.0] == 0.0).all()
        assert np.abs(shift[0][real.time > 13000.0]).max() > 0.0
    with pytest.raises(InputError, match="cell_1 has no reading before 1000 s that it could be stuck at"):
        stuck(real, "cell_1", TimeCourse(kind="step", begins=1000.0, ends=30000.0), np.random.default_rng(0))


def test_a_changed_link_is_the_difference_of_two_simulations(rod: Injector, tmp_path: Path) -> None:
    truth, file = inject(rod, tmp_path, kind="link_factor", place="cell_5-cell_6", date="24000", seed=3)
    (changed,), (effect,) = truth["changed"], truth["effects"]
    model, course = rod.model, TimeCourse(kind=changed["course"], begins=changed["from_s"], ends=changed["to_s"])
    # An independent way: the parameter of the link, held from block to block.
    base = model.base.temperatures
    rows = [{name: T[k] for name, T in base.items()} for k in range(len(model.cycle.time))]
    first = int(np.argmax(model.cycle.time > course.begins))
    T, size = rows[first], 1.0 + effect["size"] * course.share(model.cycle.time)
    for k in range(first, len(rows) - 1):
        conductance = model.parameters["G_cell_5_cell_6"] * 0.5 * (size[k] + size[k + 1])
        step = Cycle(model.cycle.time[k : k + 2], {n: v[k : k + 2] for n, v in model.cycle.inputs.items()})
        result = model.network.simulate(
            step, losses=model.losses, initial=T,
            parameters={**model.parameters, "G_cell_5_cell_6": conductance},
        )  # fmt: skip
        T = {name: values[-1] for name, values in result.temperatures.items()}
    differences = changed_columns(file, rod)
    assert set(differences) == {f"NTC{i}_degC" for i in range(1, 14)}
    for cell, name in (("cell_1", "NTC1_degC"), ("cell_6", "NTC8_degC"), ("cell_12", "NTC13_degC")):
        node = {"NTC8_degC": "cell_7"}.get(name, cell)
        assert differences[name][-1] == pytest.approx(T[node] - rows[-1][node], abs=0.02)
    assert rod.bounds_K[0] <= max(K["max"] for K in effect["K"].values()) <= rod.bounds_K[1]
    assert truth["approximate"]
    assert effect["heat_W"]["cell_5"]["mean"] == -effect["heat_W"]["cell_6"]["mean"]


@pytest.mark.parametrize("kind", sorted(set(KINDS) - {"bias", "clock", "stuck", "link_factor"}))
def test_every_kind_states_what_it_changed(rod: Injector, tmp_path: Path, kind: str) -> None:
    truth, file = inject(rod, tmp_path, kind=kind, date="3000", seed=2)
    (changed,), (effect,) = truth["changed"], truth["effects"]
    differences = changed_columns(file, rod)
    assert differences.keys() <= effect["column_shift"].keys()
    for name, shift in differences.items():
        assert np.abs(shift).max() == pytest.approx(effect["column_shift"][name], abs=0.006)
        assert not shift[rod.real.time < changed["from_s"] - 30.0].any()
    assert truth["approximate"] == (KINDS[kind].group == "machine")
    largest = max(K["max"] for K in (effect["K_of_model"] or effect["K"]).values())
    assert effect["below_bounds"] == (largest < rod.bounds_K[0])


def test_units_decimals_and_gaps_of_the_file_stay(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    hours = np.arange(400) / 30.0
    reading = np.round(10.0 * (75.0 + 45.0 * (1.0 - np.exp(-hours / 2.0)) + 0.2 * rng.normal(size=400))) / 10.0
    cells = [f"{value:.1f}".replace(".", ",") for value in reading]
    cells[50:60] = ["Bad"] * 10
    lines = [f"{2.0 * k:g};{cell};10,0;296,5" for k, cell in enumerate(cells)]
    source = tmp_path / "rod.csv"
    source.write_text("\n".join(["minutes;first;heater_power;room", *lines]) + "\n")
    (tmp_path / "rod.toml").write_text("""
schema = 1
missing = ["Bad"]
time = { column = "minutes", unit = "min" }
csv = { separator = ";", decimal = "," }
[columns.first]
quantity = "T_cell_1"
unit = "degF"
[columns.room]
quantity = "T_ambient"
unit = "K"
""")
    injector = Injector(load_gearbox("heated_rod"), str(source))
    truth, file = inject(injector, tmp_path / "out", kind="bias", date="24000")
    after = [line.split(";") for line in gzip.decompress(file.read_bytes()).decode().splitlines()[1:]]
    assert [[row[0], *row[2:]] for row in after] == [[row.split(";")[0], *row.split(";")[2:]] for row in lines]
    assert [row[1] for row in after][:200] == cells[:200]
    size = truth["effects"][0]["size"]
    assert float(after[200][1].replace(",", ".")) - reading[200] == pytest.approx(np.round(18.0 * size) / 10.0)
    again, before = (read_recording(path, injector.gearbox.network()) for path in (file, source))
    assert again.channels[0].values[210] - before.channels[0].values[210] == pytest.approx(size, abs=0.03)


def test_the_control_of_a_turbine_is_found() -> None:
    control = find_control(read_real_recording(str(TURBINE), load_gearbox("la_haute_borne")))
    assert control is not None
    assert (control.channel, control.node, control.acts_at) == ("oil", "oil", "oil_inlet")
    assert (control.low, control.high) == pytest.approx((55.3, 59.6), abs=0.5)
    assert 0.2 < control.active.mean() < 0.8


def test_a_control_holds_its_temperature_where_it_is_at_work(rod: Injector) -> None:
    late = rod.real.time > 20000.0
    control = Control(channel="cell_1", node="cell_1", acts_at="cell_2", low=0.0, high=9.0, active=late.astype(float))
    course = TimeCourse(kind="step", begins=10000.0, ends=1e9)
    held, free = (
        np.abs(heat(replace(rod.model, control=found), "cell_1", course, np.random.default_rng(1)).K["cell_1"][-1])
        for found in (control, None)
    )
    np.testing.assert_allclose(held[rod.real.time < 19000.0], free[rod.real.time < 19000.0], atol=1e-6)
    assert held[-1] < 0.4 * free[-1]


def test_no_control_is_seen_where_there_is_none(rod: Injector) -> None:
    assert find_control(rod.real) is None
    assert find_control(read_real_recording(str(ROD), rod.gearbox)) is None  # thermistor 7 is noisy at a level


def test_the_size_is_log_uniform_between_the_bounds() -> None:
    rng = np.random.default_rng(1)
    largest = np.geomspace(0.01, 100.0, 400)
    chosen = np.log([largest[choose_size(largest, (0.3, 6.0), rng)] for _ in range(2000)])
    low, high = np.log(0.3), np.log(6.0)
    assert chosen.min() >= low
    assert chosen.max() <= high
    assert np.mean(chosen) == pytest.approx(0.5 * (low + high), abs=0.08)
    assert choose_size(np.array([0.01, 0.1, 0.2]), (0.3, 6.0), rng) == 2


def test_a_seed_gives_the_same_bytes_and_cases_differ(rod: Injector, tmp_path: Path) -> None:
    for run in ("a", "b"):
        inject(Injector(rod.gearbox, f"{ROD}@0..30000"), tmp_path / run, kind="drift", seed=7, number=2)
    files = {
        run: {p.relative_to(tmp_path / run): p.read_bytes() for p in (tmp_path / run).rglob("*.*")} for run in "ab"
    }
    assert files["a"] == files["b"]
    one, two = (files["a"][Path("recordings", name, "heated_rod.csv.gz")] for name in ("case_001", "case_002"))
    assert one != two


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--effect", "biass"], "did you mean 'bias'"),
        (["--effect", "link_factor", "--place", "cell_1-cell_3"], "heated_rod.toml: has no link 'cell_1-cell_3'"),
        (["--effect", "bias", "--place", "oil"], "has no sensor 'oil'"),
        (["--effect", "bias", "--date", "90000"], "lies outside the recording"),
        (["--effect", "bias", "--date", "2020-01-01"], "name seconds"),
        (["--place", "cell_1"], "goes with --effect"),
        (["--control", "--effect", "bias"], "--control injects nothing"),
        (["--random"], "leave out --random"),
        (["--gearbox", "la_haute_borne"], "column speed_rpm is missing"),
        (["--truth", "OUT/recordings/truth"], "must not lie among"),
    ],
)
def test_faulty_wishes_write_nothing(tmp_path: Path, options: list[str], message: str) -> None:
    out = tmp_path / "out"
    options = [option.replace("OUT", str(out)) for option in options]
    given = ["--into", str(ROD), "--gearbox", "heated_rod", "--seed", "1", "--output", str(out), *options]
    result = CliRunner().invoke(conceal, given)
    assert isinstance(result.exception, InputError)
    assert message in str(result.exception)
    assert not out.exists()


def test_other_files_and_the_source_are_never_overwritten(tmp_path: Path) -> None:
    given = ["--into", str(ROD), "--gearbox", "heated_rod", "--effect", "gain", "--output", str(tmp_path)]
    assert CliRunner().invoke(conceal, [*given, "--seed", "1"]).exit_code == 0
    written = tmp_path / "recordings" / "heated_rod.csv.gz"
    first = written.read_bytes()
    assert "another case" in str(CliRunner().invoke(conceal, [*given, "--seed", "2"]).exception)
    source = ["--into", str(written), "--gearbox", "heated_rod", "--effect", "gain", "--output", str(tmp_path)]
    assert "would be lost" in str(CliRunner().invoke(conceal, [*source, "--seed", "3"]).exception)
    (tmp_path / "recordings" / "mapping.toml").write_text("schema = 1\n")
    assert "holds other files (mapping.toml)" in str(CliRunner().invoke(conceal, [*given, "--seed", "1"]).exception)
    assert written.read_bytes() == first
