"""Reads from the kernel's memory what a packet finds at a port, and what was drawn for it there."""

from dataclasses import dataclass

from tieline.network.fate import Draw, Hop
from tieline.network.packet.memory import (
    CLASS_BYTES,
    CLASS_PACKETS,
    COUNT,
    EVENT_STREAM,
    FIRST_CLASS,
    FIRST_DRAW,
    FREE_AT,
    HAS_BYTES,
    HAS_JITTER,
    HAS_LOSS,
    HAS_RED,
    HAS_SERVER,
    HELD_BYTES,
    HOP_BYTES,
    HOP_CLASS,
    HOP_PORT,
    HOP_SERVICE,
    IS_DOWN,
    IS_SERVING,
    JITTER_STREAM,
    LOSS_LEFT,
    LOSS_STREAM,
    LOSS_UNIT,
    NONE,
    OVERHEAD,
    PEER,
    PER_BIT,
    PROPAGATION,
    QUEUE,
    QUEUE_BYTES,
    RATE,
    RED,
    RED_AVERAGE,
    RED_STREAM,
    SPECIAL,
    USED,
    WAITING,
    WAITING_BYTES,
    Memory,
)
from tieline.network.packet.red import CERTAIN, ONE_PACKET
from tieline.network.packet.supplies import Supplies
from tieline.network.spec import NetworkSpec, serialisation_ns

_BITS_PER_BYTE = 8


@dataclass(frozen=True)
class Port:
    """A port as it is at an instant.

    Attributes:
        row, details: its rows of the kernel's tables.
        packets, bytes: what waits there.
        is_busy: whether a packet is in transmission.
        taken: by stream, how many numbers have been used.
        early_value: the next number of its stream of early drops, 0 to 1.
        average: of early detection, packets.
    """

    row: list[int]
    details: list[int]
    packets: int
    bytes: int
    is_busy: bool
    taken: dict[int, int]
    early_value: float = 0.0
    average: float = 0.0
    red_stream: int = NONE


def port_now(number: int, now: int, memory: Memory, supplies: Supplies) -> Port:
    """Return a port as it is before the event of an instant."""
    row, details = (memory.table(name)[number].tolist() for name in ("ports", "details"))
    streams = memory.table("streams")
    red = early = None
    if row[SPECIAL] & HAS_RED:
        red = memory.table("red")[details[RED]]
        own = int(red[RED_STREAM])
        early = float(streams[own, FIRST_DRAW + streams[own, USED]]) / CERTAIN
    used = [details[column] for column in (LOSS_STREAM, EVENT_STREAM, JITTER_STREAM)]
    used += [] if red is None else [int(red[RED_STREAM])]
    packets, size, is_busy = _queue(number, now, memory)
    return Port(
        row,
        details,
        packets,
        size,
        is_busy,
        {stream: supplies.taken(stream, streams) for stream in used if stream != NONE},
        0.0 if early is None else early,
        0.0 if red is None else float(red[RED_AVERAGE]) / ONE_PACKET,
        NONE if red is None else int(red[RED_STREAM]),
    )


def _queue(port: int, now: int, memory: Memory) -> tuple[int, int, bool]:
    """Return packets and bytes that wait at a port, and whether its link is in use."""
    row, details = memory.table("ports")[port], memory.table("details")
    if row[SPECIAL] & HAS_SERVER:
        own, peer = details[port], details[port, PEER]
        is_busy = own[IS_SERVING] or (peer != NONE and details[peer, IS_SERVING] != 0)
        return int(row[WAITING]), int(own[WAITING_BYTES]), bool(is_busy)
    places = memory.waiting_at(port)
    places = places[memory.waits[places] > now]
    return len(places), int(memory.waits[places + 1].sum()), bool(row[FREE_AT] > now)


