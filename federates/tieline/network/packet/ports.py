"""A port: what becomes of a packet that wants to go on a link.

A plain port is first in, first out and needs no event when a transmission ends: the next packet
starts at max(now, free_at), and a ring of the starts still to come gives the length of the queue.
A port with a server (priorities, round robin, half duplex) has an event at each end of a
transmission, because only then it is known which packet is next.
"""

from tieline.compiled import compiled_from_zero, inlined
from tieline.network.packet.events import DEPARTURE, item_of, next_order, push_event, take
from tieline.network.packet.memory import (
    BUSY,
    BYTES,
    CLASS_BYTES,
    CLASS_PACKETS,
    COLUMNS,
    COUNT,
    DEFICIT,
    DOWN_DROPS,
    END_CLASSES,
    EVENT_LEFT,
    EVENT_STREAM,
    FIRST_CLASS,
    FLOW,
    FREE_AT,
    HAS_BYTES,
    HAS_JITTER,
    HAS_LOSS,
    HAS_RED,
    HAS_SERVER,
    HAS_TAP,
    HEAD,
    HELD_BYTES,
    HOP,
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
    LOST,
    MAX_QUEUE,
    NEXT,
    NONE,
    ONWARD,
    OVERHEAD,
    PACKETS,
    PART,
    PEER,
    PER_BIT,
    PROPAGATION,
    QUANTUM,
    QUEUE,
    QUEUE_BYTES,
    QUEUE_DROPS,
    RATE,
    RING,
    RING_HEAD,
    ROUND_ROBIN,
    SEQUENCE,
    SERVICE_ORDER,
    SPECIAL,
    TAIL,
    TAP_BYTES,
    TAP_FLOW,
    TAP_HOP,
    TAP_PART,
    TAP_PORT,
    TAP_SEQUENCE,
    TAP_TIME,
    TAPPED,
    TURN,
    WAITING,
    WAITING_BYTES,
    Cells,
    Layout,
)
from tieline.network.packet.red import is_dropped_early
from tieline.network.packet.ways import PORT_COLUMNS, link_bytes, plan_at, plan_of, port_at

DROPPED_AT_QUEUE, DROPPED_AT_CUT, WAITS = -1, -2, -3
"""In place of the instant at which a packet reaches the end of a link."""

_CLASS, _PACKET, _TAP, _RING = (COLUMNS[name] for name in ("classes", "packets", "taps", "ring"))
_NS_PER_S = 1_000_000_000


@inlined
def transmit(now: int, slot: int, hop: int, way: int, cells: Cells, at: Layout) -> int:
    """Return when the packet in `slot` reaches the end of the link, or one of the above.

    `way` is the entry of `hops` for `hop`. Whether the link loses the packet is decided here and
    takes effect at the end of the link.
    """
    plan = plan_at(way, at)
    port = at.ports + PORT_COLUMNS * port_at(way)
    packet = at.packets + _PACKET * slot
    cells[packet + HOP] = hop
    cells[packet + ONWARD] = cells[at.hops + hop + 1]
    if cells[port + SPECIAL] != 0:
        return _transmit_special(now, slot, hop, cells, at)
    service_ns = cells[plan + HOP_SERVICE]
    size = cells[plan + HOP_BYTES]
    if service_ns == NONE:
        size = link_bytes(slot, cells, at)
        service_ns = _service_ns(size, port, cells)
    start_ns = max(now, cells[port + FREE_AT])
    if start_ns > now and not _queue(now, start_ns, size, port, cells, at):
        cells[port + QUEUE_DROPS] += 1
        return DROPPED_AT_QUEUE
    _occupy(start_ns, service_ns, size, port, cells)
    return start_ns + service_ns + cells[port + PROPAGATION]


