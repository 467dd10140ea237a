"""A port: exact times by hand, first in first out, drop-tail, losses after the link is used."""

import numpy as np
import pytest

from network.builders import ALL, chain, joined, overhead_for
from tieline.errors import CosimError
from tieline.network.engine import LOSS, QUEUE_FULL
from tieline.network.losses import Bernoulli
from tieline.network.packet import PacketEngine
from tieline.network.queues import DropTail
from tieline.network.spec import Destination, Link, Source, service_ns

ONE = np.array([0])


def test_two_hops_by_hand():
    """Otherwise every delay that is reported would be wrong.

        p (n0) ---10 Mbit/s, 2 ms--- n1 ---2 Mbit/s, 5 ms--- n2 (c)

    A frame is 106 bytes on the links: 84.8 us on the first, 424 us on the second. Three frames
    leave at 0, 10 and 2,000 us. The first arrives at 84.8 + 2000 + 424 + 5000 us. The second waits
    for the first at both links: it follows 424 us behind it. The third finds both links idle.
    """
    engine = PacketEngine(
        chain([(10_000_000, 2_000_000), (2_000_000, 5_000_000)], overhead_bytes=overhead_for(106)),
        seed=1,
    )
    for sequence, measured_ns in enumerate((0, 10_000, 2_000_000)):
        engine.send(measured_ns, ONE, sequence)
    first_ns = 84_800 + 2_000_000 + 424_000 + 5_000_000
    arrivals = engine.run_until(ALL).arrivals
    log = [(7_508_800, 0), (7_508_800 + 424_000, 1), (2_000_000 + first_ns, 2)]
    assert [(int(row["arrival_ns"]), int(row["sequence"])) for row in arrivals] == log
    first, second = engine.links()[0], engine.links()[2]
    assert (first.packets, first.bytes, first.busy_ns) == (3, 318, 3 * 84_800)
    assert (second.max_queue, first.max_queue) == (1, 1)


def test_a_burst_leaves_back_to_back():
    """Otherwise the frames that a PMU sends to all controllers would not queue behind each other.

    ns-3 3.44 (`analytic.json`, 4b): 34 packets sent at 1000 + k ns over the two hops above; the
    last has a delay of 21,500,767 ns.
    """
    engine = PacketEngine(
        chain([(10_000_000, 2_000_000), (2_000_000, 5_000_000)], overhead_bytes=overhead_for(106)),
        seed=1,
    )
    for k in range(34):
        engine.send(1000 + k, ONE, k)
    delays_ns = engine.run_until(ALL).arrivals["arrival_ns"] - 1000 - np.arange(34)
    assert (delays_ns[0], delays_ns[-1]) == (7_508_800, 21_500_767)


@pytest.mark.parametrize(
    ("rate_bps", "payload_bytes", "delay_ns"),
    [
        (3_333_333, 76, 254_400),
        (7_000_000, 77, 122_286),
        (1_544_000, 100, 673_575),
        (44_736_000, 512, 96_924),
    ],
)
def test_serialisation_is_rounded_to_the_nearest_nanosecond(rate_bps, payload_bytes, delay_ns):
    """Otherwise delays would drift from ns-3's, whose figures these are (`analytic.json`, 6)."""
    assert (
        service_ns(Link("a", "b", rate_bps, 0, DropTail(1), overhead_bytes=2), payload_bytes)
        == delay_ns
    )


@pytest.mark.parametrize(
    ("queue", "first_lost", "received", "longest_ns"),
    [(100, 601, 16_766, 102_000_000), (20, 121, 16_686, 22_000_000)],
)
def test_drop_tail_at_120_percent_load(queue, first_lost, received, longest_ns):
    """Otherwise an overloaded link would drop other packets, or more, than a real one.

    ns-3 3.44 (`analytic.json`, 3): 20,000 packets of 500 bytes at floor(k 1e6 / 1.2) ns on
    4 Mbit/s and 1 ms; in the long run one packet in six is too many.
    """
    spec = chain([(4_000_000, 1_000_000)], queue=queue, overhead_bytes=overhead_for(500))
    engine = PacketEngine(spec, seed=1)
    sent_ns = np.array([int(k * 1e6 / 1.2) for k in range(20_000)])
    for k, measured_ns in enumerate(sent_ns.tolist()):
        engine.send(measured_ns, ONE, k)
    outcome = engine.run_until(ALL)
    delays_ns = outcome.arrivals["arrival_ns"] - sent_ns[outcome.arrivals["sequence"]]
    assert outcome.drops["sequence"][:4].tolist() == [first_lost + 6 * i for i in range(4)]
    assert set(outcome.drops["reason"].tolist()) == {QUEUE_FULL}
    assert np.array_equal(outcome.drops["dropped_ns"], sent_ns[outcome.drops["sequence"]])
    assert (len(outcome.arrivals), delays_ns.max()) == (received, longest_ns)
    assert engine.links()[0].max_queue == queue
    assert engine.links()[0].dropped_queue == 20_000 - received


