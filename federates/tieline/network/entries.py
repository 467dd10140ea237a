"""The entries of a topology file, each checked by itself and against the others."""

from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from tieline.errors import InputError
from tieline.network.entry import Entry
from tieline.network.findings import Findings
from tieline.network.jitter import Jitter, JitterEntry
from tieline.network.losses import Bernoulli
from tieline.network.parts import parts_of
from tieline.network.routing import Pair, fault_of
from tieline.network.schema import (
    ControllerEntry,
    EventEntry,
    LinkDefaults,
    LinkEntry,
    NodeEntry,
    PmuEntry,
    RouteEntry,
    RoutingEntry,
    loss_of,
    overhead_of,
    queue_of,
    rate_of,
)
from tieline.network.settings import NetworkSettings
from tieline.network.spec import ETHERNET_MTU, Link, Node, Route
from tieline.network.traffic import TRAFFIC, FlowEntry
from tieline.units import seconds_to_ns
from tieline.yaml_lines import Document

SECTIONS = (
    "nodes",
    "links",
    "link_defaults",
    "pmu",
    "controller",
    "cross_traffic",
    "routing",
    "routes",
    "events",
)

Sites = Sequence[Mapping[str, Any]]
"""Sources (`name`, `bus`) or destinations (`name`, `unit`, `bus`), as the run file lists them."""

AnEntry = TypeVar("AnEntry", bound=Entry)


