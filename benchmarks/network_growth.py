"""How the cost of a packet-hop and the memory of a flow grow with the network.

A network of n nodes is a ring with one random chord from each node; n flows go from sqrt(n) PMUs to
sqrt(n) controllers. Timed are its building (routes and tables) and its packet-hops, frame by frame,
as in a federation. Beside the cost of a hop stands the binary logarithm of the events that were
pending, which is what a heap may cost. The cost has two parts more: some 0.1 ms a frame, whatever
the network, which weighs on 400 hops and is nothing on 90,000, so growth is told from both smaller
networks; and fetching rows of tables that no longer fit a nearer cache. The memory of a flow is
what twice as many flows take more on the same network: specification, engine and statistics.

    .venv/bin/python benchmarks/network_growth.py
"""

import argparse
import gc
import time
import tracemalloc
from math import isqrt, log2
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from figures import Row, save
from tieline.network.packet import PacketEngine
from tieline.network.packet.memory import HEAP_SIZE
from tieline.network.queues import DropTail
from tieline.network.recorder import Recorder
from tieline.network.routing import Router, Routing
from tieline.network.spec import Destination, Flow, Link, NetworkSpec, Node, Source

NODES = (100, 1_000, 10_000)
RATE_HZ, HOPS = 60, 3_000_000
REPETITIONS = 5


def network(nodes: int, pmus: int, controllers: int) -> NetworkSpec:
    """Return a network of so many nodes, every PMU sending to every controller."""
    random = np.random.default_rng(1)
    names = [f"n{k:05}" for k in range(nodes)]
    chords = {(k, (k + 1) % nodes) for k in range(nodes)}
    for k in range(nodes):
        other = int(random.integers(nodes))
        if other != k and (other, k) not in chords:
            chords.add((k, other))
    links = tuple(
        Link(names[a], names[b], 10**9, int(random.integers(20_000, 400_000)), DropTail(1000))
        for a, b in sorted(chords)
    )
    places = random.choice(nodes, pmus + controllers, replace=False)
    sources = tuple(Source(f"p{k}", k, names[place]) for k, place in enumerate(places[:pmus]))
    destinations = tuple(
        Destination(f"c{k}", f"G{k}", k, names[place]) for k, place in enumerate(places[pmus:])
    )
    router = Router(Routing(), names, links)
    flows = tuple(
        Flow(i, j, router.route(source.node, destination.node) or ())
        for i, source in enumerate(sources)
        for j, destination in enumerate(destinations)
    )
    return NetworkSpec(tuple(map(Node, names)), links, sources, destinations, flows)


def carried(engine: PacketEngine, frames: int) -> tuple[float, int]:
    """Return the CPU seconds of a packet-hop while frames are carried, and the events pending."""
    events = 0
    sources = np.arange(len(engine._spec.sources))
    before = sum(link.packets for link in engine.links())
    spent_s = 0.0
    for k in range(frames):
        at_ns = (engine._now_ns + 1) + 10**9 // RATE_HZ
        engine.send(at_ns, sources, k)
        began = time.process_time()
        engine.run_until(at_ns)
        events = max(events, int(engine._memory.control[HEAP_SIZE]))
        engine.run_until(at_ns + 10**9 // RATE_HZ - 1)
        spent_s += time.process_time() - began
    hops = sum(link.packets for link in engine.links()) - before
    return spent_s / hops, events


def bytes_of(nodes: int, pmus: int, controllers: int) -> int:
    """Return the memory of a network of which every flow has carried some frames."""
    gc.collect()
    tracemalloc.start()
    spec = network(nodes, pmus, controllers)
    engine = PacketEngine(spec, 1)
    with TemporaryDirectory() as folder:
        recorder = Recorder(Path(folder), spec, engine, RATE_HZ, None, record_packets=False)
        for k in range(4):
            engine.send(k * 10**9 // RATE_HZ, np.arange(pmus), k)
            recorder.add_sent(np.arange(pmus), k)
            until_ns = (k + 1) * 10**9 // RATE_HZ
            recorder.add(engine.run_until(until_ns), until_ns)
        recorder.check()
        gc.collect()
        held = tracemalloc.get_traced_memory()[0]
        recorder.write()
    tracemalloc.stop()
    return held


def growth(place: int, costs: list[NDArray[np.float64]], logs: list[float]) -> Row:
    """Return the row of the growth of the cost from a smaller network to the largest.

    Args:
        place: which of the smaller ones.
        costs: of each network, (repetitions,) CPU seconds a packet-hop.
        logs: binary logarithms of the events pending in each.
    """
    goal = logs[-1] / logs[place]
    return Row(
        f"from {NODES[place]:,} to {NODES[-1]:,} nodes",
        "growth of the cost of a packet-hop",
        "times",
        (costs[-1] / np.median(costs[place])).tolist(),
        "at most",
        goal,
        note=f"the logarithm of the events grows {goal:.2f} times",
    )


def main() -> None:
    """Measure every size."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repetitions", type=int, default=REPETITIONS)
    parser.add_argument("--json", type=Path, help="file for the figures")
    options = parser.parse_args()
    rows, costs, logs = [], [], []
    # What is loaded once is no flow's.
    bytes_of(NODES[0], 2, 2)
    for nodes in NODES:
        what, side = f"network of {nodes:,} nodes and flows", isqrt(nodes)
        began = time.process_time()
        spec = network(nodes, side, side)
        engine = PacketEngine(spec, 1)
        built_s = time.process_time() - began
        links = sum(len(flow.route) - 1 for flow in spec.flows)
        carried(engine, 3)
        runs = [
            carried(engine, max(3, HOPS // (links * options.repetitions)))
            for _ in range(options.repetitions)
        ]
        costs.append(np.array([cost_s for cost_s, _ in runs]))
        logs.append(log2(max(events for _, events in runs)))
        rows.append(Row(what, "routes and tables built", "s CPU", [built_s], "at most", 10))
        rows.append(Row(what, "packet-hop", "ns CPU", (costs[-1] * 1e9).tolist()))
        rows.append(Row(what, "binary logarithm of the events pending", "", [logs[-1]]))
        per_flow = bytes_of(nodes, 2 * side, side) - bytes_of(nodes, side, side)
        rows.append(Row(what, "memory of a flow", "B", [per_flow / side**2], "at most", 1000))
    rows += [growth(place, costs, logs) for place in range(len(NODES) - 1)]
    save(rows, options.json)


if __name__ == "__main__":
    main()
