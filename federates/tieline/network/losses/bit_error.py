"""Bits are wrong independently; a packet is lost with any of its bits, so long ones more often."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from tieline.network.draws import CHUNK, Chunks
from tieline.network.entry import Entry
from tieline.network.losses.base import Loss
from tieline.units import Share

MOST = 1e-4
"""Greatest bit-error rate: a packet of 1,500 bytes hardly ever arrives at it."""


@dataclass(frozen=True)
class BitError:
    """Bits wrong with probability `rate`, link-layer bits included.

    A packet of n bits is lost with probability 1 - (1 - rate)^n, exactly: the gap to the next wrong
    bit is geometric, and runs on from packet to packet.
    """

    rate: float

    @property
    def counts(self) -> Literal["bits"]:
        """Bits."""
        return "bits"

    def gaps(self, generator: np.random.Generator) -> Chunks:
        """Yield gaps of the geometric distribution."""
        while True:
            yield generator.geometric(self.rate, CHUNK)

    def share(self, link_bytes: int) -> float:
        """Return 1 - (1 - rate)^bits."""
        return -math.expm1(8 * link_bytes * math.log1p(-self.rate))


class BitErrorEntry(Entry):
    """Independent bit errors."""

    model: Literal["bit_error"] = Field(description="which loss model this is")
    rate: Share = Field(ge=1e-15, le=MOST, description="share of wrong bits")

    def loss(self) -> Loss:
        """Return the model."""
        return BitError(self.rate)
