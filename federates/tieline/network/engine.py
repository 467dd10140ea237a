"""What every network engine does: takes frames at instants, gives deliveries and drops in order."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tieline.errors import CosimError

ARRIVAL = np.dtype(
    [("arrival_ns", "<i8"), ("source", "<u2"), ("destination", "<u2"), ("sequence", "<u4")]
)
"""A packet that its controller can use from `arrival_ns` on."""

DROP = np.dtype(
    [
        ("dropped_ns", "<i8"),
        ("source", "<u2"),
        ("destination", "<u2"),
        ("sequence", "<u4"),
        ("reason", "u1"),
    ]
)
"""A packet that ended at `dropped_ns`; `reason` is `QUEUE_FULL`, `LOSS` or `LINK_DOWN`."""

LINK_COUNTER = np.dtype(
    [
        ("packets", "<i8"),
        ("bytes", "<i8"),
        ("busy_ns", "<i8"),
        ("dropped_queue", "<i8"),
        ("dropped_loss", "<i8"),
        ("dropped_down", "<i8"),
        ("queue", "<i8"),
        ("max_queue", "<i8"),
    ]
)
"""What one direction of one link has carried since the start, as `LinkUse`; `queue` is the packets
that wait now, and `max_queue` the most that waited since the counters were last read."""

TAP = np.dtype(
    [
        ("sent_ns", "<i8"),
        ("port", "<i4"),
        ("flow", "<i4"),
        ("sequence", "<i4"),
        ("hop", "<i4"),
        ("part", "<i4"),
        ("bytes", "<i4"),
        ("is_back", "u1"),
    ]
)
"""A packet that goes on a link.

