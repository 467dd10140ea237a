"""Delay variation, loss periods and reordering, against their definitions applied to whole runs."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tieline.errors import CosimError
from tieline.network.sequence import LOST, SequenceFigures, SequenceStatistics


def figures_of(
    arrivals: list[tuple[int, int]], lost: list[int], sent: int, pieces: int = 1
) -> SequenceFigures:
    """Return the figures of one flow, handed over in pieces.

    Args:
        arrivals: (number, delay in ns) in the order of arrival.
        lost: numbers.
        sent: how many packets were sent, numbered from 0.
        pieces: calls, each with some of both.
    """
    statistics = SequenceStatistics(1)
    for number in range(sent):
        statistics.add_sent(np.array([0]), number)
    for part in range(pieces):
        chosen = _piece(arrivals, lost, part, pieces)
        numbers = np.array([number for number, _ in chosen], dtype=np.int64)
        values = np.array([end for _, end in chosen], dtype=np.int64)
        statistics.add(np.zeros(len(chosen), np.int64), numbers, values)
    return statistics.figures()


def _piece(
    arrivals: list[tuple[int, int]], lost: list[int], part: int, pieces: int
) -> list[tuple[int, int]]:
    first, end = (len(arrivals) * edge // pieces for edge in (part, part + 1))
    dropped = lost[len(lost) * part // pieces : len(lost) * (part + 1) // pieces]
    return [*arrivals[first:end], *((number, LOST) for number in dropped)]


def test_delay_variation_is_taken_over_consecutive_numbers():
    """Otherwise a lost or overtaken packet would change what RFC 3393 calls the variation.

    Sent 0 to 5; 2 is lost and 5 overtakes 4. The pairs are (0, 1), (3, 4) and (4, 5), with
    differences 30, 50 and 90; consecutive arrivals would have given 30, 60, 40 and 90.
    """
    figures = figures_of([(0, 100), (1, 130), (3, 70), (5, 30), (4, 120)], [2], 6)
    assert figures.variation_ns[0] == pytest.approx((30 + 50 + 90) / 3)


def test_delay_variation_needs_two_packets_in_a_row():
    """Otherwise a flow that lost every other packet would have a variation that nobody defined."""
    assert np.isnan(figures_of([(0, 100), (2, 900)], [1], 3).variation_ns[0])


def test_loss_periods_are_runs_of_lost_numbers():
    """Otherwise bursts of loss, which stop a controller, would look like scattered loss.

    Lost are 1, 2, 3, then 6, then 8 and 9: RFC 3357 has three periods of 3, 1 and 2 packets, and
    distances of 1, 1, 3, 2 and 1.
    """
    arrivals = [(number, 10) for number in (0, 4, 5, 7, 10)]
    figures = figures_of(arrivals, [1, 2, 3, 6, 8, 9], 11)
    assert figures.loss_periods.tolist() == [3]
    assert figures.loss_period_mean[0] == 2
    assert figures.loss_period_max.tolist() == [3]
    assert figures.loss_distance_mean[0] == (1 + 1 + 3 + 2 + 1) / 5


def test_a_packet_under_way_ends_a_loss_period():
    """Otherwise a loss would be claimed before it happened."""
    figures = figures_of([(0, 10)], [1, 3, 4], 5)
    assert (figures.loss_periods.tolist(), figures.loss_period_max.tolist()) == ([2], [2])


def test_no_loss_has_no_period_and_no_distance():
    """Otherwise an undisturbed flow would show a burst of loss."""
    figures = figures_of([(0, 10), (1, 10)], [], 2)
    assert figures.loss_periods.tolist() == figures.loss_period_max.tolist() == [0]
    assert np.isnan(figures.loss_period_mean[0])
    assert np.isnan(figures.loss_distance_mean[0])


def test_reordering_and_its_extent():
    """Otherwise reordering could not be compared with what RFC 4737 lets others measure.

    Arrivals 0, 3, 1, 4, 2: 1 arrives one place after the packet 3 that overtook it first, and 2
    three places after it.
    """
    figures = figures_of([(number, 10) for number in (0, 3, 1, 4, 2)], [], 5)
    assert figures.reordered.tolist() == [2]
    assert figures.reordered_share[0] == 2 / 5
    assert figures.extent_mean[0] == (1 + 3) / 2
    assert figures.extent_max.tolist() == [3]


def test_packets_in_order_are_not_reordered():
    """Otherwise loss would be taken for reordering."""
    figures = figures_of([(0, 10), (2, 10), (3, 10)], [1], 4)
    assert (figures.reordered.tolist(), figures.extent_max.tolist()) == ([0], [0])
    assert np.isnan(figures.extent_mean[0])


def by_definition(arrivals: list[tuple[int, int]], lost: list[int], sent: int) -> dict[str, float]:
    """Return the figures from the whole list of arrivals, as the RFCs write them."""
    delay = dict(arrivals)
    steps = [abs(delay[n] - delay[n - 1]) for n in range(1, sent) if {n, n - 1} <= delay.keys()]
    is_lost = [number in set(lost) for number in range(sent)]
    lengths = [len(run) for run in "".join("x" if x else " " for x in is_lost).split()]
    numbers = [number for number, _ in arrivals]
    extents = []
    for i, number in enumerate(numbers):
        passing = [j for j in range(i) if numbers[j] > number]
        extents += [i - passing[0]] if passing else []
    return {
        "variation_ns": np.mean(steps) if steps else np.nan,
        "loss_periods": len(lengths),
        "loss_period_mean": np.mean(lengths) if lengths else np.nan,
        "loss_period_max": max(lengths, default=0),
        "loss_distance_mean": np.mean(np.diff(sorted(lost))) if len(lost) > 1 else np.nan,
        "reordered": len(extents),
        "extent_mean": np.mean(extents) if extents else np.nan,
        "extent_max": max(extents, default=0),
    }


@st.composite
def histories(draw: st.DrawFn) -> tuple[list[tuple[int, int]], list[int], int]:
    """Draw arrivals in any order, losses and packets that stay under way."""
    sent = draw(st.integers(0, 60))
    fates = [draw(st.sampled_from("dddlu")) for _ in range(sent)]
    delivered = [number for number in range(sent) if fates[number] == "d"]
    order = draw(st.permutations(delivered))
    arrivals = [(number, draw(st.integers(0, 10**9))) for number in order]
    return arrivals, [number for number in range(sent) if fates[number] == "l"], sent


# The first example compiles, so no deadline holds.
@settings(deadline=None, max_examples=150)
@given(histories(), st.integers(1, 5))
def test_figures_follow_the_definitions_however_they_are_handed_over(history, pieces):
    """Otherwise memory that does not grow would have been bought with wrong figures."""
    figures = figures_of(*history, pieces=pieces)
    for name, expected in by_definition(*history).items():
        assert getattr(figures, name)[0] == pytest.approx(expected, nan_ok=True), name


def test_memory_is_bounded_by_what_is_under_way():
    """Otherwise a day's run would end for want of memory.

    Every third packet takes 40 packets longer than the others, for 20,000 packets.
    """
    statistics = SequenceStatistics(2)
    sizes = set()
    for number in range(20_000):
        statistics.add_sent(np.array([0, 1]), number)
        now = [n for n in (number - 40,) if n >= 0 and n % 3 == 0]
        now += [number] if number % 3 else []
        flows = np.repeat([0, 1], len(now))
        delays = np.full(len(flows), 5)
        statistics.add(flows, np.array(now * 2, dtype=np.int64), delays)
        sizes.add(statistics._ends.size)
    assert max(sizes) == 2 * 64
    assert statistics.figures().reordered.tolist() == [(20_000 - 40 + 2) // 3] * 2


def test_numbers_that_were_not_sent_are_no_losses():
    """Otherwise a PMU that was off for a while would look like a network that lost its frames."""
    statistics = SequenceStatistics(1)
    for number in (0, 1, 500, 501):
        statistics.add_sent(np.array([0]), number)
        delay = np.array([100 + number])
        statistics.add(np.array([0]), np.array([number]), delay)
    figures = statistics.figures()
    assert figures.variation_ns[0] == 1
    assert figures.loss_periods.tolist() == figures.reordered.tolist() == [0]
    assert statistics._ends.shape == (1, 2)


@pytest.mark.parametrize("again", [0, 2])
def test_a_packet_that_ends_twice_is_an_error(again):
    """Otherwise an engine that duplicates packets would pass for one that is fast."""
    statistics = SequenceStatistics(1)
    for number in range(3):
        statistics.add_sent(np.array([0]), number)
    statistics.add(np.array([0, 0]), np.array([0, 2]), np.array([5, 5]))
    with pytest.raises(CosimError, match=f"packet {again} of flow 0 ended twice"):
        statistics.add(np.array([0]), np.array([again]), np.array([LOST]))
