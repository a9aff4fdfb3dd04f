"""How numbers are put to a reader."""

from __future__ import annotations

import math

NONE = "\N{EN DASH}"
MINUS = "\N{MINUS SIGN}"
SUPERSCRIPTS = str.maketrans({"0": "⁰", "1": "¹", "2": "²", "3": "³", "4": "⁴", "5": "⁵", "6": "⁶", "7": "⁷",
                              "8": "⁸", "9": "⁹", "-": "⁻"})  # fmt: skip


def number(value: float | None, digits: int = 3) -> str:
    """A number with some significant digits; a dash where there is none.

    Examples
    --------
    >>> number(-0.04567), number(1234.5), number(float("nan")), number(3e-7)
    ('−0.0457', '1234', '–', '3·10⁻⁷')
    """
    if value is None or not math.isfinite(value):
        return NONE
    if value == 0.0:
        return "0"
    exponent = math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    if not -4 <= exponent <= 5:
        mantissa = f"{value / 10.0**exponent:.{digits - 1}f}".rstrip("0").rstrip(".")
        text = f"{mantissa}·10{str(exponent).translate(SUPERSCRIPTS)}"
    else:
        text = f"{value:.{max(digits - 1 - exponent, 0)}f}"
    return text.replace("-", MINUS)


def fixed(value: float | None, decimals: int = 2) -> str:
    """A number with some decimals, for columns; a dash where there is none.

    Examples
    --------
    >>> fixed(3.14159), fixed(-0.001), fixed(None)
    ('3.14', '0.00', '–')
    """
    if value is None or not math.isfinite(value):
        return NONE
    return f"{round(value, decimals) + 0.0:.{decimals}f}".replace("-", MINUS)


def with_error(value: float, stderr: float) -> str:
    """A value and its standard error, both to the error's second digit.

    Examples
    --------
    >>> with_error(1.8374, 0.1129), with_error(3012.3, 146.0), with_error(2.0, float("nan"))
    ('1.84 ± 0.11', '3010 ± 150', '2.00')
    """
    if not (math.isfinite(value) and math.isfinite(stderr) and stderr > 0.0):
        return number(value)
    decimals = 1 - math.floor(math.log10(stderr))
    if decimals > 6 or abs(value) >= 1e7:
        return f"{number(value, 4)} ± {number(stderr, 2)}"
    shown = max(decimals, 0)
    return f"{round(value, decimals):.{shown}f} ± {round(stderr, decimals):.{shown}f}".replace("-", MINUS)


def share(probability: float) -> str:
    """A probability among explanations; never rounded to certainty.

    Examples
    --------
    >>> share(0.914), share(0.9999), share(0.0003)
    ('0.91', '> 0.99', '< 0.01')
    """
    if not math.isfinite(probability):
        return NONE
    if probability < 0.01:
        return "< 0.01"
    return "> 0.99" if probability > 0.99 else f"{probability:.2f}"
