"""The packet kernel's memory: tables of whole numbers, row after row in one flat array.

One array, because compiled code counts references to every array that it hands from function to
function; with a table each, that costs more than the simulation (measured: five times as long).
The kernel finds row r of a table at `layout.table + r * COLUMNS`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tieline.errors import CosimError

Cells = NDArray[np.int64]

MAX_PACKETS = 1 << 22
"""Packets, or pending events, that are ever held: about 400 MB. Queues bound them far below."""

DRAWS_CHUNK = 4096
"""Random numbers drawn at a time for each stream; two chunks of each are held."""

NO_STREAM = -1
NO_PORT = -1

# control: one row.
HEAP_SIZE, NEXT_ORDER, FREE_PACKETS, ENDED, WANTS_DRAWS = range(5)

# ports: facts of the direction of a link, its state, its statistics.
PROPAGATION, QUEUE, RING, LOSS_STREAM, JITTER_STREAM = range(5)
FREE_AT, RING_HEAD, WAITING = range(5, 8)
PACKETS, BYTES, BUSY, QUEUE_DROPS, LOSS_DROPS, MAX_QUEUE = range(8, 14)

# hops: one for each link of each flow's route; after the last link comes a row with NO_PORT.
HOP_PORT, HOP_SERVICE, HOP_BYTES = range(3)

# flows: PMU flows first, then cross flows, which have no destination.
FIRST_HOP, DESTINATION = range(2)

# sources: flows of a source are FIRST_FLOW to END_FLOWS - 1.
FIRST_FLOW, END_FLOWS = range(2)

# destinations: processing time and the stream of its jitter.
PROCESSING, PROCESSING_STREAM = range(2)

# cross: stream of gaps, and what became of the packets; ARRIVED + how they ended.
GAP_STREAM, SENT, ARRIVED, LEFT_AT_QUEUE, LEFT_AT_LINK = range(5)

# streams: how many numbers are used up, then the numbers.
USED, FIRST_DRAW = range(2)

# heap: pending events.
TIME, ORDER, ITEM = range(3)

# packets inside the network, by slot.
FLOW, SEQUENCE, HOP, LOST = range(4)

# ended: PMU packets that have ended since they were last collected.
END_TIME, END_FLOW, END_SEQUENCE, END_HOW = range(4)

COLUMNS = {
    "control": 5,
    "ports": 14,
    "hops": 3,
    "flows": 2,
    "sources": 2,
    "destinations": 2,
    "cross": 5,
    "streams": 1 + 2 * DRAWS_CHUNK,
    "ring": 1,
    "heap": 3,
    "packets": 4,
    "free": 1,
    "ended": 4,
}
GROWING = ("heap", "packets", "free", "ended")

HEAP_COLUMNS = COLUMNS["heap"]
PORT_COLUMNS = COLUMNS["ports"]
STREAM_COLUMNS = COLUMNS["streams"]


class Layout(NamedTuple):
    """Where each table begins, and the numbers that bound the kernel's loops.

    `ring` holds, port after port, when each waiting packet will start; `free` the free slots of
    `packets`. `capacity` is the number of rows of each growing table, and `most_packets` the most
    packets that one event can make.
    """

    control: int
    ports: int
    hops: int
    flows: int
    sources: int
    destinations: int
    cross: int
    streams: int
    ring: int
    heap: int
    packets: int
    free: int
    ended: int
    capacity: int
    source_count: int
    pmu_flows: int
    cross_flows: int
    most_packets: int


class Memory:
    """The cells, and views of them as tables.

    Args:
        tables: the contents of the tables of fixed size, (rows, columns) each; those that are not
            given have one row of zeros (`control`) or are empty.
        capacity: rows of the growing tables at first.
        bounds: the layout's counts, `source_count` to `most_packets`.
    """

    def __init__(self, tables: dict[str, Cells], capacity: int, bounds: dict[str, int]) -> None:
        self._bounds = bounds
        self._rows = {name: len(tables.get(name, ())) for name in COLUMNS}
        self._rows["control"] = 1
        self._rows.update(dict.fromkeys(GROWING, capacity))
        self._allocate()
        for name, content in tables.items():
            self.table(name)[:] = content
        self.table("free")[:, 0] = np.arange(capacity)[::-1]
        self.control[FREE_PACKETS] = capacity

    def table(self, name: str) -> Cells:
        """Return a table as a view (rows, columns)."""
        start: int = getattr(self.layout, name)
        rows, columns = self._rows[name], COLUMNS[name]
        return self.cells[start : start + rows * columns].reshape(rows, columns)

    @property
    def control(self) -> Cells:
        """The control row as a view."""
        return self.table("control")[0]

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
        self._rows.update(dict.fromkeys(GROWING, 2 * old))
        self._allocate()
        for name, content in contents.items():
            self.table(name)[: len(content)] = content
        free = int(self.control[FREE_PACKETS])
        self.table("free")[free : free + old, 0] = np.arange(old, 2 * old)
        self.control[FREE_PACKETS] += old

    def _allocate(self) -> None:
        starts = {}
        size = 0
        for name, columns in COLUMNS.items():
            starts[name] = size
            size += self._rows[name] * columns
        self.cells: Cells = np.zeros(size, dtype=np.int64)
        self.layout = Layout(**starts, capacity=self._rows["heap"], **self._bounds)
