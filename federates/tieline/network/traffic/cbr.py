"""Constant bit rate: equal gaps, from a random phase."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from tieline.network.draws import CHUNK, Chunks
from tieline.network.traffic.base import HEADER_BYTES, FlowEntry, Payload, Rate, Traffic
from tieline.units import NS_PER_S


@dataclass(frozen=True)
class Cbr:
    """Datagrams of one size at equal gaps."""

    rate_bps: float
    payload_bytes: int

    @property
    def gap_ns(self) -> float:
        """Time between two datagrams."""
        return (self.payload_bytes + HEADER_BYTES) * 8 * NS_PER_S / self.rate_bps

    def gaps(self, generator: np.random.Generator) -> Chunks:
        """Yield the gaps; the instants, not the gaps, are rounded, so that the rate is exact."""
        phase = generator.random()
        last_ns = 0
        count = 0
        while True:
            instants = np.rint((phase + count + np.arange(CHUNK)) * self.gap_ns).astype(np.int64)
            yield np.diff(instants, prepend=last_ns)
            last_ns = int(instants[-1])
            count += CHUNK

    def scaled(self, factor: float) -> Traffic:
        """Return it at another rate."""
        return replace(self, rate_bps=self.rate_bps * factor)


class CbrEntry(FlowEntry):
    """Constant bit rate."""

    kind: Literal["cbr"]
    rate: Rate
    payload: Payload

    def traffic(self) -> Traffic:
        """Return the traffic."""
        return Cbr(self.rate, self.payload)
