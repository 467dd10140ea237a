"""Routes: shortest by delay, hops or cost, split among equals, or fixed by hand."""

import hashlib
import heapq
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tieline.network.spec import FRAME_BYTES, Link, Route, service_ns

Metric = Literal["delay", "hops", "cost"]
Pair = tuple[str, str]

COST_UNITS = 1_000_000
"""Costs are compared in millionths, so that sums of them are exact."""


@dataclass(frozen=True)
class Routing:
    """How routes are found.

    Attributes:
        metric: what a route has least of: time of a PMU frame when nothing waits, links, or cost.
        is_split: whether flows are spread over routes of equal length, each by its own number.
        convergence_ns: from a failure or repair until routes follow it; None: they never do.
        fixed: routes from one node to another that are never looked for.
    """

    metric: Metric = "delay"
    is_split: bool = False
    convergence_ns: int | None = None
    fixed: Mapping[Pair, Route] = field(default_factory=dict)


class Router:
    """The routes of a network, some of whose links are down.

    Nodes and links enter the search in alphabetical order, so the order in which a file or a
    dictionary gives them changes nothing. Among routes of equal length the one of fewer links wins,
    then the first alphabetically; if flows are split, all of equal length are taken in turn.
    """

    def __init__(
        self,
        routing: Routing,
        nodes: Iterable[str],
        links: Sequence[Link],
        down: Collection[int] = (),
    ) -> None:
        self._routing = routing
        self._names = sorted(set(nodes))
        self._number_of = {name: number for number, name in enumerate(self._names)}
        self._lengths: list[dict[int, int]] = [{} for _ in self._names]
        up = [link for number, link in enumerate(links) if number not in down]
        # One more than any route has links: a route of fewer links wins among those of equal
        # length, and never against a shorter one.
        scale = 1 if routing.is_split else len(self._names) + 1
        for link in sorted(up, key=lambda link: sorted((link.a, link.b))):
            length = _length(link, routing.metric) * scale
            # No link has length zero: equal ways could go round in a circle.
            length = length or 1 if routing.is_split else length + 1
            a, b = sorted((self._number_of[link.a], self._number_of[link.b]))
            self._lengths[a][b] = self._lengths[b][a] = length
        self._previous: dict[str, NDArray[np.int32]] = {}
        self._before: dict[str, list[list[int]]] = {}

    def route(self, origin: str, target: str, flow: str = "") -> Route | None:
        """Return the route of a flow, or None if there is none.

        Args:
            origin, target: its ends.
            flow: names it; flows of different names are spread over equal routes.
        """
        fixed = self._routing.fixed.get((origin, target))
        if fixed is not None:
            return fixed
        if self._routing.is_split:
            return self._spread(origin, target, flow)
        if origin not in self._previous:
            self._previous[origin] = self._tree(origin)
        previous, place = self._previous[origin], self._number_of[target]
        if previous[place] < 0:
            return None
        way = [place]
        while previous[place] != place:
            place = previous[place]
            way.append(place)
        return tuple(self._names[place] for place in reversed(way))

    def _tree(self, origin: str) -> NDArray[np.int32]:
        """Return (nodes,) the node before each on its way from an origin: itself there, or -1.

        A number for each node: whole paths would take memory with the square of the network.
        """
        start = self._number_of[origin]
        before = self._ways(start)
        before[start] = [start]
        return np.array([ways[0] if ways else -1 for ways in before], dtype=np.int32)

    def _spread(self, origin: str, target: str, flow: str) -> Route | None:
        """Walk back from the target, at each node along one of the equal ways."""
        start, place = self._number_of[origin], self._number_of[target]
        if origin not in self._before:
            self._before[origin] = self._ways(start)
        before = self._before[origin]
        if place != start and not before[place]:
            return None
        path = [place]
        while path[-1] != start:
            choices = sorted(before[path[-1]])
            number = _number(f"{flow} at {self._names[path[-1]]}")
            path.append(choices[number % len(choices)])
        return tuple(self._names[place] for place in reversed(path))

    def _ways(self, start: int) -> list[list[int]]:
        """Return the nodes that come before each on its shortest ways from a start.

        They stand in the order in which the search settles them (Dijkstra 1959): by their own
        distance, equal ones in the order in which that was found.
        """
        before: list[list[int]] = [[] for _ in self._names]
        found: list[int | None] = [None] * len(self._names)
        is_settled = bytearray(len(self._names))
        found[start] = 0
        pending, order = [(0, 0, start)], 1
        while pending:
            distance, _, node = heapq.heappop(pending)
            if is_settled[node]:
                continue
            is_settled[node] = 1
            for other, length in self._lengths[node].items():
                known, way = found[other], distance + length
                if known is None or way < known:
                    found[other], before[other] = way, [node]
                    heapq.heappush(pending, (way, order, other))
                    order += 1
                elif way == known:
                    before[other].append(node)
        return before


def routes_from(
    origins: Iterable[str], nodes: Iterable[str], links: Sequence[Link]
) -> dict[str, dict[str, Route]]:
    """Return the route of least delay from each origin to every node that it reaches."""
    names = sorted(nodes)
    router = Router(Routing(), names, links)
    routes: dict[str, dict[str, Route]] = {}
    for origin in sorted(set(origins)):
        found = {target: router.route(origin, target) for target in names}
        routes[origin] = {target: route for target, route in found.items() if route is not None}
    return routes


def fault_of(route: Route, links: Collection[Pair]) -> str | None:
    """Return what is wrong with a route that was fixed by hand, or None.

    Args:
        route: its nodes.
        links: the pairs of nodes that a link joins, both ways round.
    """
    twice = [name for name in dict.fromkeys(route) if route.count(name) > 1]
    if twice:
        return f"is a loop: it passes {twice[0]} twice"
    for pair in pairwise(route):
        if pair not in links:
            return f"uses a link {pair[0]}-{pair[1]} that there is not"
    return None


def _length(link: Link, metric: Metric) -> int:
    if metric == "hops":
        return 1
    if metric == "cost":
        return round(link.cost * COST_UNITS)
    return service_ns(link, FRAME_BYTES) + link.propagation_ns


def _number(name: str) -> int:
    return int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "little")
