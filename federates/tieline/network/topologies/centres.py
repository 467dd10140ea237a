"""Control centres of a hierarchical network, and the background traffic that they cause."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tieline.network.spec import Node
from tieline.network.topologies.constants import PREFIX
from tieline.network.topologies.draft import DraftCross, DraftLink, LinkDefaults, link_along
from tieline.network.topologies.flat import ring
from tieline.network.topologies.hierarchical import Region
from tieline.network.topologies.places import Floats, Places, Way

APART = 0.04
"""Share of the picture's size by which a centre stands off its gateway in x and y (chosen)."""

CITY_KM = 20.0
"""From a control centre, which stands in a city, to the nearest gateway (chosen)."""


@dataclass(frozen=True)
class Traffic:
    """Background traffic of control centres; rates count payload, UDP and IPv4 headers.

    Attributes:
        telemetry_bps: CBR from each substation to its region's centre: measurements and video.
        telemetry_payload: bytes of each of its packets.
        data_bps: Poisson between the centres of neighbouring regions, each way: planning data,
            markets and telephony of many users.
        data_payload: bytes of each of its packets.
    """

    telemetry_bps: int = 256_000
    telemetry_payload: int = 1300
    data_bps: int = 16_000_000
    data_payload: int = 972


def control_centres(
    places: Places, regions: Sequence[Region], defaults: LinkDefaults, rate_bps: int | None
) -> tuple[tuple[Node, ...], tuple[DraftLink, ...]]:
    """Return a control centre for each region, and its links to the region's two gateways.

    A centre lies `CITY_KM` from the first gateway; in x and y it stands where most room is. Its
    fibre to the second gateway is as much longer as that is farther
    off. In a region of one place the nearest place of another region stands in for that gateway.
    """
    off_km = max(CITY_KM, APART * float(np.ptp(places.xy_km, axis=0).max()))
    nodes, links = [], []
    for region in regions:
        name = f"{PREFIX}{region.name}"
        first, second = region.gateways
        x, y = _roomiest(places.xy_km, first, off_km)
        nodes.append(Node(name, (), round(float(x)), round(float(y))))
        if second == first:
            second = _nearest(places, first)
        for gateway in dict.fromkeys((first, second)):
            way = places.way(first, gateway) if gateway != first else Way(0.0, ())
            through = (name, *way.through[1:-1], places.names[gateway])
            ends = (name, places.names[gateway])
            links.append(link_along(ends, Way(CITY_KM + way.km, through), defaults, rate_bps))
    return tuple(nodes), tuple(links)


def traffic_of(
    places: Places, regions: Sequence[Region], traffic: Traffic
) -> tuple[DraftCross, ...]:
    """Return the background traffic of control centres, one in each region."""
    cross = [
        DraftCross(
            "cbr",
            places.names[at],
            f"{PREFIX}{region.name}",
            traffic.telemetry_bps,
            traffic.telemetry_payload,
        )
        for region in regions
        for at in sorted(region.members)
    ]
    centre = {region.gateways[0]: f"{PREFIX}{region.name}" for region in regions}
    for a, b in ring(places, list(centre)):
        for start, end in ((a, b), (b, a)):
            cross.append(
                DraftCross(
                    "poisson", centre[start], centre[end], traffic.data_bps, traffic.data_payload
                )
            )
    return tuple(cross)


def _roomiest(xy_km: Floats, at: int, off_km: float) -> Floats:
    """Return the spot around a place that is farthest from every other place."""
    angles = np.arange(16) * np.pi / 8
    spots = xy_km[at] + off_km * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    others = np.delete(xy_km, at, axis=0)
    room = [np.hypot(*(others - spot).T).min(initial=np.inf) for spot in spots]
    return np.asarray(spots[int(np.argmax(room))], np.float64)


def _nearest(places: Places, at: int) -> int:
    others = np.delete(np.arange(len(places.names)), at)
    return int(others[np.argmin(places.km(at, others))])
