"""Every packet is lost with the same probability, independently of all others."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import Field

from tieline.network.draws import CHUNK, Chunks
from tieline.network.entry import Entry
from tieline.network.losses.base import Loss
from tieline.units import Share


@dataclass(frozen=True)
class Bernoulli:
    """Losses of probability `probability`, above 0 and below 1."""

    probability: float

    @property
    def counts(self) -> Literal["packets"]:
        """Packets."""
        return "packets"

    def gaps(self, generator: np.random.Generator) -> Chunks:
        """Yield gaps of the geometric distribution."""
        while True:
            yield generator.geometric(self.probability, CHUNK)

    def share(self, link_bytes: int) -> float:
        """Return the probability."""
        return self.probability


class BernoulliEntry(Entry):
    """Independent losses."""

    model: Literal["bernoulli"] = Field(description="which loss model this is")
    probability: Share = Field(gt=0, lt=1, description="probability that a packet is lost")

    def loss(self) -> Loss:
        """Return the model."""
        return Bernoulli(self.probability)
