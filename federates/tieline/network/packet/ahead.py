"""Asks for the lines of memory that the next events will need, while the first one is processed.

Packets, plans and ports of a large network do not fit the nearer caches, and where an event's are
is read from the event's packet. So what may come next but one has its packet asked for, and what
comes next, whose packet is here by then, has its port, its plan and its route asked for. What is
asked for in vain costs nothing but the asking: an event that is no arrival, a row that is empty.
"""

from tieline.compiled import inlined
from tieline.network.packet.events import ARRIVAL, KIND_BITS, KINDS
from tieline.network.packet.heap import below_of, first_of_four
from tieline.network.packet.memory import (
    COLUMNS,
    HEAP_COLUMNS,
    HOP,
    ITEM_MASK,
    ONWARD,
    RANK,
    Cells,
    Layout,
)
from tieline.network.packet.ways import PORT_COLUMNS, plan_at, port_at
from tieline.prefetch import prefetch

_PACKET = COLUMNS["packets"]


@inlined
def look_ahead(cells: Cells, at: Layout) -> None:
    """Ask for the port of the event below the first, and for the packets of those below that."""
    following = first_of_four(cells, below_of(at.heap, at.heap))
    rank = cells[following + RANK]
    if rank & (KINDS - 1) == ARRIVAL:
        packet = _packet_at(rank, at)
        way = cells[packet + ONWARD]
        prefetch(cells, plan_at(way, at))
        prefetch(cells, at.ports + PORT_COLUMNS * port_at(way))
        # The hop after the one that is now next.
        prefetch(cells, at.hops + cells[packet + HOP] + 2)
    below = below_of(at.heap, following)
    for row in range(below, below + 4 * HEAP_COLUMNS, HEAP_COLUMNS):
        prefetch(cells, _packet_at(cells[row + RANK], at))


@inlined
def _packet_at(rank: int, at: Layout) -> int:
    return at.packets + _PACKET * ((rank & ITEM_MASK) >> KIND_BITS)
