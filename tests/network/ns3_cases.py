"""Networks that ns-3 and tieline's own engine both carry frames through."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from network.builders import busy_ring, carried, chain, joined
from network.test_ns3_reference import wide_area_network
from tieline.network.engine import Counts, Engine, LinkUse
from tieline.network.jitter import NormalJitter, UniformJitter
from tieline.network.losses import Bernoulli, BitError, GilbertElliott
from tieline.network.queues import DropTail
from tieline.network.spec import CrossFlow, Destination, Flow, Link, NetworkSpec, Node, Source
from tieline.network.traffic import Cbr, OnOff, Poisson, Trace

FRAMES = [(k * 10**9 // 60, k) for k in range(20)]
TICK_NS = 248_000
"""Half the serialisation time of a frame without link layer at 1 Mbit/s."""


@dataclass(frozen=True)
class Case:
    """A network, the frames that enter it and how time is cut.

    `until_ns` ends it; without it everything ends by itself.
    """

    spec: NetworkSpec
    seed: int = 3
    frames: Sequence[tuple[int, int]] = tuple(FRAMES)
    steps: Sequence[int] = ()
    until_ns: int | None = None


@dataclass(frozen=True)
class Fate:
    """What became of the packets of a case."""

    arrivals: bytes
    drops: bytes
    counts: Counts
    links: list[LinkUse]
    counters: bytes


def fate(make: Callable[..., Engine], case: Case) -> Fate:
    """Return what an engine makes of a case."""
    engine = make(case.spec, case.seed)
    counters = engine.link_counters().tobytes()
    sources = len(case.spec.sources)
    if case.until_ns is None:
        outcome = carried(engine, case.frames, case.steps, sources)
    else:
        for measured_ns, sequence in case.frames:
            engine.send(measured_ns, np.arange(sources), sequence)
        outcome = engine.run_until(case.until_ns)
    for _ in range(2):
        counters += engine.link_counters().tobytes()
    result = Fate(
        outcome.arrivals.tobytes(),
        outcome.drops.tobytes(),
        engine.counts(),
        engine.links(),
        counters,
    )
    engine.close()
    return result


def link_layers() -> NetworkSpec:
    """Return a lossy chain whose link layers, losses and rates differ, one of half nanoseconds."""
    spec = chain([(10_000_000, 10**6)] * 5, loss=Bernoulli(0.05))
    overheads = (0, 1, 2, 9, 40)
    rates = (10_000_000, 128_000_000, 1_500_000, 128_000_000, 7_000_000)
    losses = (Bernoulli(0.02), None, BitError(1e-4), GilbertElliott(0.01, 0.2), None)
    links = [
        replace(link, overhead_bytes=overhead, rate_bps=rate, loss=loss)
        for link, overhead, rate, loss in zip(spec.links, overheads, rates, losses, strict=True)
    ]
    return replace(spec, links=tuple(links))


def busy_star() -> NetworkSpec:
    """Return six equal spokes, each with a PMU, a controller and cross traffic in rounds."""
    links = [
        Link("hub", f"s{i}", 10_000_000, 10**6, DropTail(20), overhead_bytes=9) for i in range(6)
    ]
    sources = [Source(f"p{i}", i, f"s{i}") for i in range(6)]
    destinations = [Destination(f"c{i}", f"G{i}", i, f"s{i}") for i in range(6)]
    cross = [
        CrossFlow("poisson", Poisson(4_000_000, 200), ("s0", "s1"), dscp=46),
        CrossFlow("cbr", Cbr(5_000_000, 1200), ("s2", "s1"), stop_ns=500_000_000),
        CrossFlow("on-off", OnOff(8e6, 700, 10**7, 10**7, 1.5), ("s3", "s1"), start_ns=10**8),
    ]
    return joined(links, sources, destinations, cross)


def overloaded() -> NetworkSpec:
    """Return twelve PMUs whose frames do not fit through slow links with short queues."""
    links = [
        Link("a", "b", 1_000_000, 10**6, DropTail(30, 1_500), overhead_bytes=9),
        Link("b", "c", 256_000, 10**6, DropTail(7)),
    ]
    sources = [Source(f"p{i}", i, "a", 10_000 * i) for i in range(12)]
    places = [Destination(f"c{j}", f"G{j}", j, "c") for j in range(3)]
    return joined(links, sources, places)


def lossy_ring() -> NetworkSpec:
    """Return the busy ring with jitter in PMUs and controllers, and none on its links."""
    ring = busy_ring()
    sources = (replace(ring.sources[0], jitter=NormalJitter(2_000_000, 900_000)), ring.sources[1])
    links = tuple(replace(link, jitter=None) for link in ring.links)
    return replace(ring, links=links, sources=sources)


def two_ways() -> NetworkSpec:
    """Return flows to one controller that part at b, where IP knows the destination alone.

    p0  a - b - c - d     p1  e - b - f - d     p2  b itself
    """
    ends = ["ab", "eb", "bc", "cd", "bf", "fd"]
    links = tuple(
        Link(a, b, 2_000_000, 100_000 * i, DropTail(50), Bernoulli(0.02), None, 9)
        for i, (a, b) in enumerate(ends)
    )
    routes = (("a", "b", "c", "d"), ("e", "b", "f", "d"), ("b", "c", "d"))
    return NetworkSpec(
        tuple(Node(name) for name in "abcdef"),
        links,
        tuple(Source(f"p{i}", i, route[0]) for i, route in enumerate(routes)),
        (Destination("c0", "G0", 9, "d"),),
        tuple(Flow(i, 0, route) for i, route in enumerate(routes)),
        (CrossFlow("back", Cbr(400_000, 500), ("d", "f", "b", "a")),),
    )


def in_rounds(seed: int) -> Case:
    """Return a random network in which everything happens at multiples of `TICK_NS`.

    So most events have company, and who goes first decides whom a full queue drops.
    """
    draw = np.random.default_rng(seed)
    nodes = [f"n{i}" for i in range(draw.integers(3, 8))]
    ends = {(int(draw.integers(0, i)), i) for i in range(1, len(nodes))}
    ends |= {tuple(sorted(draw.choice(len(nodes), 2, replace=False).tolist())) for _ in range(2)}
    links = [
        Link(
            nodes[a],
            nodes[b],
            int(draw.choice([1_000_000, 2_000_000])),
            int(draw.integers(0, 4)) * TICK_NS,
            DropTail(int(draw.integers(1, 6))),
            Bernoulli(0.1) if draw.random() < 0.5 else None,
        )
        for a, b in sorted(ends)
    ]
    at = [nodes[i] for i in draw.integers(0, len(nodes), 9)]
    sources = [Source(f"p{i}", i, at[i], int(draw.integers(0, 4)) * TICK_NS) for i in range(4)]
    places = [Destination(f"c{j}", f"G{j}", j, at[4 + j]) for j in range(5)]
    places[0] = replace(places[0], jitter=UniformJitter(0, 1_000_000))
    pairs = [draw.choice(len(nodes), 2, replace=False) for _ in range(3)]
    payloads = np.array([34, 34 + 62])
    cross = [
        CrossFlow(
            f"x{i}",
            Trace(np.sort(draw.integers(0, 400, 300)) * TICK_NS, draw.choice(payloads, 300)),
            (nodes[a], nodes[b]),
        )
        for i, (a, b) in enumerate(pairs)
    ]
    frames = [(k * 40 * TICK_NS, k) for k in range(8)]
    steps = np.sort(draw.integers(0, 10**8, 10)).tolist()
    return Case(joined(links, sources, places, cross), seed, frames, steps)


def wide_area(frames: int = 90, until_ns: int = 1_600_000_000) -> Case:
    """Return the 40-router network of `test_ns3_reference.py`."""
    plan = [(k * 10**9 // 60, k) for k in range(frames)]
    return Case(wide_area_network(), 1, plan, until_ns=until_ns)


CASES: dict[str, Callable[[], Case]] = {
    "chain": lambda: Case(chain([(10_000_000, 10**6), (64_000, 0)], overhead_bytes=9)),
    "link layers": lambda: Case(link_layers(), frames=[(k * 10**7, k) for k in range(400)]),
    "busy star": lambda: Case(busy_star(), until_ns=900_000_000),
    "busy star in steps": lambda: Case(
        busy_star(), steps=range(0, 700_000_000, 1_234_567), until_ns=None, frames=FRAMES[:4]
    ),
    "overloaded": lambda: Case(overloaded()),
    "lossy ring": lambda: Case(lossy_ring()),
    "two ways": lambda: Case(two_ways()),
    "wide area": wide_area,
} | {f"rounds {seed}": lambda seed=seed: in_rounds(seed) for seed in range(12)}
