from __future__ import annotations

import math
from dataclasses import replace

import pytest

from builder.fmi.signals import SignalTable, fmi_name, result_column, signal_table
from builder.surrogate.train import TrainingResult
from models.assembly.gearbox import Gearbox
from models.base.errors import InputError
from models.network.laws import Parameter
from models.quantities.units import UNITS


@pytest.fixture(scope="module")
def table(fzg: Gearbox, fzg_training: TrainingResult) -> SignalTable:
    return signal_table(fzg.network(), fzg_training.losses)


def test_every_node_loss_and_parameter_has_its_signals(fzg: Gearbox, table: SignalTable) -> None:
    network = fzg.network()
    names = {signal.name for signal in table}
    assert {f"{node.name}.T" for node in network.nodes} <= names
    assert {f"{part.name}.T_start" for part in network.parts} <= names
    assert {f"loss.{source.name}" for source in network.sources} <= names
    assert {f"factor.{parameter.name}" for parameter in network.parameters} <= names


def test_references_are_places_in_the_table(table: SignalTable) -> None:
    assert [signal.reference for signal in table] == list(range(len(table)))


def test_columns_are_those_of_a_result(fzg: Gearbox, table: SignalTable) -> None:
    columns = [signal.column for signal in table if signal.column is not None]
    losses = [f"P_loss_{source.name}_W" for source in fzg.network().sources]
    assert columns == [
        "speed_rpm", "torque_Nm", "T_ambient_degC", "air_speed_m_s",
        *(f"T_{node}_degC" for node in fzg.network().node_names),
        "P_loss_W", *losses, "torque_loss_Nm", "efficiency", "in_domain",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("unit", "si", "column"),
    [
        ("rad/s", 100.0 * math.pi / 3.0, 1000.0),
        ("K", 353.15, 80.0),
        ("N.m", 3.0, 3.0),
        ("m/s", 2.0, 2.0),
        ("W", 7.0, 7.0),
    ],
)
def test_conversion_from_file_columns(unit: str, si: float, column: float) -> None:
    factor, offset = UNITS[unit].to_column
    assert (column - offset) / factor == pytest.approx(si, rel=1e-11)


def test_trained_range_is_the_definition_s(fzg: Gearbox, table: SignalTable) -> None:
    low, high = table["speed"].domain or (0.0, 0.0)
    assert (low * 30.0 / math.pi, high * 30.0 / math.pi) == pytest.approx(fzg.training.speed_rpm)
    assert table["torque"].domain == pytest.approx(fzg.training.torque_Nm)
    assert table["oil.T"].domain == pytest.approx(tuple(T + 273.15 for T in fzg.training.temperature_degC))
    assert table["mesh.T"].domain is None


def test_dependencies_are_those_of_the_laws(table: SignalTable) -> None:
    assert table["oil.T"].depends == ()
    assert table["oil.T"].depends_initially == ("initial.uniform", "initial.T", "oil.T_start")
    assert table["air.T"].depends == table["air.T"].depends_initially == ("T_ambient",)
    assert table["loss.churning"].depends == ("speed", "torque")
    assert "factor.churning" in table["loss.churning"].depends_initially
    assert "factor.mesh" not in table["loss.churning"].depends_initially


def test_terms_of_a_user_get_signals(fzg: Gearbox) -> None:
    network = (
        fzg.network()
        .with_input("flow", 2.5)
        .with_parameter(Parameter(name="cooling", unit="W/K", start=4.0, lower=0.0, upper=10.0))
        .with_state("memory", start=3.0)
        .with_state("switch", start=0.0, update=lambda s: s.switch)
        .with_source("oil", lambda s: -s.cooling * s.flow * s.T_ambient, name="oil-cooler 1")
    )
    table = signal_table(network)
    assert (table["flow"].start, table["flow"].unit, table["flow"].column) == (2.5, "1", "flow")
    cooling = table["factor.cooling"]
    assert (cooling.unit, cooling.start, cooling.minimum, cooling.maximum) == ("W/K", 4.0, 0.0, 10.0)
    heat = table["heat.'oil-cooler 1'"]
    assert heat.depends == ("T_ambient", "flow") or heat.depends == ("flow", "T_ambient")
    assert heat.column is None
    assert heat.minimum == -math.inf
    assert table["state.memory"].causality == "local"
    assert table["state.switch"].variability == "discrete"


def test_start_outside_its_bounds_widens_them(fzg: Gearbox) -> None:
    network = fzg.network().with_parameter(Parameter(name="odd", start=30.0, lower=0.1, upper=20.0))
    assert signal_table(network)["factor.odd"].maximum == 30.0


def test_names_that_clash_are_refused(table: SignalTable) -> None:
    with pytest.raises(InputError, match=r"two signals of the FMU would be called 'oil\.T'"):
        SignalTable([table["oil.T"], table["oil.T"]])


def test_unknown_signal_names_the_nearest(table: SignalTable) -> None:
    with pytest.raises(InputError, match=r"did you mean 'oil\.T'"):
        table["oil_T"]


def test_quoted_names_survive_the_way_to_a_column() -> None:
    assert result_column(f"loss.{fmi_name('a b')}") == "P_loss_a b_W"
    assert result_column(f"{fmi_name('oil-2')}.T") == "T_oil-2_degC"


def test_nomenclature_has_one_line_per_signal(table: SignalTable) -> None:
    lines = table.markdown().splitlines()
    assert len(lines) == 2 + len(table)
    assert {line.count("|") for line in lines} == {10}


def test_the_domain_is_that_of_the_networks(fzg: Gearbox, fzg_training: TrainingResult) -> None:
    losses = replace(fzg_training.losses, temperature_bounds=(20.0, 120.0))
    assert signal_table(fzg.network(), losses)["oil.T"].domain == pytest.approx((293.15, 393.15))


def test_a_name_that_begins_another_is_refused(table: SignalTable) -> None:
    """Under structured names ``speed`` cannot be a number and a record."""
    clash = replace(table["oil.T"], name="speed.T")
    with pytest.raises(InputError, match=r"the FMU would have the signals 'speed' and 'speed\.T'; rename a node"):
        SignalTable([*table.signals, clash])
