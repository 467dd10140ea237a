"""Networks that mix every mechanism: nothing is lost count of, and the steps change nothing."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import tieline
from network.mixtures import all_that_happens, mixed_network, mixture_digest
from tieline.network.packet import PacketEngine

END_NS = 800_000_000
RANDOMS = st.randoms(use_true_random=False)


@settings(derandomize=True, max_examples=150)
@given(RANDOMS, st.lists(st.integers(0, END_NS), min_size=1, max_size=20).map(sorted))
def test_any_cadence_gives_the_same_outcome_whatever_happens(random, steps):
    """Otherwise a federation that meets more often would see other failures and repairs.

    `run_until` checks at each step that every packet is accounted for.
    """
    spec = mixed_network(random, END_NS)
    whole, _ = all_that_happens(spec, [], END_NS)
    stepped, _ = all_that_happens(spec, steps, END_NS)
    assert stepped == whole


@settings(derandomize=True, max_examples=150)
@given(RANDOMS, st.lists(st.integers(0, 90_000_000), max_size=15))
def test_every_packet_is_accounted_for_whatever_happens(random, steps):
    """Otherwise packets would vanish at a fork, a cut or a retransmission, or arrive twice."""
    spec = mixed_network(random, END_NS)
    engine = PacketEngine(spec, seed=3)
    sources = np.arange(len(spec.sources))
    seen: set[tuple[int, ...]] = set()
    now_ns = 0
    for sequence, step_ns in enumerate([*steps, 2_000_000_000]):
        engine.send(now_ns, sources, sequence)
        now_ns += step_ns
        outcome = engine.run_until(now_ns)
        engine.counts().check(now_ns)
        for records, time in ((outcome.arrivals, "arrival_ns"), (outcome.drops, "dropped_ns")):
            assert np.all(records[time] <= now_ns)
            names = ("source", "destination", "sequence")
            ended = [tuple(int(row[name]) for name in names) for row in records]
            assert seen.isdisjoint(ended)
            assert len(set(ended)) == len(ended)
            seen.update(ended)
    everything = {(f.source, f.destination, k) for f in spec.flows for k in range(len(steps) + 1)}
    assert seen <= everything
    if spec.transport == "unicast":
        counts, uses = engine.counts(), engine.links()
        assert sum(use.dropped_queue for use in uses) == counts.dropped_queue
        assert sum(use.dropped_loss for use in uses) == counts.dropped_loss
        assert sum(use.dropped_down for use in uses) == counts.dropped_down


def test_the_compiler_changes_nothing_whatever_happens():
    """Otherwise the readable program and the fast one would be two different simulators."""
    seeds = list(range(12))
    script = f"from network.mixtures import mixture_digest; print(mixture_digest({seeds}))"
    tests = Path(__file__).parents[1]
    path = os.pathsep.join([str(tests), str(Path(tieline.__file__).parents[1])])
    environment = os.environ | {"TIELINE_COMPILER": "off", "PYTHONPATH": path}
    plain = subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert plain.stdout.strip() == mixture_digest(seeds)
