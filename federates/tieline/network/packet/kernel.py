"""The discrete-event kernel: integers only, compiled, one event for each hop of each packet.

Everything random is drawn outside, by named generators, as whole numbers; the kernel takes them
from its tables in the order in which it needs them. It therefore computes the same compiled or not,
and however its caller cuts the time into pieces.

A port is first in, first out and needs no event when a transmission ends: the next packet starts at
max(now, free_at), and a ring of the starts still to come gives the length of the queue.

In the heap, item s >= 0 is the packet in slot s at the end of its link, item -1 - c the next packet
of cross flow c, and item -1 - C - (q S + i) frame q leaving source i, of C cross flows, S sources.
"""

from tieline.compiled import compiled
from tieline.network.engine import DELIVERED, LOSS, QUEUE_FULL
from tieline.network.packet.heap import pop, push, replace_first
from tieline.network.packet.memory import (
    ARRIVED,
    BUSY,
    BYTES,
    COLUMNS,
    DESTINATION,
    DRAWS_CHUNK,
    END_FLOW,
    END_FLOWS,
    END_HOW,
    END_SEQUENCE,
    END_TIME,
    ENDED,
    FIRST_DRAW,
    FIRST_FLOW,
    FIRST_HOP,
    FLOW,
    FREE_AT,
    FREE_PACKETS,
    GAP_STREAM,
    HEAP_SIZE,
    HOP,
    HOP_BYTES,
    HOP_PORT,
    HOP_SERVICE,
    ITEM,
    JITTER_STREAM,
    LOSS_DROPS,
    LOSS_STREAM,
    LOST,
    MAX_QUEUE,
    NEXT_ORDER,
    NO_PORT,
    NO_STREAM,
    PACKETS,
    PROCESSING,
    PROCESSING_STREAM,
    PROPAGATION,
    QUEUE,
    QUEUE_DROPS,
    RING,
    RING_HEAD,
    SENT,
    SEQUENCE,
    TIME,
    USED,
    WAITING,
    WANTS_DRAWS,
    Cells,
    Layout,
)

DONE, NEEDS_ROOM, NEEDS_DRAWS = 0, 1, 2

FRAME_ORDER = 1 << 62
"""Added to a frame's order: it enters after every other event of its instant, whenever it was
announced, so that sending it earlier or later in wall time changes nothing."""

_DROPPED = -1
_PORT = COLUMNS["ports"]
_HOP = COLUMNS["hops"]
_FLOW = COLUMNS["flows"]
_SOURCE = COLUMNS["sources"]
_DESTINATION = COLUMNS["destinations"]
_CROSS = COLUMNS["cross"]
_STREAM = COLUMNS["streams"]
_PACKET = COLUMNS["packets"]
_ENDED = COLUMNS["ended"]


@compiled
def run(until_ns: int, cells: Cells, at: Layout) -> int:
    """Process every event up to and including `until_ns`.

    Returns:
        `DONE`; or, with the remaining events untouched, `NEEDS_ROOM` (more packets, events or
        records of ended packets may come than the tables hold) or `NEEDS_DRAWS` (a stream has used
        up a chunk). The caller helps and calls again.
    """
    while cells[at.control + HEAP_SIZE] > 0 and cells[at.heap + TIME] <= until_ns:
        if cells[at.control + WANTS_DRAWS] != 0:
            return NEEDS_DRAWS
        if not has_room(cells, at):
            return NEEDS_ROOM
        now = cells[at.heap + TIME]
        item = cells[at.heap + ITEM]
        if item >= 0:
            _arrive(now, item, cells, at)
        elif item >= -at.cross_flows:
            _send_cross(now, -1 - item, cells, at)
        else:
            _send_frame(now, -1 - item - at.cross_flows, cells, at)
    return DONE


@compiled
def announce(times_ns: Cells, items: Cells, base_order: int, cells: Cells, at: Layout) -> None:
    """Add frames, or the first packets of cross flows, to the events; the heap must have room."""
    for place in range(len(times_ns)):
        _push(times_ns[place], base_order + _order(cells, at), items[place], cells, at)


