"""Where network nodes stand and how far it is from one to another, along lines or over land."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import networkx as nx
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from tieline.network.topologies.stations import Corridor
from tieline.streams import stream

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Pair = tuple[str, str]

ROUTE_FACTOR = 1.5
"""Length of a cable over the great-circle distance: ITU-T G.826 for less than 1,000 km."""

DETOUR = 3.0
"""Kilometres of detour that are accepted to keep a kilometre out of a corridor to be avoided
(chosen); more would send packets around half a continent."""


@dataclass(frozen=True)
class Way:
    """How a link gets from one place to another.

    Attributes:
        km: its length.
        through: the places that it passes, ends included.
        shared_km: the part of its length in corridors that should be avoided.
    """

    km: float
    through: tuple[str, ...]
    shared_km: float = 0.0

    @property
    def cost_km(self) -> float:
        """Return the length with what is shared counted as a detour."""
        return self.km + DETOUR * self.shared_km

    @property
    def corridors(self) -> frozenset[Pair]:
        """Return the corridors along the way."""
        return frozenset(_pair(a, b) for a, b in pairwise(self.through))


class Places(Protocol):
    """Places by number, with the distances between them.

    Attributes:
        names: of each place.
        xy_km: (n, 2), for drawing and for cutting regions.
        has_corridors: whether ways follow corridors, which they may share.
    """

    names: tuple[str, ...]
    xy_km: Floats
    has_corridors: bool

    def km(self, at: int, among: Integers) -> Floats:
        """Return (m,) the distances from one place to some places (m,)."""

    def ends(self) -> Integers:
        """Return the places that one corridor alone leads to."""

    def neighbours(self, count: int) -> tuple[Integers, Floats]:
        """Return (n, count) the nearest places of each place, itself left out, and how far."""

    def way(self, a: int, b: int, avoid: Collection[Pair] = ()) -> Way:
        """Return the way of least cost, see `Way`."""


class Land:
    """Places on a plain: cables take `factor` times the straight distance.

    Args:
        names: of the places.
        xy_km: (n, 2).
        factor: cable length over straight distance.
    """

    has_corridors = False

    def __init__(self, names: Sequence[str], xy_km: Floats, factor: float = ROUTE_FACTOR) -> None:
        self.names = tuple(names)
        self.xy_km = xy_km
        self.factor = factor

    def km(self, at: int, among: Integers) -> Floats:
        """Return distances, see `Places`."""
        offset = self.xy_km[among] - self.xy_km[at]
        return np.asarray(self.factor * np.hypot(offset[:, 0], offset[:, 1]), np.float64)

    def ends(self) -> Integers:
        """Return no place: on a plain there are no corridors."""
        return np.zeros(0, np.int64)

    def neighbours(self, count: int) -> tuple[Integers, Floats]:
        """Return the nearest places, see `Places`."""
        # A fifth of a second, only for those who lay out a network.
        from scipy.spatial import cKDTree

        km, near = cKDTree(self.xy_km).query(self.xy_km, count + 1)
        own = near == np.arange(len(self.names))[:, None]
        # Of places that coincide, the nearest may not hold the place itself.
        own[~own.any(axis=1), -1] = True
        shape = (len(self.names), count)
        return (
            np.asarray(near[~own], np.int64).reshape(shape),
            np.asarray(self.factor * km[~own], np.float64).reshape(shape),
        )

    def way(self, a: int, b: int, avoid: Collection[Pair] = ()) -> Way:
        """Return the direct way, see `Places`; on a plain there are no corridors to avoid."""
        offset = self.xy_km[a] - self.xy_km[b]
        km = self.factor * float(np.hypot(offset[0], offset[1]))
        return Way(km, (self.names[a], self.names[b]))


class Lines:
    """Stations whose fibre lies along the transmission corridors of a grid.

    Args:
        names: of the stations.
        corridors: they join all stations.
        xy_km: (n, 2).
    """

    has_corridors = True

    def __init__(self, names: Sequence[str], corridors: Sequence[Corridor], xy_km: Floats) -> None:
        self.names = tuple(names)
        self.xy_km = xy_km
        self._graph: nx.Graph[str] = nx.Graph()
        self._graph.add_nodes_from(names)
        self._graph.add_weighted_edges_from((c.a, c.b, c.km) for c in corridors)
        self._km = distances_km(names, corridors)

    def km(self, at: int, among: Integers) -> Floats:
        """Return distances, see `Places`."""
        return np.asarray(self._km[at, among], np.float64)

    def ends(self) -> Integers:
        """Return the places with one corridor, see `Places`."""
        return np.array([i for i, name in enumerate(self.names) if self._graph.degree(name) == 1])

    def neighbours(self, count: int) -> tuple[Integers, Floats]:
        """Return the nearest places, see `Places`."""
        others = self._km.copy()
        np.fill_diagonal(others, np.inf)
        near = np.argsort(others, axis=1, kind="stable")[:, :count]
        return near, np.take_along_axis(others, near, axis=1)

    def way(self, a: int, b: int, avoid: Collection[Pair] = ()) -> Way:
        """Return the way along corridors, see `Places`."""

        def cost(start: str, end: str, data: dict[str, float]) -> float:
            return data["weight"] * (1.0 + DETOUR * (_pair(start, end) in avoid))

        through = nx.dijkstra_path(self._graph, self.names[a], self.names[b], weight=cost)
        lengths = {_pair(*pair): self._graph.edges[pair]["weight"] for pair in pairwise(through)}
        shared_km = sum(km for pair, km in lengths.items() if pair in avoid)
        return Way(float(sum(lengths.values())), tuple(through), float(shared_km))


def distances_km(names: Sequence[str], corridors: Sequence[Corridor]) -> Floats:
    """Return (n, n) the shortest distances along corridors."""
    place = {name: i for i, name in enumerate(names)}
    ends = [(place[c.a], place[c.b]) for c in corridors]
    lengths = [corridor.km for corridor in corridors]
    starts, stops = zip(*ends, strict=True) if ends else ((), ())
    graph = csr_array((lengths, (starts, stops)), shape=(len(names), len(names)))
    return np.asarray(dijkstra(graph, directed=False), np.float64)


def random_land(count: int, seed: int, spacing_km: float, factor: float) -> Land:
    """Return places spread evenly at random over a square, one for each `spacing_km` squared."""
    width = len(str(count))
    names = [f"S{i:0{width}d}" for i in range(1, count + 1)]
    side_km = spacing_km * count**0.5
    # Whole hundreds of metres, so that a file holds the very places that the lengths come from.
    xy_km = stream(seed, "places of a generated topology").uniform(0, side_km, (count, 2)).round(1)
    return Land(names, xy_km, factor)


def _pair(a: str, b: str) -> Pair:
    return (a, b) if a < b else (b, a)
