"""Small networks that several tests use."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from tieline.network.engine import Engine, Outcome
from tieline.network.jitter import GammaJitter, NormalJitter, UniformJitter
from tieline.network.losses import Bernoulli
from tieline.network.packet import PacketEngine
from tieline.network.queues import DropTail
from tieline.network.routing import routes_from
from tieline.network.spec import (
    FRAME_BYTES,
    CrossFlow,
    Destination,
    Flow,
    Link,
    NetworkSpec,
    Node,
    Source,
)
from tieline.network.traffic import HEADER_BYTES, Cbr, Poisson

ALL = 10**15
"""An instant after everything, ns."""


def overhead_for(wire_bytes: int) -> int:
    """Return the link-layer bytes with which a PMU frame has this size on the link."""
    return wire_bytes - FRAME_BYTES - HEADER_BYTES


def joined(
    links: Sequence[Link],
    sources: Sequence[Source],
    destinations: Sequence[Destination],
    cross: Sequence[CrossFlow] = (),
) -> NetworkSpec:
    """Return a network with shortest-path routes; cross flows give their ends as the route."""
    names = sorted({name for link in links for name in (link.a, link.b)})
    names = names or [source.node for source in sources][:1]
    origins = {source.node for source in sources} | {flow.route[0] for flow in cross}
    routes = routes_from(origins, names, links)
    flows = tuple(
        Flow(i, j, routes[source.node][destination.node])
        for i, source in enumerate(sources)
        for j, destination in enumerate(destinations)
    )
    return NetworkSpec(
        tuple(Node(name) for name in names),
        tuple(links),
        tuple(sources),
        tuple(destinations),
        flows,
        tuple(replace(flow, route=routes[flow.route[0]][flow.route[-1]]) for flow in cross),
    )


def chain(links: Sequence[tuple[int, int]], queue: int = 100, **more: object) -> NetworkSpec:
    """Return n0 - n1 - ... with a source at n0 and a destination at the end.

    Args:
        links: (rate_bps, propagation_ns) of each.
        queue: of each.
        more: further fields of every link.
    """
    names = [f"n{i}" for i in range(len(links) + 1)]
    made = [
        Link(a, b, rate, propagation, DropTail(queue), **more)  # type: ignore[arg-type]
        for (a, b), (rate, propagation) in zip(pairwise(names), links, strict=True)
    ]
    return joined(made, [Source("p", 1, names[0])], [Destination("c", "G", 2, names[-1])])


def busy_ring() -> NetworkSpec:
    """Return four nodes in a ring that overload, lose, re-order and delay at every stage."""
    links = [
        Link(
            "a",
            "b",
            2_000_000,
            700_000,
            DropTail(20),
            Bernoulli(0.02),
            UniformJitter(0, 400_000),
            9,
        ),
        Link("b", "c", 1_500_000, 900_000, DropTail(5), None, NormalJitter(200_000, 90_000), 9),
        Link(
            "c",
            "d",
            2_500_000,
            600_000,
            DropTail(30),
            Bernoulli(0.05),
            GammaJitter(100_000, 150_000),
            9,
        ),
        Link("a", "d", 1_000_000, 800_000, DropTail(3), None, None, 9),
    ]
    sources = [
        Source("p0", 1, "a", 3_000_000, UniformJitter(0, 2_000_000)),
        Source("p1", 2, "c", 1_000_000),
    ]
    destinations = [
        Destination("c0", "G0", 1, "a", 500_000),
        Destination("c1", "G1", 2, "b", 0, UniformJitter(0, 5_000_000)),
        Destination("c2", "G2", 3, "d", 20_000_000),
    ]
    cross = [
        CrossFlow("poisson", Poisson(900_000, 200), ("a", "c")),
        CrossFlow("cbr", Cbr(700_000, 472), ("d", "b")),
    ]
    return joined(links, sources, destinations, cross)


def carried(
    engine: Engine, frames: Sequence[tuple[int, int]], steps: Sequence[int], sources: int
) -> Outcome:
    """Return everything that ends when frames (measured_ns, sequence) go in at these steps.

    Before each step the frames that are measured up to then and not yet sent are sent.
    """
    waiting = list(frames)
    outcomes = []
    for until_ns in (*steps, ALL):
        while waiting and waiting[0][0] <= until_ns:
            measured_ns, sequence = waiting[0]
            outcomes.append(engine.run_until(measured_ns))
            engine.send(measured_ns, np.arange(sources), sequence)
            waiting.pop(0)
        outcomes.append(engine.run_until(until_ns if until_ns < ALL else _end(frames)))
    return Outcome(
        np.concatenate([outcome.arrivals for outcome in outcomes]),
        np.concatenate([outcome.drops for outcome in outcomes]),
    )


def _end(frames: Sequence[tuple[int, int]]) -> int:
    return frames[-1][0] + 10_000_000_000


def ring_digest(frames: int) -> str:
    """Return a hash of everything that happens to some frames on the busy ring."""
    engine = PacketEngine(busy_ring(), seed=5)
    plan = [(k * 10**9 // 60, k) for k in range(frames)]
    for measured_ns, sequence in plan:
        engine.send(measured_ns, np.arange(2), sequence)
    outcome = engine.run_until(plan[-1][0] + 10**9 // 10)
    digest = hashlib.sha256(outcome.arrivals.tobytes() + outcome.drops.tobytes())
    digest.update(repr((engine.counts(), engine.links())).encode())
    return digest.hexdigest()
