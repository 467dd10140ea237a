"""Lays a `NetworkSpec` out in the kernel's memory and opens a stream for each random thing."""

from collections.abc import Iterable

import numpy as np

from tieline.errors import InputError
from tieline.network.draws import CHUNK
from tieline.network.losses import Loss
from tieline.network.packet import tcp
from tieline.network.packet.changes import Changes
from tieline.network.packet.draws import gaps, sizes, uniforms
from tieline.network.packet.memory import (
    ARRIVED,
    COLUMNS,
    CONNECTION_COLUMNS,
    END_CLASSES,
    END_WAIT,
    EVENT_STREAM,
    FIRST_CLASS,
    FIRST_COME,
    FIRST_DRAW,
    FIRST_WAIT,
    FORK,
    GAP_STREAM,
    HAS_BYTES,
    HAS_JITTER,
    HAS_LOSS,
    HAS_RED,
    HAS_SERVER,
    HAS_TAP,
    HOP_PORT,
    JITTER_STREAM,
    LINE,
    LOSS_LEFT,
    LOSS_STREAM,
    LOSS_UNIT,
    NONE,
    OVERHEAD,
    PEER,
    PER_BIT,
    PER_PACKET,
    PORT_BITS,
    PRIORITY,
    PROPAGATION,
    QUEUE,
    QUEUE_BYTES,
    RATE,
    RED,
    REPLY,
    ROUND_ROBIN,
    SERVICE_ORDER,
    SIZE_STREAM,
    SPECIAL,
    THINK,
    TURN,
    USED,
    Cells,
    Memory,
)
from tieline.network.packet.red import CERTAIN, ONE_PACKET
from tieline.network.packet.routes import FRAME_WINDOW, Routes
from tieline.network.packet.supplies import EARLY_DROPS, GAPS, LOSSES, SIZES, Supplies
from tieline.network.queues.base import NO_LIMIT, EarlyDetection
from tieline.network.spec import Link, NetworkSpec
from tieline.network.traffic.base import Acknowledged, Answered
from tieline.streams import stream

_FIRST_CAPACITY = 4096
_ORDERS = {"first_come": FIRST_COME, "priority": PRIORITY, "round_robin": ROUND_ROBIN}
LEAST_WAIT_NS = 200_000_000
"""Least retransmission time of Linux; RFC 6298 would have a second."""


def laid_out(spec: NetworkSpec, supplies: Supplies) -> tuple[Memory, Changes, Routes]:
    """Return the memory before the first event, what will be changed in it, and the routes.

    Raises:
        InputError: one source has more flows than a chunk of random numbers, or a link's MTU does
            not hold a header and eight bytes.
    """
    routes = Routes(spec)
    ports = _Ports(spec, supplies)
    connections, received = _connections(routes)
    tables = {
        "ports": ports.table,
        "details": ports.details,
        "classes": _table("classes", ports.classes),
        "red": _table("red", ports.red),
        "hops": _hops(routes),
        "plans": _table("plans", routes.plans),
        "forks": _table("forks", ((fork,) for fork in routes.forks)),
        "members": _table("members", ((flow,) for flow in routes.members)),
        "flows": _table("flows", routes.flows),
        "sources": _table("sources", routes.sources),
        "destinations": _destinations(spec, supplies),
        "cross": _cross(spec, supplies, routes),
        "connections": connections,
        "received": received,
        "blocks": np.zeros((ports.blocks, COLUMNS["blocks"]), dtype=np.int64),
    }
    changes = Changes(spec, supplies, routes)
    tables["streams"] = supplies.first_draws()
    _look_ahead(tables["details"], tables["streams"])
    most = _most_packets(spec, routes)
    if most > CHUNK:
        raise InputError(f"the packet engine makes at most {CHUNK} packets at once ({most} asked)")
    bounds = {
        "source_count": len(spec.sources),
        "pmu_flows": len(spec.flows),
        "first_tree": routes.first_tree,
        "most_packets": most,
    }
    memory = Memory(tables, _FIRST_CAPACITY + 4 * most, bounds, bool(spec.taps))
    return memory, changes, routes


def _most_packets(spec: NetworkSpec, routes: Routes) -> int:
    """Return the most packets, or records, that one event makes."""
    by_source = np.bincount([flow.source for flow in spec.flows], minlength=1).max()
    windows = [
        flow.traffic.window_segments
        for flow in spec.cross_flows
        if isinstance(flow.traffic, Acknowledged)
    ]
    if spec.transport == "tcp" and spec.flows:
        windows.append(FRAME_WINDOW)
    return 2 + max(int(by_source), routes.most_pieces, *windows, 0)


