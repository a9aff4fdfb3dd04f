"""A diagnosis as tables and figures."""

from __future__ import annotations

from collections.abc import Iterator

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot as plt

from models.base.errors import InputError
from tests.unit.diagnosis.diagnosis_example import consistent, missing_physics

FOUND = missing_physics()


@pytest.fixture(autouse=True)
def _no_window() -> Iterator[None]:
    mpl.use("Agg")
    yield
    plt.close("all")


def test_findings_have_a_row_per_number() -> None:
    table = FOUND.to_dataframe()
    (finding,) = FOUND.findings
    assert table["parameter"].tolist() == [p.name for p in finding.parameters]
    assert set(table["mechanism"]) == {"windage"} and set(table["grade"]) == {finding.grade}
    assert consistent().to_dataframe().empty


def test_the_other_tables_are_those_of_the_file() -> None:
    explanations = FOUND.to_dataframe("explanations")
    assert explanations["probability"].tolist() == [r.probability for r in FOUND.ranking]
    assert len(FOUND.to_dataframe("calibration")) == len(FOUND.calibration)
    errors = FOUND.to_dataframe("errors").set_index(["recordings", "channel"])
    assert errors.loc[("holdout", "oil"), "rmse_after"] == FOUND.holdout.sensors["oil"][2]
    assert errors.loc[("train", "P_loss"), "unit"] == "W"
    with pytest.raises(InputError, match="'finding' is not a table of a diagnosis; did you mean 'findings'"):
        FOUND.to_dataframe("finding")  # type: ignore[arg-type]


def test_one_line_names_verdict_and_findings() -> None:
    text = repr(FOUND)
    assert "\n" not in text and "missing physics; claim: windage at oil" in text
    assert "no findings" in repr(consistent())


def test_bars_are_the_most_probable_explanations() -> None:
    ax = FOUND.plot()
    widths = [bar.get_width() for bar in ax.patches]  # type: ignore[attr-defined]
    assert widths == sorted(widths) and widths[-1] == max(r.probability for r in FOUND.ranking)
    assert ax.get_yticklabels()[-1].get_text().startswith("windage at oil")


def test_a_run_has_measured_and_predicted_columns() -> None:
    run = FOUND.courses[0]
    table = run.to_dataframe()
    np.testing.assert_array_equal(table["T_oil_degC_after"], run.after["oil"])
    np.testing.assert_array_equal(table["P_loss_W"], run.measured["P_loss"])
    assert "\n" not in repr(run)


def test_a_channel_is_drawn_as_measured_and_by_three_models() -> None:
    run = FOUND.courses[0]
    ax = run.plot("P_loss")
    assert [line.get_label() for line in ax.lines] == ["measured", "as delivered", "calibrated", "corrected"]
    assert ax.get_ylabel() == "Power loss in W"
    errors = {c: np.nanmean((run.before[c] - run.measured[c]) ** 2) for c in run.measured if c != "P_loss"}
    worst = max(errors, key=lambda c: errors[c])
    assert run.plot().get_title().startswith(worst.replace("_", " "))
    with pytest.raises(InputError, match="'oli' was not measured in train_1; did you mean 'oil'"):
        run.plot("oli")
