"""Events and random numbers of the packet kernel, for its other parts.

An event's item says what happens: 8 times a number plus one of the kinds below.
"""

from tieline.compiled import inlined
from tieline.network.draws import CHUNK
from tieline.network.packet.heap import pop, push
from tieline.network.packet.memory import (
    COLUMNS,
    FIRST_DRAW,
    HEAP_SIZE,
    NEXT_ORDER,
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
def item_of(kind: int, number: int) -> int:
    """Return the item of an event."""
    return (number << KIND_BITS) + kind


@inlined
def next_order(cells: Cells, at: Layout) -> int:
    """Return the order number of a new event."""
    order = cells[at.control + NEXT_ORDER]
    cells[at.control + NEXT_ORDER] = order + 1
    return order


@inlined
def push_event(time_ns: int, order: int, item: int, cells: Cells, at: Layout) -> None:
    """Add an event."""
    push(cells, at.heap, cells[at.control + HEAP_SIZE], time_ns, order, item)
    cells[at.control + HEAP_SIZE] += 1


@inlined
def pop_event(cells: Cells, at: Layout) -> None:
    """Remove the first event."""
    pop(cells, at.heap, cells[at.control + HEAP_SIZE])
    cells[at.control + HEAP_SIZE] -= 1


@inlined
def take(stream: int, cells: Cells, at: Layout) -> int:
    """Return the next number of a stream; asks for more once a whole chunk is used up."""
    row = at.streams + _STREAM * stream
    place = cells[row + USED]
    cells[row + USED] = place + 1
    if place + 1 >= CHUNK:
        cells[at.control + WANTS_DRAWS] = 1
    return cells[row + FIRST_DRAW + place]
