"""Diagnoses of every kind, from made-up arrays, for what shows them to people."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from diagnosis.decision.settings import Settings
from diagnosis.results.predicted_run import PredictedRun
from diagnosis.results.result import Diagnosis
from diagnosis.results.result_parts import (
    Calibrated,
    CalibratedModel,
    Errors,
    Finding,
    Fits,
    Location,
    NotDetectable,
    ParameterValue,
    Ranked,
    Rival,
)
from diagnosis.setup.shapes import shape_terms
from models.assembly.gearbox import load_gearbox
from models.base.types import Array
from models.mechanisms import CATALOGUE, Placed, Scale

CHANNELS = ("oil", "housing_lower", "housing_upper", "bearing_1", "bearing_3", "pinion", "P_loss")
RECORDINGS = {
    "train_1": (64800.0, False),
    "train_2": (7200.0, False),
    "hold_1": (7200.0, True),
    "hold_2": (14400.0, True),
}
GEARBOX = load_gearbox("fzg")
NETWORK = GEARBOX.network()
SCALE = Scale.of(GEARBOX, speed=3000.0, torque=94.0)
NOISE = 0.2
SHAPES = shape_terms(NETWORK, SCALE)
PARAMETERS = (*NETWORK.parameters, *(term.strength for term in SHAPES))
SHIFTS = np.linspace(-2.6, 1.4, len(PARAMETERS))  # standard deviations of the prior
TYPICAL = 3000.0  # 1/min


def placed(mechanism: str, place: str) -> Placed:
    return next(one for one in CATALOGUE[mechanism].placed(NETWORK, SCALE) if one.place == place)


def missing_physics() -> Diagnosis:
    """Windage in the oil, with pocketing not ruled out."""
    windage = _windage()
    return _diagnosis(
        verdict="missing_physics",
        log_e_value=41.3,
        findings=(windage,),
        location=(
            Location(nodes=("oil",), probability=0.962, heat_mean_W=21.0, heat_max_W=66.0,
                     regime="speed above 2900 1/min",
                     when=(("train_1", 32400.0, 64800.0), ("train_2", 2400.0, 4100.0))),
            Location(nodes=("mesh",), probability=0.031, heat_mean_W=9.0, heat_max_W=30.0,
                     regime="speed above 2900 1/min", when=(("train_1", 32400.0, 64800.0),)),
        ),
        courses=tuple(_course(name, lacking=6.0) for name in RECORDINGS),
        train=_fits(4.13, 2.98, 0.41),
        holdout=_fits(5.21, 3.62, 0.52),
        remaining_nat=0.9,
        remaining_note="Nothing that these recordings could show remains.",
        next_test="Hold 20 m/s without load at two oil temperatures that lie 30 K apart.",
        ranking=_ranking(("windage", "oil", 0.914), ("pocketing", "oil", 0.061), ("churning_swirl", "oil", 0.019)),
    )  # fmt: skip


def two_effects() -> Diagnosis:
    """A cooler with a thermostat, whose law has cases and a new boundary, beside a fault of a bearing's seat."""
    cooler, seat = placed("cooler_thermostat", "oil"), placed("bearing_seat_contact", "bearing_1_housing")
    base = missing_physics()
    findings = (
        replace(base.findings[0], mechanism="cooler_thermostat", family=cooler.family, kind="link", term=cooler,
                says=cooler.says, reference=cooler.mechanism.reference,
                equation=cooler.equation({cooler.strength.name: 11.3}), confusable_with=(),
                parameters=(ParameterValue(name="strength", value=11.3, stderr=0.6, unit="W/K"),),
                heat_mean_W=80.0, heat_max_W=310.0),
        replace(base.findings[0], mechanism="bearing_seat_contact", place="bearing_1_housing", node="bearing_1",
                family=seat.family, kind="link_factor", term=seat, says=seat.says, equation=seat.equation(),
                probability=0.58,
                parameters=(ParameterValue(name="strength", value=-0.62, stderr=0.2, unit="1"),)),
    )  # fmt: skip
    return replace(base, findings=findings)


def sensor_fault() -> Diagnosis:
    """A drifting thermometer; the gearbox is well."""
    drift = placed("sensor_drift", "bearing_1")
    finding = Finding(
        mechanism="sensor_drift", family=drift.family, place="bearing_1", node="bearing_1", kind="sensor",
        says=drift.says, reference=drift.mechanism.reference, equation=drift.equation(), probability=0.998,
        log_bayes=63.0, term=drift,
        parameters=(ParameterValue(name="strength", value=-3.12, stderr=0.15, unit="K"),),
    )  # fmt: skip
    return replace(
        missing_physics(), verdict="sensor_fault", findings=(finding,), location=(),
        ranking=_ranking(("sensor_drift", "bearing_1", 0.998)), next_test="Exchange the sensor and repeat.",
    )  # fmt: skip


