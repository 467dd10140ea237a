"""A greedy connection in the manner of TCP: it sends as much as the network lets through."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from tieline.network.draws import NEVER, Chunks, chunked
from tieline.network.traffic.base import FlowEntry, Payload, Traffic
from tieline.units import Unit

MOST_WINDOW = 1024


@dataclass(frozen=True)
class Greedy:
    """A connection with endless data; `network/packet/tcp.py` says what is modelled.

    Attributes:
        payload_bytes: of each segment.
        window_segments: the most under way.
    """

    payload_bytes: int
    window_segments: int

    @property
    def rate_bps(self) -> float:
        """What the network lets through."""
        return math.nan

    def gaps(self, generator: np.random.Generator) -> Chunks:
        """Yield one gap of zero, at which it begins."""
        return chunked([np.zeros(1, dtype=np.int64)], NEVER)

    def scaled(self, factor: float) -> Traffic:
        """Return it as it is: it has no rate of its own."""
        return self


class GreedyEntry(FlowEntry):
    """A greedy connection."""

    kind: Literal["greedy"] = Field(description="which traffic this is")
    payload: Payload = Field(1460, description="payload of a segment")
    window: Annotated[int, Unit("segments")] = Field(
        90, ge=1, le=MOST_WINDOW, strict=True, description="most segments under way"
    )

    def traffic(self) -> Traffic:
        """Return the traffic."""
        return Greedy(self.payload, self.window)
