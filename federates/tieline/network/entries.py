"""The entries of a topology file, each checked by itself and against the others."""

from collections.abc import Mapping, Sequence
from typing import Any

import networkx as nx

from tieline.network.findings import Findings
from tieline.network.jitter import Jitter
from tieline.network.schema import (
    CrossEntry,
    JitterEntry,
    LinkDefaults,
    LinkEntry,
    NodeEntry,
    ProcessingEntry,
)
from tieline.network.spec import Link, Node
from tieline.units import seconds_to_ns
from tieline.yaml_lines import Document

SECTIONS = ("nodes", "links", "link_defaults", "pmu", "controller", "cross_traffic")

Sites = Sequence[Mapping[str, Any]]
"""Sources (`name`, `bus`) or destinations (`name`, `unit`, `bus`), as the run file lists them."""


class Entries:
    """What a topology file says, as far as it can be understood, and what is wrong with it.

    Attributes:
        sources, destinations: the sites that the network must join.
        nodes, links, cross: the entries that are right in themselves.
        pmu, controller: processing time in nanoseconds and its jitter.
        at_bus: the node of each bus.

    Args:
        document: the file.
        sources, destinations: PMUs and controllers.
        loss: loss probability of every link, in place of the file's own.
    """

    def __init__(
        self, document: Document, sources: Sites, destinations: Sites, loss: float | None
    ) -> None:
        self.sources = sources
        self.destinations = destinations
        self._loss = loss
        self._findings = Findings(document)
        self._data = self._findings.section(document.data, (), dict)
        if not isinstance(document.data, dict):
            self._findings.refuse()
        self._findings.keys(self._data, (), SECTIONS, required=("nodes", "links"))
        self.nodes = self._read_nodes()
        self._names = [node.name for node in self.nodes]
        self._defaults = self._read_defaults()
        self.links = self._read_links()
        self.pmu = self._read_processing("pmu")
        self.controller = self._read_processing("controller")
        self.cross = self._read_cross()
        self.at_bus = self._stations()
        self._check_sites()
        self._check_connected()

    def refuse(self) -> None:
        """Raise InputError with everything that is wrong, if anything is."""
        self._findings.refuse()

    def _read_nodes(self) -> tuple[Node, ...]:
        entries = self._findings.section(self._data.get("nodes", {}), ("nodes",), dict)
        nodes = []
        for name in entries:
            position = ("nodes", name)
            entry = self._findings.entry(entries[name] or {}, position, NodeEntry)
            if not isinstance(name, str):
                self._findings.add(position, f"a node's name must be text (got {name!r})")
            buses = () if entry is None else tuple(entry.buses)
            place = (None, None) if entry is None else (entry.x, entry.y)
            nodes.append(Node(str(name), buses, *place))
        return tuple(nodes)

    def _read_defaults(self) -> LinkDefaults | None:
        raw = self._data.get("link_defaults", {})
        return self._findings.entry(raw, ("link_defaults",), LinkDefaults)

    def _read_links(self) -> tuple[Link, ...]:
        entries = self._findings.section(self._data.get("links", []), ("links",), list)
        links = []
        first: dict[tuple[str, ...], int] = {}
        for index, raw in enumerate(entries):
            position = ("links", index)
            entry = self._findings.entry(raw, position, LinkEntry)
            if entry is None or not self._has_ends(entry.a, entry.b, position, ("a", "b")):
                continue
            pair = tuple(sorted((entry.a, entry.b)))
            if pair in first:
                line = self._findings.document.line(("links", first[pair]))
                text = f"duplicate link {pair[0]}-{pair[1]} (first on line {line})"
                self._findings.add(position, text)
            first.setdefault(pair, index)
            link = self._link(entry, position)
            if link is not None:
                links.append(link)
        return tuple(links)

    def _has_ends(
        self, origin: str, target: str, position: tuple[str, int], keys: tuple[str, str]
    ) -> bool:
        for name, key in zip((origin, target), keys, strict=True):
            self._findings.word(name, self._names, (*position, key), "node")
        if origin == target:
            text = f"{position[0]}.{position[1]} must join two nodes (got '{origin}' twice)"
            self._findings.add(position, text)
        return origin != target and {origin, target} <= set(self._names)

    def _link(self, entry: LinkEntry, position: tuple[str, int]) -> Link | None:
        if self._defaults is None:
            return None
        given = entry.filled(self._defaults)
        missing = [name for name in ("rate", "queue") if given[name] is None]
        for name in missing:
            text = f"link {entry.a}-{entry.b} has no '{name}', and link_defaults has none either"
            self._findings.add(position, text)
        if missing:
            return None
        return Link(
            entry.a,
            entry.b,
            round(given["rate"]),
            seconds_to_ns(entry.propagation),
            given["queue"],
            (given["loss"] or 0.0) if self._loss is None else self._loss,
            _jitter(given["jitter"]),
            given["overhead"] or 0,
        )

    def _read_processing(self, section: str) -> tuple[int, Jitter | None]:
        entry = self._findings.entry(self._data.get(section, {}), (section,), ProcessingEntry)
        return (seconds_to_ns(entry.processing), _jitter(entry.jitter)) if entry else (0, None)

    def _read_cross(self) -> list[CrossEntry]:
        raws = self._findings.section(self._data.get("cross_traffic", []), ("cross_traffic",), list)
        checked = []
        for index, raw in enumerate(raws):
            position = ("cross_traffic", index)
            entry = self._findings.entry(raw, position, CrossEntry)
            if entry and self._has_ends(entry.origin, entry.target, position, ("from", "to")):
                checked.append(entry)
        return checked

    def _stations(self) -> dict[int, str]:
        at_bus: dict[int, str] = {}
        for node in self.nodes:
            for place, bus in enumerate(node.buses):
                if bus in at_bus:
                    self._findings.add(
                        ("nodes", node.name, "buses", place),
                        f"bus {bus} is in node {at_bus[bus]} and again in node {node.name}",
                    )
                at_bus.setdefault(bus, node.name)
        return at_bus

    def _check_sites(self) -> None:
        if not isinstance(self._data.get("nodes"), dict):
            return
        for kind, sites in (("PMU", self.sources), ("controller", self.destinations)):
            for site in sites:
                if site["bus"] not in self.at_bus:
                    text = f"no node holds bus {site['bus']} of {kind} {site['name']}"
                    self._findings.add(("nodes",), text)

    def _check_connected(self) -> None:
        """Note every part of the network that no link joins to the largest one.

        It looks at the ends alone, so that a link with another fault still counts as one, and says
        nothing where an end is unknown: that link may be the one that is missing.
        """
        graph: nx.Graph[str] = nx.Graph()
        graph.add_nodes_from(self._names)
        for raw in self._findings.section(self._data.get("links", []), ("links",), list):
            a, b = (raw.get("a"), raw.get("b")) if isinstance(raw, dict) else (None, None)
            if a not in self._names or b not in self._names:
                return
            graph.add_edge(str(a), str(b))
        parts = sorted(nx.connected_components(graph), key=lambda part: (-len(part), min(part)))
        for part in parts[1:]:
            self._findings.add(("nodes", min(part)), self._cut_off(part))

    def _cut_off(self, part: set[str]) -> str:
        sites = (*self.sources, *self.destinations)
        lost = [str(site["name"]) for site in sites if self.at_bus.get(site["bus"]) in part]
        names = ", ".join(sorted(part))
        unreachable = f"; unreachable: {', '.join(lost)}" if lost else ""
        return f"disconnected network: no link joins {names} to the rest{unreachable}"


def _jitter(entry: JitterEntry | None) -> Jitter | None:
    return None if entry is None else entry.jitter()
