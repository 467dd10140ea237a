"""One line, first in, first out, limited in packets or in bytes."""

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field, model_validator

from tieline.network.entry import Entry
from tieline.network.queues.base import NO_LIMIT, EarlyDetection, Queue, WaitingLine
from tieline.units import Bytes, Unit

MOST_PACKETS = 100_000
MOST_BYTES = 1 << 30
LEAST_PACKET_BYTES = 29
"""An IPv4 packet of UDP with one byte of payload: a byte limit has room for as many as fit of it,
up to `MOST_PACKETS`."""


@dataclass(frozen=True)
class DropTail:
    """What comes when `packets` packets or `bytes` bytes wait is dropped."""

    packets: int
    bytes: int = NO_LIMIT

    @property
    def lines(self) -> tuple[WaitingLine, ...]:
        """The one line."""
        return (WaitingLine(self.packets, self.bytes),)

    @property
    def order(self) -> Literal["first_come"]:
        """First come, first served."""
        return "first_come"

    @property
    def early_detection(self) -> EarlyDetection | None:
        """None."""
        return None

    def line_of(self, dscp: int) -> int:
        """The one line."""
        return 0


class DropTailEntry(Entry):
    """A queue that drops what comes when it is full."""

    discipline: Literal["drop_tail"] = Field(description="which queue this is")
    packets: Annotated[int, Unit("packets")] | None = Field(
        None, ge=1, le=MOST_PACKETS, strict=True, description="the most packets that may wait"
    )
    bytes: Bytes | None = Field(
        None,
        ge=1,
        le=MOST_BYTES,
        description=(
            "the most bytes that may wait; without 'packets' no more than "
            f"{MOST_PACKETS} packets wait either"
        ),
    )

    @model_validator(mode="after")
    def _limited(self) -> "DropTailEntry":
        if self.packets is None and self.bytes is None:
            raise ValueError("needs a limit: 'packets' or 'bytes'")
        return self

    def queue(self) -> Queue:
        """Return the discipline."""
        most = self.bytes or NO_LIMIT
        packets = self.packets or min(MOST_PACKETS, most // LEAST_PACKET_BYTES + 1)
        return DropTail(packets, most)
