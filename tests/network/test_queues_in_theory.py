"""One port against queueing theory: waits, losses and shares, with intervals from the sample."""

from math import exp, factorial

import numpy as np
import pytest

from network.builders import joined
from network.tapped import (
    exponential_sizes,
    mean_and_error,
    one_link,
    poisson_times,
    recorded,
    waits_ns,
)
from tieline.network.losses import BitError, GilbertElliott
from tieline.network.packet import PacketEngine
from tieline.network.queues import DeficitRoundRobin, DropTail, StrictPriority, WaitingLine
from tieline.network.spec import CrossFlow, Link
from tieline.network.traffic import Cbr, OnOff

SERVICE_NS = 1_000_000
WIDE = 100_000
URGENT = 46


def assert_mean(values, expected, most_error):
    """Assert a mean within four standard errors, which must not exceed a share of it."""
    mean, error = mean_and_error(values)
    assert abs(mean - expected) < 4 * error
    assert error < most_error * expected


@pytest.mark.parametrize(("load", "most_error"), [(0.3, 0.01), (0.6, 0.015), (0.9, 0.06)])
def test_waits_of_m_d_1(load, most_error):
    """Otherwise delays behind equal packets would be systematically long or short.

    Pollaczek-Khinchine: rho D / (2 (1 - rho)).
    """
    times = poisson_times(21, SERVICE_NS / load, 200_000)
    (waits,) = waits_ns(one_link(4_000_000, DropTail(WIDE), recorded(times, 500)))
    assert_mean(waits, load * SERVICE_NS / (2 * (1 - load)), most_error)
    assert_mean((waits == 0).astype(int), 1 - load, 0.03)


@pytest.mark.parametrize(("load", "most_error"), [(0.3, 0.015), (0.6, 0.03), (0.9, 0.1)])
def test_waits_of_m_m_1(load, most_error):
    """Otherwise delays behind packets of all sizes would be wrong.

    Exponential sizes of 4,000 bytes in the mean, 1 ms: the wait is rho / (1 - rho) ms in the mean
    and longer than x with the probability rho exp(-(1 - rho) x / 1 ms). Rounding to bytes and the
    least size of 29 move the mean size by 0.003 %.
    """
    times = poisson_times(22, SERVICE_NS / load, 200_000)
    sizes = exponential_sizes(22, 4_000, len(times))
    (waits,) = waits_ns(one_link(32_000_000, DropTail(WIDE), recorded(times, sizes)))
    assert_mean(waits, load / (1 - load) * SERVICE_NS, most_error)
    longer = waits > 2 * SERVICE_NS
    assert_mean(longer.astype(int), load * exp(-(1 - load) * 2), most_error + 0.03)


def lost_of(spec, times):
    """Return the dropped share of packets of one flow, batch by batch of equal counts."""
    engine = PacketEngine(spec, seed=1)
    dropped = []
    for batch in times.reshape(40, -1):
        engine.run_until(int(batch[-1]))
        dropped.append(engine.links()[0].dropped_queue)
    return np.diff(dropped, prepend=0) / (len(times) / 40)


def loss_of_m_d_1_k(load: float, most: int) -> float:
    """Return the share that finds `most` packets in the system, the one being sent included.

    From the chain of the numbers left behind by departures; the share is 1 - 1 / (pi_0 + rho)
    (H. Takagi, Queueing Analysis, vol. 2, 1993, on M/G/1/K).
    """
    arrivals = [exp(-load) * load**k / factorial(k) for k in range(most + 1)]
    chain = np.zeros((most, most))
    for state in range(most):
        left = max(state - 1, 0)
        for k in range(most - left):
            chain[state, left + k] = arrivals[k]
        chain[state, -1] += 1 - chain[state].sum()
    stationary = np.linalg.lstsq(
        np.vstack([chain.T - np.eye(most), np.ones(most)]), np.eye(most + 1)[-1], rcond=None
    )[0]
    return 1 - 1 / (stationary[0] + load)


