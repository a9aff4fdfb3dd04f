"""Notes on a recording that can be read, but is probably not meant so: units, swapped columns, codes of loggers.

None of them is certain, so that nothing is refused and nothing is changed.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from diagnosis.recordings.cleaning import rows_text
from diagnosis.recordings.cold_start import AGREE_K, is_isothermal
from diagnosis.recordings.rows import RecordedRows
from models.portable.evaluation import RPM
from models.quantities.quantities import TOTAL_LOSS

HOT_AIR = 50.0  # degC on average, from which ambient air is more likely in another unit
COLD_START_K = 5.0  # by which temperatures differ in a machine that has stood for long
USUAL_SHARE = 0.99  # of the rows of an input,
FAR_TIMES = 10.0  # which others exceed so many times that they may be codes of a logger
CODES, CODE_TIMES = (999.0, 9999.0, 99999.0, 32767.0, 32768.0, 65535.0), 1.5  # of loggers; beyond what is usual
FAHRENHEIT_K, NEARER = 15.0, 4.0  # above the others at least, if from -20 degC on; times nearer once it is converted
COLDER_K = 3.0  # below the ambient air on average
RESTS_RPM, FEWEST_AT_REST = 1.0, 30  # 1/min; rows
ZERO_SHARE, ZERO_SPREAD = (0.01, 0.25), 0.3  # of the largest torque; of the torque at rest itself
FAR_SDS = 4.0  # of a stated tolerance, from which a start is odd all the same
LEAST_LOSS, MOST_LOSS = 1e-3, 5.0  # of the power, on average; without load all of the power, and more, is lost
BRIEF_S, WARMED_K = 300.0, 15.0  # no gearbox warms that fast
MILLISECONDS = (100.0, 200.0, 500.0, 1000.0, 2000.0)  # s from row to row that are more likely so many milliseconds


def doubts(found: RecordedRows) -> list[str]:
    """Return a note for each thing that is probably not meant so.

    Parameters
    ----------
    found : RecordedRows
        In the units inside, impossible values and outliers taken out
    """
    looked_at = (
        _time_in_another_unit, _hot, _one_in_degF, _off_when_cold, _colder_than_ambient, _far_rows,
        _torque_at_rest, _loss_and_power,
    )  # fmt: skip
    return [note for each in looked_at for note in each(found)]


def _firsts(found: RecordedRows) -> dict[str, float]:
    return {quantity: float(values[np.isfinite(values)][0]) for quantity, values in found.temperatures.items()}


def _time_in_another_unit(found: RecordedRows) -> Iterator[str]:
    if found.clock is None or found.clock.is_date:
        return
    name, steps = found.clock.column, np.diff(found.seconds)
    length, step = float(found.seconds[-1] - found.seconds[0]), float(np.median(steps))
    for quantity, values in found.temperatures.items():
        low, high = np.nanquantile(values, [0.05, 0.95])
        if length < BRIEF_S and high - low > WARMED_K:
            yield (
                f"{name} goes over {length:.3g} s, in which {found.names[quantity]} moves by {high - low:.0f} K: if it "
                'counts minutes or hours, name its unit in a mapping (time.unit = "min")'
            )
            return
    if found.clock.unit == "s" and step in MILLISECONDS and not np.any(np.mod(found.seconds, step)):
        advice = 'if it counts milliseconds, name its unit in a mapping (time.unit = "ms")'
        yield f"{name} advances by {step:g} s from row to row: {advice}"


def _hot(found: RecordedRows) -> Iterator[str]:
    advice = 'if the file has another unit, name it in a mapping (unit = "degF")'
    ambient = found.values.get("T_ambient", np.zeros(0))
    if np.isfinite(ambient).any() and np.nanmean(ambient) > HOT_AIR:
        name = found.names.get("T_ambient", "T_ambient")
        yield f"{name}: {np.nanmean(ambient):.0f} degC on average is hot for ambient air; {advice}"
    if "T_ambient" in found.names:  # in another unit it would be hot as well
        return
    firsts = _firsts(found).values()
    if len(firsts) > 1 and min(firsts) > HOT_AIR and max(firsts) - min(firsts) < COLD_START_K:
        yield (
            f"all temperatures begin at {min(firsts):.0f} to {max(firsts):.0f} degC, alike as in a machine that has "
            f"cooled down, but hot for one; {advice}"
        )


def _one_in_degF(found: RecordedRows) -> Iterator[str]:
    measured = found.temperatures
    for quantity, values in measured.items():
        others = [other for name, other in measured.items() if name != quantity]
        if not others or found.roles[quantity].unit is not None:
            continue
        rows = np.isfinite(values) & np.isfinite(others).any(axis=0)
        if not rows.any():
            continue
        middle = np.nanmedian(np.array(others)[:, rows], axis=0)
        as_read, converted = (np.abs(T - middle) for T in (values[rows], (values[rows] - 32.0) / 1.8))
        if as_read.min() > FAHRENHEIT_K and NEARER * np.quantile(converted, 0.9) < np.median(as_read):
            yield (
                f"{found.names[quantity]} is {np.median(as_read):.0f} K above the other thermometers, and "
                f'{np.median(converted):.1f} K off them if it is in degF: name its unit in a mapping (unit = "degF")'
            )


def _off_when_cold(found: RecordedRows) -> Iterator[str]:
    ambient = found.values.get("T_ambient", np.zeros(0))
    firsts = _firsts(found)
    if not np.isfinite(ambient).any() or not is_isothermal([*firsts.values()], float(ambient[np.isfinite(ambient)][0])):
        return
    middle = float(np.median([*firsts.values()]))
    for quantity, first in firsts.items():
        stated = found.roles[quantity].bias_sd
        if abs(first - middle) > max(AGREE_K, FAR_SDS * (stated or 0.0)):
            advice = (
                "if it is wrong, state its tolerance in a mapping (bias_sd)" if stated is None else
                f"that is far more than its tolerance, a bias_sd of {stated:g} K"
            )  # fmt: skip
            yield (
                f"{found.names[quantity]} begins {abs(first - middle):.1f} K {'above' if first > middle else 'below'} "
                f"the other thermometers, which agree as in a machine that has stood still: {advice}"
            )


def _torque_at_rest(found: RecordedRows) -> Iterator[str]:
    """Note a constant torque at rest that is small next to that in operation: a rig that is clamped has more."""
    if not {"speed", "torque"} <= {*found.names}:
        return
    torque = found.values["torque"]
    seen = np.isfinite(torque)
    rest = torque[seen & (np.abs(found.values["speed"]) < RESTS_RPM)]
    if len(rest) < FEWEST_AT_REST:
        return
    low, zero, high = np.quantile(rest, [0.05, 0.5, 0.95])
    least, most = np.array(ZERO_SHARE) * np.quantile(np.abs(torque[seen]), USUAL_SHARE)
    if least < abs(zero) < most and high - low < ZERO_SPREAD * abs(zero):
        yield (
            f"{found.names['torque']} is {zero:.3g} N m in the rows at rest: if nothing loads the shaft there, that is "
            "the zero of the torque meter, and all other rows are as far off"
        )


def _colder_than_ambient(found: RecordedRows) -> Iterator[str]:
    if "T_ambient" not in found.names:
        return
    ambient = found.values["T_ambient"]
    for quantity, values in found.temperatures.items():
        both = np.isfinite(values) & np.isfinite(ambient)
        below = float(np.mean(ambient[both] - values[both])) if both.any() else 0.0
        if below > COLDER_K:
            yield (
                f"{found.names[quantity]} is {below:.0f} K below {found.names['T_ambient']} on average, although a "
                "gearbox gives heat: see if the two columns are swapped, or in different units"
            )


def _loss_and_power(found: RecordedRows) -> Iterator[str]:
    if not {TOTAL_LOSS, "speed", "torque"} <= {*found.names}:
        return
    power = np.abs(found.values["speed"] * found.values["torque"]) * RPM
    loss = found.values[TOTAL_LOSS]
    both = np.isfinite(power) & np.isfinite(loss)
    if not power[both].any():
        return
    if not LEAST_LOSS < np.mean(loss[both]) / np.mean(power[both]) < MOST_LOSS:
        yield (
            f"{found.names[TOTAL_LOSS]} is {np.mean(loss[both]):.3g} W on average, but {found.names['speed']} and "
            f"{found.names['torque']} give {np.mean(power[both]):.3g} W: see if one of them is in another unit"
        )


def _far_rows(found: RecordedRows) -> Iterator[str]:
    """Note rows of an input far beyond all others, which may be codes of a logger."""
    for name, given in found.machine.inputs.items():
        size = np.abs(found.values[name])
        is_code = np.isin(size, CODES)
        others = size[np.isfinite(size) & ~is_code]
        if not len(others):
            continue
        usual = float(np.quantile(others, USUAL_SHARE, method="lower"))
        far = (size > FAR_TIMES * usual) | (is_code & (size > CODE_TIMES * usual))
        if usual > 0.0 and far.any():
            first = int(np.flatnonzero(far)[0])
            yield (
                f"{found.names.get(name, name)}: {found.values[name][first]:g} {given.quantity.unit} and the like in "
                f"{rows_text(found.rows[far])}; {USUAL_SHARE:.0%} of the others are within {usual:.3g}; a code of the "
                "logger is named under 'missing' in a mapping, or excluded by 'valid'"
            )
