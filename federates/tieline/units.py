"""Units: integer nanoseconds against float seconds, and quantities written with their unit."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, get_args

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, StrictInt
from pydantic.fields import FieldInfo
from pydantic_core import core_schema

NS_PER_S = 1_000_000_000

_SCALES: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "rate": {"bit/s": 1.0, "kbit/s": 1e3, "Mbit/s": 1e6, "Gbit/s": 1e9},
    "frequency": {"Hz": 1.0, "kHz": 1e3, "mHz": 1e-3},
    "length": {"m": 1.0, "km": 1e3},
    "power": {"MW": 1.0, "GW": 1e3, "kW": 1e-3},
    "size": {"B": 1.0, "kB": 1e3, "MB": 1e6, "GB": 1e9},
    "share": {"%": 1e-2},
}
"""Units of each dimension by what they are in the unit that a plain number counts in."""

_ARTICLES = {"share": "a number, or a share such as '10 %'"}
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s*(\S*)\s*")


def tick_ns(tick: int, rate_hz: int) -> int:
    """Return the instant of `tick` of a clock of `rate_hz`, in whole nanoseconds, rounded down."""
    return tick * NS_PER_S // rate_hz


def seconds_to_ns(time_s: float) -> int:
    """Return `time_s` in nanoseconds, rounded to the nearest."""
    return round(time_s * NS_PER_S)


def ns_to_seconds(time_ns: int) -> float:
    """Return `time_ns` in seconds."""
    return time_ns / NS_PER_S


class QuantityError(ValueError):
    """A text or value that is no quantity of its dimension.

    Attributes:
        allowed: what it must be.
    """

    def __init__(self, allowed: str, given: object) -> None:
        self.allowed = allowed
        super().__init__(f"must be {allowed} (got {given!r:.80})")


def quantity(value: object, dimension: str) -> float:
    """Return a quantity in the unit that a plain number counts in, which is SI's but for MW.

    Args:
        value: a number, or text such as `250 ms`, `2 Mbit/s` or `2 %`.
        dimension: `time`, `rate`, `frequency`, `length`, `power`, `size` or `share`.

    Raises:
        QuantityError: the text is no number, or its unit is not one of the dimension's.
    """
    scales = _SCALES[dimension]
    example = f"a {dimension} such as '10 {next(iter(scales))}'"
    match = _QUANTITY.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise QuantityError(_ARTICLES.get(dimension, example), value)
        return float(value)
    number, unit = match.groups()
    if unit and unit not in scales:
        raise QuantityError(f"a {dimension} in one of {', '.join(scales)}", value)
    return float(number) * (scales[unit] if unit else 1.0)


def split(value: object) -> tuple[float, str] | None:
    """Return number and unit of a quantity of whatever dimension, or None for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    match = _QUANTITY.fullmatch(str(value))
    if match is None or (match.group(2) and dimension_of(match.group(2)) is None):
        return None
    return float(match.group(1)), match.group(2)


def dimension_of(unit: str) -> str | None:
    """Return the dimension that a unit belongs to, or None for an unknown unit."""
    return next((name for name, scales in _SCALES.items() if unit in scales), None)


def converted(number: float, unit: str, to: str) -> float:
    """Return a number of one unit in another unit of the same dimension."""
    if unit == to:
        return number
    scales = _SCALES[str(dimension_of(to))]
    return number * scales[unit] / scales[to]


@dataclass(frozen=True)
class Unit:
    """What a number counts in, where it is always written without: `pu`, `packets`, `1`."""

    unit: str

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Return the number's JSON Schema with its unit as an annotation."""
        return {**handler(schema), "unit": self.unit}


@dataclass(frozen=True)
class Quantity:
    """A number that may be written as text with a unit of its dimension.

    Attributes:
        dimension: as `quantity` takes it.
        is_whole: whether it must be a whole number of its unit.
    """

    dimension: str
    is_whole: bool = False

    @property
    def unit(self) -> str:
        """Return the unit of a plain number."""
        scales = _SCALES[self.dimension]
        return next((unit for unit, scale in scales.items() if scale == 1.0), "1")

    def read(self, value: object) -> object:
        """Return the number that is meant; what is no text stays as it is if it must be whole.

        Raises:
            QuantityError: as `quantity`, or the text is no whole number of the unit.
        """
        if not self.is_whole:
            return quantity(value, self.dimension)
        if not isinstance(value, str):
            return value
        if _QUANTITY.fullmatch(value) is None:
            raise QuantityError("a whole number", value)
        number = quantity(value, self.dimension)
        if not number.is_integer():
            raise QuantityError(f"a whole number of {self.unit}", value)
        return int(number)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """Return a validator that reads text before the number is checked."""
        return core_schema.no_info_before_validator_function(self.read, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Return a JSON Schema that takes the number and the text."""
        number = handler(schema)
        units = "|".join(re.escape(unit) for unit in _SCALES[self.dimension])
        pattern = rf"^\s*{_NUMBER}\s*({units})?\s*$"
        return {**number, "type": [number["type"], "string"], "pattern": pattern, "unit": self.unit}


def unit_of(field: FieldInfo) -> str | None:
    """Return the unit that a field declares, or None where it holds no number."""
    return next(_units_in((*field.metadata, field.annotation)), None)


def _units_in(parts: tuple[Any, ...]) -> Iterator[str]:
    for part in parts:
        if isinstance(part, Quantity | Unit):
            yield part.unit
        else:
            yield from _units_in((*getattr(part, "__metadata__", ()), *get_args(part)))


Seconds = Annotated[float, Quantity("time")]
BitsPerSecond = Annotated[float, Quantity("rate")]
Hertz = Annotated[float, Quantity("frequency")]
Metres = Annotated[float, Quantity("length")]
Megawatts = Annotated[float, Quantity("power")]
Share = Annotated[float, Quantity("share")]
PerSecond = Annotated[StrictInt, Quantity("frequency", is_whole=True)]
Bytes = Annotated[StrictInt, Quantity("size", is_whole=True)]
