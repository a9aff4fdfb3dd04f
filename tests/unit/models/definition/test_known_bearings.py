"""Bearings by designation: a table that names one is complete, and says what is typical."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from models.assembly.gearbox import Gearbox, load_gearbox, read_gearbox
from models.base.errors import InputError
from models.definition.known_bearings import FILLED, filled_by_designation, known_bearings
from models.definition.values_with_source import Annotations
from models.files.toml_file import packaged, read_text

FZG = read_text(packaged("gearboxes", "fzg"))


def without_sizes(text: str) -> str:
    """A definition whose bearings leave out what their designation tells."""
    before, bearings = text.split("[[bearing]]", 1)
    kept = [line for line in bearings.split("[[seal]]")[0].splitlines() if line.partition(" =")[0] not in FILLED]
    return before + "[[bearing]]" + "\n".join(kept) + "\n\n[[seal]]" + bearings.split("[[seal]]", 1)[1]


def test_a_bearing_is_filled_by_its_designation() -> None:
    filled, full = read_gearbox(without_sizes(FZG), file="own.toml"), load_gearbox("fzg")
    assert filled.hash == full.hash  # the numbers of the FZG rig are those of the catalogue
    assert filled.source_of("bearing.0.bore_mm").startswith("typical: NU 406")
    assert filled.priors["bearing.3.R1"] == pytest.approx(0.1 * full.bearing[3].R1)


@pytest.mark.parametrize("name", known_bearings())
def test_sizes_are_those_of_the_dimension_series(name: str) -> None:
    """ISO 15: bore of a two-digit number is five times it, and a solid ring of that size is heavier by a third."""
    values = filled_by_designation({"designation": name}, Annotations(), "bearing.0")
    d, D, B = values["bore_mm"], values["outside_diameter_mm"], values["width_mm"]
    assert d == 5.0 * int(name[-2:])
    solid_kg = 7830.0 * 3.141593 / 4.0 * (D**2 - d**2) * B * 1e-9
    assert 0.62 < values["mass_kg"] / solid_kg < 0.82


def test_what_a_file_gives_is_kept() -> None:
    notes = Annotations()
    own = {"designation": "NU 207 ECP", **dict.fromkeys(FILLED, 1.0)}
    assert filled_by_designation(own, notes, "bearing.0") == own
    assert filled_by_designation({**own, "designation": "my own"}, notes, "bearing.0")["designation"] == "my own"
    assert not notes.sources and not notes.faults


def test_an_unknown_designation_is_one_fault_that_says_what_to_give(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text(without_sizes(FZG).replace('designation = "NU 406"', 'designation = "NU 999"'), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_gearbox(file)
    lines = str(caught.value).splitlines()
    assert len(lines) == 4  # one per bearing, and no line for every key that follows from it
    assert "bearing 'bearing_1'.designation: sizes of 'NU 999' are not known; give bore_mm" in lines[0]
    assert "type, S1 (balls, tapers) or S2 (rollers) (known are" in lines[0]
    assert (
        "Bearings of other types than cylindrical_roller, deep_groove_ball, tapered_roller are not supported"
        in lines[0]
    )


@pytest.mark.parametrize(
    ("written", "known"), [("NJ 207 ECP", "NU 207"), ("NU2210", "NU 2210"), ("N 306", "NU 306"), ("6208-2Z", "6208")]
)
def test_what_a_designation_is_taken_for(written: str, known: str) -> None:
    def filled(name: str) -> dict[str, object]:
        return filled_by_designation({"designation": name}, Annotations(), "bearing.0")

    assert filled(written) | {"designation": known} == filled(known)
    assert filled(known)["bore_mm"] == 5.0 * int(known[-2:])


@pytest.mark.parametrize(("name", "fault"), [
    ("6208-2RS1", "'6208-2RS1' has seals that rub, and open bearings are known; give bore_mm, outside_diameter_mm"),
    *((name, f"sizes of '{name}' are not known") for name in ("QJ 208", "208", "62208", "NUP 2299", "62299-RS")),
])  # fmt: skip
def test_a_seal_and_other_types_are_not_known(name: str, fault: str) -> None:
    notes = Annotations()
    assert filled_by_designation({"designation": name}, notes, "bearing.0") == {"designation": name}
    ((path, said),) = notes.faults
    assert path == "bearing.0.designation"
    assert said.startswith(fault)


def test_another_type_brings_its_constants() -> None:
    rig = load_gearbox("fzg")
    balls = rig.with_values({f"bearing.{index}.designation": "6406" for index in range(4)})
    assert [(b.type, b.R1, b.S1, b.S2, b.K_Z, b.K_L, b.mu_EHL) for b in balls.bearing] == [
        ("deep_groove_ball", 3.6e-7, 2.43e-3, 198.0, 3.1, None, 0.05)
    ] * 4
    assert {path.split(".")[-1] for path in balls.priors if path.startswith("bearing.0")} >= {"S1", "R1", "mass_kg"}
    assert "bearing.0.static_load_kN" not in balls.priors
    assert balls.bearing[0].static_load_kN == 23.6
    back = balls.with_values({f"bearing.{index}.designation": "NU 406" for index in range(4)})
    assert back.hash == rig.hash


def test_own_friction_of_a_film_stays_with_the_type() -> None:
    rig = load_gearbox("fzg").with_values({"bearing.0.mu_EHL": 0.015})
    assert rig.with_values({"bearing.0.designation": "NU 306"}).bearing[0].mu_EHL == 0.015


HELICAL = {"stage.0.helix_angle_deg": 2.0, "bearing.0.locating": True, "bearing.2.locating": True}


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"bearing.0.locating": False}, "bearing: none of those on 'shaft_1' is locating; gears of helix_angle_deg"),
        ({"bearing.1.locating": True}, "bearing: 2 of those on 'shaft_1' are locating"),
        ({}, "bearing 'bearing_1'.locating: NU 406 lets the shaft move: an NJ, an NUP, a ball or a taper bearing"),
        (
            {"bearing.1.designation": "30206", "bearing.0.designation": "NJ 406"},
            "bearing: 1 of those on 'shaft_1' are taper bearings; they come in adjusted pairs",
        ),
        (
            {"bearing.0.type": "tapered_roller", "bearing.0.S1": 0.017},
            "bearing 'bearing_1': a tapered_roller bearing needs Y",
        ),
        (
            {"bearing.0.type": "deep_groove_ball", "bearing.0.S1": 0.003, "bearing.0.K_L": None, "bearing.0.S2": None},
            "bearing 'bearing_1'.locating: S2 of its series (SKF) and static_load_kN",
        ),
        (
            {"bearing.0.designation": "6406", "bearing.0.load_share": 0.0, "bearing.1.load_share": 1.0},
            "bearing 'bearing_1'.locating: its load_share is 0",
        ),
    ],
)  # fmt: skip
def test_bearings_that_cannot_take_what_helical_gears_push(changes: dict[str, object], fault: str) -> None:
    with pytest.raises(InputError, match=re.escape(fault)):
        load_gearbox("fzg").with_values(HELICAL | changes)


def test_bearings_that_can(fzg: Gearbox) -> None:
    for name in ("NJ 406", "NUP 406 ECP", "6406", "30206"):
        helical = fzg.with_values(HELICAL | {f"bearing.{i}.designation": name for i in range(4)})
        assert [bearing.axial_fault() for bearing in helical.bearing if bearing.locating] == [None, None]
