"""Reads the counters of every port of the kernel at once, for the series of the links."""

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled_from_zero
from tieline.network.engine import LINK_COUNTER
from tieline.network.packet.kinds import FRAME, KIND_BITS, KINDS, item_of
from tieline.network.packet.memory import (
    BUSY,
    BYTES,
    CARRIED,
    COLUMNS,
    DOWN_DROPS,
    FREE_AT,
    HEAP_COLUMNS,
    HEAP_SIZE,
    HOP_BYTES,
    HOP_PORT,
    HOP_SERVICE,
    LOSS_DROPS,
    MAX_QUEUE,
    PACKETS,
    QUEUE_DROPS,
    RANK,
    Cells,
    Layout,
)
from tieline.network.packet.ports import waiting_now
from tieline.network.packet.ways import DETAILS, PORT_COLUMNS

_PLAN = COLUMNS["plans"]


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
        item = item_of(cells[at.heap + HEAP_COLUMNS * place + RANK])
        if item & (KINDS - 1) == FRAME:
            waiting += flows_of[(item >> KIND_BITS) % at.source_count]
    return waiting


@compiled_from_zero
def settle(cells: Cells, at: Layout) -> None:
    """Add what plain packets have carried, by their plans, to the counters of the ports."""
    # `forks` is the table after `plans`, whose rows fill whole lines.
    for plan in range(at.plans, at.forks, _PLAN):
        carried = cells[plan + CARRIED]
        if carried > 0:
            details = at.details + DETAILS * cells[plan + HOP_PORT]
            cells[details + PACKETS] += carried
            cells[details + BYTES] += carried * cells[plan + HOP_BYTES]
            cells[details + BUSY] += carried * cells[plan + HOP_SERVICE]
            cells[plan + CARRIED] = 0


@compiled_from_zero
def _read(now_ns: int, counters: NDArray[np.void], cells: Cells, at: Layout) -> None:
    settle(cells, at)
    for number in range(len(counters)):
        port, details = at.ports + PORT_COLUMNS * number, at.details + DETAILS * number
        row = counters[number]
        row["packets"] = cells[details + PACKETS]
        row["bytes"] = cells[details + BYTES]
        row["busy_ns"] = cells[details + BUSY] - max(0, cells[port + FREE_AT] - now_ns)
        row["dropped_queue"] = cells[details + QUEUE_DROPS]
        row["dropped_loss"] = cells[details + LOSS_DROPS]
        row["dropped_down"] = cells[details + DOWN_DROPS]
        row["queue"] = waiting_now(now_ns, port, cells, at)
        row["max_queue"] = cells[port + MAX_QUEUE]
