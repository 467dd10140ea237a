"""Says what a drawing of a run needs: stations, lines and links, and where each of them stands."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tieline.network.spec import LinkCut, LinkRepair, NetworkSpec
from tieline.network.topologies.constants import NS_PER_KM, PREFIX
from tieline.network.topologies.power_grid import PowerGrid
from tieline.network.topologies.stations import Corridor, Station, lines_of, stations_of
from tieline.units import NS_PER_S

GIVEN = "as the topology file has them"
LAID_OUT = "laid out by the lengths of lines and links, long ones shortened"

APART_KM = 200.0
"""Between parts of a network that nothing joins, on paper."""

PULL = 0.6
"""Share of its neighbours' middle in the place of a station that has none of its own: the rest is
the middle of all, so that a station at the end of a line does not hide the one that it hangs on."""


def interconnection(
    grid: PowerGrid, units: Sequence[tuple[str, int]], spec: NetworkSpec | None
) -> dict[str, Any]:
    """Return what there is to draw, as plain data; `placed` adds the places that are missing.

    Args:
        grid: buses, lines and areas.
        units: name and bus number of every unit.
        spec: the packet network, or None where the engine has none.
    """
    nodes = () if spec is None else spec.nodes
    stations = _merged(stations_of(grid), {bus: node.name for node in nodes for bus in node.buses})
    at_bus = {bus: station.name for station in stations for bus in station.buses}
    return {
        "areas": list(grid.areas),
        "stations": [
            {
                "name": station.name,
                "area": station.area,
                "buses": list(station.buses),
                "bus": _main_bus(grid, station),
            }
            for station in stations
        ],
        "units": [{"name": u, "bus": bus, "station": at_bus[bus]} for u, bus in units],
        "lines": _lines(grid, stations),
        "nodes": [_node(node.name, node.buses, node.x, node.y) for node in nodes],
        "links": _links(spec),
        "outages": _outages(spec),
    }


def placed(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Return the facts with `x` and `y` (y upwards) of each station and node, and their source.

    A node and the station of the same name stand at one place. Where the topology places all its
    nodes, a station without one stands near its neighbours; otherwise all are laid out.
    """
    given = {node["name"]: (node["x"], node["y"]) for node in facts["nodes"]}
    if given and all(x is not None and y is not None for x, y in given.values()):
        xy, source = _with_neighbours(given, facts), GIVEN
    else:
        xy, source = _laid_out(facts), LAID_OUT
    parts = {
        key: [part | {"x": xy[part["name"]][0], "y": xy[part["name"]][1]} for part in facts[key]]
        for key in ("stations", "nodes")
    }
    return {**facts, **parts, "places": source}


def _merged(stations: Iterable[Station], node_at: Mapping[int, str]) -> tuple[Station, ...]:
    """Return the stations, those at one node as one, with its name."""
    buses: dict[str, list[int]] = {}
    areas: dict[str, str] = {}
    for station in stations:
        name = next((node_at[bus] for bus in station.buses if bus in node_at), station.name)
        buses.setdefault(name, []).extend(station.buses)
        areas.setdefault(name, station.area)
    return tuple(Station(name, tuple(sorted(buses[name])), areas[name]) for name in buses)


def _main_bus(grid: PowerGrid, station: Station) -> int:
    """Return the bus that stands for a station: its first PMU's, or else of its highest voltage."""
    measured = [bus for bus in station.buses if bus in grid.pmus]
    kv = {bus.number: bus.base_kv for bus in grid.buses}
    return measured[0] if measured else max(station.buses, key=lambda bus: (kv[bus], -bus))


def _lines(grid: PowerGrid, stations: Sequence[Station]) -> list[dict[str, Any]]:
    at_bus = {bus: station.name for station in stations for bus in station.buses}
    kv = {bus.number: bus.base_kv for bus in grid.buses}
    circuits: dict[frozenset[str], list[float]] = {}
    for branch in grid.branches:
        ends = frozenset((at_bus[branch.start], at_bus[branch.end]))
        circuits.setdefault(ends, []).append(max(kv[branch.start], kv[branch.end]))
    return [
        {
            "a": line.a,
            "b": line.b,
            "km": line.km,
            "kv": max(circuits[frozenset((line.a, line.b))]),
            "circuits": len(circuits[frozenset((line.a, line.b))]),
        }
        for line in lines_of(grid, stations)
    ]


