"""What ns-3's point-to-point devices cannot do, refused before anything starts."""

from collections.abc import Iterator
from dataclasses import MISSING, fields
from typing import Any

from tieline.errors import InputError
from tieline.network.ns3.addresses import routes_of
from tieline.network.ns3.library import check_installed
from tieline.network.queues import DropTail
from tieline.network.spec import FRAME_BYTES, CrossFlow, NetworkSpec, Route
from tieline.network.traffic import HEADER_BYTES
from tieline.network.traffic.base import Acknowledged, Answered

MOST_DESTINATIONS = 50_000
"""Each has a UDP port of its own, from 10,000 on."""

MOST_HOPS = 254
"""The IPv4 header's time to live counts them."""

_CARRIED = {
    "network": {"nodes", "links", "sources", "destinations", "flows", "cross_flows", "dscp"},
    "link": {"a", "b", "rate_bps", "propagation_ns", "queue", "loss", "overhead_bytes"}
    | {"mtu_bytes", "cost"},
    "PMU": {"name", "bus", "node", "processing_ns", "jitter"},
    "controller": {"name", "unit", "bus", "node", "processing_ns", "jitter"},
    "flow": {"source", "destination", "route"},
    "cross flow": {"name", "traffic", "route", "back", "dscp", "start_ns", "stop_ns"},
}


def check_carried(spec: NetworkSpec) -> None:
    """Raise InputError, with every finding, unless ns-3 is here and can carry all of a network.

    Whatever a specification says beyond what this engine knows is refused, not left out.
    """
    check_installed()
    findings = [f"network.engine ns3 {text}: use network.engine packet" for text in _findings(spec)]
    if findings:
        raise InputError(findings)


def _findings(spec: NetworkSpec) -> Iterator[str]:
    yield from _beyond("network", "this one", spec)
    for link in spec.links:
        name = f"{link.a}-{link.b}"
        yield from _beyond("link", name, link)
        if not isinstance(link.queue, DropTail):
            kind = type(link.queue).__name__
            yield f"has drop-tail queues alone, and link {name} has a {kind}"
    for source in spec.sources:
        yield from _beyond("PMU", source.name, source)
    for destination in spec.destinations:
        yield from _beyond("controller", destination.name, destination)
    for number, flow in enumerate(spec.flows):
        yield from _beyond("flow", str(number), flow)
        yield from _too_large(spec, f"flow {number}", flow.route, FRAME_BYTES)
    for cross in spec.cross_flows:
        yield from _cross(spec, cross)
    longest = max(routes_of(spec), key=len, default=())
    if len(longest) - 1 > MOST_HOPS:
        yield (
            f"carries packets over at most {MOST_HOPS} links, and there are {len(longest) - 1}"
            f" from {longest[0]} to {longest[-1]}"
        )
    if len(spec.destinations) > MOST_DESTINATIONS:
        yield f"serves at most {MOST_DESTINATIONS} controllers (got {len(spec.destinations)})"


def _cross(spec: NetworkSpec, cross: CrossFlow) -> Iterator[str]:
    yield from _beyond("cross flow", cross.name, cross)
    if isinstance(cross.traffic, Acknowledged | Answered):
        kind = type(cross.traffic).__name__
        yield f"has no traffic that waits for answers, and {cross.name} is {kind}"
    yield from _too_large(spec, cross.name, cross.route, cross.traffic.payload_bytes)


def _beyond(what: str, name: str, entry: Any) -> Iterator[str]:
    for field in fields(entry):
        default = None if field.default is MISSING else field.default
        if field.name not in _CARRIED[what] and getattr(entry, field.name) != default:
            yield f"has no {field.name} of a {what}, and {name} has it"


def _too_large(spec: NetworkSpec, name: str, route: Route, payload_bytes: int) -> Iterator[str]:
    size = payload_bytes + HEADER_BYTES
    least = min((link.mtu_bytes for _, link in spec.hops(route)), default=size)
    if size > least:
        yield f"cuts no datagrams, and those of {name} have {size} bytes where the MTU is {least}"
