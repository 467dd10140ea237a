"""Finds the corridors whose cut parts a network: links that are disjoint may share their fibre."""

from collections.abc import Sequence
from itertools import pairwise

from tieline.network.parts import parts_of
from tieline.network.topologies.draft import DraftLink

Pair = tuple[str, str]


def severing_corridors(
    names: Sequence[str], links: Sequence[DraftLink]
) -> dict[Pair, tuple[str, ...]]:
    """Return the nodes that lose the rest when one corridor is cut, by corridor, in order.

    A cut takes every link whose fibre passes the corridor; the corridors of a link are those
    between the places that it passes. The largest part left counts as the rest.
    """
    along: dict[Pair, list[DraftLink]] = {}
    for link in links:
        for a, b in pairwise((link.a, *link.through, link.b)):
            along.setdefault((min(a, b), max(a, b)), []).append(link)
    found = {}
    for corridor, cut in sorted(along.items()):
        lost = {frozenset((link.a, link.b)) for link in cut}
        pairs = [(x.a, x.b) for x in links if frozenset((x.a, x.b)) not in lost]
        parts = parts_of(names, pairs)
        if len(parts) > 1:
            found[corridor] = tuple(sorted(name for part in parts[1:] for name in part))
    return found
