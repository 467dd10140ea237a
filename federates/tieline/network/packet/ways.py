"""Where the plan and the port of a packet's next hop are, and what the packet has there."""

from tieline.compiled import compiled_from_zero, inlined
from tieline.network.packet.memory import (
    COLUMNS,
    FORK,
    HOP,
    HOP_BYTES,
    HOP_PORT,
    HOP_SERVICE,
    IP_BYTES,
    NONE,
    OVERHEAD,
    PORT_BITS,
    PORT_MASK,
    Cells,
    Layout,
)

PORT_COLUMNS, DETAILS = COLUMNS["ports"], COLUMNS["details"]
_PLAN, _PACKET = COLUMNS["plans"], COLUMNS["packets"]


@inlined
def plan_of(hop: int, cells: Cells, at: Layout) -> int:
    """Return where the plan of a hop begins."""
    return plan_at(cells[at.hops + hop], at)


@inlined
def plan_at(way: int, at: Layout) -> int:
    """Return where the plan of an entry of `hops` begins."""
    return at.plans + _PLAN * (way >> PORT_BITS)


@inlined
def port_at(way: int) -> int:
    """Return the port of an entry of `hops`, `NO_PORT` or `FORK`."""
    return (way & PORT_MASK) + FORK


@inlined
def details_of(port: int, at: Layout) -> int:
    """Return where the details of a port begin, given where the port does."""
    return at.details + DETAILS // PORT_COLUMNS * (port - at.ports)


@compiled_from_zero
def link_bytes(slot: int, cells: Cells, at: Layout) -> int:
    """Return the bytes that a packet has on the link of its hop."""
    packet = at.packets + _PACKET * slot
    plan = plan_of(cells[packet + HOP], cells, at)
    if cells[plan + HOP_SERVICE] != NONE:
        return cells[plan + HOP_BYTES]
    details = at.details + DETAILS * cells[plan + HOP_PORT]
    return cells[packet + IP_BYTES] + cells[details + OVERHEAD]
