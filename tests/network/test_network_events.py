"""What happens to links while the network runs: cuts, repairs, rates, losses, other routes.

A frame of 62 bytes takes 496 us at 1 Mbit/s; a change comes before all else of its instant.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from network.builders import ALL, joined
from network.test_topology_file import DESTINATIONS, SOURCES, findings, read
from tieline.network.engine import DELIVERED, LINK_DOWN, LOSS
from tieline.network.losses import Bernoulli
from tieline.network.packet import PacketEngine
from tieline.network.queues import DeficitRoundRobin, DropTail, StrictPriority, WaitingLine
from tieline.network.spec import (
    Change,
    CrossFlow,
    Destination,
    Link,
    LinkCut,
    LinkRepair,
    LossChange,
    NetworkSpec,
    RateChange,
    Reroute,
    Source,
)
from tieline.network.traffic import Poisson

ONE = np.array([0])
MS = 1_000_000
SECOND = 10**9
LINES = (WaitingLine(9, quantum_bytes=100), WaitingLine(9, quantum_bytes=100))
MARKS = (frozenset({46}), frozenset[int]())
QUEUES = {
    "plain": DropTail(9),
    "priority": StrictPriority(LINES, MARKS),
    "round robin": DeficitRoundRobin(LINES, MARKS),
}


def wire(*changes: Change, queue: str = "plain", **more: object) -> NetworkSpec:
    """Return one link of 1 Mbit/s and 10 ms, with what happens to it."""
    link = Link("a", "b", 1_000_000, 10 * MS, QUEUES[queue], **more)  # type: ignore[arg-type]
    spec = joined([link], [Source("p", 1, "a")], [Destination("c", "G", 1, "b")])
    return replace(spec, changes=changes)


def fates(spec: NetworkSpec, *sent_ns: int) -> tuple[list[tuple[int, int]], PacketEngine]:
    """Return (when, how) each frame ended, by the frames' numbers, and the engine."""
    engine = PacketEngine(spec, seed=1)
    for k, at_ns in enumerate(sent_ns):
        engine.send(at_ns, ONE, k)
    outcome = engine.run_until(ALL)
    ended = {int(r["sequence"]): (int(r["arrival_ns"]), DELIVERED) for r in outcome.arrivals}
    ended |= {int(r["sequence"]): (int(r["dropped_ns"]), int(r["reason"])) for r in outcome.drops}
    return [ended[k] for k in range(len(sent_ns))], engine


@pytest.mark.parametrize("queue", QUEUES)
@pytest.mark.parametrize("is_half_duplex", [False, True])
def test_a_cut_by_hand(queue, is_half_duplex):
    """Otherwise a dead link would still deliver what is on it, or hold what waits.

    At 600 us the first frame is on the wire, the second in transmission, the third waits. The
    fourth comes while the link is down, the fifth as it is repaired, the sixth behind it.
    """
    cut, repair = LinkCut(600_000, 0), LinkRepair(20 * MS, 0)
    spec = wire(cut, repair, queue=queue, is_half_duplex=is_half_duplex)
    ended, engine = fates(spec, 0, 0, 0, 5 * MS, 20 * MS, 20 * MS)
    assert ended[:3] == [(600_000, LINK_DOWN)] * 3
    assert ended[3] == (5 * MS, LINK_DOWN)
    assert ended[4:] == [(30_496_000, DELIVERED), (30_992_000, DELIVERED)]
    use = engine.links()[0]
    assert (use.packets, use.dropped_down) == (4, 4)
    assert use.busy_ns == 600_000 + 2 * 496_000
    assert (engine.counts().dropped_down, engine.counts().in_flight) == (4, 0)


def test_a_cut_takes_one_link_alone():
    """Otherwise packets on other links would be lost with it."""
    links = [Link("a", "b", 1_000_000, MS, DropTail(9)), Link("b", "c", 1_000_000, MS, DropTail(9))]
    spec = joined(links, [Source("p", 1, "a")], [Destination("c", "G", 1, "c")])
    # The first frame is on b-c at 2 ms, the second still on a-b.
    ended, _ = fates(replace(spec, changes=(LinkCut(2 * MS, 1),)), 0, MS)
    assert ended == [(2 * MS, LINK_DOWN), (MS + 1_496_000, LINK_DOWN)]
    ended, _ = fates(replace(spec, changes=(LinkCut(2 * MS, 0),)), 0, MS)
    assert ended == [(2 * 1_496_000, DELIVERED), (2 * MS, LINK_DOWN)]


