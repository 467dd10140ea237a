"""What links that are listened to have carried, from the kernel's records to those for captures."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from tieline.network.engine import TAP
from tieline.network.packet.memory import (
    COLUMNS,
    FIRST_MEMBER,
    TAP_BYTES,
    TAP_FLOW,
    TAP_HOP,
    TAP_PART,
    TAP_PORT,
    TAP_SEQUENCE,
    TAP_TIME,
    TAPPED,
    Memory,
)
from tieline.network.packet.routes import Routes

_FIELDS = {
    "sent_ns": TAP_TIME,
    "port": TAP_PORT,
    "sequence": TAP_SEQUENCE,
    "part": TAP_PART,
    "bytes": TAP_BYTES,
}


class Taps:
    """Records of packets, kept until their first bit is on the link.

    Args:
        memory: the kernel's.
        routes: the routes of the network.
    """

    def __init__(self, memory: Memory, routes: Routes) -> None:
        self._memory = memory
        # Only what is listened to needs them, and a large network has many.
        is_tapped = len(memory.table("taps")) > 0
        self._places = np.array(routes.places if is_tapped else (), dtype=np.int64)
        carried = np.array(routes.carried if is_tapped else (), dtype=np.int64)
        self._carried = carried.reshape(-1, 2)
        self._first_tree = routes.first_tree
        self._rows = np.empty((0, COLUMNS["taps"]), dtype=np.int64)
        self._new: list[NDArray[np.int64]] = []

    def collect(self) -> None:
        """Take over what the kernel has recorded."""
        count = self._memory.control[TAPPED]
        if count:
            self._new.append(self._memory.table("taps")[:count].copy())
            self._memory.control[TAPPED] = 0

    def move(self, starts_ns: Mapping[int, NDArray[np.int64]], at_ns: int) -> None:
        """Give packets that wait at some ports at an instant the starts that they have now.

        Args:
            starts_ns: by port; where it is empty the port went down, and nothing more starts.
            at_ns: the instant.
        """
        rows = self._all()
        for port, own_ns in starts_ns.items():
            waits = (rows[:, TAP_PORT] == port) & (rows[:, TAP_TIME] >= at_ns)
            if len(own_ns) == 0:
                rows = rows[~waits]
            elif waits.any():
                rows[waits, TAP_TIME] = own_ns
        self._rows = rows

    def due(self, now_ns: int) -> NDArray[np.void]:
        """Return (n,) of `TAP`, in order of time: what has gone on a link by an instant."""
        rows = self._all()
        is_due = rows[:, TAP_TIME] <= now_ns
        self._rows = rows[~is_due]
        due = rows[is_due]
        due = due[np.argsort(due[:, TAP_TIME], kind="stable")]
        records = np.empty(len(due), TAP)
        for name, column in _FIELDS.items():
            records[name] = due[:, column]
        records["hop"] = self._places[due[:, TAP_HOP]]
        flows = due[:, TAP_FLOW].copy()
        is_tree = flows >= self._first_tree
        member = self._memory.plans_of(due[is_tree, TAP_HOP])[:, FIRST_MEMBER]
        flows[is_tree] = self._memory.table("members")[member, 0]
        records["flow"], records["is_back"] = self._carried[flows].T
        return records

    def _all(self) -> NDArray[np.int64]:
        """Return all records that are kept, as one table."""
        if self._new:
            self._rows = np.concatenate([self._rows, *self._new])
            self._new.clear()
        return self._rows
