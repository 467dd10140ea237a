"""Units: integer nanoseconds against float seconds, and quantities written with their unit."""

import re
from typing import Annotated

from pydantic import BeforeValidator

NS_PER_S = 1_000_000_000

_SCALES: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "rate": {"bit/s": 1.0, "kbit/s": 1e3, "Mbit/s": 1e6, "Gbit/s": 1e9},
    "frequency": {"Hz": 1.0, "kHz": 1e3, "mHz": 1e-3},
    "length": {"m": 1.0, "km": 1e3},
}
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)\s*")


def tick_ns(tick: int, rate_hz: int) -> int:
    """Return the instant of `tick` of a clock of `rate_hz`, in whole nanoseconds, rounded down."""
    return tick * NS_PER_S // rate_hz


def seconds_to_ns(time_s: float) -> int:
    """Return `time_s` in nanoseconds, rounded to the nearest."""
    return round(time_s * NS_PER_S)


def ns_to_seconds(time_ns: int) -> float:
    """Return `time_ns` in seconds."""
    return time_ns / NS_PER_S


def quantity(value: object, dimension: str) -> float:
    """Return a quantity in its SI unit.

    Args:
        value: a number, taken to be in the SI unit, or text such as `250 ms` or `2 Mbit/s`.
        dimension: `time`, `rate`, `frequency` or `length`.

    Raises:
        ValueError: the text is no number, or its unit is not one of the dimension's.
    """
    scales = _SCALES[dimension]
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f"must be a {dimension} such as '10 {next(iter(scales))}' (got {value!r})")
    if not isinstance(value, str):
        return float(value)
    match = _QUANTITY.fullmatch(value)
    if match is None:
        raise ValueError(f"must be a {dimension} such as '10 {next(iter(scales))}' (got {value!r})")
    number, unit = match.groups()
    if unit and unit not in scales:
        allowed = ", ".join(scales)
        raise ValueError(f"must be a {dimension} in one of {allowed} (got {value!r})")
    return float(number) * (scales[unit] if unit else 1.0)


Seconds = Annotated[float, BeforeValidator(lambda value: quantity(value, "time"))]
BitsPerSecond = Annotated[float, BeforeValidator(lambda value: quantity(value, "rate"))]
Hertz = Annotated[float, BeforeValidator(lambda value: quantity(value, "frequency"))]
Metres = Annotated[float, BeforeValidator(lambda value: quantity(value, "length"))]
