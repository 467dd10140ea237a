"""What a packet network is, in facts that every engine understands: nodes, links, flows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal

from tieline.network.jitter import Jitter
from tieline.network.losses import Loss
from tieline.network.queues import Queue
from tieline.network.traffic import HEADER_BYTES, Traffic
from tieline.units import NS_PER_S

FRAME_BYTES = 34
"""An IEEE C37.118.2 data frame with one float phasor, FREQ and DFREQ as floats."""

ETHERNET_MTU = 1500
"""Largest IP packet of a link that says nothing else, bytes."""

Transport = Literal["unicast", "multicast", "tcp"]

Route = tuple[str, ...]
"""The nodes that a packet passes, first and last included; one node is no link at all."""


@dataclass(frozen=True)
class Node:
    """A substation with its router, and the buses whose devices are wired to it.

    `x` and `y` are for drawing alone.
    """

    name: str
    buses: tuple[int, ...] = ()
    x: float | None = None
    y: float | None = None


@dataclass(frozen=True)
class Link:
    """A point-to-point link; each direction has this rate and a queue of its own.

    Attributes:
        a, b: the nodes at its ends.
        rate_bps: bits a second, link-layer bytes included.
        propagation_ns: from the last bit sent to the last bit received.
        queue: what becomes of packets that must wait.
        loss: of packets that have used the link, or none; each direction on its own.
        jitter: added to the propagation of each packet, or none.
        overhead_bytes: what the link layer adds to each packet.
        is_half_duplex: whether only one end sends at a time; the turn goes to the other end after
            each packet, if anything waits there.
        mtu_bytes: the largest IP packet that it takes.
        cost: what routing by cost counts.
    """

    a: str
    b: str
    rate_bps: int
    propagation_ns: int
    queue: Queue
    loss: Loss | None = None
    jitter: Jitter | None = None
    overhead_bytes: int = 0
    is_half_duplex: bool = False
    mtu_bytes: int = ETHERNET_MTU
    cost: float = 1.0


@dataclass(frozen=True)
class Source:
    """A PMU: a frame leaves `processing_ns` (and its jitter) after the instant of measurement."""

    name: str
    bus: int
    node: str
    processing_ns: int = 0
    jitter: Jitter | None = None


@dataclass(frozen=True)
class Destination:
    """A controller: it can use a frame `processing_ns` (and its jitter) after the packet came."""

    name: str
    unit: str
    bus: int
    node: str
    processing_ns: int = 0
    jitter: Jitter | None = None


@dataclass(frozen=True, slots=True)
class Flow:
    """One unicast UDP flow from source to destination (numbers), along a fixed route."""

    source: int
    destination: int
    route: Route


@dataclass(frozen=True)
class CrossFlow:
    """Traffic that only fills queues.

    Attributes:
        name: names its random streams.
        traffic: when its datagrams leave, and how large they are.
        route: the nodes that it passes.
        back: the way of replies and acknowledgements; the same backwards, if not given.
        dscp: its mark.
        start_ns, stop_ns: when it begins and ends; it does not end without `stop_ns`.
    """

    name: str
    traffic: Traffic
    route: Route
    back: Route = ()
    dscp: int = 0
    start_ns: int = 0
    stop_ns: int | None = None

    @property
    def way_back(self) -> Route:
        """Return the nodes that replies pass."""
        return self.back or self.route[::-1]


@dataclass(frozen=True)
class LinkCut:
    """A link goes down, with all that is on it or waits for it."""

    at_ns: int
    link: int


@dataclass(frozen=True)
class LinkRepair:
    """A link that was down works again."""

    at_ns: int
    link: int


@dataclass(frozen=True)
class RateChange:
    """A link gets another rate; a packet in transmission keeps the old one."""

    at_ns: int
    link: int
    rate_bps: int


@dataclass(frozen=True)
class LossChange:
    """A link loses packets at random besides its own losses, until the next such change.

    Attributes:
        probability: of each packet, 0 to end it.
    """

    at_ns: int
    link: int
    probability: float


@dataclass(frozen=True)
class Reroute:
    """Some flows take other routes from now on; packets under way keep theirs.

    Attributes:
        routes: by number: PMU flows, then cross flows.
        ways_back: of cross flows, by the same number.
    """

    at_ns: int
    routes: Mapping[int, Route]
    ways_back: Mapping[int, Route]


Change = LinkCut | LinkRepair | RateChange | LossChange | Reroute


@dataclass(frozen=True)
class NetworkSpec:
    """A whole network. The flows stand in the order (source, destination), one for each pair.

    Attributes:
        transport: of PMU frames: a UDP packet to each controller, one packet along a tree to all of
            them, or a connection to each (`network/packet/tcp.py`).
        dscp: the mark of PMU frames.
        changes: what happens to the network, in the order of time; before all else of an instant.
        taps: links (numbers) that are listened to.
    """

    nodes: tuple[Node, ...]
    links: tuple[Link, ...]
    sources: tuple[Source, ...]
    destinations: tuple[Destination, ...]
    flows: tuple[Flow, ...]
    cross_flows: tuple[CrossFlow, ...] = ()
    transport: Transport = "unicast"
    dscp: int = 0
    changes: tuple[Change, ...] = ()
    taps: tuple[int, ...] = ()

    @cached_property
    def ports(self) -> dict[tuple[str, str], int]:
        """The port number of each (from, to): 2l for link l from a to b, 2l + 1 back."""
        numbers = {}
        for index, link in enumerate(self.links):
            numbers[link.a, link.b] = 2 * index
            numbers[link.b, link.a] = 2 * index + 1
        return numbers

    @cached_property
    def lookahead_ns(self) -> int:
        """The least time from a measurement until its frame leaves the PMU, of all sources."""
        leaves = (source.processing_ns + _least(source.jitter) for source in self.sources)
        return min(leaves, default=0)

    @cached_property
    def mean_unloaded_delay_ns(self) -> float:
        """The unloaded combined delay averaged over the flows, of which there must be one."""
        return sum(unloaded_delay_ns(self, flow) for flow in self.flows) / len(self.flows)

    def hops(self, route: Route) -> list[tuple[int, Link]]:
        """Return the port and the link of each hop of a route."""
        numbers = [self.ports[pair] for pair in pairwise(route)]
        return [(number, self.links[number // 2]) for number in numbers]


def direct_spec(
    sources: Sequence[Mapping[str, Any]], destinations: Sequence[Mapping[str, Any]], delay_ns: int
) -> NetworkSpec:
    """Return a network of one place where every frame takes `delay_ns`, for engines without links.

    Args:
        sources: `name` and `bus` of each PMU.
        destinations: `name`, `unit` and `bus` of each controller.
        delay_ns: processing time at each PMU.
    """
    place = "everywhere"
    pmus = tuple(Source(site["name"], site["bus"], place, delay_ns) for site in sources)
    controllers = tuple(
        Destination(site["name"], site["unit"], site["bus"], place) for site in destinations
    )
    flows = tuple(Flow(i, j, (place,)) for i in range(len(pmus)) for j in range(len(controllers)))
    return NetworkSpec((Node(place),), (), pmus, controllers, flows)


def packet_bytes(link: Link, payload_bytes: int) -> int:
    """Return the bytes that a packet occupies on a link."""
    return payload_bytes + HEADER_BYTES + link.overhead_bytes


def service_ns(link: Link, payload_bytes: int) -> int:
    """Return the serialisation time of a packet on a link, rounded to the nearest nanosecond."""
    return serialisation_ns(packet_bytes(link, payload_bytes), link.rate_bps)


def serialisation_ns(size: int, rate_bps: int) -> int:
    """Return how long some bytes take at a rate, rounded to the nearest nanosecond."""
    return (16 * size * NS_PER_S + rate_bps) // (2 * rate_bps)


def unloaded_delay_ns(spec: NetworkSpec, flow: Flow) -> float:
    """Return the mean combined delay of a flow's packets if no queue ever held them.

    It runs from the measurement to the moment the controller can use the frame: processing at both
    ends, serialisation and propagation on every link, and the mean of every jitter on the way.
    """
    stages = (spec.sources[flow.source], spec.destinations[flow.destination])
    delay = sum(stage.processing_ns + _mean(stage.jitter) for stage in stages)
    for _, link in spec.hops(flow.route):
        delay += service_ns(link, FRAME_BYTES) + link.propagation_ns + _mean(link.jitter)
    return delay


def least_delay_ns(spec: NetworkSpec, flow: Flow) -> int:
    """Return the smallest combined delay that a flow's packets can have."""
    stages = (spec.sources[flow.source], spec.destinations[flow.destination])
    delay = sum(stage.processing_ns + _least(stage.jitter) for stage in stages)
    for _, link in spec.hops(flow.route):
        delay += service_ns(link, FRAME_BYTES) + link.propagation_ns + _least(link.jitter)
    return delay


def _mean(jitter: Jitter | None) -> float:
    return 0.0 if jitter is None else jitter.mean_ns


def _least(jitter: Jitter | None) -> int:
    return 0 if jitter is None else jitter.least_ns
