"""The routes of a network as rows of the kernel's tables: hops, forks of trees, flows.

Flows are numbered: PMU flows; cross flows; replies and acknowledgements to those; segments and
acknowledgements of PMU connections; trees. All but the first and the last have a row of `cross`.
"""

from collections.abc import Mapping, Sequence
from itertools import groupby, pairwise
from typing import NamedTuple

from tieline.errors import InputError
from tieline.network.packet.memory import FORK, NO_PORT, NONE
from tieline.network.spec import FRAME_BYTES, NetworkSpec, Reroute, Route, serialisation_ns
from tieline.network.traffic.base import (
    IP_HEADER,
    UDP_HEADER,
    Acknowledged,
    Answered,
    Sized,
)

TCP_HEADER = 20
"""Without options."""

LEAST_MTU = 68
"""Every link takes packets of so many bytes (RFC 791); a PMU frame is 62 of them."""

FRAME_WINDOW = 1024
"""Frames that a connection of PMU data holds until they have been delivered."""


class Connection(NamedTuple):
    """A connection: its flows, the PMU flow whose frames it carries or `NONE`, its window."""

    data_flow: int
    ack_flow: int
    frames_of: int
    window: int


class Load(NamedTuple):
    """What the packets of a flow are like: bytes with the UDP or TCP header, and the mark."""

    datagram: int
    dscp: int = 0
    is_sized: bool = False


