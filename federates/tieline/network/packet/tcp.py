"""Connections in the manner of TCP: in-order delivery, retransmission, additive increase.

Counted in segments, of which each carries one frame, or as many bytes as fit. What is modelled:
slow start and congestion avoidance, fast retransmit and fast recovery (RFC 5681, and NewReno's
partial acknowledgements, RFC 6582), the retransmission timer with Karn's rule (RFC 6298), an
initial window of 10 segments (RFC 6928), a receiver that keeps what comes out of order and
acknowledges every segment at once. What is not: opening and closing, selective and delayed
acknowledgement, Nagle's rule (a frame is sent at once), a receiver that is slow to read.

Windows are kept in 1/1024 segments, times in nanoseconds.
"""

from tieline.compiled import compiled_from_zero, inlined
from tieline.network.engine import DELIVERED, QUEUE_FULL
from tieline.network.packet.events import push_event
from tieline.network.packet.kinds import TIMER
from tieline.network.packet.memory import (
    COLUMNS,
    CONNECTION_COLUMNS,
    FRAME,
    IS_HERE,
    NONE,
    Cells,
    Layout,
)
from tieline.network.packet.packets import enter, record_end

# Facts: flows of segments, of acknowledgements and of the frames carried (NONE: as much as fits),
# most segments under way, its part of `received`, and the least retransmission time.
DATA_FLOW, ACK_FLOW, FRAMES_OF, MOST, RECEIVED, LEAST_WAIT = range(6)
# The sender: segments it may send, the next to send, the first unacknowledged, those sent so far.
AVAILABLE, NEXT_SEGMENT, UNACKNOWLEDGED, SENT_SO_FAR = range(6, 10)
WINDOW, THRESHOLD, DUPLICATES, RECOVER = range(10, 14)
# Its timer: when it ends (0: off), when its event comes, and the times that it is set by.
DEADLINE, TIMER_AT, SMOOTHED, VARIATION, WAIT, TIMED_SEGMENT, TIMED_AT = range(14, 21)
# The receiver: the next segment in order. Statistics: segments sent again, timers that ended.
EXPECTED, SENT_AGAIN, TIMED_OUT = range(21, 24)

UNIT = 1024
"""Parts of a segment in which windows are kept."""

FIRST_WINDOW = 10 * UNIT
"""RFC 6928."""

FIRST_WAIT_NS, MOST_WAIT_NS = 1_000_000_000, 60_000_000_000
"""RFC 6298, sections 2.1 and 2.5."""

ENDLESS = 1 << 60
"""Segments of a connection that always has more to send."""

_DUPLICATES = 3
_RECEIVED = COLUMNS["received"]


@inlined
def begin_or_end(now: int, connection: int, cells: Cells, at: Layout) -> None:
    """A connection with endless data begins to send; the second time, it sends nothing new."""
    row = at.connections + CONNECTION_COLUMNS * connection
    if cells[row + AVAILABLE] == 0:
        cells[row + AVAILABLE] = ENDLESS
        _send_what_fits(now, connection, cells, at)
    else:
        cells[row + AVAILABLE] = cells[row + SENT_SO_FAR]


@compiled_from_zero
def write(now: int, connection: int, frame: int, cells: Cells, at: Layout) -> None:
    """A PMU hands over a frame; it is dropped if the send buffer is full."""
    row = at.connections + CONNECTION_COLUMNS * connection
    if cells[row + AVAILABLE] - cells[row + EXPECTED] >= cells[row + MOST]:
        record_end(now, cells[row + FRAMES_OF], frame, QUEUE_FULL, cells, at)
        return
    cells[_place(cells[row + AVAILABLE], row, cells, at) + FRAME] = frame
    cells[row + AVAILABLE] += 1
    _send_what_fits(now, connection, cells, at)


@compiled_from_zero
def on_packet(now: int, flow: int, connection: int, number: int, cells: Cells, at: Layout) -> None:
    """A segment, or an acknowledgement, reaches its end."""
    row = at.connections + CONNECTION_COLUMNS * connection
    if flow == cells[row + DATA_FLOW]:
        _on_segment(now, number, row, cells, at)
    else:
        _on_acknowledgement(now, number, connection, cells, at)