@compiled_from_zero
def depart(now: int, number: int, cells: Cells, at: Layout) -> None:
    """A port with a server has ended a transmission: the next packet starts, if one waits.

    On a half-duplex link the turn goes to the other end, if anything waits there.
    """
    port = at.ports + PORT_COLUMNS * number
    cells[port + IS_SERVING] = 0
    peer = cells[port + PEER]
    if peer != NONE and cells[at.ports + PORT_COLUMNS * peer + WAITING] > 0:
        port = at.ports + PORT_COLUMNS * peer
    if cells[port + WAITING] > 0:
        slot = _next_waiting(port, cells, at)
        arrival_ns = _serve(now, slot, port, cells, at)
        push_event(arrival_ns, next_order(cells, at), item_of(0, slot), cells, at)


@inlined
def _service_ns(size: int, port: int, cells: Cells) -> int:
    """Return the serialisation time of some bytes, rounded to the nearest nanosecond."""
    rate = cells[port + RATE]
    return (16 * size * _NS_PER_S + rate) // (2 * rate)


@inlined
def _occupy(start_ns: int, service_ns: int, size: int, port: int, cells: Cells) -> None:
    """Book the link for a packet."""
    cells[port + FREE_AT] = start_ns + service_ns
    cells[port + PACKETS] += 1
    cells[port + BYTES] += size
    cells[port + BUSY] += service_ns


@inlined
def _queue(now: int, start_ns: int, size: int, port: int, cells: Cells, at: Layout) -> bool:
    """Let a packet wait at a plain port until `start_ns`; false if the queue is full.

    It is `_waiting` and `_wait` in one, without the count of bytes: most packets come here.
    """
    room = cells[port + QUEUE]
    ring = at.ring + _RING * cells[port + RING]
    head = cells[port + RING_HEAD]
    waiting = cells[port + WAITING]
    while waiting > 0 and cells[ring + _RING * head] <= now:
        head = head + 1 if head + 1 < room else 0
        waiting -= 1
    if waiting == 0:
        # A ring that always begins anew stays in the processor's cache.
        head = 0
    is_accepted = waiting < room
    if is_accepted:
        tail = head + waiting
        row = ring + _RING * (tail if tail < room else tail - room)
        cells[row] = start_ns
        cells[row + 1] = size
        waiting += 1
        cells[port + MAX_QUEUE] = max(cells[port + MAX_QUEUE], waiting)
    cells[port + RING_HEAD] = head
    cells[port + WAITING] = waiting
    return is_accepted


@inlined
def _waiting(now: int, port: int, cells: Cells, at: Layout) -> int:
    """Return how many packets wait at a port without a server."""
    ring = at.ring + _RING * cells[port + RING]
    room = cells[port + QUEUE]
    head = cells[port + RING_HEAD]
    waiting = cells[port + WAITING]
    while waiting > 0 and cells[ring + _RING * head] <= now:
        cells[port + WAITING_BYTES] -= cells[ring + _RING * head + 1]
        head = head + 1 if head + 1 < room else 0
        waiting -= 1
    cells[port + RING_HEAD] = head
    cells[port + WAITING] = waiting
    return waiting


@inlined
def _wait(start_ns: int, size: int, port: int, cells: Cells, at: Layout) -> None:
    """Note a packet that waits there until `start_ns`; there must be room for it."""
    room = cells[port + QUEUE]
    tail = cells[port + RING_HEAD] + cells[port + WAITING]
    row = at.ring + _RING * (cells[port + RING] + (tail if tail < room else tail - room))
    cells[row] = start_ns
    cells[row + 1] = size
    cells[port + WAITING] += 1
    cells[port + WAITING_BYTES] += size
    cells[port + MAX_QUEUE] = max(cells[port + MAX_QUEUE], cells[port + WAITING])


