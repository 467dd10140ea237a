"""Constant bit rate: equal gaps, from a random phase."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from tieline.network.draws import CHUNK, Chunks
from tieline.network.traffic.base import AtRate, FlowEntry, Payload, Rate, Traffic


@dataclass(frozen=True)
class Cbr(AtRate):
    """Datagrams of one size at equal gaps."""

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


class CbrEntry(FlowEntry):
    """Constant bit rate."""

    kind: Literal["cbr"] = Field(description="which traffic this is")
    rate: Rate
    payload: Payload

    def traffic(self) -> Traffic:
        """Return the traffic."""
        return Cbr(self.rate, self.payload)
