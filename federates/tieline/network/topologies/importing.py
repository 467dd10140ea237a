"""Turns a graph from elsewhere into a topology: links merged, lengths from coordinates."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import networkx as nx

from tieline.errors import InputError
from tieline.network.spec import Node
from tieline.network.topologies.draft import Draft, DraftLink, LinkDefaults, propagation_ns
from tieline.network.topologies.graph_file import FileEdge, FileGraph, FileNode
from tieline.network.topologies.places import ROUTE_FACTOR

EARTH_KM = 6371.0
"""Mean radius of the earth."""

MISSING = ("refuse", "neighbours", "drop")

Degrees = tuple[float, float]


@dataclass(frozen=True)
class ImportOptions:
    """How a graph becomes a topology.

    Attributes:
        links: what holds for every link; a propagation or length in it takes the place of those
            from coordinates, which are then not needed.
        factor: cable length over great-circle distance.
        has_external: whether nodes of other networks are kept.
        missing: what becomes of nodes without coordinates: `refuse`, `neighbours` puts them in the
            middle of their neighbours, `drop` leaves them out.
        has_largest_only: keep the largest of several unconnected parts; else they are refused.
    """

    links: LinkDefaults = field(default_factory=LinkDefaults)
    factor: float = ROUTE_FACTOR
    has_external: bool = False
    missing: str = "refuse"
    has_largest_only: bool = False


def imported(graph: FileGraph, options: ImportOptions) -> Draft:
    """Return the topology that a file holds, without buses; its head says what was changed.

    Parallel edges become one link with the sum of the rates that are known.

    Raises:
        InputError: nodes without coordinates or several parts, and the options refuse them; or no
            node is left.
    """
    notes: list[str] = []
    nodes = {node.key: node for node in graph.nodes}
    if not options.has_external:
        nodes = _without(nodes, [key for key in nodes if not nodes[key].is_internal])
        _note(notes, len(graph.nodes) - len(nodes), "external nodes were left out")
    rates = _merged(graph, nodes, notes)
    places = _places(graph, nodes, rates, options, notes)
    nodes = {key: node for key, node in nodes.items() if key in places}
    rates = {pair: rate for pair, rate in rates.items() if set(pair) <= set(nodes)}
    kept = _largest(graph, nodes, rates, options, notes)
    nodes = {key: node for key, node in nodes.items() if key in kept}
    rates = {pair: rate for pair, rate in rates.items() if set(pair) <= set(nodes)}
    names = _names(nodes)
    links = [_link(pair, names, places, rate, options) for pair, rate in rates.items()]
    on_plane = _projected({key: places[key] for key in nodes})
    made_by = (
        f"Communication network from {graph.path.name}.",
        _lengths_text(options),
        "rates: those of the file, of parallel edges the sum; link_defaults where it has none.",
        *([f"changed: {'; '.join(notes)}."] if notes else []),
    )
    return Draft(
        made_by,
        options.links,
        tuple(Node(names[key], (), *on_plane[key]) for key in nodes),
        tuple(sorted(links, key=lambda link: (link.a, link.b))),
    )


def great_circle_km(one: Degrees, other: Degrees) -> float:
    """Return the distance of two places (latitude, longitude), by the haversine formula."""
    (lat1, lon1), (lat2, lon2) = ((math.radians(a), math.radians(b)) for a, b in (one, other))
    half = (
        math.sin((lat2 - lat1) / 2) ** 2
        + math.cos(lat1) * math.cos(lat2) * math.sin((lon2 - lon1) / 2) ** 2
    )
    return 2 * EARTH_KM * math.asin(min(1.0, math.sqrt(half)))


def _merged(
    graph: FileGraph, nodes: Mapping[str, FileNode], notes: list[str]
) -> dict[tuple[str, str], int | None]:
    """Return the rate of each pair of joined nodes; None where no edge tells one."""
    order = {key: i for i, key in enumerate(nodes)}
    inside = [edge for edge in graph.edges if edge.start in nodes and edge.end in nodes]
    joining = [edge for edge in inside if edge.start != edge.end]
    _note(notes, len(inside) - len(joining), "edges from a node to itself were left out")
    of_pair: dict[tuple[str, str], list[FileEdge]] = {}
    for edge in joining:
        ends = sorted((edge.start, edge.end), key=lambda key: order[key])
        of_pair.setdefault((ends[0], ends[1]), []).append(edge)
    _note(notes, len(joining) - len(of_pair), "parallel edges were merged with others")
    return {pair: _sum(pair, edges, graph.is_directed) for pair, edges in of_pair.items()}


def _sum(pair: tuple[str, str], edges: Sequence[FileEdge], is_directed: bool) -> int | None:
    """Return the sum of the known rates; with directions, that of the slower one."""
    ways = [edges]
    if is_directed:
        ways = [[edge for edge in edges if edge.start == start] for start in pair]
    sums = [sum(edge.rate_bps or 0 for edge in way) for way in ways]
    return min((rate for rate in sums if rate), default=None)


def _places(
    graph: FileGraph,
    nodes: Mapping[str, FileNode],
    rates: Mapping[tuple[str, str], int | None],
    options: ImportOptions,
    notes: list[str],
) -> dict[str, Degrees | None]:
    """Return the place of each node that is kept; None only where no place is needed."""
    places = {key: node.degrees for key, node in nodes.items()}
    lost = [key for key, place in places.items() if place is None]
    if not lost or options.links.propagation_ns is not None or options.links.km is not None:
        return dict(places)
    labels = ", ".join(f"'{nodes[key].label}'" for key in lost[:10]) + " ..." * (len(lost) > 10)
    if options.missing == "refuse":
        raise InputError(
            f"{graph.path}: {len(lost)} nodes have no Latitude and Longitude: {labels} "
            "(--missing neighbours puts them in the middle of their neighbours, --missing drop "
            "leaves them out, --propagation or --distance gives every link the same)"
        )
    if options.missing == "drop":
        _note(notes, len(lost), "nodes without coordinates were left out")
        return {key: place for key, place in places.items() if place is not None}
    _note(notes, len(lost), "nodes without coordinates stand in the middle of their neighbours")
    return _filled(graph, nodes, places, rates)


def _filled(
    graph: FileGraph,
    nodes: Mapping[str, FileNode],
    places: Mapping[str, Degrees | None],
    rates: Mapping[tuple[str, str], int | None],
) -> dict[str, Degrees | None]:
    """Return the places with the missing ones filled in rounds, from those that have some."""
    near: nx.Graph[str] = nx.Graph()
    near.add_nodes_from(nodes)
    near.add_edges_from(rates)
    found = dict(places)
    while lost := [key for key, place in found.items() if place is None]:
        known = {
            key: [place for other in near[key] if (place := found[other]) is not None]
            for key in lost
        }
        if not any(known.values()):
            labels = ", ".join(f"'{nodes[key].label}'" for key in lost[:10])
            raise InputError(
                f"{graph.path}: no neighbour of {labels} has a Latitude and Longitude "
                "(--missing drop leaves them out)"
            )
        found |= {key: _middle(others) for key, others in known.items() if others}
    return found


def _largest(
    graph: FileGraph,
    nodes: Mapping[str, FileNode],
    rates: Mapping[tuple[str, str], int | None],
    options: ImportOptions,
    notes: list[str],
) -> set[str]:
    if not nodes:
        raise InputError(f"{graph.path}: no node is left ({'; '.join(notes)})")
    joined: nx.Graph[str] = nx.Graph()
    joined.add_nodes_from(nodes)
    joined.add_edges_from(rates)
    order = {key: i for i, key in enumerate(nodes)}
    parts = sorted(
        nx.connected_components(joined), key=lambda part: (-len(part), min(order[k] for k in part))
    )
    if len(parts) > 1 and not options.has_largest_only:
        lost = [nodes[key].label for part in parts[1:] for key in sorted(part, key=order.get)]  # type: ignore[arg-type]
        shown = ", ".join(f"'{label}'" for label in lost[:10]) + " ..." * (len(lost) > 10)
        raise InputError(
            f"{graph.path}: is in {len(parts)} parts; no edge joins {shown} to the largest, of "
            f"{len(parts[0])} nodes (--largest keeps that one alone)"
        )
    _note(notes, len(nodes) - len(parts[0]), "nodes outside the largest part were left out")
    return set(parts[0])


def _link(
    pair: tuple[str, str],
    names: Mapping[str, str],
    places: Mapping[str, Degrees | None],
    rate_bps: int | None,
    options: ImportOptions,
) -> DraftLink:
    a, b = sorted(names[key] for key in pair)
    one, other = places[pair[0]], places[pair[1]]
    if options.links.propagation_ns is not None:
        return DraftLink(a, b, options.links.propagation_ns, None, rate_bps)
    km = options.links.km
    if km is None:
        assert one is not None
        assert other is not None
        km = options.factor * great_circle_km(one, other)
    return DraftLink(a, b, propagation_ns(km), km, rate_bps)


def _names(nodes: Mapping[str, FileNode]) -> dict[str, str]:
    """Return a name for each node: its label, with its key behind where labels repeat."""
    labels = [node.label for node in nodes.values()]
    names: dict[str, str] = {}
    for key, node in nodes.items():
        name = node.label if labels.count(node.label) == 1 else f"{node.label} ({key})"
        while name in names.values():
            name += "'"
        names[key] = name
    return names


def _projected(
    places: Mapping[str, Degrees | None],
) -> dict[str, tuple[float, float] | tuple[None, None]]:
    """Return x and y in kilometres from the middle, true to scale along the middle's parallel."""
    known = [place for place in places.values() if place is not None]
    if not known:
        return dict.fromkeys(places, (None, None))
    latitude, longitude = _middle(known)
    scale = math.pi / 180 * EARTH_KM
    found: dict[str, tuple[float, float] | tuple[None, None]] = {}
    for key, place in places.items():
        if place is None:
            found[key] = (None, None)
            continue
        east = (place[1] - longitude + 180) % 360 - 180
        x_km = east * math.cos(math.radians(latitude)) * scale
        found[key] = (round(x_km, 1), round((place[0] - latitude) * scale, 1))
    return found


def _middle(places: Sequence[Degrees]) -> Degrees:
    """Return the mean latitude and the middle longitude, whatever side of 180 degrees they have."""
    east = sum(math.cos(math.radians(longitude)) for _, longitude in places)
    north = sum(math.sin(math.radians(longitude)) for _, longitude in places)
    return sum(latitude for latitude, _ in places) / len(places), math.degrees(
        math.atan2(north, east)
    )


def _lengths_text(options: ImportOptions) -> str:
    if options.links.propagation_ns is not None or options.links.km is not None:
        return "lengths: every link has the same length or propagation, as given."
    return (
        f"lengths: {options.factor:g} times the great-circle distance of the nodes (1.5 is the "
        "factor of ITU-T G.826 for less than 1,000 km). Propagation is 5 us/km, optical fibre of "
        "ITU-T G.114, annex A, rounded to 1 us. x and y: km from the middle."
    )


def _without(nodes: Mapping[str, FileNode], keys: Sequence[str]) -> dict[str, FileNode]:
    return {key: node for key, node in nodes.items() if key not in set(keys)}


def _note(notes: list[str], count: int, text: str) -> None:
    if count:
        notes.append(f"{count} {text}")