@pytest.mark.parametrize("queue", QUEUES)
@pytest.mark.parametrize(
    ("at_ns", "ends_ns"),
    [
        (600_000, (496_000, 992_000, 1_240_000, 1_488_000)),
        (496_000, (496_000, 744_000, 992_000, 1_348_000)),
        (1_450_000, (496_000, 992_000, 1_488_000, 1_736_000)),
    ],
)
def test_a_rate_change_by_hand(queue, at_ns, ends_ns):
    """Otherwise what waits would go at the rate of the past, or what goes would be cut short.

    Three frames at once and one at 1.1 ms, at 1 Mbit/s; then 2 Mbit/s, at which one takes 248 us.
    The second case changes the rate at the instant at which the second frame starts.
    """
    spec = wire(RateChange(at_ns, 0, 2_000_000), queue=queue)
    ended, engine = fates(spec, 0, 0, 0, 1_100_000)
    assert ended == [(end_ns + 10 * MS, DELIVERED) for end_ns in ends_ns]
    spent = [
        end - max(start, at)
        for end, start, at in zip(ends_ns, (0, *ends_ns), (0, 0, 0, 1_100_000), strict=False)
    ]
    assert engine.links()[0].busy_ns == sum(spent)


def test_a_slower_rate_fills_the_queue():
    """Otherwise a degraded link would drop as little as a sound one."""
    ended, engine = fates(wire(RateChange(100, 0, 100_000)), 0, *[MS] * 12)
    # 4.96 ms a frame: one in transmission, nine wait.
    assert sum(how == DELIVERED for _, how in ended) == 11
    assert engine.links()[0].dropped_queue == 2


def test_a_loss_event_takes_its_share_and_ends():
    """Otherwise an episode of losses would begin early, last on, or be too weak.

    A thousand frames a second, three in ten lost from second 2 to 5; the link itself loses one in a
    hundred all the time. Bounds are four standard deviations.
    """
    changes = LossChange(2 * SECOND, 0, 0.3), LossChange(5 * SECOND, 0, 0.0)
    for own in (0.0, 0.01):
        spec = wire(*changes, loss=Bernoulli(own) if own else None)
        ended, _ = fates(spec, *(k * MS for k in range(8_000)))
        lost = np.array([how == LOSS for _, how in ended])
        share = 1 - (1 - own) * 0.7
        assert abs(lost[2_000:5_000].sum() - 3_000 * share) < 4 * math.sqrt(3_000 * share * 0.7)
        outside = lost[:2_000].sum() + lost[5_000:].sum()
        assert abs(outside - 5_000 * own) <= 4 * math.sqrt(5_000 * own)


def triangle(*changes: Change, transport: str = "unicast") -> NetworkSpec:
    """Return a-b and the detour a-c-b, with a controller at b and one at c."""
    links = [Link(*ends, 10**9, MS, DropTail(9)) for ends in (("a", "b"), ("a", "c"), ("c", "b"))]
    places = [Destination("at b", "G", 1, "b"), Destination("at c", "H", 2, "c")]
    cross = [CrossFlow("cross flow 0", Poisson(10_000, 100), ("a", "b"))]
    spec = joined(links, [Source("p", 1, "a")], places, cross)
    return replace(spec, changes=changes, transport=transport)


