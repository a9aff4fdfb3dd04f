"""Faulty sensors: readings with the terms of kind ``sensor``, and their laws along the columns of a result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from diagnosis.forward.recurrence import lagged
from models.base.errors import InputError
from models.base.types import Array
from models.network.laws import compile_function, function_source
from models.quantities.quantities import column_of, is_total_loss, node_columns, quantity_of_column
from models.terms.term import Term


def passed_on(term: Term, law: Array, time: Array, changes: Array, channels: Sequence[int]) -> Array:
    """Return changes of the readings as a faulty sensor shows them.

    Parameters
    ----------
    term : Term
        Of kind ``sensor``, no shift: that one leaves changes as they are
    law : Array, shape (K + 1,)
        Its law at the points of time
    time : Array, shape (K + 1,)
        [s]
    changes : Array, shape (K + 1, channels, ...)
    channels : sequence of int
        Places of the term's channels
    """
    along = law.reshape(-1, *[1] * (changes.ndim - 2))
    changes = np.array(changes)
    for index in channels:
        before = changes[:, index]
        if term.form == "lag":
            changes[:, index] = lagged(before, np.diff(time), float(law[0]))
        elif term.form == "clock":
            changes[:, index] = delayed(before, time, law)
        elif term.form == "stuck":
            acts = law != 0.0  # the reading is held as it was when the law set in
            sets_in = np.where(acts & ~np.concatenate([[False], acts[:-1]]), np.arange(len(law)), 0)
            changes[:, index] = before + along * (before[np.maximum.accumulate(sets_in)] - before)
    if term.form == "swapped":
        changes[:, channels] += along[:, None] * (changes[:, channels[::-1]] - changes[:, channels])
    return changes


def distorted(term: Term, law: Array, time: Array, readings: Array, channels: Sequence[int]) -> Array:
    """Return readings as a faulty sensor shows them: shifted, or see :func:`passed_on`."""
    if term.form != "shift":
        return passed_on(term, law, time, readings, channels)
    readings = np.array(readings)
    readings[:, channels] += law[:, None]
    return readings


def delayed(values: Array, time: Array, late: Array | float) -> Array:
    """Return values as they come `late` [s] after their time, on straight lines between the points.

    Parameters
    ----------
    values : Array, shape (K + 1, ...)
    time : Array, shape (K + 1,)
        [s]
    late : Array, shape (K + 1,), or float
    """
    at = np.interp(time - late, time, np.arange(len(time)))
    low = np.minimum(at.astype(int), len(time) - 2)
    share = (at - low).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray((1.0 - share) * values[low] + share * values[low + 1])


def law_along(term: Term, columns: Mapping[str, Array]) -> Array:
    """Law of a term along a result, with its parameters at their start, shape (N,).

    Raises
    ------
    InputError
        If the law needs what the result lacks.
    """
    signals = {"time": columns["time_s"], **columns}
    signals |= {f"T_{node}": columns[column] for node, column in node_columns(columns).items()}
    signals |= {q.name: values for column, values in columns.items() if (q := quantity_of_column(column)) is not None}
    signals |= {p.name: np.asarray(p.start) for p in term.parameters}
    names = sorted(symbol.name for symbol in term.expression.free_symbols)
    missing = [name for name in names if name not in signals]
    if missing:
        raise InputError(f"{term.label}: its law needs {', '.join(missing)}, which a result does not have")
    function = compile_function(function_source("law", names, [term.expression], vector=True), "law")
    law = np.asarray(function(*(signals[name] for name in names))[0], dtype=float)
    return np.broadcast_to(law, columns["time_s"].shape)


def channel_column(channel: str) -> str:
    """Column of a channel: a node, one of its sensors, or the total loss."""
    return column_of(channel if is_total_loss(channel) else f"T_{channel}")
