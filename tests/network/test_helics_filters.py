"""HELICS's own filters as a network engine: equal to a constant delay, and lossy as told."""

import numpy as np
import pytest
from scipy import stats

from tieline.errors import CosimError
from tieline.network.engine import LOSS
from tieline.network.helics_filters import HelicsFilters
from tieline.network.ideal import ConstantDelay
from tieline.network.spec import direct_spec

SOURCES = [{"name": f"pmu{i:02d}", "bus": i} for i in range(4)]
DESTINATIONS = [{"name": f"ctl{j:02d}", "unit": f"G{j}", "bus": 9 + j} for j in range(5)]
SPEC = direct_spec(SOURCES, DESTINATIONS, 0)

pytestmark = pytest.mark.helics


@pytest.mark.parametrize("delay_ns", [1, 16_666_667, 123_456_789, 250_000_000, 1_250_000_001])
def test_a_delay_filter_is_a_constant_delay_to_the_nanosecond(delay_ns):
    """Otherwise the baseline that users know would not be the delay that it is compared at.

    Some packets arrive exactly at the instants up to which the engine is asked to run.
    """
    filters, constant = HelicsFilters(SPEC, delay_ns, 0.0), ConstantDelay(5, delay_ns)
    for k in range(100):
        measured_ns, until_ns = k * 10**9 // 60, (k + 1) * 10**9 // 60
        outcomes = []
        for engine in (filters, constant):
            engine.send(measured_ns, np.arange(4), k)
            outcomes.append(engine.run_until(until_ns).arrivals.tobytes())
        assert outcomes[0] == outcomes[1]
        assert filters.counts() == constant.counts()
    whole = [engine.run_until(10**10).arrivals.tobytes() for engine in (filters, constant)]
    assert whole[0] == whole[1]
    filters.close()


def test_random_drop_loses_its_share_and_every_packet_is_accounted_for():
    """Otherwise a lost message, of which HELICS tells nobody, would stay under way for ever."""
    engine = HelicsFilters(SPEC, 40_000_000, 0.2)
    arrivals = drops = 0
    for k in range(120):
        engine.send(k * 10**9 // 60, np.arange(4), k)
        outcome = engine.run_until((k + 1) * 10**9 // 60)
        arrivals, drops = arrivals + len(outcome.arrivals), drops + len(outcome.drops)
        late_ns = outcome.drops["dropped_ns"] - outcome.drops["sequence"] * np.int64(10**9) // 60
        assert set(late_ns.tolist()) <= {40_000_000}
        assert set(outcome.drops["reason"].tolist()) <= {LOSS}
    outcome = engine.run_until(10**10)
    engine.close()
    arrivals, drops = arrivals + len(outcome.arrivals), drops + len(outcome.drops)
    counts = engine.counts()
    assert (counts.sent, counts.in_flight) == (2_400, 0)
    assert (counts.delivered, counts.dropped_loss) == (arrivals, drops)
    # HELICS's generator is not ours to seed: one run in 1e9 fails.
    assert stats.binomtest(drops, 2_400, 0.2).pvalue > 1e-9


def test_two_engines_at_once_do_not_meet():
    """Otherwise two runs in one process would exchange their packets."""
    engines = [HelicsFilters(SPEC, delay_ns, 0.0) for delay_ns in (5_000_000, 7_000_000)]
    for engine in engines:
        engine.send(0, np.arange(4), 0)
    times = [set(e.run_until(10**9).arrivals["arrival_ns"].tolist()) for e in engines]
    assert times == [{5_000_000}, {7_000_000}]
    for engine in engines:
        engine.close()
        engine.close()


def test_a_late_frame_is_refused():
    """Otherwise HELICS would stamp its messages anew and lengthen their delay."""
    engine = HelicsFilters(SPEC, 5_000_000, 0.0)
    engine.run_until(10)
    with pytest.raises(CosimError, match="came when the network had reached 10 ns"):
        engine.send(9, np.arange(4), 0)
    engine.close()
