"""Single packets, followed link by link, against what the engine says of all of them."""

from dataclasses import replace
from random import Random

import numpy as np
import pytest

from network.builders import busy_ring, chain
from network.mixtures import mixed_network
from tieline.network.draws import CHUNK
from tieline.network.engine import DELIVERED, LOSS, QUEUE_FULL
from tieline.network.fate import Draw, Fate, Hop
from tieline.network.losses import Bernoulli
from tieline.network.packet import PacketEngine
from tieline.network.packet.red import CERTAIN
from tieline.network.packet.tracing import TracingEngine
from tieline.network.queues import EarlyDetection, RandomEarlyDetection
from tieline.network.spec import CrossFlow, Link, NetworkSpec, serialisation_ns
from tieline.network.traffic import Poisson
from tieline.streams import stream

GAP_NS, END_NS, SEED = 40_000_000, 1_000_000_000, 11


def carry(engine: PacketEngine, spec: NetworkSpec) -> dict[tuple[int, int, int], tuple[int, int]]:
    """Return (how, when) of each packet that ended, by source, destination and sequence."""
    sources, found = np.arange(len(spec.sources)), {}
    for sequence, at_ns in enumerate(range(0, END_NS, GAP_NS)):
        engine.send(at_ns, sources, sequence)
        outcome = engine.run_until(at_ns + GAP_NS)
        for when, source, place, number in outcome.arrivals.tolist():
            found[source, place, number] = (DELIVERED, when)
        for when, source, place, number, how in outcome.drops.tolist():
            found[source, place, number] = (how, when)
    return found


def follow(spec: NetworkSpec, flow: int, sequence: int) -> Fate:
    engine = TracingEngine(spec, SEED, flow, sequence)
    carry(engine, spec)
    return engine.fate


def check_times(hop: Hop) -> None:
    """A packet waits for what was there before it, and is then serialised and propagated."""
    if hop.starts_ns is None or hop.service_ns is None:
        return
    assert hop.wait_ns is not None
    assert (hop.wait_ns > 0) <= hop.is_busy
    assert (hop.waiting_packets > 0) <= hop.is_busy
    parts = hop.service_ns + hop.propagation_ns + hop.jitter_ns
    assert hop.reaches_ns == hop.starts_ns + parts


