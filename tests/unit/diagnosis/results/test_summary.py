"""The few lines that a terminal or a notebook shows of a diagnosis."""

from __future__ import annotations

from dataclasses import replace

from diagnosis.report.page import page
from diagnosis.results.result import AHEAD, NOT_ACCEPTED, VERDICT_TEXT, Ranked
from tests.unit.diagnosis.diagnosis_example import consistent, missing_physics, unexplained


def test_what_was_found_where_and_how_well_it_fits() -> None:
    lines = missing_physics().summary()
    assert lines[0] == f"missing physics: {VERDICT_TEXT['missing_physics']}"
    assert "[windage at oil, probability 0.9" in lines[1]
    assert "strength = 18.4 ± 1.1 W, " in lines[2] and lines[2].endswith(", mean |heat| = 21.0 ± 1.3 W")
    assert any(line.strip().startswith("not ruled out: pocketing at ") for line in lines)
    assert "Where: oil (0.96); speed above 2900 1/min" in lines
    assert "RMSE held-out: 5.21 K as delivered, 3.62 K calibrated, 0.52 K with the findings (noise 0.20 K)" in lines
    assert lines[-1].startswith("Next: Hold 20 m/s")
    assert len(lines) <= 10


def test_a_rival_that_the_held_out_recordings_refused_is_not_told_as_one_among_others() -> None:
    found = missing_physics()
    (finding,) = found.findings
    first, *rest = finding.confusable_with
    reported = replace(finding, probability=0.1, confusable_with=(replace(first, probability=0.21), *rest))
    lines = [line.strip() for line in replace(found, findings=(reported,)).summary()]
    assert any(line.startswith(f"{AHEAD}: {first.mechanism} at {first.place} (0.21)") for line in lines)
    near = replace(reported, confusable_with=(replace(first, probability=0.19), *rest))
    assert AHEAD not in str(replace(found, findings=(near,)))


def test_what_is_nearest_to_something_without_a_name_is_told() -> None:
    ranking = tuple(
        Ranked(mechanism=name, place="mesh", family="", log_bayes=log_bayes, probability=probability)
        for name, log_bayes, probability in (
            ("open_after_faster_loss", 190.0, 0.65), ("open_torque_loss", 170.0, 0.33), ("bearing_preload", 70.0, 0.02)
        )
    )  # fmt: skip
    nameless = replace(unexplained(), findings=(), ranking=ranking)
    reported = f"Most like: open_after_faster_loss at mesh (0.65), open_torque_loss at mesh (0.33); {NOT_ACCEPTED}"
    assert reported in nameless.summary()
    shown = page(nameless)
    assert "<b>Most like:</b> open form (after faster, a loss) at mesh (0.65)" in shown
    assert NOT_ACCEPTED in shown
    for other in (unexplained(), replace(consistent(), ranking=ranking)):
        assert other.nearest == () and "Most like" not in str(other) and "<b>Most like" not in page(other)


def test_parameters_far_from_their_priors_are_told_the_farthest_first() -> None:
    usual = consistent()
    assert not any(line.startswith("Far from") for line in usual.summary())  # all within 2.6 sd
    seal, bearing, *rest = usual.calibration
    far = (replace(bearing, parameter="bearing", value=1.9, shift_in_sd=3.2),
           replace(seal, parameter="seal", value=0.319, shift_in_sd=-4.57))  # fmt: skip
    lines = replace(usual, calibration=(*far, *rest)).summary()
    assert "Far from what the definition expects: seal = 0.319 (4.6 sd), bearing = 1.9 (3.2 sd)" in lines


def test_every_likely_place_is_told_with_what_the_first_one_does() -> None:
    """A cooler at the inlet, and air that was not recorded: both are true."""
    base = missing_physics()
    first, other = base.location
    both = replace(
        base, location=(first, replace(other, node="air", probability=0.52), replace(other, probability=0.48))
    )
    assert "Where: oil (0.96), air (0.52); speed above 2900 1/min" in str(both).splitlines()
