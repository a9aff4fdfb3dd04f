from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from fmpy.validation import validate_fmu

from builder.fmi.model_description import FmuIdentity, model_description
from builder.fmi.model_description3 import model_description3
from builder.fmi.signals import SignalTable, signal_table
from builder.surrogate.train import TrainingResult
from models.assembly.gearbox import Gearbox, load_gearbox

IDENTITY = FmuIdentity(
    model_name="a < b & c",
    model_identifier="box",
    description="Überlast",
    version="1",
    author="me",
    license="x",
    copyright="y",
    generation_tool="z",
    flags={"needsExecutionTool": True, "canGetAndSetFMUstate": False},
)


def parsed(xml: bytes) -> ET.Element:
    return ET.fromstring(xml)


@pytest.fixture(scope="module")
def table(fzg: Gearbox, fzg_training: TrainingResult) -> SignalTable:
    return signal_table(fzg.network(), fzg_training.losses)


@pytest.fixture(scope="module")
def root(table: SignalTable) -> ET.Element:
    return parsed(model_description(table, IDENTITY))


def test_same_arguments_same_bytes(table: SignalTable) -> None:
    assert model_description(table, IDENTITY) == model_description(table, IDENTITY)
    assert b"generationDateAndTime" not in model_description(table, IDENTITY)


def test_guid_depends_on_description_and_content(table: SignalTable) -> None:
    guids = {
        parsed(xml).get("guid")
        for xml in (
            model_description(table, IDENTITY),
            model_description(table, IDENTITY, content=b"x"),
            model_description(table, replace(IDENTITY, version="2")),
            model_description(SignalTable(list(table)[:-1]), IDENTITY),
        )
    }
    assert len(guids) == 4


def test_texts_are_escaped(root: ET.Element) -> None:
    assert root.get("modelName") == "a < b & c"
    assert root.get("description") == "Überlast"


def test_flags_and_sources_are_the_callers(table: SignalTable, root: ET.Element) -> None:
    simulation = root.find("CoSimulation")
    assert simulation is not None
    assert simulation.get("needsExecutionTool") == "true"
    assert simulation.get("canGetAndSetFMUstate") == "false"
    native = parsed(model_description(table, replace(IDENTITY, source_files=("a.c", "b.c"))))
    assert [f.get("name") for f in native.iterfind("CoSimulation/SourceFiles/File")] == ["a.c", "b.c"]


def test_units_have_base_units_and_display_units(root: ET.Element) -> None:
    units = {unit.get("name"): unit for unit in root.iterfind("UnitDefinitions/Unit")}
    assert set(units) == {"rad/s", "N.m", "K", "m/s", "W", "J", "1"}
    watt, kelvin, speed = (units[name] for name in ("W", "K", "rad/s"))
    assert dict(watt[0].attrib) == {"kg": "1", "m": "2", "s": "-3"}
    assert watt[1].attrib == {"name": "kW", "factor": "0.001"}
    assert kelvin[1].attrib == {"name": "degC", "offset": "-273.15"}
    assert speed[1].get("name") == "rpm"
    assert float(speed[1].get("factor", "")) == pytest.approx(9.549296585513721)


def test_indices_of_the_structure_are_one_based_places(root: ET.Element, table: SignalTable) -> None:
    names = [v.get("name") for v in root.iterfind("ModelVariables/ScalarVariable")]
    unknowns = {names[int(u.get("index", "")) - 1]: u for u in root.iterfind("ModelStructure/InitialUnknowns/Unknown")}
    assert set(unknowns) == {signal.name for signal in table if signal.causality == "output"}
    depends = [names[int(i) - 1] for i in unknowns["oil.T"].get("dependencies", "").split()]
    assert depends == ["initial.uniform", "initial.T", "oil.T_start"]


def test_kinds_of_dependencies_are_those_of_the_laws() -> None:
    """Air follows the ambient temperature; a cell takes its share, a parameter, of the power."""
    network = load_gearbox("heated_rod").network().with_source(
        "cell_1", lambda s: s.heater_power * s.T_ambient, name="product"
    )  # fmt: skip
    found = {}
    for version in (model_description, model_description3):
        root = parsed(version(signal_table(network), IDENTITY))
        names = [v.get("name") for v in root.iterfind("ModelVariables/*")]
        unknowns = [*root.iterfind("ModelStructure/Outputs/Unknown"), *root.iterfind("ModelStructure/Output")]
        kinds = {
            names[int(u.get("index", 0)) - 1 if u.get("index") else int(u.get("valueReference", ""))]:
            u.get("dependenciesKind") for u in unknowns
        }  # fmt: skip
        found[version] = {name: kinds[name] for name in ("air.T", "heat.heater_cell_1", "heat.product", "cell_1.T")}
    assert [*found.values()] == [
        {"air.T": "constant", "heat.heater_cell_1": "tunable", "heat.product": None, "cell_1.T": None}
    ] * 2


def test_experiment_has_tolerance_and_step(root: ET.Element) -> None:
    experiment = root.find("DefaultExperiment")
    assert experiment is not None
    assert experiment.attrib == {"startTime": "0", "stopTime": "600", "tolerance": "0.0001", "stepSize": "1"}


def test_only_what_must_have_a_start_value_has_one(root: ET.Element) -> None:
    for variable in root.iterfind("ModelVariables/ScalarVariable"):
        has = variable[0].get("start") is not None
        assert has == (variable.get("causality") in ("input", "parameter")), variable.get("name")


def test_fmpy_finds_no_problem(table: SignalTable, tmp_path: Path) -> None:
    (tmp_path / "modelDescription.xml").write_bytes(model_description(table, IDENTITY))
    assert validate_fmu(str(tmp_path)) == []
