"""What happens to a network while it runs, done to the kernel's tables between two events.

A change comes before every other event of its instant.
"""

import numpy as np

from tieline.network.engine import LINK_DOWN
from tieline.network.losses import Bernoulli
from tieline.network.packet.counters import settle
from tieline.network.packet.kinds import ARRIVAL, DEPARTURE, KINDS, items_of
from tieline.network.packet.memory import (
    BUSY,
    BYTES,
    COUNT,
    DEFICIT,
    DOWN_DROPS,
    END_CLASSES,
    EVENT_LEFT,
    EVENT_STREAM,
    FIRST_CLASS,
    FIRST_DRAW,
    FIRST_HOP,
    FLOW,
    FRAGMENT,
    FREE_AT,
    HAS_LOSS,
    HAS_SERVER,
    HELD_BYTES,
    HOP,
    HOP_BYTES,
    HOP_PORT,
    HOP_SERVICE,
    IS_DOWN,
    IS_SERVING,
    LOSS_STREAM,
    NONE,
    PACKETS,
    RANK,
    RATE,
    SEQUENCE,
    SPECIAL,
    TIME,
    USED,
    WAITING,
    WAITING_BYTES,
    Cells,
    Memory,
)
from tieline.network.packet.packets import dropped
from tieline.network.packet.ports import waiting_now
from tieline.network.packet.routes import Routes
from tieline.network.packet.supplies import LOSSES, Supplies
from tieline.network.packet.ways import PORT_COLUMNS
from tieline.network.spec import (
    LinkCut,
    LinkRepair,
    LossChange,
    NetworkSpec,
    RateChange,
    Reroute,
)
from tieline.streams import stream
from tieline.units import NS_PER_S

NOT_YET = 1 << 62
NOTHING: Cells = np.empty(0, dtype=np.int64)


class Changes:
    """The changes of a network that are still to come.

    Args:
        spec: with its changes in the order of time.
        supplies: the random streams; those of losses that begin later are opened here.
        routes: where the routes are that flows take later.
    """

    def __init__(self, spec: NetworkSpec, supplies: Supplies, routes: Routes) -> None:
        self._waiting = list(spec.changes)
        self._reroutes = list(routes.reroutes)
        self._spec = spec
        self._streams = {
            (place, port): _open_losses(supplies, place, change, port, spec)
            for place, change in enumerate(spec.changes)
            if isinstance(change, LossChange) and change.probability > 0
            for port in _ports(change.link)
        }
        self._done = 0

    @property
    def next_ns(self) -> int:
        """Return when the next change comes."""
        return self._waiting[0].at_ns if self._waiting else NOT_YET

    def apply(self, memory: Memory) -> dict[int, Cells]:
        """Do the next change; return when what waits now starts, by ports where that has changed.

        Nothing waits any more at a port that went down.
        """
        change = self._waiting.pop(0)
        starts: dict[int, Cells] = {}
        if isinstance(change, Reroute):
            for flow, hop, piece in self._reroutes.pop(0):
                memory.table("flows")[flow, [FIRST_HOP, FRAGMENT]] = hop, piece
        else:
            for port in _ports(change.link):
                if isinstance(change, LinkCut):
                    _cut(change.at_ns, port, memory)
                    starts[port] = NOTHING
                elif isinstance(change, LinkRepair):
                    memory.table("ports")[port, SPECIAL] &= ~IS_DOWN
                elif isinstance(change, RateChange):
                    starts[port] = _set_rate(change, port, memory)
                else:
                    self._set_losses(change, port, memory)
        self._done += 1
        return starts

    def _set_losses(self, change: LossChange, port: int, memory: Memory) -> None:
        row, details = memory.table("ports")[port], memory.table("details")[port]
        streams = memory.table("streams")
        number = self._streams.get((self._done, port), NONE)
        details[EVENT_STREAM] = number
        if number != NONE:
            row[SPECIAL] |= HAS_LOSS
            details[EVENT_LEFT] = streams[number, FIRST_DRAW + streams[number, USED]]
            streams[number, USED] += 1
        elif details[LOSS_STREAM] == NONE:
            row[SPECIAL] &= ~HAS_LOSS


def _ports(link: int) -> tuple[int, int]:
    return 2 * link, 2 * link + 1


def _open_losses(
    supplies: Supplies, place: int, change: LossChange, port: int, spec: NetworkSpec
) -> int:
    """Return the stream of the gaps between the losses of an event."""
    link = spec.links[change.link]
    origin, target = (link.a, link.b) if port % 2 == 0 else (link.b, link.a)
    name = f"loss of {origin}->{target} by change {place}"
    gaps = Bernoulli(change.probability).gaps(stream(supplies.seed, name))
    return supplies.open(gaps, name, LOSSES)