class _Ports:
    """The tables of ports, with the rows of classes and of early detection that they need."""

    def __init__(self, spec: NetworkSpec, supplies: Supplies) -> None:
        self.table = np.zeros((2 * len(spec.links), COLUMNS["ports"]), dtype=np.int64)
        self.details = np.zeros((2 * len(spec.links), COLUMNS["details"]), dtype=np.int64)
        self.details[:, [LOSS_STREAM, EVENT_STREAM, JITTER_STREAM, RED, PEER]] = NONE
        self.classes: list[tuple[int, ...]] = []
        self.red: list[tuple[int, ...]] = []
        self.blocks = 0
        self._supplies = supplies
        for (origin, target), number in spec.ports.items():
            link = spec.links[number // 2]
            row, details = self.table[number], self.details[number]
            row[PROPAGATION] = link.propagation_ns
            details[RATE], details[OVERHEAD] = link.rate_bps, link.overhead_bytes
            if link.is_half_duplex:
                details[PEER] = number ^ 1
            if number // 2 in spec.taps:
                row[SPECIAL] |= HAS_TAP
            self._queue(row, details, link, f"{origin}->{target}")
            self._losses(row, details, link.loss, f"{origin}->{target}")
            if link.jitter is not None:
                row[SPECIAL] |= HAS_JITTER
                own = supplies.jitter(f"jitter of {origin}->{target}", link.jitter)
                details[JITTER_STREAM] = own

    def _queue(self, row: Cells, details: Cells, link: Link, name: str) -> None:
        lines = link.queue.lines
        if len(lines) > 1 or link.is_half_duplex:
            row[SPECIAL] |= HAS_SERVER
            details[SERVICE_ORDER] = _ORDERS[link.queue.order]
            details[FIRST_CLASS] = details[TURN] = len(self.classes)
            self.classes += [
                (line.packets, line.bytes, line.quantum_bytes, 0, 0, 0, 0, 0) for line in lines
            ]
            details[END_CLASSES] = len(self.classes)
            return
        row[QUEUE] = lines[0].packets
        row[FIRST_WAIT] = row[END_WAIT] = LINE * self.blocks
        self.blocks += 1
        if lines[0].bytes < NO_LIMIT:
            row[SPECIAL] |= HAS_BYTES
            details[QUEUE_BYTES] = lines[0].bytes
        if link.queue.early_detection is not None:
            row[SPECIAL] |= HAS_RED
            details[RED] = len(self.red)
            draws = self._supplies.open(
                uniforms(self._supplies.seed, f"early drops of {name}"),
                f"early drops of {name}",
                EARLY_DROPS,
            )
            self.red.append(_red(link.queue.early_detection, draws))

    def _losses(self, row: Cells, details: Cells, loss: Loss | None, name: str) -> None:
        if loss is None:
            return
        row[SPECIAL] |= HAS_LOSS
        details[LOSS_UNIT] = PER_BIT if loss.counts == "bits" else PER_PACKET
        generator = stream(self._supplies.seed, f"loss of {name}")
        details[LOSS_STREAM] = self._supplies.open(loss.gaps(generator), f"loss of {name}", LOSSES)


def _red(early: EarlyDetection, draws: int) -> tuple[int, ...]:
    low, high = round(early.low * ONE_PACKET), round(early.high * ONE_PACKET)
    return low, high, round(early.probability * CERTAIN), early.weight_shift, draws, 0, -1


def _look_ahead(details: Cells, streams: Cells) -> None:
    """Take the first gap of every stream of losses."""
    lossy = np.flatnonzero(details[:, LOSS_STREAM] != NONE)
    numbers = details[lossy, LOSS_STREAM]
    details[lossy, LOSS_LEFT] = streams[numbers, FIRST_DRAW]
    streams[numbers, USED] = 1


def _hops(routes: Routes) -> Cells:
    plans = np.array(routes.hops, dtype=np.int64)
    ports = np.array([plan[HOP_PORT] for plan in routes.plans], dtype=np.int64)
    return ((plans << PORT_BITS) + ports[plans] - FORK).reshape(-1, 1)


def _destinations(spec: NetworkSpec, supplies: Supplies) -> Cells:
    return _table(
        "destinations",
        (
            (place.processing_ns, supplies.jitter(f"processing of {place.name}", place.jitter))
            for place in spec.destinations
        ),
    )


def _cross(spec: NetworkSpec, supplies: Supplies, routes: Routes) -> Cells:
    table = np.zeros((routes.first_tree - len(spec.flows), COLUMNS["cross"]), dtype=np.int64)
    table[:, [GAP_STREAM, SIZE_STREAM, REPLY]] = NONE
    table[:, ARRIVED:] = 0
    for number, (row, flow) in enumerate(zip(table, spec.cross_flows, strict=False)):
        row[GAP_STREAM] = supplies.open(gaps(supplies.seed, flow), f"arrivals of {flow.name}", GAPS)
        own_sizes = sizes(flow)
        if own_sizes is not None:
            row[SIZE_STREAM] = supplies.open(own_sizes, f"sizes of {flow.name}", SIZES)
        if isinstance(flow.traffic, Answered):
            row[REPLY] = routes.back_of[len(spec.flows) + number]
            row[THINK] = flow.traffic.think_ns
    return table


def _connections(routes: Routes) -> tuple[Cells, Cells]:
    """Return the tables of connections and of the segments that they have received."""
    table = np.zeros((len(routes.connections), CONNECTION_COLUMNS), dtype=np.int64)
    received = 0
    for row, connection in zip(table, routes.connections, strict=True):
        row[tcp.DATA_FLOW] = connection.data_flow
        row[tcp.ACK_FLOW] = connection.ack_flow
        row[tcp.FRAMES_OF] = connection.frames_of
        row[tcp.MOST] = connection.window
        row[tcp.RECEIVED] = received
        row[tcp.LEAST_WAIT] = LEAST_WAIT_NS
        row[tcp.WINDOW] = tcp.FIRST_WINDOW
        row[tcp.THRESHOLD] = connection.window * tcp.UNIT
        row[tcp.WAIT] = tcp.FIRST_WAIT_NS
        row[[tcp.RECOVER, tcp.TIMED_SEGMENT]] = NONE
        received += connection.window
    return table, np.zeros((received, COLUMNS["received"]), dtype=np.int64)


def _table(name: str, rows: Iterable[tuple[int, ...]]) -> Cells:
    listed = list(rows)
    table = np.zeros((len(listed), COLUMNS[name]), dtype=np.int64)
    if listed:
        table[:, : len(listed[0])] = listed
    return table
