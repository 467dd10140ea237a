"""Sums a topology up: size, unloaded delays, and the links and nodes that all depends on."""

from collections.abc import Sequence
from dataclasses import dataclass

import networkx as nx
import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from tieline.network.spec import FRAME_BYTES, NetworkSpec, service_ns, unloaded_delay_ns
from tieline.network.topologies.write import as_rate

MOST_SHOWN = 12
"""Links or nodes that a line names."""

NS_PER_MS = 1_000_000

MOST_FOR_FLOWS = 300
"""Nodes up to which maximum flows, one for each node, find how many links must fail."""

MOST_ORIGINS = 500
"""Nodes from which delays are measured where a topology has no flows; more are thinned out."""


@dataclass(frozen=True)
class Summary:
    """What a topology is like.

    Attributes:
        nodes, links, buses: how many.
        rates_bps: number of links by rate, slowest first.
        delays_ns: least, mean and greatest unloaded delay; None for a single node.
        delays_of: what the delays are of.
        bridges: links that part the network when they fail, by their ends.
        articulation_points: nodes that do.
        edge_connectivity: links that must fail, at least, to part the network; for more than
            `MOST_FOR_FLOWS` nodes without bridges only that it takes two.
    """

    nodes: int
    links: int
    buses: int
    rates_bps: dict[int, int]
    delays_ns: tuple[float, float, float] | None
    delays_of: str
    bridges: tuple[tuple[str, str], ...]
    articulation_points: tuple[str, ...]
    edge_connectivity: str


def summary_of(spec: NetworkSpec) -> Summary:
    """Return what a network is like.

    With flows the delays are their combined delays, processing included, from measurement to the
    moment a controller can use the frame; without, those of a PMU frame from each node to each
    other, without processing.
    """
    graph: nx.Graph[str] = nx.Graph()
    graph.add_nodes_from(node.name for node in spec.nodes)
    graph.add_edges_from((link.a, link.b) for link in spec.links)
    bridges = tuple(sorted((min(pair), max(pair)) for pair in nx.bridges(graph)))
    rates = [link.rate_bps for link in spec.links]
    delays, of = _delays(spec)
    return Summary(
        len(spec.nodes),
        len(spec.links),
        sum(len(node.buses) for node in spec.nodes),
        {rate: rates.count(rate) for rate in sorted(set(rates))},
        delays,
        of,
        bridges,
        tuple(sorted(nx.articulation_points(graph))),
        _connectivity(graph, len(bridges)),
    )


def lines_of(summary: Summary) -> list[str]:
    """Return the summary as lines for a terminal."""
    rates = ", ".join(f"{count} of {as_rate(rate)}" for rate, count in summary.rates_bps.items())
    rows = {
        "nodes": f"{summary.nodes}, with {summary.buses} buses",
        "links": f"{summary.links}" + f" ({rates})" * bool(rates),
    }
    if summary.delays_ns is not None:
        least, mean, most = (f"{delay / NS_PER_MS:.3f}" for delay in summary.delays_ns)
        rows["unloaded delay, ms"] = (
            f"least {least}, mean {mean}, greatest {most} ({summary.delays_of})"
        )
    rows["links that must fail to part it"] = summary.edge_connectivity
    rows["links that part it alone"] = _some([f"{a} - {b}" for a, b in summary.bridges])
    rows["nodes that part it alone"] = _some(summary.articulation_points)
    width = max(map(len, rows))
    return [f"  {name:<{width}}  {text}" for name, text in rows.items()]


def _some(names: Sequence[str]) -> str:
    if not names:
        return "none"
    shown = ", ".join(names[:MOST_SHOWN]) + ", ..." * (len(names) > MOST_SHOWN)
    return f"{len(names)}: {shown}"


def _delays(spec: NetworkSpec) -> tuple[tuple[float, float, float] | None, str]:
    if spec.flows:
        values = np.array([unloaded_delay_ns(spec, flow) for flow in spec.flows])
        of = f"{len(spec.flows)} flows, processing included"
    else:
        values, of = _between_nodes(spec)
    if not len(values):
        return None, of
    return (float(values.min()), float(values.mean()), float(values.max())), of


def _connectivity(graph: "nx.Graph[str]", bridges: int) -> str:
    if len(graph) == 1:
        return "there is one node alone"
    if bridges or len(graph) > MOST_FOR_FLOWS:
        return "1" if bridges else "2 or more"
    return str(nx.edge_connectivity(graph))


def _between_nodes(spec: NetworkSpec) -> tuple["np.ndarray[tuple[int], np.dtype[np.float64]]", str]:
    place = {node.name: i for i, node in enumerate(spec.nodes)}
    count = len(place)
    ends = np.array([(place[link.a], place[link.b]) for link in spec.links], np.int64).reshape(
        -1, 2
    )
    cost = [service_ns(link, FRAME_BYTES) + link.propagation_ns for link in spec.links]
    graph = csr_array((cost, (ends[:, 0], ends[:, 1])), shape=(count, count))
    origins = np.unique(np.linspace(0, count - 1, min(count, MOST_ORIGINS)).astype(np.int64))
    delays = dijkstra(graph, directed=False, indices=origins)
    is_other = np.arange(count) != origins[:, None]
    of = "a PMU frame between any two nodes, processing left out"
    if len(origins) < count:
        of = f"a PMU frame from {len(origins)} of the nodes to all, processing left out"
    return delays[is_other], of
