"""Reads the counters of every port of the kernel at once, for the series of the links."""

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled_from_zero
from tieline.network.engine import LINK_COUNTER
from tieline.network.packet.events import FRAME, KIND_BITS, KINDS
from tieline.network.packet.memory import (
    BUSY,
    BYTES,
    COLUMNS,
    DOWN_DROPS,
    FREE_AT,
    HAS_SERVER,
    HEAP_COLUMNS,
    HEAP_SIZE,
    ITEM,
    LOSS_DROPS,
    MAX_QUEUE,
    PACKETS,
    QUEUE,
    QUEUE_DROPS,
    RING,
    RING_HEAD,
    SPECIAL,
    WAITING,
    Cells,
    Layout,
)

PORT_COLUMNS, _RING = COLUMNS["ports"], COLUMNS["ring"]


def read_counters(now_ns: int, ports: int, cells: Cells, at: Layout) -> NDArray[np.void]:
    """Return (ports,) of `LINK_COUNTER` at `now_ns`, the instant that the kernel has reached.

    `max_queue` is since the start, or since the tables' own was last set back.
    """
    counters = np.empty(ports, LINK_COUNTER)
    _read(now_ns, counters, cells, at)
    return counters


@compiled_from_zero
def frames_announced(flows_of: Cells, cells: Cells, at: Layout) -> int:
    """Return in how many flows frames wait at their PMUs to enter; `flows_of` counts a source's."""
    waiting = 0
    for place in range(cells[at.control + HEAP_SIZE]):
        item = cells[at.heap + HEAP_COLUMNS * place + ITEM]
        if item & (KINDS - 1) == FRAME:
            waiting += flows_of[(item >> KIND_BITS) % at.source_count]
    return waiting


@compiled_from_zero
def _read(now_ns: int, counters: NDArray[np.void], cells: Cells, at: Layout) -> None:
    for number in range(len(counters)):
        port = at.ports + PORT_COLUMNS * number
        row = counters[number]
        row["packets"] = cells[port + PACKETS]
        row["bytes"] = cells[port + BYTES]
        row["busy_ns"] = cells[port + BUSY] - max(0, cells[port + FREE_AT] - now_ns)
        row["dropped_queue"] = cells[port + QUEUE_DROPS]
        row["dropped_loss"] = cells[port + LOSS_DROPS]
        row["dropped_down"] = cells[port + DOWN_DROPS]
        row["queue"] = _waiting(now_ns, port, cells, at)
        row["max_queue"] = cells[port + MAX_QUEUE]


@compiled_from_zero
def _waiting(now_ns: int, port: int, cells: Cells, at: Layout) -> int:
    """Return how many packets wait at a port: those whose start is still to come.

    A port with a server counts them itself.
    """
    if cells[port + SPECIAL] & HAS_SERVER != 0:
        return cells[port + WAITING]
    ring = at.ring + _RING * cells[port + RING]
    room = cells[port + QUEUE]
    head = cells[port + RING_HEAD]
    waiting = cells[port + WAITING]
    while waiting > 0 and cells[ring + _RING * head] <= now_ns:
        head = head + 1 if head + 1 < room else 0
        waiting -= 1
    return waiting
