"""Multicast trees: each link carries a frame once, each controller gets it once.

p (a) --- b --- c (c0)          1 Mbit/s and 1 ms each: a frame of 62 bytes takes 496 us
c3 |      | c2
          d (c1)
"""

from dataclasses import replace

import numpy as np
import pytest

from network.builders import ALL, joined
from tieline.network.engine import LINK_DOWN, LOSS, QUEUE_FULL
from tieline.network.losses import Loss
from tieline.network.losses.trace import LossTrace
from tieline.network.packet import PacketEngine
from tieline.network.queues import DropTail
from tieline.network.spec import Destination, Link, LinkCut, NetworkSpec, Source

ONE = np.array([0])
HOP_NS = 496_000 + 1_000_000
PLACES = {"c0": "c", "c1": "d", "c2": "b", "c3": "a"}


def star(
    upstream: Loss | None = None, downstream: Loss | None = None, queue: int = 10
) -> NetworkSpec:
    """Return the network of the drawing, with losses of a-b and of b-c."""
    links = [
        Link("a", "b", 1_000_000, 1_000_000, DropTail(queue), upstream),
        Link("b", "c", 1_000_000, 1_000_000, DropTail(queue), downstream),
        Link("b", "d", 1_000_000, 1_000_000, DropTail(queue)),
    ]
    places = [Destination(name, name, 1, node) for name, node in PLACES.items()]
    return replace(joined(links, [Source("p", 1, "a")], places), transport="multicast")


def times(records, name):
    """Return {destination: time} of the records of one frame."""
    return {int(row["destination"]): int(row[name]) for row in records}


def test_each_controller_gets_the_frame_once_and_each_link_carries_it_once():
    """Otherwise multicast would save nothing, or leave a controller out."""
    engine = PacketEngine(star(), seed=1)
    engine.send(0, ONE, 0)
    assert engine.counts().in_flight == 4
    arrivals = engine.run_until(ALL).arrivals
    assert len(arrivals) == 4
    assert times(arrivals, "arrival_ns") == {0: 2 * HOP_NS, 1: 2 * HOP_NS, 2: HOP_NS, 3: 0}
    assert {(u.origin, u.target): u.packets for u in engine.links() if u.packets} == {
        ("a", "b"): 1,
        ("b", "c"): 1,
        ("b", "d"): 1,
    }
    assert (engine.counts().sent, engine.counts().delivered) == (4, 4)


def test_members_under_way_are_counted_where_the_packet_is():
    """Otherwise a tree's packets would be lost count of between the forks."""
    engine = PacketEngine(star(), seed=1)
    engine.send(0, ONE, 0)
    counted = []
    for until_ns in (0, HOP_NS - 1, HOP_NS, 2 * HOP_NS - 1, 2 * HOP_NS):
        engine.run_until(until_ns)
        counted.append((engine.counts().delivered, engine.counts().in_flight))
    assert counted == [(1, 3), (1, 3), (2, 2), (2, 2), (4, 0)]


@pytest.mark.parametrize("seed", range(8))
def test_a_frame_takes_as_long_as_alone_on_an_empty_network(seed):
    """Otherwise a tree would be another way than the shortest one.

    Random networks of ten nodes; a unicast packet that is the only one gives the time.
    """
    generator = np.random.default_rng(seed)
    names = [f"n{i}" for i in range(10)]
    pairs = {(int(generator.integers(i)), i) for i in range(1, 10)}
    pairs |= {tuple(sorted(generator.choice(10, 2, replace=False).tolist())) for _ in range(6)}
    links = [
        Link(
            names[a],
            names[b],
            int(generator.integers(1, 20)) * 100_000,
            int(generator.integers(5_000_000)),
            DropTail(10),
        )
        for a, b in sorted(pairs)
    ]
    sources = [Source("p", 1, names[int(generator.integers(10))])]
    places = [Destination(name, name, 1, name) for name in names]
    engine = PacketEngine(replace(joined(links, sources, places), transport="multicast"), 1)
    engine.send(0, ONE, 0)
    together = times(engine.run_until(ALL).arrivals, "arrival_ns")
    for number, place in enumerate(places):
        alone = PacketEngine(joined(links, sources, [place]), 1)
        alone.send(0, ONE, 0)
        assert together[number] == int(alone.run_until(ALL).arrivals["arrival_ns"][0])
    # A tree: as many links as nodes besides the root.
    assert sum(use.packets for use in engine.links()) == 9


def test_a_loss_upstream_is_a_loss_for_all_below():
    """Otherwise losses of a tree would be independent where they are one event."""
    engine = PacketEngine(star(LossTrace((0,))), seed=1)
    for k in range(2):
        engine.send(k * 10**8, ONE, k)
    outcome = engine.run_until(ALL)
    assert times(outcome.drops, "dropped_ns") == {0: HOP_NS, 1: HOP_NS, 2: HOP_NS}
    assert set(outcome.drops["reason"].tolist()) == {LOSS}
    assert [int(row["destination"]) for row in outcome.arrivals if row["sequence"] == 0] == [3]
    assert sum(row["sequence"] == 1 for row in outcome.arrivals) == 4
    assert engine.links()[0].dropped_loss == 1


def test_a_loss_below_a_fork_is_a_loss_for_one_branch():
    """Otherwise a bad link would silence controllers that do not use it."""
    engine = PacketEngine(star(downstream=LossTrace((0,))), seed=1)
    engine.send(0, ONE, 0)
    outcome = engine.run_until(ALL)
    assert times(outcome.drops, "dropped_ns") == {0: 2 * HOP_NS}
    assert set(times(outcome.arrivals, "arrival_ns")) == {1, 2, 3}


def test_a_full_queue_or_a_cut_drops_for_all_below():
    """Otherwise a dropped copy would be counted once for many controllers."""
    spec = replace(star(queue=1), changes=(LinkCut(10**8, 0),))
    engine = PacketEngine(spec, seed=1)
    for k in range(3):
        engine.send(0, ONE, k)
    engine.send(10**8 - 100_000, ONE, 3)
    drops = engine.run_until(ALL).drops
    rows = [(int(row["sequence"]), int(row["destination"]), int(row["reason"])) for row in drops]
    assert sorted(rows) == sorted(
        (k, j, why) for k, why in ((2, QUEUE_FULL), (3, LINK_DOWN)) for j in (0, 1, 2)
    )
    assert [int(row["dropped_ns"]) for row in drops] == [0] * 3 + [10**8] * 3
