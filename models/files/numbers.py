"""Numbers in cells of tables."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd

from models.base.types import Array


def is_number(cell: object) -> bool:
    """Return True for a number, and for its text with a decimal point; also for ``nan`` and ``inf``."""
    try:
        float(cell)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return False
    return True


def numbers_of(cells: pd.Series, *, decimal: str = ".", thousands: str = "") -> Array:
    """Return cells as numbers, shape (rows,); NaN where a cell is empty or no number.

    Parameters
    ----------
    cells : Series
        Numbers, texts, or both: one cell that is no number leaves its column as texts
    decimal, thousands : str
        Signs in numbers that are texts; the second stands between groups of three digits only

    Examples
    --------
    >>> numbers_of(pd.Series(["1.500,5", "2,25", "1.5", "off", None]), decimal=",", thousands=".")
    array([1500.5 ,    2.25,     nan,     nan,     nan])
    """
    if pd.api.types.is_numeric_dtype(cells.dtype):
        return np.array(cells.to_numpy(dtype=np.float64, na_value=np.nan))
    cells = cells.astype(object)
    is_text = cells.map(lambda cell: isinstance(cell, str)).to_numpy(dtype=bool)
    texts = cells[is_text].astype(str).str.strip()
    if thousands:
        grouped = texts.str.fullmatch(rf"[+-]?\d{{1,3}}(?:{re.escape(thousands)}\d{{3}})+(?:{re.escape(decimal)}\d*)?")
        texts = texts.where(~grouped, texts.str.replace(thousands, "", regex=False))
    if decimal != ".":
        texts = texts.where(~texts.str.contains(".", regex=False), "").str.replace(decimal, ".", regex=False)
    cells = cells.mask(is_text, texts)
    return np.array(pd.to_numeric(cells, errors="coerce").to_numpy(dtype=np.float64, na_value=np.nan))
