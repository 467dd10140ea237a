"""Connections in the manner of TCP: order, retransmission, windows, and what they get of a link.

A segment of a PMU frame is 34 + 32 + 20 bytes: 688 us at 1 Mbit/s; an acknowledgement is 52: 416.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from network.builders import ALL, chain, joined
from tieline.network.engine import QUEUE_FULL
from tieline.network.losses import Bernoulli, Loss
from tieline.network.losses.trace import LossTrace
from tieline.network.packet import PacketEngine, tcp
from tieline.network.packet.build import LEAST_WAIT_NS
from tieline.network.packet.routes import FRAME_WINDOW
from tieline.network.queues import DropTail, EarlyDetection, RandomEarlyDetection
from tieline.network.spec import CrossFlow, Link, LinkCut, LinkRepair, NetworkSpec
from tieline.network.traffic import Greedy

ONE = np.array([0])
SECOND = 10**9
SEGMENT_NS, ACK_NS, WAY_NS = 688_000, 416_000, 10_000_000


def connected(loss: Loss | None = None) -> NetworkSpec:
    """Return one link of 1 Mbit/s and 10 ms under a connection; each direction has the loss."""
    return replace(chain([(1_000_000, WAY_NS)], loss=loss), transport="tcp")


def greedy(link: Link, *flows: Greedy, seconds: float, **more: int) -> PacketEngine:
    """Return the engine after greedy connections have used a link, which is listened to."""
    cross = [CrossFlow(f"g{n}", flow, (link.a, link.b), **more) for n, flow in enumerate(flows)]
    engine = PacketEngine(replace(joined([link], [], [], cross), taps=(0,)), seed=1)
    engine.run_until(round(seconds * SECOND))
    return engine


def delivered(engine: PacketEngine, connection: int = 0) -> int:
    """Return the segments that a connection has delivered in order."""
    return int(engine._memory.table("connections")[connection, tcp.EXPECTED])


def test_without_losses_a_frame_takes_serialisation_and_propagation():
    """Otherwise connections would be slower than datagrams for no reason."""
    engine = PacketEngine(connected(), seed=1)
    for k in range(20):
        engine.send(k * 20_000_000, ONE, k)
    arrivals = engine.run_until(ALL).arrivals
    assert set((arrivals["arrival_ns"] - np.arange(20) * 20_000_000).tolist()) == {
        SEGMENT_NS + WAY_NS
    }
    assert (engine.links()[0].bytes, engine.links()[1].bytes) == (20 * 86, 20 * 52)


def test_frames_behind_a_lost_one_come_with_its_retransmission():
    """Otherwise head-of-line blocking, the price of a connection, would not be seen.

    Frames every 20 ms; the second segment is lost, and so is the second acknowledgement, the first
    one that repeats. The third, fourth and fifth later segments make three duplicates; the last of
    them leaves at 100 + 10.688 ms. It is back 10.416 ms later, and the lost segment takes 10.688 ms
    again. By then all that was sent up to 120 ms is there. The window is then 3 + 3 segments, as
    many as are under way, so the eighth frame leaves with the next duplicate, at 141.104 ms.
    """
    engine = PacketEngine(connected(LossTrace((1,))), seed=1)
    for k in range(9):
        engine.send(k * 20_000_000, ONE, k)
    outcome = engine.run_until(ALL)
    again_ns = 100_000_000 + 2 * (SEGMENT_NS + WAY_NS) + ACK_NS + WAY_NS
    expected = [SEGMENT_NS + WAY_NS] + [again_ns] * 6
    expected += [sent_ns + SEGMENT_NS + WAY_NS for sent_ns in (141_104_000, 160_000_000)]
    assert outcome.arrivals["sequence"].tolist() == list(range(9))
    assert outcome.arrivals["arrival_ns"].tolist() == expected
    assert len(outcome.drops) == 0


@pytest.mark.parametrize(("lost", "waited_s"), [((0,), 1), ((0, 1), 3), ((0, 1, 2), 7)])
def test_a_lost_tail_waits_for_the_timer_which_doubles(lost, waited_s):
    """Otherwise a last frame, behind which no other comes, would be lost for ever (RFC 6298)."""
    engine = PacketEngine(connected(LossTrace(lost)), seed=1)
    engine.send(0, ONE, 0)
    arrivals = engine.run_until(ALL).arrivals
    assert arrivals["arrival_ns"].tolist() == [waited_s * SECOND + SEGMENT_NS + WAY_NS]


def test_the_timer_follows_the_round_trips():
    """Otherwise a tail would be repeated after the first second's guess for ever.

    Ten round trips of 21.1 ms make the least wait, which runs from the hand-over of the frame.
    """
    engine = PacketEngine(connected(LossTrace((10,))), seed=1)
    for k in range(11):
        engine.send(k * 50_000_000, ONE, k)
    arrivals = engine.run_until(ALL).arrivals
    assert arrivals["arrival_ns"][-1] == 500_000_000 + LEAST_WAIT_NS + SEGMENT_NS + WAY_NS


@pytest.mark.parametrize("seed", range(4))
def test_all_frames_come_in_order_though_the_link_loses_one_in_twenty(seed):
    """Otherwise the connection would not be one."""
    engine = PacketEngine(connected(Bernoulli(0.05)), seed)
    for k in range(1500):
        engine.send(k * SECOND // 60, ONE, k)
    outcome = engine.run_until(ALL)
    assert len(outcome.drops) == 0
    assert outcome.arrivals["sequence"].tolist() == list(range(1500))
    sent = engine.links()[0].packets
    # Each frame goes until it arrives: 1/0.95 times in the mean, and some go in vain.
    assert 1500 / 0.95 - 60 < sent < 1.15 * 1500
    assert engine.counts().in_flight == 0


def test_a_full_send_buffer_drops_frames():
    """Otherwise a connection over a dead link would store frames without end."""
    engine = PacketEngine(replace(connected(), changes=(LinkCut(0, 0),)), seed=1)
    for k in range(FRAME_WINDOW + 6):
        engine.send(k * 1_000_000, ONE, k)
    drops = engine.run_until(2 * SECOND).drops
    assert drops["sequence"].tolist() == list(range(FRAME_WINDOW, FRAME_WINDOW + 6))
    assert set(drops["reason"].tolist()) == {QUEUE_FULL}
    assert engine.counts().in_flight == FRAME_WINDOW + engine._inside()


def test_slow_start_doubles_the_window_each_round_trip():
    """Otherwise a connection would need minutes to reach its rate, or take all of it at once."""
    engine = greedy(
        Link("a", "b", 10**10, 50_000_000, DropTail(2000)), Greedy(1448, 500), seconds=1
    )
    taps = engine.tapped()
    starts = taps["sent_ns"][taps["port"] == 0]
    by_round = np.bincount(starts // 100_000_000).tolist()
    assert by_round[:7] == [10, 20, 40, 80, 160, 320, 500]


def test_a_greedy_connection_fills_the_bottleneck():
    """Otherwise bulk transfers would leave room that real ones do not.

    10 Mbit/s and a round trip of 20 ms hold 17 segments; the queue holds 60.
    """
    link = Link("a", "b", 10_000_000, 10_000_000, DropTail(60))
    engine = greedy(link, Greedy(1448, 1000), seconds=30)
    use = engine.links()[0]
    assert use.dropped_queue > 0
    assert use.busy_ns > 0.95 * 30 * SECOND
    assert delivered(engine) > 0.94 * 30 * 10_000_000 / (8 * 1500)


def test_two_greedy_connections_share_the_bottleneck():
    """Otherwise one transfer would starve another for ever."""
    early = RandomEarlyDetection(100, EarlyDetection(10, 50, 0.05, 6))
    link = Link("a", "b", 10_000_000, 10_000_000, early)
    engine = greedy(link, Greedy(1448, 1000), Greedy(1448, 1000), seconds=60)
    first, second = delivered(engine, 0), delivered(engine, 1)
    assert engine.links()[0].busy_ns > 0.95 * 60 * SECOND
    assert 0.4 < first / (first + second) < 0.6


def test_the_rate_under_losses_follows_the_square_root_law():
    """Otherwise transfers over lossy links would be far too fast or too slow.

    M. Mathis and others, The macroscopic behavior of the TCP congestion avoidance algorithm, ACM
    CCR 27 (1997): segments per round trip are sqrt(3/2) / sqrt(p), 12.2 at p = 0.01. The law leaves
    time-outs out, and is taken to hold within a factor of 1.4.
    """
    link = Link("a", "b", 10**9, 50_000_000, DropTail(2000), Bernoulli(0.01))
    engine = greedy(link, Greedy(1448, 1000), seconds=300)
    per_round_trip = delivered(engine) / (300 / 0.1)
    law = math.sqrt(1.5 / 0.01)
    assert law / 1.4 < per_round_trip < law * 1.4


def test_a_greedy_connection_ends_when_it_is_told_to():
    """Otherwise a transfer of a stated time would never end."""
    link = Link("a", "b", 1_000_000, 1_000_000, DropTail(20))
    engine = greedy(link, Greedy(960, 8), seconds=3, start_ns=SECOND, stop_ns=2 * SECOND)
    starts = engine.tapped()["sent_ns"]
    assert starts[0] == SECOND
    # At its end a window of eight segments of 8.096 ms is under way.
    assert 2 * SECOND < starts[-1] < 2 * SECOND + 8 * 8_100_000
    assert engine.counts().in_flight == 0


def test_a_long_cut_leaves_the_threshold_that_the_first_time_out_set():
    """Otherwise a connection would crawl after each repair (RFC 5681, section 3.1)."""
    link = Link("a", "b", 10**7, 10_000_000, DropTail(100))
    cross = [CrossFlow("g", Greedy(1448, 40), ("a", "b"))]
    changes = LinkCut(5 * SECOND, 0), LinkRepair(12 * SECOND, 0)
    engine = PacketEngine(replace(joined([link], [], [], cross), changes=changes), seed=1)
    engine.run_until(11 * SECOND)
    row = engine._memory.table("connections")[0]
    assert row[tcp.TIMED_OUT] > 2
    assert row[tcp.THRESHOLD] == 20 * tcp.UNIT
    before = delivered(engine)
    engine.run_until(30 * SECOND)
    assert delivered(engine) > before + 1000
