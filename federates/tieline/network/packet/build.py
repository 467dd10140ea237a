"""Lays a `NetworkSpec` out in the kernel's memory and opens a stream for each random thing."""

from collections.abc import Iterable, Mapping
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from tieline.errors import InputError
from tieline.network.jitter import Jitter
from tieline.network.packet.draws import Chunks, gaps, jitters, losses, trace_gaps
from tieline.network.packet.memory import (
    COLUMNS,
    DRAWS_CHUNK,
    FIRST_DRAW,
    FREE_AT,
    GAP_STREAM,
    NO_PORT,
    NO_STREAM,
    Cells,
    Memory,
)
from tieline.network.spec import FRAME_BYTES, NetworkSpec, packet_bytes, service_ns

Traces = Mapping[str, NDArray[np.int64]]

_FIRST_CAPACITY = 4096


class Supplies:
    """The random streams of a network, numbered as they are opened."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.chunks: list[Chunks] = []

    def open(self, chunks: Chunks) -> int:
        """Return the number of a new stream."""
        self.chunks.append(chunks)
        return len(self.chunks) - 1

    def loss(self, name: str, probability: float) -> int:
        """Return the stream of a link's losses, or `NO_STREAM` if it loses nothing."""
        if probability == 0:
            return NO_STREAM
        return self.open(losses(self.seed, f"loss of {name}", probability))

    def jitter(self, name: str, jitter: Jitter | None) -> int:
        """Return the stream of a jitter, or `NO_STREAM` if there is none."""
        return NO_STREAM if jitter is None else self.open(jitters(self.seed, name, jitter))

    def first_draws(self) -> Cells:
        """Return the table of streams with two chunks of each."""
        table = np.zeros((len(self.chunks), COLUMNS["streams"]), dtype=np.int64)
        for row, chunks in zip(table, self.chunks, strict=True):
            row[FIRST_DRAW:] = np.concatenate([next(chunks), next(chunks)])
        return table


def laid_out(spec: NetworkSpec, supplies: Supplies, traces: Traces) -> Memory:
    """Return the memory before the first event.

    Raises:
        InputError: one source has more flows than a chunk of random numbers.
    """
    sources = _sources(spec)
    most = int((sources[:, 1] - sources[:, 0]).max(initial=1))
    if most > DRAWS_CHUNK:
        raise InputError(f"the packet engine carries at most {DRAWS_CHUNK} flows a source")
    flows, hops = _flows_and_hops(spec)
    tables = {
        "ports": _ports(spec, supplies),
        "hops": hops,
        "flows": flows,
        "sources": sources,
        "destinations": _destinations(spec, supplies),
        "cross": _cross(spec, supplies, traces),
        "ring": np.zeros((2 * sum(link.queue_packets for link in spec.links), 1), dtype=np.int64),
    }
    tables["streams"] = supplies.first_draws()
    bounds = {
        "source_count": len(spec.sources),
        "pmu_flows": len(spec.flows),
        "cross_flows": len(spec.cross_flows),
        "most_packets": most,
    }
    return Memory(tables, _FIRST_CAPACITY + 4 * most, bounds)


def _sources(spec: NetworkSpec) -> Cells:
    sources = [flow.source for flow in spec.flows]
    edges = np.searchsorted(sources, np.arange(len(spec.sources) + 1))
    return np.stack([edges[:-1], edges[1:]], axis=1).astype(np.int64)


def _flows_and_hops(spec: NetworkSpec) -> tuple[Cells, Cells]:
    plans = chain(
        ((flow.route, FRAME_BYTES, flow.destination) for flow in spec.flows),
        ((cross.route, cross.payload_bytes, -1) for cross in spec.cross_flows),
    )
    flows: list[tuple[int, int]] = []
    hops: list[tuple[int, int, int]] = []
    for route, payload_bytes, destination in plans:
        flows.append((len(hops), destination))
        hops += [
            (port, service_ns(link, payload_bytes), packet_bytes(link, payload_bytes))
            for port, link in spec.hops(route)
        ]
        hops.append((NO_PORT, 0, 0))
    return _table("flows", flows), _table("hops", hops)


def _ports(spec: NetworkSpec, supplies: Supplies) -> Cells:
    facts = []
    ring = 0
    for (origin, target), port in spec.ports.items():
        link = spec.links[port // 2]
        name = f"{origin}->{target}"
        facts.append(
            (
                link.propagation_ns,
                link.queue_packets,
                ring,
                supplies.loss(name, link.loss_probability),
                supplies.jitter(f"jitter of {name}", link.jitter),
            )
        )
        ring += link.queue_packets
    table = np.zeros((len(facts), COLUMNS["ports"]), dtype=np.int64)
    table[:, :FREE_AT] = np.array(facts, dtype=np.int64).reshape(-1, FREE_AT)
    return table


def _destinations(spec: NetworkSpec, supplies: Supplies) -> Cells:
    return _table(
        "destinations",
        (
            (place.processing_ns, supplies.jitter(f"processing of {place.name}", place.jitter))
            for place in spec.destinations
        ),
    )


def _cross(spec: NetworkSpec, supplies: Supplies, traces: Traces) -> Cells:
    table = np.zeros((len(spec.cross_flows), COLUMNS["cross"]), dtype=np.int64)
    for row, flow in zip(table, spec.cross_flows, strict=True):
        is_traced = flow.name in traces
        chunks = trace_gaps(traces[flow.name]) if is_traced else gaps(supplies.seed, flow)
        row[GAP_STREAM] = supplies.open(chunks)
    return table


def _table(name: str, rows: Iterable[tuple[int, ...]]) -> Cells:
    return np.array(list(rows), dtype=np.int64).reshape(-1, COLUMNS[name])
