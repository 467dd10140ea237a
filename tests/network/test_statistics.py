"""Delay statistics whose memory does not grow, against the same figures from every delay."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tieline.network.ended import NONE_ENDED, Ended, ended
from tieline.network.engine import ARRIVAL, DROP, LOSS, QUEUE_FULL
from tieline.network.histogram import BINS, Histograms, _rank, bin_of, count, middle_ns
from tieline.network.stats import DELAY_BIN_NS, FlowStatistics
from tieline.streams import stream

LEAST_NS = 95_000_000
RATE_HZ = 60


def arrivals_of(delays_ns: np.ndarray) -> np.ndarray:
    """Return arrivals of one flow of these delays, measured at zero."""
    records = np.zeros(len(delays_ns), ARRIVAL)
    records["arrival_ns"] = delays_ns
    records["sequence"] = np.arange(len(delays_ns))
    return records


def at_zero(records: np.ndarray, flow_of: tuple = ((0,),)) -> Ended:
    """Return arrivals or drops as if all frames had been measured at zero."""
    found = ended(records, np.array(flow_of), RATE_HZ)
    return found._replace(measured_ns=0 * found.measured_ns, delays_ns=found.ended_ns)


def statistics_of(delays_ns: np.ndarray, least_ns: int = LEAST_NS) -> FlowStatistics:
    """Return the statistics of one flow of these delays, added a few at a time."""
    statistics = FlowStatistics(np.array([least_ns]), np.array([[0]]))
    for part in np.array_split(arrivals_of(delays_ns), 7):
        statistics.add(at_zero(part), NONE_ENDED, np.empty(0, np.uint8))
    return statistics


# The first example compiles, so no deadline holds.
@settings(deadline=None)
@given(st.integers(0, 2**42))
def test_a_bin_holds_what_lies_in_it(excess_ns):
    """Otherwise percentiles would be off by more than they state."""
    number = bin_of(excess_ns)
    assert 0 <= number < BINS
    assert abs(middle_ns(number) - excess_ns) <= max(512, excess_ns / 128)


def test_bins_follow_one_another_without_gap():
    """Otherwise two delays would share a bin that no delay between them falls into."""
    edges = [0, 1023, 1024, 128 * 1024 - 1, 128 * 1024, 130 * 1024 - 1, 130 * 1024]
    assert [bin_of(edge) for edge in edges] == [0, 0, 1, 127, 128, 128, 129]
    assert (bin_of(-5), bin_of(2**62)) == (0, BINS - 1)


def test_figures_of_a_flow_equal_those_of_all_its_delays():
    """Otherwise the tables would not describe the packets."""
    excess_ns = np.rint(stream(1, "delays").gamma(2.0, 2e6, 50_000)).astype(np.int64)
    delays_ns = LEAST_NS + excess_ns
    statistics = statistics_of(delays_ns)
    assert statistics.delivered.tolist() == [50_000]
    assert statistics.mean_ns()[0] == pytest.approx(delays_ns.mean(), rel=1e-12)
    assert statistics.min_ns()[0] == delays_ns.min()
    assert statistics.max_ns()[0] == delays_ns.max()
    assert statistics.jitter_ns()[0] == pytest.approx(np.abs(np.diff(delays_ns)).mean(), rel=1e-12)
    for share in (0.01, 0.5, 0.95, 0.999, 1.0):
        rank = int(np.ceil(share * len(delays_ns))) - 1
        exact_ns = np.sort(delays_ns)[rank]
        tolerance_ns = max(512, (exact_ns - LEAST_NS) / 128)
        assert abs(statistics.percentiles_ns(share)[0] - exact_ns) <= tolerance_ns


def test_a_constant_delay_has_exact_percentiles():
    """Otherwise the constant engine would be reported with a delay that nobody set."""
    statistics = statistics_of(np.full(100, LEAST_NS))
    assert statistics.percentiles_ns(0.5)[0] == statistics.percentiles_ns(0.95)[0] == LEAST_NS
    assert statistics.jitter_ns()[0] == statistics.smoothed_jitter_ns()[0] == 0


def test_the_jitter_of_rfc_3550_follows_its_recursion():
    """Otherwise it could not be compared with what an RTP receiver reports."""
    delays_ns = LEAST_NS + np.array([0, 1_600, 0, 800_000])
    expected_ns = 0.0
    for step_ns in np.abs(np.diff(delays_ns)):
        expected_ns += (step_ns - expected_ns) / 16
    assert statistics_of(delays_ns).smoothed_jitter_ns()[0] == expected_ns


def test_the_histogram_of_all_flows_counts_every_delay():
    """Otherwise the picture of the delays would lack some of them."""
    delays_ns = np.array([0, 99_999, 100_000, 250_000_000, 20_000_000_000, 10**12])
    counts = statistics_of(delays_ns, least_ns=0).delay_counts
    bins = [min(delay // DELAY_BIN_NS, len(counts) - 1) for delay in delays_ns]
    assert np.array_equal(np.flatnonzero(counts), sorted(set(bins)))
    assert counts.sum() == len(delays_ns)


def test_nothing_delivered_has_no_delay():
    """Otherwise a dead flow would be reported with a delay of zero."""
    statistics = FlowStatistics(np.array([LEAST_NS]), np.array([[0]]))
    for figure in ("mean_ns", "min_ns", "max_ns", "jitter_ns"):
        assert np.isnan(getattr(statistics, figure)()[0])
    assert np.isnan(statistics.percentiles_ns(0.5)[0])


def test_packets_are_counted_where_they_end():
    """Otherwise losses would be blamed on queues, or on other flows."""
    statistics = FlowStatistics(np.array([0] * 4), np.arange(4).reshape(2, 2))
    statistics.add_sent(np.array([0, 1]), 0)
    statistics.add_sent(np.array([1]), 1)
    drops = np.zeros(3, DROP)
    drops["source"] = [0, 1, 1]
    drops["destination"] = [1, 0, 0]
    drops["reason"] = [QUEUE_FULL, LOSS, LOSS]
    drops["sequence"] = [0, 0, 1]
    flow_of = ((0, 1), (2, 3))
    arrived = at_zero(arrivals_of(np.array([5])), flow_of)
    statistics.add(arrived, at_zero(drops, flow_of), drops["reason"])
    assert statistics.sent.tolist() == [1, 1, 2, 2]
    assert statistics.dropped_queue.tolist() == [0, 1, 0, 0]
    assert statistics.dropped_loss.tolist() == [0, 0, 2, 0]
    assert statistics.delivered.tolist() == [1, 0, 0, 0]
    assert statistics.in_flight.tolist() == [0, 0, 0, 2]


def counted(histograms: Histograms, flow: int, excess_ns: int) -> None:
    """Count an excess, with more room if there is none for it."""
    own = histograms
    while not count(flow, excess_ns, own.block_of, own.counts, own.carries, own.used):
        own.grow()


def test_the_nearest_rank_of_few_counts():
    """Otherwise the percentile of a short run would lie between packets, or outside them."""
    few = Histograms(2)
    for excess_ns in (3 << 10, 10 << 10, 10 << 10, 1 << 30):
        counted(few, 1, excess_ns)
    for share, excess_ns in ((0.25, 3 << 10), (0.26, 10 << 10), (0.75, 10 << 10), (1.0, 1 << 30)):
        assert few.percentiles_ns(share)[1] == middle_ns(bin_of(excess_ns))


def test_the_nearest_rank_of_more_than_a_bin_can_count():
    """Otherwise the percentiles of runs beyond 18 minutes would be those of their last packets."""
    many = Histograms(2)
    for excess_ns, packets in ((3 << 10, 70_000), (10 << 10, 69_999), (1 << 30, 1)):
        for _ in range(packets):
            counted(many, 1, excess_ns)
        counted(many, 0, excess_ns)
    for share, excess_ns in ((0.5, 3 << 10), (0.50001, 10 << 10), (1.0, 1 << 30)):
        assert many.percentiles_ns(share)[1] == middle_ns(bin_of(excess_ns))
    assert many.percentiles_ns(0.5)[0] == middle_ns(bin_of(10 << 10))


@pytest.mark.parametrize("is_compiled", [True, False])
def test_percentiles_are_the_same_with_and_without_the_compiler(is_compiled: bool) -> None:
    """A run without the compiler is what tells an error of the compiler from one of ours."""
    histograms = Histograms(1)
    for excess_us in (5, 5, 5, 900, 900, 70_000):
        counted(histograms, 0, 1_000 * excess_us)
    rank = _rank if is_compiled else getattr(_rank, "py_func", _rank)
    bins = np.zeros(1, np.int64)
    rank(0.5, histograms.block_of, histograms.counts, histograms.carries, bins)
    assert middle_ns(bins) == pytest.approx(5_000, abs=1_024)