def consistent() -> Diagnosis:
    """Nothing is missing."""
    return _diagnosis(
        verdict="consistent",
        log_e_value=-0.8,
        courses=tuple(_course(name, lacking=0.3) for name in RECORDINGS),
        train=_fits(0.92, 0.31, 0.31),
        holdout=_fits(1.02, 0.38, 0.38),
        remaining_nat=0.5,
        remaining_note="Nothing remains.",
        ranking=_ranking(("pump_heat", "oil", 0.04), ("aeration", "oil_gears", 0.02)),
    )


def unexplained() -> Diagnosis:
    """Heat without a form: nothing in the catalogue fits it."""
    base = missing_physics()
    heat = Finding(
        mechanism="unknown_heat", family="unknown", place="housing_lower", node="housing_lower", kind="source",
        says="Heat comes to the lower housing at times that none of the recorded signals explains.", reference="",
        equation="", probability=0.83, log_bayes=22.0, parameters=(), heat_mean_W=14.0, heat_max_W=48.0,
        heat={"train_2": (np.linspace(0.0, 7200.0, 200), 30.0 * (np.linspace(0.0, 20.0, 200) % 4.0 < 1.0))},
    )  # fmt: skip
    place = replace(base.location[0], nodes=("housing_lower",), probability=0.83, regime="no regime of speed or torque")
    return replace(
        base, verdict="unexplained", findings=(heat,), location=(place,),
        train=_fits(4.1, 3.0, 1.9), holdout=_fits(5.2, 3.6, 3.1), misfit=2.7, remaining_nat=6.9,
        remaining_note="Heat in the lower housing whose cause is not in the catalogue.",
    )  # fmt: skip


def insufficient_data() -> Diagnosis:
    """Ten minutes at one operating point, and nothing held out."""
    nothing = float("nan")
    return _diagnosis(
        verdict="insufficient_data",
        log_e_value=0.1,
        courses=(_course("short", lacking=0.2, duration=600.0, held_out=False),),
        train=_fits(0.4, 0.21, 0.21),
        holdout=Fits(before=nothing, calibrated=nothing, found=nothing, after=nothing, sensors={}, recordings={}),
        remaining_nat=0.0,
        remaining_note="",
        ranking=(),
        unseen=tuple(
            NotDetectable(mechanism=one.name, place=one.places[0], needed=one.experiment)
            for one in list(CATALOGUE.values())[:30]
        ),
        next_test="Drive the staircase of speeds at two torques, 18 h, and one cycle with changing load.",
    )


EXAMPLES = {
    example.__name__: example
    for example in (missing_physics, two_effects, sensor_fault, consistent, unexplained, insufficient_data)
}


# ------------------------------------------------------------------ parts


def _windage() -> Finding:
    windage = placed("windage", "oil")
    strength, exponent = (parameter.name for parameter in windage.parameters)
    time = np.linspace(0.0, 64800.0, 400)
    return Finding(
        mechanism="windage",
        family=windage.family,
        place="oil",
        node="oil",
        kind="source",
        says=windage.says,
        reference=windage.mechanism.reference,
        equation=windage.equation({strength: 18.43, exponent: 2.87}),
        probability=0.914,
        log_bayes=44.2,
        parameters=(
            ParameterValue(name="strength", value=18.43, stderr=1.12, unit="W"),
            ParameterValue(name="exponent", value=2.87, stderr=0.09, unit="1"),
        ),
        confusable_with=(
            *(
                Rival(mechanism=other, place="oil", probability=p,
                      separate_by=windage.mechanism.separate_by.get(other, windage.mechanism.experiment))
                for other, p in (("pocketing", 0.061), ("churning_swirl", 0.019))
            ),
        ),
        heat_mean_W=21.0,
        heat_stderr_W=1.3,
        heat_max_W=66.0,
        heat={"train_1": (time, _law(_speed(time, 64800.0)))},
        term=windage.with_values({strength: 18.43, exponent: 2.87}),
    )  # fmt: skip


