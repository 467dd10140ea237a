"""The discrete-event kernel: integers only, compiled, one event for each hop of each packet.

Everything random is drawn outside, by named generators, as whole numbers; the kernel takes them
from its tables in the order in which it needs them. It therefore computes the same compiled or not,
and however its caller cuts the time into pieces.
"""

from tieline.compiled import compiled_from_zero, inlined
from tieline.network.engine import DELIVERED, LOSS
from tieline.network.packet import tcp
from tieline.network.packet.events import pop_event, push_event, replace_event, take
from tieline.network.packet.heap import push
from tieline.network.packet.kinds import (
    ARRIVAL,
    CROSS,
    DEPARTURE,
    FRAME,
    KIND_BITS,
    KINDS,
    REPLY,
    TIMER,
    item_of,
)
from tieline.network.packet.memory import (
    ARRIVED,
    COLUMNS,
    CONNECTION,
    END_FLOWS,
    ENDED,
    FIRST_FLOW,
    FLOW,
    FREE_BLOCKS,
    FREE_PACKETS,
    GAP_STREAM,
    HEAP_SIZE,
    HOP,
    HOP_PORT,
    IP_BYTES,
    LOSS_DROPS,
    LOST,
    MOST_ORDERS,
    NEXT_ORDER,
    NO_PORT,
    NONE,
    ONWARD,
    RANK,
    SENT,
    SEQUENCE,
    SIZE_STREAM,
    TAPPED,
    THINK,
    TIME,
    TREE,
    WANTS_DRAWS,
    Cells,
    Layout,
)
from tieline.network.packet.memory import REPLY as REPLY_FLOW
from tieline.network.packet.packets import (
    copy_to_forks,
    drop_reason,
    dropped,
    enter,
    enter_datagram,
    record_end,
)
from tieline.network.packet.ports import WAITS, depart, transmit
from tieline.network.packet.ways import DETAILS, plan_of, port_at

DONE, NEEDS_ROOM, NEEDS_DRAWS = 0, 1, 2

_FLOW, _SOURCE, _CROSS, _PACKET = (
    COLUMNS[name] for name in ("flows", "sources", "cross", "packets")
)


@compiled_from_zero
def run(until_ns: int, cells: Cells, at: Layout) -> int:
    """Process every event up to and including `until_ns`.

    Returns:
        `DONE`; or, with the remaining events untouched, `NEEDS_ROOM` (more packets, events or
        records may come than the tables hold) or `NEEDS_DRAWS` (a stream has used up a chunk). The
        caller helps and calls again.
    """
    safe = 0
    while cells[at.control + HEAP_SIZE] > 0 and cells[at.heap + TIME] <= until_ns:
        if cells[at.control + WANTS_DRAWS] != 0:
            return NEEDS_DRAWS
        if safe == 0:
            safe = events_with_room(cells, at)
            if safe == 0:
                return NEEDS_ROOM
        safe -= 1
        _process_first(cells, at)
    return DONE


@compiled_from_zero
def step(cells: Cells, at: Layout) -> None:
    """Process the first event alone; there must be one, and room and draws for it."""
    _process_first(cells, at)


@inlined
def _process_first(cells: Cells, at: Layout) -> None:
    now = cells[at.heap + TIME]
    item = item_of(cells[at.heap + RANK])
    kind, number = item & (KINDS - 1), item >> KIND_BITS
    if kind == ARRIVAL:
        _arrive(now, number, cells, at)
    elif kind == CROSS:
        _send_cross(now, number, cells, at)
    else:
        pop_event(cells, at)
        if kind == FRAME:
            _send_frame(now, number, cells, at)
        elif kind == DEPARTURE:
            depart(now, number, cells, at)
        elif kind == TIMER:
            tcp.on_timer(now, number, cells, at)
        else:
            _reply(now, number, cells, at)


@compiled_from_zero
def announce(times_ns: Cells, ranks: Cells, cells: Cells, at: Layout) -> None:
    """Add frames, or the first packets of cross flows, to the events; the heap must have room."""
    for place in range(len(times_ns)):
        size = cells[at.control + HEAP_SIZE]
        push(size, times_ns[place], ranks[place], cells, at)
        cells[at.control + HEAP_SIZE] = size + 1


@inlined
def events_with_room(cells: Cells, at: Layout) -> int:
    """Return how many events can be processed for certain, whatever they are."""
    free = min(
        cells[at.control + FREE_PACKETS],
        cells[at.control + FREE_BLOCKS],
        (at.capacity - cells[at.control + HEAP_SIZE]) >> 1,
        (MOST_ORDERS - cells[at.control + NEXT_ORDER]) >> 1,
        at.records - cells[at.control + ENDED],
        at.records - cells[at.control + TAPPED],
    )
    return free // at.most_packets