@pytest.mark.parametrize(("load", "queue"), [(0.8, 3), (1.2, 8)])
def test_losses_of_m_d_1_k(load, queue):
    """Otherwise a short queue would lose more or fewer packets than a real one."""
    times = poisson_times(23, SERVICE_NS / load, 200_000)
    spec = one_link(4_000_000, DropTail(queue), recorded(times, 500))
    shares = lost_of(spec, times)
    error = shares.std(ddof=1) / np.sqrt(len(shares))
    expected = loss_of_m_d_1_k(load, queue + 1)
    assert abs(shares.mean() - expected) < 4 * error
    assert error < 0.03 * expected


@pytest.mark.parametrize(("load", "queue"), [(0.8, 4), (1.2, 9)])
def test_losses_of_m_m_1_k(load, queue):
    """The same for packets of all sizes: (1 - rho) rho^K / (1 - rho^(K + 1)), K = queue + 1."""
    times = poisson_times(24, SERVICE_NS / load, 200_000)
    sizes = exponential_sizes(24, 4_000, len(times))
    shares = lost_of(one_link(32_000_000, DropTail(queue), recorded(times, sizes)), times)
    error = shares.std(ddof=1) / np.sqrt(len(shares))
    most = queue + 1
    expected = (1 - load) * load**most / (1 - load ** (most + 1))
    assert abs(shares.mean() - expected) < 4 * error
    assert error < 0.04 * expected


def test_one_packet_in_six_is_too_many_at_120_percent():
    """Otherwise constant traffic would overload a link more or less than it does.

    9,600 packets in 8 s on a link that carries 8,000; the queue of 20 holds the rest at the end.
    """
    flow = CrossFlow("cbr", Cbr(4_800_000, 472), ("a", "b"))
    engine = PacketEngine(joined([Link("a", "b", 4_000_000, 0, DropTail(20))], [], [], [flow]), 1)
    engine.run_until(8_000_000_000)
    link = engine.links()[0]
    assert abs(link.dropped_queue - (9_600 / 6 - 21)) <= 2
    assert (link.max_queue, link.busy_ns > 7_998_000_000) == (20, True)


def test_a_queue_of_bytes_holds_as_many_as_fit():
    """Otherwise a router's buffer in bytes would be one in packets.

    A packet of 1,000 bytes is in transmission; 2,500 bytes may wait: 1,000 and 1,000 fit, the
    third does not, 400 still do, then 100 more to the byte, then nothing.
    """
    sizes = np.array([1000, 1000, 1000, 1000, 400, 101, 100, 29])
    flow = recorded(np.arange(8), sizes)
    engine = PacketEngine(one_link(1_000_000, DropTail(1000, 2_500), flow), seed=1)
    engine.run_until(1_000)
    link = engine.links()[0]
    assert (link.dropped_queue, link.max_queue) == (3, 4)
    engine.run_until(10**12)
    assert engine.tapped()["bytes"].tolist() == [1000, 1000, 1000, 400, 100]


def test_link_layer_bytes_count_in_a_queue_of_bytes():
    """Otherwise a buffer would hold packets that do not fit with their headers."""
    flow = recorded(np.arange(4), 90)
    spec = one_link(1_000_000, DropTail(1000, 200), flow, overhead_bytes=11)
    engine = PacketEngine(spec, seed=1)
    engine.run_until(10**12)
    # Two of 101 bytes do not fit into 200.
    assert (engine.links()[0].packets, engine.links()[0].dropped_queue) == (2, 2)


def two_classes(order, packets=WIDE, quanta=(0, 0)):
    """Return a discipline of an urgent class and another."""
    lines = tuple(WaitingLine(packets, quantum_bytes=quantum) for quantum in quanta)
    return order(lines, (frozenset({URGENT}), frozenset()))


