"""ns-3 as an engine: the network built from its objects, fed and read once a step."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tieline.errors import CosimError
from tieline.network.draws import CHUNK
from tieline.network.engine import (
    DELIVERED,
    LINK_COUNTER,
    LINK_DOWN,
    LOSS,
    QUEUE_FULL,
    Counts,
    LinkUse,
    Outcome,
    StreamUse,
    check_not_late,
)
from tieline.network.ns3.build import built
from tieline.network.packet.draws import jitters
from tieline.network.packet.endings import Endings
from tieline.network.packet.memory import END_FLOW, END_HOW, END_TIME
from tieline.network.packet.pmu import Pmus
from tieline.network.packet.supplies import JITTER
from tieline.network.spec import FRAME_BYTES, NetworkSpec


class Ns3Engine:
    """Carries frames as UDP over IPv4 through ns-3's own nodes, devices, queues and routes.

    It takes the very bytes of the frames, and compares them where they arrive. With the same seed
    every packet has the fate and the instants that the packet engine gives it: both draw the same
    random numbers for losses, cross traffic and processing, and order simultaneous events alike.
    The link layer's bytes beyond PPP's two trail each packet on its link, as a frame check does.

    Not modelled: what `limits.py` refuses, and what the packet engine leaves out. A process can
    hold one such engine at a time.

    Args:
        spec: the network.
        seed: the experiment's seed; each random thing has its own stream of it.

    Raises:
        InputError: ns-3 is not installed, or cannot carry the network.
        CosimError: another engine of this kind is open.
    """

    def __init__(self, spec: NetworkSpec, seed: int) -> None:
        self._spec = spec
        self._pmus = Pmus(spec.sources, seed)
        self._processing = _Processing(spec, seed)
        self._endings = Endings(spec)
        self._flows_of = self._endings.flows_of_sources()
        self.lookahead_ns = spec.lookahead_ns
        self._now_ns = -1
        self._sent = 0
        self._max_queue = np.zeros(len(spec.ports), dtype=np.int64)
        self._network, self._filled, self._streams = built(spec, seed)

    def send(
        self,
        measured_ns: int,
        sources: NDArray[np.int64],
        sequence: int,
        payloads: NDArray[np.uint8] | None = None,
    ) -> None:
        """Take the frames that some sources measured at one instant.

        Raises:
            CosimError: the last `run_until` has passed the instant at which a frame may enter.
        """
        check_not_late(measured_ns + self.lookahead_ns, self._now_ns)
        if payloads is None:
            payloads = np.zeros((len(sources), FRAME_BYTES), np.uint8)
        ready = self._pmus.ready_ns(measured_ns, sources).tolist()
        frames = np.ascontiguousarray(payloads)
        for source, ready_ns, payload in zip(sources.tolist(), ready, frames, strict=True):
            self._network.Announce(ready_ns, source, sequence, payload, len(payload))
        self._sent += int(self._flows_of[sources].sum())

    def run_until(self, until_ns: int) -> Outcome:
        """Return what ended after the last call and up to and including `until_ns`.

        Raises:
            CosimError: `until_ns` is before the last call, packets are not accounted for, a frame
                arrived with other bytes, or ns-3 dropped a packet where no queue or link did.
        """
        if until_ns < self._now_ns:
            raise CosimError(f"the network cannot go back from {self._now_ns} to {until_ns} ns")
        self._now_ns = until_ns
        while not self._network.RunUntil(until_ns):
            self._refill()
        fault = str(self._network.Fault())
        if fault:
            raise CosimError(f"ns-3 at {until_ns} ns: {fault}")
        rows = _table(self._network.CollectEnded, self._network.EndedCount(), 4)
        self._processing.add_to(rows)
        self._endings.take(rows)
        outcome = self._endings.outcome(until_ns)
        self.counts().check(until_ns)
        return outcome

    def counts(self) -> Counts:
        """Return the counts of PMU and cross packets at the instant of the last `run_until`."""
        [cross] = _table(self._network.CopyCross, 1, 4)
        ended = self._endings.counts[:LINK_DOWN] + cross[1:]
        inside = self._network.PacketsInside() + self._network.PacketsAnnounced()
        return Counts(
            sent=self._sent + int(cross[0]),
            delivered=int(ended[DELIVERED]),
            dropped_queue=int(ended[QUEUE_FULL]),
            dropped_loss=int(ended[LOSS]),
            in_flight=inside + self._endings.held,
        )

    def links(self) -> list[LinkUse]:
        """Return what each link carried up to the last `run_until`, direction by direction."""
        rows = self._port_counters()
        most = np.maximum(self._max_queue, rows["max_queue"])
        return [
            LinkUse(
                origin,
                target,
                self._spec.links[port // 2].rate_bps,
                packets=int(rows["packets"][port]),
                bytes=int(rows["bytes"][port]),
                dropped_queue=int(rows["dropped_queue"][port]),
                dropped_loss=int(rows["dropped_loss"][port]),
                busy_ns=int(rows["busy_ns"][port]),
                max_queue=int(most[port]),
            )
            for (origin, target), port in self._spec.ports.items()
        ]

    def link_counters(self) -> NDArray[np.void]:
        """Return the counters of each link's directions, and begin a new span for `max_queue`."""
        counters = self._port_counters()
        np.maximum(self._max_queue, counters["max_queue"], out=self._max_queue)
        self._network.BeginSpan()
        return counters

    def streams(self) -> list[StreamUse]:
        """Return every random stream; ns-3 counts only those of PMUs' jitter."""
        others = [StreamUse(name, gives, None) for name, gives in self._streams]
        return self._pmus.uses() + others + self._processing.uses()

    def close(self) -> None:
        """Let go of all that ns-3 holds; again does nothing."""
        self._network = None

    def _port_counters(self) -> NDArray[np.void]:
        names = LINK_COUNTER.names or ()
        table = _table(self._network.CopyPorts, len(self._spec.ports), len(names))
        counters = np.empty(len(table), LINK_COUNTER)
        for column, name in enumerate(names):
            counters[name] = table[:, column]
        return counters

    def _refill(self) -> None:
        for supply, chunks in self._filled.items():
            if self._network.IsLow(supply):
                self._network.Fill(supply, next(chunks), CHUNK)


