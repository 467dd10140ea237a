"""What happens to a network, from what a file says to the changes that the engine does."""

from collections.abc import Callable, Iterable, Sequence

from tieline.network.schema import EventEntry
from tieline.network.spec import (
    Change,
    CrossFlow,
    Flow,
    Link,
    LinkCut,
    LinkRepair,
    LossChange,
    RateChange,
    Reroute,
    Route,
)
from tieline.units import seconds_to_ns

LINK_CHANGES = (LinkCut, LinkRepair)

RouteOf = Callable[[frozenset[int]], Callable[[str, str, str], Route | None]]
"""Given the links that are down, what finds the route of a flow: origin, target, name."""


def changes_of(events: Sequence[EventEntry], links: Sequence[Link]) -> list[Change]:
    """Return the changes of links, in the order of time; those of one instant as the file has them.

    A link that two events take down is up again when the last of them ends.
    """
    changes: list[Change] = []
    for event in events:
        begin_ns = seconds_to_ns(event.at)
        end_ns = None if event.lasts is None else seconds_to_ns(event.at + event.lasts)
        for number in _links_of(event, links):
            link = links[number]
            begin, end = _pair(event, begin_ns, end_ns, number, link)
            changes.append(begin)
            if end is not None:
                changes.append(end)
    changes.sort(key=lambda change: change.at_ns)
    return _merged(changes)


def rerouted(
    changes: Sequence[Change],
    convergence_ns: int,
    flows: Sequence[Flow],
    cross_flows: Sequence[CrossFlow],
    ends: Sequence[tuple[str, str]],
    route_of: RouteOf,
) -> list[Change]:
    """Return changes with the routes that follow each failure and repair after a time.

    Args:
        changes: of links, in the order of time.
        convergence_ns: how much later the routes follow.
        flows, cross_flows: what is routed; a flow that has no way any more keeps the one it had.
        ends: the first and last node of each PMU flow.
        route_of: finds routes.
    """
    down: set[int] = set()
    states: dict[int, frozenset[int]] = {}
    for change in changes:
        if isinstance(change, LinkCut):
            down.add(change.link)
        elif isinstance(change, LinkRepair):
            down.discard(change.link)
        else:
            continue
        states[change.at_ns + convergence_ns] = frozenset(down)
    names = [f"flow {number}" for number in range(len(flows))]
    now = {number: flow.route for number, flow in enumerate(flows)}
    now |= {len(flows) + number: flow.route for number, flow in enumerate(cross_flows)}
    back = {len(flows) + number: flow.way_back for number, flow in enumerate(cross_flows)}
    reroutes: list[Change] = []
    for at_ns, links in states.items():
        route = route_of(links)
        found = {n: route(*ends[n], names[n]) for n in range(len(flows))}
        ways_back = {}
        for number, cross in enumerate(cross_flows, len(flows)):
            origin, target = cross.route[0], cross.route[-1]
            found[number] = route(origin, target, cross.name)
            ways_back[number] = route(target, origin, cross.name)
        moved = {n: way for n, way in found.items() if way is not None and way != now[n]}
        moved_back = {n: way for n, way in ways_back.items() if way and way != back[n]}
        now |= moved
        back |= moved_back
        if moved or moved_back:
            reroutes.append(Reroute(at_ns, moved, moved_back))
    return sorted([*changes, *reroutes], key=lambda change: change.at_ns)


def _links_of(event: EventEntry, links: Sequence[Link]) -> Iterable[int]:
    """Return the links of an event: one, those of a node, or all."""
    if event.node is not None:
        return [n for n, link in enumerate(links) if event.node in (link.a, link.b)]
    if event.link is not None:
        return [n for n, link in enumerate(links) if {link.a, link.b} == set(event.link)]
    return range(len(links))


def _pair(
    event: EventEntry, begin_ns: int, end_ns: int | None, number: int, link: Link
) -> tuple[Change, Change | None]:
    """Return the change of one link as an event begins, and as it ends."""
    if event.rate is not None:
        changes: tuple[Change, Change] = (
            RateChange(begin_ns, number, round(event.rate)),
            RateChange(end_ns or 0, number, link.rate_bps),
        )
    elif event.probability is not None:
        changes = (
            LossChange(begin_ns, number, event.probability),
            LossChange(end_ns or 0, number, 0.0),
        )
    else:
        changes = LinkCut(begin_ns, number), LinkRepair(end_ns or 0, number)
    return changes[0], None if end_ns is None else changes[1]


def _merged(changes: Sequence[Change]) -> list[Change]:
    """Leave out cuts of links that are down, and repairs while another event holds them down."""
    holds: dict[int, int] = {}
    kept: list[Change] = []
    for change in changes:
        if isinstance(change, LINK_CHANGES):
            before = holds.get(change.link, 0)
            after = before + (1 if isinstance(change, LinkCut) else -1)
            holds[change.link] = after
            if (before == 0) == (after == 0):
                continue
        kept.append(change)
    return kept
