"""The packet kernel's memory: tables of whole numbers, row after row in one flat array.

One array, because compiled code counts references to every array that it hands from function to
function; with a table each, that costs more than the simulation (measured: five times as long).
The kernel finds row r of a table at `layout.table + r * COLUMNS`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.errors import CosimError
from tieline.network.draws import CHUNK

Cells = NDArray[np.int64]

MAX_PACKETS = 1 << 22
"""Packets, or pending events, that are ever held: about 500 MB. Queues bound them far below."""

LINE = 8
"""Cells of a line of the processor's cache: tables begin with one, and the rows that every packet
meets fill whole ones."""

NONE = -1
"""No stream, no row, no slot."""

NO_PORT, FORK = -1, -2
"""In place of a hop's port: the route ends, or the packet is copied to several hops."""

PORT_BITS = 24
PORT_MASK = (1 << PORT_BITS) - 1
"""An entry of `hops` is the number of a plan above the number of its port less `FORK`."""

# control: one row.
HEAP_SIZE, NEXT_ORDER, FREE_PACKETS, ENDED, TAPPED, WANTS_DRAWS = range(6)

# ports: facts of the direction of a link, its state, its statistics.
PROPAGATION, QUEUE, RING, SPECIAL = range(4)
FREE_AT, RING_HEAD, WAITING, WAITING_BYTES = range(4, 8)
PACKETS, BYTES, BUSY, MAX_QUEUE, QUEUE_DROPS, LOSS_DROPS, DOWN_DROPS = range(8, 15)
# Columns that only ports with something SPECIAL use.
RATE, OVERHEAD, QUEUE_BYTES, JITTER_STREAM = range(15, 19)
LOSS_STREAM, LOSS_UNIT, LOSS_LEFT, EVENT_STREAM, EVENT_LEFT = range(19, 24)
RED, FIRST_CLASS, END_CLASSES, SERVICE_ORDER, TURN, PEER, IS_SERVING = range(24, 31)

# What is special about a port, as bits: all else is a drop-tail queue of packets.
IS_DOWN, HAS_SERVER, HAS_BYTES, HAS_RED, HAS_LOSS, HAS_JITTER, HAS_TAP = (1 << i for i in range(7))

PER_PACKET, PER_BIT = range(2)
"""What a stream of losses counts between one loss and the next."""

FIRST_COME, PRIORITY, ROUND_ROBIN = range(3)
"""In which order a port with a server takes the packets that wait."""

# classes: limits, then the list of the packets that wait in one class of a port with a server.
CLASS_PACKETS, CLASS_BYTES, QUANTUM = range(3)
HEAD, TAIL, COUNT, HELD_BYTES, DEFICIT = range(3, 8)

# red: thresholds (2^20 = one packet), probability (2^30 = 1), weight as a power of two, its state.
RED_LOW, RED_HIGH, RED_PROBABILITY, RED_SHIFT, RED_STREAM, RED_AVERAGE, RED_COUNT = range(7)

# hops: the plan and the port of each link of each route, in the order of the route (`PORT_BITS`).
# After the last link comes a plan with NO_PORT, or, where a tree branches, one with FORK and the
# range of `forks`.

# plans: what a hop is like; flows whose packets are alike share it, so that the plans that matter
# stay near the processor. Serialisation time is NONE where packets of a flow differ in size.
# MEMBERS are the flows that a tree's packet on this hop still serves.
HOP_PORT, HOP_SERVICE, HOP_BYTES, HOP_CLASS, FIRST_MEMBER, END_MEMBERS = range(6)
FIRST_FORK, END_FORKS = HOP_SERVICE, HOP_BYTES

# forks: a hop to copy a packet to, or -1 - flow that ends here. members: a flow each.

# flows: PMU flows, cross flows, trees of a source, acknowledgements of connections, in this order.
# Datagrams are UDP headers and payload; FRAGMENT is the most of one that a packet takes, or NONE.
FIRST_HOP, DESTINATION, CONNECTION, DATAGRAM, FRAGMENT = range(5)

# sources: flows of a source are FIRST_FLOW to END_FLOWS - 1; its tree's flow, or NONE.
FIRST_FLOW, END_FLOWS, TREE = range(3)

# destinations: processing time and the stream of its jitter.
PROCESSING, PROCESSING_STREAM = range(2)

# cross: flows beyond the PMUs', with what became of their packets: ARRIVED + how they ended.
GAP_STREAM, SIZE_STREAM, REPLY, THINK, SENT = range(5)
ARRIVED = 5

# streams: how many numbers are used up, then two chunks of numbers.
USED, FIRST_DRAW = range(2)

# heap: pending events.
TIME, ORDER, ITEM = range(3)

# packets inside the network, by slot; IP_BYTES only where packets of a flow differ in size. ONWARD
# is what `hops` has for the hop after this one: on arrival plan and port are fetched side by side.
FLOW, SEQUENCE, HOP, LOST, IP_BYTES, NEXT, PART, ONWARD = range(8)

# ended: PMU packets that have ended since they were last collected.
END_TIME, END_FLOW, END_SEQUENCE, END_HOW = range(4)

# taps: packets that have been put on a link that is listened to.
TAP_TIME, TAP_PORT, TAP_FLOW, TAP_SEQUENCE, TAP_HOP, TAP_PART, TAP_BYTES = range(7)

# connections: see tcp.py.
CONNECTION_COLUMNS = 24
IS_HERE, FRAME = range(2)

