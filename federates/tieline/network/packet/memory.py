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
"""Packets, or pending events, that are ever held: about 370 MB. Queues bound them far below."""

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

ITEM_BITS = 27
ITEM_MASK = (1 << ITEM_BITS) - 1
LATER = 1 << 62
MOST_ORDERS = LATER >> ITEM_BITS
"""What a rank is made of (see `heap`). Order numbers begin anew before they reach the last one."""

NEVER = (1 << 63) - 1
"""The time of a row of `heap` that has no event."""

# control: one row.
HEAP_SIZE, NEXT_ORDER, FREE_PACKETS, ENDED, TAPPED, WANTS_DRAWS, FREE_BLOCK, FREE_BLOCKS = range(8)

# ports: of the direction of a link, the line that every packet meets. FIRST_WAIT and END_WAIT are
# places in `blocks`: of the packet that waits first, and behind the last.
PROPAGATION, QUEUE, SPECIAL, FREE_AT, WAITING, FIRST_WAIT, END_WAIT, MAX_QUEUE = range(8)

# details: the rest of a port, its counters first. What plain packets have carried stands with their
# plans until `settle` brings it here.
PACKETS, BYTES, BUSY, QUEUE_DROPS, LOSS_DROPS, DOWN_DROPS, WAITING_BYTES = range(7)
RATE, OVERHEAD, QUEUE_BYTES, JITTER_STREAM = range(7, 11)
LOSS_STREAM, LOSS_UNIT, LOSS_LEFT, EVENT_STREAM, EVENT_LEFT = range(11, 16)
RED, FIRST_CLASS, END_CLASSES, SERVICE_ORDER, TURN, PEER, IS_SERVING = range(16, 23)

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
# MEMBERS are the flows that a tree's packet on this hop still serves. CARRIED counts packets that a
# plain port has taken by this plan and that its counters do not have yet.
HOP_PORT, HOP_SERVICE, HOP_BYTES, HOP_CLASS, FIRST_MEMBER, END_MEMBERS, CARRIED = range(7)
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

# blocks: packets that wait at plain ports, three (start, bytes) to a block, then the place of the
# next block. A plain port always has one; free ones are a list of their own.
ENTRY, NEXT_BLOCK = 2, 6

# heap: pending events. A rank decides between events of one instant and says what happens: its last
# ITEM_BITS are an item, what is above them an order number; a frame's is its item above LATER.
TIME, RANK = range(2)

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
    "control": LINE,
    "ports": LINE,
    "details": 24,
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
    "blocks": LINE,
    "heap": 2,
    "packets": 8,
    "free": 1,
    "ended": 4,
    "taps": 7,
}
GROWING = ("packets", "free")
"""The tables with a row for each packet that may be inside; `heap` has some more."""

HEAP_COLUMNS = COLUMNS["heap"]

_BEFORE_HEAP, _AROUND_HEAP = 3, 8
"""Rows before the first event, so that each four below one begin a line, and of no event in all."""


class Layout(NamedTuple):
    """Where each table begins, and the numbers that bound the kernel's loops.

    `free` holds the free slots of `packets`; `received`, connection after connection, a ring of
    segments: whether one has come out of order, and the frame that it carries. `capacity` is the
    number of rows of each growing table, `records` that of `ended`, and of `taps` if there are any;
    `most_packets` is the most packets that one event can make. Flows from `pmu_flows` on have a row
    of `cross`; `first_tree` is the first flow that is a tree.
    """

    control: int
    ports: int
    details: int
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
    blocks: int
    heap: int
    packets: int
    free: int
    ended: int
    taps: int
    capacity: int
    records: int
    source_count: int
    pmu_flows: int
    first_tree: int
    most_packets: int


