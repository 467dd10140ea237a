"""Random networks that mix every mechanism of the packet engine, and all that happens on them."""

import hashlib
from dataclasses import replace
from random import Random

import numpy as np

from tieline.network.events import rerouted
from tieline.network.jitter import UniformJitter
from tieline.network.losses import Bernoulli, BitError, GilbertElliott
from tieline.network.packet import PacketEngine
from tieline.network.queues import (
    DeficitRoundRobin,
    DropTail,
    EarlyDetection,
    Queue,
    RandomEarlyDetection,
    StrictPriority,
    WaitingLine,
)
from tieline.network.routing import Router, Routing
from tieline.network.spec import (
    Change,
    CrossFlow,
    Destination,
    Flow,
    Link,
    LinkCut,
    LinkRepair,
    LossChange,
    NetworkSpec,
    Node,
    RateChange,
    Source,
)
from tieline.network.traffic import Cbr, Greedy, Poisson, Polling

URGENT = 46


def mixed_network(random: Random, end_ns: int) -> NetworkSpec:
    """Return a small network, often overloaded, of mechanisms taken at random.

    Args:
        random: what is taken.
        end_ns: before which its events come.
    """
    names = [f"n{i}" for i in range(random.randint(2, 5))]
    links = _links(random, names)
    routing = Routing(
        random.choice(["delay", "hops"]),
        random.random() < 0.5,
        random.choice([None, 0, 30_000_000]),
    )
    router = Router(routing, names, links)
    sources = tuple(
        Source(f"p{i}", i, random.choice(names), 1_000 * i) for i in range(random.randint(0, 3))
    )
    places = tuple(
        Destination(f"c{j}", f"G{j}", j, random.choice(names), 500_000 * j)
        for j in range(random.randint(0, 3))
    )
    ends = [(source.node, place.node) for source in sources for place in places]
    routes = [router.route(*pair, f"flow {number}") for number, pair in enumerate(ends)]
    flows = tuple(
        Flow(*divmod(number, len(places)), route) for number, route in enumerate(routes) if route
    )
    cross = _cross_flows(random, names, router, end_ns)
    changes = _changes(random, links, end_ns)
    if routing.convergence_ns is not None:
        changes = rerouted(
            changes,
            routing.convergence_ns,
            flows,
            cross,
            ends,
            lambda down: Router(routing, names, links, down).route,
        )
    return NetworkSpec(
        tuple(Node(name) for name in names),
        links,
        sources,
        places,
        flows,
        cross,
        random.choice(["unicast", "multicast", "tcp"]),
        random.choice([0, URGENT]),
        tuple(changes),
        tuple(n for n in range(len(links)) if random.random() < 0.4),
    )


def all_that_happens(spec: NetworkSpec, steps: list[int], end_ns: int) -> tuple[str, PacketEngine]:
    """Return a hash of everything that happens until `end_ns`, and the engine at its end.

    A frame is sent every 40 ms; the network is also run to each of `steps` (ascending).
    """
    engine = PacketEngine(spec, seed=11)
    sources = np.arange(len(spec.sources))
    frames = {at_ns: k for k, at_ns in enumerate(range(0, end_ns, 40_000_000))}
    outcomes, taps = [], []
    for until_ns in sorted({*frames, *steps, end_ns}):
        outcomes.append(engine.run_until(until_ns))
        taps.append(engine.tapped())
        if until_ns in frames:
            engine.send(until_ns, sources, frames[until_ns])
    digest = hashlib.sha256()
    for name in ("arrivals", "drops"):
        digest.update(np.concatenate([getattr(part, name) for part in outcomes]).tobytes())
    digest.update(np.concatenate(taps).tobytes())
    digest.update(repr((engine.counts(), engine.links())).encode())
    return digest.hexdigest(), engine


def mixture_digest(seeds: list[int]) -> str:
    """Return a hash of everything that happens on some networks."""
    end_ns = 200_000_000
    return " ".join(
        all_that_happens(mixed_network(Random(seed), end_ns), [], end_ns)[0] for seed in seeds
    )


def _links(random: Random, names: list[str]) -> tuple[Link, ...]:
    pairs = {(random.randrange(i), i) for i in range(1, len(names))}
    for _ in range(random.randint(0, 3)):
        pairs.add(tuple(sorted(random.sample(range(len(names)), 2))))  # type: ignore[arg-type]
    links = []
    for a, b in sorted(pairs):
        queue = _queue(random)
        link = Link(
            names[a],
            names[b],
            random.choice([64_000, 500_000, 10_000_000]),
            random.choice([1, 300_000, 5_000_000]),
            queue,
            random.choice([None, Bernoulli(0.1), BitError(1e-5), GilbertElliott(0.05, 0.3)]),
            random.choice([None, UniformJitter(0, 2_000_000)]),
            random.randint(0, 20),
            mtu_bytes=random.choice([300, 1500]),
        )
        is_half = queue.early_detection is None and random.random() < 0.3
        links.append(replace(link, is_half_duplex=is_half))
    return tuple(links)


def _queue(random: Random) -> Queue:
    few = random.randint(1, 6)
    lines = (WaitingLine(few, 2_000, 300), WaitingLine(few, quantum_bytes=700))
    marks = frozenset({URGENT}), frozenset[int]()
    return random.choice(
        [
            DropTail(few),
            DropTail(40, 1_500),
            RandomEarlyDetection(8, EarlyDetection(1, 5, 0.3, 2)),
            StrictPriority(lines, marks),
            DeficitRoundRobin(lines, marks),
        ]
    )


def _cross_flows(
    random: Random, names: list[str], router: Router, end_ns: int
) -> tuple[CrossFlow, ...]:
    flows = []
    for number in range(random.randint(0, 4)):
        a, b = random.sample(names, 2)
        name = f"cross flow {number}"
        traffic = random.choice(
            [
                Cbr(90_000, 700),
                Poisson(400_000, 900),
                Polling(30_000_000, 12, 800, 1_000_000),
                Greedy(200, random.choice([1, 5, 40])),
            ]
        )
        start_ns = random.choice([0, end_ns // 7])
        stop_ns = random.choice([None, end_ns // 2])
        route, back = router.route(a, b, name), router.route(b, a, name)
        dscp = random.choice([0, URGENT])
        flows.append(CrossFlow(name, traffic, route or (), back or (), dscp, start_ns, stop_ns))
    return tuple(flows)


def _changes(random: Random, links: tuple[Link, ...], end_ns: int) -> list[Change]:
    changes: list[Change] = []
    for number in range(len(links)):
        if random.random() < 0.5:
            begin, end = sorted(random.sample(range(1, end_ns), 2))
            changes += [LinkCut(begin, number), LinkRepair(end, number)]
        if random.random() < 0.4:
            rate_bps = random.choice([40_000, 200_000, 3_000_000])
            changes.append(RateChange(random.randrange(end_ns), number, rate_bps))
        if random.random() < 0.4:
            begin, end = sorted(random.sample(range(1, end_ns), 2))
            changes += [LossChange(begin, number, 0.5), LossChange(end, number, 0.0)]
    return sorted(changes, key=lambda change: change.at_ns)
