"""Random traffic and losses against theory, with intervals from the sample size."""

import numpy as np
import pytest

from network.builders import ALL, chain, joined, overhead_for
from tieline.network.losses import Bernoulli
from tieline.network.packet import PacketEngine
from tieline.network.packet.draws import gaps
from tieline.network.queues import DropTail
from tieline.network.spec import CrossFlow, Link
from tieline.network.traffic import Cbr, Poisson, Trace
from tieline.streams import stream

ONE = np.array([0])


def test_waiting_time_of_an_m_d_1_queue():
    """Otherwise delays behind cross traffic would be systematically long or short.

    Poisson arrivals of 500-byte packets at a load of 0.6 on 4 Mbit/s: the mean wait is
    rho D / (2 (1 - rho)) = 750 us (Pollaczek-Khinchine), and a share 1 - rho does not wait.
    """
    count, service_ns, rho = 60_000, 1_000_000, 0.6
    spec = chain([(4_000_000, 1_000_000)], queue=100_000, overhead_bytes=overhead_for(500))
    engine = PacketEngine(spec, seed=1)
    gaps_ns = stream(45, "arrivals").standard_exponential(count) * service_ns / rho
    sent_ns = np.cumsum(np.rint(gaps_ns).astype(np.int64))
    for k, measured_ns in enumerate(sent_ns.tolist()):
        engine.send(measured_ns, ONE, k)
    waits_ns = engine.run_until(ALL).arrivals["arrival_ns"] - sent_ns - 2_000_000
    # Waits of neighbours are correlated; means of 60 batches of 1,000 are nearly independent.
    batches = waits_ns.reshape(60, -1).mean(axis=1)
    error = batches.std(ddof=1) / np.sqrt(len(batches))
    assert abs(waits_ns.mean() - rho * service_ns / (2 * (1 - rho))) < 3.5 * error
    assert error < 20_000
    assert np.mean(waits_ns == 0) == pytest.approx(1 - rho, abs=0.01)


def test_losses_are_bernoulli_with_the_given_probability():
    """Otherwise a 5 % loss would be another, or would come in bursts.

    The count of n trials has the standard deviation sqrt(n p (1 - p)); neighbours are lost
    together with probability p^2.
    """
    count, p = 200_000, 0.05
    gaps_between = Bernoulli(p).gaps(stream(1, "loss of a->b"))
    places = np.cumsum(np.concatenate([next(gaps_between) for _ in range(4)])) - 1
    assert places[-1] > count
    lost = np.zeros(count, dtype=int)
    lost[places[places < count]] = 1
    assert abs(lost.sum() - count * p) < 4 * np.sqrt(count * p * (1 - p))
    pairs = np.sum(lost[1:] & lost[:-1])
    assert abs(pairs - count * p**2) < 4 * np.sqrt(count * p**2)


def test_a_link_loses_the_stated_share():
    """Otherwise the loss that an experiment sets would not be the loss that it gets."""
    count, p = 20_000, 0.05
    engine = PacketEngine(chain([(10**9, 0)], queue=100_000, loss=Bernoulli(p)), seed=2)
    for k in range(count):
        engine.send(k * 1_000, ONE, k)
    drops = engine.run_until(ALL).drops
    assert abs(len(drops) - count * p) < 4 * np.sqrt(count * p * (1 - p))


def test_poisson_gaps_are_exponential():
    """Otherwise the queues that cross traffic forms would be those of another traffic."""
    flow = CrossFlow("cross flow 0", Poisson(1e6, 97), ("a", "b"))
    chunks = gaps(1, flow)
    drawn = np.concatenate([next(chunks) for _ in range(10)])
    n = len(drawn)
    uniform = np.sort(1 - np.exp(-drawn / flow.traffic.gap_ns))
    distance = np.abs(uniform - (np.arange(n) + 0.5) / n).max()
    # Kolmogorov-Smirnov: sqrt(n) D exceeds 1.95 with probability 0.001.
    assert distance * np.sqrt(n) < 1.95
    # 125 bytes at 1 Mbit/s.
    assert flow.traffic.gap_ns == 1_000_000


def test_cbr_keeps_its_rate_to_the_packet():
    """Otherwise rounding would add up to another rate in a long run."""
    flow = CrossFlow("cross flow 0", Cbr(3e6, 972), ("a", "b"))
    chunks = gaps(1, flow)
    instants = np.cumsum(np.concatenate([next(chunks) for _ in range(5)]))
    phase_ns = instants[0]
    assert 0 <= phase_ns <= flow.traffic.gap_ns
    expected = phase_ns + np.arange(len(instants)) * (8e12 / 3e6)
    # Each instant, and the phase, is rounded to the nearest nanosecond.
    assert np.abs(instants - expected).max() <= 1


@pytest.mark.parametrize("kind", [Cbr, Poisson])
def test_cross_flows_carry_their_mean_rate(kind):
    """Otherwise a topology's cross traffic would be more or less than it says."""
    flow = CrossFlow("cross flow 0", kind(2e6, 222), ("a", "b"))
    engine = PacketEngine(joined([Link("a", "b", 10**8, 0, DropTail(100))], [], [], [flow]), seed=4)
    engine.run_until(30_000_000_000)
    # 250 bytes at 2 Mbit/s: 1,000 packets a second; Poisson counts deviate by sqrt(n).
    assert abs(engine.links()[0].packets - 30_000) < (2 if kind is Cbr else 4 * np.sqrt(30_000))


def test_a_trace_is_followed_and_then_silent():
    """Otherwise a recorded traffic could not be replayed."""
    trace = Trace(np.array([5, 1_000, 7_000_000, 7_000_000]), np.array([97, 97, 50, 1_000]))
    spec = joined(
        [Link("a", "b", 10**9, 0, DropTail(100))],
        [],
        [],
        [CrossFlow("cross flow 0", trace, ("a", "b"))],
    )
    engine = PacketEngine(spec, seed=1)
    engine.run_until(6_999_999)
    assert engine.links()[0].packets == 2
    engine.run_until(10**18)
    # Each with 28 bytes of UDP and IPv4 headers.
    assert (engine.links()[0].packets, engine.links()[0].bytes) == (
        4,
        97 + 97 + 50 + 1_000 + 4 * 28,
    )
