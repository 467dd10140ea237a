"""What every engine promises, asked of each of them."""

import numpy as np
import pytest

from network.builders import joined
from tieline.network.empirical import EmpiricalDelay
from tieline.network.engine import Engine
from tieline.network.ideal import ConstantDelay
from tieline.network.jitter import UniformJitter
from tieline.network.packet import PacketEngine
from tieline.network.path_delays import DrawnDelay
from tieline.network.queues import DropTail
from tieline.network.spec import Destination, Link, NetworkSpec, Source, direct_spec

SOURCES, DESTINATIONS = 3, 2
RATE = 60


def packet_network_spec() -> NetworkSpec:
    """Return three PMUs and two controllers around one link, no two delays alike."""
    sources = [Source(f"p{i}", i, "a", 1_000_000 * i) for i in range(SOURCES)]
    destinations = [Destination(f"c{j}", f"G{j}", j, "b", 3_000 * j) for j in range(DESTINATIONS)]
    return joined([Link("a", "b", 10**7, 2_000_000, DropTail(50))], sources, destinations)


def empirical_network() -> Engine:
    """Return paths whose packets take 1 to 40 ms, each as long as it happens to, in order."""
    spec = direct_spec(SITES["sources"], SITES["destinations"], 1_000_000)
    delay = DrawnDelay(UniformJitter(0, 39_000_000), 1_000_000)
    return EmpiricalDelay(spec, [delay] * (SOURCES * DESTINATIONS), 0.0, True, 1)


def helics_filters() -> Engine:
    """Return HELICS's own delay filter."""
    from tieline.network.helics_filters import HelicsFilters

    return HelicsFilters(direct_spec(SITES["sources"], SITES["destinations"], 0), 30_000_000, 0.0)


SITES = {
    "sources": [{"name": f"p{i}", "bus": i} for i in range(SOURCES)],
    "destinations": [{"name": f"c{j}", "unit": f"G{j}", "bus": j} for j in range(DESTINATIONS)],
}
ENGINES = {
    "ideal": lambda: ConstantDelay(DESTINATIONS, 0),
    "constant": lambda: ConstantDelay(DESTINATIONS, 250_000_000),
    "packet": lambda: PacketEngine(packet_network_spec(), 1),
    "empirical": empirical_network,
    "helics-filters": helics_filters,
}
PROMISES = (
    "test_every_frame_reaches_every_destination_once",
    "test_arrivals_lie_in_their_window_and_in_order",
    "test_counts_follow_the_packets",
    "test_before_the_first_step_no_link_has_carried_anything",
    "test_no_frames_is_no_traffic",
)
"""The tests that ns-3, which runs in a process of its own, has to pass as well."""

MARKS = {"helics-filters": pytest.mark.helics}


@pytest.fixture(params=[pytest.param(name, marks=MARKS.get(name, ())) for name in ENGINES])
def engine(request):
    """Each engine in turn."""
    made = ENGINES[request.param]()
    yield made
    made.close()


def test_every_frame_reaches_every_destination_once(engine):
    """Otherwise a controller would lack sensors, or weigh one twice."""
    arrivals = []
    for k in range(30):
        engine.send(k * 10**9 // RATE, np.arange(SOURCES), k)
        arrivals.append(engine.run_until((k + 1) * 10**9 // RATE).arrivals)
    arrivals.append(engine.run_until(2 * 10**9).arrivals)
    rows = np.concatenate(arrivals)
    seen = {(int(r["sequence"]), int(r["source"]), int(r["destination"])) for r in rows}
    assert seen == {
        (k, i, j) for k in range(30) for i in range(SOURCES) for j in range(DESTINATIONS)
    }
    assert len(rows) == len(seen)


def test_arrivals_lie_in_their_window_and_in_order(engine):
    """Otherwise the grid would be told of the past or of the future."""
    for k in range(30):
        measured_ns, until_ns = k * 10**9 // RATE, (k + 1) * 10**9 // RATE
        engine.send(measured_ns, np.arange(SOURCES), k)
        rows = engine.run_until(until_ns).arrivals
        names = ("arrival_ns", "source", "sequence", "destination")
        keys = [tuple(int(row[name]) for name in names) for row in rows]
        assert keys == sorted(keys)
        # A frame without delay arrives at the very instant of its measurement.
        assert all(
            measured_ns < key[0] <= until_ns or key[0::2] == (measured_ns, k) for key in keys
        )


def test_counts_follow_the_packets(engine):
    """Otherwise a loss could hide in what is said to be under way."""
    engine.send(0, np.arange(SOURCES), 0)
    counts = engine.counts()
    assert (counts.sent, counts.delivered, counts.in_flight) == (6, 0, 6)
    engine.run_until(10**9)
    counts = engine.counts()
    assert (counts.sent, counts.delivered, counts.in_flight) == (6, 6, 0)


def test_before_the_first_step_no_link_has_carried_anything(engine):
    """Otherwise the first window of the links' series would show what never happened."""
    counters = engine.link_counters()
    assert len(counters) == len(engine.links())
    assert all(not counters[name].any() for name in counters.dtype.names)
    assert all(link.busy_ns == 0 for link in engine.links())


def test_no_frames_is_no_traffic(engine):
    """Otherwise continuous reporting, which sends none, would fail."""
    engine.send(0, np.arange(0), 0)
    assert len(engine.run_until(10**9).arrivals) == 0
    assert engine.counts().sent == 0


def test_an_ideal_network_delivers_at_once():
    """Otherwise ideal communication would have a delay of one interval."""
    engine = ConstantDelay(DESTINATIONS, 0)
    engine.send(5_000, np.arange(SOURCES), 0)
    assert set(engine.run_until(5_000).arrivals["arrival_ns"].tolist()) == {5_000}


def test_a_constant_network_delays_each_frame_by_the_same_time():
    """Otherwise a study of pure delay would study jitter."""
    engine = ConstantDelay(DESTINATIONS, 250_000_000)
    engine.send(0, np.arange(SOURCES), 0)
    engine.send(16_666_666, np.arange(SOURCES), 1)
    assert len(engine.run_until(249_999_999).arrivals) == 0
    assert engine.run_until(250_000_000).arrivals["sequence"].tolist() == [0] * 6
    assert set(engine.run_until(10**9).arrivals["arrival_ns"].tolist()) == {266_666_666}
    assert engine.links() == []
