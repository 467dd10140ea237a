"""What a sweep says of one setting: values in a list, or a distribution to draw from."""

import math
from collections.abc import Sequence
from statistics import NormalDist
from typing import Annotated, Any, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    StrictFloat,
    StrictInt,
    Tag,
    WithJsonSchema,
    model_validator,
)

from tieline.units import QuantityError, Unit, converted, dimension_of, split

DIGITS = 4
"""Significant digits that a drawn or spaced value keeps at least, so that labels can be read."""

MOST_READABLE = 1_000
"""Values between two ends that so many digits tell apart."""

MOST_VALUES = 10_000


def _is_quantity(value: object) -> object:
    if split(value) is None:
        raise QuantityError("a number, or a quantity such as '250 ms'", value)
    return value


Value = Annotated[
    Any,
    BeforeValidator(_is_quantity),
    WithJsonSchema({"type": ["number", "string"], "unit": "the setting's"}),
]
Ends = Annotated[list[Value], Field(min_length=2, max_length=2)]
Count = Annotated[StrictInt, Field(ge=2, le=MOST_VALUES), Unit("values")]


class Axis(BaseModel):
    """What one setting is in the points of a sweep."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    def at(self, share: float) -> Any:
        """Return the value below which `share`, 0 or more and below 1, of all draws lie."""
        raise NotImplementedError

    def values(self) -> tuple[Any, ...] | None:
        """Return the values that a grid visits, or None for a distribution."""
        return None


class Uniform(Axis):
    """Every value between two ends is equally likely."""

    uniform: Ends = Field(description="lower and upper end")

    @model_validator(mode="after")
    def _is_range(self) -> Self:
        _ordered(self.uniform)
        return self

    def at(self, share: float) -> Any:
        """Return the value at a share of the way."""
        (low, high), unit = common(self.uniform)
        return written(low + share * (high - low), unit, low, high)


class LogUniform(Axis):
    """Every value between two positive ends is equally likely on a logarithmic scale."""

    log_uniform: Ends = Field(description="lower and upper end, above 0")

    @model_validator(mode="after")
    def _is_range(self) -> Self:
        _ordered(self.log_uniform, above_zero=True)
        return self

    def at(self, share: float) -> Any:
        """Return the value at a share of the way between the logarithms."""
        (low, high), unit = common(self.log_uniform)
        return written(_between_logarithms(low, high, share), unit, low, high)


class Normal(Axis):
    """A normal distribution, of which what is outside `within` is left out."""

    normal: Ends = Field(description="mean and standard deviation before the cut")
    within: Ends = Field(description="lower and upper end")

    @model_validator(mode="after")
    def _has_room(self) -> Self:
        _ordered(self.within, of=" in 'within'")
        (mean, deviation, low, high), _ = common([*self.normal, *self.within])
        if deviation <= 0:
            raise ValueError(f"must have a deviation above 0 (got {self.normal[1]})")
        if not low - 4 * deviation <= mean <= high + 4 * deviation:
            raise ValueError(
                f"must have a mean at most 4 deviations outside 'within' (got {self.normal[0]})"
            )
        return self

    def at(self, share: float) -> Any:
        """Return the inverse of the cut distribution."""
        (mean, deviation, low, high), unit = common([*self.normal, *self.within])
        bell = NormalDist(mean, deviation)
        below, above = bell.cdf(low), bell.cdf(high)
        inside = min(max(below + share * (above - below), 1e-300), 1 - 1e-16)
        return written(bell.inv_cdf(inside), unit, low, high)


class Integers(Axis):
    """Every whole number from the first to the last is equally likely."""

    integers: list[Annotated[StrictInt, Unit("1")]] = Field(
        min_length=2, max_length=2, description="first and last"
    )

    @model_validator(mode="after")
    def _is_range(self) -> Self:
        _ordered(self.integers)
        return self

    def at(self, share: float) -> Any:
        """Return a whole number."""
        low, high = self.integers
        return low + int(share * (high - low + 1))


class Choice(Axis):
    """One of some values; a grid visits all of them."""

    choice: list[Any] = Field(
        min_length=1, max_length=MOST_VALUES, description="the values, of any kind"
    )
    weights: list[Annotated[StrictFloat, Field(ge=0, le=1e9), Unit("1")]] | None = Field(
        None, description="weight of each value when drawn; none: all are equally likely"
    )

    @model_validator(mode="after")
    def _is_complete(self) -> Self:
        twice = [value for i, value in enumerate(self.choice) if value in self.choice[:i]]
        if twice:
            raise ValueError(f"lists {twice[0]!r} twice")
        if self.weights is None:
            return self
        if len(self.weights) != len(self.choice) or not any(self.weights):
            raise ValueError(
                f"must have one weight for each of the {len(self.choice)} values, not all 0"
                f" (got {self.weights})"
            )
        return self

    def at(self, share: float) -> Any:
        """Return the value whose part of the weights holds the share."""
        weights = self.weights or [1.0] * len(self.choice)
        reached, total = 0.0, sum(weights)
        for value, weight in zip(self.choice, weights, strict=True):
            reached += weight / total
            if share < reached:
                return value
        return self.choice[-1]

    def values(self) -> tuple[Any, ...]:
        """Return all values."""
        return tuple(self.choice)


class _Spaced(Axis):
    """Values at set distances between two ends, both included."""

    def at(self, share: float) -> Any:
        """Return one of the values."""
        return self._value(int(share * self._size()))

    def values(self) -> tuple[Any, ...]:
        """Return all values."""
        return tuple(self._value(i) for i in range(self._size()))

    def _size(self) -> int:
        raise NotImplementedError

    def _value(self, i: int) -> Any:
        raise NotImplementedError


class Linspace(_Spaced):
    """Values at equal distances, both ends included."""

    linspace: Ends = Field(description="first and last value")
    count: Count = Field(description="how many values")

    @model_validator(mode="after")
    def _is_range(self) -> Self:
        _ordered(self.linspace)
        return self

    def _size(self) -> int:
        return self.count

    def _value(self, i: int) -> Any:
        (low, high), unit = common(self.linspace)
        return written(low + i / (self.count - 1) * (high - low), unit, low, high, self.count)


class Logspace(_Spaced):
    """Values in equal ratios, both ends included."""

    logspace: Ends = Field(description="first and last value, above 0")
    count: Count = Field(description="how many values")

    @model_validator(mode="after")
    def _is_range(self) -> Self:
        _ordered(self.logspace, above_zero=True)
        return self

    def _size(self) -> int:
        return self.count

    def _value(self, i: int) -> Any:
        (low, high), unit = common(self.logspace)
        value = _between_logarithms(low, high, i / (self.count - 1))
        return written(value, unit, low, high, self.count)


AXES: dict[str, type[Axis]] = {
    "uniform": Uniform,
    "log_uniform": LogUniform,
    "normal": Normal,
    "integers": Integers,
    "choice": Choice,
    "linspace": Linspace,
    "logspace": Logspace,
}


def _kind(axis: Any) -> str | None:
    if isinstance(axis, Axis):
        return next(kind for kind, model in AXES.items() if isinstance(axis, model))
    named = [kind for kind in AXES if isinstance(axis, dict) and kind in axis]
    return named[0] if len(named) == 1 else None


AnyAxis = Annotated[
    Annotated[Uniform, Tag("uniform")]
    | Annotated[LogUniform, Tag("log_uniform")]
    | Annotated[Normal, Tag("normal")]
    | Annotated[Integers, Tag("integers")]
    | Annotated[Choice, Tag("choice")]
    | Annotated[Linspace, Tag("linspace")]
    | Annotated[Logspace, Tag("logspace")],
    Discriminator(_kind),
    BeforeValidator(lambda axis: {"choice": axis} if isinstance(axis, list) else axis),
]
"""A list of values counts as a choice among them."""


def common(values: Sequence[Any]) -> tuple[list[float], str]:
    """Return quantities as numbers of one unit, that of the first that has one.

    Raises:
        ValueError: they are of different dimensions, or one that is not 0 lacks the unit.
    """
    parts = [split(value) or (math.nan, "") for value in values]
    unit = next((unit for _, unit in parts if unit), "")
    if any(own and dimension_of(own) != dimension_of(unit) for _, own in parts):
        raise ValueError(f"must hold quantities of one kind (got {_listed(values)})")
    if unit and any(not own and number for number, own in parts):
        raise ValueError(f"must give each value a unit, as one has (got {_listed(values)})")
    return [converted(number, own or unit, unit) for number, own in parts], unit


def written(number: float, unit: str, low: float, high: float, count: int = 1) -> float | str:
    """Return a number between two ends, rounded for readers, with its unit if it has one.

    Args:
        number: between the ends, in the unit.
        unit: empty for a bare number.
        low, high: the ends; where they are close together more digits are kept.
        count: how many values there are between the ends that must differ.
    """
    finest = max(abs(low), abs(high)) / (high - low) * max(1.0, count / MOST_READABLE)
    digits = DIGITS + max(0, math.floor(math.log10(finest)))
    rounded = min(max(float(f"{number:.{digits}g}"), low), high)
    return f"{rounded:.15g} {unit}" if unit else rounded


def _between_logarithms(low: float, high: float, share: float) -> float:
    """Return what lies a share of the way from one number above 0 to another, in ratios."""
    return math.exp(math.log(low) + share * (math.log(high) - math.log(low)))


def _ordered(ends: Sequence[Any], above_zero: bool = False, of: str = "") -> None:
    (low, high), _ = common(ends)
    if not low < high:
        raise ValueError(f"must have a first value below the last{of} (got {_listed(ends)})")
    if above_zero and low <= 0:
        raise ValueError(f"must lie above 0 (got {_listed(ends)})")


def _listed(values: Sequence[Any]) -> str:
    return f"[{', '.join(map(str, values))}]"
