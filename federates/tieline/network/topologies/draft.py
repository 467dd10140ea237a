"""A topology before it is written to a file: nodes, links, and what holds for all links."""

from collections.abc import Iterable
from dataclasses import dataclass

import networkx as nx

from tieline.network.spec import Node
from tieline.network.topologies.constants import NS_PER_KM
from tieline.network.topologies.places import Places, Way

US = 1_000


@dataclass(frozen=True)
class DraftLink:
    """A link; what is None is left to the defaults of the file.

    Attributes:
        a, b: the nodes at its ends.
        propagation_ns: whole microseconds.
        km: length that the propagation comes from, or None if it was given.
        rate_bps: bits a second.
        through: stations that its fibre passes between its ends.
    """

    a: str
    b: str
    propagation_ns: int
    km: float | None = None
    rate_bps: int | None = None
    through: tuple[str, ...] = ()


@dataclass(frozen=True)
class DraftCross:
    """Background traffic between two nodes; the rate counts payload, UDP and IPv4 headers."""

    kind: str
    origin: str
    target: str
    rate_bps: int
    payload_bytes: int


@dataclass(frozen=True)
class LinkDefaults:
    """What every link of a topology has unless it says otherwise.

    Attributes:
        rate_bps: bits a second, link-layer bytes included.
        queue: packets that may wait.
        overhead_bytes: of the link layer; PPP over SONET, RFC 2615, has 9.
        propagation_ns: of every link, in place of that of its length.
        km: length of every link, in place of that of its way.
    """

    rate_bps: int = 20_000_000
    queue: int = 200
    overhead_bytes: int = 9
    propagation_ns: int | None = None
    km: float | None = None


@dataclass(frozen=True)
class Draft:
    """A topology as it will be written.

    Attributes:
        made_by: sentences for the head of the file.
        defaults: of the links.
        nodes: with buses and positions in kilometres.
        links: one at most for each pair of nodes.
        cross: background traffic.
    """

    made_by: tuple[str, ...]
    defaults: LinkDefaults
    nodes: tuple[Node, ...]
    links: tuple[DraftLink, ...]
    cross: tuple[DraftCross, ...] = ()

    def graph(self) -> "nx.Graph[str]":
        """Return nodes and links alone."""
        graph: nx.Graph[str] = nx.Graph()
        graph.add_nodes_from(node.name for node in self.nodes)
        graph.add_edges_from((link.a, link.b) for link in self.links)
        return graph


def link_along(
    names: tuple[str, str], way: Way, defaults: LinkDefaults, rate_bps: int | None = None
) -> DraftLink:
    """Return a link of a way's length, or of the length or propagation that all links have."""
    a, b = sorted(names)
    through = way.through[1:-1]
    if (a, b) != names:
        through = through[::-1]
    if defaults.propagation_ns is not None:
        return DraftLink(a, b, defaults.propagation_ns, None, rate_bps, through)
    km = way.km if defaults.km is None else defaults.km
    return DraftLink(a, b, propagation_ns(km), km, rate_bps, through)


def links_between(
    places: Places, pairs: Iterable[tuple[int, int]], defaults: LinkDefaults
) -> tuple[DraftLink, ...]:
    """Return the links between pairs of places, in the order of their names."""
    made = [
        link_along((places.names[a], places.names[b]), places.way(a, b), defaults) for a, b in pairs
    ]
    return tuple(sorted(made, key=lambda link: (link.a, link.b)))


def propagation_ns(km: float) -> int:
    """Return the time that light in fibre takes, rounded to a microsecond."""
    return round(km * NS_PER_KM / US) * US