def test_packets_leave_a_port_in_the_order_in_which_they_came():
    """Otherwise a queue would not be a queue."""
    engine = PacketEngine(chain([(1_000_000, 0)], queue=1000), seed=1)
    for k in range(500):
        engine.send(k * 100_000, ONE, k)
    arrivals = engine.run_until(ALL).arrivals
    assert arrivals["sequence"].tolist() == list(range(500))
    # 62 bytes take 496 us at 1 Mbit/s: the port is never idle after the first.
    assert set(np.diff(arrivals["arrival_ns"]).tolist()) == {496_000}


def test_a_lost_packet_has_used_the_link():
    """Otherwise losses would make room for other packets, which they do not."""
    spec = chain([(1_000_000, 1_000_000)], queue=1000, loss=Bernoulli(0.5))
    engine = PacketEngine(spec, seed=3)
    for k in range(200):
        engine.send(0, ONE, k)
    outcome = engine.run_until(ALL)
    assert set(outcome.drops["reason"].tolist()) == {LOSS}
    slots = {*outcome.arrivals["arrival_ns"].tolist(), *outcome.drops["dropped_ns"].tolist()}
    assert slots == {1_000_000 + 496_000 * (k + 1) for k in range(200)}
    link = engine.links()[0]
    assert (link.packets, link.busy_ns) == (200, 200 * 496_000)
    assert link.dropped_loss == len(outcome.drops)


def test_busy_time_counts_what_is_past_alone():
    """Otherwise a link with a backlog at the end would be busy for more than all the time."""
    engine = PacketEngine(chain([(1_000_000, 0)], queue=1000), seed=1)
    for k in range(100):
        engine.send(0, ONE, k)
    engine.run_until(10_000_000)
    assert engine.links()[0].busy_ns == 10_000_000


def test_a_controller_beside_its_pmu_waits_for_processing_alone():
    """Otherwise the local sensor would come later than those across the country."""
    spec = joined([], [Source("p", 1, "a", 5_000)], [Destination("c", "G", 1, "a", 700)])
    engine = PacketEngine(spec, seed=1)
    engine.send(1_000, ONE, 0)
    assert len(engine.run_until(6_699).arrivals) == 0
    assert engine.counts().in_flight == 1
    assert engine.run_until(6_700).arrivals["arrival_ns"].tolist() == [6_700]


def test_frames_leave_a_pmu_in_order_though_its_processing_time_varies():
    """Otherwise a PMU would send frame 8 before frame 7, which none does."""
    from tieline.network.jitter import UniformJitter

    source = Source("p", 1, "a", 0, UniformJitter(0, 50_000_000))
    engine = PacketEngine(joined([], [source], [Destination("c", "G", 1, "a")]), seed=1)
    for k in range(300):
        engine.send(k * 1_000_000, ONE, k)
    arrivals = engine.run_until(ALL).arrivals
    assert arrivals["sequence"].tolist() == list(range(300))
    assert np.all(arrivals["arrival_ns"] >= np.arange(300) * 1_000_000)


def test_time_only_goes_forward():
    """Otherwise a broken time contract would pass for a short delay."""
    engine = PacketEngine(chain([(1_000_000, 0)]), seed=1)
    engine.run_until(1_000)
    with pytest.raises(CosimError, match="cannot go back from 1000 to 999 ns"):
        engine.run_until(999)
    with pytest.raises(CosimError, match="at 999 ns came when"):
        engine.send(999, ONE, 0)
    engine.send(1_000, ONE, 0)
