"""What every model of loss does: it says how far it is from one loss to the next.

A packet that is lost has used the link; what receives it throws it away.
"""

from typing import Literal, Protocol

import numpy as np

from tieline.network.draws import Chunks


class Loss(Protocol):
    """Losses of one direction of a link.

    Attributes:
        counts: what the gaps are counted in. A gap of 1 means that the very next one is bad.
    """

    @property
    def counts(self) -> Literal["packets", "bits"]:
        """Return `packets`, or `bits` where a packet is lost with any of its bits."""

    def gaps(self, generator: np.random.Generator) -> Chunks:
        """Yield chunks of the gaps from one loss to the next, each 1 or more."""

    def share(self, link_bytes: int) -> float:
        """Return the share of packets of a size, bytes on the link, that is lost in the mean."""
