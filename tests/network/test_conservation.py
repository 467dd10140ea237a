"""Every packet is accounted for at every instant, whatever the network."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from network.builders import busy_ring, joined
from tieline.errors import CosimError
from tieline.network.engine import Counts
from tieline.network.jitter import UniformJitter
from tieline.network.losses import Bernoulli
from tieline.network.packet import PacketEngine
from tieline.network.packet.memory import FREE_PACKETS
from tieline.network.queues import DropTail
from tieline.network.spec import CrossFlow, Destination, Link, NetworkSpec, Source
from tieline.network.traffic import Cbr, Poisson


@st.composite
def networks(draw: st.DrawFn) -> NetworkSpec:
    """Draw a connected network of up to six nodes that is often overloaded."""
    size = draw(st.integers(2, 6))
    names = [f"n{i}" for i in range(size)]
    tree = [(draw(st.integers(0, i - 1)), i) for i in range(1, size)]
    extra = draw(
        st.lists(st.tuples(st.integers(0, size - 1), st.integers(0, size - 1)), max_size=3)
    )
    pairs = sorted({(min(p), max(p)) for p in [*tree, *extra] if p[0] != p[1]})
    links = [
        Link(
            names[a],
            names[b],
            draw(st.sampled_from([64_000, 500_000, 10_000_000])),
            draw(st.sampled_from([0, 1, 300_000, 5_000_000])),
            DropTail(draw(st.integers(1, 6))),
            draw(st.sampled_from([None, Bernoulli(0.3)])),
            draw(st.sampled_from([None, UniformJitter(0, 2_000_000)])),
            draw(st.integers(0, 20)),
        )
        for a, b in pairs
    ]
    place = st.sampled_from(names)
    sources = [Source(f"p{i}", i, draw(place), 1_000 * i) for i in range(draw(st.integers(0, 3)))]
    destinations = [
        Destination(f"c{j}", f"G{j}", j, draw(place), 500_000 * j)
        for j in range(draw(st.integers(0, 3)))
    ]
    kinds = st.sampled_from([Cbr, Poisson])
    rates = st.sampled_from([20_000.0, 900_000.0])
    plans = draw(st.lists(st.tuples(kinds, rates, place, place), max_size=2))
    cross = [
        CrossFlow(f"cross flow {c}", kind(rate, 300), (a, b))
        for c, (kind, rate, a, b) in enumerate(plans)
        if a != b
    ]
    return joined(links, sources, destinations, cross)


# Compilation happens in the first example, so no deadline holds.
@settings(deadline=None, max_examples=60)
@given(networks(), st.integers(0, 2**32), st.lists(st.integers(0, 9_000_000), max_size=12))
def test_every_packet_is_accounted_for_at_every_instant(spec, seed, steps):
    """Otherwise packets would vanish, or arrive twice, and every loss figure would be in doubt."""
    engine = PacketEngine(spec, seed)
    sources = np.arange(len(spec.sources))
    seen: set[tuple[int, ...]] = set()
    now_ns = 0
    for sequence, step_ns in enumerate([*steps, 60_000_000_000]):
        engine.send(now_ns, sources, sequence)
        now_ns += step_ns
        outcome = engine.run_until(now_ns)
        counts = engine.counts()
        counts.check(now_ns)
        for records in (outcome.arrivals, outcome.drops):
            ended = [
                (int(row["source"]), int(row["destination"]), int(row["sequence"]))
                for row in records
            ]
            assert seen.isdisjoint(ended)
            assert len(set(ended)) == len(ended)
            seen.update(ended)
    everything = {(f.source, f.destination, k) for f in spec.flows for k in range(len(steps) + 1)}
    # A minute after the last frame, only cross traffic can still be under way.
    assert seen == everything
    if not spec.cross_flows:
        assert counts.in_flight == 0
    uses = engine.links()
    assert sum(use.dropped_queue for use in uses) == counts.dropped_queue
    assert sum(use.dropped_loss for use in uses) == counts.dropped_loss


def test_counts_that_do_not_add_up_are_an_error():
    """Otherwise the check at the end of every interval would check nothing."""
    Counts(10, 5, 2, 1, 2).check(0)
    with pytest.raises(CosimError, match="10 sent, but 5 delivered, 2 dropped at queues, 1 lost"):
        Counts(10, 5, 2, 1, 1).check(77)


def test_a_packet_that_disappears_inside_is_noticed():
    """Otherwise the check could pass because it infers what it should count."""
    engine = PacketEngine(busy_ring(), seed=1)
    engine.send(0, np.arange(2), 0)
    engine.run_until(5_000_000)
    engine._memory.control[FREE_PACKETS] += 1
    with pytest.raises(CosimError, match="lost count"):
        engine.run_until(5_000_001)


def test_an_overloaded_network_drops_and_does_not_grow():
    """Otherwise a long overload would exhaust the memory instead of losing packets.

    Cross traffic of a hundred times the link's rate, for 20 s.
    """
    link = Link("a", "b", 1_000_000, 1_000_000, DropTail(50))
    flood = CrossFlow("cross flow 0", Poisson(100e6, 972), ("a", "b"))
    engine = PacketEngine(joined([link], [], [], [flood]), seed=1)
    cells = len(engine._memory.cells)
    engine.run_until(20_000_000_000)
    counts = engine.counts()
    assert counts.in_flight <= 50 + 1 + 1
    assert counts.dropped_queue > 0.98 * counts.sent
    assert len(engine._memory.cells) == cells


def test_more_packets_than_the_first_room_are_carried():
    """Otherwise a fast, long link would lose packets for want of memory."""
    link = Link("a", "b", 10**9, 2_000_000_000, DropTail(20_000))
    spec = joined([link], [Source("p", 1, "a")], [Destination("c", "G", 2, "b")])
    engine = PacketEngine(spec, seed=1)
    for k in range(12_000):
        engine.send(0, np.array([0]), k)
    arrivals = engine.run_until(10**10).arrivals
    assert arrivals["sequence"].tolist() == list(range(12_000))