COLUMNS = {
    "control": 6,
    "ports": 32,
    "classes": 8,
    "red": 7,
    "hops": 1,
    "plans": 8,
    "forks": 1,
    "members": 1,
    "flows": 5,
    "sources": 3,
    "destinations": 2,
    "cross": 9,
    "connections": CONNECTION_COLUMNS,
    "received": 2,
    "streams": 1 + 2 * CHUNK,
    "ring": 2,
    "heap": 3,
    "packets": 8,
    "free": 1,
    "ended": 4,
    "taps": 7,
}
GROWING = ("heap", "packets", "free", "ended")
"""The tables with a row for each packet that may be inside; with links tapped, `taps` is one."""

HEAP_COLUMNS = COLUMNS["heap"]

_ROWS_AT_ONCE = 1 << 14


class Layout(NamedTuple):
    """Where each table begins, and the numbers that bound the kernel's loops.

    `ring` holds, port after port, when each waiting packet will start and its size; `free` the free
    slots of `packets`; `received`, connection after connection, a ring of segments: whether one has
    come out of order, and the frame that it carries. `capacity` is the number of rows of each
    growing table, and `most_packets` the most packets that one event can make. Flows from
    `pmu_flows` on have a row of `cross`; `first_tree` is the first flow that is a tree.
    """

    control: int
    ports: int
    classes: int
    red: int
    hops: int
    plans: int
    forks: int
    members: int
    flows: int
    sources: int
    destinations: int
    cross: int
    connections: int
    received: int
    streams: int
    ring: int
    heap: int
    packets: int
    free: int
    ended: int
    taps: int
    capacity: int
    source_count: int
    pmu_flows: int
    first_tree: int
    most_packets: int


class Memory:
    """The cells, and views of them as tables.

    Args:
        tables: the contents of the tables of fixed size, (rows, columns) each; those that are not
            given have one row of zeros (`control`) or are empty.
        capacity: rows of the growing tables at first.
        bounds: the layout's counts, `source_count` to `most_packets`.
        is_tapped: whether a link is listened to.
    """

    def __init__(
        self, tables: dict[str, Cells], capacity: int, bounds: dict[str, int], is_tapped: bool
    ) -> None:
        self._bounds = bounds
        self._rows = {name: len(tables.get(name, ())) for name in COLUMNS}
        self._rows["control"] = 1
        self._growing = (*GROWING, "taps") if is_tapped else GROWING
        self._rows.update(dict.fromkeys(self._growing, capacity))
        self._allocate()
        for name, content in tables.items():
            _copy(content, self.table(name))
        self.table("free")[:, 0] = np.arange(capacity)[::-1]
        self.control[FREE_PACKETS] = capacity

    def table(self, name: str) -> Cells:
        """Return a table as a view (rows, columns)."""
        return self._tables[name]

    @property
    def control(self) -> Cells:
        """The control row as a view."""
        return self.table("control")[0]

    def plans_of(self, hops: Cells | int) -> Cells:
        """Return the rows of `plans` (n, columns) of some hops (n,), or the row of one."""
        return self.table("plans")[self.plan_numbers_of(hops)]

    def plan_numbers_of(self, hops: Cells | int) -> Cells:
        """Return which row of `plans` is that of some hops (n,), or of one."""
        numbers: Cells = self.table("hops")[hops, 0] >> PORT_BITS
        return numbers

    def inside(self) -> Cells:
        """Return the slots of the packets inside the network, ascending."""
        is_free = np.zeros(self.layout.capacity, dtype=bool)
        is_free[self.table("free")[: self.control[FREE_PACKETS], 0]] = True
        return np.flatnonzero(~is_free)

    def events(self) -> Cells:
        """Return the pending events as a view (events, 3)."""
        return self.table("heap")[: self.control[HEAP_SIZE]]

    def put_events(self, events: Cells) -> None:
        """Replace the pending events by as many or fewer."""
        # Rows in ascending order are a heap.
        in_order = events[np.lexsort((events[:, ORDER], events[:, TIME]))]
        self.table("heap")[: len(in_order)] = in_order
        self.control[HEAP_SIZE] = len(in_order)

    def free(self, slots: Cells) -> None:
        """Take packets out of the network."""
        first = int(self.control[FREE_PACKETS])
        self.table("free")[first : first + len(slots), 0] = slots
        self.control[FREE_PACKETS] += len(slots)

    def grow(self) -> None:
        """Double the room for packets and events.

        Raises:
            CosimError: it would exceed `MAX_PACKETS`.
        """
        old = self.layout.capacity
        if 2 * old > MAX_PACKETS:
            raise CosimError(
                f"more than {old} packets are inside the network: lower the queues, the "
                "propagation times or the rate of the cross traffic"
            )
        contents = {name: self.table(name) for name in COLUMNS}
        self._rows.update(dict.fromkeys(self._growing, 2 * old))
        self._allocate()
        for name, content in contents.items():
            _copy(content, self.table(name))
        self.free(np.arange(old, 2 * old))

    def _allocate(self) -> None:
        starts = {}
        size = 0
        for name, columns in COLUMNS.items():
            starts[name] = size
            size += -(-self._rows[name] * columns // LINE) * LINE
        whole: Cells = np.zeros(size + LINE, dtype=np.int64)
        aligned = -(whole.ctypes.data // whole.itemsize) % LINE
        self.cells = whole[aligned : aligned + size]
        self.layout = Layout(**starts, capacity=self._rows["heap"], **self._bounds)
        self._tables = {
            name: self.cells[start : start + self._rows[name] * columns].reshape(-1, columns)
            for (name, columns), start in zip(COLUMNS.items(), starts.values(), strict=True)
        }


def _copy(content: Cells, table: Cells) -> None:
    """Write the rows of a table to another one of zeros, which has as many or more.

    Zeros are not written: the rings of 10,000 links would take hundreds of megabytes before
    anything waits there.
    """
    for start in range(0, len(content), _ROWS_AT_ONCE):
        rows = content[start : start + _ROWS_AT_ONCE]
        if rows.any():
            table[start : start + len(rows)] = rows