def hop_of(now: int, row: int, ip_bytes: int, port: Port, memory: Memory, spec: NetworkSpec) -> Hop:
    """Return a packet at the link of a row of `hops`, as it comes there."""
    plan = memory.plans_of(row)
    origin, target = ends_of(int(plan[HOP_PORT]), spec)
    size = int(plan[HOP_BYTES])
    if plan[HOP_SERVICE] == NONE:
        size = ip_bytes + port.details[OVERHEAD]
    return Hop(
        origin,
        target,
        now,
        port.packets,
        port.bytes,
        port.is_busy,
        size,
        port.row[PROPAGATION],
    )


def ends_of(port: int, spec: NetworkSpec) -> tuple[str, str]:
    """Return the nodes from and to which a port sends."""
    link = spec.links[port // 2]
    return (link.a, link.b) if port % 2 == 0 else (link.b, link.a)


def note_sent(
    hop: Hop, starts_ns: int, reaches_ns: int, is_lost: bool, port: Port, supplies: Supplies
) -> None:
    """Complete the record of a packet that goes on its link, given the port before that."""
    details = port.details
    hop.starts_ns, hop.reaches_ns = starts_ns, reaches_ns
    hop.service_ns = serialisation_ns(hop.size_bytes, details[RATE])
    if port.row[SPECIAL] & HAS_JITTER:
        stream = details[JITTER_STREAM]
        hop.jitter_ns = reaches_ns - starts_ns - hop.service_ns - hop.propagation_ns
        number = port.taken[stream] + 1
        hop.jitter = Draw(supplies.names[stream], number, float(hop.jitter_ns))
    if is_lost:
        hop.lost = _loss(hop, port, supplies)


def _loss(hop: Hop, port: Port, supplies: Supplies) -> Draw:
    """Return the gap between losses that ended within the packet."""
    details = port.details
    amount = _BITS_PER_BYTE * hop.size_bytes if details[LOSS_UNIT] == PER_BIT else 1
    stream = details[EVENT_STREAM]
    has_own = port.row[SPECIAL] & HAS_LOSS and details[LOSS_STREAM] != NONE
    if has_own and details[LOSS_LEFT] <= amount:
        stream = details[LOSS_STREAM]
    return Draw(supplies.names[stream], port.taken[stream])


def note_refused(hop: Hop, row: int, port: Port, memory: Memory, supplies: Supplies) -> None:
    """Complete the record of a packet that its port has refused, given the port before that."""
    if port.row[SPECIAL] & IS_DOWN:
        hop.dropped = "the link was down"
        return
    full = _why_full(hop, row, port, memory)
    if port.row[SPECIAL] & HAS_RED:
        stream = port.red_stream
        if supplies.taken(stream, memory.table("streams")) > port.taken[stream]:
            hop.early = Draw(supplies.names[stream], port.taken[stream] + 1, port.early_value)
        if full is None:
            average = f"the averaged queue was {port.average:.3f} packets before it came"
            hop.dropped = f"dropped early: {average}"
            return
    hop.dropped = full


def _why_full(hop: Hop, row: int, port: Port, memory: Memory) -> str | None:
    """Return in words why a queue has no room for a packet; None if it has."""
    if port.row[SPECIAL] & HAS_SERVER:
        place = port.details[FIRST_CLASS] + int(memory.plans_of(row)[HOP_CLASS])
        line = memory.table("classes")[place]
        if line[COUNT] >= line[CLASS_PACKETS]:
            return f"its class held {line[COUNT]} packets, the most it takes"
        return f"its class held {line[HELD_BYTES]} of at most {line[CLASS_BYTES]} bytes"
    if not port.is_busy:
        return None
    if port.packets >= port.row[QUEUE]:
        return f"the queue held {port.packets} packets, the most it takes"
    most = port.details[QUEUE_BYTES]
    if port.row[SPECIAL] & HAS_BYTES and port.bytes + hop.size_bytes > most:
        return f"the queue held {port.bytes} of at most {most} bytes"
    return None