@compiled_from_zero
def on_timer(now: int, connection: int, cells: Cells, at: Layout) -> None:
    """The event of a retransmission timer: late, early, or the end of it."""
    row = at.connections + CONNECTION_COLUMNS * connection
    if now != cells[row + TIMER_AT]:
        return
    cells[row + TIMER_AT] = 0
    deadline = cells[row + DEADLINE]
    if deadline > now:
        _plan_timer(deadline, connection, cells, at)
    elif deadline > 0:
        under_way = cells[row + NEXT_SEGMENT] - cells[row + UNACKNOWLEDGED]
        # A segment that the timer sends a second time leaves the threshold (RFC 5681, section 3.1).
        if cells[row + WINDOW] > UNIT:
            cells[row + THRESHOLD] = max(under_way * UNIT // 2, 2 * UNIT)
        cells[row + WINDOW] = UNIT
        cells[row + WAIT] = min(2 * cells[row + WAIT], MOST_WAIT_NS)
        cells[row + NEXT_SEGMENT] = cells[row + UNACKNOWLEDGED]
        cells[row + TIMED_SEGMENT] = NONE
        cells[row + RECOVER] = NONE
        cells[row + DUPLICATES] = 0
        cells[row + DEADLINE] = 0
        cells[row + TIMED_OUT] += 1
        _send_what_fits(now, connection, cells, at)


@inlined
def _place(segment: int, row: int, cells: Cells, at: Layout) -> int:
    """Return the row of `received` for a segment."""
    return at.received + _RECEIVED * (cells[row + RECEIVED] + segment % cells[row + MOST])


@inlined
def _on_segment(now: int, segment: int, row: int, cells: Cells, at: Layout) -> None:
    expected = cells[row + EXPECTED]
    if segment >= expected:
        cells[_place(segment, row, cells, at) + IS_HERE] = 1
    while cells[_place(expected, row, cells, at) + IS_HERE] != 0:
        place = _place(expected, row, cells, at)
        cells[place + IS_HERE] = 0
        if cells[row + FRAMES_OF] != NONE:
            record_end(now, cells[row + FRAMES_OF], cells[place + FRAME], DELIVERED, cells, at)
        expected += 1
    cells[row + EXPECTED] = expected
    enter(now, cells[row + ACK_FLOW], expected, cells, at)


@inlined
def _on_acknowledgement(now: int, number: int, connection: int, cells: Cells, at: Layout) -> None:
    row = at.connections + CONNECTION_COLUMNS * connection
    if number > cells[row + UNACKNOWLEDGED]:
        _on_news(now, number, connection, cells, at)
    elif number == cells[row + UNACKNOWLEDGED] and cells[row + NEXT_SEGMENT] > number:
        cells[row + DUPLICATES] += 1
        if cells[row + RECOVER] != NONE:
            cells[row + WINDOW] += UNIT
        elif cells[row + DUPLICATES] == _DUPLICATES:
            under_way = cells[row + NEXT_SEGMENT] - number
            cells[row + THRESHOLD] = max(under_way * UNIT // 2, 2 * UNIT)
            cells[row + WINDOW] = cells[row + THRESHOLD] + _DUPLICATES * UNIT
            cells[row + RECOVER] = cells[row + NEXT_SEGMENT]
            _send_again(now, connection, cells, at)
    _send_what_fits(now, connection, cells, at)


@inlined
def _on_news(now: int, number: int, connection: int, cells: Cells, at: Layout) -> None:
    """Segments have been acknowledged for the first time."""
    row = at.connections + CONNECTION_COLUMNS * connection
    newly = number - cells[row + UNACKNOWLEDGED]
    cells[row + UNACKNOWLEDGED] = number
    cells[row + NEXT_SEGMENT] = max(cells[row + NEXT_SEGMENT], number)
    if cells[row + TIMED_SEGMENT] != NONE and number > cells[row + TIMED_SEGMENT]:
        _learn_wait(now - cells[row + TIMED_AT], row, cells)
        cells[row + TIMED_SEGMENT] = NONE
    is_all = number == cells[row + NEXT_SEGMENT]
    cells[row + DEADLINE] = 0 if is_all else now + cells[row + WAIT]
    if not is_all:
        _plan_timer(cells[row + DEADLINE], connection, cells, at)
    recover = cells[row + RECOVER]
    window = cells[row + WINDOW]
    if recover == NONE:
        cells[row + DUPLICATES] = 0
        if window < cells[row + THRESHOLD]:
            window += newly * UNIT
        else:
            window += max(1, newly * UNIT * UNIT // window)
        cells[row + WINDOW] = min(window, cells[row + MOST] * UNIT)
    elif number >= recover:
        cells[row + RECOVER] = NONE
        cells[row + DUPLICATES] = 0
        cells[row + WINDOW] = cells[row + THRESHOLD]
    else:
        # A partial acknowledgement: the next hole is sent at once (RFC 6582, section 3.2).
        cells[row + WINDOW] = max(UNIT, window - newly * UNIT + UNIT)
        _send_again(now, connection, cells, at)


@inlined
def _learn_wait(round_trip_ns: int, row: int, cells: Cells) -> None:
    """Set the retransmission time by RFC 6298, section 2."""
    if cells[row + SMOOTHED] == 0:
        cells[row + SMOOTHED] = round_trip_ns
        cells[row + VARIATION] = round_trip_ns // 2
    else:
        off = abs(cells[row + SMOOTHED] - round_trip_ns)
        cells[row + VARIATION] += (off - cells[row + VARIATION]) // 4
        cells[row + SMOOTHED] += (round_trip_ns - cells[row + SMOOTHED]) // 8
    wait = cells[row + SMOOTHED] + 4 * cells[row + VARIATION]
    cells[row + WAIT] = min(max(wait, cells[row + LEAST_WAIT]), MOST_WAIT_NS)


@inlined
def _send_again(now: int, connection: int, cells: Cells, at: Layout) -> None:
    """Send the first unacknowledged segment once more."""
    row = at.connections + CONNECTION_COLUMNS * connection
    cells[row + SENT_AGAIN] += 1
    cells[row + TIMED_SEGMENT] = NONE
    enter(now, cells[row + DATA_FLOW], cells[row + UNACKNOWLEDGED], cells, at)


@compiled_from_zero
def _send_what_fits(now: int, connection: int, cells: Cells, at: Layout) -> None:
    """Send what there is as far as the window reaches."""
    row = at.connections + CONNECTION_COLUMNS * connection
    reach = cells[row + UNACKNOWLEDGED] + min(cells[row + WINDOW] // UNIT, cells[row + MOST])
    segment = cells[row + NEXT_SEGMENT]
    while segment < reach and segment < cells[row + AVAILABLE]:
        if segment >= cells[row + SENT_SO_FAR]:
            cells[row + SENT_SO_FAR] = segment + 1
            if cells[row + TIMED_SEGMENT] == NONE:
                cells[row + TIMED_SEGMENT] = segment
                cells[row + TIMED_AT] = now
        else:
            cells[row + SENT_AGAIN] += 1
        enter(now, cells[row + DATA_FLOW], segment, cells, at)
        segment += 1
    cells[row + NEXT_SEGMENT] = segment
    if segment > cells[row + UNACKNOWLEDGED] and cells[row + DEADLINE] == 0:
        cells[row + DEADLINE] = now + cells[row + WAIT]
        _plan_timer(cells[row + DEADLINE], connection, cells, at)


@compiled_from_zero
def _plan_timer(deadline: int, connection: int, cells: Cells, at: Layout) -> None:
    """See to it that the timer's event comes no later than it ends."""
    row = at.connections + CONNECTION_COLUMNS * connection
    if cells[row + TIMER_AT] == 0 or cells[row + TIMER_AT] > deadline:
        cells[row + TIMER_AT] = deadline
        push_event(deadline, TIMER, connection, cells, at)
