"""Random early detection against the paper: written again in plain words, and its theory."""

from collections import deque

import numpy as np
import pytest

from network.tapped import one_link, poisson_times, recorded
from tieline.network.packet import PacketEngine
from tieline.network.packet.draws import uniforms
from tieline.network.packet.red import CERTAIN
from tieline.network.queues import EarlyDetection, RandomEarlyDetection

SEED = 5
BYTE_NS = 1000
"""8 Mbit/s."""


def red(packets, low, high, probability=0.1, weight_shift=4):
    return RandomEarlyDetection(packets, EarlyDetection(low, high, probability, weight_shift))


def draws():
    """Yield the engine's own numbers, as shares of 1."""
    for chunk in uniforms(SEED, "early drops of a->b"):
        yield from chunk / CERTAIN


def accepted_by_the_paper(queue, times_ns, sizes):
    """Return the places of the packets that get through, by the algorithm of the paper's figure 2.

    The queue is of the packets that wait, the one in transmission not among them.
    """
    rule = queue.early_detection
    weight, numbers = 2.0**-rule.weight_shift, draws()
    average, count, free_ns = 0.0, -1, 0
    starts: deque[int] = deque()
    accepted = []
    for place, (now, size) in enumerate(zip(times_ns.tolist(), sizes.tolist(), strict=True)):
        while starts and starts[0] <= now:
            starts.popleft()
        if now > free_ns:
            average *= (1 - weight) ** ((now - free_ns) // (size * BYTE_NS))
        else:
            average += weight * (len(starts) - average)
        is_dropped = False
        if average >= rule.high:
            count, is_dropped = 0, True
        elif average >= rule.low:
            count += 1
            share = rule.probability * (average - rule.low) / (rule.high - rule.low)
            is_dropped = next(numbers) * max(0.0, 1 - count * share) < share
            count = 0 if is_dropped else count
        else:
            count = -1
        is_full = free_ns > now and len(starts) >= queue.packets
        if is_dropped or is_full:
            continue
        start_ns = max(now, free_ns)
        if start_ns > now:
            starts.append(start_ns)
        free_ns = start_ns + size * BYTE_NS
        accepted.append(place)
    return accepted


def accepted_by_the_engine(queue, times_ns, sizes, seed=SEED):
    """Return the places of the packets that get through; each has a size of its own."""
    engine = PacketEngine(one_link(8_000_000, queue, recorded(times_ns, sizes)), seed)
    engine.run_until(10**15)
    return np.searchsorted(sizes, engine.tapped()["bytes"]).tolist()


@pytest.mark.parametrize(
    ("queue", "load"),
    [
        (red(50, 5, 15), 0.95),
        (red(50, 5, 15), 1.5),
        (red(30, 2, 30, 0.02, 9), 1.2),
        (red(12, 3.5, 9.25, 1.0, 2), 1.1),
        # A queue that is often full before its average is high: those drops count as arrivals.
        (red(8, 3, 8, 0.05, 6), 10.0),
        # Averages of more than 8,192 packets.
        (red(20_000, 9_000, 19_000, 0.1, 1), 1000.0),
    ],
    ids=repr,
)
def test_the_engine_drops_what_the_paper_drops(queue, load):
    """Otherwise early detection would be something else by its name.

    20,000 packets in the manner of Poisson, with pauses, of 29 to 20,028 bytes.
    """
    sizes = 29 + np.arange(20_000)
    gaps = np.diff(poisson_times(51, BYTE_NS / load, len(sizes)), prepend=0) * sizes
    gaps[5000::5000] += 400_000_000
    times_ns = np.cumsum(gaps)
    expected = accepted_by_the_paper(queue, times_ns, sizes)
    assert accepted_by_the_engine(queue, times_ns, sizes) == expected
    # The case must tell something: some packets are dropped and some are not.
    assert 100 < len(expected) < 19_990


def burst(queue, count, marks):
    """Return how many of a burst are dropped up to some places; nothing leaves meanwhile."""
    engine = PacketEngine(one_link(1000, queue, recorded(np.arange(count), 100)), SEED)
    dropped = []
    for place in marks:
        engine.run_until(place - 1)
        dropped.append(engine.links()[0].dropped_queue)
    return dropped


def test_nothing_is_dropped_below_low_and_everything_from_high_on():
    """Otherwise the two thresholds of a file would mean something else.

    The average, of weight 1/2, is at most one packet behind the queue.
    """
    below, between, at_high, later = burst(red(1000, 50, 100, 0.5, 1), 400, (51, 110, 250, 400))
    assert below == 0
    assert between > 0
    assert later - at_high == 150


def test_the_dropped_share_grows_in_proportion_to_the_average():
    """Otherwise early detection would be too harsh or too mild.

    In a burst nothing leaves, so the average grows from low to high. With P = share / (1 - count
    share) the packets from drop to drop are uniform from 1 to 1 / share - 1 (the paper's section
    VII, method 2): the dropped share is 2 share, and the count over n packets has the variance
    2/3 n share.
    """
    marks = np.arange(0, 100_001, 10_000)
    dropped = np.diff([0, *burst(red(100_000, 1, 100_000, 0.02, 1), 100_000, marks[1:])])
    arrived = marks[1:]
    waiting = arrived - np.cumsum(dropped)
    middle = (waiting + np.concatenate([[0], waiting[:-1]])) / 2
    share = 0.02 * middle / 100_000
    assert np.all(np.diff(dropped) > 0)
    assert np.all(np.abs(dropped - 10_000 * 2 * share) < 4 * np.sqrt(10_000 * share * 2 / 3))


def test_early_drops_are_the_same_in_every_run_and_others_with_another_seed():
    """Otherwise an experiment could not be repeated, or its repetitions would all be one."""
    sizes = 29 + np.arange(5000)
    times_ns = np.cumsum(sizes * BYTE_NS // 2)
    first, again, other = (
        accepted_by_the_engine(red(50, 5, 25), times_ns, sizes, seed) for seed in (1, 1, 2)
    )
    assert first == again
    assert first != other


def test_an_average_of_thousands_decays_in_an_idle_time():
    """Otherwise the average of a long queue would overflow, and the next packets pass it by.

    A burst lifts the average above 10,000 packets; 20 ms after the last of it has left, about 1.6
    times the service of a packet of 12,029 bytes, the next come while the average is still high.
    """
    queue, first = red(20_000, 8_500, 20_000, 1.0, 9), 12_000
    sizes = 29 + np.arange(first + 1_000)
    times_ns = np.arange(first + 1_000)
    through = accepted_by_the_paper(queue, times_ns[:first], sizes[:first])
    idle_from_ns = int(sizes[through].sum()) * BYTE_NS
    times_ns[first:] = idle_from_ns + 20_000_000 + 13_000_000 * np.arange(1_000)
    expected = accepted_by_the_paper(queue, times_ns, sizes)
    assert accepted_by_the_engine(queue, times_ns, sizes) == expected
    assert sum(place >= first for place in expected) < 1_000
