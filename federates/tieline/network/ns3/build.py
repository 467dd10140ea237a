"""Builds a `NetworkSpec` from ns-3's objects."""

from collections.abc import Callable, Sequence
from typing import Any

from tieline.errors import CosimError, InputError
from tieline.network.ns3.addresses import addressed
from tieline.network.ns3.library import model
from tieline.network.ns3.limits import check_carried
from tieline.network.packet.build import Supplies, Traces
from tieline.network.packet.draws import Chunks, gaps, trace_gaps
from tieline.network.packet.memory import DRAWS_CHUNK, NO_STREAM
from tieline.network.spec import FRAME_BYTES, Link, NetworkSpec, packet_bytes, service_ns

_NO_SUPPLY = -1
_CROSS = -1


def built(spec: NetworkSpec, supplies: Supplies, traces: Traces) -> tuple[Any, dict[int, Chunks]]:
    """Return the network, its cross traffic planned, and what fills each of its supplies.

    Args:
        spec: the network.
        supplies: where the streams of losses and cross traffic are opened.
        traces: instants (ns, ascending) at which a cross flow sends, by the flow's name.

    Raises:
        InputError: ns-3 is not installed, cannot carry the network, or rounds the serialisation
            time of a packet otherwise than the specification does.
        CosimError: another network is open.
    """
    check_carried(spec)
    rates_bps = [
        rate_for_ns3(link, sizes, model().Network.ServiceNs)
        for link, sizes in zip(spec.links, _payloads(spec), strict=True)
    ]
    if model().Network.IsOpen():
        raise CosimError("ns-3 simulates one network at a time: close the other engine first")
    builder = _Builder(spec, supplies)
    builder.add_links(rates_bps)
    builder.add_flows(traces)
    return builder.network, builder.filled


class _Builder:
    def __init__(self, spec: NetworkSpec, supplies: Supplies) -> None:
        self.network = model().Network(len(spec.nodes), len(spec.flows))
        self.filled: dict[int, Chunks] = {}
        self._spec = spec
        self._supplies = supplies
        self._numbers = {node.name: number for number, node in enumerate(spec.nodes)}

    def add_links(self, rates_bps: Sequence[int]) -> None:
        """Add every link, whose ports get the numbers of the specification."""
        for link, rate_bps in zip(self._spec.links, rates_bps, strict=True):
            self.network.AddLink(
                self._numbers[link.a],
                self._numbers[link.b],
                rate_bps,
                link.propagation_ns,
                link.queue_packets,
                link.overhead_bytes,
                self._losses(f"{link.a}->{link.b}", link.loss_probability),
                self._losses(f"{link.b}->{link.a}", link.loss_probability),
            )

    def add_flows(self, traces: Traces) -> None:
        """Add addresses, routes and sockets, and start the cross traffic."""
        spec, network = self._spec, self.network
        addresses, of_flow = addressed(spec)
        for number, address in enumerate(addresses):
            network.AddAddress(self._numbers[address.node], number)
            for port in address.next_port.values():
                network.AddRoute(number, port)
        for source in spec.sources:
            network.AddSource(self._numbers[source.node])
        for number, destination in enumerate(spec.destinations):
            network.AddDestination(self._numbers[destination.node], number)
        for flow, number in zip(spec.flows, of_flow, strict=False):
            network.AddFlow(flow.source, flow.destination, number)
        for node in dict.fromkeys(cross.route[-1] for cross in spec.cross_flows):
            network.AddDestination(self._numbers[node], _CROSS)
        for cross, number in zip(spec.cross_flows, of_flow[len(spec.flows) :], strict=True):
            own = traces.get(cross.name)
            chunks = gaps(self._supplies.seed, cross) if own is None else trace_gaps(own)
            origin = self._numbers[cross.route[0]]
            network.AddCross(origin, cross.payload_bytes, number, self._supply(chunks))

    def _losses(self, name: str, probability: float) -> int:
        stream = self._supplies.loss(name, probability)
        return _NO_SUPPLY if stream == NO_STREAM else self._supply(self._supplies.chunks[stream])

    def _supply(self, chunks: Chunks) -> int:
        number = int(self.network.AddSupply(DRAWS_CHUNK))
        for _ in range(2):
            self.network.Fill(number, next(chunks), DRAWS_CHUNK)
        self.filled[number] = chunks
        return number


def _payloads(spec: NetworkSpec) -> list[set[int]]:
    """Return the sizes of the payloads that each link carries, bytes."""
    sizes: list[set[int]] = [set() for _ in spec.links]
    for flow in spec.flows:
        for port, _ in spec.hops(flow.route):
            sizes[port // 2].add(FRAME_BYTES)
    for cross in spec.cross_flows:
        for port, _ in spec.hops(cross.route):
            sizes[port // 2].add(cross.payload_bytes)
    return sizes


def rate_for_ns3(link: Link, payloads: set[int], found_ns: Callable[[int, int], int]) -> int:
    """Return the rate at which ns-3 finds the link's own serialisation times.

    ns-3's fixed-point arithmetic rounds half a nanosecond down at some rates, where one bit a
    second less makes it a little more than half.

    Raises:
        InputError: the times differ, or one is zero, which ns-3 does not order as the
            specification does.
    """
    wanted_ns = {packet_bytes(link, size): service_ns(link, size) for size in payloads}
    for rate_bps in (link.rate_bps, link.rate_bps - 1):
        if all(ns == found_ns(rate_bps, size) > 0 for size, ns in wanted_ns.items()):
            return rate_bps
    raise InputError(
        f"network.engine ns3 cannot serialise packets of {sorted(wanted_ns)} bytes at"
        f" {link.rate_bps} bit/s to the nanosecond (link {link.a}-{link.b}): use another rate"
    )
