"""tieline's own packet network: the compiled kernel, fed with frames and random numbers."""

import numpy as np
from numpy.typing import NDArray

from tieline.errors import CosimError
from tieline.network.engine import (
    DELIVERED,
    LINK_DOWN,
    LOSS,
    QUEUE_FULL,
    Counts,
    LinkUse,
    Outcome,
    StreamUse,
    check_not_late,
)
from tieline.network.packet import kernel, tcp
from tieline.network.packet.build import Supplies, laid_out
from tieline.network.packet.counters import frames_announced, read_counters, settle
from tieline.network.packet.endings import Endings
from tieline.network.packet.kinds import CROSS, FRAME, KINDS
from tieline.network.packet.memory import (
    ARRIVED,
    BUSY,
    BYTES,
    CHUNK,
    DOWN_DROPS,
    END_MEMBERS,
    ENDED,
    FIRST_DRAW,
    FIRST_MEMBER,
    FLOW,
    FRAGMENT,
    FREE_AT,
    FREE_PACKETS,
    GAP_STREAM,
    HEAP_SIZE,
    HOP,
    ITEM_BITS,
    LATER,
    LOSS_DROPS,
    MAX_QUEUE,
    NEXT_ORDER,
    NONE,
    PACKETS,
    QUEUE_DROPS,
    SENT,
    USED,
    WANTS_DRAWS,
)
from tieline.network.packet.pmu import Pmus
from tieline.network.packet.taps import Taps
from tieline.network.spec import NetworkSpec


