"""What every queue discipline says: which packets wait where, how many, and who is next."""

from dataclasses import dataclass
from typing import Literal, Protocol

NO_LIMIT = 1 << 60


@dataclass(frozen=True)
class WaitingLine:
    """Packets of one class, first in, first out; what comes when it is full is dropped.

    Attributes:
        packets, bytes: the most that may wait besides the packet in transmission, link-layer bytes
            included.
        quantum_bytes: what deficit round robin grants it at each visit.
    """

    packets: int
    bytes: int = NO_LIMIT
    quantum_bytes: int = 0


@dataclass(frozen=True)
class EarlyDetection:
    """Random early detection: when packets are dropped before the queue is full.

    Attributes:
        low, high: averaged packets waiting below which none, and from which all are dropped.
        probability: share that is dropped as the average comes near `high`.
        weight_shift: the newest sample weighs 2^-weight_shift in the average.
    """

    low: float
    high: float
    probability: float
    weight_shift: int


class Queue(Protocol):
    """The queue of each direction of a link."""

    @property
    def lines(self) -> tuple[WaitingLine, ...]:
        """Return the waiting lines, the most urgent first."""

    @property
    def order(self) -> Literal["first_come", "priority", "round_robin"]:
        """Return in which order they are served; one line alone is first come, first served."""

    @property
    def early_detection(self) -> EarlyDetection | None:
        """Return when packets are dropped early; only one line alone can have it."""

    def line_of(self, dscp: int) -> int:
        """Return the number of the line in which packets of a DSCP wait."""