`sent_ns` is when its first bit does; `port` the link's direction, as in `NetworkSpec.ports`; `flow`
the number of the PMU flow (one of those that a multicast packet serves), or their count plus that
of the cross flow; `hop` the place of the link on the route, from 0; `part` the number of the
fragment, from 0; `bytes` those from the IPv4 header on; `is_back` is 1 for replies and
acknowledgements, which go from the flow's target to its source.
"""

DELIVERED, QUEUE_FULL, LOSS, LINK_DOWN = 0, 1, 2, 3
"""How a packet ends: at its controller, at a queue, corrupted on a link, or with its link."""

NO_ARRIVALS = np.empty(0, ARRIVAL)
NO_DROPS = np.empty(0, DROP)
NO_LINKS = np.empty(0, LINK_COUNTER)


@dataclass(frozen=True)
class Outcome:
    """What became of PMU packets up to an instant.

    Attributes:
        arrivals: (m,) of `ARRIVAL`, in the order (arrival_ns, source, sequence, destination).
        drops: (d,) of `DROP`, in order of time.
    """

    arrivals: NDArray[np.void]
    drops: NDArray[np.void]


def joined(outcomes: Sequence[Outcome]) -> Outcome:
    """Return the outcomes of spans that follow one another as one; at least one is given."""
    if len(outcomes) == 1:
        return outcomes[0]
    return Outcome(
        _one_after_another([outcome.arrivals for outcome in outcomes]),
        _one_after_another([outcome.drops for outcome in outcomes]),
    )


def _one_after_another(records: Sequence[NDArray[np.void]]) -> NDArray[np.void]:
    """Return records of one type as one array.

    They are joined as bare bytes: NumPy would work out anew, field by field, what is common to
    types that are the same.
    """
    kind = records[0].dtype
    whole: NDArray[np.void] = np.concatenate([each.view(f"V{kind.itemsize}") for each in records])
    return whole.view(kind)


@dataclass(frozen=True)
class Counts:
    """Packets of all flows since the start; `in_flight` is counted on its own, not inferred."""

    sent: int
    delivered: int
    dropped_queue: int
    dropped_loss: int
    in_flight: int
    dropped_down: int = 0

    def check(self, at_ns: int) -> None:
        """Raise CosimError unless every packet sent is accounted for."""
        ended = self.delivered + self.dropped_queue + self.dropped_loss + self.dropped_down
        if self.sent != ended + self.in_flight:
            raise CosimError(
                f"the network lost count of packets at {at_ns} ns: {self.sent} sent, but "
                f"{self.delivered} delivered, {self.dropped_queue} dropped at queues, "
                f"{self.dropped_loss} lost on links, {self.dropped_down} lost with links and "
                f"{self.in_flight} in flight"
            )


@dataclass(frozen=True)
class LinkUse:
    """What one direction of one link carried, PMU and cross traffic together.

    Attributes:
        origin, target: the nodes.
        rate_bps: its rate.
        packets, bytes: put on the link, those lost on it included, link-layer bytes included.
        dropped_queue: packets that found the queue full, or were dropped early.
        dropped_loss: packets that used the link and were lost at its end.
        busy_ns: time in transmission.
        max_queue: the most packets that waited, besides the one in transmission.
        dropped_down: packets that were lost with the link, or came while it was down.
    """

    origin: str
    target: str
    rate_bps: int
    packets: int
    bytes: int
    dropped_queue: int
    dropped_loss: int
    busy_ns: int
    max_queue: int
    dropped_down: int = 0


@dataclass(frozen=True)
class StreamUse:
    """A random stream of an engine.

    Attributes:
        name: as `tieline.streams.stream` has it.
        gives: in words, what its numbers are.
        taken: how many of them have been used; None if nobody counts them.
        is_seeded: whether the experiment's seed and the name decide its numbers.
    """

    name: str
    gives: str
    taken: int | None
    is_seeded: bool = True


class Engine(Protocol):
    """A network that carries one packet of every frame to every destination.

    Time only goes forward: a frame must be sent before `run_until` passes the instant at which it
    can first enter the network, `lookahead_ns` after its measurement. However often `run_until` is
    called on the way, and whenever frames are sent within that bound, the outcome is the same to
    the nanosecond.

    Attributes:
        lookahead_ns: least time from a measurement until its frame does anything.
    """

    lookahead_ns: int

    def send(
        self,
        measured_ns: int,
        sources: NDArray[np.int64],
        sequence: int,
        payloads: NDArray[np.uint8] | None = None,
    ) -> None:
        """Take the frames that some sources measured at one instant.

        Args:
            measured_ns: the instant of measurement.
            sources: their numbers, ascending.
            sequence: the number of the frame; each source sends each number once.
            payloads: (sources, size) the bytes of the frames. An engine that carries bytes compares
                what arrives with them, so that the frames handed over are those that travelled;
                the others leave them alone.
        """

    def run_until(self, until_ns: int) -> Outcome:
        """Return what ended after the last call and up to and including `until_ns`.

        Raises:
            CosimError: packets are not all accounted for, or a frame arrived with other bytes.
        """

    def counts(self) -> Counts:
        """Return the counts at the instant of the last `run_until`."""

    def links(self) -> list[LinkUse]:
        """Return what each link carried, direction by direction; none without a topology."""

    def link_counters(self) -> NDArray[np.void]:
        """Return (directions,) of `LINK_COUNTER` in the order of `links`, at the last `run_until`.

        Reading them begins a new span for `max_queue`; nothing else changes.
        """

    def streams(self) -> list[StreamUse]:
        """Return every random stream, with the numbers used up to the last `run_until`."""

    def close(self) -> None:
        """Let go of what the engine holds outside Python; nothing is asked of it afterwards."""


def check_not_late(enters_ns: int, now_ns: int) -> None:
    """Raise CosimError unless a frame can still do what it does first, at `enters_ns`."""
    if enters_ns < now_ns:
        raise CosimError(
            f"a frame that does something at {enters_ns} ns came when the network had reached "
            f"{now_ns} ns"
        )


def order_of(times_ns: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the places (n,) of instants (n,) in ascending order, equal ones as they stand."""
    if not len(times_ns):
        return np.empty(0, dtype=np.int64)
    first_ns = times_ns.min()
    bits = len(times_ns).bit_length()
    if int(times_ns.max()) - int(first_ns) >= 1 << (63 - bits):
        return np.argsort(times_ns, kind="stable")
    # One number for instant and place: sorting numbers is several times as fast as their places.
    keys = (times_ns - first_ns) << bits
    keys += np.arange(len(times_ns))
    keys.sort()
    keys &= (1 << bits) - 1
    return keys


def in_order(arrivals: NDArray[np.void]) -> NDArray[np.void]:
    """Return arrivals in the total order (arrival_ns, source, sequence, destination)."""
    times_ns = arrivals["arrival_ns"]
    order = order_of(times_ns)
    if not np.any(times_ns[order[1:]] == times_ns[order[:-1]]):
        return arrivals[order]
    # 16 + 32 + 16 bits hold the three lesser keys as one unsigned number.
    tie = arrivals["source"].astype(np.uint64) << np.uint64(48)
    tie |= arrivals["sequence"].astype(np.uint64) << np.uint64(16)
    tie |= arrivals["destination"]
    return arrivals[np.lexsort((tie, times_ns))]
