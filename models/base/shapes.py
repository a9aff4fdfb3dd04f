"""Shapes of what a caller gives together."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from models.base.errors import InputError


def common_shape(given: Mapping[str, ArrayLike]) -> tuple[int, ...]:
    """Shape of all values together: single numbers hold everywhere.

    Raises
    ------
    InputError
        If arrays have different lengths.

    Examples
    --------
    >>> common_shape({"speed": [1000.0, 2000.0], "torque": 90.0})
    (2,)
    """
    shapes = {name: np.shape(values) for name, values in given.items()}
    try:
        return np.broadcast_shapes(*shapes.values())
    except ValueError as error:
        sizes = ", ".join(f"{name} {' x '.join(map(str, shape))}" for name, shape in shapes.items() if shape)
        raise InputError(f"numbers of values differ: {sizes}; give single numbers or equally many") from error
