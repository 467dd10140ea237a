"""What ns-3's point-to-point devices cannot do, refused before anything starts."""

from collections.abc import Iterator
from dataclasses import MISSING, fields
from typing import Any

from tieline.errors import InputError
from tieline.network.ns3.addresses import routes_of
from tieline.network.ns3.library import check_installed
from tieline.network.spec import NetworkSpec

MOST_DESTINATIONS = 50_000
"""Each has a UDP port of its own, from 10,000 on."""

MOST_HOPS = 254
"""The IPv4 header's time to live counts them."""

_CARRIED = {
    "link": {"a", "b", "rate_bps", "propagation_ns", "queue_packets", "loss_probability"}
    | {"overhead_bytes"},
    "PMU": {"name", "bus", "node", "processing_ns", "jitter"},
    "controller": {"name", "unit", "bus", "node", "processing_ns", "jitter"},
    "flow": {"source", "destination", "route"},
    "cross flow": {"name", "kind", "rate_bps", "payload_bytes", "route"},
    "network": {"nodes", "links", "sources", "destinations", "flows", "cross_flows"},
}
_KINDS = ("poisson", "cbr")


def check_carried(spec: NetworkSpec) -> None:
    """Raise InputError, with every finding, unless ns-3 is here and can carry all of a network.

    Whatever a specification says beyond what this engine knows is refused, not left out.
    """
    check_installed()
    findings = list(_findings(spec))
    if findings:
        raise InputError(findings)


def _findings(spec: NetworkSpec) -> Iterator[str]:
    yield from _beyond("network", "", spec)
    for link in spec.links:
        yield from _beyond("link", f" {link.a}-{link.b}", link)
    for source in spec.sources:
        yield from _beyond("PMU", f" {source.name}", source)
    for destination in spec.destinations:
        yield from _beyond("controller", f" {destination.name}", destination)
    for route in routes_of(spec):
        if len(route) - 1 > MOST_HOPS:
            yield (
                f"network.engine ns3 carries packets over at most {MOST_HOPS} links"
                f" (got {len(route) - 1} from {route[0]} to {route[-1]})"
            )
    for number, flow in enumerate(spec.flows):
        yield from _beyond("flow", f" {number}", flow)
    for cross in spec.cross_flows:
        yield from _beyond("cross flow", f" {cross.name}", cross)
        if cross.kind not in _KINDS:
            yield f"network.engine ns3 knows {' and '.join(_KINDS)} traffic (got {cross.kind})"
    if len(spec.destinations) > MOST_DESTINATIONS:
        yield (
            f"network.engine ns3 serves at most {MOST_DESTINATIONS} controllers"
            f" (got {len(spec.destinations)})"
        )


def _beyond(what: str, name: str, entry: Any) -> Iterator[str]:
    for field in fields(entry):
        default = None if field.default is MISSING else field.default
        if field.name not in _CARRIED[what] and getattr(entry, field.name) != default:
            yield (
                f"network.engine ns3 has no {field.name} of a {what}, which{name or ' this one'}"
                " has: use network.engine packet"
            )
