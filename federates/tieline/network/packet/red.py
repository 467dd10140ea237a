"""Random early detection, in whole numbers, so that every machine drops the same packets.

S. Floyd and V. Jacobson, Random early detection gateways for congestion avoidance, IEEE/ACM Trans.
Networking 1 (1993), sections IV and VII: the averaged queue, measured in packets, the count since
the last early drop, and the decay of the average while the port was idle.
"""

from tieline.compiled import inlined
from tieline.network.packet.events import take
from tieline.network.packet.memory import (
    COLUMNS,
    FREE_AT,
    RED,
    RED_AVERAGE,
    RED_COUNT,
    RED_HIGH,
    RED_LOW,
    RED_PROBABILITY,
    RED_SHIFT,
    RED_STREAM,
    Cells,
    Layout,
)
from tieline.network.packet.ways import details_of

ONE_PACKET = 1 << 20
CERTAIN = 1 << 30
_BITS = 30
_RED = COLUMNS["red"]


@inlined
def is_dropped_early(
    now: int, waiting: int, service_ns: int, port: int, cells: Cells, at: Layout
) -> bool:
    """Return whether a packet that finds some waiting is dropped, and note that it came."""
    row = at.red + _RED * cells[details_of(port, at) + RED]
    average = cells[row + RED_AVERAGE]
    idle_ns = now - cells[port + FREE_AT]
    if idle_ns > 0:
        # An average is up to 2^37: its share is taken to 20 bits, so that no product overflows.
        left = _decayed(idle_ns // max(1, service_ns), row, cells) >> (_BITS - 20)
        average = (average * left) >> 20
    else:
        average += (waiting * ONE_PACKET - average) >> cells[row + RED_SHIFT]
    cells[row + RED_AVERAGE] = average
    low, high = cells[row + RED_LOW], cells[row + RED_HIGH]
    if average < low:
        cells[row + RED_COUNT] = -1
        return False
    if average >= high:
        cells[row + RED_COUNT] = 0
        return True
    cells[row + RED_COUNT] += 1
    share = (cells[row + RED_PROBABILITY] * (((average - low) << 20) // (high - low))) >> 20
    # P = share / (1 - count share), so that the packets between two drops are spread evenly.
    spread = CERTAIN - cells[row + RED_COUNT] * share
    draw = take(cells[row + RED_STREAM], cells, at)
    if spread <= 0 or (draw * spread) >> _BITS < share:
        cells[row + RED_COUNT] = 0
        return True
    return False


@inlined
def _decayed(packets: int, row: int, cells: Cells) -> int:
    """Return (1 - weight)^packets, 2^30 being 1."""
    result = CERTAIN
    factor = CERTAIN - (CERTAIN >> cells[row + RED_SHIFT])
    left = packets
    while left > 0 and result > 0:
        if left & 1:
            result = (result * factor) >> _BITS
        factor = (factor * factor) >> _BITS
        left >>= 1
    return result