@pytest.mark.parametrize("transport", ["unicast", "multicast", "tcp"])
def test_another_route_adds_to_the_ones_before(transport):
    """Otherwise a second failure would send flows back to the way that the first one closed.

    At 0.1 s the flow to b goes by c, at 0.2 s the one to c by b.
    """
    changes = (
        Reroute(SECOND // 10, {0: ("a", "c", "b")}, {2: ("b", "c", "a")}),
        Reroute(SECOND // 5, {1: ("a", "b", "c")}, {}),
    )
    engine = PacketEngine(triangle(*changes, transport=transport), seed=1)
    hops = []
    for k in range(3):
        engine.send(k * SECOND // 10, ONE, k)
        arrivals = engine.run_until((k + 1) * SECOND // 10 - 1).arrivals
        order = np.argsort(arrivals["destination"])
        hops.append(((arrivals["arrival_ns"][order] - k * SECOND // 10) // MS).tolist())
    assert hops == [[1, 1], [2, 1], [2, 2]]


FILE = """\
link_defaults: {rate: 1 Gbit/s, queue: 50}
nodes: {a: {buses: [2, 4]}, b: {buses: [1]}, c: {buses: [5]}}
links:
  - {a: a, b: b, propagation: 1 ms}
  - {a: a, b: c, propagation: 2 ms}
  - {a: c, b: b, propagation: 2 ms}
"""


def way(spec: NetworkSpec) -> dict[int, tuple[int, int]]:
    """Return the end of a frame from a to b each 0.1 s, by tenths: (how, whole ms)."""
    engine = PacketEngine(spec, seed=1)
    for k in range(60):
        engine.send(k * SECOND // 10, ONE, k)
    outcome = engine.run_until(10 * SECOND)
    ends = {}
    for name, records in (("arrival_ns", outcome.arrivals), ("dropped_ns", outcome.drops)):
        for row in records[records["destination"] == 0]:
            k = int(row["sequence"])
            how = DELIVERED if name == "arrival_ns" else int(row["reason"])
            ends[k] = (how, (int(row[name]) - k * SECOND // 10) // MS)
    return ends


@pytest.mark.parametrize("transport", ["unicast", "multicast"])
def test_routes_follow_a_failure_and_a_repair_after_their_time(tmp_path, transport):
    """Otherwise routing would know of a failure before it can, or never.

    The direct link fails from 1 to 3 s; routing needs half a second.
    """
    text = FILE + "routing: {convergence: 500 ms}\n"
    text += "events: [{at: 1 s, for: 2 s, event: link_down, link: [b, a]}]\n"
    ends = way(read(tmp_path, text, transport=transport))
    assert {k for k, end in ends.items() if end == (LINK_DOWN, 0)} == set(range(10, 15))
    assert {k for k, end in ends.items() if end == (DELIVERED, 4)} == set(range(15, 35))
    assert {k for k, end in ends.items() if end == (DELIVERED, 1)} == {
        *range(10),
        *range(35, 60),
    }


def test_without_convergence_frames_die_until_the_repair(tmp_path):
    """Otherwise static routes would heal themselves."""
    text = FILE + "events: [{at: 1 s, for: 2 s, event: link_down, link: [a, b]}]\n"
    ends = way(read(tmp_path, text))
    assert {k for k, end in ends.items() if end[0] == LINK_DOWN} == set(range(10, 30))


def test_a_flow_without_any_way_keeps_dying_at_the_cut(tmp_path):
    """Otherwise an unreachable controller would stop the simulation, or be reached."""
    text = FILE + "routing: {convergence: 0 s}\n"
    text += "events: [{at: 1 s, for: 2 s, event: node_down, node: b}]\n"
    spec = read(tmp_path, text)
    assert [type(change) for change in spec.changes[:2]] == [LinkCut, LinkCut]
    ends = way(spec)
    assert {k for k, end in ends.items() if end == (LINK_DOWN, 0)} == set(range(10, 30))


def test_a_link_that_two_events_hold_down_is_repaired_once(tmp_path):
    """Otherwise the end of a short failure would end a longer one."""
    text = (
        FILE
        + """\
events:
  - {at: 1 s, for: 3 s, event: link_down, link: [a, b]}
  - {at: 2 s, for: 1 s, event: node_down, node: a}
"""
    )
    changes = read(tmp_path, text).changes
    assert [change for change in changes if change.link == 0] == [
        LinkCut(SECOND, 0),
        LinkRepair(4 * SECOND, 0),
    ]
    assert [change for change in changes if change.link == 1] == [
        LinkCut(2 * SECOND, 1),
        LinkRepair(3 * SECOND, 1),
    ]


def test_rates_and_losses_of_a_file(tmp_path):
    """Otherwise an event would last for ever, or come back to another rate."""
    text = (
        FILE
        + """\
events:
  - {at: 2 s, for: 1 s, event: rate, link: [b, c], rate: 2 Mbit/s}
  - {at: 1 s, for: 3 s, event: loss, probability: 0.5}
"""
    )
    assert read(tmp_path, text).changes == (
        *(LossChange(SECOND, number, 0.5) for number in range(3)),
        RateChange(2 * SECOND, 2, 2_000_000),
        RateChange(3 * SECOND, 2, 10**9),
        *(LossChange(4 * SECOND, number, 0.0) for number in range(3)),
    )


def test_faulty_events_are_refused_with_their_lines(tmp_path):
    """Otherwise an event with a slip of the pen would silently not happen."""
    text = (
        FILE
        + """\
events:
  - {at: 1 s, event: link_down, link: [b, x]}
  - {at: 1 s, event: node_down, node: aa}
  - {at: 1 s, event: rate, link: [a, b]}
  - {at: 1 s, event: link_down, link: [a, b], node: a}
  - {at: 1 s, event: link_dwn, link: [a, b]}
  - {at: 1 s, evnt: link_down, link: [a, b]}
"""
    )
    found = findings(tmp_path, text)
    for start in (
        "network.yaml:8: events.0: there is no link b-x",
        "network.yaml:9: unknown node 'aa' (did you mean 'a'?)",
        "network.yaml:10: events.2 event 'rate' needs 'rate'",
        "network.yaml:11: events.3 event 'link_down' takes no 'node'",
        "network.yaml:12: events.4.event must be ",
        "network.yaml:13: unknown key 'evnt' (did you mean 'event'?)",
    ):
        assert any(line.startswith(start) for line in found), (start, found)


def test_faults_of_an_experiment_are_named_by_its_settings(tmp_path):
    """Otherwise a user would look for an event in the case's file that stands in the experiment's.

    What is wrong with the file itself is said in the same error.
    """
    events = (
        {"at": "1 s", "event": "node_down", "node": "aa"},
        {"at": "1 s", "event": "link_down", "link": ["a", "x"]},
        {"at": "-1 s", "event": "loss", "probability": 0.1},
        {"att": "1 s", "event": "loss", "probability": 0.1},
    )
    traffic = (
        {"kind": "cbrr", "from": "a", "to": "b", "rate": 1000, "payload": 10},
        {"kind": "cbr", "from": "a", "to": "bb", "rate": 1000, "payload": 10},
        {"kind": "cbr", "from": "a", "to": "a", "rate": 1000, "payload": 10},
        {"from": "a"},
    )
    text = FILE + "rooting: {}\n"
    found = findings(tmp_path, text, events=events, traffic=traffic)
    for start in (
        "network.yaml:7: unknown key 'rooting' (did you mean 'routing'?)",
        "network.events.0.node: unknown node 'aa'",
        "network.events.1: there is no link a-x",
        "network.events.2.at must be ",
        "network.events.3.att: unknown key 'att' (did you mean 'at'?)",
        "network.traffic.0.kind: unknown kind 'cbrr' (did you mean 'cbr'?)",
        "network.traffic.1.to: unknown node 'bb'",
        "network.traffic.2 must join two nodes",
        "network.traffic.3 lacks 'kind'",
    ):
        assert any(line.startswith(start) for line in found), (start, found)


def test_what_an_experiment_adds_happens_as_well(tmp_path):
    """Otherwise a study of failures would study the sound network."""
    text = FILE + "events: [{at: 2 s, event: link_down, link: [a, b]}]\n"
    event = {"at": "1 s", "event": "rate", "link": ["a", "c"], "rate": "1 Mbit/s"}
    flow = {"kind": "cbr", "from": "a", "to": "b", "rate": 1000, "payload": 10}
    spec = read(tmp_path, text, events=(event,), traffic=(flow,))
    assert spec.changes == (RateChange(SECOND, 1, 1_000_000), LinkCut(2 * SECOND, 0))
    assert [cross.route for cross in spec.cross_flows] == [("a", "b")]
    assert len(spec.flows) == len(SOURCES) * len(DESTINATIONS)


@pytest.mark.parametrize("transport", ["unicast", "multicast", "tcp"])
def test_many_packets_in_flight_survive_a_cut_elsewhere(transport):
    """Otherwise a cut on a busy network would ask for more memory than there is.

    Three thousand frames are on a long link when another one is cut.
    """
    links = [Link("a", "b", 10**10, SECOND, DropTail(5000)), Link("b", "c", 10**9, 0, DropTail(9))]
    spec = joined(links, [Source("p", 1, "a")], [Destination("c", "G", 1, "b")])
    spec = replace(spec, transport=transport, changes=(LinkCut(SECOND // 2, 1),))
    flood = CrossFlow("cross flow 0", Poisson(8e6, 100), ("a", "b"))
    engine = PacketEngine(replace(spec, cross_flows=(flood,)), seed=1)
    engine.send(SECOND // 4, ONE, 0)
    engine.run_until(SECOND // 2 - 1)
    assert engine.counts().in_flight > 3000
    assert len(engine.run_until(3 * SECOND).arrivals) == 1


def test_packets_die_at_a_cut_in_one_order_however_the_tables_grew():
    """Otherwise the order of drops would depend on how far ahead frames are announced.

    More frames are on the link than the tables hold at first; they grow sooner if all are announced
    at the beginning.
    """
    links = [Link("a", "b", 10**10, SECOND, DropTail(9))]
    places = [Destination("c", "G", 1, "b"), Destination("d", "H", 2, "b")]
    spec = joined(links, [Source("p", 1, "a")], places)
    spec = replace(spec, changes=(LinkCut(SECOND * 9 // 10, 0),))
    runs = []
    for is_early in (True, False):
        engine = PacketEngine(spec, seed=1)
        outcomes = []
        for k in range(4_000):
            measured_ns = SECOND // 4 + 100_000 * k
            if not is_early:
                outcomes.append(engine.run_until(measured_ns - 1))
            engine.send(measured_ns, ONE, k)
        outcomes.append(engine.run_until(2 * SECOND))
        runs.append(np.concatenate([outcome.drops for outcome in outcomes]))
    assert runs[0].tobytes() == runs[1].tobytes()
    assert len(runs[0]) == 8_000
