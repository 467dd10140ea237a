"""From bare records of ended packets to arrivals and drops, for engines that make such records."""

import numpy as np
from numpy.typing import NDArray

from tieline.network.engine import (
    ARRIVAL,
    DELIVERED,
    DROP,
    NO_ARRIVALS,
    Outcome,
    in_order,
)
from tieline.network.packet.memory import END_FLOW, END_HOW, END_SEQUENCE, END_TIME
from tieline.network.spec import NetworkSpec


class Endings:
    """Keeps arrivals until their time has come, and counts what has ended.

    A packet that has come, but that its controller is still processing, is held.

    Args:
        spec: the network.

    Attributes:
        counts: (4,) PMU packets by how they ended, as in `network/engine.py`.
    """

    def __init__(self, spec: NetworkSpec) -> None:
        self._sources = len(spec.sources)
        self._ends = np.array(
            [(flow.source, flow.destination) for flow in spec.flows], dtype=np.int64
        ).reshape(-1, 2)
        self._held = NO_ARRIVALS
        self.counts = np.zeros(4, dtype=np.int64)

    @property
    def held(self) -> int:
        """Packets that have come and that their controller cannot use yet."""
        return len(self._held)

    def flows_of_sources(self) -> NDArray[np.int64]:
        """Return (sources,) how many flows each source has."""
        return np.bincount(self._ends[:, 0], minlength=self._sources)

    def outcome(self, rows: NDArray[np.int64], until_ns: int) -> Outcome:
        """Return the drops, and the arrivals up to and including `until_ns`.

        Args:
            rows: (packets, 4) records with the columns of the table `ended`, in the order of the
                events; the time of a delivery is when its controller can use the frame.
            until_ns: ns.
        """
        is_delivered = rows[:, END_HOW] == DELIVERED
        self._held = np.concatenate([self._held, self._records(rows[is_delivered], ARRIVAL)])
        is_due = self._held["arrival_ns"] <= until_ns
        arrivals = in_order(self._held[is_due])
        self._held = self._held[~is_due]
        drops = self._records(rows[~is_delivered], DROP)
        drops["reason"] = rows[~is_delivered, END_HOW]
        self.counts += np.bincount(drops["reason"], minlength=4)
        self.counts[DELIVERED] += len(arrivals)
        return Outcome(arrivals, drops)

    def _records(self, rows: NDArray[np.int64], layout: "np.dtype[np.void]") -> NDArray[np.void]:
        flows = rows[:, END_FLOW]
        records = np.empty(len(rows), layout)
        records[layout.names[0]] = rows[:, END_TIME]  # type: ignore[index]
        records["source"] = self._ends[flows, 0]
        records["destination"] = self._ends[flows, 1]
        records["sequence"] = rows[:, END_SEQUENCE]
        return records
