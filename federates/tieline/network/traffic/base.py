"""What every kind of background traffic does: it says when its packets leave, and how large."""

from dataclasses import dataclass, replace
from typing import Annotated, Protocol, Self, runtime_checkable

import numpy as np
from pydantic import Field, model_validator

from tieline.network.draws import Chunks
from tieline.network.entry import Entry
from tieline.units import NS_PER_S, BitsPerSecond, Bytes, Seconds, Unit

UDP_HEADER, IP_HEADER = 8, 20
HEADER_BYTES = UDP_HEADER + IP_HEADER
"""UDP and IPv4 headers, which every datagram carries besides its payload and the link's own."""

MOST_PAYLOAD = 65_000
MOST_RATE = 1e13


class Traffic(Protocol):
    """Datagrams from one node to another, which only fill queues.

    Rates count payload and UDP and IPv4 headers, without the link layer's bytes.
    """

    @property
    def payload_bytes(self) -> int:
        """Return the payload of a datagram, of the largest where they differ."""

    @property
    def rate_bps(self) -> float:
        """Return the mean rate; NaN where only the network decides it."""

    def gaps(self, generator: np.random.Generator) -> Chunks:
        """Yield the times between datagrams, ns, the first counted from the flow's start."""

    def scaled(self, factor: float) -> "Traffic":
        """Return the traffic at a rate `factor` times as high, where its kind has a rate."""


@runtime_checkable
class Sized(Traffic, Protocol):
    """Traffic whose datagrams differ in size."""

    def sizes(self) -> Chunks:
        """Yield the payload of each datagram, bytes."""


@runtime_checkable
class Answered(Traffic, Protocol):
    """Traffic of requests, each of which is answered by its target."""

    @property
    def reply_bytes(self) -> int:
        """Return the payload of a reply."""

    @property
    def think_ns(self) -> int:
        """Return the time from the arrival of a request until the reply leaves."""


@runtime_checkable
class Acknowledged(Traffic, Protocol):
    """Traffic of a connection, which sends as much as the network lets through."""

    @property
    def window_segments(self) -> int:
        """Return the most segments that are under way."""


@dataclass(frozen=True)
class AtRate:
    """Datagrams of one size at a mean rate."""

    rate_bps: float
    payload_bytes: int

    @property
    def gap_ns(self) -> float:
        """Mean time between two datagrams."""
        return (self.payload_bytes + HEADER_BYTES) * 8 * NS_PER_S / self.rate_bps

    def scaled(self, factor: float) -> Self:
        """Return it at another rate."""
        return replace(self, rate_bps=self.rate_bps * factor)


Payload = Annotated[Bytes, Field(ge=1, le=MOST_PAYLOAD, description="payload of each datagram")]
Rate = Annotated[
    BitsPerSecond,
    Field(ge=1, le=MOST_RATE, description="mean rate of payload, UDP and IPv4 headers"),
]


class FlowEntry(Entry):
    """From where to where, when, and with which mark."""

    origin: str = Field(alias="from", description="node that sends")
    target: str = Field(alias="to", description="node that receives")
    start: Seconds = Field(0.0, ge=0, le=1e6, description="when it begins")
    stop: Seconds | None = Field(None, gt=0, le=1e6, description="when it ends; none: never")
    dscp: Annotated[int, Unit("number")] = Field(
        0, ge=0, le=63, strict=True, description="differentiated services mark of its packets"
    )

    @model_validator(mode="after")
    def _in_order(self) -> "FlowEntry":
        if self.stop is not None and self.stop <= self.start:
            raise ValueError(f"'stop' must be after 'start' ({self.stop:g} s, {self.start:g} s)")
        return self

    def traffic(self) -> Traffic:
        """Return the traffic of this kind."""
        raise TypeError(f"{type(self).__name__} is no kind of traffic")
