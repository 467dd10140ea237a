"""Shortest-path routes: least delay, then fewest links, then the first found alphabetically."""

from collections.abc import Iterable

import networkx as nx

from tieline.network.spec import FRAME_BYTES, Link, Route, service_ns


def routes_from(
    origins: Iterable[str], nodes: Iterable[str], links: Iterable[Link]
) -> dict[str, dict[str, Route]]:
    """Return the route from each origin to every node that it reaches.

    The length of a link is the time that a PMU frame needs on it when nothing waits: serialisation
    and propagation. Nodes and links enter the search in alphabetical order, so the order in which
    a file or a dictionary gives them changes nothing.
    """
    graph: nx.Graph[str] = nx.Graph()
    graph.add_nodes_from(sorted(nodes))
    # One more than any route has links: a route of fewer links wins among those of equal delay,
    # and never against one of less delay.
    scale = len(graph) + 1
    for link in sorted(links, key=lambda link: sorted((link.a, link.b))):
        delay_ns = service_ns(link, FRAME_BYTES) + link.propagation_ns
        graph.add_edge(*sorted((link.a, link.b)), length=delay_ns * scale + 1)
    return {
        origin: {
            target: tuple(path)
            for target, path in nx.single_source_dijkstra_path(
                graph, origin, weight="length"
            ).items()
        }
        for origin in sorted(set(origins))
    }
