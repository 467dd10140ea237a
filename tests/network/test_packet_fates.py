"""The fate of single packets, followed link by link, against what the engine says of all of them."""

from random import Random

import numpy as np
import pytest

from network.builders import busy_ring
from network.mixtures import mixed_network
from tieline.network.engine import DELIVERED, LOSS
from tieline.network.packet import PacketEngine
from tieline.network.packet.tracing import TracingEngine
from tieline.network.spec import NetworkSpec, serialisation_ns

GAP_NS, END_NS, SEED = 40_000_000, 1_000_000_000, 11


def carry(engine: PacketEngine, spec: NetworkSpec) -> dict[tuple[int, int, int], tuple[int, int]]:
    """Return (how, when) of each packet that ended, by source, destination and sequence."""
    sources, found = np.arange(len(spec.sources)), {}
    for sequence, at_ns in enumerate(range(0, END_NS, GAP_NS)):
        outcome = engine.run_until(at_ns)
        engine.send(at_ns, sources, sequence)
        parts = [outcome] if at_ns + GAP_NS < END_NS else [outcome, engine.run_until(END_NS)]
        for part in parts:
            for row in part.arrivals.tolist():
                found[row[1], row[2], row[3]] = (DELIVERED, row[0])
            for row in part.drops.tolist():
                found[row[1], row[2], row[3]] = (row[4], row[0])
    return found


def follow(spec: NetworkSpec, flow: int, sequence: int) -> TracingEngine:
    engine = TracingEngine(spec, SEED, flow, sequence)
    carry(engine, spec)
    return engine


@pytest.mark.parametrize("number", range(30))
def test_every_ending_is_the_one_that_the_engine_states(number: int) -> None:
    """Otherwise the story of a packet would be that of another network."""
    random = Random(number)
    spec = mixed_network(random, END_NS)
    spec = NetworkSpec(**{**vars(spec), "taps": ()}) if spec.taps else spec
    if not spec.flows:
        return
    found = carry(PacketEngine(spec, SEED), spec)
    for _ in range(3):
        flow, sequence = random.randrange(len(spec.flows)), random.randrange(END_NS // GAP_NS)
        fate = follow(spec, flow, sequence).fate
        ends = spec.flows[flow]
        wanted = found.get((ends.source, ends.destination, sequence))
        print(spec.transport, wanted, fate)
        got = None if fate.ended_ns is None or fate.ended_ns > END_NS else (fate.outcome, fate.ended_ns)
        assert got == wanted
