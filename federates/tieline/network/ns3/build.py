"""Builds a `NetworkSpec` from ns-3's objects."""

from collections.abc import Callable, Sequence
from typing import Any

from tieline.errors import CosimError, InputError
from tieline.network.draws import CHUNK, Chunks
from tieline.network.losses import Loss
from tieline.network.ns3.addresses import addressed
from tieline.network.ns3.library import model
from tieline.network.ns3.limits import check_carried
from tieline.network.packet.draws import gaps, sizes
from tieline.network.packet.supplies import GAPS, LOSSES, SIZES
from tieline.network.spec import FRAME_BYTES, Link, NetworkSpec, packet_bytes, service_ns
from tieline.network.traffic.base import Sized
from tieline.streams import stream

_NO_SUPPLY = -1
_CROSS = -1


def built(spec: NetworkSpec, seed: int) -> tuple[Any, dict[int, Chunks], list[tuple[str, str]]]:
    """Return the network, its cross traffic planned, what fills its supplies, and their streams.

    Of each stream the last has its name and, in words, what its numbers are.

    Args:
        spec: the network.
        seed: the experiment's.

    Raises:
        InputError: ns-3 is not installed, cannot carry the network, or rounds the serialisation
            time of a packet otherwise than the specification does.
        CosimError: another network is open.
    """
    check_carried(spec)
    rates_bps = [
        rate_for_ns3(link, payloads, model().Network.ServiceNs)
        for link, payloads in zip(spec.links, _payloads(spec), strict=True)
    ]
    if model().Network.IsOpen():
        raise CosimError("ns-3 simulates one network at a time: close the other engine first")
    builder = _Builder(spec, seed)
    builder.add_links(rates_bps)
    builder.add_pmu_flows()
    builder.add_cross_flows()
    return builder.network, builder.filled, builder.streams


class _Builder:
    def __init__(self, spec: NetworkSpec, seed: int) -> None:
        self.network = model().Network(len(spec.nodes), len(spec.flows))
        self.filled: dict[int, Chunks] = {}
        self.streams: list[tuple[str, str]] = []
        self._spec = spec
        self._seed = seed
        self._numbers = {node.name: number for number, node in enumerate(spec.nodes)}
        self._addresses, self._address_of = addressed(spec)

    def add_links(self, rates_bps: Sequence[int]) -> None:
        """Add every link, whose ports get the numbers of the specification, and the routes."""
        for link, rate_bps in zip(self._spec.links, rates_bps, strict=True):
            [line] = link.queue.lines
            self.network.AddLink(
                self._numbers[link.a],
                self._numbers[link.b],
                rate_bps,
                link.propagation_ns,
                line.packets,
                line.bytes,
                link.overhead_bytes,
                self._losses(link.loss, f"{link.a}->{link.b}"),
                self._losses(link.loss, f"{link.b}->{link.a}"),
                link.loss is not None and link.loss.counts == "bits",
            )
        for number, address in enumerate(self._addresses):
            self.network.AddAddress(self._numbers[address.node], number)
            for port in address.next_port.values():
                self.network.AddRoute(number, port)

    def add_pmu_flows(self) -> None:
        """Add the sockets of PMUs and controllers."""
        for source in self._spec.sources:
            self.network.AddSource(self._numbers[source.node], self._spec.dscp)
        for number, destination in enumerate(self._spec.destinations):
            self.network.AddDestination(self._numbers[destination.node], number)
        for flow, number in zip(self._spec.flows, self._address_of, strict=False):
            self.network.AddFlow(flow.source, flow.destination, number)

    def add_cross_flows(self) -> None:
        """Add the sockets of the cross traffic, and start it."""
        crosses = self._spec.cross_flows
        for node in dict.fromkeys(cross.route[-1] for cross in crosses):
            self.network.AddDestination(self._numbers[node], _CROSS)
        numbers = self._address_of[len(self._spec.flows) :]
        for cross, number in zip(crosses, numbers, strict=True):
            self.network.AddCross(
                self._numbers[cross.route[0]],
                number,
                cross.dscp,
                cross.traffic.payload_bytes,
                self._supply(sizes(cross), f"sizes of {cross.name}", SIZES),
                self._supply(gaps(self._seed, cross), f"arrivals of {cross.name}", GAPS),
            )

    def _losses(self, loss: Loss | None, name: str) -> int:
        generator = stream(self._seed, f"loss of {name}")
        chunks = None if loss is None else loss.gaps(generator)
        return self._supply(chunks, f"loss of {name}", LOSSES)

    def _supply(self, chunks: Chunks | None, name: str, gives: str) -> int:
        if chunks is None:
            return _NO_SUPPLY
        number = int(self.network.AddSupply(CHUNK))
        for _ in range(2):
            self.network.Fill(number, next(chunks), CHUNK)
        self.filled[number] = chunks
        self.streams.append((name, gives))
        return number


def _payloads(spec: NetworkSpec) -> list[set[int]]:
    """Return the sizes of the payloads that each link may carry, bytes."""
    carried: list[set[int]] = [set() for _ in spec.links]
    for flow in spec.flows:
        for port, _ in spec.hops(flow.route):
            carried[port // 2].add(FRAME_BYTES)
    for cross in spec.cross_flows:
        most = cross.traffic.payload_bytes
        least = 1 if isinstance(cross.traffic, Sized) else most
        for port, _ in spec.hops(cross.route):
            carried[port // 2].update(range(least, most + 1))
    return carried


def rate_for_ns3(link: Link, payloads: set[int], found_ns: Callable[[int, int], int]) -> int:
    """Return the rate at which ns-3 finds the link's own serialisation times.

    ns-3's fixed-point arithmetic rounds half a nanosecond down at some rates, where one bit a
    second less makes it a little more than half.

    Args:
        link: the link.
        payloads: sizes of the payloads that it may carry, bytes.
        found_ns: returns the time that ns-3 finds for a rate (bit/s) and a size on the link.

    Raises:
        InputError: the times differ, or one is zero, which ns-3 does not order as the
            specification does.
    """
    wanted_ns = {packet_bytes(link, size): service_ns(link, size) for size in sorted(payloads)}
    for rate_bps in (link.rate_bps, link.rate_bps - 1):
        if all(ns == found_ns(rate_bps, size) > 0 for size, ns in wanted_ns.items()):
            return rate_bps
    raise InputError(
        f"network.engine ns3 cannot serialise packets of {min(wanted_ns)} to {max(wanted_ns)} bytes"
        f" at {link.rate_bps} bit/s to the nanosecond (link {link.a}-{link.b}): use another rate"
    )
