"""Random delays that a link or a processing stage adds to each packet, in whole nanoseconds."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Jitter(Protocol):
    """A distribution of non-negative delays, independent from packet to packet.

    On a link the delay comes after serialisation and does not hold the port, so a packet can
    overtake the one before it: links with jitter re-order.
    """

    @property
    def mean_ns(self) -> float:
        """The exact mean of the distribution."""

    @property
    def least_ns(self) -> int:
        """The lower end of the distribution."""

    def draw(self, generator: np.random.Generator, count: int) -> NDArray[np.int64]:
        """Return `count` delays in nanoseconds, each rounded to the nearest."""


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
