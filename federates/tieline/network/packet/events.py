"""Events and random numbers of the packet kernel, for its other parts."""

from tieline.compiled import inlined
from tieline.network.draws import CHUNK
from tieline.network.packet.heap import pop, push, replace_first
from tieline.network.packet.kinds import KIND_BITS
from tieline.network.packet.memory import (
    COLUMNS,
    FIRST_DRAW,
    HEAP_SIZE,
    ITEM_BITS,
    NEXT_ORDER,
    USED,
    WANTS_DRAWS,
    Cells,
    Layout,
)

_STREAM = COLUMNS["streams"]


@inlined
def push_event(time_ns: int, kind: int, number: int, cells: Cells, at: Layout) -> None:
    """Add an event."""
    size = cells[at.control + HEAP_SIZE]
    push(size, time_ns, _next_rank(kind, number, cells, at), cells, at)
    cells[at.control + HEAP_SIZE] = size + 1


@inlined
def replace_event(time_ns: int, kind: int, number: int, cells: Cells, at: Layout) -> None:
    """Put an event in the place of the first."""
    size = cells[at.control + HEAP_SIZE]
    replace_first(size, time_ns, _next_rank(kind, number, cells, at), cells, at)


@inlined
def pop_event(cells: Cells, at: Layout) -> None:
    """Remove the first event."""
    pop(cells[at.control + HEAP_SIZE], cells, at)
    cells[at.control + HEAP_SIZE] -= 1


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