def _diagnosis(**given: object) -> Diagnosis:
    usual: dict[str, object] = {
        "gearbox": "fzg",
        "threshold": 3.9,
        "further_threshold": 3.9,
        "settings": Settings(false_alarm_rate=0.05),
        "location": (),
        "findings": (),
        "model": CalibratedModel(calibration=tuple(
            Calibrated(parameter=p.name, prior=p.start, value=p.start + 0.08 * shift, stderr=0.05,
                       estimate=p.start + 0.1 * shift, estimate_stderr=0.06, shift_in_sd=shift)
            for p, shift in zip(PARAMETERS, SHIFTS.tolist(), strict=True)
        )),
        "noise_K": NOISE,
        "misfit": 0.62,
        "floor": "random heat of 0.5 % of the typical loss (140 W) in every part: assumed",
        "unseen": (
            NotDetectable(mechanism="aeration", place="oil_gears", needed="hold 20 m/s for three hours"),
            NotDetectable(mechanism="hot_neighbour", place="housing_lower", needed="let the rig stand for a night"),
        ),
        "next_test": "",
        "network": NETWORK,
        "shapes": SHAPES,
        "inputs": {"recordings": {"train_1": "9b1c" * 16}, "held_out": {"hold_1": "04de" * 16},
                   "switched_off": ["windage"], "gearbox": "3f7a" * 16, "version": "0.1.0"},
        "notes": ("train_1: 14 outliers of bearing_3 removed (rows 120, 688, ...)",),
    }  # fmt: skip
    return Diagnosis(**(usual | given))  # type: ignore[arg-type]


def _ranking(*first: tuple[str, str, float]) -> tuple[Ranked, ...]:
    rest = [(name, "oil", 0.0004) for name in CATALOGUE if name not in {one[0] for one in first}]
    return tuple(
        Ranked(mechanism=name, place=place, probability=p, log_bayes=44.0 - 2.5 * rank,
               family=CATALOGUE[name].family, laws=(name,))
        for rank, (name, place, p) in enumerate([*first, *rest])
    )  # fmt: skip


def _fits(before: float, calibrated: float, after: float) -> Fits:
    sensors = {
        channel: Errors(40.0, 22.0, 6.0) if channel == "P_loss" else Errors(before * k, calibrated * k, after * k)
        for k, channel in zip(np.linspace(1.3, 0.7, len(CHANNELS)).tolist(), CHANNELS, strict=True)
    }
    recordings = {f"{name}_1": Errors(before, calibrated, after) for name in ("morning", "evening")}
    return Fits(before=before, calibrated=calibrated, found=after, after=after, sensors=sensors, recordings=recordings)


def _speed(time: Array, duration: float) -> Array:
    """A staircase with a standstill at its end."""
    step = np.floor(6.0 * time / duration)
    return np.where(step < 5.0, 400.0 + 1000.0 * step, 0.0)


def _law(speed: Array) -> Array:
    return np.asarray(18.43 * (speed / TYPICAL) ** 2.87)


def _course(name: str, *, lacking: float, duration: float | None = None, held_out: bool | None = None) -> PredictedRun:
    usual_duration, usual_role = RECORDINGS.get(name, (600.0, False))
    duration = duration or usual_duration
    rng = np.random.default_rng(len(name))
    time = np.arange(0.0, duration, 10.0)
    time = time[(time < 0.62 * duration) | (time > 0.66 * duration)]  # a gap
    speed = _speed(time, duration)
    torque = np.where(time % (duration / 3.0) < duration / 6.0, 94.0, 30.0)
    warm = 27.0 + 45.0 * (1.0 - np.exp(-4.0 * time / duration)) + 6.0 * np.sin(9.0 * time / duration)
    lack = lacking * (speed / TYPICAL) ** 2
    measured, before, calibrated, after = {}, {}, {}, {}
    for index, channel in enumerate(CHANNELS):
        truth = (60.0 + 0.05 * speed if channel == "P_loss" else warm + 3.0 * index) + lack
        noise = rng.normal(0.0, NOISE, len(time))
        measured[channel] = np.where(rng.random(len(time)) < 0.01, np.nan, np.round(truth + noise, 1))
        before[channel], calibrated[channel], after[channel] = truth - lack, truth - 0.6 * lack + 0.8, truth + 0.1
    return PredictedRun(
        recording=name,
        held_out=usual_role if held_out is None else held_out,
        time=time,
        inputs={"speed": speed, "torque": torque, "T_ambient": np.full(len(time), 25.0)},
        measured=measured,
        before=before,
        calibrated=calibrated,
        after=after,
        counts_from_s=0.05 * duration,
    )