@pytest.mark.parametrize("number", range(12))
def test_every_ending_is_the_one_that_the_engine_states(number: int) -> None:
    """Otherwise the story of a packet would be that of another network."""
    random = Random(number)
    spec = replace(mixed_network(random, END_NS), taps=())
    if not spec.flows:
        return
    found = carry(PacketEngine(spec, SEED), spec)
    for _ in range(2):
        flow, sequence = random.randrange(len(spec.flows)), random.randrange(END_NS // GAP_NS)
        fate = follow(spec, flow, sequence)
        ends = spec.flows[flow]
        is_over = fate.ended_ns is not None and fate.ended_ns <= END_NS
        got = (fate.outcome, fate.ended_ns) if is_over else None
        assert got == found.get((ends.source, ends.destination, sequence))
        for hop in fate.hops:
            check_times(hop)
        if spec.transport != "tcp":
            for earlier, later in zip(fate.hops, fate.hops[1:], strict=False):
                assert earlier.reaches_ns == later.came_ns
                assert earlier.target == later.origin


def test_a_wait_is_the_time_that_what_was_found_takes() -> None:
    """Otherwise the queue that is shown would not be the one that delayed the packet."""
    cross = CrossFlow("poisson", Poisson(600_000, 60), ("n0", "n1"))
    spec = replace(chain([(500_000, 0)], queue=1000), cross_flows=(cross,))
    hops = [follow(spec, 0, number).hops[0] for number in (5, 12, 20)]
    assert max(hop.waiting_packets for hop in hops) > 2
    for hop in hops:
        assert hop.wait_ns is not None
        before_ns = serialisation_ns(hop.waiting_bytes, 500_000)
        # Besides what waits, the rest of one packet is in transmission, of a cross flow at most.
        assert before_ns < hop.wait_ns <= before_ns + serialisation_ns(60 + 28, 500_000)
        assert hop.service_ns == serialisation_ns(34 + 28, 500_000)


def drawn(draw: Draw, of: object) -> float:
    """Return the number that a draw names, taken from its stream anew."""
    values, generator = np.empty(0), stream(SEED, draw.stream)
    while len(values) < draw.number:
        values = np.append(values, of.draw(generator, CHUNK))  # type: ignore[attr-defined]
    return float(values[draw.number - 1])


def test_every_jitter_is_the_number_of_its_stream_that_it_says() -> None:
    """Otherwise nobody could draw a packet's delay again from the seed and the stream's name."""
    spec = busy_ring()
    jitters = {f"jitter of {link.a}->{link.b}": link.jitter for link in spec.links}
    jitters |= {f"jitter of {link.b}->{link.a}": link.jitter for link in spec.links}
    places = (*spec.sources, *spec.destinations)
    jitters |= {f"processing of {place.name}": place.jitter for place in places}
    seen = set()
    for flow, sequence in [(0, 9), (1, 14), (2, 3), (3, 20), (4, 17)]:
        fate = follow(spec, flow, sequence)
        draws = [hop.jitter for hop in fate.hops if hop.starts_ns is not None]
        for draw in [fate.pmu_jitter, fate.controller_jitter, *draws]:
            if draw is not None:
                assert drawn(draw, jitters[draw.stream]) == draw.value
                seen.add(draw.stream.partition(" ")[0])
    assert seen == {"jitter", "processing"}


def test_a_loss_is_where_its_gap_ends() -> None:
    """Otherwise the draw that is blamed would not be the one that lost the packet."""
    spec = chain([(1_000_000, 0)], loss=Bernoulli(0.3))
    found = carry(PacketEngine(spec, SEED), spec)
    lost = [number for (_, _, number), (how, _) in sorted(found.items()) if how == LOSS]
    gaps = next(Bernoulli(0.3).gaps(stream(SEED, "loss of n0->n1")))
    # One flow: the packet of sequence k is the link's packet k + 1.
    assert np.array_equal(np.cumsum(gaps)[: len(lost)], np.array(lost) + 1)
    for place, number in enumerate(lost[:3]):
        hop = follow(spec, 0, number).hops[0]
        assert hop.lost == Draw("loss of n0->n1", place + 1)
    kept = next(number for number in range(25) if number not in lost)
    assert follow(spec, 0, kept).hops[0].lost is None


def test_an_early_drop_names_its_draw() -> None:
    """Otherwise random early detection would lose packets and not say by which number."""
    queue = RandomEarlyDetection(50, EarlyDetection(0.1, 10.0, 0.5, 1))
    link = Link("n0", "n1", 400_000, 0, queue)
    cross = CrossFlow("poisson", Poisson(350_000, 60), ("n0", "n1"))
    spec = replace(chain([(400_000, 0)]), links=(link,), cross_flows=(cross,))
    found = carry(PacketEngine(spec, SEED), spec)
    dropped = [number for (_, _, number), (how, _) in sorted(found.items()) if how == QUEUE_FULL]
    assert dropped
    values = stream(SEED, "early drops of n0->n1").integers(CERTAIN, size=CHUNK) / CERTAIN
    for number in dropped[:3]:
        hop = follow(spec, 0, number).hops[0]
        assert hop.dropped is not None
        assert "early" in hop.dropped
        assert hop.early is not None
        assert values[hop.early.number - 1] == hop.early.value


def test_the_streams_are_all_named_and_count_what_they_gave() -> None:
    """Otherwise something random would stand in no manifest."""
    spec = busy_ring()
    engine = PacketEngine(spec, SEED)
    carry(engine, spec)
    uses = {use.name: use for use in engine.streams()}
    assert len(uses) == len(engine.streams())
    wanted = {"arrivals of poisson", "arrivals of cbr", "processing of p0", "processing of c1"}
    for link in spec.links:
        for ends in (f"{link.a}->{link.b}", f"{link.b}->{link.a}"):
            wanted |= {f"loss of {ends}"} if link.loss else set()
            wanted |= {f"jitter of {ends}"} if link.jitter else set()
    assert set(uses) == wanted
    assert uses["processing of p0"].taken == END_NS // GAP_NS
    assert uses["jitter of b->c"].taken == engine.links()[spec.ports["b", "c"]].packets
