"""File transfers: bursts of datagrams at a pace, at random times."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from pydantic import Field

from tieline.network.draws import CHUNK, NEVER, Chunk, Chunks, chunked
from tieline.network.traffic.base import HEADER_BYTES, FlowEntry, Payload, Rate, Traffic
from tieline.units import NS_PER_S, Bytes, Seconds, seconds_to_ns


@dataclass(frozen=True)
class Files:
    """Files of one size, each sent at a pace, the next not before the last has left.

    Attributes:
        pace_bps: rate while a file is sent.
        payload_bytes: of each datagram.
        file_bytes: of each file; its last datagram is padded.
        interval_ns: mean time from one request for a file to the next, exponentially distributed.
    """

    pace_bps: float
    payload_bytes: int
    file_bytes: int
    interval_ns: int

    @property
    def datagrams(self) -> int:
        """Datagrams of a file."""
        return -(-self.file_bytes // self.payload_bytes)

    @property
    def rate_bps(self) -> float:
        """The mean rate, if files are asked for less often than they can be sent."""
        bits = self.datagrams * (self.payload_bytes + HEADER_BYTES) * 8
        return min(self.pace_bps, bits * NS_PER_S / self.interval_ns)

    def gaps(self, generator: np.random.Generator) -> Chunks:
        """Yield the gaps."""
        return chunked(self._parts(generator), NEVER)

    def scaled(self, factor: float) -> Traffic:
        """Return it with files asked for more or less often."""
        return replace(self, interval_ns=max(1, round(self.interval_ns / factor)))

    def _parts(self, generator: np.random.Generator) -> Iterator[Chunk]:
        gap_ns = (self.payload_bytes + HEADER_BYTES) * 8 * NS_PER_S / self.pace_bps
        length_ns = round(self.datagrams * gap_ns)
        asked_ns, free_ns, last_ns = 0.0, 0, 0
        while True:
            asked_ns += generator.standard_exponential() * self.interval_ns
            start_ns = max(free_ns, round(asked_ns))
            for first in range(0, self.datagrams, CHUNK):
                numbers = np.arange(first, min(first + CHUNK, self.datagrams))
                instants = start_ns + np.rint(numbers * gap_ns).astype(np.int64)
                yield np.diff(instants, prepend=last_ns)
                last_ns = int(instants[-1])
            free_ns = start_ns + length_ns


class FilesEntry(FlowEntry):
    """File transfers."""

    kind: Literal["files"] = Field(description="which traffic this is")
    rate: Rate = Field(description="rate while a file is sent")
    payload: Payload
    size: Bytes = Field(ge=1, le=10**10, description="size of a file")
    interval: Seconds = Field(gt=0, le=1e5, description="mean time between requests for a file")

    def traffic(self) -> Traffic:
        """Return the traffic."""
        return Files(self.rate, self.payload, self.size, seconds_to_ns(self.interval))