class Routes:
    """The tables `hops`, `plans`, `forks`, `members`, `flows` and `sources`, row by row.

    Attributes:
        first_tree: the first flow that is a tree.
        back_of: the flow of replies to a cross flow.
        connections: in the order of their data flows.
        places: of each hop, how many links lie before it on its route.
        carried: of each flow but trees, the PMU or cross flow that it serves, and whether it goes
            back to that flow's source.
        most_pieces: the most packets that a datagram is sent in.
        reroutes: for each `Reroute` of the spec, in order, (flow, first hop, most of a datagram in
            a packet or `NONE`) of what it changes.

    Raises:
        InputError: a link's MTU is too small, or a segment of a connection or a request that is
            answered exceeds it.
    """

    def __init__(self, spec: NetworkSpec) -> None:
        for link in spec.links:
            if link.mtu_bytes < LEAST_MTU:
                raise InputError(
                    f"the MTU of link {link.a}-{link.b} must be at least {LEAST_MTU} bytes "
                    f"(got {link.mtu_bytes})"
                )
        self._spec = spec
        self.hops: list[int] = []
        self.plans: list[tuple[int, ...]] = []
        self.forks: list[int] = []
        self.members: list[int] = []
        self.flows: list[tuple[int, ...]] = []
        self.connections: list[Connection] = []
        self.back_of: dict[int, int] = {}
        self.most_pieces = 1
        self.places: list[int] = []
        self.carried: list[tuple[int, bool]] = []
        self._loads: list[Load] = []
        self._plan_of: dict[tuple[int, ...], int] = {}
        self._frames = Load(FRAME_BYTES + UDP_HEADER, spec.dscp)
        self._ways = {number: flow.route for number, flow in enumerate(spec.flows)}
        self._add_pmu_flows()
        self._add_cross_flows()
        if spec.transport == "tcp":
            self._connect_pmus()
        self.first_tree = len(self.flows)
        self.sources = self._sources()
        self.reroutes = [
            self._rerouted(change) for change in spec.changes if isinstance(change, Reroute)
        ]

    def _add_pmu_flows(self) -> None:
        for flow in self._spec.flows:
            self._add_flow(flow.route, self._frames, (len(self.flows), False), flow.destination)

    def _add_cross_flows(self) -> None:
        backs: list[tuple[int, Route, Load]] = []
        for cross in self._spec.cross_flows:
            traffic, number = cross.traffic, len(self.flows)
            is_connection = isinstance(traffic, Acknowledged)
            header = TCP_HEADER if is_connection else UDP_HEADER
            is_sized = isinstance(traffic, Sized)
            load = Load(traffic.payload_bytes + header, cross.dscp, is_sized)
            self._add_flow(cross.route, load, (number, False))
            if is_connection:
                backs.append((number, cross.way_back, Load(TCP_HEADER, cross.dscp)))
            elif isinstance(traffic, Answered):
                self._check_whole(number, self.flows[number][4], "request")
                answer = Load(traffic.reply_bytes + UDP_HEADER, cross.dscp)
                backs.append((number, cross.way_back, answer))
        for number, route, load in backs:
            self.back_of[number] = len(self.flows)
            self._add_flow(route, load, (number, True))
            traffic = self._spec.cross_flows[number - len(self._spec.flows)].traffic
            if isinstance(traffic, Acknowledged):
                self._connect(number, self.back_of[number], NONE, traffic.window_segments)

    def _connect_pmus(self) -> None:
        """Give every PMU flow that uses a link a connection, with two flows of its own."""
        for number, flow in enumerate(self._spec.flows):
            if len(flow.route) == 1:
                continue
            data = len(self.flows)
            segment, ack = FRAME_BYTES + TCP_HEADER, TCP_HEADER
            self._add_flow(flow.route, Load(segment, self._spec.dscp), (number, False))
            self._add_flow(flow.route[::-1], Load(ack, self._spec.dscp), (number, True))
            self._connect(data, data + 1, number, FRAME_WINDOW)

    def _connect(self, data: int, ack: int, frames_of: int, window: int) -> None:
        connection = len(self.connections)
        for flow in (data, ack, frames_of):
            if flow != NONE:
                first_hop, destination, _, datagram, piece = self.flows[flow]
                self.flows[flow] = (first_hop, destination, connection, datagram, piece)
        for flow in (data, ack):
            self._check_whole(flow, self.flows[flow][4], "segment")
        self.connections.append(Connection(data, ack, frames_of, window))

    def _check_whole(self, flow: int, piece: int, kind: str) -> None:
        """Raise InputError if a flow's packets go in pieces: nothing puts them together again."""
        if piece != NONE:
            raise InputError(
                f"a {kind} of {self._loads[flow].datagram + IP_HEADER} bytes exceeds the MTU of a "
                "link on its route: lower its payload"
            )

    def _add_flow(
        self, route: Route, load: Load, carried: tuple[int, bool], destination: int = NONE
    ) -> None:
        hop, piece = self._path(route, load)
        self.carried.append(carried)
        self.flows.append((hop, destination, NONE, load.datagram, piece))
        self._loads.append(load)

    def _path(self, route: Route, load: Load) -> tuple[int, int]:
        """Add the hops of a route; return the first, and the most of a datagram in a packet."""
        links = [self._spec.links[self._spec.ports[pair] // 2] for pair in pairwise(route)]
        mtu = min((link.mtu_bytes for link in links), default=load.datagram + IP_HEADER)
        piece = NONE
        if load.datagram + IP_HEADER > mtu:
            piece = (mtu - IP_HEADER) // 8 * 8
            self.most_pieces = max(self.most_pieces, -(-load.datagram // piece))
        first = len(self.hops)
        for pair in pairwise(route):
            self._add_hop(self._plan(pair, load, is_sized=load.is_sized or piece != NONE))
        self._add_hop((NO_PORT, 0, 0, 0, 0, 0))
        self.places += range(len(route))
        return first, piece

    def _add_hop(self, plan: tuple[int, ...]) -> None:
        number = self._plan_of.setdefault(plan, len(self.plans))
        if number == len(self.plans):
            self.plans.append(plan)
        self.hops.append(number)

    def _plan(
        self,
        pair: tuple[str, str],
        load: Load,
        first: int = 0,
        end: int = 0,
        is_sized: bool = False,
    ) -> tuple[int, ...]:
        """Return the plan of a hop; `first` and `end` are the members of a tree's."""
        port = self._spec.ports[pair]
        link = self._spec.links[port // 2]
        line = link.queue.line_of(load.dscp)
        if is_sized:
            return port, NONE, 0, line, first, end
        size = load.datagram + IP_HEADER + link.overhead_bytes
        return port, serialisation_ns(size, link.rate_bps), size, line, first, end

    def _sources(self) -> list[tuple[int, ...]]:
        """Return the rows of the sources, whose flows stand together, with their trees."""
        rows: list[tuple[int, ...]] = []
        end = 0
        for source in range(len(self._spec.sources)):
            first = end
            while end < len(self._spec.flows) and self._spec.flows[end].source == source:
                end += 1
            tree = NONE
            if self._spec.transport == "multicast" and end > first:
                tree = len(self.flows)
                hop = self._tree([(self._spec.flows[n].route, n) for n in range(first, end)])
                self.flows.append((hop, NONE, NONE, self._frames.datagram, NONE))
                self._loads.append(self._frames)
            rows.append((first, end, tree))
        return rows

    def _tree(self, routes: Sequence[tuple[Route, int]]) -> int:
        """Add the hops of a tree along routes that begin at one node; return the first of them.

        In alphabetical order all routes that begin alike stand together, the shortest first.
        """
        ordered = sorted(routes)
        base = len(self.members)
        self.members += [flow for _, flow in ordered]
        root = len(self.hops)
        pending = [(0, len(ordered), 0, NONE)]
        while pending:
            low, high, depth, fork = pending.pop()
            if fork != NONE:
                self.forks[fork] = len(self.hops)
            ends, branches = _at_node(ordered, low, high, depth)
            while not ends and len(branches) == 1:
                route = ordered[low][0]
                pair = (route[depth], route[depth + 1])
                self._add_hop(self._plan(pair, self._frames, base + low, base + high))
                self.places.append(depth)
                depth += 1
                ends, branches = _at_node(ordered, low, high, depth)
            first = len(self.forks)
            self.forks += [-1 - flow for flow in ends] + [NONE] * len(branches)
            self._add_hop((FORK, first, len(self.forks), 0, 0, 0))
            self.places.append(depth)
            for place, (branch_low, branch_high) in enumerate(branches):
                pending.append((branch_low, branch_high, depth, first + len(ends) + place))
        return root

    def _rerouted(self, change: Reroute) -> list[tuple[int, int, int]]:
        """Add the hops of other routes; return each flow that takes one, as `reroutes` has it."""
        moved: dict[int, Route] = dict(change.routes)
        ways_back = change.ways_back.items()
        moved |= {self.back_of[flow]: way for flow, way in ways_back if flow in self.back_of}
        for connection in self.connections:
            if connection.frames_of in change.routes:
                route = change.routes[connection.frames_of]
                moved |= {connection.data_flow: route, connection.ack_flow: route[::-1]}
        hops = [(flow, *self._path(route, self._loads[flow])) for flow, route in moved.items()]
        segments = {flow for pair in self.connections for flow in pair[:2]}
        for flow, _, piece in hops:
            if flow in segments or flow in self.back_of:
                self._check_whole(flow, piece, "segment" if flow in segments else "request")
        return hops + self._trees_moved(change.routes)

    def _trees_moved(self, routes: Mapping[int, Route]) -> list[tuple[int, int, int]]:
        hops = []
        self._ways |= {flow: way for flow, way in routes.items() if flow in self._ways}
        for first, end, tree in self.sources:
            own = range(first, end)
            if tree != NONE and any(flow in routes for flow in own):
                hops.append((tree, self._tree([(self._ways[flow], flow) for flow in own]), NONE))
        return hops


def _at_node(
    ordered: Sequence[tuple[Route, int]], low: int, high: int, depth: int
) -> tuple[list[int], list[tuple[int, int]]]:
    """Return the flows of a range that end at the node of a depth, and the ranges that go on."""
    ends = [ordered[k][1] for k in range(low, high) if len(ordered[k][0]) == depth + 1]
    going = range(low + len(ends), high)
    branches = []
    for _, group in groupby(going, key=lambda k: ordered[k][0][depth + 1]):
        places = list(group)
        branches.append((places[0], places[-1] + 1))
    return ends, branches
