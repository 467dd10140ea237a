"""The packets that wait at a plain port: when each will start, and its size.

They stand in blocks of one line, of which a port has one and takes more from those that are free,
so that the memory is that of what waits and not of what the queues could hold. A start that has
passed is let go when somebody asks.
"""

from tieline.compiled import inlined
from tieline.network.packet.memory import (
    END_WAIT,
    ENTRY,
    FIRST_WAIT,
    FREE_BLOCK,
    FREE_BLOCKS,
    LINE,
    MAX_QUEUE,
    NEXT_BLOCK,
    WAITING,
    Cells,
    Layout,
)


@inlined
def still_waiting(now: int, port: int, cells: Cells, at: Layout) -> tuple[int, int]:
    """Let go of the packets that have started; return how many still wait, and the bytes let go."""
    place = at.blocks + cells[port + FIRST_WAIT]
    waiting = cells[port + WAITING]
    started_bytes = 0
    while waiting > 0 and cells[place] <= now:
        started_bytes += cells[place + 1]
        place += ENTRY
        waiting -= 1
        if waiting > 0 and _is_end(place):
            place = _next_block(place, cells, at)
    if waiting == 0:
        # A block that always begins anew stays in the processor's cache.
        place &= ~(LINE - 1)
        cells[port + END_WAIT] = place - at.blocks
    cells[port + FIRST_WAIT] = place - at.blocks
    cells[port + WAITING] = waiting
    return waiting, started_bytes


@inlined
def wait(start_ns: int, size: int, port: int, cells: Cells, at: Layout) -> None:
    """Note a packet that waits until `start_ns`; a block must be free."""
    place = at.blocks + cells[port + END_WAIT]
    if _is_end(place):
        place = _new_block(place, cells, at)
    cells[place] = start_ns
    cells[place + 1] = size
    cells[port + END_WAIT] = place + ENTRY - at.blocks
    cells[port + WAITING] += 1
    cells[port + MAX_QUEUE] = max(cells[port + MAX_QUEUE], cells[port + WAITING])


@inlined
def _is_end(place: int) -> bool:
    """Whether a place is behind the last packet of a block; blocks begin with lines."""
    return place & (LINE - 1) == NEXT_BLOCK


@inlined
def _next_block(end: int, cells: Cells, at: Layout) -> int:
    """Return where the block after one begins, which becomes free, given the end of that."""
    following = at.blocks + cells[end]
    cells[end] = cells[at.control + FREE_BLOCK]
    cells[at.control + FREE_BLOCK] = end - NEXT_BLOCK - at.blocks
    cells[at.control + FREE_BLOCKS] += 1
    return following


@inlined
def _new_block(end: int, cells: Cells, at: Layout) -> int:
    """Return where a block begins that was free and now follows one, given the end of that."""
    block = cells[at.control + FREE_BLOCK]
    cells[at.control + FREE_BLOCK] = cells[at.blocks + block + NEXT_BLOCK]
    cells[at.control + FREE_BLOCKS] -= 1
    cells[end] = block
    return at.blocks + block
