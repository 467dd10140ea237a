"""From bare records of ended packets to arrivals and drops, for engines that make such records."""

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled_from_zero
from tieline.network.engine import ARRIVAL, DELIVERED, DROP, NO_DROPS, Outcome, order_of
from tieline.network.packet.memory import COLUMNS, END_FLOW, END_HOW, END_SEQUENCE, END_TIME
from tieline.network.spec import NetworkSpec

# Columns of what is held: when it can be used, and what decides between arrivals of one instant.
_TIME, _TIE = range(2)

_FIRST_ROOM = 1024


class Endings:
    """Keeps arrivals until their time has come, and counts what has ended.

    A packet that has come, but that its controller is still processing, is held.

    Args:
        spec: the network.

    Attributes:
        counts: (4,) PMU packets by how they ended, as in `network/engine.py`.
        held: packets that have come and that their controller cannot use yet.
    """

    def __init__(self, spec: NetworkSpec) -> None:
        self._sources = len(spec.sources)
        self._ends = np.array(
            [(flow.source, flow.destination) for flow in spec.flows], dtype=np.int32
        ).reshape(-1, 2)
        self._pending = np.empty((_FIRST_ROOM, 2), dtype=np.int64)
        self.held = 0
        self._drops: list[NDArray[np.void]] = []
        self.counts = np.zeros(4, dtype=np.int64)
        # Compiles, where that is still to be done, before the federation waits for an answer.
        self.take(np.empty((0, COLUMNS["ended"]), dtype=np.int64))
        self.outcome(0)

    def flows_of_sources(self) -> NDArray[np.int64]:
        """Return (sources,) how many flows each source has."""
        return np.bincount(self._ends[:, 0], minlength=self._sources)

    def take(self, rows: NDArray[np.int64]) -> None:
        """Take over records of ended packets.

        Args:
            rows: (packets, 4) with the columns of the table `ended`, in the order of the events;
                the time of a delivery is when its controller can use the frame.
        """
        if self.held + len(rows) > len(self._pending):
            room = (self.held + len(rows)) * 5 // 4
            held = self._pending[: self.held]
            self._pending = np.concatenate([held, np.empty((room - self.held, 2), dtype=np.int64)])
        drops = np.empty(len(rows), DROP)
        before = self.held
        self.held += _sort_out(rows, self._ends, self._pending[before:], drops)
        count = len(rows) - (self.held - before)
        if count:
            self._drops.append(drops[:count])
            self.counts += np.bincount(drops["reason"][:count], minlength=4)

    def outcome(self, until_ns: int) -> Outcome:
        """Return the drops taken over, and the arrivals up to and including `until_ns`."""
        pending = self._pending[: self.held]
        arrivals = np.empty(self.held, ARRIVAL)
        due = _let_go(order_of(pending[:, _TIME]), until_ns, pending.copy(), pending, arrivals)
        self.held -= due
        self.counts[DELIVERED] += due
        drops = np.concatenate([NO_DROPS, *self._drops]) if self._drops else NO_DROPS
        self._drops.clear()
        return Outcome(arrivals[:due], drops)


@compiled_from_zero
def _sort_out(
    rows: NDArray[np.int64],
    ends: NDArray[np.int32],
    pending: NDArray[np.int64],
    drops: NDArray[np.void],
) -> int:
    """Write deliveries to `pending` and the rest to `drops`; return how many are delivered."""
    delivered = 0
    for place in range(len(rows)):
        flow, sequence = rows[place, END_FLOW], rows[place, END_SEQUENCE]
        source, destination = np.int64(ends[flow, 0]), np.int64(ends[flow, 1])
        if rows[place, END_HOW] == DELIVERED:
            pending[delivered, _TIME] = rows[place, END_TIME]
            # 16, 31 and 16 bits, so that the numbers order as (source, sequence, destination).
            pending[delivered, _TIE] = (source << 47) | (sequence << 16) | destination
            delivered += 1
        else:
            drop = drops[place - delivered]
            drop["dropped_ns"] = rows[place, END_TIME]
            drop["source"] = source
            drop["destination"] = destination
            drop["sequence"] = sequence
            drop["reason"] = rows[place, END_HOW]
    return delivered


@compiled_from_zero
def _let_go(
    order: NDArray[np.int64],
    until_ns: int,
    pending: NDArray[np.int64],
    left: NDArray[np.int64],
    arrivals: NDArray[np.void],
) -> int:
    """Write what is due to `arrivals` and the rest to `left`; return how many are due.

    Args:
        order: (n,) the places of `pending` by time.
        until_ns: the last instant that is due.
        pending: (n, 2) arrivals that wait.
        left: (n, 2) room for those that go on waiting.
        arrivals: (n,) room for those that are due, in order of time and tie.
    """
    due = 0
    while due < len(order) and pending[order[due], _TIME] <= until_ns:
        own = order[due]
        place = due
        while place > 0 and (
            pending[order[place - 1], _TIME] == pending[own, _TIME]
            and pending[order[place - 1], _TIE] > pending[own, _TIE]
        ):
            order[place] = order[place - 1]
            place -= 1
        order[place] = own
        due += 1
    for place in range(due):
        own = order[place]
        tie = pending[own, _TIE]
        arrival = arrivals[place]
        arrival["arrival_ns"] = pending[own, _TIME]
        arrival["source"] = tie >> 47
        arrival["sequence"] = (tie >> 16) & 0x7FFFFFFF
        arrival["destination"] = tie & 0xFFFF
    for place in range(due, len(order)):
        left[place - due, _TIME] = pending[order[place], _TIME]
        left[place - due, _TIE] = pending[order[place], _TIE]
    return due
