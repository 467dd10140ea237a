"""Random early detection on one line.

S. Floyd and V. Jacobson, Random early detection gateways for congestion avoidance, IEEE/ACM Trans.
Networking 1 (1993). From `high` on every packet is dropped (no gentle mode).
"""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field, model_validator

from tieline.network.entry import Entry
from tieline.network.queues.base import EarlyDetection, Queue, WaitingLine
from tieline.network.queues.drop_tail import MOST_PACKETS
from tieline.units import Share, Unit

Packets = Annotated[float, Unit("packets")]


@dataclass(frozen=True)
class RandomEarlyDetection:
    """A drop-tail line of `packets`, of which some are dropped before it is full."""

    packets: int
    early_detection: EarlyDetection

    @property
    def lines(self) -> tuple[WaitingLine, ...]:
        """The one line."""
        return (WaitingLine(self.packets),)

    @property
    def order(self) -> Literal["first_come"]:
        """First come, first served."""
        return "first_come"

    def line_of(self, dscp: int) -> int:
        """The one line."""
        return 0


class EarlyDetectionEntry(Entry):
    """A queue that drops some packets early."""

    discipline: Literal["red"] = Field(description="which queue this is")
    packets: Annotated[int, Unit("packets")] = Field(
        ge=1, le=MOST_PACKETS, strict=True, description="the most packets that may wait"
    )
    low: Packets = Field(
        gt=0, le=MOST_PACKETS, description="averaged packets below which none is dropped"
    )
    high: Packets = Field(
        gt=0, le=MOST_PACKETS, description="averaged packets from which all are dropped"
    )
    probability: Share = Field(0.1, gt=0, le=1, description="share dropped near 'high'")
    weight_shift: Annotated[int, Unit("1")] = Field(
        9, ge=1, le=16, description="the newest sample weighs 2^-this in the average"
    )

    @model_validator(mode="after")
    def _ordered(self) -> "EarlyDetectionEntry":
        if not self.low < self.high <= self.packets:
            raise ValueError(
                "needs low < high <= packets "
                f"(got low={self.low:g}, high={self.high:g}, packets={self.packets})"
            )
        return self

    def queue(self) -> Queue:
        """Return the discipline."""
        early = EarlyDetection(self.low, self.high, self.probability, self.weight_shift)
        return RandomEarlyDetection(self.packets, early)
