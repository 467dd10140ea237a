"""tieline's own packet network: the compiled kernel, fed with frames and random numbers."""

import numpy as np
from numpy.typing import NDArray

from tieline.errors import CosimError
from tieline.network.engine import (
    DELIVERED,
    LOSS,
    QUEUE_FULL,
    Counts,
    LinkUse,
    Outcome,
    check_not_late,
)
from tieline.network.packet import kernel
from tieline.network.packet.build import Supplies, Traces, laid_out
from tieline.network.packet.endings import Endings
from tieline.network.packet.memory import (
    ARRIVED,
    BUSY,
    BYTES,
    DRAWS_CHUNK,
    ENDED,
    FIRST_DRAW,
    FREE_AT,
    FREE_PACKETS,
    GAP_STREAM,
    HEAP_SIZE,
    ITEM,
    LOSS_DROPS,
    MAX_QUEUE,
    PACKETS,
    QUEUE_DROPS,
    SENT,
    USED,
    WANTS_DRAWS,
)
from tieline.network.packet.pmu import Pmu
from tieline.network.spec import NetworkSpec


class PacketEngine:
    """Carries frames through a `NetworkSpec`, packet by packet.

    Not modelled: routers' own processing, fragmentation, address resolution, routing protocols (the
    routes stand from the start). A controller's processing time delays each packet by itself; the
    packets do not queue for the controller. A PMU sends its frames in order, so one whose jitter
    would overtake the last waits for it.

    Args:
        spec: the network.
        seed: the experiment's seed; each random thing has its own stream of it.
        traces: instants (ns, ascending) at which a cross flow sends, by the flow's name, in place
            of its random arrivals.

    Raises:
        InputError: one source has more flows than a chunk of random numbers.
    """

    def __init__(self, spec: NetworkSpec, seed: int, traces: Traces | None = None) -> None:
        self._spec = spec
        self._supplies = Supplies(seed)
        self._memory = laid_out(spec, self._supplies, traces or {})
        self._pmus = [Pmu(source, seed) for source in spec.sources]
        self._endings = Endings(spec.flows)
        self._flows_of = np.bincount(
            np.array([flow.source for flow in spec.flows], dtype=np.int64),
            minlength=len(spec.sources),
        )
        self.lookahead_ns = spec.lookahead_ns
        self._now_ns = -1
        self._rows: list[NDArray[np.int64]] = []
        self._sent = 0
        self._start_cross_flows()

    def send(
        self,
        measured_ns: int,
        sources: NDArray[np.int64],
        sequence: int,
        payloads: NDArray[np.uint8] | None = None,
    ) -> None:
        """Take the frames that some sources measured at one instant; it carries no bytes.

        Raises:
            CosimError: the last `run_until` has passed the instant at which a frame may enter.
        """
        check_not_late(measured_ns + self.lookahead_ns, self._now_ns)
        ready = [self._pmus[source].ready_ns(measured_ns) for source in sources]
        items = -1 - len(self._spec.cross_flows) - (sequence * len(self._pmus) + sources)
        self._announce(np.array(ready, dtype=np.int64), items, kernel.FRAME_ORDER)
        self._sent += int(self._flows_of[sources].sum())

    def run_until(self, until_ns: int) -> Outcome:
        """Return what ended after the last call and up to and including `until_ns`.

        Raises:
            CosimError: `until_ns` is before the last call, or packets are not accounted for.
        """
        if until_ns < self._now_ns:
            raise CosimError(f"the network cannot go back from {self._now_ns} to {until_ns} ns")
        self._now_ns = until_ns
        while (stop := self._run()) != kernel.DONE:
            if stop == kernel.NEEDS_DRAWS:
                self._refill()
            elif not kernel.has_room(self._memory.cells, self._memory.layout):
                self._memory.grow()
        outcome = self._endings.outcome(np.concatenate(self._rows), until_ns)
        self._rows.clear()
        self.counts().check(until_ns)
        return outcome

    def counts(self) -> Counts:
        """Return the counts of PMU and cross packets at the instant of the last `run_until`."""
        cross = self._memory.table("cross").sum(axis=0)
        inside = self._memory.layout.capacity - int(self._memory.control[FREE_PACKETS])
        return Counts(
            sent=self._sent + int(cross[SENT]),
            delivered=int(self._endings.counts[DELIVERED] + cross[ARRIVED + DELIVERED]),
            dropped_queue=int(self._endings.counts[QUEUE_FULL] + cross[ARRIVED + QUEUE_FULL]),
            dropped_loss=int(self._endings.counts[LOSS] + cross[ARRIVED + LOSS]),
            in_flight=inside + self._endings.held + self._packets_announced(),
        )

    def links(self) -> list[LinkUse]:
        """Return what each link carried up to the last `run_until`, direction by direction."""
        rows = self._memory.table("ports").tolist()
        return [
            LinkUse(
                origin,
                target,
                self._spec.links[port // 2].rate_bps,
                packets=rows[port][PACKETS],
                bytes=rows[port][BYTES],
                dropped_queue=rows[port][QUEUE_DROPS],
                dropped_loss=rows[port][LOSS_DROPS],
                busy_ns=rows[port][BUSY] - max(0, rows[port][FREE_AT] - self._now_ns),
                max_queue=rows[port][MAX_QUEUE],
            )
            for (origin, target), port in self._spec.ports.items()
        ]

    def close(self) -> None:
        """Do nothing: it holds nothing outside Python."""

    def _start_cross_flows(self) -> None:
        """Announce the first packet of each cross flow."""
        streams = self._memory.table("streams")
        own = self._memory.table("cross")[:, GAP_STREAM]
        items = -1 - np.arange(len(own), dtype=np.int64)
        self._announce(streams[own, FIRST_DRAW], items, base_order=0)
        streams[own, USED] = 1
        # Compiles, where that is still to be done, before the federation waits for an answer.
        self._run()

    def _announce(
        self, times_ns: NDArray[np.int64], items: NDArray[np.int64], base_order: int
    ) -> None:
        while self._memory.control[HEAP_SIZE] + len(items) > self._memory.layout.capacity:
            self._memory.grow()
        kernel.announce(times_ns, items, base_order, self._memory.cells, self._memory.layout)

    def _packets_announced(self) -> int:
        """Return the packets of the frames that have not left their PMU, counted in the heap."""
        items = self._memory.table("heap")[: self._memory.control[HEAP_SIZE], ITEM]
        cross_flows = len(self._spec.cross_flows)
        codes = -1 - cross_flows - items[items < -cross_flows]
        return int(self._flows_of[codes % len(self._pmus)].sum())

    def _run(self) -> int:
        """Run the kernel as far as it comes, and take over its records of ended packets."""
        stop = kernel.run(self._now_ns, self._memory.cells, self._memory.layout)
        count = self._memory.control[ENDED]
        self._rows.append(self._memory.table("ended")[:count].copy())
        self._memory.control[ENDED] = 0
        return stop

    def _refill(self) -> None:
        """Draw another chunk for each stream that has used one up."""
        streams = self._memory.table("streams")
        for number in np.flatnonzero(streams[:, USED] >= DRAWS_CHUNK):
            streams[number, USED] -= DRAWS_CHUNK
            draws = streams[number, FIRST_DRAW:]
            draws[:DRAWS_CHUNK] = draws[DRAWS_CHUNK:]
            draws[DRAWS_CHUNK:] = next(self._supplies.chunks[number])
        self._memory.control[WANTS_DRAWS] = 0
