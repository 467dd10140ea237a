"""SCADA polling: requests at equal gaps, each answered by its target."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from tieline.network.draws import CHUNK, Chunks
from tieline.network.traffic.base import FlowEntry, Payload, Traffic
from tieline.units import Seconds, seconds_to_ns


@dataclass(frozen=True)
class Polling:
    """A master that asks one station; a request is not repeated if it is lost.

    Attributes:
        interval_ns: from request to request, from a random phase.
        payload_bytes, reply_bytes: of a request and of a reply.
        think_ns: from the arrival of a request until the reply leaves.
    """

    interval_ns: int
    payload_bytes: int
    reply_bytes: int
    think_ns: int

    @property
    def rate_bps(self) -> float:
        """Not a rate of its own."""
        return math.nan

    def gaps(self, generator: np.random.Generator) -> Chunks:
        """Yield the gaps between requests."""
        chunk = np.full(CHUNK, self.interval_ns, dtype=np.int64)
        chunk[0] = int(generator.integers(self.interval_ns))
        while True:
            yield chunk
            chunk = np.full(CHUNK, self.interval_ns, dtype=np.int64)

    def scaled(self, factor: float) -> Traffic:
        """Return it as it is: stations are polled as often as before."""
        return self


class PollingEntry(FlowEntry):
    """SCADA polling."""

    kind: Literal["polling"] = Field(description="which traffic this is")
    interval: Seconds = Field(ge=1e-3, le=1e5, description="time from request to request")
    payload: Payload = Field(12, description="payload of a request")
    reply: Payload = Field(250, description="payload of a reply")
    think: Seconds = Field(0.005, ge=0, le=10, description="from a request to its reply")

    def traffic(self) -> Traffic:
        """Return the traffic."""
        interval_ns, think_ns = seconds_to_ns(self.interval), seconds_to_ns(self.think)
        return Polling(interval_ns, self.payload, self.reply, think_ns)