def _node(name: str, buses: Sequence[int], x: float | None, y: float | None) -> dict[str, Any]:
    kind = "substation" if buses else "control centre" if name.startswith(PREFIX) else "router"
    return {"name": name, "kind": kind, "buses": list(buses), "x": x, "y": y}


def _links(spec: NetworkSpec | None) -> list[dict[str, Any]]:
    links = () if spec is None else spec.links
    return [
        {"a": x.a, "b": x.b, "rate_bps": x.rate_bps, "propagation_s": x.propagation_ns / NS_PER_S}
        for x in links
    ]


def _outages(spec: NetworkSpec | None) -> list[dict[str, Any]]:
    """Return when a link (by number) goes down and works again."""
    changes = () if spec is None else spec.changes
    return [
        {"t_s": c.at_ns / NS_PER_S, "link": c.link, "is_down": isinstance(c, LinkCut)}
        for c in changes
        if isinstance(c, LinkCut | LinkRepair)
    ]


def _with_neighbours(
    given: Mapping[str, tuple[float, float]], facts: Mapping[str, Any]
) -> dict[str, tuple[float, float]]:
    known = {name: np.array(xy, np.float64) for name, xy in given.items()}
    middle = np.mean(list(known.values()), axis=0)
    waiting = [s["name"] for s in facts["stations"] if s["name"] not in known]
    while waiting:
        # The one with most placed neighbours first; without any, the middle of all has to do.
        best = max(waiting, key=lambda name: len(_neighbours(name, facts) & known.keys()))
        near = [known[name] for name in sorted(_neighbours(best, facts) & known.keys())]
        known[best] = PULL * np.mean(near, axis=0) + (1 - PULL) * middle if near else middle
        waiting.remove(best)
    return {name: (round(float(x), 1), round(float(y), 1)) for name, (x, y) in known.items()}


def _neighbours(name: str, facts: Mapping[str, Any]) -> set[str]:
    pairs = [(line["a"], line["b"]) for line in facts["lines"]]
    return {b if a == name else a for a, b in pairs if name in (a, b)}


def _laid_out(facts: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    # Half a second of imports, only for those who have no places.
    import networkx as nx

    from tieline.network.topologies.layout import layout

    names = list(dict.fromkeys(p["name"] for key in ("stations", "nodes") for p in facts[key]))
    lengths = [(line["a"], line["b"], line["km"]) for line in facts["lines"]]
    # A link without propagation has a length all the same.
    lengths += [
        (link["a"], link["b"], 1.0 + link["propagation_s"] * NS_PER_S / NS_PER_KM)
        for link in facts["links"]
    ]
    graph: nx.Graph[str] = nx.Graph()
    graph.add_nodes_from(names)
    for a, b, km in lengths:
        known = graph.get_edge_data(a, b, {"km": km})
        graph.add_edge(a, b, km=min(km, known["km"]))
    parts = [min(part) for part in nx.connected_components(graph)]
    graph.add_edges_from(((parts[0], other) for other in parts[1:]), km=APART_KM)
    # Stations next to each other must not cover each other for the sake of a long line elsewhere.
    corridors = [Corridor(a, b, float(d["km"]) ** 0.5) for a, b, d in graph.edges(data=True)]
    first = [s["name"] for s in facts["stations"] if s["area"] == next(iter(facts["areas"]), None)]
    xy = _turned(layout(names, corridors, first if len(facts["areas"]) > 2 else ()), facts, names)
    return {
        name: (round(float(x), 1), round(float(y), 1))
        for name, (x, y) in zip(names, xy, strict=True)
    }


def _turned(
    xy: NDArray[np.float64], facts: Mapping[str, Any], names: Sequence[str]
) -> NDArray[np.float64]:
    """Return the places with the first of two areas on the left, as such systems are drawn."""
    if len(facts["areas"]) != 2:
        return xy
    area = {station["name"]: station["area"] for station in facts["stations"]}
    left = xy[[area.get(name) == facts["areas"][0] for name in names]]
    if not len(left):
        return xy
    cos, sin = -left.mean(axis=0) / max(float(np.hypot(*left.mean(axis=0))), 1e-9)
    return np.asarray(xy @ np.array([[cos, -sin], [sin, cos]]), np.float64)
