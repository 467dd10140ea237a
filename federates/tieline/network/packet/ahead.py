"""Asks for the lines of memory that events will need, as they come near the first.

Packets, plans and ports of a large network do not fit the nearer caches, and where an event's are
is read from the event's packet. So an event's packet is asked for some events ahead, and later,
when the packet is here, its port, its plan and its route.
"""

from tieline.compiled import inlined
from tieline.network.packet.kinds import ARRIVAL, KIND_BITS, KINDS
from tieline.network.packet.memory import COLUMNS, HOP, ITEM_MASK, ONWARD, Cells, Layout
from tieline.network.packet.ways import PORT_COLUMNS, plan_at, port_at
from tieline.prefetch import prefetch

_PACKET = COLUMNS["packets"]


@inlined
def ask_for_packet(rank: int, cells: Cells, at: Layout) -> None:
    """Ask for the packet of an event; in vain, if it is no arrival."""
    prefetch(cells, _packet_at(rank, at))


@inlined
def ask_for_port(rank: int, cells: Cells, at: Layout) -> None:
    """Ask for what the packet of an event will meet, if it is an arrival."""
    if rank & (KINDS - 1) == ARRIVAL:
        packet = _packet_at(rank, at)
        way = cells[packet + ONWARD]
        prefetch(cells, plan_at(way, at))
        prefetch(cells, at.ports + PORT_COLUMNS * port_at(way))
        # The hop after the one that is now next.
        prefetch(cells, at.hops + cells[packet + HOP] + 2)


@inlined
def _packet_at(rank: int, at: Layout) -> int:
    return at.packets + _PACKET * ((rank & ITEM_MASK) >> KIND_BITS)
