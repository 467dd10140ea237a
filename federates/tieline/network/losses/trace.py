"""Losses as somebody else saw them: the numbers of the packets that were lost."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from tieline.network.draws import NEVER, Chunks, chunked


@dataclass(frozen=True)
class LossTrace:
    """The n-th packet of a direction is lost, counted from 0, for each n of a list.

    Attributes:
        numbers: ascending.
    """

    numbers: tuple[int, ...]

    @property
    def counts(self) -> Literal["packets"]:
        """Packets."""
        return "packets"

    def gaps(self, generator: np.random.Generator) -> Chunks:
        """Yield the gaps of the list, then none that ends."""
        places = np.array([-1, *self.numbers], dtype=np.int64)
        return chunked([places[1:] - places[:-1]], NEVER)

    def share(self, link_bytes: int) -> float:
        """Return zero: what a list says has no mean."""
        return 0.0
