"""Delays of a gamma distribution: a long tail at the right."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tieline.network.entry import Entry
from tieline.network.jitter.base import Jitter
from tieline.units import Seconds, seconds_to_ns


@dataclass(frozen=True)
class GammaJitter:
    """A gamma distribution: zero at the left, a long tail at the right.

    Shape (mean / deviation)^2 and scale deviation^2 / mean; deviation = mean is the exponential.
    """

    centre_ns: int
    deviation_ns: int

    @property
    def mean_ns(self) -> float:
        """The mean."""
        return float(self.centre_ns)

    @property
    def least_ns(self) -> int:
        """Zero."""
        return 0

    def draw(self, generator: np.random.Generator, count: int) -> NDArray[np.int64]:
        """Return `count` delays in nanoseconds."""
        shape = (self.centre_ns / self.deviation_ns) ** 2
        delays = generator.gamma(shape, self.centre_ns / shape, count)
        return np.rint(delays).astype(np.int64)


class GammaEntry(Entry):
    """A gamma distribution."""

    distribution: Literal["gamma"] = Field(description="which distribution this is")
    mean: Seconds = Field(ge=1e-9, le=10, description="mean delay")
    deviation: Seconds = Field(ge=1e-9, le=10, description="standard deviation")

    def jitter(self) -> Jitter:
        """Return the distribution."""
        return GammaJitter(seconds_to_ns(self.mean), seconds_to_ns(self.deviation))
