"""Random delays that a link or a processing stage adds to each packet, in whole nanoseconds."""

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