@compiled_from_zero
def _transmit_special(now: int, slot: int, hop: int, cells: Cells, at: Layout) -> int:
    plan = plan_of(hop, cells, at)
    port = at.ports + PORT_COLUMNS * cells[plan + HOP_PORT]
    special = cells[port + SPECIAL]
    if special & IS_DOWN != 0:
        cells[port + DOWN_DROPS] += 1
        return DROPPED_AT_CUT
    if special & HAS_SERVER != 0:
        return _transmit_served(now, slot, hop, cells, at)
    size = link_bytes(slot, cells, at)
    start_ns = max(now, cells[port + FREE_AT])
    waiting = _waiting(now, port, cells, at)
    is_full = start_ns > now and (
        waiting >= cells[port + QUEUE]
        or (
            special & HAS_BYTES != 0
            and cells[port + WAITING_BYTES] + size > cells[port + QUEUE_BYTES]
        )
    )
    service_ns = cells[plan + HOP_SERVICE]
    if service_ns == NONE:
        service_ns = _service_ns(size, port, cells)
    # Every packet that comes counts in the average of early detection, also at a full queue.
    is_early = special & HAS_RED != 0 and is_dropped_early(
        now, waiting, service_ns, port, cells, at
    )
    if is_full or is_early:
        cells[port + QUEUE_DROPS] += 1
        return DROPPED_AT_QUEUE
    if start_ns > now:
        _wait(start_ns, size, port, cells, at)
    _occupy(start_ns, service_ns, size, port, cells)
    return _reach(start_ns, service_ns, size, slot, port, cells, at)


@compiled_from_zero
def _reach(
    start_ns: int, service_ns: int, size: int, slot: int, port: int, cells: Cells, at: Layout
) -> int:
    """Return when a packet that starts at an instant reaches the end of the link."""
    special = cells[port + SPECIAL]
    packet = at.packets + _PACKET * slot
    arrival_ns = start_ns + service_ns + cells[port + PROPAGATION]
    if special & HAS_LOSS != 0:
        cells[packet + LOST] = _is_lost(size, port, cells, at)
    if special & HAS_JITTER != 0:
        arrival_ns += take(cells[port + JITTER_STREAM], cells, at)
    if special & HAS_TAP != 0:
        hop = cells[packet + HOP]
        number = cells[plan_of(hop, cells, at) + HOP_PORT]
        record = at.taps + _TAP * cells[at.control + TAPPED]
        cells[record + TAP_TIME] = start_ns
        cells[record + TAP_PORT] = number
        cells[record + TAP_FLOW] = cells[packet + FLOW]
        cells[record + TAP_SEQUENCE] = cells[packet + SEQUENCE]
        cells[record + TAP_HOP] = hop
        cells[record + TAP_PART] = cells[packet + PART]
        cells[record + TAP_BYTES] = size - cells[port + OVERHEAD]
        cells[at.control + TAPPED] += 1
    return arrival_ns


@inlined
def _is_lost(size: int, port: int, cells: Cells, at: Layout) -> int:
    """Return 1 if the link loses a packet, by its own losses or by those of an event."""
    lost = 0
    if cells[port + LOSS_STREAM] != NONE:
        amount = 8 * size if cells[port + LOSS_UNIT] == PER_BIT else 1
        lost = _passes(amount, port + LOSS_LEFT, cells[port + LOSS_STREAM], cells, at)
    if cells[port + EVENT_STREAM] != NONE:
        lost |= _passes(1, port + EVENT_LEFT, cells[port + EVENT_STREAM], cells, at)
    return lost


@inlined
def _passes(amount: int, left: int, stream: int, cells: Cells, at: Layout) -> int:
    """Return 1 if the next loss, `left` units ahead, falls within some; then look for another."""
    cells[left] -= amount
    lost = 1 if cells[left] <= 0 else 0
    while cells[left] <= 0:
        cells[left] += take(stream, cells, at)
    return lost