class PacketEngine:
    """Carries frames through a `NetworkSpec`, packet by packet.

    Not modelled: address resolution, the messages of routing protocols. Datagrams are cut to the
    smallest MTU of their route where they enter it. A packet keeps the route that it entered with,
    as on a label-switched path. A controller's processing time delays each packet by itself; the
    packets do not queue for the controller. A PMU sends its frames in order, so one whose jitter
    would overtake the last waits for it.

    Args:
        spec: the network.
        seed: the experiment's seed; each random thing has its own stream of it.

    Raises:
        InputError: as `laid_out`.
    """

    def __init__(self, spec: NetworkSpec, seed: int) -> None:
        self._spec = spec
        self._supplies = Supplies(seed)
        self._memory, self._changes, routes = laid_out(spec, self._supplies)
        self._taps = Taps(self._memory, routes)
        self._pmus = Pmus(spec.sources, seed)
        self._endings = Endings(spec)
        self._flows_of = self._endings.flows_of_sources()
        self.lookahead_ns = spec.lookahead_ns
        self._now_ns = -1
        self._sent = 0
        self._max_queue = np.zeros(len(spec.ports), dtype=np.int64)
        self._start_cross_flows()

    def send(
        self,
        measured_ns: int,
        sources: NDArray[np.int64],
        sequence: int,
        payloads: NDArray[np.uint8] | None = None,
    ) -> None:
        """Take the frames that some sources measured at one instant; their bytes stay here.

        Raises:
            CosimError: the last `run_until` has passed the instant at which a frame may enter.
        """
        check_not_late(measured_ns + self.lookahead_ns, self._now_ns)
        items = KINDS * (sequence * len(self._spec.sources) + sources) + FRAME
        self._announce(self._pmus.ready_ns(measured_ns, sources), LATER + items)
        self._sent += int(self._flows_of[sources].sum())

    def run_until(self, until_ns: int) -> Outcome:
        """Return what ended after the last call and up to and including `until_ns`.

        Raises:
            CosimError: `until_ns` is before the last call, or packets are not accounted for.
        """
        if until_ns < self._now_ns:
            raise CosimError(f"the network cannot go back from {self._now_ns} to {until_ns} ns")
        while self._changes.next_ns <= until_ns:
            self._run_to(self._changes.next_ns - 1)
            self._change()
        self._run_to(until_ns)
        self._now_ns = until_ns
        outcome = self._endings.outcome(until_ns)
        self.counts().check(until_ns)
        return outcome

    def counts(self) -> Counts:
        """Return the counts of PMU and cross packets at the instant of the last `run_until`.

        A multicast packet counts once for each controller that it is still to reach, a frame on a
        connection from the hand-over to its delivery, besides the segments that carry it.
        """
        cross = self._memory.table("cross").sum(axis=0)
        ended = self._endings.counts + cross[ARRIVED:]
        return Counts(
            sent=self._sent + int(cross[SENT]),
            delivered=int(ended[DELIVERED]),
            dropped_queue=int(ended[QUEUE_FULL]),
            dropped_loss=int(ended[LOSS]),
            dropped_down=int(ended[LINK_DOWN]),
            in_flight=self._inside() + self._endings.held + self._frames_waiting(),
        )

    def links(self) -> list[LinkUse]:
        """Return what each link carried up to the last `run_until`, direction by direction."""
        settle(self._memory.cells, self._memory.layout)
        ports, rows = (self._memory.table(name).tolist() for name in ("ports", "details"))
        before = self._max_queue.tolist()
        return [
            LinkUse(
                origin,
                target,
                self._spec.links[port // 2].rate_bps,
                packets=rows[port][PACKETS],
                bytes=rows[port][BYTES],
                dropped_queue=rows[port][QUEUE_DROPS],
                dropped_loss=rows[port][LOSS_DROPS],
                busy_ns=rows[port][BUSY] - max(0, ports[port][FREE_AT] - max(0, self._now_ns)),
                max_queue=max(before[port], ports[port][MAX_QUEUE]),
                dropped_down=rows[port][DOWN_DROPS],
            )
            for (origin, target), port in self._spec.ports.items()
        ]

    def tapped(self) -> NDArray[np.void]:
        """Return the packets of tapped links whose first bit has left since the last call.

        Returns:
            (n,) of `TAP`, in order of time.
        """
        return self._taps.due(self._now_ns)

    @property
    def fragment_bytes(self) -> NDArray[np.int64]:
        """Return (flows,) the most of a datagram that a packet of each PMU and cross flow takes.

        0 where datagrams are never cut.
        """
        count = len(self._spec.flows) + len(self._spec.cross_flows)
        return np.maximum(self._memory.table("flows")[:count, FRAGMENT], 0)

    def link_counters(self) -> NDArray[np.void]:
        """Return the counters of each link's directions, and begin a new span for `max_queue`."""
        ports = self._memory.table("ports")
        memory = self._memory
        # Before the first step, too, when nothing has been in transmission.
        now_ns = max(0, self._now_ns)
        counters = read_counters(now_ns, len(ports), memory.cells, memory.layout)
        np.maximum(self._max_queue, counters["max_queue"], out=self._max_queue)
        ports[:, MAX_QUEUE] = counters["queue"]
        return counters

    def streams(self) -> list[StreamUse]:
        """Return every random stream, with the numbers used up to the last `run_until`."""
        return self._pmus.uses() + self._supplies.uses(self._memory.table("streams"))

    def close(self) -> None:
        """Do nothing: there is nothing to let go of."""

    def _start_cross_flows(self) -> None:
        """Announce the first packet of each cross flow."""
        streams = self._memory.table("streams")
        own = self._memory.table("cross")[:, GAP_STREAM]
        own = own[own != NONE]
        orders = np.arange(len(own), dtype=np.int64)
        self._memory.control[NEXT_ORDER] = len(own)
        self._announce(streams[own, FIRST_DRAW], (orders << ITEM_BITS) + KINDS * orders + CROSS)
        streams[own, USED] = 1
        # Compiles, where that is still to be done, before the federation waits for an answer.
        self._run(-1)

    def _change(self) -> None:
        """Do the next change of the network."""
        at_ns = self._changes.next_ns
        self._memory.hold_records(self._inside())
        starts = self._changes.apply(self._memory)
        self._collect()
        self._taps.move(starts, at_ns)

    def _announce(self, times_ns: NDArray[np.int64], ranks: NDArray[np.int64]) -> None:
        while (
            self._memory.control[HEAP_SIZE] + 2 * self._memory.layout.most_packets + len(ranks)
            > self._memory.layout.capacity
        ):
            self._memory.grow()
        kernel.announce(times_ns, ranks, self._memory.cells, self._memory.layout)

    def _inside(self) -> int:
        """Return the packets inside, each member of a tree counted."""
        layout = self._memory.layout
        if layout.first_tree == len(self._memory.table("flows")):
            return layout.capacity - int(self._memory.control[FREE_PACKETS])
        packets = self._memory.table("packets")[self._memory.inside()]
        plans = self._memory.plans_of(packets[:, HOP])
        members = plans[:, END_MEMBERS] - plans[:, FIRST_MEMBER]
        return int(np.where(packets[:, FLOW] < layout.first_tree, 1, members).sum())

    def _frames_waiting(self) -> int:
        """Return the frames that are still at their PMU, or on a connection."""
        memory = self._memory
        waiting = frames_announced(self._flows_of, memory.cells, memory.layout)
        connections = self._memory.table("connections")
        if not len(connections):
            return waiting
        connections = connections[connections[:, tcp.FRAMES_OF] != NONE]
        under_way = connections[:, tcp.AVAILABLE] - connections[:, tcp.EXPECTED]
        return waiting + int(under_way.sum())

    def _run_to(self, until_ns: int) -> None:
        """Run the kernel, helping it on, up to and including an instant."""
        while (stop := self._run(until_ns)) != kernel.DONE:
            if stop == kernel.NEEDS_DRAWS:
                self._refill()
            elif not kernel.events_with_room(self._memory.cells, self._memory.layout):
                self._memory.make_room()

    def _run(self, until_ns: int) -> int:
        """Run the kernel as far as it comes, and take over its records."""
        stop = kernel.run(until_ns, self._memory.cells, self._memory.layout)
        self._collect()
        return stop

    def _collect(self) -> None:
        control = self._memory.control
        self._endings.take(self._memory.table("ended")[: control[ENDED]])
        control[ENDED] = 0
        self._taps.collect()

    def _refill(self) -> None:
        """Draw another chunk for each stream that has used one up."""
        streams = self._memory.table("streams")
        for number in np.flatnonzero(streams[:, USED] >= CHUNK):
            streams[number, USED] -= CHUNK
            draws = streams[number, FIRST_DRAW:]
            draws[:CHUNK] = draws[CHUNK:]
            draws[CHUNK:] = self._supplies.refill(int(number))
        self._memory.control[WANTS_DRAWS] = 0
