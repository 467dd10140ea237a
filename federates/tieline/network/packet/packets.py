"""How packets enter the network, are copied in it, and end."""

from tieline.compiled import compiled_from_zero, inlined
from tieline.network.engine import DELIVERED, LINK_DOWN, QUEUE_FULL
from tieline.network.packet.events import push_event, take
from tieline.network.packet.kinds import ARRIVAL
from tieline.network.packet.memory import (
    ARRIVED,
    COLUMNS,
    DATAGRAM,
    DESTINATION,
    END_FLOW,
    END_FORKS,
    END_HOW,
    END_MEMBERS,
    END_SEQUENCE,
    END_TIME,
    ENDED,
    FIRST_FORK,
    FIRST_HOP,
    FIRST_MEMBER,
    FLOW,
    FRAGMENT,
    FREE_PACKETS,
    HOP_PORT,
    IP_BYTES,
    LOST,
    NO_PORT,
    NONE,
    PART,
    PROCESSING,
    PROCESSING_STREAM,
    SENT,
    SEQUENCE,
    Cells,
    Layout,
)
from tieline.network.packet.ports import DROPPED_AT_CUT, DROPPED_AT_QUEUE, WAITS, transmit
from tieline.network.packet.ways import plan_of

IP_HEADER = 20

_FLOW, _CROSS, _DESTINATION, _PACKET, _ENDED = (
    COLUMNS[name] for name in ("flows", "cross", "destinations", "packets", "ended")
)


@inlined
def enter(now: int, flow: int, sequence: int, cells: Cells, at: Layout) -> None:
    """A flow's datagram of its usual size enters the network."""
    enter_datagram(now, flow, sequence, cells[at.flows + _FLOW * flow + DATAGRAM], cells, at)


@compiled_from_zero
def enter_datagram(now: int, flow: int, sequence: int, size: int, cells: Cells, at: Layout) -> None:
    """A datagram (bytes, its header included) enters the network, in pieces if it must."""
    row = at.flows + _FLOW * flow
    hop = cells[row + FIRST_HOP]
    piece = cells[row + FRAGMENT]
    if piece == NONE or size <= piece:
        _start(now, flow, sequence, 0, hop, size + IP_HEADER, cells, at)
        return
    part = 0
    while part * piece < size:
        length = min(size - part * piece, piece)
        _start(now, flow, sequence, part, hop, length + IP_HEADER, cells, at)
        part += 1


@compiled_from_zero
def copy_to_forks(
    now: int, flow: int, sequence: int, row: int, size: int, cells: Cells, at: Layout
) -> None:
    """A tree's packet goes on along each of the hops at a fork, or ends there for a member."""
    plan = plan_of(row, cells, at)
    for fork in range(cells[plan + FIRST_FORK], cells[plan + END_FORKS]):
        target = cells[at.forks + fork]
        if target >= 0:
            _put_on_link(now, flow, sequence, 0, target, size, cells, at)
        else:
            record_end(now, -1 - target, sequence, DELIVERED, cells, at)


@compiled_from_zero
def dropped(
    now: int, flow: int, sequence: int, hop: int, how: int, cells: Cells, at: Layout
) -> None:
    """Count a packet that is dropped or lost on a hop."""
    if flow < at.pmu_flows:
        record_end(now, flow, sequence, how, cells, at)
    elif flow < at.first_tree:
        cells[at.cross + _CROSS * (flow - at.pmu_flows) + ARRIVED + how] += 1
    else:
        plan = plan_of(hop, cells, at)
        for member in range(cells[plan + FIRST_MEMBER], cells[plan + END_MEMBERS]):
            record_end(now, cells[at.members + member], sequence, how, cells, at)


@compiled_from_zero
def record_end(now: int, flow: int, sequence: int, how: int, cells: Cells, at: Layout) -> None:
    """Record how a PMU packet ended; a delivered one's time is when its controller can use it."""
    end_ns = now
    if how == DELIVERED:
        stage = at.destinations + _DESTINATION * cells[at.flows + _FLOW * flow + DESTINATION]
        end_ns += cells[stage + PROCESSING]
        if cells[stage + PROCESSING_STREAM] != NONE:
            end_ns += take(cells[stage + PROCESSING_STREAM], cells, at)
    record = at.ended + _ENDED * cells[at.control + ENDED]
    cells[record + END_TIME] = end_ns
    cells[record + END_FLOW] = flow
    cells[record + END_SEQUENCE] = sequence
    cells[record + END_HOW] = how
    cells[at.control + ENDED] += 1


@inlined
def drop_reason(refusal: int) -> int:
    """Return how a packet ends that a port has refused."""
    return LINK_DOWN if refusal == DROPPED_AT_CUT else QUEUE_FULL


@inlined
def _start(
    now: int, flow: int, sequence: int, part: int, hop: int, size: int, cells: Cells, at: Layout
) -> None:
    """A packet of `size` IP bytes begins its route."""
    port = cells[plan_of(hop, cells, at) + HOP_PORT]
    if port >= 0:
        _put_on_link(now, flow, sequence, part, hop, size, cells, at)
    elif port == NO_PORT:
        record_end(now, flow, sequence, DELIVERED, cells, at)
    else:
        copy_to_forks(now, flow, sequence, hop, size, cells, at)


@compiled_from_zero
def _put_on_link(
    now: int, flow: int, sequence: int, part: int, hop: int, size: int, cells: Cells, at: Layout
) -> None:
    """A new packet, or a copy of one, goes on its first link."""
    if at.pmu_flows <= flow < at.first_tree:
        cells[at.cross + _CROSS * (flow - at.pmu_flows) + SENT] += 1
    slot = cells[at.free + cells[at.control + FREE_PACKETS] - 1]
    packet = at.packets + _PACKET * slot
    cells[packet + FLOW] = flow
    cells[packet + SEQUENCE] = sequence
    cells[packet + LOST] = 0
    cells[packet + IP_BYTES] = size
    cells[packet + PART] = part
    arrival_ns = transmit(now, slot, hop, cells[at.hops + hop], cells, at)
    if arrival_ns in (DROPPED_AT_QUEUE, DROPPED_AT_CUT):
        dropped(now, flow, sequence, hop, drop_reason(arrival_ns), cells, at)
        return
    cells[at.control + FREE_PACKETS] -= 1
    if arrival_ns != WAITS:
        push_event(arrival_ns, ARRIVAL, slot, cells, at)