@inlined
def _transmit_served(now: int, slot: int, hop: int, cells: Cells, at: Layout) -> int:
    """A packet comes to a port with a server."""
    plan = plan_of(hop, cells, at)
    port = at.ports + PORT_COLUMNS * cells[plan + HOP_PORT]
    peer = cells[port + PEER]
    is_busy = cells[port + IS_SERVING] != 0 or (
        peer != NONE and cells[at.ports + PORT_COLUMNS * peer + IS_SERVING] != 0
    )
    if not is_busy:
        return _serve(now, slot, port, cells, at)
    size = link_bytes(slot, cells, at)
    row = at.classes + _CLASS * (cells[port + FIRST_CLASS] + cells[plan + HOP_CLASS])
    if (
        cells[row + COUNT] >= cells[row + CLASS_PACKETS]
        or cells[row + HELD_BYTES] + size > cells[row + CLASS_BYTES]
    ):
        cells[port + QUEUE_DROPS] += 1
        return DROPPED_AT_QUEUE
    cells[at.packets + _PACKET * slot + NEXT] = NONE
    if cells[row + COUNT] == 0:
        cells[row + HEAD] = slot
    else:
        cells[at.packets + _PACKET * cells[row + TAIL] + NEXT] = slot
    cells[row + TAIL] = slot
    cells[row + COUNT] += 1
    cells[row + HELD_BYTES] += size
    cells[port + WAITING] += 1
    cells[port + WAITING_BYTES] += size
    cells[port + MAX_QUEUE] = max(cells[port + MAX_QUEUE], cells[port + WAITING])
    return WAITS


@compiled_from_zero
def _serve(now: int, slot: int, port: int, cells: Cells, at: Layout) -> int:
    """A port with a server starts to transmit a packet; returns when that reaches the end."""
    hop = cells[at.packets + _PACKET * slot + HOP]
    plan = plan_of(hop, cells, at)
    size = link_bytes(slot, cells, at)
    service_ns = cells[plan + HOP_SERVICE]
    if service_ns == NONE:
        service_ns = _service_ns(size, port, cells)
    _occupy(now, service_ns, size, port, cells)
    cells[port + IS_SERVING] = 1
    item = item_of(DEPARTURE, cells[plan + HOP_PORT])
    push_event(now + service_ns, next_order(cells, at), item, cells, at)
    return _reach(now, service_ns, size, slot, port, cells, at)


@inlined
def _next_waiting(port: int, cells: Cells, at: Layout) -> int:
    """Take the packet out of a port's classes that is next; one must wait."""
    first, end = cells[port + FIRST_CLASS], cells[port + END_CLASSES]
    number = first
    if cells[port + SERVICE_ORDER] == ROUND_ROBIN:
        number = _turn(port, cells, at)
    else:
        while cells[at.classes + _CLASS * number + COUNT] == 0 and number + 1 < end:
            number += 1
    row = at.classes + _CLASS * number
    slot = cells[row + HEAD]
    size = link_bytes(slot, cells, at)
    cells[row + HEAD] = cells[at.packets + _PACKET * slot + NEXT]
    cells[row + COUNT] -= 1
    cells[row + HELD_BYTES] -= size
    cells[port + WAITING] -= 1
    cells[port + WAITING_BYTES] -= size
    if cells[port + SERVICE_ORDER] == ROUND_ROBIN:
        cells[row + DEFICIT] = cells[row + DEFICIT] - size if cells[row + COUNT] > 0 else 0
    return slot


@inlined
def _turn(port: int, cells: Cells, at: Layout) -> int:
    """Return the class whose turn it is by deficit round robin.

    M. Shreedhar and G. Varghese, Efficient fair queuing using deficit round-robin, IEEE/ACM Trans.
    Networking 4 (1996): a class may send what its deficit counter covers; the counter grows by the
    quantum at each visit and is lost when the class is empty.
    """
    first, end = cells[port + FIRST_CLASS], cells[port + END_CLASSES]
    number = cells[port + TURN]
    row = at.classes + _CLASS * number
    while (
        cells[row + COUNT] == 0 or link_bytes(cells[row + HEAD], cells, at) > cells[row + DEFICIT]
    ):
        number = number + 1 if number + 1 < end else first
        row = at.classes + _CLASS * number
        if cells[row + COUNT] > 0:
            cells[row + DEFICIT] += cells[row + QUANTUM]
    cells[port + TURN] = number
    return number