class Memory:
    """The cells, and views of them as tables.

    Args:
        tables: the contents of the tables of fixed size, (rows, columns) each; those that are not
            given have one row of zeros (`control`) or are empty. `blocks` has the plain ports' own.
        capacity: rows of the growing tables at first, records, and free blocks.
        bounds: the layout's counts, `source_count` to `most_packets`.
        is_tapped: whether a link is listened to.
    """

    def __init__(
        self, tables: dict[str, Cells], capacity: int, bounds: dict[str, int], is_tapped: bool
    ) -> None:
        self._bounds = bounds
        self._rows = {name: len(tables.get(name, ())) for name in COLUMNS}
        self._rows["control"] = 1
        self._records = ("ended", "taps") if is_tapped else ("ended",)
        self._rows.update(dict.fromkeys((*GROWING, *self._records), capacity))
        taken = self._rows["blocks"]
        self._rows["blocks"] += capacity
        self._allocate(tables)
        self.table("free")[:, 0] = np.arange(capacity)[::-1]
        self.control[FREE_PACKETS] = capacity
        self._free_blocks(taken)

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
        """Return the pending events as a view (events, 2)."""
        return self.table("heap")[_BEFORE_HEAP:][: self.control[HEAP_SIZE]]

    def put_events(self, events: Cells) -> None:
        """Replace the pending events by as many or fewer."""
        # Rows in ascending order are a heap.
        in_order = events[np.lexsort((events[:, RANK], events[:, TIME]))]
        self.events()[:, TIME] = NEVER
        self.control[HEAP_SIZE] = len(in_order)
        self.events()[:] = in_order

    def free(self, slots: Cells) -> None:
        """Take packets out of the network."""
        first = int(self.control[FREE_PACKETS])
        self.table("free")[first : first + len(slots), 0] = slots
        self.control[FREE_PACKETS] += len(slots)

    @property
    def waits(self) -> Cells:
        """The cells of `blocks` as a view: a packet's start has its size behind it."""
        return self.table("blocks").reshape(-1)

    def waiting_at(self, port: int) -> Cells:
        """Return (n,) the places in `waits` of the packets that wait at a plain port, in order.

        Some may have started, if nothing has come to the port since.
        """
        row, waits = self.table("ports")[port], self.waits
        place, places = int(row[FIRST_WAIT]), []
        for _ in range(row[WAITING]):
            if place % LINE == NEXT_BLOCK:
                place = int(waits[place])
            places.append(place)
            place += ENTRY
        return np.array(places, dtype=np.int64)

    def make_room(self) -> None:
        """Grow what is too short for any event: order numbers, what holds those that wait, or all.

        Raises:
            CosimError: as `grow`.
        """
        if MOST_ORDERS - self.control[NEXT_ORDER] < 2 * self.layout.most_packets:
            self._number_anew()
        elif self.control[FREE_BLOCKS] < self.layout.most_packets:
            taken = self._rows["blocks"]
            # Three packets fill one.
            self._rows["blocks"] += self._rows["packets"] // 4
            self._allocate(self._tables)
            self._free_blocks(taken)
        else:
            self.grow()

    def _number_anew(self) -> None:
        """Give the pending events the first order numbers, in the order of those that they have."""
        ranks = self.events()[:, RANK]
        own = np.flatnonzero(ranks < LATER)
        own = own[np.argsort(ranks[own])]
        ranks[own] = (np.arange(len(own)) << ITEM_BITS) + (ranks[own] & ITEM_MASK)
        self.control[NEXT_ORDER] = len(own)

    def grow(self) -> None:
        """Make room for half as many packets and events again.

        Raises:
            CosimError: it would exceed `MAX_PACKETS`.
        """
        old = self.layout.capacity
        if old == MAX_PACKETS:
            raise CosimError(
                f"more than {old} packets are inside the network: lower the queues, the "
                "propagation times or the rate of the cross traffic"
            )
        new = min(old * 3 // 2, MAX_PACKETS)
        self._rows.update(dict.fromkeys(GROWING, new))
        self._allocate(self._tables)
        self.free(np.arange(old, new))

    def hold_records(self, count: int) -> None:
        """Make room for so many records, and one event's, before they are collected."""
        if count + self.layout.most_packets > self.layout.records:
            rows = count + self.layout.most_packets
            self._rows.update(dict.fromkeys(self._records, rows))
            self._allocate(self._tables)

    def _free_blocks(self, first: int) -> None:
        """Add the rows of `blocks` from one on to those that are free."""
        rows = np.arange(first, self._rows["blocks"])
        nexts = self.table("blocks")[first:, NEXT_BLOCK]
        nexts[:-1] = LINE * rows[1:]
        nexts[-1] = self.control[FREE_BLOCK]
        self.control[FREE_BLOCK] = LINE * first
        self.control[FREE_BLOCKS] += len(rows)

    def _allocate(self, contents: dict[str, Cells]) -> None:
        """Lay the tables out anew, with the contents that some of them have."""
        starts = {}
        size = 0
        self._rows["heap"] = self._rows["packets"] + _AROUND_HEAP
        for name, columns in COLUMNS.items():
            starts[name] = size
            size += -(-self._rows[name] * columns // LINE) * LINE
        whole: Cells = np.zeros(size + LINE, dtype=np.int64)
        aligned = -(whole.ctypes.data // whole.itemsize) % LINE
        self.cells = whole[aligned : aligned + size]
        events = {"heap": starts["heap"] + _BEFORE_HEAP * HEAP_COLUMNS}
        bounds = {"capacity": self._rows["packets"], "records": self._rows["ended"]} | self._bounds
        self.layout = Layout(**starts | events | bounds)
        self._tables = {
            name: self.cells[start : start + self._rows[name] * columns].reshape(-1, columns)
            for (name, columns), start in zip(COLUMNS.items(), starts.values(), strict=True)
        }
        self.table("heap")[:, TIME] = NEVER
        for name, content in contents.items():
            self.table(name)[: len(content)] = content