@compiled
def has_room(cells: Cells, at: Layout) -> bool:
    """Return whether the next event can be processed, whatever it is."""
    return (
        cells[at.control + FREE_PACKETS] >= at.most_packets
        and cells[at.control + HEAP_SIZE] + at.most_packets <= at.capacity
        and cells[at.control + ENDED] + at.most_packets <= at.capacity
    )


@compiled
def _take(stream: int, cells: Cells, at: Layout) -> int:
    """Return the next number of a stream; asks for more once a whole chunk is used up."""
    row = at.streams + _STREAM * stream
    place = cells[row + USED]
    cells[row + USED] = place + 1
    if place + 1 >= DRAWS_CHUNK:
        cells[at.control + WANTS_DRAWS] = 1
    return cells[row + FIRST_DRAW + place]


@compiled
def _order(cells: Cells, at: Layout) -> int:
    order = cells[at.control + NEXT_ORDER]
    cells[at.control + NEXT_ORDER] = order + 1
    return order


@compiled
def _push(time_ns: int, order: int, item: int, cells: Cells, at: Layout) -> None:
    push(cells, at.heap, cells[at.control + HEAP_SIZE], time_ns, order, item)
    cells[at.control + HEAP_SIZE] += 1


@compiled
def _pop(cells: Cells, at: Layout) -> None:
    pop(cells, at.heap, cells[at.control + HEAP_SIZE])
    cells[at.control + HEAP_SIZE] -= 1


@compiled
def _arrive(now: int, slot: int, cells: Cells, at: Layout) -> None:
    """A packet reaches the end of a link, as the first event of the heap."""
    packet = at.packets + _PACKET * slot
    hop = cells[packet + HOP] + 1
    if cells[packet + LOST] != 0:
        port = cells[at.hops + _HOP * (hop - 1) + HOP_PORT]
        cells[at.ports + _PORT * port + LOSS_DROPS] += 1
        _leave(now, slot, LOSS, cells, at)
    elif cells[at.hops + _HOP * hop + HOP_PORT] == NO_PORT:
        _leave(now, slot, DELIVERED, cells, at)
    else:
        arrival_ns = _transmit(now, slot, hop, cells, at)
        if arrival_ns == _DROPPED:
            _leave(now, slot, QUEUE_FULL, cells, at)
        else:
            size = cells[at.control + HEAP_SIZE]
            replace_first(cells, at.heap, size, arrival_ns, _order(cells, at), slot)


@compiled
def _leave(now: int, slot: int, how: int, cells: Cells, at: Layout) -> None:
    """Take a packet, whose event is the first of the heap, out of the network."""
    _pop(cells, at)
    cells[at.free + cells[at.control + FREE_PACKETS]] = slot
    cells[at.control + FREE_PACKETS] += 1
    packet = at.packets + _PACKET * slot
    _end(now, cells[packet + FLOW], cells[packet + SEQUENCE], how, cells, at)


@compiled
def _send_cross(now: int, number: int, cells: Cells, at: Layout) -> None:
    """A cross flow sends a packet and plans its next one."""
    flow = at.cross + _CROSS * number
    cells[flow + SENT] += 1
    _enter(now, at.pmu_flows + number, 0, cells, at)
    next_ns = now + _take(cells[flow + GAP_STREAM], cells, at)
    # The packet's own event is later in the heap's order, so this one still stands first.
    size = cells[at.control + HEAP_SIZE]
    replace_first(cells, at.heap, size, next_ns, _order(cells, at), -1 - number)


