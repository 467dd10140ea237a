"""Reads a topology file, refuses a faulty one, and resolves it to a `NetworkSpec`."""

from dataclasses import replace
from pathlib import Path

from tieline.errors import InputError
from tieline.network.entries import Entries, Sites
from tieline.network.ns3.limits import check_carried
from tieline.network.routing import routes_from
from tieline.network.settings import NetworkSettings
from tieline.network.spec import (
    CrossFlow,
    Destination,
    Flow,
    NetworkSpec,
    Route,
    Source,
    direct_spec,
    unloaded_delay_ns,
)
from tieline.units import ns_to_seconds, seconds_to_ns
from tieline.yaml_lines import load


def read_topology(
    path: Path, sources: Sites, destinations: Sites, settings: NetworkSettings
) -> NetworkSpec:
    """Return the network of a topology file, with what the experiment changes of it.

    Args:
        path: the topology file.
        sources: the PMUs; the place in the list is the source number.
        destinations: the controllers; the place in the list is the destination number.
        settings: `loss` replaces the loss of every link, `cross_traffic` multiplies the rates of
            the cross flows, and `mean_delay` lengthens the PMUs' processing times, all by the same
            time, so that the unloaded combined delay, averaged over the flows, has this value.
            Waiting in queues comes on top of it, as it does in the topology's own delays.

    Raises:
        InputError: whatever is wrong with the file, all of it in one error, each finding with
            `file:line`; or a `mean_delay` below the mean that the topology has anyway.
    """
    entries = Entries(load(path), sources, destinations, settings.loss)
    entries.refuse()
    return lengthened(_resolved(entries, settings.cross_traffic), settings, path)


def network_spec(
    settings: NetworkSettings, topology: Path | None, sources: Sites, destinations: Sites
) -> NetworkSpec:
    """Return the network of an experiment, whatever its engine; nothing is started or written.

    Args:
        settings: engine, and what it needs.
        topology: the file of the network of an engine that simulates packets; None for the others.
        sources: the PMUs, as for `read_topology`.
        destinations: the controllers, as for `read_topology`.

    Raises:
        InputError: as `read_topology`, the constant engine has no delay, or ns-3 is not installed
            or cannot carry the network.
    """
    if topology is not None:
        spec = read_topology(topology, sources, destinations, settings)
        if settings.engine == "ns3":
            check_carried(spec)
        return spec
    if settings.engine == "constant" and settings.delay is None:
        raise InputError("network.delay must be given with network.engine constant")
    delay_s = settings.delay if settings.engine == "constant" else None
    return direct_spec(sources, destinations, seconds_to_ns(delay_s or 0.0))


def mean_unloaded_delay_ns(spec: NetworkSpec) -> float:
    """Return the unloaded combined delay averaged over the flows."""
    return sum(unloaded_delay_ns(spec, flow) for flow in spec.flows) / len(spec.flows)


def lengthened(spec: NetworkSpec, settings: NetworkSettings, path: Path) -> NetworkSpec:
    """Return the network with PMU processing times lengthened to reach `settings.mean_delay`.

    Raises:
        InputError: the mean is longer already.
    """
    if settings.mean_delay is None or not spec.flows:
        return spec
    base_ns = mean_unloaded_delay_ns(spec)
    extra_ns = round(seconds_to_ns(settings.mean_delay) - base_ns)
    if extra_ns < 0:
        raise InputError(
            f"network.mean_delay must be at least {ns_to_seconds(round(base_ns)):.6f} s, the mean "
            f"delay of {path} without queueing (got {settings.mean_delay:g} s)"
        )
    sources = tuple(
        replace(source, processing_ns=source.processing_ns + extra_ns) for source in spec.sources
    )
    return replace(spec, sources=sources)


def _resolved(entries: Entries, cross_traffic: float) -> NetworkSpec:
    """Return the network of entries without fault, every route found."""
    at_bus = entries.at_bus
    sources = tuple(
        Source(site["name"], site["bus"], at_bus[site["bus"]], *entries.pmu)
        for site in entries.sources
    )
    destinations = tuple(
        Destination(
            site["name"], site["unit"], site["bus"], at_bus[site["bus"]], *entries.controller
        )
        for site in entries.destinations
    )
    origins = {source.node for source in sources} | {entry.origin for entry in entries.cross}
    routes = routes_from(origins, (node.name for node in entries.nodes), entries.links)
    flows = tuple(
        Flow(i, j, routes[source.node][destination.node])
        for i, source in enumerate(sources)
        for j, destination in enumerate(destinations)
    )
    cross_flows = _cross_flows(entries, cross_traffic, routes)
    return NetworkSpec(entries.nodes, entries.links, sources, destinations, flows, cross_flows)


def _cross_flows(
    entries: Entries, factor: float, routes: dict[str, dict[str, Route]]
) -> tuple[CrossFlow, ...]:
    if factor == 0:
        return ()
    return tuple(
        CrossFlow(
            f"cross flow {index}",
            entry.kind,
            entry.rate * factor,
            entry.payload,
            routes[entry.origin][entry.target],
        )
        for index, entry in enumerate(entries.cross)
    )
