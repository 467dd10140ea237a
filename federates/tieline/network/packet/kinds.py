"""What an event is: a packet that arrives, a flow that sends, a timer that ends.

An event's item says what happens: 8 times a number plus one of the kinds below. A frame enters
after every other event of its instant, and frames in the order of their items, whenever they were
announced, so that sending them earlier or later in wall time changes nothing.
"""

import numpy as np

from tieline.compiled import inlined
from tieline.network.packet.memory import ITEM_MASK, LATER, RANK, Cells

ARRIVAL, CROSS, FRAME, DEPARTURE, TIMER, REPLY = range(6)
"""The packet in a slot reaches the end of its link; a cross flow sends; a frame leaves its source
(sequence times sources, plus the source); a port with a server ends a transmission; a connection's
timer ends; a flow sends the reply to a request."""

KIND_BITS = 3
KINDS = 1 << KIND_BITS


@inlined
def item_of(rank: int) -> int:
    """Return the item of an event, given its rank."""
    return rank - LATER if rank >= LATER else rank & ITEM_MASK


def items_of(events: Cells) -> Cells:
    """Return (events,) the items of some events (events, 2)."""
    ranks = events[:, RANK]
    return np.where(ranks >= LATER, ranks - LATER, ranks & ITEM_MASK)
