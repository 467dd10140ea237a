"""Endless supplies of whole random numbers, one for each random thing of a network."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from tieline.network.jitter import Jitter
from tieline.network.packet.memory import DRAWS_CHUNK
from tieline.network.spec import CrossFlow
from tieline.streams import stream

Chunks = Iterator[NDArray[np.int64]]

NEVER_NS = 1 << 60
"""A gap of 36 years: what follows the last packet of a trace."""


def losses(seed: int, name: str, probability: float) -> Chunks:
    """Yield chunks of 0 (kept) and 1 (lost), independent, 1 with the given probability."""
    generator = stream(seed, name)
    while True:
        yield (generator.random(DRAWS_CHUNK) < probability).astype(np.int64)


def jitters(seed: int, name: str, jitter: Jitter) -> Chunks:
    """Yield chunks of delays of a distribution, in nanoseconds."""
    generator = stream(seed, name)
    while True:
        yield jitter.draw(generator, DRAWS_CHUNK)


def gaps(seed: int, flow: CrossFlow) -> Chunks:
    """Yield chunks of the times between a cross flow's packets, the first counted from zero.

    CBR keeps its mean rate exactly: the instants, not the gaps, are rounded to whole nanoseconds.
    """
    generator = stream(seed, f"arrivals of {flow.name}")
    if flow.kind == "poisson":
        while True:
            exponential = generator.standard_exponential(DRAWS_CHUNK) * flow.gap_ns
            yield np.rint(exponential).astype(np.int64)
    phase = generator.random()
    last_ns = 0
    count = 0
    while True:
        instants = np.rint((phase + count + np.arange(DRAWS_CHUNK)) * flow.gap_ns).astype(np.int64)
        yield np.diff(instants, prepend=last_ns)
        last_ns = int(instants[-1])
        count += DRAWS_CHUNK


def trace_gaps(times_ns: NDArray[np.int64]) -> Chunks:
    """Yield the gaps between given ascending instants, then gaps that never end."""
    all_gaps = np.diff(times_ns, prepend=0)
    for start in range(0, len(all_gaps), DRAWS_CHUNK):
        chunk = np.full(DRAWS_CHUNK, NEVER_NS)
        part = all_gaps[start : start + DRAWS_CHUNK]
        chunk[: len(part)] = part
        yield chunk
    while True:
        yield np.full(DRAWS_CHUNK, NEVER_NS)