class Entries:
    """What a topology file says, as far as it can be understood, and what is wrong with it.

    Attributes:
        sources, destinations: the sites that the network must join.
        nodes, links, cross, events: the entries that are right in themselves.
        pmu, controller, routing: what the file says of them, or what holds without.
        fixed: routes that are fixed by hand, by their ends.
        at_bus: the node of each bus.

    Args:
        document: the file.
        sources, destinations: PMUs and controllers.
        settings: what the experiment adds (`traffic`, `events`) or says instead of the file.
    """

    def __init__(
        self,
        document: Document,
        sources: Sites,
        destinations: Sites,
        settings: NetworkSettings,
    ) -> None:
        self.sources = sources
        self.destinations = destinations
        self._settings = settings
        self._findings = Findings(document)
        self._data = self._findings.section(document.data, (), dict)
        if not isinstance(document.data, dict):
            self._findings.refuse()
        own = {"traffic": list(settings.traffic), "events": list(settings.events)}
        self._added = Findings(Document(document.path, own, {}), "network.")
        self._findings.keys(self._data, (), SECTIONS, required=("nodes", "links"))
        self.nodes = self._read_nodes()
        self._names = dict.fromkeys(node.name for node in self.nodes)
        self._defaults = self._read("link_defaults", LinkDefaults)
        self.links = self._read_links()
        self.pmu = self._read("pmu", PmuEntry) or PmuEntry.model_validate({})
        self.controller = self._read(
            "controller", ControllerEntry
        ) or ControllerEntry.model_validate({})
        self.routing = self._read("routing", RoutingEntry) or RoutingEntry.model_validate({})
        pairs = {pair for link in self.links for pair in ((link.a, link.b), (link.b, link.a))}
        self.fixed = self._read_routes(pairs)
        self.cross = self._read_cross()
        self.events = self._read_events(pairs)
        self.at_bus = self._stations()
        self._check_sites()
        self._check_connected()

    def refuse(self) -> None:
        """Raise InputError with everything that is wrong, if anything is."""
        found = [*self._findings.lines(), *self._added.lines()]
        if found:
            raise InputError(found)

    def _read(self, section: str, model: type[AnEntry]) -> AnEntry | None:
        return self._findings.entry(self._data.get(section, {}), (section,), model)

    def _list(self, section: str) -> list[Any]:
        entries: list[Any] = self._findings.section(self._data.get(section, []), (section,), list)
        return entries

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

    def _read_links(self) -> tuple[Link, ...]:
        links = []
        first: dict[tuple[str, ...], int] = {}
        for index, raw in enumerate(self._list("links")):
            position = ("links", index)
            entry = self._findings.entry(raw, position, LinkEntry)
            ends = None if entry is None else (entry.a, entry.b)
            if entry is None or not self._has_ends(ends, self._findings, position, ("a", "b")):
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
        self,
        ends: tuple[str, str] | None,
        findings: Findings,
        position: tuple[str, int],
        keys: tuple[str, str],
    ) -> bool:
        if ends is None:
            return False
        for name, key in zip(ends, keys, strict=True):
            findings.word(name, self._names, (*position, key), "node")
        if ends[0] == ends[1]:
            text = f"{position[0]}.{position[1]} must join two nodes (got '{ends[0]}' twice)"
            findings.add(position, text)
        return ends[0] != ends[1] and set(ends) <= set(self._names)

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
        own = self._settings.queue
        queue = queue_of(given["queue"] if own is None else own)
        is_half = given["duplex"] == "half"
        if is_half and queue.early_detection is not None:
            text = f"link {entry.a}-{entry.b} cannot be half duplex and have a queue of red"
            self._findings.add(position, text)
        loss = self._settings.loss
        return Link(
            entry.a,
            entry.b,
            rate_of(given),
            seconds_to_ns(entry.propagation),
            queue,
            loss_of(given["loss"]) if loss is None else Bernoulli(loss) if loss else None,
            jitter_of(given["jitter"] if self._settings.jitter is None else self._settings.jitter),
            overhead_of(given),
            is_half,
            given["mtu"] or ETHERNET_MTU,
            given["cost"] or 1.0,
        )

    def _read_routes(self, pairs: set[Pair]) -> dict[Pair, Route]:
        fixed: dict[Pair, Route] = {}
        for index, raw in enumerate(self._list("routes")):
            position = ("routes", index)
            entry = self._findings.entry(raw, position, RouteEntry)
            ends = None if entry is None else (entry.origin, entry.target)
            known = self._has_ends(ends, self._findings, position, ("from", "to"))
            if entry is None or ends is None or not known:
                continue
            route = (entry.origin, *entry.via, entry.target)
            fault = fault_of(route, pairs)
            if fault is not None:
                text = f"the route from {entry.origin} to {entry.target} {fault}"
                self._findings.add(position, text)
            elif ends in fixed:
                text = f"a second route from {entry.origin} to {entry.target}"
                self._findings.add(position, text)
            fixed[ends] = route
        return fixed

    def _read_cross(self) -> list[FlowEntry]:
        checked = []
        sources = [
            (self._findings, "cross_traffic", self._list("cross_traffic")),
            (self._added, "traffic", self._added.document.data["traffic"]),
        ]
        for findings, section, raws in sources:
            for index, raw in enumerate(raws):
                position = (section, index)
                entry = findings.tagged(raw, position, "kind", TRAFFIC)
                if not isinstance(entry, FlowEntry):
                    continue
                ends = (entry.origin, entry.target)
                if self._has_ends(ends, findings, position, ("from", "to")):
                    checked.append(entry)
        return checked

    def _read_events(self, pairs: set[Pair]) -> list[EventEntry]:
        checked = []
        sources = [
            (self._findings, self._list("events")),
            (self._added, self._added.document.data["events"]),
        ]
        for findings, raws in sources:
            for index, raw in enumerate(raws):
                position = ("events", index)
                entry = findings.entry(raw, position, EventEntry)
                if entry is None:
                    continue
                if entry.node is not None:
                    findings.word(entry.node, self._names, (*position, "node"), "node")
                if entry.link is not None and tuple(entry.link) not in pairs:
                    text = f"events.{index}: there is no link {'-'.join(entry.link)}"
                    findings.add((*position, "link"), text)
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
        joined: list[tuple[str, str]] = []
        for raw in self._list("links"):
            ends = (raw.get("a"), raw.get("b")) if isinstance(raw, dict) else (None, None)
            if not all(isinstance(end, str) and end in self._names for end in ends):
                return
            joined.append((str(ends[0]), str(ends[1])))
        for part in parts_of(self._names, joined)[1:]:
            self._findings.add(("nodes", min(part)), self._cut_off(part))

    def _cut_off(self, part: set[str]) -> str:
        sites = (*self.sources, *self.destinations)
        lost = [str(site["name"]) for site in sites if self.at_bus.get(site["bus"]) in part]
        names = ", ".join(sorted(part))
        unreachable = f"; unreachable: {', '.join(lost)}" if lost else ""
        return f"disconnected network: no link joins {names} to the rest{unreachable}"


def jitter_of(entry: JitterEntry | None) -> Jitter | None:
    """Return the distribution that an entry says, or none."""
    return None if entry is None else entry.jitter()
