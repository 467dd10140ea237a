"""Networks of three levels: a core in two planes, a ring in each region, dual-homed substations.

    core       each region has two gateways; a ring (or mesh) joins the first gateways of all
               regions, another ring the second ones
    regional   a ring through both gateways and the region's other ring routers
    access     every other substation has a link to each of two ring routers of its region

With three nodes or more no link and no node is a single point of failure.
"""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from tieline.network.topologies.draft import DraftLink, LinkDefaults, link_along
from tieline.network.topologies.flat import ordered, ring
from tieline.network.topologies.places import Integers, Pair, Places

NEAREST_ROUTERS = 5
"""Ring routers, the nearest ones, among which a substation finds its two."""


@dataclass(frozen=True)
class Rates:
    """Bits a second of each level; None is the rate of the defaults."""

    core_bps: int | None = None
    regional_bps: int | None = None
    access_bps: int | None = None


@dataclass(frozen=True)
class Region:
    """A region: its members by number; the ring routers, the two gateways first."""

    name: str
    members: tuple[int, ...]
    routers: tuple[int, ...]

    @property
    def gateways(self) -> tuple[int, int]:
        """Return the first and the second gateway, one and the same in a region of one."""
        return self.routers[0], self.routers[min(1, len(self.routers) - 1)]


class _Builder:
    """Gathers links; a pair that has one keeps it."""

    def __init__(self, places: Places, defaults: LinkDefaults) -> None:
        self.places = places
        self.defaults = defaults
        self.links: dict[tuple[int, int], DraftLink] = {}

    def join(
        self, a: int, b: int, rate_bps: int | None, avoid: Collection[Pair] = ()
    ) -> frozenset[Pair]:
        """Add a link that keeps clear of some corridors, and return those that it uses."""
        a, b = ordered(a, b)
        way = self.places.way(a, b, avoid)
        if a != b and (a, b) not in self.links:
            names = (self.places.names[a], self.places.names[b])
            self.links[a, b] = link_along(names, way, self.defaults, rate_bps)
        return way.corridors


def regions_of(
    places: Places, groups: Sequence[tuple[str, Sequence[int]]], ring_size: int | None
) -> tuple[Region, ...]:
    """Return the regions with their ring routers.

    The first router is the most central member; each further one is the member that shortens the
    members' distances to their nearest router most. A place at the end of a single corridor is
    taken only when there is no other. The second gateway is the router nearest to all places.

    Args:
        places: of the members.
        groups: name and members of each region, all of them once.
        ring_size: routers in each ring; by default the square root of the number of members, three
            at least. A region with fewer members has them all in its ring.
    """
    regions = []
    everywhere = np.arange(len(places.names))
    for name, members in groups:
        size = min(len(members), ring_size or max(3, round(len(members) ** 0.5)))
        first, *others = _routers(places, np.array(members), size)
        reach = {at: float(places.km(at, everywhere).sum()) for at in others}
        others.sort(key=lambda at: round(reach[at], 6))
        regions.append(Region(name, tuple(members), (first, *others)))
    return tuple(regions)


def hierarchical(
    places: Places,
    regions: Sequence[Region],
    core: str,
    rates: Rates,
    defaults: LinkDefaults,
) -> tuple[DraftLink, ...]:
    """Return the links of a network of three levels, in the order of their names.

    The two links of a substation, the planes of the core and the links of one ring take different
    corridors as far as there are any.

    Args:
        places: where the nodes stand.
        regions: all places, once.
        core: `ring` or `mesh`, the shape of the first plane.
        rates: of each level.
        defaults: of the links.
    """
    builder = _Builder(places, defaults)
    _add_core(builder, regions, core, rates.core_bps)
    for region in regions:
        used: set[Pair] = set()
        for a, b in ring(places, region.routers):
            used |= builder.join(a, b, rates.regional_bps, used)
        _add_access(builder, region, rates.access_bps)
    return tuple(sorted(builder.links.values(), key=lambda link: (link.a, link.b)))


def halved(places: Places, members: Sequence[int], count: int) -> list[list[int]]:
    """Return `count` groups of about as many members each, cut across the longer side each time."""
    if count == 1:
        return [sorted(members)]
    xy = places.xy_km[list(members)]
    axis = int(np.argmax(np.ptp(xy, axis=0)))
    order = [members[i] for i in np.argsort(xy[:, axis], kind="stable")]
    left = count // 2
    at = round(len(order) * left / count)
    return [*halved(places, order[:at], left), *halved(places, order[at:], count - left)]


def _add_core(
    builder: _Builder, regions: Sequence[Region], core: str, rate_bps: int | None
) -> None:
    first = [region.gateways[0] for region in regions]
    second = {region.gateways[0]: region.gateways[1] for region in regions}
    around = ring(builder.places, first)
    plane: Iterable[tuple[int, int]] = around
    if core == "mesh":
        plane = combinations(sorted(first), 2)
    used = {ordered(a, b): builder.join(a, b, rate_bps) for a, b in plane}
    for a, b in around:
        builder.join(second[a], second[b], rate_bps, used[a, b])


def _add_access(builder: _Builder, region: Region, rate_bps: int | None) -> None:
    routers = np.array(region.routers)
    for at in sorted(set(region.members) - set(region.routers)):
        order = np.argsort(builder.places.km(at, routers), kind="stable")
        nearest, *others = routers[order[:NEAREST_ROUTERS]].tolist()
        used = builder.join(at, nearest, rate_bps)
        costs = {other: builder.places.way(at, other, used).cost_km for other in others}
        builder.join(at, min(others, key=lambda other: costs[other]), rate_bps, used)


def _routers(places: Places, members: Integers, count: int) -> list[int]:
    """Return `count` members, each the one that shortens the members' ways to a router most."""
    ends = np.isin(members, places.ends())
    candidates = np.concatenate([members[~ends], members[ends]])
    able = max(count, int((~ends).sum()))
    candidates = candidates[:able]
    km = np.array([places.km(int(at), members) for at in candidates]).round(6)
    nearest = np.full(len(members), np.inf)
    chosen: list[int] = []
    while len(chosen) < count:
        sums = np.minimum(km, nearest).sum(axis=1)
        sums[chosen] = np.inf
        chosen.append(int(np.argmin(sums)))
        nearest = np.minimum(nearest, km[chosen[-1]])
    return candidates[chosen].tolist()
