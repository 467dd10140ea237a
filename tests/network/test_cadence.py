"""The outcome depends on the seed alone: not on how time is cut, nor on the compiler."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from network.builders import busy_ring, carried, ring_digest
from tieline.network.engine import LOSS, QUEUE_FULL
from tieline.network.packet import PacketEngine

FRAMES = [(k * 10**9 // 60, k) for k in range(40)]
WHOLE = carried(PacketEngine(busy_ring(), seed=9), FRAMES, [], 2)


# Compilation happens in the first example, so no deadline holds.
@settings(deadline=None, max_examples=40)
@given(st.lists(st.integers(0, 900_000_000), max_size=30).map(sorted))
def test_any_cadence_gives_the_same_outcome(steps):
    """Otherwise a federation that meets more often would simulate another network.

    The instants of measurement themselves are the boundaries of the federation, and are among the
    steps of both runs.
    """
    outcome = carried(PacketEngine(busy_ring(), seed=9), FRAMES, steps, 2)
    assert outcome.arrivals.tobytes() == WHOLE.arrivals.tobytes()
    assert outcome.drops.tobytes() == WHOLE.drops.tobytes()
    assert set(WHOLE.drops["reason"].tolist()) == {QUEUE_FULL, LOSS}


def test_long_cross_traffic_does_not_depend_on_the_steps():
    """Otherwise random numbers would be drawn in another order when a supply runs out on the way.

    Forty seconds take several chunks of every stream.
    """
    whole, stepped = (PacketEngine(busy_ring(), seed=2) for _ in range(2))
    whole.run_until(40 * 10**9)
    for until_ns in range(0, 40 * 10**9 + 1, 16_000_000):
        stepped.run_until(until_ns)
    assert stepped.links() == whole.links()
    assert stepped.counts() == whole.counts()


def test_frames_announced_early_change_nothing():
    """Otherwise a federate that is told its frames ahead of time would get other results."""
    engine = PacketEngine(busy_ring(), seed=9)
    for measured_ns, sequence in FRAMES:
        engine.send(measured_ns, np.arange(2), sequence)
    outcome = engine.run_until(FRAMES[-1][0] + 10**10)
    assert outcome.arrivals.tobytes() == WHOLE.arrivals.tobytes()
    assert outcome.drops.tobytes() == WHOLE.drops.tobytes()


def test_the_same_seed_gives_the_same_outcome_and_another_seed_another():
    """Otherwise an experiment could not be repeated, or its seed would mean nothing."""
    again = carried(PacketEngine(busy_ring(), seed=9), FRAMES, [], 2)
    other = carried(PacketEngine(busy_ring(), seed=10), FRAMES, [], 2)
    assert again.arrivals.tobytes() == WHOLE.arrivals.tobytes()
    assert other.arrivals.tobytes() != WHOLE.arrivals.tobytes()


def test_arrivals_come_in_the_total_order():
    """Otherwise a controller could act on frames in an order that depends on the machine."""
    keys = [
        tuple(int(row[name]) for name in ("arrival_ns", "source", "sequence", "destination"))
        for row in WHOLE.arrivals
    ]
    assert keys == sorted(keys)


def test_the_compiler_changes_nothing():
    """Otherwise the readable program and the fast one would be two different simulators."""
    frames = 8
    script = f"from network.builders import ring_digest; print(ring_digest({frames}))"
    tests = Path(__file__).parents[1]
    environment = os.environ | {"TIELINE_COMPILER": "off", "PYTHONPATH": str(tests)}
    plain = subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert plain.stdout.strip() == ring_digest(frames)