def _table(copy: Callable[[NDArray[np.int64]], None], rows: int, columns: int) -> NDArray[np.int64]:
    """Return what a C++ method writes row by row."""
    # One row more than is written, since cppyy takes no empty array.
    table = np.empty((rows + 1, columns), dtype=np.int64)
    copy(table.reshape(-1))
    return table[:rows]


class _Processing:
    """The time that controllers take for each packet, in the order in which packets reach them."""

    def __init__(self, spec: NetworkSpec, seed: int) -> None:
        self._destination_of = np.array([flow.destination for flow in spec.flows], dtype=np.int64)
        self._processing_ns = np.array(
            [place.processing_ns for place in spec.destinations], dtype=np.int64
        )
        self._names = {
            number: f"processing of {place.name}"
            for number, place in enumerate(spec.destinations)
            if place.jitter is not None
        }
        self._taken = dict.fromkeys(self._names, 0)
        self._chunks = {
            number: jitters(seed, self._names[number], place.jitter)
            for number, place in enumerate(spec.destinations)
            if place.jitter is not None
        }
        self._drawn = {number: np.empty(0, np.int64) for number in self._chunks}

    def add_to(self, rows: NDArray[np.int64]) -> None:
        """Turn the times of arrivals into those from which their controllers can use them."""
        places = np.flatnonzero(rows[:, END_HOW] == DELIVERED)
        destinations = self._destination_of[rows[places, END_FLOW]]
        rows[places, END_TIME] += self._processing_ns[destinations]
        for number in np.unique(destinations).tolist():
            if number in self._chunks:
                own = places[destinations == number]
                rows[own, END_TIME] += self._take(number, len(own))

    def _take(self, number: int, count: int) -> NDArray[np.int64]:
        while len(self._drawn[number]) < count:
            self._drawn[number] = np.append(self._drawn[number], next(self._chunks[number]))
        self._taken[number] += count
        taken, self._drawn[number] = np.split(self._drawn[number], [count])
        return taken

    def uses(self) -> list[StreamUse]:
        """Return the stream of each controller's jitter, with the numbers used so far."""
        return [
            StreamUse(name, JITTER, self._taken[number]) for number, name in self._names.items()
        ]
