"""The packet kernel's memory: as large as what is inside the network, whatever that may hold."""

import numpy as np

from network.builders import ALL, joined
from tieline.network.packet import PacketEngine
from tieline.network.packet.memory import MOST_ORDERS, NEXT_ORDER
from tieline.network.queues import DropTail
from tieline.network.spec import Destination, Link, NetworkSpec, Source

SOURCES = 40
ALL_SOURCES = np.arange(SOURCES)


def narrow(queue: int) -> NetworkSpec:
    """Return a network where 40 PMUs share a link of 1 Mbit/s."""
    links = [Link("a", "b", 10**6, 1_000, DropTail(queue))]
    sources = [Source(f"p{k}", k, "a") for k in range(SOURCES)]
    return joined(links, sources, [Destination("c", "G", 1, "b")])


def test_the_memory_is_not_that_of_what_queues_could_hold():
    """Otherwise a network of 10,000 nodes with long queues would take hundreds of megabytes."""
    few, many = (PacketEngine(narrow(queue), seed=1) for queue in (10, 100_000))
    assert many._memory.cells.nbytes == few._memory.cells.nbytes


def test_a_queue_grows_to_what_it_may_hold_and_is_emptied_in_order():
    """Otherwise a long queue would lose packets that it has room for, or mix them up."""
    engine = PacketEngine(narrow(20_000), seed=1)
    for k in range(500):
        engine.send(1_000 * k, ALL_SOURCES, k)
    outcome = engine.run_until(ALL)
    assert engine.links()[0].max_queue > 19_000
    assert len(outcome.drops) == 0
    codes = SOURCES * outcome.arrivals["sequence"].astype(np.int64) + outcome.arrivals["source"]
    assert np.array_equal(codes, np.arange(500 * SOURCES))


def test_what_waited_leaves_its_memory_to_the_next():
    """Otherwise a run of hours would need memory for every packet that ever waited."""
    engine = PacketEngine(narrow(1_000), seed=1)
    for k in range(300):
        engine.send(30_000_000 * k, ALL_SOURCES, k)
        engine.run_until(30_000_000 * k)
        if k == 20:
            before = engine._memory.cells.nbytes
    assert engine.links()[0].max_queue == SOURCES - 1
    assert engine._memory.cells.nbytes == before


def test_events_keep_their_order_when_their_numbers_begin_anew():
    """Otherwise packets that arrive at one instant would change places once in 30 thousand million.

    All 40 PMUs have links alike to one node, where only the order of the events decides who goes
    first on the link that they share.
    """
    links = [Link(f"n{k}", "a", 10**7, 1_000, DropTail(10)) for k in range(SOURCES)]
    links.append(Link("a", "b", 10**6, 1_000, DropTail(50)))
    sources = [Source(f"p{k}", k, f"n{k}") for k in range(SOURCES)]
    spec = joined(links, sources, [Destination("c", "G", 1, "b")])
    logs = []
    for first in (0, MOST_ORDERS - 1_000):
        engine = PacketEngine(spec, seed=1)
        engine._memory.control[NEXT_ORDER] = first
        for k in range(100):
            engine.send(20_000_000 * k, ALL_SOURCES, k)
        outcome = engine.run_until(ALL)
        logs.append(outcome.arrivals.tobytes() + outcome.drops.tobytes())
        assert engine._memory.control[NEXT_ORDER] < MOST_ORDERS // 2
    assert logs[0] == logs[1]
