"""The packet engine, writing down link by link what becomes of one packet.

It computes what `PacketEngine` computes: while the packet is on its way the events of the instants
that concern it are processed one by one, and the memory is read before and after each.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tieline.compiled import compiled
from tieline.errors import InputError
from tieline.network.engine import DELIVERED, LINK_DOWN, Outcome
from tieline.network.fate import Draw, Fate, Hop
from tieline.network.packet import kernel, tcp
from tieline.network.packet.engine import PacketEngine
from tieline.network.packet.events import pop_event
from tieline.network.packet.kinds import ARRIVAL, FRAME, KINDS, items_of
from tieline.network.packet.looking import (
    Port,
    hop_of,
    note_refused,
    note_sent,
    port_now,
)
from tieline.network.packet.memory import (
    CONNECTION,
    DATAGRAM,
    END_FLOW,
    END_FLOWS,
    END_HOW,
    END_SEQUENCE,
    END_TIME,
    ENDED,
    FIRST_FLOW,
    HAS_TAP,
    HEAP_SIZE,
    HOP_PORT,
    LOST,
    NONE,
    PROCESSING_STREAM,
    RATE,
    SPECIAL,
    TAP_FLOW,
    TAP_PORT,
    TAP_SEQUENCE,
    TAP_TIME,
    TAPPED,
    TIME,
    WANTS_DRAWS,
    Cells,
    Layout,
)
from tieline.network.packet.packets import IP_HEADER, enter_datagram
from tieline.network.packet.routes import Routes
from tieline.network.packet.sight import Sight
from tieline.network.spec import NetworkSpec, serialisation_ns


@dataclass
class _Copy:
    """The packet on a link, or waiting for one; over a connection there may be several."""

    slot: int
    row: int
    hop: Hop
    waits: bool


class TracingEngine(PacketEngine):
    """A `PacketEngine` that watches one packet.

    Args:
        spec: the network, without taps.
        seed: the experiment's.
        flow: number of the PMU flow.
        sequence: number of the frame.

    Attributes:
        fate: what has become of the packet so far.

    Raises:
        InputError: as `PacketEngine`, or the spec has taps.
    """

    def __init__(self, spec: NetworkSpec, seed: int, flow: int, sequence: int) -> None:
        if spec.taps:
            raise InputError("a packet is followed on a network without taps")
        self._flow, self._sequence = flow, sequence
        ends = spec.flows[flow]
        source, destination = spec.sources[ends.source], spec.destinations[ends.destination]
        self.fate = Fate(source.name, destination.name, sequence, -1, transport=spec.transport)
        self._is_watching = False
        self._copies: list[_Copy] = []
        self._taken_at_end = self._event_ns = 0
        # With taps there is room for what is sent on links; it is noted from the packet's entry on.
        super().__init__(replace(spec, taps=tuple(range(len(spec.links)))), seed)
        self._memory.table("ports")[:, SPECIAL] &= ~HAS_TAP
        self._source = ends.source
        self._destination = ends.destination
        self._code = KINDS * (sequence * len(spec.sources) + ends.source) + FRAME
        routes = Routes(spec)
        self._tree = routes.sources[ends.source][2]
        carrier = flow if self._tree == NONE else self._tree
        self._sight = Sight(self._memory, flow, carrier, sequence)
        self._connection = int(self._memory.table("flows")[flow, CONNECTION])
        if self._connection != NONE:
            row = self._memory.table("connections")[self._connection]
            self._sight.carrier, self._sight.segment = int(row[tcp.DATA_FLOW]), NONE

    @property
    def is_over(self) -> bool:
        """Whether the packet has ended."""
        return self.fate.outcome is not None

    def send(
        self,
        measured_ns: int,
        sources: NDArray[np.int64],
        sequence: int,
        payloads: NDArray[np.uint8] | None = None,
    ) -> None:
        """Take the frames of one instant, as `PacketEngine`; begin to watch at the right one."""
        super().send(measured_ns, sources, sequence, payloads)
        if sequence == self._sequence and self._source in sources:
            self.fate.measured_ns = measured_ns
            drawn = self._pmus.last_draw(self._source)
            if drawn is not None:
                stream, number, draw_ns = drawn
                self.fate.pmu_jitter = Draw(stream, number, float(draw_ns))
            self._memory.table("ports")[:, SPECIAL] |= HAS_TAP
            self._is_watching = True

    def run_until(self, until_ns: int) -> Outcome:
        """Return what ended, as `PacketEngine`."""
        outcome = super().run_until(until_ns)
        self.tapped()
        return outcome

    def _run(self, until_ns: int) -> int:
        if not self._is_watching or self.is_over:
            return super()._run(until_ns)
        while self._memory.control[HEAP_SIZE] and self._memory.events()[0, TIME] <= until_ns:
            concerns_ns = self._concerns_ns()
            if self._memory.events()[0, TIME] < concerns_ns:
                stop = super()._run(min(until_ns, concerns_ns - 1))
                if stop != kernel.DONE:
                    return stop
                continue
            if self._memory.control[WANTS_DRAWS]:
                return kernel.NEEDS_DRAWS
            if not kernel.events_with_room(self._memory.cells, self._memory.layout):
                return kernel.NEEDS_ROOM
            if self._step():
                return super()._run(until_ns)
        return kernel.DONE

    def _concerns_ns(self) -> int:
        """Return the next instant that can concern the packet; what waits concerns every one."""
        events = self._memory.events()
        if self._connection != NONE and self.fate.left_ns is not None:
            return int(events[0, TIME])
        if any(copy.waits for copy in self._copies):
            return int(events[0, TIME])
        items = [KINDS * copy.slot + ARRIVAL for copy in self._copies] + [self._code]
        times = events[np.isin(items_of(events), items), TIME]
        return int(times.min()) if len(times) else 1 << 62

    def _step(self) -> bool:
        """Process the first event, see what it does to the packet; return whether it has ended."""
        first = self._memory.events()[:1]
        now, item = int(first[0, TIME]), int(items_of(first)[0])
        self._event_ns = now
        stream = self._controller_stream()
        if stream != NONE:
            self._taken_at_end = self._supplies.taken(stream, self._memory.table("streams"))
        moving = next((c for c in self._copies if item == KINDS * c.slot + ARRIVAL), None)
        if item == self._code:
            self._enter(now)
        elif moving is not None:
            self._arrive(now, moving)
        else:
            self._else(now)
        if self._memory.control[ENDED] or self._memory.control[TAPPED]:
            self._collect()
        return self.is_over

    def _enter(self, now: int) -> None:
        """The frame leaves its PMU."""
        self.fate.left_ns = now
        memory = self._memory
        if self._connection != NONE:
            before = int(memory.table("connections")[self._connection, tcp.AVAILABLE])
            self._sight.segment = before
            self._else(now)
            after = int(memory.table("connections")[self._connection, tcp.AVAILABLE])
            if after == before:
                self._sight.segment = NONE
                self.fate.remark = "the connection's send buffer was full"
            return
        if self._tree != NONE:
            self._offer(now, self._sight.row(self._sight.first_row()), None)
            return
        _pop_first(memory.cells, memory.layout)
        source = memory.table("sources")[self._source]
        for flow in range(int(source[FIRST_FLOW]), int(source[END_FLOWS])):
            size = int(memory.table("flows")[flow, DATAGRAM])
            arguments = (now, flow, self._sequence, size)
            if flow == self._flow:
                self._offer(now, self._sight.row(self._sight.first_row()), None, arguments)
            else:
                enter_datagram(*arguments, memory.cells, memory.layout)

    def _arrive(self, now: int, copy: _Copy) -> None:
        """The packet reaches the end of a link."""
        self._copies.remove(copy)
        is_lost = self._memory.table("packets")[copy.slot, LOST] != 0
        self._offer(now, None if is_lost else self._sight.row(copy.row + 1), copy.slot)

    def _else(self, now: int) -> None:
        """Process an event of another packet, of a port, or of the connection."""
        waiting = [copy for copy in self._copies if copy.waits]
        ports = {copy.row: self._port(copy.row, now) for copy in waiting}
        first = self._sight.first_row() if self._connection != NONE else NONE
        before = self._port(first, now) if first != NONE else None
        known = {copy.slot for copy in self._copies}
        kernel.step(self._memory.cells, self._memory.layout)
        for copy in waiting:
            if self._sight.starts_ns(copy.row) is not None:
                self._note_start(copy, ports[copy.row])
        if before is not None:
            self._take_new_segments(now, first, before, known)

    def _take_new_segments(self, now: int, row: int, port: Port, known: set[int]) -> None:
        """Take up transmissions of the segment that an event has begun."""
        for slot in self._sight.slots(row):
            if slot not in known:
                hop = hop_of(now, row, self._sight.ip_bytes(slot), port, self._memory, self._spec)
                self._ahead(hop, now, row)
                self._follow(slot, row, hop, port)

    def _ahead(self, hop: Hop, now: int, row: int) -> None:
        """Count what the same event has put before a segment."""
        port = int(self._memory.plans_of(row)[HOP_PORT])
        for tap in self._sight.new_taps():
            if tap[TAP_FLOW] == self._sight.carrier and tap[TAP_SEQUENCE] == self._sight.segment:
                return
            if tap[TAP_PORT] == port:
                hop.waiting_packets += int(tap[TAP_TIME] > now)
                hop.waiting_bytes += hop.size_bytes * int(tap[TAP_TIME] > now)
                hop.is_busy = True

    def _offer(
        self,
        now: int,
        row: int | None,
        slot: int | None,
        entering: tuple[int, int, int, int] | None = None,
    ) -> None:
        """Process the event that brings the packet to the link of a row of `hops`, or to its end.

        Args:
            now: its instant.
            row: the row; None if the packet ends.
            slot: its place so far, or None if it is new.
            entering: arguments of `enter_datagram`, if that is the event.
        """
        memory = self._memory
        port = None if row is None else self._port(row, now)
        ip_bytes = 0
        if slot is not None:
            ip_bytes = self._sight.ip_bytes(slot)
        elif row is not None:
            ip_bytes = int(memory.table("flows")[self._sight.carrier, DATAGRAM]) + IP_HEADER
        hop = None
        if row is not None and port is not None:
            hop = hop_of(now, row, ip_bytes, port, memory, self._spec)
        if entering is None:
            kernel.step(memory.cells, memory.layout)
        else:
            enter_datagram(*entering, memory.cells, memory.layout)
        if row is None or port is None or hop is None:
            return
        slots = self._sight.slots(row)
        if slots:
            self._follow(slots[0], row, hop, port)
        else:
            self.fate.hops.append(hop)
            note_refused(hop, row, port, memory, self._supplies)

    def _follow(self, slot: int, row: int, hop: Hop, port: Port) -> None:
        """Keep an eye on the packet in a slot, which has been offered to a link."""
        self.fate.hops.append(hop)
        copy = _Copy(slot, row, hop, waits=True)
        self._copies.append(copy)
        if self._sight.starts_ns(row) is not None:
            self._note_start(copy, port)

    def _note_start(self, copy: _Copy, port: Port) -> None:
        """A packet goes on its link, or knows when it will."""
        starts_ns, reaches_ns = self._sight.starts_ns(copy.row), self._sight.reaches_ns(copy.slot)
        assert starts_ns is not None
        copy.waits = False
        is_lost = bool(self._memory.table("packets")[copy.slot, LOST])
        note_sent(copy.hop, starts_ns, reaches_ns, is_lost, port, self._supplies)

    def _change(self) -> None:
        """Do the next change of the network, and see what it does to the packet."""
        at_ns = self._changes.next_ns
        super()._change()
        inside = set(self._memory.inside().tolist())
        for copy in list(self._copies):
            if copy.slot not in inside:
                self._copies.remove(copy)
                copy.hop.dropped = f"the link went down at {at_ns} ns"
            elif not copy.waits:
                self._move(copy)

    def _move(self, copy: _Copy) -> None:
        """Follow a packet whose link has got another rate before its transmission began."""
        reaches_ns = self._sight.reaches_ns(copy.slot)
        if reaches_ns == copy.hop.reaches_ns:
            return
        port = int(self._memory.plans_of(copy.row)[HOP_PORT])
        rate_bps = int(self._memory.table("details")[port, RATE])
        hop = copy.hop
        hop.reaches_ns = reaches_ns
        hop.service_ns = serialisation_ns(hop.size_bytes, rate_bps)
        hop.starts_ns = reaches_ns - hop.service_ns - hop.propagation_ns - hop.jitter_ns

    def _collect(self) -> None:
        memory = self._memory
        ended = memory.table("ended")[: memory.control[ENDED]]
        own = np.flatnonzero(
            (ended[:, END_FLOW] == self._flow) & (ended[:, END_SEQUENCE] == self._sequence)
        )
        if len(own) and not self.is_over:
            self._note_end(ended, int(own[0]))
        super()._collect()

    def _note_end(self, ended: Cells, place: int) -> None:
        fate = self.fate
        fate.outcome, fate.ended_ns = int(ended[place, END_HOW]), int(ended[place, END_TIME])
        if fate.outcome != DELIVERED:
            if fate.outcome == LINK_DOWN and fate.hops and fate.hops[-1].dropped is None:
                fate.hops[-1].dropped = f"the link went down at {fate.ended_ns} ns"
            return
        fate.processing_ns = fate.ended_ns - self._event_ns
        stream = self._controller_stream()
        if stream != NONE:
            place_of = self._spec.destinations[self._destination]
            before = sum(self._is_to_controller(row) for row in ended[:place])
            jitter_ns = fate.processing_ns - place_of.processing_ns
            number = self._taken_at_end + before + 1
            fate.controller_jitter = Draw(self._supplies.names[stream], number, float(jitter_ns))

    def _is_to_controller(self, row: Cells) -> bool:
        """Return whether a record is of a packet delivered to the same controller."""
        flow = self._spec.flows[int(row[END_FLOW])]
        return bool(row[END_HOW] == DELIVERED) and flow.destination == self._destination

    def _controller_stream(self) -> int:
        return int(self._memory.table("destinations")[self._destination, PROCESSING_STREAM])

    def _port(self, row: int, now: int) -> Port:
        number = int(self._memory.plans_of(row)[HOP_PORT])
        return port_now(number, now, self._memory, self._supplies)


@compiled
def _pop_first(cells: Cells, at: Layout) -> None:
    pop_event(cells, at)