@compiled
def _send_frame(now: int, code: int, cells: Cells, at: Layout) -> None:
    """A PMU sends one frame to each of its destinations, back to back in their order."""
    _pop(cells, at)
    source = at.sources + _SOURCE * (code % at.source_count)
    for flow in range(cells[source + FIRST_FLOW], cells[source + END_FLOWS]):
        _enter(now, flow, code // at.source_count, cells, at)


@compiled
def _enter(now: int, flow: int, sequence: int, cells: Cells, at: Layout) -> None:
    """A packet enters the network at the first node of its route."""
    hop = cells[at.flows + _FLOW * flow + FIRST_HOP]
    if cells[at.hops + _HOP * hop + HOP_PORT] == NO_PORT:
        _end(now, flow, sequence, DELIVERED, cells, at)
        return
    slot = cells[at.free + cells[at.control + FREE_PACKETS] - 1]
    arrival_ns = _transmit(now, slot, hop, cells, at)
    if arrival_ns == _DROPPED:
        _end(now, flow, sequence, QUEUE_FULL, cells, at)
        return
    cells[at.control + FREE_PACKETS] -= 1
    packet = at.packets + _PACKET * slot
    cells[packet + FLOW] = flow
    cells[packet + SEQUENCE] = sequence
    _push(arrival_ns, _order(cells, at), slot, cells, at)


@compiled
def _transmit(now: int, slot: int, hop: int, cells: Cells, at: Layout) -> int:
    """Return when the packet in `slot` reaches the end of the link, or `_DROPPED`.

    Whether the link loses it is decided here and takes effect at the end of the link.
    """
    plan = at.hops + _HOP * hop
    port = at.ports + _PORT * cells[plan + HOP_PORT]
    start_ns = max(now, cells[port + FREE_AT])
    if start_ns > now and not _queue(now, start_ns, port, cells, at):
        cells[port + QUEUE_DROPS] += 1
        return _DROPPED
    service_ns = cells[plan + HOP_SERVICE]
    cells[port + FREE_AT] = start_ns + service_ns
    cells[port + PACKETS] += 1
    cells[port + BYTES] += cells[plan + HOP_BYTES]
    cells[port + BUSY] += service_ns
    packet = at.packets + _PACKET * slot
    cells[packet + HOP] = hop
    cells[packet + LOST] = 0
    if cells[port + LOSS_STREAM] != NO_STREAM:
        cells[packet + LOST] = _take(cells[port + LOSS_STREAM], cells, at)
    arrival_ns = start_ns + service_ns + cells[port + PROPAGATION]
    if cells[port + JITTER_STREAM] != NO_STREAM:
        arrival_ns += _take(cells[port + JITTER_STREAM], cells, at)
    return arrival_ns


@compiled
def _queue(now: int, start_ns: int, port: int, cells: Cells, at: Layout) -> bool:
    """Let a packet wait at a busy port until `start_ns`; false if the queue is full."""
    ring = at.ring + cells[port + RING]
    room = cells[port + QUEUE]
    head = cells[port + RING_HEAD]
    waiting = cells[port + WAITING]
    while waiting > 0 and cells[ring + head] <= now:
        head = head + 1 if head + 1 < room else 0
        waiting -= 1
    is_accepted = waiting < room
    if is_accepted:
        tail = head + waiting
        cells[ring + (tail if tail < room else tail - room)] = start_ns
        waiting += 1
        cells[port + MAX_QUEUE] = max(cells[port + MAX_QUEUE], waiting)
    cells[port + RING_HEAD] = head
    cells[port + WAITING] = waiting
    return is_accepted


@compiled
def _end(now: int, flow: int, sequence: int, how: int, cells: Cells, at: Layout) -> None:
    """Record how a packet ended; a delivered frame's time is when its controller can use it."""
    if flow >= at.pmu_flows:
        cells[at.cross + _CROSS * (flow - at.pmu_flows) + ARRIVED + how] += 1
        return
    end_ns = now
    if how == DELIVERED:
        destination = cells[at.flows + _FLOW * flow + DESTINATION]
        stage = at.destinations + _DESTINATION * destination
        end_ns += cells[stage + PROCESSING]
        if cells[stage + PROCESSING_STREAM] != NO_STREAM:
            end_ns += _take(cells[stage + PROCESSING_STREAM], cells, at)
    record = at.ended + _ENDED * cells[at.control + ENDED]
    cells[record + END_TIME] = end_ns
    cells[record + END_FLOW] = flow
    cells[record + END_SEQUENCE] = sequence
    cells[record + END_HOW] = how
    cells[at.control + ENDED] += 1
