"""The same delay for every packet: a router's own processing at each hop."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tieline.network.entry import Entry
from tieline.network.jitter.base import Jitter
from tieline.units import Seconds, seconds_to_ns


@dataclass(frozen=True)
class ConstantJitter:
    """Always `delay_ns`."""

    delay_ns: int

    @property
    def mean_ns(self) -> float:
        """The delay."""
        return float(self.delay_ns)

    @property
    def least_ns(self) -> int:
        """The delay."""
        return self.delay_ns

    def draw(self, generator: np.random.Generator, count: int) -> NDArray[np.int64]:
        """Return `count` delays in nanoseconds."""
        return np.full(count, self.delay_ns, dtype=np.int64)


class ConstantEntry(Entry):
    """The same delay for every packet."""

    distribution: Literal["constant"] = Field(description="which distribution this is")
    delay: Seconds = Field(ge=0, le=10, description="the delay of every packet")

    def jitter(self) -> Jitter:
        """Return the distribution."""
        return ConstantJitter(seconds_to_ns(self.delay))
