"""Taps: what a link carried, in the order of time."""

from dataclasses import replace
from random import Random

import numpy as np
import pytest

from network.builders import ALL, busy_ring, chain, joined
from network.mixtures import mixed_network
from tieline.network.packet import PacketEngine
from tieline.network.queues import DropTail, StrictPriority, WaitingLine
from tieline.network.spec import Destination, Link, LinkCut, RateChange, Source

ONE = np.array([0])


def records(engine: PacketEngine) -> list[tuple[int, int, int]]:
    """Return (sent_ns, port, sequence) of what was heard since the last look."""
    return [(int(r["sent_ns"]), int(r["port"]), int(r["sequence"])) for r in engine.tapped()]


def test_starts_of_transmission_by_hand():
    """Otherwise a capture file would carry other times than the link."""
    spec = replace(chain([(1_000_000, 1_000_000), (500_000, 0)]), taps=(0, 1))
    engine = PacketEngine(spec, seed=1)
    for k in range(2):
        engine.send(0, ONE, k)
    engine.run_until(400_000)
    assert records(engine) == [(0, 0, 0)]
    engine.run_until(ALL)
    assert records(engine) == [(496_000, 0, 1), (1_496_000, 2, 0), (2_488_000, 2, 1)]
    assert records(engine) == []


def test_what_is_heard_says_whose_packet_it_is():
    """Otherwise a capture could not be told apart by flow."""
    spec = joined(
        [Link("a", "b", 1_000_000, 0, DropTail(9), overhead_bytes=7)],
        [Source("p", 1, "a"), Source("q", 1, "b")],
        [Destination("c", "G", 1, "b"), Destination("d", "H", 2, "a")],
    )
    engine = PacketEngine(replace(spec, taps=(0,)), seed=1)
    engine.send(0, np.array([0, 1]), 5)
    engine.run_until(ALL)
    taps = engine.tapped()
    heard = [tuple(int(row[n]) for n in ("port", "flow", "sequence", "bytes")) for row in taps]
    # p to d and q to c use no link.
    assert heard == [(0, 0, 5, 62), (1, 3, 5, 62)]


@pytest.mark.parametrize("step_ns", [1_000_000, 7_654_321, 10**9])
def test_as_many_packets_are_heard_as_the_link_has_carried(step_ns):
    """Otherwise captures would not agree with the statistics of links."""
    engine = PacketEngine(replace(busy_ring(), taps=(0, 1, 2, 3)), seed=3)
    heard = []
    for until_ns in range(0, 10**9 + 1, step_ns):
        engine.run_until(until_ns)
        rows = engine.tapped()
        assert np.all(rows["sent_ns"] > until_ns - step_ns)
        assert np.all(rows["sent_ns"] <= until_ns)
        heard.append(rows)
    taps = np.concatenate(heard)
    assert np.all(np.diff(taps["sent_ns"]) >= 0)
    counts = np.bincount(taps["port"], minlength=8)
    ends = [(link.a, link.b) for link in busy_ring().links]
    uses = {(use.origin, use.target): use for use in engine.links()}
    for number, (a, b) in enumerate(ends):
        for port, pair in ((2 * number, (a, b)), (2 * number + 1, (b, a))):
            # Packets that wait are booked on the link already, and have not been heard.
            assert 0 <= uses[pair].packets - counts[port] <= 30


@pytest.mark.parametrize("seed", range(12))
def test_what_was_heard_agrees_with_the_link_through_cuts_and_rate_changes(seed):
    """Otherwise packets that never left would stay in a capture, or such that left be missing."""
    spec = mixed_network(Random(seed), 400_000_000)
    cuts = tuple(LinkCut(400_000_000, number) for number in range(len(spec.links)))
    spec = replace(spec, changes=(*spec.changes, *cuts), taps=tuple(range(len(spec.links))))
    engine = PacketEngine(spec, seed=1)
    for k in range(20):
        engine.send(k * 20_000_000, np.arange(len(spec.sources)), k)
    engine.run_until(3 * 10**9)
    taps = engine.tapped()
    assert np.all(np.diff(taps["sent_ns"]) >= 0)
    counts = np.bincount(taps["port"], minlength=2 * len(spec.links))
    uses = {spec.ports[use.origin, use.target]: use.packets for use in engine.links()}
    assert {port: int(count) for port, count in enumerate(counts)} == uses


QUEUES = {
    "plain": DropTail(10),
    "served": StrictPriority((WaitingLine(10), WaitingLine(10)), (frozenset({46}), frozenset())),
}


@pytest.mark.parametrize("kind", QUEUES)
@pytest.mark.parametrize(
    ("cut_ns", "heard"), [(600_000, [0, 496_000]), (992_000, [0, 496_000]), (1, [0])]
)
def test_what_waits_at_a_cut_is_not_heard(kind, cut_ns, heard):
    """Otherwise a capture would hold packets that a dead link carried."""
    link = Link("a", "b", 1_000_000, 10_000_000, QUEUES[kind])
    spec = joined([link], [Source("p", 1, "a")], [Destination("c", "G", 1, "b")])
    engine = PacketEngine(replace(spec, taps=(0,), changes=(LinkCut(cut_ns, 0),)), seed=1)
    for k in range(4):
        engine.send(0, ONE, k)
    engine.run_until(ALL)
    assert [sent_ns for sent_ns, _, _ in records(engine)] == heard
    assert engine.links()[0].packets == len(heard)


@pytest.mark.parametrize("kind", QUEUES)
def test_what_waits_at_a_rate_change_is_heard_when_it_starts(kind):
    """Otherwise a capture would keep the times of the old rate."""
    link = Link("a", "b", 1_000_000, 10_000_000, QUEUES[kind])
    spec = joined([link], [Source("p", 1, "a")], [Destination("c", "G", 1, "b")])
    change = RateChange(600_000, 0, 500_000)
    engine = PacketEngine(replace(spec, taps=(0,), changes=(change,)), seed=1)
    for k in range(4):
        engine.send(0, ONE, k)
    engine.run_until(ALL)
    assert [sent_ns for sent_ns, _, _ in records(engine)] == [0, 496_000, 992_000, 1_984_000]
