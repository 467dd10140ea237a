"""Poisson traffic: exponential gaps, as of many independent users."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from tieline.network.draws import CHUNK, Chunks
from tieline.network.traffic.base import AtRate, FlowEntry, Payload, Rate, Traffic


@dataclass(frozen=True)
class Poisson(AtRate):
    """Datagrams of one size at exponential gaps."""

    def gaps(self, generator: np.random.Generator) -> Chunks:
        """Yield the gaps."""
        while True:
            exponential = generator.standard_exponential(CHUNK) * self.gap_ns
            yield np.rint(exponential).astype(np.int64)


class PoissonEntry(FlowEntry):
    """Poisson traffic."""

    kind: Literal["poisson"] = Field(description="which traffic this is")
    rate: Rate
    payload: Payload

    def traffic(self) -> Traffic:
        """Return the traffic."""
        return Poisson(self.rate, self.payload)
