"""Delays of a normal distribution that is cut on both sides."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from tieline.network.entry import Entry
from tieline.network.jitter.base import Jitter
from tieline.units import Seconds, seconds_to_ns

MOST_DEVIATION = 100
"""In means: nearly all draws of a wider distribution would be outside the cut."""


@dataclass(frozen=True)
class NormalJitter:
    """A normal distribution cut to [0, 2 mean].

    The cut is symmetric, so `centre_ns` stays the mean; draws outside are drawn again. The
    standard deviation is that before the cut.
    """

    centre_ns: int
    deviation_ns: int

    @property
    def mean_ns(self) -> float:
        """The centre, which the symmetric cut leaves as the mean."""
        return float(self.centre_ns)

    @property
    def least_ns(self) -> int:
        """Zero: the cut."""
        return 0

    def draw(self, generator: np.random.Generator, count: int) -> NDArray[np.int64]:
        """Return `count` delays in nanoseconds."""
        delays = np.full(count, -1.0)
        outside = np.ones(count, dtype=bool)
        while outside.any():
            delays[outside] = generator.normal(
                self.centre_ns, self.deviation_ns, np.count_nonzero(outside)
            )
            outside = (delays < 0) | (delays > 2 * self.centre_ns)
        return np.rint(delays).astype(np.int64)


class NormalEntry(Entry):
    """A normal distribution cut to [0, 2 mean]."""

    distribution: Literal["normal"] = Field(description="which distribution this is")
    mean: Seconds = Field(ge=1e-9, le=10, description="mean delay")
    deviation: Seconds = Field(ge=1e-9, le=10, description="standard deviation before the cut")

    @model_validator(mode="after")
    def _narrow(self) -> "NormalEntry":
        if self.deviation > MOST_DEVIATION * self.mean:
            raise ValueError(
                f"'deviation' must not exceed {MOST_DEVIATION} times 'mean' "
                f"({self.deviation:g} s > {MOST_DEVIATION} x {self.mean:g} s)"
            )
        return self

    def jitter(self) -> Jitter:
        """Return the distribution."""
        return NormalJitter(seconds_to_ns(self.mean), seconds_to_ns(self.deviation))
