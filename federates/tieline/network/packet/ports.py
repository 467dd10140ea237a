"""A port: what becomes of a packet that wants to go on a link.

A plain port is first in, first out and needs no event when a transmission ends: the next packet
starts at max(now, free_at), and the starts still to come give the length of the queue.
A port with a server (priorities, round robin, half duplex) has an event at each end of a
transmission, because only then it is known which packet is next.
"""

from tieline.compiled import compiled_from_zero, inlined
from tieline.network.packet.events import push_event, take
from tieline.network.packet.kinds import ARRIVAL, DEPARTURE
from tieline.network.packet.memory import (
    BUSY,
    BYTES,
    CARRIED,
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
from tieline.network.packet.waiting import still_waiting, wait
from tieline.network.packet.ways import (
    DETAILS,
    PORT_COLUMNS,
    details_of,
    link_bytes,
    plan_at,
    plan_of,
    port_at,
)

DROPPED_AT_QUEUE, DROPPED_AT_CUT, WAITS = -1, -2, -3
"""In place of the instant at which a packet reaches the end of a link."""

_CLASS, _PACKET, _TAP = (COLUMNS[name] for name in ("classes", "packets", "taps"))
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
    service_ns = cells[plan + HOP_SERVICE]
    if cells[port + SPECIAL] != 0 or service_ns == NONE:
        return _transmit_special(now, slot, hop, cells, at)
    start_ns = max(now, cells[port + FREE_AT])
    if start_ns > now:
        waiting, _ = still_waiting(now, port, cells, at)
        if waiting >= cells[port + QUEUE]:
            cells[details_of(port, at) + QUEUE_DROPS] += 1
            return DROPPED_AT_QUEUE
        wait(start_ns, cells[plan + HOP_BYTES], port, cells, at)
    cells[port + FREE_AT] = start_ns + service_ns
    cells[plan + CARRIED] += 1
    return start_ns + service_ns + cells[port + PROPAGATION]


@compiled_from_zero
def depart(now: int, number: int, cells: Cells, at: Layout) -> None:
    """A port with a server has ended a transmission: the next packet starts, if one waits.

    On a half-duplex link the turn goes to the other end, if anything waits there.
    """
    port = at.ports + PORT_COLUMNS * number
    cells[details_of(port, at) + IS_SERVING] = 0
    peer = cells[details_of(port, at) + PEER]
    if peer != NONE and cells[at.ports + PORT_COLUMNS * peer + WAITING] > 0:
        port = at.ports + PORT_COLUMNS * peer
    if cells[port + WAITING] > 0:
        slot = _next_waiting(port, cells, at)
        arrival_ns = _serve(now, slot, port, cells, at)
        push_event(arrival_ns, ARRIVAL, slot, cells, at)


@inlined
def _service_ns(size: int, port: int, cells: Cells, at: Layout) -> int:
    """Return the serialisation time of some bytes, rounded to the nearest nanosecond."""
    rate = cells[details_of(port, at) + RATE]
    return (16 * size * _NS_PER_S + rate) // (2 * rate)


@inlined
def _occupy(start_ns: int, service_ns: int, size: int, port: int, cells: Cells, at: Layout) -> None:
    """Book the link for a packet, and count it."""
    cells[port + FREE_AT] = start_ns + service_ns
    details = details_of(port, at)
    cells[details + PACKETS] += 1
    cells[details + BYTES] += size
    cells[details + BUSY] += service_ns


@compiled_from_zero
def waiting_now(now: int, port: int, cells: Cells, at: Layout) -> int:
    """Return how many packets wait at a port: those whose start is still to come.

    A port with a server counts them itself.
    """
    if cells[port + SPECIAL] & HAS_SERVER != 0:
        return cells[port + WAITING]
    waiting, started_bytes = still_waiting(now, port, cells, at)
    cells[details_of(port, at) + WAITING_BYTES] -= started_bytes
    return waiting


@compiled_from_zero
def _transmit_special(now: int, slot: int, hop: int, cells: Cells, at: Layout) -> int:
    plan = plan_of(hop, cells, at)
    port = at.ports + PORT_COLUMNS * cells[plan + HOP_PORT]
    details = details_of(port, at)
    special = cells[port + SPECIAL]
    if special & IS_DOWN != 0:
        cells[details + DOWN_DROPS] += 1
        return DROPPED_AT_CUT
    if special & HAS_SERVER != 0:
        return _transmit_served(now, slot, hop, cells, at)
    size = link_bytes(slot, cells, at)
    start_ns = max(now, cells[port + FREE_AT])
    waiting = waiting_now(now, port, cells, at)
    is_full = start_ns > now and (
        waiting >= cells[port + QUEUE]
        or (
            special & HAS_BYTES != 0
            and cells[details + WAITING_BYTES] + size > cells[details + QUEUE_BYTES]
        )
    )
    service_ns = cells[plan + HOP_SERVICE]
    if service_ns == NONE:
        service_ns = _service_ns(size, port, cells, at)
    # Every packet that comes counts in the average of early detection, also at a full queue.
    is_early = special & HAS_RED != 0 and is_dropped_early(
        now, waiting, service_ns, port, cells, at
    )
    if is_full or is_early:
        cells[details + QUEUE_DROPS] += 1
        return DROPPED_AT_QUEUE
    if start_ns > now:
        wait(start_ns, size, port, cells, at)
        cells[details + WAITING_BYTES] += size
    _occupy(start_ns, service_ns, size, port, cells, at)
    return _reach(start_ns, service_ns, size, slot, port, cells, at)


@compiled_from_zero
def _reach(
    start_ns: int, service_ns: int, size: int, slot: int, port: int, cells: Cells, at: Layout
) -> int:
    """Return when a packet that starts at an instant reaches the end of the link."""
    special = cells[port + SPECIAL]
    details = details_of(port, at)
    packet = at.packets + _PACKET * slot
    arrival_ns = start_ns + service_ns + cells[port + PROPAGATION]
    if special & HAS_LOSS != 0:
        cells[packet + LOST] = _is_lost(size, details, cells, at)
    if special & HAS_JITTER != 0:
        arrival_ns += take(cells[details + JITTER_STREAM], cells, at)
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
        cells[record + TAP_BYTES] = size - cells[details + OVERHEAD]
        cells[at.control + TAPPED] += 1
    return arrival_ns


@inlined
def _is_lost(size: int, details: int, cells: Cells, at: Layout) -> int:
    """Return 1 if the link loses a packet, by its own losses or by those of an event."""
    lost = 0
    if cells[details + LOSS_STREAM] != NONE:
        amount = 8 * size if cells[details + LOSS_UNIT] == PER_BIT else 1
        lost = _passes(amount, details + LOSS_LEFT, cells[details + LOSS_STREAM], cells, at)
    if cells[details + EVENT_STREAM] != NONE:
        lost |= _passes(1, details + EVENT_LEFT, cells[details + EVENT_STREAM], cells, at)
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
    details = details_of(port, at)
    peer = cells[details + PEER]
    is_busy = cells[details + IS_SERVING] != 0 or (
        peer != NONE and cells[at.details + DETAILS * peer + IS_SERVING] != 0
    )
    if not is_busy:
        return _serve(now, slot, port, cells, at)
    size = link_bytes(slot, cells, at)
    row = at.classes + _CLASS * (cells[details + FIRST_CLASS] + cells[plan + HOP_CLASS])
    if (
        cells[row + COUNT] >= cells[row + CLASS_PACKETS]
        or cells[row + HELD_BYTES] + size > cells[row + CLASS_BYTES]
    ):
        cells[details + QUEUE_DROPS] += 1
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
    cells[details + WAITING_BYTES] += size
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
        service_ns = _service_ns(size, port, cells, at)
    _occupy(now, service_ns, size, port, cells, at)
    cells[details_of(port, at) + IS_SERVING] = 1
    push_event(now + service_ns, DEPARTURE, cells[plan + HOP_PORT], cells, at)
    return _reach(now, service_ns, size, slot, port, cells, at)


@inlined
def _next_waiting(port: int, cells: Cells, at: Layout) -> int:
    """Take the packet out of a port's classes that is next; one must wait."""
    details = details_of(port, at)
    first, end = cells[details + FIRST_CLASS], cells[details + END_CLASSES]
    number = first
    if cells[details + SERVICE_ORDER] == ROUND_ROBIN:
        number = _turn(details, cells, at)
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
    cells[details + WAITING_BYTES] -= size
    if cells[details + SERVICE_ORDER] == ROUND_ROBIN:
        cells[row + DEFICIT] = cells[row + DEFICIT] - size if cells[row + COUNT] > 0 else 0
    return slot


@inlined
def _turn(details: int, cells: Cells, at: Layout) -> int:
    """Return the class whose turn it is by deficit round robin.

    M. Shreedhar and G. Varghese, Efficient fair queuing using deficit round-robin, IEEE/ACM Trans.
    Networking 4 (1996): a class may send what its deficit counter covers; the counter grows by the
    quantum at each visit and is lost when the class is empty.
    """
    first, end = cells[details + FIRST_CLASS], cells[details + END_CLASSES]
    number = cells[details + TURN]
    row = at.classes + _CLASS * number
    while (
        cells[row + COUNT] == 0 or link_bytes(cells[row + HEAD], cells, at) > cells[row + DEFICIT]
    ):
        number = number + 1 if number + 1 < end else first
        row = at.classes + _CLASS * number
        if cells[row + COUNT] > 0:
            cells[row + DEFICIT] += cells[row + QUANTUM]
    cells[details + TURN] = number
    return number