@pytest.mark.parametrize("loads", [(0.2, 0.3), (0.3, 0.5), (0.6, 0.2)])
def test_waits_with_priority_are_cobhams(loads):
    """Otherwise priority would help the urgent too much or too little.

    Non-preemptive M/G/1 (A. Cobham, Operations Research 2, 1954): with the mean residual service
    R = sum of lambda E[S^2] / 2, urgent packets wait R / (1 - rho_1), the others
    R / ((1 - rho_1) (1 - rho_1 - rho_2)). Urgent ones are 250 bytes, 0.5 ms; the others 500, 1 ms.
    """
    services = (SERVICE_NS / 2, SERVICE_NS)
    counts = [
        int(100_000 * load / service * SERVICE_NS)
        for load, service in zip(loads, services, strict=True)
    ]
    flows = [
        recorded(
            poisson_times(31 + i, services[i] / loads[i], counts[i] // 40 * 40), size, dscp, f"{i}"
        )
        for i, (size, dscp) in enumerate(((250, URGENT), (500, 0)))
    ]
    urgent, other = waits_ns(one_link(4_000_000, two_classes(StrictPriority), *flows))
    residual = sum(load * service / 2 for load, service in zip(loads, services, strict=True))
    assert_mean(urgent, residual / (1 - loads[0]), 0.03)
    assert_mean(other, residual / ((1 - loads[0]) * (1 - sum(loads))), 0.06)


def test_only_the_packet_in_transmission_delays_an_urgent_one():
    """Otherwise one large packet could be two in the way."""
    times = np.zeros(50, dtype=np.int64)
    flows = [recorded(times, 1500, 0, "0"), recorded(np.array([500_000]), 100, URGENT, "1")]
    _, (urgent,) = waits_ns(one_link(12_000_000, two_classes(StrictPriority), *flows))
    assert urgent == 500_000


def test_each_class_has_a_limit_of_its_own():
    """Otherwise ordinary traffic could push urgent packets out."""
    flows = [
        recorded(np.zeros(50, dtype=np.int64), 500, 0, "0"),
        recorded(np.full(5, 10), 500, URGENT, "1"),
    ]
    engine = PacketEngine(one_link(1_000_000, two_classes(StrictPriority, 4), *flows), seed=1)
    engine.run_until(10**12)
    records = engine.tapped()
    # One in transmission and four waiting of the first; four waiting of the urgent ones, first.
    assert records["flow"].tolist() == [0, 1, 1, 1, 1, 0, 0, 0, 0]
    assert engine.links()[0].dropped_queue == 45 + 1


@pytest.mark.parametrize("quanta", [(3000, 1000), (500, 1500), (1, 4), (1500, 1500)])
def test_shares_are_in_the_ratio_of_quanta(quanta):
    """Otherwise a class of large packets would take more of a link than it was granted.

    Both classes always have packets, of 200 and of 1,400 bytes. What each has sent over n rounds
    differs from n quanta by less than a packet (M. Shreedhar and G. Varghese, lemma 2).
    """
    sizes = (200, 1400)
    counts = (60_000, 20_000)
    flows = [
        recorded(np.zeros(count, dtype=np.int64), size, dscp, f"{i}")
        for i, (size, count, dscp) in enumerate(zip(sizes, counts, (URGENT, 0), strict=True))
    ]
    engine = PacketEngine(
        one_link(8_000_000, two_classes(DeficitRoundRobin, WIDE, quanta), *flows), seed=1
    )
    # 1 MB a second, for 6 s: neither class runs out.
    engine.run_until(6_000_000_000)
    records = engine.tapped()
    sent = [records["bytes"][records["flow"] == number].sum() for number in (0, 1)]
    assert sum(sent) == pytest.approx(6_000_000, abs=1400)
    rounds = 6_000_000 / sum(quanta)
    # A round, and a packet, may be under way at the end; the first packet needs no turn.
    for number in (0, 1):
        most = max(quanta) + 2 * 1400
        assert abs(sent[number] - rounds * quanta[number]) <= most


def test_a_class_that_is_alone_has_the_whole_link():
    """Otherwise round robin would keep a link idle for a class that sends nothing."""
    flow = recorded(np.zeros(1000, dtype=np.int64), 1000)
    spec = one_link(8_000_000, two_classes(DeficitRoundRobin, WIDE, (9000, 100)), flow)
    (waits,) = waits_ns(spec)
    assert waits.tolist() == [k * 1_000_000 for k in range(1000)]


def test_idle_classes_save_up_no_credit():
    """Otherwise a class could be silent for a minute and then block the link with a burst."""
    steady = recorded(np.zeros(100, dtype=np.int64), 1000, 0, "0")
    burst = recorded(np.full(20, 50_500_000), 1000, URGENT, "1")
    spec = one_link(8_000_000, two_classes(DeficitRoundRobin, WIDE, (1000, 1000)), steady, burst)
    engine = PacketEngine(spec, seed=1)
    engine.run_until(10**12)
    # From the burst on the two take turns until the burst is through.
    after = engine.tapped()["flow"][51:91]
    assert sorted(set(np.diff(after).tolist())) == [-1, 1]


@pytest.mark.parametrize("size", [60, 500, 1500])
def test_long_packets_meet_more_bit_errors(size):
    """Otherwise a noisy line would treat short and long packets alike.

    A packet of n bits is lost with 1 - (1 - 1e-5)^n, independently of the others.
    """
    count = 40_000
    flow = recorded(np.arange(count) * 20_000, size)
    engine = PacketEngine(one_link(10**9, DropTail(10), flow, loss=BitError(1e-5)), seed=6)
    engine.run_until(10**12)
    p = 1 - (1 - 1e-5) ** (8 * size)
    assert abs(engine.links()[0].dropped_loss - count * p) < 4 * np.sqrt(count * p * (1 - p))


def test_a_link_loses_in_bursts():
    """Otherwise a link would not lose what its model says.

    The count over n packets of a chain with the second eigenvalue r = 1 - to_bad - to_good has a
    variance of n p (1 - p) (1 + r) / (1 - r).
    """
    count, model = 60_000, GilbertElliott(0.02, 0.18)
    flow = recorded(np.arange(count) * 20_000, 500)
    engine = PacketEngine(one_link(10**9, DropTail(10), flow, loss=model), seed=6)
    engine.run_until(10**12)
    variance = count * 0.1 * 0.9 * (1.8 / 0.2)
    assert abs(engine.links()[0].dropped_loss - count * 0.1) < 4 * np.sqrt(variance)


def test_pareto_on_off_traffic_carries_its_mean_rate():
    """Otherwise bursty traffic would load a link more or less than it says.

    100 flows of shape 1.5 for 60 s, each 2 Mbit/s for 10 ms of 40: 50 Mbit/s.
    """
    flows = [
        CrossFlow(f"{i}", OnOff(2e6, 222, 10**7, 3 * 10**7, 1.5), ("a", "b")) for i in range(100)
    ]
    engine = PacketEngine(joined([Link("a", "b", 10**9, 0, DropTail(WIDE))], [], [], flows), 2)
    sent = []
    for second in range(5, 61):
        engine.run_until(second * 10**9)
        sent.append(engine.links()[0].packets)
    mean, error = mean_and_error(np.diff(sent), 11)
    # 250 bytes: 25,000 a second.
    assert abs(mean - 25_000) < 4 * error
    assert error < 500


def test_half_duplex_carries_its_rate_in_both_directions_together():
    """Otherwise a radio link would carry twice what it can, or one end would starve the other.

    Both ends always have packets of 500 bytes; the turn changes after each.
    """
    there = recorded(np.zeros(3000, dtype=np.int64), 500, name="0")
    back = CrossFlow("1", there.traffic, ("b", "a"))
    queue = DropTail(WIDE)
    engine = PacketEngine(one_link(4_000_000, queue, there, back, is_half_duplex=True), seed=1)
    engine.run_until(2_000_000_000)
    uses = engine.links()
    assert [use.packets for use in uses] == [1000, 1000] or sum(u.packets for u in uses) == 2001
    assert abs(uses[0].busy_ns - 10**9) <= SERVICE_NS
    assert sum(use.busy_ns for use in uses) == 2 * 10**9
    ports = engine.tapped()["port"]
    assert set(np.abs(np.diff(ports)).tolist()) == {1}


def test_half_duplex_waits_are_those_of_one_queue():
    """Otherwise two quiet ends would not hear each other, and send at once.

    Poisson traffic from both ends: the order of service changes no mean wait where all packets are
    alike, so it is that of M/D/1 at the whole load.
    """
    flows = [
        recorded(poisson_times(41 + i, SERVICE_NS / 0.3, 60_000), 500, name=f"{i}") for i in (0, 1)
    ]
    flows[1] = CrossFlow("1", flows[1].traffic, ("b", "a"))
    spec = one_link(4_000_000, DropTail(WIDE), *flows, is_half_duplex=True)
    waits = waits_ns(spec)
    for own in waits:
        assert_mean(own, 0.6 * SERVICE_NS / (2 * 0.4), 0.02)
