"""Parts of a network that nothing joins."""

from collections.abc import Iterable
from typing import TypeVar

Name = TypeVar("Name", int, str)


def parts_of(names: Iterable[Name], pairs: Iterable[tuple[Name, Name]]) -> list[set[Name]]:
    """Return the connected parts, the largest first, among equals that with the least name.

    Args:
        names: of all nodes.
        pairs: nodes that something joins.
    """
    neighbours: dict[Name, set[Name]] = {name: set() for name in names}
    for a, b in pairs:
        neighbours[a].add(b)
        neighbours[b].add(a)
    parts: list[set[Name]] = []
    seen: set[Name] = set()
    for name in neighbours:
        if name not in seen:
            parts.append(_reached(name, neighbours))
            seen |= parts[-1]
    return sorted(parts, key=lambda part: (-len(part), min(part)))


def _reached(start: Name, neighbours: dict[Name, set[Name]]) -> set[Name]:
    found = {start}
    edge = [start]
    while edge:
        new = neighbours[edge.pop()] - found
        found |= new
        edge += new
    return found
