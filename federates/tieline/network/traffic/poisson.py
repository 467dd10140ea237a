"""Poisson traffic: exponential gaps, as of many independent users."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from tieline.network.draws import CHUNK, Chunks
from tieline.network.traffic.base import HEADER_BYTES, FlowEntry, Payload, Rate, Traffic
from tieline.units import NS_PER_S


@dataclass(frozen=True)
class Poisson:
    """Datagrams of one size at exponential gaps."""

    rate_bps: float
    payload_bytes: int

    @property
    def gap_ns(self) -> float:
        """Mean time between two datagrams."""
        return (self.payload_bytes + HEADER_BYTES) * 8 * NS_PER_S / self.rate_bps

    def gaps(self, generator: np.random.Generator) -> Chunks:
        """Yield the gaps."""
        while True:
            exponential = generator.standard_exponential(CHUNK) * self.gap_ns
            yield np.rint(exponential).astype(np.int64)

    def scaled(self, factor: float) -> Traffic:
        """Return it at another rate."""
        return replace(self, rate_bps=self.rate_bps * factor)


class PoissonEntry(FlowEntry):
    """Poisson traffic."""

    kind: Literal["poisson"]
    rate: Rate
    payload: Payload

    def traffic(self) -> Traffic:
        """Return the traffic."""
        return Poisson(self.rate, self.payload)
