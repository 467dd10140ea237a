"""Reads a topology file, refuses a faulty one, and resolves it to a `NetworkSpec`."""

import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from tieline.errors import InputError
from tieline.network.entries import Entries, Sites, jitter_of
from tieline.network.events import changes_of, rerouted
from tieline.network.linkless import least_delay_without_links_ns
from tieline.network.routing import Router, Routing
from tieline.network.settings import NetworkSettings
from tieline.network.spec import (
    CrossFlow,
    Destination,
    Flow,
    Link,
    NetworkSpec,
    Route,
    Source,
    direct_spec,
)
from tieline.units import ns_to_seconds, seconds_to_ns
from tieline.yaml_lines import load

_NETWORKS_KEPT = 8
"""A sweep may have thousands, of a megabyte each; those next to each other are mostly alike."""


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
    entries = Entries(load(path), sources, destinations, settings)
    entries.refuse()
    return lengthened(_resolved(entries, settings), settings, path)


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
            # It brings the packet engine and its compiler with it.
            from tieline.network.ns3.limits import check_carried

            check_carried(spec)
        return spec
    least_ns = least_delay_without_links_ns(settings, sources, destinations)
    return direct_spec(sources, destinations, least_ns)


class Networks:
    """Resolves the networks of many experiments: what differs in its mean delay alone, once."""

    def __init__(self) -> None:
        self._known: dict[str, NetworkSpec] = {}

    def spec(
        self, settings: NetworkSettings, topology: Path | None, sources: Sites, destinations: Sites
    ) -> NetworkSpec:
        """Return the network of an experiment, as `network_spec` does.

        Raises:
            InputError: as `network_spec`.
        """
        if topology is None:
            return network_spec(settings, topology, sources, destinations)
        unlengthened = settings.model_copy(update={"mean_delay": None})
        stated = unlengthened.model_dump(mode="json"), str(topology), sources, destinations
        key = json.dumps(stated, sort_keys=True)
        if key not in self._known:
            found = network_spec(unlengthened, topology, sources, destinations)
            if len(self._known) == _NETWORKS_KEPT:
                del self._known[next(iter(self._known))]
            self._known[key] = found
        return lengthened(self._known[key], settings, topology)


def lengthened(spec: NetworkSpec, settings: NetworkSettings, path: Path) -> NetworkSpec:
    """Return the network with PMU processing times lengthened to reach `settings.mean_delay`.

    Raises:
        InputError: the mean is longer already.
    """
    if settings.mean_delay is None or not spec.flows:
        return spec
    base_ns = spec.mean_unloaded_delay_ns
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


def _resolved(entries: Entries, settings: NetworkSettings) -> NetworkSpec:
    """Return the network of entries without fault, every route found."""
    pmu = seconds_to_ns(entries.pmu.processing), jitter_of(entries.pmu.jitter)
    controller = seconds_to_ns(entries.controller.processing), jitter_of(entries.controller.jitter)
    at_bus = entries.at_bus
    sources = tuple(
        Source(site["name"], site["bus"], at_bus[site["bus"]], *pmu) for site in entries.sources
    )
    destinations = tuple(
        Destination(site["name"], site["unit"], site["bus"], at_bus[site["bus"]], *controller)
        for site in entries.destinations
    )
    routing = _routing(entries, settings)
    names = [node.name for node in entries.nodes]
    ends = [(source.node, place.node) for source in sources for place in destinations]
    router = Router(routing, names, entries.links)
    flows = tuple(
        Flow(*divmod(number, len(destinations)), _found(router, *pair, f"flow {number}"))
        for number, pair in enumerate(ends)
    )
    cross_flows = _cross_flows(entries, settings.cross_traffic, router)
    changes = changes_of(entries.events, entries.links)
    if routing.convergence_ns is not None:

        def route_of(down: frozenset[int]) -> Callable[[str, str, str], Route | None]:
            return Router(routing, names, entries.links, down).route

        changes = rerouted(changes, routing.convergence_ns, flows, cross_flows, ends, route_of)
    return NetworkSpec(
        entries.nodes,
        entries.links,
        sources,
        destinations,
        flows,
        cross_flows,
        settings.transport or entries.pmu.transport,
        entries.pmu.dscp if settings.dscp is None else settings.dscp,
        tuple(changes),
        _taps(entries.links, settings.capture),
    )


def _routing(entries: Entries, settings: NetworkSettings) -> Routing:
    stated = entries.routing
    wait_s = stated.convergence if settings.convergence is None else settings.convergence
    return Routing(
        stated.metric,
        stated.equal_cost == "split",
        None if wait_s is None else seconds_to_ns(wait_s),
        entries.fixed,
    )


def _found(router: Router, origin: str, target: str, flow: str) -> Route:
    """Return a route that there must be: every network is connected."""
    route = router.route(origin, target, flow)
    if route is None:
        raise InputError(f"no route from {origin} to {target}")
    return route


def _cross_flows(entries: Entries, factor: float, router: Router) -> tuple[CrossFlow, ...]:
    if factor == 0:
        return ()
    flows = []
    for index, entry in enumerate(entries.cross):
        name, ends = f"cross flow {index}", (entry.origin, entry.target)
        flows.append(
            CrossFlow(
                name,
                entry.traffic().scaled(factor),
                _found(router, *ends, name),
                _found(router, *ends[::-1], name),
                entry.dscp,
                seconds_to_ns(entry.start),
                None if entry.stop is None else seconds_to_ns(entry.stop),
            )
        )
    return tuple(flows)


def _taps(links: Sequence[Link], capture: Sequence[tuple[str, str]]) -> tuple[int, ...]:
    """Return the numbers of the links that are listened to.

    Raises:
        InputError: there is no such link.
    """
    numbers = {frozenset((link.a, link.b)): number for number, link in enumerate(links)}
    missing = [pair for pair in capture if frozenset(pair) not in numbers]
    if missing:
        raise InputError(f"network.capture: there is no link {'-'.join(missing[0])}")
    return tuple(sorted({numbers[frozenset(pair)] for pair in capture}))
