"""Delays that are equally likely between two ends."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tieline.network.entry import Entry
from tieline.network.jitter.base import Jitter
from tieline.units import Seconds, seconds_to_ns


@dataclass(frozen=True)
class UniformJitter:
    """Any whole nanosecond between `low_ns` and `high_ns`, both included, is equally likely."""

    low_ns: int
    high_ns: int

    @property
    def mean_ns(self) -> float:
        """The middle of the interval."""
        return (self.low_ns + self.high_ns) / 2

    @property
    def least_ns(self) -> int:
        """The lower end."""
        return self.low_ns

    def draw(self, generator: np.random.Generator, count: int) -> NDArray[np.int64]:
        """Return `count` delays in nanoseconds."""
        return generator.integers(self.low_ns, self.high_ns, count, dtype=np.int64, endpoint=True)


class UniformEntry(Entry):
    """Equally likely between two ends."""

    distribution: Literal["uniform"] = Field(description="which distribution this is")
    low: Seconds = Field(ge=0, le=10, description="least delay")
    high: Seconds = Field(ge=0, le=10, description="greatest delay")

    @model_validator(mode="after")
    def _ordered(self) -> "UniformEntry":
        if self.low > self.high:
            raise ValueError(f"'low' must not exceed 'high' ({self.low:g} s > {self.high:g} s)")
        return self

    def jitter(self) -> Jitter:
        """Return the distribution."""
        return UniformJitter(seconds_to_ns(self.low), seconds_to_ns(self.high))
