"""What a packet network is, in facts that every engine understands: nodes, links, flows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal

from tieline.network.jitter import Jitter
from tieline.units import NS_PER_S

FRAME_BYTES = 34
"""An IEEE C37.118.2 data frame with one float phasor, FREQ and DFREQ as floats."""

HEADER_BYTES = 8 + 20
"""UDP and IPv4 headers, which every packet carries besides its payload and the link's own."""

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
    """A full-duplex point-to-point link; each direction has this rate and a queue of its own.

    Attributes:
        a, b: the nodes at its ends.
        rate_bps: bits a second, link-layer bytes included.
        propagation_ns: from the last bit sent to the last bit received.
        queue_packets: packets that may wait besides the one in transmission; more are dropped.
        loss_probability: of each packet, on its own, after it has used the link.
        jitter: added to the propagation of each packet, or none.
        overhead_bytes: what the link layer adds to each packet.
    """

    a: str
    b: str
    rate_bps: int
    propagation_ns: int
    queue_packets: int
    loss_probability: float = 0.0
    jitter: Jitter | None = None
    overhead_bytes: int = 0


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


@dataclass(frozen=True)
class Flow:
    """One unicast UDP flow from source to destination (numbers), along a fixed route."""

    source: int
    destination: int
    route: Route


@dataclass(frozen=True)
class CrossFlow:
    """Traffic that only fills queues.

    Attributes:
        name: names its random stream.
        kind: `cbr` (equal gaps, from a random phase) or `poisson` (exponential gaps).
        rate_bps: mean rate of payload and UDP and IPv4 headers, without the link layer's bytes.
        payload_bytes: the same for every packet.
        route: the nodes that it passes.
    """

    name: str
    kind: Literal["cbr", "poisson"]
    rate_bps: float
    payload_bytes: int
    route: Route

    @property
    def gap_ns(self) -> float:
        """Mean time between two packets."""
        return (self.payload_bytes + HEADER_BYTES) * 8 * NS_PER_S / self.rate_bps


@dataclass(frozen=True)
class NetworkSpec:
    """A whole network. The flows stand in the order (source, destination), one for each pair."""

    nodes: tuple[Node, ...]
    links: tuple[Link, ...]
    sources: tuple[Source, ...]
    destinations: tuple[Destination, ...]
    flows: tuple[Flow, ...]
    cross_flows: tuple[CrossFlow, ...] = ()

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
    bits = 8 * packet_bytes(link, payload_bytes)
    return (2 * bits * NS_PER_S + link.rate_bps) // (2 * link.rate_bps)


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