def _cut(now: int, port: int, memory: Memory) -> None:
    """Take a port down: all that is on it, or waits for it, is dropped at once."""
    row, details = memory.table("ports")[port], memory.table("details")[port]
    inside = memory.inside()
    packets = memory.table("packets")
    hops = packets[inside, HOP]
    lost = inside[memory.plans_of(hops)[:, HOP_PORT] == port]
    # By what they carry: slots depend on when the tables grew, and so on the caller's steps.
    lost = lost[np.lexsort((packets[lost, SEQUENCE], packets[lost, FLOW]))]
    _forget_events(memory, lost, port)
    memory.free(lost)
    for slot in lost:
        _drop(now, int(slot), memory)
    details[DOWN_DROPS] += len(lost)
    # What has not been transmitted has not been put on the link either.
    places = _yet_to_start(now, port, memory)
    details[PACKETS] -= len(places)
    details[BYTES] -= memory.waits[places + 1].sum()
    details[BUSY] -= max(0, row[FREE_AT] - now)
    row[FREE_AT] = min(row[FREE_AT], now)
    waiting_now(NOT_YET, memory.layout.ports + PORT_COLUMNS * port, memory.cells, memory.layout)
    row[WAITING] = 0
    details[[WAITING_BYTES, IS_SERVING]] = 0
    if row[SPECIAL] & HAS_SERVER:
        classes = memory.table("classes")[details[FIRST_CLASS] : details[END_CLASSES]]
        classes[:, [COUNT, HELD_BYTES, DEFICIT]] = 0
    row[SPECIAL] |= IS_DOWN


def _forget_events(memory: Memory, slots: Cells, port: int) -> None:
    """Remove the events of packets, and the end of a port's transmission."""
    events = memory.events()
    number, kind = np.divmod(items_of(events), KINDS)
    is_lost = (kind == ARRIVAL) & np.isin(number, slots)
    memory.put_events(events[~is_lost & ~((kind == DEPARTURE) & (number == port))])


def _drop(now: int, slot: int, memory: Memory) -> None:
    packet = memory.table("packets")[slot]
    flow, sequence, hop = (int(packet[column]) for column in (FLOW, SEQUENCE, HOP))
    dropped(now, flow, sequence, hop, LINK_DOWN, memory.cells, memory.layout)


def _set_rate(change: RateChange, port: int, memory: Memory) -> Cells:
    """Give a port another rate: what waits takes it, what is in transmission does not.

    Returns when the packets start that wait at a plain port.
    """
    details, plans = memory.table("details")[port], memory.table("plans")
    # What has been carried took the old rate.
    settle(memory.cells, memory.layout)
    own = (plans[:, HOP_PORT] == port) & (plans[:, HOP_SERVICE] != NONE)
    before = plans[:, HOP_SERVICE].copy()
    old_rate, details[RATE] = int(details[RATE]), change.rate_bps
    plans[own, HOP_SERVICE] = _service_ns(plans[own, HOP_BYTES], change.rate_bps)
    return _set_starts(change.at_ns, port, before, old_rate, memory)


def _set_starts(now: int, port: int, before: Cells, old_rate: int, memory: Memory) -> Cells:
    """Move the starts of what waits at a plain port, and the events that depend on them."""
    row, plans = memory.table("ports")[port], memory.table("plans")
    details = memory.table("details")[port]
    waits, places = memory.waits, _yet_to_start(now, port, memory)
    if len(places) == 0:
        return NOTHING
    events = memory.events().copy()
    slots, kinds = np.divmod(items_of(events), KINDS)
    is_arrival = kinds == ARRIVAL
    packets = memory.table("packets")
    on_port = np.zeros(len(events), dtype=bool)
    on_port[is_arrival] = memory.plans_of(packets[slots[is_arrival], HOP])[:, HOP_PORT] == port
    # Events are ordered as packets came, and the last to come are those that wait.
    own = np.flatnonzero(on_port)
    waiting = own[np.argsort(events[own, RANK])][-len(places) :]
    old_starts, sizes = waits[places].copy(), waits[places + 1]
    own_plans = memory.plan_numbers_of(packets[slots[waiting], HOP])
    is_sized = plans[own_plans, HOP_SERVICE] == NONE
    old = np.where(is_sized, _service_ns(sizes, old_rate), before[own_plans])
    new = _service_ns(sizes, int(details[RATE]))
    starts = old_starts[0] + np.cumsum(new) - new
    waits[places] = starts
    events[waiting, TIME] += starts + new - old_starts - old
    memory.put_events(events)
    row[FREE_AT] = starts[-1] + new[-1]
    details[BUSY] += int((new - old).sum())
    return starts


def _yet_to_start(now: int, port: int, memory: Memory) -> Cells:
    """Return the places in `waits` of what waits at a plain port; at one with a server: none."""
    if memory.table("ports")[port, SPECIAL] & HAS_SERVER:
        return NOTHING
    places = memory.waiting_at(port)
    return places[memory.waits[places] >= now]


def _service_ns(sizes: Cells, rate_bps: int) -> Cells:
    """Return serialisation times, rounded to the nearest nanosecond."""
    result: Cells = (16 * sizes * NS_PER_S + rate_bps) // (2 * rate_bps)
    return result
