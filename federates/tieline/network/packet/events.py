"""Events and random numbers of the packet kernel, for its other parts.

An event's item says what happens: 8 times a number plus one of the kinds below. A frame enters
after every other event of its instant, and frames in the order of their items, whenever they were
announced, so that sending them earlier or later in wall time changes nothing.
"""

import numpy as np

from tieline.compiled import inlined
from tieline.network.draws import CHUNK
from tieline.network.packet.heap import pop, push, replace_first
from tieline.network.packet.memory import (
    COLUMNS,
    FIRST_DRAW,
    HEAP_SIZE,
    ITEM_BITS,
    ITEM_MASK,
    LATER,
    NEXT_ORDER,
    RANK,
    USED,
    WANTS_DRAWS,
    Cells,
    Layout,
)

ARRIVAL, CROSS, FRAME, DEPARTURE, TIMER, REPLY = range(6)
"""The packet in a slot reaches the end of its link; a cross flow sends; a frame leaves its source
(sequence times sources, plus the source); a port with a server ends a transmission; a connection's
timer ends; a flow sends the reply to a request."""

KIND_BITS = 3
KINDS = 1 << KIND_BITS

_STREAM = COLUMNS["streams"]


@inlined
def push_event(time_ns: int, kind: int, number: int, cells: Cells, at: Layout) -> None:
    """Add an event."""
    size = cells[at.control + HEAP_SIZE]
    push(cells, at.heap, size, time_ns, _next_rank(kind, number, cells, at))
    cells[at.control + HEAP_SIZE] = size + 1


@inlined
def replace_event(time_ns: int, kind: int, number: int, cells: Cells, at: Layout) -> None:
    """Put an event in the place of the first."""
    size = cells[at.control + HEAP_SIZE]
    replace_first(cells, at.heap, size, time_ns, _next_rank(kind, number, cells, at))


@inlined
def pop_event(cells: Cells, at: Layout) -> None:
    """Remove the first event."""
    pop(cells, at.heap, cells[at.control + HEAP_SIZE])
    cells[at.control + HEAP_SIZE] -= 1


@inlined
def item_of(rank: int) -> int:
    """Return the item of an event, given its rank."""
    return rank - LATER if rank >= LATER else rank & ITEM_MASK


def items_of(events: Cells) -> Cells:
    """Return (events,) the items of some events (events, 2)."""
    ranks = events[:, RANK]
    return np.where(ranks >= LATER, ranks - LATER, ranks & ITEM_MASK)


@inlined
def _next_rank(kind: int, number: int, cells: Cells, at: Layout) -> int:
    """Return the rank of a new event."""
    order = cells[at.control + NEXT_ORDER]
    cells[at.control + NEXT_ORDER] = order + 1
    return (order << ITEM_BITS) + (number << KIND_BITS) + kind


@inlined
def take(stream: int, cells: Cells, at: Layout) -> int:
    """Return the next number of a stream; asks for more once a whole chunk is used up."""
    row = at.streams + _STREAM * stream
    place = cells[row + USED]
    cells[row + USED] = place + 1
    if place + 1 >= CHUNK:
        cells[at.control + WANTS_DRAWS] = 1
    return cells[row + FIRST_DRAW + place]
