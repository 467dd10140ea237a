"""What became of one packet, link by link, in facts that every engine can state."""

from dataclasses import dataclass, field

from tieline.network.engine import DELIVERED, LINK_DOWN, LOSS, QUEUE_FULL

ENDINGS = {
    DELIVERED: "delivered",
    QUEUE_FULL: "dropped at a queue",
    LOSS: "lost on a link",
    LINK_DOWN: "lost with a link that was down",
}


@dataclass(frozen=True)
class Draw:
    """A random number that decided something: number `number` (from 1) of the stream `stream`.

    `value` is what the engine made of it, in the unit of the thing decided; None where it is a gap
    that began before the packet came.
    """

    stream: str
    number: int
    value: float | None = None


@dataclass
class Hop:
    """A packet at one link.

    Attributes:
        origin, target: the link's nodes.
        came_ns: when the packet was at `origin`, ready for the link.
        waiting_packets, waiting_bytes: what waited there before it, link-layer bytes included.
        is_busy: whether another packet was in transmission.
        size_bytes: of the packet on the link.
        starts_ns: its first bit; None if it never was sent.
        service_ns, propagation_ns: serialisation and propagation time.
        jitter_ns, jitter: what the link added at random, and the draw.
        reaches_ns: when it reaches `target`, or would if it were not lost.
        lost: the draw by which the link lost it, or None.
        dropped: why it did not get over the link, in words, or None.
        early: the draw of early detection, if one was made.
    """

    origin: str
    target: str
    came_ns: int
    waiting_packets: int
    waiting_bytes: int
    is_busy: bool
    size_bytes: int
    propagation_ns: int
    starts_ns: int | None = None
    service_ns: int | None = None
    jitter_ns: int = 0
    jitter: Draw | None = None
    reaches_ns: int | None = None
    lost: Draw | None = None
    dropped: str | None = None
    early: Draw | None = None

    @property
    def wait_ns(self) -> int | None:
        """How long it waited for the link."""
        return None if self.starts_ns is None else self.starts_ns - self.came_ns


@dataclass
class Fate:
    """What became of one packet.

    Attributes:
        source, destination: names of PMU and controller.
        sequence: the number of its frame.
        measured_ns: when the frame was measured.
        left_ns: when it left the PMU; None if it never did.
        pmu_jitter: the draw that lengthened the PMU's processing, if any.
        hops: in order of time; over a connection, of every transmission of its segment.
        transport: how it travelled.
        outcome: `DELIVERED` ...; None while it is under way.
        ended_ns: when the controller could use it, or when it was dropped.
        processing_ns: the controller's share of that.
        controller_jitter: the draw that lengthened it, if any.
        draws: what an engine without links drew for it.
        remark: what else there is to say.
    """

    source: str
    destination: str
    sequence: int
    measured_ns: int
    left_ns: int | None = None
    pmu_jitter: Draw | None = None
    hops: list[Hop] = field(default_factory=list)
    transport: str = "unicast"
    outcome: int | None = None
    ended_ns: int | None = None
    processing_ns: int = 0
    controller_jitter: Draw | None = None
    draws: list[Draw] = field(default_factory=list)
    remark: str | None = None
