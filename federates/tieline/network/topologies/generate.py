"""Makes whole topologies: star, ring, mesh, hierarchical, along-lines; of a case or any size."""

from collections.abc import Sequence

from tieline.errors import InputError
from tieline.network.spec import Node
from tieline.network.topologies.draft import Draft, LinkDefaults, link_along, links_between
from tieline.network.topologies.flat import mesh, ring, star
from tieline.network.topologies.layout import layout
from tieline.network.topologies.levels import Group, levels
from tieline.network.topologies.options import Options
from tieline.network.topologies.places import ROUTE_FACTOR, Lines, Places, Way, random_land
from tieline.network.topologies.power_grid import PowerGrid
from tieline.network.topologies.stations import Corridor, Station, corridors_of, stations_of

MOST_NODES = 100_000

USUAL_DEGREE = 3.0

STATIONS = (
    "nodes: substations. Buses joined by a transformer without resistance, or by a branch of at "
    "most 0.0011 pu reactance, are one station. A station bears the number of its PMU's bus, or "
    "else of its bus of highest voltage. x and y (km) are no geography: a layout of the distances "
    "along the lines."
)
FIBRE = (
    "Propagation is 5 us/km, optical fibre of ITU-T G.114, annex A, rounded to 1 us. 'by' names "
    "what the fibre of a link passes without a stop."
)
ALONG_LINES = (
    "lengths: along the transmission corridors. A corridor is as long as its shortest circuit, a "
    "circuit as its reactance at 0.325 ohm/km (500 kV), 0.367 (345 kV) and 0.488 (230 kV), typical "
    f"lines of P. Kundur, Power System Stability and Control (1994), table 6.1. {FIBRE}"
)
OVER_LAND = (
    f"lengths: {ROUTE_FACTOR:g} times the straight distance, the factor of ITU-T G.826 for less "
    f"than 1,000 km. {FIBRE}"
)
AS_GIVEN = "lengths: every link has the same length or propagation, as given."


def for_case(kind: str, grid: PowerGrid, options: Options) -> Draft:
    """Return a topology of a case: its substations, joined along its transmission corridors.

    Args:
        kind: one of `options.KINDS`.
        grid: the case.
        options: what the kind can be told.

    Raises:
        InputError: an option does not fit the case, or no line joins some of its stations.
    """
    stations = stations_of(grid)
    corridors = corridors_of(grid, stations)
    names = [station.name for station in stations]
    upward = [station.name for station in stations if station.area in grid.areas[:1]]
    # Positions enter the choice of regions: whole kilometres are the same on every computer.
    places = Lines(names, corridors, layout(names, corridors, upward).round())
    nodes = _nodes(places, [station.buses for station in stations])
    title = f"Communication network of the case {grid.name}: {kind}."
    if kind == "along-lines":
        text = "links: one along each transmission corridor."
        links = _along(corridors, options.links)
        return Draft(
            (title, STATIONS, text, _lengths(ALONG_LINES, options)), options.links, nodes, links
        )
    head = (title, STATIONS, _lengths(ALONG_LINES, options))
    return _joined(kind, places, nodes, _areas(grid, stations), options, head)


def generated(kind: str, count: int, seed: int, spacing_km: float, options: Options) -> Draft:
    """Return a topology of substations that are spread evenly at random over a square.

    The k-th substation holds bus k, so that PMUs and controllers can stand there.

    Args:
        kind: one of `options.KINDS` but `along-lines`.
        count: substations, 3 to `MOST_NODES`; a star may have 2.
        seed: of the places; all else follows from them.
        spacing_km: the square has an area of this squared for each substation.
        options: what the kind can be told.

    Raises:
        InputError: a kind, number or option that is not allowed.
    """
    least = 2 if kind == "star" else 3
    if kind == "along-lines":
        raise InputError("along-lines follows the lines of a case: give a case, not --nodes")
    if not least <= count <= MOST_NODES:
        raise InputError(f"--nodes must be from {least} to {MOST_NODES} for {kind} (got {count})")
    places = random_land(count, seed, spacing_km, ROUTE_FACTOR)
    nodes = _nodes(places, [(i,) for i in range(1, count + 1)])
    title = f"A generated communication network: {kind}, {count} nodes, seed {seed}."
    text = (
        f"nodes: substations at random places of a square, one for each {spacing_km:g} km squared; "
        "x and y in km. Substation k holds bus k."
    )
    head = (title, text, _lengths(OVER_LAND, options))
    return _joined(kind, places, nodes, None, options, head)


def _joined(
    kind: str,
    places: Places,
    nodes: tuple[Node, ...],
    areas: Sequence[Group] | None,
    options: Options,
    head: tuple[str, ...],
) -> Draft:
    if kind == "hierarchical":
        return levels(places, nodes, areas, options, head)
    if kind == "star":
        pairs, hub = star(places, options.hub)
        text = f"links: from every node to {hub}; each link is a single point of failure."
    elif kind == "ring":
        pairs = set(ring(places, range(len(places.names))))
        text = "links: a ring through all nodes, a short tour."
    else:
        most = len(places.names) - 1
        degree = min(USUAL_DEGREE, most) if options.degree is None else options.degree
        pairs = mesh(places, degree)
        text = (
            "links: a ring through all nodes, a short tour, and the shortest further links up to "
            f"{degree:g} a node on average."
        )
    links = links_between(places, sorted(pairs), options.links)
    return Draft((*head, text), options.links, nodes, links)


def _along(corridors: Sequence[Corridor], defaults: LinkDefaults) -> tuple:
    return tuple(link_along((c.a, c.b), Way(c.km, (c.a, c.b)), defaults) for c in corridors)


def _lengths(text: str, options: Options) -> str:
    is_given = options.links.propagation_ns is not None or options.links.km is not None
    return AS_GIVEN if is_given else text


def _nodes(places: Places, buses: Sequence[tuple[int, ...]]) -> tuple[Node, ...]:
    return tuple(
        Node(name, own, float(x), float(y))
        for name, own, (x, y) in zip(places.names, buses, places.xy_km, strict=True)
    )


def _areas(grid: PowerGrid, stations: Sequence[Station]) -> list[Group]:
    members = {
        area: [i for i, station in enumerate(stations) if station.area == area]
        for area in (*grid.areas, "")
    }
    return [(area, found) for area, found in members.items() if found]