@inlined
def _arrive(now: int, slot: int, cells: Cells, at: Layout) -> None:
    """A packet reaches the end of a link, as the first event of the heap."""
    packet = at.packets + _PACKET * slot
    hop = cells[packet + HOP] + 1
    way = cells[packet + ONWARD]
    port = port_at(way)
    if cells[packet + LOST] != 0:
        _lose(now, slot, cells, at)
    elif port >= 0:
        arrival_ns = transmit(now, slot, hop, way, cells, at)
        if arrival_ns >= 0:
            replace_event(arrival_ns, ARRIVAL, slot, cells, at)
        elif arrival_ns == WAITS:
            pop_event(cells, at)
        else:
            _leave(slot, cells, at)
            flow, sequence = cells[packet + FLOW], cells[packet + SEQUENCE]
            dropped(now, flow, sequence, hop, drop_reason(arrival_ns), cells, at)
    else:
        _leave(slot, cells, at)
        flow, sequence = cells[packet + FLOW], cells[packet + SEQUENCE]
        if port != NO_PORT:
            copy_to_forks(now, flow, sequence, hop, cells[packet + IP_BYTES], cells, at)
        elif flow < at.pmu_flows:
            record_end(now, flow, sequence, DELIVERED, cells, at)
        else:
            _reach_target(now, flow, sequence, cells, at)


@inlined
def _lose(now: int, slot: int, cells: Cells, at: Layout) -> None:
    """A packet that its link has lost would reach the end."""
    packet = at.packets + _PACKET * slot
    hop = cells[packet + HOP]
    port = cells[plan_of(hop, cells, at) + HOP_PORT]
    cells[at.details + DETAILS * port + LOSS_DROPS] += 1
    _leave(slot, cells, at)
    dropped(now, cells[packet + FLOW], cells[packet + SEQUENCE], hop, LOSS, cells, at)


@inlined
def _leave(slot: int, cells: Cells, at: Layout) -> None:
    """Take a packet, whose event is the first of the heap, out of the network."""
    pop_event(cells, at)
    cells[at.free + cells[at.control + FREE_PACKETS]] = slot
    cells[at.control + FREE_PACKETS] += 1


@compiled_from_zero
def _reach_target(now: int, flow: int, sequence: int, cells: Cells, at: Layout) -> None:
    """A packet that carries no PMU frame of its own reaches the end of its route."""
    row = at.cross + _CROSS * (flow - at.pmu_flows)
    cells[row + ARRIVED + DELIVERED] += 1
    connection = cells[at.flows + _FLOW * flow + CONNECTION]
    if connection != NONE:
        tcp.on_packet(now, flow, connection, sequence, cells, at)
    elif cells[row + REPLY_FLOW] != NONE:
        push_event(now + cells[row + THINK], REPLY, cells[row + REPLY_FLOW], cells, at)


@inlined
def _reply(now: int, flow: int, cells: Cells, at: Layout) -> None:
    """The target of a request answers it."""
    row = at.cross + _CROSS * (flow - at.pmu_flows)
    enter(now, flow, cells[row + SENT], cells, at)


@inlined
def _send_cross(now: int, number: int, cells: Cells, at: Layout) -> None:
    """A cross flow sends a packet and plans its next one."""
    row = at.cross + _CROSS * number
    flow = at.pmu_flows + number
    if cells[at.flows + _FLOW * flow + CONNECTION] != NONE:
        tcp.begin_or_end(now, cells[at.flows + _FLOW * flow + CONNECTION], cells, at)
    elif cells[row + SIZE_STREAM] == NONE:
        enter(now, flow, cells[row + SENT], cells, at)
    else:
        enter_datagram(
            now, flow, cells[row + SENT], take(cells[row + SIZE_STREAM], cells, at), cells, at
        )
    next_ns = now + take(cells[row + GAP_STREAM], cells, at)
    # The packet's own event is later in the heap's order, so this one still stands first.
    replace_event(next_ns, CROSS, number, cells, at)


@compiled_from_zero
def _send_frame(now: int, code: int, cells: Cells, at: Layout) -> None:
    """A PMU sends one frame to each of its destinations, back to back in their order.

    Where it has a tree, one packet goes to all of them; where it has connections, each takes it.
    """
    source = at.sources + _SOURCE * (code % at.source_count)
    sequence = code // at.source_count
    if cells[source + TREE] != NONE:
        enter(now, cells[source + TREE], sequence, cells, at)
        return
    for flow in range(cells[source + FIRST_FLOW], cells[source + END_FLOWS]):
        connection = cells[at.flows + _FLOW * flow + CONNECTION]
        if connection == NONE:
            enter(now, flow, sequence, cells, at)
        else:
            tcp.write(now, connection, sequence, cells, at)
