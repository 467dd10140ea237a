"""Networks of one level: star, ring and mesh."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from tieline.errors import InputError
from tieline.network.topologies.places import Places

Pairs = set[tuple[int, int]]

MOST_TO_IMPROVE = 400
"""Places up to which a tour is shortened by exchanging its sections."""


def star(places: Places, hub: str | None = None) -> tuple[Pairs, str]:
    """Return a link from every place to the hub, and the hub's name.

    Args:
        places: at least two.
        hub: its name; by default the place with the least sum of distances to all others.

    Raises:
        InputError: there is no such place.
    """
    if hub is not None and hub not in places.names:
        raise InputError(
            f"--hub '{hub}' is none of the {len(places.names)} nodes, "
            f"{places.names[0]} to {places.names[-1]}"
        )
    centre = places.names.index(hub) if hub else central(places, range(len(places.names)))
    others = (at for at in range(len(places.names)) if at != centre)
    return {ordered(centre, at) for at in others}, places.names[centre]


def ring(places: Places, members: Iterable[int]) -> list[tuple[int, int]]:
    """Return the links of a ring through some places, in order around it.

    Two places have one link and one has none. The ring is the tour of the nearest next place from
    the first one; with at most `MOST_TO_IMPROVE` places it is shortened until no exchange of two
    links shortens it further.
    """
    tour = _nearest_tour(places, list(members))
    if 4 <= len(tour) <= MOST_TO_IMPROVE:
        tour = _without_crossings(places, tour)
    pairs = [ordered(a, b) for a, b in zip(tour, tour[1:] + tour[:1], strict=True) if a != b]
    return pairs[:1] if len(tour) == 2 else pairs


def mesh(places: Places, degree: float) -> Pairs:
    """Return a ring through all places and the shortest further links up to a mean degree.

    Args:
        places: at least three.
        degree: links that a place has on average, 2 (the ring alone) to n - 1 (every pair).

    Raises:
        InputError: the degree is out of these bounds.
    """
    count = len(places.names)
    if not 2 <= degree <= max(2, count - 1):
        raise InputError(
            f"--degree must be from 2 to {max(2, count - 1)} for {count} nodes (got {degree:g})"
        )
    pairs = set(ring(places, range(count)))
    wanted = round(degree * count / 2)
    near = min(count - 1, 2 * int(np.ceil(degree)))
    while len(pairs) < wanted:
        for pair in _shortest(places, near):
            if len(pairs) >= wanted:
                break
            pairs.add(pair)
        near = min(count - 1, 2 * near)
    return pairs


def central(places: Places, members: Iterable[int]) -> int:
    """Return the member with the least sum of distances to the members; of equals the first.

    For many members it measures to the middle of them all instead, which takes no matrix.
    """
    chosen = np.array(list(members))
    if len(chosen) > MOST_TO_IMPROVE:
        offset = places.xy_km[chosen] - places.xy_km[chosen].mean(axis=0)
        return int(chosen[np.argmin(np.hypot(offset[:, 0], offset[:, 1]))])
    sums = [places.km(int(at), chosen).sum() for at in chosen]
    return int(chosen[np.argmin(np.round(sums, 6))])


def ordered(a: int, b: int) -> tuple[int, int]:
    """Return two numbers, the smaller first."""
    return (a, b) if a < b else (b, a)


def _shortest(places: Places, near: int) -> list[tuple[int, int]]:
    neighbours, km = places.neighbours(near)
    order = np.argsort(km, axis=None, kind="stable")
    starts = order // near
    ends = neighbours.ravel()[order]
    return [ordered(int(a), int(b)) for a, b in zip(starts, ends, strict=True)]


def _nearest_tour(places: Places, members: list[int]) -> list[int]:
    left = np.array(members[1:], np.int64)
    tour = members[:1]
    while len(left):
        at = int(np.argmin(places.km(tour[-1], left)))
        tour.append(int(left[at]))
        left = np.delete(left, at)
    return tour


def _without_crossings(places: Places, tour: list[int]) -> list[int]:
    """Return a tour that no exchange of two links shortens ('2-opt')."""
    km: NDArray[np.float64] = np.array([places.km(at, np.array(tour)) for at in tour])
    order = np.arange(len(tour))
    is_better = True
    while is_better:
        is_better = False
        for i in range(len(tour) - 2):
            a, b = order[i], order[i + 1]
            j = np.arange(i + 2, len(tour) - (i == 0))
            c, d = order[j], order[(j + 1) % len(tour)]
            gain = km[a, b] + km[c, d] - km[a, c] - km[b, d]
            if len(j) and gain.max() > 1e-9:
                end = int(j[np.argmax(gain)])
                order[i + 1 : end + 1] = order[i + 1 : end + 1][::-1]
                is_better = True
    return [tour[at] for at in order]
